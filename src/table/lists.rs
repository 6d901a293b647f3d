//! The small tables beside the data: errors against references, error bars, and what columns mean.
//!
//! Owns their rows in Arrow's shape. May use `record`, `schema`, `unit`. It deliberately computes
//! no error.

use super::footer::{doc_of, names};
use super::record::{ErrorBarRow, ErrorRow, Norms, Record};
use super::schema::{Column, Kind, Measured};
use super::unit::{ValueUnit, dimension_of, exponent, integrated, si_text, value_unit};
use crate::plan::Plan;
use crate::units::Dimension;
use arrow_array::builder::StringDictionaryBuilder;
use arrow_array::types::UInt16Type;
use arrow_array::{ArrayRef, Float64Array, StringArray, UInt16Array, UInt32Array, UInt64Array};
use arrow_schema::DataType;
use std::sync::Arc;

/// Columns of the errors table, in the order of its schema.
pub fn errors(rows: &[ErrorRow]) -> Vec<ArrayRef> {
    let finite = |value: f64| value.is_finite().then_some(value);
    let norm = |of: fn(&Norms) -> f64| -> ArrayRef {
        Arc::new(rows.iter().map(|row| finite(of(&row.norms))).collect::<Float64Array>())
    };
    let ratio = |of: fn(&Norms) -> f64| -> ArrayRef {
        let value = |row: &ErrorRow| row.relative.as_ref().and_then(|norms| finite(of(norms)));
        Arc::new(rows.iter().map(value).collect::<Float64Array>())
    };
    vec![
        Arc::new(UInt32Array::from_iter_values(rows.iter().map(|row| row.point))),
        Arc::new(UInt32Array::from_iter_values(rows.iter().map(|row| row.replicate))),
        Arc::new(rows.iter().map(|row| row.t).collect::<Float64Array>()),
        words(rows.iter().map(|row| Some(row.reference.as_str()))),
        Arc::new(UInt16Array::from_iter_values(rows.iter().map(|row| row.output))),
        words(rows.iter().map(|row| Some(row.kind.as_str()))),
        words(rows.iter().map(|row| Some(row.species_a.as_str()))),
        words(rows.iter().map(|row| row.species_b.as_deref())),
        Arc::new(UInt64Array::from_iter_values(rows.iter().map(|row| row.n))),
        Arc::new(UInt64Array::from_iter_values(rows.iter().map(|row| row.n_empty))),
        norm(|norms| norms.l1),
        norm(|norms| norms.l2),
        norm(|norms| norms.linf),
        norm(|norms| norms.rmse),
        ratio(|norms| norms.l1),
        ratio(|norms| norms.l2),
        ratio(|norms| norms.linf),
        ratio(|norms| norms.rmse),
        Arc::new(rows.iter().map(|row| row.noise.and_then(finite)).collect::<Float64Array>()),
        words(rows.iter().map(|row| Some(row.unit.as_str()))),
    ]
}

/// Columns of the table of error bars, in the order of its schema.
pub fn error_bars(rows: &[ErrorBarRow]) -> Vec<ArrayRef> {
    let norm = |of: fn(&ErrorBarRow) -> Option<f64>| -> ArrayRef {
        let finite = |row: &ErrorBarRow| of(row).filter(|value| value.is_finite());
        Arc::new(rows.iter().map(finite).collect::<Float64Array>())
    };
    vec![
        Arc::new(UInt32Array::from_iter_values(rows.iter().map(|row| row.point))),
        Arc::new(UInt32Array::from_iter_values(rows.iter().map(|row| row.replicate))),
        Arc::new(rows.iter().map(|row| row.t).collect::<Float64Array>()),
        Arc::new(UInt16Array::from_iter_values(rows.iter().map(|row| row.output))),
        words(rows.iter().map(|row| Some(row.kind.as_str()))),
        words(rows.iter().map(|row| Some(row.species_a.as_str()))),
        words(rows.iter().map(|row| row.species_b.as_deref())),
        words(rows.iter().map(|_| Some("l2"))),
        Arc::new(UInt64Array::from_iter_values(rows.iter().map(|row| row.n))),
        norm(|row| Some(row.size)),
        norm(|row| Some(row.total)),
        norm(|row| Some(row.from_step)),
        norm(|row| Some(row.from_particles)),
        norm(|row| row.from_bins),
        norm(|row| row.relative),
        words(rows.iter().map(|row| Some(row.unit.as_str()))),
    ]
}

/// What the rows of a table of norms are of.
#[derive(Debug, Clone, PartialEq)]
pub struct Compared {
    table: Kind,
    /// Species, or pair as `A, B`.
    species: String,
    kind: String,
    output: u16,
    unit: String,
}

impl From<&ErrorRow> for Compared {
    fn from(row: &ErrorRow) -> Self {
        let species = species_or_pair(&row.species_a, row.species_b.as_deref());
        let (kind, unit) = (row.kind.clone(), row.unit.clone());
        Self { table: Kind::Errors, species, kind, output: row.output, unit }
    }
}

impl From<&ErrorBarRow> for Compared {
    fn from(row: &ErrorBarRow) -> Self {
        let species = species_or_pair(&row.species_a, row.species_b.as_deref());
        let (kind, unit) = (row.kind.clone(), row.unit.clone());
        Self { table: Kind::ErrorBars, species, kind, output: row.output, unit }
    }
}

fn species_or_pair(a: &str, b: Option<&str>) -> String {
    b.map_or_else(|| a.to_owned(), |b| format!("{a}, {b}"))
}

pub(super) fn words<'a>(texts: impl Iterator<Item = Option<&'a str>>) -> ArrayRef {
    let mut builder = StringDictionaryBuilder::<UInt16Type>::new();
    texts.for_each(|text| builder.append_option(text));
    Arc::new(builder.finish())
}

/// A row of `columns.parquet`.
struct Meaning {
    table: String,
    column: String,
    species: Option<String>,
    unit: Option<String>,
    dimension: Option<Dimension>,
    description: String,
}

/// `columns.parquet`: the columns of each table, then a row per species of a value column with the
/// unit and the scene's text for it; for errors a row per kind of table and species that was compared.
pub fn columns(
    tables: &[(String, Vec<Column>)],
    compared: &[Compared],
    plan: &Plan,
    record: &Record,
) -> (Vec<Column>, Vec<ArrayRef>) {
    let rows: Vec<Meaning> = tables
        .iter()
        .flat_map(|(table, columns)| columns.iter().map(move |column| (table, column)))
        .flat_map(|(table, column)| meanings(table, column, compared, plan, record))
        .collect();
    (column_columns(), column_arrays(&rows))
}

fn column_columns() -> Vec<Column> {
    let text = |name: &str, doc: &str| Column::new(name, DataType::Utf8, Measured::Unitless, doc);
    let number = |name: &str, doc: &str| {
        Column::new(name, DataType::Float64, Measured::Fixed(Dimension::NONE), doc).or_null()
    };
    vec![
        text("table", "folder or file of the table"),
        text("column", "name of the column"),
        text("species", "species, or pair as `A, B`, that this row tells of; null for all").or_null(),
        text("unit", "unit of the values; null for names and counts").or_null(),
        number("length", "exponent of m"),
        number("mass", "exponent of kg"),
        number("time", "exponent of s"),
        number("amount", "exponent of mol"),
        number("temperature", "exponent of K"),
        number("current", "exponent of A"),
        number("luminous_intensity", "exponent of cd"),
        text("description", "what the column holds"),
    ]
}

fn column_arrays(rows: &[Meaning]) -> Vec<ArrayRef> {
    let exponents = |k: usize| -> ArrayRef {
        let value = |row: &Meaning| row.dimension.map(|dimension| exponent(dimension.0[k]));
        Arc::new(rows.iter().map(value).collect::<Float64Array>())
    };
    let mut arrays: Vec<ArrayRef> = vec![
        Arc::new(StringArray::from_iter_values(rows.iter().map(|row| &row.table))),
        Arc::new(StringArray::from_iter_values(rows.iter().map(|row| &row.column))),
        Arc::new(rows.iter().map(|row| row.species.as_deref()).collect::<StringArray>()),
        Arc::new(rows.iter().map(|row| row.unit.as_deref()).collect::<StringArray>()),
    ];
    arrays.extend((0..7).map(exponents));
    arrays.push(Arc::new(StringArray::from_iter_values(rows.iter().map(|row| &row.description))));
    arrays
}

fn meanings(
    table: &str,
    column: &Column,
    compared: &[Compared],
    plan: &Plan,
    record: &Record,
) -> Vec<Meaning> {
    let row = |species, unit, dimension, description: &str| Meaning {
        table: table.to_owned(),
        column: column.name.clone(),
        species,
        unit,
        dimension,
        description: description.to_owned(),
    };
    match &column.measured {
        Measured::Unitless => vec![row(None, None, None, &column.doc)],
        Measured::Fixed(dimension) => {
            vec![row(None, Some(column.unit_text(None)), Some(*dimension), &column.doc)]
        }
        Measured::Named(unit) => vec![row(None, Some(unit.clone()), dimension_of(unit), &column.doc)],
        Measured::Row => {
            let mut rows = vec![row(None, Some(column.unit_text(None)), None, &column.doc)];
            for (species, docs, unit) in values_of(table, plan, record) {
                let description = if docs.is_empty() { &column.doc } else { &docs };
                rows.push(row(Some(species), Some(unit.text), Some(unit.dimension), description));
            }
            for (species, kind, dimension) in norms_of(table, &column.name, compared, plan) {
                let description = format!("{}; of {kind}", column.doc);
                rows.push(row(Some(species), Some(si_text(dimension)), Some(dimension), &description));
            }
            rows
        }
    }
}

/// What a column of norms is measured in: species or pair, kind of table and dimension, each once.
fn norms_of(
    table: &str,
    column: &str,
    compared: &[Compared],
    plan: &Plan,
) -> Vec<(String, String, Dimension)> {
    let mut found = Vec::new();
    for row in compared.iter().filter(|row| row.table.name() == table) {
        let Some(field) = dimension_of(&row.unit) else { continue };
        let Some(output) = plan.outputs.get(usize::from(row.output)) else { continue };
        let dimension = match column {
            "l1" => integrated(plan, output.kind, field, 1),
            "linf" | "rmse" => field,
            _ => integrated(plan, output.kind, field, 2),
        };
        let entry = (row.species.clone(), row.kind.clone(), dimension);
        if !found.contains(&entry) {
            found.push(entry);
        }
    }
    found
}

/// What a table holds: species or pair, its texts in the scene, its unit; each once.
fn values_of(table: &str, plan: &Plan, record: &Record) -> Vec<(String, String, ValueUnit)> {
    let mut values = Vec::new();
    for output in plan.outputs.iter().filter(|output| Kind::from(output.kind).name() == table) {
        for quantity in &output.quantities {
            let names = names(plan, *quantity);
            let docs: Vec<&str> = names.iter().filter_map(|name| doc_of(record, name)).collect();
            let value =
                (names.join(", "), docs.join(", "), value_unit(plan, output, *quantity, record.n_axes));
            if !values.contains(&value) {
                values.push(value);
            }
        }
    }
    values
}

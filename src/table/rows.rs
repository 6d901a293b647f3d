//! From a snapshot to rows.
//!
//! Owns the order of rows: by quantity, then by bin or particle. May use `plan` and
//! `engine::snapshot`. It deliberately holds at most one row group at a time.

use super::bins::Grid;
use super::failure::TableError;
use super::schema::{self, Kind};
use super::sheet::{ROW_GROUP, Sheet};
use super::unit::{ValueUnit, si_text, value_dimension, value_unit};
use crate::engine::snapshot::{MixingState, Row, Snapshot, Values, counts};
use crate::plan::station::Rule;
use crate::plan::{Output, OutputKind, Plan, Quantity};
use arrow_array::types::UInt16Type;
use arrow_array::{
    ArrayRef, DictionaryArray, Float64Array, RecordBatch, StringArray, UInt16Array, UInt32Array, UInt64Array,
};
use arrow_schema::SchemaRef;
use std::ops::Range;
use std::sync::Arc;

/// What is the same for all rows of a table.
pub struct Layout {
    kind: Kind,
    pub schema: SchemaRef,
    species: ArrayRef,
    units: ArrayRef,
    /// Per output of the plan and quantity: place in `units`, factor.
    unit_keys: Vec<Vec<(u16, f64)>>,
    /// The unit of the whole table, if there is only one.
    pub row_unit: Option<String>,
    /// Units of amounts, and per species its place there.
    amounts: (ArrayRef, Vec<u16>),
    /// Words of places, and where those of each output begin.
    places: (ArrayRef, Vec<u16>),
}

impl Layout {
    pub fn new(kind: Kind, plan: &Plan, n_axes: usize) -> Self {
        let mut texts: Vec<String> = Vec::new();
        let mut key = |unit: ValueUnit| {
            let place = texts.iter().position(|text| *text == unit.text).unwrap_or_else(|| {
                texts.push(unit.text.clone());
                texts.len() - 1
            });
            (place as u16, unit.factor)
        };
        let mut keys_of = |output: &Output| -> Vec<(u16, f64)> {
            let is_mine = Kind::from(output.kind) == kind;
            let mine = output.quantities.iter().filter(|_| is_mine);
            mine.map(|quantity| key(value_unit(plan, output, *quantity, n_axes))).collect()
        };
        let unit_keys: Vec<_> = plan.outputs.iter().map(&mut keys_of).collect();
        let row_unit = (texts.len() == 1).then(|| texts[0].clone());
        let names = plan.species.iter().map(|species| species.name.as_str());
        Self {
            kind,
            schema: schema::arrow_schema(&schema::columns(kind), row_unit.as_deref()),
            species: Arc::new(StringArray::from_iter_values(names)),
            units: Arc::new(StringArray::from_iter_values(&texts)),
            unit_keys,
            row_unit,
            amounts: amounts(plan, n_axes),
            places: places(kind, plan),
        }
    }
}

/// Units of the amounts of all species.
fn amounts(plan: &Plan, n_axes: usize) -> (ArrayRef, Vec<u16>) {
    let mut texts: Vec<String> = Vec::new();
    let mut keys = Vec::new();
    for idx in 0..plan.species.len() {
        let text = si_text(value_dimension(plan, OutputKind::Total, Quantity::Species(idx), n_axes));
        let place = texts.iter().position(|other| *other == text).unwrap_or_else(|| {
            texts.push(text);
            texts.len() - 1
        });
        keys.push(place as u16);
    }
    (Arc::new(StringArray::from_iter_values(&texts)), keys)
}

/// Words of the places of all outputs of a kind.
fn places(kind: Kind, plan: &Plan) -> (ArrayRef, Vec<u16>) {
    let mut words: Vec<String> = Vec::new();
    let mut firsts = Vec::new();
    for output in &plan.outputs {
        firsts.push(words.len() as u16);
        if Kind::from(output.kind) == kind {
            words.extend(plan.places(output));
        }
    }
    (Arc::new(StringArray::from_iter_values(&words)), firsts)
}

/// Point and replicate that rows belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Place {
    pub point: u32,
    pub replicate: u32,
}

/// Appends all rows of one snapshot.
pub fn append(
    sheet: &mut Sheet,
    layout: &Layout,
    plan: &Plan,
    place: Place,
    snapshot: &Snapshot,
) -> Result<(), TableError> {
    let output = &plan.outputs[snapshot.output_idx];
    check_shape(plan, output, snapshot)?;
    let grid = Grid::new(plan, output);
    for (quantity_idx, quantity) in output.quantities.iter().enumerate() {
        let quantity = *quantity;
        let block = Block { layout, plan, grid: &grid, place, snapshot, quantity_idx, quantity };
        let n = block.n_rows();
        for start in (0..n).step_by(ROW_GROUP) {
            sheet.append(&block.batch(start..n.min(start + ROW_GROUP))?)?;
        }
    }
    Ok(())
}

/// The rows of one quantity at one time.
struct Block<'a> {
    layout: &'a Layout,
    plan: &'a Plan,
    grid: &'a Grid,
    place: Place,
    snapshot: &'a Snapshot,
    quantity_idx: usize,
    quantity: Quantity,
}

impl Block<'_> {
    fn n_rows(&self) -> usize {
        match &self.snapshot.values {
            Values::Binned { mean, .. } => mean[self.quantity_idx].len(),
            Values::Covariance { n_particles, .. } => n_particles.len(),
            Values::Total { .. } | Values::Mixing(_) => 1,
            Values::Particles { concentrations, .. } => concentrations[self.quantity_idx].len(),
            Values::Rows(all) => all[self.quantity_idx].len(),
        }
    }

    /// The columns in the order of the schema.
    fn batch(&self, rows: Range<usize>) -> Result<RecordBatch, TableError> {
        let q = self.quantity_idx;
        let mut columns = self.head(rows.len());
        match &self.snapshot.values {
            Values::Binned { mean, standard_error, n_particles } => {
                columns.extend(self.bin_coordinates(rows.clone()));
                columns.extend(self.names(rows.len()));
                let n_particles = counts(n_particles, mean[q].len(), q);
                let is_known = |row: usize| n_particles[row] > 0 || self.plan.carries_mass();
                columns.push(self.values(&mean[q], rows.clone(), is_known));
                columns.push(self.values(&standard_error[q], rows.clone(), |row| n_particles[row] > 1));
                columns.push(numbers(&n_particles[rows.clone()]));
            }
            Values::Covariance { covariance, n_particles } => {
                columns.extend(self.bin_coordinates(rows.clone()));
                columns.extend(self.names(rows.len()));
                columns.push(self.values(&covariance[q], rows.clone(), |row| n_particles[row] > 1));
                columns.push(numbers(&n_particles[rows.clone()]));
            }
            Values::Total { amount } => {
                columns.extend(self.names(1));
                columns.push(self.values(&amount[q..=q], rows.clone(), |_| true));
            }
            Values::Mixing(states) => {
                columns.extend(self.names(1));
                columns.extend(self.mixing(states[q]));
            }
            Values::Particles { positions, concentrations } => {
                columns.push(Arc::new(UInt64Array::from_iter_values(rows.clone().map(|row| row as u64))));
                columns.extend(self.particle_coordinates(positions, rows.clone()));
                columns.extend(self.names(rows.len()));
                columns.push(self.values(&concentrations[q], rows.clone(), |_| true));
            }
            Values::Rows(all) => columns.extend(self.rows(&all[q][rows.clone()])),
        }
        columns.extend(self.tail(rows.len()));
        RecordBatch::try_new(self.layout.schema.clone(), columns).map_err(|reason| TableError::Format {
            file: self.layout.kind.name().into(),
            reason: reason.to_string(),
        })
    }

    /// Place, species, numbers and the unit of amounts, as in `schema::row_columns`.
    fn rows(&self, rows: &[Row]) -> Vec<ArrayRef> {
        let (kind, output_idx) = (self.plan.outputs[self.snapshot.output_idx].kind, self.snapshot.output_idx);
        let mut columns: Vec<ArrayRef> = Vec::new();
        if kind.has_places() {
            let (words, firsts) = &self.layout.places;
            let keys = UInt16Array::from_iter_values(rows.iter().map(|row| firsts[output_idx] + row.place));
            columns.push(Arc::new(DictionaryArray::<UInt16Type>::new(keys, words.clone())));
        }
        if let Some(station) = &self.plan.outputs[output_idx].station {
            let position = self.plan.position(station);
            columns.extend(
                position.map(|at| -> ArrayRef { Arc::new(Float64Array::from(vec![at; rows.len()])) }),
            );
        }
        columns.extend(self.names(rows.len()));
        let (_, factor) = self.unit();
        for (idx, number) in kind.numbers().iter().enumerate() {
            let values = rows.iter().map(|row| row.numbers[idx]);
            let factor = if number.rule == Rule::Value { factor } else { 1.0 };
            columns.push(match number.rule {
                Rule::Count => Arc::new(UInt64Array::from_iter_values(values.map(|value| value as u64))),
                _ => Arc::new(
                    values.map(|value| value.is_finite().then_some(value / factor)).collect::<Float64Array>(),
                ),
            });
        }
        if schema::has_amounts(kind) {
            let (units, keys) = &self.layout.amounts;
            let (Quantity::Species(species) | Quantity::Pair(species, _)) = self.quantity;
            columns.push(repeated(units, keys[species], rows.len()));
        }
        columns
    }

    fn head(&self, n: usize) -> Vec<ArrayRef> {
        vec![
            Arc::new(UInt32Array::from_value(self.place.point, n)),
            Arc::new(UInt32Array::from_value(self.place.replicate, n)),
            Arc::new(Float64Array::from_value(self.snapshot.t, n)),
        ]
    }

    fn tail(&self, n: usize) -> Vec<ArrayRef> {
        let (unit, _) = self.unit();
        let output = self.snapshot.output_idx as u16;
        vec![repeated(&self.layout.units, unit, n), Arc::new(UInt16Array::from_value(output, n))]
    }

    fn unit(&self) -> (u16, f64) {
        self.layout.unit_keys[self.snapshot.output_idx][self.quantity_idx]
    }

    fn names(&self, n: usize) -> Vec<ArrayRef> {
        let name = |idx: usize| repeated(&self.layout.species, idx as u16, n);
        match self.quantity {
            Quantity::Species(s) => vec![name(s)],
            Quantity::Pair(a, b) => vec![name(a), name(b)],
        }
    }

    /// Values in the unit of the output; null where there is nothing, or nothing finite, to tell.
    fn values(&self, column: &[f64], rows: Range<usize>, is_known: impl Fn(usize) -> bool) -> ArrayRef {
        let (_, factor) = self.unit();
        let value = |row: usize| (is_known(row) && column[row].is_finite()).then(|| column[row] / factor);
        Arc::new(rows.map(value).collect::<Float64Array>())
    }

    fn mixing(&self, state: MixingState) -> Vec<ArrayRef> {
        let (_, factor) = self.unit();
        let cell = |value: f64| -> ArrayRef {
            Arc::new(Float64Array::from(vec![value.is_finite().then_some(value)]))
        };
        vec![
            cell(state.m / factor),
            cell(state.m_mean / factor),
            cell(state.m_cov / factor),
            cell(state.gamma),
        ]
    }

    fn bin_coordinates(&self, rows: Range<usize>) -> Vec<ArrayRef> {
        let column = |axis: usize| -> ArrayRef {
            Arc::new(rows.clone().map(|row| self.grid.coordinate(axis, row)).collect::<Float64Array>())
        };
        (0..3).map(column).collect()
    }

    fn particle_coordinates(&self, positions: &[Vec<f64>], rows: Range<usize>) -> Vec<ArrayRef> {
        let column = |axis: usize| -> ArrayRef {
            match self.plan.axes.iter().position(|active| active.index == axis) {
                Some(place) => {
                    Arc::new(Float64Array::from_iter_values(positions[place][rows.clone()].iter().copied()))
                }
                None => Arc::new(Float64Array::new_null(rows.len())),
            }
        };
        (0..3).map(column).collect()
    }
}

fn numbers(n_particles: &[u64]) -> ArrayRef {
    Arc::new(UInt64Array::from_iter_values(n_particles.iter().copied()))
}

/// One word `n` times.
fn repeated(words: &ArrayRef, key: u16, n: usize) -> ArrayRef {
    let keys = UInt16Array::from_value(key, n);
    Arc::new(DictionaryArray::<UInt16Type>::new(keys, words.clone()))
}

/// Refuses a snapshot whose columns do not fit its output, before any row is written.
fn check_shape(plan: &Plan, output: &Output, snapshot: &Snapshot) -> Result<(), TableError> {
    let is = |what: &'static str, expected: usize, found: usize| {
        if expected == found {
            return Ok(());
        }
        Err(TableError::Shape { output_idx: snapshot.output_idx, what, expected, found })
    };
    let all = |what: &'static str, expected: usize, columns: &[Vec<f64>]| {
        columns.iter().try_for_each(|column| is(what, expected, column.len()))
    };
    let n_quantities = output.quantities.len();
    let n_bins = output.bins.iter().product();
    match &snapshot.values {
        Values::Binned { mean, standard_error, n_particles } => {
            is("quantities", n_quantities, mean.len())?;
            is("quantities", n_quantities, standard_error.len())?;
            let n_counts = if n_particles.len() == n_bins { n_bins } else { n_bins * n_quantities };
            is("bins", n_counts, n_particles.len())?;
            all("bins", n_bins, mean)?;
            all("bins", n_bins, standard_error)
        }
        Values::Covariance { covariance, n_particles } => {
            is("quantities", n_quantities, covariance.len())?;
            is("bins", n_bins, n_particles.len())?;
            all("bins", n_bins, covariance)
        }
        Values::Total { amount } => is("quantities", n_quantities, amount.len()),
        Values::Mixing(states) => is("quantities", n_quantities, states.len()),
        Values::Particles { positions, concentrations } => {
            is("axes", plan.axes.len(), positions.len())?;
            is("quantities", n_quantities, concentrations.len())?;
            let n = concentrations.first().map_or(0, Vec::len);
            all("particles", n, concentrations)?;
            all("particles", n, positions)
        }
        Values::Rows(rows) => {
            is("quantities", n_quantities, rows.len())?;
            let n_numbers = output.kind.numbers().len();
            let n_places = plan.places(output).len().max(1);
            rows.iter().flatten().try_for_each(|row| {
                is("numbers", n_numbers, row.numbers.len())?;
                is("places", n_places, n_places.max(usize::from(row.place) + 1))
            })
        }
    }
}

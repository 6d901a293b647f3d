//! The columns of every table: one schema per kind, the same for all scenes.
//!
//! Owns names, types and descriptions. May use `units` and `plan`. It deliberately holds no rows.

use super::unit::si_text;
use crate::plan::OutputKind;
use crate::plan::station::{Rule, number_dimension};
use crate::units::Dimension;
use arrow_schema::{DataType, Field, Schema};
use std::collections::HashMap;
use std::sync::Arc;

/// A folder of a run, each with one schema.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    Profile,
    Map,
    Covariance,
    Total,
    Mixing,
    Particles,
    Breakthrough,
    FirstPassage,
    Moments,
    Dilution,
    Budget,
    Density,
    Kernels,
    Errors,
    ErrorBars,
    Flow,
}

impl Kind {
    pub const ALL: [Self; 16] = [
        Self::Profile,
        Self::Map,
        Self::Covariance,
        Self::Total,
        Self::Mixing,
        Self::Particles,
        Self::Breakthrough,
        Self::FirstPassage,
        Self::Moments,
        Self::Dilution,
        Self::Budget,
        Self::Density,
        Self::Kernels,
        Self::Errors,
        Self::ErrorBars,
        Self::Flow,
    ];

    /// Name of the folder.
    pub fn name(self) -> &'static str {
        match self {
            Self::Profile => "profile",
            Self::Map => "map",
            Self::Covariance => "covariance",
            Self::Total => "total",
            Self::Mixing => "mixing",
            Self::Particles => "particles",
            Self::Breakthrough => "breakthrough",
            Self::FirstPassage => "first_passage",
            Self::Moments => "moments",
            Self::Dilution => "dilution",
            Self::Budget => "budget",
            Self::Density => "density",
            Self::Kernels => "kernels",
            Self::Errors => "errors",
            Self::ErrorBars => "error_bars",
            Self::Flow => "flow",
        }
    }
}

impl From<OutputKind> for Kind {
    fn from(kind: OutputKind) -> Self {
        match kind {
            OutputKind::Profile => Self::Profile,
            OutputKind::Map => Self::Map,
            OutputKind::Covariance => Self::Covariance,
            OutputKind::Total => Self::Total,
            OutputKind::Mixing => Self::Mixing,
            OutputKind::Particles => Self::Particles,
            OutputKind::Breakthrough => Self::Breakthrough,
            OutputKind::FirstPassage => Self::FirstPassage,
            OutputKind::Moments => Self::Moments,
            OutputKind::Dilution => Self::Dilution,
            OutputKind::Budget => Self::Budget,
            OutputKind::Density => Self::Density,
            OutputKind::Kernels => Self::Kernels,
        }
    }
}

/// What a column's numbers are measured in.
#[derive(Debug, Clone, PartialEq)]
pub enum Measured {
    /// Counts, names, keys.
    Unitless,
    Fixed(Dimension),
    /// A unit outside the base units: `byte`.
    Named(String),
    /// The unit of the output: one for the table, or row by row in column `unit`.
    Row,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    pub name: String,
    pub shape: DataType,
    pub is_nullable: bool,
    pub measured: Measured,
    pub doc: String,
}

/// What field metadata says where the unit differs between rows.
pub const BY_ROW: &str = "see column unit";
/// The same for amounts.
const BY_AMOUNT: &str = "see column amount_unit";

impl Column {
    pub fn new(name: &str, shape: DataType, measured: Measured, doc: &str) -> Self {
        Self { name: name.to_owned(), shape, is_nullable: false, measured, doc: doc.to_owned() }
    }

    pub fn or_null(mut self) -> Self {
        self.is_nullable = true;
        self
    }

    /// The unit as text, given the table's row unit if there is only one; empty for names and counts.
    pub fn unit_text(&self, row_unit: Option<&str>) -> String {
        match &self.measured {
            Measured::Unitless => String::new(),
            Measured::Fixed(dimension) => si_text(*dimension),
            Measured::Named(text) => text.clone(),
            Measured::Row => row_unit.unwrap_or(BY_ROW).to_owned(),
        }
    }
}

/// Names are stored once and pointed at.
pub fn word() -> DataType {
    DataType::Dictionary(Box::new(DataType::UInt16), Box::new(DataType::Utf8))
}

/// Columns of a table kind, in order.
pub fn columns(kind: Kind) -> Vec<Column> {
    let mut columns = head().to_vec();
    match kind {
        Kind::Profile | Kind::Map => {
            columns.extend(coordinates());
            columns.push(species());
            columns
                .push(concentration("mean concentration of the particles in the bin; null if it is empty"));
            columns.push(row_value(
                "standard_error",
                "standard error of the mean over the particles of the bin; null for fewer than two",
            ));
            columns.push(n_particles());
        }
        Kind::Covariance => {
            columns.extend(coordinates());
            columns.extend(pair());
            columns.push(row_value(
                "covariance",
                "covariance of the unreacted concentrations of the particles in the bin, times n/(n-1)",
            ));
            columns.push(n_particles());
        }
        Kind::Total => {
            columns.push(species());
            columns.push(row_value(
                "amount",
                "amount of all particles, those outside of open sides included: sum of volume times concentration",
            ));
        }
        Kind::Mixing => {
            columns.extend(pair());
            columns.push(row_value("m", "integral of the mean product of the unreacted concentrations"));
            columns.push(row_value("m_mean", "integral of the product of the mean unreacted concentrations"));
            columns.push(row_value("m_cov", "integral of the covariance of the unreacted concentrations"));
            columns.push(
                Column::new("gamma", DataType::Float64, Measured::Fixed(Dimension::NONE), "m_cov / m_mean")
                    .or_null(),
            );
        }
        Kind::Particles => {
            columns.push(plain("particle", DataType::UInt64, "number of the particle, from 0"));
            columns.extend(coordinates());
            columns.push(species());
            columns.push(concentration("concentration of the particle"));
        }
        Kind::Breakthrough => columns.extend(row_columns(OutputKind::Breakthrough)),
        Kind::FirstPassage => columns.extend(row_columns(OutputKind::FirstPassage)),
        Kind::Moments => columns.extend(row_columns(OutputKind::Moments)),
        Kind::Dilution => columns.extend(row_columns(OutputKind::Dilution)),
        Kind::Budget => columns.extend(row_columns(OutputKind::Budget)),
        Kind::Density => columns.extend(row_columns(OutputKind::Density)),
        Kind::Kernels => columns.extend(row_columns(OutputKind::Kernels)),
        Kind::Errors => return error_columns(),
        Kind::ErrorBars => return error_bar_columns(),
        Kind::Flow => return super::cells::columns(),
    }
    columns.push(plain("unit", word(), "unit of the values of this row"));
    columns.push(plain("output", DataType::UInt16, "number of the output in the plan, from 0"));
    columns
}

/// Columns of an output in rows: where, of what, its numbers, the unit of amounts.
fn row_columns(kind: OutputKind) -> Vec<Column> {
    let mut columns = Vec::new();
    if kind.has_station() {
        columns.push(plain(
            "place",
            word(),
            "plane, box, the name of a side or a well, or `part of` the first",
        ));
        columns.extend(["x", "y", "z"].map(|name| {
            let doc = "where the plane or the side is, or the centre of the box, the part or the well; null along other axes";
            Column::new(name, DataType::Float64, Measured::Fixed(Dimension::LENGTH), doc).or_null()
        }));
    } else if kind.has_places() {
        let doc =
            "`initial`, the name of a source or a side; `inside` is what is there, `defect` what is missing";
        columns.push(plain("place", word(), doc));
    }
    columns.push(species());
    columns.extend(kind.numbers().iter().map(|number| match number.rule {
        Rule::Value => row_value(number.name, number.doc),
        Rule::Count => plain(number.name, DataType::UInt64, number.doc),
        rule => {
            let measured = match rule {
                Rule::Amount => Measured::Named(BY_AMOUNT.to_owned()),
                Rule::Rate => Measured::Named(format!("{BY_AMOUNT}, per s")),
                rule => Measured::Fixed(number_dimension(rule, Dimension::NONE, Dimension::NONE)),
            };
            Column::new(number.name, DataType::Float64, measured, number.doc).or_null()
        }
    }));
    if has_amounts(kind) {
        columns.push(plain("amount_unit", word(), "SI unit of amounts in this row; rates are that per s"));
    }
    columns
}

/// Whether rows have amounts or rates beside values in the unit of the output.
pub fn has_amounts(kind: OutputKind) -> bool {
    kind.numbers().iter().any(|number| matches!(number.rule, Rule::Amount | Rule::Rate))
}

fn error_columns() -> Vec<Column> {
    let norm = |name: &str, doc: &str| Column::new(name, DataType::Float64, Measured::Row, doc).or_null();
    let ratio = |name: &str, doc: &str| {
        Column::new(name, DataType::Float64, Measured::Fixed(Dimension::NONE), doc).or_null()
    };
    let [point, replicate, t] = head();
    let t = Column { doc: "time; null is all times of the output together".to_owned(), ..t.or_null() };
    vec![
        point,
        replicate,
        t,
        plain("reference", word(), "name of the reference"),
        plain("output", DataType::UInt16, "number of the output in the plan, from 0"),
        plain("kind", word(), "table of the compared values"),
        plain("species_a", word(), "species, or the first of a pair"),
        plain("species_b", word(), "the second species of a pair").or_null(),
        plain("n", DataType::UInt64, "values compared: bins that are not empty, times"),
        plain("n_empty", DataType::UInt64, "bins left out because they hold no particle"),
        norm("l1", "integral of |result - reference|: unit times m per axis"),
        norm("l2", "root of the integral of (result - reference)^2: unit times m^(1/2) per axis"),
        norm("linf", "largest |result - reference|"),
        norm("rmse", "root of the mean of (result - reference)^2"),
        ratio("relative_l1", "l1 / l1 of the reference"),
        ratio("relative_l2", "l2 / l2 of the reference"),
        ratio("relative_linf", "linf / linf of the reference"),
        ratio("relative_rmse", "rmse / root mean square of the reference"),
        norm("noise", "l2 that sampling noise alone would give: unit times m^(1/2) per axis"),
        plain("unit", word(), "SI unit of the compared values"),
    ]
}

fn error_bar_columns() -> Vec<Column> {
    let norm = |name: &str, doc: &str| Column::new(name, DataType::Float64, Measured::Row, doc).or_null();
    let [point, replicate, t] = head();
    let t = Column { doc: "time; null is all times of the output together".to_owned(), ..t.or_null() };
    vec![
        point,
        replicate,
        t,
        plain("output", DataType::UInt16, "number of the output in the plan, from 0"),
        plain("kind", word(), "table of the values"),
        plain("species_a", word(), "species, or the first of a pair"),
        plain("species_b", word(), "the second species of a pair").or_null(),
        plain("norm", word(), "norm of the other columns: l2, over bins or times, as in table errors"),
        plain(
            "n",
            DataType::UInt64,
            "values that the bar is estimated from: bins that no trial left empty, times",
        ),
        norm("size", "norm of the result"),
        norm("total", "expected norm of result - truth"),
        norm("from_step", "the part that falls in proportion to the step"),
        norm("from_particles", "sampling noise, and the bias of few particles per bin"),
        norm(
            "from_bins",
            "the part that falls with the square of the width of bins; null if it was not tried",
        ),
        Column::new("relative", DataType::Float64, Measured::Fixed(Dimension::NONE), "total / size")
            .or_null(),
        plain("unit", word(), "SI unit of the values; the norm is in unit times m^(1/2) per axis"),
    ]
}

fn plain(name: &str, shape: DataType, doc: &str) -> Column {
    Column::new(name, shape, Measured::Unitless, doc)
}

fn row_value(name: &str, doc: &str) -> Column {
    Column::new(name, DataType::Float64, Measured::Row, doc).or_null()
}

pub(super) fn head() -> [Column; 3] {
    [
        plain("point", DataType::UInt32, "number of the point of the sweep, 0 for a single run"),
        plain("replicate", DataType::UInt32, "number of the replicate, from 0"),
        Column::new("t", DataType::Float64, Measured::Fixed(Dimension::TIME), "time"),
    ]
}

pub(super) fn coordinates() -> [Column; 3] {
    ["x", "y", "z"].map(|name| {
        let doc = "position in the (moving) frame, of a bin its centre; null if the output has no such axis";
        Column::new(name, DataType::Float64, Measured::Fixed(Dimension::LENGTH), doc).or_null()
    })
}

fn species() -> Column {
    plain("species", word(), "name of the species in the scene")
}

fn pair() -> [Column; 2] {
    [
        plain("species_a", word(), "first species of the pair"),
        plain("species_b", word(), "second species of the pair"),
    ]
}

fn concentration(doc: &str) -> Column {
    row_value("concentration", doc)
}

fn n_particles() -> Column {
    plain("n_particles", DataType::UInt64, "particles in the bin")
}

/// The Arrow schema; unit and description travel with each field.
pub fn arrow_schema(columns: &[Column], row_unit: Option<&str>) -> Arc<Schema> {
    let field = |column: &Column| {
        let unit = column.unit_text(row_unit);
        let metadata: HashMap<String, String> = [("unit", unit), ("doc", column.doc.clone())]
            .into_iter()
            .filter(|(_, text)| !text.is_empty())
            .map(|(key, text)| (key.to_owned(), text))
            .collect();
        Field::new(&column.name, column.shape.clone(), column.is_nullable).with_metadata(metadata)
    };
    Arc::new(Schema::new(columns.iter().map(field).collect::<Vec<_>>()))
}

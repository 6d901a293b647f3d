//! `points.parquet`: a row per point and replicate, with everything that data tables must not hold.
//!
//! Owns its columns. May use `record` and `schema`. It deliberately measures nothing.

use super::record::{PointRow, Swept, SweptValue};
use super::schema::{Column, Measured};
use crate::units::Dimension;
use arrow_array::{
    ArrayRef, Float64Array, Int64Array, StringArray, TimestampMicrosecondArray, UInt32Array, UInt64Array,
};
use arrow_schema::{DataType, TimeUnit};
use std::sync::Arc;

/// The columns that the scene names: those of any row, in the order in which they first appear. A table
/// that is written in parts has them from a first look at all rows.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Shape {
    swept: Vec<Swept>,
    values: Vec<(String, String)>,
}

impl Shape {
    pub fn of<'a>(rows: impl IntoIterator<Item = &'a PointRow>) -> Self {
        let mut shape = Self::default();
        rows.into_iter().for_each(|row| shape.add(row));
        shape
    }

    pub fn add(&mut self, row: &PointRow) {
        for swept in &row.swept {
            if !self.swept.iter().any(|known| known.name == swept.name) {
                self.swept.push(swept.clone());
            }
        }
        for value in &row.values {
            if !self.values.iter().any(|(name, _)| *name == value.name) {
                self.values.push((value.name.clone(), value.unit.clone()));
            }
        }
    }
}

impl Shape {
    /// What the column of a swept value is called.
    pub fn column_of(&self, name: &str) -> String {
        let columns = table(self, &[]).0;
        let long = format!("swept.{name}");
        let has_long = columns.iter().any(|column| column.name == long);
        if has_long { long } else { name.to_owned() }
    }
}

/// Columns and their values, for any number of points.
pub fn table(shape: &Shape, rows: &[PointRow]) -> (Vec<Column>, Vec<ArrayRef>) {
    let mut table = Table { columns: Vec::new(), arrays: Vec::new(), shape, rows };
    table.identity();
    table.swept();
    table.outcome();
    table.cost();
    table.values();
    table.circumstances();
    (table.columns, table.arrays)
}

struct Table<'a> {
    columns: Vec<Column>,
    arrays: Vec<ArrayRef>,
    shape: &'a Shape,
    rows: &'a [PointRow],
}

impl Table<'_> {
    fn push(&mut self, column: Column, array: ArrayRef) {
        self.columns.push(column);
        self.arrays.push(array);
    }

    fn text(&mut self, name: &str, doc: &str, value: impl Fn(&PointRow) -> Option<&str>) {
        let array: StringArray = self.rows.iter().map(value).collect();
        self.push(Column::new(name, DataType::Utf8, Measured::Unitless, doc).or_null(), Arc::new(array));
    }

    fn count32(&mut self, name: &str, doc: &str, value: impl Fn(&PointRow) -> u32) {
        let array = UInt32Array::from_iter_values(self.rows.iter().map(value));
        self.push(Column::new(name, DataType::UInt32, Measured::Unitless, doc), Arc::new(array));
    }

    fn count64(
        &mut self,
        name: &str,
        measured: Measured,
        doc: &str,
        value: impl Fn(&PointRow) -> Option<u64>,
    ) {
        let array: UInt64Array = self.rows.iter().map(value).collect();
        self.push(Column::new(name, DataType::UInt64, measured, doc).or_null(), Arc::new(array));
    }

    /// A number; null where it is not finite.
    fn real(&mut self, name: &str, measured: Measured, doc: &str, value: impl Fn(&PointRow) -> Option<f64>) {
        let finite = |row: &PointRow| value(row).filter(|number| number.is_finite());
        let array: Float64Array = self.rows.iter().map(finite).collect();
        self.push(Column::new(name, DataType::Float64, measured, doc).or_null(), Arc::new(array));
    }

    fn seconds(&mut self, name: &str, doc: &str, value: impl Fn(&PointRow) -> Option<f64>) {
        self.real(name, Measured::Fixed(Dimension::TIME), doc, value);
    }

    fn moment(&mut self, name: &str, doc: &str, value: impl Fn(&PointRow) -> i64) {
        let array = TimestampMicrosecondArray::from_iter_values(self.rows.iter().map(value));
        let shape = DataType::Timestamp(TimeUnit::Microsecond, None);
        self.push(Column::new(name, shape, Measured::Named("UTC".to_owned()), doc), Arc::new(array));
    }

    fn identity(&mut self) {
        self.count32("point", "number of the point of the sweep, 0 for a single run", |row| row.point);
        self.count32("replicate", "number of the replicate, from 0", |row| row.replicate);
        self.text("key", "hash of the plan", |row| Some(&row.key));
    }

    /// The names a column may still have: readers such as DuckDB do not tell upper from lower case.
    fn free_name(&self, name: &str, prefix: &str) -> String {
        let is_taken = |name: &str| {
            RESERVED.contains(&name)
                || self.columns.iter().any(|column| column.name.eq_ignore_ascii_case(name))
        };
        let mut free = name.to_owned();
        while is_taken(&free) {
            free = format!("{prefix}.{free}");
        }
        free
    }

    fn swept(&mut self) {
        for swept in &self.shape.swept {
            let value = |row: &PointRow| {
                row.swept.iter().find(|own| own.name == swept.name).map(|own| own.value.clone())
            };
            let name = self.free_name(&swept.name, "swept");
            match &swept.value {
                SweptValue::Real(_, unit) => {
                    let unit = Measured::Named(unit.clone());
                    self.real(&name, unit, "swept value", |row| match value(row) {
                        Some(SweptValue::Real(number, _)) => Some(number),
                        _ => None,
                    });
                }
                SweptValue::Integer(_) => {
                    let number = |row: &PointRow| match value(row) {
                        Some(SweptValue::Integer(number)) => Some(number),
                        _ => None,
                    };
                    let array: Int64Array = self.rows.iter().map(number).collect();
                    let column = Column::new(&name, DataType::Int64, Measured::Unitless, "swept value");
                    self.push(column.or_null(), Arc::new(array));
                }
                SweptValue::Text(_) => {
                    let text = |row: &PointRow| match value(row) {
                        Some(SweptValue::Text(text)) => Some(text),
                        _ => None,
                    };
                    let array: StringArray = self.rows.iter().map(text).collect();
                    let column = Column::new(&name, DataType::Utf8, Measured::Unitless, "swept value");
                    self.push(column.or_null(), Arc::new(array));
                }
            }
        }
    }

    fn outcome(&mut self) {
        self.count64("seed", Measured::Unitless, "root of all random streams", |row| Some(row.seed));
        self.text("status", "done, failed or interrupted", |row| Some(row.status.text()));
        self.text("error_code", "code of the message if the point failed", |row| row.error_code.as_deref());
        self.text("error_message", "the message if the point failed", |row| row.error_message.as_deref());
    }

    fn cost(&mut self) {
        let bytes = || Measured::Named("byte".to_owned());
        self.seconds("wall", "wall time of the engine", |row| Some(row.wall));
        self.seconds("cpu", "CPU time of the engine over all threads", |row| Some(row.cpu));
        self.seconds("loop_wall", "wall time of the step loop alone", |row| Some(row.loop_wall));
        self.seconds("compile_wall", "wall time from text to plan", |row| Some(row.compile_wall));
        self.seconds("write_wall", "wall time of writing the data tables", |row| row.write_wall);
        self.count64("peak_memory", bytes(), "largest resident memory of the process", |row| row.peak_memory);
        self.count64("particles", Measured::Unitless, "number of particles", |row| Some(row.particles));
        self.seconds("step", "time step", |row| Some(row.step));
        self.seconds("duration", "simulated time", |row| Some(row.duration));
        self.count64("steps", Measured::Unitless, "number of steps", |row| Some(row.steps));
        let doc =
            "accepted sub-steps of the integrator, all particles together; null if nothing is integrated";
        self.count64("sub_steps", Measured::Unitless, doc, |row| row.sub_steps);
        let product = |row: &PointRow| row.particles.checked_mul(row.steps);
        self.count64("particle_steps", Measured::Unitless, "particles times steps", product);
        let ratio = Measured::Fixed(Dimension::NONE);
        self.real("mass_defect", ratio, "largest relative mass defect of any component", |row| {
            row.mass_defect
        });
    }

    /// Measures and errors: the union over the points, in the order they first appear.
    fn values(&mut self) {
        for (name, unit) in &self.shape.values {
            let free = self.free_name(name, "measure");
            let of = |row: &PointRow| row.values.iter().find(|value| value.name == *name)?.value;
            self.real(&free, Measured::Named(unit.to_owned()), "measure, or error against a reference", of);
        }
    }

    fn circumstances(&mut self) {
        self.text("version", "version of Lamella", |row| Some(&row.version));
        self.count32("numerics", "version of the numerics", |row| row.numerics);
        self.text("host", "name of the machine", |row| Some(&row.host));
        self.count32("threads", "threads of the engine", |row| row.threads);
        self.moment("started", "when the run began", |row| row.started);
        self.moment("finished", "when the engine was done", |row| row.finished);
    }
}

/// Columns that come after the ones a user names.
const RESERVED: [&str; 23] = [
    "seed",
    "status",
    "error_code",
    "error_message",
    "wall",
    "cpu",
    "loop_wall",
    "compile_wall",
    "write_wall",
    "peak_memory",
    "particles",
    "step",
    "duration",
    "steps",
    "sub_steps",
    "particle_steps",
    "mass_defect",
    "version",
    "numerics",
    "host",
    "threads",
    "started",
    "finished",
];

/// Names of the columns that every `points.parquet` has; all others were named by the scene.
pub fn is_fixed(name: &str) -> bool {
    RESERVED.contains(&name) || ["point", "replicate", "key"].contains(&name)
}

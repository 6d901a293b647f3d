//! Tables of this crate back into plain rows.
//!
//! Owns what later stages read: footers, points, errors, profiles. May use `record` and `footer`.
//! It deliberately reads no file that lacks a whole footer of a version it knows.

use super::failure::TableError;
use super::footer::{Footer, KEY, VERSION};
use super::points::is_fixed;
use super::record::{ErrorRow, Norms, Status, Value};
use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, TimestampMicrosecondType, UInt16Type, UInt32Type, UInt64Type};
use arrow_array::{Array, RecordBatch};
use parquet::arrow::arrow_reader::{
    ArrowReaderMetadata, ArrowReaderOptions, ParquetRecordBatchReaderBuilder,
};
use std::fs::File;
use std::path::Path;

/// True if the file was finished by Lamella: its footer is there, known and tells of a plan. Size
/// and age of the file do not matter.
pub fn is_complete(path: &Path) -> bool {
    footer(path).is_ok()
}

/// The footer of any table.
pub fn footer(path: &Path) -> Result<Footer, TableError> {
    let (_, metadata) = open(path)?;
    let foreign = |reason: String| TableError::Foreign { file: path.to_path_buf(), reason };
    let pairs = metadata.metadata().file_metadata().key_value_metadata();
    let text = pairs
        .into_iter()
        .flatten()
        .find(|pair| pair.key == KEY)
        .and_then(|pair| pair.value.as_deref())
        .ok_or_else(|| foreign(format!("it has no footer `{KEY}`")))?;
    let footer: Footer = serde_json::from_str(text).map_err(|reason| foreign(reason.to_string()))?;
    if footer.version == VERSION {
        Ok(footer)
    } else {
        Err(foreign(format!("its footer has version {}, this program reads {VERSION}", footer.version)))
    }
}

/// A row of `points.parquet` as a report needs it.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    pub point: u32,
    pub replicate: u32,
    pub key: String,
    pub seed: u64,
    pub status: Status,
    pub error_code: Option<String>,
    pub error_message: Option<String>,
    pub wall: f64,
    pub cpu: f64,
    pub particles: u64,
    pub step: f64,
    pub steps: u64,
    pub mass_defect: Option<f64>,
    /// Microseconds since 1970, UTC.
    pub started: i64,
    /// All numeric columns that the scene named: swept values, measures, errors.
    pub values: Vec<Value>,
}

/// All points, in the order of the file.
pub fn points(path: &Path) -> Result<Vec<Point>, TableError> {
    let mut points = Vec::new();
    for batch in batches(path)? {
        let table = Table { batch: batch?, path };
        for row in 0..table.batch.num_rows() {
            points.push(point(&table, row)?);
        }
    }
    Ok(points)
}

fn point(table: &Table, row: usize) -> Result<Point, TableError> {
    let status = table.text("status", row)?.unwrap_or_default();
    Ok(Point {
        point: table.u32("point", row)?,
        replicate: table.u32("replicate", row)?,
        key: table.text("key", row)?.unwrap_or_default(),
        seed: table.u64("seed", row)?,
        status: Status::from_text(&status).ok_or_else(|| table.lacks("status"))?,
        error_code: table.text("error_code", row)?,
        error_message: table.text("error_message", row)?,
        wall: table.real("wall", row)?.unwrap_or(f64::NAN),
        cpu: table.real("cpu", row)?.unwrap_or(f64::NAN),
        particles: table.u64("particles", row)?,
        step: table.real("step", row)?.unwrap_or(f64::NAN),
        steps: table.u64("steps", row)?,
        mass_defect: table.real("mass_defect", row)?,
        started: table.moment("started", row)?,
        values: table.named_values(row),
    })
}

/// A row of a profile or map.
#[derive(Debug, Clone, PartialEq)]
pub struct ProfileRow {
    pub point: u32,
    pub replicate: u32,
    pub t: f64,
    /// x, y, z where the output has them.
    pub position: [Option<f64>; 3],
    pub species: String,
    pub concentration: Option<f64>,
    pub standard_error: Option<f64>,
    pub n_particles: u64,
    pub unit: String,
    pub output: u16,
}

/// All rows of one file of `profile` or `map`.
pub fn profile(path: &Path) -> Result<Vec<ProfileRow>, TableError> {
    let mut rows = Vec::new();
    for batch in batches(path)? {
        let table = Table { batch: batch?, path };
        for row in 0..table.batch.num_rows() {
            rows.push(ProfileRow {
                point: table.u32("point", row)?,
                replicate: table.u32("replicate", row)?,
                t: table.real("t", row)?.unwrap_or(f64::NAN),
                position: [table.real("x", row)?, table.real("y", row)?, table.real("z", row)?],
                species: table.word("species", row)?.unwrap_or_default(),
                concentration: table.real("concentration", row)?,
                standard_error: table.real("standard_error", row)?,
                n_particles: table.u64("n_particles", row)?,
                unit: table.word("unit", row)?.unwrap_or_default(),
                output: table.u16("output", row)?,
            });
        }
    }
    Ok(rows)
}

/// All rows of one file of `errors`.
pub fn errors(path: &Path) -> Result<Vec<ErrorRow>, TableError> {
    let mut rows = Vec::new();
    for batch in batches(path)? {
        let table = Table { batch: batch?, path };
        for row in 0..table.batch.num_rows() {
            rows.push(ErrorRow {
                point: table.u32("point", row)?,
                replicate: table.u32("replicate", row)?,
                t: table.real("t", row)?,
                reference: table.word("reference", row)?.unwrap_or_default(),
                output: table.u16("output", row)?,
                kind: table.word("kind", row)?.unwrap_or_default(),
                species_a: table.word("species_a", row)?.unwrap_or_default(),
                species_b: table.word("species_b", row)?,
                n: table.u64("n", row)?,
                n_empty: table.u64("n_empty", row)?,
                norms: norms(&table, "", row)?.unwrap_or(Norms {
                    l1: f64::NAN,
                    l2: f64::NAN,
                    linf: f64::NAN,
                    rmse: f64::NAN,
                }),
                relative: norms(&table, "relative_", row)?,
                noise: table.real("noise", row)?,
                unit: table.word("unit", row)?.unwrap_or_default(),
            });
        }
    }
    Ok(rows)
}

/// The four norms; absent if all four are.
fn norms(table: &Table, prefix: &str, row: usize) -> Result<Option<Norms>, TableError> {
    let one = |name: &str| table.real(&format!("{prefix}{name}"), row);
    let all = [one("l1")?, one("l2")?, one("linf")?, one("rmse")?];
    if all.iter().all(Option::is_none) {
        return Ok(None);
    }
    let [l1, l2, linf, rmse] = all.map(|value| value.unwrap_or(f64::NAN));
    Ok(Some(Norms { l1, l2, linf, rmse }))
}

pub(super) fn open(path: &Path) -> Result<(File, ArrowReaderMetadata), TableError> {
    let file = File::open(path).map_err(|reason| TableError::system(path, "read", reason, 0))?;
    let metadata = ArrowReaderMetadata::load(&file, ArrowReaderOptions::new())
        .map_err(|reason| TableError::parquet(path, reason, 0))?;
    Ok((file, metadata))
}

/// The rows of a file that is complete.
fn batches(path: &Path) -> Result<impl Iterator<Item = Result<RecordBatch, TableError>>, TableError> {
    footer(path)?;
    let (file, metadata) = open(path)?;
    let reader = ParquetRecordBatchReaderBuilder::new_with_metadata(file, metadata)
        .build()
        .map_err(|reason| TableError::parquet(path, reason, 0))?;
    let path = path.to_path_buf();
    Ok(reader.map(move |batch| {
        batch.map_err(|reason| TableError::Format { file: path.clone(), reason: reason.to_string() })
    }))
}

/// Columns by name, each access checked: a file may come from anywhere.
struct Table<'a> {
    batch: RecordBatch,
    path: &'a Path,
}

impl Table<'_> {
    fn lacks(&self, column: &str) -> TableError {
        let reason = format!("column `{column}` is missing or of another type");
        TableError::Foreign { file: self.path.to_path_buf(), reason }
    }

    fn column(&self, name: &str) -> Result<&dyn Array, TableError> {
        self.batch.column_by_name(name).map(|column| column.as_ref()).ok_or_else(|| self.lacks(name))
    }

    fn real(&self, name: &str, row: usize) -> Result<Option<f64>, TableError> {
        let column = self.column(name)?.as_primitive_opt::<Float64Type>().ok_or_else(|| self.lacks(name))?;
        Ok(column.is_valid(row).then(|| column.value(row)))
    }

    fn u16(&self, name: &str, row: usize) -> Result<u16, TableError> {
        let column = self.column(name)?.as_primitive_opt::<UInt16Type>().ok_or_else(|| self.lacks(name))?;
        Ok(column.value(row))
    }

    fn u32(&self, name: &str, row: usize) -> Result<u32, TableError> {
        let column = self.column(name)?.as_primitive_opt::<UInt32Type>().ok_or_else(|| self.lacks(name))?;
        Ok(column.value(row))
    }

    fn u64(&self, name: &str, row: usize) -> Result<u64, TableError> {
        let column = self.column(name)?.as_primitive_opt::<UInt64Type>().ok_or_else(|| self.lacks(name))?;
        Ok(column.value(row))
    }

    fn moment(&self, name: &str, row: usize) -> Result<i64, TableError> {
        let column = self.column(name)?.as_primitive_opt::<TimestampMicrosecondType>();
        Ok(column.ok_or_else(|| self.lacks(name))?.value(row))
    }

    fn text(&self, name: &str, row: usize) -> Result<Option<String>, TableError> {
        let column = self.column(name)?.as_string_opt::<i32>().ok_or_else(|| self.lacks(name))?;
        Ok(column.is_valid(row).then(|| column.value(row).to_owned()))
    }

    fn word(&self, name: &str, row: usize) -> Result<Option<String>, TableError> {
        let column = self.column(name)?.as_dictionary_opt::<UInt16Type>().ok_or_else(|| self.lacks(name))?;
        let words = column.values().as_string_opt::<i32>().ok_or_else(|| self.lacks(name))?;
        Ok(column.key(row).map(|key| words.value(key).to_owned()))
    }

    fn named_values(&self, row: usize) -> Vec<Value> {
        let schema = self.batch.schema();
        let mut values = Vec::new();
        for (field, column) in schema.fields().iter().zip(self.batch.columns()) {
            let number = match column.as_primitive_opt::<Float64Type>() {
                Some(column) if !is_fixed(field.name()) => column.is_valid(row).then(|| column.value(row)),
                _ => continue,
            };
            let unit = field.metadata().get("unit").map_or_else(String::new, |unit| unit.to_string());
            values.push(Value { name: field.name().clone(), unit, value: number });
        }
        values
    }
}

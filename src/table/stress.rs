//! The table of a stress test: a row per trial.
//!
//! Owns its columns. May use the sheet and the footer. It deliberately knows no trial: rows are plain.

use super::failure::TableError;
use super::footer::Footer;
use super::lists::words;
use super::record::Record;
use super::schema::{Column, Measured, arrow_schema, word};
use super::sheet::{Sheet, sync_folder};
use crate::plan::Plan;
use crate::units::Dimension;
use arrow_array::{ArrayRef, Float64Array, Int32Array, RecordBatch, UInt32Array, UInt64Array};
use arrow_schema::DataType;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A trial.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct StressRow {
    pub knob: String,
    pub decades: i32,
    pub fate: String,
    pub code: Option<String>,
    pub line: Option<u32>,
    pub message: Option<String>,
    pub particles: u64,
    pub steps: u64,
    pub sub_steps: u64,
    pub wall: f64,
    pub cpu: f64,
    pub mass_defect: Option<f64>,
    pub lowest: Option<f64>,
    pub error: Option<f64>,
}

fn columns() -> Vec<Column> {
    let plain = |name: &str, shape, doc: &str| Column::new(name, shape, Measured::Unitless, doc);
    let ratio = |name: &str, doc: &str| {
        Column::new(name, DataType::Float64, Measured::Fixed(Dimension::NONE), doc).or_null()
    };
    let time =
        |name: &str, doc: &str| Column::new(name, DataType::Float64, Measured::Fixed(Dimension::TIME), doc);
    vec![
        plain("knob", word(), "what was multiplied"),
        plain("decades", DataType::Int32, "power of ten by which it was multiplied"),
        plain("fate", word(), "finished, refused, stopped, mass_lost, negative, beyond or too_long"),
        plain("code", word(), "code of the message that refused it").or_null(),
        plain("line", DataType::UInt32, "line of the scene that the message names, from 1").or_null(),
        plain("message", word(), "why it was refused, stopped or not run").or_null(),
        plain("particles", DataType::UInt64, "particles of the trial"),
        plain("steps", DataType::UInt64, "steps of the trial"),
        plain("sub_steps", DataType::UInt64, "accepted sub-steps of the integrator, all particles together"),
        time("wall", "wall time of the run"),
        time("cpu", "processor time of the run"),
        ratio("mass_defect", "largest relative defect of what is conserved"),
        ratio("lowest", "smallest value observed over the largest"),
        ratio("error", "difference to a hundredth of the tolerance, L2 over all values, relative"),
    ]
}

/// Writes `stress.parquet` into a folder, whole or not at all.
pub fn write_stress(
    folder: &Path,
    plan: &Plan,
    record: &Record,
    rows: &[StressRow],
) -> Result<PathBuf, TableError> {
    let columns = columns();
    let schema = arrow_schema(&columns, None);
    let target = folder.join("stress.parquet");
    let mut sheet =
        Sheet::create(&target, schema.clone(), &Footer::new("stress", plan, record, &columns, None))?;
    let batch = RecordBatch::try_new(schema, arrays(rows))
        .map_err(|reason| TableError::Format { file: target, reason: reason.to_string() })?;
    sheet.append(&batch)?;
    let path = sheet.finish()?.draft.publish()?;
    sync_folder(folder)?;
    Ok(path)
}

fn arrays(rows: &[StressRow]) -> Vec<ArrayRef> {
    let count = |of: fn(&StressRow) -> u64| -> ArrayRef {
        Arc::new(UInt64Array::from_iter_values(rows.iter().map(of)))
    };
    let ratio = |of: fn(&StressRow) -> Option<f64>| -> ArrayRef {
        let finite = |row: &StressRow| of(row).filter(|value| value.is_finite());
        Arc::new(rows.iter().map(finite).collect::<Float64Array>())
    };
    vec![
        words(rows.iter().map(|row| Some(row.knob.as_str()))),
        Arc::new(Int32Array::from_iter_values(rows.iter().map(|row| row.decades))),
        words(rows.iter().map(|row| Some(row.fate.as_str()))),
        words(rows.iter().map(|row| row.code.as_deref())),
        Arc::new(rows.iter().map(|row| row.line).collect::<UInt32Array>()),
        words(rows.iter().map(|row| row.message.as_deref())),
        count(|row| row.particles),
        count(|row| row.steps),
        count(|row| row.sub_steps),
        ratio(|row| Some(row.wall)),
        ratio(|row| Some(row.cpu)),
        ratio(|row| row.mass_defect),
        ratio(|row| row.lowest),
        ratio(|row| row.error),
    ]
}

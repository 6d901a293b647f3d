//! The table of a density: a row per cell.
//!
//! Owns its columns and its notes. May use the sheet. It deliberately knows no estimator: numbers are handed in.

use super::failure::TableError;
use super::schema::{Column, Measured, arrow_schema};
use super::sheet::{Sheet, sync_folder};
use arrow_array::{ArrayRef, Float64Array, RecordBatch, UInt64Array};
use arrow_schema::DataType;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Key of the notes in the file's metadata.
const KEY: &str = "lamella_density";

/// Rows that are put together at once: few, so that their memory is used again.
const ROWS: usize = 8192;

/// What is known of a cell beside its density.
#[derive(Debug, Clone, PartialEq)]
pub struct DensityCell {
    pub idx: usize,
    pub n_particles: u64,
    /// By axis; zero where there is none.
    pub bandwidth: Vec<f64>,
    /// Unit vector that the first of them is along, if there is one.
    pub direction: Vec<f64>,
    pub support: f64,
}

/// A density on cells of one size; the last axis runs fastest.
#[derive(Debug, Clone)]
pub struct DensityTable {
    /// By axis: its name, its unit, where it begins, the size of a cell, and how many.
    pub axes: Vec<(String, String, f64, f64, usize)>,
    /// Unit of weights.
    pub unit: String,
    pub density: Vec<f64>,
    pub standard_error: Vec<f64>,
    /// Those with particles, in order.
    pub cells: Vec<DensityCell>,
    /// Whether cells without a density are left out.
    pub is_sparse: bool,
    /// Whether bandwidths are along directions: the first along that of the cell, the others across.
    pub is_oriented: bool,
    /// JSON: where it comes from.
    pub notes: String,
}

impl DensityTable {
    fn columns(&self) -> Vec<Column> {
        let measured = |unit: &str| match unit {
            "" => Measured::Unitless,
            unit => Measured::Named(unit.to_owned()),
        };
        let length = self.axes.first().map_or("", |axis| axis.1.as_str());
        let d = self.axes.len() as i32;
        let per = |what: &str, power: i32| match (what, length) {
            ("", "") => String::new(),
            (what, "") => what.to_owned(),
            ("", length) => format!("{length}^-{power}"),
            (what, length) if power == 1 => format!("{what}/{length}"),
            (what, length) => format!("{what}/{length}^{power}"),
        };
        let number =
            |name: &str, unit: &str, doc: &str| Column::new(name, DataType::Float64, measured(unit), doc);
        let count = |name: &str, doc: &str| Column::new(name, DataType::UInt64, Measured::Unitless, doc);
        let mut columns = Vec::new();
        for (name, unit, ..) in &self.axes {
            columns.push(number(name, unit, "centre of the cell"));
        }
        let density = per(&self.unit, d);
        columns.push(number("density", &density, "weight of particles per length, area or volume"));
        columns.push(number("standard_error", &density, "scatter of the density by the number of particles"));
        columns.push(count("n_particles", "particles in the cell"));
        let where_any = "in cells with particles";
        for (axis, (name, unit, ..)) in self.axes.iter().enumerate() {
            let (column, doc) = match self.local_axes().get(axis) {
                None => (
                    format!("bandwidth_{name}"),
                    format!("bandwidth of the kernel along {name}, {where_any}"),
                ),
                Some((column, way)) => {
                    (format!("bandwidth_{column}"), format!("bandwidth of the kernel {way}, {where_any}"))
                }
            };
            columns.push(number(&column, unit, &doc).or_null());
        }
        for (name, ..) in self.axes.iter().filter(|_| self.is_oriented) {
            let doc = format!(
                "component along {name} of the direction of the kernel, a unit vector, {where_any} that have one"
            );
            columns.push(number(&format!("direction_{name}"), "", &doc).or_null());
        }
        let doc = format!("width within which the error of the kernel is weighed, {where_any}");
        columns.push(number("support", length, &doc).or_null());
        columns
    }

    /// Names of bandwidths along directions, and what they are along.
    fn local_axes(&self) -> &'static [(&'static str, &'static str)] {
        match (self.is_oriented, self.axes.len()) {
            (false, _) => &[],
            (_, 3) => &[
                ("along", "along its direction"),
                ("sideways", "across its direction, in the plane of the first two axes"),
                ("upwards", "across both"),
            ],
            _ => &[("along", "along its direction"), ("across", "across its direction")],
        }
    }

    /// Columns of some cells, their numbers rising.
    fn arrays(&self, wanted: &[usize]) -> Vec<ArrayRef> {
        let mut arrays: Vec<ArrayRef> = Vec::new();
        let mut stride: usize = self.axes.iter().map(|axis| axis.4).product();
        for (_, _, low, edge, cells) in &self.axes {
            stride /= cells;
            let centre = |idx: &usize| low + edge * ((idx / stride % cells) as f64 + 0.5);
            arrays.push(Arc::new(Float64Array::from_iter_values(wanted.iter().map(centre))));
        }
        let part = |values: &[f64]| -> ArrayRef {
            Arc::new(Float64Array::from_iter_values(wanted.iter().map(|&idx| values[idx])))
        };
        arrays.push(part(&self.density));
        arrays.push(part(&self.standard_error));
        let mut own: Vec<Option<&DensityCell>> = vec![None; wanted.len()];
        let first = wanted.first().copied().unwrap_or(0);
        let low = self.cells.partition_point(|cell| cell.idx < first);
        let mut at = 0;
        for cell in &self.cells[low..] {
            while wanted.get(at).is_some_and(|&idx| idx < cell.idx) {
                at += 1;
            }
            match wanted.get(at) {
                None => break,
                Some(&idx) if idx == cell.idx => own[at] = Some(cell),
                // It is left out.
                Some(_) => {}
            }
        }
        let count = |cell: &Option<&DensityCell>| cell.map_or(0, |cell| cell.n_particles);
        arrays.push(Arc::new(UInt64Array::from_iter_values(own.iter().map(count))));
        let of_cells = |value: &dyn Fn(&DensityCell) -> Option<f64>| -> ArrayRef {
            Arc::new(own.iter().map(|cell| cell.and_then(value)).collect::<Float64Array>())
        };
        for axis in 0..self.axes.len() {
            arrays.push(of_cells(&|cell| cell.bandwidth.get(axis).copied().filter(|h| *h > 0.0)));
        }
        for axis in self.axes.iter().enumerate().filter(|_| self.is_oriented).map(|(axis, _)| axis) {
            arrays.push(of_cells(&|cell| cell.direction.get(axis).copied()));
        }
        arrays.push(of_cells(&|cell| Some(cell.support).filter(|support| *support > 0.0)));
        arrays
    }
}

/// Writes it, whole or not at all.
pub fn write_density(target: &Path, table: &DensityTable) -> Result<PathBuf, TableError> {
    let columns = table.columns();
    let schema = arrow_schema(&columns, None);
    let notes = vec![(KEY.to_owned(), table.notes.clone())];
    let varied: Vec<&str> = columns.iter().map(|column| column.name.as_str()).collect();
    let mut sheet = Sheet::with_notes(target, schema.clone(), notes, &varied)?;
    let n = table.density.len();
    let mut next = 0;
    while next < n {
        let rest = (next..n).filter(|&idx| !table.is_sparse || table.density[idx] != 0.0);
        let wanted: Vec<usize> = rest.take(ROWS).collect();
        next = wanted.last().map_or(n, |last| last + 1);
        let batch = RecordBatch::try_new(schema.clone(), table.arrays(&wanted))
            .map_err(|reason| TableError::Format { file: target.to_owned(), reason: reason.to_string() })?;
        sheet.append(&batch)?;
    }
    let path = sheet.finish()?.draft.publish()?;
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    sync_folder(folder)?;
    Ok(path)
}

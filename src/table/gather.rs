//! The tables of many points: one file per kind, rows in the order in which points are handed in.
//!
//! Owns the rows of points and errors until a batch is full. May use everything of `table`. It
//! deliberately holds no more than a batch: a sweep may have any number of points.

use super::failure::TableError;
use super::footer::Footer;
use super::lists;
use super::points::{self, Shape};
use super::record::{ErrorRow, PointRow, Record};
use super::rows::{self, Layout, Place};
use super::schema::{self, Column, Kind};
use super::sheet::{Draft, Finished, Sheet};
use super::writer::{Summary, Writer, part_name};
use crate::engine::snapshot::Snapshot;
use crate::plan::Plan;
use arrow_array::{ArrayRef, RecordBatch};
use std::path::Path;
use std::time::Instant;

/// Rows that are held before they are encoded.
const BATCH: usize = 4096;

/// Writes the tables of a sweep. Until [`Gatherer::finish`] returns, readers see what was there before.
pub struct Gatherer {
    writer: Writer,
    shape: Shape,
    begin: Instant,
    points: Option<Sheet>,
    point_rows: Vec<PointRow>,
    errors: Option<Sheet>,
    error_rows: Vec<ErrorRow>,
    /// The errors of the first point that has any: what its columns mean.
    sample: Vec<ErrorRow>,
}

impl Gatherer {
    /// `plan` is that of the scene without a point; `shape` has the columns of all rows to come.
    pub fn create(folder: &Path, plan: &Plan, record: &Record, shape: Shape) -> Result<Self, TableError> {
        Ok(Self {
            writer: Writer::create(folder, plan, record)?,
            shape,
            begin: Instant::now(),
            points: None,
            point_rows: Vec::new(),
            errors: None,
            error_rows: Vec::new(),
            sample: Vec::new(),
        })
    }

    /// Appends one replicate of one point: its row, its snapshots, its errors.
    pub fn add(
        &mut self,
        plan: &Plan,
        row: PointRow,
        snapshots: &[Snapshot],
        errors: Vec<ErrorRow>,
    ) -> Result<(), TableError> {
        let place = Place { point: row.point, replicate: row.replicate };
        let n_axes = self.writer.record.n_axes;
        for (kind, _, sheet) in &mut self.writer.sheets {
            let mut layout = None;
            for snapshot in snapshots {
                let Some(output) = plan.outputs.get(snapshot.output_idx) else { continue };
                if Kind::from(output.kind) == *kind {
                    let layout = layout.get_or_insert_with(|| Layout::new(*kind, plan, n_axes));
                    rows::append(sheet, layout, plan, place, snapshot)?;
                }
            }
        }
        if self.sample.is_empty() {
            self.sample.clone_from(&errors);
        }
        self.error_rows.extend(errors);
        self.point_rows.push(row);
        if self.point_rows.len() >= BATCH || self.error_rows.len() >= BATCH {
            self.flush()?;
        }
        Ok(())
    }

    fn flush(&mut self) -> Result<(), TableError> {
        if !self.error_rows.is_empty() {
            let rows = std::mem::take(&mut self.error_rows);
            let columns = schema::columns(Kind::Errors);
            let name = part_name(Kind::Errors);
            if self.errors.is_none() {
                self.errors = Some(self.sheet(&name, Kind::Errors.name(), &columns)?);
            }
            append(self.errors.as_mut(), &columns, lists::errors(&rows))?;
        }
        let rows = std::mem::take(&mut self.point_rows);
        let (columns, arrays) = points::table(&self.shape, &rows);
        if self.points.is_none() {
            self.points = Some(self.sheet("points.parquet", "points", &columns)?);
        }
        append(self.points.as_mut(), &columns, arrays)
    }

    fn sheet(&self, name: &str, table: &str, columns: &[Column]) -> Result<Sheet, TableError> {
        let footer = Footer::new(table, &self.writer.plan, &self.writer.record, columns, None);
        Sheet::create(&self.writer.folder.join(name), schema::arrow_schema(columns, None), &footer)
    }

    /// Completes every file, then gives all of them their names, `points.parquet` last. `texts` are
    /// further files, name and content.
    pub fn finish(mut self, texts: &[(&str, &str)]) -> Result<Summary, TableError> {
        self.flush()?;
        let mut drafts = self.writer.texts()?;
        for (name, text) in texts {
            drafts.push(Draft::text(&self.writer.folder.join(name), text)?);
        }
        let mut tables: Vec<(String, Vec<Column>)> = Vec::new();
        let mut done: Vec<(String, Finished)> = Vec::new();
        for (kind, _, sheet) in std::mem::take(&mut self.writer.sheets) {
            tables.push((kind.name().to_owned(), schema::columns(kind)));
            done.push((part_name(kind), sheet.finish()?));
        }
        if let Some(sheet) = self.errors.take() {
            tables.push((Kind::Errors.name().to_owned(), schema::columns(Kind::Errors)));
            done.push((part_name(Kind::Errors), sheet.finish()?));
        }
        tables.push(("points".to_owned(), points::table(&self.shape, &[]).0));
        let compared: Vec<lists::Compared> = self.sample.iter().map(lists::Compared::from).collect();
        let (meanings, arrays) = lists::columns(&tables, &compared, &self.writer.plan, &self.writer.record);
        let columns = self.writer.whole("columns.parquet", "columns", &meanings, arrays)?;
        done.push(("columns.parquet".to_owned(), columns));
        if let Some(sheet) = self.points.take() {
            done.push(("points.parquet".to_owned(), sheet.finish()?));
        }
        let files = self.writer.publish(drafts, done)?;
        Ok(Summary { files, write_wall: self.begin.elapsed().as_secs_f64() })
    }
}

fn append(sheet: Option<&mut Sheet>, columns: &[Column], arrays: Vec<ArrayRef>) -> Result<(), TableError> {
    let Some(sheet) = sheet else { return Ok(()) };
    let batch = RecordBatch::try_new(schema::arrow_schema(columns, None), arrays)
        .map_err(|reason| TableError::Format { file: "points".into(), reason: reason.to_string() })?;
    sheet.append(&batch)
}

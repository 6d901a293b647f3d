//! A run's folder: streamed into under temporary names, put in place at the end.
//!
//! Owns which files there are and the order in which they get their names. May use everything of
//! `table`. It deliberately leaves files alone that Lamella did not name.

use super::failure::TableError;
use super::footer::Footer;
use super::points::Shape;
use super::record::{ErrorBarRow, ErrorRow, PointRow, Record};
use super::rows::{self, Layout, Place};
use super::schema::{self, Column, Kind};
use super::sheet::{Draft, Finished, Sheet, is_temporary, sync_folder};
use super::{cells, lists, points};
use crate::engine::snapshot::Snapshot;
use crate::flow::FaceFlow;
use crate::plan::Plan;
use arrow_array::{ArrayRef, RecordBatch};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Writes one run. Until [`Writer::finish`] returns, readers see what was there before; a writer
/// that is dropped takes its temporary files away.
pub struct Writer {
    pub(super) folder: PathBuf,
    /// Held as long as the writer lives: one run per folder.
    _lock: Option<File>,
    pub(super) plan: Plan,
    pub(super) record: Record,
    pub(super) sheets: Vec<(Kind, Layout, Sheet)>,
    error_bars: Vec<ErrorBarRow>,
    flow: Option<Arc<FaceFlow>>,
    elapsed: Duration,
}

/// What was written.
#[derive(Debug, Clone, PartialEq)]
pub struct Summary {
    pub files: Vec<WrittenFile>,
    /// Wall seconds spent in the writer.
    pub write_wall: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub struct WrittenFile {
    /// Relative to the run's folder.
    pub name: String,
    pub n_rows: u64,
    pub n_bytes: u64,
}

impl Writer {
    /// Opens a temporary file per table kind that the plan asks for.
    pub fn create(folder: &Path, plan: &Plan, record: &Record) -> Result<Self, TableError> {
        let begin = Instant::now();
        fs::create_dir_all(folder)
            .map_err(|reason| TableError::system(folder, "make the folder", reason, 0))?;
        let lock = lock(folder)?;
        if lock.is_some() {
            remove_temporaries(folder);
        }
        let mut writer = Self {
            folder: folder.to_path_buf(),
            _lock: lock,
            plan: plan.clone(),
            record: record.clone(),
            sheets: Vec::new(),
            error_bars: Vec::new(),
            flow: None,
            elapsed: Duration::ZERO,
        };
        for kind in Kind::ALL {
            if plan.outputs.iter().any(|output| Kind::from(output.kind) == kind) {
                let layout = Layout::new(kind, plan, record.n_axes);
                let columns = schema::columns(kind);
                let footer = Footer::new(kind.name(), plan, record, &columns, layout.row_unit.as_deref());
                let sheet = Sheet::create(&writer.part(kind), layout.schema.clone(), &footer)?;
                writer.sheets.push((kind, layout, sheet));
            }
        }
        writer.elapsed = begin.elapsed();
        Ok(writer)
    }

    /// Appends the rows of a snapshot to its table.
    pub fn write(&mut self, snapshot: &Snapshot) -> Result<(), TableError> {
        let begin = Instant::now();
        let n_outputs = self.plan.outputs.len();
        let Some(output) = self.plan.outputs.get(snapshot.output_idx) else {
            let (output_idx, found) = (snapshot.output_idx, snapshot.output_idx + 1);
            return Err(TableError::Shape { output_idx, what: "outputs", expected: n_outputs, found });
        };
        let kind = Kind::from(output.kind);
        if let Some((_, layout, sheet)) = self.sheets.iter_mut().find(|(other, ..)| *other == kind) {
            rows::append(sheet, layout, &self.plan, Place::default(), snapshot)?;
        }
        self.elapsed += begin.elapsed();
        Ok(())
    }

    /// Takes the rows of the table of error bars, which is written at the end.
    pub fn error_bars(&mut self, rows: Vec<ErrorBarRow>) {
        self.error_bars = rows;
    }

    /// Takes the flow whose cells are written at the end.
    pub fn flow(&mut self, flow: Arc<FaceFlow>) {
        self.flow = Some(flow);
    }

    /// The table of the flow, finished but not yet named.
    fn flow_table(&mut self) -> Result<Option<(Kind, Finished)>, TableError> {
        let Some(flow) = self.flow.take() else { return Ok(None) };
        let columns = schema::columns(Kind::Flow);
        let schema = schema::arrow_schema(&columns, None);
        let footer = Footer::new(Kind::Flow.name(), &self.plan, &self.record, &columns, None);
        let mut sheet = Sheet::create(&self.part(Kind::Flow), schema.clone(), &footer)?;
        cells::append(&mut sheet, &schema, &self.plan, &flow, 0.0)?;
        Ok(Some((Kind::Flow, sheet.finish()?)))
    }

    /// Completes every file, then gives all of them their names.
    pub fn finish(mut self, mut points: Vec<PointRow>, errors: &[ErrorRow]) -> Result<Summary, TableError> {
        let begin = Instant::now();
        let mut tables: Vec<(String, Vec<Column>)> = Vec::new();
        let mut done: Vec<(String, Finished)> = Vec::new();
        for (kind, _, sheet) in std::mem::take(&mut self.sheets) {
            tables.push((kind.name().to_owned(), schema::columns(kind)));
            done.push((part_name(kind), sheet.finish()?));
        }
        if let Some((kind, finished)) = self.flow_table()? {
            tables.push((kind.name().to_owned(), schema::columns(kind)));
            done.push((part_name(kind), finished));
        }
        let bars = std::mem::take(&mut self.error_bars);
        let lists = [
            (Kind::Errors, !errors.is_empty(), lists::errors(errors)),
            (Kind::ErrorBars, !bars.is_empty(), lists::error_bars(&bars)),
        ];
        for (kind, _, arrays) in lists.into_iter().filter(|(_, has_rows, _)| *has_rows) {
            let columns = schema::columns(kind);
            let name = part_name(kind);
            done.push((name.clone(), self.whole(&name, kind.name(), &columns, arrays)?));
            tables.push((kind.name().to_owned(), columns));
        }
        let compared: Vec<lists::Compared> =
            errors.iter().map(Into::into).chain(bars.iter().map(Into::into)).collect();
        let texts = self.texts()?;
        let write_wall = (self.elapsed + begin.elapsed()).as_secs_f64();
        points.iter_mut().for_each(|row| row.write_wall = row.write_wall.or(Some(write_wall)));
        let (columns, arrays) = points::table(&Shape::of(&points), &points);
        tables.push(("points".to_owned(), columns.clone()));
        let (meanings, meaning_arrays) = lists::columns(&tables, &compared, &self.plan, &self.record);
        done.push((
            "columns.parquet".to_owned(),
            self.whole("columns.parquet", "columns", &meanings, meaning_arrays)?,
        ));
        done.push(("points.parquet".to_owned(), self.whole("points.parquet", "points", &columns, arrays)?));

        let files = self.publish(texts, done)?;
        Ok(Summary { files, write_wall: (self.elapsed + begin.elapsed()).as_secs_f64() })
    }

    /// The texts that stand beside the tables.
    pub(super) fn texts(&self) -> Result<Vec<Draft>, TableError> {
        Ok(vec![
            Draft::text(&self.folder.join("plan.yaml"), &self.record.plan_yaml)?,
            Draft::text(&self.folder.join("scene.lam"), &self.record.scene_source)?,
        ])
    }

    /// A small table, finished but not yet named.
    pub(super) fn whole(
        &self,
        name: &str,
        table: &str,
        columns: &[Column],
        arrays: Vec<ArrayRef>,
    ) -> Result<Finished, TableError> {
        let target = self.folder.join(name);
        let schema = schema::arrow_schema(columns, None);
        let footer = Footer::new(table, &self.plan, &self.record, columns, None);
        let mut sheet = Sheet::create(&target, schema.clone(), &footer)?;
        let batch = RecordBatch::try_new(schema, arrays)
            .map_err(|reason| TableError::Format { file: target, reason: reason.to_string() })?;
        sheet.append(&batch)?;
        sheet.finish()
    }

    /// Gives all files their names. The earlier `points.parquet` goes first and the new one comes last: a
    /// folder whose points tell of a plan holds the whole of it. A program that is killed in between, which
    /// is a matter of milliseconds, leaves tables without points, and never those of two plans as one.
    pub(super) fn publish(
        &self,
        texts: Vec<Draft>,
        done: Vec<(String, Finished)>,
    ) -> Result<Vec<WrittenFile>, TableError> {
        self.remove_points()?;
        for draft in texts {
            draft.publish()?;
        }
        self.remove_absent(&done)?;
        let mut files = Vec::new();
        for (name, file) in done {
            let path = file.draft.publish()?;
            sync_folder(path.parent().unwrap_or(&self.folder))?;
            files.push(WrittenFile { name, n_rows: file.n_rows, n_bytes: file.n_bytes });
        }
        Ok(files)
    }

    fn remove_points(&self) -> Result<(), TableError> {
        let path = self.folder.join("points.parquet");
        match fs::remove_file(&path) {
            Ok(()) => sync_folder(&self.folder),
            Err(reason) if reason.kind() == std::io::ErrorKind::NotFound => Ok(()),
            Err(reason) => Err(TableError::system(&path, "remove", reason, 0)),
        }
    }

    /// Takes away parts of an earlier run that this run does not replace.
    fn remove_absent(&self, done: &[(String, Finished)]) -> Result<(), TableError> {
        for kind in Kind::ALL {
            let folder = self.folder.join(kind.name());
            for name in names_in(&folder) {
                let is_part = name.starts_with("part-") && name.ends_with(".parquet");
                let is_replaced = done.iter().any(|(other, _)| *other == format!("{}/{name}", kind.name()));
                if is_part && !is_replaced {
                    let path = folder.join(&name);
                    fs::remove_file(&path)
                        .map_err(|reason| TableError::system(&path, "remove", reason, 0))?;
                }
            }
            // Fails, as it should, if anything is left inside.
            let _ = fs::remove_dir(&folder);
        }
        Ok(())
    }

    pub(super) fn part(&self, kind: Kind) -> PathBuf {
        self.folder.join(part_name(kind))
    }
}

impl Drop for Writer {
    fn drop(&mut self) {
        // Temporary files first, then the folders that were made for them and are empty now.
        self.sheets.clear();
        for kind in Kind::ALL {
            let _ = fs::remove_dir(self.folder.join(kind.name()));
        }
        let _ = fs::remove_dir(&self.folder);
    }
}

pub(super) fn part_name(kind: Kind) -> String {
    format!("{}/part-0000.parquet", kind.name())
}

/// One writer per folder; `None` where the file system knows no locks.
fn lock(folder: &Path) -> Result<Option<File>, TableError> {
    let Ok(file) = File::open(folder) else { return Ok(None) };
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(fs::TryLockError::WouldBlock) => Err(TableError::InUse { folder: folder.to_path_buf() }),
        Err(fs::TryLockError::Error(_)) => Ok(None),
    }
}

/// Takes away what a killed run left; safe because the folder is locked.
fn remove_temporaries(folder: &Path) {
    let folders = std::iter::once(folder.to_path_buf()).chain(Kind::ALL.map(|kind| folder.join(kind.name())));
    for folder in folders {
        for name in names_in(&folder).iter().filter(|name| is_temporary(name)) {
            let _ = fs::remove_file(folder.join(name));
        }
    }
}

/// Names in a folder, sorted; none if it cannot be read.
fn names_in(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> =
        entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

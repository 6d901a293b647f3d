//! One Parquet file on its way to its name: written beside it, synced, then renamed.
//!
//! Owns temporary names, the encoder's settings and the removal of what was not finished. May use
//! `failure`, `footer`. It deliberately knows no columns.

use super::failure::TableError;
use super::footer::Footer;
use arrow_array::RecordBatch;
use arrow_schema::SchemaRef;
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, ZstdLevel};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::schema::types::ColumnPath;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Rows of a row group: DuckDB's unit of parallel work, and the bound on buffered rows.
pub const ROW_GROUP: usize = 122_880;

/// Written into every file in place of the library's own text, which would change with its version.
const CREATED_BY: &str = "lamella version 1.0.0";

/// A file under a temporary name; removed when dropped unless [`Draft::publish`] gave it its name.
#[derive(Debug)]
pub struct Draft {
    temporary: PathBuf,
    target: PathBuf,
    is_published: bool,
}

impl Draft {
    /// Reserves `.NAME.tmp-PID` beside `target` and makes the folder.
    pub fn new(target: &Path) -> Result<(Self, File), TableError> {
        let folder = target.parent().unwrap_or(Path::new("."));
        fs::create_dir_all(folder)
            .map_err(|reason| TableError::system(folder, "make the folder", reason, 0))?;
        let name = target.file_name().unwrap_or_default().to_string_lossy();
        let temporary = folder.join(format!(".{name}.tmp-{}", std::process::id()));
        let file =
            File::create(&temporary).map_err(|reason| TableError::system(target, "create", reason, 0))?;
        Ok((Self { temporary, target: target.to_path_buf(), is_published: false }, file))
    }

    /// A whole small file of text, synced, still under its temporary name.
    pub fn text(target: &Path, text: &str) -> Result<Self, TableError> {
        let (draft, mut file) = Self::new(target)?;
        let fail = |reason| TableError::system(target, "write", reason, 0);
        file.write_all(text.as_bytes()).map_err(fail)?;
        file.sync_all().map_err(fail)?;
        Ok(draft)
    }

    /// Gives the file its name in one step.
    pub fn publish(mut self) -> Result<PathBuf, TableError> {
        fs::rename(&self.temporary, &self.target)
            .map_err(|reason| TableError::system(&self.target, "rename", reason, 0))?;
        self.is_published = true;
        Ok(std::mem::take(&mut self.target))
    }
}

impl Drop for Draft {
    fn drop(&mut self) {
        if !self.is_published {
            // Nothing can be done here if the removal fails; the next run removes what it finds.
            let _ = fs::remove_file(&self.temporary);
        }
    }
}

/// True for names that only an unfinished run leaves behind.
pub fn is_temporary(name: &str) -> bool {
    name.starts_with('.') && name.contains(".tmp-")
}

/// Makes names that were given durable.
pub fn sync_folder(folder: &Path) -> Result<(), TableError> {
    File::open(folder)
        .and_then(|file| file.sync_all())
        .map_err(|reason| TableError::system(folder, "sync", reason, 0))
}

/// A Parquet file being written, row group by row group.
pub struct Sheet {
    draft: Draft,
    writer: ArrowWriter<File>,
    n_rows: u64,
}

/// A finished Parquet file that waits for its name.
#[derive(Debug)]
pub struct Finished {
    pub draft: Draft,
    pub n_rows: u64,
    pub n_bytes: u64,
}

impl Sheet {
    /// The footer goes into the file's metadata, where most tools look, and into the Arrow schema,
    /// where pyarrow and pandas look.
    pub fn create(target: &Path, schema: SchemaRef, footer: &Footer) -> Result<Self, TableError> {
        Self::with_notes(target, schema, footer.key_values(), &[])
    }

    /// A table that comes from no scene: notes are by their keys. In columns that are named hardly a value is there twice, so
    /// that a dictionary of them is not tried.
    pub fn with_notes(
        target: &Path,
        schema: SchemaRef,
        pairs: Vec<(String, String)>,
        varied: &[&str],
    ) -> Result<Self, TableError> {
        let schema =
            schema.as_ref().clone().with_metadata(pairs.iter().cloned().collect::<arrow_schema::Metadata>());
        let (draft, file) = Draft::new(target)?;
        let writer = ArrowWriter::try_new(file, Arc::new(schema), Some(properties(pairs, varied)))
            .map_err(|reason| TableError::parquet(target, reason, 0))?;
        Ok(Self { draft, writer, n_rows: 0 })
    }

    pub fn append(&mut self, batch: &RecordBatch) -> Result<(), TableError> {
        self.n_rows += batch.num_rows() as u64;
        self.writer.write(batch).map_err(|reason| {
            TableError::parquet(&self.draft.target, reason, self.writer.bytes_written() as u64)
        })
    }

    /// Writes the footer and waits until everything is on the disk.
    pub fn finish(mut self) -> Result<Finished, TableError> {
        let target = &self.draft.target;
        let n_bytes = |writer: &ArrowWriter<File>| writer.bytes_written() as u64;
        if let Err(reason) = self.writer.finish() {
            return Err(TableError::parquet(target, reason, n_bytes(&self.writer)));
        }
        let n_bytes = n_bytes(&self.writer);
        self.writer
            .inner()
            .sync_all()
            .map_err(|reason| TableError::system(target, "sync", reason, n_bytes))?;
        Ok(Finished { draft: self.draft, n_rows: self.n_rows, n_bytes })
    }
}

fn properties(pairs: Vec<(String, String)>, varied: &[&str]) -> WriterProperties {
    let metadata = pairs.into_iter().map(|(key, value)| KeyValue::new(key, value)).collect();
    let start = WriterProperties::builder();
    let start = varied.iter().fold(start, |start, name| {
        start.set_column_dictionary_enabled(ColumnPath::from((*name).to_owned()), false)
    });
    start
        .set_created_by(CREATED_BY.to_owned())
        .set_compression(Compression::ZSTD(ZstdLevel::try_new(3).unwrap_or_default()))
        .set_max_row_group_row_count(Some(ROW_GROUP))
        .set_statistics_enabled(EnabledStatistics::Page)
        .set_key_value_metadata(Some(metadata))
        .build()
}

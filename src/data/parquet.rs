//! Columns of Parquet tables of other programs.
//!
//! Owns the choice of columns and their types. May use the messages beside it. It deliberately reads flat columns
//! only, batch by batch.

use super::error::{Kind, Place, ReadError, no_column};
use arrow_array::cast::AsArray;
use arrow_array::types::{
    Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type, UInt32Type,
    UInt64Type,
};
use arrow_array::{Array, ArrayRef};
use arrow_schema::DataType;
use bytes::Bytes;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::{ArrowReaderOptions, ParquetRecordBatchReaderBuilder};
use parquet::file::metadata::ParquetMetaData;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Every Parquet file begins with this.
pub const MAGIC: &[u8] = b"PAR1";

/// The key of what our tables say of themselves, as `table::footer` writes it.
const NOTES: &str = "lamella";

/// What takes the word of a row.
pub type Take<'a> = dyn FnMut(usize, Option<&str>) -> Result<(), ReadError> + 'a;

/// A column of words: its name, and what takes them.
pub type Words<'a> = (&'a str, &'a mut Take<'a>);

/// The columns of these names as doubles, in this order, at most `most` numbers in all.
pub fn columns(
    bytes: Bytes,
    names: &[&str],
    words: Option<Words>,
    most: usize,
) -> Result<Vec<Vec<f64>>, ReadError> {
    if !bytes.starts_with(MAGIC) {
        return Err(ReadError::new(Kind::Foreign, "this is no Parquet file"));
    }
    // The library stops at an index out of bounds in some damaged files.
    let read = catch_unwind(AssertUnwindSafe(|| read(bytes, names, words, most)));
    read.unwrap_or_else(|_| Err(damaged(&"a page contradicts itself")))
}

/// Units that a table of ours says its columns are in, by their names; nothing of other tables.
pub fn units(bytes: &Bytes) -> BTreeMap<String, String> {
    let notes = catch_unwind(AssertUnwindSafe(|| {
        let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
        let builder = ParquetRecordBatchReaderBuilder::try_new_with_options(bytes.clone(), options).ok()?;
        let notes = builder.metadata().file_metadata().key_value_metadata()?;
        notes.iter().find(|note| note.key == NOTES)?.value.clone()
    }));
    // What is damaged is told when its numbers are read.
    let Some(notes) = notes.ok().flatten() else { return BTreeMap::new() };
    let notes: serde_json::Value = serde_json::from_str(&notes).unwrap_or_default();
    let columns = notes["columns"].as_array().map(Vec::as_slice).unwrap_or_default();
    let of = |column: &serde_json::Value| {
        Some((column["name"].as_str()?.to_owned(), column["unit"].as_str()?.to_owned()))
    };
    columns.iter().filter_map(of).collect()
}

fn read(
    bytes: Bytes,
    names: &[&str],
    mut words: Option<Words>,
    most: usize,
) -> Result<Vec<Vec<f64>>, ReadError> {
    let n_bytes = bytes.len() as i64;
    // The types of the columns are those of Parquet: what a writer noted besides is of no use here.
    let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
    let builder =
        ParquetRecordBatchReaderBuilder::try_new_with_options(bytes, options).map_err(|why| damaged(&why))?;
    check_places(builder.metadata(), n_bytes)?;
    let schema = builder.schema().clone();
    let known = || schema.fields().iter().map(|field| field.name().as_str());
    let column = |name: &str| known().position(|own| own == name).ok_or_else(|| no_column(name, known()));
    let wanted: Vec<usize> = names.iter().map(|name| column(name)).collect::<Result<_, _>>()?;
    let of_words = words.as_ref().map(|(name, _)| column(name)).transpose()?;
    let mask = ProjectionMask::roots(builder.parquet_schema(), wanted.iter().copied().chain(of_words));
    let reader = builder.with_projection(mask).with_batch_size(8192).build().map_err(|why| damaged(&why))?;
    let name = |idx: usize| schema.field(idx).name().as_str();
    let mut columns = vec![Vec::new(); wanted.len()];
    let mut n_rows = 0;
    for batch in reader {
        let batch = batch.map_err(|why| damaged(&why))?;
        if (n_rows + batch.num_rows()).saturating_mul(wanted.len()) > most {
            return Err(too_many(most));
        }
        let of = |idx: usize| batch.column_by_name(name(idx)).ok_or_else(|| no_column(name(idx), known()));
        for (&idx, numbers) in wanted.iter().zip(&mut columns) {
            let array = of(idx)?;
            check(array, name(idx), n_rows, numbers.len())?;
            push(array, name(idx), n_rows, numbers)?;
        }
        if let (Some(idx), Some((_, take))) = (of_words, &mut words) {
            push_words(of(idx)?, name(idx), n_rows, take)?;
        }
        n_rows += batch.num_rows();
    }
    Ok(columns)
}

/// More numbers than a table may have.
pub fn too_many(most: usize) -> ReadError {
    ReadError::new(Kind::Unsupported, format!("the table has more than {most} numbers"))
        .help("leave out rows or columns that are not needed")
}

/// Where the footer says that columns lie; the library takes its word for it.
fn check_places(metadata: &ParquetMetaData, n_bytes: i64) -> Result<(), ReadError> {
    for group in metadata.row_groups() {
        for column in group.columns() {
            let start = column.dictionary_page_offset().unwrap_or_else(|| column.data_page_offset());
            let length = column.compressed_size();
            let fits =
                start >= 0 && length >= 0 && start.checked_add(length).is_some_and(|end| end <= n_bytes);
            if !fits || column.num_values() < 0 || group.num_rows() < 0 {
                return Err(damaged(&"its footer names places outside the file"));
            }
        }
    }
    Ok(())
}

fn damaged(why: &dyn std::fmt::Display) -> ReadError {
    let why: String = why.to_string().chars().map(|c| if c.is_control() { ' ' } else { c }).collect();
    let error = ReadError::new(Kind::Damaged, format!("the Parquet file cannot be read: {why}"));
    if why.contains("Disabled feature") {
        let help = "write it with zstd, snappy or no compression";
        return ReadError { kind: Kind::Unsupported, ..error }.help(help);
    }
    error
}

fn check(array: &ArrayRef, name: &str, before: usize, n_own: usize) -> Result<(), ReadError> {
    debug_assert_eq!(before, n_own);
    match array.nulls().and_then(|nulls| nulls.iter().position(|is_there| !is_there)) {
        None => Ok(()),
        Some(row) => Err(ReadError::new(Kind::Value, format!("column `{name}` is empty here"))
            .at(Place::Row(before + row + 1))),
    }
}

/// Appends a column as doubles.
fn push(array: &ArrayRef, name: &str, before: usize, numbers: &mut Vec<f64>) -> Result<(), ReadError> {
    macro_rules! widened {
        ($kind:ty) => {
            numbers.extend(array.as_primitive::<$kind>().values().iter().map(|&value| value as f64))
        };
    }
    match array.data_type() {
        DataType::Float64 => widened!(Float64Type),
        DataType::Float32 => widened!(Float32Type),
        DataType::Int8 => widened!(Int8Type),
        DataType::Int16 => widened!(Int16Type),
        DataType::Int32 => widened!(Int32Type),
        DataType::Int64 => widened!(Int64Type),
        DataType::UInt8 => widened!(UInt8Type),
        DataType::UInt16 => widened!(UInt16Type),
        DataType::UInt32 => widened!(UInt32Type),
        DataType::UInt64 => widened!(UInt64Type),
        other => {
            let message = format!("column `{name}` holds {other}, not numbers");
            return Err(ReadError::new(Kind::Value, message));
        }
    }
    match numbers[before..].iter().position(|number| !number.is_finite()) {
        None => Ok(()),
        Some(row) => {
            let message = format!("column `{name}` is {} here", numbers[before + row]);
            Err(ReadError::new(Kind::Value, message).at(Place::Row(before + row + 1)))
        }
    }
}

fn push_words(array: &ArrayRef, name: &str, before: usize, take: &mut Take<'_>) -> Result<(), ReadError> {
    let texts: Vec<Option<&str>> = match array.data_type() {
        DataType::Utf8 => array.as_string::<i32>().iter().collect(),
        DataType::LargeUtf8 => array.as_string::<i64>().iter().collect(),
        DataType::Utf8View => array.as_string_view().iter().collect(),
        other => {
            let message = format!("column `{name}` holds {other}, not text");
            return Err(ReadError::new(Kind::Value, message));
        }
    };
    texts.into_iter().enumerate().try_for_each(|(row, text)| take(before + row, text))
}

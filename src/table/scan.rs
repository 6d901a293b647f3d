//! Tables of any size, row after row: chosen columns of one batch at a time.
//!
//! Owns the choice of columns and row groups. May use `read`. It deliberately keeps no row: whoever
//! reads makes sums of them.

use super::failure::TableError;
use super::read::{footer, open};
use super::schema::Kind;
use arrow_array::cast::AsArray;
use arrow_array::types::{
    Float64Type, Int64Type, TimestampMicrosecondType, UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{
    Array, Float64Array, Int64Array, PrimitiveArray, RecordBatch, StringArray, UInt16Array, UInt32Array,
    UInt64Array,
};
use arrow_schema::DataType;
use parquet::arrow::ProjectionMask;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use parquet::file::metadata::RowGroupMetaData;
use parquet::file::statistics::Statistics;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// What is read of a table.
#[derive(Debug, Clone, Copy, Default)]
pub struct Selection<'a> {
    pub numbers: &'a [&'a str],
    pub words: &'a [&'a str],
    /// Row groups that hold none of these points are not read; rows of others may still come.
    pub points: Option<&'a [u32]>,
}

/// A column as its field tells of it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnHead {
    pub name: String,
    /// Empty for names and counts.
    pub unit: String,
    pub is_number: bool,
}

/// The files of a kind of table in a folder of results, in order; none if there is no such table.
pub fn parts(folder: &Path, kind: Kind) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder.join(kind.name())).into_iter().flatten().flatten();
    let is_part = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("part-") && name.ends_with(".parquet")
    };
    let mut parts: Vec<PathBuf> = entries.map(|entry| entry.path()).filter(is_part).collect();
    parts.sort();
    parts
}

/// The columns of a table that is complete.
pub fn columns(path: &Path) -> Result<Vec<ColumnHead>, TableError> {
    footer(path)?;
    let (_, metadata) = open(path)?;
    let head = |field: &std::sync::Arc<arrow_schema::Field>| ColumnHead {
        name: field.name().clone(),
        unit: field.metadata().get("unit").cloned().unwrap_or_default(),
        is_number: matches!(
            field.data_type(),
            DataType::Float64 | DataType::Int64 | DataType::UInt64 | DataType::UInt32 | DataType::UInt16
        ),
    };
    Ok(metadata.schema().fields().iter().map(head).collect())
}

/// Hands each row of a complete table to `each`, in the order of the file.
pub fn scan(path: &Path, selection: Selection, mut each: impl FnMut(&Row)) -> Result<(), TableError> {
    footer(path)?;
    let (file, metadata) = open(path)?;
    let groups = metadata.metadata().row_groups();
    let is_wanted = |group: &RowGroupMetaData| selection.points.is_none_or(|points| may_hold(group, points));
    let wanted: Vec<usize> = (0..groups.len()).filter(|idx| is_wanted(&groups[*idx])).collect();
    let is_selected =
        |name: &String| selection.numbers.iter().chain(selection.words).any(|selected| selected == name);
    // By number: a dot in a name, as in `limit.profile.AB.l2`, would be taken for a step into a structure.
    let fields = metadata.schema().fields().iter().enumerate();
    let roots: Vec<usize> =
        fields.filter(|(_, field)| is_selected(field.name())).map(|(idx, _)| idx).collect();
    let mask = ProjectionMask::roots(metadata.parquet_schema(), roots);
    let reader = ParquetRecordBatchReaderBuilder::new_with_metadata(file, metadata)
        .with_row_groups(wanted)
        .with_projection(mask)
        .with_batch_size(8192)
        .build()
        .map_err(|reason| TableError::parquet(path, reason, 0))?;
    for batch in reader {
        let batch =
            batch.map_err(|reason| TableError::Format { file: path.into(), reason: reason.to_string() })?;
        let columns = Columns::new(&batch, selection, path)?;
        for row in 0..batch.num_rows() {
            each(&Row { columns: &columns, row });
        }
    }
    Ok(())
}

/// Whether a row group may hold one of the points; true where it does not say.
fn may_hold(group: &RowGroupMetaData, points: &[u32]) -> bool {
    let column = group.columns().iter().find(|column| column.column_path().string() == "point");
    match column.and_then(|column| column.statistics()) {
        Some(Statistics::Int32(range)) => match (range.min_opt(), range.max_opt()) {
            // Parquet keeps unsigned numbers in signed ones of the same bits.
            (Some(low), Some(high)) => {
                points.iter().any(|point| (*low as u32..=*high as u32).contains(point))
            }
            _ => true,
        },
        _ => true,
    }
}

/// One row of a scan.
pub struct Row<'a> {
    columns: &'a Columns<'a>,
    row: usize,
}

impl Row<'_> {
    /// The value of number column `idx` of the selection; absent if it is null.
    pub fn number(&self, idx: usize) -> Option<f64> {
        fn of<T: arrow_array::ArrowPrimitiveType>(
            array: &PrimitiveArray<T>,
            row: usize,
        ) -> Option<T::Native> {
            array.is_valid(row).then(|| array.value(row))
        }
        match self.columns.numbers.get(idx)? {
            Numbers::Real(array) => of(array, self.row),
            Numbers::Signed(array) => of(array, self.row).map(|value| value as f64),
            Numbers::Long(array) => of(array, self.row).map(|value| value as f64),
            Numbers::Short(array) => of(array, self.row).map(f64::from),
            Numbers::Tiny(array) => of(array, self.row).map(f64::from),
            Numbers::Moment(array) => of(array, self.row).map(|value| value as f64),
        }
    }

    /// The text of word column `idx` of the selection; a count is written out.
    pub fn word(&self, idx: usize) -> Option<Cow<'_, str>> {
        match self.columns.words.get(idx)? {
            Words::Plain(array) => array.is_valid(self.row).then(|| Cow::Borrowed(array.value(self.row))),
            Words::Keyed(keys, words) => {
                keys.is_valid(self.row).then(|| Cow::Borrowed(words.value(usize::from(keys.value(self.row)))))
            }
            Words::Count(array) => {
                array.is_valid(self.row).then(|| Cow::Owned(array.value(self.row).to_string()))
            }
        }
    }
}

enum Numbers<'a> {
    Real(&'a Float64Array),
    Signed(&'a Int64Array),
    Long(&'a UInt64Array),
    Short(&'a UInt32Array),
    Tiny(&'a UInt16Array),
    Moment(&'a PrimitiveArray<TimestampMicrosecondType>),
}

enum Words<'a> {
    Plain(&'a StringArray),
    Keyed(&'a UInt16Array, &'a StringArray),
    Count(&'a UInt64Array),
}

/// The selected columns of a batch, each of a type that is known.
struct Columns<'a> {
    numbers: Vec<Numbers<'a>>,
    words: Vec<Words<'a>>,
}

impl<'a> Columns<'a> {
    fn new(batch: &'a RecordBatch, selection: Selection, path: &Path) -> Result<Self, TableError> {
        let lacks = |name: &str| TableError::Foreign {
            file: path.to_path_buf(),
            reason: format!("column `{name}` is missing or of another type"),
        };
        let column = |name: &str| batch.column_by_name(name).map(|column| column.as_ref());
        let number = |name: &&str| column(name).and_then(numbers).ok_or_else(|| lacks(name));
        let word = |name: &&str| column(name).and_then(words).ok_or_else(|| lacks(name));
        Ok(Self {
            numbers: selection.numbers.iter().map(number).collect::<Result<_, _>>()?,
            words: selection.words.iter().map(word).collect::<Result<_, _>>()?,
        })
    }
}

fn numbers(column: &dyn Array) -> Option<Numbers<'_>> {
    let real = column.as_primitive_opt::<Float64Type>().map(Numbers::Real);
    real.or_else(|| column.as_primitive_opt::<Int64Type>().map(Numbers::Signed))
        .or_else(|| column.as_primitive_opt::<UInt64Type>().map(Numbers::Long))
        .or_else(|| column.as_primitive_opt::<UInt32Type>().map(Numbers::Short))
        .or_else(|| column.as_primitive_opt::<UInt16Type>().map(Numbers::Tiny))
        .or_else(|| column.as_primitive_opt::<TimestampMicrosecondType>().map(Numbers::Moment))
}

fn words(column: &dyn Array) -> Option<Words<'_>> {
    if let Some(keyed) = column.as_dictionary_opt::<UInt16Type>() {
        return keyed.values().as_string_opt::<i32>().map(|words| Words::Keyed(keyed.keys(), words));
    }
    let plain = column.as_string_opt::<i32>().map(Words::Plain);
    plain.or_else(|| column.as_primitive_opt::<UInt64Type>().map(Words::Count))
}

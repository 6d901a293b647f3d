//! The columns that a scene declares, out of a file, in SI.
//!
//! Owns the search for columns, the guess of the separator, and the conversion. May use the formats and units. It
//! deliberately looks at no value beyond its being finite.

use super::csv::{self, Field, Reader};
use super::error::{Kind, ReadError, RowPlaces, no_column};
use super::parquet;
use crate::units::Unit;
use bytes::Bytes;
use std::collections::BTreeMap;

/// Numbers that a table may have, over all its columns.
pub const MAX_NUMBERS: usize = 10_000_000;

/// A column as it is declared.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    pub name: String,
    pub unit: Unit,
}

/// Numbers in SI, and where their rows are.
#[derive(Debug)]
pub struct Columns {
    pub numbers: Vec<Vec<f64>>,
    pub places: RowPlaces,
}

impl Columns {
    pub fn n_rows(&self) -> usize {
        self.numbers.first().map_or(0, Vec::len)
    }
}

/// Reads the declared columns of a file: Parquet by its first bytes, separated text otherwise.
pub fn read(bytes: &Bytes, wanted: &[Column]) -> Result<Columns, ReadError> {
    let columns =
        if bytes.starts_with(parquet::MAGIC) { of_parquet(bytes, wanted) } else { of_text(bytes, wanted) }?;
    if columns.n_rows() == 0 {
        return Err(ReadError::new(Kind::Missing, "the table has no row"));
    }
    Ok(columns)
}

fn of_parquet(bytes: &Bytes, wanted: &[Column]) -> Result<Columns, ReadError> {
    let names: Vec<&str> = wanted.iter().map(|column| column.name.as_str()).collect();
    let mut numbers = parquet::columns(bytes.clone(), &names, None, MAX_NUMBERS)?;
    let places = RowPlaces::Counted;
    let noted = parquet::units(bytes);
    for (column, values) in wanted.iter().zip(&mut numbers) {
        let factor = unit_of(bytes, &noted, column)?.unwrap_or(column.unit).factor();
        values.iter_mut().for_each(|value| *value *= factor);
        if let Some(row) = values.iter().position(|value| !value.is_finite()) {
            return Err(too_large(&column.name).at(places.of(row)));
        }
    }
    Ok(Columns { numbers, places })
}

/// The unit that a table of ours gives a column, which must measure what the scene says; nothing where the table says
/// nothing.
fn unit_of(
    bytes: &Bytes,
    noted: &BTreeMap<String, String>,
    column: &Column,
) -> Result<Option<Unit>, ReadError> {
    let Some(text) = noted.get(&column.name) else { return Ok(None) };
    // Units may differ from row to row.
    let text = match text.strip_prefix("see column ") {
        Some(other) => match one_word(bytes, other, &column.name)? {
            Some(word) => word,
            None => return Ok(None),
        },
        None => text.clone(),
    };
    let Ok(unit) = Unit::parse(&text) else { return Ok(None) };
    if unit.dimension == column.unit.dimension {
        return Ok(Some(unit));
    }
    let name = &column.name;
    let message = format!("the file says that column `{name}` is in {text}, and the scene says otherwise");
    Err(ReadError::new(Kind::Mismatch, message).help(format!("declare it as `{name} [{text}]`")))
}

/// What all rows of a column of words say.
fn one_word(bytes: &Bytes, name: &str, of: &str) -> Result<Option<String>, ReadError> {
    let mut first: Option<String> = None;
    let mut take = |row: usize, word: Option<&str>| match (&first, word) {
        (None, Some(word)) => {
            first = Some(word.to_owned());
            Ok(())
        }
        (Some(first), Some(word)) if first != word => {
            let message = format!("column `{of}` is in {first} above, and in {word} here");
            Err(ReadError::new(Kind::Mismatch, message)
                .at(RowPlaces::Counted.of(row))
                .help("keep only rows of one unit"))
        }
        _ => Ok(()),
    };
    parquet::columns(bytes.clone(), &[], Some((name, &mut take)), MAX_NUMBERS)?;
    Ok(first)
}

fn too_large(column: &str) -> ReadError {
    ReadError::new(Kind::Value, format!("the number in column `{column}` is too large for its unit"))
}

fn of_text(bytes: &[u8], wanted: &[Column]) -> Result<Columns, ReadError> {
    let text = csv::text(bytes)?;
    let mut reader = Reader::new(text, separator(text));
    let Some(first) = reader.record()? else {
        return Err(ReadError::new(Kind::Missing, "the file has no row"));
    };
    let is_header = first.iter().any(|field| begins_word(field.text.trim()));
    let order = if is_header { by_name(&first, wanted)? } else { (0..wanted.len()).collect() };
    let mut text = Text { wanted, order, n_fields: first.len(), numbers: vec![Vec::new(); wanted.len()] };
    let mut lines = Vec::new();
    if !is_header {
        text.check_count(&first)?;
        text.push(&first)?;
        lines.push(first[0].line);
    }
    while let Some(record) = reader.record()? {
        if record.len() != text.n_fields {
            let message = format!("{} fields here, and {} in the first line", record.len(), text.n_fields);
            let at = record[record.len().min(text.n_fields) - 1].place();
            return Err(ReadError::new(Kind::Damaged, message).at(at));
        }
        if (lines.len() + 1).saturating_mul(wanted.len()) > MAX_NUMBERS {
            return Err(parquet::too_many(MAX_NUMBERS));
        }
        text.push(&record)?;
        lines.push(record[0].line);
    }
    Ok(Columns { numbers: text.numbers, places: RowPlaces::Lines(lines) })
}

/// Semicolon or tabulator where the first line with fields has one outside of quotes, comma otherwise.
fn separator(text: &str) -> char {
    let first = text.lines().find(|line| !line.starts_with('#') && !line.trim().is_empty()).unwrap_or("");
    let mut is_quoted = false;
    let outside = first.chars().filter(|&c| {
        is_quoted ^= c == '"';
        !is_quoted
    });
    let outside: String = outside.collect();
    [';', '\t'].into_iter().find(|&c| outside.contains(c)).unwrap_or(',')
}

/// A header has a word; what is written instead of a number, such as `nan` and `-inf`, is none.
fn begins_word(text: &str) -> bool {
    let bare = text.trim_start_matches(['+', '-']).to_ascii_lowercase();
    let is_no_number = ["nan", "na", "n/a", "null", "inf", "infinity"].contains(&bare.as_str());
    text.chars().next().is_some_and(|c| c.is_alphabetic() || c == '_' || c == '°') && !is_no_number
}

/// Where the declared columns stand in a line of names.
fn by_name(header: &[Field], wanted: &[Column]) -> Result<Vec<usize>, ReadError> {
    let names: Vec<(String, Option<String>)> =
        header.iter().map(|field| name_and_unit(&field.text)).collect();
    let find = |column: &Column| {
        let mut found = names.iter().enumerate().filter(|(_, (name, _))| *name == column.name);
        let Some((idx, (_, unit))) = found.next() else {
            return Err(
                no_column(&column.name, names.iter().map(|(name, _)| name.as_str())).at(header[0].place())
            );
        };
        if let Some((again, _)) = found.next() {
            let message = format!("two columns are named `{}`", column.name);
            return Err(ReadError::new(Kind::Mismatch, message).at(header[again].place()));
        }
        check_unit(column, unit.as_deref()).map_err(|error| error.at(header[idx].place()))?;
        Ok(idx)
    };
    wanted.iter().map(find).collect()
}

/// `t [d]` and `t (d)` are the column `t` with its unit.
fn name_and_unit(text: &str) -> (String, Option<String>) {
    let text = text.trim();
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some((name, unit)) = text.strip_suffix(close).and_then(|rest| rest.split_once(open)) {
            return (name.trim().to_owned(), Some(unit.trim().to_owned()));
        }
    }
    (text.to_owned(), None)
}

/// A unit of the file that is one of ours must be the declared one; others say nothing.
fn check_unit(column: &Column, written: Option<&str>) -> Result<(), ReadError> {
    let Some((text, unit)) = written.and_then(|text| Some((text, Unit::parse(text).ok()?))) else {
        return Ok(());
    };
    let own = column.unit;
    if unit.dimension == own.dimension && unit.factor() == own.factor() {
        return Ok(());
    }
    let message =
        format!("the file says that column `{}` is in {text}, and the scene says otherwise", column.name);
    Err(ReadError::new(Kind::Mismatch, message).help("declare the column with the unit of the file"))
}

/// Columns of a text as they fill.
struct Text<'w> {
    wanted: &'w [Column],
    /// Field of each declared column.
    order: Vec<usize>,
    n_fields: usize,
    numbers: Vec<Vec<f64>>,
}

impl Text<'_> {
    /// Without names every field must be declared.
    fn check_count(&self, first: &[Field]) -> Result<(), ReadError> {
        let n = self.wanted.len();
        if first.len() == n {
            return Ok(());
        }
        let message = format!("{} fields here, and {n} columns declared", first.len());
        Err(ReadError::new(Kind::Mismatch, message)
            .at(first[first.len().min(n) - 1].place())
            .help("declare every column, or write a first line with the names of columns"))
    }

    fn push(&mut self, record: &[Field]) -> Result<(), ReadError> {
        for ((column, &idx), numbers) in self.wanted.iter().zip(&self.order).zip(&mut self.numbers) {
            let field = &record[idx];
            let text = field.text.trim();
            // The digits go to SI before they become binary: centimetres and metres give the same bits.
            let Some(value) = column.unit.to_si(text).filter(|_| csv::is_decimal(text)) else {
                csv::number(field, &column.name)?;
                return Err(too_large(&column.name).at(field.place()));
            };
            numbers.push(value);
        }
        Ok(())
    }
}

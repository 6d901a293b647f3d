//! Comma-separated tables of a flow with a line of names.
//!
//! Owns the way from records to rows of a flow. May use the records and the tables. It deliberately guesses
//! nothing: another separator is a message and not a try.

use super::error::{Kind, ReadError};
use super::table::{Frame, Layout, Raw, RowPlaces, axis_of, no_column};
use crate::data::csv::{Field, Reader, number, text};
use crate::flow::FaceFlow;

/// The flow of a table as text. Lines that start with `#` and empty lines are passed over; the first other
/// line names the columns.
pub fn flow(bytes: &[u8], layout: &Layout, frame: &Frame) -> Result<FaceFlow, ReadError> {
    layout.flow(raw(bytes, layout)?, frame)
}

fn raw(bytes: &[u8], layout: &Layout) -> Result<Raw, ReadError> {
    let mut reader = Reader::new(text(bytes)?, ',');
    let Some(names) = reader.record()? else {
        return Err(ReadError::new(Kind::Missing, "the file has no line with the names of columns"));
    };
    check_separator(&names)?;
    let column = |name: &str| {
        let mut found = names.iter().enumerate().filter(|(_, field)| field.text.trim() == name);
        let (idx, _) = found.next().ok_or_else(|| {
            no_column(name, names.iter().map(|field| field.text.trim())).at(names[0].place())
        })?;
        match found.next() {
            None => Ok(idx),
            Some((_, again)) => {
                Err(ReadError::new(Kind::Mismatch, format!("two columns are named `{name}`"))
                    .at(again.place()))
            }
        }
    };
    let wanted: Vec<usize> =
        layout.numeric().iter().map(|wanted| column(&wanted.name)).collect::<Result<_, _>>()?;
    let normal = layout.normal().map(column).transpose()?;
    let mut raw = Raw { numbers: vec![Vec::new(); wanted.len()], ..Raw::default() };
    let mut lines = Vec::new();
    let n_columns = names.len();
    let names: Vec<String> = names.iter().map(|field| field.text.trim().to_owned()).collect();
    while let Some(record) = reader.record()? {
        if record.len() != n_columns {
            let message = format!("{} fields, the line of names has {n_columns}", record.len());
            return Err(
                ReadError::new(Kind::Damaged, message).at(record[record.len().min(n_columns) - 1].place())
            );
        }
        for (&idx, numbers) in wanted.iter().zip(&mut raw.numbers) {
            numbers.push(number(&record[idx], &names[idx])?);
        }
        if let Some(idx) = normal {
            raw.normals.push(axis_of(&record[idx].text).ok_or_else(|| {
                let message = format!("`{}` in column `{}` is no axis", record[idx].shown(), names[idx]);
                ReadError::new(Kind::Value, message).at(record[idx].place()).help("write x, y or z")
            })?);
        }
        lines.push(record[0].line);
    }
    raw.places = RowPlaces::Lines(lines);
    Ok(raw)
}

/// The usual slip: one column whose name is the whole line.
fn check_separator(names: &[Field]) -> Result<(), ReadError> {
    let [only] = names else { return Ok(()) };
    let Some(found) = [';', '\t'].into_iter().find(|&c| only.text.contains(c)) else { return Ok(()) };
    let name = if found == ';' { "semicolons" } else { "tabulators" };
    Err(ReadError::new(Kind::Unsupported, format!("the columns are separated by {name}"))
        .at(only.place())
        .help("separate columns by commas, and write decimal points"))
}

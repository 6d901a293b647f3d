//! Points of a density: columns of a table, as far as their rows are wanted.
//!
//! Owns the choice of columns, rows and units. May use the readers of tables. It deliberately estimates nothing.

use super::density::{Arguments, wrong};
use super::files::read_data;
use super::{Exit, Stopped};
use lamella::data::{Column, DataFile, Kind, MAX_NUMBERS, Place, ReadError, columns, parquet};
use lamella::diagnostic::{Diagnostic, codes};
use lamella::units::{Dimension, Unit};
use std::path::Path;

/// Numbers in SI where units are known, weights after coordinates, velocities last; the factors of coordinates and the units of
/// coordinates and weights.
pub(super) struct Points {
    pub(super) hash: String,
    pub(super) names: Vec<String>,
    pub(super) factors: Vec<f64>,
    pub(super) units: Vec<String>,
    pub(super) dimensions: Vec<Dimension>,
    pub(super) numbers: Vec<Vec<f64>>,
}

impl Points {
    pub(super) fn read(arguments: &Arguments) -> Result<Self, Stopped> {
        let d = arguments.domain.len();
        let names: Vec<String> = match arguments.columns.len() {
            0 => ["x", "y", "z"].into_iter().take(d).map(str::to_owned).collect(),
            _ => arguments.columns.clone(),
        };
        if d > 3 || names.len() != d {
            return Err(wrong("a domain has one to three axes, and as many columns"));
        }
        let bytes = read_data(&arguments.file)?;
        let file = DataFile::new(arguments.file.display().to_string(), bytes);
        let noted = file.units();
        let unit_of = |name: &String, given: Option<&(String, Unit)>| -> (String, Unit) {
            let noted = || noted.get(name).and_then(|text| Some((text.clone(), Unit::parse(text).ok()?)));
            given.cloned().or_else(noted).unwrap_or((String::new(), Unit::ONE))
        };
        for (name, axis) in names.iter().zip(&arguments.domain) {
            let of_file = noted.get(name).and_then(|text| Some((text, Unit::parse(text).ok()?)));
            if let (Some((text, known)), Some((given, unit))) = (of_file, &axis.unit)
                && known.dimension != unit.dimension
            {
                let message =
                    format!("the file says that column `{name}` is in {text}, and --domain says {given}");
                return Err(wrong(&message));
            }
        }
        let mut units: Vec<(String, Unit)> = names
            .iter()
            .zip(&arguments.domain)
            .map(|(name, axis)| unit_of(name, axis.unit.as_ref()))
            .collect();
        let mut wanted = names;
        if let Some(weight) = &arguments.weight {
            units.push(unit_of(weight, None));
            wanted.push(weight.clone());
        }
        let velocities: Vec<Unit> = arguments.velocity.iter().map(|name| unit_of(name, None).1).collect();
        if velocities.iter().any(|unit| unit.dimension != velocities[0].dimension) {
            return Err(wrong("columns of --velocity have units of different kinds"));
        }
        let of_points = wanted.iter().zip(units.iter().map(|(_, unit)| unit));
        let declared: Vec<Column> = of_points
            .chain(arguments.velocity.iter().zip(&velocities))
            .map(|(name, unit)| Column { name: name.clone(), unit: *unit })
            .collect();
        let found =
            columns::read(&file.bytes, &declared).map_err(|error| unreadable(&arguments.file, &error))?;
        let weights = found.numbers.get(d).filter(|_| arguments.weight.is_some());
        if let Some(row) = weights.and_then(|own| own.iter().position(|weight| *weight < 0.0)) {
            let error =
                ReadError::new(lamella::data::Kind::Value, "a weight is below zero").at(found.places.of(row));
            return Err(unreadable(&arguments.file, &error));
        }
        Ok(Points {
            hash: file.hash.clone(),
            factors: units[..d].iter().map(|(_, unit)| unit.factor()).collect(),
            units: units.iter().map(|(text, unit)| si(text, unit)).collect(),
            dimensions: units.iter().map(|(_, unit)| unit.dimension).collect(),
            names: wanted,
            numbers: selected(arguments, &file, found.numbers)?,
        })
    }
}

/// The name of what numbers are in.
fn si(text: &str, unit: &Unit) -> String {
    if text.is_empty() || text == "1" { String::new() } else { lamella::table::si_text(unit.dimension) }
}

/// The rows of which all conditions hold.
fn selected(
    arguments: &Arguments,
    file: &DataFile,
    numbers: Vec<Vec<f64>>,
) -> Result<Vec<Vec<f64>>, Stopped> {
    if arguments.conditions.is_empty() {
        return Ok(numbers);
    }
    let mut is_wanted = vec![true; numbers.first().map_or(0, Vec::len)];
    for (name, value) in &arguments.conditions {
        let number = value.trim().parse::<f64>().ok();
        let holds = number.map(|number| equals(file, name, number));
        let holds = match holds {
            Some(Ok(holds)) => Ok(holds),
            // A word may look like a number.
            Some(Err(error)) => reads(file, name, value.trim()).map_err(|_| error),
            None => reads(file, name, value.trim()),
        };
        let holds = holds.map_err(|error| unreadable(&arguments.file, &error))?;
        is_wanted.iter_mut().zip(holds).for_each(|(all, own)| *all &= own);
    }
    if !is_wanted.contains(&true) {
        return Err(wrong("no row has all that --where asks for"));
    }
    let of_column = |column: &Vec<f64>| {
        column
            .iter()
            .zip(&is_wanted)
            .filter(|(_, is_wanted)| **is_wanted)
            .map(|(number, _)| *number)
            .collect()
    };
    Ok(numbers.iter().map(of_column).collect())
}

/// Rows that have a number in a column, as the file writes it, to rounding.
fn equals(file: &DataFile, name: &str, number: f64) -> Result<Vec<bool>, ReadError> {
    let unit = file.units().get(name).and_then(|text| Unit::parse(text).ok()).unwrap_or(Unit::ONE);
    let columns = file.columns(&[Column { name: name.to_owned(), unit }])?;
    let wanted = number * unit.factor();
    let is_near = |own: &f64| (own - wanted).abs() <= 1e-9 * wanted.abs().max(own.abs());
    Ok(columns.numbers[0].iter().map(is_near).collect())
}

/// Rows that have a word in a column.
fn reads(file: &DataFile, name: &str, word: &str) -> Result<Vec<bool>, ReadError> {
    if !file.bytes.starts_with(parquet::MAGIC) {
        let message =
            format!("column `{name}` is compared with the word `{word}`, which only Parquet files can have");
        return Err(ReadError::new(Kind::Unsupported, message).help("leave out the other rows of the file"));
    }
    let mut holds = Vec::new();
    let mut take = |_: usize, own: Option<&str>| {
        holds.push(own == Some(word));
        Ok(())
    };
    parquet::columns(file.bytes.clone(), &[], Some((name, &mut take)), MAX_NUMBERS)?;
    Ok(holds)
}

fn unreadable(file: &Path, error: &ReadError) -> Stopped {
    let place = match error.place {
        None => String::new(),
        Some(Place::Byte(at)) => format!(" (byte {at})"),
        Some(Place::Text { line, column }) => format!(" (line {line}, column {column})"),
        Some(Place::Row(row)) => format!(" (row {row})"),
    };
    let message = format!("cannot take points from {}: {}{place}", file.display(), error.message);
    let message = Diagnostic::error(codes::F101, message);
    Stopped::new(
        Exit::SceneWrong,
        match &error.help {
            Some(help) => message.help(help.clone()),
            None => message,
        },
    )
}

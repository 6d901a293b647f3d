//! Columns, units and names in the entries of a flow from files.
//!
//! Owns their checks. May use the scenario's slots. It deliberately knows no entry by its name: callers say what an
//! entry is for.

use super::super::check::Checker;
use super::flow_file::FileColumn;
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{D009, M004, U104};
use crate::source::Span;
use crate::syntax::tree::{Column, FileEntry, FileValue, Name, Number, Text};
use crate::units::Dimension;

pub fn of_faces(checker: &mut Checker<'_>, at: Span, what: &str) {
    checker.report(
        Diagnostic::error(M004, format!("{what} belongs to cells, and this flow is given at their faces"))
            .at(at, "a face lies between two cells")
            .found(what.to_owned())
            .expected("`discharge`, the water per area of the medium"),
    );
}

pub fn wrong_value<T>(
    checker: &mut Checker<'_>,
    entry: &FileEntry,
    expected: &str,
    example: &str,
) -> Option<T> {
    let found = match &entry.value {
        FileValue::Unit(_) => "a unit",
        FileValue::Value(_) => "a value",
        FileValue::Columns(_) => "names",
    };
    checker.report(
        Diagnostic::error(M004, format!("`{}` needs {expected}", entry.word.value))
            .at(entry.word.span, format!("{found} after this"))
            .found(found)
            .expected(expected.to_owned())
            .help(format!("write for example `{example}`")),
    );
    None
}

pub fn unit_of<'a>(checker: &mut Checker<'a>, entry: &'a FileEntry, dimension: Dimension) -> Option<f64> {
    let FileValue::Unit(unit) = &entry.value else {
        let example = format!("{} [{}]", entry.word.value, unit_example(dimension));
        return wrong_value(checker, entry, "the unit of the file in brackets", &example);
    };
    factor(checker, unit, &format!("`{}`", entry.word.value), dimension)
}

fn unit_example(dimension: Dimension) -> &'static str {
    match dimension {
        Dimension::LENGTH => "m",
        Dimension::TIME => "d",
        _ => "m/d",
    }
}

/// What one of a unit is in SI.
fn factor(checker: &mut Checker<'_>, unit: &Name, what: &str, dimension: Dimension) -> Option<f64> {
    let one = Number { digits: "1".to_owned(), unit: Some(unit.clone()) };
    let value = checker.number(&one, unit.span)?;
    let found = value.kind.describe();
    if value.kind.dimension() != Some(dimension) {
        checker.report(
            Diagnostic::error(U104, format!("{what} has the wrong dimension"))
                .at(unit.span, format!("this is {found}"))
                .found(found)
                .expected(dimension.describe()),
        );
        return None;
    }
    value.value()
}

fn columns<'a>(
    checker: &mut Checker<'a>,
    entry: &'a FileEntry,
    dimension: Dimension,
) -> Option<&'a [Column]> {
    let FileValue::Columns(list) = &entry.value else {
        let unit = if dimension == Dimension::NONE {
            String::new()
        } else {
            format!(" [{}]", unit_example(dimension))
        };
        let example = format!("{} NAME{unit}", entry.word.value);
        return wrong_value(checker, entry, "the name of a column", &example);
    };
    Some(list)
}

fn read_column<'a>(
    checker: &mut Checker<'a>,
    column: &'a Column,
    dimension: Dimension,
) -> Option<FileColumn> {
    let name = column.name.value.clone();
    let Some(unit) = &column.unit else {
        if dimension == Dimension::NONE {
            return Some(FileColumn { name, factor: 1.0 });
        }
        checker.report(
            Diagnostic::error(U104, format!("column `{name}` has no unit"))
                .at(column.name.span, "no unit after this")
                .found("no unit")
                .expected(dimension.describe())
                .help(format!(
                    "write the unit of the file behind it, such as `[{}]`",
                    unit_example(dimension)
                )),
        );
        return None;
    };
    let factor = factor(checker, unit, &format!("column `{name}`"), dimension)?;
    Some(FileColumn { name, factor })
}

pub fn per_axis<'a>(
    checker: &mut Checker<'a>,
    entry: &'a FileEntry,
    dimension: Dimension,
) -> Option<Vec<FileColumn>> {
    let list = columns(checker, entry, dimension)?;
    let n_axes = checker.axes.len();
    if list.len() != n_axes {
        checker.report(
            Diagnostic::error(
                D009,
                format!("`{}` needs one column for each axis of the domain", entry.word.value),
            )
            .at(entry.word.span, format!("{} here", list.len()))
            .found(format!("{} columns", list.len()))
            .expected(format!("{n_axes} columns")),
        );
        return None;
    }
    list.iter()
        .map(|column| read_column(checker, column, dimension))
        .collect::<Vec<_>>()
        .into_iter()
        .collect()
}

pub fn single<'a>(
    checker: &mut Checker<'a>,
    entry: &'a FileEntry,
    dimension: Dimension,
) -> Option<FileColumn> {
    let list = columns(checker, entry, dimension)?;
    let [column] = list else {
        checker.report(
            Diagnostic::error(D009, format!("`{}` is one column", entry.word.value))
                .at(entry.word.span, format!("{} here", list.len()))
                .found(format!("{} columns", list.len()))
                .expected("1 column"),
        );
        return None;
    };
    read_column(checker, column, dimension)
}

/// An entry that is one name without a unit.
pub fn only_name<'a>(checker: &mut Checker<'a>, entry: &'a FileEntry, example: &str) -> Option<&'a Column> {
    match &entry.value {
        FileValue::Columns(list) if list.len() == 1 && list[0].unit.is_none() => list.first(),
        _ => wrong_value(checker, entry, "one name", example),
    }
}

pub fn only_text<'a>(checker: &mut Checker<'a>, entry: &'a FileEntry, example: &str) -> Option<&'a Text> {
    match &entry.value {
        FileValue::Columns(list) if list.len() == 1 && list[0].is_quoted && list[0].unit.is_none() => {
            list.first().map(|column| &column.name)
        }
        _ => wrong_value(checker, entry, "one file name in quotes", example),
    }
}

pub fn has_ending(name: &Text, endings: &[&str]) -> bool {
    let ending = name.value.rsplit_once('.').map(|(_, ending)| ending.to_ascii_lowercase());
    ending.is_some_and(|ending| endings.contains(&ending.as_str()))
}

pub fn unknown_format(checker: &mut Checker<'_>, name: &Text, expected: &str) {
    checker.report(
        Diagnostic::error(M004, format!("the format of \"{}\" is not known here", name.value))
            .at(name.span, "the ending of the name says the format")
            .found(format!("\"{}\"", name.value))
            .expected(expected.to_owned()),
    );
}

/// Whether the one file of a table is Parquet.
pub fn table_format(checker: &mut Checker<'_>, names: &[Text]) -> Option<bool> {
    if let [_, second, ..] = names {
        checker.report(
            Diagnostic::error(D009, "the table of a flow is one file")
                .at(second.span, "a second file")
                .found(format!("{} files", names.len()))
                .expected("1 file"),
        );
        return None;
    }
    let name = names.first()?;
    if has_ending(name, &["parquet"]) {
        return Some(true);
    }
    if has_ending(name, &["csv", "txt"]) {
        return Some(false);
    }
    unknown_format(checker, name, "a table that ends in `.csv` or `.parquet`");
    None
}

//! Sources at the places of a table: each row gives its own amount.
//!
//! Owns which columns are places and amounts, and what is wrong with rows. May use tables and the checker. It
//! deliberately cuts nothing into particles.

use super::super::check::Checker;
use super::super::expression::{Expr, Type};
use super::super::model::species_index;
use super::source::{dimensions, report_dimension};
use super::{Region, Strength};
use crate::data::{Cloud, Columns};
use crate::diagnostic::codes::{T105, U104};
use crate::diagnostic::{Diagnostic, precise};
use crate::syntax::tree;
use crate::units::Dimension;
use std::sync::Arc;

/// Rows that one message names.
const NAMED: usize = 3;

/// What a column of a table gives of a species, and where.
pub(super) fn rows<'a>(
    checker: &mut Checker<'a>,
    table: &'a tree::Data,
    written: &'a tree::Source,
    assignment: &'a tree::Assignment,
) -> Option<((usize, Strength), Region)> {
    let species = species_index(checker, &assignment.name)?;
    let known = checker.tables.get(&table.name.value).cloned().flatten()?;
    let n_axes = checker.axes.len();
    let of_table = checker.column_of(&assignment.value).filter(|(own, ..)| std::ptr::eq(*own, table));
    let Some((_, _, value)) = of_table.filter(|(.., idx)| *idx >= n_axes) else {
        let name = &table.name.value;
        let amounts: Vec<String> =
            known.columns.iter().skip(n_axes).map(|column| format!("`{name}.{}`", column.name)).collect();
        let expected =
            if amounts.is_empty() { "a column after the coordinates".to_owned() } else { amounts.join(", ") };
        checker.report(
            Diagnostic::error(
                T105,
                format!("a source at the places of `{name}` takes its amounts from there"),
            )
            .at(assignment.value.span, "no column of amounts of this table")
            .also(written.region.span, "at these places")
            .found("another value")
            .expected(expected),
        );
        return None;
    };
    for column in &known.columns[..n_axes] {
        if column.unit.dimension != Dimension::LENGTH {
            let found = Type::Number(column.unit.dimension).describe();
            checker.report(
                Diagnostic::error(U104, format!("column `{}` is no coordinate of a place", column.name))
                    .at(written.region.span, format!("`{}` is {found}", column.name))
                    .also(table.name.span, "its first columns are the place, one for each axis of the domain")
                    .found(found)
                    .expected("a length (m)"),
            );
            return None;
        }
    }
    let concentration = checker.concentration_of(species)?;
    let wanted = dimensions(concentration, n_axes);
    let kind = Type::Number(known.columns[value].unit.dimension);
    let Some(found @ 1..) = wanted.iter().position(|own| Type::Number(*own) == kind) else {
        report_dimension(checker, assignment, kind, wanted, n_axes);
        return None;
    };
    // They have been read before: a mistake has been told.
    let columns = known.file.columns(&known.columns).ok()?;
    check_places(checker, &columns, n_axes, written, table)?;
    check_amounts(checker, &columns, value, written, table)?;
    let parts = columns.numbers[..n_axes].iter().chain([&columns.numbers[value]]).cloned().collect();
    let cloud = Cloud::new(parts).ok()?;
    let total = cloud.cumulative().last().copied().unwrap_or(0.0);
    let strength = match found {
        1 => Strength::Rate(Expr::constant(total, kind, assignment.value.span)),
        _ => Strength::Pulse(total),
    };
    Some(((species, strength), Region::Table(Arc::new(cloud))))
}

fn check_places(
    checker: &mut Checker<'_>,
    columns: &Columns,
    n_axes: usize,
    written: &tree::Source,
    table: &tree::Data,
) -> Option<()> {
    let mut extents = checker.extents.clone();
    extents.sort_by_key(|(index, ..)| *index);
    let outside = |row: usize| {
        extents.iter().take(n_axes).zip(&columns.numbers).find_map(|((index, low, high), numbers)| {
            let at = numbers[row];
            (!(low..=high).contains(&&at)).then(|| format!("{} = {} m", ["x", "y", "z"][*index], precise(at)))
        })
    };
    let wrong = (0..columns.n_rows()).filter_map(|row| Some((row, outside(row)?)));
    tell(checker, columns, wrong, "lie outside of the domain", "places within the domain", (written, table))
}

fn check_amounts(
    checker: &mut Checker<'_>,
    columns: &Columns,
    value: usize,
    written: &tree::Source,
    table: &tree::Data,
) -> Option<()> {
    let amounts = columns.numbers[value].iter().enumerate();
    let wrong = amounts.filter(|(_, amount)| **amount < 0.0);
    let wrong = wrong.map(|(row, amount)| (row, format!("{} (SI)", precise(*amount))));
    tell(checker, columns, wrong, "give less than nothing", "amounts of zero and more", (written, table))
}

/// One message about all rows that are wrong; names the first of them.
fn tell(
    checker: &mut Checker<'_>,
    columns: &Columns,
    mut wrong: impl Iterator<Item = (usize, String)>,
    what: &str,
    expected: &str,
    (written, table): (&tree::Source, &tree::Data),
) -> Option<()> {
    let named: Vec<String> = wrong
        .by_ref()
        .take(NAMED)
        .map(|(row, found)| format!("{}: {found}", columns.places.of(row)))
        .collect();
    if named.is_empty() {
        return Some(());
    }
    let n = named.len() + wrong.count();
    let rest = if n > named.len() { format!("; {} more", n - named.len()) } else { String::new() };
    let found = if n == 1 { "1 row".to_owned() } else { format!("{n} rows") };
    checker.report(
        Diagnostic::error(T105, format!("rows of `{}` {what}", table.name.value))
            .at(written.region.span, format!("{}{rest}", named.join("; ")))
            .also(table.path.span, "in this file")
            .found(found)
            .expected(expected),
    );
    None
}

//! Dispersion: a tensor, a coefficient over the place, or lengths along the flow.
//!
//! Owns the statement. May use the scenario's slots. It deliberately makes no tensor of lengths: that hangs
//! on the velocity of the place.

use super::super::check::{Allow, Checker};
use super::super::collect::Statements;
use super::super::slot::tuple_parts;
use super::Dispersion;
use crate::diagnostic::codes::{D009, M001, M002, M008};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::{Span, Spanned};
use crate::syntax::tree;
use crate::units::Dimension;

/// `Some(None)`: there is no `dispersion` statement.
pub fn dispersion<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
) -> Option<Option<Spanned<Dispersion>>> {
    let Some((span, statement)) = statements.dispersion else { return Some(None) };
    let dispersion = match statement {
        tree::Dispersion::Value(written) => value(checker, written)?,
        tree::Dispersion::Parts(fields) => parts(checker, span, fields)?,
    };
    Some(Some(Spanned::new(dispersion, span)))
}

fn value<'a>(checker: &mut Checker<'a>, written: &'a tree::Expr) -> Option<Dispersion> {
    let indices: Vec<usize> = checker.axes.iter().map(|(_, index)| *index).collect();
    let rows = tuple_parts(written);
    let mut tensor = [[0.0; 3]; 3];
    let is_tensor = rows.iter().any(|row| matches!(row.kind, tree::ExprKind::Tuple(_)));
    if rows.len() == 1 {
        let what = "the dispersion coefficient";
        let checked = checker.check(written, Allow::PLACE)?;
        checker.expect_dimension(written, &checked, what, &[Dimension::DISPERSION])?;
        let Some(value) = checked.value() else { return Some(Dispersion::Isotropic(checked)) };
        indices.iter().for_each(|&index| tensor[index][index] = value);
    } else if is_tensor {
        read_tensor(checker, written, &rows, &indices, &mut tensor)?;
    } else {
        let diagonal = checker.vector(written, "a diagonal dispersion tensor", Dimension::DISPERSION)?;
        indices.iter().for_each(|&index| tensor[index][index] = diagonal[index]);
    }
    check_tensor(checker, written, &tensor)?;
    Some(Dispersion::Tensor(tensor))
}

fn read_tensor<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Expr,
    rows: &[&'a tree::Expr],
    indices: &[usize],
    tensor: &mut [[f64; 3]; 3],
) -> Option<()> {
    if rows.len() != indices.len() {
        checker.report(
            Diagnostic::error(D009, "a dispersion tensor has a row for each axis of the domain")
                .at(written.span, format!("{} rows here", rows.len()))
                .found(format!("{} rows", rows.len()))
                .expected(format!("{} rows", indices.len())),
        );
        return None;
    }
    let mut is_right = true;
    for (row, &index) in rows.iter().zip(indices) {
        match checker.vector(row, "a row of the dispersion tensor", Dimension::DISPERSION) {
            Some(values) => tensor[index] = values,
            None => is_right = false,
        }
    }
    is_right.then_some(())
}

/// A dispersion tensor is symmetric and has no negative eigenvalue.
fn check_tensor(checker: &mut Checker<'_>, written: &tree::Expr, tensor: &[[f64; 3]; 3]) -> Option<()> {
    let matrix = nalgebra::Matrix3::from_fn(|row, column| tensor[row][column]);
    let largest = matrix.amax();
    let is_symmetric = (matrix - matrix.transpose()).amax() <= 1e-12 * largest;
    let smallest = if is_symmetric { matrix.symmetric_eigenvalues().min() } else { 0.0 };
    let (label, found) = if !is_symmetric {
        ("it is not symmetric".to_owned(), "a tensor that is not symmetric".to_owned())
    } else if smallest < -1e-12 * largest {
        let found = format!("the negative eigenvalue {} m^2/s", precise(smallest));
        (format!("it has {found}"), found)
    } else {
        return Some(());
    };
    checker.report(
        Diagnostic::error(M008, "this is no dispersion tensor")
            .at(written.span, label)
            .found(found)
            .expected("a symmetric tensor without negative eigenvalues; one value is not negative"),
    );
    None
}

const WORDS: &[(&str, usize)] =
    &[("longitudinal", 0), ("transverse", 1), ("transverse_vertical", 2), ("molecular", 3)];

/// `longitudinal a, transverse b, molecular m` in any order: physics has no default.
fn parts<'a>(checker: &mut Checker<'a>, span: Span, fields: &'a [tree::Field]) -> Option<Dispersion> {
    let mut found: [Option<(f64, Span)>; 4] = [None; 4];
    let mut is_right = true;
    for field in fields {
        let Some(part) = checker.word(&field.name, "a part of the dispersion", WORDS) else {
            is_right = false;
            continue;
        };
        if let Some((_, first)) = found[part] {
            checker.report(
                Diagnostic::error(M002, format!("`{}` is given twice", field.name.value))
                    .at(field.name.span, "here again")
                    .also(first, "first here")
                    .found("one part twice")
                    .expected("each part once"),
            );
            is_right = false;
            continue;
        }
        let what = format!("`{}`", field.name.value);
        let dimension = if part == 3 { Dimension::DISPERSION } else { Dimension::LENGTH };
        // A wrong value is not a missing one.
        found[part] = Some((0.0, field.name.span));
        let Some(value) = checker.slot(&field.value, &what, dimension) else {
            is_right = false;
            continue;
        };
        let found_text = format!("{} {}", precise(value.value), dimension.unit_text());
        is_right &=
            checker.require(value.value >= 0.0, &what, found_text, "zero or more", value.span).is_some();
        found[part] = Some((value.value, field.name.span));
    }
    let n_axes = checker.axes.len();
    let example = ["longitudinal 0.5 m", "transverse 0.05 m", "", "molecular 1e-9 m^2/s"];
    for part in [0, 1, 3] {
        // A line has no direction across.
        if found[part].is_some() || (part == 1 && n_axes == 1) {
            continue;
        }
        checker.report(
            Diagnostic::error(M001, format!("the dispersion has no `{}` part", WORDS[part].0))
                .at(span, "parts without it")
                .found(format!("no `{}`", WORDS[part].0))
                .expected("`longitudinal`, `transverse` and `molecular`; a line needs no `transverse`")
                .help(format!(
                    "add for example `, {}`; a part that is zero is written as `0`",
                    example[part]
                )),
        );
        is_right = false;
    }
    is_right.then_some(())?;
    let value = |part: usize| found[part].map(|(value, _)| value);
    let transverse = value(1).unwrap_or(0.0);
    Some(Dispersion::Parts {
        longitudinal: value(0)?,
        transverse,
        transverse_vertical: value(2).unwrap_or(transverse),
        molecular: value(3)?,
    })
}

//! How the water moves, and the porosity that it moves in.
//!
//! Owns these statements but for what is solved for. May use the scenario's slots. It deliberately looks at
//! no place: whether water is kept is seen in the plan.

use super::super::check::{Allow, Checker};
use super::super::collect::Statements;
use super::super::expression::Expr;
use super::super::slot::tuple_parts;
use super::Flow;
use super::change::changes;
use super::file::FileKind;
use crate::diagnostic::codes::{D009, M001, M002, M004};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::Spanned;
use crate::syntax::tree::{self, FlowArgument};
use crate::units::Dimension;

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Uniform,
    Velocity,
    Darcy,
    File(FileKind),
}

const KINDS: &[(&str, Kind)] = &[
    ("uniform", Kind::Uniform),
    ("velocity", Kind::Velocity),
    ("darcy", Kind::Darcy),
    ("table", Kind::File(FileKind::Table)),
    ("grid", Kind::File(FileKind::Grid)),
    ("modflow", Kind::File(FileKind::Modflow)),
];

/// `Some(None)`: there is no flow statement, and nothing flows.
pub fn flow<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> Option<Option<Spanned<Flow>>> {
    let Some((span, statement)) = statements.flow else { return Some(None) };
    let kind = checker.word(&statement.kind, "a kind of flow", KINDS)?;
    let flow = match (kind, &statement.argument) {
        (Kind::Uniform, FlowArgument::Value(value)) => {
            velocity(checker, value, Allow::TIME, statement.change.as_ref())?
        }
        (Kind::Velocity, FlowArgument::Assigned(value)) => {
            velocity(checker, value, Allow::REFERENCE, statement.change.as_ref())?
        }
        (Kind::Darcy, FlowArgument::Entries(entries)) if statement.change.is_none() => {
            Flow::Darcy(Box::new(super::darcy::darcy(checker, statement, entries)?))
        }
        (Kind::File(kind), FlowArgument::Files(names, entries)) => {
            Flow::File(Box::new(super::file::file(checker, kind, &statement.kind, names, entries)?))
        }
        _ => {
            report_argument(checker, kind, statement);
            return None;
        }
    };
    Some(Some(Spanned::new(flow, span)))
}

fn report_argument(checker: &mut Checker<'_>, kind: Kind, statement: &tree::Flow) {
    let (message, label, expected) = match kind {
        Kind::Uniform => {
            ("`flow uniform` needs a velocity", "no velocity after this", "a velocity, such as `1 m/d`")
        }
        Kind::Velocity => (
            "`flow velocity` needs its expressions",
            "no `=` and expressions after this",
            "`= (u, v)`, one expression for each axis",
        ),
        Kind::Darcy => ("`flow darcy` needs its entries", "no `{ … }` after this", "`{`, entries, `}`"),
        Kind::File(FileKind::Table) => (
            "`flow table` needs a file and its columns",
            "no file name in quotes after this",
            "`\"field.csv\" { at …; velocity … }`",
        ),
        Kind::File(FileKind::Grid) => (
            "`flow grid` needs its files",
            "no file name in quotes after this",
            "`\"v.npy\" { velocity [m/d] }`",
        ),
        Kind::File(FileKind::Modflow) => (
            "`flow modflow` needs a budget file",
            "no file name in quotes after this",
            "`\"model.bud\" { grid \"model.dis.grb\"; length [m]; time [d] }`",
        ),
    };
    let found = match statement.argument {
        FlowArgument::None => "the end of the statement",
        FlowArgument::Value(_) => "a value",
        FlowArgument::Assigned(_) => "`=`",
        FlowArgument::Entries(_) => "`{`",
        FlowArgument::Files(..) => "a file",
    };
    checker.report(
        Diagnostic::error(M004, message).at(statement.kind.span, label).found(found).expected(expected),
    );
}

/// An expression for each axis; constants make it uniform.
fn velocity<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Expr,
    allow: Allow,
    change: Option<&'a tree::Change>,
) -> Option<Flow> {
    let changes = changes(checker, change);
    let parts = tuple_parts(written);
    let indices: Vec<usize> = checker.axes.iter().map(|(_, index)| *index).collect();
    if parts.len() != indices.len() && !allow.position {
        checker.vector(written, "the velocity", Dimension::VELOCITY);
        return None;
    }
    if parts.len() != indices.len() {
        checker.report(
            Diagnostic::error(D009, "the velocity needs one expression for each axis of the domain")
                .at(written.span, format!("{} here", parts.len()))
                .found(if parts.len() == 1 {
                    "1 expression".to_owned()
                } else {
                    format!("{} expressions", parts.len())
                })
                .expected(format!("{} expressions", indices.len())),
        );
        return None;
    }
    let mut list: Vec<Option<Expr>> = Vec::new();
    for part in parts {
        let value = checker.check(part, allow);
        let is_right = value
            .as_ref()
            .and_then(|value| checker.expect_dimension(part, value, "the velocity", &[Dimension::VELOCITY]));
        list.push(value.filter(|_| is_right.is_some()));
    }
    let list: Vec<Expr> = list.into_iter().collect::<Option<_>>()?;
    let constants: Option<Vec<f64>> = list.iter().map(Expr::value).collect();
    Some(match constants {
        Some(values) => {
            let mut velocity = [0.0; 3];
            indices.iter().zip(values).for_each(|(&index, value)| velocity[index] = value);
            Flow::Uniform(velocity)
        }
        None => Flow::Expression(list, changes?),
    })
}

/// `Some(None)`: no medium but water.
pub fn porosity<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> Option<Option<Spanned<Expr>>> {
    let Some((span, fields)) = statements.medium else { return Some(None) };
    let mut found: Option<(&tree::Name, Option<Expr>)> = None;
    for field in fields {
        checker.word(&field.name, "a property of the medium", &[("porosity", ())])?;
        if let Some((first, _)) = &found {
            checker.report(
                Diagnostic::error(M002, "the porosity is given twice")
                    .at(field.name.span, "here again")
                    .also(first.span, "first here")
                    .found("two porosities")
                    .expected("one porosity"),
            );
            return None;
        }
        found = Some((&field.name, read_porosity(checker, &field.value)));
    }
    let Some((_, porosity)) = found else {
        checker.report(
            Diagnostic::error(M001, "the medium has no porosity")
                .at(span, "no `porosity` here")
                .found("no `porosity`")
                .expected("`porosity` and a number"),
        );
        return None;
    };
    Some(Some(Spanned::new(porosity?, span)))
}

/// A column of porosity and a statement of it say two things.
pub fn one_porosity(checker: &mut Checker<'_>, statements: &Statements<'_>, flow: Option<&Spanned<Flow>>) {
    let (Some((medium, _)), Some(Spanned { value: Flow::File(file), .. })) = (statements.medium, flow) else {
        return;
    };
    let (Some(column), Some(named)) = (file.porosity_span, file.file.files.first()) else { return };
    checker.report(
        Diagnostic::error(M002, "the porosity is given twice")
            .at(medium, "by this statement")
            .also(column, format!("and by a column of \"{}\"", named.name))
            .found("two porosities")
            .expected("one porosity")
            .help("leave out the `medium`, or the `porosity` of the flow"),
    );
}

fn read_porosity<'a>(checker: &mut Checker<'a>, written: &'a tree::Expr) -> Option<Expr> {
    let value = checker.check(written, Allow::PLACE)?;
    checker.expect_dimension(written, &value, "the porosity", &[Dimension::NONE])?;
    if let Some(constant) = value.value() {
        let is_right = constant > 0.0 && constant <= 1.0;
        checker.require(is_right, "the porosity", precise(constant), "above 0, at most 1", written.span)?;
    }
    Some(value)
}

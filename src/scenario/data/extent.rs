//! Whether tables are asked beyond their rows.
//!
//! Owns where expressions of a scene are worked out, and the two messages. May use intervals. It deliberately stays
//! silent about references: beyond the rows of measured data there is nothing to compare.

use super::super::Rate;
use super::super::Scenario;
use super::super::check::Checker;
use super::super::expression::{Expr, Node};
use super::super::transport::{Conductivity, Dispersion, Flow, SideRule};
use crate::data::Table;
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{T103, T104};
use crate::maths::interval::Interval;
use crate::maths::operator::Binary;
use crate::source::Span;

/// Between which numbers coordinates and the time stay where an expression is worked out.
#[derive(Clone, Copy)]
struct Inputs {
    axes: [Interval; 3],
    time: Interval,
}

/// Tells of every table that the domain or the run asks beyond its rows.
pub(in crate::scenario) fn check_extents(checker: &mut Checker<'_>, scenario: &Scenario) {
    if checker.tables.is_empty() {
        return;
    }
    let mut axes = [Interval::ZERO; 3];
    for axis in &scenario.domain.axes {
        axes[axis.index] = Interval::new(axis.low, axis.high);
    }
    let inputs = Inputs { axes, time: Interval::new(0.0, scenario.run.duration) };
    let mut told = Vec::new();
    for expr in everywhere(scenario) {
        visit(checker, expr, &inputs, true, &mut told);
    }
    for axis in &scenario.domain.axes {
        for patch in axis.patches.iter().flatten() {
            let (SideRule::Inflow(list) | SideRule::Held(list)) = &patch.rule else { continue };
            let mut inputs = inputs;
            for &(index, low, high) in &patch.limits {
                inputs.axes[index] = Interval::new(low, high);
            }
            list.iter().for_each(|(_, expr)| visit(checker, expr, &inputs, true, &mut told));
        }
    }
    let mut seen: Vec<Span> = Vec::new();
    // What is certain comes first: nothing is told twice of one place.
    told.sort_by_key(|(message, span): &(Diagnostic, Span)| (!message.is_fatal(), *span));
    for (message, span) in told {
        if !seen.contains(&span) {
            seen.push(span);
            checker.report(message);
        }
    }
}

/// Expressions that are worked out over the whole domain.
fn everywhere(scenario: &Scenario) -> Vec<&Expr> {
    let mut list: Vec<&Expr> = scenario.species.iter().map(|species| &species.initial).collect();
    list.extend(scenario.reactions.iter().filter_map(|reaction| match &reaction.rate {
        Rate::MassAction(expr) | Rate::Law(expr) => Some(expr),
        Rate::Instant | Rate::Equilibrium(_) => None,
    }));
    list.extend(scenario.medium.iter().map(|medium| &medium.value));
    match scenario.flow.as_ref().map(|flow| &flow.value) {
        Some(Flow::Expression(exprs, _)) => list.extend(exprs),
        Some(Flow::Darcy(darcy)) => {
            if let Conductivity::Expression(expr) = &darcy.conductivity {
                list.push(expr);
            }
        }
        Some(Flow::Uniform(_) | Flow::File(_)) | None => {}
    }
    if let Some(Dispersion::Isotropic(expr)) = scenario.dispersion.as_ref().map(|it| &it.value) {
        list.push(expr);
    }
    list
}

/// `is_certain`: no condition stands before this part.
fn visit(
    checker: &Checker<'_>,
    expr: &Expr,
    inputs: &Inputs,
    is_certain: bool,
    told: &mut Vec<(Diagnostic, Span)>,
) {
    let mut go = |part: &Expr, is_certain: bool| visit(checker, part, inputs, is_certain, told);
    match &expr.node {
        Node::Constant(_) | Node::Axis(_) | Node::Time | Node::Species(_) => {}
        Node::Unary(_, a) => go(a, is_certain),
        Node::Binary(_, a, b) => [a, b].into_iter().for_each(|part| go(part, is_certain)),
        Node::Select(condition, a, b) => {
            go(condition, is_certain);
            [a, b].into_iter().for_each(|part| go(part, false));
        }
        Node::Table(table, at) => {
            at.iter().for_each(|part| go(part, is_certain));
            told.extend(at.iter().enumerate().filter_map(|(axis, part)| {
                Some((judge(checker, table, axis, (part, is_certain), inputs)?, expr.span))
            }));
        }
    }
}

fn judge(
    checker: &Checker<'_>,
    table: &Table,
    axis: usize,
    (at, is_certain): (&Expr, bool),
    inputs: &Inputs,
) -> Option<Diagnostic> {
    let found = bounds(at, inputs);
    if table.speaks_of(axis, found.low, found.high) {
        return None;
    }
    let shown =
        |range: (f64, f64)| checker.shown_range(range, at.kind.dimension().unwrap_or_default(), at.span);
    let (found, rows) = (shown((found.low, found.high)), shown(table.extent(axis)));
    let column = format!("coordinate {} of the table", axis + 1);
    if is_certain && is_exact(at) {
        return Some(beyond(&column, &found, &rows, at.span));
    }
    Some(
        Diagnostic::warning(T104, "a table may be asked beyond its rows")
            .at(at.span, format!("{column} may go from {found} here"))
            .found(found)
            .expected(rows)
            .note("beyond its rows a table holds the value of its edge"),
    )
}

/// The message about coordinates for which there are no rows.
pub(super) fn beyond(column: &str, found: &str, rows: &str, span: Span) -> Diagnostic {
    Diagnostic::error(T103, format!("{column} is asked where there are no rows"))
        .at(span, format!("this is {found}"))
        .found(found)
        .expected(rows)
        .help("add rows to the table, or hold it at an edge with `min(…)` and `max(…)`")
}

fn bounds(expr: &Expr, inputs: &Inputs) -> Interval {
    match &expr.node {
        Node::Constant(value) => Interval::of(*value),
        Node::Axis(index) => inputs.axes.get(*index).copied().unwrap_or(Interval::ANY),
        Node::Time => inputs.time,
        Node::Species(_) => Interval::AMOUNT,
        Node::Unary(operator, a) => Interval::unary(*operator, bounds(a, inputs)),
        Node::Binary(operator, a, b) => Interval::binary(*operator, bounds(a, inputs), bounds(b, inputs)),
        Node::Select(condition, a, b) => {
            Interval::select(bounds(condition, inputs), bounds(a, inputs), bounds(b, inputs))
        }
        Node::Table(table, _) => {
            let (low, high) = table.range();
            Interval::new(low, high)
        }
    }
}

/// Whether every number between the bounds is reached: one coordinate, shifted and scaled.
fn is_exact(expr: &Expr) -> bool {
    match &expr.node {
        Node::Constant(_) | Node::Axis(_) | Node::Time => true,
        Node::Unary(crate::maths::operator::Unary::Negate, a) => is_exact(a),
        Node::Binary(Binary::Add | Binary::Subtract | Binary::Multiply, a, b) => {
            (a.value().is_some() || b.value().is_some()) && is_exact(a) && is_exact(b)
        }
        Node::Binary(Binary::Divide, a, b) => b.value().is_some() && is_exact(a),
        _ => false,
    }
}

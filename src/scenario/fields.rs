//! Numbers and fields of measures, from checked expressions.
//!
//! Owns which results combine bin by bin. May use the checker. It deliberately looks at no dimension:
//! the expressions have been checked.

use super::check::{Allow, Checker, operator_of};
use super::expression::{Expr, Node};
use super::measure::{Field, Scalar};
use super::places::Places;
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::U108;
use crate::maths::operator::{Binary, Unary};
use crate::source::Span;
use crate::syntax::tree::{self, ExprKind};

/// A part of a measure.
#[derive(Debug, Clone)]
pub(super) enum Part {
    Scalar(Scalar),
    /// A field and the outputs on whose bins and times it can live.
    Field(Field, Places),
}

/// What an expression of a measure is; `None` means that a mistake has been reported.
pub(super) fn part(checker: &mut Checker<'_>, expr: &Expr) -> Option<Part> {
    match &expr.node {
        Node::Constant(value) => Some(Part::Scalar(Scalar::Number(*value))),
        Node::Axis(index) => Some(Part::Field(Field::Position(*index), Places::default())),
        Node::Species(idx) => checker.measuring.as_ref()?.leaves.get(*idx).cloned(),
        Node::Unary(operator, a) => Some(match part(checker, a)? {
            Part::Scalar(a) => Part::Scalar(Scalar::Unary(*operator, Box::new(a))),
            Part::Field(a, on) => Part::Field(Field::Unary(*operator, Box::new(a)), on),
        }),
        Node::Binary(operator, a, b) => {
            let (a, b) = (part(checker, a), part(checker, b));
            join(checker, *operator, a?, b?, expr.span)
        }
        Node::Table(..) => {
            checker.report(
                Diagnostic::error(U108, "a measure cannot look results up in a table")
                    .at(expr.span, "a table of numbers, over results or bins")
                    .found("a table of numbers")
                    .expected("a table at constant coordinates, or a reference")
                    .help("make a `reference` of the table, and name that in the measure"),
            );
            None
        }
        Node::Time | Node::Select(..) => {
            checker.report(
                Diagnostic::error(U108, "a measure cannot choose between results")
                    .at(expr.span, "an `if` whose condition is a result")
                    .found("`if … then … else`")
                    .expected("`+`, `-`, `*`, `/`, `^`, functions such as `min` and `max`, norms"),
            );
            None
        }
    }
}

fn join(checker: &mut Checker<'_>, operator: Binary, a: Part, b: Part, span: Span) -> Option<Part> {
    let field = |a, b| Field::Binary(operator, Box::new(a), Box::new(b));
    match (a, b) {
        (Part::Scalar(a), Part::Scalar(b)) => {
            Some(Part::Scalar(Scalar::Binary(operator, Box::new(a), Box::new(b))))
        }
        (Part::Field(a, on), Part::Field(b, other)) if on.can_join(&other) => {
            Some(Part::Field(field(a, b), on.both(&other)))
        }
        (Part::Field(a, on), Part::Scalar(Scalar::Number(b))) => {
            Some(Part::Field(field(a, Field::Number(b)), on))
        }
        (Part::Scalar(Scalar::Number(a)), Part::Field(b, on)) => {
            Some(Part::Field(field(Field::Number(a), b), on))
        }
        _ => {
            checker.report(
                Diagnostic::error(U108, "these two cannot be combined bin by bin")
                    .at(span, "values on different bins, or a field and a computed number")
                    .found("different bins")
                    .expected("fields of one output, or constants"),
            );
            None
        }
    }
}

/// A number with its sums and products of constants as they are written, not worked out: the written form
/// is what a sweep knows its measures by, and it computes anew what it does not know.
pub(super) fn as_written<'a>(checker: &mut Checker<'a>, value: Scalar, written: &'a tree::Expr) -> Scalar {
    let argument = match &written.kind {
        ExprKind::Unary { operand, .. } => Some((Unary::Negate, &**operand)),
        ExprKind::Call { function, arguments } if function.value == "abs" => {
            arguments.first().map(|argument| (Unary::Abs, &argument.value))
        }
        _ => None,
    };
    match (value, argument, &written.kind) {
        (Scalar::Unary(operator, a), Some((_, inner)), _) => {
            Scalar::Unary(operator, Box::new(as_written(checker, *a, inner)))
        }
        (Scalar::Number(value), Some((operator, inner)), _) => match constant(checker, inner) {
            Some(a) => Scalar::Unary(operator, Box::new(a)),
            None => Scalar::Number(value),
        },
        (Scalar::Binary(operator, a, b), _, ExprKind::Binary { left, right, .. }) => {
            let (a, b) = (as_written(checker, *a, left), as_written(checker, *b, right));
            Scalar::Binary(operator, Box::new(a), Box::new(b))
        }
        (Scalar::Number(value), _, ExprKind::Binary { operator, left, right }) => {
            match (constant(checker, left), constant(checker, right)) {
                (Some(a), Some(b)) => Scalar::Binary(operator_of(operator.value).0, Box::new(a), Box::new(b)),
                _ => Scalar::Number(value),
            }
        }
        (value, ..) => value,
    }
}

/// A part that has been found right as part of a larger constant.
fn constant<'a>(checker: &mut Checker<'a>, written: &'a tree::Expr) -> Option<Scalar> {
    let value = Scalar::Number(checker.check(written, Allow::CONSTANT)?.value()?);
    Some(as_written(checker, value, written))
}

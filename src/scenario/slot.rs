//! Slots: places of a scene that take a constant of one dimension within a range.

use super::check::{Allow, Checker};
use super::expression::{Expr, Type};
use super::scope::{Origin, Progress};
use crate::diagnostic::codes::{D009, M004, M005, U103, U104};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::Span;
use crate::syntax::tree::{self, ExprKind};
use crate::units::Dimension;

/// A constant and where it was written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Value {
    pub value: f64,
    pub span: Span,
}

impl<'a> Checker<'a> {
    /// A constant of a given dimension; `what` names the slot in messages ("the step").
    pub(super) fn slot(&mut self, expr: &'a tree::Expr, what: &str, dimension: Dimension) -> Option<Value> {
        let checked = self.check(expr, Allow::CONSTANT)?;
        self.expect_dimension(expr, &checked, what, &[dimension])?;
        let value = checked.value()?;
        Some(Value { value, span: expr.span })
    }

    /// Reports unless the expression has one of the dimensions (or is zero). Returns its type.
    pub(super) fn expect_dimension(
        &mut self,
        written: &'a tree::Expr,
        checked: &Expr,
        what: &str,
        dimensions: &[Dimension],
    ) -> Option<Type> {
        let fits = match checked.kind {
            Type::Zero => true,
            Type::Number(dimension) => dimensions.contains(&dimension),
            Type::Truth => false,
        };
        if fits {
            return Some(checked.kind);
        }
        let expected: Vec<String> = dimensions.iter().map(|dimension| dimension.describe()).collect();
        let expected = expected.join(" or ");
        let found = checked.kind.describe();
        let code = if dimensions == [Dimension::NONE] { U103 } else { U104 };
        let mut message = Diagnostic::error(code, format!("{what} has the wrong dimension"))
            .at(written.span, format!("this is {found}"))
            .found(found.clone())
            .expected(expected.clone());
        if let (ExprKind::Number(number), Type::Number(Dimension::NONE)) = (&written.kind, checked.kind)
            && let Some(dimension) = dimensions.first()
        {
            message = message.help(format!("add the unit: `{} {}`", number.digits, dimension.unit_text()));
        }
        for (name, span, kind) in self.constants_in(written) {
            message = message.also(span, format!("`{name}` is set here: {}", kind.describe()));
        }
        self.report(message);
        None
    }

    /// The constants and parameters that an expression names, with the places that set them.
    pub(super) fn constants_in(&self, expr: &tree::Expr) -> Vec<(String, Span, Type)> {
        let mut names = Vec::new();
        collect_names(expr, &mut names);
        names.sort_unstable();
        names.dedup();
        let known = |name: String| {
            let entry = self.scope.get(&name)?;
            let value = match entry.origin {
                Origin::Let(statement) => statement.value.span,
                Origin::Param(statement) => statement.value.span,
                _ => return None,
            };
            match entry.progress {
                // A setting of the command line has a text of its own: that is the place to look at.
                Progress::Known(_, kind) if value.file != entry.span.file => Some((name, value, kind)),
                Progress::Known(_, kind) => Some((name, entry.span.to_if_same_file(value), kind)),
                _ => None,
            }
        };
        names.into_iter().filter_map(known).take(4).collect()
    }

    /// Reports a value outside of its range; `rule` says the range in words.
    pub(super) fn require(
        &mut self,
        is_right: bool,
        what: &str,
        found: impl Into<String>,
        rule: &str,
        span: Span,
    ) -> Option<()> {
        if is_right {
            return Some(());
        }
        let found = found.into();
        self.report(
            Diagnostic::error(M005, format!("{what} is out of range"))
                .at(span, format!("this is {found}"))
                .found(found)
                .expected(rule),
        );
        None
    }

    /// A whole number of at least one, written or from a parameter.
    pub(super) fn count(&mut self, value: f64, what: &str, most: f64, span: Span) -> Option<u64> {
        let rule = format!("a whole number from 1 to {}", precise(most));
        self.require(
            value.fract() == 0.0 && (1.0..=most).contains(&value),
            what,
            precise(value),
            &rule,
            span,
        )?;
        Some(value as u64)
    }

    /// `lo .. hi` as two constants of one dimension, low below high; a bare bound takes the unit of
    /// the other one.
    pub(super) fn range(
        &mut self,
        range: &'a tree::Range,
        what: &str,
        dimension: Option<Dimension>,
    ) -> Option<(Value, Value, Dimension)> {
        let low = self.bound(&range.low, &range.high);
        let high = self.bound(&range.high, &range.low);
        let (low, high) = (low?, high?);
        let expected = dimension.or_else(|| match low.kind.unify(high.kind) {
            Some(Type::Number(dimension)) => Some(dimension),
            _ => low.kind.dimension(),
        })?;
        self.expect_dimension(&range.low, &low, what, &[expected])?;
        self.expect_dimension(&range.high, &high, what, &[expected])?;
        let span = low.span.to(high.span);
        let (low, high) = (low.value()?, high.value()?);
        if low > high || (low == high && dimension.is_some()) {
            let shown = [(low, &range.low), (high, &range.high)]
                .map(|(value, written)| self.shown(value, expected, written.span))
                .join(" .. ");
            self.report(
                Diagnostic::error(M005, format!("{what} is empty"))
                    .at(span, "the first bound must lie below the second")
                    .found(shown)
                    .expected("a lower bound, `..`, an upper bound"),
            );
            return None;
        }
        let value = |value, expr: &tree::Expr| Value { value, span: expr.span };
        Some((value(low, &range.low), value(high, &range.high), expected))
    }

    fn bound(&mut self, bound: &'a tree::Expr, other: &'a tree::Expr) -> Option<Expr> {
        let Some((digits, is_negative)) = bare_number(bound) else {
            return self.check(bound, Allow::CONSTANT);
        };
        let Some(unit) = unit_of(other) else { return self.check(bound, Allow::CONSTANT) };
        let number = tree::Number { digits: digits.to_owned(), unit: Some(unit.clone()) };
        let value = self.number(&number, bound.span)?;
        let sign = if is_negative { -1.0 } else { 1.0 };
        Some(Expr::constant(sign * value.value()?, value.kind, bound.span))
    }

    /// Looks a word up in a list of catalogue words, or reports it with the nearest one.
    pub(super) fn word<T: Copy>(&mut self, name: &tree::Name, what: &str, words: &[(&str, T)]) -> Option<T> {
        if let Some((_, value)) = words.iter().find(|(word, _)| *word == name.value) {
            return Some(*value);
        }
        let all: Vec<&str> = words.iter().map(|(word, _)| *word).collect();
        let mut message = Diagnostic::error(M004, format!("`{}` is not {what}", name.value))
            .at(name.span, "not known here")
            .found(format!("`{}`", name.value))
            .expected(all.iter().map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", "));
        if let Some(candidate) = crate::diagnostic::did_you_mean(&name.value, all) {
            message = message.help(format!("did you mean `{candidate}`?"));
        }
        self.report(message);
        None
    }

    /// A vector over the axes of the domain: a single value for one axis, a list for more.
    pub(super) fn vector(
        &mut self,
        expr: &'a tree::Expr,
        what: &str,
        dimension: Dimension,
    ) -> Option<[f64; 3]> {
        let parts = tuple_parts(expr);
        let indices: Vec<usize> = self.axes.iter().map(|(_, index)| *index).collect();
        if parts.len() != indices.len() {
            let axes: Vec<&str> = self.axes.iter().map(|(name, _)| name.as_str()).collect();
            let expected = match axes.len() {
                1 => "one value".to_owned(),
                n => format!("{n} values, ({} component, …)", axes.join(" component, ")),
            };
            self.report(
                Diagnostic::error(D009, format!("{what} needs one value for each axis of the domain"))
                    .at(expr.span, format!("{} here", parts.len()))
                    .found(format!("{} values", parts.len()))
                    .expected(expected),
            );
            return None;
        }
        let values: Vec<Option<Value>> =
            parts.into_iter().map(|part| self.slot(part, what, dimension)).collect();
        let mut vector = [0.0; 3];
        for (index, value) in indices.into_iter().zip(values) {
            vector[index] = value?.value;
        }
        Some(vector)
    }
}

/// The parts of a list in brackets, or the expression itself.
pub(super) fn tuple_parts(expr: &tree::Expr) -> Vec<&tree::Expr> {
    match &expr.kind {
        ExprKind::Tuple(parts) => parts.iter().collect(),
        _ => vec![expr],
    }
}

fn bare_number(expr: &tree::Expr) -> Option<(&str, bool)> {
    match &expr.kind {
        ExprKind::Number(tree::Number { digits, unit: None }) => Some((digits, false)),
        ExprKind::Unary { operator, operand } if operator.value == tree::UnaryOperator::Negate => {
            bare_number(operand).map(|(digits, is_negative)| (digits, !is_negative))
        }
        _ => None,
    }
}

fn unit_of(expr: &tree::Expr) -> Option<&crate::source::Spanned<String>> {
    match &expr.kind {
        ExprKind::Number(number) => number.unit.as_ref(),
        ExprKind::Unary { operand, .. } => unit_of(operand),
        _ => None,
    }
}

/// Single names in an expression, each once per use.
pub(super) fn collect_names(expr: &tree::Expr, names: &mut Vec<String>) {
    each_name(expr, &mut |name, is_called| {
        if !is_called {
            names.push(name.value.clone());
        }
    });
}

/// Names that stand alone, and with `true` those of functions that are called.
pub(super) fn each_name<'t>(expr: &'t tree::Expr, visit: &mut impl FnMut(&'t tree::Name, bool)) {
    match &expr.kind {
        ExprKind::Number(_) => {}
        ExprKind::Path(path) => {
            if let [name] = path.as_slice() {
                visit(name, false);
            }
        }
        ExprKind::Call { function, arguments } => {
            visit(function, true);
            arguments.iter().for_each(|argument| each_name(&argument.value, visit));
        }
        ExprKind::Unary { operand, .. } => each_name(operand, visit),
        ExprKind::Binary { left, right, .. } => {
            each_name(left, visit);
            each_name(right, visit);
        }
        ExprKind::If { condition, then, otherwise } => {
            each_name(condition, visit);
            each_name(then, visit);
            each_name(otherwise, visit);
        }
        ExprKind::Tuple(parts) => parts.iter().for_each(|part| each_name(part, visit)),
    }
}

//! Values in messages, in the units that a scene writes them in.
//!
//! Owns the choice of a unit. May use the checker. It deliberately rounds nothing that matters: twelve figures stay.

use super::check::Checker;
use super::scope::Origin;
use crate::diagnostic::precise;
use crate::source::Span;
use crate::syntax::tree::{self, ExprKind};
use crate::units::{Dimension, Unit};

/// Constants that are defined by one another, looked through for a unit.
const DEPTH: usize = 4;

impl Checker<'_> {
    /// A value in SI with the first unit of its dimension that stands in an expression or in the constants that it names;
    /// else the first one of the scene, else that of SI.
    pub(super) fn shown(&self, value: f64, dimension: Dimension, written: Span) -> String {
        let (factor, text) = self.unit_for(dimension, written);
        in_unit(value, factor, &text)
    }

    /// Two values in one unit: `1 d to 3 d`.
    pub(super) fn shown_range(&self, (low, high): (f64, f64), dimension: Dimension, written: Span) -> String {
        if low == high {
            return self.shown(low, dimension, written);
        }
        format!("{} to {}", self.shown(low, dimension, written), self.shown(high, dimension, written))
    }

    /// That unit: what one of it is in SI, and its text; 1 and nothing for plain numbers.
    pub(super) fn unit_for(&self, dimension: Dimension, written: Span) -> (f64, String) {
        if dimension.is_none() {
            return (1.0, String::new());
        }
        let own = self.checked.get(&written).and_then(|expr| self.unit_in(expr, dimension, DEPTH));
        let of_scene = || self.checked.values().find_map(|expr| self.unit_in(expr, dimension, 0));
        let (unit, text) = own.or_else(of_scene).unwrap_or_else(|| (Unit::ONE, dimension.unit_text()));
        (unit.factor(), text)
    }

    fn unit_in(&self, expr: &tree::Expr, dimension: Dimension, depth: usize) -> Option<(Unit, String)> {
        let within = |part: &tree::Expr| self.unit_in(part, dimension, depth);
        match &expr.kind {
            ExprKind::Number(number) => {
                let text = &number.unit.as_ref()?.value;
                let unit = Unit::parse(text).ok().filter(|unit| unit.dimension == dimension)?;
                Some((unit, text.clone()))
            }
            ExprKind::Path(path) => {
                let [name] = &path[..] else { return None };
                let value = match self.scope.get(&name.value).filter(|_| depth > 0)?.origin {
                    Origin::Let(statement) => &statement.value,
                    Origin::Param(statement) => &statement.value,
                    _ => return None,
                };
                self.unit_in(value, dimension, depth - 1)
            }
            ExprKind::Call { arguments, .. } => arguments.iter().find_map(|argument| within(&argument.value)),
            ExprKind::Unary { operand, .. } => within(operand),
            ExprKind::Binary { left, right, .. } => within(left).or_else(|| within(right)),
            ExprKind::If { condition, then, otherwise } => {
                within(then).or_else(|| within(otherwise)).or_else(|| within(condition))
            }
            ExprKind::Tuple(parts) => parts.iter().find_map(within),
        }
    }
}

/// `1.5 d`; a number without a unit is itself.
fn in_unit(value: f64, factor: f64, text: &str) -> String {
    match text.is_empty() {
        true => precise(value),
        false => format!("{} {text}", precise(value / factor)),
    }
}

//! When a flow that changes is taken anew.
//!
//! Owns the clause `change`. May use the scenario's slots. It deliberately knows no flow: which periods there are is
//! seen in the plan.

use super::super::check::Checker;
use super::Changes;
use crate::diagnostic::precise;
use crate::syntax::tree::{self, ChangeTimes};
use crate::units::Dimension;

/// The times of a clause; none without one. `None` if it is wrong.
pub fn changes<'a>(checker: &mut Checker<'a>, written: Option<&'a tree::Change>) -> Option<Changes> {
    let Some(written) = written else { return Some(Changes::default()) };
    let mut changes = Changes { span: Some(written.span), ..Changes::default() };
    let mut is_right = true;
    let time = |checker: &mut Checker<'a>, value: &'a tree::Expr, what: &str| {
        let value = checker.slot(value, what, Dimension::TIME)?;
        let found = format!("{} s", precise(value.value));
        checker.require(value.value > 0.0, what, found, "above 0 s", value.span)?;
        Some(value.value)
    };
    match &written.times {
        ChangeTimes::At(list) => {
            for value in list {
                let t = time(checker, value, "the time of a change");
                is_right &= t.is_some();
                changes.at.extend(t);
            }
        }
        ChangeTimes::Every(value) => {
            changes.every = time(checker, value, "the time between changes");
            is_right = changes.every.is_some();
        }
    }
    is_right.then_some(changes)
}

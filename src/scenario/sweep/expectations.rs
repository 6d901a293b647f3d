//! How often a point runs, and what must hold of the whole.

use super::super::Measure;
use super::super::check::Checker;
use super::super::condition::{Condition, Known, is_fact};
use super::super::scope::Origin;
use super::{ExpectKind, Replicates, Target, Until};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::W001;
use crate::syntax::tree::{self, ExprKind};
use crate::units::Dimension;

/// Most replicates of a point.
const MAX_REPLICATES: f64 = 1e6;

pub(super) fn replicates<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Replicates,
    measures: &[Measure],
) -> Option<Replicates> {
    let what = "the number of replicates";
    let least = checker.slot(&written.least, what, Dimension::NONE)?;
    let least = checker.count(least.value, what, MAX_REPLICATES, least.span)? as u32;
    let Some((most, criterion)) = &written.until else { return Some(Replicates { least, until: None }) };
    let most = checker.slot(most, what, Dimension::NONE)?;
    let most_value = checker.count(most.value, what, MAX_REPLICATES, most.span)? as u32;
    checker.require(
        (2..=most_value).contains(&least),
        what,
        format!("{least} .. {most_value}"),
        "two or more, and the least first: a standard error needs two",
        written.span,
    )?;
    checker.word(&criterion.function, "a criterion", &[("stderr", ())])?;
    checker.word(&criterion.of, "what the standard error is a part of", &[("mean", ())])?;
    let measure = measure_name(checker, &criterion.measure, measures)?;
    if criterion.of_measure.value != measure {
        checker.report(
            Diagnostic::error(W001, "the standard error is compared with the mean of the same measure")
                .at(criterion.of_measure.span, "another measure")
                .also(criterion.measure.span, "the standard error of this")
                .found(format!("`{}`", criterion.of_measure.value))
                .expected(format!("`{measure}`")),
        );
        return None;
    }
    let threshold = checker.slot(&criterion.threshold, "the part of the mean", Dimension::NONE)?;
    let found = threshold.value.to_string();
    checker.require(threshold.value > 0.0, "the part of the mean", found, "above zero", threshold.span)?;
    let until = Until { most: most_value, measure, threshold: threshold.value };
    Some(Replicates { least, until: Some(until) })
}

pub(super) fn measure_name(
    checker: &mut Checker<'_>,
    name: &tree::Name,
    measures: &[Measure],
) -> Option<String> {
    match checker.scope.get(&name.value).map(|entry| entry.origin) {
        // A measure that is wrong has been reported where it stands.
        Some(Origin::Measure(_)) if measures.iter().all(|measure| measure.name != name.value) => return None,
        // The definition may be what is misspelt: all uses of the name decide together.
        None if !is_fact(&name.value) => {
            checker.scope.note_undefined(&name.value, name.span);
            return None;
        }
        _ => {}
    }
    let words: Vec<(&str, ())> = measures.iter().map(|measure| (measure.name.as_str(), ())).collect();
    checker.word(name, "a measure of the scene", &words)?;
    if let Some(entry) = checker.scope.get_mut(&name.value) {
        entry.n_uses += 1;
    }
    Some(name.value.clone())
}

/// `order(err, step) in 0.9 .. 1.1`, or a condition.
pub(super) fn expect<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Expect,
    measures: &[Measure],
    known: &Known,
    swept: &[&Target],
) -> Option<ExpectKind> {
    let order = match &written.value.kind {
        ExprKind::Call { function, arguments } if function.value == "order" => Some(arguments),
        ExprKind::Call { function, arguments } if function.value == "mean" => {
            return mean(checker, written, arguments, measures);
        }
        _ => None,
    };
    let (Some(arguments), Some(range)) = (order, &written.range) else {
        if order.is_some() || written.range.is_some() {
            checker.report(
                Diagnostic::error(W001, "an order or a mean is expected in a range, and nothing else is")
                    .at(written.value.span, "this")
                    .found("one without the other")
                    .expected("`expect order(measure, axis) in low .. high`, `expect mean(measure) in low .. high`, or a condition"),
            );
            return None;
        }
        return Some(ExpectKind::Holds(Condition::check(checker, &written.value, known, swept)?));
    };
    let names: Vec<&tree::Name> = arguments
        .iter()
        .filter_map(|argument| match &argument.value.kind {
            ExprKind::Path(path) if path.len() == 1 && argument.name.is_none() => path.first(),
            _ => None,
        })
        .collect();
    let [measure, axis] = names[..] else {
        checker.report(
            Diagnostic::error(W001, "`order` takes a measure and an axis of the sweep")
                .at(written.value.span, "these arguments")
                .found("other arguments")
                .expected("`order(err, step)`"),
        );
        return None;
    };
    let measure = measure_name(checker, measure, measures);
    let words: Vec<(&str, &Target)> = swept.iter().map(|target| (target.name(), *target)).collect();
    let axis = checker.word(axis, "an axis of the sweep", &words);
    let (low, high, _) = checker.range(range, "the expected order", Some(Dimension::NONE))?;
    Some(ExpectKind::Order { measure: measure?, axis: axis?.clone(), low: low.value, high: high.value })
}

/// `mean(err) in 0.9 .. 1.1`
fn mean<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Expect,
    arguments: &'a [tree::Argument],
    measures: &[Measure],
) -> Option<ExpectKind> {
    let name = match arguments {
        [tree::Argument { name: None, value }] => match &value.kind {
            ExprKind::Path(path) => path.first().filter(|_| path.len() == 1),
            _ => None,
        },
        _ => None,
    };
    let (Some(name), Some(range)) = (name, &written.range) else {
        checker.report(
            Diagnostic::error(W001, "`mean` takes a measure, and is expected in a range")
                .at(written.value.span, "this")
                .found("another argument, or no range")
                .expected("`expect mean(err) in low .. high`"),
        );
        return None;
    };
    let measure = measure_name(checker, name, measures)?;
    let dimension = measures.iter().find(|other| other.name == measure)?.dimension;
    let (low, high, _) = checker.range(range, "the expected mean", Some(dimension))?;
    let unit = checker.unit_for(dimension, range.high.span);
    Some(ExpectKind::Mean { measure, low: low.value, high: high.value, unit })
}

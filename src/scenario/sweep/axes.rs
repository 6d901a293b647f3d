//! The values of an axis: lists, progressions, `linspace` and `logspace`.

use super::super::Parameter;
use super::super::check::Checker;
use super::super::geometry::MAX_BINS;
use super::super::model::MAX_PARTICLES;
use super::super::scope::Origin;
use super::{AxisValue, SweepAxis, Target};
use crate::diagnostic::codes::{W001, W002, W003};
use crate::diagnostic::{Diagnostic, did_you_mean};
use crate::source::{Span, Spanned};
use crate::syntax::tree::{self, ExprKind, SweepValue};
use crate::syntax::words::SWEEP_ENTRIES;
use crate::units::Dimension;

/// Values that one axis may have.
const MAX_VALUES: f64 = 1e6;

pub(super) fn zip<'a>(
    checker: &mut Checker<'a>,
    axes: &'a [tree::SweepAxis],
    parameters: &[Parameter],
) -> Option<Vec<SweepAxis>> {
    let group: Vec<Option<SweepAxis>> =
        axes.iter().map(|written| one_axis(checker, written, parameters)).collect();
    let group: Vec<SweepAxis> = group.into_iter().collect::<Option<_>>()?;
    let first = group.first()?;
    let Some(at) = group.iter().position(|axis| axis.values.len() != first.values.len()) else {
        let names: Vec<&str> = group.iter().map(|axis| axis.target.name()).collect();
        let rows = (0..first.values.len()).map(|row| {
            let parts = group.iter().flat_map(|axis| &axis.values[row].si);
            (parts.copied().collect(), first.values[row].expr.span)
        });
        report_twice(checker, &format!("a row of `{}`", names.join("`, `")), rows);
        return Some(group);
    };
    let other = &group[at];
    checker.report(
        Diagnostic::error(W003, "axes that go together need equally many values")
            .at(whole_span(&axes[at]), format!("{} values", other.values.len()))
            .also(whole_span(&axes[0]), format!("{} values", first.values.len()))
            .found(format!("{} values", other.values.len()))
            .expected(format!("{} values", first.values.len())),
    );
    None
}

/// From the name of an axis to its last value.
fn whole_span(axis: &tree::SweepAxis) -> Span {
    let last = axis.values.last().map_or(axis.target.span, |value| match value {
        SweepValue::One(expr) => expr.span,
        SweepValue::Progression { span, .. } => *span,
    });
    axis.target.span.to(last)
}

/// An axis by itself.
pub(super) fn axis<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::SweepAxis,
    parameters: &[Parameter],
) -> Option<SweepAxis> {
    let axis = one_axis(checker, written, parameters)?;
    let values = axis.values.iter().map(|value| (value.si.clone(), value.expr.span));
    report_twice(checker, &format!("a value of `{}`", axis.target.name()), values);
    Some(axis)
}

/// An axis, in which values may stand again: beside others a row is another one.
fn one_axis<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::SweepAxis,
    parameters: &[Parameter],
) -> Option<SweepAxis> {
    let (target, parameter) = target(checker, &written.target, parameters)?;
    let dimension = target.dimension(parameter);
    let mut values = Vec::new();
    let mut is_right = true;
    for value in &written.values {
        match axis_values(checker, value, &target, dimension) {
            Some(more) => values.extend(more),
            None => is_right = false,
        }
    }
    let span = written.target.span;
    is_right.then_some(SweepAxis { target, span, dimension, values })
}

/// A value that stands twice would run twice with the same seeds.
fn report_twice(checker: &mut Checker<'_>, what: &str, values: impl Iterator<Item = (Vec<f64>, Span)>) {
    let mut seen = std::collections::BTreeMap::new();
    for (parts, span) in values {
        let bits: Vec<u64> = parts.iter().map(|part| part.to_bits()).collect();
        if let Some(first) = seen.insert(bits, span) {
            let message = Diagnostic::error(W002, format!("{what} stands twice"));
            let message = match first == span {
                true => message.at(first, "gives the same value twice"),
                false => message.at(span, "here again").also(first, "first here"),
            };
            checker.report(message.found("the same value twice").expected("each value once"));
            return;
        }
    }
}

fn target(
    checker: &mut Checker<'_>,
    name: &tree::Name,
    parameters: &[Parameter],
) -> Option<(Target, Dimension)> {
    if let Some(parameter) = parameters.iter().find(|parameter| parameter.name == name.value) {
        return Some((Target::Parameter(name.value.clone()), parameter.dimension));
    }
    if matches!(checker.scope.get(&name.value).map(|entry| entry.origin), Some(Origin::Param(_))) {
        // A parameter without a value has been reported where it stands.
        return None;
    }
    let words = [("particles", Target::Particles), ("step", Target::Step), ("bins", Target::Bins)];
    if let Some((_, target)) = words.iter().find(|(word, _)| *word == name.value) {
        return Some((target.clone(), Dimension::NONE));
    }
    if checker.scope.is_undefined(&name.value) {
        // The definition may be what is misspelt: all uses of the name decide together.
        checker.scope.note_undefined(&name.value, name.span);
        return None;
    }
    let known: Vec<&str> =
        parameters.iter().map(|it| it.name.as_str()).chain(words.iter().map(|(word, _)| *word)).collect();
    let mut message = Diagnostic::error(W001, format!("`{}` cannot be swept", name.value))
        .at(name.span, "no parameter of the scene")
        .found(format!("`{}`", name.value))
        .expected(known.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "));
    if let Some(entry) = checker.scope.get(&name.value) {
        message = message.also(entry.span, format!("this is {}", entry.origin.describe()));
        message = message.help("write it as `param`, and it can be swept");
    } else if let Some(help) = entry_help(&name.value) {
        message = message.help(help);
    } else if let Some(candidate) =
        did_you_mean(&name.value, known.into_iter().chain(SWEEP_ENTRIES.iter().copied()))
    {
        message = message.help(format!("did you mean `{candidate}`?"));
    }
    checker.report(message);
    None
}

/// An entry of another kind that is written as an axis would be.
fn entry_help(name: &str) -> Option<&'static str> {
    match name {
        "skip" => Some("write `skip when CONDITION`"),
        "seed" => Some("a seed is a whole number, such as `seed 42`"),
        _ => None,
    }
}

/// The values of one item of a list.
fn axis_values<'a>(
    checker: &mut Checker<'a>,
    written: &'a SweepValue,
    target: &Target,
    dimension: Dimension,
) -> Option<Vec<AxisValue>> {
    let what = format!("a value of `{}`", target.name());
    let made = |values: Vec<f64>, span: Span| {
        let round = matches!(target, Target::Particles | Target::Bins);
        let mut values = values;
        // Neighbours that only rounding made equal are one value; others stay, and are reported.
        if round && values.windows(2).all(|pair| pair[0] != pair[1]) {
            values.iter_mut().for_each(|value| *value = value.round());
            values.dedup();
        }
        values.into_iter().map(|si| AxisValue { expr: number(si, dimension, span), si: vec![si] }).collect()
    };
    match written {
        SweepValue::Progression { span, range, is_factor, by } => {
            let values = progression(checker, &what, range, *is_factor, by, dimension)?;
            Some(made(values, *span))
        }
        SweepValue::One(expr) => match &expr.kind {
            ExprKind::Call { function, arguments } if is_space(&function.value) => {
                let values = space(checker, &what, function, arguments, dimension, expr.span)?;
                Some(made(values, expr.span))
            }
            ExprKind::Tuple(parts) if *target == Target::Bins => {
                let counts: Vec<Option<f64>> =
                    parts.iter().map(|part| Some(checker.slot(part, &what, dimension)?.value)).collect();
                let si = counts.into_iter().collect::<Option<_>>()?;
                Some(vec![AxisValue { expr: expr.clone(), si }])
            }
            _ => {
                let value = checker.slot(expr, &what, dimension)?;
                check_value(checker, target, value.value, expr.span)?;
                Some(vec![AxisValue { expr: expr.clone(), si: vec![value.value] }])
            }
        },
    }
}

fn check_value(checker: &mut Checker<'_>, target: &Target, value: f64, span: Span) -> Option<()> {
    let what = format!("a value of `{}`", target.name());
    match target {
        Target::Particles => checker.count(value, &what, MAX_PARTICLES, span).map(|_| ()),
        Target::Bins => checker.count(value, &what, MAX_BINS, span).map(|_| ()),
        Target::Step => checker.require(value > 0.0, &what, format!("{value} s"), "above zero", span),
        Target::Parameter(_) => Some(()),
    }
}

/// A number of the swept dimension as an expression: SI, so that it needs no rounding.
fn number(si: f64, dimension: Dimension, span: Span) -> tree::Expr {
    let text = dimension.unit_text();
    // A unit after a number has no `1` before its slash.
    let text = text.strip_prefix('1').unwrap_or(&text).to_owned();
    let has_unit = dimension != Dimension::NONE;
    let unit = has_unit.then(|| Spanned::new(text, span));
    let digits =
        |value: f64| ExprKind::Number(tree::Number { digits: format!("{value:e}"), unit: unit.clone() });
    let kind = if si < 0.0 {
        let operand = Box::new(tree::Expr { span, kind: digits(-si) });
        ExprKind::Unary { operator: Spanned::new(tree::UnaryOperator::Negate, span), operand }
    } else {
        digits(si)
    };
    tree::Expr { span, kind }
}

fn is_space(name: &str) -> bool {
    matches!(name, "linspace" | "logspace")
}

/// `linspace(low, high, n)`, `logspace(low, high, n)`: both ends belong to it.
fn space<'a>(
    checker: &mut Checker<'a>,
    what: &str,
    function: &'a tree::Name,
    arguments: &'a [tree::Argument],
    dimension: Dimension,
    span: Span,
) -> Option<Vec<f64>> {
    let [low, high, n] = arguments else {
        checker.report(
            Diagnostic::error(W001, format!("`{}` takes two ends and a number", function.value))
                .at(span, format!("{} arguments here", arguments.len()))
                .found(format!("{} arguments", arguments.len()))
                .expected(format!("`{}(low, high, n)`", function.value)),
        );
        return None;
    };
    let low = checker.slot(&low.value, what, dimension);
    let high = checker.slot(&high.value, what, dimension);
    let n = checker.slot(&n.value, "the number of values", Dimension::NONE)?;
    let n = checker.count(n.value, "the number of values", MAX_VALUES, n.span)?;
    let (low, high) = (low?.value, high?.value);
    if function.value == "linspace" {
        return Some(spaced(n, |part| low + (high - low) * part, low, high));
    }
    for end in [low, high] {
        let found = checker.shown(end, dimension, span);
        checker.require(end > 0.0, what, found, "above zero for `logspace`", span)?;
    }
    let ratio = high / low;
    Some(spaced(n, |part| low * crate::maths::scalar::pow(ratio, part), low, high))
}

/// `n` values with exact ends.
fn spaced(n: u64, at: impl Fn(f64) -> f64, low: f64, high: f64) -> Vec<f64> {
    let value = |idx: u64| match idx {
        0 => low,
        _ if idx == n - 1 => high,
        _ => at(idx as f64 / (n - 1) as f64),
    };
    (0..n).map(value).collect()
}

/// `low .. high by step` and `low .. high by factor f`, from `low` on as long as `high` is not passed.
fn progression<'a>(
    checker: &mut Checker<'a>,
    what: &str,
    range: &'a tree::Range,
    is_factor: bool,
    by: &'a tree::Expr,
    dimension: Dimension,
) -> Option<Vec<f64>> {
    let ends = checker.range(range, what, Some(dimension));
    let of_by = if is_factor { Dimension::NONE } else { dimension };
    let by = checker.slot(by, if is_factor { "the factor" } else { "the increment" }, of_by)?;
    let (low, high, _) = ends?;
    let (low, high, step) = (low.value, high.value, by.value);
    let found = checker.shown(step, of_by, by.span);
    // What rounding adds must not lose the last value.
    const SLACK: f64 = 1e-9;
    let n = if is_factor {
        let shown = checker.shown(low, dimension, range.low.span);
        checker.require(low > 0.0, what, shown, "above zero for `by factor`", range.low.span)?;
        checker.require(step > 1.0, "the factor", found, "above one", by.span)?;
        crate::maths::scalar::ln(high / low) / crate::maths::scalar::ln(step) + SLACK
    } else {
        checker.require(step > 0.0, "the increment", found, "above zero", by.span)?;
        (high - low) / step + SLACK
    };
    let rule = format!("at most {MAX_VALUES}");
    checker.require(n < MAX_VALUES, "the number of values", format!("{n:.3e}"), &rule, by.span)?;
    let mut values = vec![low];
    for idx in 1..=n as u64 {
        let next = if is_factor { values[values.len() - 1] * step } else { low + idx as f64 * step };
        values.push(next);
    }
    Some(values)
}

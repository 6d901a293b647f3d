//! Whether the times and the range of a measure leave something of the outputs that its norms are on.
//!
//! Owns these messages. May use the scenario's types. It deliberately chooses no output: `places` does.

use super::check::Checker;
use super::measure::Scalar;
use super::places::{Results, has_times};
use super::{Domain, Output};
use crate::diagnostic::codes::{M005, M015};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::Span;
use crate::syntax::tree;

/// Times of an output that a message lists.
const MOST_TIMES: usize = 5;

/// Reports a time that an output of the measure does not have, and a range without any of its bins.
pub(super) fn check_restrictions(
    checker: &mut Checker<'_>,
    results: &Results,
    written: &tree::Measure,
    value: &Scalar,
    over: Option<(usize, f64, f64)>,
    domain: Option<&Domain>,
) -> Option<()> {
    let mut places = Vec::new();
    outputs_of(value, &mut places);
    places.sort_unstable();
    places.dedup();
    for output in places.into_iter().map(|idx| &results.outputs[idx]) {
        if let (Some(list), Some(wanted)) = (&written.times, &results.times)
            && !has_times(output, Some(wanted))
        {
            report_times(checker, output, list, wanted);
            return None;
        }
        if let (Some(written), Some(over), Some(domain)) = (&written.over, over, domain) {
            check_range(checker, output, written, over, domain)?;
        }
    }
    Some(())
}

fn outputs_of(value: &Scalar, list: &mut Vec<usize>) {
    match value {
        Scalar::Number(_) | Scalar::Fact(_) | Scalar::Measure(_) => {}
        Scalar::Norm(_, output_idx, _) => list.push(*output_idx),
        Scalar::Unary(_, a) => outputs_of(a, list),
        Scalar::Binary(_, a, b) => {
            outputs_of(a, list);
            outputs_of(b, list);
        }
    }
}

fn report_times(checker: &mut Checker<'_>, output: &Output, list: &[tree::Expr], wanted: &[f64]) {
    let seconds = |times: &[f64]| times.iter().map(|t| format!("{} s", precise(*t))).collect::<Vec<_>>();
    let missing: Vec<f64> = wanted.iter().copied().filter(|&t| !has_times(output, Some(&[t]))).collect();
    let mut own = seconds(&output.times[..output.times.len().min(MOST_TIMES)]);
    if output.times.len() > MOST_TIMES {
        own.push(format!("… ({} times)", output.times.len()));
    }
    let place = list.first().zip(list.last()).map_or(output.span, |(first, last)| first.span.to(last.span));
    checker.report(
        Diagnostic::error(M015, format!("the `{}` of this measure is not observed then", output.kind.word()))
            .at(place, "not among the times of the output")
            .also(output.span, "the output")
            .found(seconds(&missing).join(", "))
            .expected(own.join(", "))
            .help("add the time to the output, or ask for one that it has"),
    );
}

fn check_range(
    checker: &mut Checker<'_>,
    output: &Output,
    written: &tree::Axis,
    (index, low, high): (usize, f64, f64),
    domain: &Domain,
) -> Option<()> {
    let name = &written.name.value;
    let word = output.kind.word();
    let place = written.range.low.span.to(written.range.high.span);
    let no_such_bins = |reason: String, expected: String| {
        Diagnostic::error(M015, reason)
            .at(written.name.span.to(place), format!("a range along {name}"))
            .also(output.span, "the output")
            .found(format!("`over {name} = …`"))
            .expected(expected)
    };
    if !output.kind.is_binned() {
        let message =
            no_such_bins(format!("`{word}` has no bins that a range could choose"), "no `over`".into());
        checker.report(message.help("a `profile` or a `map` has bins"));
        return None;
    }
    if output.along.is_some_and(|along| along != index) {
        let reason = format!("this `{word}` is a mean over all {name}: a range cannot divide it");
        let message = no_such_bins(reason, "a range along its own axis".into());
        checker.report(message.help(format!("use `output map`, or `output {word} … along {name}`")));
        return None;
    }
    let axis_idx = domain.axes.iter().position(|axis| axis.index == index)?;
    let axis = &domain.axes[axis_idx];
    if high < axis.low || low > axis.high {
        return outside(checker, place, format!("{} m .. {} m", precise(low), precise(high)), axis);
    }
    let n_bins = *output.bins.get(axis_idx)?;
    let width = (axis.high - axis.low) / n_bins as f64;
    // The same slack as when the measure is taken: centres may be off by rounding.
    let slack = 1e-9 * (high - low);
    let first = ((low - slack - axis.low) / width - 0.5).ceil().clamp(0.0, n_bins as f64 - 1.0);
    let centre = axis.low + (first + 0.5) * width;
    if (low - slack..=high + slack).contains(&centre) {
        return Some(());
    }
    checker.report(
        Diagnostic::error(M005, "no bin of the output has its centre in this range")
            .at(place, format!("{} m .. {} m", precise(low), precise(high)))
            .also(output.span, format!("bins of {} m along {name}", precise(width)))
            .found("no bin")
            .expected(format!("the nearest centre, {} m, or another one", precise(centre))),
    );
    None
}

fn outside(checker: &mut Checker<'_>, place: Span, found: String, axis: &super::Axis) -> Option<()> {
    checker.report(
        Diagnostic::error(M005, "the range of this measure lies outside of the domain")
            .at(place, "nothing is there")
            .also(axis.span, "the domain")
            .found(found)
            .expected(format!("within {} m .. {} m", precise(axis.low), precise(axis.high))),
    );
    None
}

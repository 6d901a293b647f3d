//! Outputs: what, when, on which bins, in which unit.

use super::check::Checker;
pub(super) use super::choice::OUTPUTS;
use super::collect::Statements;
use super::geometry::{count_of, grid};
use super::model::species_index;
use super::{Domain, Output, OutputKind};
use crate::diagnostic::codes::{D009, M001, M002, M004, U104, U105};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::{Span, Spanned};
use crate::syntax::tree;
use crate::units::{Dimension, Unit};

/// Observations that one output may ask for.
const MAX_TIMES: f64 = 1e6;

impl OutputKind {
    /// The dimension of its values for a concentration of dimension `c` in a domain of `n` axes.
    pub fn dimension(self, c: Dimension, n_axes: usize) -> Dimension {
        let volume = Dimension::LENGTH.power(n_axes as i32, 1).unwrap_or(Dimension::NONE);
        match self {
            OutputKind::Profile | OutputKind::Map | OutputKind::Particles => c,
            OutputKind::Covariance => c.times(c),
            OutputKind::Breakthrough | OutputKind::Density => c,
            OutputKind::Kernels => Dimension::LENGTH,
            OutputKind::Total | OutputKind::FirstPassage | OutputKind::Moments | OutputKind::Budget => {
                c.times(volume)
            }
            OutputKind::Dilution => volume,
            OutputKind::Mixing => c.times(c).times(volume),
        }
    }
}

/// All outputs, and whether every one of them is right.
pub(super) fn outputs<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    duration: Option<f64>,
    bins: Option<&Spanned<Vec<usize>>>,
    domain: Option<&Domain>,
) -> (Vec<Output>, bool) {
    let mut list = Vec::new();
    let asked =
        || statements.outputs.iter().filter(|(_, written)| written.kind.value != super::flow_table::WORD);
    for (span, written) in asked() {
        list.extend(output(checker, statements, (*span, written), duration, bins, domain));
    }
    let is_right = list.len() == asked().count();
    (list, is_right)
}

fn output<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    (span, written): (Span, &'a tree::Output),
    duration: Option<f64>,
    average: Option<&Spanned<Vec<usize>>>,
    domain: Option<&Domain>,
) -> Option<Output> {
    let kind = checker.word(&written.kind, "an output", OUTPUTS);
    let species = species_of(checker, written);
    let times = times(checker, span, written, duration);
    let (kind, species, times) = (kind?, species?, times?);
    let pairs = if kind.is_of_pairs() { pairs(&species) } else { Vec::new() };
    let station = super::station::station(checker, statements, written, kind, domain)?;
    let along = along(checker, written, kind)?;
    let bins = output_bins(checker, statements, written, kind, along, average)?;
    let unit = match &written.unit {
        None => None,
        Some(unit) => Some(output_unit(checker, unit, kind, &species)?),
    };
    let bins_span = written.grid.first().map_or(written.kind.span, |count| count.span);
    Some(Output { span, kind, species, pairs, times, along, bins, bins_span, station, unit })
}

fn species_of(checker: &mut Checker<'_>, written: &tree::Output) -> Option<Vec<usize>> {
    let found: Vec<Option<usize>> = written.species.iter().map(|name| species_index(checker, name)).collect();
    if written.species.is_empty() {
        checker.report(
            Diagnostic::error(M001, "the output names no species")
                .at(written.kind.span, "of which species?")
                .found("no species")
                .expected("one or more species"),
        );
        return None;
    }
    let found: Vec<usize> = found.into_iter().collect::<Option<_>>()?;
    let is_pair = found.len() == 2 && ["covariance", "mixing"].contains(&written.kind.value.as_str());
    for (idx, species) in found.iter().enumerate() {
        if found[..idx].contains(species) && !is_pair {
            checker.report(
                Diagnostic::error(M002, format!("`{}` is listed twice", written.species[idx].value))
                    .at(written.species[idx].span, "here again")
                    .found("one species twice")
                    .expected("each species once"),
            );
            return None;
        }
    }
    Some(found)
}

/// One species makes a pair with itself; several make every pair of different places.
pub(super) fn pairs(species: &[usize]) -> Vec<(usize, usize)> {
    if let [only] = species {
        return vec![(*only, *only)];
    }
    let firsts = species.iter().enumerate();
    firsts.flat_map(|(idx, a)| species[idx + 1..].iter().map(move |b| (*a, *b))).collect()
}

fn times<'a>(
    checker: &mut Checker<'a>,
    span: Span,
    written: &'a tree::Output,
    duration: Option<f64>,
) -> Option<Vec<f64>> {
    match &written.times {
        None => {
            checker.report(
                Diagnostic::error(M001, "the output does not say when")
                    .at(span, "no times")
                    .found("no times")
                    .expected("`at t = …` or `every …`")
                    .help("add for example `at t = 1 d, 2 d`"),
            );
            None
        }
        Some(tree::Times::List(list)) => time_list(checker, list, duration),
        Some(tree::Times::Every(interval)) => every(checker, interval, duration),
    }
}

/// Times within the run, in order, each once.
pub(super) fn time_list<'a>(
    checker: &mut Checker<'a>,
    list: &'a [tree::Expr],
    duration: Option<f64>,
) -> Option<Vec<f64>> {
    let values: Vec<Option<f64>> = list
        .iter()
        .map(|time| {
            let value = checker.slot(time, "an output time", Dimension::TIME)?;
            let Some(duration) = duration else { return Some(value.value) };
            let rule = format!("from 0 s to the end of the run, {} s", precise(duration));
            let found = format!("{} s", precise(value.value));
            let is_fine = (0.0..=duration).contains(&value.value);
            checker.require(is_fine, "an output time", found, &rule, value.span)?;
            Some(value.value)
        })
        .collect();
    let mut values: Vec<f64> = values.into_iter().collect::<Option<_>>()?;
    values.sort_by(f64::total_cmp);
    values.dedup();
    Some(values)
}

fn every<'a>(checker: &mut Checker<'a>, interval: &'a tree::Expr, duration: Option<f64>) -> Option<Vec<f64>> {
    let interval = checker.slot(interval, "the interval of an output", Dimension::TIME)?;
    let found = format!("{} s", precise(interval.value));
    checker.require(interval.value > 0.0, "the interval of an output", found, "above zero", interval.span)?;
    let duration = duration?;
    // A run that is a whole number of intervals long ends with an output, whatever the rounding.
    let n_intervals = (duration / interval.value * (1.0 + 1e-12)).floor();
    let found = format!("{} times", precise(n_intervals));
    checker.require(
        n_intervals < MAX_TIMES,
        "the number of output times",
        found,
        "below 1e6",
        interval.span,
    )?;
    Some((0..=n_intervals as u64).map(|idx| (idx as f64 * interval.value).min(duration)).collect())
}

/// The axis of a profile; the first one if the scene does not say.
fn along(checker: &mut Checker<'_>, written: &tree::Output, kind: OutputKind) -> Option<Option<usize>> {
    let is_profile = matches!(kind, OutputKind::Profile | OutputKind::Covariance);
    let words: Vec<(String, usize)> = checker.axes.clone();
    let words: Vec<(&str, usize)> = words.iter().map(|(name, index)| (name.as_str(), *index)).collect();
    match &written.along {
        Some(name) if is_profile => checker.word(name, "an axis of the domain", &words).map(Some),
        Some(name) => {
            checker.report(
                Diagnostic::error(M004, format!("`along` has no meaning for `{}`", kind.word()))
                    .at(name.span, "an axis here")
                    .found(format!("`along {}`", name.value))
                    .expected("no `along`, or a profile"),
            );
            None
        }
        None if is_profile => Some(words.first().map(|(_, index)| *index)),
        None => Some(None),
    }
}

/// Whether the output is a mean over a bin around a plane.
fn is_slab(written: &tree::Output) -> bool {
    written.averaging.as_ref().is_some_and(|name| name.value == "resident")
        && matches!(written.place, Some(tree::Place::Plane(..)))
}

fn output_bins<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'_>,
    written: &'a tree::Output,
    kind: OutputKind,
    along: Option<usize>,
    average: Option<&Spanned<Vec<usize>>>,
) -> Option<Vec<usize>> {
    let place = written.grid.first().map_or(written.kind.span, |count| count.span);
    let takes_bins = kind.is_binned() || kind == OutputKind::Dilution || is_slab(written);
    if !takes_bins && !written.grid.is_empty() {
        checker.report(
            Diagnostic::error(M004, format!("`on` has no meaning for `{}`", kind.word()))
                .at(place, "bins here")
                .found("a number of bins")
                .expected("no `on`")
                .help("`mixing` uses the bins of `average`; others use none"),
        );
        return None;
    }
    if !kind.has_bins() {
        return Some(Vec::new());
    }
    if !written.grid.is_empty() {
        let Some(axis) = along else {
            return grid(checker, &written.grid, "the bins of the output", place).map(|grid| grid.value);
        };
        if written.grid.len() != 1 {
            checker.report(
                Diagnostic::error(D009, format!("`{}` has bins along one axis", kind.word()))
                    .at(place, format!("the first of {} counts", written.grid.len()))
                    .found(format!("{} counts", written.grid.len()))
                    .expected("one count")
                    .help("`map` has bins along all axes of the domain"),
            );
            return None;
        }
        let count = count_of(checker, &written.grid[0], "the number of bins")? as usize;
        return Some(checker.axes.iter().map(|(_, index)| if *index == axis { count } else { 1 }).collect());
    }
    let Some(average) = average else {
        // A wrong `average` has been reported already.
        if !statements.has_bins() {
            let message = Diagnostic::error(M001, format!("`{}` needs bins", kind.word())).found("no bins");
            checker.report(if kind == OutputKind::Mixing {
                message
                    .at(written.kind.span, "no `average bins` in the scene")
                    .expected("bins of an `average`")
                    .help(statements.bins_help(100))
            } else {
                message
                    .at(written.kind.span, "neither `on` here nor `average bins` in the scene")
                    .expected("`on` and a number of bins")
                    .help(match statements.average {
                        Some(_) => {
                            "add `on 100` to the output, or `, bins 100` to the `average` of the scene"
                        }
                        None => "add `on 100` to the output, or `average bins 100` to the scene",
                    })
            });
        }
        return None;
    };
    let of_axis = |(idx, (_, index)): (usize, &(String, usize))| {
        if along.is_none_or(|axis| axis == *index) { average.value[idx] } else { 1 }
    };
    Some(checker.axes.iter().enumerate().map(of_axis).collect())
}

fn output_unit(
    checker: &mut Checker<'_>,
    written: &Spanned<String>,
    kind: OutputKind,
    species: &[usize],
) -> Option<(String, f64)> {
    let Ok(unit) = Unit::parse(&written.value) else {
        checker.report(
            Diagnostic::error(U105, format!("`{}` is not a unit", written.value))
                .at(written.span, "unknown unit")
                .found(format!("`{}`", written.value))
                .expected("a unit such as `mg/L`"),
        );
        return None;
    };
    let n_axes = checker.axes.len();
    for &idx in species {
        let Some(concentration) = checker.concentration_of(idx) else { continue };
        let expected = kind.dimension(concentration, n_axes);
        if expected != unit.dimension {
            checker.report(
                Diagnostic::error(U104, "the unit of the output has the wrong dimension")
                    .at(written.span, format!("this is {}", unit.dimension.describe()))
                    .found(unit.dimension.describe())
                    .expected(expected.describe()),
            );
            return None;
        }
    }
    let factor = unit.factor();
    checker.require(
        factor.is_finite() && factor > 0.0,
        "this unit",
        "a factor of zero",
        "a finite unit",
        written.span,
    )?;
    Some((written.value.clone(), factor))
}

//! Which outputs a field of a measure can take its bins and times from.
//!
//! Owns the sets of outputs that the parts of an expression allow, and the choice between them. May use
//! the scenario's types and names. It deliberately checks no dimension: `measure` does.

use super::check::Checker;
use super::measure::FieldTarget;
use super::{Output, OutputKind, Reference};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{M017, U108};
use crate::source::Span;
use std::rc::Rc;

/// Times that are asked for by number match those of an output to this relative distance.
pub const SAME_TIME: f64 = 1e-9;

/// What measures may speak of.
#[derive(Debug, Clone)]
pub(super) struct Results {
    pub outputs: Rc<[Output]>,
    pub references: Rc<[Reference]>,
    /// Whether these lists are whole, so that an absent entry is the user's mistake.
    pub are_whole: bool,
    /// Times that the measure is restricted to.
    pub times: Option<Vec<f64>>,
    /// Outputs that some norm of the measure is taken on for certain.
    pub decided: Vec<usize>,
}

/// The outputs whose bins and times a field can take; `None` allows all. Outputs of one kind with the
/// same bins and times are one place: the first of them stands for it.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Places {
    /// Where the outputs that the field names stand.
    named: Option<Vec<usize>>,
    /// Outputs of the kinds that its references predict, …
    possible: Option<Vec<usize>>,
    /// … and those of them that have the very species: they count where no output is named.
    fitting: Option<Vec<usize>>,
}

impl Places {
    /// Whether the field names neither an output nor a reference.
    pub(super) fn are_free(&self) -> bool {
        *self == Self::default()
    }

    /// The places of two fields that are combined bin by bin.
    pub(super) fn both(&self, other: &Self) -> Self {
        Self {
            named: common(&self.named, &other.named),
            possible: common(&self.possible, &other.possible),
            fitting: common(&self.fitting, &other.fitting),
        }
    }

    /// Whether two fields can live on the bins and times of one output.
    pub(super) fn can_join(&self, other: &Self) -> bool {
        self.are_free() || other.are_free() || !self.both(other).candidates().is_empty()
    }

    /// All outputs that the field can live on.
    pub(super) fn candidates(&self) -> Vec<usize> {
        let wanted = if self.named.is_some() { &self.named } else { &self.fitting };
        common(wanted, &self.possible).unwrap_or_default()
    }

    /// The candidates that are left when the measure's times and its other norms have had their say.
    pub(super) fn chosen(&self, results: &Results) -> Vec<usize> {
        let all = self.candidates();
        let keep = |list: &[usize], test: &dyn Fn(usize) -> bool| -> Vec<usize> {
            let kept: Vec<usize> = list.iter().copied().filter(|&idx| test(idx)).collect();
            // What fits nowhere is told by `restriction`: it decides nothing here.
            if kept.is_empty() { list.to_vec() } else { kept }
        };
        let in_time = keep(&all, &|idx| has_times(&results.outputs[idx], results.times.as_deref()));
        keep(&in_time, &|idx| results.decided.contains(&idx))
    }
}

fn common(a: &Option<Vec<usize>>, b: &Option<Vec<usize>>) -> Option<Vec<usize>> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.iter().copied().filter(|idx| b.contains(idx)).collect()),
        (some, None) | (None, some) => some.clone(),
    }
}

pub(super) fn has_times(output: &Output, wanted: Option<&[f64]>) -> bool {
    let is_there =
        |&t: &f64| output.times.iter().any(|own| (own - t).abs() <= SAME_TIME * t.abs().max(own.abs()));
    wanted.is_none_or(|times| times.iter().all(is_there))
}

impl Results {
    /// Distinct places among the outputs that pass a test.
    fn places(&self, test: impl Fn(&Output) -> bool) -> Vec<usize> {
        let is_same = |a: &Output, b: &Output| {
            a.kind == b.kind && a.bins == b.bins && a.times == b.times && a.station == b.station
        };
        let first = |output: &Output| self.outputs.iter().position(|other| is_same(other, output));
        let mut list: Vec<usize> =
            self.outputs.iter().filter(|output| test(output)).filter_map(first).collect();
        list.sort_unstable();
        list.dedup();
        list
    }

    /// The places of an output by kind and species; empty if no output gives them.
    pub(super) fn of_output(&self, kind: OutputKind, target: FieldTarget) -> Places {
        let has = |output: &Output| output.kind == kind && target.is_in(output);
        Places { named: Some(self.places(has)), ..Places::default() }
    }

    pub(super) fn of_reference(&self, idx: usize) -> Places {
        let target = self.references[idx].target;
        Places {
            named: None,
            possible: Some(self.places(|output| target.outputs().contains(&output.kind))),
            fitting: Some(self.places(|output| target.is_in(output))),
        }
    }
}

impl FieldTarget {
    /// What a dotted name of this kind speaks of.
    pub(super) fn of(kind: OutputKind, species: &[usize]) -> Option<Self> {
        match (kind, species) {
            (OutputKind::Covariance | OutputKind::Mixing, [a]) => Some(Self::Pair(*a, *a)),
            (OutputKind::Covariance | OutputKind::Mixing, [a, b]) => Some(Self::Pair(*a, *b)),
            (OutputKind::Profile | OutputKind::Map, [a]) => Some(Self::Species(*a)),
            (kind, [a]) if kind.is_course() => Some(Self::Species(*a)),
            _ => None,
        }
    }

    fn is_in(self, output: &Output) -> bool {
        match self {
            Self::Species(a) => output.species.contains(&a),
            Self::Pair(a, b) => output.pairs.contains(&(a, b)) || output.pairs.contains(&(b, a)),
        }
    }
}

/// The one output that a norm is taken on, or a message.
pub(super) fn place_of(
    checker: &mut Checker<'_>,
    results: &Results,
    norm: &str,
    places: &Places,
    span: Span,
) -> Option<usize> {
    if places.are_free() {
        checker.report(
            Diagnostic::error(U108, format!("`{norm}` needs an output"))
                .at(span, "on which bins?")
                .found("positions only")
                .expected("an expression with an output such as `profile.A`"),
        );
        return None;
    }
    let chosen = places.chosen(results);
    let first = *chosen.first()?;
    if chosen.len() == 1 || !results.are_whole {
        return Some(first);
    }
    let mut message = Diagnostic::error(M017, format!("`{norm}` could be taken on more than one output"))
        .at(span, "on whose bins and times?");
    for output in chosen.iter().take(MOST_CANDIDATES).map(|&idx| &results.outputs[idx]) {
        message = message.also(output.span, describe_place(output));
    }
    if chosen.len() > MOST_CANDIDATES {
        message = message.note(format!("and {} outputs more", chosen.len() - MOST_CANDIDATES));
    }
    checker.report(
        message
            .found(format!("{} outputs with different bins or times", chosen.len()))
            .expected("one output that decides")
            .help("compare it with a result of one output only, restrict the measure with `at t = …` to times that one of them has, or leave the others out"),
    );
    None
}

/// Outputs that an ambiguous measure lists.
const MOST_CANDIDATES: usize = 4;

fn describe_place(output: &Output) -> String {
    let bins: Vec<String> = output.bins.iter().map(ToString::to_string).collect();
    let bins = if bins.is_empty() { "no bins".to_owned() } else { format!("{} bins", bins.join(" x ")) };
    let times = if output.times.len() == 1 { "time" } else { "times" };
    format!("{bins}, {} {times}", output.times.len())
}

//! Sweeps: the values of each axis, how often a point runs, what is left out and what is expected.
//!
//! Owns what many runs of a scene are made of. May use the checker. It deliberately makes no points:
//! `sweep` multiplies the axes, so that a sweep of a million points costs nothing here.

mod axes;
mod expectations;
mod reports;

use super::check::Checker;
use super::collect::Statements;
use super::condition::{Condition, known_names};
use super::{Measure, Parameter};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{M002, W001, W002, W007};
use crate::source::Span;
use crate::syntax::tree::{self, SweepEntry};
use crate::units::Dimension;
use axes::{axis, zip};
use expectations::{expect, replicates};
pub(super) use reports::reports;

/// A sweep, resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    pub name: String,
    pub span: Span,
    /// The alias of the used scene that is swept.
    pub of: Option<String>,
    /// Axes that are multiplied; those of one group go together and have equally many values.
    pub groups: Vec<Vec<SweepAxis>>,
    pub replicates: Replicates,
    /// Root of all random numbers; the scene's if absent.
    pub seed: Option<u64>,
    /// Whether all points draw the same numbers in the same replicate.
    pub has_common_numbers: bool,
    pub skips: Vec<Condition>,
    pub expects: Vec<Expect>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct SweepAxis {
    pub target: Target,
    pub span: Span,
    pub dimension: Dimension,
    pub values: Vec<AxisValue>,
}

/// What an axis sets.
#[derive(Debug, Clone, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Target {
    Parameter(String),
    /// The number of particles.
    Particles,
    /// The time step.
    Step,
    /// Bins of the averages.
    Bins,
}

impl Target {
    /// The words of the sizes, and the statements that give them.
    pub(super) const SIZES: [(&str, &str); 3] =
        [("particles", "particles"), ("step", "run"), ("bins", "average bins")];

    /// The name of its column and of its axis.
    pub fn name(&self) -> &str {
        match self {
            Target::Parameter(name) => name,
            Target::Particles => "particles",
            Target::Step => "step",
            Target::Bins => "bins",
        }
    }

    fn dimension(&self, parameter: Dimension) -> Dimension {
        match self {
            Target::Parameter(_) => parameter,
            Target::Step => Dimension::TIME,
            Target::Particles | Target::Bins => Dimension::NONE,
        }
    }
}

/// A value as an expression that replaces the scene's own, and in SI.
#[derive(Debug, Clone, PartialEq)]
pub struct AxisValue {
    pub expr: tree::Expr,
    /// One number, or one for each axis of the domain.
    pub si: Vec<f64>,
}

/// Runs of each point.
#[derive(Debug, Clone, PartialEq)]
pub struct Replicates {
    pub least: u32,
    pub until: Option<Until>,
}

/// Further replicates until the standard error of a measure's mean is below `threshold` times the mean.
#[derive(Debug, Clone, PartialEq)]
pub struct Until {
    pub most: u32,
    pub measure: String,
    pub threshold: f64,
}

/// What must hold, or the sweep fails.
#[derive(Debug, Clone, PartialEq)]
pub struct Expect {
    pub span: Span,
    pub kind: ExpectKind,
    /// Points that it is said of; all if absent.
    pub when: Option<Condition>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum ExpectKind {
    /// For each point with all its replicates.
    Holds(Condition),
    /// The slope of ln(mean of the measure) by ln(value of the axis).
    Order { measure: String, axis: Target, low: f64, high: f64 },
    /// The mean over the replicates of each point; `unit` is that of the range, with what one of it is in SI.
    Mean { measure: String, low: f64, high: f64, unit: (f64, String) },
}

/// What is drawn of a sweep besides what is always drawn.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    pub span: Span,
    pub kind: ReportKind,
    pub measure: String,
    pub against: Vec<String>,
    pub by: Vec<String>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ReportKind {
    WorkPrecision,
    Convergence,
    Minimum,
}

/// All sweeps of a scene, and whether all of them are right.
pub(super) fn sweeps<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    parameters: &[Parameter],
    measures: &[Measure],
) -> (Vec<Sweep>, bool) {
    let mut list: Vec<Sweep> = Vec::new();
    for (span, written) in &statements.sweeps {
        if let Some(first) = list.iter().find(|sweep| sweep.name == written.name.value) {
            checker.report(
                Diagnostic::error(M002, format!("two sweeps are called `{}`", written.name.value))
                    .at(written.name.span, "here again")
                    .also(first.span, "first here")
                    .found("one name twice")
                    .expected("a name for each sweep"),
            );
            continue;
        }
        let sweep = sweep(checker, *span, written, parameters, measures);
        if !statements.has_bins() {
            bins_of_nothing(checker, statements, sweep.as_ref());
        }
        list.extend(sweep);
    }
    let is_right = list.len() == statements.sweeps.len();
    (list, is_right)
}

fn sweep<'a>(
    checker: &mut Checker<'a>,
    span: Span,
    written: &'a tree::Sweep,
    parameters: &[Parameter],
    measures: &[Measure],
) -> Option<Sweep> {
    let mut sweep = Sweep {
        name: written.name.value.clone(),
        span,
        of: written.of.as_ref().map(|name| name.value.clone()),
        groups: Vec::new(),
        replicates: Replicates { least: 1, until: None },
        seed: None,
        has_common_numbers: false,
        skips: Vec::new(),
        expects: Vec::new(),
    };
    let n_before = checker.diagnostics.len();
    only_once(checker, written);
    for entry in &written.entries {
        match entry {
            SweepEntry::Axis(written) => {
                sweep.groups.extend(axis(checker, written, parameters).map(|axis| vec![axis]));
            }
            SweepEntry::Zip(_, axes) => sweep.groups.extend(zip(checker, axes, parameters)),
            SweepEntry::Seed(seed) => sweep.seed = Some(seed.value),
            SweepEntry::Common(_) => sweep.has_common_numbers = true,
            SweepEntry::Replicates(written) => {
                if let Some(replicates) = replicates(checker, written, measures) {
                    sweep.replicates = replicates;
                }
            }
            SweepEntry::Skip(..) | SweepEntry::Expect(_) => {}
        }
    }
    set_once(checker, &sweep);
    bounded(checker, &sweep, written.name.span);
    conditions(checker, written, parameters, measures, &mut sweep);
    let is_right = !checker.diagnostics[n_before..].iter().any(Diagnostic::is_fatal);
    is_right.then_some(sweep)
}

/// Conditions come last: they may use the axes.
fn conditions<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Sweep,
    parameters: &[Parameter],
    measures: &[Measure],
    sweep: &mut Sweep,
) {
    let swept: Vec<&Target> = sweep.groups.iter().flatten().map(|axis| &axis.target).collect();
    let before = known_names(checker, parameters, &[]);
    let after = known_names(checker, parameters, measures);
    let (mut skips, mut expects) = (Vec::new(), Vec::new());
    for entry in &written.entries {
        match entry {
            SweepEntry::Skip(_, expr) => skips.extend(Condition::check(checker, expr, &before, &swept)),
            SweepEntry::Expect(written) => {
                let when = written.when.as_ref();
                let when = when.map(|expr| Condition::check(checker, expr, &before, &swept));
                let kind = expect(checker, written, measures, &after, &swept);
                if let (Some(kind), None | Some(Some(_))) = (kind, &when) {
                    expects.push(Expect { span: written.span, kind, when: when.flatten() });
                }
            }
            _ => {}
        }
    }
    (sweep.skips, sweep.expects) = (skips, expects);
}

fn only_once(checker: &mut Checker<'_>, written: &tree::Sweep) {
    let place = |entry: &SweepEntry| match entry {
        SweepEntry::Replicates(it) => Some(("replicates", it.span)),
        SweepEntry::Seed(it) => Some(("seed", it.span)),
        SweepEntry::Common(span) => Some(("common_random_numbers", *span)),
        _ => None,
    };
    let places: Vec<(&str, Span)> = written.entries.iter().filter_map(place).collect();
    for (idx, (what, span)) in places.iter().enumerate() {
        if let Some((_, first)) = places[..idx].iter().find(|(other, _)| other == what) {
            checker.report(
                Diagnostic::error(M002, format!("`{what}` stands twice in this sweep"))
                    .at(*span, "here again")
                    .also(*first, "first here")
                    .found(format!("`{what}` twice"))
                    .expected("one of them"),
            );
        }
    }
}

/// Most points of a sweep.
const MAX_POINTS: f64 = 2e7;

fn bounded(checker: &mut Checker<'_>, sweep: &Sweep, span: Span) {
    let lengths = sweep.groups.iter().filter_map(|group| group.first()).map(|axis| axis.values.len());
    let n: f64 = lengths.map(|n| n as f64).product();
    if n > MAX_POINTS {
        checker.report(
            Diagnostic::error(W007, format!("the sweep `{}` has too many points", sweep.name))
                .at(span, "all combinations of its axes")
                .found(format!("{n} combinations"))
                .expected(format!("at most {MAX_POINTS}"))
                .help("write axes that go together in `zip { … }`, or give them fewer values"),
        );
    }
}

/// An axis of bins would set nothing where the scene has no average.
fn bins_of_nothing(checker: &mut Checker<'_>, statements: &Statements<'_>, sweep: Option<&Sweep>) {
    let axes = sweep.into_iter().flat_map(|sweep| sweep.groups.iter().flatten());
    for axis in axes.filter(|axis| axis.target == Target::Bins) {
        checker.report(
            Diagnostic::error(W001, "the scene has no bins that could be swept")
                .at(axis.span, "of which average?")
                .found("no `average bins`")
                .expected("an `average bins` statement in the scene")
                .help(statements.bins_help(100)),
        );
    }
}

/// No two axes set the same thing.
fn set_once(checker: &mut Checker<'_>, sweep: &Sweep) {
    let axes: Vec<&SweepAxis> = sweep.groups.iter().flatten().collect();
    for (idx, axis) in axes.iter().enumerate() {
        if let Some(first) = axes[..idx].iter().find(|first| first.target == axis.target) {
            checker.report(
                Diagnostic::error(W002, format!("two axes of the sweep set `{}`", axis.target.name()))
                    .at(axis.span, "here again")
                    .also(first.span, "first here")
                    .found("two axes with one target")
                    .expected("all values of a target in one list"),
            );
        }
    }
}

//! Where breakthroughs and first passages are taken.
//!
//! Owns the checks of `at x = …`, `at right`, `in box(…)` and of the way concentrations are averaged there. May
//! use the checker. It deliberately counts nothing.

use super::check::Checker;
use super::collect::Statements;
use super::transport::sides::side_words;
use super::transport::{Patch, SideRule};
use super::{Axis, Domain, OutputKind, Station};
use crate::diagnostic::codes::{D009, M001, M004, M005, M032};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::Span;
use crate::syntax::tree;
use crate::units::Dimension;

/// Part of an axis within which a plane is at its end.
const AT_THE_END: f64 = 1e-9;

/// Ways in which a concentration is averaged.
const WORDS: &[(&str, bool)] = &[("flux_weighted", false), ("resident", true)];

/// The station of an output; `Some(None)` for an output without one.
pub(super) fn station<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    written: &'a tree::Output,
    kind: OutputKind,
    domain: Option<&Domain>,
) -> Option<Option<Station>> {
    check_particles(checker, statements, written, kind)?;
    let is_resident = match &written.averaging {
        Some(name) => Some(checker.word(name, "a way of averaging", WORDS)?),
        None => None,
    };
    if !kind.has_station() {
        let place = written.place.as_ref().map(|place| (place.span(), "a place"));
        let averaging = written.averaging.as_ref().map(|name| (name.span, "a way of averaging"));
        return match place.or(averaging) {
            Some((span, what)) => no_meaning(checker, kind, span, what, "no place"),
            None => Some(None),
        };
    }
    if let (OutputKind::FirstPassage, Some(name)) = (kind, &written.averaging) {
        return no_meaning(checker, kind, name.span, "a way of averaging", "no such word");
    }
    let Some(place) = &written.place else {
        checker.report(
            Diagnostic::error(M001, format!("the `{}` does not say where", kind.word()))
                .at(written.kind.span, "no place")
                .found("no place")
                .expected("`at x = …` or a side such as `at right`")
                .help("add for example `at x = 10 m`"),
        );
        return None;
    };
    match place {
        tree::Place::Box(span, ranges) => {
            if kind != OutputKind::Breakthrough {
                return no_meaning(checker, kind, *span, "a box", "a plane or a side");
            }
            if let (Some(false), Some(name)) = (is_resident, &written.averaging) {
                return no_meaning(checker, kind, name.span, "a flux through a box", "`resident`");
            }
            let (low, high) = limits(checker, *span, ranges, domain?)?;
            Some(Some(Station::Box { low, high }))
        }
        tree::Place::Side(name) => {
            let side = side(checker, name, domain?)?;
            match is_resident {
                Some(true) => no_meaning(checker, kind, name.span, "a resident mean at a side", "a plane"),
                _ => Some(Some(Station::Side(side))),
            }
        }
        tree::Place::Plane(name, value) => {
            let words: Vec<(String, usize)> = checker.axes.clone();
            let words: Vec<(&str, usize)> =
                words.iter().enumerate().map(|(idx, (name, _))| (name.as_str(), idx)).collect();
            let axis_idx = checker.word(name, "an axis of the domain", &words)?;
            let at = checker.slot(value, "the place of a plane", Dimension::LENGTH)?;
            let axis = &domain?.axes[axis_idx];
            let rule = format!("from {} m to {} m", precise(axis.low), precise(axis.high));
            let is_inside = (axis.low..=axis.high).contains(&at.value);
            let found = format!("{} m", precise(at.value));
            checker.require(is_inside, "the place of a plane", found, &rule, at.span)?;
            if is_resident == Some(true) {
                return slab(checker, written, domain?, axis_idx, at.value).map(Some);
            }
            Some(Some(plane(axis, axis_idx, at.value)))
        }
    }
}

fn no_meaning<T>(
    checker: &mut Checker<'_>,
    kind: OutputKind,
    span: Span,
    what: &str,
    expected: &str,
) -> Option<T> {
    checker.report(
        Diagnostic::error(M004, format!("{what} has no meaning for `{}`", kind.word()))
            .at(span, "here")
            .found(what)
            .expected(expected),
    );
    None
}

/// What is counted on the way of particles needs particles that carry mass.
fn check_particles(
    checker: &mut Checker<'_>,
    statements: &Statements<'_>,
    written: &tree::Output,
    kind: OutputKind,
) -> Option<()> {
    let (_, particles) = statements.particles?;
    if !kind.needs_masses() || particles.kind.value == "mass" {
        return Some(());
    }
    checker.report(
        Diagnostic::error(M032, format!("`{}` needs particles that carry mass", kind.word()))
            .at(written.kind.span, "what particles do on their way is counted")
            .also(particles.kind.span, "these are volumes of water")
            .found(format!("`particles {}`", particles.kind.value))
            .expected("`particles mass`")
            .help("with fluid particles `profile`, `map`, `total`, `moments` and `dilution` tell where a species is"),
    );
    None
}

/// A plane, or the side that it lies on.
fn plane(axis: &Axis, axis_idx: usize, at: f64) -> Station {
    let near = |end: f64| (at - end).abs() <= AT_THE_END * (axis.high - axis.low);
    if near(axis.low) && is_wall(&axis.patches[0]) {
        Station::Side(2 * axis_idx)
    } else if near(axis.high) && is_wall(&axis.patches[1]) {
        Station::Side(2 * axis_idx + 1)
    } else {
        Station::Plane { axis: axis_idx, at }
    }
}

/// Whether particles end at a side, or at a part of it.
fn is_wall(side: &[Patch]) -> bool {
    !side.iter().all(|patch| matches!(patch.rule, SideRule::Open | SideRule::Periodic))
}

/// The bin around a plane.
fn slab<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Output,
    domain: &Domain,
    axis_idx: usize,
    at: f64,
) -> Option<Station> {
    let [count] = &written.grid[..] else {
        checker.report(
            Diagnostic::error(M001, "a resident mean needs the width of a bin")
                .at(written.grid.first().map_or(written.kind.span, |count| count.span), "not one count")
                .found(format!("{} counts", written.grid.len()))
                .expected("`on` and the number of bins along the axis")
                .help("add for example `on 200`: the mean is over one bin around the plane"),
        );
        return None;
    };
    let count = super::geometry::count_of(checker, count, "the number of bins")?;
    let axis = &domain.axes[axis_idx];
    let half = 0.5 * (axis.high - axis.low) / count as f64;
    let mut low: Vec<f64> = domain.axes.iter().map(|axis| axis.low).collect();
    let mut high: Vec<f64> = domain.axes.iter().map(|axis| axis.high).collect();
    low[axis_idx] = (at - half).max(axis.low);
    high[axis_idx] = (at + half).min(axis.high);
    Some(Station::Box { low, high })
}

/// Lower and upper limits of a box.
fn limits<'a>(
    checker: &mut Checker<'a>,
    span: Span,
    ranges: &'a [tree::Range],
    domain: &Domain,
) -> Option<(Vec<f64>, Vec<f64>)> {
    if ranges.len() != domain.axes.len() {
        checker.report(
            Diagnostic::error(D009, "a box has a range along every axis of the domain")
                .at(span, format!("{} ranges", ranges.len()))
                .found(format!("{} ranges", ranges.len()))
                .expected(domain.axes.len().to_string()),
        );
        return None;
    }
    let found: Vec<Option<(f64, f64)>> = ranges
        .iter()
        .zip(&domain.axes)
        .map(|(range, axis)| {
            let (low, high, _) = checker.range(range, "the range of a box", Some(Dimension::LENGTH))?;
            let rule = format!("within {} m .. {} m", precise(axis.low), precise(axis.high));
            let found = format!("{} m .. {} m", precise(low.value), precise(high.value));
            let is_inside = low.value >= axis.low && high.value <= axis.high;
            checker.require(is_inside, "the range of a box", found, &rule, low.span.to(high.span))?;
            Some((low.value, high.value))
        })
        .collect();
    let found: Vec<(f64, f64)> = found.into_iter().collect::<Option<_>>()?;
    Some(found.into_iter().unzip())
}

/// Twice the axis, plus one at its upper end.
fn side(checker: &mut Checker<'_>, name: &tree::Name, domain: &Domain) -> Option<usize> {
    let indices: Vec<usize> = domain.axes.iter().map(|axis| axis.index).collect();
    let words = side_words(&indices);
    let words: Vec<(&str, usize)> = words.iter().map(|(word, (axis, end))| (*word, 2 * axis + end)).collect();
    let side = checker.word(name, "a side of this domain", &words)?;
    let axis = &domain.axes[side / 2];
    if is_wall(&axis.patches[side % 2]) {
        return Some(side);
    }
    let kind = if side % 2 == 0 { axis.low_side } else { axis.high_side };
    checker.report(
        Diagnostic::error(M005, format!("nothing leaves through an `{}` side", kind.word()))
            .at(name.span, "particles go on there")
            .found(format!("`{}`", kind.word()))
            .expected("a plane such as `at x = …`"),
    );
    None
}

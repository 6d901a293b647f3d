//! Where breakthroughs and first passages are taken.
//!
//! Owns the checks of `at x = …`, `at right`, parts of these, `at well …`, `in box(…)` and of the way
//! concentrations are averaged there. May use the checker. It deliberately counts nothing.

use super::check::Checker;
use super::collect::Statements;
use super::transport::sides::side_words;
use super::transport::{Patch, SideRule};
use super::{Axis, Domain, OutputKind, Scenario, Station};
use crate::diagnostic::codes::{D009, M001, M004, M005, M026, M027, M032};
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
    let averaging = (is_resident, written.averaging.as_ref().map(|name| name.span));
    at_place(checker, statements, (written, place), kind, averaging, domain).map(Some)
}

/// The station of a written place; `averaging` is whether it is resident, and the word that says so.
fn at_place<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    (written, place): (&'a tree::Output, &'a tree::Place),
    kind: OutputKind,
    (is_resident, word): (Option<bool>, Option<Span>),
    domain: Option<&Domain>,
) -> Option<Station> {
    match place {
        tree::Place::Box(span, ranges) => {
            if kind != OutputKind::Breakthrough {
                return no_meaning(checker, kind, *span, "a box", "a plane or a side");
            }
            if let (Some(false), Some(span)) = (is_resident, word) {
                return no_meaning(checker, kind, span, "a flux through a box", "`resident`");
            }
            let (low, high) = limits(checker, *span, ranges, domain?)?;
            Some(Station::Box { low, high })
        }
        tree::Place::Well(name) => {
            if let (Some(true), Some(span)) = (is_resident, word) {
                return no_meaning(checker, kind, span, "a resident mean at a well", "a box around it");
            }
            needs_masses(checker, statements, name.span, "wells")?;
            well(checker, statements, name)
        }
        tree::Place::Side(name, limits) => {
            if let Some(first) = limits.first() {
                needs_masses(checker, statements, first.name.span, "parts of sides")?;
            }
            let side = side(checker, name, domain?)?;
            if is_resident == Some(true) {
                return no_meaning(checker, kind, name.span, "a resident mean at a side", "a plane");
            }
            let part = part(checker, limits, domain?, side / 2)?;
            is_left(checker, kind, domain?, side, name.span)?;
            Some(limited(Station::Side(side), limits, part))
        }
        tree::Place::Plane(name, value, limits) => {
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
            let part = part(checker, limits, domain?, axis_idx)?;
            if is_resident == Some(true) {
                return slab(checker, written, axis, part, (axis_idx, at.value));
            }
            let plane = plane(axis, axis_idx, at.value);
            if let Station::Side(side) = plane {
                is_left(checker, kind, domain?, side, at.span)?;
            }
            Some(limited(plane, limits, part))
        }
    }
}

/// Reports a first passage at a side that turns all particles back: what leaves there is counted, and nothing does.
fn is_left(
    checker: &mut Checker<'_>,
    kind: OutputKind,
    domain: &Domain,
    side: usize,
    span: Span,
) -> Option<()> {
    let axis = &domain.axes[side / 2];
    let patches = &axis.patches[side % 2];
    if kind != OutputKind::FirstPassage || !patches.iter().all(|patch| patch.rule == SideRule::Reflect) {
        return Some(());
    }
    let inset = 1e-3 * (axis.high - axis.low);
    let at = if side.is_multiple_of(2) { axis.low + inset } else { axis.high - inset };
    let name = ["x", "y", "z"][axis.index];
    checker.report(
        Diagnostic::error(M005, "nothing leaves through a `reflect` side")
            .at(span, "particles are turned back there; a side counts what leaves through it")
            .also(patches[0].span, "this side")
            .found("`reflect`")
            .expected("a plane within the domain, or a side that particles leave through")
            .help(format!("write `at {name} = {} m` for what comes near this side", precise(at))),
    );
    None
}

/// Reports a place at which only masses are counted yet.
fn needs_masses(
    checker: &mut Checker<'_>,
    statements: &Statements<'_>,
    span: Span,
    what: &str,
) -> Option<()> {
    let (_, particles) = statements.particles?;
    if particles.kind.value == "mass" {
        return Some(());
    }
    checker.report(
        Diagnostic::error(M026, format!("fluid particles are not counted at {what} yet"))
            .at(span, "not with particles of fluid")
            .also(particles.kind.span, "parcels of water")
            .found(format!("`particles {}`", particles.kind.value))
            .expected("`particles mass`, or a plane or a whole side")
            .help("what parcels leave by a whole side is counted; a `budget` has all sides"),
    );
    None
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

/// A place, or the part of it that is written.
fn limited(of: Station, written: &[tree::Axis], (low, high): (Vec<f64>, Vec<f64>)) -> Station {
    if written.is_empty() { of } else { Station::Part { of: Box::new(of), low, high } }
}

/// Lower and upper limits of a part of a plane; those of the domain where nothing is written.
fn part<'a>(
    checker: &mut Checker<'a>,
    written: &'a [tree::Axis],
    domain: &Domain,
    normal: usize,
) -> Option<(Vec<f64>, Vec<f64>)> {
    let mut low: Vec<f64> = domain.axes.iter().map(|axis| axis.low).collect();
    let mut high: Vec<f64> = domain.axes.iter().map(|axis| axis.high).collect();
    let words: Vec<(String, usize)> = checker.axes.clone();
    let words: Vec<(&str, usize)> =
        words.iter().enumerate().map(|(idx, (name, _))| (name.as_str(), idx)).collect();
    let mut taken = vec![normal];
    for limit in written {
        let axis = checker.word(&limit.name, "an axis of the domain", &words);
        let range = checker.range(&limit.range, "this part of a plane", Some(Dimension::LENGTH));
        let (axis, (from, to, _)) = (axis?, range?);
        if taken.contains(&axis) {
            let message = match axis == normal {
                true => "a plane has no extent along its own axis",
                false => "an axis is limited twice",
            };
            checker.report(
                Diagnostic::error(M027, message)
                    .at(limit.name.span, "not this axis")
                    .found(format!("`{} = …`", limit.name.value))
                    .expected("each of the other axes once"),
            );
            return None;
        }
        taken.push(axis);
        let rule = format!("within {} m .. {} m", precise(low[axis]), precise(high[axis]));
        let found = format!("{} m .. {} m", precise(from.value), precise(to.value));
        let is_inside = from.value >= low[axis] && to.value <= high[axis];
        checker.require(is_inside, "this part of a plane", found, &rule, from.span.to(to.span))?;
        (low[axis], high[axis]) = (from.value, to.value);
    }
    Some((low, high))
}

/// A well of the flow, by its name.
fn well(checker: &mut Checker<'_>, statements: &Statements<'_>, name: &tree::Name) -> Option<Station> {
    if matches!(statements.flow, Some((_, tree::Flow { argument: tree::FlowArgument::Files(..), .. }))) {
        // What takes water out is known when the files have been read.
        return Some(Station::Well(name.value.clone()));
    }
    let written = match statements.flow {
        Some((_, tree::Flow { argument: tree::FlowArgument::Entries(entries), .. })) => &entries[..],
        _ => &[],
    };
    let mut words: Vec<(&str, ())> = Vec::new();
    for entry in written {
        if let tree::DarcyKind::Well(well) = &entry.kind {
            words.push((&well.name.value, ()));
        }
    }
    if words.is_empty() {
        checker.report(
            Diagnostic::error(M001, "this scene has no wells")
                .at(name.span, "a well")
                .found(format!("`{}`", name.value))
                .expected("a `well` in `flow darcy`, or another place")
                .help("write for example `at x = 10 m`, or add `well NAME at (…) rate …` to `flow darcy`"),
        );
        return None;
    }
    checker.word(name, "a well of this scene", &words)?;
    Some(Station::Well(name.value.clone()))
}

/// Reports wells that nothing is taken out by.
pub(super) fn check_wells(checker: &mut Checker<'_>, scenario: &Scenario) {
    let Some(super::transport::Flow::Darcy(flow)) = scenario.flow.as_ref().map(|flow| &flow.value) else {
        return;
    };
    for output in &scenario.outputs {
        let Some(Station::Well(name)) = &output.station else { continue };
        if flow
            .wells
            .iter()
            .any(|well| well.name == *name && well.rate.value().is_some_and(|rate| rate >= 0.0))
        {
            checker.report(
                Diagnostic::error(M005, format!("well `{name}` takes nothing out"))
                    .at(output.span, "what leaves with the water of a well is counted")
                    .found("a well that puts water in")
                    .expected("a well with a rate below zero, or another place"),
            );
        }
    }
}

/// The bin around a plane, or around a part of it.
fn slab<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Output,
    axis: &Axis,
    (mut low, mut high): (Vec<f64>, Vec<f64>),
    (axis_idx, at): (usize, f64),
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
    let half = 0.5 * (axis.high - axis.low) / count as f64;
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

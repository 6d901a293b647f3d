//! `flow darcy { … }`: heads, fluxes, conductivity, wells, cells.
//!
//! Owns the entries and what must be there for a solution. May use the scenario's slots. It deliberately
//! solves nothing.

use super::super::check::{Allow, Checker};
use super::super::expression::{Expr, Type};
use super::super::geometry::grid;
use super::change::changes;
use super::lognormal;
use super::sides::{concentrations, side_names, side_words};
use super::{Conductivity, Darcy, DarcySide, Well};
use crate::diagnostic::codes::{D002, D009, M001, M002, M028, M030, U104};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::{Span, Spanned};
use crate::syntax::tree::{self, DarcyEntry, DarcyKind};
use crate::units::Dimension;

/// Entries by kind.
#[derive(Default)]
struct Found<'a> {
    /// Per axis, low and high, with the place of the side's name.
    sides: Vec<[Option<(DarcySide, Span)>; 2]>,
    conductivity: Option<(Span, &'a tree::Expr)>,
    anisotropy: Option<(Span, &'a tree::Expr)>,
    grid: Option<(Span, &'a [tree::Expr])>,
    wells: Vec<&'a tree::Well>,
    change: Option<(Span, &'a tree::Change)>,
    is_right: bool,
}

pub fn darcy<'a>(
    checker: &mut Checker<'a>,
    statement: &'a tree::Flow,
    entries: &'a [DarcyEntry],
) -> Option<Darcy> {
    let found = gather(checker, entries);
    let place = statement.kind.span;
    let mut is_right = found.is_right;
    is_right &= check_sides(checker, &found, place);
    for (is_there, what, example) in [
        (found.conductivity.is_some(), "conductivity", "conductivity 10 m/d"),
        (found.grid.is_some(), "grid", if checker.axes.len() == 1 { "grid 400" } else { "grid 400 x 160" }),
    ] {
        if !is_there {
            is_right = false;
            checker.report(
                Diagnostic::error(M001, format!("`flow darcy` has no `{what}`"))
                    .at(place, format!("no `{what}` in its braces"))
                    .found(format!("no `{what}`"))
                    .expected(format!("one `{what}`"))
                    .help(format!("add for example `{example}`")),
            );
        }
    }
    let conductivity = found.conductivity.and_then(|(_, written)| conductivity(checker, written));
    let cells = found.grid.and_then(|(span, counts)| grid(checker, counts, "the cells of the flow", span));
    let anisotropy = anisotropy(checker, found.anisotropy);
    let wells = wells(checker, &found.wells);
    let changes = changes(checker, found.change.map(|(_, change)| change));
    let (conductivity, cells, anisotropy, wells) = (conductivity?, cells?, anisotropy?, wells?);
    let changes = changes?;
    is_right.then_some(())?;
    let sides: Vec<[DarcySide; 2]> = found
        .sides
        .iter()
        .map(|[low, high]| Some([low.as_ref()?.0.clone(), high.as_ref()?.0.clone()]))
        .collect::<Option<_>>()?;
    let Spanned { value: cells, span: cells_span } = cells;
    let conductivity_span = found.conductivity.map_or(place, |(_, written)| written.span);
    Some(Darcy { cells, cells_span, sides, conductivity, conductivity_span, anisotropy, wells, changes })
}

fn gather<'a>(checker: &mut Checker<'a>, entries: &'a [DarcyEntry]) -> Found<'a> {
    let mut found =
        Found { sides: vec![[const { None }; 2]; checker.axes.len()], is_right: true, ..Found::default() };
    for entry in entries {
        match &entry.kind {
            DarcyKind::Head(list) => {
                for (side, value) in list {
                    let head = timed(checker, value, "the head", Dimension::LENGTH);
                    set_side(checker, &mut found, side, head.map(DarcySide::Head));
                }
            }
            DarcyKind::Flux(list) => {
                for (side, value) in list {
                    let flux = timed(checker, value, "the flux", Dimension::VELOCITY);
                    set_side(checker, &mut found, side, flux.map(DarcySide::Flux));
                }
            }
            DarcyKind::NoFlow(list) => {
                list.iter().for_each(|side| set_side(checker, &mut found, side, Some(DarcySide::NoFlow)));
            }
            DarcyKind::Periodic(list) => {
                list.iter().for_each(|side| set_side(checker, &mut found, side, Some(DarcySide::Periodic)));
            }
            DarcyKind::Conductivity(value) => {
                let first = found.conductivity.replace((entry.word, value));
                twice(checker, &mut found, "conductivity", entry.word, first.map(|it| it.0));
            }
            DarcyKind::Anisotropy(value) => {
                let first = found.anisotropy.replace((entry.word, value));
                twice(checker, &mut found, "anisotropy", entry.word, first.map(|it| it.0));
            }
            DarcyKind::Grid(counts) => {
                let first = found.grid.replace((entry.word, counts));
                twice(checker, &mut found, "grid", entry.word, first.map(|it| it.0));
            }
            DarcyKind::Well(well) => found.wells.push(well),
            DarcyKind::Change(change) => {
                let first = found.change.replace((entry.word, change));
                twice(checker, &mut found, "change", entry.word, first.map(|it| it.0));
            }
        }
    }
    found
}

fn twice(checker: &mut Checker<'_>, found: &mut Found<'_>, what: &str, again: Span, first: Option<Span>) {
    let Some(first) = first else { return };
    checker.report(
        Diagnostic::error(M002, format!("`{what}` is given twice"))
            .at(again, "here again")
            .also(first, "first here")
            .found(format!("`{what}` twice"))
            .expected(format!("one `{what}`")),
    );
    found.is_right = false;
}

fn set_side(checker: &mut Checker<'_>, found: &mut Found<'_>, side: &tree::Name, value: Option<DarcySide>) {
    let indices: Vec<usize> = checker.axes.iter().map(|(_, index)| *index).collect();
    let Some((axis, end)) = checker.word(side, "a side of this domain", &side_words(&indices)) else {
        found.is_right = false;
        return;
    };
    if let Some((_, first)) = found.sides[axis][end].clone() {
        checker.report(
            Diagnostic::error(M002, format!("side `{}` of the flow is given twice", side.value))
                .at(side.span, "here again")
                .also(first, "first here")
                .found("two conditions for one side")
                .expected("a head, a flux or `no_flow` for each side"),
        );
        found.is_right = false;
    }
    found.is_right &= value.is_some();
    found.sides[axis][end] = Some((value.unwrap_or(DarcySide::NoFlow), side.span));
}

/// Every side says what the water does there, and one has a head: fluxes alone leave all heads open.
fn check_sides(checker: &mut Checker<'_>, found: &Found<'_>, place: Span) -> bool {
    let indices: Vec<usize> = checker.axes.iter().map(|(_, index)| *index).collect();
    let mut missing = Vec::new();
    let mut is_right = true;
    for (axis, ends) in found.sides.iter().enumerate() {
        let names = side_names(indices[axis], &indices)[0];
        missing.extend((0..2).filter(|&end| ends[end].is_none()).map(|end| names[end]));
        if let [Some((low, low_span)), Some((high, high_span))] = ends
            && (*low == DarcySide::Periodic) != (*high == DarcySide::Periodic)
        {
            let (at, other) =
                if *low == DarcySide::Periodic { (*low_span, *high_span) } else { (*high_span, *low_span) };
            checker.report(
                Diagnostic::error(
                    M030,
                    format!("`periodic` joins {} and {}: both or none", names[0], names[1]),
                )
                .at(at, "periodic")
                .also(other, "not periodic")
                .found("one periodic side")
                .expected("two periodic sides"),
            );
            is_right = false;
        }
    }
    if !missing.is_empty() && found.is_right {
        let list = missing.join(", ");
        checker.report(
            Diagnostic::error(M001, format!("nothing says what the water does at {list}"))
                .at(place, "sides without a head, a flux or `no_flow`")
                .found(format!("nothing for {list}"))
                .expected("a head, a flux or `no_flow` for each side")
                .help(format!("add for example `no_flow {list}`")),
        );
        return false;
    }
    let has_head = found.sides.iter().flatten().flatten().any(|(side, _)| matches!(side, DarcySide::Head(_)));
    if !has_head && found.is_right && missing.is_empty() && !indices.is_empty() {
        checker.report(
            Diagnostic::error(M030, "no side of the flow has a head")
                .at(place, "fluxes and wells leave all heads open by a constant, and may not balance")
                .found("no `head`")
                .expected("a head at one side or more")
                .help("give one side a `head` instead of its flux"),
        );
        is_right = false;
    }
    is_right
}

fn conductivity<'a>(checker: &mut Checker<'a>, written: &'a tree::Expr) -> Option<Conductivity> {
    if let tree::ExprKind::Call { function, arguments } = &written.kind
        && function.value == "lognormal"
        && checker.scope.get("lognormal").is_none()
    {
        return lognormal::lognormal(checker, function, arguments);
    }
    let value = checker.check(written, Allow::PLACE)?;
    checker.expect_dimension(written, &value, "the conductivity", &[Dimension::VELOCITY])?;
    if let Some(constant) = value.value() {
        let found = format!("{} m/s", precise(constant));
        checker.require(constant > 0.0, "the conductivity", found, "above zero", written.span)?;
    }
    Some(Conductivity::Expression(value))
}

/// One number: vertical over horizontal; or one for each axis, the first of them 1.
fn anisotropy<'a>(checker: &mut Checker<'a>, written: Option<(Span, &'a tree::Expr)>) -> Option<Vec<f64>> {
    let n_axes = checker.axes.len();
    let mut list = vec![1.0; n_axes];
    let Some((word, written)) = written else { return Some(list) };
    let value = checker.slot(written, "the anisotropy", Dimension::NONE)?;
    checker.require(value.value > 0.0, "the anisotropy", precise(value.value), "above zero", value.span)?;
    if n_axes == 1 {
        checker.report(
            Diagnostic::error(D009, "a line has one direction")
                .at(word, "an anisotropy here")
                .found("`anisotropy`")
                .expected("no `anisotropy`, or a domain with more axes"),
        );
        return None;
    }
    if let Some(last) = list.last_mut() {
        *last = value.value;
    }
    Some(list)
}

fn wells<'a>(checker: &mut Checker<'a>, written: &[&'a tree::Well]) -> Option<Vec<Well>> {
    let mut list = Vec::new();
    let mut is_right = true;
    for (idx, well) in written.iter().enumerate() {
        if let Some(first) = written[..idx].iter().find(|first| first.name.value == well.name.value) {
            checker.report(
                Diagnostic::error(D002, format!("well `{}` is defined twice", well.name.value))
                    .at(well.name.span, "here again")
                    .also(first.name.span, "first here")
                    .found("a second definition")
                    .expected("one definition of each well"),
            );
            is_right = false;
        }
        match read_well(checker, well) {
            Some(well) => list.push(well),
            None => is_right = false,
        }
    }
    is_right.then_some(list)
}

fn read_well<'a>(checker: &mut Checker<'a>, well: &'a tree::Well) -> Option<Well> {
    let n_axes = checker.axes.len();
    let area = Dimension::LENGTH.power(n_axes as i32, 1)?;
    let rate = match &well.rate {
        Some(rate) => rate_of(checker, well, rate, area.over(Dimension::TIME)),
        None => {
            checker.report(
                Diagnostic::error(M001, format!("well `{}` has no rate", well.name.value))
                    .at(well.name.span, "no `rate` after its place")
                    .found("no `rate`")
                    .expected("`rate` and water per time, below zero where it is taken out"),
            );
            None
        }
    };
    let carrying = concentrations(checker, &well.carrying, Allow::TIME);
    let (low, high) = well_place(checker, well)?;
    checker.is_inside(&[low, high], &format!("well `{}`", well.name.value), well.at.span, M028)?;
    Some(Well { name: well.name.value.clone(), low, high, rate: rate?, carrying: carrying? })
}

/// Water per time; with fewer than three axes per unit of what is missing.
fn rate_of<'a>(
    checker: &mut Checker<'a>,
    well: &tree::Well,
    written: &'a tree::Expr,
    wanted: Dimension,
) -> Option<Expr> {
    let value = checker.check(written, Allow::TIME)?;
    if matches!(value.kind, Type::Zero) || value.kind == Type::Number(wanted) {
        return Some(value);
    }
    let whole = Dimension::LENGTH.power(3, 1)?.over(Dimension::TIME);
    let (per, by) = match checker.axes.len() {
        1 => (" and square metre across the line", "cross-section: `rate Q / (20 m^2)`"),
        2 => (" and metre of the axis that the domain does not have", "thickness: `rate Q / (10 m)`"),
        _ => ("", ""),
    };
    let message =
        Diagnostic::error(U104, format!("the rate of well `{}` has the wrong dimension", well.name.value))
            .at(written.span, format!("this is {}", value.kind.describe()))
            .found(value.kind.describe())
            .expected(format!("water per time{per} ({})", wanted.unit_text()));
    checker.report(match value.kind == Type::Number(whole) {
        true => message.help(format!("divide it by the {by}")),
        false => message,
    });
    None
}

/// A value that may change in time.
fn timed<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Expr,
    what: &str,
    dimension: Dimension,
) -> Option<Expr> {
    let value = checker.check(written, Allow::TIME)?;
    checker.expect_dimension(written, &value, what, &[dimension])?;
    Some(value)
}

/// Its point, or the ends of its screen along the last axis.
fn well_place<'a>(checker: &mut Checker<'a>, well: &'a tree::Well) -> Option<([f64; 3], [f64; 3])> {
    let Some(screen) = &well.screen else {
        let at = checker.vector(&well.at, "the place of a well", Dimension::LENGTH)?;
        return Some((at, at));
    };
    let Some((name, last)) = checker.axes.last().cloned().filter(|_| checker.axes.len() > 1) else {
        checker.report(
            Diagnostic::error(D009, "a well on a line has no screen")
                .at(screen.low.span.to(screen.high.span), "a screen here")
                .found("`screen`")
                .expected("a point"),
        );
        return None;
    };
    let range = checker.range(screen, "the screen of a well", Some(Dimension::LENGTH));
    // The other axes of the domain: the screen stands in for the last.
    let all = checker.axes.clone();
    checker.axes.pop();
    let at = checker.vector(&well.at, &format!("a well with a screen along {name}"), Dimension::LENGTH);
    checker.axes = all;
    let ((from, to, _), mut low) = (range?, at?);
    let mut high = low;
    (low[last], high[last]) = (from.value, to.value);
    Some((low, high))
}

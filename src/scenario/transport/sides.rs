//! Sides of the domain, whole or in parts, and what happens there.
//!
//! Owns the names of sides and the rules of parts. May use the scenario's slots. It deliberately asks nobody
//! whether particles can do it: `restriction` does.

use super::super::check::{Allow, Checker};
use super::super::choice::Side;
use super::super::collect::Statements;
use super::super::model::{CONCENTRATIONS, species_index};
use super::super::{Axis, Domain};
use super::{Patch, SideRule};
use crate::diagnostic::codes::{M001, M002, M004, M007, M027};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::Span;
use crate::syntax::tree;
use crate::units::Dimension;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Reflect,
    Open,
    Periodic,
    Absorb,
    Outflow,
    Inflow,
    Concentration,
}

const KINDS: &[(&str, Kind)] = &[
    ("reflect", Kind::Reflect),
    ("open", Kind::Open),
    ("periodic", Kind::Periodic),
    ("absorb", Kind::Absorb),
    ("outflow", Kind::Outflow),
    ("inflow", Kind::Inflow),
    ("concentration", Kind::Concentration),
];

/// The words for the two sides of an axis in a domain of given axes.
///
/// x has left and right; the vertical axis (z, or y without z) has bottom and top; y of a box has
/// front and back. A line may call its sides left and right whatever its axis.
pub fn side_names(index: usize, axes: &[usize]) -> Vec<[&'static str; 2]> {
    let mut names = match index {
        0 => vec![["left", "right"]],
        1 if axes.contains(&2) => vec![["front", "back"]],
        _ => vec![["bottom", "top"]],
    };
    if axes.len() == 1 && index != 0 {
        names.push(["left", "right"]);
    }
    names
}

/// Every word for a side of a domain of given axes, with its axis in their order and its end.
pub fn side_words(indices: &[usize]) -> Vec<(&'static str, (usize, usize))> {
    let mut words = Vec::new();
    for (axis_idx, &index) in indices.iter().enumerate() {
        for [low, high] in side_names(index, indices) {
            words.push((low, (axis_idx, 0)));
            words.push((high, (axis_idx, 1)));
        }
    }
    words
}

/// Every side must say what happens there: physics has no default.
pub fn set_sides<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    axes: &mut [Axis],
    domain: &tree::Domain,
) -> bool {
    let indices: Vec<usize> = axes.iter().map(|axis| axis.index).collect();
    let words = side_words(&indices);
    let mut is_right = true;
    for (statement_idx, statement) in statements.boundaries.iter().enumerate() {
        let rule = rule(checker, statement);
        let limits = limits(checker, statement, axes);
        for side in &statement.sides {
            let Some((axis_idx, end)) = checker.word(side, "a side of this domain", &words) else {
                is_right = false;
                continue;
            };
            let Some(limits) = limits.clone() else {
                is_right = false;
                continue;
            };
            is_right &= rule.is_some();
            // The wrong word has been reported; the side itself is not missing.
            let rule = rule.clone().unwrap_or(SideRule::Reflect);
            let patch = Patch { span: side.span, limits, rule, statement: statement_idx };
            is_right &= add(checker, &mut axes[axis_idx], end, patch, side);
        }
    }
    let mut missing = Vec::new();
    for axis in axes.iter_mut() {
        let names = side_names(axis.index, &indices)[0];
        for (end, name) in names.into_iter().enumerate() {
            let patches = &mut axis.patches[end];
            // What is left of a side comes last.
            patches.sort_by_key(|patch| patch.limits.is_empty());
            match patches.last() {
                Some(last) if last.limits.is_empty() => {}
                Some(last) if is_right => is_right = report_rest(checker, name, last.span),
                Some(_) => {}
                None => missing.push(name),
            }
        }
        is_right &= check_periodic(checker, axis, names);
        settle(axis);
    }
    if !missing.is_empty() && is_right {
        report_missing_sides(checker, &missing, domain);
    }
    is_right && missing.is_empty()
}

/// What a statement says of its sides; species and their values are filled in later.
fn rule<'a>(checker: &mut Checker<'a>, statement: &'a tree::Boundary) -> Option<SideRule> {
    let kind = checker.word(&statement.kind, "a kind of boundary", KINDS)?;
    let word = &statement.kind;
    let no_meaning = |checker: &mut Checker<'_>, span: Span, found: String, kinds: &str| {
        checker.report(
            Diagnostic::error(M004, format!("{found} has no meaning for `{}`", word.value))
                .at(span, "not known here")
                .also(word.span, "at a side of this kind")
                .found(found)
                .expected(format!("nothing after it, or {kinds}")),
        );
    };
    if let Some(field) = &statement.rate
        && (kind != Kind::Absorb
            || checker.word(&field.name, "a property of a side", &[("rate", ())]).is_none())
    {
        if kind != Kind::Absorb {
            no_meaning(checker, field.name.span, format!("`{}`", field.name.value), "`absorb`");
        }
        return None;
    }
    let is_carrying = matches!(kind, Kind::Inflow | Kind::Concentration);
    if let Some(first) = statement.carried.first()
        && !is_carrying
    {
        let found = format!("`{} = …`", first.name.value);
        no_meaning(checker, first.name.span, found, "`inflow` or `concentration`");
        return None;
    }
    if kind == Kind::Concentration && statement.carried.is_empty() {
        checker.report(
            Diagnostic::error(M001, "`concentration` does not say which")
                .at(word.span, "no species and value after this")
                .found("no species")
                .expected("one or more species with their concentrations")
                .help(
                    "write for example `concentration A = 1 mol/L`; species that are not named are held at 0",
                ),
        );
        return None;
    }
    Some(match kind {
        Kind::Reflect => SideRule::Reflect,
        Kind::Open => SideRule::Open,
        Kind::Periodic => SideRule::Periodic,
        Kind::Outflow => SideRule::Outflow,
        Kind::Inflow => SideRule::Inflow(Vec::new()),
        Kind::Concentration => SideRule::Held(Vec::new()),
        Kind::Absorb => match &statement.rate {
            None => SideRule::Absorb,
            Some(field) => {
                let rate =
                    checker.slot(&field.value, "the rate of a surface reaction", Dimension::VELOCITY)?;
                let found = format!("{} m/s", precise(rate.value));
                checker.require(
                    rate.value >= 0.0,
                    "the rate of a surface reaction",
                    found,
                    "zero or more",
                    rate.span,
                )?;
                SideRule::Partial(rate.value)
            }
        },
    })
}

/// The part of its sides that a statement speaks of; nothing for whole sides.
fn limits<'a>(
    checker: &mut Checker<'a>,
    statement: &'a tree::Boundary,
    axes: &[Axis],
) -> Option<Vec<(usize, f64, f64)>> {
    let words: Vec<(String, usize)> = checker.axes.clone();
    let words: Vec<(&str, usize)> = words.iter().map(|(name, index)| (name.as_str(), *index)).collect();
    let mut list: Vec<(usize, f64, f64)> = Vec::new();
    for part in &statement.patch {
        let index = checker.word(&part.name, "an axis of the domain", &words);
        let range = checker.range(&part.range, "this part of a side", Some(Dimension::LENGTH));
        let (index, (low, high, _)) = (index?, range?);
        let span = low.span.to_if_same_file(high.span);
        let axis = axes.iter().find(|axis| axis.index == index)?;

        let is_across = !statement.sides.iter().any(|side| is_of(side, index, axes));
        if !is_across || list.iter().any(|(other, ..)| *other == index) {
            let message = if is_across {
                "an axis is limited twice"
            } else {
                "a side has no extent along its own axis"
            };
            checker.report(
                Diagnostic::error(M027, message)
                    .at(part.name.span, "not this axis")
                    .found(format!("`{} = …`", part.name.value))
                    .expected("each of the other axes once"),
            );
            return None;
        }
        if low.value < axis.low || high.value > axis.high {
            checker.report(
                Diagnostic::error(M027, "this part reaches beyond its side")
                    .at(span, format!("{} m .. {} m", precise(low.value), precise(high.value)))
                    .also(axis.span, "the domain")
                    .found(format!("{} m .. {} m", precise(low.value), precise(high.value)))
                    .expected(format!("within {} m .. {} m", precise(axis.low), precise(axis.high))),
            );
            return None;
        }
        list.push((index, low.value, high.value));
    }
    Some(list)
}

/// Whether a name is that of a side normal to an axis.
fn is_of(side: &tree::Name, index: usize, axes: &[Axis]) -> bool {
    let indices: Vec<usize> = axes.iter().map(|axis| axis.index).collect();
    side_names(index, &indices).concat().contains(&side.value.as_str())
}

/// Adds a part, unless it stands twice or does not go with the others.
fn add(checker: &mut Checker<'_>, axis: &mut Axis, end: usize, patch: Patch, side: &tree::Name) -> bool {
    let overlaps = |other: &&Patch| {
        let is_whole = patch.limits.is_empty() || other.limits.is_empty();
        let apart = patch.limits.iter().any(|(axis, low, high)| {
            let same = other.limits.iter().find(|(index, ..)| index == axis);
            same.is_some_and(|(_, from, to)| from >= high || to <= low)
        });
        if is_whole { patch.limits.is_empty() && other.limits.is_empty() } else { !apart }
    };
    let mut is_right = true;
    if let Some(first) = axis.patches[end].iter().find(overlaps) {
        let is_whole = patch.limits.is_empty();
        let message = if is_whole {
            Diagnostic::error(M002, format!("side `{}` is given twice", side.value))
                .found("two boundaries for one side")
                .expected("one boundary for every side")
        } else {
            Diagnostic::error(M027, format!("two parts of side `{}` overlap", side.value))
                .found("two boundaries for one place")
                .expected("parts that leave each other alone")
        };
        checker.report(message.at(side.span, "here again").also(first.span, "first here"));
        is_right = false;
    }
    if !patch.limits.is_empty() && matches!(patch.rule, SideRule::Open | SideRule::Periodic) {
        checker.report(
            Diagnostic::error(M027, "this kind of boundary is one of a whole side")
                .at(side.span, "a part of a side")
                .found("a part")
                .expected("a whole side, or another kind"),
        );
        is_right = false;
    }
    axis.patches[end].push(patch);
    is_right
}

/// What today's walk knows, and the places of the sides.
fn settle(axis: &mut Axis) {
    let side = |patches: &[Patch]| {
        let last = patches.last()?;
        let side = match last.rule {
            SideRule::Periodic => Side::Periodic,
            SideRule::Open => Side::Open,
            _ => Side::Reflect,
        };
        Some((side, last.span))
    };
    if let Some((side, span)) = side(&axis.patches[0]) {
        (axis.low_side, axis.low_side_span) = (side, span);
    }
    if let Some((side, span)) = side(&axis.patches[1]) {
        (axis.high_side, axis.high_side_span) = (side, span);
    }
}

fn report_rest(checker: &mut Checker<'_>, name: &str, part: Span) -> bool {
    checker.report(
        Diagnostic::error(M027, format!("nothing says what happens at the rest of side `{name}`"))
            .at(part, "a part of it")
            .found("parts only")
            .expected("a boundary for what is left of the side")
            .help(format!("add for example `boundary {name} reflect`")),
    );
    false
}

fn report_missing_sides(checker: &mut Checker<'_>, missing: &[&str], domain: &tree::Domain) {
    let list = missing.join(", ");
    checker.report(
        Diagnostic::error(M001, format!("nothing says what happens at {list}"))
            .at(domain.shape.span, "sides of this domain without a boundary")
            .found(format!("no boundary for {list}"))
            .expected("one boundary for every side")
            .help(format!("add for example `boundary {list} reflect`")),
    );
}

fn check_periodic(checker: &mut Checker<'_>, axis: &Axis, names: [&str; 2]) -> bool {
    let is_periodic = |patches: &[Patch]| {
        patches.last().map(|patch| (patch.rule == SideRule::Periodic && patches.len() == 1, patch.span))
    };
    let (Some((low, low_span)), Some((high, high_span))) =
        (is_periodic(&axis.patches[0]), is_periodic(&axis.patches[1]))
    else {
        return true;
    };
    if low == high {
        return true;
    }
    let (place, other) = if low { (low_span, high_span) } else { (high_span, low_span) };
    checker.report(
        Diagnostic::error(M007, format!("`periodic` joins {} and {}: both or none", names[0], names[1]))
            .at(place, "periodic")
            .also(other, "not periodic")
            .also(axis.span, "of this axis")
            .found("one periodic side")
            .expected("two periodic sides"),
    );
    false
}

/// Fills in what enters or is held at the sides, once the species are known.
pub fn carried<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    domain: &mut Domain,
) -> Option<()> {
    let of_statement: Vec<Option<Vec<(usize, super::Expr)>>> = statements
        .boundaries
        .iter()
        .map(|statement| concentrations(checker, &statement.carried, Allow::REFERENCE))
        .collect();
    let is_right = of_statement.iter().all(Option::is_some);
    for patch in domain.axes.iter_mut().flat_map(|axis| &mut axis.patches).flatten() {
        if let (SideRule::Inflow(list) | SideRule::Held(list), Some(Some(known))) =
            (&mut patch.rule, of_statement.get(patch.statement))
        {
            list.clone_from(known);
        }
    }
    is_right.then_some(())
}

/// `A = 1 mg/L, B = 0`: each species once, its concentration over place and time as far as these may be named.
pub fn concentrations<'a>(
    checker: &mut Checker<'a>,
    written: &'a [tree::Assignment],
    allow: Allow,
) -> Option<Vec<(usize, super::Expr)>> {
    let mut list: Vec<(usize, super::Expr)> = Vec::new();
    let mut is_right = true;
    for (place, assignment) in written.iter().enumerate() {
        let species = species_index(checker, &assignment.name);
        let value = checker.check(&assignment.value, allow);
        let (Some(species), Some(value)) = (species, value) else {
            is_right = false;
            continue;
        };
        if list.iter().any(|(known, _)| *known == species) {
            checker.report(
                Diagnostic::error(M002, format!("`{}` has two concentrations here", assignment.name.value))
                    .at(assignment.name.span, "here again")
                    .also(
                        written[..place]
                            .iter()
                            .rfind(|it| it.name.value == assignment.name.value)
                            .map_or(assignment.name.span, |it| it.name.span),
                        "first here",
                    )
                    .found("a second concentration")
                    .expected("one for each species"),
            );
            is_right = false;
        }
        let what = format!("the concentration of `{}`", assignment.name.value);
        let Some(dimension) = checker.concentration_of(species) else {
            checker.expect_dimension(&assignment.value, &value, &what, &CONCENTRATIONS);
            is_right = false;
            continue;
        };
        is_right &= checker.expect_dimension(&assignment.value, &value, &what, &[dimension]).is_some();
        if let Some(constant) = value.value() {
            let found = checker.shown(constant, dimension, assignment.value.span);
            is_right &= checker
                .require(constant >= 0.0, &what, found, "zero or more", assignment.value.span)
                .is_some();
        }
        list.push((species, value));
    }
    is_right.then_some(list)
}

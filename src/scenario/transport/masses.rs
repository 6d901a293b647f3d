//! Particles and their numbers, and the criteria of `step auto`.
//!
//! Owns `particles` and the step. May use the scenario's slots. It deliberately shares nothing by mass: the
//! plan does, as that hangs on flow and sources.

use super::super::check::Checker;
use super::super::choice::{PLACEMENTS, Placement};
use super::super::collect::Statements;
use super::super::model::{MAX_PARTICLES, species_index};
use super::super::scope::Origin;
use super::super::{Particles, slot::Value};
use super::{Auto, Shares};
use crate::diagnostic::codes::{M001, M002, M004};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::Span;
use crate::syntax::tree::{self, BinaryOperator, Count, ExprKind};
use crate::units::Dimension;

/// Distances of parcels that one may lie from its place; far below, there is nothing left of an order.
const MOST_DISORDER: f64 = 1000.0;

pub fn particles<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> Option<Particles> {
    let (span, written) = statements.particles?;
    let is_mass = checker.word(&written.kind, "a kind of particle", &[("fluid", false), ("mass", true)]);
    if let (Some(true), Count::All(count), Some(number)) = (is_mass, &written.count, &written.placement)
        && let Some(species) = species_named(checker, count)
    {
        return one_share(checker, statements, span, species, number);
    }
    let placement = match &written.placement {
        Some(name) => checker.word(name, "a placement", PLACEMENTS),
        None => Some(Placement::Random),
    };
    let (count, count_span, shares) = match &written.count {
        Count::All(count) => {
            let value = number(checker, count, "the number of particles")?;
            (value.0, value.1, (is_mass == Some(true)).then_some(Shares::ByMass))
        }
        Count::Shares(list) => shares(checker, statements, list, is_mass?)?,
    };
    is_mass?;
    let (kind_span, placement) = (written.kind.span, placement?);
    let disorder = match &written.disorder {
        Some(value) => disorder(checker, value, placement, written.placement.as_ref()?.span)?,
        None => 0.0,
    };
    Some(Particles { span, kind_span, count, count_span, placement, disorder, shares })
}

/// `disorder Q` after `ordered`.
fn disorder<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Expr,
    placement: Placement,
    placement_span: Span,
) -> Option<f64> {
    let what = "the disorder of parcels";
    let value = checker.slot(written, what, Dimension::NONE)?;
    if placement != Placement::Ordered {
        checker.report(
            Diagnostic::error(M004, "`disorder` says how far parcels lie from the places of an order")
                .at(value.span, "there is no order here")
                .also(placement_span, "this placement has no places to lie beside")
                .found("`disorder` of particles that are not ordered")
                .expected("`ordered disorder Q`, or no `disorder`")
                .help("with `ordered disorder 1` each is anywhere in its share of the domain"),
        );
        return None;
    }
    let is_fine = (0.0..=MOST_DISORDER).contains(&value.value);
    let rule = format!("from 0 to {MOST_DISORDER}");
    checker.require(is_fine, what, precise(value.value), &rule, value.span)?;
    Some(value.value)
}

fn number<'a>(checker: &mut Checker<'a>, written: &'a tree::Expr, what: &str) -> Option<(u64, Span)> {
    let value: Value = checker.slot(written, what, Dimension::NONE)?;
    Some((checker.count(value.value, what, MAX_PARTICLES, value.span)?, value.span))
}

/// The species that an expression is the name of.
fn species_named(checker: &Checker<'_>, written: &tree::Expr) -> Option<usize> {
    let ExprKind::Path(path) = &written.kind else { return None };
    let [name] = path.as_slice() else { return None };
    match checker.scope.get(&name.value)?.origin {
        Origin::Species(idx) => Some(idx),
        _ => None,
    }
}

/// `particles mass A n`: by the words alone `n` could be a placement.
fn one_share(
    checker: &mut Checker<'_>,
    statements: &Statements<'_>,
    span: Span,
    species: usize,
    number: &tree::Name,
) -> Option<Particles> {
    let Some(entry) = checker.scope.get_mut(&number.value) else {
        checker.scope.note_undefined(&number.value, number.span);
        return None;
    };
    entry.n_uses += 1;
    let (value, _) = checker.constant_of(&number.value)?;
    let count = checker.count(value, "the number of particles", MAX_PARTICLES, number.span)?;
    let mut counts = vec![None; statements.species.len()];
    counts[species] = Some(count);
    let counts = all_counts(checker, statements, &counts, number.span)?;
    let kind_span = statements.particles?.1.kind.span;
    let shares = Some(Shares::Given(counts));
    let (count_span, placement) = (number.span, Placement::Random);
    Some(Particles { span, kind_span, count, count_span, placement, disorder: 0.0, shares })
}

fn shares<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    list: &'a [tree::Field],
    is_mass: bool,
) -> Option<(u64, Span, Option<Shares>)> {
    let place = match (list.first(), list.last()) {
        (Some(first), Some(last)) => first.name.span.to_if_same_file(last.value.span),
        _ => statements.particles?.0,
    };
    if !is_mass {
        checker.report(
            Diagnostic::error(M004, "fluid particles carry all species: they have one number")
                .at(place, "numbers of single species")
                .found("a number for each species")
                .expected("one number, or `particles mass`"),
        );
        return None;
    }
    let mut counts: Vec<Option<u64>> = vec![None; statements.species.len()];
    let mut is_right = true;
    for (idx, field) in list.iter().enumerate() {
        let species = species_index(checker, &field.name);
        let what = format!("the number of particles of `{}`", field.name.value);
        let count = number(checker, &field.value, &what);
        let (Some(species), Some((count, _))) = (species, count) else {
            is_right = false;
            continue;
        };
        if let Some(first) = list[..idx].iter().find(|it| it.name.value == field.name.value) {
            checker.report(
                Diagnostic::error(M002, format!("`{}` has two numbers of particles", field.name.value))
                    .at(field.name.span, "here again")
                    .also(first.name.span, "first here")
                    .found("one species twice")
                    .expected("each species once"),
            );
            is_right = false;
        }
        counts[species] = Some(count);
    }
    is_right.then_some(())?;
    let counts = all_counts(checker, statements, &counts, place)?;
    let total = counts.iter().fold(0_u64, |sum, &count| sum.saturating_add(count));
    let total = checker.count(total as f64, "the number of particles", MAX_PARTICLES, place)?;
    Some((total, place, Some(Shares::Given(counts))))
}

fn all_counts(
    checker: &mut Checker<'_>,
    statements: &Statements<'_>,
    counts: &[Option<u64>],
    place: Span,
) -> Option<Vec<u64>> {
    let missing: Vec<&str> = statements
        .species
        .iter()
        .zip(counts)
        .filter(|(_, count)| count.is_none())
        .map(|(species, _)| species.name.value.as_str())
        .collect();
    let Some(first) = missing.first() else { return counts.iter().copied().collect() };
    let list = missing.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
    checker.report(
        Diagnostic::error(M001, format!("nothing says how many particles {list} has"))
            .at(place, "without it")
            .found(format!("no number for {list}"))
            .expected("a number for each species, or one for all together")
            .help(format!("add for example `, {first} 10_000`")),
    );
    None
}

const CRITERIA: &[(&str, usize)] = &[("courant", 0), ("dispersion", 1), ("reaction", 2)];

/// What `step auto` means without numbers; they are numerics, and the plan shows them.
const DEFAULTS: [f64; 2] = [0.5, 0.1];

/// `step auto`, `step auto(courant <= 0.5, dispersion <= 0.1)`; `None` for any other step, `Some(None)` for a
/// wrong one.
pub fn auto<'a>(checker: &mut Checker<'a>, step: &'a tree::Expr) -> Option<Option<Auto>> {
    if checker.scope.get("auto").is_some() {
        return None;
    }
    let arguments = match &step.kind {
        ExprKind::Call { function, arguments } if function.value == "auto" => &arguments[..],
        ExprKind::Path(path) if path.len() == 1 && path[0].value == "auto" => &[],
        _ => return None,
    };
    Some(criteria(checker, arguments))
}

fn criteria<'a>(checker: &mut Checker<'a>, arguments: &'a [tree::Argument]) -> Option<Auto> {
    let mut found: [Option<(f64, Span)>; 3] = [None; 3];
    let mut is_right = true;
    for argument in arguments {
        let ExprKind::Binary { operator, left, right } = &argument.value.kind else {
            is_right = report_criterion(checker, argument.value.span);
            continue;
        };
        let name = match &left.kind {
            ExprKind::Path(path) if operator.value == BinaryOperator::LessEqual && path.len() == 1 => {
                &path[0]
            }
            _ => {
                is_right = report_criterion(checker, argument.value.span);
                continue;
            }
        };
        let Some(which) = checker.word(name, "a criterion for steps", CRITERIA) else {
            is_right = false;
            continue;
        };
        let slot = &mut found[which];
        if let Some((_, first)) = slot.replace((0.0, name.span)) {
            checker.report(
                Diagnostic::error(M002, format!("`{}` is given twice", name.value))
                    .at(name.span, "here again")
                    .also(first, "first here")
                    .found("one criterion twice")
                    .expected("each criterion once"),
            );
            is_right = false;
        }
        let what = format!("`{}`", name.value);
        let Some(value) = checker.slot(right, &what, Dimension::NONE) else {
            is_right = false;
            continue;
        };
        let is_inside = value.value > 0.0 && value.value <= 10.0;
        is_right &= checker
            .require(is_inside, &what, precise(value.value), "above 0, at most 10", value.span)
            .is_some();
        found[which] = Some((value.value, name.span));
    }
    let value = |which: usize| found[which].map_or(DEFAULTS[which], |(value, _)| value);
    let reaction = found[2].map(|(value, _)| value);
    is_right.then(|| Auto { courant: value(0), dispersion: value(1), reaction })
}

fn report_criterion(checker: &mut Checker<'_>, span: Span) -> bool {
    checker.report(
        Diagnostic::error(M004, "this is no criterion for steps")
            .at(span, "not of the form `courant <= 0.5`")
            .found("something else")
            .expected("`courant <= …`, `dispersion <= …`, `reaction <= …`"),
    );
    false
}

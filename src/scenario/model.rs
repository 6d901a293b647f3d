//! Species, reactions, mixing zones, particles and the run itself.

use super::check::{Allow, Checker};
use super::collect::Statements;
use super::expression::{Expr, Type};
use super::scope::Origin;
use super::slot::collect_names;
use super::{Mixing, Particles, Placement, Reaction, Run, Species, Zone};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{D002, D005, D006, M001, M002, M004, M005, M009, M010, M011, M012, M013};
use crate::source::Span;
use crate::syntax::tree::{self, ExprKind};
use crate::units::Dimension;

/// Particles that a plan may name at all; memory is checked against the machine later.
const MAX_PARTICLES: f64 = 1e11;

/// The species so far; some may be wrong while the rest is still checked.
pub(super) struct SpeciesList {
    pub list: Vec<Option<Species>>,
}

impl SpeciesList {
    pub(super) fn all_right(self) -> Option<Vec<Species>> {
        self.list.into_iter().collect()
    }
}

const CONCENTRATIONS: [Dimension; 2] = [Dimension::MOLAR_CONCENTRATION, Dimension::MASS_CONCENTRATION];

pub(super) fn species<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> SpeciesList {
    for species in &statements.species {
        for qualifier in &species.qualifiers {
            // All species move with the fluid in this version; the word may say so.
            if qualifier.value == "immobile" {
                checker.report(
                    Diagnostic::error(M004, "immobile species are not in this version")
                        .at(qualifier.span, "all species move with the fluid")
                        .found("`immobile`")
                        .expected("`mobile`, or nothing"),
                );
            } else {
                checker.word(qualifier, "a property of a species", &[("mobile", ())]);
            }
        }
    }
    let assigned = assignments(checker, statements);
    let mut initials: Vec<Initial> = vec![Initial::Untouched; statements.species.len()];
    for idx in 0..initials.len() {
        initial_of(checker, statements, &assigned, &mut initials, idx);
    }
    spread_dimensions(checker, statements);
    let list = statements.species.iter().enumerate().map(|(idx, written)| {
        let dimension = checker.species_dimensions[idx].unwrap_or(Dimension::MOLAR_CONCENTRATION);
        let initial = match &initials[idx] {
            Initial::Known(expr) => expr.clone(),
            Initial::Absent => Expr::constant(0.0, Type::Zero, written.name.span),
            Initial::Untouched | Initial::Running | Initial::Wrong => return None,
        };
        Some(Species {
            name: written.name.value.clone(),
            doc: written.doc.as_ref().map(|doc| doc.value.clone()),
            span: written.name.span,
            dimension,
            initial,
        })
    });
    SpeciesList { list: list.collect() }
}

#[derive(Clone)]
enum Initial {
    Untouched,
    Running,
    Absent,
    Known(Expr),
    Wrong,
}

/// The assignment of each species, if it has one.
fn assignments<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
) -> Vec<Option<&'a tree::Assignment>> {
    let mut assigned: Vec<Option<&'a tree::Assignment>> = vec![None; statements.species.len()];
    for assignment in &statements.initials {
        let Some(idx) = species_index(checker, &assignment.name) else { continue };
        if let Some(first) = assigned[idx] {
            checker.report(
                Diagnostic::error(
                    D002,
                    format!("`{}` has two initial concentrations", assignment.name.value),
                )
                .at(assignment.name.span, "here again")
                .also(first.name.span, "first here")
                .found("a second initial concentration")
                .expected("one for each species"),
            );
            continue;
        }
        assigned[idx] = Some(assignment);
    }
    assigned
}

/// The species that a name means, or a message.
pub(super) fn species_index(checker: &mut Checker<'_>, name: &tree::Name) -> Option<usize> {
    let Some(entry) = checker.scope.get_mut(&name.value) else {
        checker.scope.note_undefined(&name.value, name.span);
        return None;
    };
    entry.n_uses += 1;
    if let Origin::Species(idx) = entry.origin {
        return Some(idx);
    }
    let (what, defined) = (entry.origin.describe(), entry.span);
    checker.report(
        Diagnostic::error(D005, format!("`{}` is not a species", name.value))
            .at(name.span, format!("this is {what}"))
            .also(defined, "defined here")
            .found(what)
            .expected("a species"),
    );
    None
}

fn initial_of<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    assigned: &[Option<&'a tree::Assignment>],
    initials: &mut [Initial],
    idx: usize,
) {
    match initials[idx] {
        Initial::Untouched => {}
        Initial::Running => {
            let name = &statements.species[idx].name;
            let place = assigned[idx].map_or(name.span, |assignment| assignment.name.span);
            checker.report(
                Diagnostic::error(
                    D006,
                    format!("the initial concentration of `{}` needs itself", name.value),
                )
                .at(place, "in a circle of definitions")
                .found("a circle")
                .expected("initial concentrations that end in numbers"),
            );
            initials[idx] = Initial::Wrong;
            return;
        }
        _ => return,
    }
    let Some(assignment) = assigned[idx] else {
        initials[idx] = Initial::Absent;
        return;
    };
    initials[idx] = Initial::Running;
    let mut names = Vec::new();
    collect_names(&assignment.value, &mut names);
    for name in names {
        if let Some(Origin::Species(other)) = checker.scope.get(&name).map(|entry| entry.origin) {
            initial_of(checker, statements, assigned, initials, other);
        }
    }
    if matches!(initials[idx], Initial::Wrong) {
        return;
    }
    let what = format!("the initial concentration of `{}`", assignment.name.value);
    let checked = checker.check(&assignment.value, Allow::INITIAL);
    let kind = checked
        .as_ref()
        .and_then(|expr| checker.expect_dimension(&assignment.value, expr, &what, &CONCENTRATIONS));
    if let Some(Type::Number(dimension)) = kind {
        checker.species_dimensions[idx] = Some(dimension);
    }
    if let Some(expr) = &checked
        && let Some(value) = expr.value()
        && value < 0.0
    {
        checker.require(false, &what, format!("{value} (SI)"), "zero or more", assignment.value.span);
    }
    initials[idx] = match (checked, kind) {
        (Some(expr), Some(_)) => Initial::Known(expr),
        _ => Initial::Wrong,
    };
}

/// A species without a dimension of its own takes that of its reaction's other species.
fn spread_dimensions(checker: &mut Checker<'_>, statements: &Statements<'_>) {
    for _ in 0..=statements.reactions.len() {
        for (span, reaction) in &statements.reactions {
            let members: Vec<(usize, Span)> = reaction
                .reactants
                .iter()
                .chain(&reaction.products)
                .filter_map(|term| match checker.scope.get(&term.species.value)?.origin {
                    Origin::Species(idx) => Some((idx, term.species.span)),
                    _ => None,
                })
                .collect();
            let known =
                members.iter().find_map(|(idx, place)| Some((checker.species_dimensions[*idx]?, *place)));
            let Some((dimension, place)) = known else { continue };
            for (idx, own_place) in members {
                let own = *checker.species_dimensions[idx].get_or_insert(dimension);
                if own != dimension {
                    checker.report(
                        Diagnostic::error(M009, "a reaction cannot mix amounts and masses")
                            .at(own_place, format!("this is {}", own.describe()))
                            .also(place, format!("this is {}", dimension.describe()))
                            .also(*span, "in this reaction")
                            .found(own.describe())
                            .expected(dimension.describe())
                            .help("give all species of a reaction in mol/L, or all in mg/L"),
                    );
                }
            }
        }
    }
}

pub(super) fn reactions<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    species: &SpeciesList,
) -> Option<Vec<Reaction>> {
    debug_assert_eq!(species.list.len(), statements.species.len());
    let all: Vec<Option<Reaction>> = statements
        .reactions
        .iter()
        .enumerate()
        .map(|(idx, (span, written))| reaction(checker, idx, *span, written))
        .collect();
    let all: Vec<Reaction> = all.into_iter().collect::<Option<_>>()?;
    check_competition(checker, statements, &all)?;
    Some(all)
}

fn reaction<'a>(
    checker: &mut Checker<'a>,
    idx: usize,
    span: Span,
    written: &'a tree::Reaction,
) -> Option<Reaction> {
    let name =
        written.name.as_ref().map_or_else(|| format!("reaction_{}", idx + 1), |name| name.value.clone());
    let reactants = side(checker, &written.reactants);
    let products = side(checker, &written.products);
    check_instant(checker, written)?;
    let (reactants, products) = (reactants?, products?);
    if reactants.len() < 2 {
        checker.report(
            Diagnostic::error(M010, format!("`{name}` cannot be instant"))
                .at(span, "an instant reaction of one species would leave nothing of it")
                .found(format!("{} reacting species", reactants.len()))
                .expected("two or more different reactants"),
        );
        return None;
    }
    Some(Reaction { name, span, reactants, products })
}

/// Only complete instant reactions run in this edition.
fn check_instant(checker: &mut Checker<'_>, written: &tree::Reaction) -> Option<()> {
    let is_instant =
        matches!(&written.rate.kind, ExprKind::Path(path) if path.len() == 1 && path[0].value == "instant");
    if !is_instant {
        let mut names = Vec::new();
        collect_names(&written.rate, &mut names);
        // What the law names is used, so that nothing is said of it besides.
        for name in &names {
            if let Some(entry) = checker.scope.get_mut(name) {
                entry.n_uses += 1;
            }
        }
        let word = matches!(&written.rate.kind, ExprKind::Path(_)).then(|| names.first()).flatten();
        let mut message = Diagnostic::error(M011, "this rate is not in this version")
            .at(written.rate.span, "only `instant` is known here")
            .found(word.map_or_else(|| "a rate law".to_owned(), |word| format!("`{word}`")))
            .expected("`instant`");
        if word.is_some_and(|word| crate::diagnostic::did_you_mean(word, ["instant"]).is_some()) {
            message = message.help("did you mean `instant`?");
        }
        checker.report(message);
        return None;
    }
    if written.arrow.value == tree::Arrow::Both {
        checker.report(
            Diagnostic::error(M011, "an instant reaction goes one way")
                .at(written.arrow.span, "this is a reversible reaction")
                .found("`<->`")
                .expected("`->`"),
        );
        return None;
    }
    Some(())
}

fn side(checker: &mut Checker<'_>, terms: &[tree::Term]) -> Option<Vec<(usize, f64)>> {
    let mut list: Vec<(usize, f64)> = Vec::new();
    let mut is_right = true;
    for term in terms {
        let coefficient = match &term.coefficient {
            None => Some(1.0),
            Some(digits) => {
                let value: f64 = digits.value.parse().unwrap_or(f64::NAN);
                let is_fine = value > 0.0 && value.is_finite();
                checker
                    .require(
                        is_fine,
                        "a stoichiometric coefficient",
                        digits.value.clone(),
                        "above zero",
                        digits.span,
                    )
                    .map(|()| value)
            }
        };
        match (species_index(checker, &term.species), coefficient) {
            (Some(idx), Some(coefficient)) => match list.iter_mut().find(|(known, _)| *known == idx) {
                Some((_, sum)) => *sum += coefficient,
                None => list.push((idx, coefficient)),
            },
            _ => is_right = false,
        }
    }
    is_right.then_some(list)
}

/// Instant reactions that share a reactant, or feed one another, have no defined order.
fn check_competition(checker: &mut Checker<'_>, statements: &Statements<'_>, all: &[Reaction]) -> Option<()> {
    for (second_idx, second) in all.iter().enumerate() {
        for first in &all[..=second_idx] {
            let is_same = std::ptr::eq(first, second);
            let shares = |a: &[(usize, f64)], b: &[(usize, f64)]| {
                a.iter()
                    .find(|(species, _)| b.iter().any(|(other, _)| other == species))
                    .map(|(species, _)| *species)
            };
            let shared = if is_same {
                shares(&first.reactants, &first.products)
            } else {
                shares(&first.reactants, &second.reactants)
                    .or_else(|| shares(&first.reactants, &second.products))
                    .or_else(|| shares(&first.products, &second.reactants))
            };
            let Some(species) = shared else { continue };
            let name = &statements.species[species].name.value;
            let mut message = Diagnostic::error(M012, "instant reactions compete")
                .at(second.span, format!("`{name}` has more than one part in instant reactions"))
                .found(format!("`{name}` twice"))
                .expected("each reactant of an instant reaction in that place alone");
            message = if is_same {
                message.help(format!("write `{name}` on one side only"))
            } else {
                message.also(first.span, "and here").note(
                    "two instant reactions of one species have no order, so their result is not defined",
                )
            };
            checker.report(message);
            return None;
        }
    }
    Some(())
}

/// `Some(None)`: no zones, no mixing.
pub(super) fn mixing<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> Option<Option<Mixing>> {
    let Some((span, written)) = statements.zones else { return Some(None) };
    let mut names: Vec<&tree::Name> = Vec::new();
    let mut zones = Vec::new();
    let mut is_right = true;
    for zone in written {
        if let Some(first) = names.iter().find(|first| first.value == zone.name.value) {
            checker.report(
                Diagnostic::error(D002, format!("zone `{}` is defined twice", zone.name.value))
                    .at(zone.name.span, "here again")
                    .also(first.span, "first here")
                    .found("a second definition")
                    .expected("one definition of each zone"),
            );
            is_right = false;
        }
        names.push(&zone.name);
        match read_zone(checker, zone) {
            Some(zone) => zones.push(zone),
            None => is_right = false,
        }
    }
    if statements.average.is_none() && !zones.is_empty() {
        checker.report(
            Diagnostic::error(M001, "mixing zones need an average to exchange with")
                .at(span, "zones without an `average` statement")
                .found("no `average`")
                .expected("one `average` statement")
                .help("add for example `average bins 300`"),
        );
    }
    if !is_right {
        return None;
    }
    let sum: f64 = zones.iter().map(|zone| zone.fraction).sum();
    if (sum - 1.0).abs() > 1e-9 {
        checker.report(
            Diagnostic::error(M013, "the fractions of the zones do not add up")
                .at(span, format!("their sum is {sum}"))
                .found(sum.to_string())
                .expected("1")
                .help("write the last fraction as 1 minus the others"),
        );
        return None;
    }
    Some(Some(Mixing { span, zones }))
}

fn read_zone<'a>(checker: &mut Checker<'a>, zone: &'a tree::Zone) -> Option<Zone> {
    let mut fraction = None;
    let mut rate = None;
    let mut is_right = true;
    for field in &zone.fields {
        let Some(is_fraction) =
            checker.word(&field.name, "a property of a zone", &[("fraction", true), ("rate", false)])
        else {
            is_right = false;
            continue;
        };
        let slot = if is_fraction { &mut fraction } else { &mut rate };
        if let Some(first) = slot.replace(field) {
            let first: &tree::Field = first;
            checker.report(
                Diagnostic::error(
                    M002,
                    format!("a second `{}` of zone `{}`", field.name.value, zone.name.value),
                )
                .at(field.name.span, "here again")
                .also(first.name.span, "first here")
                .found(format!("`{}` twice", field.name.value))
                .expected(format!("one `{}`", field.name.value)),
            );
            is_right = false;
        }
    }
    for (slot, word, example) in [(&fraction, "fraction", "fraction 0.5"), (&rate, "rate", "rate 1e-3 /s")] {
        if slot.is_none() && is_right {
            checker.report(
                Diagnostic::error(M001, format!("zone `{}` has no {word}", zone.name.value))
                    .at(zone.name.span, format!("without a {word}"))
                    .found(format!("no `{word}`"))
                    .expected(format!("`{word}` and a value"))
                    .help(format!("add for example `{example}`")),
            );
        }
    }
    let (fraction, rate) = (fraction?, rate?);
    let share = checker.slot(&fraction.value, "a fraction", Dimension::NONE);
    let share = share.and_then(|share| {
        let is_fine = (0.0..=1.0).contains(&share.value);
        checker.require(is_fine, "a fraction", share.value.to_string(), "from 0 to 1", share.span)?;
        Some(share.value)
    });
    let is_instant =
        matches!(&rate.value.kind, ExprKind::Path(path) if path.len() == 1 && path[0].value == "instant");
    let speed = if is_instant {
        Some(None)
    } else {
        checker.slot(&rate.value, "an exchange rate", Dimension::RATE).and_then(|speed| {
            checker.require(
                speed.value >= 0.0,
                "an exchange rate",
                speed.value.to_string(),
                "zero or more",
                speed.span,
            )?;
            Some(Some(speed.value))
        })
    };
    is_right.then_some(())?;
    Some(Zone {
        name: zone.name.value.clone(),
        span: zone.name.span,
        fraction: share?,
        rate: speed?,
        rate_span: rate.value.span,
    })
}

pub(super) fn particles<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> Option<Particles> {
    let (span, written) = statements.particles?;
    let kind = checker.word(&written.kind, "a kind of particle", &[("fluid", ())]);
    let placements = [
        ("stratified", Placement::Stratified),
        ("random", Placement::Random),
        ("ordered", Placement::Ordered),
    ];
    let placement = match &written.placement {
        Some(name) => checker.word(name, "a placement", &placements),
        None => Some(Placement::Random),
    };
    let count = checker.slot(&written.count, "the number of particles", Dimension::NONE)?;
    let count_value = checker.count(count.value, "the number of particles", MAX_PARTICLES, count.span)?;
    kind?;
    Some(Particles { span, count: count_value, count_span: count.span, placement: placement? })
}

pub(super) fn run<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> Option<Run> {
    let (span, written) = statements.run?;
    let duration = checker.slot(&written.duration, "the duration", Dimension::TIME).and_then(|duration| {
        let found = format!("{} s", duration.value);
        checker.require(duration.value > 0.0, "the duration", found, "above zero", duration.span)?;
        Some(duration)
    });
    let step = match &written.step {
        Some(step) => checker.slot(step, "the step", Dimension::TIME).and_then(|step| {
            let found = format!("{} s", step.value);
            checker.require(step.value > 0.0, "the step", found, "above zero", step.span)?;
            Some(step)
        }),
        None => {
            checker.report(
                Diagnostic::error(M001, "the run has no step")
                    .at(span, "no `step` here")
                    .found("no `step`")
                    .expected("`, step` and a time")
                    .help("add for example `, step 1 min`"),
            );
            None
        }
    };
    let mut are_normals_double = false;
    let mut is_right = true;
    for (name, value) in &written.settings {
        let known = checker.word(name, "a setting of the run", &[("normals", ())]);
        let chosen = checker.word(value, "a kind of normals", &[("single", false), ("double", true)]);
        match (known, chosen) {
            (Some(()), Some(is_double)) => are_normals_double = is_double,
            _ => is_right = false,
        }
    }
    let (duration, step) = (duration?, step?);
    let n_steps = duration.value / step.value;
    if n_steps > 1e12 {
        checker.report(
            Diagnostic::error(M005, "the run would have too many steps")
                .at(step.span, format!("{n_steps:.3e} steps"))
                .also(duration.span, "for this duration")
                .found(format!("{n_steps:.3e} steps"))
                .expected("at most 1e12"),
        );
        return None;
    }
    is_right.then_some(())?;
    Some(Run { span, duration: duration.value, step: step.value, step_span: step.span, are_normals_double })
}

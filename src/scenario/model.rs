//! Species and the run itself.

use super::check::{Allow, Checker, label_circle};
use super::collect::Statements;
use super::expression::{Expr, Type};
use super::scope::Origin;
use super::slot::Value;
use super::slot::collect_names;
use super::{Run, Species};
use crate::diagnostic::codes::{D002, D005, D006, M001, M005, M009};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::Span;
use crate::syntax::tree;
use crate::units::Dimension;

/// Particles that a plan may name at all; memory is checked against the machine later.
pub(super) const MAX_PARTICLES: f64 = 1e11;

/// Steps that a run may have.
pub const MAX_STEPS: f64 = 1e12;

/// The species so far; some may be wrong while the rest is still checked.
pub(super) struct SpeciesList {
    pub list: Vec<Option<Species>>,
}

impl SpeciesList {
    pub(super) fn all_right(self) -> Option<Vec<Species>> {
        self.list.into_iter().collect()
    }
}

pub(super) const CONCENTRATIONS: [Dimension; 2] =
    [Dimension::MOLAR_CONCENTRATION, Dimension::MASS_CONCENTRATION];

pub(super) fn species<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> SpeciesList {
    let properties: Vec<_> =
        statements.species.iter().map(|species| super::qualifiers::properties(checker, species)).collect();
    let assigned = assignments(checker, statements);
    let mut initials: Vec<Initial> = vec![Initial::Untouched; statements.species.len()];
    let mut running = Vec::new();
    for idx in 0..initials.len() {
        initial_of(checker, &assigned, &mut initials, &mut running, idx);
    }
    infer_dimensions(checker, statements);
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
            is_immobile: properties[idx].is_immobile,
            is_mineral: properties[idx].is_mineral,
            charge: properties[idx].charge,
            ion_size: properties[idx].ion_size,
            retardation: properties[idx].retardation.unwrap_or(1.0),
            diffusion: properties[idx].diffusion,
            own_transport: properties[idx].own_transport,
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
        checker.scope.note_undefined_species(&name.value, name.span);
        return None;
    };
    entry.n_uses += 1;
    if let Origin::Species(idx) = entry.origin {
        return Some(idx);
    }
    let (what, defined) = (entry.origin.describe(), entry.span);
    if checker.scope.is_doubtful(&name.value) {
        return None;
    }
    checker.report(
        Diagnostic::error(D005, format!("`{}` is not a species", name.value))
            .at(name.span, format!("this is {what}"))
            .also(defined, "defined here")
            .found(what)
            .expected("a species"),
    );
    None
}

/// Works the initial concentration of a species out, after those that it needs; `running` are the
/// species on the way to it.
fn initial_of<'a>(
    checker: &mut Checker<'a>,
    assigned: &[Option<&'a tree::Assignment>],
    initials: &mut [Initial],
    running: &mut Vec<usize>,
    idx: usize,
) {
    match initials[idx] {
        Initial::Untouched => {}
        Initial::Running => {
            let first = running.iter().position(|&other| other == idx).unwrap_or(0);
            let link = |&other: &usize| assigned[other].map(|a| (a.name.value.as_str(), a.name.span));
            let links: Vec<(&str, Span)> = running[first..].iter().filter_map(link).collect();
            if let Some((name, _)) = links.first() {
                let message =
                    Diagnostic::error(D006, format!("the initial concentration of `{name}` needs itself"));
                let message = label_circle(message, &links, "needs the initial concentration of")
                    .found("a circle")
                    .expected("initial concentrations that end in numbers");
                checker.report(message);
            }
            initials[idx] = Initial::Wrong;
            checker.is_initial_wrong = true;
            return;
        }
        _ => return,
    }
    let Some(assignment) = assigned[idx] else {
        initials[idx] = Initial::Absent;
        return;
    };
    initials[idx] = Initial::Running;
    running.push(idx);
    let mut names = Vec::new();
    collect_names(&assignment.value, &mut names);
    for name in names {
        if let Some(Origin::Species(other)) = checker.scope.get(&name).map(|entry| entry.origin) {
            initial_of(checker, assigned, initials, running, other);
        }
    }
    running.pop();
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
        let found = checker.shown(value, expr.kind.dimension().unwrap_or_default(), assignment.value.span);
        checker.require(false, &what, found, "zero or more", assignment.value.span);
    }
    initials[idx] = match (checked, kind) {
        (Some(expr), Some(_)) => Initial::Known(expr),
        _ => Initial::Wrong,
    };
    checker.is_initial_wrong |= matches!(initials[idx], Initial::Wrong);
}

/// A species without an initial concentration takes the dimension of what enters at a side, is held there or
/// comes from a well or a source. Mistakes in these values are told where they are read.
fn infer_dimensions<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) {
    let n_axes = checker.axes.len();
    let at_sides = statements.boundaries.iter().flat_map(|it| &it.carried);
    let at_sides = at_sides.map(|it| (it, true, Allow::REFERENCE));
    let of_wells = wells(statements).flat_map(|it| &it.carrying).map(|it| (it, true, Allow::TIME));
    let of_sources = statements.sources.iter().flat_map(|(_, it)| &it.carried);
    let of_sources = of_sources.map(|it| (it, false, Allow::TIME));
    let mut wrong = Vec::new();
    for (assignment, is_concentration, allow) in at_sides.chain(of_wells).chain(of_sources) {
        let Some(Origin::Species(idx)) = checker.scope.get(&assignment.name.value).map(|it| it.origin) else {
            continue;
        };
        if checker.species_dimensions[idx].is_some() {
            continue;
        }
        let kind = match checker.kind_of_column(&assignment.value) {
            Some(kind) => Some(kind),
            None => checker.check(&assignment.value, allow).map(|value| value.kind),
        };
        let Some(kind) = kind else {
            wrong.push(idx);
            continue;
        };
        checker.species_dimensions[idx] = match kind {
            Type::Number(dimension) if is_concentration => {
                Some(dimension).filter(|dimension| dimension.is_concentration())
            }
            _ if is_concentration => None,
            kind => super::transport::source::concentration_for(kind, n_axes),
        };
        if kind != Type::Zero && checker.species_dimensions[idx].is_none() {
            wrong.push(idx);
        }
    }
    // A value that says neither is told once, and not at everything that would have to agree with it.
    checker.is_initial_wrong |= wrong.into_iter().any(|idx| checker.species_dimensions[idx].is_none());
}

/// The wells of a flow.
fn wells<'a>(statements: &Statements<'a>) -> impl Iterator<Item = &'a tree::Well> {
    let entries = match statements.flow.map(|(_, flow)| &flow.argument) {
        Some(tree::FlowArgument::Entries(entries)) => &entries[..],
        _ => &[],
    };
    entries.iter().filter_map(|entry| match &entry.kind {
        tree::DarcyKind::Well(well) => Some(&**well),
        _ => None,
    })
}

/// A species without a dimension of its own takes that of its reaction's other species.
fn spread_dimensions(checker: &mut Checker<'_>, statements: &Statements<'_>) {
    let members = |reaction: &tree::Reaction| -> Vec<(usize, Span)> {
        let terms = reaction.reactants.iter().chain(&reaction.products);
        let species = |term: &tree::Term| match checker.scope.get(&term.species.value)?.origin {
            Origin::Species(idx) => Some((idx, term.species.span)),
            _ => None,
        };
        terms.filter_map(species).collect()
    };
    let members: Vec<_> = statements.reactions.iter().map(|(_, reaction)| members(reaction)).collect();
    let mut is_changed = true;
    while is_changed {
        is_changed = false;
        for ((span, _), members) in statements.reactions.iter().zip(&members) {
            let known =
                members.iter().find_map(|(idx, place)| Some((checker.species_dimensions[*idx]?, *place)));
            let Some((dimension, place)) = known else { continue };
            for &(idx, own_place) in members {
                is_changed |= checker.species_dimensions[idx].is_none();
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

pub(super) fn run<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> Option<Run> {
    let (span, written) = statements.run?;
    let duration = checker.slot(&written.duration, "the duration", Dimension::TIME).and_then(|duration| {
        let found = format!("{} s", precise(duration.value));
        checker.require(duration.value > 0.0, "the duration", found, "above zero", duration.span)?;
        Some(duration)
    });
    let auto = written.step.as_ref().and_then(|step| super::transport::masses::auto(checker, step));
    let step = match &written.step {
        Some(step) if auto.is_some() => {
            auto.flatten()?;
            duration.map(|duration| Value { value: duration.value, span: step.span })
        }
        Some(step) => checker.slot(step, "the step", Dimension::TIME).and_then(|step| {
            let found = format!("{} s", precise(step.value));
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
    if n_steps > MAX_STEPS {
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
    Some(Run {
        span,
        duration: duration.value,
        step: step.value,
        step_span: step.span,
        auto: auto.flatten(),
        are_normals_double,
    })
}

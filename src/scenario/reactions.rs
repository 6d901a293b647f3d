//! Reactions: equations, and what may react with what.

use super::check::Checker;
use super::collect::Statements;
use super::expression::Node;
use super::model::species_index;
use super::rates::{self, Equation};
use super::{Rate, Reaction, Scenario};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{M001, M012, M019, M020, M021};
use crate::source::Span;
use crate::syntax::tree;

pub(super) fn reactions<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> Option<Vec<Reaction>> {
    let names: Vec<&str> = statements.species.iter().map(|species| species.name.value.as_str()).collect();
    let is_called_mineral = |species: &&'a tree::Species| {
        species.qualifiers.iter().any(|qualifier| qualifier.name.value == "mineral")
    };
    let is_mineral: Vec<bool> = statements.species.iter().map(is_called_mineral).collect();
    let all: Vec<Option<Vec<Reaction>>> = statements
        .reactions
        .iter()
        .enumerate()
        .map(|(idx, (span, written))| reaction(checker, idx, *span, written, (&names, &is_mineral)))
        .collect();
    let all: Vec<Reaction> = all.into_iter().collect::<Option<Vec<_>>>()?.into_iter().flatten().collect();
    check_competition(checker, statements, &all)?;
    check_sharing(checker, statements, &all)?;
    Some(all)
}

/// One reaction, or its two directions.
fn reaction<'a>(
    checker: &mut Checker<'a>,
    idx: usize,
    span: Span,
    written: &'a tree::Reaction,
    (names, is_mineral): (&[&str], &[bool]),
) -> Option<Vec<Reaction>> {
    let name =
        written.name.as_ref().map_or_else(|| format!("reaction_{}", idx + 1), |name| name.value.clone());
    let reactants = side(checker, &written.reactants);
    let products = side(checker, &written.products);
    rates::check_sides(checker, written, span)?;
    let is_known = reactants.is_some() && products.is_some();
    let (reactants, products) = (reactants.unwrap_or_default(), products.unwrap_or_default());
    let equation =
        Equation { name: &name, span, reactants: &reactants, products: &products, is_mineral, names };
    if !is_known {
        // The rate cannot be judged without its equation, but its names can.
        rates::look_at_names(checker, &written.rate);
        return None;
    }
    let rates = rates::rates(checker, written, equation)?;
    if matches!(rates[..], [(Rate::Instant, _)]) {
        rates::check_instant(checker, equation)?;
    }
    let is_two = rates.len() == 2;
    let of = |(direction, (rate, rate_span)): (usize, (Rate, Span))| {
        let (from, to) = if direction == 0 { (&reactants, &products) } else { (&products, &reactants) };
        let suffix = ["forward", "backward"][direction];
        let name = if is_two { format!("{name}.{suffix}") } else { name.clone() };
        Reaction { name, span, reactants: from.clone(), products: to.clone(), rate, rate_span }
    };
    Some(rates.into_iter().enumerate().map(of).collect())
}

fn side<'a>(checker: &mut Checker<'a>, terms: &'a [tree::Term]) -> Option<Vec<(usize, f64)>> {
    let mut list: Vec<(usize, f64)> = Vec::new();
    let mut is_right = true;
    for term in terms {
        let coefficient = rates::coefficient(checker, term);
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
    let instant: Vec<&Reaction> = all.iter().filter(|reaction| reaction.rate == Rate::Instant).collect();
    for (second_idx, second) in instant.iter().enumerate() {
        for first in &instant[..=second_idx] {
            let is_same = std::ptr::eq(*first, *second);
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

/// The species of a reaction and of its law, each once.
fn touched(reaction: &Reaction) -> Vec<usize> {
    let mut list: Vec<usize> =
        reaction.reactants.iter().chain(&reaction.products).map(|(species, _)| *species).collect();
    if let Rate::Law(law) | Rate::MassAction(law) = &reaction.rate {
        law.walk(&mut |expr| {
            if let Node::Species(species) = expr.node {
                list.push(species);
            }
        });
    }
    list.sort_unstable();
    list.dedup();
    list
}

/// Instant reactions are worked out of unreacted concentrations when somebody looks; a species that also
/// reacts otherwise has none.
fn check_sharing(checker: &mut Checker<'_>, statements: &Statements<'_>, all: &[Reaction]) -> Option<()> {
    let (instant, others): (Vec<&Reaction>, Vec<&Reaction>) =
        all.iter().partition(|reaction| reaction.rate == Rate::Instant);
    for reaction in instant {
        let own = touched(reaction);
        for other in &others {
            let Some(species) = touched(other).into_iter().find(|species| own.contains(species)) else {
                continue;
            };
            let name = &statements.species[species].name.value;
            checker.report(
                Diagnostic::error(M019, format!("`{name}` reacts at once and otherwise, too"))
                    .at(other.span, format!("`{name}` has a part here"))
                    .also(reaction.span, "and in this instant reaction")
                    .found("an instant reaction and another one with a common species")
                    .expected("instant reactions whose species react nowhere else")
                    .help("give the instant reaction a large rate constant instead of `instant`"),
            );
            return None;
        }
    }
    Some(())
}

/// Whether what stays in its place has one, and whether what reacts in equilibrium moves together.
pub(super) fn check_places(checker: &mut Checker<'_>, scenario: &Scenario) {
    check_charges(checker, scenario);
    // What masses do with reactions is told elsewhere; they need no bins to rest.
    if !scenario.has_transport() || scenario.particles.shares.is_some() {
        return;
    }
    let word = |species: &super::Species| if species.is_mineral { "mineral" } else { "immobile" };
    let is_immobile = |idx: usize| scenario.species[idx].is_immobile;
    for reaction in &scenario.reactions {
        let mut members = touched(reaction).into_iter();
        let (what, help) = match reaction.rate {
            Rate::Instant => ("an instant reaction", "give it a rate"),
            Rate::Equilibrium(_) => (
                "a reaction in equilibrium",
                "give it a rate, forward and backward, or take the transport away",
            ),
            _ => continue,
        };
        let Some(species) = members.find(|&idx| is_immobile(idx)).map(|idx| &scenario.species[idx]) else {
            continue;
        };
        checker.report(
            Diagnostic::error(M020, format!("{what} would carry `{}` along", species.name))
                .at(reaction.span, format!("`{}` stays in its place here", species.name))
                .also(species.span, format!("{} since this", word(species)))
                .found(format!("`{}`, {}", species.name, word(species)))
                .expected("mobile species, or a scene in which nothing moves")
                .help(help),
        );
        return;
    }
    let Some(species) = scenario.species.iter().find(|species| species.is_immobile) else { return };
    if scenario.domain.frame.iter().any(|v| *v != 0.0) {
        checker.report(
            Diagnostic::error(M020, format!("`{}` cannot rest in a moving frame", species.name))
                .at(species.span, format!("{} here", word(species)))
                .also(scenario.domain.span, "the frame moves")
                .found("`frame moving`")
                .expected("a resting frame")
                .help("leave `frame moving` out"),
        );
    } else if scenario.bins.is_none() {
        checker.report(
            Diagnostic::error(M001, format!("`{}` needs bins to live in", species.name))
                .at(species.span, format!("{} species without bins", word(species)))
                .found("no bins")
                .expected("`bins` of an `average` statement")
                .help(match &scenario.averaging {
                    Some(_) => "add `, bins 300` to the `average` of the scene",
                    None => "add for example `average bins 300`",
                }),
        );
    }
}

/// A reaction of species with declared charges makes no charge.
fn check_charges(checker: &mut Checker<'_>, scenario: &Scenario) {
    let mut last = None;
    for reaction in &scenario.reactions {
        // Both directions of a reaction have one balance.
        if last.replace(reaction.span) == Some(reaction.span) {
            continue;
        }
        let sum = |side: &[(usize, f64)]| -> Option<f64> {
            side.iter().map(|(species, nu)| Some(nu * charge(&scenario.species[*species])?)).sum()
        };
        let (Some(before), Some(after)) = (sum(&reaction.reactants), sum(&reaction.products)) else {
            continue;
        };
        let is_sink = reaction.reactants.is_empty() || reaction.products.is_empty();
        let is_in_equilibrium = matches!(reaction.rate, Rate::Equilibrium(_));
        if (before - after).abs() < 1e-9 || (is_sink && !is_in_equilibrium) {
            continue;
        }
        let shown = crate::diagnostic::precise;
        // Both directions are told as one.
        let name = reaction.name.split('.').next().unwrap_or_default();
        checker.report(
            Diagnostic::warning(M021, format!("the charges of `{name}` do not balance"))
                .at(reaction.span, format!("{} before, {} after", shown(before), shown(after)))
                .found(format!("a change of charge by {}", shown(after - before)))
                .expected("as much charge after as before")
                .help("look at the coefficients and at `charge` of the species"),
        );
    }
}

/// Minerals have no charge; that of others is known if it is declared.
fn charge(species: &super::Species) -> Option<f64> {
    if species.is_mineral { species.charge.or(Some(0.0)) } else { species.charge }
}

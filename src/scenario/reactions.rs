//! Reactions: equations, rates, and what may react with what.

use super::Reaction;
use super::check::Checker;
use super::collect::Statements;
use super::model::{SpeciesList, species_index};
use super::slot::collect_names;
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{M010, M011, M012};
use crate::source::Span;
use crate::syntax::tree::{self, ExprKind};

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

//! What stands after the name of a species: where it is, its charge, its size.
//!
//! Owns these words and their ranges. May use the scenario's types. It deliberately asks nobody whether
//! the property matters: reactions and `chemistry` do.

use super::check::Checker;
use crate::diagnostic::codes::{M001, M002};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::Span;
use crate::syntax::tree;
use crate::units::Dimension;

/// The properties of one species.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Properties {
    pub is_immobile: bool,
    pub is_mineral: bool,
    pub charge: Option<f64>,
    pub ion_size: Option<f64>,
    pub retardation: Option<f64>,
    pub diffusion: Option<f64>,
    pub own_transport: Option<Span>,
}

/// Largest number of elementary charges, far above that of any ion in water.
const MAX_CHARGE: f64 = 20.0;
/// Largest ion-size parameter, m; those of ions in water are 2.5 to 11 Å.
const MAX_ION_SIZE: f64 = 5e-9;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    Immobile,
    Mobile,
    Mineral,
    Charge,
    IonSize,
    Retardation,
    Diffusion,
}

const WORDS: &[(&str, Word)] = &[
    ("immobile", Word::Immobile),
    ("mobile", Word::Mobile),
    ("mineral", Word::Mineral),
    ("charge", Word::Charge),
    ("ion_size", Word::IonSize),
    ("retardation", Word::Retardation),
    ("diffusion", Word::Diffusion),
];

/// Reads what stands after the name; mistakes are reported and count as not written.
pub(super) fn properties<'a>(checker: &mut Checker<'a>, species: &'a tree::Species) -> Properties {
    let mut found = Properties::default();
    let mut seen: Vec<(Word, &tree::Name)> = Vec::new();
    for qualifier in &species.qualifiers {
        let Some(word) = checker.word(&qualifier.name, "a property of a species", WORDS) else { continue };
        if let Some((_, first)) = seen.iter().find(|(earlier, _)| excludes(*earlier, word)) {
            let (a, b) = (&first.value, &qualifier.name.value);
            let message = if a == b {
                Diagnostic::error(M002, format!("`{}` is called `{a}` twice", species.name.value))
            } else {
                Diagnostic::error(M002, format!("`{}` cannot be `{a}` and `{b}`", species.name.value))
            };
            let message = message.at(qualifier.name.span, "here").also(first.span, "first here");
            checker.report(message.found(format!("`{a}` and `{b}`")).expected("one of them"));
            continue;
        }
        seen.push((word, &qualifier.name));
        if matches!(word, Word::Retardation | Word::Diffusion) {
            found.own_transport.get_or_insert(qualifier.name.span);
        }
        match word {
            Word::Immobile => found.is_immobile = true,
            Word::Mobile => {}
            Word::Mineral => (found.is_immobile, found.is_mineral) = (true, true),
            Word::Charge => found.charge = charge(checker, qualifier),
            Word::IonSize => found.ion_size = ion_size(checker, qualifier),
            Word::Retardation => found.retardation = retardation(checker, qualifier),
            Word::Diffusion => found.diffusion = diffusion(checker, qualifier),
        }
    }
    found
}

/// The same word twice, and words that say opposite things; a mineral is immobile anyway.
fn excludes(a: Word, b: Word) -> bool {
    let is_opposite = |a, b| a == Word::Mobile && matches!(b, Word::Immobile | Word::Mineral);
    a == b || is_opposite(a, b) || is_opposite(b, a)
}

fn charge<'a>(checker: &mut Checker<'a>, qualifier: &'a tree::Qualifier) -> Option<f64> {
    let value = qualifier.value.as_ref().or_else(|| without_value(checker, &qualifier.name, "charge 2"))?;
    let charge = checker.slot(value, "a charge", Dimension::NONE)?;
    let is_fine = charge.value.fract() == 0.0 && charge.value.abs() <= MAX_CHARGE;
    let rule = format!("a whole number from -{MAX_CHARGE} to {MAX_CHARGE}");
    checker.require(is_fine, "a charge", precise(charge.value), &rule, charge.span)?;
    Some(charge.value)
}

fn ion_size<'a>(checker: &mut Checker<'a>, qualifier: &'a tree::Qualifier) -> Option<f64> {
    let example = "ion_size 6e-10 m";
    let value = qualifier.value.as_ref().or_else(|| without_value(checker, &qualifier.name, example))?;
    let size = checker.slot(value, "an ion size", Dimension::LENGTH)?;
    let is_fine = size.value > 0.0 && size.value <= MAX_ION_SIZE;
    let rule = format!("above zero, at most {} m", precise(MAX_ION_SIZE));
    checker.require(is_fine, "an ion size", format!("{} m", precise(size.value)), &rule, size.span)?;
    Some(size.value)
}

fn retardation<'a>(checker: &mut Checker<'a>, qualifier: &'a tree::Qualifier) -> Option<f64> {
    let example = "retardation 2";
    let value = qualifier.value.as_ref().or_else(|| without_value(checker, &qualifier.name, example))?;
    let factor = checker.slot(value, "a retardation factor", Dimension::NONE)?;
    let is_fine = factor.value >= 1.0;
    checker.require(is_fine, "a retardation factor", precise(factor.value), "1 or more", factor.span)?;
    Some(factor.value)
}

fn diffusion<'a>(checker: &mut Checker<'a>, qualifier: &'a tree::Qualifier) -> Option<f64> {
    let example = "diffusion 1e-9 m^2/s";
    let value = qualifier.value.as_ref().or_else(|| without_value(checker, &qualifier.name, example))?;
    let diffusion = checker.slot(value, "a diffusion coefficient", Dimension::DISPERSION)?;
    let found = format!("{} m^2/s", precise(diffusion.value));
    checker.require(
        diffusion.value >= 0.0,
        "a diffusion coefficient",
        found,
        "zero or more",
        diffusion.span,
    )?;
    Some(diffusion.value)
}

fn without_value<'a>(checker: &mut Checker<'a>, name: &tree::Name, example: &str) -> Option<&'a tree::Expr> {
    checker.report(
        Diagnostic::error(M001, format!("`{}` has no value", name.value))
            .at(name.span, "a number stands after this")
            .found("no number")
            .expected(format!("`{}` and a number", name.value))
            .help(format!("write for example `{example}`")),
    );
    None
}

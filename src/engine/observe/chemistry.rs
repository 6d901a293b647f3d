//! From components to species, and the instant reactions.
//!
//! Owns speciation of what is observed. May use the plan. It deliberately changes nothing that is
//! carried: reactions act on the unreacted concentrations when somebody looks.

use super::super::program::Program;
use crate::plan::InstantReaction;
use crate::state::particles::CHUNK;

/// Unreacted concentrations of all species of a chunk, then the reactions.
#[inline(always)]
pub fn speciate<const D: usize>(
    program: &Program<D>,
    n: usize,
    components: &[[f64; CHUNK]],
    unreacted: &mut [[f64; CHUNK]],
    species: &mut [[f64; CHUNK]],
) {
    for (target, recipe) in unreacted.iter_mut().zip(&program.plan.species) {
        target[..n].fill(recipe.constant);
        for &(component, coefficient) in &recipe.terms {
            for (target, value) in target[..n].iter_mut().zip(&components[component]) {
                *target += coefficient * value;
            }
        }
    }
    for (target, source) in species.iter_mut().zip(unreacted.iter()) {
        target[..n].copy_from_slice(&source[..n]);
    }
    for reaction in &program.plan.reactions {
        react(reaction, n, unreacted, species);
    }
}

/// An irreversible and complete reaction.
///
/// - Equation: `ξ = min_r U_r / ν_r`; `C_r = U_r − ν_r ξ`, `C_p = U_p + ν_p ξ`.
/// - Symbols: `U` unreacted, `C` reacted concentration, `ν` coefficient, `ξ` extent.
/// - Range: `U ≥ 0`; then `C ≥ 0`, up to rounding.
/// - Source: the limit of infinite rate; methods, section 7.6 for `A + B → AB`.
/// - Shape: one chunk.
#[inline(always)]
fn react(reaction: &InstantReaction, n: usize, unreacted: &[[f64; CHUNK]], species: &mut [[f64; CHUNK]]) {
    let mut extent = [f64::INFINITY; CHUNK];
    for &(reactant, coefficient) in &reaction.reactants {
        for (extent, value) in extent[..n].iter_mut().zip(&unreacted[reactant]) {
            let own = value / coefficient;
            *extent = if own < *extent { own } else { *extent };
        }
    }
    for &(reactant, coefficient) in &reaction.reactants {
        for (target, extent) in species[reactant][..n].iter_mut().zip(&extent) {
            *target -= coefficient * extent;
        }
    }
    for &(product, coefficient) in &reaction.products {
        for (target, extent) in species[product][..n].iter_mut().zip(&extent) {
            *target += coefficient * extent;
        }
    }
}

//! From components to species, and the instant reactions.
//!
//! Owns speciation of what is observed. May use the plan. It deliberately changes nothing that is
//! carried: reactions act on the unreacted concentrations when somebody looks.

use super::super::program::Program;
use crate::plan::{InstantReaction, OutputKind, Plan, Quantity};
use crate::state::particles::CHUNK;

/// Particles whose extents are held at once.
const PART: usize = 64;

/// Which concentrations somebody looks at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Needs {
    pub unreacted: Vec<bool>,
    pub reacted: Vec<bool>,
    reactions: Vec<bool>,
}

impl Needs {
    /// Of these outputs. Mixing is made of components alone.
    pub fn of(plan: &Plan, outputs: &[usize]) -> Self {
        let n_species = plan.species.len();
        let (mut unreacted, mut reacted) = (vec![false; n_species], vec![false; n_species]);
        for output in outputs.iter().map(|&idx| &plan.outputs[idx]) {
            match output.kind {
                OutputKind::Particles => reacted.fill(true),
                OutputKind::Mixing => {}
                OutputKind::Profile | OutputKind::Map | OutputKind::Total | OutputKind::Covariance => {
                    for quantity in &output.quantities {
                        match *quantity {
                            Quantity::Species(idx) => reacted[idx] = true,
                            Quantity::Pair(a, b) => [a, b].iter().for_each(|&idx| unreacted[idx] = true),
                        }
                    }
                }
            }
        }
        let touches = |reaction: &InstantReaction| {
            reaction.reactants.iter().chain(&reaction.products).any(|&(species, _)| reacted[species])
        };
        let reactions: Vec<bool> = plan.reactions.iter().map(touches).collect();
        for (reaction, _) in plan.reactions.iter().zip(&reactions).filter(|&(_, &is_needed)| is_needed) {
            reaction.reactants.iter().for_each(|&(species, _)| unreacted[species] = true);
        }
        unreacted.iter_mut().zip(&reacted).for_each(|(unreacted, reacted)| *unreacted |= reacted);
        Self { unreacted, reacted, reactions }
    }

    /// Whether any concentration is needed.
    pub fn any(&self) -> bool {
        self.unreacted.contains(&true)
    }
}

/// The needed concentrations of a chunk: unreacted, then reacted.
#[inline(always)]
pub fn speciate<const D: usize>(
    program: &Program<D>,
    needs: &Needs,
    n: usize,
    components: &[[f64; CHUNK]],
    unreacted: &mut [[f64; CHUNK]],
    species: &mut [[f64; CHUNK]],
) {
    for (idx, recipe) in program.plan.species.iter().enumerate().filter(|&(idx, _)| needs.unreacted[idx]) {
        let target = &mut unreacted[idx][..n];
        target.fill(recipe.constant);
        for &(component, coefficient) in &recipe.terms {
            for (target, value) in target.iter_mut().zip(&components[component]) {
                *target += coefficient * value;
            }
        }
        if needs.reacted[idx] {
            species[idx][..n].copy_from_slice(&unreacted[idx][..n]);
        }
    }
    for (reaction, _) in
        program.plan.reactions.iter().zip(&needs.reactions).filter(|&(_, &is_needed)| is_needed)
    {
        for start in (0..n).step_by(PART) {
            react(reaction, needs, start..(start + PART).min(n), unreacted, species);
        }
    }
}

/// An irreversible and complete reaction.
///
/// - Equation: `ξ = min_r U_r / ν_r`; `C_r = U_r − ν_r ξ`, `C_p = U_p + ν_p ξ`.
/// - Symbols: `U` unreacted, `C` reacted concentration, `ν` coefficient, `ξ` extent.
/// - Range: `U ≥ 0`; then `C ≥ 0`, up to rounding.
/// - Source: the limit of infinite rate; methods, section 7.6 for `A + B → AB`.
/// - Shape: at most 64 particles.
#[inline(always)]
fn react(
    reaction: &InstantReaction,
    needs: &Needs,
    range: std::ops::Range<usize>,
    unreacted: &[[f64; CHUNK]],
    species: &mut [[f64; CHUNK]],
) {
    let mut extents = [f64::INFINITY; PART];
    for &(reactant, coefficient) in &reaction.reactants {
        let values = &unreacted[reactant][range.clone()];
        // A division is dear and by 1 it changes nothing.
        if coefficient == 1.0 {
            for (extent, &own) in extents.iter_mut().zip(values) {
                *extent = if own < *extent { own } else { *extent };
            }
        } else {
            for (extent, value) in extents.iter_mut().zip(values) {
                let own = value / coefficient;
                *extent = if own < *extent { own } else { *extent };
            }
        }
    }
    // A total that is negative by rounding makes no product.
    extents.iter_mut().for_each(|extent| *extent = if *extent < 0.0 { 0.0 } else { *extent });
    let consumed = reaction.reactants.iter().map(|&(species, coefficient)| (species, -coefficient));
    for (idx, coefficient) in consumed.chain(reaction.products.iter().copied()) {
        if needs.reacted[idx] {
            for (target, extent) in species[idx][range.clone()].iter_mut().zip(&extents) {
                *target += coefficient * extent;
            }
        }
    }
}

//! From components to species, and the instant reactions.
//!
//! Owns speciation of what is observed. May use the plan. It deliberately changes nothing that is
//! carried: reactions act on the unreacted concentrations when somebody looks.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::super::program::{Program, Term};
use crate::plan::{InstantReaction, OutputKind, Quantity};
use crate::state::particles::CHUNK;

/// Particles whose extents are held at once.
const PART: usize = 64;

/// Which concentrations somebody looks at.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Needs {
    pub unreacted: Vec<bool>,
    pub reacted: Vec<bool>,
    reactions: Vec<bool>,
    /// The values of the simulated zones alone, and ū.
    pub simulated: bool,
    pub mixed: bool,
    /// How concentrations follow ū, for the standard errors of what sees it.
    pub slopes: bool,
}

impl Needs {
    /// Of these outputs. Mixing is made of components alone.
    pub fn of<const D: usize>(program: &Program<D>, outputs: &[usize]) -> Self {
        let plan = program.plan;
        let n_species = plan.species.len();
        let (mut unreacted, mut reacted) = (vec![false; n_species], vec![false; n_species]);
        for output in outputs.iter().map(|&idx| &plan.outputs[idx]) {
            match output.kind {
                OutputKind::Particles => reacted.fill(true),
                OutputKind::Mixing => {}
                OutputKind::Budget => {
                    for quantity in &output.quantities {
                        let (Quantity::Species(idx) | Quantity::Pair(idx, _)) = *quantity;
                        unreacted[idx] = true;
                    }
                }
                _ => {
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
        let any = |kinds: &[OutputKind]| outputs.iter().any(|&idx| kinds.contains(&plan.outputs[idx].kind));
        let has_mean = program.terms.iter().any(|term| matches!(term, Term::Mean { .. }));
        let follows = has_mean || program.mean_slot().is_some();
        let errs = follows && any(&[OutputKind::Profile, OutputKind::Map]);
        let mixed =
            (program.has_mixing() && any(&[OutputKind::Mixing])) || (has_mean && unreacted.contains(&true));
        // Outside open sides a particle is its own mean.
        let simulated =
            any(&[OutputKind::Mixing]) || (has_mean && errs) || (mixed && program.grid.has_open_side());
        Self { unreacted, reacted, reactions, simulated, mixed, slopes: errs }
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
    for (idx, recipe) in program.species.iter().enumerate().filter(|&(idx, _)| needs.unreacted[idx]) {
        let target = &mut unreacted[idx][..n];
        combine(recipe.constant, &recipe.terms, components, target);
        if needs.reacted[idx] {
            species[idx][..n].copy_from_slice(target);
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

/// `constant + Σ coefficient · component`, terms in order.
#[inline(always)]
fn combine(constant: f64, terms: &[(usize, f64)], components: &[[f64; CHUNK]], target: &mut [f64]) {
    let n = target.len();
    if terms.is_empty() {
        target.fill(constant);
    }
    for (rank, &(component, coefficient)) in terms.iter().enumerate() {
        let values = &components[component][..n];
        for idx in 0..n {
            let before = if rank == 0 { constant } else { target[idx] };
            target[idx] = before + coefficient * values[idx];
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
    let n = range.len().min(PART);
    for &(reactant, coefficient) in &reaction.reactants {
        let values = &unreacted[reactant][range.clone()][..n];
        for idx in 0..n {
            // A division is dear and by 1 it changes nothing.
            let own = if coefficient == 1.0 { values[idx] } else { values[idx] / coefficient };
            extents[idx] = if own < extents[idx] { own } else { extents[idx] };
        }
    }
    // A total that is negative by rounding makes no product.
    for extent in &mut extents {
        *extent = if *extent < 0.0 { 0.0 } else { *extent };
    }
    for (idx, coefficient) in changes(reaction) {
        if needs.reacted[idx] {
            let target = &mut species[idx][range.clone()][..n];
            for particle in 0..n {
                target[particle] += coefficient * extents[particle];
            }
        }
    }
}

/// What one unit of extent does to each species.
#[inline(always)]
fn changes(reaction: &InstantReaction) -> impl Iterator<Item = (usize, f64)> {
    let consumed = reaction.reactants.iter().map(|&(species, coefficient)| (species, -coefficient));
    consumed.chain(reaction.products.iter().copied())
}

/// How each needed concentration follows the totals of components.
///
/// - Equation: `∂C_s/∂U_k = a_sk + ν_s a_rk / ν_r`, where `r` is the reactant that limits the extent.
/// - Symbols: `a_sk` the coefficient of component `k` in species `s`, `ν_s` positive for products.
/// - Range: one-sided where two reactants limit at once; no second term where the extent is 0.
/// - Source: derivative of the extent in [`react`].
/// - Shape: `slopes[s · components + k]` over the particles of a chunk.
#[inline(always)]
pub fn slopes<const D: usize>(
    program: &Program<D>,
    needs: &Needs,
    n: usize,
    unreacted: &[[f64; CHUNK]],
    slopes: &mut [[f64; CHUNK]],
) {
    let (species, n_components) = (&program.species, program.n_components());
    for (idx, recipe) in species.iter().enumerate().filter(|&(idx, _)| needs.reacted[idx]) {
        let own = &mut slopes[idx * n_components..][..n_components];
        own.iter_mut().for_each(|slope| slope[..n].fill(0.0));
        let carried = recipe.terms.iter().filter(|&&(k, _)| k < n_components);
        carried.for_each(|&(k, coefficient)| own[k][..n].fill(coefficient));
    }
    for (reaction, _) in
        program.plan.reactions.iter().zip(&needs.reactions).filter(|&(_, &is_needed)| is_needed)
    {
        for particle in 0..n {
            let (mut extent, mut limiting) = (f64::INFINITY, (0, 1.0));
            for &(reactant, coefficient) in &reaction.reactants {
                let own = unreacted[reactant][particle] / coefficient;
                if own < extent {
                    (extent, limiting) = (own, (reactant, coefficient));
                }
            }
            if extent <= 0.0 || extent == f64::INFINITY {
                continue;
            }
            for (idx, coefficient) in changes(reaction).filter(|&(idx, _)| needs.reacted[idx]) {
                for &(k, own) in species[limiting.0].terms.iter().filter(|&&(k, _)| k < n_components) {
                    slopes[idx * n_components + k][particle] += coefficient * own / limiting.1;
                }
            }
        }
    }
}

//! Reactions of masses: which become of which, how fast, and what their particles weigh.
//!
//! Owns the recognition of reactions of first order and the weights. May use the scenario and the laws of chemistry.
//! It deliberately leaves what is of another order to kernels: single particles do not know what others carry.

use super::chemistry::Law;
use super::kernels;
use super::law::recognise;
use super::lower_chemistry::{mass_action, net};
use super::transport::{Decay, Turn};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::M025;
use crate::scenario::{Rate, Reaction, Scenario};

/// Weights that differ by less are the same: what coefficients that do not end in binary leave.
const ROUNDING: f64 = 1e-12;

/// The reactions of a scene with masses: those of particles each by itself, and whether they need kernels instead.
pub(super) fn decay(scenario: &Scenario) -> Result<(Option<Decay>, bool), Vec<Diagnostic>> {
    if scenario.particles.shares.is_none() || scenario.reactions.is_empty() {
        return Ok((None, false));
    }
    let is_bound = |reaction: &&Reaction| matches!(reaction.rate, Rate::Equilibrium(_));
    let refused: Vec<Diagnostic> =
        scenario.reactions.iter().filter(is_bound).map(|reaction| refusal(scenario, reaction)).collect();
    if !refused.is_empty() {
        return Err(refused);
    }
    let losses: Option<Vec<Loss>> =
        scenario.reactions.iter().map(|reaction| loss(scenario, reaction)).collect();
    let Some(losses) = losses.filter(|_| !kernels::are_asked_for(scenario)) else {
        return Ok((None, true));
    };
    // What makes ever more of itself is made by kernels.
    let Some(weights) = weights(scenario.species.len(), &losses) else { return Ok((None, true)) };
    let going = losses.iter().filter(|loss| loss.rate > 0.0);
    let reactions: Vec<Turn> = going.map(|loss| loss.turn(&weights)).collect();
    Ok(((!reactions.is_empty()).then_some(Decay { reactions, weights }), false))
}

/// What a reaction takes, and what it makes of one unit of that.
struct Loss<'a> {
    reaction: &'a Reaction,
    species: usize,
    /// 1/s
    rate: f64,
    yields: Vec<(usize, f64)>,
}

impl Loss<'_> {
    /// Sum of all yields.
    fn whole(&self) -> f64 {
        self.yields.iter().map(|(_, amount)| amount).sum()
    }

    /// - Equation: chance of `b`: `y_b w_a / w_b`.
    /// - Symbols: `y_b` made of one unit of `a`; `w` weights of particles in `a` and `b`.
    /// - Range: at most 1 in all, by the choice of the weights.
    /// - Source: the mean mass that becomes `b` is `y_b` of what is taken.
    /// - Shape: one reaction.
    fn turn(&self, weights: &[f64]) -> Turn {
        let chance = |amount: f64, to: usize| amount * weights[self.species] / weights[to];
        let whole: f64 = self.yields.iter().map(|&(to, amount)| chance(amount, to)).sum();
        // Nothing gets lost by rounding.
        let scale = if (whole - 1.0).abs() < ROUNDING { 1.0 / whole } else { 1.0 };
        Turn {
            name: self.reaction.name.clone(),
            population: self.species,
            rate: self.rate,
            outcomes: self.yields.iter().map(|&(to, amount)| (to, scale * chance(amount, to))).collect(),
        }
    }
}

/// What a reaction of first order takes; nothing if it is of another kind.
fn loss<'a>(scenario: &Scenario, reaction: &'a Reaction) -> Option<Loss<'a>> {
    let law = match &reaction.rate {
        Rate::Instant | Rate::Equilibrium(_) => return None,
        Rate::MassAction(constant) => mass_action(scenario, constant, &reaction.reactants).0,
        Rate::Law(rate) => recognise(rate),
    };
    let Law::MassAction { constant, orders } = law else { return None };
    let [(species, 1.0)] = orders[..] else { return None };
    let net = net(reaction);
    let of = |species: usize| net.iter().find(|(own, _)| *own == species).map_or(0.0, |(_, nu)| *nu);
    if of(species) >= 0.0 || net.iter().any(|(other, nu)| *other != species && *nu < 0.0) {
        return None;
    }
    let taken = -of(species);
    let made = net.iter().filter(|(other, _)| *other != species);
    Some(Loss {
        reaction,
        species,
        rate: constant * taken,
        yields: made.map(|&(other, nu)| (other, nu / taken)).collect(),
    })
}

fn refusal(scenario: &Scenario, reaction: &Reaction) -> Diagnostic {
    Diagnostic::error(M025, "particles that carry mass have no equilibrium")
        .at(reaction.span, "not with particles that carry mass")
        .also(scenario.particles.kind_span, "particles that carry mass")
        .found("a reaction in equilibrium")
        .expected("reactions at rates, or instant ones")
        .help(
            "use `particles fluid`, whose parcels carry totals, or give the reaction two rates: `<-> … @ forward kf, backward kb`",
        )
}

/// Weights of particles with which no reaction makes more than one of one; nothing where a cycle grows.
///
/// - Equation: `w_b = max w_a Σ_i y_i` over the reactions `a → … b …`.
/// - Symbols: `y_i` what is made of one unit of `a`.
/// - Range: networks without a cycle along which `Σ y` multiply to more than 1.
/// - Source: longest ways in a graph (R. Bellman 1958, Quart. Appl. Math. 16, 87), with products for sums.
/// - Shape: one weight per species; 1 where nothing is made or lost.
fn weights(n_species: usize, losses: &[Loss]) -> Option<Vec<f64>> {
    let mut weights: Vec<Option<f64>> = vec![None; n_species];
    for first in 0..n_species {
        if weights[first].is_some() {
            continue;
        }
        // As light as what it becomes, if that is settled.
        let settled = |loss: &Loss| {
            let products = loss.yields.iter().filter_map(|(to, _)| weights[*to]);
            products.map(|weight| weight / loss.whole()).reduce(f64::min)
        };
        let own = losses.iter().filter(|loss| loss.species == first);
        weights[first] = Some(own.filter_map(settled).reduce(f64::min).unwrap_or(1.0));
        let mut n_rounds = 0;
        while raise(&mut weights, losses) {
            n_rounds += 1;
            if n_rounds > n_species {
                return None;
            }
        }
    }
    let weights: Vec<f64> = weights.into_iter().map(|weight| weight.unwrap_or(1.0)).collect();
    // Coefficients may multiply to what no number can hold.
    let is_number = |weight: f64| weight > 0.0 && weight.is_finite();
    let is_right = |loss: &Loss| loss.yields.iter().all(|(to, _)| is_number(weights[*to]));
    losses.iter().all(is_right).then_some(weights)
}

/// One round over all reactions; whether one raised a weight.
fn raise(weights: &mut [Option<f64>], losses: &[Loss]) -> bool {
    let mut is_raised = false;
    for loss in losses {
        let Some(own) = weights[loss.species] else { continue };
        let least = own * loss.whole();
        for &(to, _) in &loss.yields {
            if weights[to].is_none_or(|weight| least > weight * (1.0 + ROUNDING)) {
                weights[to] = Some(least);
                is_raised = true;
            }
        }
    }
    is_raised
}

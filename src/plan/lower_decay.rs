//! Reactions of masses: which become of which, how fast, and what their particles weigh.
//!
//! Owns the recognition of reactions of first order and the weights. May use the scenario and the laws of chemistry.
//! It deliberately refuses what is of another order: single particles do not know what others carry.

use super::chemistry::Law;
use super::law::recognise;
use super::lower_chemistry::{mass_action, net};
use super::transport::{Decay, Turn};
use crate::diagnostic::codes::M025;
use crate::diagnostic::{Diagnostic, precise};
use crate::scenario::{Rate, Reaction, Scenario};

/// Weights that differ by less are the same: what coefficients that do not end in binary leave.
const ROUNDING: f64 = 1e-12;

/// The reactions of a scene with masses; `None` if there are none.
pub(super) fn decay(scenario: &Scenario) -> Result<Option<Decay>, Vec<Diagnostic>> {
    if scenario.particles.shares.is_none() || scenario.reactions.is_empty() {
        return Ok(None);
    }
    let mut losses = Vec::new();
    let mut problems: Vec<Diagnostic> = Vec::new();
    for reaction in &scenario.reactions {
        match loss(scenario, reaction) {
            Ok(loss) => losses.push(loss),
            Err(why) => problems.push(refusal(scenario, reaction, why)),
        }
    }
    if !problems.is_empty() {
        // Both directions of a reaction stand at one place.
        problems.dedup_by(|later, earlier| later.labels.first() == earlier.labels.first());
        return Err(problems);
    }
    let weights = weights(scenario.species.len(), &losses).map_err(|idx| {
        let why = Why {
            found: "reactions that make ever more of a species".to_owned(),
            expected: "as much at the end of a cycle of reactions as at its beginning, or less",
            help: "use `particles fluid`, or leave one of the reactions out",
        };
        vec![refusal(scenario, losses[idx].reaction, why)]
    })?;
    let going = losses.iter().filter(|loss| loss.rate > 0.0);
    let reactions: Vec<Turn> = going.map(|loss| loss.turn(&weights)).collect();
    Ok((!reactions.is_empty()).then_some(Decay { reactions, weights }))
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

/// Why a reaction is not one of single particles.
struct Why {
    found: String,
    expected: &'static str,
    help: &'static str,
}

fn loss<'a>(scenario: &Scenario, reaction: &'a Reaction) -> Result<Loss<'a>, Why> {
    const EXPECTED: &str = "a constant times the concentration of what the reaction takes";
    const HELP: &str = "use `particles fluid`, or leave the reaction out";
    let why = |found: String| Why { found, expected: EXPECTED, help: HELP };
    let law = match &reaction.rate {
        Rate::Instant => return Err(why("an instant reaction".into())),
        Rate::Equilibrium(_) => return Err(why("a reaction in equilibrium".into())),
        Rate::MassAction(constant) => mass_action(scenario, constant, &reaction.reactants).0,
        Rate::Law(rate) => recognise(rate),
    };
    let (species, constant) = match &law {
        Law::MassAction { constant, orders } => match orders[..] {
            [(species, 1.0)] => (species, *constant),
            [] => return Err(why("a rate that does not hang on any concentration".into())),
            _ => {
                let order: f64 = orders.iter().map(|(_, order)| order).sum();
                return Err(why(format!("a rate of order {}", precise(order))));
            }
        },
        Law::Saturation { .. } => return Err(why("a rate with a largest value".into())),
        Law::Expression => return Err(why("a rate that is no constant times one concentration".into())),
    };
    let net = net(reaction);
    let name = &scenario.species[species].name;
    let of = |species: usize| net.iter().find(|(own, _)| *own == species).map_or(0.0, |(_, nu)| *nu);
    if let Some(&(other, _)) = net.iter().find(|(other, nu)| *other != species && *nu < 0.0) {
        let other = &scenario.species[other].name;
        return Err(why(format!("`{other}` taken at a rate of `{name}`")));
    }
    if of(species) >= 0.0 {
        return Err(why(format!("a rate of `{name}`, which the reaction does not take")));
    }
    let taken = -of(species);
    let made = net.iter().filter(|(other, _)| *other != species);
    Ok(Loss {
        reaction,
        species,
        rate: constant * taken,
        yields: made.map(|&(other, nu)| (other, nu / taken)).collect(),
    })
}

fn refusal(scenario: &Scenario, reaction: &Reaction, why: Why) -> Diagnostic {
    Diagnostic::error(M025, "mass particles react at rates of first order only")
        .at(reaction.span, "not with particles that carry mass")
        .also(scenario.particles.kind_span, "particles that carry mass")
        .found(why.found)
        .expected(why.expected)
        .help(why.help)
}

/// Weights of particles with which no reaction makes more than one of one; else a reaction of a cycle that grows.
///
/// - Equation: `w_b = max w_a Σ_i y_i` over the reactions `a → … b …`.
/// - Symbols: `y_i` what is made of one unit of `a`.
/// - Range: networks without a cycle along which `Σ y` multiply to more than 1.
/// - Source: longest ways in a graph (R. Bellman 1958, Quart. Appl. Math. 16, 87), with products for sums.
/// - Shape: one weight per species; 1 where nothing is made or lost.
fn weights(n_species: usize, losses: &[Loss]) -> Result<Vec<f64>, usize> {
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
        while let Some(raised) = raise(&mut weights, losses) {
            n_rounds += 1;
            if n_rounds > n_species {
                return Err(raised);
            }
        }
    }
    let weights: Vec<f64> = weights.into_iter().map(|weight| weight.unwrap_or(1.0)).collect();
    // Coefficients may multiply to what no number can hold.
    let is_number = |weight: f64| weight > 0.0 && weight.is_finite();
    match losses.iter().position(|loss| loss.yields.iter().any(|(to, _)| !is_number(weights[*to]))) {
        Some(idx) => Err(idx),
        None => Ok(weights),
    }
}

/// One round over all reactions; the last one that raised a weight.
fn raise(weights: &mut [Option<f64>], losses: &[Loss]) -> Option<usize> {
    let mut last = None;
    for (idx, loss) in losses.iter().enumerate() {
        let Some(own) = weights[loss.species] else { continue };
        let least = own * loss.whole();
        for &(to, _) in &loss.yields {
            if weights[to].is_none_or(|weight| least > weight * (1.0 + ROUNDING)) {
                weights[to] = Some(least);
                last = Some(idx);
            }
        }
    }
    last
}

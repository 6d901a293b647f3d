//! How often particles turn into others.
//!
//! Owns this estimate. May use the plan's transport. It deliberately decides nothing: costs and limits are told by
//! it.

use super::Plan;
use super::transport::Decay;
use nalgebra::{DMatrix, DVector};

/// Reactions of one particle in one step, on the mean over a run.
///
/// - Equation: `n = Δt Σ_j k_j p_j`, `p = (I − T M)⁻¹ p₀`.
/// - Symbols: `M` rates between populations, `p₀` their shares of the particles, `T` duration, `k_j` rate of leaving.
/// - Range: an estimate; `p` is the mean over runs that end at random after `T` on the mean.
/// - Source: Laplace transform of `dp/dt = M p`.
/// - Shape: one number.
pub(super) fn per_step(plan: &Plan, decay: &Decay) -> f64 {
    let populations = plan.transport.iter().flat_map(|transport| &transport.populations);
    let counts: Vec<f64> = populations.map(|population| population.count as f64).collect();
    let n = counts.len();
    let whole: f64 = counts.iter().sum();
    let shares = DVector::from_iterator(n, counts.iter().map(|count| count / whole));
    let mut matrix = DMatrix::identity(n, n);
    let mut rates = vec![0.0; n];
    for turn in &decay.reactions {
        let often = turn.rate * plan.time.duration;
        matrix[(turn.population, turn.population)] += often;
        rates[turn.population] += turn.rate;
        turn.outcomes.iter().for_each(|&(to, chance)| matrix[(to, turn.population)] -= often * chance);
    }
    let step = plan.time.step.min(plan.time.duration);
    let mean = matrix.lu().solve(&shares);
    // What numbers cannot tell takes all of them to react all the time.
    let mean = mean.filter(|mean| mean.iter().all(|share| (-1e-9..=1.0 + 1e-9).contains(share)));
    match mean {
        Some(mean) => rates.iter().zip(mean.iter()).map(|(rate, share)| rate * step * share).sum(),
        None => rates.iter().fold(0.0, |largest: f64, rate| largest.max(rate * step)),
    }
}

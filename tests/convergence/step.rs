//! The order in the time step. The walk is exact in law for constant coefficients; what is left is the
//! splitting of motion and exchange.

use crate::fit::{Estimate, order};
use crate::support::*;
use lamella::engine::snapshot::{MixingState, Values};
use lamella::plan::*;

const ETA: f64 = 0.5;
const N_PARTICLES: u64 = 200_000;
const BINS: usize = 100;
const N_SEEDS: u64 = 48;

/// Mixing state of A and B, and the integral of the product in cm, at the end of a run of the front.
fn end(duration: f64, n_steps: u64, seed: u64) -> (MixingState, f64) {
    let mut plan = Plan { seed, ..front(N_PARTICLES, BINS, duration, duration / n_steps as f64) };
    plan.mixing = dual_rate(ETA, CHI);
    plan.outputs = vec![
        output(OutputKind::Mixing, vec![Quantity::Pair(0, 1)], vec![BINS], vec![duration]),
        output(OutputKind::Total, vec![Quantity::Species(2)], vec![], vec![duration]),
    ];
    match &run(&plan).1[..] {
        [first, second] => match (&first.values, &second.values) {
            (Values::Mixing(states), Values::Total { amount }) => (states[0], amount[0] * 100.0),
            other => panic!("{other:?}"),
        },
        other => panic!("{} snapshots", other.len()),
    }
}

/// `∫₀¹ exp(−χt(1 − s²)) ds = F(√(χt))/√(χt)` by Simpson's rule, 1e-12.
fn dawson_ratio(chi_t: f64) -> f64 {
    let n = 4000;
    let value = |k: usize| (-chi_t * (1.0 - (k as f64 / n as f64).powi(2))).exp();
    let inner: f64 = (1..n).map(|k| if k % 2 == 1 { 4.0 * value(k) } else { 2.0 * value(k) }).sum();
    (value(0) + inner + value(n)) / n as f64 / 3.0
}

/// What the splitting makes of γ: dispersion turns gradients of the mean into covariance for a whole
/// step, M_mean growing with √t as it must; then the whole step relaxes all of it.
fn gamma_of_splitting(chi_t: f64, n_steps: u64) -> f64 {
    let n = n_steps as f64;
    let grown = |k: u64| (k as f64 / n).sqrt() - ((k - 1) as f64 / n).sqrt();
    let left = |k: u64| (-chi_t * (n_steps - k + 1) as f64 / n).exp();
    -ETA * ETA * (1..=n_steps).map(|k| grown(k) * left(k)).sum::<f64>()
}

fn gamma(duration: f64, n_steps: u64) -> Estimate {
    Estimate::of(&(0..N_SEEDS).map(|seed| end(duration, n_steps, seed).0.gamma).collect::<Vec<_>>())
}

/// γ_AB = −η² F(√(χt))/√(χt) at χt = 2 (methods, section 7.5), with 40 to 5 steps: χΔt from 0.05 to 0.4.
/// The step's error is 2 to 17 %, that of the mean of all runs 0.04 %; the noise of bin means adds
/// bins/N = 0.05 %, bins of 0.15 cm as much again.
#[test]
fn gamma_converges_with_the_first_order_of_the_step() {
    let exact = -ETA * ETA * dawson_ratio(2.0);
    let errors = [40, 20, 10, 5].map(|n_steps| {
        let gamma = gamma(2.0 / CHI, n_steps);
        let predicted = gamma_of_splitting(2.0, n_steps);
        let allowed = 3.0 * gamma.standard_error + 1e-3 * predicted.abs();
        assert!((gamma.mean - predicted).abs() < allowed, "{n_steps} steps: {gamma:?}, not {predicted}");
        (2.0 / n_steps as f64, gamma.minus(exact))
    });
    let order = order(&errors);
    println!("order of γ in the step: {:.3} ± {:.3}; errors {errors:?}", order.mean, order.standard_error);
    assert!(order.standard_error < 0.05);
    assert!(order.mean + 2.0 * order.standard_error >= 1.0, "{order:?}");
}

/// ∫c̄_AB at 1510 s against the exact limit of the front (methods, section 7.6), with 40 to 5 steps. The
/// product scatters with the number of particles that crossed the front, and so does M_mean = √(2Dt/π),
/// which no step changes: what the product would be at its exact value scatters by a fifth.
#[test]
fn product_converges_with_the_first_order_of_the_step() {
    let (duration, exact) = (1510.0, 1.414961);
    let mean_exact = (2.0 * D * duration / std::f64::consts::PI).sqrt();
    let errors = [40, 20, 10, 5].map(|n_steps| {
        let ends: Vec<_> = (0..N_SEEDS).map(|seed| end(duration, n_steps, seed)).collect();
        (duration / n_steps as f64, controlled(&ends, mean_exact).minus(exact))
    });
    let order = order(&errors);
    println!("order of ∫c̄_AB in the step: {:.3} ± {:.3}; {errors:?}", order.mean, order.standard_error);
    assert!(order.standard_error < 0.2);
    assert!(order.mean + 2.0 * order.standard_error >= 1.0, "{order:?}");
}

/// The product at the exact M_mean, from the line through product and M_mean of all runs.
fn controlled(ends: &[(MixingState, f64)], mean_exact: f64) -> Estimate {
    let control = Estimate::of(&ends.iter().map(|(state, _)| state.m_mean).collect::<Vec<_>>()).mean;
    let product = Estimate::of(&ends.iter().map(|(_, product)| *product).collect::<Vec<_>>()).mean;
    let (above, below) = ends.iter().fold((0.0, 0.0), |(above, below), (state, value)| {
        let deviation = state.m_mean - control;
        (above + deviation * (value - product), below + deviation * deviation)
    });
    let adjusted = ends.iter().map(|(state, value)| value - above / below * (state.m_mean - mean_exact));
    Estimate::of(&adjusted.collect::<Vec<_>>())
}

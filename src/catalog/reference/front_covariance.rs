//! Covariance of the concentrations within a front that mixes at a finite rate.

use super::arguments::{C0, CHI, DISPERSION, ETA, VELOCITY, X0, checked};
use super::front::Front;
use super::front_gamma::{MULTIRATE_DOC, ZONE_ARGUMENTS, Zones};
use super::solutions::of_x_and_time;
use super::{Argument, Built, Item, Predicts};
use crate::maths::quadrature::integrate;
use crate::maths::scalar::exp;

pub(super) const ITEM: Item = Item {
    name: "front_covariance",
    predicts: Predicts::Covariance,
    arguments: ARGUMENTS,
    equation: "Σ_AB = −(η² c0² / 2π) ∫₀ᵗ [τ (2t − τ)]^(−1/2) exp(−(x − x0 − v t)² / (2D (2t − τ)) − χ (t − τ)) dτ",
    summary: "covariance of A and B at a step front, one slow mixing zone (negative: where A is high, B is low)",
    source: "Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1, covariance of the dual-rate step front",
    build,
};

pub(super) const MULTIRATE: Item = Item {
    name: "multirate_front_covariance",
    predicts: Predicts::Covariance,
    arguments: MULTIRATE_ARGUMENTS,
    equation: "Σ_AB = Σ_ij η_i η_j Σ*(½ (χ_i + χ_j)), Σ* as in `front_covariance` for η = 1",
    summary: "covariance of A and B at a step front, up to three slow mixing zones",
    source: "Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1, multi-rate covariance of the step front",
    build: build_multirate,
};

const ARGUMENTS: &[Argument; 6] = &[C0, DISPERSION, ETA, CHI, X0, VELOCITY];

const MULTIRATE_ARGUMENTS: &[Argument; 10] = &[
    C0,
    DISPERSION,
    ZONE_ARGUMENTS[0],
    ZONE_ARGUMENTS[1],
    ZONE_ARGUMENTS[2],
    ZONE_ARGUMENTS[3],
    ZONE_ARGUMENTS[4],
    ZONE_ARGUMENTS[5],
    X0,
    VELOCITY,
];

fn build(values: &[f64]) -> Built {
    let [c0, dispersion, eta, chi, x0, velocity] = checked(ARGUMENTS, values)?;
    let front = Front { dispersion, velocity, x0 };
    let scale = -eta * eta * c0 * c0;
    Ok(of_x_and_time(move |x, t| scale * spread(front, x, t, chi)))
}

fn build_multirate(values: &[f64]) -> Built {
    let [c0, dispersion, eta1, chi1, eta2, chi2, eta3, chi3, x0, velocity] =
        checked(MULTIRATE_ARGUMENTS, values)?;
    let front = Front { dispersion, velocity, x0 };
    let zones = Zones::new([(eta1, chi1), (eta2, chi2), (eta3, chi3)], MULTIRATE_DOC)?;
    let scale = -c0 * c0;
    Ok(of_x_and_time(move |x, t| scale * zones.sum_over_pairs(|chi| spread(front, x, t, chi))))
}

/// `variance(ξ, χt)` at a place and a time; nothing fluctuates before the front spreads.
fn spread(front: Front, x: f64, t: f64, chi: f64) -> f64 {
    if front.dispersion * t > 0.0 { variance(front.similarity(x, t), chi * t) } else { 0.0 }
}

/// Variance of the concentration of a slow zone at a unit step front.
///
/// Equation: `Σ = (1/π) ∫₀^{π/4} exp(−ξ²/cos²θ − χt cos 2θ) dθ`, which is
/// `(1/2π) ∫₀ᵗ [τ(2t−τ)]^{-1/2} exp(−x²/(2D(2t−τ)) − χ(t−τ)) dτ` with τ = 2t sin²θ; computed in w = cos 2θ.
/// Symbols: ξ = x/(2√(Dt)) distance from the front, χt age in exchange times, θ, w, τ integration variables.
/// Dimensions and range: none; 0 to 1/4.
/// Source: Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1.
/// Shape: highest at the front; `u (1 − u)` at rate 0; falls like exp(−2ξ²)/(2π χt) at late times.
pub(super) fn variance(xi: f64, age: f64) -> f64 {
    // Beyond exp(−60) of the largest integrand nothing counts.
    let cut = if age > 60.0 { 60.0 / age } else { 1.0 };
    let xi_squared = xi * xi;
    // w = 1 − s² removes the root at w = 1.
    let integrand = |s: f64| {
        let w = 1.0 - s * s;
        exp(-2.0 * xi_squared / (1.0 + w) - age * w) / (1.0 + w).sqrt()
    };
    let first = (1.0 - cut).sqrt();
    let split = (1.0 - 0.1 * cut).sqrt();
    integrate(integrand, &[first, split, 1.0], 1e-15, 1e-12).value / std::f64::consts::PI
}

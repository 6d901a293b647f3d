//! Variance of the concentration within a pulse that mixes at a finite rate.

use super::arguments::{C0, CHI, DISPERSION, ETA, VELOCITY, X0, checked, extent, renamed};
use super::solutions::of_x_and_time;
use super::{Argument, Built, Item, Predicts};
use crate::maths::quadrature::integrate;
use crate::maths::scalar::exp;

pub(super) const ITEM: Item = Item {
    name: "pulse_covariance",
    predicts: Predicts::Covariance,
    arguments: ARGUMENTS,
    equation: "Σ_AA = η² ∫₀ᵗ e^(−χ(t−s)) [2D (∂c̄/∂x)²(·, s) ∗ N(0, 2D (t − s))](x) ds",
    summary: "covariance of A with itself in a normal pulse along x, one slow mixing zone",
    source: "Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1, covariance equation, integrated over its sources",
    build,
};

const ARGUMENTS: &[Argument; 7] = &[
    renamed(C0, "c0", None, "peak concentration at time 0"),
    extent("width", None, "standard deviation of the pulse at time 0"),
    DISPERSION,
    ETA,
    CHI,
    X0,
    VELOCITY,
];

/// Variance of A in a normal pulse.
///
/// Equation: `Σ_AA = η² ∫₀ᵗ e^{−χ(t−s)} [2D (∂c̄/∂x)²(·, s) * N(0, 2D(t−s))](x) ds`; with a = σ_s²/2,
/// b = 2D(t−s) the bracket is `2D c0² w² σ_s⁻⁶ √(2πa) N(x; 0, a+b) [(ax/(a+b))² + ab/(a+b)]`.
/// Symbols: c̄ mean pulse of peak c0 and initial deviation w, σ_s² = w² + 2Ds, η fraction and χ rate of
/// the slow zone, N the normal density with that variance, s time of the source.
/// Dimensions and range: concentration squared; not negative.
/// Source: Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1 (source 2D(∂c̄/∂x)², decay χ).
/// Shape: at first two humps at the flanks of the pulse, later one.
fn build(values: &[f64]) -> Built {
    let [c0, width, dispersion, eta, chi, x0, velocity] = checked(ARGUMENTS, values)?;
    if width == 0.0 {
        return Err(
            "`width` must be positive, because a pulse without width has no gradient to integrate.".into()
        );
    }
    let scale = eta * eta * c0 * c0;
    Ok(of_x_and_time(move |x, t| {
        let t = t.max(0.0);
        scale * variance((x - x0 - velocity * t) / width, 2.0 * dispersion * t / width / width, chi * t)
    }))
}

/// The integral in units of the initial width; `spread` is 2Dt/w², `age` is χt.
fn variance(x: f64, spread: f64, age: f64) -> f64 {
    // Sources older than exp(−60) do not count; r is the elapsed part (t − s)/t.
    let cut = if age > 60.0 { 60.0 / age } else { 1.0 };
    let integrand = |r: f64| {
        let sigma_squared = 1.0 + spread * (1.0 - r);
        let (a, b) = (0.5 * sigma_squared, spread * r);
        let shrunk = a / (a + b);
        let second_moment = shrunk * shrunk * x * x + shrunk * b;
        let bell = shrunk.sqrt() * exp(-0.5 * x * x / (a + b) - age * r);
        spread / (sigma_squared * sigma_squared * sigma_squared) * bell * second_moment
    };
    // The sources of a wide-spread pulse gather at early times (r near 1), on the scale 1/spread.
    let late = 1.0 - 1.0 / (1.0 + spread);
    let breaks = if late < cut { [0.0, late, cut] } else { [0.0, 0.5 * cut, cut] };
    integrate(integrand, &breaks, 1e-15, 1e-11).value
}

//! How incomplete mixing raises the mixing state of a pulse with itself.

use super::arguments::{CHI, DISPERSION, ETA, checked, extent};
use super::solutions::of_time;
use super::{Argument, Built, Item, Predicts};
use crate::maths::scalar::{exp, expm1};
use crate::maths::special::dawson;

pub(super) const ITEM: Item = Item {
    name: "pulse_gamma",
    predicts: Predicts::Gamma,
    arguments: ARGUMENTS,
    equation: "γ_AA = η² [f(√(χt₀)) √(1 + t/t₀) e^(−χt) − f(√(χ(t + t₀)))], f(u) = 1 − 2u F(u), t₀ = width²/(2D)",
    summary: "gamma of A with itself for a normal pulse along x, one slow mixing zone",
    source: "Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1, gamma of the dual-rate Gaussian pulse",
    build,
};

const ARGUMENTS: &[Argument; 4] =
    &[ETA, CHI, DISPERSION, extent("width", None, "standard deviation of the pulse at time 0")];

/// γ of a normal pulse.
///
/// Equation: `γ_AA = η² [f(√(χt₀)) √(1 + t/t₀) e^{−χt} − f(√(χ(t + t₀)))]`, `f(u) = 1 − 2u F(u)`.
/// Symbols: η fraction and χ rate of the slow zone, t₀ = width²/(2D), t time, F Dawson's integral.
/// Dimensions and range: none; 0 or more.
/// Source: Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1.
/// Shape: rises from 0 to a peak near χt = 1, then falls like t⁻¹.
fn build(values: &[f64]) -> Built {
    let [eta, chi, dispersion, width] = checked(ARGUMENTS, values)?;
    if width == 0.0 || dispersion == 0.0 {
        return Err(
            "`width` and `D` must be positive, because the pulse ages on the scale width²/(2 D).".into()
        );
    }
    let t0 = width * width / (2.0 * dispersion);
    Ok(of_time(move |t| eta * eta * gamma(chi * t.max(0.0), chi * t0, t.max(0.0) / t0)))
}

/// γ for η = 1, with age χt, initial age χt₀ and t/t₀.
fn gamma(age: f64, initial_age: f64, ratio: f64) -> f64 {
    if age == 0.0 {
        // Without exchange nothing mixes: M_AA stays, while M of the mean falls like √(t₀/(t + t₀)).
        return growth(ratio);
    }
    let early = remainder(initial_age.sqrt());
    let late = remainder((age + initial_age).sqrt());
    let difference = early * (growth(ratio) * exp(-age) + expm1(-age)) + (early - late);
    difference.max(0.0)
}

/// √(1 + ratio) − 1 without cancellation.
fn growth(ratio: f64) -> f64 {
    ratio / (1.0 + (1.0 + ratio).sqrt())
}

/// f(u) = 1 − 2u F(u)
fn remainder(u: f64) -> f64 {
    if u < 8.0 { 1.0 - 2.0 * u * dawson(u) } else { remainder_asymptotic(u) }
}

/// −Σ_{k≥1} (2k−1)!!/(2u²)^k, where the difference would lose digits.
fn remainder_asymptotic(u: f64) -> f64 {
    let mut term = -1.0;
    let mut sum = 0.0;
    for k in 1..20 {
        term *= f64::from(2 * k - 1) / (2.0 * u) / u;
        sum += term;
    }
    sum
}

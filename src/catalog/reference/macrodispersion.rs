//! How far a mildly heterogeneous aquifer draws a plume out, to first order in the variance of ln K.
//!
//! Owns the two second moments in two dimensions. May use the exponential integral. It deliberately knows no plume: a
//! point and a line spread alike in the mean over fields.

use super::arguments::{DISPERSION, checked, length, renamed, velocity};
use super::solutions::of_time;
use super::{Argument, ArgumentDimension, Built, Item, Predicts};
use crate::maths::scalar::{exp, ln};
use crate::maths::special::exponential_integral;
use crate::units::Dimension;

const SOURCE: &str = "Dagan 1984, J. Fluid Mech. 145, doi:10.1017/S0022112084002020";

pub(super) const ALONG: Item = Item {
    name: "macrodispersion_along",
    predicts: Predicts::Moment,
    arguments: ARGUMENTS,
    equation: "X = σ²λ² [2τ − 3 ln τ + 3/2 − 3C − 3 E₁(τ) + 3 ((1 + τ) e^(−τ) − 1)/τ²] + 2 D t + w², τ = U t/λ",
    summary: "variance along the mean flow in two dimensions, exponential covariance of ln K, first order",
    source: SOURCE,
    build: build_along,
};

pub(super) const ACROSS: Item = Item {
    name: "macrodispersion_across",
    predicts: Predicts::Moment,
    arguments: ARGUMENTS,
    equation: "Y = σ²λ² [ln τ − 3/2 + C + E₁(τ) + 3 (1 − (1 + τ) e^(−τ))/τ²] + 2 D t + w², τ = U t/λ",
    summary: "variance across the mean flow in two dimensions, exponential covariance of ln K, first order",
    source: SOURCE,
    build: build_across,
};

/// Euler's constant.
const C: f64 = 0.577_215_664_901_532_9;
/// Below it the terms of the closed forms cancel, and their power series are summed.
const SMALL: f64 = 2.0;

const ARGUMENTS: &[Argument; 5] = &[
    Argument {
        name: "variance",
        dimension: ArgumentDimension::Fixed(Dimension::NONE),
        default: None,
        range: (0.0, f64::MAX),
        doc: "variance of ln K",
    },
    length("length", None, (f64::MIN_POSITIVE, f64::MAX), "correlation length of ln K"),
    velocity("velocity", None, (0.0, f64::MAX), "mean pore velocity"),
    renamed(DISPERSION, "dispersion", Some(0.0), "local dispersion in this direction"),
    length("width", Some(0.0), (0.0, f64::MAX), "standard deviation of the plume at time 0"),
];

/// Variance along the flow.
///
/// Equation: `X = σ²λ² [2τ − 3 ln τ + 3/2 − 3C − 3 E₁(τ) + 3((1 + τ)e^{−τ} − 1)/τ²] + 2 D t + w²`, `τ = U t/λ`.
/// Symbols: σ² variance and λ correlation length of ln K, U mean velocity, D local dispersion, w width at first.
/// Dimensions and range: length²; of first order in σ², within a tenth up to σ² of about 0.3.
/// Source: G. Dagan 1984, doi:10.1017/S0022112084002020; below τ = 2 its power series
/// `3 Σ_{k≥2} (−τ)^k [1/(k k!) − (k + 1)/(k + 2)!]`.
/// Shape: as t² at first, then with slope 2 σ² λ U.
fn build_along(values: &[f64]) -> Built {
    plume(values, along)
}

/// Variance across the flow.
///
/// Equation: `Y = σ²λ² [ln τ − 3/2 + C + E₁(τ) + 3(1 − (1 + τ)e^{−τ})/τ²] + 2 D t + w²`.
/// Symbols: as along the flow.
/// Dimensions and range: length²; of first order in σ².
/// Source: G. Dagan 1984; below τ = 2 its power series `Σ_{k≥2} (−τ)^k [3(k + 1)/(k + 2)! − 1/(k k!)]`.
/// Shape: as t² at first, then as ln t.
fn build_across(values: &[f64]) -> Built {
    plume(values, across)
}

fn plume(values: &[f64], shape: fn(f64) -> f64) -> Built {
    let [variance, length, velocity, dispersion, width] = checked(ARGUMENTS, values)?;
    Ok(of_time(move |t| {
        let t = t.max(0.0);
        // Beyond this many lengths the moments of a length as short have no digit left.
        let tau = (velocity * t / length).min(1e150);
        variance * length * length * shape(tau) + 2.0 * dispersion * t + width * width
    }))
}

fn along(tau: f64) -> f64 {
    if tau < SMALL {
        return 3.0 * series(tau, |own, mixed| own - mixed);
    }
    let decay = ((1.0 + tau) * exp(-tau) - 1.0) / (tau * tau);
    2.0 * tau - 3.0 * ln(tau) + 1.5 - 3.0 * C - 3.0 * exponential_integral(tau) + 3.0 * decay
}

fn across(tau: f64) -> f64 {
    if tau < SMALL {
        return series(tau, |own, mixed| 3.0 * mixed - own);
    }
    let decay = (1.0 - (1.0 + tau) * exp(-tau)) / (tau * tau);
    ln(tau) - 1.5 + C + exponential_integral(tau) + 3.0 * decay
}

/// `Σ_{k≥2} (−τ)^k f(1/(k k!), (k + 1)/(k + 2)!)`
fn series(tau: f64, term: impl Fn(f64, f64) -> f64) -> f64 {
    let (mut power, mut sum) = (-tau, 0.0);
    for k in 2..40 {
        let k = f64::from(k);
        // (−τ)^k/k!
        power *= -tau / k;
        sum += power * term(1.0 / k, 1.0 / (k + 2.0));
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reference: the closed forms in 40 digits (mpmath), rounded as in the memo of the project to five.
    #[test]
    fn moments_have_their_values() {
        for (tau, x, y) in [(1.0, 0.317_48, 0.089_323), (10.0, 12.831, 1.409_8), (100.0, 185.95, 3.682_7)] {
            assert!((along(tau) / x - 1.0).abs() < 5e-5, "{tau}: {}", along(tau));
            assert!((across(tau) / y - 1.0).abs() < 5e-5, "{tau}: {}", across(tau));
        }
    }

    /// Where both ways are right they agree; and small times begin as 3τ²/8 and τ²/8.
    #[test]
    fn the_series_meets_the_closed_form() {
        for shape in [along, across] {
            let (below, above) = (shape(SMALL * (1.0 - 1e-9)), shape(SMALL));
            assert!((below / above - 1.0).abs() < 1e-8, "{below} {above}");
        }
        assert!((along(1e-6) / 0.375e-12 - 1.0).abs() < 1e-5);
        assert!((across(1e-6) / 0.125e-12 - 1.0).abs() < 1e-5);
    }
}

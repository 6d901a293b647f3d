//! Product of a front if the concentrations within a bin were normally distributed.

use super::arguments::{C0, CHI, DISPERSION, ETA, VELOCITY, X0, checked};
use super::front::Front;
use super::front_covariance::variance;
use super::solutions::of_x_and_time;
use super::{Argument, Built, Item, Predicts};
use crate::maths::scalar::{erf, erfc, exp};

pub(super) const ITEM: Item = Item {
    name: "gaussian_closure",
    predicts: Predicts::Concentration,
    arguments: ARGUMENTS,
    equation: "c = c0/2 − √(2Σ/π) exp(−y²/2Σ) − y erf(y/√(2Σ)), y = c0/2 − ū, Σ = −Σ_AB",
    summary: "product of A + B -> AB at a step front, closed by a normal distribution: an Eulerian model, \
              3 to 14 % above the limit that particles converge to (`front_limit`)",
    source: "Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1, Gaussian closure (sign of the mean corrected)",
    build,
};

const ARGUMENTS: &[Argument; 6] = &[C0, DISPERSION, ETA, CHI, X0, VELOCITY];

/// Mean product of normally distributed concentrations.
///
/// Equation: `c_AB = c0/2 − √(2Σ/π) exp(−y²/2Σ) − y erf(y/√(2Σ))`, `y = c0/2 − ū`.
/// Symbols: ū mean of unreacted A, Σ its variance (η² times that of the slow zone), c0 of both fluids.
/// Dimensions and range: concentration; at most c0/2. The normal distribution reaches below 0, so the
/// formula can be slightly negative far from the front.
/// Source: Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1, there printed with c0/2 + ⟨|…|⟩.
/// Shape: a rounded peak at the front, lower than that of a well-mixed front.
fn build(values: &[f64]) -> Built {
    let [c0, dispersion, eta, chi, x0, velocity] = checked(ARGUMENTS, values)?;
    let front = Front { dispersion, velocity, x0 };
    Ok(of_x_and_time(move |x, t| {
        if dispersion * t <= 0.0 {
            return 0.0;
        }
        let xi = front.similarity(x, t);
        c0 * product(erfc(xi.abs()), eta * eta * variance(xi, chi * t))
    }))
}

/// `½ − E|½ − U|` for a normal U with mean `double_mean / 2` ≤ ½ and that variance.
///
/// The absolute value is split as y − (y − |y|), so that far from the front no digits are lost.
fn product(double_mean: f64, variance: f64) -> f64 {
    let y = 0.5 - 0.5 * double_mean;
    if variance <= 0.0 {
        return 0.5 * double_mean;
    }
    let z = y / (2.0 * variance).sqrt();
    let excess = (2.0 * variance / std::f64::consts::PI).sqrt() * exp(-z * z) - y * (1.0 - erf(z));
    0.5 * double_mean - excess
}

//! The exact limit of the product at a step front that mixes at two rates.
//!
//! Owns the product and its total. May use the shared parts of `reference` and `maths`. It deliberately
//! knows no particles: it is what they converge to as their number grows and bins and step vanish.
//!
//! With W the concentration of the slow zone (of c0 = 1), ū its mean and ξ = x/(2√(Dt)), everything
//! follows from the law of W at ξ, which depends on the age χt alone:
//! `age` computes it up to χt = 60, `late` from there on.

mod age;
mod late;
mod legendre;
#[cfg(test)]
mod tests;

use super::arguments::{C0, CHI, DISPERSION, ETA, VELOCITY, X0, checked};
use super::front::Front;
use super::solutions::of_time;
use super::well_mixed::{DEPTH, WIDTH};
use super::{Argument, Built, Item, Predicts, Solution};
use crate::maths::quadrature::integrate;
use crate::maths::scalar::erfc;

pub(super) const FRONT: Item = Item {
    name: "front_limit",
    predicts: Predicts::Concentration,
    arguments: FRONT_ARGUMENTS,
    equation: "c = E[min(U, c0 − U)], U = (1 − η) ū + η W, dW = −(χ/2) (W − ū(X, t)) dt along Brownian paths X",
    summary: "product of A + B -> AB, instant, at a step front with one slow mixing zone: \
              the limit of infinitely many particles, to 1e-5 of `c0`",
    source: "derived from the particle model of Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1; \
             docs/references.md",
    build: build_front,
};

pub(super) const TOTAL: Item = Item {
    name: "front_total",
    predicts: Predicts::Total,
    arguments: TOTAL_ARGUMENTS,
    equation: "M = width · depth · ∫ c dx, c as in `front_limit`",
    summary: "amount of product at a step front with one slow mixing zone: the integral of `front_limit`",
    source: "derived from the particle model of Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1; \
             docs/references.md",
    build: build_total,
};

const FRONT_ARGUMENTS: &[Argument; 6] = &[C0, DISPERSION, ETA, CHI, X0, VELOCITY];
const TOTAL_ARGUMENTS: &[Argument; 6] = &[C0, DISPERSION, ETA, CHI, WIDTH, DEPTH];

/// Beyond this ξ there is nothing: erfc(5)/2 = 8e-13.
const FARTHEST: f64 = 5.0;

/// Limit of the product at a front.
///
/// Equation: `c_AB = E[min(U, c0 − U)]`, `U = (1−η) ū + η W`, `dW = −(χ/2)(W − ū(X, t)) dt`,
/// `dX = √(2D) dB`, W = c0 left of the front and 0 right of it at time 0, `ū = ½ c0 erfc(ξ)`.
/// Symbols: U unreacted concentration of A on a particle at X, W that of its slow zone, ū mean, η fraction
/// and χ rate of the slow zone, D dispersion, B Brownian motion, ξ = (x − x0 − v t)/(2√(Dt)).
/// Dimensions and range: concentration; 0 to c0/2, error below 1e-5 c0 for any η and χ.
/// Source: derived from the particle model of Sole-Mari et al. 2020, doi:10.1002/essoar.10501517.1.
/// Shape: an even bell, lower and rounder than the well-mixed tip, which it approaches as χt grows.
fn build_front(values: &[f64]) -> Built {
    let [c0, dispersion, eta, chi, x0, velocity] = checked(FRONT_ARGUMENTS, values)?;
    let front = Front { dispersion, velocity, x0 };
    Ok(Box::new(FrontLimit { c0, front, eta, chi }))
}

/// Amount of product at a front in an unbounded domain.
///
/// Equation: `M = width · depth · ∫ c_AB dx`.
/// Symbols: c_AB the limit of the product, width and depth of the domain across x.
/// Dimensions and range: amount (per area without `width` and `depth`); at most that of the well-mixed front.
/// Source: as for the limit; integrated to 1e-7.
/// Shape: grows with √t times a factor that rises from that of χ = 0 to one.
fn build_total(values: &[f64]) -> Built {
    let [c0, dispersion, eta, chi, width, depth] = checked(TOTAL_ARGUMENTS, values)?;
    Ok(of_time(move |t| {
        let t = t.max(0.0);
        let half_width = 2.0 * (dispersion * t).sqrt();
        c0 * width * depth * half_width * integral(eta, chi * t)
    }))
}

struct FrontLimit {
    c0: f64,
    front: Front,
    eta: f64,
    chi: f64,
}

impl Solution for FrontLimit {
    fn fill(&self, t: f64, positions: [&[f64]; 3], out: &mut [f64]) {
        if self.front.dispersion * t <= 0.0 {
            out.fill(0.0);
            return;
        }
        let law = age::law(self.chi * t);
        for (value, &x) in out.iter_mut().zip(positions[0]) {
            *value = self.c0 * product(law.as_ref(), self.eta, self.front.similarity(x, t));
        }
    }
}

/// What the product needs to know of the slow zone at one age.
trait Law: Send + Sync {
    /// `E[(W − u)₊ | ξ]` for 0 ≤ ξ ≤ 5 and ½ ≤ u < 1, with `mean` = ū(ξ).
    fn excess(&self, xi: f64, mean: f64, u: f64) -> f64;
}

/// Product for c0 = 1.
///
/// Equation: `c_AB = ū − 2η E[(W − u*)₊]`, `u* = (½ − (1−η)ū)/η`, for ξ ≥ 0; even in ξ.
/// Symbols: as for the limit; u* the value of W at which U = ½.
/// Dimensions and range: none; 0 to ū.
/// Source: min(U, 1 − U) = U − 2 (U − ½)₊.
/// Shape: ū where no particle has more A than B.
fn product(law: &dyn Law, eta: f64, xi: f64) -> f64 {
    let xi = xi.abs();
    let mean = 0.5 * erfc(xi);
    let threshold = (0.5 - (1.0 - eta) * mean) / eta;
    // Also for η = 0, where the threshold is infinite.
    if xi >= FARTHEST || threshold.is_nan() || threshold >= 1.0 {
        return mean;
    }
    (mean - 2.0 * eta * law.excess(xi, mean, threshold)).clamp(0.0, mean)
}

/// `∫ c_AB dξ` for c0 = 1.
fn integral(eta: f64, age: f64) -> f64 {
    let law = age::law(age);
    // A young front has kinks; they are found by halving.
    2.0 * integrate(|xi| product(law.as_ref(), eta, xi), &[0.0, 0.5, 1.0, 2.0, FARTHEST], 1e-8, 1e-8).value
}

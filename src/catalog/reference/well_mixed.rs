//! Product of two fluids that react completely and mix without delay.

use super::arguments::{C0, DISPERSION, VELOCITY, X0, checked, extent};
use super::front::Front;
use super::solutions::{of_time, of_x_and_time};
use super::{Argument, Built, Item, Predicts};
use crate::maths::scalar::erfc;

pub(super) const FRONT: Item = Item {
    name: "well_mixed_front",
    predicts: Predicts::Concentration,
    arguments: FRONT_ARGUMENTS,
    equation: "c = ½ c0 erfc(|x − x0 − v t| / (2 √(D t)))",
    summary: "product of A + B -> AB, instant, behind and before a front that is mixed without delay",
    source: "Gramling, Harvey, Meigs 2002, Environ. Sci. Technol. 36, doi:10.1021/es0157144",
    build: build_front,
};

pub(super) const TOTAL: Item = Item {
    name: "well_mixed_total",
    predicts: Predicts::Total,
    arguments: TOTAL_ARGUMENTS,
    equation: "M = c0 · 2 √(D t / π) · width · depth",
    summary: "amount of product of A + B -> AB, instant, at a front that is mixed without delay",
    source: "Gramling, Harvey, Meigs 2002, Environ. Sci. Technol. 36, doi:10.1021/es0157144",
    build: build_total,
};

const FRONT_ARGUMENTS: &[Argument; 4] = &[C0, DISPERSION, VELOCITY, X0];

const TOTAL_ARGUMENTS: &[Argument; 4] = &[C0, DISPERSION, WIDTH, DEPTH];

/// For totals of scenes with two axes: the length of the front.
pub(super) const WIDTH: Argument =
    extent("width", Some(1.0), "extent of the domain along y; leave out on a line (amount per area)");
/// For totals of scenes with three axes.
pub(super) const DEPTH: Argument =
    extent("depth", Some(1.0), "extent of the domain along z; leave out on a line or a rectangle");

/// Product at a well-mixed front.
///
/// Equation: `c_AB = min(u, c0 − u) = ½ c0 erfc(|x − x0 − v t| / (2 √(D t)))`.
/// Symbols: u the unreacted concentration of A, c0 of both fluids, D dispersion, v velocity, t time.
/// Dimensions and range: concentration; 0 to c0/2.
/// Source: Gramling, Harvey, Meigs 2002, doi:10.1021/es0157144.
/// Shape: a tip of height c0/2 at the front, falling on both sides over about 4 √(D t).
fn build_front(values: &[f64]) -> Built {
    let [c0, dispersion, velocity, x0] = checked(FRONT_ARGUMENTS, values)?;
    let front = Front { dispersion, velocity, x0 };
    Ok(of_x_and_time(move |x, t| {
        // A front that has not spread has no product, not even in the point where it stands.
        if dispersion * t > 0.0 { 0.5 * c0 * erfc(front.similarity(x, t).abs()) } else { 0.0 }
    }))
}

/// Amount of product at a well-mixed front in an unbounded domain.
///
/// Equation: `M = c0 · 2 √(D t / π) · width · depth`.
/// Symbols: c0 concentration of both fluids, D dispersion, t time, width and depth of the domain.
/// Dimensions and range: amount (per area without `width` and `depth`); not negative.
/// Source: integral of ½ c0 erfc(|x| / (2 √(D t))).
/// Shape: grows with √t.
fn build_total(values: &[f64]) -> Built {
    let [c0, dispersion, width, depth] = checked(TOTAL_ARGUMENTS, values)?;
    Ok(of_time(move |t| c0 * width * depth * 2.0 * (dispersion * t.max(0.0) / std::f64::consts::PI).sqrt()))
}

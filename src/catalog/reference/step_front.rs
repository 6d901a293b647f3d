//! A sharp step that spreads.

use super::arguments::{C0, DISPERSION, VELOCITY, X0, checked, renamed};
use super::front::Front;
use super::solutions::of_x_and_time;
use super::{Argument, Built, Item, Predicts};
use crate::maths::scalar::erfc;

pub(super) const ITEM: Item = Item {
    name: "step_front",
    predicts: Predicts::Concentration,
    arguments: ARGUMENTS,
    equation: "c = right + ½ (c0 − right) erfc((x − x0 − v t) / (2 √(D t)))",
    summary: "a step that is `c0` left of `x0` and `right` beyond it at time 0, spreading by dispersion",
    source: "Crank 1975, The Mathematics of Diffusion, eq. 2.14",
    build,
};

const ARGUMENTS: &[Argument; 5] = &[
    renamed(C0, "c0", None, "concentration left of the step"),
    DISPERSION,
    VELOCITY,
    X0,
    renamed(C0, "right", Some(0.0), "concentration right of the step"),
];

/// Concentration of a spreading step.
///
/// Equation: `c = right + ½ (c0 − right) erfc((x − x0 − v t) / (2 √(D t)))`.
/// Symbols: c0, right the concentrations at either side, x0 the step, v velocity, D dispersion, t time.
/// Dimensions and range: concentration; between `c0` and `right`.
/// Source: Crank 1975, The Mathematics of Diffusion, eq. 2.14.
/// Shape: falls from c0 to `right` over about 4 √(D t).
fn build(values: &[f64]) -> Built {
    let [left, dispersion, velocity, x0, right] = checked(ARGUMENTS, values)?;
    let front = Front { dispersion, velocity, x0 };
    Ok(of_x_and_time(move |x, t| right + 0.5 * (left - right) * erfc(front.similarity(x, t))))
}

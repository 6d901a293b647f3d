//! Arguments that several references share, and the check of their values.
//!
//! Owns the wording of the arguments. May use `units`. It deliberately converts nothing: values are SI.

use super::{Argument, ArgumentDimension};
use crate::units::Dimension;

const ANY: (f64, f64) = (-f64::MAX, f64::MAX);
const NOT_NEGATIVE: (f64, f64) = (0.0, f64::MAX);

pub(super) const C0: Argument = Argument {
    name: "c0",
    dimension: ArgumentDimension::Concentration,
    default: None,
    range: NOT_NEGATIVE,
    doc: "concentration of the resident and of the displacing fluid",
};
pub(super) const DISPERSION: Argument = Argument {
    name: "D",
    dimension: ArgumentDimension::Fixed(Dimension::DISPERSION),
    default: None,
    range: NOT_NEGATIVE,
    doc: "hydrodynamic dispersion",
};
pub(super) const ETA: Argument = Argument {
    name: "eta",
    dimension: ArgumentDimension::Fixed(Dimension::NONE),
    default: None,
    range: (0.0, 1.0),
    doc: "fraction of the slow mixing zone; the rest mixes instantly",
};
pub(super) const CHI: Argument = Argument {
    name: "chi",
    dimension: ArgumentDimension::Fixed(Dimension::RATE),
    default: None,
    range: NOT_NEGATIVE,
    doc: "rate of the slow mixing zone (fluctuations decay with chi/2)",
};
pub(super) const X0: Argument = length("x0", Some(0.0), ANY, "position at time 0");
pub(super) const VELOCITY: Argument =
    velocity("v", Some(0.0), ANY, "velocity relative to the frame of the scene");

/// An argument with the dimension of a length.
pub(super) const fn length(
    name: &'static str,
    default: Option<f64>,
    range: (f64, f64),
    doc: &'static str,
) -> Argument {
    Argument { name, dimension: ArgumentDimension::Fixed(Dimension::LENGTH), default, range, doc }
}

/// A length that is not negative.
pub(super) const fn extent(name: &'static str, default: Option<f64>, doc: &'static str) -> Argument {
    length(name, default, NOT_NEGATIVE, doc)
}

/// A position or a distance with sign.
pub(super) const fn position(name: &'static str, doc: &'static str) -> Argument {
    length(name, Some(0.0), ANY, doc)
}

/// An argument with the dimension of a velocity.
pub(super) const fn velocity(
    name: &'static str,
    default: Option<f64>,
    range: (f64, f64),
    doc: &'static str,
) -> Argument {
    Argument { name, dimension: ArgumentDimension::Fixed(Dimension::VELOCITY), default, range, doc }
}

/// The same argument under another name, with another default and another text.
pub(super) const fn renamed(
    argument: Argument,
    name: &'static str,
    default: Option<f64>,
    doc: &'static str,
) -> Argument {
    Argument { name, default, doc, ..argument }
}

/// The values as an array, if their number and their ranges are those of `arguments`.
pub(super) fn checked<const N: usize>(arguments: &[Argument; N], values: &[f64]) -> Result<[f64; N], String> {
    let values: [f64; N] =
        values.try_into().map_err(|_| format!("{N} arguments are needed, {} are given.", values.len()))?;
    match arguments.iter().zip(values).find(|(argument, value)| !is_allowed(argument, *value)) {
        Some((argument, value)) => Err(out_of_range(argument, value)),
        None => Ok(values),
    }
}

fn is_allowed(argument: &Argument, value: f64) -> bool {
    value.is_finite() && argument.range.0 <= value && value <= argument.range.1
}

fn out_of_range(argument: &Argument, value: f64) -> String {
    let (name, (low, high)) = (argument.name, argument.range);
    if !value.is_finite() {
        format!("`{name}` is {value}, and it must be a finite number.")
    } else if high == f64::MAX && low == 0.0 {
        format!("`{name}` is {value} in SI units, and it must not be negative.")
    } else {
        format!("`{name}` is {value} in SI units, and it must lie between {low} and {high}.")
    }
}

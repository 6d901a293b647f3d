//! The numbers that outputs in rows have.
//!
//! Owns their names and what they are measured in. May use dimensions. It deliberately counts nothing: the engine does.

use super::OutputKind;
use crate::units::Dimension;

/// What a number is measured in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rule {
    /// The unit of the output, as its first number.
    Value,
    /// SI amount: mol or kg, per m² or m with fewer axes.
    Amount,
    /// The same per s.
    Rate,
    /// A power of m.
    Length(i8),
    Ratio,
    Count,
}

/// A number of a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Number {
    pub name: &'static str,
    pub rule: Rule,
    pub doc: &'static str,
}

const fn number(name: &'static str, rule: Rule, doc: &'static str) -> Number {
    Number { name, rule, doc }
}

const BREAKTHROUGH: &[Number] = &[
    number(
        "concentration",
        Rule::Value,
        "through a plane, a side or a well: net mass over water, both since the time before; in a box: mean concentration of its water; null without water or time",
    ),
    number("rate", Rule::Rate, "net mass per time since the time before; null in a box"),
    number("cumulative", Rule::Amount, "net mass since the start; null in a box"),
    number(
        "n_particles",
        Rule::Count,
        "passages since the time before, forwards and backwards; in a box the particles there",
    ),
];

const FIRST_PASSAGE: &[Number] = &[
    number("cumulative", Rule::Value, "mass of the particles that have touched the place, each once"),
    number("rate", Rule::Rate, "the same per time since the time before; null at the start"),
    number(
        "n_particles",
        Rule::Count,
        "particles that touched the place for the first time since the time before",
    ),
];

const MOMENTS: &[Number] = &[
    number("amount", Rule::Value, "amount that is there, outside of open sides included"),
    number("mean_x", Rule::Length(1), "centre of the amount; null without amount or axis"),
    number("mean_y", Rule::Length(1), "centre of the amount; null without amount or axis"),
    number("mean_z", Rule::Length(1), "centre of the amount; null without amount or axis"),
    number("xx", Rule::Length(2), "second central moment; null without amount or axis"),
    number("yy", Rule::Length(2), "second central moment; null without amount or axis"),
    number("zz", Rule::Length(2), "second central moment; null without amount or axis"),
    number("xy", Rule::Length(2), "second central moment; null without amount or axis"),
    number("xz", Rule::Length(2), "second central moment; null without amount or axis"),
    number("yz", Rule::Length(2), "second central moment; null without amount or axis"),
];

const DILUTION: &[Number] = &[
    number(
        "index",
        Rule::Value,
        "exp(-sum p ln(p/V)) over bins of volume V that hold the share p of the amount; m^d over d axes",
    ),
    number("entropy", Rule::Ratio, "-sum p ln p over the bins"),
    number("reactor_ratio", Rule::Ratio, "index over the volume of the domain"),
];

const BUDGET: &[Number] = &[
    number(
        "amount",
        Rule::Value,
        "entered less left; what is there in row `inside`; in row `defect` that less all others",
    ),
    number(
        "entered",
        Rule::Value,
        "what came in, or was made by a reaction, since the start; null in rows `inside` and `defect`",
    ),
    number(
        "left",
        Rule::Value,
        "what went out, or was taken by a reaction, since the start; null in rows `inside` and `defect`",
    ),
];

const DENSITY: &[Number] = &[
    number(
        "concentration",
        Rule::Value,
        "of the water of the cell, by kernels: density over porosity and retardation",
    ),
    number("standard_error", Rule::Value, "of the concentration, by the number of particles"),
    number("density", Rule::Value, "mass of the species, mobile and sorbed, per volume of the medium"),
    number("x", Rule::Length(1), "centre of the cell; null without the axis"),
    number("y", Rule::Length(1), "centre of the cell; null without the axis"),
    number("z", Rule::Length(1), "centre of the cell; null without the axis"),
    number(
        "bandwidth_x",
        Rule::Length(1),
        "of the kernel of the cell; null without particles, kernel or axis",
    ),
    number(
        "bandwidth_y",
        Rule::Length(1),
        "of the kernel of the cell; null without particles, kernel or axis",
    ),
    number(
        "bandwidth_z",
        Rule::Length(1),
        "of the kernel of the cell; null without particles, kernel or axis",
    ),
    number(
        "support",
        Rule::Length(1),
        "width within which the error of the kernel was least; null without one",
    ),
    number("n_particles", Rule::Count, "particles in the cell"),
];

const KERNELS: &[Number] = &[
    number(
        "bandwidth",
        Rule::Value,
        "median over particles of the geometric mean of a kernel's bandwidths; null without particles",
    ),
    number("narrow", Rule::Length(1), "that of a twentieth of all particles is narrower"),
    number("wide", Rule::Length(1), "that of a twentieth of all particles is wider"),
    number("stretch", Rule::Ratio, "median of a kernel's widest over its narrowest bandwidth"),
    number("effective", Rule::Ratio, "effective number of particles: (sum m)^2 / sum m^2"),
    number("n_particles", Rule::Count, "particles in the domain"),
    number("n_loops", Rule::Count, "loops until the bandwidths settled"),
];

impl OutputKind {
    /// The numbers of a row, the first of which measures and figures speak of; none where there are no rows.
    pub fn numbers(self) -> &'static [Number] {
        match self {
            OutputKind::Breakthrough => BREAKTHROUGH,
            OutputKind::FirstPassage => FIRST_PASSAGE,
            OutputKind::Moments => MOMENTS,
            OutputKind::Dilution => DILUTION,
            OutputKind::Budget => BUDGET,
            OutputKind::Density => DENSITY,
            OutputKind::Kernels => KERNELS,
            OutputKind::Profile
            | OutputKind::Covariance
            | OutputKind::Map
            | OutputKind::Total
            | OutputKind::Mixing
            | OutputKind::Particles => &[],
        }
    }
}

/// Dimension of a number of an output whose first one has dimension `value`, for amounts of dimension `amount`.
pub fn number_dimension(rule: Rule, value: Dimension, amount: Dimension) -> Dimension {
    match rule {
        Rule::Value => value,
        Rule::Amount => amount,
        Rule::Rate => amount.over(Dimension::TIME),
        Rule::Length(power) => Dimension::new(i16::from(power), 0, 0, 0),
        Rule::Ratio | Rule::Count => Dimension::NONE,
    }
}

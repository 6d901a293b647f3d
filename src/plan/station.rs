//! The numbers that outputs in rows have, and the words of their places.
//!
//! Owns the words of rows and the meaning of their numbers. May use the plan's types and
//! dimensions. It deliberately counts nothing: the engine does.

use super::{Output, OutputKind, Plan, Station};
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
        "through a plane or a side: net mass over water, both since the time before; in a box: mean concentration of its water; null without water or time",
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

impl OutputKind {
    /// The numbers of a row, the first of which measures and figures speak of; none where there are no rows.
    pub fn numbers(self) -> &'static [Number] {
        match self {
            OutputKind::Breakthrough => BREAKTHROUGH,
            OutputKind::FirstPassage => FIRST_PASSAGE,
            OutputKind::Moments => MOMENTS,
            OutputKind::Dilution => DILUTION,
            OutputKind::Budget => BUDGET,
            OutputKind::Profile
            | OutputKind::Covariance
            | OutputKind::Map
            | OutputKind::Total
            | OutputKind::Mixing
            | OutputKind::Particles => &[],
        }
    }

    /// Whether rows of one time are told apart by a word.
    pub fn has_places(self) -> bool {
        self.has_station() || self == OutputKind::Budget
    }
}

/// The row of a budget of fluid that says what reactions made.
pub const REACTIONS: &str = "reactions";
/// The row of a budget that says what is there.
pub const INSIDE: &str = "inside";
/// The row of a budget that says what is missing.
pub const DEFECT: &str = "defect";

impl Plan {
    /// What mass may come in or go out by: what is there at the start, sources, sides.
    pub fn doors(&self) -> Vec<String> {
        let mut doors = vec!["initial".to_owned()];
        let sources = self.transport.iter().flat_map(|transport| &transport.sources);
        doors.extend(sources.map(|source| source.name.clone()));
        doors.extend((0..2 * self.axes.len()).map(|side| self.side_name(side).to_owned()));
        let wells = self.transport.iter().flat_map(|transport| transport.outlets());
        doors.extend(wells.map(|outlet| outlet.name));
        doors
    }

    /// Whether parcels of water react on their way.
    pub fn has_fluid_reactions(&self) -> bool {
        !self.carries_mass() && self.reacts_in_steps()
    }

    /// The word of a side: twice the active axis, plus one at its upper end.
    pub fn side_name(&self, side: usize) -> &'static str {
        let index = self.axes.get(side / 2).map_or(0, |axis| axis.index);
        let has_z = self.axes.iter().any(|axis| axis.index == 2);
        let [low, high] = match index {
            0 => ["left", "right"],
            1 if has_z => ["front", "back"],
            _ => ["bottom", "top"],
        };
        if side.is_multiple_of(2) { low } else { high }
    }

    /// The words that rows of an output point at.
    pub fn places(&self, output: &Output) -> Vec<String> {
        match (output.kind, &output.station) {
            (OutputKind::Budget, _) => {
                let mut places = self.doors();
                let decay = self.transport.iter().flat_map(|transport| &transport.decay);
                places.extend(decay.flat_map(|decay| &decay.reactions).map(|turn| turn.name.clone()));
                if self.has_fluid_reactions() {
                    places.push(REACTIONS.to_owned());
                }
                places.extend([INSIDE.to_owned(), DEFECT.to_owned()]);
                places
            }
            (_, Some(Station::Plane { .. })) => vec!["plane".to_owned()],
            (_, Some(Station::Side(side))) => vec![self.side_name(*side).to_owned()],
            (_, Some(Station::Box { .. })) => vec!["box".to_owned()],
            (_, None) => Vec::new(),
        }
    }

    /// Where a station is along the axes of the scene: its plane, its side, the centre of its box.
    pub fn position(&self, station: &Station) -> [Option<f64>; 3] {
        let mut position = [None; 3];
        for (axis_idx, axis) in self.axes.iter().enumerate() {
            let at = match station {
                Station::Plane { axis, at } => (*axis == axis_idx).then_some(*at),
                Station::Side(side) if side / 2 == axis_idx => {
                    Some(if side % 2 == 0 { axis.low } else { axis.high })
                }
                Station::Side(_) => None,
                Station::Box { low, high } => Some(0.5 * (low[axis_idx] + high[axis_idx])),
            };
            if axis.index < 3 {
                position[axis.index] = at;
            }
        }
        position
    }
}

/// Whether a station fits so many axes.
pub(super) fn fits(station: &Station, n_axes: usize) -> bool {
    match station {
        Station::Plane { axis, at } => *axis < n_axes && at.is_finite(),
        Station::Side(side) => *side < 2 * n_axes,
        Station::Box { low, high } => {
            low.len() == n_axes && high.len() == n_axes && low.iter().zip(high).all(|(low, high)| low < high)
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

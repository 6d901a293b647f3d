//! The words of the places of rows, and where they are.
//!
//! Owns these words. May use the plan's types. It deliberately counts nothing: the engine does.

use super::transport::{Flow, Outlet};
use super::{Output, OutputKind, Plan, Station};

pub use crate::scenario::numbers::{Number, Rule, number_dimension};

impl OutputKind {
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

    /// Whether what particles carry changes by all reactions together.
    pub fn has_joint_reactions(&self) -> bool {
        if self.carries_mass() { self.reacting().is_some() } else { self.reacts_in_steps() }
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
                if self.has_joint_reactions() {
                    places.push(REACTIONS.to_owned());
                }
                places.extend([INSIDE.to_owned(), DEFECT.to_owned()]);
                places
            }
            (_, Some(station)) => vec![self.place(station)],
            (_, None) => Vec::new(),
        }
    }

    fn place(&self, station: &Station) -> String {
        match station {
            Station::Plane { .. } => "plane".to_owned(),
            Station::Side(side) => self.side_name(*side).to_owned(),
            Station::Box { .. } => "box".to_owned(),
            Station::Well(name) => name.clone(),
            Station::Part { of, .. } => format!("part of {}", self.place(of)),
        }
    }

    /// Where a station is along the axes of the scene: its plane, its side, the centre of its box or part, its well.
    pub fn position(&self, station: &Station) -> [Option<f64>; 3] {
        let mut position = [None; 3];
        for (axis_idx, axis) in self.axes.iter().enumerate().filter(|(_, axis)| axis.index < 3) {
            position[axis.index] = self.along(station, axis_idx);
        }
        position
    }

    fn along(&self, station: &Station, axis_idx: usize) -> Option<f64> {
        let axis = &self.axes[axis_idx];
        match station {
            Station::Plane { axis, at } => (*axis == axis_idx).then_some(*at),
            Station::Side(side) if side / 2 == axis_idx => {
                Some(if side % 2 == 0 { axis.low } else { axis.high })
            }
            Station::Side(_) => None,
            Station::Box { low, high } => Some(0.5 * (low[axis_idx] + high[axis_idx])),
            Station::Part { of, low, high } => {
                self.along(of, axis_idx).or(Some(0.5 * (low[axis_idx] + high[axis_idx])))
            }
            Station::Well(name) => {
                let Flow::Darcy(flow) = &self.transport.as_ref()?.flow else { return None };
                let well = flow.wells.iter().find(|well| well.name == *name)?;
                Some(0.5 * (well.low[axis_idx] + well.high[axis_idx]))
            }
        }
    }

    /// A well or package that takes water out, with its number among these.
    pub fn outlet(&self, name: &str) -> Option<(usize, Outlet)> {
        let outlets = self.transport.as_ref()?.outlets();
        outlets.into_iter().enumerate().find(|(_, outlet)| outlet.name == name)
    }
}

/// Whether a plan has such a station.
pub(super) fn fits(station: &Station, plan: &Plan) -> bool {
    let n_axes = plan.axes.len();
    match station {
        Station::Plane { axis, at } => *axis < n_axes && at.is_finite(),
        Station::Side(side) => *side < 2 * n_axes,
        Station::Box { low, high } => {
            low.len() == n_axes && high.len() == n_axes && low.iter().zip(high).all(|(low, high)| low < high)
        }
        Station::Well(name) => plan.outlet(name).is_some(),
        Station::Part { of, low, high } => {
            let whole = Station::Box { low: low.clone(), high: high.clone() };
            matches!(**of, Station::Plane { .. } | Station::Side(_)) && fits(of, plan) && fits(&whole, plan)
        }
    }
}

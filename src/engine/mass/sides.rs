//! What happens to particles at the sides of the domain.
//!
//! Owns the making of walls. May use the plan and `track`. It deliberately lets nothing in: `inlets` does.

use super::super::error::RunError;
use super::super::program::unsound;
use super::super::track::walls::{self, Ends, Law, Wall};
use super::world::Site;
use crate::plan::transport::SideRule;

impl<const D: usize> Site<'_, D> {
    pub fn ends(&self, axis: usize) -> Result<Ends<D>, RunError> {
        let sides = self.transport.sides.get(axis).ok_or_else(|| unsound("an axis without sides"))?;
        let is_periodic = |end: usize| sides[end].iter().any(|patch| patch.rule == SideRule::Periodic);
        if is_periodic(0) || is_periodic(1) {
            return Ok(Ends::Periodic { low: self.low[axis], high: self.high[axis] });
        }
        let wall = |end: usize| {
            if sides[end].iter().all(|patch| patch.rule == SideRule::Open) {
                return None;
            }
            let at = if end == 0 { self.low[axis] } else { self.high[axis] };
            let patch = |patch: &crate::plan::transport::Patch| walls::Patch {
                low: std::array::from_fn(|other| patch.low[other]),
                high: std::array::from_fn(|other| patch.high[other]),
                law: if self.transport.is_of_fluid { wet(&patch.rule) } else { law(&patch.rule) },
            };
            Some(Wall { at, patches: sides[end].iter().map(patch).collect() })
        };
        Ok(Ends::Walls([wall(0), wall(1)]))
    }
}

fn law(rule: &SideRule) -> Law {
    match rule {
        SideRule::Reflect | SideRule::Periodic | SideRule::Open => Law::Reflect,
        SideRule::Absorb | SideRule::Held(_) => Law::Absorb,
        SideRule::Partial(rate) => Law::Partial(*rate),
        // Where and while the water leaves, what it carries leaves with it.
        SideRule::Inflow(_) | SideRule::Outflow => Law::Outflow,
    }
}

/// What a side does to parcels of water: they leave with it where it leaves, and else stay.
fn wet(rule: &SideRule) -> Law {
    match rule {
        SideRule::Reflect | SideRule::Periodic | SideRule::Open => Law::Reflect,
        SideRule::Inflow(_) | SideRule::Outflow => Law::Outflow,
        SideRule::Absorb | SideRule::Held(_) | SideRule::Partial(_) => Law::Wet,
    }
}

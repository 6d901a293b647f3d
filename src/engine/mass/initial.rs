//! What is there at the start.
//!
//! Owns the mass of a species before anything moves. May use the plan and places. It deliberately draws nothing.

use super::super::error::RunError;
use super::parts::{Part, Shape};
use super::place::{Cells, Place};
use super::release::Sampling;
use super::world::Site;
use crate::state::stream::{Purpose, Stream};

impl<const D: usize> Site<'_, D> {
    pub fn initial(&self, population: usize) -> Result<Part<D>, RunError> {
        let of = &self.transport.populations[population];
        let cells = Cells::new(self.low, self.high, |centres| {
            let porosity = self.porosity(centres);
            let values = self.evaluate(&of.initial, centres, 0.0);
            porosity.iter().zip(values).map(|(porosity, c)| porosity * of.retardation * c).collect()
        });
        let stream = Stream::new(self.plan.seed, Purpose::Placement);
        let sampling = Sampling::new(&self.plan.particles, &stream);
        Ok(Part {
            door: 0,
            mass: cells.total(),
            place: Place::Cells(cells),
            shape: Shape::Steady { from: 0.0, to: 0.0, sampling },
        })
    }
}

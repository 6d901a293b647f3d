//! What is there at the start.
//!
//! Owns the mass of a species before anything moves, and who may share it. May use the plan and places. It deliberately
//! draws nothing.

use super::super::error::RunError;
use super::parts::{Part, Shape};
use super::place::{Cells, Place};
use super::release::Sampling;
use super::running::Running;
use super::world::Site;
use crate::flow::memo::{Memo, key};
use crate::plan::NUMERICS_VERSION;
use crate::plan::transport::Population;
use crate::state::stream::{Purpose, Stream};
use std::sync::Arc;

/// Bytes of integrated initial concentrations that are kept.
const MOST_BYTES: usize = 1 << 26;

/// Integrated initial concentrations that several runs share: a million cells each, which cost more than a short run.
/// They change no byte of a result.
#[derive(Debug, Clone)]
pub struct Starts(Arc<Memo<Arc<Running>>>);

impl Default for Starts {
    fn default() -> Self {
        Self(Arc::new(Memo::new(MOST_BYTES)))
    }
}

/// Runs with and without them are the same.
impl PartialEq for Starts {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl<const D: usize> Site<'_, D> {
    pub fn initial(&self, population: usize) -> Result<Part<D>, RunError> {
        let cells = self.shared(&self.transport.populations[population]);
        let stream = Stream::new(self.plan.seed, Purpose::Placement);
        let sampling = Sampling::new(&self.plan.particles, &stream);
        Ok(Part {
            door: 0,
            mass: cells.total(),
            place: Place::Cells(cells),
            shape: Shape::Steady { from: 0.0, to: 0.0, sampling },
        })
    }

    fn integrated(&self, of: &Population) -> Cells<D> {
        Cells::new(self.low, self.high, |centres| {
            let porosity = self.porosity(centres);
            let values = self.evaluate(&of.initial, centres, 0.0);
            porosity.iter().zip(values).map(|(porosity, c)| porosity * of.retardation * c).collect()
        })
    }

    /// Those of an earlier run, if nothing is different. Porosity of cells is not looked through.
    fn shared(&self, of: &Population) -> Cells<D> {
        let Some(Starts(known)) = self.starts_known.as_ref().filter(|_| self.pores().is_none()) else {
            return self.integrated(of);
        };
        let axes: Vec<(usize, f64, f64)> =
            self.plan.axes.iter().map(|axis| (axis.index, axis.low, axis.high)).collect();
        let own = key(&(NUMERICS_VERSION, axes, &self.transport.porosity, of.retardation, &of.initial));
        let sums = known.get(own, |sums| sums.size(), || self.integrated(of).sums());
        Cells::with(self.low, self.high, sums)
    }
}

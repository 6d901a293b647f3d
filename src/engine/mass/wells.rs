//! Wells as particles meet them.
//!
//! Owns the boxes that water is taken from, and what comes with water that is put in. May use the plan, `flow` and
//! `track`. It deliberately knows no chance: a drain has its own.

use super::super::track::drains::Drain;
use super::in_time::Course;
use super::parts::{Part, Shape};
use super::place::Place;
use super::world::Site;
use crate::flow::{FaceFlow, build};
use crate::plan::transport::{Changed, Flow, Well};

impl<const D: usize> Site<'_, D> {
    /// The cells that wells and packages take water from during a flow.
    pub fn drains(&self, period: usize) -> Vec<Drain<D>> {
        let Some(flow) = self.face_flow(period) else { return Vec::new() };
        let mut drains = Vec::new();
        for (idx, outlet) in self.transport.outlets().into_iter().enumerate() {
            for sink in flow.sinks.iter().filter(|sink| sink.owner == outlet.owner && sink.rate > 0.0) {
                let [low, high] = self.cell(flow, sink.cell);
                let volume: f64 = (0..D).map(|axis| high[axis] - low[axis]).product();
                let water = flow.porosity[sink.cell] * volume;
                drains.push(Drain { low, high, rate: sink.rate / water, side: 2 * D + idx });
            }
        }
        drains
    }

    /// What comes into a population with the water of wells.
    pub fn feeds(&self, population: usize) -> Vec<Part<D>> {
        let species = self.transport.populations[population].species;
        let (Flow::Darcy(darcy), Some(flow)) = (&self.transport.flow, self.face_flow(0)) else {
            return Vec::new();
        };
        let mut parts = Vec::new();
        for (door, outlet) in self.transport.outlets().into_iter().enumerate() {
            let Some(well) = darcy.wells.get(outlet.owner) else { continue };
            let Some(tape) = well.carrying.get(species) else { continue };
            let rate = |period: usize| self.well_rate(outlet.owner, period).max(0.0);
            let rates: Vec<f64> = (0..self.starts.len()).map(rate).collect();
            let first = 1 + self.transport.sources.len() + 2 * D;
            // Each cell has the same part of the water at all times.
            for (cell, share) in self.cells_of(flow, well, 1.0) {
                let [low, high] = self.cell(flow, cell);
                let screen = |axis: usize| {
                    let is_along = well.high[axis] > well.low[axis];
                    let (from, to) = (well.low[axis].max(low[axis]), well.high[axis].min(high[axis]));
                    if is_along { (from, to) } else { (low[axis], high[axis]) }
                };
                let low = std::array::from_fn(|axis| screen(axis).0);
                let high = std::array::from_fn(|axis| screen(axis).1);
                let course =
                    Course { tape, faces: vec![(low, high)], window: (0.0, self.plan.time.duration) };
                let (pace, _) = self.pace(&course, |period, _| share * rates[period]);
                parts.push(Part {
                    door: first + door,
                    mass: pace.total(),
                    place: Place::Box(low, high),
                    shape: Shape::Paced { pace, faces: Vec::new() },
                });
            }
        }
        parts
    }

    /// Water that a well puts in during a flow, m³/s.
    fn well_rate(&self, number: usize, period: usize) -> f64 {
        let Flow::Darcy(darcy) = &self.transport.flow else { return 0.0 };
        let later = period.checked_sub(1).and_then(|idx| self.transport.changes.get(idx));
        match later.map(|change| &change.flow) {
            Some(Changed::Darcy { rates, .. }) => rates.get(number).copied().unwrap_or(0.0),
            _ => darcy.wells.get(number).map_or(0.0, |well| well.rate),
        }
    }

    /// The cells of a well with their parts of its rate, as the solver has them.
    fn cells_of(&self, flow: &FaceFlow, well: &Well, rate: f64) -> Vec<(usize, f64)> {
        let conductivity = flow.conductivity.as_deref().unwrap_or(&[]);
        let cells = build::well_cells(self.plan, well, rate, &flow.cells, conductivity);
        cells.unwrap_or_default().into_iter().map(|well| (well.cell, well.rate)).collect()
    }

    /// Lower and upper corner of a cell of the flow.
    pub fn cell(&self, flow: &FaceFlow, cell: usize) -> [[f64; D]; 2] {
        let place = flow.cells.place(cell);
        let edge = |axis: usize, end: usize| {
            let index = self.plan.axes[axis].index;
            flow.cells.edges()[index][place[index] + end]
        };
        [0, 1].map(|end| std::array::from_fn(|axis| edge(axis, end)))
    }
}

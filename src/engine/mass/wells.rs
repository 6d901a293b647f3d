//! Wells as particles meet them.
//!
//! Owns the boxes that water is taken from. May use the plan, `flow` and `track`. It deliberately knows no chance: a
//! drain has its own.

use super::super::track::drains::Drain;
use super::world::Site;
use crate::flow::FaceFlow;

impl<const D: usize> Site<'_, D> {
    /// The cells that wells and packages take water from.
    pub fn drains(&self) -> Vec<Drain<D>> {
        let Some(flow) = &self.flow else { return Vec::new() };
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

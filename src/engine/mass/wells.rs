//! Wells as particles meet them.
//!
//! Owns the boxes that water is taken from. May use the plan, `flow` and `track`. It deliberately knows no chance: a
//! drain has its own.

use super::super::track::drains::Drain;
use super::world::Site;
use crate::flow::FaceFlow;

impl<const D: usize> Site<'_, D> {
    /// The cells that wells take water from.
    pub fn drains(&self) -> Vec<Drain<D>> {
        let Some(flow) = &self.flow else { return Vec::new() };
        let mut drains = Vec::new();
        for (idx, well) in self.transport.drains().into_iter().enumerate() {
            for &(cell, rate) in flow.sinks.iter().filter(|(_, rate)| *rate > 0.0) {
                let [low, high] = self.cell(flow, cell);
                let meets = |axis: usize| well.low[axis] < high[axis] && well.high[axis] >= low[axis];
                if (0..D).all(meets) {
                    let volume: f64 = (0..D).map(|axis| high[axis] - low[axis]).product();
                    let water = flow.porosity[cell] * volume;
                    drains.push(Drain { low, high, rate: rate / water, side: 2 * D + idx });
                }
            }
        }
        drains
    }

    /// Lower and upper corner of a cell of the flow.
    fn cell(&self, flow: &FaceFlow, cell: usize) -> [[f64; D]; 2] {
        let place = flow.cells.place(cell);
        let edge = |axis: usize, end: usize| {
            let index = self.plan.axes[axis].index;
            flow.cells.edges()[index][place[index] + end]
        };
        [0, 1].map(|end| std::array::from_fn(|axis| edge(axis, end)))
    }
}

//! Exact paths of what flow alone moves through cells.
//!
//! Owns the velocities of faces and the wells of cells. May use `flow`, rulers and drains. It deliberately spreads
//! nothing: a medium that wants these paths has none for the carrier.

mod follow;
mod leg;
mod pathed;
#[cfg(test)]
mod tests;

use super::drains::Drain;
use super::uneven::records::{place, strides};
use super::uneven::ruler::Ruler;
use crate::flow::FaceFlow;
pub use leg::Leg;
pub use pathed::Pathed;

/// Velocities that are linear between the two faces of a cell along each axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Paths<const D: usize> {
    rulers: [Ruler; D],
    strides: [usize; D],
    /// Per cell and axis through the lower and the upper face, m/s.
    velocities: Vec<[[f64; 2]; D]>,
    /// Wells in the order of cells.
    wells: Vec<WellInCell>,
}

/// Water that a well takes out of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
struct WellInCell {
    cell: usize,
    /// Of the water in the cell, 1/s.
    rate: f64,
    /// What it is called in the books.
    side: usize,
}

impl<const D: usize> Paths<D> {
    /// From the flow over the axes `axes` of the scene, and the boxes that wells take water from: each is a cell.
    pub fn new(flow: &FaceFlow, axes: [usize; D], drains: &[Drain<D>]) -> Self {
        let rulers = axes.map(|axis| Ruler::new(&flow.cells.edges()[axis]));
        let n = axes.map(|axis| flow.cells.n()[axis]);
        let face = |axis: usize, place: [usize; D], end: usize| {
            let mut n = n;
            n[axis] += 1;
            let strides = strides(n);
            let first: usize = place.iter().zip(strides).map(|(along, stride)| along * stride).sum();
            flow.flux[axes[axis]][first + end * strides[axis]]
        };
        let of_cell = |cell: usize| {
            let place = place(n, cell);
            let porosity = flow.porosity[cell];
            let pore = |q: f64| if porosity > 0.0 { q / porosity } else { 0.0 };
            std::array::from_fn(|axis| [0, 1].map(|end| pore(face(axis, place, end))))
        };
        let strides = strides(n);
        let well = |drain: &Drain<D>| {
            let along = |axis: usize| rulers[axis].cell(0.5 * (drain.low[axis] + drain.high[axis]));
            let cell = (0..D).map(|axis| along(axis) * strides[axis]).sum();
            WellInCell { cell, rate: drain.rate, side: drain.side }
        };
        let mut wells: Vec<WellInCell> = drains.iter().map(well).collect();
        wells.sort_by_key(|well| well.cell);
        let velocities = (0..flow.cells.n_cells()).map(of_cell).collect();
        Self { strides, velocities, wells, rulers }
    }

    fn wells_of(&self, cell: usize) -> &[WellInCell] {
        let first = self.wells.partition_point(|well| well.cell < cell);
        let n = self.wells[first..].partition_point(|well| well.cell == cell);
        &self.wells[first..first + n]
    }
}

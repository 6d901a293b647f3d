//! Steady flow of water on rectilinear cells.
//!
//! Owns the discharge through faces, and what makes it: solvers and readers. May use the words and the
//! plan. It deliberately moves nothing: the engine does.

pub mod balance;
pub mod build;
pub mod cache;
pub mod cells;
pub mod darcy;
pub mod files;
pub mod memo;
mod packages;
pub mod random_field;
pub mod read;
pub mod scene;
pub mod series;
pub mod statistics;
pub mod store;

pub use balance::Balance;
pub use cells::Cells;
pub use series::FlowSeries;
pub use store::Flows;

/// The discharge of water through the faces of cells.
///
/// Sign: a flux is positive along its axis, a sink is positive where water is taken out.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceFlow {
    pub cells: Cells,
    /// Specific discharge, m/s, through the faces normal to each axis; along its own axis there is one face
    /// more than there are cells. The last axis is fastest.
    pub flux: [Vec<f64>; 3],
    /// Per cell.
    pub porosity: Vec<f64>,
    /// Per cell, m; absent where the flow was not solved for.
    pub head: Option<Vec<f64>>,
    /// Per cell, m/s, along x.
    pub conductivity: Option<Vec<f64>>,
    pub sinks: Vec<Sink>,
}

/// Water that is taken out of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sink {
    pub cell: usize,
    /// m³/s, below zero where it is put in; with fewer axes per unit of what is missing.
    pub rate: f64,
    /// Which well or package it belongs to, counted by whoever made the flow.
    pub owner: usize,
}

impl FaceFlow {
    /// Water that appears in each cell without a source, m³/s: what flows out less what flows in, and what is
    /// taken out. Zero up to rounding in a sound flow.
    ///
    /// - Equation: `r = Σ_faces ± q A + Q`.
    /// - Symbols: `q` specific discharge, `A` area of a face, `Q` sink.
    /// - Range: any flow.
    /// - Source: conservation of water of constant density.
    /// - Shape: one number per cell.
    pub fn imbalance(&self) -> Vec<f64> {
        let mut rest = vec![0.0; self.cells.n_cells()];
        for axis in 0..3 {
            for (cell, rest) in rest.iter_mut().enumerate() {
                let place = self.cells.place(cell);
                let area = self.cells.face_area(axis, place);
                let (low, high) = self.cells.faces(axis, place);
                *rest += area * (self.flux[axis][high] - self.flux[axis][low]);
            }
        }
        for sink in &self.sinks {
            rest[sink.cell] += sink.rate;
        }
        rest
    }

    /// Water that enters through the outer faces, m³/s.
    pub fn through_flow(&self) -> f64 {
        let mut sum = 0.0;
        let n = self.cells.n();
        for axis in 0..3 {
            for cell in 0..self.cells.n_cells() {
                let place = self.cells.place(cell);
                let area = self.cells.face_area(axis, place);
                let (low, high) = self.cells.faces(axis, place);
                if place[axis] == 0 {
                    sum += area * self.flux[axis][low].max(0.0);
                }
                if place[axis] + 1 == n[axis] {
                    sum -= area * self.flux[axis][high].min(0.0);
                }
            }
        }
        sum + self.sinks.iter().map(|sink| (-sink.rate).max(0.0)).sum::<f64>()
    }
}

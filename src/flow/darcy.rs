//! Steady flow from conductivity, fixed heads, inflows and wells.
//!
//! Owns the problem, its checks and its solution by finite volumes. May use cells. It deliberately knows no
//! statements of a scene, and no random fields: conductivity is one number per cell.

mod aggregate;
mod cycle;
pub mod error;
mod gradient;
mod matrix;
mod system;
#[cfg(test)]
mod tests;
pub mod wells;

use super::{Cells, FaceFlow, Sink};
use cycle::Cycle;
pub use error::DarcyError;
use matrix::dot;
use system::System;
pub use wells::{Well, wells};

/// Imbalance of a cell, by the through-flow, at which corrections end.
const ENOUGH: f64 = 1e-13;

/// Imbalance of a cell, by the through-flow, above which there is no solution.
pub const MOST_IMBALANCE: f64 = 1e-9;

/// What conjugate gradients gain at most before the fluxes are balanced anew.
const SHARE: f64 = 1e-7;

/// Balancing anew, at most.
const MOST_PASSES: usize = 8;

/// Conjugate gradients in one pass, at most.
const MOST_ITERATIONS: usize = 400;

/// Where nothing fixes the head, inflow and outflow may differ by this share: rounding.
const ADDS_UP: f64 = 1e-12;

/// What holds on one side of the domain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Side {
    NoFlow,
    /// Fixed head on the side itself, half a cell from the nearest centre, m.
    Head(f64),
    /// Specific discharge into the domain, m/s.
    Inflow(f64),
    /// The other side of the axis follows; the head falls by so much along the axis, m. Both sides say the same.
    Periodic {
        fall: f64,
    },
}

/// A flow to be solved for.
#[derive(Debug, Clone, PartialEq)]
pub struct Problem {
    pub cells: Cells,
    /// Per cell, m/s, along x.
    pub conductivity: Vec<f64>,
    /// Conductivity along each axis by that along x.
    pub anisotropy: [f64; 3],
    /// Per cell.
    pub porosity: Vec<f64>,
    /// Per axis the lower and the upper side.
    pub sides: [[Side; 2]; 3],
    pub wells: Vec<Well>,
}

/// A flow, and how good it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Solution {
    /// The sinks stand in the order of the wells.
    pub flow: FaceFlow,
    /// Conjugate gradients, over all passes.
    pub iterations: usize,
    /// Norm of the imbalances, by that of what drives the flow.
    pub residual: f64,
    /// Water that appears in the worst cell, by the through-flow.
    pub worst_imbalance: f64,
    pub worst_cell: usize,
}

/// Solves for heads and fluxes.
///
/// - Equation: `Σ_faces q A = Q`, `q = (h₁ − h₂)/(d₁/2K₁ + d₂/2K₂)`.
/// - Symbols: `K` conductivity along the axis, `d` widths of the two cells, `h` their heads, `Q` what wells inject.
/// - Range: positive conductivity; a fixed head somewhere, or inflows that add up (then the head of the first cell is 0).
/// - Source: H. Darcy (1856), Les fontaines publiques de la ville de Dijon; two-point finite volumes.
/// - Shape: fluxes are made from heads once. What does not balance is solved for, and the fluxes of that correction
///   are added: balance is not limited by the rounding of heads.
pub fn solve(problem: Problem) -> Result<Solution, DarcyError> {
    error::check(&problem)?;
    let system = System::new(&problem);
    let mut cycle = Cycle::new(system.matrix(&problem));
    let Problem { cells, conductivity, porosity, wells, .. } = problem;
    let n = cells.n_cells();
    let sink = |(owner, well): (usize, &Well)| Sink { cell: well.cell, rate: -well.rate, owner };
    let sinks = wells.iter().enumerate().map(sink).collect();
    let mut head = vec![0.0; n];
    let flux = system.flux(&cells, &head);
    let mut flow = FaceFlow { cells, flux, porosity, head: None, conductivity: Some(conductivity), sinks };
    let mut rest = flow.imbalance();
    let drive = dot(&rest, &rest).sqrt();
    let (mut iterations, mut correction) = (0, vec![0.0; n]);
    let (mut share, mut best) = (SHARE, f64::INFINITY);
    let n_passes = if drive > 0.0 { MOST_PASSES } else { 0 };
    for pass in 0..n_passes {
        rest.iter_mut().for_each(|rest| *rest = -*rest);
        iterations += gradient::solve(&mut cycle, &mut rest, &mut correction, share, MOST_ITERATIONS);
        head.iter_mut().zip(&correction).for_each(|(head, correction)| *head += correction);
        if pass == 0 {
            flow.flux = system.flux(&flow.cells, &head);
        } else {
            system.add_flux(&flow.cells, &correction, &mut flow.flux);
        }
        rest = flow.imbalance();
        let worst = worst(&rest).1 / flow.through_flow();
        if worst <= ENOUGH || worst > 0.5 * best {
            break;
        }
        best = best.min(worst);
        // No more than is asked for, with a digit to spare.
        share = SHARE.max(0.1 * ENOUGH / worst);
    }
    finish(flow, head, &system, iterations, drive)
}

/// The first cell of the largest absolute value; one that is no number counts as the largest.
fn worst(rest: &[f64]) -> (usize, f64) {
    let mut worst = (0, 0.0);
    for (cell, rest) in rest.iter().enumerate() {
        let rest = if rest.is_nan() { f64::INFINITY } else { rest.abs() };
        if rest > worst.1 {
            worst = (cell, rest);
        }
    }
    worst
}

fn finish(
    mut flow: FaceFlow,
    mut head: Vec<f64>,
    system: &System,
    iterations: usize,
    drive: f64,
) -> Result<Solution, DarcyError> {
    let rest = flow.imbalance();
    let through_flow = flow.through_flow();
    let (worst_cell, most) = worst(&rest);
    let worst_imbalance = if most == 0.0 { 0.0 } else { most / through_flow };
    if worst_imbalance.is_nan() || worst_imbalance > MOST_IMBALANCE {
        let place = flow.cells.place(worst_cell);
        return Err(DarcyError::NotConverged { iterations, imbalance: worst_imbalance, place });
    }
    let residual = if drive > 0.0 { dot(&rest, &rest).sqrt() / drive } else { 0.0 };
    head.iter_mut().for_each(|head| *head += system.reference());
    flow.head = Some(head);
    Ok(Solution { flow, iterations, residual, worst_imbalance, worst_cell })
}

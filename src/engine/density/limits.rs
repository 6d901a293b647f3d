//! How wide and how narrow kernels may be.
//!
//! Owns these bounds. May use the lattice. It deliberately chooses no bandwidth.

use super::lattice::{AXES, Lattice};
use super::taps::{CURVATURE_REACH, REACH};

/// Of an axis, that kernels may take up to one side.
const PART: f64 = 0.9;

/// A support may grow by so much in a loop.
pub const GROWTH: f64 = 1.5;

/// Bounds of bandwidths, m.
#[derive(Debug, Clone)]
pub struct Limits {
    /// Of kernels, along each axis.
    pub kernel: [[f64; 2]; AXES],
    /// Of kernels for curvatures.
    pub curvature: [f64; 2],
    /// The same along each axis.
    pub curvature_along: [[f64; 2]; AXES],
    pub support: [f64; 2],
}

impl Limits {
    /// - Equation: `0.4 Δ_i ≤ h_i ≤ Δ_i (0.9 n_i − 1)/3`, `0.3 Δ_i ≤ g ≤ Δ_i (0.9 n_i − 1)/4`, `0.4 max Δ ≤ σ ≤ min h_i`.
    /// - Symbols: `Δ_i` size of cells, `n_i` their number.
    /// - Range: axes of at least four cells; on shorter ones the lower bound holds.
    /// - Source: methods, section 4.6.
    /// - Shape: lower and upper bounds, m.
    pub fn new(lattice: &Lattice) -> Self {
        let mut limits = Self {
            kernel: [[0.0, f64::INFINITY]; AXES],
            curvature: [0.0, f64::INFINITY],
            curvature_along: [[0.0, f64::INFINITY]; AXES],
            support: [0.0, f64::INFINITY],
        };
        for axis in lattice.axes() {
            let edge = lattice.edge[axis];
            let most = edge * (PART * lattice.cells[axis] as f64 - 1.0);
            let low = 0.4 * edge;
            let high = (most / REACH).max(low);
            limits.support[0] = limits.support[0].max(low);
            limits.support[1] = limits.support[1].min(high);
            let of_curvature = [0.3 * edge, (most / CURVATURE_REACH).max(0.3 * edge)];
            limits.curvature_along[axis] = of_curvature;
            limits.curvature[0] = limits.curvature[0].max(of_curvature[0]);
            limits.curvature[1] = limits.curvature[1].min(of_curvature[1]);
            limits.kernel[axis] = [low, high];
        }
        limits.support[1] = limits.support[1].max(limits.support[0]);
        limits.curvature[1] = limits.curvature[1].max(limits.curvature[0]);
        limits
    }

    /// The same, with kernels within bounds of others too, which come first.
    pub fn within(mut self, others: &Self) -> Self {
        for (own, [low, high]) in self.kernel.iter_mut().zip(others.kernel) {
            *own = own.map(|bound| bound.clamp(low, high));
        }
        self
    }
}

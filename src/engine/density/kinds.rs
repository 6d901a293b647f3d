//! What is asked of kernels that differ from cell to cell, and what is told of them.
//!
//! Owns the settings and the result. May use the lattice and tallies. It deliberately computes nothing.

use super::lattice::{AXES, Lattice};
use super::local::Orientation;
use super::tally::Weighing;

/// Which formulas are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Variant {
    /// As published: curvatures without a mean and with the right square, shapes that are least rough.
    #[default]
    Corrected,
    /// As in the released program, with its defects, to compare.
    Released,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Shape {
    /// Kernels may be longer along one axis than along another.
    #[default]
    Stretched,
    Round,
}

/// Of which power of a bandwidth the bias is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Order {
    /// Every particle has its kernel.
    #[default]
    Second,
    /// Kernels are wider, and what they are wrong by is put right; of the second order beside ends that absorb or hold a value.
    Fourth,
}

/// The bandwidths of the first loop.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum Start {
    /// That of a normal density with the cloud's standard deviations.
    #[default]
    NormalReference,
    /// So much of it.
    Times(f64),
    /// m
    Bandwidth(f64),
}

/// How kernels are found.
#[derive(Debug, Clone, PartialEq)]
pub struct Adaptive {
    pub variant: Variant,
    pub shape: Shape,
    pub start: Start,
    /// Which way kernels are stretched; along the axes of the lattice if they are round, or as in the released program.
    pub orientation: Orientation,
    pub weighing: Weighing,
    pub order: Order,
    /// Bounds of all bandwidths, m.
    pub bounds: Option<[f64; 2]>,
    /// Wide kernels are summed on coarse cells, and the iteration begins there.
    pub is_fast: bool,
    /// Relative change of a loop that ends the iteration; zero for never.
    pub tolerance: f64,
    pub most_loops: usize,
}

impl Adaptive {
    /// Whether kernels follow directions.
    pub(super) fn is_oriented(&self) -> bool {
        self.takes_cells() && self.orientation != Orientation::Axes
    }

    /// Whether lengths are counted in cells.
    pub(super) fn takes_cells(&self) -> bool {
        self.shape == Shape::Stretched && self.variant == Variant::Corrected
    }
}

impl Default for Adaptive {
    fn default() -> Self {
        Self {
            variant: Variant::default(),
            shape: Shape::default(),
            start: Start::default(),
            orientation: Orientation::default(),
            weighing: Weighing::default(),
            order: Order::default(),
            bounds: None,
            is_fast: true,
            tolerance: 0.02,
            most_loops: 20,
        }
    }
}

/// What is known of a cell with particles.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cell {
    pub at: [usize; AXES],
    /// Bandwidth, m: the geometric mean of those along its axes.
    pub h: f64,
    /// Bandwidths over it.
    pub s: [f64; AXES],
    /// The axes of the kernel, unit vectors: those of the lattice, or the first along the direction of its cell.
    pub axes: [[f64; AXES]; AXES],
    /// Whether there is a direction to follow that the cell has not: its kernel is round.
    pub is_stagnant: bool,
    /// Width of the support within which errors are weighed, m.
    pub sigma: f64,
    /// Bandwidths of curvatures along the same axes, m.
    pub g: [f64; AXES],
    /// Classes of bandwidths, where they are rounded.
    pub h_class: [i64; AXES],
    pub g_class: [i64; AXES],
    /// Density, and its mean over the support; counts per m^d.
    pub rho: f64,
    pub n: f64,
    /// Net roughness Λ, and locally averaged products of curvatures, by rows of the lower triangle.
    pub roughness: f64,
    pub psi: [f64; 6],
}

impl Cell {
    /// The kernel's covariance, m².
    ///
    /// - Equation: `H = Σ_k (h s_k)² e_k e_kᵀ`.
    /// - Symbols: `e_k` axes of the kernel.
    /// - Range: any.
    /// - Source: methods, section 3.4.
    /// - Shape: symmetric; rows and columns of zeros for axes of one cell.
    pub fn matrix(&self) -> [[f64; AXES]; AXES] {
        let mut matrix = [[0.0; AXES]; AXES];
        for (axis, s) in self.axes.iter().zip(self.s) {
            for i in 0..AXES {
                for j in 0..AXES {
                    matrix[i][j] += (self.h * s) * (self.h * s) * axis[i] * axis[j];
                }
            }
        }
        matrix
    }
}

/// A density, and how it was found.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// Mass per m^d, by cell of the lattice, and its standard error by the numbers of particles.
    pub density: Vec<f64>,
    pub standard_error: Vec<f64>,
    /// By cell with particles, in the order of the tally.
    pub cells: Vec<Cell>,
    /// Mean bandwidth over cells with particles after each loop, m, that of the start first; loops on coarser cells come before
    /// those on the cells themselves.
    pub history: Vec<f64>,
    /// Whether the last loop changed less than the tolerance.
    pub is_settled: bool,
}

impl Estimate {
    /// Of particles whose masses are not finite and above zero.
    pub(super) fn unknown(lattice: &Lattice) -> Self {
        let none = vec![f64::NAN; lattice.n_cells()];
        let (density, standard_error) = (none.clone(), none);
        Self { density, standard_error, cells: Vec::new(), history: vec![f64::NAN], is_settled: false }
    }
}

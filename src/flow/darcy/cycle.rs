//! The preconditioner: a multigrid cycle over ever coarser systems.
//!
//! Owns the levels and their scratch memory. May use the matrix and the joining of nodes. It deliberately does not
//! iterate on the finest level: the conjugate gradients do.

use super::aggregate::coarsen;
use super::matrix::{Matrix, add, dot};

/// Nodes of a system that is factorised.
const FEW: usize = 64;

/// A system that is hardly smaller than the one before is the last.
const LEAST_GAIN: f64 = 0.9;

struct Level {
    matrix: Matrix,
    /// Group of each node on the next level.
    group: Vec<u32>,
    scratch: Scratch,
}

/// Of the next level.
#[derive(Default)]
struct Scratch {
    rest: Vec<f64>,
    solution: Vec<f64>,
    first: Vec<f64>,
    first_image: Vec<f64>,
    second_image: Vec<f64>,
}

impl Scratch {
    fn new(n: usize) -> Self {
        let zeros = || vec![0.0; n];
        Self { rest: zeros(), solution: zeros(), first: zeros(), first_image: zeros(), second_image: zeros() }
    }
}

/// A symmetric multigrid cycle in which each coarse system is solved by two flexible conjugate gradients.
///
/// - Equation: smooth forwards, correct on the groups, smooth backwards; smoothing is Gauss–Seidel.
/// - Symbols: the second coarse iteration is left out where the first leaves less than a quarter.
/// - Range: symmetric M-matrices.
/// - Source: Y. Notay and P. S. Vassilevski (2008), Numer. Linear Algebra Appl. 15, 473, doi:10.1002/nla.542.
/// - Shape: `z ≈ A⁻¹ r`; not linear in `r`, so that the outer iteration must be flexible.
pub struct Cycle {
    levels: Vec<Level>,
    last: Factor,
}

impl Cycle {
    pub fn new(matrix: Matrix) -> Self {
        let mut levels = Vec::new();
        let mut matrix = matrix;
        while matrix.n() > FEW {
            let (group, coarse) = coarsen(&matrix);
            if coarse.n() as f64 > LEAST_GAIN * matrix.n() as f64 {
                break;
            }
            let scratch = Scratch::new(coarse.n());
            levels.push(Level { matrix, group, scratch });
            matrix = coarse;
        }
        Self { levels, last: Factor::new(matrix) }
    }

    pub fn matrix(&self) -> &Matrix {
        self.levels.first().map_or(&self.last.matrix, |level| &level.matrix)
    }

    /// `z ≈ A⁻¹ r`.
    pub fn apply(&mut self, r: &[f64], z: &mut [f64]) {
        apply(&mut self.levels, &self.last, r, z);
    }
}

fn apply(levels: &mut [Level], last: &Factor, r: &[f64], z: &mut [f64]) {
    let Some((level, coarser)) = levels.split_first_mut() else { return last.solve(r, z) };
    let (matrix, group) = (&level.matrix, &level.group);
    let mut scratch = std::mem::take(&mut level.scratch);
    z.fill(0.0);
    for i in 0..matrix.n() {
        z[i] = (r[i] + matrix.neighbours(i, z)) / matrix.diagonal[i];
    }
    scratch.rest.fill(0.0);
    for i in 0..matrix.n() {
        let rest = r[i] - (matrix.diagonal[i] * z[i] - matrix.neighbours(i, z));
        scratch.rest[group[i] as usize] += rest;
    }
    correct(coarser, last, &mut scratch);
    for (z, &group) in z.iter_mut().zip(group) {
        *z += scratch.solution[group as usize];
    }
    for i in (0..matrix.n()).rev() {
        z[i] = (r[i] + matrix.neighbours(i, z)) / matrix.diagonal[i];
    }
    level.scratch = scratch;
}

/// One or two flexible conjugate gradients on the system of the first level, for `rest`; the result is `solution`.
fn correct(levels: &mut [Level], last: &Factor, scratch: &mut Scratch) {
    let Scratch { rest, solution, first, first_image, second_image } = scratch;
    apply(levels, last, rest, first);
    let Some(level) = levels.first() else { return solution.copy_from_slice(first) };
    level.matrix.multiply(first, first_image);
    let curvature = dot(first, first_image);
    let before = dot(rest, rest);
    if curvature <= 0.0 || before == 0.0 {
        return solution.copy_from_slice(first);
    }
    let length = dot(first, rest) / curvature;
    add(rest, -length, first_image);
    if dot(rest, rest) <= 0.0625 * before {
        solution.copy_from_slice(first);
        solution.iter_mut().for_each(|value| *value *= length);
        return;
    }
    apply(levels, last, rest, solution);
    if let Some(level) = levels.first() {
        level.matrix.multiply(solution, second_image);
    }
    let mixed = dot(solution, first_image);
    let left = dot(solution, second_image) - mixed * mixed / curvature;
    let second_length = if left > 0.0 { dot(solution, rest) / left } else { 0.0 };
    let first_length = length - mixed * second_length / curvature;
    for (solution, first) in solution.iter_mut().zip(first) {
        *solution = first_length * *first + second_length * *solution;
    }
}

/// The coarsest system: factorised if it is small, else smoothed.
struct Factor {
    matrix: Matrix,
    /// Lower triangle of the Cholesky factor, by rows; empty if the system is not small.
    lower: Vec<f64>,
}

impl Factor {
    fn new(matrix: Matrix) -> Self {
        let n = matrix.n();
        if n > 8 * FEW {
            return Self { matrix, lower: Vec::new() };
        }
        let mut lower = vec![0.0; n * n];
        for i in 0..n {
            lower[i * n + i] = matrix.diagonal[i];
            let (nodes, conductances) = matrix.row(i);
            for (&node, conductance) in nodes.iter().zip(conductances) {
                lower[i * n + node as usize] = -conductance;
            }
        }
        for j in 0..n {
            for i in j..n {
                let sum: f64 = (0..j).map(|k| lower[i * n + k] * lower[j * n + k]).sum();
                let value = lower[i * n + j] - sum;
                // A pivot that rounding made negative belongs to a node that hardly knows a fixed head.
                let floor = f64::EPSILON * matrix.diagonal[j];
                lower[i * n + j] = if i == j { value.max(floor).sqrt() } else { value / lower[j * n + j] };
            }
        }
        Self { matrix, lower }
    }

    fn solve(&self, r: &[f64], z: &mut [f64]) {
        let n = self.matrix.n();
        if self.lower.is_empty() {
            z.fill(0.0);
            (0..n).for_each(|i| z[i] = (r[i] + self.matrix.neighbours(i, z)) / self.matrix.diagonal[i]);
            (0..n).rev().for_each(|i| z[i] = (r[i] + self.matrix.neighbours(i, z)) / self.matrix.diagonal[i]);
            return;
        }
        for i in 0..n {
            let sum: f64 = (0..i).map(|k| self.lower[i * n + k] * z[k]).sum();
            z[i] = (r[i] - sum) / self.lower[i * n + i];
        }
        for i in (0..n).rev() {
            let sum: f64 = (i + 1..n).map(|k| self.lower[k * n + i] * z[k]).sum();
            z[i] = (z[i] - sum) / self.lower[i * n + i];
        }
    }
}

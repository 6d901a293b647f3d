//! Walls at which a density is held at a value.
//!
//! Owns what stands behind such walls. May use lattices and taps. It deliberately leaves the folding of particles to kernels: a
//! wall mirrors them with the other sign, and adds twice its own density behind it.

#![allow(clippy::needless_range_loop)] // An axis belongs to several arrays at once.

use super::classes::Fill;
use super::lattice::{AXES, End, Lattice};
use super::taps::{Integral, Line, Taps};
use std::collections::VecDeque;

/// An end of an axis, and its density.
#[derive(Debug, Clone, Copy)]
pub struct Wall {
    pub axis: usize,
    pub side: usize,
    pub value: f64,
}

/// All walls that hold something above zero.
///
/// - Equation: a cell behind a wall has `2 ρ_w V − c_b` counts, and the kernel of cell b turned over.
/// - Symbols: `ρ_w` density of the wall, `c_b` counts of the cell that it mirrors, which may be none.
/// - Range: never clipped by cell, as counts scatter: what is clipped would be missing on the mean. With kernels along axes no
///   density is below zero, as no cell has more of the mirrored kernel than of the kernel.
/// - Source: methods, section 4.7.
/// - Shape: a linear density stays linear.
#[derive(Debug)]
pub struct Held {
    pub walls: Vec<Wall>,
    /// By cell of the lattice, the cell with particles whose kernel it has: the nearest one, in steps along axes.
    owners: Vec<u32>,
}

impl Held {
    /// Of cells with particles.
    pub fn new(lattice: &Lattice, cells: &[[usize; AXES]]) -> Option<Self> {
        let mut walls = Vec::new();
        for axis in lattice.axes() {
            for (side, end) in lattice.ends[axis].iter().enumerate() {
                if let End::Held(value) = *end
                    && value > 0.0
                {
                    walls.push(Wall { axis, side, value });
                }
            }
        }
        if walls.is_empty() || cells.is_empty() {
            return None;
        }
        let mut owners = vec![u32::MAX; lattice.n_cells()];
        let place = |[x, y, z]: [usize; AXES]| (x * lattice.cells[1] + y) * lattice.cells[2] + z;
        let mut next: VecDeque<[usize; AXES]> = cells.iter().copied().collect();
        cells.iter().enumerate().for_each(|(idx, &cell)| owners[place(cell)] = idx as u32);
        while let Some(cell) = next.pop_front() {
            let owner = owners[place(cell)];
            for axis in lattice.axes() {
                for other in lattice.beside(cell[axis], axis) {
                    let mut cell = cell;
                    cell[axis] = other;
                    if owners[place(cell)] == u32::MAX {
                        owners[place(cell)] = owner;
                        next.push_back(cell);
                    }
                }
            }
        }
        Some(Self { walls, owners })
    }

    /// Cells that a wall mirrors, as deep as kernels reach, and the cells with particles whose kernels they have.
    pub fn before(&self, lattice: &Lattice, wall: Wall, reach: usize) -> Vec<([usize; AXES], usize)> {
        let n = lattice.cells[wall.axis];
        let is_near = |cell: &[usize; AXES]| {
            let depth = if wall.side == 0 { cell[wall.axis] } else { n - 1 - cell[wall.axis] };
            depth <= reach
        };
        let all = self.owners.iter().enumerate();
        let cells = all.map(|(idx, &owner)| (lattice.cell(idx), owner as usize));
        cells.filter(|(cell, _)| is_near(cell)).collect()
    }

    /// What a Gaussian in a cell has of twice the densities of walls behind them.
    ///
    /// - Equation: `Σ_w 2 ρ_w T_w Π_j (1 − T_j)`, `T = ½ erfc(x/(√2 σ))`.
    /// - Symbols: `x` distance of the wall; j other axes, `T_j` what is behind both their ends.
    /// - Range: any; behind two walls of different axes at once their densities cancel, as mirroring twice gives the cell back.
    /// - Source: methods, section 4.7.
    /// - Shape: from `ρ_w` at a wall to zero.
    pub fn beyond(&self, lattice: &Lattice, integral: Integral, cell: [usize; AXES], sigma: f64) -> f64 {
        let behind = |axis: usize, side: usize| {
            let at = if side == 0 { cell[axis] } else { lattice.cells[axis] - 1 - cell[axis] };
            0.5 - integral.at((at as f64 + 0.5) * lattice.edge[axis] / sigma)
        };
        let of_axis = |axis: usize| -> f64 {
            let sides = (0..2).filter(|&side| lattice.ends[axis][side].is_odd());
            sides.map(|side| behind(axis, side)).sum()
        };
        let of_wall = |wall: &Wall| {
            let others = lattice.axes().filter(|&axis| axis != wall.axis);
            let inside: f64 = others.map(|axis| 1.0 - of_axis(axis)).product();
            2.0 * wall.value * behind(wall.axis, wall.side) * inside
        };
        self.walls.iter().map(of_wall).sum()
    }
}

/// What the cells of a line have of a kernel that one of its ends has turned over, or that lies beside a wall of another axis:
/// without what ends that change signs make of that.
pub fn turned_over(line: Line, own: f64, (b, side): (usize, Option<usize>), fill: Fill, taps: &mut Taps) {
    if side.is_none() && !line.ends.iter().any(|end| end.is_odd()) {
        return fill(line, own, b, taps);
    }
    let n = line.n;
    // On a line of three times the length no end is reached.
    let centre = match side {
        None => n + b,
        Some(0) => n - 1 - b,
        Some(_) => 3 * n - 1 - b,
    };
    fill(Line { n: 3 * n, ends: [End::Mirror; 2], ..line }, own, centre, taps);
    let (first, end) = (taps.first.max(n), (taps.first + taps.values.len()).min(2 * n));
    if first >= end {
        taps.values.clear();
        taps.first = 0;
        return;
    }
    taps.values.truncate(end - taps.first);
    taps.values.drain(..first - taps.first);
    taps.first = first - n;
}

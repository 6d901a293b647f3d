//! Where particles start.
//!
//! Owns the strata and the first positions. May use `state` and the plan's words. It deliberately
//! reads no initial values.

use super::quasi::Quasi;
use crate::maths::wide::Width;
use crate::plan::{Axis, Placement, Side};
use crate::state::particles::{Block, CHUNK};
use crate::state::stream::{Purpose, Stream};

/// Cells of nearly equal sides, filled with equal numbers (±1) of particles in the order of cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Strata<const D: usize> {
    low: [f64; D],
    width: [f64; D],
    cells: [u64; D],
    n_particles: u64,
}

impl<const D: usize> Strata<D> {
    /// One axis: as many cells as particles. More axes: at most as many.
    pub fn new(axes: &[Axis], n_particles: u64) -> Self {
        let length: [f64; D] = std::array::from_fn(|axis| axes[axis].high - axes[axis].low);
        let mut order: [usize; D] = std::array::from_fn(|axis| axis);
        order.sort_by(|&a, &b| length[a].total_cmp(&length[b]));
        let mut cells = [1; D];
        let mut n_left = n_particles;
        // Shortest axis first: a thin domain leaves its cells to the longer axes.
        for (rank, &axis) in order.iter().enumerate() {
            let rest = &order[rank..];
            let shape: f64 = rest.iter().map(|&other| length[axis] / length[other]).product();
            let along = root(n_left as f64 * shape, rest.len());
            cells[axis] = (along as u64).clamp(1, n_left);
            n_left /= cells[axis];
        }
        let low = std::array::from_fn(|axis| axes[axis].low);
        let width = std::array::from_fn(|axis| length[axis] / cells[axis] as f64);
        Self { low, width, cells, n_particles }
    }

    /// Cell of a particle, its rank in the cell and the number of particles there.
    fn cell(&self, particle: u64) -> ([u64; D], u64, u64) {
        let n_cells = u128::from(self.cells.iter().product::<u64>());
        let n = u128::from(self.n_particles);
        let mut cell = (u128::from(particle) * n_cells / n) as u64;
        let first = |cell: u64| (u128::from(cell) * n).div_ceil(n_cells) as u64;
        let (start, end) = (first(cell), first(cell + 1));
        let mut along = [0; D];
        for axis in (0..D).rev() {
            along[axis] = cell % self.cells[axis];
            cell /= self.cells[axis];
        }
        (along, particle - start, end - start)
    }
}

/// The `n`-th root, a little above whole numbers so that rounding does not lose one.
fn root(x: f64, n: usize) -> f64 {
    match n {
        1 => x * (1.0 + 1e-12),
        2 => x.sqrt() * (1.0 + 1e-12),
        _ => crate::maths::scalar::pow(x, 1.0 / n as f64) * (1.0 + 1e-12),
    }
}

/// Fills the positions of a block.
pub fn place<const D: usize>(
    axes: &[Axis],
    (placement, disorder): (Placement, f64),
    strata: &Strata<D>,
    seed: u64,
    block: &mut Block<D>,
) {
    let stream = Stream::new(seed, Purpose::Placement);
    let quasi = Quasi::new(&stream);
    let mut uniforms = [[0.5; CHUNK]; D];
    for (chunk_idx, range) in block.chunks().enumerate() {
        if matches!(placement, Placement::Random | Placement::Stratified) || disorder > 0.0 {
            for (axis, uniforms) in uniforms.iter_mut().enumerate() {
                stream.uniforms(Width::widest(), block.idx, (chunk_idx * D + axis) as u64, uniforms);
            }
        }
        for (idx, particle_idx) in range.enumerate() {
            let particle = block.first() + particle_idx as u64;
            let uniform = std::array::from_fn(|axis| uniforms[axis][idx]);
            let position = match placement {
                Placement::Random => across(axes, uniform),
                Placement::LowDiscrepancy => across(axes, quasi.point(particle)),
                Placement::Stratified => inside(strata, particle, uniform),
                Placement::Ordered if disorder > 0.0 => {
                    let place = centre(strata, particle);
                    std::array::from_fn(|axis| {
                        let beside = disorder * (uniform[axis] - 0.5) * strata.width[axis];
                        folded(&axes[axis], place[axis] + beside)
                    })
                }
                Placement::Ordered => centre(strata, particle),
            };
            for axis in 0..D {
                block.positions[axis][particle_idx] = position[axis].clamp(axes[axis].low, axes[axis].high);
            }
        }
    }
}

/// The place of a point of the unit cube in the domain.
fn across<const D: usize>(axes: &[Axis], uniform: [f64; D]) -> [f64; D] {
    std::array::from_fn(|axis| axes[axis].low + uniform[axis] * (axes[axis].high - axes[axis].low))
}

/// What lies beyond a side is mirrored there, or comes in again at the other one.
fn folded(axis: &Axis, x: f64) -> f64 {
    let length = axis.high - axis.low;
    let turn = if axis.low_side == Side::Periodic { length } else { 2.0 * length };
    let within = (x - axis.low).rem_euclid(turn);
    axis.low + if within > length { turn - within } else { within }
}

fn inside<const D: usize>(strata: &Strata<D>, particle: u64, uniform: [f64; D]) -> [f64; D] {
    let (cell, _, _) = strata.cell(particle);
    std::array::from_fn(|axis| strata.low[axis] + (cell[axis] as f64 + uniform[axis]) * strata.width[axis])
}

/// The centre of the particle's share: a cell with several particles is sliced along the first axis.
fn centre<const D: usize>(strata: &Strata<D>, particle: u64) -> [f64; D] {
    let (cell, rank, n_in_cell) = strata.cell(particle);
    std::array::from_fn(|axis| {
        let offset = if axis == 0 { (rank as f64 + 0.5) / n_in_cell as f64 } else { 0.5 };
        strata.low[axis] + (cell[axis] as f64 + offset) * strata.width[axis]
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis(index: usize, length: f64) -> Axis {
        Axis {
            index,
            low: -1.0,
            high: -1.0 + length,
            low_side: Side::Reflect,
            high_side: Side::Reflect,
            bins: 1,
        }
    }

    #[test]
    fn one_axis_has_one_particle_per_stratum() {
        let strata = Strata::<1>::new(&[axis(0, 3.0)], 1_000_003);
        assert_eq!(strata.cells, [1_000_003]);
        assert_eq!(strata.cell(777), ([777], 0, 1));
    }

    #[test]
    fn cells_are_nearly_cubic_and_equally_filled() {
        for (lengths, n) in [([1.0, 1.0, 1.0], 1000), ([4.0, 1.0, 1e-3], 10_000), ([1.0, 2.0, 3.0], 12_345)] {
            let axes: Vec<Axis> =
                lengths.iter().enumerate().map(|(index, &length)| axis(index, length)).collect();
            let strata = Strata::<3>::new(&axes, n);
            let n_cells: u64 = strata.cells.iter().product();
            assert!(n_cells <= n && n_cells * 2 > n, "{:?}", strata.cells);
            let mut counts = vec![0_u64; n_cells as usize];
            for particle in 0..n {
                let (along, rank, total) = strata.cell(particle);
                let idx = (along[0] * strata.cells[1] + along[1]) * strata.cells[2] + along[2];
                assert_eq!(counts[idx as usize], rank);
                assert!(total == n / n_cells || total == n / n_cells + 1);
                counts[idx as usize] += 1;
            }
            assert!(counts.iter().all(|&c| c == n / n_cells || c == n / n_cells + 1));
        }
        let strata = Strata::<3>::new(&[axis(0, 1.0), axis(1, 1.0), axis(2, 1.0)], 1000);
        assert_eq!(strata.cells, [10, 10, 10]);
    }
}

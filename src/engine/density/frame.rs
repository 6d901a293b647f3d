//! The lattice on which kernels are found, and the way back.
//!
//! Owns axes that are left out and lengths that are taken for one. May use lattices and tallies. It deliberately finds no kernel.
//!
//! Supports and kernels of curvatures have one width along all axes. That is a width in cells where kernels may be stretched:
//! of a thin layer a metre along it is not what a metre across it is. An axis of one cell tells nothing of a density.

use super::kinds::{Cell, Estimate};
use super::lattice::{AXES, End, Lattice};
use super::tally::Tally;
use crate::maths::vector::pow;

pub struct Frame<'a> {
    original: &'a Lattice,
    /// Nothing where the original serves, or has no axis with more than one cell.
    pub reduced: Option<(Lattice, Tally)>,
    /// Axes of the original that there are, and what is one along them, m.
    pub kept: Vec<usize>,
    pub scales: Vec<f64>,
}

impl<'a> Frame<'a> {
    pub fn new(original: &'a Lattice, tally: &Tally, takes_cells: bool) -> Self {
        let kept: Vec<usize> = original.axes().filter(|&axis| original.cells[axis] > 1).collect();
        let edges: Vec<f64> = kept.iter().map(|&axis| original.edge[axis]).collect();
        let is_even = edges.iter().all(|edge| *edge == edges[0]);
        let scales = if takes_cells && !is_even { edges } else { vec![1.0; kept.len()] };
        let serves = kept.len() == original.d && scales.iter().all(|scale| *scale == 1.0);
        let mut frame = Self { original, reduced: None, kept, scales };
        if !serves {
            let axis = |(&axis, scale): (&usize, &f64)| {
                (original.cells[axis], original.edge[axis] / scale, original.ends[axis])
            };
            let axes: Vec<(usize, f64, [End; 2])> = frame.kept.iter().zip(&frame.scales).map(axis).collect();
            frame.reduced =
                Lattice::new(&axes).map(|lattice| (lattice, tally.along(&frame.kept, &frame.scales)));
            let per = frame.per_volume();
            if let Some((lattice, _)) = &mut frame.reduced {
                for end in lattice.ends.as_flattened_mut() {
                    if let End::Held(value) = end {
                        *value /= per;
                    }
                }
            }
        }
        frame
    }

    /// Whether the original is nothing but one cell.
    pub fn is_point(&self) -> bool {
        self.kept.is_empty()
    }

    /// Geometric mean of what is one, m.
    pub fn mean(&self) -> f64 {
        pow(self.scales.iter().product(), 1.0 / self.scales.len().max(1) as f64)
    }

    /// Counts per volume of the reduced lattice, over those of the original.
    pub fn per_volume(&self) -> f64 {
        self.reduced.as_ref().map_or(1.0, |(lattice, _)| lattice.volume()) / self.original.volume()
    }

    /// An estimate on the reduced lattice as one on the original.
    pub fn restore(&self, mut found: Estimate, is_oriented: bool) -> Estimate {
        let unit = |axis: usize| std::array::from_fn(|other| if other == axis { 1.0 } else { 0.0 });
        for cell in found.cells.iter_mut().filter(|_| !is_oriented) {
            self.kept.iter().for_each(|&axis| cell.axes[axis] = unit(axis));
        }
        let Some((lattice, _)) = &self.reduced else { return found };
        let (mean, ratio) = (self.mean(), self.per_volume());
        found.density.iter_mut().chain(&mut found.standard_error).for_each(|value| *value *= ratio);
        found.history.iter_mut().for_each(|h| *h *= mean);
        let first = AXES - lattice.d;
        for cell in &mut found.cells {
            let own = cell.clone();
            // One cell along an axis has no bandwidth.
            let mut at = [0; AXES];
            (cell.s, cell.g) = ([0.0; AXES], [0.0; AXES]);
            if is_oriented {
                cell.axes = [[0.0; AXES]; AXES];
            }
            for (k, (&axis, scale)) in self.kept.iter().zip(&self.scales).enumerate() {
                at[axis] = own.at[first + k];
                if is_oriented {
                    // Axes are no unit vectors where lengths along them differ; bandwidths are along what they are in metres.
                    (cell.s[axis], cell.g[axis]) = (own.s[first + k], own.g[first + k] * mean);
                    for (i, (&other, scale)) in self.kept.iter().zip(&self.scales).enumerate() {
                        cell.axes[axis][other] = own.axes[first + k][first + i] * scale / mean;
                    }
                    continue;
                }
                cell.s[axis] = own.s[first + k] * scale / mean;
                cell.g[axis] = own.g[first + k] * scale;
            }
            let roughness = own.roughness * ratio * ratio / (mean * mean * mean * mean);
            *cell = Cell {
                at,
                h: own.h * mean,
                sigma: own.sigma * mean,
                rho: own.rho * ratio,
                n: own.n * ratio,
                roughness,
                ..cell.clone()
            };
        }
        found
    }
}

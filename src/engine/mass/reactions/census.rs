//! Which cell each particle is in, and what is in each cell.
//!
//! Owns these lists of one population. May use flocks and `parallel`. It deliberately adds masses in the order of particles:
//! no number of threads shows.

#![allow(clippy::needless_range_loop)] // An axis belongs to several arrays at once.

use super::super::super::density::Lattice;
use super::super::super::parallel;
use super::super::flock::Flock;

/// Of a particle outside of the lattice.
pub const OUTSIDE: u32 = u32::MAX;

/// What is where.
#[derive(Default)]
pub struct Census {
    /// The cell of each particle, by flock.
    pub places: Vec<Vec<u32>>,
    /// Cells with particles, rising, and the mass in each.
    pub cells: Vec<u32>,
    pub masses: Vec<f64>,
    /// Sums of squared masses of the same cells, if they are asked for.
    pub squares: Vec<f64>,
    /// Σm and Σm².
    pub moments: [f64; 2],
}

impl Census {
    /// Counts a population; `of_cell` holds zeros, one per cell of the lattice, before and after.
    pub fn of<const D: usize>(
        flocks: &[&Flock<D>],
        (lattice, low): (&Lattice, &[f64; D]),
        (of_cell, has_squares): (&mut [f64], bool),
    ) -> Self {
        let places = parallel::map(flocks.len(), &|idx| locate(flocks[idx], lattice, low));
        let mut census = Self { places, ..Self::default() };
        for (flock, places) in flocks.iter().zip(&census.places) {
            for (&cell, &mass) in places.iter().zip(&flock.masses) {
                census.moments[0] += mass;
                census.moments[1] += mass * mass;
                if cell != OUTSIDE {
                    of_cell[cell as usize] += mass;
                }
            }
        }
        for (cell, mass) in of_cell.iter_mut().enumerate().filter(|(_, mass)| **mass != 0.0) {
            census.cells.push(cell as u32);
            census.masses.push(std::mem::take(mass));
        }
        if has_squares {
            census.square(flocks, of_cell);
        }
        census
    }

    fn square<const D: usize>(&mut self, flocks: &[&Flock<D>], of_cell: &mut [f64]) {
        for (flock, places) in flocks.iter().zip(&self.places) {
            let inside = places.iter().zip(&flock.masses).filter(|(cell, _)| **cell != OUTSIDE);
            inside.for_each(|(&cell, &mass)| of_cell[cell as usize] += mass * mass);
        }
        self.squares = self.cells.iter().map(|&cell| std::mem::take(&mut of_cell[cell as usize])).collect();
    }

    /// Effective number of particles.
    pub fn effective(&self) -> f64 {
        let [sum, squares] = self.moments;
        if squares > 0.0 { sum * sum / squares } else { 0.0 }
    }
}

fn locate<const D: usize>(flock: &Flock<D>, lattice: &Lattice, low: &[f64; D]) -> Vec<u32> {
    let first = lattice.axes().start;
    let mut places = vec![0_u32; flock.len()];
    for axis in 0..D {
        let (n, edge) = (lattice.cells[first + axis], lattice.edge[first + axis]);
        let most = n as f64;
        for (place, x) in places.iter_mut().zip(&flock.positions[axis]) {
            let along = (x - low[axis]) / edge;
            // What is on the upper end is inside.
            let is_inside = along >= 0.0 && along <= most;
            let own = (along.max(0.0) as usize).min(n - 1) as u32;
            *place = if is_inside && *place != OUTSIDE { *place * n as u32 + own } else { OUTSIDE };
        }
    }
    places
}

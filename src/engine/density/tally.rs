//! Particles counted in cells.
//!
//! Owns counts, masses and what estimators take for counts where masses differ. May use the lattice. It deliberately keeps no
//! particle.

use super::lattice::{AXES, Lattice};

/// Cells with particles in them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Tally {
    /// Numbers of cells, rising.
    pub cells: Vec<u32>,
    pub counts: Vec<f64>,
    pub masses: Vec<f64>,
    /// Sums of squares of masses over the largest one.
    pub squares: Vec<f64>,
    /// The largest mass.
    pub largest: f64,
    /// Particles outside of the lattice, and their mass.
    pub outside: (u64, f64),
    /// Mass-weighted sums of coordinates and of their squares, of what is inside.
    moments: [[f64; 2]; AXES],
}

/// What stands for the number of particles in a cell where their masses differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Weighing {
    /// Mass over the effective mass of all, `Σm²/Σm`.
    #[default]
    OfAll,
    /// Mass over the mean mass.
    Mean,
    /// The number of particles; masses come in at the end.
    Number,
    /// The effective number of particles of the cell, `(Σm)²/Σm²`; masses come in at the end.
    OfCell,
}

impl Tally {
    /// Counts particles with a position per axis of the lattice, from a corner on, and a mass each.
    pub fn of(lattice: &Lattice, low: &[f64], positions: &[&[f64]], masses: Option<&[f64]>) -> Self {
        let mut of_cells = vec![[0.0; 3]; lattice.n_cells()];
        let largest =
            masses.map_or(1.0, |masses| masses.iter().fold(0.0, |largest: f64, &own| largest.max(own)));
        let mut tally = Self { largest, ..Self::default() };
        // Squares of what is far from its middle would drown the spread.
        let origins: Vec<f64> =
            positions.iter().zip(low).map(|(x, low)| x.first().copied().unwrap_or(*low)).collect();
        let origins: Vec<f64> =
            origins.iter().zip(low).map(|(x, low)| if x.is_finite() { *x } else { *low }).collect();
        let places = places(lattice, low, positions);
        for (idx, &cell) in places.iter().enumerate() {
            let mass = masses.map_or(1.0, |masses| masses[idx]);
            if cell == OUTSIDE {
                tally.outside.0 += 1;
                tally.outside.1 += mass;
                continue;
            }
            // Squares of the masses themselves might be beyond all numbers.
            let share = if largest > 0.0 { mass / largest } else { 0.0 };
            for ((axis, x), origin) in lattice.axes().zip(positions).zip(&origins) {
                let x = x[idx] - origin;
                tally.moments[axis][0] += share * x;
                tally.moments[axis][1] += share * x * x;
            }
            let sums = &mut of_cells[cell as usize];
            sums[0] += 1.0;
            sums[1] += mass;
            sums[2] += share * share;
        }
        // What has no mass has no density; what has one that is no number is kept, to be refused.
        for (cell, sums) in of_cells.iter().enumerate().filter(|(_, sums)| sums[2] != 0.0) {
            tally.cells.push(cell as u32);
            tally.counts.push(sums[0]);
            tally.masses.push(sums[1]);
            tally.squares.push(sums[2]);
        }
        tally
    }

    /// Means of something of the same particles, weighted by mass, by cell with particles: components on the axes of the lattice.
    /// Particles for which it is no number are left out; of none the mean is zero.
    pub fn means(
        &self,
        lattice: &Lattice,
        low: &[f64],
        (positions, masses): (&[&[f64]], Option<&[f64]>),
        values: &[&[f64]],
    ) -> Vec<[f64; AXES]> {
        let mut sums = vec![[0.0; AXES + 1]; self.cells.len()];
        for (idx, cell) in places(lattice, low, positions).into_iter().enumerate() {
            let at = self.cells.binary_search(&cell).ok().filter(|_| cell != OUTSIDE);
            let Some(at) = at.filter(|_| values.iter().all(|own| own[idx].is_finite())) else { continue };
            let share = masses.map_or(1.0, |masses| masses[idx] / self.largest);
            for (axis, own) in lattice.axes().zip(values) {
                sums[at][axis] += share * own[idx];
            }
            sums[at][AXES] += share;
        }
        let mean = |[x, y, z, all]: [f64; AXES + 1]| {
            if all > 0.0 { [x / all, y / all, z / all] } else { [0.0; AXES] }
        };
        sums.into_iter().map(mean).collect()
    }

    /// The same of some axes alone, the last ones then, with other lengths for one.
    pub fn along(&self, kept: &[usize], scales: &[f64]) -> Self {
        let mut moments = [[0.0; 2]; AXES];
        for ((own, &axis), scale) in moments[AXES - kept.len()..].iter_mut().zip(kept).zip(scales) {
            let [first, second] = self.moments[axis];
            *own = [first / scale, second / (scale * scale)];
        }
        Self { moments, ..self.clone() }
    }

    /// The same on other cells, of which there are so many: `places` says which of them each cell with particles is a part of.
    /// Also, for each, the position of that one among those with particles.
    pub fn joined(&self, places: &[u32], n_cells: usize) -> (Self, Vec<u32>) {
        let mut sums = vec![[0.0; 3]; n_cells];
        for (idx, &place) in places.iter().enumerate() {
            let own = &mut sums[place as usize];
            own[0] += self.counts[idx];
            own[1] += self.masses[idx];
            own[2] += self.squares[idx];
        }
        let (largest, outside, moments) = (self.largest, self.outside, self.moments);
        let mut joined = Self { largest, outside, moments, ..Self::default() };
        let mut positions = vec![0; n_cells];
        for (cell, [count, mass, square]) in sums.into_iter().enumerate().filter(|(_, sums)| sums[2] != 0.0) {
            positions[cell] = joined.cells.len() as u32;
            joined.cells.push(cell as u32);
            joined.counts.push(count);
            joined.masses.push(mass);
            joined.squares.push(square);
        }
        (joined, places.iter().map(|&place| positions[place as usize]).collect())
    }

    pub fn mass(&self) -> f64 {
        self.masses.iter().sum()
    }

    /// Effective number of particles `(Σm)²/Σm²`.
    pub fn effective(&self) -> f64 {
        let (square, share) = (self.squares.iter().sum::<f64>(), self.mass() / self.largest);
        if square > 0.0 { share * share / square } else { 0.0 }
    }

    /// Standard deviation along each axis, weighted by mass; m.
    pub fn deviations(&self) -> [f64; AXES] {
        let share = self.mass() / self.largest;
        self.moments.map(|[first, second]| {
            let mean = first / share;
            (second / share - mean * mean).max(0.0).sqrt()
        })
    }

    /// What stands for counts, and what a count of a density means.
    pub fn pseudo_counts(&self, weighing: Weighing) -> (Vec<f64>, f64) {
        let (mass, n) = (self.mass(), self.counts.iter().sum::<f64>());
        let over = |unit: f64| (self.masses.iter().map(|mass| mass / unit).collect(), unit);
        match weighing {
            Weighing::OfAll => over(self.squares.iter().sum::<f64>() / (mass / self.largest) * self.largest),
            Weighing::Mean => over(mass / n),
            Weighing::Number => (self.counts.clone(), 1.0),
            Weighing::OfCell => {
                let share = |mass: &f64| mass / self.largest;
                let count = |(mass, square): (&f64, &f64)| share(mass) * share(mass) / square;
                (self.masses.iter().zip(&self.squares).map(count).collect(), 1.0)
            }
        }
    }
}

/// In place of the cell of a particle that is not inside; there are fewer cells.
const OUTSIDE: u32 = u32::MAX;

/// The cells of particles, axis by axis.
fn places(lattice: &Lattice, low: &[f64], positions: &[&[f64]]) -> Vec<u32> {
    let mut places = vec![0; positions.first().map_or(0, |axis| axis.len())];
    for ((axis, x), low) in lattice.axes().zip(positions).zip(low) {
        let (edge, cells) = (lattice.edge[axis], lattice.cells[axis]);
        let (most, n, last) = (cells as f64, cells as u32, cells as u32 - 1);
        for (cell, x) in places.iter_mut().zip(*x) {
            let place = (x - low) / edge;
            // What is on the upper end is inside.
            let is_inside = place >= 0.0 && place <= most && *cell != OUTSIDE;
            *cell = if is_inside { cell.wrapping_mul(n) + (place as u32).min(last) } else { OUTSIDE };
        }
    }
    places
}

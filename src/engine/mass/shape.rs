//! Where the mass is as a whole: moments, dilution, boxes, budgets.
//!
//! Owns these rows. May use exact sums, grids and the plan. It deliberately disturbs nothing, and its sums do
//! not hang on the order of particles.

use super::super::parallel;
use super::super::snapshot::Row;
use super::flock::Flock;
use super::observe::Scene;
use crate::maths::exact::{MOST_TERMS, Quanta, Sum};
use crate::maths::scalar::{exp, ln};
use crate::plan::Output;
use crate::state::grid::Grid;

/// Axes of the second moments in the order of a row.
pub const PRODUCTS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)];

impl<const D: usize> Scene<'_, D> {
    /// Sums over the particles of a population, group by group; merging must not depend on the order.
    fn fold<T: Send + Sync + Clone>(
        &self,
        population: usize,
        zero: T,
        add: impl Fn(&mut T, f64, [f64; D]) + Sync,
        mut merge: impl FnMut(&mut T, T),
    ) -> T {
        let flocks: Vec<&Flock<D>> =
            self.flocks.iter().filter(|flock| flock.population == population).collect();
        let groups: Vec<&[&Flock<D>]> = flocks.chunks(flocks.len().div_ceil(16).max(1)).collect();
        let units = self.units.row(population);
        let partial = parallel::map(groups.len(), &|group| {
            let mut sum = zero.clone();
            for flock in groups[group] {
                let weights = flock.weights(units);
                (0..flock.len()).for_each(|idx| add(&mut sum, weights(idx), flock.position(idx)));
            }
            sum
        });
        let mut whole = zero;
        partial.into_iter().for_each(|part| merge(&mut whole, part));
        whole
    }

    fn largest(&self) -> f64 {
        self.heaviest
    }

    /// Centre, then central moments around it, both by exact sums.
    ///
    /// - Equation: `X̄ = Σ m x / Σ m`, `S_ij = Σ m (x_i − X̄_i)(x_j − X̄_j) / Σ m`.
    /// - Symbols: `m` mass of a particle, `x` its place.
    /// - Range: any; around a period places are those inside.
    /// - Source: methods, 10.0 item 1.
    /// - Shape: one row.
    pub fn moments(&self, population: Option<usize>) -> Row {
        let mut numbers = vec![f64::NAN; 10];
        let Some(population) = population else {
            numbers[0] = 0.0;
            return Row { place: 0, numbers };
        };
        let amount = self.inside(population);
        numbers[0] = amount;
        if amount <= 0.0 {
            return Row { place: 0, numbers };
        }
        let origin: [f64; D] = std::array::from_fn(|axis| 0.5 * (self.site.low[axis] + self.site.high[axis]));
        let furthest = |whole: &mut [f64; D], part: [f64; D]| {
            whole.iter_mut().zip(part).for_each(|(a, b)| *a = a.max(b));
        };
        let reach = self.fold(
            population,
            [0.0; D],
            |reach, _, x| furthest(reach, std::array::from_fn(|axis| (x[axis] - origin[axis]).abs())),
            furthest,
        );
        let quanta = reach.map(|reach| Quanta::new(self.largest() * reach, MOST_TERMS));
        let firsts = self.fold(
            population,
            [Sum::default(); D],
            |sums, mass, x| {
                for axis in 0..D {
                    quanta[axis].add(&mut sums[axis], mass * (x[axis] - origin[axis]));
                }
            },
            |whole, part| whole.iter_mut().zip(part).for_each(|(sum, part)| sum.merge(part)),
        );
        let mean: [f64; D] = std::array::from_fn(|axis| origin[axis] + firsts[axis].value() / amount);
        let products: Vec<(usize, usize)> = PRODUCTS.into_iter().filter(|&(i, j)| i < D && j < D).collect();
        let quanta: Vec<Quanta> = products
            .iter()
            .map(|&(i, j)| Quanta::new(self.largest() * 4.0 * reach[i] * reach[j], MOST_TERMS))
            .collect();
        let seconds = self.fold(
            population,
            [Sum::default(); 6],
            |sums, mass, x| {
                for (k, &(i, j)) in products.iter().enumerate() {
                    quanta[k].add(&mut sums[k], mass * (x[i] - mean[i]) * (x[j] - mean[j]));
                }
            },
            |whole, part| whole.iter_mut().zip(part).for_each(|(sum, part)| sum.merge(part)),
        );
        let index = |axis: usize| self.site.plan.axes[axis].index;
        (0..D).for_each(|axis| numbers[1 + index(axis)] = mean[axis]);
        for (k, &(i, j)) in products.iter().enumerate() {
            numbers[4 + product(index(i), index(j))] = seconds[k].value() / amount;
        }
        Row { place: 0, numbers }
    }

    /// Dilution index on the bins of an output.
    pub fn dilution(&self, population: Option<usize>, grid: &Grid<D>) -> Row {
        let sums = population.map(|population| self.sums(population, grid));
        let masses: Vec<f64> = sums.map_or_else(Vec::new, |sums| {
            sums[..grid.n_bins()].iter().map(|cell| cell.mass.value()).collect()
        });
        let volume = (0..D).map(|axis| self.site.high[axis] - self.site.low[axis]).product();
        Row { place: 0, numbers: dilution(&masses, grid.n_bins(), volume) }
    }

    /// Mean concentration in a box.
    pub fn in_box(&self, population: Option<usize>, low: &[f64], high: &[f64]) -> Row {
        let low: [f64; D] = std::array::from_fn(|axis| low[axis]);
        let high: [f64; D] = std::array::from_fn(|axis| high[axis]);
        let volume: f64 = (0..D).map(|axis| high[axis] - low[axis]).product();
        let (mass, n) = population.map_or((0.0, 0), |population| {
            let (sum, n) = self.fold(
                population,
                (Sum::default(), 0_u64),
                |(sum, n), mass, x| {
                    if (0..D).all(|axis| x[axis] >= low[axis] && x[axis] < high[axis]) {
                        self.quanta.add(sum, mass);
                        *n += 1;
                    }
                },
                |whole, part| {
                    whole.0.merge(part.0);
                    whole.1 += part.1;
                },
            );
            (sum.value(), n)
        });
        let retardation = population.map_or(1.0, |p| self.site.transport.populations[p].retardation);
        let concentration = mass / (self.site.porosity_in(&low, &high) * retardation * volume);
        Row { place: 0, numbers: vec![concentration, f64::NAN, f64::NAN, n as f64] }
    }

    /// What came and went by each door and reaction, what is there, and what is missing.
    pub fn budget(&self, population: Option<usize>) -> Vec<Row> {
        let n_doors = self.book.n_doors();
        let row = |place: usize, numbers: Vec<f64>| Row { place: place as u16, numbers };
        let mut whole = 0.0;
        let mut rows = Vec::with_capacity(n_doors + 2);
        for door in 0..n_doors {
            let entered = population.map_or(0.0, |population| self.book.entered(population, door));
            let left = population.map_or(0.0, |population| self.book.left(population, door));
            whole += entered - left;
            rows.push(row(door, vec![entered - left, entered, left]));
        }
        let n_reactions = self.book.n_reactions();
        for reaction in 0..n_reactions {
            let (made, taken) = population.map_or((0.0, 0.0), |own| self.book.turned(own, reaction));
            rows.push(row(n_doors + reaction, vec![made - taken, made, taken]));
        }
        whole += population.map_or(0.0, |population| self.book.net(population));
        let inside = population.map_or(0.0, |population| self.inside(population));
        let last = n_doors + n_reactions;
        rows.push(row(last, vec![inside, f64::NAN, f64::NAN]));
        rows.push(row(last + 1, vec![inside - whole, f64::NAN, f64::NAN]));
        rows
    }

    /// The grid of an output's bins.
    pub fn grid(&self, output: &Output) -> Option<Grid<D>> {
        let bins: [usize; D] = output.bins.clone().try_into().ok()?;
        Grid::new(self.site.low, self.site.high, bins, [true; D])
    }
}

/// Place of a product of two axes of the scene among the six.
pub fn product(i: usize, j: usize) -> usize {
    PRODUCTS.iter().position(|&(a, b)| (a, b) == (i.min(j), i.max(j))).unwrap_or(0)
}

/// Dilution index, entropy and reactor ratio of masses in equal bins.
///
/// - Equation: `E = exp(−Σ p ln(p/V))`, `p = m/Σm`.
/// - Symbols: `m` mass and `V` volume of a bin; the ratio is `E` over the whole volume.
/// - Range: bins without mass count nothing; no value without mass.
/// - Source: P. K. Kitanidis (1994), Water Resour. Res. 30, 2011, doi:10.1029/94WR00762.
/// - Shape: three numbers.
pub fn dilution(masses: &[f64], n_bins: usize, volume: f64) -> Vec<f64> {
    let whole: f64 = masses.iter().sum();
    if whole <= 0.0 || n_bins == 0 {
        return vec![f64::NAN; 3];
    }
    let shares = masses.iter().map(|mass| mass / whole).filter(|&share| share > 0.0);
    let entropy = -shares.map(|share| share * ln(share)).sum::<f64>();
    let index = exp(entropy) * volume / n_bins as f64;
    vec![index, entropy, index / volume]
}

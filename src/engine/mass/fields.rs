//! Concentrations by kernels, as outputs see them.
//!
//! Owns means of cells over the bins of an output, and the rows of densities and kernels. May use kernels, grids and the plan.
//! It deliberately keeps nothing: an output finds kernels of its own.

use super::super::density::Cell;
use super::super::error::RunError;
use super::super::snapshot::Row;
use super::flock::Flock;
use super::kernels::{Finder, Found};
use super::observe::Scene;
use crate::plan::Axis;
use crate::state::grid::Grid;

/// Values on the bins of an output, or on cells: mean and standard error, concentrations.
pub struct Binned {
    pub mean: Vec<f64>,
    pub standard_error: Vec<f64>,
}

impl<const D: usize> Scene<'_, D> {
    pub fn has_kernels_in_bins(&self) -> bool {
        self.site.plan.kernels.as_ref().is_some_and(|kernels| kernels.shows)
    }

    fn find(&self, population: usize) -> Result<&(Finder, Found), RunError> {
        let find = || {
            let finder = Finder::new(self.site, population, self.width)?.shown(self.site, population, self.t);
            let flocks: Vec<&Flock<D>> =
                self.flocks.iter().filter(|flock| flock.population == population).collect();
            let found = finder.find(&flocks, self.units.row(population), None)?;
            Ok((finder, found))
        };
        self.kernels[population].get_or_init(find).as_ref().map_err(Clone::clone)
    }

    /// Concentrations of a population in bins, by kernels on cells.
    ///
    /// - Equation: `c = ∫ ρ dx / (φ R V)` over a bin of volume `V`; its standard error is the mean of that of its cells.
    /// - Symbols: `ρ` density, even in each cell; `φ` porosity of the bin, `R` retardation.
    /// - Range: bins of any size; neighbouring cells share their kernels, so that errors do not average out.
    /// - Source: methods, section 0.
    /// - Shape: one value per bin.
    pub fn kernels_in_bins(
        &self,
        population: usize,
        grid: &Grid<D>,
        porosity: &[f64],
    ) -> Result<Binned, RunError> {
        let (finder, found) = self.find(population)?;
        let retardation = self.site.transport.populations[population].retardation;
        let cells: [usize; D] =
            std::array::from_fn(|axis| finder.lattice.cells[finder.lattice.axes().start + axis]);
        let onto = |values: &[f64]| -> Vec<f64> {
            let means = means(values, cells, grid.bins());
            means.iter().zip(porosity).map(|(mean, porosity)| mean / (porosity * retardation)).collect()
        };
        Ok(Binned { mean: onto(&found.density), standard_error: onto(&found.standard_error) })
    }

    /// A row for each cell with some density.
    pub fn density(&self, population: Option<usize>) -> Result<Vec<Row>, RunError> {
        let Some(population) = population else { return Ok(Vec::new()) };
        let (finder, found) = self.find(population)?;
        let Some(grid) = finder.grid() else { return Ok(Vec::new()) };
        let mut water = self.site.porosity_of_bins(&grid);
        let retardation = self.site.transport.populations[population].retardation;
        water.iter_mut().for_each(|water| *water *= retardation);
        let per_water =
            |all: &[f64]| -> Vec<f64> { all.iter().zip(&water).map(|(own, water)| own / water).collect() };
        let (mean, standard_error) = (per_water(&found.density), per_water(&found.standard_error));
        Ok(found.rows(&self.site.plan.axes, &grid, &Binned { mean, standard_error }))
    }

    /// How wide the kernels of a population are.
    pub fn kernel_sizes(&self, population: Option<usize>) -> Result<Vec<Row>, RunError> {
        let found = population.map(|population| self.find(population)).transpose()?;
        Ok(vec![Found::size_row(found.map(|(_, found)| found))])
    }
}

impl Finder {
    /// The cells of the lattice as bins.
    pub fn grid<const D: usize>(&self) -> Option<Grid<D>> {
        let first = self.lattice.axes().start;
        let bins: [usize; D] = std::array::from_fn(|axis| self.lattice.cells[first + axis]);
        let low: [f64; D] = self.low[..].try_into().ok()?;
        let high =
            std::array::from_fn(|axis| low[axis] + bins[axis] as f64 * self.lattice.edge[first + axis]);
        Grid::new(low, high, bins, [false; D])
    }
}

impl Found {
    /// A row for each cell with some density, and its concentration.
    pub fn rows<const D: usize>(&self, axes: &[Axis], grid: &Grid<D>, concentrations: &Binned) -> Vec<Row> {
        let first = self.projection.lattice().axes().start;
        let mut known = self.tally.cells.iter().zip(&self.tally.counts).enumerate().peekable();
        let mut rows = Vec::new();
        for (cell, &density) in self.density.iter().enumerate().filter(|(_, density)| **density > 0.0) {
            while known.next_if(|(_, (own, _))| (**own as usize) < cell).is_some() {}
            let here = known.next_if(|(_, (own, _))| **own as usize == cell);
            let mut numbers = vec![f64::NAN; 11];
            let Binned { mean, standard_error } = concentrations;
            numbers[..3].copy_from_slice(&[mean[cell], standard_error[cell], density]);
            let centre = grid.centre(cell);
            for (rank, axis) in axes.iter().enumerate() {
                numbers[3 + axis.index] = centre[rank];
                let own = here.and_then(|(idx, _)| self.cells.get(idx));
                let along = |own: &Cell| own.matrix()[first + rank][first + rank].sqrt();
                let h = own.map_or(self.one[first + rank], along);
                numbers[6 + axis.index] = if h > 0.0 { h } else { f64::NAN };
            }
            if let Some((idx, (_, count))) = here {
                numbers[9] = self.cells.get(idx).map_or(f64::NAN, |own| own.sigma);
                numbers[10] = *count;
            } else {
                numbers[10] = 0.0;
                if !self.cells.is_empty() {
                    numbers[6..9].fill(f64::NAN);
                }
            }
            rows.push(Row { place: 0, numbers });
        }
        rows
    }

    /// How wide kernels are; of nothing, where there are none.
    pub fn size_row(found: Option<&Self>) -> Row {
        let mut numbers = vec![f64::NAN, f64::NAN, f64::NAN, f64::NAN, 0.0, 0.0, 0.0];
        let Some(found) = found else { return Row { place: 0, numbers } };
        let axes = found.projection.lattice().axes();
        let mut sizes: Vec<(f64, f64)> = Vec::new();
        let mut stretches: Vec<(f64, f64)> = Vec::new();
        for (cell, count) in found.cells.iter().zip(&found.tally.counts).filter(|(cell, _)| cell.h > 0.0) {
            let along = axes.clone().map(|axis| cell.s[axis]).filter(|s| *s > 0.0);
            let (low, high) =
                along.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), s| (low.min(s), high.max(s)));
            sizes.push((cell.h, *count));
            stretches.push((high / low, *count));
        }
        if found.cells.is_empty() && found.one[axes.start] > 0.0 && !found.tally.cells.is_empty() {
            let own: Vec<f64> = axes.map(|axis| found.one[axis]).filter(|h| *h > 0.0).collect();
            let mean = crate::maths::vector::pow(own.iter().product(), 1.0 / own.len() as f64);
            let (low, high) =
                own.iter().fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), &h| (a.min(h), b.max(h)));
            sizes.push((mean, 1.0));
            stretches.push((high / low, 1.0));
        }
        for (number, part) in [(0, 0.5), (1, 0.05), (2, 0.95)] {
            numbers[number] = quantile(&mut sizes, part);
        }
        numbers[3] = quantile(&mut stretches, 0.5);
        numbers[4] = found.tally.effective();
        numbers[5] = found.tally.counts.iter().sum();
        numbers[6] = found.n_loops as f64;
        Row { place: 0, numbers }
    }
}

/// The value that a part of all weights lies below; none without values.
fn quantile(values: &mut [(f64, f64)], part: f64) -> f64 {
    values.sort_unstable_by(|one, other| one.0.total_cmp(&other.0));
    let whole: f64 = values.iter().map(|(_, weight)| weight).sum();
    let mut before = 0.0;
    for &(value, weight) in values.iter() {
        before += weight;
        if before >= part * whole {
            return value;
        }
    }
    f64::NAN
}

/// Means over bins of values that are even in cells, both equal parts of one domain.
fn means<const D: usize>(values: &[f64], cells: [usize; D], bins: [usize; D]) -> Vec<f64> {
    let mut shape = cells;
    let mut all = values.to_vec();
    for axis in 0..D {
        let (n, m) = (shape[axis], bins[axis]);
        let inner: usize = shape[axis + 1..].iter().product();
        let outer: usize = shape[..axis].iter().product();
        let mut next = vec![0.0; outer * m * inner];
        for bin in 0..m {
            // In cells; a bin is so many of them long.
            let (from, to) = (bin as f64 * n as f64 / m as f64, (bin + 1) as f64 * n as f64 / m as f64);
            for cell in from as usize..(to.ceil() as usize).min(n) {
                let part = (to.min(cell as f64 + 1.0) - from.max(cell as f64)) / (to - from);
                if part <= 0.0 {
                    continue;
                }
                for block in 0..outer {
                    let source = &all[(block * n + cell) * inner..][..inner];
                    let target = &mut next[(block * m + bin) * inner..][..inner];
                    target.iter_mut().zip(source).for_each(|(sum, value)| *sum += part * value);
                }
            }
        }
        shape[axis] = m;
        all = next;
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_keep_what_there_is() {
        let values: Vec<f64> = (0..35).map(|k| f64::from(k * k % 13)).collect();
        for bins in [[5, 7], [10, 14], [3, 4], [1, 1], [7, 3]] {
            let found = means(&values, [5, 7], bins);
            let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
            assert!((mean(&found) - mean(&values)).abs() < 1e-14, "{bins:?}");
        }
        assert_eq!(means(&values, [5, 7], [5, 7]), values);
        let found = means(&[1.0, 2.0, 4.0], [3], [2]);
        assert!(found.iter().zip([4.0 / 3.0, 10.0 / 3.0]).all(|(a, b)| (a - b).abs() < 1e-14), "{found:?}");
    }
}

//! What outputs see of particles that carry mass.
//!
//! Owns the sums over flocks. May use exact sums, grids and the plan. It deliberately disturbs nothing, and
//! its sums do not hang on the order of particles.

use super::super::error::RunError;
use super::super::parallel;
use super::super::program::unsound;
use super::super::snapshot::{Row, Snapshot, Values};
use super::book::Book;
use super::fields::Binned;
use super::flock::{self, Flock};
use super::gate;
use super::kernels::{Finder, Found};
use super::total::Total;
use super::units::Units;
use super::world::Site;
use crate::maths::exact::{MOST_TERMS, Quanta, Sum};
use crate::maths::wide::Width;
use crate::plan::{Output, OutputKind, Station};
use crate::state::grid::Grid;
use crate::state::particles::CHUNK;
use std::sync::OnceLock;

/// What is looked at.
pub struct Scene<'a, const D: usize> {
    pub site: &'a Site<'a, D>,
    pub flocks: &'a [Flock<D>],
    pub units: &'a Units,
    /// Mass that no particle exceeds, and sums of such.
    pub heaviest: f64,
    pub quanta: Quanta,
    pub book: &'a Book,
    pub width: Width,
    /// s
    pub t: f64,
    /// What reactions have made and no particle carries yet, by population.
    pub pending: Vec<f64>,
    /// Kernels of each population, found when an output first asks: several outputs of one time share them.
    pub kernels: Vec<OnceLock<Result<(Finder, Found), RunError>>>,
}

impl<const D: usize> Scene<'_, D> {
    pub fn observe(&self, output_idx: usize, t: f64) -> Result<Snapshot, RunError> {
        let output = &self.site.plan.outputs[output_idx];
        let values = match output.kind {
            OutputKind::Profile | OutputKind::Map => self.binned(output)?,
            OutputKind::Total => Values::Total { amount: self.totals(output) },
            OutputKind::Particles => self.particles(output),
            OutputKind::Moments => self.rows(output, |population| vec![self.moments(population)]),
            OutputKind::Budget => self.rows(output, |population| self.budget(population)),
            OutputKind::Dilution => {
                let grid = self.grid(output).ok_or_else(|| unsound("bins that do not make a grid"))?;
                self.rows(output, |population| vec![self.dilution(population, &grid)])
            }
            OutputKind::Breakthrough | OutputKind::FirstPassage => match &output.station {
                Some(Station::Box { low, high }) if output.kind == OutputKind::Breakthrough => {
                    self.rows(output, |population| vec![self.in_box(population, low, high)])
                }
                _ => return Err(unsound("a place that nobody counts at")),
            },
            OutputKind::Density => self.rows_of(output, |population| self.density(population))?,
            OutputKind::Kernels => self.rows_of(output, |population| self.kernel_sizes(population))?,
            OutputKind::Covariance | OutputKind::Mixing => {
                return Err(unsound("an output of fluid in a run of masses"));
            }
        };
        Ok(Snapshot { output_idx, t, values })
    }

    /// The populations of an output's species, in its order; nothing is carried by some.
    fn populations(&self, output: &Output) -> Vec<Option<usize>> {
        gate::populations(self.site.plan, output)
    }

    fn rows(&self, output: &Output, rows: impl Fn(Option<usize>) -> Vec<Row>) -> Values {
        Values::Rows(self.populations(output).into_iter().map(rows).collect())
    }

    fn rows_of(
        &self,
        output: &Output,
        rows: impl Fn(Option<usize>) -> Result<Vec<Row>, RunError>,
    ) -> Result<Values, RunError> {
        Ok(Values::Rows(self.populations(output).into_iter().map(rows).collect::<Result<_, _>>()?))
    }

    fn binned(&self, output: &Output) -> Result<Values, RunError> {
        let grid = self.grid(output).ok_or_else(|| unsound("an output whose bins do not make a grid"))?;
        let bins = grid.bins();
        let porosity = self.site.porosity_of_bins(&grid);
        let volume: f64 =
            (0..D).map(|axis| (self.site.high[axis] - self.site.low[axis]) / bins[axis] as f64).product();
        let mut mean = Vec::new();
        let mut standard_error = Vec::new();
        let mut n_particles = Vec::new();
        for population in self.populations(output) {
            let sums =
                population.map_or_else(|| vec![Cell::default(); grid.n_slots()], |p| self.sums(p, &grid));
            let retardation = population.map_or(1.0, |p| self.site.transport.populations[p].retardation);
            let per = |bin: usize| 1.0 / (porosity[bin] * retardation * volume);
            n_particles.extend(sums[..grid.n_bins()].iter().map(|cell| cell.n));
            if let (Some(population), true) = (population, self.has_kernels_in_bins()) {
                let Binned { mean: own, standard_error: error } =
                    self.kernels_in_bins(population, &grid, &porosity)?;
                mean.push(own);
                standard_error.push(error);
                continue;
            }
            mean.push((0..grid.n_bins()).map(|bin| sums[bin].mass.value() * per(bin)).collect());
            standard_error
                .push((0..grid.n_bins()).map(|bin| sums[bin].square.value().sqrt() * per(bin)).collect());
        }
        Ok(Values::Binned { mean, standard_error, n_particles })
    }

    /// Mass, squared mass and number of a population per slot of a grid.
    pub(super) fn sums(&self, population: usize, grid: &Grid<D>) -> Vec<Cell> {
        let flocks: Vec<&Flock<D>> =
            self.flocks.iter().filter(|flock| flock.population == population).collect();
        let n_groups = flocks.len().clamp(1, 16);
        let per_group = flocks.len().div_ceil(n_groups).max(1);
        let groups: Vec<&[&Flock<D>]> = flocks.chunks(per_group).collect();
        let largest = self.heaviest;
        let square = Quanta::new(largest * largest, MOST_TERMS);
        let units = self.units.row(population);
        let partial = parallel::map(groups.len(), &|group| {
            let mut cells = vec![Cell::default(); grid.n_slots()];
            let mut slots = [0_i32; CHUNK];
            for flock in groups[group] {
                for first in (0..flock.len()).step_by(CHUNK) {
                    let range = first..(first + CHUNK).min(flock.len());
                    let positions = flock.positions.each_ref().map(|axis| &axis[range.clone()]);
                    grid.locate(positions, &mut slots[..range.len()]);
                    let weights = flock.weights(units);
                    for (slot, idx) in slots.iter().zip(range) {
                        let mass = weights(idx);
                        let cell = &mut cells[*slot as usize];
                        self.quanta.add(&mut cell.mass, mass);
                        square.add(&mut cell.square, mass * mass);
                        cell.n += 1;
                    }
                }
            }
            cells
        });
        let mut whole = vec![Cell::default(); grid.n_slots()];
        for cells in partial {
            for (sum, part) in whole.iter_mut().zip(cells) {
                sum.mass.merge(part.mass);
                sum.square.merge(part.square);
                sum.n += part.n;
            }
        }
        whole
    }

    fn totals(&self, output: &Output) -> Vec<f64> {
        self.populations(output).into_iter().map(|p| p.map_or(0.0, |p| self.inside(p))).collect()
    }

    /// Mass of a population that is there.
    pub fn inside(&self, population: usize) -> f64 {
        if let Some(pending) = self.pending.get(population) {
            let own = self.flocks.iter().filter(|flock| flock.population == population);
            return Total::of(own.flat_map(|flock| flock.masses.iter().copied()).chain([*pending]));
        }
        let mut counts = vec![0_u64; self.units.n_origins()];
        for flock in self.flocks.iter().filter(|flock| flock.population == population) {
            flock.ids.iter().for_each(|&id| counts[flock::origin(id)] += 1);
        }
        self.units.sum(population, counts.iter().map(|&n| n as f64))
    }

    /// Positions in the order of numbers; the mass stands in the column of the particle's species.
    fn particles(&self, output: &Output) -> Values {
        let populations = self.populations(output);
        let mut list: Vec<(u64, usize, usize)> = Vec::new();
        for (flock_idx, flock) in self.flocks.iter().enumerate() {
            if populations.contains(&Some(flock.population)) {
                list.extend(flock.ids.iter().enumerate().map(|(idx, &id)| (id, flock_idx, idx)));
            }
        }
        list.sort_unstable();
        let positions = (0..D)
            .map(|axis| list.iter().map(|&(_, flock, idx)| self.flocks[flock].positions[axis][idx]).collect())
            .collect();
        let column = |population: &Option<usize>| {
            list.iter()
                .map(|&(id, flock, idx)| {
                    let flock = &self.flocks[flock];
                    let own = flock.masses.get(idx).copied();
                    let mass = || own.unwrap_or_else(|| self.units.of(flock.population, id));
                    if Some(flock.population) == *population { mass() } else { 0.0 }
                })
                .collect()
        };
        Values::Particles { positions, concentrations: populations.iter().map(column).collect() }
    }
}

/// Sums of a bin.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cell {
    pub mass: Sum,
    square: Sum,
    n: u64,
}

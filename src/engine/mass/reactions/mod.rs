//! Reactions of particles that carry mass, by what their kernels have of cells.
//!
//! Owns the order of work of a step: concentrations, chemistry in cells, and what particles have of it. May use kernels,
//! `chemistry` and the books. It deliberately moves no particle.
//!
//! Concentrations in cells are those of the kernels; what reacts there is taken of particles by the same kernels, transposed.
//! So what one species loses is what chemistry says to the last digits, and what another one gains with it.

mod cells;
mod census;
mod make;
mod merge;
mod near;
mod noise;
mod pairing;
mod pairs;

use super::super::density::Projection;
use super::super::error::RunError;
use super::super::program::unsound;
use super::book::Book;
use super::flock::Flock;
use super::kernels::{Finder, Found};
use super::place::Place;
use super::release::{Kind, Release, Sampling};
use super::total::Total;
use super::units::Units;
use super::world::Site;
use crate::maths::exact::Quanta;
use crate::maths::wide::Width;
use crate::plan::Plan;
use crate::plan::chemistry::Splitting;
use crate::plan::kernels::{Manner, Reacting};
use crate::state::grid::Grid;
use crate::state::stream::{Purpose, Stream};
use cells::{Content, Vessel};
use census::{Census, OUTSIDE};
use make::{Gains, Maker};
use pairs::Meetings;
use std::sync::Arc;

/// Relative change of the effective number of particles with which kernels are found again.
const CHANGED: f64 = 0.05;
/// How much longer kernels serve of what does not move.
const RESTING: u64 = 10;
/// Growth of a cell's content in a step up to which particles that are there grow; what is more is made anew.
const MOST_GROWTH: f64 = 2.0;
/// Masses may grow to so much of all that is there.
const MARGIN: f64 = 1024.0;
/// Terms of sums of masses.
const TERMS: u64 = 1 << 27;

/// When a reaction is: the step, and its number among all.
#[derive(Debug, Clone, Copy)]
pub struct Turn {
    pub turn: u64,
    pub step: u64,
}

/// Variances of a step's displacements along axes, by population, place and time, m².
pub type Variances<'a, const D: usize> = &'a (dyn Fn(usize, [f64; D], f64) -> [f64; D] + Sync);

/// What flocks, units and books a step works on.
pub type Stock<'a, const D: usize> = (&'a mut Vec<Flock<D>>, &'a Units, &'a mut Book);

/// The reactions of a run.
#[derive(Debug, Clone)]
pub struct Reactions<const D: usize> {
    low: [f64; D],
    /// Water of each cell, m^d.
    water: Vec<f64>,
    places: [Vec<f64>; 3],
    populations: Vec<Own>,
    makers: Vec<Maker>,
    vessel: Vessel,
    /// Where pairs meet.
    meetings: Option<Arc<Meetings>>,
    is_collocation: bool,
    quanta: Quanta,
    stream: Stream,
    refresh: u64,
    of_cell: Vec<f64>,
    pub is_symmetric: bool,
}

/// One population.
#[derive(Debug, Clone)]
struct Own {
    species: usize,
    retardation: f64,
    is_mobile: bool,
    /// Whether reactions change it, or their rates hang on it.
    takes_part: bool,
    /// Whether nothing of it is made where there is none.
    grows: bool,
    finder: Finder,
    kernels: Option<Kept>,
}

/// Kernels that were found, when, and for how many particles.
#[derive(Debug, Clone)]
struct Kept {
    projection: Projection,
    step: u64,
    effective: f64,
    /// Mean bandwidth, m.
    mean: Option<f64>,
}

/// What cells have before and after: by population the mass that kernels give them.
struct Fields {
    spread: Vec<Vec<f64>>,
    content: Content,
}

impl<const D: usize> Reactions<D> {
    /// As the plan says; nothing if particles do not react so. Adds what makes particles to the releases.
    pub fn new(
        site: &Site<D>,
        releases: &mut Vec<Release<D>>,
        width: Width,
    ) -> Result<Option<Self>, RunError> {
        let plan = site.plan;
        let Some(kernels) = plan.kernels.as_ref().filter(|kernels| kernels.reacting.is_some()) else {
            return Ok(None);
        };
        let bins: [usize; D] =
            kernels.cells.clone().try_into().map_err(|_| unsound("cells that do not fit the axes"))?;
        let grid =
            Grid::new(site.low, site.high, bins, [false; D]).ok_or_else(|| unsound("cells that are none"))?;
        let volume: f64 = (0..D).map(|axis| (site.high[axis] - site.low[axis]) / bins[axis] as f64).product();
        let water = site.porosity_of_bins(&grid).into_iter().map(|porosity| porosity * volume).collect();
        let n_cells = grid.n_bins();
        let mut places = [const { Vec::new() }; 3];
        for (rank, axis) in plan.axes.iter().enumerate() {
            places[axis.index] = (0..n_cells).map(|cell| grid.centre(cell)[rank]).collect();
        }
        let populations = 0..site.transport.populations.len();
        let populations = populations.map(|idx| own(site, idx, width)).collect::<Result<Vec<_>, _>>()?;
        let makers = makers(site, releases);
        let whole: f64 = releases.iter().map(|release| release.unit * release.expected()).sum();
        Ok(Some(Self {
            low: site.low,
            water,
            places,
            populations,
            makers,
            vessel: Vessel::new(plan, n_cells)?,
            meetings: match kernels.reacting {
                Some(Reacting::Pairs) => {
                    Some(Arc::new(Meetings::new(plan).ok_or_else(|| unsound("reactions of no pairs"))?))
                }
                _ => None,
            },
            is_collocation: kernels.manner == Manner::Collocation,
            quanta: Quanta::new(MARGIN * whole.max(f64::MIN_POSITIVE), TERMS),
            stream: Stream::new(plan.seed, Purpose::React),
            refresh: kernels.refresh,
            of_cell: vec![0.0; n_cells],
            is_symmetric: plan.chemistry.as_ref().is_some_and(|it| it.splitting == Splitting::Strang),
        }))
    }

    pub fn quanta(&self) -> Quanta {
        self.quanta
    }

    /// What was made and is no particle yet, by population.
    pub fn pending(&self) -> Vec<f64> {
        self.makers.iter().map(|maker| maker.pending).collect()
    }

    /// Reactions of a step, where particles are now. `variances` are those of displacements in a time, by population and place.
    pub fn react(
        &mut self,
        site: &Site<D>,
        variances: Variances<D>,
        (flocks, units, book): Stock<D>,
        (when, t, dt): (Turn, f64, f64),
    ) -> Result<(), RunError> {
        if let Some(meetings) = self.meetings.clone() {
            return self.meet(site, (&meetings, variances), (flocks, units, book), (when, t, dt));
        }
        let census = self.count(flocks);
        let spread = self.spread(flocks, units, &census, when.step)?;
        let mut fields = Fields { content: self.content(&spread, &census), spread };
        let before = fields.content.columns.clone();
        self.vessel.react(site.plan, (&mut fields.content, &before), (when.step + 1, t, dt))?;
        for (idx, census) in census.iter().enumerate() {
            let changes = self.changes(idx, &fields, &before);
            let Some((loss, gains)) = changes else { continue };
            self.settle(idx, census, (loss, gains), (flocks, book), when.turn)?;
        }
        Ok(())
    }

    fn count(&mut self, flocks: &[Flock<D>]) -> Vec<Census> {
        let has_squares = self.vessel.noise.is_some() && self.meetings.is_none();
        let mut all = Vec::with_capacity(self.populations.len());
        for (idx, own) in self.populations.iter().enumerate() {
            let flocks: Vec<&Flock<D>> = if own.takes_part { of(flocks, idx).collect() } else { Vec::new() };
            all.push(Census::of(&flocks, (&own.finder.lattice, &self.low), (&mut self.of_cell, has_squares)));
        }
        all
    }

    /// Mass that the kernels of each population give cells.
    fn spread(
        &mut self,
        flocks: &[Flock<D>],
        units: &Units,
        census: &[Census],
        step: u64,
    ) -> Result<Vec<Vec<f64>>, RunError> {
        let mut all = Vec::with_capacity(self.populations.len());
        for (idx, (own, census)) in self.populations.iter_mut().zip(census).enumerate() {
            if census.cells.is_empty() {
                all.push(Vec::new());
                continue;
            }
            let effective = census.effective();
            // What rests changes by its masses alone.
            let refresh = if own.is_mobile { self.refresh } else { RESTING.saturating_mul(self.refresh) };
            let is_old = own.kernels.as_ref().is_none_or(|kept| {
                step >= kept.step.saturating_add(refresh)
                    || (effective / kept.effective - 1.0).abs() > CHANGED
            });
            if is_old {
                let flocks: Vec<&Flock<D>> = of(flocks, idx).collect();
                let start = own.kernels.as_ref().and_then(|kept| kept.mean);
                let Found { projection, cells, .. } = own.finder.find(&flocks, units.row(idx), start)?;
                let mean = cells.iter().map(|cell| cell.h).sum::<f64>() / cells.len() as f64;
                let mean = Some(mean).filter(|mean| *mean > 0.0);
                own.kernels = Some(Kept { projection, step, effective, mean });
            }
            let Some(kept) = &own.kernels else { continue };
            all.push(kept.projection.spread(&census.cells, &census.masses));
        }
        Ok(all)
    }

    /// What the water holds, dissolved and sorbed, where there is anything.
    fn content(&self, spread: &[Vec<f64>], census: &[Census]) -> Content {
        let is_there = |cell: usize| spread.iter().any(|own| own.get(cell).is_some_and(|m| *m > 0.0));
        let is_in = |cell: &usize| self.vessel.makes_of_nothing || is_there(*cell);
        let cells: Vec<u32> = (0..self.water.len()).filter(is_in).map(|cell| cell as u32).collect();
        let along = |axis: &Vec<f64>| match axis.is_empty() {
            true => Vec::new(),
            false => cells.iter().map(|&cell| axis[cell as usize]).collect(),
        };
        let places = self.places.each_ref().map(along);
        let mut columns = vec![vec![0.0; cells.len()]; self.populations.len()];
        for (own, spread) in self.populations.iter().zip(spread).filter(|(_, spread)| !spread.is_empty()) {
            for (c, &cell) in columns[own.species].iter_mut().zip(&cells) {
                let cell = cell as usize;
                *c = (spread[cell] / self.water[cell]).max(0.0);
            }
        }
        let variances = self.variances(&cells, census);
        Content { cells, places, columns, variances }
    }

    /// Squared standard errors of concentrations in some cells, if a law is bent; by species.
    fn variances(&self, cells: &[u32], census: &[Census]) -> Vec<Vec<f64>> {
        if self.vessel.noise.is_none() {
            return Vec::new();
        }
        let mut all = vec![Vec::new(); self.populations.len()];
        for (own, census) in self.populations.iter().zip(census).filter(|(_, it)| !it.cells.is_empty()) {
            let Some(kept) = &own.kernels else { continue };
            let squares = kept.projection.spread_squares(&census.cells, &census.squares);
            let per = |cell: usize| 1.0 / self.water[cell];
            let variance = |&cell: &u32| {
                let cell = cell as usize;
                squares[cell].max(0.0) * per(cell) * per(cell)
            };
            all[own.species] = cells.iter().map(variance).collect();
        }
        all
    }

    /// What a population loses, as parts of what is in each cell of the lattice, and what is made of it; nothing if it does not
    /// change.
    fn changes(&self, idx: usize, fields: &Fields, before: &[Vec<f64>]) -> Option<(Vec<f64>, Gains)> {
        let own = &self.populations[idx];
        let (old, new) = (&before[own.species], &fields.content.columns[own.species]);
        if !own.takes_part || old == new {
            return None;
        }
        let mut loss = vec![0.0; self.water.len()];
        let mut gains = Gains::default();
        for ((&cell, &old), &new) in fields.content.cells.iter().zip(old).zip(new) {
            let grows = own.grows && old > 0.0 && new <= MOST_GROWTH * old;
            if new < old || (grows && new > old) {
                loss[cell as usize] = new / old - 1.0;
            } else if new > old {
                gains.cells.push(cell);
                gains.masses.push((new - old) * self.water[cell as usize]);
            }
        }
        // A column of no mass has no kernel to lose by.
        if fields.spread[idx].is_empty() {
            loss.clear();
        }
        Some((loss, gains))
    }

    /// Takes and gives particles of a population what cells have lost and gained.
    fn settle(
        &mut self,
        idx: usize,
        census: &Census,
        (loss, gains): (Vec<f64>, Gains),
        (flocks, book): (&mut Vec<Flock<D>>, &mut Book),
        turn: u64,
    ) -> Result<(), RunError> {
        let own = &self.populations[idx];
        let (mut made, mut taken) = (Total::default(), Total::default());
        let mut inside = census.moments[0];
        let maker = &mut self.makers[idx];
        if let (Some(kept), false) = (&own.kernels, loss.is_empty()) {
            let found = kept.projection.gather(&census.cells, loss);
            census.cells.iter().zip(&found).for_each(|(&cell, part)| self.of_cell[cell as usize] = *part);
            let mut flocks: Vec<&mut Flock<D>> =
                flocks.iter_mut().filter(|flock| flock.population == idx).collect();
            for (flock, places) in flocks.iter_mut().zip(&census.places) {
                for (mass, &cell) in flock.masses.iter_mut().zip(places).filter(|(_, cell)| **cell != OUTSIDE)
                {
                    let new = (*mass * (1.0 + self.of_cell[cell as usize])).max(0.0);
                    (if new > *mass { &mut made } else { &mut taken }).add((new - *mass).abs());
                    *mass = new;
                }
            }
            census.cells.iter().for_each(|&cell| self.of_cell[cell as usize] = 0.0);
            let unit = light_unit(maker.unit, &flocks);
            taken.add(merge::merge(&mut flocks, &census.places, unit, (&self.stream, turn)));
            inside += made.value() - taken.value();
        }
        gains.masses.iter().for_each(|mass| made.add(*mass));
        let (made, taken) = (made.value(), taken.value());
        if !(made.is_finite() && taken.is_finite()) {
            return Err(unsound("masses that are no numbers"));
        }
        maker.make(&gains, inside, (&own.finder.lattice, &self.low), (&self.stream, turn), flocks);
        book.react(idx, made, taken);
        Ok(())
    }
}

/// What particles weigh against which they are light: their unit, or their mean if all have become lighter.
fn light_unit<const D: usize>(unit: f64, flocks: &[&mut Flock<D>]) -> f64 {
    let n: usize = flocks.iter().map(|flock| flock.len()).sum();
    let mass: f64 = flocks.iter().flat_map(|flock| &flock.masses).sum();
    if n > 0 { unit.min(mass / n as f64) } else { unit }
}

fn of<const D: usize>(flocks: &[Flock<D>], population: usize) -> impl Iterator<Item = &Flock<D>> {
    flocks.iter().filter(move |flock| flock.population == population)
}

fn own<const D: usize>(site: &Site<D>, idx: usize, width: Width) -> Result<Own, RunError> {
    let population = &site.transport.populations[idx];
    let plan: &Plan = site.plan;
    Ok(Own {
        species: population.species,
        retardation: population.retardation,
        is_mobile: population.is_mobile,
        takes_part: plan.takes_part(population.species),
        grows: plan.grows_by_itself(population.species),
        finder: Finder::new(site, idx, width)?,
        kernels: None,
    })
}

/// What makes particles of each population, with a release of its own that gives nothing by itself.
fn makers<const D: usize>(site: &Site<D>, releases: &mut Vec<Release<D>>) -> Vec<Maker> {
    let mut makers = Vec::new();
    // Where nothing tells, a particle weighs what others do.
    let numbers = releases.iter().map(|release| (release.unit * release.expected(), release.expected()));
    let (mass, n) = numbers.fold((0.0, 0.0), |(mass, n), own| (mass + own.0, n + own.1));
    let usual = if n > 0.0 { mass / n } else { 0.0 };
    for (population, own) in site.transport.populations.iter().enumerate() {
        let of_own = || releases.iter().filter(|release| release.population == population);
        let own_mass: f64 = of_own().map(|release| release.unit * release.expected()).sum();
        let of_others = of_own().map(|release| release.unit).fold(0.0, f64::max);
        let known = own.made.map_or(of_others, |made| made.max(of_others));
        let unit = if known > 0.0 { known } else { usual };
        let origin = releases.len();
        let (from, to) = (f64::INFINITY, f64::INFINITY);
        let kind = Kind::Steady { n: 0, from, to, sampling: Sampling::Random };
        releases.push(Release { door: 0, origin, population, unit, place: Place::Point(site.low), kind });
        // Where all species share one number, its own says how much of it there is at first, and not how much can be made.
        let is_of_all = own.made.is_some() && unit * (own.count as f64 - 1.5) <= own_mass;
        let count = (own.count as f64).max(if is_of_all { mass / unit } else { 0.0 });
        makers.push(Maker { population, origin, unit, count, n_made: 0, pending: 0.0 });
    }
    makers
}

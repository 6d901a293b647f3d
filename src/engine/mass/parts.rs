//! Mass by where it comes from, and how it is cut into particles.
//!
//! Owns the list of everything that gives mass, and the size of a population's particles. May use the plan and
//! `track`. It deliberately works out no mass: `initial`, `sources` and `inlets` do.

use super::super::error::RunError;
use super::super::program::unsound;
use super::super::track::medium::Medium;
use super::super::track::tracker::Tracker;
use super::entry::Entry;
use super::place::Place;
use super::release::{Kind, Release, Sampling};
use super::world::Site;

/// Mass from one place, before it is cut into particles.
pub struct Part<const D: usize> {
    pub door: usize,
    pub mass: f64,
    pub place: Place<D>,
    pub shape: Shape<D>,
}

pub enum Shape<const D: usize> {
    Steady {
        from: f64,
        to: f64,
        sampling: Sampling,
    },
    /// Mass per step.
    Held {
        per_step: f64,
        entry: Entry,
        axis: usize,
        sign: f64,
    },
    /// Mass of the full box.
    Filled {
        fill: f64,
        low: [f64; D],
        high: [f64; D],
        from: f64,
        to: f64,
    },
}

impl<const D: usize> Part<D> {
    /// Cuts the mass into particles of about `unit`; these add up to the mass exactly.
    fn release(self, origin: usize, population: usize, unit: f64) -> Release<D> {
        let n = (self.mass / unit).round().max(1.0);
        let (unit, kind) = match self.shape {
            Shape::Steady { from, to, sampling } => {
                (self.mass / n, Kind::Steady { n: n as u64, from, to, sampling })
            }
            Shape::Held { per_step, entry, axis, sign } => (
                unit,
                Kind::Held { per_step: per_step / unit, entry, axis, sign, from: 0.0, to: f64::INFINITY },
            ),
            Shape::Filled { fill, low, high, from, to } => {
                let n = (fill / unit).round().max(1.0);
                (fill / n, Kind::Filled { n: n as u64, low, high, from, to })
            }
        };
        Release { door: self.door, origin, population, unit, place: self.place, kind }
    }
}

impl<const D: usize> Site<'_, D> {
    /// Everything that gives mass, with the units that a population's particles follow from.
    pub fn releases<M: Medium<D>>(&self, tracker: &Tracker<D, M>) -> Result<Vec<Release<D>>, RunError> {
        let mut releases = Vec::new();
        for (idx, population) in self.transport.populations.iter().enumerate() {
            let mut parts = self.parts(tracker, idx)?;
            let whole: f64 = parts.iter().map(|part| part.mass).sum();
            if !whole.is_finite() || whole < 0.0 {
                return Err(unsound(&format!("the mass of population {idx} is {whole}")));
            }
            let unit = whole / population.count.max(1) as f64;
            parts.retain(|part| part.mass > 0.0);
            for part in parts {
                let origin = releases.len();
                releases.push(part.release(origin, idx, unit));
            }
        }
        Ok(releases)
    }

    fn parts<M: Medium<D>>(
        &self,
        tracker: &Tracker<D, M>,
        population: usize,
    ) -> Result<Vec<Part<D>>, RunError> {
        let mut parts = vec![self.initial(population)?];
        let species = self.transport.populations[population].species;
        for (idx, source) in self.transport.sources.iter().enumerate() {
            if source.species == species {
                parts.push(self.source(tracker, source, population, 1 + idx));
            }
        }
        for axis in 0..D {
            for end in 0..2 {
                for idx in 0..self.transport.sides[axis][end].len() {
                    parts.extend(self.side(tracker, population, [axis, end], idx));
                }
            }
        }
        Ok(parts)
    }
}

//! Mass by where it comes from, and how it is cut into particles.
//!
//! Owns the list of everything that gives mass, and the size of a population's particles. May use the plan and
//! `track`. It deliberately works out no mass: `initial`, `sources`, `inlets` and `wells` do.

use super::super::error::RunError;
use super::super::program::unsound;
use super::super::track::medium::Medium;
use super::entry::Entry;
use super::inlets::Inlet;
use super::pace::Pace;
use super::place::{Faces, Place};
use super::release::{Kind, Release, Sampling};
use super::sources::Bath;
use super::world::Site;
use crate::plan::tape::Tape;

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
    /// As a pace says, with places of each of its pieces where these change.
    Paced {
        pace: Pace,
        faces: Vec<Faces<D>>,
    },
    Held {
        course: Deep,
        /// Per flow, over a whole step.
        entries: Vec<Entry>,
        axis: usize,
        sign: f64,
    },
    /// Boxes with the mass of each when it is full, per flow.
    Filled {
        boxes: Vec<(f64, [f64; D], [f64; D])>,
        /// What the mass is multiplied by over time, and its largest value.
        level: Option<(Tape, f64)>,
        from: f64,
        to: f64,
    },
}

/// What a side that is held gives.
#[derive(Debug, Clone, PartialEq)]
pub enum Deep {
    /// The same in each step: mass, or particles.
    Even { per_step: f64 },
    /// Mass over time.
    Paced(Pace),
}

impl<const D: usize> Part<D> {
    /// Cuts the mass into particles of about `unit`; these add up to the mass exactly.
    fn release(self, origin: usize, population: usize, unit: f64) -> Release<D> {
        let n = (self.mass / unit).round().max(1.0);
        let (unit, kind) = match self.shape {
            Shape::Steady { from, to, sampling } => {
                (self.mass / n, Kind::Steady { n: n as u64, from, to, sampling })
            }
            Shape::Paced { pace, faces } => (self.mass / n, Kind::Paced { n: n as u64, pace, faces }),
            Shape::Held { course, entries, axis, sign } => {
                let course = match course {
                    Deep::Even { per_step } => Deep::Even { per_step: per_step / unit },
                    paced @ Deep::Paced(_) => paced,
                };
                (unit, Kind::Held { course, entries, axis, sign })
            }
            Shape::Filled { boxes, level, from, to } => {
                let is_steady = level.is_none() && boxes.len() == 1;
                let fill = boxes.iter().map(|it| it.0).fold(0.0, f64::max);
                let n = (fill / unit).round().max(1.0);
                let unit = if is_steady { fill / n } else { unit };
                let most = level.as_ref().map_or(1.0, |(_, peak)| *peak) * fill / unit;
                let counted = boxes.into_iter().map(|(fill, low, high)| (fill / unit, low, high)).collect();
                let stride = if is_steady { n as u64 } else { (most * (1.0 + 1e-6)) as u64 + 2 };
                let level = level.map(|(tape, _)| tape);
                (unit, Kind::Filled { boxes: counted, level, stride, from, to })
            }
        };
        Release { door: self.door, origin, population, unit, place: self.place, kind }
    }
}

/// What gives mass of one population, while media are looked at.
enum Draft<'a, const D: usize> {
    Ready(Part<D>),
    Inlet(Inlet<'a, D>),
    Bath(Bath<'a, D>),
}

/// What gives mass, of all populations.
pub struct Drafts<'a, const D: usize> {
    of_populations: Vec<Vec<Draft<'a, D>>>,
}

impl<'a, const D: usize> Drafts<'a, D> {
    pub fn new(site: &'a Site<'_, D>) -> Result<Self, RunError> {
        let populations = 0..site.transport.populations.len();
        let of_populations = populations.map(|idx| drafts(site, idx)).collect::<Result<_, _>>()?;
        Ok(Self { of_populations })
    }

    /// Looks at the medium of the next period.
    pub fn look<M: Medium<D>>(&mut self, site: &Site<D>, medium: &M) {
        for draft in self.of_populations.iter_mut().flatten() {
            match draft {
                Draft::Ready(_) => {}
                Draft::Inlet(inlet) => inlet.look(site, medium),
                Draft::Bath(bath) => bath.look(site, medium),
            }
        }
    }

    /// Everything that gives mass, with the units that a population's particles follow from.
    pub fn releases(self, site: &Site<D>) -> Result<Vec<Release<D>>, RunError> {
        let mut releases = Vec::new();
        for ((idx, population), drafts) in
            site.transport.populations.iter().enumerate().zip(self.of_populations)
        {
            let part = |draft: Draft<D>| match draft {
                Draft::Ready(part) => vec![part],
                Draft::Inlet(inlet) => inlet.parts(site),
                Draft::Bath(bath) => vec![bath.part(site)],
            };
            let mut parts: Vec<Part<D>> = drafts.into_iter().flat_map(part).collect();
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
}

fn drafts<'a, const D: usize>(
    site: &'a Site<'_, D>,
    population: usize,
) -> Result<Vec<Draft<'a, D>>, RunError> {
    let mut list = vec![Draft::Ready(site.initial(population)?)];
    let species = site.transport.populations[population].species;
    for (idx, source) in site.transport.sources.iter().enumerate() {
        if source.species == species {
            list.push(match site.bath(source, population, 1 + idx) {
                Some(bath) => Draft::Bath(bath),
                None => Draft::Ready(site.source(source, 1 + idx)),
            });
        }
    }
    list.extend(site.inlets(population).into_iter().map(Draft::Inlet));
    list.extend(site.feeds(population).into_iter().map(Draft::Ready));
    Ok(list)
}

//! When particles come into being, and with what mass.
//!
//! Owns the schedule of an origin. May use places and draws. It deliberately moves nothing.

use super::entry::Entry;
use super::flock;
use super::place::Place;
use crate::state::stream::Stream;

/// A particle that begins within a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Birth<const D: usize> {
    pub id: u64,
    pub population: usize,
    pub position: [f64; D],
    /// Part of the step that is over.
    pub entered: f64,
}

/// Particles of equal mass from one origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Release<const D: usize> {
    /// What it comes in by: 0 is the start, then sources, then sides.
    pub door: usize,
    pub origin: usize,
    pub population: usize,
    /// Mass of each, mol or kg.
    pub unit: f64,
    pub place: Place<D>,
    pub kind: Kind<D>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Kind<const D: usize> {
    /// So many, evenly from one time to another, in this order of shares.
    Steady { n: u64, from: f64, to: f64, sampling: Sampling },
    /// What a side that is held at a concentration gives in each step: `per_step` particles, as deep as the
    /// entry says; into the domain along `axis` with this sign.
    Held { per_step: f64, entry: Entry, axis: usize, sign: f64, from: f64, to: f64 },
    /// A box that is filled again in each step.
    Filled { n: u64, low: [f64; D], high: [f64; D], from: f64, to: f64 },
}

/// How shares of a mass are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    Random,
    Stratified,
    Ordered,
}

/// One step of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    pub step: u64,
    pub t: f64,
    pub dt: f64,
}

impl<const D: usize> Release<D> {
    /// Particles of the window, in the order of their numbers.
    pub fn births(&self, stream: &Stream, window: Window, births: &mut Vec<Birth<D>>) {
        let end = window.t + window.dt;
        match &self.kind {
            Kind::Steady { n, from, to, sampling } => {
                let (n, from, to) = (*n, *from, *to);
                if from >= end || to < window.t || n == 0 {
                    return;
                }
                let share = |t: f64| if to > from { ((t - from) / (to - from)).clamp(0.0, 1.0) } else { 0.0 };
                let first = (share(window.t) * n as f64) as u64;
                let last = if to > from { (share(end) * n as f64) as u64 + 1 } else { n };
                for count in first.saturating_sub(1)..last.min(n) {
                    let id = flock::id(self.origin, count);
                    let uniforms = stream.uniforms_of(id, 0);
                    let along = (count as f64 + uniforms[5]) / n as f64;
                    let t = from + along * (to - from);
                    if t >= window.t && t < end {
                        let position = self.place.at(sampling.share(count, n, &uniforms), &uniforms);
                        births.push(Birth {
                            id,
                            population: self.population,
                            position,
                            entered: (t - window.t) / window.dt,
                        });
                    }
                }
            }
            Kind::Held { per_step, entry, axis, sign, from, to } => {
                if window.t < *from || window.t >= *to {
                    return;
                }
                let offset = stream.uniforms_of(flock::id(self.origin, 0), 1)[0];
                let before = per_step * window.step as f64 + offset;
                // A step of another length, as the last one may be, has its own share and depths.
                let is_whole = (window.dt / entry.time - 1.0).abs() < 1e-9;
                let own = if is_whole { *entry } else { Entry { time: window.dt, ..*entry } };
                let after = match is_whole {
                    true => per_step * (window.step + 1) as f64 + offset,
                    false => before + per_step * own.total() / entry.total(),
                };
                for count in before as u64..after as u64 {
                    let id = flock::id(self.origin, count);
                    let uniforms = stream.uniforms_of(id, 0);
                    let mut position = self.place.at(uniforms[5], &uniforms);
                    position[*axis] += sign * own.depth(uniforms[6]);
                    // They are where they are at the end of the step.
                    births.push(Birth { id, population: self.population, position, entered: 1.0 });
                }
            }
            Kind::Filled { n, low, high, from, to } => {
                if window.t < *from || window.t >= *to {
                    return;
                }
                for k in 0..*n {
                    let id = flock::id(self.origin, window.step * n + k);
                    let uniforms = stream.uniforms_of(id, 0);
                    let position = Place::Box(*low, *high).at(0.5, &uniforms);
                    births.push(Birth { id, population: self.population, position, entered: 0.0 });
                }
            }
        }
    }
}

impl<const D: usize> Release<D> {
    /// How long a particle of its own has been in there before it is seen, at the end of a step of `dt`, s.
    pub fn age(&self, stream: &Stream, birth: &Birth<D>, dt: f64) -> f64 {
        let Kind::Held { entry, axis, .. } = &self.kind else { return 0.0 };
        let side = match &self.place {
            Place::Box(low, _) => low[*axis],
            _ => return 0.0,
        };
        let depth = (birth.position[*axis] - side).abs();
        Entry { time: dt, ..*entry }.age(depth, stream.uniforms_of(birth.id, 0)[7])
    }
}

impl Sampling {
    /// Share of the mass that comes before a particle.
    pub fn share(self, count: u64, n: u64, uniforms: &[f64; 8]) -> f64 {
        match self {
            Self::Random => uniforms[7],
            Self::Stratified => (count as f64 + uniforms[7]) / n as f64,
            Self::Ordered => (count as f64 + 0.5) / n as f64,
        }
    }
}

//! When particles come into being, and with what mass.
//!
//! Owns the schedule of an origin. May use places, paces and draws. It deliberately moves nothing.

use super::super::quasi::Quasi;
use super::entry::Entry;
use super::flock;
use super::pace::Pace;
use super::parts::Deep;
use super::place::{Faces, Place};
use crate::plan::tape::Tape;
use crate::plan::{Particles, Placement};
use crate::state::stream::Stream;
use std::ops::Range;

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
    /// What it comes in by: 0 is the start, then sources, then sides, then wells.
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
    /// So many at the times of a pace, at the faces of its pieces or at the place of the release.
    Paced { n: u64, pace: Pace, faces: Vec<Faces<D>> },
    /// What a side that is held at a concentration gives in each step: so many particles, as deep as the entry of the
    /// flow says; into the domain along `axis` with this sign.
    Held { course: Deep, entries: Vec<Entry>, axis: usize, sign: f64 },
    /// A box that is filled again in each step: particles, lower and upper corner in each flow. Where a level says
    /// how much there is of that, numbers are drawn so that they are right on average, `stride` at most.
    Filled { boxes: Vec<(f64, [f64; D], [f64; D])>, level: Option<Tape>, stride: u64, from: f64, to: f64 },
}

/// How shares of a mass are drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sampling {
    Random,
    Stratified,
    /// At their places, or beside them by so many of their distances.
    Ordered(f64),
    LowDiscrepancy(Quasi),
}

/// One step of time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    pub step: u64,
    pub t: f64,
    pub dt: f64,
    /// The number of the flow.
    pub period: usize,
    /// Part of the whole step; less than 1 for a look between two steps.
    pub part: f64,
}

impl<const D: usize> Release<D> {
    /// How many there will be in a run, about.
    pub fn expected(&self) -> f64 {
        match &self.kind {
            Kind::Steady { n, .. } | Kind::Paced { n, .. } => *n as f64,
            Kind::Held { course: Deep::Paced(pace), .. } => pace.total() / self.unit,
            // In one step; how many there are does not show before.
            Kind::Held { course: Deep::Even { per_step }, .. } => *per_step,
            Kind::Filled { stride, .. } => *stride as f64,
        }
    }

    /// How many are there when the run begins.
    pub fn n_at_start(&self) -> u64 {
        match self.kind {
            Kind::Steady { n, from: 0.0, to: 0.0, .. } => n,
            _ => 0,
        }
    }

    /// Some of those that are there when the run begins.
    pub fn at_start(&self, stream: &Stream, counts: Range<u64>) -> Vec<Birth<D>> {
        let Kind::Steady { n, sampling, .. } = self.kind else { return Vec::new() };
        let born = |count: u64| {
            let id = flock::id(self.origin, count);
            let uniforms = stream.uniforms_of(id, 0);
            let (share, uniforms) = sampling.draw(count, n, uniforms);
            let position = self.place.at(share, &uniforms);
            Birth { id, population: self.population, position, entered: 0.0 }
        };
        counts.map(born).collect()
    }

    /// Particles of the window, in the order of their numbers.
    pub fn births(&self, stream: &Stream, window: Window, births: &mut Vec<Birth<D>>) {
        match &self.kind {
            Kind::Steady { n, from, to, sampling } => {
                let time = |share: f64| from + share * (to - from);
                let share = |t: f64| if to > from { ((t - from) / (to - from)).clamp(0.0, 1.0) } else { 0.0 };
                if *from >= window.t + window.dt || *to < window.t {
                    return;
                }
                let last = if to > from { None } else { Some(*n) };
                self.spread(stream, window, (*n, last), share, births, |along, count, uniforms| {
                    let (share, uniforms) = sampling.draw(count, *n, *uniforms);
                    let position = self.place.at(share, &uniforms);
                    (time(along), position)
                });
            }
            Kind::Paced { n, pace, faces } => {
                let total = pace.total();
                let share = |t: f64| pace.before(t) / total;
                self.spread(stream, window, (*n, None), share, births, |along, _, uniforms| {
                    let (t, piece) = pace.at(along * total);
                    let position = match faces.get(piece) {
                        Some(faces) => faces.at(uniforms),
                        // The order of particles is that of their times: places must not follow it.
                        None => self.place.at(uniforms[7], uniforms),
                    };
                    (t, position)
                });
            }
            Kind::Held { course, entries, axis, sign } => {
                let Some(entry) = entries.get(window.period) else { return };
                let (entry, from_to) = self.numbers(stream, window, course, *entry);
                for count in from_to.0..from_to.1 {
                    let id = flock::id(self.origin, count);
                    let uniforms = stream.uniforms_of(id, 0);
                    let mut position = self.place.at(uniforms[5], &uniforms);
                    position[*axis] += sign * entry.depth(uniforms[6]);
                    // They are where they are at the end of the step.
                    births.push(Birth { id, population: self.population, position, entered: 1.0 });
                }
            }
            Kind::Filled { boxes, level, stride, from, to } => {
                if window.t < *from || window.t >= *to {
                    return;
                }
                let Some((wanted, low, high)) = boxes.get(window.period) else { return };
                let n = if level.is_none() && boxes.len() == 1 {
                    *stride
                } else {
                    let t = window.t + 0.5 * window.dt;
                    let level = level.as_ref().map_or(1.0, |tape| tape.evaluate(&[0.0, 0.0, 0.0, t]));
                    let uniform = stream.uniforms_of(flock::id(self.origin, window.step), 2)[0];
                    ((wanted * level + uniform) as u64).min(*stride)
                };
                for k in 0..n {
                    let id = flock::id(self.origin, window.step * stride + k);
                    let uniforms = stream.uniforms_of(id, 0);
                    let position = Place::Box(*low, *high).at(0.5, &uniforms);
                    births.push(Birth { id, population: self.population, position, entered: 0.0 });
                }
            }
        }
    }

    /// Those of a whole number whose time falls into the window. `share` is the part of them that has come by a time,
    /// `born` gives time and place of one. All up to `last` are asked, if it is given.
    fn spread(
        &self,
        stream: &Stream,
        window: Window,
        (n, last): (u64, Option<u64>),
        share: impl Fn(f64) -> f64,
        births: &mut Vec<Birth<D>>,
        born: impl Fn(f64, u64, &[f64; 8]) -> (f64, [f64; D]),
    ) {
        let end = window.t + window.dt;
        if n == 0 {
            return;
        }
        let first = (share(window.t) * n as f64) as u64;
        let last = last.unwrap_or_else(|| (share(end) * n as f64) as u64 + 1);
        for count in first.saturating_sub(1)..last.min(n) {
            let id = flock::id(self.origin, count);
            let uniforms = stream.uniforms_of(id, 0);
            let (t, position) = born((count as f64 + uniforms[5]) / n as f64, count, &uniforms);
            if t >= window.t && t < end {
                let entered = (t - window.t) / window.dt;
                births.push(Birth { id, population: self.population, position, entered });
            }
        }
    }

    /// The entry of a step through a side that is held, and the numbers of its particles.
    fn numbers(&self, stream: &Stream, window: Window, course: &Deep, entry: Entry) -> (Entry, (u64, u64)) {
        let offset = stream.uniforms_of(flock::id(self.origin, 0), 1)[0];
        match course {
            Deep::Even { per_step } => {
                let before = per_step * window.step as f64 + offset;
                // A step of another length, as the last one may be, has its own share and depths.
                let is_whole = (window.dt / entry.time - 1.0).abs() < 1e-9;
                if is_whole {
                    let after = per_step * (window.step + 1) as f64 + offset;
                    return (entry, (before as u64, after as u64));
                }
                let own = Entry { time: window.dt, ..entry };
                let after = before + per_step * own.total() / entry.total();
                (own, (before as u64, after as u64))
            }
            Deep::Paced(pace) => {
                let whole = window.dt / window.part;
                let own = Entry { time: window.dt, ..entry };
                let before = pace.before(window.t) / self.unit + offset;
                let mut after = pace.before(window.t + whole) / self.unit + offset;
                if window.part < 1.0 {
                    let part = own.total() / Entry { time: whole, ..entry }.total();
                    after = before + (after - before) * part;
                }
                (own, (before as u64, after as u64))
            }
        }
    }
}

impl<const D: usize> Release<D> {
    /// How long a particle of its own has been in there before it is seen, at the end of a step of `dt` during a flow, s.
    pub fn age(&self, stream: &Stream, birth: &Birth<D>, (dt, period): (f64, usize)) -> f64 {
        let Kind::Held { entries, axis, .. } = &self.kind else { return 0.0 };
        let Some(entry) = entries.get(period) else { return 0.0 };
        let side = match &self.place {
            Place::Box(low, _) => low[*axis],
            _ => return 0.0,
        };
        let depth = (birth.position[*axis] - side).abs();
        Entry { time: dt, ..*entry }.age(depth, stream.uniforms_of(birth.id, 0)[7])
    }
}

impl Sampling {
    pub fn new(particles: &Particles, stream: &Stream) -> Self {
        match particles.placement {
            Placement::Random => Self::Random,
            Placement::Stratified => Self::Stratified,
            Placement::Ordered => Self::Ordered(particles.disorder),
            Placement::LowDiscrepancy => Self::LowDiscrepancy(Quasi::new(stream)),
        }
    }

    /// Share of the mass that comes before a particle, and the numbers that place it there.
    pub fn draw(self, count: u64, n: u64, mut uniforms: [f64; 8]) -> (f64, [f64; 8]) {
        let share = match self {
            Self::Random => uniforms[7],
            Self::Stratified => (count as f64 + uniforms[7]) / n as f64,
            Self::Ordered(disorder) => {
                let place = (count as f64 + 0.5 + disorder * (uniforms[7] - 0.5)) / n as f64;
                // Beyond either end it is mirrored.
                let turned = place.rem_euclid(2.0);
                if turned > 1.0 { 2.0 - turned } else { turned }
            }
            Self::LowDiscrepancy(quasi) => {
                let [share, x, y, z] = quasi.point(count);
                uniforms[..3].copy_from_slice(&[x, y, z]);
                share
            }
        };
        (share, uniforms)
    }
}

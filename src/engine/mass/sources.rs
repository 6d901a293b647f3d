//! What sources give.
//!
//! Owns the mass of sources, and boxes that are kept at a concentration. May use the plan and `track`. It
//! deliberately draws nothing.

use super::super::track::medium::{Medium, spread_at};
use super::entry::Entry;
use super::in_time::Course;
use super::parts::{Part, Shape};
use super::place::{Place, Tail};
use super::release::Sampling;
use super::spots::Spots;
use super::world::Site;
use crate::plan::tape::Tape;
use crate::plan::transport::{Region, SideRule, Source, Strength};

/// How much smaller a reservoir acts that is filled once a step, in standard deviations of a step.
const RESERVOIR: f64 = 0.582_597_157_939_010_7;

/// A box whose water is kept at a concentration: it is filled again in each step.
pub struct Bath<'a, const D: usize> {
    population: usize,
    door: usize,
    low: [f64; D],
    high: [f64; D],
    level: Level<'a>,
    from: f64,
    to: f64,
    found: Vec<Found<D>>,
}

/// The concentration of a box.
#[derive(Clone, Copy)]
enum Level<'a> {
    Constant(f64),
    InTime(&'a Tape),
}

/// A box in one flow.
struct Found<const D: usize> {
    /// The box as it is filled.
    low: [f64; D],
    high: [f64; D],
    /// Area of each face that is not a side of the domain, with what goes out there, over no time yet.
    faces: Vec<(f64, Entry)>,
}

impl<const D: usize> Bath<'_, D> {
    /// Looks at the medium of the next period.
    ///
    /// - Equation: faces move outwards by `0.5826 √(2 D Δt)`.
    /// - Symbols: `D` dispersion normal to the face, `Δt` step.
    /// - Range: any step; what is left is of first order in it.
    /// - Source: methods, section 1.6: a reservoir that is filled once a step acts as if it were smaller by so much
    ///   (`−ζ(½)/√(2π)`, M. Broadie, P. Glasserman, S. Kou 1997, doi:10.1111/1467-9965.00035).
    /// - Shape: one box.
    pub fn look<M: Medium<D>>(&mut self, site: &Site<D>, medium: &M) {
        let carrier = site.carriers()[self.population];
        let (mut low, mut high) = (self.low, self.high);
        let centre: [f64; D] = std::array::from_fn(|axis| 0.5 * (low[axis] + high[axis]));
        let mut faces = Vec::new();
        for axis in 0..D {
            let area = volume(&self.low, &self.high) / (self.high[axis] - self.low[axis]);
            for (at, sign, limit) in
                [(&mut low[axis], -1.0, site.low[axis]), (&mut high[axis], 1.0, site.high[axis])]
            {
                if *at == limit {
                    continue;
                }
                let mut face = centre;
                face[axis] = *at;
                let spread = spread_at(medium, &carrier, face, axis);
                let velocity = sign * medium.velocity(face, axis) * carrier.mobility;
                faces.push((area, Entry { velocity, dispersion: 0.5 * spread, time: 0.0 }));
                *at += sign * RESERVOIR * (spread * site.plan.time.step).sqrt();
            }
            low[axis] = low[axis].max(site.low[axis]);
            high[axis] = high[axis].min(site.high[axis]);
        }
        self.found.push(Found { low, high, faces });
    }

    /// What it gives, as far as that can be told before: the number of its particles follows from that, and from
    /// what leaves it how many there will be.
    pub fn part(self, site: &Site<D>) -> Part<D> {
        let centre: [f64; D] = std::array::from_fn(|axis| 0.5 * (self.low[axis] + self.high[axis]));
        let porosity = site.porosity(&[centre])[0];
        let retardation = site.transport.populations[self.population].retardation;
        let (from, to) = (self.from, self.to);
        let (mean, unit, level) = match self.level {
            Level::Constant(c) => (c, c, None),
            Level::InTime(tape) => {
                let course = Course { tape, faces: vec![(self.low, self.high)], window: (from, to) };
                let (pace, _) = site.pace(&course, |_, _| 1.0);
                (pace.total() / (to - from).max(f64::MIN_POSITIVE), 1.0, Some((tape.clone(), pace.peak())))
            }
        };
        let density = |c: f64| c * porosity * retardation;
        let mut expected = density(mean) * volume(&self.low, &self.high);
        for (period, from, to) in site.periods_within(from, to) {
            for &(area, face) in &self.found[period].faces {
                expected += density(mean) * area * Entry { time: (to - from).max(0.0), ..face }.total();
            }
        }
        let filled = |it: &Found<D>| (density(unit) * volume(&it.low, &it.high), it.low, it.high);
        let boxes = self.found.iter().map(filled).collect();
        Part {
            door: self.door,
            mass: expected,
            place: Place::Box(self.low, self.high),
            shape: Shape::Filled { boxes, level, from, to },
        }
    }
}

fn volume<const D: usize>(low: &[f64; D], high: &[f64; D]) -> f64 {
    (0..D).map(|axis| high[axis] - low[axis]).product()
}

impl<const D: usize> Site<'_, D> {
    /// A source that is kept at a concentration.
    pub fn bath<'a>(&self, source: &'a Source, population: usize, door: usize) -> Option<Bath<'a, D>> {
        let level = match &source.strength {
            Strength::Held(c) => Level::Constant(*c),
            Strength::HeldInTime(tape) => Level::InTime(tape),
            Strength::Pulse(_) | Strength::Rate(_) | Strength::RateInTime(_) => return None,
        };
        let (low, high) = match self.place(source) {
            Place::Box(low, high) => (low, high),
            _ => ([0.0; D], [0.0; D]),
        };
        let (from, to) = self.window(source);
        Some(Bath { population, door, low, high, level, from, to, found: Vec::new() })
    }

    /// A source that gives amounts.
    pub fn source(&self, source: &Source, door: usize) -> Part<D> {
        let place = self.place(source);
        let (from, to) = self.window(source);
        let sampling = Sampling::Random;
        let (mass, shape) = match &source.strength {
            Strength::Pulse(mass) => {
                (*mass, Shape::Steady { from, to: from, sampling: Sampling::Stratified })
            }
            // The order of particles is that of their times: places must not follow it.
            Strength::Rate(rate) => (*rate * (to - from).max(0.0), Shape::Steady { from, to, sampling }),
            Strength::RateInTime(tape) => {
                let course = Course { tape, faces: vec![(self.low, self.high)], window: (from, to) };
                let (pace, faces) = self.pace(&course, |_, _| 1.0);
                (pace.total(), Shape::Paced { pace, faces })
            }
            Strength::Held(_) | Strength::HeldInTime(_) => (0.0, Shape::Steady { from, to, sampling }),
        };
        Part { door, mass, place, shape }
    }

    fn window(&self, source: &Source) -> (f64, f64) {
        (source.during.0, source.during.1.min(self.plan.time.duration))
    }

    fn place(&self, source: &Source) -> Place<D> {
        let array = |list: &[f64]| std::array::from_fn(|axis| list.get(axis).copied().unwrap_or(0.0));
        match &source.region {
            Region::Point(at) => Place::Point(array(at)),
            Region::Line(from, to) => Place::Line(array(from), array(to)),
            Region::Box(low, high) => Place::Box(array(low), array(high)),
            Region::Gaussian(centre, deviation) => {
                Place::Gaussian(array(centre), array(deviation), std::array::from_fn(|axis| self.tail(axis)))
            }
            Region::Table(cloud) => Place::Spots(Spots::new(cloud)),
        }
    }

    fn tail(&self, axis: usize) -> Tail {
        let is = |end: usize, rule: SideRule| {
            self.transport.sides[axis][end].iter().all(|patch| patch.rule == rule)
        };
        let at = |end: usize, at: f64| (!is(end, SideRule::Open)).then_some(at);
        Tail {
            low: at(0, self.low[axis]),
            high: at(1, self.high[axis]),
            is_periodic: is(0, SideRule::Periodic),
        }
    }
}

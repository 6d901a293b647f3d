//! What sources give.
//!
//! Owns the mass of sources, and boxes that are kept at a concentration. May use the plan and `track`. It
//! deliberately draws nothing.

use super::super::track::medium::{Medium, spread_at};
use super::super::track::tracker::Tracker;
use super::entry::Entry;
use super::parts::{Part, Shape};
use super::place::{Place, Tail};
use super::release::Sampling;
use super::spots::Spots;
use super::world::Site;
use crate::plan::transport::{Region, SideRule, Source, Strength};

/// How much smaller a reservoir acts that is filled once a step, in standard deviations of a step.
const RESERVOIR: f64 = 0.582_597_157_939_010_7;

impl<const D: usize> Site<'_, D> {
    pub fn source<M: Medium<D>>(
        &self,
        tracker: &Tracker<D, M>,
        source: &Source,
        population: usize,
        door: usize,
    ) -> Part<D> {
        let array = |list: &[f64]| std::array::from_fn(|axis| list.get(axis).copied().unwrap_or(0.0));
        let place = match &source.region {
            Region::Point(at) => Place::Point(array(at)),
            Region::Line(from, to) => Place::Line(array(from), array(to)),
            Region::Box(low, high) => Place::Box(array(low), array(high)),
            Region::Gaussian(centre, deviation) => {
                Place::Gaussian(array(centre), array(deviation), std::array::from_fn(|axis| self.tail(axis)))
            }
            Region::Table(cloud) => Place::Spots(Spots::new(cloud)),
        };
        let (from, to) = (source.during.0, source.during.1.min(self.plan.time.duration));
        let (mass, shape) = match source.strength {
            Strength::Pulse(mass) => (mass, Shape::Steady { from, to: from, sampling: Sampling::Stratified }),
            // The order of particles is that of their times: places must not follow it.
            Strength::Rate(rate) => {
                (rate * (to - from).max(0.0), Shape::Steady { from, to, sampling: Sampling::Random })
            }
            Strength::Held(c) => self.filled(tracker, population, c, &place, (from, to)),
        };
        Part { door, mass, place, shape }
    }

    /// A box whose water is kept at a concentration: it is filled again in each step.
    ///
    /// - Equation: faces move outwards by `0.5826 √(2 D Δt)`.
    /// - Symbols: `D` dispersion normal to the face, `Δt` step.
    /// - Range: any step; what is left is of first order in it.
    /// - Source: methods, section 1.6: a reservoir that is filled once a step acts as if it were smaller by so much
    ///   (`−ζ(½)/√(2π)`, M. Broadie, P. Glasserman, S. Kou 1997, doi:10.1111/1467-9965.00035).
    /// - Shape: one box.
    fn filled<M: Medium<D>>(
        &self,
        tracker: &Tracker<D, M>,
        population: usize,
        c: f64,
        place: &Place<D>,
        (from, to): (f64, f64),
    ) -> (f64, Shape<D>) {
        let (mut low, mut high) = match place {
            Place::Box(low, high) => (*low, *high),
            _ => ([0.0; D], [0.0; D]),
        };
        let carrier = self.carriers()[population];
        let centre: [f64; D] = std::array::from_fn(|axis| 0.5 * (low[axis] + high[axis]));
        let porosity = self.porosity(&[centre])[0];
        let density = c * porosity * self.transport.populations[population].retardation;
        let volume =
            |low: &[f64; D], high: &[f64; D]| -> f64 { (0..D).map(|axis| high[axis] - low[axis]).product() };
        let mut expected = density * volume(&low, &high);
        let (inner_low, inner_high) = (low, high);
        for axis in 0..D {
            let area = volume(&inner_low, &inner_high) / (inner_high[axis] - inner_low[axis]);
            for (at, sign, limit) in
                [(&mut low[axis], -1.0, self.low[axis]), (&mut high[axis], 1.0, self.high[axis])]
            {
                if *at == limit {
                    continue;
                }
                let mut face = centre;
                face[axis] = *at;
                let spread = spread_at(&tracker.medium, &carrier, face, axis);
                let entry = Entry {
                    velocity: sign * tracker.medium.velocity(face, axis) * carrier.mobility,
                    dispersion: 0.5 * spread,
                    time: (to - from).max(0.0),
                };
                expected += density * area * entry.total();
                *at += sign * RESERVOIR * (spread * self.plan.time.step).sqrt();
            }
            low[axis] = low[axis].max(self.low[axis]);
            high[axis] = high[axis].min(self.high[axis]);
        }
        (expected, Shape::Filled { fill: density * volume(&low, &high), low, high, from, to })
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

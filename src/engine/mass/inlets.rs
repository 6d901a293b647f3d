//! What enters through the sides of the domain.
//!
//! Owns the mass that inflow and sides kept at a concentration give, over the parts of a side. May use the plan
//! and `track`. It deliberately draws nothing.

use super::super::track::medium::{Medium, spread_at};
use super::super::track::tracker::Tracker;
use super::entry::Entry;
use super::parts::{Part, Shape};
use super::place::{Faces, Place};
use super::release::Sampling;
use super::world::Site;
use crate::plan::tape::{Operation, Tape};
use crate::plan::transport::{Dispersion, Flow, Patch, SideRule};

/// Parts along an axis that a side is cut into where what enters varies, with one and with two axes; a side that
/// is kept at a concentration draws numbers for each of them in each step.
const CUTS: [usize; 2] = [1024, 128];
const HELD_CUTS: [usize; 2] = [64, 16];

impl<const D: usize> Site<'_, D> {
    /// What enters through a patch of a side.
    pub fn side<M: Medium<D>>(
        &self,
        tracker: &Tracker<D, M>,
        population: usize,
        [axis, end]: [usize; 2],
        idx: usize,
    ) -> Vec<Part<D>> {
        let patch = &self.transport.sides[axis][end][idx];
        let of = &self.transport.populations[population];
        let (tapes, is_held) = match &patch.rule {
            SideRule::Inflow(tapes) => (tapes, false),
            SideRule::Held(tapes) => (tapes, true),
            _ => return Vec::new(),
        };
        let Some(tape) = tapes.get(of.species) else { return Vec::new() };
        let sign = if end == 0 { 1.0 } else { -1.0 };
        let duration = self.plan.time.duration;
        let door = 1 + self.transport.sources.len() + 2 * axis + end;
        let mut flux = Vec::new();
        let mut parts = Vec::new();
        for (low, high) in self.faces([axis, end], idx, (tape, if is_held { HELD_CUTS } else { CUTS })) {
            let centre: [f64; D] = std::array::from_fn(|other| 0.5 * (low[other] + high[other]));
            let area: f64 =
                (0..D).filter(|&other| other != axis).map(|other| high[other] - low[other]).product();
            let c = self.evaluate(tape, &[centre], 0.0)[0];
            let porosity = self.porosity(&[centre])[0];
            let inwards = sign * tracker.medium.velocity(centre, axis);
            if !is_held {
                flux.push((low, high, c * porosity * area * inwards.max(0.0)));
                continue;
            }
            let carrier = self.carriers()[population];
            let entry = |time: f64| Entry {
                velocity: inwards * carrier.mobility,
                dispersion: 0.5 * spread_at(&tracker.medium, &carrier, centre, axis),
                time,
            };
            let density = c * porosity * of.retardation * area;
            let step = entry(self.plan.time.step);
            parts.push(Part {
                door,
                mass: density * entry(duration).total(),
                place: Place::Box(low, high),
                shape: Shape::Held { per_step: density * step.total(), entry: step, axis, sign },
            });
        }
        if !is_held {
            let faces = Faces::new(flux);
            parts.push(Part {
                door,
                mass: faces.total() * duration,
                place: Place::Faces(faces),
                shape: Shape::Steady { from: 0.0, to: duration, sampling: Sampling::Stratified },
            });
        }
        parts
    }

    /// Rectangles of a patch that no earlier one holds, small enough to be looked at in the middle: what enters
    /// is a tape, with the cuts that it is worth.
    pub fn faces(
        &self,
        [axis, end]: [usize; 2],
        idx: usize,
        varied: (&Tape, [usize; 2]),
    ) -> Vec<([f64; D], [f64; D])> {
        let (earlier, rest) = self.transport.sides[axis][end].split_at(idx);
        let Some(patch) = rest.first() else { return Vec::new() };
        let at = if end == 0 { self.low[axis] } else { self.high[axis] };
        let mut faces: Vec<([f64; D], [f64; D])> = vec![([at; D], [at; D])];
        for other in (0..D).filter(|&other| other != axis) {
            let low = patch.low[other].max(self.low[other]);
            let high = patch.high[other].min(self.high[other]);
            let edges = self.edges(other, (low, high), earlier, varied);
            let cut = |(from, to): ([f64; D], [f64; D])| {
                let pairs: Vec<_> = edges.windows(2).map(|pair| (pair[0], pair[1])).collect();
                pairs.into_iter().map(move |(low, high)| {
                    let (mut from, mut to) = (from, to);
                    (from[other], to[other]) = (low, high);
                    (from, to)
                })
            };
            faces = faces.into_iter().flat_map(cut).collect();
        }
        let is_free = |(low, high): &([f64; D], [f64; D])| {
            let holds = |patch: &Patch, other: usize| {
                let centre = 0.5 * (low[other] + high[other]);
                other == axis || (patch.low[other] <= centre && centre <= patch.high[other])
            };
            !earlier.iter().any(|patch| (0..D).all(|other| holds(patch, other)))
        };
        faces.retain(is_free);
        faces
    }

    /// Where a side is cut along an axis: at faces of cells, at limits of other patches, and evenly where
    /// something varies.
    fn edges(
        &self,
        other: usize,
        (low, high): (f64, f64),
        earlier: &[Patch],
        (tape, cuts): (&Tape, [usize; 2]),
    ) -> Vec<f64> {
        let is_constant = |tape: &Tape| matches!(tape.operations[..], [Operation::Constant(_)]);
        let is_even = is_constant(tape)
            && !self.has_smooth_pores()
            && !matches!(self.transport.flow, Flow::Expression(_))
            && !matches!(self.transport.dispersion, Dispersion::Isotropic(_));
        let n = if is_even { 1 } else { cuts[usize::from(D > 2)] };
        let mut edges: Vec<f64> = (0..n).map(|k| low + (high - low) * k as f64 / n as f64).collect();
        edges.push(high);
        let index = self.plan.axes[other].index;
        edges.extend(self.flow.iter().flat_map(|flow| &flow.cells.edges()[index]));
        edges.extend(earlier.iter().flat_map(|patch| [patch.low[other], patch.high[other]]));
        edges.retain(|edge| (low..=high).contains(edge));
        edges.sort_by(f64::total_cmp);
        edges.dedup();
        edges
    }
}

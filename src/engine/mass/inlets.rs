//! What enters through the sides of the domain.
//!
//! Owns the mass that inflow and sides kept at a concentration give, over the parts of a side. May use the plan
//! and `track`. It deliberately draws nothing.

use super::super::track::medium::{Medium, spread_at};
use super::entry::Entry;
use super::in_time::Course;
use super::pace::Pace;
use super::parts::{Deep, Part, Shape};
use super::place::{Faces, Place};
use super::release::Sampling;
use super::world::Site;
use crate::plan::in_time::{bounds, is_timed};
use crate::plan::tape::{Operation, Tape};
use crate::plan::transport::{Dispersion, Flow, Patch, SideRule};

/// Parts along an axis that a side is cut into where what enters varies, with one and with two axes; a side that
/// is kept at a concentration draws numbers for each of them in each step.
const CUTS: [usize; 2] = [1024, 128];
const HELD_CUTS: [usize; 2] = [64, 16];

/// A patch of a side that gives mass of one population.
pub struct Inlet<'a, const D: usize> {
    population: usize,
    axis: usize,
    /// Into the domain.
    sign: f64,
    door: usize,
    is_held: bool,
    course: Course<'a, D>,
    centres: Vec<[f64; D]>,
    /// Per face.
    porosity: Vec<f64>,
    areas: Vec<f64>,
    /// Per period and face: velocity inwards, m/s, and 2 D_nn, m²/s.
    found: Vec<Vec<[f64; 2]>>,
}

impl<'a, const D: usize> Inlet<'a, D> {
    /// Looks at the medium of the next period.
    pub fn look<M: Medium<D>>(&mut self, site: &Site<D>, medium: &M) {
        let carrier = site.carriers()[self.population];
        let of = |centre: &[f64; D]| {
            let inwards = self.sign * medium.velocity(*centre, self.axis);
            let spread = if self.is_held { spread_at(medium, &carrier, *centre, self.axis) } else { 0.0 };
            [inwards, spread]
        };
        self.found.push(self.centres.iter().map(of).collect());
    }

    /// What enters.
    pub fn parts(self, site: &Site<D>) -> Vec<Part<D>> {
        if self.is_held {
            return (0..self.centres.len()).map(|face| self.held(site, face)).collect();
        }
        let duration = site.plan.time.duration;
        let water = |period: usize, face: usize| {
            self.porosity[face] * self.areas[face] * self.found[period][face][0].max(0.0)
        };
        if is_timed(self.course.tape) || site.starts.len() > 1 {
            let (pace, faces) = site.pace(&self.course, water);
            let weights = self.course.faces.iter().map(|&(low, high)| (low, high, 1.0)).collect();
            let place = Place::Faces(Faces::new(weights));
            let mass = pace.total();
            return vec![Part { door: self.door, mass, place, shape: Shape::Paced { pace, faces } }];
        }
        let mut flux = Vec::new();
        for (face, &(low, high)) in self.course.faces.iter().enumerate() {
            let c = site.evaluate(self.course.tape, &[self.centres[face]], 0.0)[0];
            let inwards = self.found[0][face][0].max(0.0);
            flux.push((low, high, c * self.porosity[face] * self.areas[face] * inwards));
        }
        let faces = Faces::new(flux);
        vec![Part {
            door: self.door,
            mass: faces.total() * duration,
            place: Place::Faces(faces),
            shape: Shape::Steady { from: 0.0, to: duration, sampling: Sampling::Stratified },
        }]
    }

    /// What a face gives that is kept at a concentration.
    fn held(&self, site: &Site<D>, face: usize) -> Part<D> {
        let of = &site.transport.populations[self.population];
        let carrier = site.carriers()[self.population];
        let (low, high) = self.course.faces[face];
        let entry = |period: usize, time: f64| {
            let [inwards, spread] = self.found[period][face];
            Entry { velocity: inwards * carrier.mobility, dispersion: 0.5 * spread, time }
        };
        let step = site.plan.time.step;
        let density = |c: f64| c * self.porosity[face] * of.retardation * self.areas[face];
        let entries: Vec<Entry> = (0..site.starts.len()).map(|period| entry(period, step)).collect();
        let is_cut = site.calendar.n_steps() != site.plan.time.n_steps;
        let (mass, course) = if !is_timed(self.course.tape) && !is_cut && site.starts.len() == 1 {
            let c = site.evaluate(self.course.tape, &[self.centres[face]], 0.0)[0];
            let mass = density(c) * entry(0, site.plan.time.duration).total();
            (mass, Deep::Even { per_step: density(c) * entries[0].total() })
        } else {
            let pace =
                self.held_pace(site, face, |period, time| density(1.0) * entry(period, time).total() / time);
            (pace.total(), Deep::Paced(pace))
        };
        let shape = Shape::Held { course, entries, axis: self.axis, sign: self.sign };
        Part { door: self.door, mass, place: Place::Box(low, high), shape }
    }

    /// Mass over time of a face that is held: `gives` says how much per time and concentration in a step of a length
    /// during a period. Concentrations are those at the mean time of what is there at the end of the step.
    fn held_pace(&self, site: &Site<D>, face: usize, gives: impl Fn(usize, f64) -> f64) -> Pace {
        let centre = self.centres[face];
        let tape = self.course.tape;
        let duration = site.plan.time.duration;
        let switches = site.switches(tape, &[centre], (0.0, duration));
        let mut edges = site.calendar.seams();
        edges.extend(switches.iter().copied().chain([0.0, duration]));
        edges.sort_by(f64::total_cmp);
        edges.dedup();
        let mobility = site.carriers()[self.population].mobility;
        let mut rates = |t: f64, values: &mut [f64]| {
            let number = site.calendar.step_at(t);
            let (period, time) = (site.period(number), site.calendar.length(number));
            let [inwards, spread] = self.found[period][face];
            let own = Entry { velocity: inwards * mobility, dispersion: 0.5 * spread, time };
            let next = switches.partition_point(|&switch| switch <= t);
            let last = switches.get(next).map_or(duration, |switch| switch - 1e-9 * time);
            let seen = (t + 0.5 * time - own.lag()).min(last);
            values[0] = site.evaluate(tape, &[centre], seen)[0] * gives(period, time);
        };
        let place = site.in_space(&centre);
        let width = |from: f64, to: f64| {
            let number = site.calendar.step_at(0.5 * (from + to));
            let of = bounds(tape, place, from, to);
            let width = of.high - of.low;
            // Finer than a step nothing is told apart.
            let is_fine = !is_timed(tape) || to - from <= site.calendar.length(number);
            if is_fine { 0.0 } else { width * gives(site.period(number), site.calendar.length(number)) }
        };
        Pace::new(&edges, 1, &mut rates, &width).0
    }
}

impl<const D: usize> Site<'_, D> {
    /// Everything that lets a population in.
    pub fn inlets(&self, population: usize) -> Vec<Inlet<'_, D>> {
        let species = self.transport.populations[population].species;
        let mut list = Vec::new();
        for side in 0..2 * D {
            let [axis, end] = [side / 2, side % 2];
            for (idx, patch) in self.transport.sides[axis][end].iter().enumerate() {
                let (tapes, is_held) = match &patch.rule {
                    SideRule::Inflow(tapes) => (tapes, false),
                    SideRule::Held(tapes) => (tapes, true),
                    _ => continue,
                };
                let Some(tape) = tapes.get(species) else { continue };
                let faces = match is_held {
                    true => self.held_faces([axis, end], idx, tape),
                    false => self.faces([axis, end], idx, (tape, CUTS)),
                };
                let course = Course { tape, faces, window: (0.0, self.plan.time.duration) };
                let centres = course.centres();
                let porosity = self.porosity(&centres);
                let area = |(low, high): &([f64; D], [f64; D])| -> f64 {
                    (0..D).filter(|&other| other != axis).map(|other| high[other] - low[other]).product()
                };
                let areas = course.faces.iter().map(area).collect();
                list.push(Inlet {
                    population,
                    axis,
                    sign: if end == 0 { 1.0 } else { -1.0 },
                    door: 1 + self.transport.sources.len() + side,
                    is_held,
                    course,
                    centres,
                    porosity,
                    areas,
                    found: Vec::new(),
                });
            }
        }
        list
    }

    /// The rectangles of a patch that is held at a concentration.
    pub fn held_faces(&self, side: [usize; 2], idx: usize, tape: &Tape) -> Vec<([f64; D], [f64; D])> {
        self.faces(side, idx, (tape, HELD_CUTS))
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
        let reads_place = |tape: &Tape| tape.operations.iter().any(|it| matches!(it, Operation::Input(0..3)));
        let is_even = !reads_place(tape)
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

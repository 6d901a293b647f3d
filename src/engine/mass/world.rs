//! The plan's transport as loops want it.
//!
//! Owns the making of walls, releases and units of mass. May use the plan, `flow` and `track`. It deliberately
//! runs nothing.

use super::super::error::RunError;
use super::super::program::unsound;
use super::super::track::drains::Drain;
use super::super::track::interfaces::Interface;
use super::super::track::medium::{Carrier, Criteria, Medium, spread_at};
use super::super::track::noise::Draws;
use super::super::track::tracker::Tracker;
use super::super::track::walls::{self, Ends, Law, Wall};
use super::entry::Entry;
use super::place::{Cells, Faces, Place, Tail};
use super::release::{Kind, Release, Sampling};
use crate::flow::FaceFlow;
use crate::maths::wide::Width;
use crate::plan::tape::{Operation, Tape};
use crate::plan::transport::{Dispersion, Flow, Patch, Region, SideRule, Source, Strength, Transport};
use crate::plan::{Normals, Placement, Plan};
use std::sync::Arc;

/// How much smaller a reservoir acts that is filled once a step, in standard deviations of a step.
const RESERVOIR: f64 = 0.582_597_157_939_010_7;
/// Parts along an axis that a side is cut into where what enters varies, with one and with two axes; a side that
/// is kept at a concentration draws numbers for each of them in each step.
const CUTS: [usize; 2] = [1024, 128];
const HELD_CUTS: [usize; 2] = [64, 16];

/// What the builders read.
pub struct Site<'a, const D: usize> {
    pub plan: &'a Plan,
    pub transport: &'a Transport,
    pub flow: Option<Arc<FaceFlow>>,
    pub low: [f64; D],
    pub high: [f64; D],
}

impl<'a, const D: usize> Site<'a, D> {
    pub fn new(plan: &'a Plan, flow: Option<Arc<FaceFlow>>) -> Result<Self, RunError> {
        let transport = plan.transport.as_ref().ok_or_else(|| unsound("no transport"))?;
        let axis = |value: fn(&crate::plan::Axis) -> f64| std::array::from_fn(|idx| value(&plan.axes[idx]));
        Ok(Self { plan, transport, flow, low: axis(|a| a.low), high: axis(|a| a.high) })
    }

    /// A tape at places, at a time.
    pub fn evaluate(&self, tape: &Tape, places: &[[f64; D]], t: f64) -> Vec<f64> {
        let mut inputs = [const { Vec::new() }; 4];
        for (idx, input) in inputs.iter_mut().enumerate() {
            let axis = self.plan.axes.iter().position(|axis| axis.index == idx);
            *input = match axis {
                Some(axis) => places.iter().map(|place| place[axis]).collect(),
                None => vec![if idx == 3 { t } else { 0.0 }; places.len()],
            };
        }
        let inputs: Vec<&[f64]> = inputs.iter().map(|input: &Vec<f64>| &input[..]).collect();
        let mut values = vec![0.0; places.len()];
        tape.evaluate_block(&inputs, &mut Vec::new(), &mut values);
        values
    }

    pub fn carriers(&self) -> Vec<Carrier> {
        let carrier = |population: &crate::plan::transport::Population| Carrier {
            mobility: if population.is_mobile { 1.0 / population.retardation } else { 0.0 },
            molecular: population.molecular,
        };
        self.transport.populations.iter().map(carrier).collect()
    }

    pub fn tracker<M: Medium<D>>(&self, medium: M, width: Width) -> Result<Tracker<D, M>, RunError> {
        let is_double = self.plan.walk.normals == Normals::Double;
        let mut ends: Vec<Ends<D>> = Vec::with_capacity(D);
        for axis in 0..D {
            ends.push(self.ends(axis)?);
        }
        Ok(Tracker {
            medium,
            ends: ends.try_into().map_err(|_| unsound("sides that do not fit the axes"))?,
            planes: Vec::new(),
            drains: self.drains(),
            draws: Draws::new(self.plan.seed, D, is_double),
            interfaces: self
                .transport
                .interfaces
                .iter()
                .map(|interface| Interface { axis: interface.axis, at: interface.at })
                .collect(),
            criteria: self
                .transport
                .sub_steps
                .map(|sub| Criteria { courant: sub.courant, dispersion: sub.dispersion }),
            width,
        })
    }

    /// The cells that wells take water from.
    fn drains(&self) -> Vec<Drain<D>> {
        let Some(flow) = &self.flow else { return Vec::new() };
        let mut drains = Vec::new();
        for (idx, well) in self.transport.drains().into_iter().enumerate() {
            for &(cell, rate) in flow.sinks.iter().filter(|(_, rate)| *rate > 0.0) {
                let [low, high] = self.cell(flow, cell);
                let meets = |axis: usize| well.low[axis] < high[axis] && well.high[axis] >= low[axis];
                if (0..D).all(meets) {
                    let volume: f64 = (0..D).map(|axis| high[axis] - low[axis]).product();
                    let water = flow.porosity[cell] * volume;
                    drains.push(Drain { low, high, rate: rate / water, side: 2 * D + idx });
                }
            }
        }
        drains
    }

    /// Lower and upper corner of a cell of the flow.
    fn cell(&self, flow: &FaceFlow, cell: usize) -> [[f64; D]; 2] {
        let place = flow.cells.place(cell);
        let edge = |axis: usize, end: usize| {
            let index = self.plan.axes[axis].index;
            flow.cells.edges()[index][place[index] + end]
        };
        [0, 1].map(|end| std::array::from_fn(|axis| edge(axis, end)))
    }

    fn ends(&self, axis: usize) -> Result<Ends<D>, RunError> {
        let sides = self.transport.sides.get(axis).ok_or_else(|| unsound("an axis without sides"))?;
        let is_periodic = |end: usize| sides[end].iter().any(|patch| patch.rule == SideRule::Periodic);
        if is_periodic(0) || is_periodic(1) {
            return Ok(Ends::Periodic { low: self.low[axis], high: self.high[axis] });
        }
        let wall = |end: usize| {
            if sides[end].iter().all(|patch| patch.rule == SideRule::Open) {
                return None;
            }
            let at = if end == 0 { self.low[axis] } else { self.high[axis] };
            let patch = |patch: &crate::plan::transport::Patch| walls::Patch {
                low: std::array::from_fn(|other| patch.low[other]),
                high: std::array::from_fn(|other| patch.high[other]),
                law: law(&patch.rule),
            };
            Some(Wall { at, patches: sides[end].iter().map(patch).collect() })
        };
        Ok(Ends::Walls([wall(0), wall(1)]))
    }

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

    fn initial(&self, population: usize) -> Result<Part<D>, RunError> {
        let of = &self.transport.populations[population];
        let cells = Cells::new(self.low, self.high, |centres| {
            let porosity = self.evaluate(&self.transport.porosity, centres, 0.0);
            let values = self.evaluate(&of.initial, centres, 0.0);
            porosity.iter().zip(values).map(|(porosity, c)| porosity * of.retardation * c).collect()
        });
        let sampling = match self.plan.particles.placement {
            Placement::Random => Sampling::Random,
            Placement::Stratified => Sampling::Stratified,
            Placement::Ordered => Sampling::Ordered,
        };
        Ok(Part {
            door: 0,
            mass: cells.total(),
            place: Place::Cells(cells),
            shape: Shape::Steady { from: 0.0, to: 0.0, sampling },
        })
    }

    fn source<M: Medium<D>>(
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
            Region::Table(columns) => {
                let n = columns.first().map_or(0, Vec::len);
                Place::List((0..n).map(|row| std::array::from_fn(|axis| columns[axis][row])).collect())
            }
        };
        let (from, to) = (source.during.0, source.during.1.min(self.plan.time.duration));
        let sampling = Sampling::Stratified;
        let (mass, shape) = match source.strength {
            Strength::Pulse(mass) => (mass, Shape::Steady { from, to: from, sampling }),
            Strength::Rate(rate) => (rate * (to - from).max(0.0), Shape::Steady { from, to, sampling }),
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
        let porosity = self.evaluate(&self.transport.porosity, &[centre], 0.0)[0];
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

    /// What enters through a patch of a side.
    fn side<M: Medium<D>>(
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
            let porosity = self.evaluate(&self.transport.porosity, &[centre], 0.0)[0];
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
    fn faces(
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
            && is_constant(&self.transport.porosity)
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

fn law(rule: &SideRule) -> Law {
    match rule {
        SideRule::Reflect | SideRule::Periodic | SideRule::Open | SideRule::Inflow(_) => Law::Reflect,
        SideRule::Absorb | SideRule::Held(_) => Law::Absorb,
        SideRule::Partial(rate) => Law::Partial(*rate),
        SideRule::Outflow => Law::Outflow,
    }
}

/// Mass from one place, before it is cut into particles.
struct Part<const D: usize> {
    door: usize,
    mass: f64,
    place: Place<D>,
    shape: Shape<D>,
}

enum Shape<const D: usize> {
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
                let n = if let Place::List(list) = &self.place { list.len() as f64 } else { n };
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

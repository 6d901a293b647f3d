//! Particles on exact paths, from cell to cell.
//!
//! Owns the order of events on a path. May use legs, walls, planes and the tracker's words. It deliberately draws
//! nothing, except where a well takes a part of the water of a cell.

use super::super::lanes::Lane;
use super::super::medium::{Carrier, Medium};
use super::super::monitors::{Crossing, Plane};
use super::super::noise::Draws;
use super::super::tracker::{Bench, EARLIEST, Events, Steps, TooManySubSteps, Tracker};
use super::super::walls::{Ends, Exit, Law};
use super::{Leg, Paths, WellInCell};
use crate::maths::scalar::{exp, ln};

/// The draws of wells that take a part, beside those of walls, drains and jumps.
const WHAT: u64 = 13;
/// Cells that one step may lead through.
const MOST_CELLS: u64 = 1 << 24;

/// What lies on the paths.
struct Surroundings<'a, const D: usize> {
    paths: &'a Paths<D>,
    ends: &'a [Ends<D>; D],
    planes: &'a [Plane<D>],
    draws: &'a Draws,
    /// 1/R
    mobility: f64,
}

/// Where a particle is along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Where {
    Inside,
    /// At a wall that lets nothing through.
    Held,
    /// Beyond the lower or the upper end of the domain, where it is open.
    Beyond(usize),
}

/// A particle within a step.
struct Trip<const D: usize> {
    x: [f64; D],
    place: [usize; D],
    whereabouts: [Where; D],
    /// Rest of the step, s.
    left: f64,
    /// What a well that takes a part may still take: an exponential number, once it is asked for.
    luck: Option<f64>,
    id: u64,
    step: u64,
}

/// What a hop ends with.
enum Hop {
    Done,
    On,
    Gone { side: usize, patch: usize },
}

/// Time in a cell from which nothing flows out but through its well.
///
/// - Equation: `F = e^{−λ s}` of its water lies farther in; what is there is taken out after `F/λ`.
/// - Symbols: `λ = −∇·v` share of the water that the well takes out in 1 s, `s` time since the way came in, if
///   velocities were linear in the cell: they are, over `F`, so that the water there stays as it is on its way in.
/// - Range: cells that water comes into through all faces.
/// - Source: `∇·v = 0` outside of the well; the volume farther in than `s` shrinks as `e^{−λs}`.
/// - Shape: one particle.
#[derive(Debug, Clone, Copy)]
struct Funnel {
    /// 1/s
    rate: f64,
    /// Time until it is taken out, s.
    rest: f64,
}

impl Funnel {
    fn time_of(self, linear: f64) -> f64 {
        self.rest * (1.0 - exp(-self.rate * linear))
    }

    fn linear_of(self, time: f64) -> f64 {
        if time < self.rest { -ln(1.0 - time / self.rest) / self.rate } else { f64::INFINITY }
    }
}

impl<const D: usize, M: Medium<D>> Tracker<D, M> {
    /// Takes the group of the bench along its paths; `entered` is the part of the first step that is over when a
    /// particle comes in.
    #[inline(never)]
    pub(in super::super) fn follow(
        &self,
        paths: &Paths<D>,
        carrier: &Carrier,
        steps: Steps,
        entered: Option<&Lane>,
        bench: &mut Bench<D, M>,
        events: &mut impl Events,
    ) -> Result<(), TooManySubSteps> {
        let (ends, planes, draws) = (&self.ends, &self.planes[..], &self.draws);
        let around = Surroundings { paths, ends, planes, draws, mobility: carrier.mobility };
        for lane in 0..bench.lanes.n {
            let id = bench.lanes.ids[lane];
            for step in steps.first..steps.end {
                let begin = steps.t + (step - steps.first) as f64 * steps.dt;
                let late = entered.filter(|_| step == steps.first).map_or(0.0, |entered| entered[lane]);
                let x = std::array::from_fn(|axis| bench.lanes.positions[axis][lane]);
                let mut trip = around.begin(x, steps.dt * (1.0 - late), id, step);
                bench.displacements += 1;
                let time = |left: f64| (begin + (steps.dt - left)).max(begin + EARLIEST * steps.dt);
                let mut crossed = |plane: usize, is_forward: bool, left: f64| {
                    let crossing = Crossing { lane, is_forward, fraction: 1.0 - left / steps.dt };
                    events.crossed(id, plane, crossing, time(left));
                };
                let end = around.go(&mut trip, &mut crossed).ok_or(TooManySubSteps { id, step })?;
                (0..D).for_each(|axis| bench.lanes.positions[axis][lane] = trip.x[axis]);
                if let Hop::Gone { side, patch } = end {
                    bench.lanes.gone |= 1 << lane;
                    let fraction = 1.0 - trip.left / steps.dt;
                    for (idx, gap) in self.gaps.iter().enumerate() {
                        if gap.side == side && gap.part.holds(side / 2, |axis| trip.x[axis]) {
                            let crossing = Crossing { lane, is_forward: true, fraction };
                            events.crossed(id, planes.len() + idx, crossing, time(trip.left));
                        }
                    }
                    events.left(id, Exit { lane, side, patch, fraction }, time(trip.left));
                    break;
                }
            }
        }
        Ok(())
    }
}

impl<const D: usize> Trip<D> {
    /// Into another cell, where walls may be met in another way.
    fn enter(&mut self, axis: usize, place: usize) {
        self.place[axis] = place;
        self.whereabouts.iter_mut().filter(|it| **it == Where::Held).for_each(|it| *it = Where::Inside);
    }
}

impl<const D: usize> Surroundings<'_, D> {
    fn begin(&self, x: [f64; D], left: f64, id: u64, step: u64) -> Trip<D> {
        let rulers = &self.paths.rulers;
        let place = std::array::from_fn(|axis| rulers[axis].cell(x[axis]));
        let whereabouts = std::array::from_fn(|axis| {
            let [low, _] = rulers[axis].ends(0);
            let [_, high] = rulers[axis].ends(rulers[axis].n() - 1);
            match x[axis] {
                x if x < low => Where::Beyond(0),
                x if x > high => Where::Beyond(1),
                _ => Where::Inside,
            }
        });
        Trip { x, place, whereabouts, left, luck: None, id, step }
    }

    /// From cell to cell to the end of the step; nothing if there are too many.
    fn go(&self, trip: &mut Trip<D>, crossed: &mut impl FnMut(usize, bool, f64)) -> Option<Hop> {
        for _ in 0..MOST_CELLS {
            match self.hop(trip, crossed) {
                Hop::On => {}
                end => return Some(end),
            }
        }
        None
    }

    /// The way through one cell.
    fn hop(&self, trip: &mut Trip<D>, crossed: &mut impl FnMut(usize, bool, f64)) -> Hop {
        if trip.left <= 0.0 {
            return Hop::Done;
        }
        let cell: usize = (0..D).map(|axis| trip.place[axis] * self.paths.strides[axis]).sum();
        let legs: [Leg; D] = std::array::from_fn(|axis| self.leg(cell, axis, trip));
        let mut exit: Option<(usize, usize, f64)> = None;
        for (axis, leg) in legs.iter().enumerate() {
            if let Some((end, time)) = leg.exit()
                && exit.is_none_or(|(_, _, soonest)| time < soonest)
            {
                exit = Some((axis, end, time));
            }
        }
        let wells = self.paths.wells_of(cell);
        if !wells.is_empty() && legs.iter().all(Leg::is_closed) {
            return self.funnel(trip, &legs, wells, crossed);
        }
        let leaving = exit.filter(|(_, _, time)| *time <= trip.left);
        let mut time = leaving.map_or(trip.left, |(_, _, time)| time);
        let taken = self.taken(trip, wells, time);
        if let Some((_, after)) = taken {
            time = after;
        }
        self.move_on(trip, &legs, time, |linear| linear, crossed);
        trip.left -= time;
        match (taken, leaving) {
            (Some((side, _)), _) => Hop::Gone { side, patch: 0 },
            (None, Some((axis, end, _))) => self.pass(trip, axis, end, crossed),
            (None, None) => {
                trip.left = 0.0;
                Hop::Done
            }
        }
    }

    fn leg(&self, cell: usize, axis: usize, trip: &Trip<D>) -> Leg {
        let at_ends = self.paths.velocities[cell][axis].map(|v| v * self.mobility);
        let ends = self.paths.rulers[axis].ends(trip.place[axis]);
        let x = trip.x[axis];
        match trip.whereabouts[axis] {
            Where::Inside => Leg::between(x, ends, at_ends),
            Where::Held => Leg::steady(x, 0.0, ends),
            Where::Beyond(0) => Leg::steady(x, at_ends[0], [f64::NEG_INFINITY, ends[0]]),
            Where::Beyond(_) => Leg::steady(x, at_ends[1], [ends[1], f64::INFINITY]),
        }
    }

    /// Goes along the legs and tells what planes are crossed; `clock` turns the time of legs into that of the step.
    fn move_on(
        &self,
        trip: &mut Trip<D>,
        legs: &[Leg; D],
        linear: f64,
        clock: impl Fn(f64) -> f64,
        crossed: &mut impl FnMut(usize, bool, f64),
    ) {
        let to: [f64; D] = std::array::from_fn(|axis| legs[axis].after(linear));
        for (number, plane) in self.planes.iter().enumerate() {
            let (from, to) = (trip.x[plane.axis], to[plane.axis]);
            if (from < plane.at) != (to < plane.at) {
                let time = legs[plane.axis].time_to(plane.at).min(linear);
                let at = |axis: usize| legs[axis].after(time);
                if plane.part.as_ref().is_none_or(|part| part.holds(plane.axis, at)) {
                    crossed(number, to > from, trip.left - clock(time));
                }
            }
        }
        trip.x = to;
    }

    /// In a cell that all water leaves by a well.
    fn funnel(
        &self,
        trip: &mut Trip<D>,
        legs: &[Leg; D],
        wells: &[WellInCell],
        crossed: &mut impl FnMut(usize, bool, f64),
    ) -> Hop {
        let rate = -legs.iter().map(Leg::rate).sum::<f64>();
        let since = legs.iter().map(Leg::since).fold(f64::INFINITY, f64::min);
        let rest = if rate > 0.0 { exp(-rate * since) / rate } else { f64::INFINITY };
        let funnel = Funnel { rate, rest };
        let linear = funnel.linear_of(trip.left);
        self.move_on(trip, legs, linear, |linear| funnel.time_of(linear), crossed);
        if linear.is_finite() {
            trip.left = 0.0;
            return Hop::Done;
        }
        trip.left -= rest;
        Hop::Gone { side: self.which(trip, wells), patch: 0 }
    }

    /// The well that takes a particle out within a time, and when.
    ///
    /// - Equation: it is taken out when `∫ λ dt` reaches an exponential number.
    /// - Symbols: `λ` share of the water of the cell that its wells take out in 1 s.
    /// - Range: cells that water flows out of by faces, too.
    /// - Source: `∂c/∂t + v·∇c = −c (∇·v + λ)`, and `λ = −∇·v`.
    /// - Shape: one particle; the number holds for all such cells of a step.
    fn taken(&self, trip: &mut Trip<D>, wells: &[WellInCell], time: f64) -> Option<(usize, f64)> {
        if wells.is_empty() {
            return None;
        }
        let rate = wells.iter().map(|well| well.rate).sum::<f64>() * self.mobility;
        let fresh = || -ln(self.draws.uniforms(trip.id, trip.step, WHAT)[0]);
        let luck = trip.luck.unwrap_or_else(fresh);
        trip.luck = Some(luck - rate * time);
        (rate * time >= luck).then(|| (self.which(trip, wells), luck / rate))
    }

    /// One of the wells of a cell, by the water that they take.
    fn which(&self, trip: &Trip<D>, wells: &[WellInCell]) -> usize {
        if let [well] = wells {
            return well.side;
        }
        let whole: f64 = wells.iter().map(|well| well.rate).sum();
        let mut rest = self.draws.uniforms(trip.id, trip.step, WHAT)[1] * whole;
        for well in wells {
            rest -= well.rate;
            if rest <= 0.0 {
                return well.side;
            }
        }
        wells[wells.len() - 1].side
    }

    /// Over a face into the next cell, or what is there at the end of the domain.
    fn pass(
        &self,
        trip: &mut Trip<D>,
        axis: usize,
        end: usize,
        crossed: &mut impl FnMut(usize, bool, f64),
    ) -> Hop {
        let ruler = &self.paths.rulers[axis];
        let place = trip.place[axis];
        if trip.whereabouts[axis] != Where::Inside {
            // Back from beyond an open end.
            trip.x[axis] = ruler.ends(place)[1 - end];
            trip.whereabouts[axis] = Where::Inside;
            return Hop::On;
        }
        trip.x[axis] = ruler.ends(place)[end];
        let last = ruler.n() - 1;
        if (end == 0 && place > 0) || (end == 1 && place < last) {
            trip.enter(axis, if end == 0 { place - 1 } else { place + 1 });
            return Hop::On;
        }
        let wall = match &self.ends[axis] {
            Ends::Periodic { low, high } => {
                for (number, plane) in self.planes.iter().enumerate() {
                    let holds = || {
                        let part = plane.part.as_ref();
                        part.is_none_or(|part| part.holds(axis, |other| trip.x[other]))
                    };
                    if plane.axis == axis && plane.at == *low && holds() {
                        crossed(number, end == 1, trip.left);
                    }
                }
                trip.x[axis] = if end == 1 { *low } else { *high };
                trip.enter(axis, if end == 1 { 0 } else { last });
                return Hop::On;
            }
            Ends::Walls(walls) => walls[end].as_ref(),
        };
        let patch = wall.and_then(|wall| wall.patches.iter().position(|patch| patch.holds(&trip.x, axis)));
        let law = wall.zip(patch).map(|(wall, patch)| wall.patches[patch].law);
        match law {
            None => trip.whereabouts[axis] = Where::Beyond(end),
            Some(Law::Reflect) => trip.whereabouts[axis] = Where::Held,
            Some(Law::Partial(rate)) if rate <= 0.0 => trip.whereabouts[axis] = Where::Held,
            Some(Law::Absorb | Law::Partial(_) | Law::Outflow | Law::Wet) => {
                return Hop::Gone { side: 2 * axis + end, patch: patch.unwrap_or(0) };
            }
        }
        Hop::On
    }
}

//! Groups of particles on their way through steps.
//!
//! Owns the order of work within a displacement. May use media, walls and monitors. It deliberately stores
//! nothing: a group comes in, and goes on or leaves.

use super::drains::Drain;
use super::interfaces::Interfaces;
use super::lanes::{LANES, Lane, Lanes, each};
use super::medium::{Carrier, Criteria, Leap, Medium};
use super::monitors::{Crossing, Gap, Plane};
use super::noise::{Draws, Normals};
use super::turning::Fates;
use super::walls::{Ends, Exit, Met, Stride, Touch};
use crate::maths::wide::Width;

/// Part of a step before which nothing happens in it: what does is told apart from the step before, whose end
/// is known up to rounding.
pub const EARLIEST: f64 = 4e-9;

/// Displacements that one step may be cut into.
pub const MOST_SUB_STEPS: u64 = 1 << 14;

/// Everything that a walk meets.
pub struct Tracker<const D: usize, M: Medium<D>> {
    pub medium: M,
    pub ends: [Ends<D>; D],
    /// Boxes that water is taken from.
    pub drains: Vec<Drain<D>>,
    /// Where coefficients jump, axis by axis.
    pub interfaces: Vec<Interfaces>,
    pub planes: Vec<Plane<D>>,
    /// Parts of sides that are watched; what leaves through one crosses the plane of a number behind those of planes.
    pub gaps: Vec<Gap<D>>,
    pub draws: Draws,
    /// Steps of each particle's own, if any.
    pub criteria: Option<Criteria>,
    pub width: Width,
}

/// Steps that a group goes through.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Steps {
    pub first: u64,
    /// One more than the last.
    pub end: u64,
    /// When the first one begins, s.
    pub t: f64,
    /// Length of each, s.
    pub dt: f64,
}

/// What happens on the way, at a time.
pub trait Events {
    /// A particle has left through a side at time `t`.
    fn left(&mut self, id: u64, exit: Exit, t: f64);
    /// A particle has crossed a plane at time `t`.
    fn crossed(&mut self, id: u64, plane: usize, crossing: Crossing, t: f64);
    /// A parcel of water has touched a wall; it may leave after that.
    fn touched(&mut self, touch: &Touch) {
        let _ = touch;
    }
}

/// What one thread needs for a group.
pub struct Bench<const D: usize, M: Medium<D>> {
    pub lanes: Lanes<D>,
    pub(super) normals: Box<Normals>,
    pub(super) look: M::Look,
    pub(super) leap: Leap,
    met: Met,
    /// What becomes of the group, if it turns.
    pub fates: Option<Box<Fates>>,
    /// Displacements done, one per particle.
    pub displacements: u64,
}

/// A particle needed more sub-steps than there are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TooManySubSteps {
    pub id: u64,
    pub step: u64,
}

impl<const D: usize, M: Medium<D>> Tracker<D, M> {
    pub fn bench(&self) -> Bench<D, M> {
        Bench {
            lanes: Lanes::new(),
            normals: Normals::new(),
            look: self.medium.blank(),
            leap: Leap::new(1.0),
            met: Met::default(),
            fates: None,
            displacements: 0,
        }
    }

    /// Takes the group of the bench through its steps. `entered` is the part of the first step that is over
    /// when a particle comes in.
    #[inline(always)]
    pub fn advance(
        &self,
        carrier: &Carrier,
        steps: Steps,
        entered: Option<&Lane>,
        bench: &mut Bench<D, M>,
        events: &mut impl Events,
    ) -> Result<(), TooManySubSteps> {
        if let Some(paths) = self.medium.paths(carrier) {
            return self.follow(paths, carrier, steps, entered, bench, events);
        }
        bench.normals.clear();
        if self.criteria.is_none() {
            bench.leap.assign(&[steps.dt; LANES]);
        }
        let mut late = entered;
        for step in steps.first..steps.end {
            let t = steps.t + (step - steps.first) as f64 * steps.dt;
            let mut left = [steps.dt; LANES];
            let is_late = late.is_some();
            if let Some(entered) = late.take() {
                for lane in 0..LANES {
                    left[lane] = steps.dt * (1.0 - entered[lane]);
                }
            }
            match &self.criteria {
                None if !self.is_cut() => {
                    if is_late {
                        bench.leap.assign(&left);
                    }
                    self.medium.look(carrier, &bench.lanes.positions, &mut bench.look);
                    let start = each(&left, |left| t + (steps.dt - left));
                    self.displace(carrier, step, (&start, t + EARLIEST * steps.dt), bench, events);
                    bench.displacements += bench.lanes.n as u64;
                    if is_late {
                        bench.leap.assign(&[steps.dt; LANES]);
                    }
                }
                criteria => {
                    self.sub_steps(carrier, criteria.as_ref(), (step, t, steps.dt), left, bench, events)?
                }
            }
            if bench.lanes.gone & bench.lanes.occupied() == bench.lanes.occupied() {
                break;
            }
        }
        Ok(())
    }

    /// Whether particles divide steps without criteria for it, too.
    #[inline(always)]
    pub(super) fn is_cut(&self) -> bool {
        self.interfaces.iter().any(Interfaces::are_walled)
    }

    /// The longest displacements from the places that were looked at, in a step `dt`.
    #[inline(always)]
    pub(super) fn limit(
        &self,
        carrier: &Carrier,
        criteria: Option<&Criteria>,
        (look, positions): (&M::Look, &[Lane; D]),
        dt: f64,
        time: &mut Lane,
    ) {
        match criteria {
            Some(criteria) => {
                self.medium.longest(look, criteria, time);
                for drain in &self.drains {
                    drain.limit(carrier, criteria.courant, positions, time);
                }
            }
            None => time.fill(dt),
        }
        for interfaces in &self.interfaces {
            interfaces.limit((&self.medium, carrier, look), positions, dt, time);
        }
    }

    /// One step in sub-steps of each particle's own.
    #[inline(always)]
    fn sub_steps(
        &self,
        carrier: &Carrier,
        criteria: Option<&Criteria>,
        (step, t, dt): (u64, f64, f64),
        mut left: Lane,
        bench: &mut Bench<D, M>,
        events: &mut impl Events,
    ) -> Result<(), TooManySubSteps> {
        let mut time = [0.0; LANES];
        for sub_step in 0..MOST_SUB_STEPS {
            self.medium.look(carrier, &bench.lanes.positions, &mut bench.look);
            self.limit(carrier, criteria, (&bench.look, &bench.lanes.positions), dt, &mut time);
            let start = each(&left, |left| t + dt - left);
            let mut is_going = 0_u64;
            for lane in 0..LANES {
                // A sliver of a sub-step is taken with the one before it.
                time[lane] = if time[lane] * 1.0001 >= left[lane] { left[lane] } else { time[lane] };
                left[lane] -= time[lane];
                is_going |= u64::from(left[lane] > 0.0) << lane;
                bench.displacements += u64::from(lane < bench.lanes.n && time[lane] > 0.0);
            }
            bench.leap.assign(&time);
            let start = (&start, t + EARLIEST * dt);
            self.displace(carrier, step * MOST_SUB_STEPS + sub_step, start, bench, events);
            let going = is_going & bench.lanes.occupied() & !bench.lanes.gone;
            if going == 0 {
                return Ok(());
            }
            if sub_step + 1 == MOST_SUB_STEPS {
                return Err(TooManySubSteps { id: bench.lanes.ids[going.trailing_zeros() as usize], step });
            }
        }
        Ok(())
    }

    /// One displacement of all lanes from `start` on, over the times of the leap. Nothing happens before
    /// `earliest`.
    #[inline(always)]
    pub(super) fn displace(
        &self,
        carrier: &Carrier,
        number: u64,
        (start, earliest): (&Lane, f64),
        bench: &mut Bench<D, M>,
        events: &mut impl Events,
    ) {
        let Bench { lanes, normals, look, leap, met, .. } = bench;
        let before = lanes.positions;
        let row = self.draws.prepare(self.width, &lanes.ids, number, normals);
        let rows: [&Lane; D] = std::array::from_fn(|axis| normals.row(row + axis));
        self.medium.displace(look, leap, rows, &mut lanes.positions);
        let was_gone = lanes.gone;
        let stride = Stride {
            medium: &self.medium,
            look,
            carrier,
            leap,
            before: &before,
            draws: &self.draws,
            step: number,
        };
        self.medium.settle(&stride, lanes);
        for interfaces in &self.interfaces {
            interfaces.apply(&stride, lanes);
        }
        let free = (!self.planes.is_empty()).then_some(lanes.positions);
        for (axis, ends) in self.ends.iter().enumerate() {
            ends.apply(axis, &stride, lanes, met);
        }
        for touch in met.touches.drain(..) {
            events.touched(&touch);
        }
        for (idx, plane) in self.planes.iter().enumerate() {
            let Some(free) = &free else { continue };
            plane.crossings(&stride, free, lanes, was_gone, |crossing| {
                let t = start[crossing.lane] + crossing.fraction * leap.time[crossing.lane];
                events.crossed(lanes.ids[crossing.lane], idx, crossing, t.max(earliest));
            });
        }
        for (idx, drain) in self.drains.iter().enumerate() {
            drain.apply(idx, &stride, lanes, &mut met.exits);
        }
        for exit in met.exits.drain(..) {
            let t = start[exit.lane] + exit.fraction * leap.time[exit.lane];
            events.left(lanes.ids[exit.lane], exit, t.max(earliest));
            for (idx, gap) in self.gaps.iter().enumerate() {
                if gap.side == exit.side
                    && gap.part.holds(gap.side / 2, |axis| lanes.positions[axis][exit.lane])
                {
                    let crossing = Crossing { lane: exit.lane, is_forward: true, fraction: exit.fraction };
                    events.crossed(lanes.ids[exit.lane], self.planes.len() + idx, crossing, t.max(earliest));
                }
            }
        }
    }
}

//! Blocks of parcels on their way through a step, in whatever medium.
//!
//! Owns the work on one block: it is called once per block, and compiled for each medium. May use the tracker and
//! the books. It deliberately lets nothing in.

use super::super::error::RunError;
use super::super::mass::book::What;
use super::super::mass::gate::{Gates, Monitors};
use super::super::mass::media::{InMedium, Media};
use super::super::mass::world::Site;
use super::super::parallel::Pool;
use super::super::schedule::Due;
use super::super::track::lanes::{LANES, Lane};
use super::super::track::medium::{Carrier, Medium};
use super::super::track::monitors::Crossing;
use super::super::track::tracker::{Bench, Events, Steps, Tracker};
use super::super::track::walls::{Ends, Exit, Touch};
use super::book::Moved;
use super::composition::{Composition, Rinse};
use super::inlets::{self, Inlet};
use super::passages::{Cargo, Passages, Passed, Watched};
use super::{Passage, Trouble};
use crate::maths::wide::Width;
use crate::plan::Station;
use crate::plan::transport::Patch;
use crate::state::particles::Block;
use std::sync::Arc;

/// A tracker in a medium, with what sides do to parcels.
struct Course<const D: usize, M: Medium<D>> {
    tracker: Tracker<D, M>,
    /// Per side and part of it.
    rinses: Vec<Vec<Rinse>>,
    n_slots: usize,
    benches: Pool<Bench<D, M>>,
}

/// What a site makes of its water.
pub struct Launched<const D: usize> {
    pub current: Arc<dyn Current<D>>,
    pub inlets: Vec<Inlet<D>>,
    /// Per component the lowest and highest value that sides give.
    pub ranges: Vec<(f64, f64)>,
    pub gates: Gates,
    pub watched: Watched,
}

/// Makes the current of a site, and what comes in with it.
pub struct Launch<'a> {
    pub width: Width,
    /// Of a parcel, with the zones that are stored and the components that it carries.
    pub volume: f64,
    pub n_slots: usize,
    pub n: usize,
    /// Outputs of what passes leave them.
    pub dues: &'a mut Vec<Due>,
}

impl<const D: usize> InMedium<D> for Launch<'_> {
    type Output = Launched<D>;

    fn go<M: Medium<D> + Send + 'static>(
        self,
        site: &Site<D>,
        media: Media<M>,
    ) -> Result<Self::Output, RunError> {
        let mut tracker = site.tracker(media(0)?, self.width)?;
        let period = |axis: usize| match tracker.ends[axis] {
            Ends::Periodic { low, high } => Some((low, high)),
            Ends::Walls(_) => None,
        };
        let periods = std::array::from_fn(period);
        let mut monitors = Monitors { planes: Vec::new(), gaps: Vec::new(), periods };
        let mut gates = Gates::new(site.plan, &site.calendar, self.dues, &mut monitors);
        gates.look(0.0, |station| site.water(&tracker.medium, station, 0));
        (tracker.planes, tracker.gaps) = (monitors.planes, monitors.gaps);
        let is_watched = |side: &usize| {
            site.plan.outputs.iter().any(|output| output.station == Some(Station::Side(*side)))
        };
        let watched = Watched { sides: (0..2 * D).map(|side| is_watched(&side)).collect() };
        let inlets = inlets::inlets(site, &tracker, self.volume, self.n)?;
        let axes: Vec<usize> = site.plan.axes.iter().map(|axis| axis.index).collect();
        let sides = site.transport.sides.iter().flatten();
        let of_side = |patches: &Vec<Patch>| {
            patches.iter().map(|patch| Rinse::new(&patch.rule, self.n, &axes)).collect()
        };
        let rinses = sides.map(of_side).collect();
        let course = Course { tracker, rinses, n_slots: self.n_slots, benches: Pool::new() };
        let ranges = (0..self.n).map(|component| range(site, &axes, self.n, component)).collect();
        Ok(Launched { current: Arc::new(course), inlets, ranges, gates, watched })
    }
}

/// Lowest and highest value of a component at the sides; 0 is one of them.
fn range<const D: usize>(site: &Site<D>, axes: &[usize], n: usize, component: usize) -> (f64, f64) {
    let of_patch = |patch: &Patch| {
        let composition = Composition::of_side(&patch.rule, n, axes);
        composition.range(component, &patch.low, &patch.high)
    };
    let all = site.transport.sides.iter().flatten().flatten().map(of_patch);
    all.fold((0.0, 0.0), |(lowest, highest): (f64, f64), (low, high)| (lowest.min(low), highest.max(high)))
}

/// What moves parcels.
pub trait Current<const D: usize>: Send + Sync {
    /// Takes a block through a step, and those out of it that leave. `entered` is the part of the step that is over
    /// when each comes in; nothing for parcels that have been there.
    fn carry(
        &self,
        steps: Steps,
        entered: &[f64],
        watched: &Watched,
        block: &mut Block<D>,
        passage: &mut Passage<D>,
    );
}

impl<const D: usize, M: Medium<D> + Send + 'static> Current<D> for Course<D, M> {
    fn carry(
        &self,
        steps: Steps,
        entered: &[f64],
        watched: &Watched,
        block: &mut Block<D>,
        passage: &mut Passage<D>,
    ) {
        self.benches.lend(
            || Box::new(self.tracker.bench()),
            |bench| {
                let course = self;
                self.tracker.width.run(OnBlock { course, steps, entered, watched, block, bench, passage });
            },
        );
    }
}

/// One block, to be dispatched to wide or narrow code.
struct OnBlock<'a, const D: usize, M: Medium<D>> {
    course: &'a Course<D, M>,
    steps: Steps,
    entered: &'a [f64],
    watched: &'a Watched,
    block: &'a mut Block<D>,
    bench: &'a mut Bench<D, M>,
    passage: &'a mut Passage<D>,
}

impl<const D: usize, M: Medium<D>> pulp::NullaryFnOnce for OnBlock<'_, D, M> {
    type Output = ();

    /// Takes 64 parcels at a time; those that stay close up.
    #[inline(always)]
    fn call(self) {
        let Self { course, steps, entered, watched, block, bench, passage } = self;
        let n = block.n_particles;
        let mut kept = 0;
        bench.displacements = 0;
        for first in (0..n).step_by(LANES) {
            let range = first..(first + LANES).min(n);
            let late = entered.get(range.clone()).map(lane_of);
            bench
                .lanes
                .load(&block.ids[range.clone()], block.positions.each_ref().map(|x| &x[range.clone()]));
            let mut log = Log {
                rinses: &course.rinses,
                n_slots: course.n_slots,
                first,
                middle: steps.t + 0.5 * steps.dt,
                watched,
                ids: &block.ids,
                positions: &block.positions,
                columns: &mut block.columns,
                moved: &mut passage.moved,
                passages: &mut passage.passages,
            };
            if let Err(problem) =
                course.tracker.advance(&Carrier::WATER, steps, late.as_ref(), bench, &mut log)
            {
                passage.trouble.get_or_insert(Trouble::SubSteps(problem));
            }
            let lanes = &bench.lanes;
            for lane in 0..range.len() {
                if lanes.gone >> lane & 1 == 1 {
                    continue;
                }
                for axis in 0..D {
                    let x = lanes.positions[axis][lane];
                    if !x.is_finite() {
                        let id = lanes.ids[lane];
                        passage.trouble.get_or_insert(Trouble::Position { id, step: steps.first });
                    }
                    block.positions[axis][kept] = x;
                }
                if kept != first + lane {
                    block.take_over(kept, first + lane);
                }
                kept += 1;
            }
        }
        block.truncate(kept);
        passage.displacements += bench.displacements;
    }
}

/// Parts of a step of a group; none of it for the rest of the lanes.
fn lane_of(entered: &[f64]) -> Lane {
    let mut lane = [0.0; LANES];
    lane[..entered.len()].copy_from_slice(entered);
    lane
}

/// What happens to a group on its way.
struct Log<'a, const D: usize> {
    rinses: &'a [Vec<Rinse>],
    n_slots: usize,
    /// Place of the group in its block.
    first: usize,
    /// Middle of the step, s.
    middle: f64,
    watched: &'a Watched,
    ids: &'a [u64],
    /// At the beginning of the step.
    positions: &'a [Vec<f64>; D],
    columns: &'a mut [Vec<f64>],
    moved: &'a mut Moved,
    passages: &'a mut Passages<D>,
}

/// The door of a side, or of a well that is counted on behind the sides.
fn door(side: usize) -> usize {
    1 + side
}

impl<const D: usize> Log<'_, D> {
    fn passed(&self, idx: usize, what: What, cargo: Cargo, t: f64) -> Passed<D> {
        let place = std::array::from_fn(|axis| self.positions[axis][idx]);
        Passed { what, cargo, entered_by: None, id: self.ids[idx], t, place }
    }

    /// A parcel passes with all it carries.
    fn note(&mut self, idx: usize, what: What, t: f64) {
        let passed = self.passed(idx, what, Cargo::Parcel, t);
        let columns = &self.columns;
        self.passages.push(passed, columns.len(), |column| columns[column][idx]);
    }
}

impl<const D: usize> Events for Log<'_, D> {
    fn left(&mut self, _: u64, exit: Exit, t: f64) {
        let idx = self.first + exit.lane;
        self.moved.leave(door(exit.side), self.columns, idx);
        if self.watched.has(exit.side) {
            self.note(idx, What::Left { side: exit.side, patch: exit.patch }, t);
        }
    }

    fn crossed(&mut self, _: u64, plane: usize, crossing: Crossing, t: f64) {
        let what = What::Crossed { plane, is_forward: crossing.is_forward };
        self.note(self.first + crossing.lane, what, t);
    }

    fn touched(&mut self, touch: &Touch) {
        let Touch { lane, side, patch, push, place } = *touch;
        let rinse = &self.rinses[side][patch];
        let idx = self.first + lane;
        let n_slots = self.n_slots;
        let loss = |(column_idx, column): (usize, &mut Vec<f64>)| {
            let before = column[idx];
            column[idx] = rinse.after(column_idx / n_slots, before, push, &place[..D]);
            before - column[idx]
        };
        let losses: Vec<f64> = self.columns.iter_mut().enumerate().map(loss).collect();
        losses.iter().enumerate().for_each(|(column, loss)| self.moved.change(door(side), column, -loss));
        if self.watched.has(side) && losses.iter().any(|loss| *loss != 0.0) {
            let passed = self.passed(idx, What::Left { side, patch }, Cargo::Exchange, self.middle);
            self.passages.push(passed, losses.len(), |column| losses[column]);
        }
    }
}

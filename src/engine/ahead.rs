//! The state between two steps, where it has to be taken there.
//!
//! Owns the copy that goes a part of the next step. May use the run and its stages. It deliberately changes nothing
//! of the run itself.

use super::error::RunError;
use super::observe::{Draws, Instant};
use super::parallel;
use super::program::Work;
use super::run::Run;
use super::schedule::{Due, step_length};
use super::track::tracker::Steps;

/// Steps of a look ahead are counted on from here: no step of a run has such a number, and so their draws are their
/// own.
const ASIDE: u64 = 1 << 40;

impl<const D: usize> Run<'_, D> {
    /// The state at a time within the next step, if what reacts has to be taken there: a copy that goes
    /// part of the step. Otherwise nothing, and a look-through does.
    pub fn ahead(&self, due: &Due) -> Result<Option<Self>, RunError> {
        if due.fraction == 0.0 {
            return Ok(None);
        }
        if self.water.is_some() {
            return self.flow_ahead(due).map(Some);
        }
        if self.reactions.reactor.is_none() && self.exchanges.are_none() {
            return Ok(None);
        }
        let plan_step = step_length(&self.program.plan.time, due.steps);
        let Instant::Between(between) = self.instant(due) else { return Ok(None) };
        let mut ahead = self.copy();
        let t = due.steps as f64 * self.program.plan.time.step;
        ahead.reactions.begin_step(t, due.fraction * plan_step);
        if ahead.reactions.is_symmetric {
            ahead.settle_pending(due.steps)?;
        }
        let program = &self.program;
        let draws = Draws { width: self.width, walk: &self.walk, bridge: &self.bridge };
        parallel::for_each(&mut ahead.blocks.iter_mut().collect::<Vec<_>>(), &|_, block| {
            between.carry(program, &draws, block);
        });
        ahead.is_averaged = false;
        ahead.exchange_all(due.steps, due.fraction * plan_step)?;
        if program.is_coupled() {
            let still = program.mover.leap(0.0, 0.0);
            ahead.pass(Work { averages: true, ..Work::default() }, due.steps, still, &[])?;
        }
        if self.program.relaxes() {
            ahead.pending = Some(between.decays.clone());
        }
        ahead.reactions.end_step();
        ahead.settle_pending(due.steps)?;
        Ok(Some(ahead))
    }

    /// The same for parcels that come and go.
    ///
    /// - Equation: `X(t + f Δt) = X(t) + A f Δt + √(2D f Δt) ξ`, sides over `f Δt`, with draws of their own.
    /// - Symbols: `f` part of the step.
    /// - Range: as right in law as a step of that length.
    /// - Source: the Markov property of the walk.
    /// - Shape: a copy.
    fn flow_ahead(&self, due: &Due) -> Result<Self, RunError> {
        let mut ahead = self.copy();
        ahead.settle_pending(due.steps.saturating_sub(1))?;
        let t = due.steps as f64 * self.program.plan.time.step;
        let dt = due.fraction * step_length(&self.program.plan.time, due.steps);
        ahead.reactions.begin_step(t, dt);
        if ahead.reactions.is_symmetric {
            ahead.settle_pending(due.steps)?;
        }
        let first = due.steps + ASIDE;
        ahead.flow_on(Steps { first, end: first + 1, t, dt })?;
        ahead.exchange_all(due.steps, dt)?;
        let relaxes = ahead.program.relaxes();
        if relaxes || ahead.program.is_coupled() {
            let still = ahead.program.mover.leap(0.0, 0.0);
            ahead.pass(Work { averages: true, ..Work::default() }, due.steps, still, &[])?;
        }
        ahead.pending = relaxes.then(|| ahead.program.decays(dt));
        ahead.reactions.end_step();
        ahead.settle_pending(due.steps)?;
        Ok(ahead)
    }
}

//! Plan and seed in, snapshots out.
//!
//! Owns the run: blocks of particles through the stages of the plan. May use the plan, `state` and
//! `maths`. It deliberately knows no files and prints nothing.

mod ahead;
mod amount;
mod average;
mod calendar;
mod clock;
mod conserved;
mod control;
pub mod density;
mod error;
mod exchange;
mod initial;
mod mass;
mod mix;
mod observe;
mod parallel;
mod place;
mod program;
mod quasi;
mod react;
mod reactions;
mod run;
mod schedule;
mod sides;
pub mod snapshot;
mod step;
pub mod track;
mod walk;
mod water;

use crate::plan::Plan;
pub use control::{Control, Settings, Unattended};
pub use error::RunError;
pub use mass::Starts;
use snapshot::{Outcome, Snapshot};

/// Runs a plan and hands every snapshot to `sink`: those of one output in the order of time, those of one time in
/// the order of outputs. What passes a place between two steps is known, and handed out, after the second one.
///
/// The bytes of the snapshots depend on the plan alone: not on threads, not on other outputs.
pub fn run(
    plan: &Plan,
    settings: &Settings,
    control: &dyn Control,
    sink: &mut (dyn FnMut(Snapshot) -> Result<(), RunError> + Send),
) -> Result<Outcome, RunError> {
    let Some(n_threads) = settings.threads else {
        return run_here(plan, settings, control, sink);
    };
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(n_threads.max(1))
        .build()
        .map_err(|error| RunError::Threads(error.to_string()))?;
    pool.install(|| run_here(plan, settings, control, sink))
}

/// The number of axes is matched here, once.
fn run_here(
    plan: &Plan,
    settings: &Settings,
    control: &dyn Control,
    sink: &mut (dyn FnMut(Snapshot) -> Result<(), RunError> + Send),
) -> Result<Outcome, RunError> {
    if plan.carries_mass() {
        return match plan.axes.len() {
            1 => mass::run::<1>(plan, settings, control, sink),
            2 => mass::run::<2>(plan, settings, control, sink),
            3 => mass::run::<3>(plan, settings, control, sink),
            n => Err(program::unsound(&format!("{n} axes"))),
        };
    }
    match plan.axes.len() {
        0 => run::run::<0>(plan, settings, control, sink),
        1 => run::run::<1>(plan, settings, control, sink),
        2 => run::run::<2>(plan, settings, control, sink),
        3 => run::run::<3>(plan, settings, control, sink),
        n => Err(program::unsound(&format!("{n} axes"))),
    }
}

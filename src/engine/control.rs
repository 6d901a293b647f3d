//! How a caller follows and stops a run.
//!
//! Owns the settings and the line to the caller. May use `flow` and what starts are. It deliberately
//! prints nothing.

use super::mass::Starts;
use crate::flow::FlowSeries;

/// How a plan is run: threads and vector instructions change no byte of the results, half draws do.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Settings {
    /// Threads of a pool of its own; `None` takes the pool of the caller.
    pub threads: Option<usize>,
    /// Never use vector instructions beyond the baseline, to compare.
    pub is_narrow: bool,
    /// The noise of a step is the sum of two draws, those of the two half steps in a run of the same
    /// plan with half the step and without this: both runs then follow the same paths, and differ by
    /// what the step does to them alone.
    pub takes_half_draws: bool,
    /// Bytes of what is remembered of pairs of parcels, at most; `None` takes what is good. Without any, neighbours are
    /// looked for anew in every sum, to compare.
    pub most_pair_bytes: Option<usize>,
    /// The flows of the plan, one after another, where they have to be solved or read.
    pub flow: Option<FlowSeries>,
    /// Initial concentrations that other runs of the program may have integrated; `None` integrates them anew.
    pub starts: Option<Starts>,
}

/// Progress and Ctrl-C, asked once per step.
pub trait Control: Sync {
    fn step_done(&self, step: u64, n_steps: u64);
    fn is_cancelled(&self) -> bool;
}

/// Nobody is watching.
pub struct Unattended;

impl Control for Unattended {
    fn step_done(&self, _step: u64, _n_steps: u64) {}

    fn is_cancelled(&self) -> bool {
        false
    }
}

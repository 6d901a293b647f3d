//! How a caller follows and stops a run.
//!
//! Owns the settings and the line to the caller. May use nothing else of the crate. It deliberately
//! prints nothing.

/// What does not change a byte of the results.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Settings {
    /// Threads of a pool of its own; `None` takes the pool of the caller.
    pub threads: Option<usize>,
    /// Never use vector instructions beyond the baseline, to compare.
    pub is_narrow: bool,
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

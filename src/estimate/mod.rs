//! Error bars without a reference: what a run's own step, particles and bins do to its outputs.
//!
//! Owns the trial runs that are needed beside a run, and the arithmetic from their snapshots to error
//! bars; docs/methods.md derives it. May use the plan, the engine's words, `measure` and `table`. It deliberately
//! starts no run and writes no file: who asks for error bars runs the trials.

mod advice;
mod bars;
mod rows;
mod statistics;
mod trials;

pub use advice::{Advice, Remedy, advice};
pub use bars::bars;
pub use rows::rows;
pub use trials::{Trial, Trials};

use crate::plan::{OutputKind, Quantity};

/// The expected error of one quantity of one output, as the L2 norm that an error row has, in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorBar {
    /// Index into `plan.outputs`, and its kind.
    pub output_idx: usize,
    pub kind: OutputKind,
    pub quantity: Quantity,
    /// s; `None` for all times of the output together.
    pub t: Option<f64>,
    /// Values that were compared: bins that hold particles in all trials, times.
    pub n: u64,
    /// L2 norm of the result itself.
    pub size: f64,
    pub parts: Parts,
}

/// An error bar and its sources, as L2 norms. Systematic errors may cancel: `total²` is not the sum of
/// the squares of the sources, but of `particles`' noise and of the sum of the systematic fields.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Parts {
    pub total: f64,
    pub step: f64,
    pub particles: f64,
    /// `None` if bins could not be halved.
    pub bins: Option<f64>,
    /// What `total` would be with twice the particles, half the step, and twice the bins along each axis.
    pub remedied: [f64; 3],
}

impl ErrorBar {
    /// Of the result; `None` where that is zero.
    pub fn relative(&self) -> Option<f64> {
        (self.size > 0.0).then(|| self.parts.total / self.size)
    }
}

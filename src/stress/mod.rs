//! A scene under stress: its quantities multiplied by powers of ten, one at a time.
//!
//! Owns the trials and what is told of each. May use the plan and the engine. It deliberately keeps no
//! result but its size: trials are run small, to see whether they run at all.

mod knob;
mod trial;

pub use knob::Knob;
pub use trial::{Bounds, Fate, Trial, Verdict};

//! Chemistry on particles: rates, their integration over a step, and equilibrium.
//!
//! Owns what happens to the concentrations of one particle, many particles at a time. May use the words
//! and the plan. It deliberately knows no positions in memory, no zones and no bins: the engine hands it
//! columns of carried values and gets them back reacted.

mod aqueous;
mod closed;
pub mod equilibrium;
mod explicit;
mod integrate;
mod invariants;
pub mod laws;
mod matrix;
mod observed;
#[cfg(test)]
mod orders;
mod queue;
mod reactor;
mod reversal;
mod rosenbrock;

pub use observed::Observed;
pub use reactor::{Batch, Failure, Propagator, Reactor, Scratch, Why, Work};
pub use reversal::Reversal;

//! Runs of particles that carry mass.
//!
//! Owns populations, what enters and leaves, and the books of it. May use `track`, `flow` and the plan. It
//! deliberately knows no files.

mod births;
pub(super) mod book;
mod courant;
mod entry;
pub(super) mod fields;
pub(super) mod flock;
pub(super) mod gate;
mod in_time;
mod initial;
mod inlets;
pub(super) mod kernels;
mod march;
pub(super) mod media;
mod observe;
mod order;
mod pace;
mod parts;
pub(super) mod place;
mod pores;
mod reactions;
pub(super) mod release;
mod run;
mod running;
mod shape;
mod sides;
mod sources;
mod spots;
mod total;
mod turn;
mod units;
mod water;
mod wells;
pub(super) mod world;

pub use initial::Starts;
pub use media::run;
pub use shape::{PRODUCTS, dilution, product};

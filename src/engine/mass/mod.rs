//! Runs of particles that carry mass.
//!
//! Owns populations, what enters and leaves, and the books of it. May use `track`, `flow` and the plan. It
//! deliberately knows no files.

mod births;
mod book;
mod entry;
mod flock;
mod gate;
mod initial;
mod inlets;
mod march;
mod media;
mod observe;
mod parts;
mod place;
mod release;
mod run;
mod shape;
mod sides;
mod sources;
mod turn;
mod units;
mod water;
mod wells;
mod world;

pub use media::run;
pub use shape::{PRODUCTS, dilution, product};

//! Runs of particles that carry mass.
//!
//! Owns populations, what enters and leaves, and the books of it. May use `track`, `flow` and the plan. It
//! deliberately knows no files.

mod book;
mod entry;
mod flock;
mod gate;
mod media;
mod observe;
mod place;
mod release;
mod run;
mod shape;
mod water;
mod world;

pub use media::run;
pub use shape::{PRODUCTS, dilution, product};

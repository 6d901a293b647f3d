//! Runs of particles that carry mass.
//!
//! Owns populations, what enters and leaves, and the books of it. May use `track`, `flow` and the plan. It
//! deliberately knows no files.

mod book;
mod entry;
mod flock;
mod observe;
mod place;
mod release;
mod run;
mod world;

pub use run::run;

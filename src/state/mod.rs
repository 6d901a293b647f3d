//! Where things are: particles in blocks, the grid of bins, the streams of random words.
//!
//! Owns the arrays of a run and how space is cut. May use `maths`. It deliberately changes nothing
//! over time: the stages of `engine` do.

pub mod grid;
pub mod particles;
pub mod stream;

//! Random walks in media that vary from place to place.
//!
//! Owns the displacement of particles in lanes of 64, their walls and what they cross. May use `flow`,
//! `maths`, `state` and the plan's words. It deliberately knows no storage: lanes are filled and emptied by
//! others, in any order.

pub mod cells;
pub mod drains;
pub mod duals;
pub mod fates;
pub mod formula;
pub mod interfaces;
pub mod lanes;
pub mod medium;
pub mod monitors;
pub mod noise;
pub mod paths;
pub mod skew;
pub mod tracker;
pub mod trips;
pub mod turning;
pub mod uneven;
pub mod uniform;
pub mod walls;

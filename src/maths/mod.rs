//! The fixed library of functions: the same bits on every x86-64 machine.
//!
//! Owns every transcendental function that the crate calls. May use nothing else of the crate. It
//! deliberately never calls the system's library (`f64::exp` and friends pick code by CPU).

pub mod chacha;
pub mod double;
pub mod exact;
pub mod fourier;
pub mod interval;
pub mod normal;
pub mod operator;
pub mod order;
pub mod pentadiagonal;
pub mod quadrature;
pub mod scalar;
pub mod special;
pub mod student;
pub mod vector;
pub mod wide;

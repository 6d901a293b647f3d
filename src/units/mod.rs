//! Dimensions, units and exact conversion of written quantities to SI.
//!
//! Owns the table of units; prefixes are computed. May use nothing else of the crate.
//! It deliberately does not know what a quantity is for.

pub mod dimension;
pub use dimension::Dimension;

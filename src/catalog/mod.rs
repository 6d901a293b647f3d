//! What newcomers extend: one file per item, one line in its `mod.rs`.
//!
//! Owns formulas, their arguments and their sources. May use the words only. It deliberately runs nothing.

pub mod kernel;
pub mod rate;
pub mod reference;

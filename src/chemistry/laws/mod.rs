//! Rate laws as programs over many particles, with exact derivatives.
//!
//! Owns the way from the plan's tape to a program: recipes of species put in, common parts shared,
//! constants folded, derivatives taken symbolically. May use `maths` and the plan. It deliberately
//! integrates nothing.

mod code;
mod derive;
mod graph;
mod system;

pub use code::{Code, LANES, Lane};
pub use graph::{Graph, Id};
pub use system::{Basis, Linear, System};

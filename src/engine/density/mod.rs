//! Densities of particles by kernels on a lattice: how much there is, how wide kernels have to be for it, and how wrong it is.
//!
//! Owns histograms, kernels of one size, and kernels that differ from cell to cell in size and shape. May use the fixed maths
//! and `parallel`. It deliberately knows no plan: particles come as counts in cells.

mod adaptive;
mod bands;
mod choice;
mod classes;
mod coarser;
mod curvature;
mod direct;
mod ellipse;
mod fourth;
mod frame;
mod global;
mod held;
mod kinds;
mod ladder;
pub mod lattice;
mod levels;
mod limits;
mod local;
mod oriented;
mod patch;
mod projection;
mod rough;
mod settled;
mod smoothed;
mod spectrum;
mod stencil;
mod tally;
mod taps;

pub use adaptive::estimate;
pub use fourth::WIDER;
pub use global::{Global, Rule, Trouble, global, histogram};
pub use kinds::{Adaptive, Cell, Estimate, Order, Shape, Start, Variant};
pub use lattice::{End, Lattice};
pub use local::Orientation;
pub use projection::Projection;
pub use tally::{Tally, Weighing};

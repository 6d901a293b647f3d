//! Expressions compiled to straight-line code over blocks of points.
//!
//! Owns the tape and its evaluation. May use `maths`. It deliberately has no branches: `if` selects.

mod check;
pub mod dual;
mod evaluate;

pub use crate::maths::operator::{Binary, Unary};
use serde::{Deserialize, Serialize};

/// A register: the result of the operation with that index.
pub type Register = u16;

/// Straight-line program; operation `k` writes register `k`; the last register is the result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tape {
    pub operations: Vec<Operation>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Operation {
    Constant(f64),
    /// Input column (positions first, then time; later concentrations).
    Input(u16),
    Unary(Unary, Register),
    Binary(Binary, Register, Register),
    /// `condition != 0 ? then : otherwise`
    Select(Register, Register, Register),
}

//! Expressions compiled to straight-line code over blocks of points.
//!
//! Owns the tape and its evaluation. May use `maths`. It deliberately has no branches: `if` selects.

mod check;
pub mod dual;
mod evaluate;
mod kinks;

use crate::data::{Beyond, Table, table};
pub use crate::maths::operator::{Binary, Unary};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// A register: the result of the operation with that index.
pub type Register = u16;

/// Straight-line program; operation `k` writes register `k`; the last register is the result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tape {
    pub operations: Vec<Operation>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Operation {
    Constant(f64),
    /// Input column (positions first, then time; later concentrations).
    Input(u16),
    Unary(Unary, Register),
    Binary(Binary, Register, Register),
    /// `condition != 0 ? then : otherwise`
    Select(Register, Register, Register),
    Table(Lookup),
}

impl Tape {
    /// The same times a factor.
    pub fn scale(&mut self, factor: f64) {
        let result = (self.operations.len() - 1) as Register;
        self.operations.push(Operation::Constant(factor));
        self.operations.push(Operation::Binary(Binary::Multiply, result, result + 1));
    }
}

/// A table of numbers at up to three coordinates; registers beyond those of the table count for nothing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lookup {
    #[serde(with = "table::shared")]
    pub table: Arc<Table>,
    pub at: [Register; 3],
    #[serde(default)]
    pub beyond: Beyond,
}

impl Lookup {
    /// The registers that it reads.
    pub fn reads(&self) -> &[Register] {
        &self.at[..self.table.n_axes().min(3)]
    }
}

impl Operation {
    /// The registers that it reads.
    pub fn reads(&self) -> Vec<Register> {
        match self {
            Self::Constant(_) | Self::Input(_) => Vec::new(),
            Self::Unary(_, a) => vec![*a],
            Self::Binary(_, a, b) => vec![*a, *b],
            Self::Select(a, b, c) => vec![*a, *b, *c],
            Self::Table(lookup) => lookup.reads().to_vec(),
        }
    }
}

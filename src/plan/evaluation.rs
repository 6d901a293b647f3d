//! What is computed from the results: references and measures. Apart from the plan, because a run
//! need not be repeated when only these change.
//!
//! Owns their resolved forms. May use `plan`. It deliberately evaluates nothing: `measure` does.

use super::tape::{Binary, Tape, Unary};
use super::{OutputKind, Quantity};
pub use crate::scenario::{Fact, Norm, SAME_TIME};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evaluation {
    pub references: Vec<Reference>,
    pub measures: Vec<Measure>,
}

/// A solution that results are held against.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    pub name: String,
    /// The kinds of output that it is compared with; profile and map for a concentration.
    pub outputs: Vec<OutputKind>,
    pub target: Quantity,
    pub solution: Solution,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Solution {
    /// Inputs of the tape are x, y, z, t.
    Expression(Tape),
    /// An item of `catalog::reference` with its SI arguments in order.
    Catalogue { name: String, arguments: Vec<f64> },
}

/// A named number computed from results and references.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measure {
    pub name: String,
    pub value: Scalar,
    /// Restrict fields to bins whose centre lies in `(axis index, low, high)`.
    pub over: Option<(usize, f64, f64)>,
    /// Restrict fields to these times; absent means all times of the output.
    pub times: Option<Vec<f64>>,
    /// SI unit of the result, for the column.
    pub unit: String,
    pub doc: Option<String>,
}

/// An expression whose value is one number.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Scalar {
    Number(f64),
    Fact(Fact),
    /// On the bins and times of an output of the plan, given by its index.
    Norm(Norm, usize, Box<Field>),
    Unary(Unary, Box<Scalar>),
    Binary(Binary, Box<Scalar>, Box<Scalar>),
}

impl Scalar {
    /// Whether it hangs on the clock: two runs of one plan give other values.
    pub fn is_timed(&self) -> bool {
        match self {
            Self::Fact(fact) => matches!(fact, Fact::WallTime | Fact::CpuTime),
            Self::Number(_) | Self::Norm(..) => false,
            Self::Unary(_, operand) => operand.is_timed(),
            Self::Binary(_, left, right) => left.is_timed() || right.is_timed(),
        }
    }
}

/// An expression whose value is a field over the bins and times of one output.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Field {
    Number(f64),
    /// Centre of the bin along axis 0, 1, 2 for x, y, z; m.
    Position(usize),
    /// From the output of that kind with the quantity and with the bins and times of the norm's.
    Output(OutputKind, Quantity),
    /// Index into `Evaluation::references`.
    Reference(usize),
    Unary(Unary, Box<Field>),
    Binary(Binary, Box<Field>, Box<Field>),
}

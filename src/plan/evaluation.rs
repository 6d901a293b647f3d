//! What is computed from the results: references and measures. Apart from the plan, because a run
//! need not be repeated when only these change.
//!
//! Owns their resolved forms. May use `plan`. It deliberately evaluates nothing: `measure` does.

use super::tape::{Binary, Tape, Unary};
use super::{OutputKind, Quantity};
use crate::maths::order::order;
pub use crate::scenario::{Fact, Norm, SAME_TIME};
use serde::{Deserialize, Serialize};

#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Evaluation {
    pub references: Vec<Reference>,
    pub measures: Vec<Measure>,
}

impl Evaluation {
    /// The measures by number, each after those that it names. Measures of a circle, which no scene has
    /// but a file may, come in some order.
    pub fn order(&self) -> Vec<usize> {
        let n_measures = self.measures.len();
        let needs = self.measures.iter().map(|measure| {
            let mut needs = Vec::new();
            measure.value.measures(&mut needs);
            needs.retain(|&idx| idx < n_measures);
            needs
        });
        order(&needs.collect::<Vec<_>>()).items
    }

    /// Whether a measure speaks of the flow in cells.
    pub fn has_flow(&self) -> bool {
        self.measures.iter().any(|measure| measure.value.has_flow())
    }

    /// For each measure whether it hangs on the clock: two runs of one plan give other values.
    pub fn is_timed(&self) -> Vec<bool> {
        let mut is_timed = vec![false; self.measures.len()];
        for idx in self.order() {
            is_timed[idx] = self.measures[idx].value.is_timed(&is_timed);
        }
        is_timed
    }
}

/// A solution that results are held against.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    pub name: String,
    /// The kinds of output that it is compared with; profile and map for a concentration.
    pub outputs: Vec<OutputKind>,
    pub target: Quantity,
    /// Which number of a row it predicts.
    #[serde(default, skip_serializing_if = "is_first")]
    pub number: usize,
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

#[allow(clippy::trivially_copy_pass_by_ref)] // As serde calls it.
fn is_first(number: &usize) -> bool {
    *number == 0
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
    /// The value of another measure, by its index into `Evaluation::measures`.
    Measure(usize),
    /// On the bins and times of an output of the plan, given by its index.
    Norm(Norm, usize, Box<Field>),
    Unary(Unary, Box<Scalar>),
    Binary(Binary, Box<Scalar>, Box<Scalar>),
}

impl Scalar {
    /// Whether it hangs on the clock, where that is known of the measures that it names.
    fn is_timed(&self, measures: &[bool]) -> bool {
        match self {
            Self::Fact(fact) => matches!(fact, Fact::WallTime | Fact::CpuTime),
            Self::Measure(idx) => measures.get(*idx).copied().unwrap_or(false),
            Self::Number(_) | Self::Norm(..) => false,
            Self::Unary(_, operand) => operand.is_timed(measures),
            Self::Binary(_, left, right) => left.is_timed(measures) || right.is_timed(measures),
        }
    }

    fn has_flow(&self) -> bool {
        match self {
            Self::Fact(fact) => fact.is_of_cells(),
            Self::Number(_) | Self::Norm(..) | Self::Measure(_) => false,
            Self::Unary(_, operand) => operand.has_flow(),
            Self::Binary(_, left, right) => left.has_flow() || right.has_flow(),
        }
    }

    /// Adds the measures that it names.
    fn measures(&self, list: &mut Vec<usize>) {
        match self {
            Self::Measure(idx) => list.push(*idx),
            Self::Number(_) | Self::Fact(_) | Self::Norm(..) => {}
            Self::Unary(_, operand) => operand.measures(list),
            Self::Binary(_, left, right) => {
                left.measures(list);
                right.measures(list);
            }
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
    /// The same of a number of its rows that is not the first.
    Column(OutputKind, Quantity, usize),
    /// Index into `Evaluation::references`.
    Reference(usize),
    Unary(Unary, Box<Field>),
    Binary(Binary, Box<Field>, Box<Field>),
}

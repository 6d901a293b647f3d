//! The operators of expressions, and their value on numbers.
//!
//! One definition serves constant folding in the scenario and evaluation in tapes, so that a
//! constant and a column give the same bits.

use super::{scalar, vector};
use serde::{Deserialize, Serialize};

/// Operators of one argument. Logic takes and gives 1 and 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Unary {
    Negate,
    Not,
    Abs,
    Sqrt,
    Exp,
    Ln,
    Log10,
    Sin,
    Cos,
    Tanh,
    Erf,
    Erfc,
}

impl Unary {
    #[inline(always)]
    pub fn apply(self, a: f64) -> f64 {
        match self {
            Unary::Negate => -a,
            Unary::Not => truth(a == 0.0),
            Unary::Abs => a.abs(),
            Unary::Sqrt => a.sqrt(),
            Unary::Exp => vector::exp(a),
            Unary::Ln => scalar::ln(a),
            Unary::Log10 => scalar::log10(a),
            Unary::Sin => scalar::sin(a),
            Unary::Cos => scalar::cos(a),
            Unary::Tanh => scalar::tanh(a),
            Unary::Erf => scalar::erf(a),
            Unary::Erfc => scalar::erfc(a),
        }
    }
}

/// Operators of two arguments. Comparisons and logic give 1 or 0.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Power,
    Minimum,
    Maximum,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    Equal,
    NotEqual,
    And,
    Or,
}

impl Binary {
    #[inline(always)]
    pub fn apply(self, a: f64, b: f64) -> f64 {
        match self {
            Binary::Add => a + b,
            Binary::Subtract => a - b,
            Binary::Multiply => a * b,
            Binary::Divide => a / b,
            Binary::Power => power(a, b),
            // A NaN must not be swallowed: it is an error that the run reports.
            Binary::Minimum if a.is_nan() || b.is_nan() => f64::NAN,
            Binary::Maximum if a.is_nan() || b.is_nan() => f64::NAN,
            Binary::Minimum => a.min(b),
            Binary::Maximum => a.max(b),
            Binary::Less => truth(a < b),
            Binary::LessEqual => truth(a <= b),
            Binary::Greater => truth(a > b),
            Binary::GreaterEqual => truth(a >= b),
            Binary::Equal => truth(a == b),
            Binary::NotEqual => truth(a != b),
            Binary::And => truth(a != 0.0 && b != 0.0),
            Binary::Or => truth(a != 0.0 || b != 0.0),
        }
    }
}

#[inline(always)]
fn truth(value: bool) -> f64 {
    f64::from(u8::from(value))
}

/// `a^b`; small whole powers by multiplication, which is exact where the powers are.
fn power(a: f64, b: f64) -> f64 {
    match b {
        2.0 => a * a,
        3.0 => a * a * a,
        4.0 => (a * a) * (a * a),
        _ => scalar::pow(a, b),
    }
}

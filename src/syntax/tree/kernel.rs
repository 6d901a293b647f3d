//! Kernels as they were written: radial ones of exchanges, and what densities of particles are found by.

use super::{Expr, Name, Range, Text};

/// `kernel W(q) = … support 2`
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    pub name: Name,
    /// What the distance over the bandwidth is called.
    pub parameter: Name,
    pub value: Expr,
    pub support: Expr,
    pub doc: Option<Text>,
}

/// `kernel gaussian adaptive { bandwidth 0.2 .. 5 m, grid 0.5 m, correct boundaries }`
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    pub name: Name,
    /// `adaptive`, `global`, `fixed`
    pub manner: Option<Name>,
    pub entries: Vec<EstimateEntry>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct EstimateEntry {
    pub name: Name,
    pub value: EstimateValue,
}

#[derive(Debug, Clone, PartialEq)]
pub enum EstimateValue {
    One(Expr),
    Range(Range),
    /// `400 x 160`
    Counts(Vec<Expr>),
}

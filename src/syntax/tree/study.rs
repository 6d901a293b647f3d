//! The statements of studies: used scenes, sweeps, reports.
//!
//! Owns their shapes. May use the tree. It deliberately resolves no name.

use super::{Expr, Name, Range, Text};
use crate::source::{Span, Spanned};

#[derive(Debug, Clone, PartialEq)]
pub struct Use {
    /// Relative to the folder of the file that uses it.
    pub path: Text,
    pub alias: Name,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    pub name: Name,
    /// The alias of a used scene; absent means this one.
    pub of: Option<Name>,
    pub entries: Vec<SweepEntry>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum SweepEntry {
    /// `step 1 s, 2 s`
    Axis(SweepAxis),
    /// `zip { step 1 s, 2 s  bins 100, 200 }`: axes that go together.
    Zip(Span, Vec<SweepAxis>),
    Replicates(Replicates),
    Seed(Spanned<u64>),
    /// `common_random_numbers`
    Common(Span),
    /// `skip when particles / step > 1e9 /s`
    Skip(Span, Expr),
    Expect(Expect),
}

#[derive(Debug, Clone, PartialEq)]
pub struct SweepAxis {
    /// A parameter, or a word such as `particles`; with dots where it is that of a used scene.
    pub target: Name,
    pub values: Vec<SweepValue>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum SweepValue {
    /// One value, or a call of `linspace` or `logspace`.
    One(Expr),
    /// `1 s .. 16 s by factor 2`
    Progression { span: Span, range: Range, is_factor: bool, by: Expr },
}

/// `replicates 8`, or `replicates 8 .. 64 until stderr(err) < 5 % of mean(err)`
#[derive(Debug, Clone, PartialEq)]
pub struct Replicates {
    pub span: Span,
    pub least: Expr,
    pub until: Option<(Expr, Criterion)>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Criterion {
    /// `stderr`
    pub function: Name,
    pub measure: Name,
    pub threshold: Expr,
    /// `mean`
    pub of: Name,
    pub of_measure: Name,
}

/// `expect order(err, step) in 0.9 .. 1.1 when particles > 1e5`, or `expect leak < 1e-12`
#[derive(Debug, Clone, PartialEq)]
pub struct Expect {
    pub span: Span,
    pub value: Expr,
    pub range: Option<Range>,
    pub when: Option<Expr>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// `work_precision`, `convergence`
    pub kind: Name,
    pub measure: Name,
    pub against: Vec<Name>,
    /// What makes a series of its own.
    pub by: Vec<Name>,
}

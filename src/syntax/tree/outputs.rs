//! The tree of outputs: what is observed, when and where.
//!
//! Owns these shapes. May use the other shapes of the tree. It deliberately knows no physics.

use super::{Axis, Expr, Name, Range};
use crate::source::{Span, Spanned};

#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// A catalogue name: `profile`, `total`, `breakthrough`, …
    pub kind: Name,
    pub species: Vec<Name>,
    pub times: Option<Times>,
    /// `along y`
    pub along: Option<Name>,
    /// `on 200 x 80`
    pub grid: Vec<Expr>,
    /// `at x = 10 m`, `at right`, `in box(…)`
    pub place: Option<Place>,
    /// `resident`, `flux_weighted`
    pub averaging: Option<Name>,
    /// The text after `in`: a unit, as written.
    pub unit: Option<Spanned<String>>,
}

/// Where an output is taken.
#[derive(Debug, Clone, PartialEq)]
pub enum Place {
    /// With a range along each axis that limits it.
    Plane(Name, Expr, Vec<Axis>),
    Side(Name, Vec<Axis>),
    Box(Span, Vec<Range>),
    Well(Name),
}

impl Place {
    pub fn span(&self) -> Span {
        match self {
            Self::Plane(name, at, _) => name.span.to(at.span),
            Self::Side(name, _) | Self::Well(name) => name.span,
            Self::Box(span, _) => *span,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum Times {
    /// `at t = a, b, …`
    List(Vec<Expr>),
    /// `every e`
    Every(Expr),
}

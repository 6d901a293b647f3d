//! Transport as a scene says it: porosity, flow, dispersion, sides, sources, masses.
//!
//! Owns the types, and in the files beside it the checks. May use the scenario's slots and expressions. It
//! deliberately solves and samples nothing: `plan` and `flow` do.

pub(super) mod change;
mod cloud;
pub(super) mod darcy;
pub(super) mod dispersion;
pub(super) mod file;
mod file_columns;
pub(super) mod flow;
pub mod flow_file;
pub(super) mod lognormal;
pub(super) mod masses;
pub(super) mod restriction;
pub(super) mod sides;
pub(super) mod source;

pub use file::FileFlow;
pub use sides::side_names;

use super::choice::Covariance;
use super::expression::Expr;
use crate::data::Cloud;
use crate::source::Span;
use std::sync::Arc;

/// How the water moves, in the resting frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Flow {
    /// m/s along x, y, z
    Uniform([f64; 3]),
    /// m/s, an expression of place and time for each axis of the domain.
    Expression(Vec<Expr>, Changes),
    Darcy(Box<Darcy>),
    File(Box<FileFlow>),
}

/// What is solved for the flow.
#[derive(Debug, Clone, PartialEq)]
pub struct Darcy {
    /// Along each axis of the domain.
    pub cells: Vec<usize>,
    pub cells_span: Span,
    /// Per axis of the domain: the lower side, the upper side.
    pub sides: Vec<[DarcySide; 2]>,
    pub conductivity: Conductivity,
    pub conductivity_span: Span,
    /// Along each axis of the domain over that along the first.
    pub anisotropy: Vec<f64>,
    pub wells: Vec<Well>,
    pub changes: Changes,
}

/// Times at which a flow that changes is taken anew, beside those at which its expressions switch.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Changes {
    /// s
    pub at: Vec<f64>,
    pub every: Option<f64>,
    /// The word; absent if the scene does not say.
    pub span: Option<Span>,
}

/// What the water does at a side; expressions are of the time.
#[derive(Debug, Clone, PartialEq)]
pub enum DarcySide {
    /// m
    Head(Expr),
    /// Specific discharge into the domain, m/s.
    Flux(Expr),
    NoFlow,
    Periodic,
}

impl DarcySide {
    /// The head or the flux.
    pub fn value(&self) -> Option<&Expr> {
        match self {
            Self::Head(value) | Self::Flux(value) => Some(value),
            Self::NoFlow | Self::Periodic => None,
        }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum Conductivity {
    /// m/s, over the place.
    Expression(Expr),
    Lognormal {
        geometric_mean: f64,
        /// Of ln K.
        variance: f64,
        covariance: Covariance,
        /// Along each axis of the domain, m.
        lengths: Vec<f64>,
        /// That of the scene if absent.
        seed: Option<u64>,
    },
}

/// A well: a point, or a line along the last axis of the domain.
#[derive(Debug, Clone, PartialEq)]
pub struct Well {
    pub name: String,
    pub low: [f64; 3],
    pub high: [f64; 3],
    /// Water put in, m³/s, per m² or m with fewer axes, over time.
    pub rate: Expr,
    /// Concentrations in that water, over time; 0 for all other species.
    pub carrying: Vec<(usize, Expr)>,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Dispersion {
    /// m²/s
    Tensor([[f64; 3]; 3]),
    /// m²/s, the same in all directions, over the place.
    Isotropic(Expr),
    /// Lengths in m, molecular in m²/s.
    Parts { longitudinal: f64, transverse: f64, transverse_vertical: f64, molecular: f64 },
}

/// A part of a side, or all of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch {
    /// Of the side's name in its statement.
    pub span: Span,
    /// `(axis x, y, z, low, high)`; none for what is left of the side.
    pub limits: Vec<(usize, f64, f64)>,
    pub rule: SideRule,
    /// Which `boundary` statement it is of.
    pub(super) statement: usize,
}

/// What happens at a side.
#[derive(Debug, Clone, PartialEq)]
pub enum SideRule {
    Reflect,
    Periodic,
    Open,
    Absorb,
    /// m/s
    Partial(f64),
    Outflow,
    /// Concentrations of species in the water that enters; 0 for all others.
    Inflow(Vec<(usize, Expr)>),
    /// Concentrations of species that are held; 0 for all others.
    Held(Vec<(usize, Expr)>),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Source {
    pub name: String,
    pub span: Span,
    pub species: usize,
    pub region: Region,
    pub strength: Strength,
    /// s; nothing for what is put in at once.
    pub during: Option<(f64, f64)>,
}

/// Places along x, y, z.
#[derive(Debug, Clone, PartialEq)]
pub enum Region {
    Point([f64; 3]),
    Line([f64; 3], [f64; 3]),
    Box([f64; 3], [f64; 3]),
    /// Centre and standard deviation.
    Gaussian([f64; 3], [f64; 3]),
    /// Rows of a table: coordinates along the axes of the domain, and what each gives.
    Table(Arc<Cloud>),
}

#[derive(Debug, Clone, PartialEq)]
pub enum Strength {
    /// mol or kg, per m² or m with fewer axes.
    Pulse(f64),
    /// The same per s, over time.
    Rate(Expr),
    /// mol/m³ or kg/m³, over time.
    Held(Expr),
}

/// How particles that carry mass are shared among species.
#[derive(Debug, Clone, PartialEq)]
pub enum Shares {
    /// By their masses.
    ByMass,
    /// For each species of the scene.
    Given(Vec<u64>),
}

/// Criteria of `step auto`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Auto {
    pub courant: f64,
    pub dispersion: f64,
    /// Bound of `|∇r · ν| Δt`; where there is none it is not asked for.
    pub reaction: Option<f64>,
}

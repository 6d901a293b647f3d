//! The scenario: what a scene means. Names resolved, dimensions checked, everything in SI.
//!
//! Owns the resolved types and the phase that builds them from the tree. May use the words, the
//! catalogue and `syntax`. It deliberately decides nothing numerical: `plan` does.

mod call;
mod check;
mod chemistry;
mod choice;
mod collect;
pub mod condition;
mod data;
mod data_files;
mod equilibrium;
pub mod estimation;
pub mod exchange;
mod exchange_places;
pub mod expression;
mod fields;
mod flow_table;
mod geometry;
mod measure;
mod model;
pub mod numbers;
mod observe;
mod places;
mod point;
mod qualifiers;
mod quantity;
mod rates;
mod reactions;
mod reference;
mod restriction;
mod results;
mod scope;
mod settings;
mod shown;
mod slot;
mod station;
pub mod sweep;
pub mod transport;
mod unused;
mod used;
mod zones;

use crate::source::{Span, Spanned};
use crate::units::Dimension;
use expression::Expr;
use transport::{Auto, Dispersion, Flow, Patch, Shares, Source};

pub use choice::{
    Activity, Covariance, Integration, Integrator, Normalisation, OutputKind, Placement, Side, Splitting,
    Station,
};
pub use collect::resolve;
pub use data_files::wanted_data;
pub use geometry::MAX_BINS;
pub use measure::{Fact, Field, FieldTarget, Norm, Scalar};
pub use model::MAX_STEPS;
pub use places::SAME_TIME;
pub use used::{MAX_USES, Used, Uses, resolve_all, sweeps, wanted_files};

/// What the command line adds to a scene.
#[derive(Debug, Clone, Default)]
pub struct Settings {
    /// `--set name=value`, in order.
    pub set: Vec<(String, String)>,
    /// `--seed`, or the seed of a point and replicate.
    pub seed: Option<u64>,
    /// The sweep whose scene is meant, where a file uses several; the first one if absent.
    pub sweep: Option<String>,
    /// What a point of a sweep sets: these expressions stand in place of the scene's own. A point has no
    /// sweeps.
    pub point: Option<Vec<(sweep::Target, crate::syntax::tree::Expr)>>,
}

/// A whole scene, resolved.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    pub title: Option<String>,
    pub citations: Vec<String>,
    /// `--set name=value`, in order.
    pub settings: Vec<(String, String)>,
    pub parameters: Vec<Parameter>,
    pub species: Vec<Species>,
    pub reactions: Vec<Reaction>,
    pub chemistry: Chemistry,
    pub domain: Domain,
    /// Porosity over the place; absent without a `medium` statement.
    pub medium: Option<Spanned<Expr>>,
    /// Absent without a `flow` statement.
    pub flow: Option<Spanned<Flow>>,
    /// Absent without a `dispersion` statement.
    pub dispersion: Option<Spanned<Dispersion>>,
    pub sources: Vec<Source>,
    pub mixing: Option<Mixing>,
    /// Absent without an `exchange` statement.
    pub exchange: Option<exchange::Exchange>,
    /// The scene's own kernels.
    pub kernels: Vec<exchange::Kernel>,
    /// What zones exchange with, if it is not the mean of a bin.
    pub averaging: Option<exchange::Averaging>,
    /// How concentrations of masses are found; absent without a statement.
    pub estimation: Option<estimation::Estimation>,
    /// Bins of the averages, one count per axis of the domain.
    pub bins: Option<Spanned<Vec<usize>>>,
    pub particles: Particles,
    pub run: Run,
    pub seed: u64,
    pub outputs: Vec<Output>,
    /// Where a table of the flow's cells is asked for.
    pub flow_table: Option<Span>,
    pub references: Vec<Reference>,
    pub measures: Vec<Measure>,
    pub sweeps: Vec<sweep::Sweep>,
    pub reports: Vec<sweep::Report>,
}

impl Scenario {
    /// The reaction of a plan as it is written: one that goes both ways is two in a plan.
    pub fn reaction(&self, name: &str) -> Option<&Reaction> {
        let own = name.split('.').next().unwrap_or(name);
        let named = |name: &str| self.reactions.iter().find(|reaction| reaction.name == name);
        named(name).or_else(|| named(own))
    }

    /// Whether fluid, frame or exchange between zones could carry anything away from where it is.
    pub fn has_transport(&self) -> bool {
        let flows = match self.flow.as_ref().map(|flow| &flow.value) {
            None => false,
            Some(Flow::Uniform(velocity)) => velocity.iter().any(|v| *v != 0.0),
            Some(Flow::Expression(..) | Flow::Darcy(_) | Flow::File(_)) => true,
        };
        let disperses = match self.dispersion.as_ref().map(|dispersion| &dispersion.value) {
            None => false,
            Some(Dispersion::Tensor(tensor)) => tensor.iter().flatten().any(|entry| *entry != 0.0),
            Some(Dispersion::Isotropic(_)) => true,
            Some(Dispersion::Parts { longitudinal, transverse, transverse_vertical, molecular }) => {
                let along = [longitudinal, transverse, transverse_vertical].iter().any(|part| **part != 0.0);
                *molecular != 0.0 || (along && flows)
            }
        };
        let is_moving = self.domain.frame.iter().any(|v| *v != 0.0);
        flows || is_moving || self.mixing.is_some() || disperses
    }
}

/// A parameter as it was set, for the record of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    pub name: String,
    /// In SI.
    pub value: f64,
    pub dimension: Dimension,
    /// The unit as it was written; absent for a value that is worked out.
    pub unit: Option<String>,
    /// Whether the command line set it.
    pub is_set: bool,
    pub doc: Option<String>,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Species {
    pub name: String,
    pub doc: Option<String>,
    pub span: Span,
    /// Amount (mol/m³) or mass (kg/m³).
    pub dimension: Dimension,
    /// Initial concentration over x, y, z; may refer to other species' initial concentrations.
    pub initial: Expr,
    /// Whether it stays where it is; true of minerals, too.
    pub is_immobile: bool,
    /// A pure phase: its activity is 1.
    pub is_mineral: bool,
    pub charge: Option<f64>,
    /// Ion-size parameter å, m.
    pub ion_size: Option<f64>,
    /// Total over mobile concentration.
    pub retardation: f64,
    /// Molecular diffusion of its own, m²/s.
    pub diffusion: Option<f64>,
    /// Where either of the two is given.
    pub own_transport: Option<Span>,
}

/// One direction of a reaction: `A <-> B @ forward …, backward …` makes two of these.
#[derive(Debug, Clone, PartialEq)]
pub struct Reaction {
    pub name: String,
    pub span: Span,
    /// `(species, ν > 0)`
    pub reactants: Vec<(usize, f64)>,
    pub products: Vec<(usize, f64)>,
    pub rate: Rate,
    pub rate_span: Span,
}

/// How fast a reaction goes.
#[derive(Debug, Clone, PartialEq)]
pub enum Rate {
    /// Complete and irreversible, before anything else happens.
    Instant,
    /// `k Π c^order`, the orders being the coefficients of the reactants; k without species.
    MassAction(Expr),
    /// The rate itself, concentration/s; species stand for current concentrations.
    Law(Expr),
    /// `K = Π products^ν / Π reactants^ν` in (mol/m³)^Δν, minerals not counted.
    Equilibrium(f64),
}

/// How reactions are worked out: the `chemistry` statement, or its defaults.
#[derive(Debug, Clone, PartialEq)]
pub struct Chemistry {
    /// Absent without the statement.
    pub span: Option<Span>,
    pub tolerance: f64,
    /// In SI, for the species of this dimension.
    pub floor: Option<(f64, Dimension)>,
    pub splitting: Splitting,
    pub activity: Activity,
    pub integrator: Integrator,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Domain {
    pub span: Span,
    pub axes: Vec<Axis>,
    /// Velocity of the frame, m/s; zero for a resting one.
    pub frame: [f64; 3],
}

#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// 0, 1, 2 for x, y, z.
    pub index: usize,
    pub low: f64,
    pub high: f64,
    pub low_side: Side,
    pub high_side: Side,
    /// Of the lower and the upper side: parts first, what is left of it last.
    pub patches: [Vec<Patch>; 2],
    /// Where the `boundary` statements name them.
    pub low_side_span: Span,
    pub high_side_span: Span,
    pub span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Mixing {
    pub span: Span,
    pub zones: Vec<Zone>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Zone {
    pub name: String,
    pub span: Span,
    pub fraction: f64,
    /// χ in 1/s; `None` is instant.
    pub rate: Option<f64>,
    pub rate_span: Span,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Particles {
    pub span: Span,
    pub kind_span: Span,
    pub count: u64,
    pub count_span: Span,
    pub placement: Placement,
    /// Of ordered ones: how far each may lie from its place, in their distances.
    pub disorder: f64,
    /// Of particles that carry mass; absent for fluid.
    pub shares: Option<Shares>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    pub span: Span,
    pub duration: f64,
    /// The whole duration where the plan chooses the step.
    pub step: f64,
    pub auto: Option<Auto>,
    pub step_span: Span,
    pub are_normals_double: bool,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    pub span: Span,
    pub kind: OutputKind,
    /// Species of the list; for pairs the pairs are made from it.
    pub species: Vec<usize>,
    pub pairs: Vec<(usize, usize)>,
    pub times: Vec<f64>,
    /// Axis index (0, 1, 2) of a profile or covariance.
    pub along: Option<usize>,
    /// Bins per axis of the domain; empty where nothing is binned.
    pub bins: Vec<usize>,
    pub bins_span: Span,
    /// Where a breakthrough or a first passage is taken.
    pub station: Option<Station>,
    /// Unit text and factor to SI.
    pub unit: Option<(String, f64)>,
}

#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    pub name: String,
    pub span: Span,
    pub target: Target,
    pub solution: Solution,
}

/// What a reference predicts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    Concentration(usize),
    Covariance(usize, usize),
    Mixing(usize, usize),
    /// One number over time: a total, a breakthrough, …; of an output in rows which of its numbers.
    Course(OutputKind, usize, usize),
}

#[derive(Debug, Clone, PartialEq)]
pub enum Solution {
    /// Over x, y, z and t.
    Expression(Expr),
    /// Item of the catalogue with its SI arguments in order.
    Catalogue { name: &'static str, arguments: Vec<f64> },
}

#[derive(Debug, Clone, PartialEq)]
pub struct Measure {
    pub name: String,
    pub span: Span,
    pub value: Scalar,
    pub over: Option<(usize, f64, f64)>,
    pub times: Option<Vec<f64>>,
    pub dimension: Dimension,
    pub doc: Option<String>,
}

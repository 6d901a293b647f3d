//! Transport along tracks: what a plan says of flow, dispersion, sides, sources and masses.
//!
//! Owns the types. May use tapes. It deliberately solves nothing: a flow is solved or read by `flow`, and
//! particles are moved by the engine.

use super::Time;
use super::tape::Tape;
use crate::data::{Cloud, cloud};
pub use crate::scenario::Covariance;
pub use crate::scenario::transport::flow_file::{
    FileColumn, FileForm, FlowFacts, FlowFile, ModflowForm, NamedFile, Outlet, TableForm, Velocity,
};
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Transport in anything but uniform flow between simple sides, or of particles that carry mass.
///
/// Positions are those of the scene's axes; tapes read x, y, z and t.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Transport {
    /// The flow at the start.
    pub flow: Flow,
    /// What it becomes later, in rising order of time; nothing where it is steady.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub changes: Vec<Change>,
    pub dispersion: Dispersion,
    /// Volume of water per volume of medium; 1 without a medium.
    pub porosity: Tape,
    /// What happens at each side, per active axis: the lower, the upper. The first patch that holds a place
    /// decides; the last one has no limits.
    pub sides: Vec<[Vec<Patch>; 2]>,
    pub sources: Vec<Source>,
    /// Masses of one species each; none if the particles are fluid.
    pub populations: Vec<Population>,
    /// True: particles are parcels of water, and what sides carry is a tape for each component.
    #[serde(default, skip_serializing_if = "is_false")]
    pub is_of_fluid: bool,
    /// First-order reactions of what carries mass; none if nothing reacts.
    pub decay: Option<Decay>,
    /// Steps of each particle's own within a step.
    pub sub_steps: Option<SubSteps>,
    /// Planes normal to an axis at which coefficients jump.
    pub interfaces: Vec<Interface>,
    /// How particles lie in memory; absent where it does not matter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub order: Option<Order>,
}

/// Particles of one tile lie side by side in memory.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Order {
    /// Equal parts of the domain along each active axis; at most 65,535 in all.
    pub tiles: Vec<usize>,
    /// Displacements of a particle, on average, from one sorting to the next.
    pub displacements: u64,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde asks for a reference.
fn is_false(value: &bool) -> bool {
    !*value
}

impl Transport {
    /// Whether anything is put into the water, or taken out of it, after the start: what it then is depends on
    /// when that was.
    pub fn changes_water(&self) -> bool {
        let is_bare = |rule: &SideRule| {
            matches!(rule, SideRule::Reflect | SideRule::Periodic | SideRule::Open | SideRule::Outflow)
        };
        let mut patches = self.sides.iter().flatten().flatten();
        self.injects() || patches.any(|patch| !is_bare(&patch.rule))
    }

    /// What sides bring of all species or components.
    pub fn carried_mut(&mut self) -> impl Iterator<Item = &mut Tape> {
        self.sides.iter_mut().flatten().flatten().flat_map(|patch| match &mut patch.rule {
            SideRule::Inflow(tapes) | SideRule::Held(tapes) => tapes.iter_mut(),
            _ => [].iter_mut(),
        })
    }

    /// Whether wells may put water in.
    pub fn injects(&self) -> bool {
        match &self.flow {
            Flow::Darcy(flow) => flow.wells.iter().any(|well| well.rate > 0.0),
            Flow::Uniform(_) | Flow::Expression(_) => false,
            Flow::File(_) => true,
        }
    }

    /// What takes water out within the domain at some time, and what is in it; and wells whose water carries something.
    pub fn outlets(&self) -> Vec<Outlet> {
        let later = |idx: usize, change: &Change| match &change.flow {
            Changed::Darcy { rates, .. } => rates.get(idx).is_some_and(|rate| *rate < 0.0),
            Changed::Uniform(_) | Changed::Expression(_) => false,
        };
        let takes =
            |idx: usize, well: &Well| well.rate < 0.0 || self.changes.iter().any(|change| later(idx, change));
        match &self.flow {
            Flow::Darcy(flow) => {
                let wells = flow.wells.iter().enumerate();
                let wells = wells.filter(|(idx, well)| takes(*idx, well) || !well.carrying.is_empty());
                wells.map(|(owner, well)| Outlet { name: well.name.clone(), owner }).collect()
            }
            Flow::File(flow) => flow.facts.outlets.clone(),
            Flow::Uniform(_) | Flow::Expression(_) => Vec::new(),
        }
    }

    /// All flows, one after another.
    pub fn flows(&self) -> Vec<Flow> {
        let later = |change: &Change| match (&change.flow, &self.flow) {
            (Changed::Uniform(velocity), _) => Flow::Uniform(velocity.clone()),
            (Changed::Expression(tapes), _) => Flow::Expression(tapes.clone()),
            (Changed::Darcy { sides, rates }, Flow::Darcy(first)) => {
                let mut darcy = first.clone();
                darcy.sides.clone_from(sides);
                darcy.wells.iter_mut().zip(rates).for_each(|(well, &rate)| well.rate = rate);
                Flow::Darcy(darcy)
            }
            (Changed::Darcy { .. }, other) => other.clone(),
        };
        [self.flow.clone()].into_iter().chain(self.changes.iter().map(later)).collect()
    }

    /// Steps that a flow which begins within them cuts in two.
    pub fn n_cuts(&self, time: &Time) -> u64 {
        /// Part of a step within which a time is on it.
        const AT_A_STEP: f64 = 1e-9;
        let of_files: &[f64] = if let Flow::File(flow) = &self.flow { &flow.facts.changes } else { &[] };
        let all = self.changes.iter().map(|change| change.from).chain(of_files.iter().copied());
        let is_within = |t: &f64| {
            let steps = t / time.step;
            *t > 0.0 && *t < time.duration && (steps - steps.round()).abs() > AT_A_STEP
        };
        all.filter(is_within).count() as u64
    }

    /// When a new flow begins, s; the first one at 0.
    pub fn starts(&self) -> Vec<f64> {
        [0.0].into_iter().chain(self.changes.iter().map(|change| change.from)).collect()
    }
}

/// A new flow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Change {
    /// s
    pub from: f64,
    pub flow: Changed,
}

/// What of the flow is new, in the way that the first one is given.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Changed {
    /// One velocity, an entry per active axis, m/s.
    Uniform(Vec<f64>),
    /// An expression of the place per active axis, m/s.
    Expression(Vec<Tape>),
    /// What the water does at the sides, and the rate of each well.
    Darcy { sides: Vec<[DarcySide; 2]>, rates: Vec<f64> },
}

/// Where the water goes. Velocities are those of the water in its pores, relative to the frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Flow {
    /// One velocity, an entry per active axis, m/s.
    Uniform(Vec<f64>),
    /// An expression per active axis, m/s.
    Expression(Vec<Tape>),
    /// Solved for on cells.
    Darcy(Box<Darcy>),
    /// Read from a file.
    File(Box<FileFlow>),
}

/// Darcy flow `q = −K ∇h`, `∇·q = wells`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Darcy {
    /// Cells along each axis of the domain.
    pub cells: Vec<usize>,
    /// Per axis of the domain: the lower side, the upper side.
    pub sides: Vec<[DarcySide; 2]>,
    pub conductivity: Conductivity,
    /// Conductivity along each axis over that along the first.
    pub anisotropy: Vec<f64>,
    pub wells: Vec<Well>,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DarcySide {
    /// m
    Head(f64),
    /// Specific discharge into the domain, m/s.
    Flux(f64),
    NoFlow,
    Periodic,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Conductivity {
    /// m/s, at the centres of cells.
    Expression(Tape),
    Lognormal {
        /// m/s
        geometric_mean: f64,
        /// Of ln K.
        variance: f64,
        covariance: Covariance,
        /// Correlation length per axis of the domain, m.
        lengths: Vec<f64>,
        seed: u64,
    },
}

/// A well in a Darcy flow.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Well {
    pub name: String,
    /// Lower and upper end per axis of the domain, m: the same but along the screen.
    pub low: Vec<f64>,
    pub high: Vec<f64>,
    /// Water injected (positive) or taken out, m³/s; per m or m² with fewer axes.
    pub rate: f64,
    /// Concentrations in the water that it puts in, one tape per species; none if it carries nothing.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub carrying: Vec<Tape>,
}

/// A flow in files of the scene's folder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FileFlow {
    pub file: FlowFile,
    pub facts: FlowFacts,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Dispersion {
    /// Lower triangle of the constant tensor, m²/s, row by row.
    Constant(Vec<f64>),
    /// The same in all directions, m²/s, over the place.
    Isotropic(Tape),
    /// Lengths in m; molecular in m²/s.
    Velocity { longitudinal: f64, transverse: f64, transverse_vertical: f64, molecular: f64 },
}

impl Dispersion {
    /// A multiple of it, over `d` axes.
    pub fn times(self, factor: f64, d: usize) -> Self {
        match self {
            same if factor == 1.0 => same,
            Self::Constant(triangle) => Self::Constant(triangle.iter().map(|entry| factor * entry).collect()),
            // Nothing is the same everywhere.
            Self::Isotropic(_) if factor == 0.0 => Self::Constant(vec![0.0; d * (d + 1) / 2]),
            Self::Isotropic(mut tape) => {
                tape.scale(factor);
                Self::Isotropic(tape)
            }
            Self::Velocity { longitudinal, transverse, transverse_vertical, molecular } => Self::Velocity {
                longitudinal: factor * longitudinal,
                transverse: factor * transverse,
                transverse_vertical: factor * transverse_vertical,
                molecular: factor * molecular,
            },
        }
    }
}

/// A part of a side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Patch {
    /// Limits per active axis, m; the whole extent where there is none.
    pub low: Vec<f64>,
    pub high: Vec<f64>,
    pub rule: SideRule,
}

/// What happens to particles at a side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SideRule {
    Reflect,
    Periodic,
    /// Walks on outside.
    Open,
    /// Concentration 0.
    Absorb,
    /// Surface reaction `J = k c`, m/s.
    Partial(f64),
    /// Leaves with the water: no gradient.
    Outflow,
    /// Water that enters carries these concentrations: one tape per species, or with fluid per component.
    Inflow(Vec<Tape>),
    /// These concentrations are held at the side: one tape per species, or with fluid per component.
    Held(Vec<Tape>),
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Source {
    pub name: String,
    pub species: usize,
    pub region: Region,
    pub strength: Strength,
    /// From, to, s. A pulse has the same twice.
    pub during: (f64, f64),
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Region {
    Point(Vec<f64>),
    Line(Vec<f64>, Vec<f64>),
    Box(Vec<f64>, Vec<f64>),
    /// Centre and standard deviation per active axis, m.
    Gaussian(Vec<f64>, Vec<f64>),
    /// Places of a table along the active axes, with what each gives.
    Table(#[serde(with = "cloud::shared")] Arc<Cloud>),
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Strength {
    /// mol or kg at once (per m², m with fewer axes).
    Pulse(f64),
    /// mol/s or kg/s.
    Rate(f64),
    /// mol/m³ or kg/m³ that the water there is kept at.
    Held(f64),
    /// A rate that changes, by an expression of the time.
    RateInTime(Tape),
    /// A concentration that changes.
    HeldInTime(Tape),
}

/// Particles that carry the mass of one species.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Population {
    pub species: usize,
    /// Particles that initial mass, sources and inflow are divided into.
    pub count: u64,
    /// Total over mobile concentration.
    pub retardation: f64,
    /// Molecular diffusion of its own, m²/s; that of the medium if absent.
    pub molecular: Option<f64>,
    /// False: it stays where it is.
    pub is_mobile: bool,
    /// Concentration in the water at the start.
    pub initial: Tape,
    /// Mass of a particle that a reaction makes, where it is not that of the others, mol or kg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub made: Option<f64>,
}

/// First-order reactions of what particles carry: one becomes another, or is gone.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Decay {
    pub reactions: Vec<Turn>,
    /// Per population, what a particle weighs in it: one that comes from population `a` has the mass of its
    /// origin times `weights[b] / weights[a]` in `b`.
    pub weights: Vec<f64>,
}

/// A reaction of the particles of one population.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Turn {
    pub name: String,
    pub population: usize,
    /// Chance per time of each particle, 1/s.
    pub rate: f64,
    /// What becomes of it, `(population, chance)`; it is gone with what is left to 1.
    pub outcomes: Vec<(usize, f64)>,
}

impl Decay {
    /// Populations that something becomes of.
    pub fn reacts(&self, population: usize) -> bool {
        self.reactions.iter().any(|turn| turn.population == population && turn.rate > 0.0)
    }
}

/// Criteria for the steps of single particles.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SubSteps {
    /// Σ |v_i| Δt / Δx_i
    pub courant: f64,
    /// Σ D_ii Δt / Δx_i²
    pub dispersion: f64,
}

/// A plane at which dispersion or porosity jump.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Interface {
    /// Active axis.
    pub axis: usize,
    /// m
    pub at: f64,
}

//! The plan: everything that a run will do, in SI, with nothing undecided and nothing superfluous.
//!
//! Owns the plan's types, its lowering from a scenario, the passes, the limits and the hash. May
//! use the words, the catalogue and `scenario`. It deliberately runs nothing.

mod auto_step;
pub mod averaging;
mod averaging_limits;
pub mod build_tape;
pub mod burnett_frind;
mod check;
mod check_chemistry;
mod check_transport;
pub mod chemistry;
pub mod compile;
pub mod cost;
pub mod document;
mod edges;
pub mod eliminate;
pub mod evaluation;
pub mod exchange;
mod exchange_limits;
pub mod explain;
mod explain_exchange;
mod explain_kernels;
mod explain_reactions;
mod explain_transport;
pub mod gates;
pub mod in_time;
mod integrator;
mod kernel_limits;
pub mod kernels;
mod law;
pub mod limits;
mod lower;
mod lower_chemistry;
mod lower_decay;
mod lower_exchange;
mod lower_transport;
mod medium_limits;
mod method;
pub mod passes;
mod periods;
mod reaction_limits;
mod shares;
pub mod side_water;
mod start_rates;
pub mod station;
pub mod tape;
pub mod time_scales;
pub mod transport;
mod transport_limits;
mod turns;

pub use crate::scenario::{OutputKind, Placement, Side, Station};
pub use compile::{Compiled, Options, Selection, compile, hash};

use averaging::Averaging;
use chemistry::Chemistry;
use exchange::Exchange;
use kernels::Kernels;
use serde::{Deserialize, Serialize};
use tape::Tape;
use transport::Transport;

/// Version of everything that decides bytes: stages, formulas, streams. Part of the plan hash.
pub const NUMERICS_VERSION: u32 = 3;

/// A whole run, frozen. Lengths in m, times in s, concentrations in mol/m³ or kg/m³.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plan {
    pub numerics: u32,
    /// Active axes only: an axis without gradient or flux is left out by a pass.
    pub axes: Vec<Axis>,
    pub walk: Walk,
    pub particles: Particles,
    /// The species of the scene that some output needs, in the order of the scene.
    pub species: Vec<Species>,
    /// The conservative fields that every particle carries; each in every stored zone.
    pub components: Vec<Component>,
    pub mixing: Option<Mixing>,
    /// What parcels exchange with those around them; absent where they do not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub exchange: Option<Exchange>,
    pub reactions: Vec<InstantReaction>,
    /// Reactions at finite rates and in equilibrium; absent where there are none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chemistry: Option<Chemistry>,
    /// Absent where one velocity and one tensor say everything.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub transport: Option<Transport>,
    /// How concentrations of particles that carry mass are found; absent where nobody needs them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kernels: Option<Kernels>,
    pub time: Time,
    pub outputs: Vec<Output>,
    /// Whether the cells of the flow are written.
    #[serde(default, skip_serializing_if = "is_false")]
    pub writes_flow: bool,
    /// What one step does, in order.
    pub stages: Vec<Stage>,
    pub seed: u64,
}

/// One active axis of the domain, in the coordinates of the (moving) frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Axis {
    /// 0, 1, 2 for x, y, z of the scene.
    pub index: usize,
    pub low: f64,
    pub high: f64,
    pub low_side: Side,
    pub high_side: Side,
    /// Bins of the averages along this axis (1 if nothing is averaged).
    pub bins: usize,
}

/// `X ← X + drift·Δt + B ξ √Δt`, `B Bᵀ = 2 D` (Itô–Euler; exact in law for constant coefficients).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Walk {
    /// Velocity relative to the frame, one entry per active axis, m/s.
    pub drift: Vec<f64>,
    /// Lower triangle of B row by row over the active axes, m/√s: `[b00, b10, b11, b20, b21, b22]`.
    pub spread: Vec<f64>,
    pub normals: Normals,
}

/// How normal numbers are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Normals {
    /// Box–Muller in 32-bit lanes: radius error 1e-5, largest value about 6.6.
    Single,
    /// Box–Muller in 64-bit arithmetic with 53-bit uniforms, for tails.
    Double,
}

fn is_none(disorder: &f64) -> bool {
    *disorder == 0.0
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Particles {
    pub count: u64,
    pub placement: Placement,
    /// Of ordered ones: each lies up to half of this, in their distances, from its place along every axis.
    #[serde(default, skip_serializing_if = "is_none")]
    pub disorder: f64,
    /// Fluid volume of one particle: m, m² or m³ over the axes of the scene (an axis that was left
    /// out still counts with its length).
    pub volume: f64,
}

/// A species and how to restore it from what particles carry.
///
/// `U_s = constant + Σ_k coefficient_k · component_k` is the concentration as if nothing had
/// reacted; the reactions then give the concentration itself.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Species {
    pub name: String,
    pub constant: f64,
    /// `(component index, coefficient)`
    pub terms: Vec<(usize, f64)>,
    /// True: amount of substance (mol/m³); false: mass (kg/m³).
    pub is_molar: bool,
}

/// A field that is carried, transported linearly and conserved.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Component {
    /// The species that it stands for (its unreacted concentration).
    pub name: String,
    /// Initial value; inputs of the tape are x, y, z, t (SI, frame coordinates).
    pub initial: Tape,
    /// True: it does not move with the fluid, and lives in the bins of the averages.
    #[serde(default, skip_serializing_if = "is_false")]
    pub is_immobile: bool,
}

#[allow(clippy::trivially_copy_pass_by_ref)] // serde asks for a reference.
fn is_false(value: &bool) -> bool {
    !*value
}

/// Mixing zones by exchange with the mean (MRIEM).
///
/// A particle's value is `U = Σ_i η_i W_i`, zones in order; an instant zone has `W = ū(bin)`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mixing {
    pub zones: Vec<Zone>,
    /// True if only instant zones exist: one unmixed carrier per component is stored (weight 0), and
    /// every value is the mean of the carriers.
    pub is_well_mixed: bool,
    /// What zones exchange with, if it is not the mean of the bin. A parcel then stores its mean where a zone is instant.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub averaging: Option<Averaging>,
}

impl Mixing {
    /// Whether every parcel stores the mean that it sees.
    pub fn stores_mean(&self) -> bool {
        self.averaging.is_some() && self.zones.iter().any(|zone| zone.rate == ZoneRate::Instant)
    }
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Zone {
    pub name: String,
    pub fraction: f64,
    pub rate: ZoneRate,
    /// Whether every particle stores a value for this zone. Instant zones are stored only when the
    /// pass that drops them is switched off; the bytes of the outputs do not change.
    pub is_stored: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum ZoneRate {
    Instant,
    /// χ in 1/s: `W ← ū + (W − ū) e^{−χΔt/2}`.
    Finite(f64),
}

/// An irreversible, complete reaction, applied to the unreacted concentrations when observed:
/// extent `ξ = min_r U_r/ν_r`, then `C_r = U_r − ν_r ξ`, `C_p = U_p + ν_p ξ`.
/// Reactant sets of different reactions are disjoint and no product is a reactant.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InstantReaction {
    pub name: String,
    /// `(species index, ν > 0)`
    pub reactants: Vec<(usize, f64)>,
    pub products: Vec<(usize, f64)>,
}

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Time {
    pub step: f64,
    /// Whole steps; the last one is shortened if `duration` is not a multiple.
    pub n_steps: u64,
    pub duration: f64,
}

impl Plan {
    /// Whether particles carry mass of one species each; otherwise they are parcels of water.
    pub fn carries_mass(&self) -> bool {
        self.transport.as_ref().is_some_and(|transport| !transport.is_of_fluid)
    }

    /// Whether particles change their places.
    pub fn moves(&self) -> bool {
        self.transport.is_some() || self.walk.drift.iter().chain(&self.walk.spread).any(|entry| *entry != 0.0)
    }

    /// The plan with another root of its random numbers: a random field that has no seed of its own follows it.
    pub fn with_seed(&self, seed: u64) -> Self {
        let mut plan = self.clone();
        plan.seed = seed;
        if let Some(transport::Flow::Darcy(darcy)) = plan.transport.as_mut().map(|own| &mut own.flow)
            && let transport::Conductivity::Lognormal { seed: field, .. } = &mut darcy.conductivity
            && *field == self.seed
        {
            *field = seed;
        }
        plan
    }

    /// Sets the number of particles; each then stands for as much more or less.
    pub fn set_count(&mut self, count: u64) {
        let before = self.particles.count;
        self.particles.volume *= before as f64 / count as f64;
        self.particles.count = count;
        for population in self.transport.iter_mut().flat_map(|transport| &mut transport.populations) {
            let share = population.count as f64 / before as f64;
            population.count = ((count as f64 * share).round() as u64).max(1);
        }
    }
}

impl Time {
    /// The part of a step by which the last one may be longer than the others, so that a duration which is a
    /// multiple up to rounding has no extra sliver of a step.
    pub fn slack(n_steps: f64) -> f64 {
        (1e-9 * n_steps.max(1.0)).min(0.1)
    }

    pub fn new(duration: f64, step: f64) -> Self {
        let exact = duration / step;
        let is_whole = (exact - exact.round()).abs() < Self::slack(exact);
        let n_steps = if is_whole { exact.round() } else { exact.ceil() };
        Self { step, n_steps: (n_steps as u64).max(1), duration }
    }
}

/// What is observed and when.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Output {
    pub kind: OutputKind,
    /// Species indices; pairs (all combinations a ≤ b … as listed) for covariance and mixing.
    pub quantities: Vec<Quantity>,
    /// Bins along each active axis for profile, covariance, map, mixing; empty otherwise.
    pub bins: Vec<usize>,
    pub times: Vec<f64>,
    /// Unit of the values as written by the user; `None` is SI.
    pub unit: Option<OutputUnit>,
    /// Where a breakthrough or a first passage is taken.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub station: Option<Station>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Quantity {
    Species(usize),
    Pair(usize, usize),
}

/// `value_in_unit = value_SI / factor`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OutputUnit {
    pub text: String,
    pub factor: f64,
}

/// What the engine does in a step, in the order of the plan. Closed: every match is exhaustive.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Stage {
    /// What the particles carry reacts, at the positions reached.
    React,
    /// Relax towards the bin means of the positions reached.
    Mix,
    /// Advect and disperse.
    Move,
    /// Apply the sides of the domain.
    Bound,
    /// Parcels exchange with those around them at the positions reached.
    Exchange,
    /// Zones exchange with the means over the parcels around, at the positions reached.
    KernelMean,
    /// Concentrations by kernels at the positions reached.
    Estimate,
    /// Bin index of every particle, sums per bin, means.
    Average,
    /// Mix and React in one pass over memory, both of the step before.
    FusedReact,
    /// Mix and React (of the step before), Move, Bound and Average in one pass over memory.
    FusedStep,
    /// Outputs due.
    Observe,
}

//! Choices among words that go into the plan as they are.
//!
//! Owns the types and their words. May use `serde`, as the plan is written. It deliberately checks
//! nothing.

use serde::{Deserialize, Serialize};

/// What happens to a particle at one side of the domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Side {
    /// No flux: specular reflection.
    Reflect,
    /// Particles leave and come in at the opposite side. Both sides of an axis or none.
    Periodic,
    /// Particles walk on outside; they are counted in totals, not in bins.
    Open,
}

const SIDES: &[(&str, Side)] =
    &[("reflect", Side::Reflect), ("open", Side::Open), ("periodic", Side::Periodic)];

impl Side {
    /// The word of the language.
    pub fn word(self) -> &'static str {
        word(SIDES, self)
    }
}

/// How a random field is correlated over distances `d_i`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Covariance {
    /// `σ² exp(−√Σ (d_i/λ_i)²)`
    Exponential,
    /// `σ² exp(−Σ (d_i/λ_i)²)`
    Gaussian,
}

pub(super) const COVARIANCES: &[(&str, Covariance)] =
    &[("exponential", Covariance::Exponential), ("gaussian", Covariance::Gaussian)];

/// Where particles start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Placement {
    /// Uniform and independent.
    Random,
    /// One axis: particle p uniform in the p-th of `count` equal intervals. More axes: the domain is
    /// cut into a grid of nearly cubic cells with equal numbers (±1) of uniform particles in each.
    Stratified,
    /// Centres of the strata, no randomness.
    Ordered,
    /// A sequence that fills the domain more evenly than chance, moved by the seed.
    LowDiscrepancy,
}

impl Placement {
    /// As scenes have it.
    pub fn word(self) -> &'static str {
        PLACEMENTS.iter().find(|(_, placement)| *placement == self).map_or("", |(word, _)| word)
    }
}

pub(super) const PLACEMENTS: &[(&str, Placement)] = &[
    ("stratified", Placement::Stratified),
    ("random", Placement::Random),
    ("ordered", Placement::Ordered),
    ("low_discrepancy", Placement::LowDiscrepancy),
];

/// The order in which transport and reaction take turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Splitting {
    /// Transport, then reaction over the whole step: first order.
    Lie,
    /// Half a reaction, transport, half a reaction: second order.
    Strang,
}

pub(super) const SPLITTINGS: &[(&str, Splitting)] = &[("lie", Splitting::Lie), ("strang", Splitting::Strang)];

/// Activity coefficients from the ionic strength `I = ½ Σ z² c`, in mol/L.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Activity {
    /// γ = 1
    Ideal,
    /// `log₁₀ γ = −A z² √I`
    DebyeHuckel,
    /// `log₁₀ γ = −A z² √I / (1 + B å √I)`
    ExtendedDebyeHuckel,
    /// `log₁₀ γ = −A z² (√I / (1 + √I) − 0.3 I)`
    Davies,
}

pub(super) const ACTIVITIES: &[(&str, Activity)] = &[
    ("ideal", Activity::Ideal),
    ("debye_huckel", Activity::DebyeHuckel),
    ("extended_debye_huckel", Activity::ExtendedDebyeHuckel),
    ("davies", Activity::Davies),
];

/// What the scene asks of the integration of rates.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Integrator {
    /// The plan chooses: a closed form where there is one, else by stiffness.
    #[default]
    Auto,
    /// Dormand–Prince 5(4), also where a closed form exists.
    Explicit,
    /// Rodas, also where a closed form exists.
    Rosenbrock,
}

pub(super) const INTEGRATORS: &[(&str, Integrator)] =
    &[("auto", Integrator::Auto), ("explicit", Integrator::Explicit), ("rosenbrock", Integrator::Rosenbrock)];

/// What makes weights of kernels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Normalisation {
    /// `w_ij / ½(ρ_i + ρ_j)`
    Arithmetic,
    /// `w_ij / √(ρ_i ρ_j)`
    Geometric,
    /// `u_i w_ij u_j` with sums of one.
    Sinkhorn,
}

pub(super) const NORMALISATIONS: &[(&str, Normalisation)] = &[
    ("arithmetic", Normalisation::Arithmetic),
    ("geometric", Normalisation::Geometric),
    ("sinkhorn", Normalisation::Sinkhorn),
];

impl Normalisation {
    /// The word of the language.
    pub fn word(self) -> &'static str {
        word(NORMALISATIONS, self)
    }
}

/// How an exchange is taken over a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Integration {
    Explicit,
    Implicit,
    Exponential,
}

pub(super) const INTEGRATIONS: &[(&str, Integration)] = &[
    ("explicit", Integration::Explicit),
    ("implicit", Integration::Implicit),
    ("exponential", Integration::Exponential),
];

impl Integration {
    /// The word of the language.
    pub fn word(self) -> &'static str {
        word(INTEGRATIONS, self)
    }

    /// Share of a parcel that a step may exchange: above one an explicit step overshoots, and the others need ever
    /// more sums.
    pub fn most(self) -> f64 {
        match self {
            Self::Explicit => 1.0,
            Self::Implicit => 1e4,
            Self::Exponential => 200.0,
        }
    }
}

/// A place that is watched.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Station {
    /// What goes through a plane normal to an active axis, net along it.
    Plane { axis: usize, at: f64 },
    /// What leaves through a side (twice the active axis, plus one at its upper end), net of what enters.
    Side(usize),
    /// What is in a box: limits per active axis, m.
    Box { low: Vec<f64>, high: Vec<f64> },
    /// What a well takes out, by its name.
    Well(String),
    /// A part of a plane or a side: limits per active axis, m; along that of the plane they say nothing.
    Part { of: std::boxed::Box<Station>, low: Vec<f64>, high: Vec<f64> },
}

/// What is observed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OutputKind {
    /// Mean concentration and its standard error per bin along one axis.
    Profile,
    /// Covariance of unreacted concentrations of a pair within bins along one axis, times n/(n−1).
    Covariance,
    /// Mean concentration per bin over all active axes.
    Map,
    /// Amount of all particles, those outside of open sides included: Σ volume · C.
    Total,
    /// M = ∫⟨C_a C_b⟩, M_mean = ∫ c̄_a c̄_b, M_cov, γ = M_cov / M_mean, of unreacted concentrations.
    Mixing,
    /// Every particle with position and concentrations.
    Particles,
    /// What passes a plane or a side, or is in a box, between two times.
    Breakthrough,
    /// What has touched a plane, each particle once.
    FirstPassage,
    /// Amount, centre and second central moments.
    Moments,
    /// Volume that the amount is spread over, by its entropy.
    Dilution,
    /// What has entered and left, by where, and what is there.
    Budget,
    /// Density of masses by kernels, cell by cell, with their bandwidths.
    Density,
    /// How wide kernels are.
    Kernels,
}

pub(super) const OUTPUTS: &[(&str, OutputKind)] = &[
    ("profile", OutputKind::Profile),
    ("covariance", OutputKind::Covariance),
    ("map", OutputKind::Map),
    ("total", OutputKind::Total),
    ("mixing", OutputKind::Mixing),
    ("particles", OutputKind::Particles),
    ("breakthrough", OutputKind::Breakthrough),
    ("first_passage", OutputKind::FirstPassage),
    ("moments", OutputKind::Moments),
    ("dilution", OutputKind::Dilution),
    ("budget", OutputKind::Budget),
    ("density", OutputKind::Density),
    ("kernels", OutputKind::Kernels),
];

impl OutputKind {
    /// The word of the language.
    pub fn word(self) -> &'static str {
        word(OUTPUTS, self)
    }

    /// Whether its values belong to pairs of species.
    pub fn is_of_pairs(self) -> bool {
        matches!(self, OutputKind::Covariance | OutputKind::Mixing)
    }

    /// Whether it has values in bins that a profile or a map is drawn of.
    pub fn is_binned(self) -> bool {
        matches!(self, OutputKind::Profile | OutputKind::Covariance | OutputKind::Map)
    }

    /// Whether it is summed over bins, which the scene has to state.
    pub fn has_bins(self) -> bool {
        self.is_binned() || matches!(self, OutputKind::Mixing | OutputKind::Dilution)
    }

    /// Whether there is one number for each quantity and time that measures, references and figures speak of.
    pub fn is_course(self) -> bool {
        matches!(
            self,
            OutputKind::Total
                | OutputKind::Mixing
                | OutputKind::Breakthrough
                | OutputKind::FirstPassage
                | OutputKind::Moments
                | OutputKind::Dilution
                | OutputKind::Kernels
        )
    }

    /// Whether its values are numbers in named columns, in one row or several.
    pub fn has_rows(self) -> bool {
        matches!(
            self,
            OutputKind::Breakthrough
                | OutputKind::FirstPassage
                | OutputKind::Moments
                | OutputKind::Dilution
                | OutputKind::Budget
                | OutputKind::Density
                | OutputKind::Kernels
        )
    }

    /// Whether it is taken at a station.
    pub fn has_station(self) -> bool {
        matches!(self, OutputKind::Breakthrough | OutputKind::FirstPassage)
    }

    /// Whether what particles do on their way is counted.
    pub fn counts_passages(self) -> bool {
        matches!(self, OutputKind::Breakthrough | OutputKind::FirstPassage | OutputKind::Budget)
    }

    /// Whether only particles that carry mass have it: parcels of water pass again and again with other contents.
    pub fn needs_masses(self) -> bool {
        self == OutputKind::FirstPassage
    }

    /// Whether it is found by kernels, whatever the particles are.
    pub fn is_by_kernels(self) -> bool {
        matches!(self, OutputKind::Density | OutputKind::Kernels)
    }
}

fn word<T: Copy + PartialEq>(words: &[(&'static str, T)], wanted: T) -> &'static str {
    words.iter().find(|(_, choice)| *choice == wanted).map_or("", |(word, _)| word)
}

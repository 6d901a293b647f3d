//! What reacts at finite rates or is in equilibrium, as the plan holds it.
//!
//! Owns these types. May use the tape's operations. It deliberately solves nothing: `crate::chemistry` does.
//!
//! Species have concentrations; components are what is carried and transported. Without equilibrium a
//! species is an affine combination of components ([`super::Species`]). In equilibrium the totals of the
//! primary species are such combinations, and the concentrations follow by speciation.

use super::averaging::Averaging;
use super::tape::{Operation, Register, Tape};
pub use crate::scenario::{Activity, Integrator, Splitting};
use serde::{Deserialize, Serialize};

/// Chemistry beyond complete instant reactions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Chemistry {
    pub kinetics: Option<Kinetics>,
    pub equilibrium: Option<Equilibrium>,
    /// Relative tolerance of what is integrated with error control.
    pub tolerance: f64,
    /// Concentration per component, mol/m³ or kg/m³, below which the relative tolerance stops to hold.
    pub floors: Vec<f64>,
    pub splitting: Splitting,
    /// What the scene asks for; [`Kinetics::method`] is what is done.
    #[serde(default)]
    pub integrator: Integrator,
}

impl Chemistry {
    /// Whether rates are integrated in sub-steps.
    pub fn has_error_control(&self) -> bool {
        let method = self.kinetics.as_ref().map(|kinetics| kinetics.method);
        matches!(method, Some(Method::Explicit | Method::Rosenbrock))
    }
}

/// Reactions at finite rates.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Kinetics {
    pub reactions: Vec<Kinetic>,
    pub laws: Laws,
    pub method: Method,
}

/// One reaction: `dy/dt` of each component that it changes is coefficient × rate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Kinetic {
    pub name: String,
    /// `(component index, coefficient)`, in the order of components. See [`Method::Observed`].
    pub changes: Vec<(usize, f64)>,
    pub law: Law,
}

/// The rate of a reaction, concentration per second of extent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Law {
    /// `r = k Π c_s^n_s` with a constant k; `(species index, n)`, none for a zero-order law.
    MassAction { constant: f64, orders: Vec<(usize, f64)> },
    /// `r = V c_s / (K + c_s)` with constants.
    Saturation { maximum: f64, half: f64, species: usize },
    /// Anything else: only the tape knows.
    Expression,
}

/// The rates of all reactions as one program; `rates[k]` is the register of reaction `k`. Inputs are x, y,
/// z, t, then the concentrations of all species of the plan (input `4 + s`).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Laws {
    pub operations: Vec<Operation>,
    pub rates: Vec<Register>,
}

impl Laws {
    /// The program of one rate.
    pub fn tape(&self, reaction: usize) -> Tape {
        Tape { operations: self.operations[..=usize::from(self.rates[reaction])].to_vec() }
    }
}

/// How kinetics are integrated over a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Method {
    /// First-order network with constant coefficients: the matrix exponential, applied to what is carried
    /// when somebody looks; reactions and transport commute. The `changes` are those of species then, by
    /// species index: components are unreacted.
    Observed,
    /// The same, applied in each step, since others react too or species do not all move alike.
    Exponential,
    /// One mass-action reaction of two species, second order in all: closed form.
    Pair,
    /// One reaction with a [`Law::Saturation`]: Lambert's W.
    Saturation,
    /// One zero-order reaction, to the end of its scarcest reactant.
    Zero,
    /// Explicit, with error control: Dormand–Prince 5(4).
    Explicit,
    /// L-stable with error control: Rodas4.
    Rosenbrock,
}

/// Reactions in equilibrium, written over primary species by elimination.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Equilibrium {
    pub primaries: Vec<Primary>,
    pub secondaries: Vec<Secondary>,
    pub minerals: Vec<Mineral>,
    pub activity: Activity,
}

/// A species in which the others are written, and its total
/// `T_j = c_j + Σ_i ν_ij c_i + Σ_m ν_mj n_m`, which is conserved by equilibrium reactions.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Primary {
    pub species: usize,
    pub charge: f64,
    /// Ion-size parameter å, m; 0 if it is not given.
    pub ion_size: f64,
    /// `T_j = constant + Σ coefficient · component`
    pub constant: f64,
    pub terms: Vec<(usize, f64)>,
}

/// A species with `ln a_i = ln K_i + Σ_j ν_ij ln a_j`, concentrations in mol/m³.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Secondary {
    pub species: usize,
    pub charge: f64,
    pub ion_size: f64,
    pub ln_constant: f64,
    /// `(primary index, ν)`
    pub coefficients: Vec<(usize, f64)>,
}

/// A pure phase: either `n = 0` and `Σ_j ν_j ln a_j ≤ ln S`, or `n > 0` and equality.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mineral {
    pub species: usize,
    /// ln of the ion activity product at saturation, activities in mol/m³.
    pub ln_solubility: f64,
    /// `(primary index, ν)`: what dissolving one unit gives.
    pub coefficients: Vec<(usize, f64)>,
}

impl Equilibrium {
    /// Everything in equilibrium.
    pub fn members(&self) -> Vec<usize> {
        let primaries = self.primaries.iter().map(|primary| primary.species);
        let secondaries = self.secondaries.iter().map(|secondary| secondary.species);
        primaries.chain(secondaries).chain(self.minerals.iter().map(|mineral| mineral.species)).collect()
    }

    /// What the total of a primary species adds up, each with how often: itself and what is made of it.
    pub fn total(&self, primary: usize) -> Vec<(usize, f64)> {
        let share = |coefficients: &[(usize, f64)], species: usize| {
            coefficients.iter().find(|(own, _)| *own == primary).map(|(_, nu)| (species, *nu))
        };
        let secondaries = self.secondaries.iter().filter_map(|it| share(&it.coefficients, it.species));
        let minerals = self.minerals.iter().filter_map(|it| share(&it.coefficients, it.species));
        [(self.primaries[primary].species, 1.0)].into_iter().chain(secondaries).chain(minerals).collect()
    }

    /// Whether a total is a sum of amounts.
    pub fn is_sum(&self, primary: usize) -> bool {
        self.total(primary).iter().all(|(_, nu)| *nu > 0.0)
    }
}

impl super::Plan {
    /// Whether particles react in each step.
    pub fn reacts_in_steps(&self) -> bool {
        let kinetics = self.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
        kinetics.is_some_and(|kinetics| kinetics.method != Method::Observed)
    }

    /// Whether something lives in bins.
    pub fn has_immobile(&self) -> bool {
        self.components.iter().any(|component| component.is_immobile)
    }

    /// Whether particles see means of bins.
    pub fn sees_bins(&self) -> bool {
        self.mixing.is_some() && !self.has_kernel_mean()
    }

    /// The means over the parcels around that zones exchange with, if these are not those of bins.
    pub fn averaging(&self) -> Option<&Averaging> {
        self.mixing.as_ref().and_then(|mixing| mixing.averaging.as_ref())
    }

    pub fn has_kernel_mean(&self) -> bool {
        self.averaging().is_some()
    }

    /// Whether what a particle reacts with hangs on its bin: a mean, or what lives there.
    pub fn hangs_on_bins(&self) -> bool {
        self.sees_bins() || self.has_immobile()
    }

    /// Components that particles carry; those that live in bins come last.
    pub fn n_mobile(&self) -> usize {
        self.components.iter().filter(|component| !component.is_immobile).count()
    }
}

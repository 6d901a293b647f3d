//! What the engine sees of chemistry: columns of components go in, reacted columns come out.
//!
//! Owns the choice of the integrator by the plan's method, and the recipes of species. May use all of
//! `chemistry`. It deliberately stores nothing about particles: what must be remembered is lent.

use crate::plan::chemistry::Kinetics;
use crate::plan::{Plan, Species};

/// Compiled chemistry of a plan.
#[derive(Debug, Clone)]
pub struct Reactor {
    n_components: usize,
    species: Vec<Species>,
    #[allow(dead_code)]
    kinetics: Option<Kinetics>,
}

/// What a thread needs besides, kept from call to call so that no step allocates.
#[derive(Debug, Default)]
pub struct Scratch {}

/// Particles that react together, as columns of equal length.
#[derive(Debug)]
pub struct Batch<'a> {
    /// x, y, z; an empty slice is 0.
    pub positions: [&'a [f64]; 3],
    pub t: f64,
    pub dt: f64,
    /// One column per component of the plan; before the call at `t`, after it at `t + dt`.
    pub components: &'a mut [&'a mut [f64]],
    /// The sub-step of each particle that its next call should begin with, s; 0 if it is not known.
    /// May be empty: nothing is remembered.
    pub memory: &'a mut [f32],
}

/// How much was done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Work {
    /// Accepted sub-steps.
    pub steps: u64,
    pub rejected: u64,
    /// Evaluations of all rates.
    pub rates: u64,
    /// Factored matrices.
    pub factored: u64,
}

/// A particle that cannot be taken over the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Failure {
    /// Its index in the batch.
    pub particle: usize,
    pub why: Why,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Why {
    /// The error cannot be held with any step that time can resolve.
    StepTooSmall {
        t: f64,
        step: f64,
    },
    NotFinite {
        component: usize,
    },
    Negative {
        component: usize,
        value: f64,
    },
    NoEquilibrium {
        residual: f64,
    },
}

/// What a first-order network does in a time: `y ← matrix · y + constant`.
#[derive(Debug, Clone, PartialEq)]
pub struct Propagator {
    /// Row by row, n × n for n components.
    pub matrix: Vec<f64>,
    /// What zero-order reactions and constants of species add; n entries.
    pub constant: Vec<f64>,
}

impl Reactor {
    /// `None` if the plan has no chemistry; an error if its chemistry cannot be compiled.
    pub fn new(plan: &Plan) -> Result<Option<Self>, String> {
        let Some(chemistry) = &plan.chemistry else { return Ok(None) };
        Ok(Some(Self {
            n_components: plan.components.len(),
            species: plan.species.clone(),
            kinetics: chemistry.kinetics.clone(),
        }))
    }

    /// What a thread needs to call [`Reactor::react`].
    pub fn scratch(&self) -> Scratch {
        Scratch::default()
    }

    /// Takes every particle of the batch over its step. After a failure the columns are partly reacted.
    pub fn react(&self, batch: Batch<'_>, _scratch: &mut Scratch) -> Result<Work, Failure> {
        debug_assert_eq!(batch.components.len(), self.n_components);
        Ok(Work::default())
    }

    /// The first-order network over a time, if the method of the plan is one: see [`Propagator`].
    pub fn propagator(&self, _t: f64) -> Option<Propagator> {
        None
    }

    /// Concentrations of all species of the plan from what is carried.
    pub fn speciate(
        &self,
        components: &[&[f64]],
        species: &mut [&mut [f64]],
        _scratch: &mut Scratch,
    ) -> Result<(), Failure> {
        for (recipe, column) in self.species.iter().zip(species) {
            column.fill(recipe.constant);
            for &(component, coefficient) in &recipe.terms {
                for (value, carried) in column.iter_mut().zip(components[component]) {
                    *value += coefficient * carried;
                }
            }
        }
        Ok(())
    }
}

//! What the engine sees of chemistry: columns of components go in, reacted columns come out.
//!
//! Owns the choice of the integrator by the plan's method, and the recipes of species. May use all of
//! `chemistry`. It deliberately stores nothing about particles: what must be remembered is lent.

use super::aqueous::{Aqueous, AqueousScratch};
use super::closed::exponential::Exponential;
use super::closed::pair::Pair;
use super::closed::saturation::Saturation;
use super::closed::zero::Zero;
use super::explicit::Explicit;
use super::integrate::{Lanes, Network, Task, integrate};
use super::invariants::Invariants;
use super::laws::{Basis, System};
use super::matrix::Symbolic;
use super::rosenbrock::Rosenbrock;
use crate::maths::wide::Width;
use crate::plan::chemistry::{Chemistry, Equilibrium, Integrator as Asked, Kinetics, Law, Method};
use crate::plan::{Plan, Species};
use std::sync::atomic::{AtomicU64, Ordering};

static NEXT_IDENTITY: AtomicU64 = AtomicU64::new(1);

/// Compiled chemistry of a plan.
#[derive(Debug, Clone)]
pub struct Reactor {
    n_components: usize,
    species: Vec<Species>,
    integrator: Integrator,
    aqueous: Option<Box<Aqueous>>,
    width: Width,
    /// Tells whose memory a [`Scratch`] is; copies share it.
    identity: u64,
}

/// How the kinetics are taken over a step.
#[derive(Debug, Clone)]
enum Integrator {
    Nothing,
    Exponential(Exponential),
    Pair(Pair),
    Saturation(Saturation),
    Zero(Zero),
    /// With error control. `is_explicit`: tried first; `is_asked_for`: and nothing else.
    Adaptive {
        network: Box<Network>,
        symbolic: Symbolic,
        is_explicit: bool,
        is_asked_for: bool,
    },
}

/// What a thread needs besides, kept from call to call so that no step allocates.
#[derive(Debug, Default)]
pub struct Scratch {
    /// The reactor that it was last used with; 0 for none.
    owner: u64,
    lanes: Lanes,
    aqueous: Option<AqueousScratch>,
    old: Vec<f64>,
    /// The last propagator and its time.
    propagator: Option<(f64, Propagator)>,
    failures: Vec<Failure>,
    left_over: Vec<u32>,
}

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
    /// The error cannot be held with any step that time can resolve; that of `component` least of all.
    StepTooSmall {
        component: usize,
        t: f64,
        step: f64,
    },
    /// The end of the step is not reached with as many sub-steps as one step may take.
    TooManySteps {
        t: f64,
        tried: u32,
        /// What was done of the step.
        share: f64,
    },
    NotFinite {
        component: usize,
        /// The first whose rate is no number, if it is known.
        reaction: Option<usize>,
    },
    Negative {
        component: usize,
        value: f64,
    },
    /// No amounts of species have these totals.
    Impossible,
    /// Minerals would form without end.
    Endless,
    /// An equilibrium is not found to the last digits.
    NoEquilibrium {
        residual: f64,
    },
    /// More ions than the model of activities is for, mol/L.
    TooSalty {
        ionic_strength: f64,
    },
}

impl Why {
    /// For a reactor of some of a plan's reactions, whose numbers are others.
    pub fn without_reaction(self) -> Self {
        match self {
            Self::NotFinite { component, .. } => Self::NotFinite { component, reaction: None },
            other => other,
        }
    }
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
        let aqueous = chemistry.equilibrium.as_ref().map(|equilibrium| Aqueous::new(plan, equilibrium));
        let aqueous = aqueous.transpose()?.map(Box::new);
        let integrator = match &chemistry.kinetics {
            None => Integrator::Nothing,
            Some(kinetics) => Integrator::new(plan, chemistry, kinetics, aqueous.as_deref())?,
        };
        Ok(Some(Self {
            n_components: plan.components.len(),
            species: plan.species.clone(),
            integrator,
            aqueous,
            width: Width::widest(),
            identity: NEXT_IDENTITY.fetch_add(1, Ordering::Relaxed),
        }))
    }

    /// The same with other code, to compare: results have the same bits.
    pub fn with_width(mut self, width: Width) -> Self {
        self.width = width;
        self
    }

    /// Makes a thread's memory that of this reactor.
    fn adopt(&self, scratch: &mut Scratch) {
        if scratch.owner == self.identity {
            return;
        }
        let lanes = match &self.integrator {
            Integrator::Adaptive { network, symbolic, .. } => Lanes::new(network, 7, symbolic.n_slots()),
            _ => Lanes::default(),
        };
        let aqueous = self.aqueous.as_ref().map(|aqueous| aqueous.scratch());
        *scratch = Scratch { owner: self.identity, lanes, aqueous, ..Scratch::default() };
        if let (Some(aqueous), Integrator::Adaptive { .. }) = (&self.aqueous, &self.integrator) {
            scratch.lanes.aqueous = Some(Box::new(aqueous.lanes()));
        }
    }

    /// Takes every particle of the batch over its step. After a failure the columns are partly reacted.
    pub fn react(&self, batch: Batch<'_>, scratch: &mut Scratch) -> Result<Work, Failure> {
        debug_assert_eq!(batch.components.len(), self.n_components);
        self.adopt(scratch);
        let Batch { components, dt, .. } = batch;
        match &self.integrator {
            Integrator::Nothing => return Ok(Work::default()),
            Integrator::Adaptive { .. } => {
                return self.integrate(Batch { components, ..batch }, scratch);
            }
            Integrator::Exponential(network) => {
                let known = scratch.propagator.take().filter(|(t, _)| t.to_bits() == dt.to_bits());
                let (_, propagator) =
                    scratch.propagator.insert(known.unwrap_or_else(|| (dt, network.propagator(dt))));
                propagator.apply(self.width, components, &mut scratch.old);
            }
            Integrator::Pair(pair) => pair.react(self.width, dt, components),
            Integrator::Saturation(law) => law.react(self.width, dt, components),
            Integrator::Zero(law) => law.react(self.width, dt, components, &mut scratch.old),
        }
        check_finite(components)?;
        let n = components.first().map_or(0, |column| column.len()) as u64;
        Ok(Work { steps: n, rates: n, ..Work::default() })
    }

    fn integrate(&self, batch: Batch<'_>, scratch: &mut Scratch) -> Result<Work, Failure> {
        let Integrator::Adaptive { network, symbolic, is_explicit, is_asked_for } = &self.integrator else {
            return Ok(Work::default());
        };
        let Scratch { lanes, failures, left_over, .. } = scratch;
        let aqueous = self.aqueous.as_deref().map(|aqueous| (aqueous, self.width));
        failures.clear();
        let mut task = Task {
            positions: batch.positions,
            t: batch.t,
            dt: batch.dt,
            components: batch.components,
            memory: batch.memory,
            chosen: None,
            work: Work::default(),
            failures,
            ends_at_failure: !is_explicit || *is_asked_for,
        };
        if *is_explicit {
            integrate(self.width, network, &Explicit { network }, lanes, &mut task);
            if task.failures.is_empty() {
                return Ok(task.work);
            }
            if *is_asked_for {
                return first_failure(&task);
            }
            // Too stiff after all.
            left_over.clear();
            left_over.extend(task.failures.drain(..).map(|failure| failure.particle as u32));
            left_over.sort_unstable();
            task.chosen = Some(left_over);
            task.ends_at_failure = true;
        }
        integrate(self.width, network, &Rosenbrock { network, symbolic, aqueous }, lanes, &mut task);
        first_failure(&task)
    }

    /// The first-order network over a time, if the method of the plan is one: see [`Propagator`].
    pub fn propagator(&self, t: f64) -> Option<Propagator> {
        match &self.integrator {
            Integrator::Exponential(network) => Some(network.propagator(t)),
            _ => None,
        }
    }

    /// Concentrations of all species of the plan from what is carried.
    pub fn speciate(
        &self,
        components: &[&[f64]],
        species: &mut [&mut [f64]],
        scratch: &mut Scratch,
    ) -> Result<(), Failure> {
        self.adopt(scratch);
        if let (Some(aqueous), Some(scratch)) = (&self.aqueous, &mut scratch.aqueous) {
            return aqueous.speciate(self.width, components, species, scratch);
        }
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

impl Integrator {
    fn new(
        plan: &Plan,
        chemistry: &Chemistry,
        kinetics: &Kinetics,
        aqueous: Option<&Aqueous>,
    ) -> Result<Self, String> {
        check_indices(plan, kinetics)?;
        let n = plan.components.len();
        let single = || match &kinetics.reactions[..] {
            [reaction] => Ok(reaction),
            reactions => Err(format!("a closed form for {} reactions", reactions.len())),
        };
        // Tolerances that are none would make every step fail.
        let tolerance = chemistry.tolerance.clamp(1e-13, 1.0);
        let small: Vec<f64> = (0..n)
            .map(|component| tolerance * chemistry.floors.get(component).copied().unwrap_or(0.0).max(1e-250))
            .collect();
        if let (Some(aqueous), Some(equilibrium)) = (aqueous, &chemistry.equilibrium) {
            return Self::mixed(plan, (tolerance, small), kinetics, (aqueous, equilibrium));
        }
        let system = || System::new(kinetics, &plan.species, n, Basis::Components, &small);
        Ok(match kinetics.method {
            Method::Observed | Method::Exponential => {
                let known = Exponential::of_mass_action(kinetics, &plan.species, n);
                Self::Exponential(match known {
                    Some(network) => network,
                    None => {
                        let linear = system()?.linear.ok_or("the network is not of first order")?;
                        Exponential::new(n, &linear.matrix, &linear.constant)
                    }
                })
            }
            Method::Pair => Self::Pair(Pair::new(single()?, &plan.species)?),
            Method::Saturation => Self::Saturation(Saturation::new(single()?, &plan.species)?),
            Method::Zero => Self::Zero(Zero::new(single()?)?),
            Method::Explicit | Method::Rosenbrock => {
                let system = system()?;
                let changes: Vec<Vec<(usize, f64)>> =
                    kinetics.reactions.iter().map(|reaction| reaction.changes.clone()).collect();
                let symbolic = Symbolic::new(n, &system.pattern);
                // What is faded out near zero is stiff there; plans that were compiled say so themselves.
                let is_explicit = kinetics.method == Method::Explicit && !system.is_gated;
                let invariants = Invariants::new(n, &changes);
                let network = Box::new(Network { system, invariants, small, tolerance });
                let is_asked_for = is_explicit && chemistry.integrator == Asked::Explicit;
                Self::Adaptive { network, symbolic, is_explicit, is_asked_for }
            }
        })
    }
}

impl Integrator {
    /// Kinetics of species in equilibrium: totals are integrated, with the rates of what they speciate to.
    fn mixed(
        plan: &Plan,
        (tolerance, small): (f64, Vec<f64>),
        kinetics: &Kinetics,
        (aqueous, equilibrium): (&Aqueous, &Equilibrium),
    ) -> Result<Self, String> {
        let n = plan.components.len();
        let mut system = System::new(kinetics, &plan.species, n, Basis::Species(equilibrium), &small)?;
        aqueous.mark_signs(&mut system.is_positive);
        let changes: Vec<Vec<(usize, f64)>> =
            kinetics.reactions.iter().map(|reaction| reaction.changes.clone()).collect();
        let everywhere: Vec<(usize, usize)> = (0..n).flat_map(|i| (0..n).map(move |j| (i, j))).collect();
        let symbolic = Symbolic::new(n, &everywhere);
        let invariants = Invariants::new(n, &changes);
        let network = Box::new(Network { system, invariants, small, tolerance });
        Ok(Self::Adaptive { network, symbolic, is_explicit: false, is_asked_for: false })
    }
}

fn first_failure(task: &Task<'_, '_>) -> Result<Work, Failure> {
    match task.failures.iter().min_by_key(|failure| failure.particle) {
        Some(failure) => Err(*failure),
        None => Ok(task.work),
    }
}

fn check_indices(plan: &Plan, kinetics: &Kinetics) -> Result<(), String> {
    let (n, n_species) = (plan.components.len(), plan.species.len());
    let has_component = |&(component, _): &(usize, f64)| component < n;
    let has_species = |law: &Law| match law {
        Law::MassAction { orders, .. } => orders.iter().all(|&(species, _)| species < n_species),
        Law::Saturation { species, .. } => *species < n_species,
        Law::Expression => true,
    };
    for reaction in &kinetics.reactions {
        if !reaction.changes.iter().all(has_component) || !has_species(&reaction.law) {
            return Err(format!("reaction `{}` names what is not there", reaction.name));
        }
    }
    if kinetics.laws.rates.len() != kinetics.reactions.len() {
        return Err("one rate per reaction is needed".to_owned());
    }
    let tape = crate::plan::tape::Tape { operations: kinetics.laws.operations.clone() };
    if !kinetics.reactions.is_empty() {
        tape.check(4 + n_species)?;
    }
    let is_written = |register: &u16| usize::from(*register) < tape.operations.len();
    if !kinetics.laws.rates.iter().all(is_written) {
        return Err("a rate stands in no register".to_owned());
    }
    Ok(())
}

fn check_finite(components: &[&mut [f64]]) -> Result<(), Failure> {
    for (component, column) in components.iter().enumerate() {
        // A sum of zeros, unless there is something that is no number.
        let sum: f64 = column.iter().map(|value| value * 0.0).sum();
        if sum != 0.0 {
            let particle = column.iter().position(|value| !value.is_finite()).unwrap_or(0);
            return Err(Failure { particle, why: Why::NotFinite { component, reaction: None } });
        }
    }
    Ok(())
}

//! The plan as the loops want it: constants per axis, roles of columns, terms of values.
//!
//! Owns the check that a plan can be run. May use `state` and the plan. It deliberately decides no
//! physics: everything here is already in the plan.

use super::error::RunError;
use super::sides::Rule;
use super::walk::Mover;
use crate::plan::{Mixing, OutputKind, Plan, Quantity, Side, Species, Stage, Time, ZoneRate};
use crate::state::grid::Grid;

/// What a stored column of a component is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Role {
    /// Never changes: without zones, in a well-mixed fluid, or with rate 0.
    Fixed,
    /// Relaxes to the mean of the bin at this rate, 1/s.
    Relaxing(f64),
    /// Always ū of the bin.
    Mean,
}

/// A summand of `U = Σ_i η_i W_i`, in the order of zones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Term {
    /// `fraction · column`
    Column { slot: usize, fraction: f64 },
    /// `fraction · ū`
    Mean { fraction: f64 },
}

/// `U = Σ_i η_i W_i`, zones in order.
#[inline(always)]
#[allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; this loop is hot.
pub fn total<C: AsRef<[f64]>>(terms: &[Term], columns: &[C], mixed: &[f64], target: &mut [f64]) {
    let n = target.len();
    for (rank, term) in terms.iter().enumerate() {
        let (fraction, values) = match *term {
            Term::Column { slot, fraction } => (fraction, &columns[slot].as_ref()[..n]),
            Term::Mean { fraction } => (fraction, &mixed[..n]),
        };
        for idx in 0..n {
            let before = if rank == 0 { 0.0 } else { target[idx] };
            target[idx] = before + fraction * values[idx];
        }
    }
}

/// What is done in one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Work {
    pub mixes: bool,
    pub reacts: bool,
    pub moves: bool,
    pub bounds: bool,
    pub exchanges: bool,
    /// Exchange of zones with means over the parcels around.
    pub blends: bool,
    pub averages: bool,
}

/// A plan that has been checked, for `D` active axes.
#[derive(Debug, Clone)]
pub struct Program<'a, const D: usize> {
    pub plan: &'a Plan,
    /// Bins of the averages.
    pub grid: Grid<D>,
    pub rules: [Rule; D],
    pub mover: Mover<D>,
    /// Stored columns of each component.
    pub roles: Vec<Role>,
    pub terms: Vec<Term>,
    /// `(slot, weight)` of the simulated zones in ū; the weights sum to 1.
    pub mean_weights: Vec<(usize, f64)>,
    /// The same of what is seen of a particle: its zones, or all that it stores where it stores its mean.
    pub seen_weights: Vec<(usize, f64)>,
    /// Σ η of the simulated zones: how much of a deviation from ū is seen in U.
    pub carried_fraction: f64,
    /// The passes over memory that make a step, in order.
    pub passes: Vec<Work>,
    /// How species follow from components at the instant that is looked at.
    pub species: Vec<Species>,
    /// Water of a particle: m, m² or m³ over the axes of the scene.
    pub volume: f64,
    /// Water of each bin of the averages over that of the mean one; nothing where all have the same.
    pub uneven: Option<Vec<f64>>,
    n_mobile: usize,
}

impl<'a, const D: usize> Program<'a, D> {
    pub fn new(plan: &'a Plan) -> Result<Self, RunError> {
        check_scalars(plan)?;
        check_indices(plan, D)?;
        let axis = |value: fn(&crate::plan::Axis) -> f64| std::array::from_fn(|idx| value(&plan.axes[idx]));
        let is_open = std::array::from_fn(|idx| {
            plan.axes[idx].low_side == Side::Open || plan.axes[idx].high_side == Side::Open
        });
        let bins = std::array::from_fn(|idx| plan.axes[idx].bins);
        let grid = Grid::new(axis(|a| a.low), axis(|a| a.high), bins, is_open)
            .ok_or_else(|| unsound("an axis without length or bins, or with too many bins"))?;
        let mut rules = [Rule::Open; D];
        for (rule, axis) in rules.iter_mut().zip(&plan.axes) {
            *rule = Rule::new(axis.low_side, axis.high_side, axis.low, axis.high)
                .ok_or_else(|| unsound("an axis with one periodic side"))?;
        }
        let mover = Mover::new(&plan.walk).ok_or_else(|| unsound("a walk that does not fit the axes"))?;
        let (roles, terms) = columns(plan.mixing.as_ref());
        let (mean_weights, carried_fraction) = weights(plan.mixing.as_ref(), &terms, &roles);
        let stored = terms.iter().filter_map(|term| match *term {
            Term::Column { slot, fraction } => Some((slot, fraction)),
            Term::Mean { .. } => None,
        });
        let (seen_weights, carried_fraction) = match plan.has_kernel_mean() {
            true => (stored.collect(), 1.0),
            false => (mean_weights.clone(), carried_fraction),
        };
        let mut program = Self {
            plan,
            rules,
            mover,
            roles,
            terms,
            mean_weights,
            seen_weights,
            carried_fraction,
            passes: Vec::new(),
            species: plan.species.clone(),
            volume: plan.particles.volume,
            uneven: None,
            grid,
            n_mobile: plan.n_mobile(),
        };
        program.passes = program.passes_of(&plan.stages);
        Ok(program)
    }

    /// Components that particles carry; those that live in bins come after them.
    pub fn n_components(&self) -> usize {
        self.n_mobile
    }

    pub fn n_columns(&self) -> usize {
        self.n_components() * self.roles.len()
    }

    /// Particles per bin, over all bins.
    pub fn per_bin(&self) -> f64 {
        self.plan.particles.count as f64 / self.grid.n_bins() as f64
    }

    /// Particles that make up the water of a bin.
    pub fn expected(&self, bin: usize) -> f64 {
        self.per_bin() * self.uneven.as_ref().map_or(1.0, |water| water[bin])
    }

    /// Sum over bins, each by its water over that of the mean one.
    pub fn sum_of_bins(&self, values: &[f64]) -> f64 {
        match &self.uneven {
            None => values.iter().sum(),
            Some(water) => values.iter().zip(water).map(|(value, water)| value * water).sum(),
        }
    }

    /// Whether particles see means of bins.
    pub fn has_mixing(&self) -> bool {
        self.plan.sees_bins()
    }

    /// Whether particles are divided into zones.
    pub fn has_zones(&self) -> bool {
        self.plan.mixing.is_some()
    }

    pub fn has_equilibrium(&self) -> bool {
        self.plan.chemistry.as_ref().is_some_and(|chemistry| chemistry.equilibrium.is_some())
    }

    /// Whether what a particle reacts with hangs on its bin: a mean, or what lives there.
    pub fn is_coupled(&self) -> bool {
        self.plan.hangs_on_bins()
    }

    /// Which of a component's columns is a mean over the parcels around.
    pub fn mean_slot(&self) -> Option<usize> {
        let slot = self.roles.iter().position(|role| *role == Role::Mean);
        slot.filter(|_| self.plan.has_kernel_mean())
    }

    /// Whether any zone approaches the mean of its bin.
    pub fn relaxes(&self) -> bool {
        self.has_mixing() && self.roles.iter().any(|role| !matches!(role, Role::Fixed))
    }

    /// Factor `e^{−χΔt/2}` per slot; `None` where nothing relaxes towards the mean of its bin.
    pub fn decays(&self, dt: f64) -> Vec<Option<f64>> {
        let decay = |role: &Role| match *role {
            Role::Relaxing(rate) if self.has_mixing() => Some(crate::maths::scalar::exp(-0.5 * rate * dt)),
            Role::Relaxing(_) | Role::Fixed | Role::Mean => None,
        };
        self.roles.iter().map(decay).collect()
    }

    /// Turns the stages of the plan into passes, leaving out what has nothing to do.
    fn passes_of(&self, stages: &[Stage]) -> Vec<Work> {
        let relaxes = self.relaxes();
        let is_tracked = self.plan.transport.is_some();
        let moves = is_tracked || self.mover.is_moving();
        let reacts = self.plan.reacts_in_steps();
        let is_coupled = reacts && self.is_coupled();
        let averages = relaxes || is_coupled;
        let works = stages.iter().map(|stage| match stage {
            Stage::Mix => Work { mixes: relaxes, ..Work::default() },
            Stage::React => Work { reacts, ..Work::default() },
            Stage::FusedReact => Work { mixes: relaxes, reacts, ..Work::default() },
            Stage::Move => Work { moves, ..Work::default() },
            Stage::Bound => Work { bounds: moves && !is_tracked, ..Work::default() },
            Stage::Exchange => Work { exchanges: self.plan.exchange.is_some(), ..Work::default() },
            Stage::KernelMean => Work { blends: self.plan.has_kernel_mean(), ..Work::default() },
            Stage::Average => Work { averages, ..Work::default() },
            Stage::FusedStep => Work {
                mixes: relaxes,
                reacts: reacts && !is_coupled,
                moves,
                bounds: moves,
                averages,
                ..Work::default()
            },
            // Of particles that carry mass, which are run elsewhere.
            Stage::Estimate | Stage::Observe => Work::default(),
        });
        works.filter(|work| *work != Work::default()).collect()
    }
}

/// The columns of a component and the terms of its value.
fn columns(mixing: Option<&Mixing>) -> (Vec<Role>, Vec<Term>) {
    let Some(mixing) = mixing else {
        return (vec![Role::Fixed], vec![Term::Column { slot: 0, fraction: 1.0 }]);
    };
    let (mut roles, mut terms) = (Vec::new(), Vec::new());
    if mixing.is_well_mixed {
        roles.push(Role::Fixed);
    }
    if mixing.averaging.is_some() {
        with_kernel_mean(mixing, &mut roles, &mut terms);
        return (roles, terms);
    }
    if mixing.is_well_mixed {
        terms.push(Term::Mean { fraction: 1.0 });
    }
    for zone in &mixing.zones {
        match zone.rate {
            ZoneRate::Instant => {
                if !mixing.is_well_mixed {
                    terms.push(Term::Mean { fraction: zone.fraction });
                }
                if zone.is_stored {
                    roles.push(Role::Mean);
                }
            }
            ZoneRate::Finite(rate) => {
                terms.push(Term::Column { slot: roles.len(), fraction: zone.fraction });
                roles.push(if rate > 0.0 { Role::Relaxing(rate) } else { Role::Fixed });
            }
        }
    }
    (roles, terms)
}

/// The same where a particle stores the mean that it sees: once, for all zones that are instant.
fn with_kernel_mean(mixing: &Mixing, roles: &mut Vec<Role>, terms: &mut Vec<Term>) {
    let mut fraction = 0.0;
    for zone in &mixing.zones {
        match zone.rate {
            ZoneRate::Instant => fraction += zone.fraction,
            ZoneRate::Finite(rate) => {
                terms.push(Term::Column { slot: roles.len(), fraction: zone.fraction });
                roles.push(if rate > 0.0 { Role::Relaxing(rate) } else { Role::Fixed });
            }
        }
    }
    if mixing.stores_mean() {
        let fraction = if mixing.is_well_mixed { 1.0 } else { fraction };
        terms.push(Term::Column { slot: roles.len(), fraction });
        roles.push(Role::Mean);
    }
}

fn weights(mixing: Option<&Mixing>, terms: &[Term], roles: &[Role]) -> (Vec<(usize, f64)>, f64) {
    if mixing.is_some_and(|mixing| mixing.is_well_mixed) {
        return (vec![(0, 1.0)], 0.0);
    }
    let simulated = terms.iter().filter_map(|term| match *term {
        Term::Column { slot, fraction } => Some((slot, fraction)),
        Term::Mean { .. } => None,
    });
    // A stored mean is no zone that is simulated.
    let simulated: Vec<(usize, f64)> = simulated.filter(|&(slot, _)| roles[slot] != Role::Mean).collect();
    let sum: f64 = simulated.iter().map(|&(_, fraction)| fraction).sum();
    let n = simulated.len() as f64;
    debug_assert!(simulated.iter().all(|&(slot, _)| !matches!(roles[slot], Role::Mean)));
    let weight = |fraction: f64| if sum > 0.0 { fraction / sum } else { 1.0 / n };
    (simulated.iter().map(|&(slot, fraction)| (slot, weight(fraction))).collect(), sum)
}

pub fn unsound(what: &str) -> RunError {
    RunError::Plan(what.to_owned())
}

fn check_scalars(plan: &Plan) -> Result<(), RunError> {
    if plan.transport.is_some() && plan.stages.contains(&Stage::FusedStep) {
        return Err(unsound("parcels on tracks do not move in one pass with other work"));
    }
    let time = &plan.time;
    let last = time.duration - time.step * time.n_steps.saturating_sub(1) as f64;
    // Twice the slack, since the last step is itself a difference of rounded numbers.
    let longest = 1.0 + 2.0 * Time::slack(time.n_steps as f64);
    let is_time_sound = time.duration.is_finite()
        && time.duration >= 0.0
        && (time.n_steps == 0 || (time.step > 0.0 && last > 0.0 && last <= time.step * longest));
    if !is_time_sound {
        return Err(unsound("steps that do not add up to the duration"));
    }
    if plan.particles.count == 0 || plan.particles.count > 1 << 48 {
        return Err(unsound("no particles, or more than 2^48"));
    }
    if !(plan.particles.volume.is_finite() && plan.particles.volume > 0.0) {
        return Err(unsound("particles without volume"));
    }
    let Some(mixing) = &plan.mixing else { return Ok(()) };
    let is_simulated = |rate: ZoneRate| matches!(rate, ZoneRate::Finite(_));
    let has_simulated = mixing.zones.iter().any(|zone| is_simulated(zone.rate));
    if has_simulated == mixing.is_well_mixed {
        return Err(unsound("mixing is called well mixed exactly if all zones are instant"));
    }
    for zone in &mixing.zones {
        let is_rate_sound = match zone.rate {
            ZoneRate::Instant => true,
            ZoneRate::Finite(rate) => zone.is_stored && rate >= 0.0 && rate.is_finite(),
        };
        if !(is_rate_sound && zone.fraction >= 0.0 && zone.fraction.is_finite()) {
            return Err(unsound(
                "a mixing zone with a rate or fraction out of range, or one that is not stored",
            ));
        }
    }
    Ok(())
}

fn check_indices(plan: &Plan, n_axes: usize) -> Result<(), RunError> {
    let n_species = plan.species.len();
    if plan.axes.iter().any(|axis| axis.index > 2) {
        return Err(unsound("an axis beyond x, y and z"));
    }
    let n_mobile = plan.n_mobile();
    if plan.components[..n_mobile].iter().any(|component| component.is_immobile) {
        return Err(unsound("an immobile component before a mobile one"));
    }
    for component in &plan.components {
        component
            .initial
            .check(4)
            .map_err(|what| unsound(&format!("initial `{}`: {what}", component.name)))?;
    }
    for species in &plan.species {
        if species.terms.iter().any(|&(component, _)| component >= plan.components.len()) {
            return Err(unsound("a species made of a component that does not exist"));
        }
    }
    for reaction in &plan.reactions {
        let all = reaction.reactants.iter().chain(&reaction.products);
        let is_sound = all.clone().all(|&(species, _)| species < n_species)
            && !reaction.reactants.is_empty()
            && reaction.reactants.iter().all(|&(_, coefficient)| coefficient > 0.0);
        if !is_sound {
            return Err(unsound("a reaction of species that do not exist, or without reactants"));
        }
    }
    for output in &plan.outputs {
        let is_pair = matches!(output.kind, OutputKind::Covariance | OutputKind::Mixing);
        let is_quantity_sound = output.quantities.iter().all(|quantity| match *quantity {
            Quantity::Species(species) => !is_pair && species < n_species,
            Quantity::Pair(a, b) => is_pair && a < n_species && b < n_species,
        });
        let needs_bins = output.kind.has_bins();
        let is_binned = !needs_bins || output.bins.len() == n_axes;
        let is_immobile = |species: usize| plan.species[species].terms.iter().any(|&(k, _)| k >= n_mobile);
        let is_mixing_sound = output.kind != OutputKind::Mixing
            || output.quantities.iter().all(|quantity| match *quantity {
                Quantity::Pair(a, b) => !is_immobile(a) && !is_immobile(b),
                Quantity::Species(_) => false,
            });
        let is_counted = plan.transport.is_some() || !output.kind.counts_passages();
        let has_fluid = is_counted && !output.kind.needs_masses();
        if !has_fluid || !is_quantity_sound || !is_binned || !is_mixing_sound {
            return Err(unsound("an output whose species or bins do not fit"));
        }
    }
    Ok(())
}

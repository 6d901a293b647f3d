//! Transport and reaction take turns: what is pending, what lives in bins, and the budget.
//!
//! Owns the order of these turns. May use `chemistry` and the passes of a run. It deliberately knows no
//! rate law: a reactor does.

use super::average::Means;
use super::error::RunError;
use super::initial;
use super::program::{Program, Work, unsound};
use super::react::{Added, Bench, Reaction, Span, add_work};
use super::run::Run;
use crate::chemistry::{Batch, Observed, Reactor, Reversal, Scratch, Why, Work as Labour};
use crate::diagnostic::precise;
use crate::plan::Plan;
use crate::plan::chemistry::{Kinetic, Splitting};
use crate::state::particles::{Block, CHUNK};
use std::sync::{Mutex, PoisonError};

/// The chemistry of a run.
pub struct Reactions {
    pub reactor: Option<Reactor>,
    /// For bins without particles: only what lives there reacts, with itself.
    resting: Option<Reactor>,
    observed: Option<Observed>,
    pub speciation: Option<Speciation>,
    /// With zones: what is taken back where others have used up a mean.
    pub reversal: Option<Reversal>,
    /// The same as observations see it.
    pub shown: Option<Reversal>,
    pub is_symmetric: bool,
    /// Over which the particles still have to react, at the positions that they have now.
    spans: Vec<Span>,
    step: Span,
    /// Per immobile component and slot, the concentration in the fluid of the bin.
    pub immobile: Vec<Vec<f64>>,
    /// Its sums over bins at the beginning.
    pub immobile_before: Vec<f64>,
    /// Per component.
    pub added: Vec<Added>,
    /// Per component the largest size that the sum of what was added has had.
    pub peaks: Vec<f64>,
    /// Of everything that was integrated.
    pub labour: Labour,
}

/// Equilibrium as observations see it.
pub struct Speciation {
    pub reactor: Reactor,
    /// What is in equilibrium.
    pub species: Vec<usize>,
    /// The first particle without equilibrium.
    failure: Mutex<Option<(u64, Why)>>,
}

impl Clone for Speciation {
    fn clone(&self) -> Self {
        Self { reactor: self.reactor.clone(), species: self.species.clone(), failure: Mutex::default() }
    }
}

impl Speciation {
    fn new(plan: &Plan) -> Result<Option<Self>, String> {
        let equilibrium = plan.chemistry.as_ref().and_then(|chemistry| chemistry.equilibrium.as_ref());
        // A reactor of a network that is propagated when somebody looks is another one.
        let Some(equilibrium) = equilibrium else { return Ok(None) };
        let Some(reactor) = Reactor::new(plan)? else { return Ok(None) };
        let primaries = equilibrium.primaries.iter().map(|primary| primary.species);
        let secondaries = equilibrium.secondaries.iter().map(|secondary| secondary.species);
        let minerals = equilibrium.minerals.iter().map(|mineral| mineral.species);
        let species = primaries.chain(secondaries).chain(minerals).collect();
        Ok(Some(Self { reactor, species, failure: Mutex::default() }))
    }

    /// Keeps the failure of the first particle.
    pub fn fail(&self, particle: u64, why: Why) {
        let mut kept = self.failure.lock().unwrap_or_else(PoisonError::into_inner);
        if kept.is_none_or(|(first, _)| particle < first) {
            *kept = Some((particle, why));
        }
    }

    /// What was kept.
    pub fn failure(&self) -> Option<(u64, Why)> {
        *self.failure.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What the reactions of a group of blocks gave.
#[derive(Default)]
pub struct Yield {
    added: Vec<Added>,
    labour: Labour,
}

impl Yield {
    /// Takes what a thread has gathered.
    pub fn take(&mut self, bench: &mut Bench) {
        self.added.clone_from(&bench.added);
        self.labour = std::mem::take(&mut bench.labour);
    }
}

impl Reactions {
    pub fn new<const D: usize>(program: &Program<D>, blocks: &mut [Block<D>]) -> Result<Self, RunError> {
        let plan = program.plan;
        let reactor = match plan.reacts_in_steps() {
            true => Reactor::new(plan).map_err(|what| unsound(&what))?,
            false => None,
        };
        if reactor.is_some() {
            for block in blocks {
                block.memory.resize(block.n_particles, 0.0);
            }
        }
        let immobile = initial::immobile(program)?;
        let resting = match reactor.is_some() && !immobile.is_empty() {
            true => resting(plan).map_err(|what| unsound(&what))?,
            false => None,
        };
        let splitting = plan.chemistry.as_ref().map(|chemistry| chemistry.splitting);
        Ok(Self {
            reactor,
            resting,
            observed: Observed::new(plan).map_err(|what| unsound(&what))?,
            speciation: Speciation::new(plan).map_err(|what| unsound(&what))?,
            reversal: Reversal::new(plan).filter(|_| program.has_zones()),
            shown: Reversal::shown(plan).filter(|_| program.has_zones()),
            is_symmetric: splitting == Some(Splitting::Strang),
            spans: Vec::new(),
            step: Span { t: 0.0, dt: 0.0 },
            immobile_before: immobile.iter().map(|bins| program.sum_of_bins(bins)).collect(),
            immobile,
            added: vec![Added::default(); plan.components.len()],
            peaks: vec![0.0; plan.components.len()],
            labour: Labour::default(),
        })
    }

    /// The same, to go another way from here.
    pub fn copy(&self) -> Self {
        Self {
            reactor: self.reactor.clone(),
            resting: self.resting.clone(),
            observed: self.observed.clone(),
            speciation: self.speciation.clone(),
            reversal: self.reversal.clone(),
            shown: self.shown.clone(),
            is_symmetric: self.is_symmetric,
            spans: self.spans.clone(),
            step: self.step,
            immobile: self.immobile.clone(),
            immobile_before: self.immobile_before.clone(),
            added: self.added.clone(),
            peaks: self.peaks.clone(),
            labour: Labour::default(),
        }
    }

    /// The step that begins; with symmetric splitting its first half reacts before anything moves.
    pub fn begin_step(&mut self, t: f64, dt: f64) {
        self.step = Span { t, dt };
        if self.is_symmetric && self.reactor.is_some() {
            self.spans.push(Span { t, dt: 0.5 * dt });
        }
    }

    /// What is left to react when everything has moved.
    pub fn end_step(&mut self) {
        if self.reactor.is_some() {
            let Span { t, dt } = self.step;
            let rest = if self.is_symmetric { Span { t: t + 0.5 * dt, dt: 0.5 * dt } } else { self.step };
            self.spans.push(rest);
        }
    }

    pub fn take_spans(&mut self) -> Vec<Span> {
        std::mem::take(&mut self.spans)
    }

    /// The reaction of a pass; none if nothing reacts in it.
    pub fn reaction<'a, const D: usize>(
        &'a self,
        program: &'a Program<'a, D>,
        means: &'a Means,
        spans: &'a [Span],
    ) -> Option<Reaction<'a, D>> {
        let reactor = self.reactor.as_ref().filter(|_| !spans.is_empty())?;
        Some(Reaction {
            program,
            reactor,
            reversal: self.reversal.as_ref(),
            spans,
            means,
            immobile: &self.immobile,
        })
    }

    /// Takes the sums and yields of a pass over all groups, in their order.
    pub fn settle<'y, const D: usize>(
        &mut self,
        program: &Program<D>,
        sums: &[f64],
        yields: impl Iterator<Item = &'y Yield>,
    ) {
        for group in yields {
            self.added.iter_mut().zip(&group.added).for_each(|(sum, part)| sum.add(*part));
            add_work(&mut self.labour, &group.labour);
        }
        for (peak, added) in self.peaks.iter_mut().zip(&self.added) {
            *peak = peak.max(added.sum.abs());
        }
        let stride = self.immobile.len();
        let n_bins = program.grid.n_bins();
        for (idx, bins) in self.immobile.iter_mut().enumerate() {
            let changes = sums.iter().skip(idx).step_by(stride);
            for ((number, bin), change) in bins[..n_bins].iter_mut().enumerate().zip(changes) {
                let (before, change) = (*bin, change / program.expected(number));
                *bin = before + change;
                // What is used up may miss zero by rounding; more than that would be a loss, and shows.
                if *bin < 0.0 && -*bin <= 1e-12 * before.abs() {
                    *bin = 0.0;
                }
            }
        }
    }

    /// A failure of the chemistry in the words of the plan.
    pub fn explain<const D: usize>(&self, program: &Program<D>, why: Why) -> String {
        explain(program.plan, why)
    }
}

/// A failure of the chemistry in the words of a plan.
pub fn explain(plan: &Plan, why: Why) -> String {
    let name = |idx: usize| plan.components.get(idx).map_or("?", |component| &component.name);
    match why {
        Why::StepTooSmall { component, t, step } => format!(
            "at {} s a sub-step of {} s is still too long for `{}`",
            precise(t),
            precise(step),
            name(component)
        ),
        Why::TooManySteps { t, tried, .. } => {
            format!("{tried} sub-steps, the most that one step may take, end at {} s", precise(t))
        }
        Why::NotFinite { component, reaction } => {
            let kinetics = plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
            let own = reaction.and_then(|idx| kinetics?.reactions.get(idx));
            let own = own.map_or_else(String::new, |own| format!(" in reaction `{}`", own.name));
            format!("the rate of `{}`{own} is not a finite number", name(component))
        }
        Why::Negative { component, value } => {
            format!("`{}` would become negative ({})", name(component), precise(value))
        }
        Why::Impossible => "no amounts of species in equilibrium have these totals".to_owned(),
        Why::Endless => {
            "no solution is at or below the saturation of all minerals: their constants contradict \
                         each other"
                .to_owned()
        }
        Why::NoEquilibrium { residual } => {
            format!("no equilibrium is found (relative residual {})", precise(residual))
        }
        Why::TooSalty { ionic_strength } => {
            format!(
                "the ionic strength {} mol/L is more than activities are known for",
                precise(ionic_strength)
            )
        }
    }
}

/// The reactions of a plan that change nothing but what lives in bins; `None` if there are none.
fn resting(plan: &Plan) -> Result<Option<Reactor>, String> {
    let mut plan = plan.clone();
    let kinetics = plan.chemistry.as_mut().and_then(|chemistry| chemistry.kinetics.as_mut());
    let Some(kinetics) = kinetics else { return Ok(None) };
    let is_resting = |reaction: &Kinetic| {
        reaction.changes.iter().all(|&(k, change)| change == 0.0 || plan.components[k].is_immobile)
    };
    let mut is_kept = kinetics.reactions.iter().map(is_resting).collect::<Vec<_>>().into_iter();
    let rates =
        std::mem::take(&mut kinetics.laws.rates).into_iter().zip(std::mem::take(&mut kinetics.reactions));
    let kept = rates.filter(|_| is_kept.next().unwrap_or(false));
    (kinetics.laws.rates, kinetics.reactions) = kept.unzip();
    if kinetics.reactions.is_empty() { Ok(None) } else { Reactor::new(&plan) }
}

impl<const D: usize> Run<'_, D> {
    /// Brings everything up to date for somebody who looks, and says how species follow from components
    /// then. Without reactions in steps a look-through does as well, and costs less.
    pub fn look_at(&mut self, t: f64, steps: u64) -> Result<(), RunError> {
        if let Some(recipes) = self.reactions.observed.as_ref().and_then(|observed| observed.recipes(t)) {
            self.program.species = recipes;
        }
        let takes_copies = self.reactions.reactor.is_some() || !self.exchanges.are_none();
        if takes_copies { self.settle_pending(steps.saturating_sub(1)) } else { Ok(()) }
    }

    /// Does what the step before has left to do.
    pub fn settle_pending(&mut self, step: u64) -> Result<(), RunError> {
        let work = Work { mixes: self.pending.is_some(), ..Work::default() };
        if self.reactions.spans.is_empty() {
            let leap = self.program.mover.leap(0.0, 0.0);
            return if work.mixes { self.pass(work, step, leap, &[]) } else { Ok(()) };
        }
        let work = Work { reacts: true, ..work };
        if self.program.is_coupled() {
            return self.react_in_bins(work, step);
        }
        let spans = self.reactions.take_spans();
        self.pass(work, step, self.program.mover.leap(0.0, 0.0), &spans)
    }

    /// One reaction after the other, each with the means and bins as the one before left them.
    pub fn react_in_bins(&mut self, work: Work, step: u64) -> Result<(), RunError> {
        let still = self.program.mover.leap(0.0, 0.0);
        let mut mixes = work.mixes;
        let spans = self.reactions.take_spans();
        if spans.is_empty() && mixes {
            return self.pass(Work { mixes, ..Work::default() }, step, still, &[]);
        }
        for span in spans {
            if !self.is_averaged {
                self.pass(Work { averages: true, ..Work::default() }, step, still, &[])?;
            }
            self.pass(Work { mixes, reacts: true, ..Work::default() }, step, still, &[span])?;
            mixes = false;
            self.react_without_particles(span, step)?;
        }
        Ok(())
    }

    /// What lives in a bin without particles reacts with nothing but itself. What it would give to the fluid
    /// waits: nobody is there to take it.
    fn react_without_particles(&mut self, span: Span, step: u64) -> Result<(), RunError> {
        let (program, reactions) = (&self.program, &mut self.reactions);
        let Some(reactor) = &reactions.resting else { return Ok(()) };
        let n_bins = program.grid.n_bins();
        let empty: Vec<usize> = (0..n_bins).filter(|&bin| self.means.counts[bin] == 0.0).collect();
        if empty.is_empty() {
            return Ok(());
        }
        let mut places = [const { Vec::new() }; 3];
        for (rank, axis) in program.plan.axes.iter().enumerate() {
            places[axis.index] = empty.iter().map(|&bin| program.grid.centre(bin)[rank]).collect();
        }
        let mut values = vec![vec![0.0; empty.len()]; program.n_components()];
        values.extend(reactions.immobile.iter().map(|bins| empty.iter().map(|&bin| bins[bin]).collect()));
        let positions = places.each_ref().map(|axis: &Vec<f64>| &axis[..]);
        let mut memory = vec![0.0_f32; empty.len()];
        let mut scratch = Scratch::default();
        for start in (0..empty.len()).step_by(CHUNK) {
            let range = start..(start + CHUNK).min(empty.len());
            let mut columns: Vec<&mut [f64]> = values.iter_mut().map(|c| &mut c[range.clone()]).collect();
            let batch = Batch {
                positions: positions.map(|axis| if axis.is_empty() { axis } else { &axis[range.clone()] }),
                t: span.t,
                dt: span.dt,
                components: &mut columns,
                memory: &mut memory[range.clone()],
            };
            if let Err(failure) = reactor.react(batch, &mut scratch) {
                let what = format!(
                    "in a bin without particles: {}",
                    reactions.explain(program, failure.why.without_reaction())
                );
                // Fewer reactions go on there: numbers are not those of the plan.
                let why = failure.why.without_reaction();
                return Err(RunError::Chemistry { step: step.max(1), particle: 0, what, why });
            }
        }
        for (idx, bins) in reactions.immobile.iter_mut().enumerate() {
            for (&bin, &after) in empty.iter().zip(&values[program.n_components() + idx]) {
                let change = (after - bins[bin]) * program.expected(bin);
                reactions.added[program.n_components() + idx].add(Added { sum: change, size: change.abs() });
                bins[bin] = after;
            }
        }
        Ok(())
    }
}

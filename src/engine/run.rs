//! The loop over steps.
//!
//! Owns the state of a run and its checks. May use all stages. It deliberately works on no particle:
//! passes do.

use super::amount::{self, Amount};
use super::average::{self, Means};
use super::calendar::Calendar;
use super::clock::Clock;
use super::conserved;
use super::control::{Control, Settings};
use super::error::RunError;
use super::exchange::Exchanges;
use super::mass::{gate::Gates, media::flow_of};
use super::observe::{self, Instant, Lab};
use super::parallel::{self, Pool};
use super::program::{Program, Work};
use super::react::{Added, Span};
use super::reactions::{Reactions, Yield};
use super::schedule::{Due, schedule, step_length};
use super::snapshot::{Outcome, Snapshot};
use super::step::{OnBlock, Pass, Scratch, Trouble};
use super::track::tracker::Steps;
use super::water::{Water, quanta};
use super::{initial, walk::Leap};
use crate::maths::exact::Quanta;
use crate::maths::wide::Width;
use crate::plan::Plan;
use crate::state::particles::{Block, state_bytes};
use crate::state::stream::{Purpose, Stream};

/// Relative change of a carried amount that stops a run.
const LOST: f64 = 1e-9;

/// Negative values of this size, relative to the largest initial value, are rounding.
const ROUNDING: f64 = 1e-12;

type Sink<'a> = &'a mut (dyn FnMut(Snapshot) -> Result<(), RunError> + Send);

/// Everything that lives as long as the run.
pub struct Run<'a, const D: usize> {
    pub program: Program<'a, D>,
    pub width: Width,
    pub blocks: Vec<Block<D>>,
    pub walk: Stream,
    pub bridge: Stream,
    /// Of the last `Average`.
    pub means: Means,
    /// Decays of a relaxation that the next pass will do.
    pub pending: Option<Vec<Option<f64>>>,
    /// Whether `means` are those of the positions now.
    pub is_averaged: bool,
    pub labs: Pool<Lab<D>>,
    scratches: Pool<Scratch<D>>,
    groups: Vec<Group>,
    blocks_per_group: usize,
    pub before: Vec<Amount>,
    /// What reactions conserve.
    invariants: Vec<Vec<f64>>,
    /// Smallest value allowed per component.
    pub limits: Vec<f64>,
    pub reactions: Reactions,
    /// What moves particles that come and go; the walk of the program moves all others.
    pub water: Option<Water<D>>,
    /// Outputs of what passes places.
    pub gates: Gates,
    pub quanta: Quanta,
    /// What parcels exchange with those around them.
    pub exchanges: Exchanges<D>,
}

/// Sums and the first trouble of consecutive blocks.
#[derive(Default)]
struct Group {
    sums: Vec<f64>,
    trouble: Option<Trouble>,
    yields: Yield,
}

pub fn run<const D: usize>(
    plan: &Plan,
    settings: &Settings,
    control: &dyn Control,
    sink: Sink,
) -> Result<Outcome, RunError> {
    let mut clock = Clock::start();
    let calendar = Calendar::new(&plan.time, &[]);
    let mut dues = schedule(plan, &calendar)?;
    let mut run = Run::<D>::new(plan, settings, &mut dues)?;
    run.take_means()?;
    let mut loop_clock = Clock::start();
    let mut dues = dues.iter().peekable();
    for step in 0..=plan.time.n_steps {
        let mut passed = Vec::new();
        in_order(&mut passed, run.gates.ready(step));
        while let Some(due) = dues.next_if(|due| due.steps == step) {
            run.look_at(due.t, step)?;
            let mut snapshots = match run.ahead(due)? {
                Some(ahead) => observe::observe(&ahead, due, &Instant::Now)?,
                None => observe::observe(&run, due, &run.instant(due))?,
            };
            let (before, later) = passed.into_iter().partition(|snapshot| snapshot.t <= due.t);
            passed = later;
            in_order(&mut snapshots, before);
            for snapshot in snapshots {
                loop_clock.away(|| clock.away(|| sink(snapshot)))?;
            }
        }
        for snapshot in passed {
            loop_clock.away(|| clock.away(|| sink(snapshot)))?;
        }
        if control.is_cancelled() {
            return Err(RunError::Cancelled);
        }
        if step < plan.time.n_steps {
            run.step(step)?;
            control.step_done(step + 1, plan.time.n_steps);
        }
    }
    let loop_wall = loop_clock.wall();
    let mass_defect = run.finish()?;
    run.check_defects(&mass_defect, plan.time.n_steps.saturating_sub(1))?;
    Ok(Outcome {
        n_steps: plan.time.n_steps,
        n_particles: plan.particles.count,
        mass_defect,
        labour: run.reactions.labour,
        loop_wall,
        wall: clock.wall(),
        cpu: clock.cpu(),
        state_bytes: state_bytes(plan.particles.count, D, run.program.n_columns()),
        flow: None,
    })
}

impl<'a, const D: usize> Run<'a, D> {
    /// Outputs of what passes places leave `dues`.
    fn new(plan: &'a Plan, settings: &Settings, dues: &mut Vec<Due>) -> Result<Self, RunError> {
        // A flow is solved or read once.
        let solved = plan.transport.as_ref().map(|_| flow_of(plan, settings)).transpose()?.flatten();
        let settings = &Settings { flow: solved, ..settings.clone() };
        let mut program = Program::<D>::new(plan)?;
        program.mover.takes_half_draws = settings.takes_half_draws;
        let width = if settings.is_narrow { Width::baseline() } else { Width::widest() };
        let (water, gates) = match plan.transport {
            Some(_) => {
                let (water, gates) = Water::new(&mut program, settings, width, dues)?;
                (Some(water), gates)
            }
            None => (None, Gates::default()),
        };
        let mut blocks = initial::blocks(&program, water.as_ref().and_then(Water::cells))?;
        let before = amount::amounts(&blocks, program.n_columns());
        let reactions = Reactions::new(&program, &mut blocks)?;
        let ranges = water.iter().flat_map(|water| &water.ranges).map(|range| range.1);
        let highest = before.iter().map(|amount| amount.highest).chain(ranges).fold(0.0, f64::max);
        let quanta = quanta(program.volume, highest);
        let limits = limits(&program, &before, water.as_ref().map_or(&[], |water| &water.ranges));
        let blocks_per_group = average::blocks_per_group(plan.particles.count, program.grid.n_slots());
        let n_groups = blocks.len().div_ceil(blocks_per_group);
        let groups = (0..n_groups).map(|_| Group::default()).collect();
        Ok(Self {
            exchanges: Exchanges::new(&program, settings)?,
            width,
            walk: Stream::new(plan.seed, Purpose::Walk),
            bridge: Stream::new(plan.seed, Purpose::Bridge),
            means: Means::default(),
            pending: None,
            is_averaged: false,
            program,
            blocks,
            labs: Pool::new(),
            scratches: Pool::new(),
            groups,
            blocks_per_group,
            before,
            invariants: conserved::invariants(plan),
            limits,
            reactions,
            water,
            gates,
            quanta,
        })
    }

    /// The same state, to go another way from here.
    pub(super) fn copy(&self) -> Self {
        Self {
            program: self.program.clone(),
            width: self.width,
            blocks: self.blocks.clone(),
            walk: self.walk.clone(),
            bridge: self.bridge.clone(),
            means: self.means.clone(),
            pending: self.pending.clone(),
            is_averaged: self.is_averaged,
            labs: Pool::new(),
            scratches: Pool::new(),
            groups: self.groups.iter().map(|_| Group::default()).collect(),
            blocks_per_group: self.blocks_per_group,
            before: self.before.clone(),
            invariants: self.invariants.clone(),
            limits: self.limits.clone(),
            reactions: self.reactions.copy(),
            water: self.water.as_ref().map(Water::copy),
            gates: Gates::default(),
            quanta: self.quanta,
            exchanges: self.exchanges.copy(),
        }
    }

    /// How the state is to be seen at a due time.
    pub(super) fn instant(&self, due: &Due) -> Instant<D> {
        if due.fraction == 0.0 {
            return Instant::Now;
        }
        let dt = step_length(&self.program.plan.time, due.steps);
        Instant::between(&self.program, due.steps, due.fraction, due.t, dt)
    }

    /// One step: the passes of the plan.
    fn step(&mut self, step: u64) -> Result<(), RunError> {
        let dt = step_length(&self.program.plan.time, step);
        let leap = self.program.mover.leap(dt, dt.sqrt());
        self.reactions.begin_step(step as f64 * self.program.plan.time.step, dt);
        let passes = self.program.passes.clone();
        for work in passes {
            let mixes = work.mixes && self.pending.is_some();
            let work = Work { mixes, ..work };
            if work.moves && self.water.is_some() {
                let t = step as f64 * self.program.plan.time.step;
                self.flow_on(Steps { first: step, end: step + 1, t, dt })?;
                continue;
            }
            if work.exchanges || work.blends {
                self.exchange(work, step, dt)?;
                continue;
            }
            if work.reacts && self.program.is_coupled() {
                self.react_in_bins(work, step)?;
                continue;
            }
            let spans = if work.reacts { self.reactions.take_spans() } else { Vec::new() };
            self.is_averaged &= !work.moves;
            self.pass(work, step, leap, &spans)?;
            if work.averages {
                self.pending = self.program.relaxes().then(|| self.program.decays(dt));
                self.check_amounts(step)?;
            }
        }
        self.reactions.end_step();
        Ok(())
    }

    /// A step of particles that come and go: a stage of its own.
    pub(super) fn flow_on(&mut self, steps: Steps) -> Result<(), RunError> {
        self.prepare_gates(steps.first)?;
        let Some(water) = &mut self.water else { return Ok(()) };
        let passages = water.flow_on(&mut self.blocks, steps)?;
        self.count(&passages, steps.first)?;
        self.groups.resize_with(self.blocks.len().div_ceil(self.blocks_per_group), Group::default);
        self.is_averaged = false;
        Ok(())
    }

    /// One pass over all blocks, in parallel over groups. What reacts does so over `spans`.
    pub(super) fn pass(
        &mut self,
        work: Work,
        step: u64,
        leap: Leap<D>,
        spans: &[Span],
    ) -> Result<(), RunError> {
        let stride = self.program.n_columns() + 1;
        let n_places = self.program.grid.n_slots();
        let n_immobile = self.reactions.immobile.len();
        let sums_len = match work {
            Work { averages: true, .. } => n_places * stride,
            Work { reacts: true, .. } => n_places * n_immobile,
            _ => 0,
        };
        let n_lanes = if work.averages { average::lanes(n_places) } else { 1 };
        let pass = Pass {
            program: &self.program,
            work,
            step,
            leap,
            stream: &self.walk,
            means: &self.means,
            decays: self.pending.as_deref().unwrap_or_default(),
            reaction: self.reactions.reaction(&self.program, &self.means, spans),
            limits: &self.limits,
            n_lanes,
            width: self.width,
        };
        let (width, scratches) = (self.width, &self.scratches);
        let blocks = self.blocks.chunks_mut(self.blocks_per_group);
        let mut tasks: Vec<_> = blocks.zip(&mut self.groups).collect();
        parallel::for_each(&mut tasks, &|_, (blocks, group)| {
            scratches.lend(Scratch::<D>::new, |scratch| {
                scratch.sums.clear();
                scratch.sums.resize(sums_len * n_lanes, 0.0);
                scratch.bench.clear(pass.program);
                for block in blocks.iter_mut() {
                    width.run(OnBlock { pass: &pass, block, scratch, trouble: &mut group.trouble });
                }
                group.sums.clear();
                group.sums.resize(sums_len, 0.0);
                let stride = if work.averages { stride } else { n_immobile.max(1) };
                average::fold_lanes(&scratch.sums, n_lanes, stride, &mut group.sums);
                group.yields.take(&mut scratch.bench);
            });
        });
        if let Some(trouble) = self.groups.iter().find_map(|group| group.trouble) {
            return Err(self.explain(trouble, work, step));
        }
        if work.mixes {
            self.pending = None;
        }
        if work.averages {
            self.merge();
            self.is_averaged = true;
        } else if !spans.is_empty() {
            let sums = self.merged_sums();
            self.reactions.settle(&self.program, &sums, self.groups.iter().map(|group| &group.yields));
            self.is_averaged = false;
        }
        Ok(())
    }

    /// Sums of groups in their order.
    fn merged_sums(&mut self) -> Vec<f64> {
        let Some((first, others)) = self.groups.split_first_mut() else { return Vec::new() };
        for group in others {
            first.sums.iter_mut().zip(&group.sums).for_each(|(sum, part)| *sum += part);
        }
        std::mem::take(&mut first.sums)
    }

    /// Sums of groups in their order, then means.
    fn merge(&mut self) {
        let sums = self.merged_sums();
        self.means.assign(&self.program, &sums);
        if let Some(first) = self.groups.first_mut() {
            // Its memory serves again.
            first.sums = sums;
        }
    }

    fn check_amounts(&self, step: u64) -> Result<(), RunError> {
        if self.means.totals.iter().any(|total| !total.is_finite()) {
            return Err(self.find_non_finite(step));
        }
        let defects = self.defects(&self.means.totals);
        self.check_defects(&defects, step)
    }

    /// Per component the largest relative change that nothing accounts for: of what particles carry, of what
    /// lives in bins, and of what reactions conserve.
    fn defects(&self, sums: &[f64]) -> Vec<f64> {
        let added = &self.reactions.added;
        let gained = |column: usize| match &self.water {
            Some(water) => water.book.whole(column),
            None => Added::default(),
        };
        let mut defects = amount::defects(&self.program, &self.before, added, sums, gained);
        let in_bins = self.reactions.immobile_before.iter().zip(&self.reactions.immobile);
        for ((before, bins), &added) in in_bins.zip(&added[self.program.n_components()..]) {
            let per_bin = self.program.per_bin();
            let after = self.program.sum_of_bins(&bins[..self.program.grid.n_bins()]);
            let before = Amount::of_bins(before * per_bin);
            defects.push(Amount::defect_of(after * per_bin, &before, added));
        }
        let Reactions { added, peaks, .. } = &self.reactions;
        let reacted = conserved::defects(&self.invariants, added, peaks, &self.initial_sizes());
        defects.iter_mut().zip(reacted).for_each(|(own, other)| *own = amount::worse(*own, other));
        defects
    }

    fn check_defects(&self, defects: &[f64], step: u64) -> Result<(), RunError> {
        match defects.iter().position(|&defect| defect > LOST) {
            None => Ok(()),
            Some(idx) => Err(RunError::MassLost {
                step: step + 1,
                component: self.component_name(idx),
                defect: defects[idx],
            }),
        }
    }

    fn component_name(&self, idx: usize) -> String {
        self.program.plan.components[idx].name.clone()
    }

    /// Per component Σ|value| at the beginning, over particles.
    fn initial_sizes(&self) -> Vec<f64> {
        let program = &self.program;
        let n_slots = program.roles.len();
        let carried = (0..program.n_components()).map(|component| self.before[component * n_slots].size);
        let in_bins = self.reactions.immobile_before.iter().map(|sum| sum * self.program.per_bin());
        carried.chain(in_bins).collect()
    }

    /// Names the first particle whose value is not finite; if only a sum is not, the amount.
    #[cold]
    fn find_non_finite(&self, step: u64) -> RunError {
        let n_slots = self.program.roles.len();
        for block in &self.blocks {
            for (column_idx, column) in block.columns.iter().enumerate() {
                if let Some(idx) = column.iter().position(|value| !value.is_finite()) {
                    let component = self.component_name(column_idx / n_slots);
                    let particle = block.number(idx);
                    return RunError::NonFiniteConcentration { step: step + 1, particle, component };
                }
            }
        }
        let column = self.means.totals.iter().position(|total| !total.is_finite()).unwrap_or(0);
        let component = self.component_name(column / n_slots);
        RunError::MassLost { step: step + 1, component, defect: f64::INFINITY }
    }

    /// Names the particle behind a trouble.
    #[cold]
    fn explain(&self, trouble: Trouble, work: Work, step: u64) -> RunError {
        match trouble {
            Trouble::Position { particle } => RunError::NonFinitePosition { step: step + 1, particle },
            Trouble::Chemistry { particle, why } => {
                // What reacts does so over the step before.
                let what = self.reactions.explain(&self.program, why);
                RunError::Chemistry { step: step.max(1), particle, what, why }
            }
            Trouble::Negative { component, block, first } => {
                let (particle, value) = self.find_below(component, block, first);
                // A pass that relaxes and then averages does the relaxation of the step before.
                let step = if work.averages { step } else { step + 1 };
                RunError::NegativeConcentration {
                    step,
                    particle,
                    component: self.component_name(component),
                    value,
                }
            }
        }
    }

    /// The first particle of a block, from its place `first` on, with a value below the limit.
    fn find_below(&self, component: usize, block: usize, first: usize) -> (u64, f64) {
        let n_slots = self.program.roles.len();
        let limit = self.limits[component];
        let block = &self.blocks[block];
        let columns = &block.columns[component * n_slots..][..n_slots];
        let found = columns.iter().filter_map(|column| {
            let offset = column[first..].iter().position(|&value| value < limit)?;
            Some((offset, column[first + offset]))
        });
        let (offset, value) = found.min_by_key(|&(offset, _)| offset).unwrap_or((0, f64::NAN));
        (block.number(first + offset), value)
    }

    /// Does what is pending and compares the amounts.
    fn finish(&mut self) -> Result<Vec<f64>, RunError> {
        self.settle_pending(self.program.plan.time.n_steps.saturating_sub(1))?;
        let after: Vec<f64> =
            amount::amounts(&self.blocks, self.program.n_columns()).iter().map(|amount| amount.sum).collect();
        Ok(self.defects(&after))
    }
}

/// Adds snapshots of what passed: in the order of times, those of one time in the order of outputs.
fn in_order(snapshots: &mut Vec<Snapshot>, passed: Vec<Snapshot>) {
    snapshots.extend(passed);
    snapshots.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.output_idx.cmp(&b.output_idx)));
}

/// Smallest value allowed per component: none where the initial values are negative somewhere.
/// `ranges` are those of what may come in later.
fn limits<const D: usize>(program: &Program<D>, before: &[Amount], ranges: &[(f64, f64)]) -> Vec<f64> {
    let n_slots = program.roles.len();
    let kinetics = program.plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
    let reactions = kinetics.filter(|_| program.plan.reacts_in_steps()).map(|kinetics| &kinetics.reactions);
    let reacts = |component: usize| {
        let mut changes = reactions.into_iter().flatten().flat_map(|reaction| &reaction.changes);
        changes.any(|&(changed, _)| changed == component)
    };
    (0..program.n_components())
        .map(|component| {
            let amounts = &before[component * n_slots..][..n_slots];
            let later = ranges.get(component).copied().unwrap_or((f64::INFINITY, 0.0));
            let lowest = amounts.iter().map(|amount| amount.lowest).fold(later.0, f64::min);
            let highest = amounts.iter().map(|amount| amount.highest).fold(later.1, f64::max);
            // What reacts may be below zero in one of the zones, and is not in the particle.
            if lowest < 0.0 || reacts(component) { f64::NEG_INFINITY } else { -ROUNDING * highest }
        })
        .collect()
}

#[cfg(test)]
#[path = "run_tests.rs"]
mod tests;

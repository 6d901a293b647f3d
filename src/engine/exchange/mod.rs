//! Exchange between parcels of water and those around them.
//!
//! Owns one step of it. May use blocks, kernels and `parallel`. It deliberately moves nothing: places stay as they are.

mod around;
mod bands;
mod crowd;
mod ellipse;
mod in_run;
mod integrate;
mod local;
mod matrix;
mod mean;
mod near;
mod notes;
mod operator;
mod own_kernels;
mod picks;
mod space;
mod stretch;
mod table;

use super::control::Settings;
use super::error::RunError;
use super::parallel::{self, Pool};
use super::program::{Program, Role, unsound};
use crate::maths::wide::Width;
use crate::plan::exchange::{Exchange as Planned, Integration, MOST_PAIR_BYTES, Sizes};
use crate::plan::transport::{Patch, SideRule};
use crate::plan::{Axis, Plan, Side};
use crate::state::particles::Block;
use around::Around;
use crowd::{MOST_BLOCKS, Sorted};
use local::Local;
use near::Near;
use notes::{Notes, Sheets};
use operator::{Operator, Profile, Weights};
use space::Space;

pub use in_run::Exchanges;

/// Threads that have room for notes of their own; more of them share it.
const MOST_ROOMS: usize = 8;

/// What lives as long as the run.
pub struct Exchange<const D: usize> {
    planned: Planned,
    sizes: Sizes,
    space: Space<D>,
    /// Where dispersion varies from place to place.
    local: Option<Local<D>>,
    profile: Profile,
    sorted: Sorted,
    /// What the weights of the parcels as they are sorted are made of.
    factors: Vec<f64>,
    notes: Notes,
    columns: Vec<Vec<f64>>,
    lists: Pool<Near<D>>,
    own_lists: Pool<Around>,
}

/// The axes of a plan with what sides are to an exchange: nothing disperses through those that water flows through.
fn closed(plan: &Plan) -> Vec<Axis> {
    let mut axes = plan.axes.clone();
    let Some(transport) = &plan.transport else { return axes };
    let of_side = |patches: &[Patch]| match patches.first().map(|patch| &patch.rule) {
        Some(SideRule::Periodic) => Side::Periodic,
        Some(SideRule::Open) => Side::Open,
        _ => Side::Reflect,
    };
    for (axis, [low, high]) in axes.iter_mut().zip(&transport.sides) {
        (axis.low_side, axis.high_side) = (of_side(low), of_side(high));
    }
    axes
}

/// Room for notes: what every thread needs to keep the pairs between its two sums.
fn most_pair_bytes(settings: &Settings) -> usize {
    settings.most_pair_bytes.unwrap_or(MOST_PAIR_BYTES * parallel::n_threads().min(MOST_ROOMS))
}

/// A value that is wrong after an exchange.
pub struct Wrong {
    pub column: usize,
    pub block: usize,
    pub at: usize,
}

impl<const D: usize> Exchange<D> {
    pub fn new(program: &Program<D>, settings: &Settings) -> Result<Option<Self>, RunError> {
        let plan = program.plan;
        let Some(planned) = &plan.exchange else { return Ok(None) };
        planned.check(D).map_err(|reason| unsound(&reason))?;
        let local = Local::new(plan, planned, settings)?;
        Self::of(plan, planned.clone(), local, settings).map(Some)
    }

    fn of(
        plan: &Plan,
        planned: Planned,
        local: Option<Local<D>>,
        settings: &Settings,
    ) -> Result<Self, RunError> {
        let sizes = planned.sizes(plan, plan.time.step.min(plan.time.duration));
        let size = (sizes.bandwidth, sizes.radius);
        let space = Space::new(&closed(plan), &planned.diffusion, size, plan.particles.count)
            .filter(|_| sizes.share.is_finite() && sizes.bandwidth > 0.0)
            .ok_or_else(|| unsound("an exchange without dispersion or bandwidth"))?;
        let profile =
            Profile::new(&planned).ok_or_else(|| unsound("an exchange by a kernel that does not exist"))?;
        Ok(Self {
            planned,
            sizes,
            space,
            local,
            profile,
            sorted: Sorted::default(),
            factors: Vec::new(),
            notes: Notes::new(Sheets::new(most_pair_bytes(settings))),
            columns: Vec::new(),
            lists: Pool::new(),
            own_lists: Pool::new(),
        })
    }

    /// The same, to go another way from here.
    pub fn copy(&self) -> Self {
        Self {
            planned: self.planned.clone(),
            sizes: self.sizes,
            space: self.space.clone(),
            local: self.local.as_ref().map(Local::copy),
            profile: self.profile.clone(),
            sorted: Sorted::default(),
            factors: Vec::new(),
            // Both together have no more room than one.
            notes: Notes::new(self.notes.sheets.clone()),
            columns: Vec::new(),
            lists: Pool::new(),
            own_lists: Pool::new(),
        }
    }

    /// Everything that parcels carry is exchanged over `dt`; the first value that is below its limit afterwards, or no
    /// number, is handed back.
    pub fn step(
        &mut self,
        program: &Program<D>,
        blocks: &mut [Block<D>],
        (dt, width): (f64, Width),
        limits: &[f64],
    ) -> Result<Option<Wrong>, RunError> {
        let n_slots = program.roles.len();
        // What is a mean is made anew, not exchanged.
        let is_exchanged = |column: &usize| !matches!(program.roles[column % n_slots], Role::Mean);
        let carried: Vec<usize> = (0..program.n_columns()).filter(is_exchanged).collect();
        if carried.is_empty() {
            return Ok(None);
        }
        self.look(program, blocks, (dt, width))?;
        let (beta, integration) = (self.beta(dt), self.planned.integration);
        self.on_columns(
            blocks,
            (&carried, Weights::Forces, width),
            integration,
            &mut |operator, columns| {
                integrate::step(operator, integration, beta, columns);
            },
        )?;
        Ok(self.give_back(blocks, &carried, (limits, n_slots)))
    }

    /// Sorts parcels, makes weights, and lets columns of theirs be worked on in the order of cells.
    fn on_columns(
        &mut self,
        blocks: &[Block<D>],
        (carried, weights, width): (&[usize], Weights, Width),
        integration: Integration,
        work: &mut dyn FnMut(&mut Operator<D>, &mut [Vec<f64>]),
    ) -> Result<(), RunError> {
        if blocks.len() >= MOST_BLOCKS {
            return Err(unsound("an exchange of more than four thousand million parcels"));
        }
        // Of parcels that stand where they stood, all but the values is known; kernels may hang on the length of a step.
        let is_at_rest = self.local.is_none() && self.sorted.stands(&self.space, blocks);
        if !is_at_rest {
            self.sorted.sort(&self.space, blocks);
        }
        if let Some(local) = &mut self.local {
            local.sort(&self.sorted);
        }
        self.columns.resize_with(carried.len(), Vec::new);
        for (values, &column) in self.columns.iter_mut().zip(carried) {
            self.sorted.gather(blocks, column, values);
        }
        let mut operator = Operator {
            crowd: self.sorted.crowd(&self.space),
            metrics: self.local.as_ref().and_then(Local::metrics),
            profile: &self.profile,
            normalisation: self.planned.normalisation,
            weights,
            width,
            lists: &self.lists,
            own_lists: &self.own_lists,
            factors: std::mem::take(&mut self.factors),
            start: 0,
            notes: self.notes.take(),
            caps: Vec::new(),
        };
        operator.prepare(integration, is_at_rest);
        work(&mut operator, &mut self.columns);
        (self.factors, self.notes) = (operator.factors, operator.notes);
        Ok(())
    }

    /// Columns go back to their blocks; the first value that is below its limit, or no number, is told.
    fn give_back(
        &self,
        blocks: &mut [Block<D>],
        carried: &[usize],
        (limits, n_slots): (&[f64], usize),
    ) -> Option<Wrong> {
        let mut wrong = None;
        for (values, &column) in self.columns.iter().zip(carried) {
            let found = self.sorted.give_back(blocks, column, values, limits[column / n_slots]);
            if let Some((block, at)) = found.filter(|_| wrong.is_none()) {
                wrong = Some(Wrong { column, block, at });
            }
        }
        wrong
    }

    /// Kernels and cells for where parcels are, if they differ from place to place.
    fn look(
        &mut self,
        program: &Program<D>,
        blocks: &[Block<D>],
        (dt, width): (f64, Width),
    ) -> Result<(), RunError> {
        let Some(local) = &mut self.local else { return Ok(()) };
        let (plan, radius) = (program.plan, self.sizes.radius);
        let step = plan.time.step.min(plan.time.duration);
        let extents = local.look(blocks, (step, dt), (radius, width))?;
        self.space = Space::plain(&closed(plan), radius, extents, plan.particles.count);
        Ok(())
    }

    /// What the normalised sum of exchange forces is multiplied by in `dt`; where kernels differ it is in the weights.
    fn beta(&self, dt: f64) -> f64 {
        if self.local.is_some() {
            return 1.0;
        }
        let Sizes { diffusion, bandwidth, fidelity, .. } = self.sizes;
        let given_back = if self.planned.is_compensated { 1.0 / fidelity } else { 1.0 };
        2.0 * diffusion * dt / (bandwidth * bandwidth) * given_back
    }
}

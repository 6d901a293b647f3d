//! The runs beside a run.
//!
//! Owns their plans and seeds. May use the plan. It deliberately runs nothing.

use crate::plan::averaging::Averaging;
use crate::plan::tape::{Operation, Tape};
use crate::plan::{OutputKind, Plan, Side, ZoneRate};
use crate::scenario::MAX_BINS;

/// Trials of a smaller number of particles, independent of one another: what is known of noise comes
/// from the differences between them.
pub(super) const GROUPS: usize = 4;
/// Those of them that are repeated with half the step and with half the bins.
pub(super) const PAIRS: usize = 2;
/// The number of particles of a run, divided by that of a trial.
const FEWER: u64 = 4;

/// What a trial changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Role {
    /// Fewer particles with a seed of their own.
    Group(usize),
    /// A group on bins of half the width.
    GroupHalfBins(usize),
    /// A group with half the step.
    GroupHalfStep(usize),
    /// The run itself on bins of half the width.
    HalfBins,
}

/// A run to be made beside the run.
#[derive(Debug, Clone, PartialEq)]
pub struct Trial {
    pub(super) role: Role,
    pub plan: Plan,
    /// For `engine::Settings`.
    pub takes_half_draws: bool,
}

/// All trials of a run, in the order in which their snapshots are wanted.
#[derive(Debug, Clone, PartialEq)]
pub struct Trials {
    pub trials: Vec<Trial>,
    /// Whether particles see one another, the step can matter, and bins matter.
    pub(super) interacts: bool,
    /// Bins matter, but halving them would make too many.
    pub(super) has_unknown_bins: bool,
    /// Particles of a trial divided by those of the run.
    pub(super) share: f64,
}

impl Trials {
    pub fn of(plan: &Plan) -> Self {
        let mixes = plan
            .mixing
            .as_ref()
            .is_some_and(|mixing| mixing.zones.iter().any(|zone| zone.rate != ZoneRate::Finite(0.0)));
        let interacts = mixes || plan.exchange.is_some();
        let matters = mixes || plan.outputs.iter().any(|output| output.kind.is_of_pairs());
        let halved = matters.then(|| half_bins(plan)).flatten();
        let has_step_error = has_step_error(plan);
        let fewer = fewer(plan);
        let mut trials = Vec::new();
        let mut add = |role, plan, takes_half_draws| trials.push(Trial { role, plan, takes_half_draws });
        for group in 0..GROUPS {
            let plan = Plan { seed: seed(plan.seed, group), ..fewer.clone() };
            if group < PAIRS {
                if has_step_error {
                    add(Role::GroupHalfStep(group), half_step(&plan), false);
                }
                if let Some(plan) = halved.as_ref().and_then(|_| half_bins(&plan)) {
                    add(Role::GroupHalfBins(group), plan, true);
                }
            }
            add(Role::Group(group), plan, true);
        }
        let has_unknown_bins = matters && halved.is_none();
        if let Some(plan) = halved {
            add(Role::HalfBins, plan, false);
        }
        let share = fewer.particles.count as f64 / plan.particles.count as f64;
        Self { trials, interacts, has_unknown_bins, share }
    }

    /// Particle-steps of all trials, divided by those of the run.
    pub fn cost(&self, plan: &Plan) -> f64 {
        let work = |plan: &Plan| plan.particles.count as f64 * plan.time.n_steps as f64;
        self.trials.iter().map(|trial| work(&trial.plan)).sum::<f64>() / work(plan)
    }
}

/// Constant coefficients are walked exactly; the step shows in exchange with means or with other parcels, and where
/// drift leans on a reflecting side.
fn has_step_error(plan: &Plan) -> bool {
    let exchanges = plan.mixing.as_ref().is_some_and(|mixing| {
        mixing.zones.iter().any(|zone| matches!(zone.rate, ZoneRate::Finite(rate) if rate > 0.0))
    });
    let leans = plan.axes.iter().zip(&plan.walk.drift).any(|(axis, &drift)| {
        let side = if drift < 0.0 { axis.low_side } else { axis.high_side };
        drift != 0.0 && side == Side::Reflect
    });
    let reacts_to_means = plan.has_kernel_mean() && plan.reacts_in_steps();
    exchanges || plan.exchange.is_some() || reacts_to_means || leans
}

/// The seed of a group: the first eight bytes of a BLAKE3 of the root seed and the number.
fn seed(root: u64, group: usize) -> u64 {
    let mut hasher = blake3::Hasher::new();
    hasher.update(b"lamella error bars 1\0");
    hasher.update(&root.to_le_bytes());
    hasher.update(&(group as u64).to_le_bytes());
    let mut bytes = [0; 8];
    bytes.copy_from_slice(&hasher.finalize().as_bytes()[..8]);
    u64::from_le_bytes(bytes)
}

/// A part of the particles, each with more volume, and no output of single particles.
fn fewer(plan: &Plan) -> Plan {
    let mut plan = watched(plan);
    let count = plan.particles.count.div_ceil(FEWER);
    let averaging = plan.averaging();
    let bandwidth = averaging.map(|averaging| averaging.extents(&plan).bandwidth);
    plan.set_count(count);
    if let (Some(bandwidth), Some(averaging)) = (bandwidth, averaging_of(&mut plan)) {
        // Fewer parcels are one thing, wider means another.
        averaging.bandwidth = Tape { operations: vec![Operation::Constant(bandwidth)] };
    }
    plan
}

fn averaging_of(plan: &mut Plan) -> Option<&mut Averaging> {
    plan.mixing.as_mut().and_then(|mixing| mixing.averaging.as_mut())
}

/// The plan without times for outputs that have no error bar: single particles, budgets.
fn watched(plan: &Plan) -> Plan {
    let mut plan = plan.clone();
    let has_bar = |kind: OutputKind| kind.is_binned() || kind.is_course();
    let single = plan.outputs.iter_mut().filter(|output| !has_bar(output.kind));
    single.for_each(|output| output.times.clear());
    plan
}

fn half_step(plan: &Plan) -> Plan {
    let mut plan = plan.clone();
    let exact = plan.time.duration / (0.5 * plan.time.step);
    plan.time.step *= 0.5;
    // As when a scene is lowered: no sliver of a step from rounding.
    let is_whole = (exact - exact.round()).abs() < 1e-9 * exact.max(1.0);
    plan.time.n_steps = if is_whole { exact.round() } else { exact.ceil() }.max(1.0) as u64;
    plan
}

/// Twice the bins along each axis: of the averages, and of mixing states and covariances, which are
/// those within bins. `None` if these are more than can be.
fn half_bins(plan: &Plan) -> Option<Plan> {
    let mut plan = watched(plan);
    plan.axes.iter_mut().for_each(|axis| axis.bins *= 2);
    if let Some(averaging) = averaging_of(&mut plan) {
        averaging.bandwidth.scale(0.5);
    }
    let within_bins = plan.outputs.iter_mut().filter(|output| output.kind.is_of_pairs());
    within_bins.for_each(|output| output.bins.iter_mut().for_each(|bins| *bins *= 2));
    let n_bins = |bins: &mut dyn Iterator<Item = usize>| bins.map(|n| n as f64).product::<f64>();
    let is_possible = n_bins(&mut plan.axes.iter().map(|axis| axis.bins)) <= MAX_BINS
        && plan.outputs.iter().all(|output| n_bins(&mut output.bins.iter().copied()) <= MAX_BINS);
    is_possible.then_some(plan)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_have_seeds_of_their_own() {
        let seeds: Vec<u64> = (0..GROUPS).map(|group| seed(42, group)).collect();
        for (idx, own) in seeds.iter().enumerate() {
            assert!(*own != 42 && !seeds[..idx].contains(own));
        }
        assert_ne!(seed(42, 0), seed(43, 0));
    }
}

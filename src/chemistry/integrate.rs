//! Steps with error control, each particle at its own pace, many particles at once.
//!
//! Owns which particle stands in which lane, the size of its steps, the tests of error, sign and
//! finiteness, and what remains after rounding. May use the laws and `maths`. It deliberately knows no
//! method: a method makes one step of all lanes.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::aqueous::AqueousLanes;
use super::invariants::Invariants;
use super::laws::{LANES, Lane, System};
use super::queue::{Queue, load};
use super::reactor::{Failure, Why, Work};
use crate::maths::vector;
use crate::maths::wide::Width;
use pulp::NullaryFnOnce;

/// A lane without a particle.
pub(super) const IDLE: u32 = u32::MAX;

/// A step is at most this many times longer than the one before.
const MOST_GROWTH: f64 = 5.0;
/// What is asked for, of the size that would just have been allowed.
const CAUTION: f64 = 0.9;

/// One step of all lanes.
pub(super) trait Stepper {
    /// Sub-steps after which a particle is given up.
    const MOST_STEPS: u32;
    /// Whether the last stage of an accepted step is the first of the next one: `attempt` leaves it in `ahead`,
    /// and `begin` is asked for new particles only.
    const KEEPS_SLOPES: bool;
    /// Order of the error estimate plus 1.
    fn exponent(&self) -> f64;
    /// The share of the tolerance that the error of one step may have, so that errors that add up or grow
    /// stay within ten tolerances.
    fn local_share(&self) -> f64;
    /// Evaluations of rates and factored matrices per attempt.
    fn work(&self) -> (u64, u64);
    /// Whatever depends on the state alone; leaves `dy/dt` in `slopes`.
    fn begin(&self, lanes: &mut Lanes);
    /// The sizes that new particles begin with, where it keeps slopes; they stand in `wanted`, with 0 for what
    /// nobody remembers. Evaluations of rates, those of `begin` included.
    fn start(&self, lanes: &mut Lanes, dt: f64) -> u64;
    /// From `y` over `step` to `new` with the estimate `error`.
    fn attempt(&self, lanes: &mut Lanes);
}

/// What both methods need to know of the network.
#[derive(Debug, Clone)]
pub(super) struct Network {
    pub system: System,
    pub invariants: Invariants,
    /// Per component: tolerance × floor.
    pub small: Vec<f64>,
    pub tolerance: f64,
}

/// The state of all lanes, and what the methods remember within a step.
#[derive(Debug, Default, Clone)]
pub(super) struct Lanes {
    pub y: Vec<Lane>,
    pub new: Vec<Lane>,
    pub error: Vec<Lane>,
    pub slopes: Vec<Lane>,
    /// Slopes at `new`, where a method knows them.
    pub ahead: Vec<Lane>,
    pub sum: Vec<Lane>,
    pub stages: Vec<Lane>,
    pub matrix: Vec<Lane>,
    /// Registers of the programs.
    pub rates: Vec<Lane>,
    pub full: Vec<Lane>,
    pub positions: [Lane; 3],
    pub elapsed: Lane,
    /// Particles with their slopes that come next, where a method keeps them: evaluated together, they cost
    /// one particle a sixteenth of what they would cost one by one.
    waiting: Option<Box<Lanes>>,
    /// What speciation needs, where species are in equilibrium.
    pub aqueous: Option<Box<AqueousLanes>>,
    /// The size that is tried now.
    pub step: Lane,
    pub t: f64,
    /// The size that the error asks for.
    pub wanted: Lane,
    /// The size that the error of the last accepted step would just have allowed; 0: none was accepted.
    pub reach: Lane,
    pub totals: Vec<Lane>,
    pub particle: [u32; LANES],
    pub count: [u32; LANES],
    pub is_fresh: [bool; LANES],
    /// True as 1.
    pub was_rejected: Lane,
    pub column: Vec<f64>,
    pub column_totals: Vec<f64>,
    dense: Vec<f64>,
}

impl Lanes {
    pub fn new(network: &Network, n_stages: usize, n_slots: usize) -> Self {
        let n = network.system.n_components;
        let zeros = |n: usize| vec![[0.0; LANES]; n];
        Self {
            y: zeros(n),
            new: zeros(n),
            error: zeros(n),
            slopes: zeros(n),
            ahead: zeros(n),
            sum: zeros(n),
            stages: zeros(n * n_stages),
            matrix: zeros(n_slots),
            rates: network.system.rates.registers(),
            full: network.system.full.registers(),
            totals: zeros(network.invariants.count()),
            column: vec![0.0; n],
            column_totals: vec![0.0; network.invariants.count()],
            ..Self::default()
        }
    }
}

/// Which particles go where, and what came of it.
pub(super) struct Task<'a, 'b> {
    pub positions: [&'a [f64]; 3],
    pub t: f64,
    pub dt: f64,
    pub components: &'a mut [&'b mut [f64]],
    pub memory: &'a mut [f32],
    /// Particles to do; `None`: all.
    pub chosen: Option<&'a [u32]>,
    pub work: Work,
    /// Particles that cannot be done, as they were, with the reason.
    pub failures: &'a mut Vec<Failure>,
    /// Whether nothing after a failure counts. Those before it are under way, and may fail, too.
    pub ends_at_failure: bool,
}

/// Takes all chosen particles over the step.
pub(super) fn integrate<S: Stepper>(
    width: Width,
    network: &Network,
    stepper: &S,
    lanes: &mut Lanes,
    task: &mut Task<'_, '_>,
) {
    width.run(Run { network, stepper, lanes, task });
}

struct Run<'a, 't, 'u, 'v, S> {
    network: &'a Network,
    stepper: &'a S,
    lanes: &'a mut Lanes,
    task: &'t mut Task<'u, 'v>,
}

impl<S: Stepper> NullaryFnOnce for Run<'_, '_, '_, '_, S> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { network, stepper, lanes, task } = self;
        let n_chosen =
            task.chosen.map_or_else(|| task.components.first().map_or(0, |c| c.len()), <[u32]>::len);
        let mut queue = Queue { next: 0, n_chosen, place: LANES };
        lanes.t = task.t;
        lanes.particle = [IDLE; LANES];
        lanes.step = [task.dt; LANES];
        let mut waiting = lanes.waiting.take().unwrap_or_default();
        if S::KEEPS_SLOPES && waiting.y.len() != lanes.y.len() {
            *waiting = lanes.clone();
        }
        waiting.t = task.t;
        waiting.particle = [IDLE; LANES];
        let (n_rates, n_factored) = stepper.work();
        loop {
            if S::KEEPS_SLOPES {
                queue.admit(network, stepper, (&mut waiting, &mut *lanes), task);
            }
            let mut n_busy = 0;
            for l in 0..LANES {
                if !S::KEEPS_SLOPES
                    && lanes.particle[l] == IDLE
                    && let Some(particle) = queue.particle(task)
                {
                    load(network, lanes, task, l, particle);
                }
                n_busy += u64::from(lanes.particle[l] != IDLE);
            }
            if n_busy == 0 {
                lanes.waiting = Some(waiting);
                return;
            }
            task.work.rates += n_busy * n_rates;
            task.work.factored += n_busy * n_factored;
            if !S::KEEPS_SLOPES {
                stepper.begin(lanes);
            }
            choose_steps(network, lanes, task.dt);
            stepper.attempt(lanes);
            let judged = judge(network, lanes, stepper.exponent(), stepper.local_share());
            let verdicts = settle::<S>(network, lanes, task.dt, &judged);
            for l in 0..LANES {
                if lanes.particle[l] != IDLE {
                    conclude::<S>(network, lanes, task, l, verdicts[l]);
                }
            }
        }
    }
}

/// First steps from the size of values and slopes, and no step beyond the end.
#[inline(always)]
fn choose_steps(network: &Network, lanes: &mut Lanes, dt: f64) {
    if lanes.is_fresh.contains(&true) {
        let n = network.system.n_components;
        let (mut values, mut slopes) = ([0.0; LANES], [0.0; LANES]);
        for i in 0..n {
            for l in 0..LANES {
                let scale = 1.0 / (network.small[i] + network.tolerance * lanes.y[i][l].abs());
                let (value, slope) = (lanes.y[i][l] * scale, lanes.slopes[i][l] * scale);
                values[l] += value * value;
                slopes[l] += slope * slope;
            }
        }
        for l in 0..LANES {
            if lanes.is_fresh[l] {
                let (value, slope) = (values[l].sqrt(), slopes[l].sqrt());
                let guess = 0.01 * if value > 1.0 { value } else { 1.0 } / slope;
                lanes.wanted[l] = if guess < dt { guess } else { dt };
                lanes.is_fresh[l] = false;
            }
        }
    }
    for l in 0..LANES {
        let (left, wanted) = (dt - lanes.elapsed[l], lanes.wanted[l]);
        // Two equal steps rather than a whole one and a crumb.
        let half = if wanted < 0.5 * left { wanted } else { 0.5 * left };
        let step = if wanted >= left * (1.0 - 1e-10) { left } else { half };
        lanes.step[l] = if lanes.particle[l] == IDLE { dt } else { step };
    }
}

/// What came of a step, per lane.
struct Judged {
    /// The error in tolerances; NaN if something was not finite.
    norm: Lane,
    /// How many times longer the step could just have been.
    growth: Lane,
    /// True as 1: no value is below nothing.
    is_positive: Lane,
}

#[inline(always)]
fn judge(network: &Network, lanes: &mut Lanes, exponent: f64, local_share: f64) -> Judged {
    let n = network.system.n_components;
    let (mut sum, mut is_positive) = ([0.0; LANES], [1.0; LANES]);
    for i in 0..n {
        let small = network.small[i];
        let lowest = if network.system.is_positive[i] { -small } else { f64::NEG_INFINITY };
        let (before, after, error) = (lanes.y[i], lanes.new[i], lanes.error[i]);
        for l in 0..LANES {
            // Where a value ends it has to be right: in one step it may fall by decades. What changes its
            // sign is nothing special when it is zero. Not `max`: NaN must come through.
            let (old, new) = (before[l].abs(), after[l].abs());
            let size = if old > new && lowest < -small { old } else { new };
            let share = error[l] / (local_share * (small + network.tolerance * size));
            let broken = after[l] * 0.0;
            sum[l] += share * share + broken;
            is_positive[l] = if after[l] < lowest { 0.0 } else { is_positive[l] };
        }
    }
    let (mut norm, mut growth) = ([0.0; LANES], [0.0; LANES]);
    for l in 0..LANES {
        norm[l] = (sum[l] / n as f64).sqrt();
        growth[l] = vector::pow(norm[l], -1.0 / exponent);
    }
    Judged { norm, growth, is_positive }
}

/// What a lane does next.
#[derive(Debug, Clone, Copy)]
struct Verdict {
    is_right: bool,
    /// Right, and at the end of the whole step.
    is_last: bool,
}

/// Accepts or rejects the step of every lane: its values, and the size of the next.
#[inline(always)]
fn settle<S: Stepper>(network: &Network, lanes: &mut Lanes, dt: f64, judged: &Judged) -> [Verdict; LANES] {
    let mut right = [0.0; LANES];
    let mut last = [0.0; LANES];
    for l in 0..LANES {
        let (step, norm, growth) = (lanes.step[l], judged.norm[l], judged.growth[l]);
        right[l] = if norm <= 1.0 { judged.is_positive[l] } else { 0.0 };
        // Not finite: far away. Negative: half. Otherwise the error says how much.
        let shrink = CAUTION * growth;
        let shrink = if shrink < 0.2 { 0.2 } else { shrink };
        let shrink = if shrink > 0.9 { 0.9 } else { shrink };
        let shrink = if norm > 1.0 { shrink } else { 0.5 };
        let shorter = step * if norm.is_nan() { 0.1 } else { shrink };
        // The size that is allowed goes on shrinking as it did from step to step: K. Gustafsson 1994, ACM
        // Trans. Math. Softw. 20, 496, doi:10.1145/198429.198437.
        let most = MOST_GROWTH / CAUTION;
        let reach = step * if growth < most { growth } else { most };
        let trend = if lanes.reach[l] > reach { reach / lanes.reach[l] } else { 1.0 };
        let (asked, least) = (CAUTION * reach * trend, 0.2 * step);
        let asked = if asked < least { least } else { asked };
        let is_longer_after_failure = lanes.was_rejected[l] == 1.0 && asked > step;
        let asked = if is_longer_after_failure { step } else { asked };
        // A step that was cut short at the end says little.
        let wanted = lanes.wanted[l];
        let longer = if step < wanted && asked < wanted { wanted } else { asked };
        let is_right = right[l] == 1.0;
        lanes.wanted[l] = if is_right { longer } else { shorter };
        lanes.reach[l] = if is_right { reach } else { lanes.reach[l] };
        lanes.was_rejected[l] = 1.0 - right[l];
        last[l] = if step == dt - lanes.elapsed[l] { right[l] } else { 0.0 };
        lanes.elapsed[l] += if is_right { step } else { 0.0 };
    }
    for (i, &is_positive) in network.system.is_positive.iter().enumerate() {
        let lowest = if is_positive { 0.0 } else { f64::NEG_INFINITY };
        let (mut value, new) = (lanes.y[i], lanes.new[i]);
        for l in 0..LANES {
            let new = if new[l] < lowest { 0.0 } else { new[l] };
            // Numbers this small only cost time.
            let new = if new.abs() < 1e-250 { 0.0 } else { new };
            value[l] = if right[l] == 1.0 { new } else { value[l] };
        }
        lanes.y[i] = value;
        if S::KEEPS_SLOPES {
            let (mut slope, ahead) = (lanes.slopes[i], lanes.ahead[i]);
            for l in 0..LANES {
                slope[l] = if right[l] == 1.0 { ahead[l] } else { slope[l] };
            }
            lanes.slopes[i] = slope;
        }
    }
    std::array::from_fn(|l| Verdict { is_right: right[l] == 1.0, is_last: last[l] == 1.0 })
}

/// Lets the particle of a lane go when it is done or lost.
#[inline(always)]
fn conclude<S: Stepper>(
    network: &Network,
    lanes: &mut Lanes,
    task: &mut Task<'_, '_>,
    l: usize,
    verdict: Verdict,
) {
    lanes.count[l] += 1;
    let is_spent = lanes.count[l] >= S::MOST_STEPS;
    if verdict.is_right {
        task.work.steps += 1;
        if verdict.is_last {
            finish(network, lanes, task, l);
        } else if is_spent {
            lose(network, lanes, task, l, S::MOST_STEPS);
        }
        return;
    }
    task.work.rejected += 1;
    let is_lost = is_spent
        || lanes.elapsed[l] + lanes.wanted[l] == lanes.elapsed[l]
        || lanes.wanted[l].partial_cmp(&(1e-40 * task.dt)) != Some(std::cmp::Ordering::Greater);
    if is_lost {
        lose(network, lanes, task, l, S::MOST_STEPS);
    }
}

/// Writes a particle back.
fn finish(network: &Network, lanes: &mut Lanes, task: &mut Task<'_, '_>, l: usize) {
    let at = lanes.particle[l] as usize;
    for (value, lane) in lanes.column.iter_mut().zip(&lanes.y) {
        *value = lane[l];
    }
    for (value, lane) in lanes.column_totals.iter_mut().zip(&lanes.totals) {
        *value = lane[l];
    }
    network.invariants.restore(&mut lanes.column, &lanes.column_totals, &mut lanes.dense);
    for (column, value) in task.components.iter_mut().zip(&lanes.column) {
        column[at] = *value;
    }
    if let Some(remembered) = task.memory.get_mut(at) {
        *remembered = lanes.wanted[l].min(f64::from(f32::MAX)) as f32;
    }
    lanes.particle[l] = IDLE;
}

/// Gives a particle up, as it was before the whole step.
fn lose(network: &Network, lanes: &mut Lanes, task: &mut Task<'_, '_>, l: usize, most: u32) {
    let particle = lanes.particle[l] as usize;
    let t = task.t + lanes.elapsed[l];
    let broken = lanes.slopes.iter().position(|slope| !slope[l].is_finite());
    let why = match broken {
        Some(component) => Why::NotFinite { component, reaction: broken_rate(network, lanes, l) },
        None if lanes.count[l] >= most => {
            Why::TooManySteps { t, tried: lanes.count[l], share: lanes.elapsed[l] / task.dt }
        }
        None => Why::StepTooSmall { component: worst(network, lanes, l), t, step: lanes.step[l] },
    };
    task.failures.push(Failure { particle, why });
    lanes.particle[l] = IDLE;
}

/// The first reaction whose rate is no number where the sub-step began.
#[cold]
fn broken_rate(network: &Network, lanes: &Lanes, l: usize) -> Option<usize> {
    let System { each, n_variables, .. } = &network.system;
    let mut registers = each.registers();
    let n_inputs = n_variables + 4;
    registers[..n_inputs].copy_from_slice(&lanes.full[..n_inputs]);
    each.run(&mut registers);
    each.outputs.iter().position(|&place| !registers[usize::from(place)][l].is_finite())
}

/// The component with the largest error; one whose value is no number before all others.
fn worst(network: &Network, lanes: &Lanes, l: usize) -> usize {
    let share = |i: usize| {
        let size = network.small[i] + network.tolerance * lanes.y[i][l].abs().max(lanes.new[i][l].abs());
        let share = (lanes.error[i][l] / size).abs();
        if lanes.new[i][l].is_finite() && share.is_finite() { share } else { f64::INFINITY }
    };
    let larger = |found: usize, i: usize| if share(i) > share(found) { i } else { found };
    (1..network.system.n_components).fold(0, larger)
}

//! From the snapshots of a run and of its trials to error bars.
//!
//! Owns the combination of trials. May use `measure` and the plan. It deliberately knows no reference.

use super::statistics::{Cell, Differences, Estimate, Levers, mean_and_variance, share_of_direct, shrinkage};
use super::trials::{GROUPS, PAIRS, Role, Trials};
use super::{ErrorBar, Parts};
use crate::engine::snapshot::Snapshot;
use crate::measure::{self, FieldAt, Fields};
use crate::plan::{OutputKind, Plan, Quantity};

/// The order of what bins do, ½² of which is left on bins of half the width, and that of the step.
const LEFT_OF_BINS: f64 = 0.25;
const LEFT_OF_STEP: f64 = 0.5;

/// The error bars of a run: for each output with values in bins a row per quantity and time, for each
/// total and γ, too, and one over all times.
///
/// `snapshots` are those of the run, `of_trials` those of each trial in order. An error is one sentence.
pub fn bars(
    plan: &Plan,
    trials: &Trials,
    snapshots: &[Snapshot],
    of_trials: &[Vec<Snapshot>],
) -> Result<Vec<ErrorBar>, String> {
    let mut bars = Vec::new();
    for (output_idx, output) in plan.outputs.iter().enumerate() {
        if !output.kind.is_binned() && !output.kind.is_course() {
            continue;
        }
        for &quantity in &output.quantities {
            let seen = Seen::new(plan, trials, snapshots, of_trials, output_idx, quantity)?;
            bars.extend(seen.bars(output_idx, output.kind, quantity));
        }
    }
    Ok(bars)
}

/// One quantity of one output in all runs.
struct Seen<'a> {
    trials: &'a Trials,
    n_axes: usize,
    run: Fields,
    half_bins: Option<Fields>,
    groups: Vec<Fields>,
    groups_half_bins: Vec<Fields>,
    groups_half_step: Vec<Fields>,
}

impl<'a> Seen<'a> {
    fn new(
        plan: &Plan,
        trials: &'a Trials,
        snapshots: &[Snapshot],
        of_trials: &[Vec<Snapshot>],
        output_idx: usize,
        quantity: Quantity,
    ) -> Result<Self, String> {
        let run = measure::fields(plan, snapshots, output_idx, quantity)?;
        let mut seen = Self {
            trials,
            n_axes: plan.axes.len(),
            run,
            half_bins: None,
            groups: Vec::new(),
            groups_half_bins: Vec::new(),
            groups_half_step: Vec::new(),
        };
        for (trial, snapshots) in trials.trials.iter().zip(of_trials) {
            let mut fields = measure::fields(&trial.plan, snapshots, output_idx, quantity)?;
            let own = (&plan.outputs[output_idx].bins, &trial.plan.outputs[output_idx].bins);
            if own.0 != own.1 && !is_scalar(plan.outputs[output_idx].kind) {
                fields.times.iter_mut().for_each(|time| *time = means_of_halves(time, own.0));
            }
            if fields.times.len() != seen.run.times.len() {
                return Err("A trial run has other times than the run.".into());
            }
            match trial.role {
                Role::Group(_) => seen.groups.push(fields),
                Role::GroupHalfBins(_) => seen.groups_half_bins.push(fields),
                Role::GroupHalfStep(_) => seen.groups_half_step.push(fields),
                Role::HalfBins => seen.half_bins = Some(fields),
            }
        }
        let is_whole = |n: usize| n == 0 || n == PAIRS;
        if seen.groups.len() != GROUPS
            || !is_whole(seen.groups_half_bins.len())
            || !is_whole(seen.groups_half_step.len())
        {
            return Err("Trial runs are missing.".into());
        }
        Ok(seen)
    }

    fn bars(&self, output_idx: usize, kind: OutputKind, quantity: Quantity) -> Vec<ErrorBar> {
        // One value says little about its own noise: those of all times are judged together.
        let times: Vec<usize> = (0..self.run.times.len()).collect();
        let judged_together = times.chunks(if is_scalar(kind) { times.len().max(1) } else { 1 });
        let mut bars: Vec<ErrorBar> = Vec::new();
        for times in judged_together {
            let cells = self.cells(times);
            let pooled: Vec<Cell> = cells.iter().flatten().copied().collect();
            let factors = Factors::of(&pooled);
            for (&time_idx, cells) in times.iter().zip(&cells).filter(|(_, cells)| !cells.is_empty()) {
                let time = &self.run.times[time_idx];
                // Bins that a trial with fewer particles left empty are taken to be like the others.
                let n_filled = time.is_filled.iter().filter(|filled| **filled).count();
                let weight = self.run.weight * n_filled as f64 / cells.len() as f64;
                let size: f64 = cells.iter().map(|cell| cell.value * cell.value).sum();
                bars.push(ErrorBar {
                    output_idx,
                    kind,
                    quantity,
                    t: Some(time.t),
                    n: cells.len() as u64,
                    size: (weight * size).sqrt(),
                    parts: self.parts(cells, factors, weight),
                });
            }
        }
        bars.extend(over_all_times(&bars));
        bars
    }

    /// The values of some times, with the errors in them.
    fn cells(&self, times: &[usize]) -> Vec<Vec<Cell>> {
        let levers = Levers {
            fewer: 1.0 / self.trials.share - 1.0,
            crowding: f64::from(1 << self.n_axes) - 1.0,
            bins: 1.0 - LEFT_OF_BINS,
        };
        let known: Vec<Vec<(Cell, Differences)>> = times
            .iter()
            .map(|&time| self.known_bins(time).into_iter().map(|bin| self.cell(time, bin)).collect())
            .collect();
        let pooled: Vec<Differences> = known.iter().flatten().map(|(_, differences)| *differences).collect();
        let has_bins = self.half_bins.is_some();
        let direct = if has_bins { share_of_direct(&pooled, levers) } else { 1.0 };
        let resolve = |(cell, differences): &(Cell, Differences)| {
            let (bias, bins) = match (self.trials.interacts && levers.fewer > 0.0, has_bins) {
                (true, true) => differences.resolve(levers, direct),
                (true, false) => (differences.smaller.times(1.0 / levers.fewer), Estimate::default()),
                (false, _) => (Estimate::default(), differences.halved.times(1.0 / levers.bins)),
            };
            Cell { bias, bins, ..*cell }
        };
        known.iter().map(|cells| cells.iter().map(resolve).collect()).collect()
    }

    /// The bins of one time that hold particles in all runs.
    fn known_bins(&self, time_idx: usize) -> Vec<usize> {
        let all = || {
            let groups = self.groups.iter().chain(&self.groups_half_bins).chain(&self.groups_half_step);
            std::iter::once(&self.run).chain(&self.half_bins).chain(groups)
        };
        let is_known = |bin: &usize| {
            all().all(|fields| {
                let time = &fields.times[time_idx];
                time.is_filled[*bin] && time.values[*bin].is_finite()
            })
        };
        (0..self.run.times[time_idx].values.len()).filter(is_known).collect()
    }

    /// What the trials tell of one value; docs/methods.md, "Error bars without a reference".
    fn cell(&self, time_idx: usize, bin: usize) -> (Cell, Differences) {
        let at = |fields: &Fields| fields.times[time_idx].values[bin];
        let share = self.trials.share;
        let value = at(&self.run);
        let groups: Vec<f64> = self.groups.iter().map(at).collect();
        let group = mean_and_variance(&groups);
        let noise = share * group.variance;
        let pairs = |others: &[Fields]| -> Estimate {
            let differences: Vec<f64> =
                groups.iter().zip(others).map(|(own, other)| own - at(other)).collect();
            mean_and_variance(&differences)
        };
        let mean_of_pairs = |pair: Estimate| Estimate { variance: pair.variance / PAIRS as f64, ..pair };
        let mut cell = Cell { value, noise, ..Cell::default() };
        if !self.groups_half_step.is_empty() {
            cell.step = mean_of_pairs(pairs(&self.groups_half_step)).times(1.0 / (1.0 - LEFT_OF_STEP));
        }
        let variance = noise + group.variance / groups.len() as f64;
        let mut differences = Differences {
            smaller: Estimate { value: group.value - value, variance },
            ..Differences::default()
        };
        if let Some(half_bins) = &self.half_bins {
            let pair = pairs(&self.groups_half_bins);
            differences.halved = Estimate { value: value - at(half_bins), variance: share * pair.variance };
            differences.halved_smaller = mean_of_pairs(pair);
        }
        (cell, differences)
    }

    fn parts(&self, cells: &[Cell], factors: Factors, weight: f64) -> Parts {
        // Half bins hold fewer particles each: their bias grows while the error of the width falls.
        let per_bin = f64::from(1 << self.n_axes);
        let mut sums = Parts::default();
        let mut bins_squared = 0.0;
        for cell in cells {
            let step = factors.step * cell.step.value;
            let bias = factors.bias * cell.bias.value;
            let bins = factors.bins * cell.bins.value;
            let square = |noise: f64, systematic: f64| noise + systematic * systematic;
            sums.total += square(cell.noise, step + bias + bins);
            sums.step += step * step;
            sums.particles += square(cell.noise, bias);
            bins_squared += bins * bins;
            sums.remedied[0] += square(0.5 * cell.noise, step + 0.5 * bias + bins);
            sums.remedied[1] += square(cell.noise, LEFT_OF_STEP * step + bias + bins);
            sums.remedied[2] += square(cell.noise, step + per_bin * bias + LEFT_OF_BINS * bins);
        }
        let norm = |sum: f64| (weight * sum).sqrt();
        Parts {
            total: norm(sums.total),
            step: norm(sums.step),
            particles: norm(sums.particles),
            bins: (!self.trials.has_unknown_bins).then(|| norm(bins_squared)),
            remedied: sums.remedied.map(norm),
        }
    }
}

/// One value at each time, none in bins.
fn is_scalar(kind: OutputKind) -> bool {
    kind.is_course()
}

/// Values over twice as many bins along each axis as `bins`, averaged to those; the first axis is the
/// slowest. Where no half holds a value, neither does the whole.
fn means_of_halves(halves: &FieldAt, bins: &[usize]) -> FieldAt {
    let n_bins = bins.iter().product();
    let (mut sums, mut counts) = (vec![0.0; n_bins], vec![0.0; n_bins]);
    for (idx, (value, is_filled)) in halves.values.iter().zip(&halves.is_filled).enumerate() {
        let (mut rest, mut whole, mut stride) = (idx, 0, 1);
        for &n in bins.iter().rev() {
            whole += stride * (rest % (2 * n) / 2);
            rest /= 2 * n;
            stride *= n;
        }
        if *is_filled && value.is_finite() {
            sums[whole] += value;
            counts[whole] += 1.0;
        }
    }
    let values = sums.iter().zip(&counts).map(|(sum, count)| sum / count).collect();
    FieldAt { t: halves.t, values, is_filled: counts.iter().map(|count| *count > 0.0).collect() }
}

/// The bar of all times from those of each.
fn over_all_times(bars: &[ErrorBar]) -> Option<ErrorBar> {
    let first = bars.first()?;
    let norm = |of: &dyn Fn(&ErrorBar) -> f64| bars.iter().map(|bar| of(bar) * of(bar)).sum::<f64>().sqrt();
    let parts = Parts {
        total: norm(&|bar| bar.parts.total),
        step: norm(&|bar| bar.parts.step),
        particles: norm(&|bar| bar.parts.particles),
        bins: first.parts.bins.map(|_| norm(&|bar| bar.parts.bins.unwrap_or(0.0))),
        remedied: std::array::from_fn(|idx| norm(&|bar| bar.parts.remedied[idx])),
    };
    let n = bars.iter().map(|bar| bar.n).sum();
    Some(ErrorBar { t: None, n, size: norm(&|bar| bar.size), parts, ..*first })
}

/// How much of each systematic field is more than noise.
#[derive(Debug, Clone, Copy)]
struct Factors {
    step: f64,
    bias: f64,
    bins: f64,
}

impl Factors {
    fn of(cells: &[Cell]) -> Self {
        let of = |field: fn(&Cell) -> Estimate| shrinkage(cells.iter().map(field));
        Self { step: of(|cell| cell.step), bias: of(|cell| cell.bias), bins: of(|cell| cell.bins) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_averaged_along_every_axis() {
        let values: Vec<f64> = (0..24).map(f64::from).collect();
        let mut is_filled = vec![true; 24];
        (is_filled[0], is_filled[1], is_filled[6]) = (false, false, false);
        // 4 × 6 halves make 2 × 3 bins; the first has one half left, number 7.
        let whole = means_of_halves(&FieldAt { t: 0.0, values, is_filled }, &[2, 3]);
        assert_eq!(whole.values, [7.0, 5.5, 7.5, 15.5, 17.5, 19.5]);
        assert_eq!(whole.is_filled, [true; 6]);
    }
}

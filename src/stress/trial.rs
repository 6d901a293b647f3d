//! One trial: compiled, run small, and judged.
//!
//! Owns the verdict. May use the plan and the engine. It deliberately stops what takes too long.

use super::Knob;
use crate::diagnostic::{Diagnostic, Severity};
use crate::engine::snapshot::{Outcome, Snapshot, Values};
use crate::engine::{Control, RunError, Settings, run};
use crate::flow::FlowSeries;
use crate::plan::compile::{Compiled, Options, compile_edited};
use crate::plan::transport::Transport;
use crate::plan::{Output, OutputKind, Plan, Quantity};
use crate::scenario::Scenario;
use crate::stop;
use std::time::{Duration, Instant};

/// A tolerance this much tighter tells the error of the one that is asked for.
const TIGHTER: f64 = 1e-2;

/// Tighter tolerances are not asked for.
const TIGHTEST: f64 = 1e-13;

/// Without a tolerance: what is below zero by this share of the largest value is no rounding.
const LEAST: f64 = 1e-9;

/// Beyond the values at the start by this share of the largest one: more than rounding.
const BEYOND: f64 = 1e-12;

/// How much a trial may take.
#[derive(Debug, Clone, PartialEq)]
pub struct Bounds {
    /// Particles at most, but as many as the bins need.
    pub particles: u64,
    /// Wall time of a run.
    pub time: Duration,
    /// The flow of a scene that has it from files: no trial turns it.
    pub flow: Option<FlowSeries>,
}

/// A knob turned by a power of ten.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Trial {
    pub knob: Knob,
    pub decades: i32,
}

/// How a trial ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fate {
    Finished,
    /// The plan was refused at a line.
    Refused,
    /// The run stopped with a reason.
    Stopped,
    /// What is conserved was not.
    MassLost,
    /// Something was below zero by more than the tolerance.
    Negative,
    /// Something was above or below all that there was at the start, though parcels only exchanged it.
    Beyond,
    /// Not run, or cut short, for its time.
    TooLong,
}

impl Fate {
    pub fn name(self) -> &'static str {
        match self {
            Self::Finished => "finished",
            Self::Refused => "refused",
            Self::Stopped => "stopped",
            Self::MassLost => "mass_lost",
            Self::Negative => "negative",
            Self::Beyond => "beyond",
            Self::TooLong => "too_long",
        }
    }
}

/// What is told of a trial.
#[derive(Debug, Clone)]
pub struct Verdict {
    pub trial: Trial,
    pub fate: Fate,
    /// What refused or stopped it, with its place.
    pub message: Option<Diagnostic>,
    /// Why it was not run, or not to its end.
    pub reason: Option<String>,
    pub wall: f64,
    pub cpu: f64,
    pub steps: u64,
    pub particles: u64,
    pub sub_steps: u64,
    pub mass_defect: Option<f64>,
    /// Smallest concentration that was observed, over the largest.
    pub lowest: Option<f64>,
    /// Difference to a run with a hundredth of the tolerance, over the size of the outputs; `None` if
    /// nothing is integrated with error control.
    pub error: Option<f64>,
}

impl Trial {
    /// All trials of a scene: each knob that it has by `-decades ..= decades`, in steps of `every`.
    pub fn all(scenario: &Scenario, knobs: &[Knob], decades: i32, every: i32) -> Vec<Self> {
        let of_knob = |&knob: &Knob| {
            let n = decades / every.max(1);
            (-n..=n).map(move |k| Self { knob, decades: k * every.max(1) })
        };
        Knob::of(scenario).iter().filter(|knob| knobs.contains(knob)).flat_map(of_knob).collect()
    }

    /// Runs the trial.
    pub fn run(self, scenario: &Scenario, options: &Options, bounds: &Bounds) -> Verdict {
        let mut verdict = Verdict::new(self);
        let factor = power_of_ten(self.decades);
        let compiled = compile_edited(scenario, options, &|plan| {
            self.knob.turn(plan, factor);
            shrink(plan, bounds.particles);
        });
        let (compiled, diagnostics) = compiled;
        let Some(compiled) = compiled else {
            verdict.fate = Fate::Refused;
            let is_fatal =
                |message: &&Diagnostic| matches!(message.severity, Severity::Error | Severity::Refused);
            verdict.message = diagnostics.iter().find(is_fatal).cloned();
            return verdict;
        };
        verdict.particles = compiled.plan.particles.count;
        verdict.steps = compiled.plan.time.n_steps;
        if compiled.cost.cpu_seconds > 10.0 * bounds.time.as_secs_f64() {
            verdict.fate = Fate::TooLong;
            verdict.reason = Some(format!("not run: about {:.1e} s", compiled.cost.cpu_seconds));
            return verdict;
        }
        verdict.take(scenario, &compiled, bounds);
        verdict
    }
}

/// As few particles as the bins and the trial need, each of more fluid.
fn shrink(plan: &mut Plan, particles: u64) {
    const PER_BIN: u64 = 100;
    // A kernel is as long as in the scene: among few parcels it would reach none.
    const EXCHANGING: u64 = 4_000;
    let particles = if plan.exchange.is_some() { particles.max(EXCHANGING) } else { particles };
    let n_bins: u64 = plan.axes.iter().map(|axis| axis.bins as u64).product();
    let needed = if n_bins > 1 { n_bins.saturating_mul(PER_BIN) } else { 1 };
    let count = particles.max(needed).min(plan.particles.count);
    plan.set_count(count);
}

/// Exact for what numbers can hold.
fn power_of_ten(decades: i32) -> f64 {
    format!("1e{decades}").parse().unwrap_or(f64::NAN)
}

impl Verdict {
    fn new(trial: Trial) -> Self {
        Self {
            trial,
            fate: Fate::Finished,
            message: None,
            reason: None,
            wall: 0.0,
            cpu: 0.0,
            steps: 0,
            particles: 0,
            sub_steps: 0,
            mass_defect: None,
            lowest: None,
            error: None,
        }
    }

    fn take(&mut self, scenario: &Scenario, compiled: &Compiled, bounds: &Bounds) {
        let begin = Instant::now();
        let watched = is_bounded(&compiled.plan).then(|| watched(&compiled.plan));
        let result = finish(watched.as_ref().unwrap_or(&compiled.plan), bounds);
        self.wall = begin.elapsed().as_secs_f64();
        let (outcome, snapshots) = match result {
            Ok(finished) => finished,
            Err(RunError::Cancelled) => {
                self.fate = Fate::TooLong;
                self.reason = Some(format!("cut short after {:.1} s", bounds.time.as_secs_f64()));
                return;
            }
            Err(error) => {
                self.fate = match error {
                    RunError::MassLost { .. } => Fate::MassLost,
                    RunError::NegativeConcentration { .. } => Fate::Negative,
                    _ => Fate::Stopped,
                };
                self.message = Some(stop::message(&error, scenario, &compiled.plan));
                return;
            }
        };
        self.cpu = outcome.cpu;
        self.sub_steps = outcome.labour.steps;
        self.mass_defect = Some(outcome.worst_defect());
        let (lowest, highest) = extremes(&snapshots);
        self.lowest = (highest > 0.0).then_some(lowest / highest);
        let tolerance = compiled.plan.chemistry.as_ref().map_or(LEAST, |chemistry| chemistry.tolerance);
        if self.lowest.is_some_and(|lowest| lowest < -tolerance) {
            self.fate = Fate::Negative;
            self.reason = Some("a concentration that is shown is below zero".to_owned());
        }
        if let Some(reason) = watched.and_then(|plan| beyond(&snapshots, plan.outputs.len() - 1)) {
            self.fate = Fate::Beyond;
            self.reason = Some(reason);
        }
        self.error = tolerance_error(&compiled.plan, &snapshots, bounds);
    }
}

/// Whether values stay between those at the start: parcels exchange, and nothing else makes, brings or mixes any.
fn is_bounded(plan: &Plan) -> bool {
    let brings = plan.transport.as_ref().is_some_and(Transport::changes_water);
    plan.exchange.is_some() && plan.chemistry.is_none() && plan.mixing.is_none() && !brings
}

/// With all parcels looked at, at the start and in the end.
fn watched(plan: &Plan) -> Plan {
    let mut plan = plan.clone();
    plan.outputs.push(Output {
        kind: OutputKind::Particles,
        quantities: (0..plan.species.len()).map(Quantity::Species).collect(),
        bins: Vec::new(),
        times: vec![0.0, plan.time.duration],
        unit: None,
        station: None,
    });
    plan
}

/// The first value of an output that lies beyond those of its species at the start, or is no number.
fn beyond(snapshots: &[Snapshot], output_idx: usize) -> Option<String> {
    let mut seen = snapshots.iter().filter(|snapshot| snapshot.output_idx == output_idx);
    let columns = |snapshot: &'_ Snapshot| match &snapshot.values {
        Values::Particles { concentrations, .. } => concentrations.clone(),
        _ => Vec::new(),
    };
    let (start, end) = (columns(seen.next()?), columns(seen.next_back()?));
    start.iter().zip(&end).find_map(|(start, end)| {
        let low = start.iter().copied().fold(f64::INFINITY, f64::min);
        let high = start.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let slack = BEYOND * low.abs().max(high.abs());
        let is_inside = |value: f64| value >= low - slack && value <= high + slack;
        let wrong = end.iter().copied().find(|&value| !is_inside(value))?;
        Some(format!("a parcel has {wrong:e}, where there were {low:e} to {high:e} at the start (SI)"))
    })
}

/// Stops a run at its deadline.
struct Deadline(Instant);

impl Control for Deadline {
    fn step_done(&self, _step: u64, _n_steps: u64) {}

    fn is_cancelled(&self) -> bool {
        Instant::now() > self.0
    }
}

fn finish(plan: &Plan, bounds: &Bounds) -> Result<(Outcome, Vec<Snapshot>), RunError> {
    let mut snapshots = Vec::new();
    let settings = Settings { flow: bounds.flow.clone(), ..Settings::default() };
    let outcome = run(plan, &settings, &Deadline(Instant::now() + bounds.time), &mut |snapshot| {
        snapshots.push(snapshot);
        Ok(())
    })?;
    Ok((outcome, snapshots))
}

/// All concentrations that were observed.
fn concentrations(snapshots: &[Snapshot]) -> impl Iterator<Item = f64> {
    let of = |snapshot: &Snapshot| -> Vec<f64> {
        match &snapshot.values {
            Values::Binned { mean: columns, .. } | Values::Particles { concentrations: columns, .. } => {
                columns.concat()
            }
            Values::Total { amount } => amount.clone(),
            Values::Covariance { .. } | Values::Mixing(_) | Values::Rows(_) => Vec::new(),
        }
    };
    snapshots.iter().flat_map(of).filter(|value| !value.is_nan())
}

fn extremes(snapshots: &[Snapshot]) -> (f64, f64) {
    concentrations(snapshots)
        .fold((f64::INFINITY, 0.0), |(lowest, highest), value| (lowest.min(value), highest.max(value.abs())))
}

/// Relative difference, root of sums of squares, to a run with a tighter tolerance.
fn tolerance_error(plan: &Plan, snapshots: &[Snapshot], bounds: &Bounds) -> Option<f64> {
    let mut tighter = plan.clone();
    let chemistry = tighter.chemistry.as_mut()?;
    chemistry.kinetics.as_ref()?;
    chemistry.tolerance = (chemistry.tolerance * TIGHTER).max(TIGHTEST);
    chemistry.floors.iter_mut().for_each(|floor| *floor *= TIGHTER);
    let (_, reference) = finish(&tighter, bounds).ok()?;
    let (mut difference, mut size) = (0.0, 0.0);
    for (own, other) in concentrations(snapshots).zip(concentrations(&reference)) {
        difference += (own - other) * (own - other);
        size += other * other;
    }
    (size > 0.0).then(|| (difference / size).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seen(output_idx: usize, values: &[f64]) -> Snapshot {
        let values =
            Values::Particles { positions: vec![vec![0.0; 3]], concentrations: vec![values.to_vec()] };
        Snapshot { output_idx, t: 0.0, values }
    }

    #[test]
    fn what_lies_beyond_the_start_or_is_no_number_is_found() {
        let after = |end: &[f64]| beyond(&[seen(1, &[1.0, 1.5, 2.0]), seen(0, &[9.0; 3]), seen(1, end)], 1);
        assert_eq!(after(&[2.0, 1.0, 1.0]), None);
        assert_eq!(after(&[2.0 + 1e-12, 1.0, 1.0]), None);
        assert!(after(&[2.0 + 1e-11, 1.0, 1.0]).is_some());
        assert!(after(&[1.0, 0.999, 1.0]).is_some());
        assert!(after(&[1.0, 1.0, f64::NAN]).is_some());
    }
}

//! One replicate of one point: from its plan to what the journal keeps.
//!
//! Owns the run and its row. May use the engine and `measure`. It deliberately writes nothing.

use super::frame::Replicate;
use super::run::Surroundings;
use super::{Key, Scene, key_text};
use crate::diagnostic::codes;
use crate::engine::snapshot::{Outcome, Snapshot, Values};
use crate::engine::{self, Control, RunError};
use crate::flow::FlowSeries;
use crate::flow::statistics::Statistics;
use crate::measure::{self, Evaluated};
use crate::plan::compile::Compiled;
use crate::plan::evaluation::Evaluation;
use crate::plan::{NUMERICS_VERSION, Plan};
use crate::report;
use crate::scenario::Scenario;
use crate::stop;
use crate::table::{ErrorRow, PointRow, Status, Value};
use std::time::Instant;

/// A plan with the seed of one replicate.
pub struct Task<'a> {
    pub scene: &'a Scene,
    pub scenario: &'a Scenario,
    pub compiled: &'a Compiled,
    pub plan: Plan,
    pub key: Key,
    pub combination: u64,
    pub replicate: u32,
    pub session: u32,
    /// Wall seconds that its plan took.
    pub compile_wall: f64,
    /// Bytes that it may need; any, if nothing is said.
    pub memory: Option<u64>,
}

/// Hash of what is computed from results: with another one, errors and measures are worked out again.
pub fn evaluation_key(evaluation: &Evaluation) -> Key {
    let text = serde_json::to_string(evaluation).expect("evaluations hold numbers, lists and names only");
    *blake3::hash(text.as_bytes()).as_bytes()
}

impl Task<'_> {
    /// Runs it. Nothing if it was cancelled.
    pub fn run(&self, control: &dyn Control, threads: usize, around: &Surroundings) -> Option<Replicate> {
        let started = (around.now)();
        let mut snapshots: Vec<Snapshot> = Vec::new();
        let mut sink = |snapshot| {
            snapshots.push(snapshot);
            Ok(())
        };
        let begin = Instant::now();
        let mut settings = engine::Settings::default();
        // One thread is that of the caller: a pool of its own would cost more than a small run.
        if threads > 1 {
            settings.threads = Some(threads);
        }
        let refusal = self.too_large().or_else(|| self.fault(around));
        let outcome = match refusal {
            Some(refusal) => Err(refusal),
            None => self.flow().and_then(|flow| {
                settings.flow = flow;
                settings.starts = Some(self.scene.starts.clone());
                engine::run(&self.plan, &settings, control, &mut sink)
            }),
        };
        let outcome = match outcome {
            Ok(outcome) => Ok(outcome),
            Err(RunError::Cancelled) => return None,
            Err(error) => {
                let message = stop::message(&error, self.scenario, &self.plan);
                // What would work stands with what is wrong: the row has no place for more.
                let help = message.help.iter().take(1).cloned();
                let text: Vec<String> = std::iter::once(message.message).chain(help).collect();
                Err((message.code.0.to_owned(), text.join("; ")))
            }
        };
        let found = outcome.and_then(|outcome| {
            let evaluated = evaluate(self.compiled, &snapshots, &outcome)?;
            Ok((outcome, evaluated))
        });
        let mut row = self.row(threads, started, begin.elapsed().as_secs_f64(), around);
        let mut errors = Vec::new();
        match found {
            Ok((outcome, evaluated)) => {
                fill(&mut row, &outcome);
                let n_axes = self.scenario.domain.axes.len();
                (row.values, errors) = results(&self.compiled.plan, n_axes, &evaluated);
            }
            Err((code, message)) => {
                row.status = Status::Failed;
                (row.error_code, row.error_message) = (Some(code), Some(message));
                snapshots.clear();
            }
        }
        row.finished = (around.now)();
        Some(Replicate {
            key: self.key,
            evaluation: evaluation_key(&self.compiled.evaluation),
            session: self.session,
            row,
            errors,
            snapshots,
        })
    }

    /// A point that does not fit into this machine fails here and may run on another.
    fn too_large(&self) -> Option<RunError> {
        let bytes = self.compiled.cost.bytes();
        self.memory.is_some_and(|memory| bytes > memory).then_some(RunError::OutOfMemory { bytes })
    }

    /// The flow that this plan shares with others of the sweep.
    fn flow(&self) -> Result<Option<FlowSeries>, RunError> {
        let flow = self.scene.flows.of(&self.plan, &self.scene.sources);
        flow.map_err(|error| RunError::Flow(error.to_string()))
    }

    /// Failures asked for, to test how a sweep bears them.
    fn fault(&self, around: &Surroundings) -> Option<RunError> {
        let every = around.fault_every?;
        let number = u64::from_le_bytes(std::array::from_fn(|idx| self.key[idx]));
        number.is_multiple_of(every).then(|| RunError::Sink("a fault that was asked for".to_owned()))
    }

    fn row(&self, threads: usize, started: i64, wall: f64, around: &Surroundings) -> PointRow {
        let plan = &self.plan;
        PointRow {
            point: 0,
            replicate: self.replicate,
            key: key_text(&self.key),
            swept: self.scene.swept(self.combination),
            seed: plan.seed,
            status: Status::Done,
            error_code: None,
            error_message: None,
            wall,
            loop_wall: 0.0,
            cpu: 0.0,
            compile_wall: self.compile_wall,
            write_wall: None,
            // Of the process, which other points share.
            peak_memory: if threads > 1 { (around.peak_memory)() } else { None },
            particles: plan.particles.count,
            step: plan.time.step,
            duration: plan.time.duration,
            steps: plan.time.n_steps,
            sub_steps: None,
            mass_defect: None,
            values: Vec::new(),
            version: around.version.clone(),
            numerics: NUMERICS_VERSION,
            host: around.host.clone(),
            threads: threads as u32,
            started,
            finished: started,
        }
    }
}

fn fill(row: &mut PointRow, outcome: &Outcome) {
    (row.wall, row.loop_wall, row.cpu) = (outcome.wall, outcome.loop_wall, outcome.cpu);
    row.steps = outcome.n_steps;
    row.sub_steps = outcome.sub_steps();
    row.mass_defect = (!outcome.mass_defect.is_empty()).then(|| outcome.worst_defect());
}

fn evaluate(
    compiled: &Compiled,
    snapshots: &[Snapshot],
    outcome: &Outcome,
) -> Result<Evaluated, (String, String)> {
    measure::evaluate(&compiled.plan, &compiled.evaluation, snapshots, outcome)
        .map_err(|reason| (codes::R105.0.to_owned(), reason))
}

/// Columns and rows of what was evaluated.
fn results(plan: &Plan, n_axes: usize, evaluated: &Evaluated) -> (Vec<Value>, Vec<ErrorRow>) {
    let measure = |measure: &measure::MeasureValue| Value {
        name: measure.name.clone(),
        unit: measure.unit.clone(),
        value: Some(measure.value).filter(|value| !value.is_nan()),
    };
    let mut values = report::error_values(plan, n_axes, &evaluated.errors);
    values.extend(evaluated.measures.iter().map(measure));
    (values, report::error_rows(plan, n_axes, &evaluated.errors))
}

/// The flow of a replicate anew, where measures speak of it.
fn flow_of(compiled: &Compiled, seed: u64) -> Option<Statistics> {
    if !compiled.evaluation.has_flow() {
        return None;
    }
    let plan = compiled.plan.with_seed(seed);
    let solution = crate::flow::build::of(&plan).ok().flatten()?;
    Some(Statistics::of(&plan, &solution.flow))
}

/// Brings a recorded replicate up to date with the references and measures of today.
pub fn refresh(recorded: &mut Replicate, scenario: &Scenario, compiled: &Compiled) {
    let key = evaluation_key(&compiled.evaluation);
    if recorded.evaluation == key || recorded.row.status != Status::Done {
        return;
    }
    let row = &recorded.row;
    let outcome = Outcome {
        // Not kept: what is worked out again needs no counts.
        labour: crate::chemistry::Work::default(),
        n_steps: row.steps,
        n_particles: row.particles,
        mass_defect: row.mass_defect.into_iter().collect(),
        loop_wall: row.loop_wall,
        wall: row.wall,
        cpu: row.cpu,
        state_bytes: 0,
        flow: flow_of(compiled, row.seed),
    };
    let binned: Vec<Snapshot> = recorded
        .snapshots
        .iter()
        .filter(|snapshot| !matches!(snapshot.values, Values::Particles { .. }))
        .cloned()
        .collect();
    match evaluate(compiled, &binned, &outcome) {
        Ok(evaluated) => {
            (recorded.row.values, recorded.errors) =
                results(&compiled.plan, scenario.domain.axes.len(), &evaluated);
        }
        Err((code, message)) => {
            recorded.row.status = Status::Failed;
            (recorded.row.error_code, recorded.row.error_message) = (Some(code), Some(message));
        }
    }
    recorded.evaluation = key;
}

//! The points of a sweep: which combinations are run, what each will cost, which are refused.
//!
//! Owns their numbers and their order. May use [`Scene`]. It deliberately keeps a few numbers per point:
//! plans are made again when they are needed.

use super::Scene;
use crate::diagnostic::Diagnostic;
use crate::scenario::Scenario;
use crate::scenario::condition::Variable;
use crate::source::Sources;
use crate::units::Dimension;
use rayon::prelude::*;

/// One combination that is not skipped.
#[derive(Debug, Clone)]
pub struct Point {
    pub combination: u64,
    /// Processor seconds of one replicate, as the cost model has it.
    pub cost: f64,
    /// Bytes that a run of it needs.
    pub bytes: u64,
    /// Why it cannot be run.
    pub refusal: Option<Box<Refusal>>,
}

/// The message of a point that does not pass the checks.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Refusal {
    pub code: String,
    pub message: String,
}

impl Refusal {
    /// The message in one line, with its place and what was found there.
    fn of(diagnostic: &Diagnostic, sources: &Sources) -> Self {
        let mut message = diagnostic.message.clone();
        if let (Some(found), Some(expected)) = (&diagnostic.found, &diagnostic.expected) {
            message += &format!(": found {found}, expected {expected}");
        }
        let known = diagnostic.primary_span().filter(|span| sources.files().any(|(id, _)| id == span.file));
        if let Some(span) = known {
            let (line, column) = sources.line_column(span);
            message += &format!(" ({}:{line}:{column})", sources.file(span.file).name);
        }
        Self { code: diagnostic.code.0.to_owned(), message }
    }
}

/// All points in the order of their numbers.
pub struct Points {
    pub list: Vec<Point>,
    pub n_skipped: u64,
}

impl Points {
    /// Works all combinations out, on all threads of the pool; nothing if it was cancelled meanwhile.
    pub fn of(scene: &Scene, is_cancelled: &(dyn Fn() -> bool + Sync)) -> Option<Self> {
        let n = scene.n_combinations();
        let worked_out = |combination| if is_cancelled() { None } else { Some(point(scene, combination)) };
        let list: Option<Vec<Vec<Point>>> = (0..n)
            .into_par_iter()
            .fold(
                || Some(Vec::new()),
                |list: Option<Vec<Point>>, combination| {
                    let (mut list, found) = (list?, worked_out(combination)?);
                    list.extend(found);
                    Some(list)
                },
            )
            .collect();
        let list: Vec<Point> = list?.into_iter().flatten().collect();
        let n_skipped = n - list.len() as u64;
        Some(Self { list, n_skipped })
    }

    pub fn len(&self) -> usize {
        self.list.len()
    }

    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Numbers of the points that can be run, the dearest first: the end of the sweep then has small
    /// ones to fill all cores.
    pub fn by_cost(&self) -> Vec<u32> {
        let runs = |number: &u32| self.list[*number as usize].refusal.is_none();
        let mut order: Vec<u32> = (0..self.list.len() as u32).filter(runs).collect();
        let cost = |number: u32| self.list[number as usize].cost;
        order.sort_by(|&a, &b| cost(b).total_cmp(&cost(a)).then(a.cmp(&b)));
        order
    }
}

fn point(scene: &Scene, combination: u64) -> Option<Point> {
    let refused = |diagnostic: &Diagnostic| Point {
        combination,
        cost: 0.0,
        bytes: 0,
        refusal: Some(Box::new(Refusal::of(diagnostic, &scene.sources))),
    };
    let scenario = match scene.scenario(combination) {
        Ok(scenario) => scenario,
        // A point that is wrong may be one that is skipped for that: its values alone can tell.
        Err(diagnostic) => {
            let value = |variable: &Variable| written(scene, combination, variable);
            let is_skipped = scene.sweep.skips.iter().any(|skip| skip.holds(&value));
            return (!is_skipped).then(|| refused(&diagnostic));
        }
    };
    if scene.sweep.skips.iter().any(|skip| skip.holds(&|variable| size(&scenario, variable))) {
        return None;
    }
    let (compiled, diagnostics) = crate::plan::compile::compile(&scenario, &scene.options);
    Some(match compiled {
        Some(compiled) => Point {
            combination,
            cost: compiled.cost.cpu_seconds,
            bytes: compiled.cost.bytes(),
            refusal: None,
        },
        None => match diagnostics.iter().find(|diagnostic| diagnostic.is_fatal()) {
            Some(diagnostic) => refused(diagnostic),
            None => Point { combination, cost: 0.0, bytes: 0, refusal: None },
        },
    })
}

/// What the values of a combination say of a variable by themselves; not a number if they do not.
fn written(scene: &Scene, combination: u64, variable: &Variable) -> f64 {
    let name = match variable {
        Variable::Parameter(name) => name.as_str(),
        Variable::Particles => "particles",
        Variable::Step => "step",
        Variable::Bins => "bins",
        _ => return f64::NAN,
    };
    let values = scene.values(combination);
    let own = values.iter().find(|value| value.target.name() == name);
    own.map_or(f64::NAN, |value| value.value.si.iter().product())
}

/// The value of a parameter or a size of a scenario; not a number for what only a run knows.
pub fn size(scenario: &Scenario, variable: &Variable) -> f64 {
    match variable {
        Variable::Parameter(name) => {
            let own = scenario.parameters.iter().find(|parameter| parameter.name == *name);
            own.map_or(f64::NAN, |parameter| parameter.value)
        }
        Variable::Particles => scenario.particles.count as f64,
        Variable::Step => scenario.run.step,
        Variable::Duration => scenario.run.duration,
        Variable::Steps => (scenario.run.duration / scenario.run.step - 1e-9).ceil().max(1.0),
        Variable::Bins => {
            scenario.bins.as_ref().map_or(1.0, |bins| bins.value.iter().product::<usize>() as f64)
        }
        Variable::Measure(_) | Variable::WallTime | Variable::CpuTime | Variable::MassDefect => f64::NAN,
    }
}

/// The dimension of a swept value, for those who print it.
pub fn unit(dimension: Dimension) -> String {
    if dimension == Dimension::NONE { String::new() } else { crate::table::si_text(dimension) }
}

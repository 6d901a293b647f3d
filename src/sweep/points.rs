//! The points of a sweep: which combinations are run, what each will cost, which are refused.
//!
//! Owns their numbers and their order. May use [`Scene`]. It deliberately keeps a few numbers per point:
//! plans are made again when they are needed.

use super::Scene;
use crate::diagnostic::Diagnostic;
use crate::scenario::Scenario;
use crate::scenario::condition::Variable;
use crate::units::Dimension;
use rayon::prelude::*;

/// One combination that is not skipped.
#[derive(Debug, Clone)]
pub struct Point {
    pub combination: u64,
    /// Processor seconds of one replicate, as the cost model has it.
    pub cost: f64,
    /// Bytes of particle state.
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
    pub fn of(diagnostic: &Diagnostic) -> Self {
        Self { code: diagnostic.code.0.to_owned(), message: diagnostic.message.clone() }
    }
}

/// All points in the order of their numbers.
pub struct Points {
    pub list: Vec<Point>,
    pub n_skipped: u64,
}

impl Points {
    /// Works all combinations out, on all threads of the pool.
    pub fn of(scene: &Scene) -> Self {
        let n = scene.n_combinations();
        let list: Vec<Point> =
            (0..n).into_par_iter().filter_map(|combination| point(scene, combination)).collect();
        let n_skipped = n - list.len() as u64;
        Self { list, n_skipped }
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
        refusal: Some(Box::new(Refusal::of(diagnostic))),
    };
    let scenario = match scene.scenario(combination) {
        Ok(scenario) => scenario,
        Err(diagnostic) => return Some(refused(&diagnostic)),
    };
    if scene.sweep.skips.iter().any(|skip| skip.holds(&|variable| size(&scenario, variable))) {
        return None;
    }
    let (compiled, diagnostics) = crate::plan::compile::compile(&scenario, &scene.options);
    Some(match compiled {
        Some(compiled) => Point {
            combination,
            cost: compiled.cost.cpu_seconds,
            bytes: compiled.cost.state_bytes,
            refusal: None,
        },
        None => match diagnostics.iter().find(|diagnostic| diagnostic.is_fatal()) {
            Some(diagnostic) => refused(diagnostic),
            None => Point { combination, cost: 0.0, bytes: 0, refusal: None },
        },
    })
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

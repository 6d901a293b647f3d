//! A scene with one of its sweeps, parsed once: any point of it as settings and as a plan.
//!
//! Owns the way from a combination of values to a plan. May use `scenario` and `plan`. It deliberately
//! keeps no plan: a sweep may have any number of points.

use super::Key;
use super::seed::seed;
use crate::diagnostic::Diagnostic;
use crate::engine::Starts;
use crate::flow::Flows;
use crate::flow::scene::attach;
use crate::plan::Plan;
use crate::plan::compile::{Compiled, Options, compile};
use crate::scenario::sweep::{AxisValue, Sweep, Target};
use crate::scenario::{self, Scenario, Settings};
use crate::source::Sources;
use crate::syntax::tree;
use crate::table::{Swept, SweptValue, si_text};
use crate::units::Dimension;

/// Everything that the points of a sweep have in common.
pub struct Scene {
    pub file: tree::File,
    pub sources: Sources,
    /// What the command line sets at every point.
    pub settings: Settings,
    pub options: Options,
    pub sweep: Sweep,
    /// Flows that points share.
    pub flows: Flows,
    /// Integrated initial concentrations that points share.
    pub starts: Starts,
    root_seed: u64,
}

/// A value of one axis at a point.
pub struct PointValue<'a> {
    pub target: &'a Target,
    pub dimension: Dimension,
    pub value: &'a AxisValue,
}

impl Scene {
    /// `scenario` is that of the scene without a point.
    pub fn new(
        file: tree::File,
        sources: Sources,
        settings: Settings,
        options: Options,
        scenario: &Scenario,
        sweep: Sweep,
    ) -> Self {
        let root_seed = settings.seed.or(sweep.seed).unwrap_or(scenario.seed);
        Self {
            file,
            sources,
            settings,
            options,
            sweep,
            flows: Flows::default(),
            starts: Starts::default(),
            root_seed,
        }
    }

    pub fn root_seed(&self) -> u64 {
        self.root_seed
    }

    /// Combinations of the axes before any is skipped.
    pub fn n_combinations(&self) -> u64 {
        let lengths = self.sweep.groups.iter().map(|group| group.first().map_or(1, |axis| axis.values.len()));
        lengths.map(|n| n as u64).product()
    }

    /// The values of a combination, in the order of the axes; the first axis is slowest.
    pub fn values(&self, combination: u64) -> Vec<PointValue<'_>> {
        let mut rest = combination;
        let mut places = Vec::new();
        for group in self.sweep.groups.iter().rev() {
            let n = group.first().map_or(1, |axis| axis.values.len()) as u64;
            places.push((group, (rest % n) as usize));
            rest /= n;
        }
        let mut values = Vec::new();
        for (group, place) in places.into_iter().rev() {
            for axis in group {
                let (target, dimension) = (&axis.target, axis.dimension);
                values.push(PointValue { target, dimension, value: &axis.values[place] });
            }
        }
        values
    }

    pub fn seed(&self, combination: u64, replicate: u32) -> u64 {
        if self.sweep.has_common_numbers {
            return seed(self.root_seed, &[], replicate);
        }
        let named = |value: &PointValue| (value.target.name().to_owned(), value.value.si.clone());
        let named: Vec<_> = self.values(combination).iter().map(named).collect();
        seed(self.root_seed, &named, replicate)
    }

    /// The columns of a point that its row does not have anyway.
    pub fn swept(&self, combination: u64) -> Vec<Swept> {
        let column = |value: &PointValue| {
            let swept = match (value.target, &value.value.si[..]) {
                (Target::Particles | Target::Step, _) => return None,
                (Target::Bins, [n]) => SweptValue::Integer(*n as i64),
                (_, [si]) => SweptValue::Real(*si, si_text(value.dimension)),
                (_, several) => {
                    let words: Vec<String> = several.iter().map(f64::to_string).collect();
                    SweptValue::Text(words.join(" x "))
                }
            };
            Some(Swept { name: value.target.name().to_owned(), value: swept })
        };
        self.values(combination).iter().filter_map(column).collect()
    }

    /// What a point is called: `step=2, chi=0.001`, values in SI.
    pub fn name(&self, combination: u64) -> String {
        let word = |value: &PointValue| {
            let numbers: Vec<String> =
                value.value.si.iter().map(|number| crate::diagnostic::precise(*number)).collect();
            let unit = si_text(value.dimension);
            let unit = if value.dimension == Dimension::NONE { String::new() } else { format!(" {unit}") };
            format!("{}={}{unit}", value.target.name(), numbers.join("x"))
        };
        let words: Vec<String> = self.values(combination).iter().map(word).collect();
        if words.is_empty() { "the scene itself".to_owned() } else { words.join(", ") }
    }

    /// The values of a combination as settings of a command line: exact, in SI.
    pub fn assignments(&self, combination: u64) -> Vec<(String, String)> {
        let assignment = |value: &PointValue| {
            let unit = match value.dimension {
                Dimension::NONE => String::new(),
                dimension => dimension
                    .unit_text()
                    .strip_prefix('1')
                    .map_or_else(|| dimension.unit_text(), str::to_owned),
            };
            let numbers: Vec<String> = value.value.si.iter().map(|si| format!("{si:e}{unit}")).collect();
            let text = match &numbers[..] {
                [one] => one.clone(),
                several => format!("({})", several.join(", ")),
            };
            (value.target.name().to_owned(), text)
        };
        self.values(combination).iter().map(assignment).collect()
    }

    /// The scenario of a combination; the first fatal message if it is wrong.
    pub fn scenario(&self, combination: u64) -> Result<Scenario, Box<Diagnostic>> {
        let point = self.values(combination);
        let point = point.iter().map(|value| (value.target.clone(), value.value.expr.clone())).collect();
        let settings = Settings { point: Some(point), ..self.settings.clone() };
        // Settings of the command line add texts: to a copy, so that they do not pile up.
        let is_alone = settings.set.is_empty() && self.sources.data().is_empty();
        let mut sources = if is_alone { Sources::default() } else { self.sources.clone() };
        let (scenario, diagnostics) = scenario::resolve(&self.file, &mut sources, &settings, false);
        let mut scenario = scenario.ok_or_else(|| first_fatal(diagnostics))?;
        let found = attach(&mut scenario, &self.sources, &self.flows);
        if crate::diagnostic::any_fatal(&found) { Err(first_fatal(found)) } else { Ok(scenario) }
    }

    /// The plan of a combination with the seed of its replicate 0.
    pub fn compile(&self, combination: u64) -> Result<(Scenario, Compiled), Box<Diagnostic>> {
        let mut scenario = self.scenario(combination)?;
        scenario.seed = self.seed(combination, 0);
        let (compiled, diagnostics) = compile(&scenario, &self.options);
        let compiled = compiled.ok_or_else(|| first_fatal(diagnostics))?;
        Ok((scenario, compiled))
    }

    /// The plan of another replicate, and its key.
    pub fn replicate(&self, plan: &Plan, combination: u64, replicate: u32) -> (Plan, Key) {
        let plan = plan.with_seed(self.seed(combination, replicate));
        let key = plan_key(&plan);
        (plan, key)
    }
}

/// The key of a plan: its hash as bytes.
pub fn plan_key(plan: &Plan) -> Key {
    *crate::plan::compile::hash_of(plan).as_bytes()
}

fn first_fatal(diagnostics: Vec<Diagnostic>) -> Box<Diagnostic> {
    let fatal = diagnostics.into_iter().find(Diagnostic::is_fatal);
    Box::new(fatal.unwrap_or_else(|| {
        Diagnostic::error(crate::diagnostic::codes::R104, "the point has no plan, and nothing says why")
    }))
}

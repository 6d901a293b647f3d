//! What a sweep expects of its results: conditions for every replicate, and orders of convergence.
//!
//! Owns their verdicts. May use the rows of points. It deliberately fits nothing itself: `report` has
//! the one fit that figures show, too.

use super::Scene;
use super::points::size;
use crate::report::{ExpectationOutcome, ExpectedOrder, SweepExpectation};
use crate::scenario::Scenario;
use crate::scenario::condition::{Condition, Variable};
use crate::scenario::sweep::{Expect, ExpectKind, Target};
use crate::table::PointRow;

/// What the expectations need to know of one replicate that ended well.
#[derive(Debug, Clone, PartialEq)]
struct Sample {
    number: u32,
    /// Index into the combination's other axes: samples of one line of a fit share it.
    line: Vec<u64>,
    axis: f64,
    value: f64,
}

/// Collects replicates, then judges.
pub struct Judge<'a> {
    scene: &'a Scene,
    verdicts: Vec<Verdict<'a>>,
}

struct Verdict<'a> {
    expect: &'a Expect,
    samples: Vec<Sample>,
    n_looked_at: u64,
    /// Values that are not defined.
    n_undefined: u64,
    /// The first replicates that break a condition, in words.
    broken: Vec<String>,
    n_broken: u64,
}

/// How many broken replicates are named.
const MAX_NAMED: usize = 3;

impl<'a> Judge<'a> {
    pub fn new(scene: &'a Scene) -> Self {
        let verdict = |expect| Verdict {
            expect,
            samples: Vec::new(),
            n_looked_at: 0,
            n_undefined: 0,
            broken: Vec::new(),
            n_broken: 0,
        };
        Self { scene, verdicts: scene.sweep.expects.iter().map(verdict).collect() }
    }

    /// Looks at one replicate that ended well.
    pub fn look(&mut self, combination: u64, scenario: &Scenario, row: &PointRow) {
        let value = |variable: &Variable| value_of(scenario, row, variable);
        for verdict in &mut self.verdicts {
            if verdict.expect.when.as_ref().is_some_and(|when| !when.holds(&value)) {
                continue;
            }
            verdict.n_looked_at += 1;
            match &verdict.expect.kind {
                ExpectKind::Holds(condition) => {
                    verdict.check(self.scene, combination, condition, row, &value)
                }
                ExpectKind::Mean { measure, .. } => {
                    let number = value(&Variable::Measure(measure.clone()));
                    let sample = Sample { number: row.point, line: Vec::new(), axis: 0.0, value: number };
                    verdict.samples.push(Sample { line: vec![combination], ..sample });
                }
                ExpectKind::Order { measure, axis, .. } => {
                    let number = value(&Variable::Measure(measure.clone()));
                    if !number.is_finite() {
                        verdict.n_undefined += 1;
                        continue;
                    }
                    let (axis, line) = place(self.scene, combination, axis);
                    verdict.samples.push(Sample { number: row.point, line, axis, value: number });
                }
            }
        }
    }

    /// The verdicts; with points missing nothing that holds so far is called met.
    pub fn judge(self, is_whole: bool) -> Vec<SweepExpectation> {
        let scene = self.scene;
        self.verdicts.into_iter().map(|verdict| verdict.judge(scene, is_whole)).collect()
    }
}

/// The first few, and how many more there are.
fn listed(texts: &[&str]) -> String {
    let shown = texts[..texts.len().min(MAX_NAMED)].join("; ");
    match texts.len().saturating_sub(MAX_NAMED) {
        0 => shown,
        more => format!("{shown}; and {more} more"),
    }
}

impl Verdict<'_> {
    fn check(
        &mut self,
        scene: &Scene,
        combination: u64,
        condition: &Condition,
        row: &PointRow,
        value: &impl Fn(&Variable) -> f64,
    ) {
        let uses = condition.uses();
        if uses.iter().any(|variable| value(variable).is_nan()) {
            self.n_undefined += 1;
            return;
        }
        if condition.holds(value) {
            return;
        }
        self.n_broken += 1;
        if self.broken.len() < MAX_NAMED {
            let shown = |variable: &&Variable| {
                format!("{} = {}", name_of(variable), crate::diagnostic::number(value(variable)))
            };
            let values: Vec<String> = uses.iter().map(shown).collect();
            let point = scene.name(combination);
            self.broken.push(format!(
                "{} at point {} ({point}), replicate {}",
                values.join(", "),
                row.point,
                row.replicate
            ));
        }
    }

    fn judge(self, scene: &Scene, is_whole: bool) -> SweepExpectation {
        let text = scene.sources.slice(self.expect.span).trim_start_matches("expect").trim().to_owned();
        let (outcome, detail, order) = match &self.expect.kind {
            ExpectKind::Holds(_) => {
                let (outcome, detail) = self.condition(is_whole);
                (outcome, detail, None)
            }
            ExpectKind::Mean { measure, low, high, unit } => {
                let (outcome, detail) = self.mean(scene, (measure, unit), (*low, *high), is_whole);
                (outcome, detail, None)
            }
            ExpectKind::Order { measure, axis, low, high } => {
                let (measure, axis) = (measure.clone(), axis.name().to_owned());
                let (outcome, detail) = self.order(*low, *high, is_whole);
                // An order of some points only says nothing of the lines through all.
                let is_of_all = self.expect.when.is_none();
                let order = is_of_all.then_some(ExpectedOrder { measure, axis, low: *low, high: *high });
                (outcome, detail, order)
            }
        };
        SweepExpectation { text, outcome, detail, order }
    }

    fn condition(&self, is_whole: bool) -> (ExpectationOutcome, String) {
        if self.n_broken > 0 {
            let rest = self.n_broken - self.broken.len() as u64;
            let more = if rest > 0 { format!("; and {rest} more") } else { String::new() };
            return (ExpectationOutcome::NotMet, format!("{}{more}", self.broken.join("; ")));
        }
        if self.n_undefined > 0 || self.n_looked_at == 0 {
            let detail = format!("{} of {} replicates have no value", self.n_undefined, self.n_looked_at);
            return (ExpectationOutcome::Unknown, detail);
        }
        let detail = format!("{} replicates", self.n_looked_at);
        (if is_whole { ExpectationOutcome::Met } else { ExpectationOutcome::Unknown }, detail)
    }

    /// The means over the replicates of each point; those out of range are named, or the one nearest to an end.
    fn mean(
        &self,
        scene: &Scene,
        (measure, (factor, unit)): (&str, &(f64, String)),
        (low, high): (f64, f64),
        is_whole: bool,
    ) -> (ExpectationOutcome, String) {
        let mut points: Vec<(u64, u32, Vec<f64>)> = Vec::new();
        for sample in &self.samples {
            match points.iter_mut().rfind(|(_, number, _)| *number == sample.number) {
                Some((.., values)) => values.push(sample.value),
                None => points.push((sample.line[0], sample.number, vec![sample.value])),
            }
        }
        let shown = |(combination, number, values): &(u64, u32, Vec<f64>)| {
            let n = values.len() as f64;
            let mean = values.iter().sum::<f64>() / n;
            let square: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
            let digits = |value: f64| crate::diagnostic::number(value / factor);
            let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
            let error = if n > 1.0 {
                format!(" ± {}", digits((square / (n - 1.0) / n).sqrt()))
            } else {
                String::new()
            };
            let name = scene.name(*combination);
            let of = if name.is_empty() { String::new() } else { format!(" ({name})") };
            (mean, format!("{measure} = {}{error}{unit} at point {number}{of}", digits(mean)))
        };
        let means: Vec<(f64, String)> = points.iter().map(shown).collect();
        if means.is_empty() || means.iter().any(|(mean, _)| mean.is_nan()) {
            return (ExpectationOutcome::Unknown, "a replicate has no value".to_owned());
        }
        let broken: Vec<&str> = means
            .iter()
            .filter(|(mean, _)| !(low..=high).contains(mean))
            .map(|(_, text)| &text[..])
            .collect();
        if !broken.is_empty() {
            return (ExpectationOutcome::NotMet, listed(&broken));
        }
        let texts: Vec<&str> = means.iter().map(|(_, text)| &text[..]).collect();
        let outcome = if is_whole { ExpectationOutcome::Met } else { ExpectationOutcome::Unknown };
        (outcome, listed(&texts))
    }

    /// The slope over all lines, each with an offset of its own.
    fn order(&self, low: f64, high: f64, is_whole: bool) -> (ExpectationOutcome, String) {
        let mut points: Vec<(Vec<u64>, f64, Vec<f64>)> = Vec::new();
        let mut last = None;
        for sample in &self.samples {
            if last != Some(sample.number) {
                points.push((sample.line.clone(), sample.axis, Vec::new()));
                last = Some(sample.number);
            }
            if let Some((_, _, values)) = points.last_mut() {
                values.push(sample.value);
            }
        }
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let logs: Vec<(&[u64], f64, f64)> = points
            .iter()
            .filter(|(_, axis, values)| *axis > 0.0 && mean(values) > 0.0)
            .map(|(line, axis, values)| {
                let ln = crate::maths::scalar::ln;
                (&line[..], ln(*axis), ln(mean(values)))
            })
            .collect();
        let n_without = points.len() - logs.len();
        let Some((slope, error)) = slope(&logs) else {
            let why = match n_without {
                0 => "fewer than two points on a line".to_owned(),
                n => format!(
                    "{n} of {} points have no logarithm: a mean or a value is not above zero",
                    points.len()
                ),
            };
            return (ExpectationOutcome::Unknown, why);
        };
        let detail = match error {
            Some(error) => format!("{slope:.3} ± {error:.3} (standard error) over {} points", logs.len()),
            None => format!("{slope:.3} over {} points", logs.len()),
        };
        let outcome = match (low..=high).contains(&slope) {
            true if is_whole => ExpectationOutcome::Met,
            true => ExpectationOutcome::Unknown,
            false => ExpectationOutcome::NotMet,
        };
        (outcome, detail)
    }
}

/// Slope of `y` by `x` with an offset for each line, and its standard error.
///
/// - Equation: `b = Σ (x − x̄_l)(y − ȳ_l) / Σ (x − x̄_l)²`, `s_b² = Σ r² / ((n − L − 1) Σ (x − x̄_l)²)`.
/// - Symbols: `l` line, `L` lines, `n` points, `r` residuals.
/// - Range: `None` without two different `x` on a line; no error without a degree of freedom.
/// - Source: least squares with a dummy variable per line (textbook analysis of covariance).
/// - Shape: two numbers.
fn slope(points: &[(&[u64], f64, f64)]) -> Option<(f64, Option<f64>)> {
    let mut lines: std::collections::BTreeMap<&[u64], Vec<(f64, f64)>> = std::collections::BTreeMap::new();
    for &(line, x, y) in points {
        lines.entry(line).or_default().push((x, y));
    }
    let centred: Vec<(f64, f64)> = lines
        .values()
        .flat_map(|line| {
            let n = line.len() as f64;
            let (x, y) =
                line.iter().fold((0.0, 0.0), |sum, point| (sum.0 + point.0 / n, sum.1 + point.1 / n));
            line.iter().map(move |point| (point.0 - x, point.1 - y))
        })
        .collect();
    let sum_xx: f64 = centred.iter().map(|(x, _)| x * x).sum();
    if sum_xx <= 1e-24 {
        return None;
    }
    let slope = centred.iter().map(|(x, y)| x * y).sum::<f64>() / sum_xx;
    let freedom = points.len() as f64 - lines.len() as f64 - 1.0;
    let residuals: f64 = centred.iter().map(|(x, y)| (y - slope * x).powi(2)).sum();
    let error = (freedom > 0.0).then(|| (residuals / freedom / sum_xx).sqrt());
    Some((slope, error))
}

/// The value of an axis at a combination, and the values of the axes that are varied apart from it, as
/// bits: those zipped with it change with it.
fn place(scene: &Scene, combination: u64, axis: &Target) -> (f64, Vec<u64>) {
    let own_group = scene.sweep.groups.iter().find(|group| group.iter().any(|other| other.target == *axis));
    let goes_along =
        |target: &Target| own_group.is_some_and(|group| group.iter().any(|other| other.target == *target));
    let (mut own, mut line) = (f64::NAN, Vec::new());
    for value in scene.values(combination) {
        if value.target == axis {
            own = value.value.si.iter().product();
        } else if !goes_along(value.target) {
            line.extend(value.value.si.iter().map(|si| si.to_bits()));
        }
    }
    (own, line)
}

fn value_of(scenario: &Scenario, row: &PointRow, variable: &Variable) -> f64 {
    match variable {
        Variable::Measure(name) => {
            let own = row.values.iter().find(|value| value.name == *name);
            own.and_then(|value| value.value).unwrap_or(f64::NAN)
        }
        Variable::WallTime => row.wall,
        Variable::CpuTime => row.cpu,
        Variable::MassDefect => row.mass_defect.unwrap_or(f64::NAN),
        Variable::Steps => row.steps as f64,
        other => size(scenario, other),
    }
}

fn name_of(variable: &Variable) -> &str {
    match variable {
        Variable::Parameter(name) | Variable::Measure(name) => name,
        Variable::Particles => "particles",
        Variable::Step => "step",
        Variable::Duration => "duration",
        Variable::Steps => "steps",
        Variable::Bins => "bins",
        Variable::WallTime => "wall_time",
        Variable::CpuTime => "cpu_time",
        Variable::MassDefect => "mass_defect",
    }
}

#[cfg(test)]
mod tests {
    use super::slope;

    #[test]
    fn lines_have_offsets_of_their_own() {
        let points = [
            (&[0][..], 0.0, 1.0),
            (&[0], 1.0, 0.5),
            (&[0], 2.0, 0.0),
            (&[1], 1.0, 7.5),
            (&[1], 3.0, 6.5),
            (&[2], 9.0, 3.0),
        ];
        let (slope, error) = slope(&points).unwrap();
        assert!((slope + 0.5).abs() < 1e-15 && error.unwrap() < 1e-15);
    }

    /// y = 0, 1, 1 at x = 0, 1, 2: slope 1/2, residuals −1/6, 1/3, −1/6, so s² = (1/6)/1/2.
    #[test]
    fn the_standard_error_is_that_of_least_squares() {
        let points = [(&[0][..], 0.0, 0.0), (&[0], 1.0, 1.0), (&[0], 2.0, 1.0)];
        let (slope, error) = slope(&points).unwrap();
        assert!((slope - 0.5).abs() < 1e-15);
        assert!((error.unwrap() - (1.0_f64 / 12.0).sqrt()).abs() < 1e-15);
        assert_eq!(super::slope(&points[..1]), None);
        assert_eq!(super::slope(&[(&[0], 1.0, 0.0), (&[1], 2.0, 1.0)]), None);
    }
}

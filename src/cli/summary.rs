//! What a run tells at its end: errors against references, measures, time, mass, where the results are.

use super::error_bars::{ErrorBars, JsonBar};
use super::text::{Align, bytes, duration, grouped, significant, table};
use lamella::engine::snapshot::Outcome;
use lamella::table::{ErrorRow, Value};
use serde::Serialize;
use std::path::Path;

/// More rows than this are in the results, not on the terminal.
const MAX_ROWS: usize = 40;

/// All that is told of a finished run.
pub(crate) struct Summary<'a> {
    pub(crate) folder: &'a Path,
    pub(crate) figure: Option<&'a Path>,
    pub(crate) plan_hash: &'a str,
    pub(crate) outcome: &'a Outcome,
    pub(crate) errors: &'a [ErrorRow],
    pub(crate) measures: &'a [Value],
    pub(crate) error_bars: Option<&'a ErrorBars>,
    pub(crate) n_threads: usize,
    pub(crate) peak_memory: Option<u64>,
    /// Wall seconds of reading and planning, and of writing tables and figure.
    pub(crate) compile_wall: f64,
    pub(crate) write_wall: f64,
}

impl Summary<'_> {
    pub(crate) fn text(&self) -> String {
        let bars = self.error_bars.map(ErrorBars::text).unwrap_or_default();
        let parts = [self.error_table(), bars, self.measure_table(), self.facts()];
        let present: Vec<String> = parts.into_iter().filter(|part| !part.is_empty()).collect();
        present.join("\n")
    }

    fn error_table(&self) -> String {
        if self.errors.is_empty() {
            return String::new();
        }
        let header = [
            ("reference", Align::Left),
            ("output", Align::Left),
            ("t", Align::Right),
            ("L1", Align::Right),
            ("L2", Align::Right),
            ("L∞", Align::Right),
            ("noise", Align::Right),
            ("RMSE", Align::Right),
            ("unit", Align::Left),
        ];
        let rows: Vec<Vec<String>> = self.errors.iter().take(MAX_ROWS).map(error_cells).collect();
        let rest = self.errors.len().saturating_sub(MAX_ROWS);
        let more = if rest > 0 { format!("… and {rest} rows more in errors/\n") } else { String::new() };
        format!(
            "errors and noise relative to the reference (noise as L2), RMSE in its unit\n{}{more}",
            table(&header, &rows)
        )
    }

    fn measure_table(&self) -> String {
        if self.measures.is_empty() {
            return String::new();
        }
        let header = [("measure", Align::Left), ("value", Align::Right), ("unit", Align::Left)];
        let cells = |measure: &Value| {
            let value = shown(measure.value, 5);
            vec![measure.name.clone(), value, measure.unit.clone()]
        };
        table(&header, &self.measures.iter().map(cells).collect::<Vec<_>>())
    }

    fn facts(&self) -> String {
        let outcome = self.outcome;
        let mut lines = vec![
            ("particles", format!("{}, steps {}", grouped(outcome.n_particles), grouped(outcome.n_steps))),
            ("engine", self.engine_time()),
            (
                "other time",
                format!("plan {}, writing {}", duration(self.compile_wall), duration(self.write_wall)),
            ),
            ("mass defect", format!("{} relative", shown(Some(self.outcome.worst_defect()), 2))),
            ("memory", self.memory()),
            ("plan", self.plan_hash.to_owned()),
            ("results", self.folder.display().to_string()),
        ];
        lines.extend(self.figure.map(|figure| ("figure", figure.display().to_string())));
        lines.into_iter().map(|(name, text)| format!("{name:<12}{text}\n")).collect()
    }

    fn engine_time(&self) -> String {
        let (wall, cpu) = (duration(self.outcome.wall), duration(self.outcome.cpu));
        match self.ns_per_particle_step() {
            Some(ns) => format!("{wall} ({cpu} CPU), {ns:.2} ns per particle-step on {}", self.threads()),
            None => format!("{wall} ({cpu} CPU), no steps"),
        }
    }

    fn threads(&self) -> String {
        if self.n_threads == 1 { "1 thread".to_owned() } else { format!("{} threads", self.n_threads) }
    }

    fn memory(&self) -> String {
        let state = format!("{} of particles", bytes(self.outcome.state_bytes));
        self.peak_memory.map_or(state.clone(), |peak| format!("{state}, peak {}", bytes(peak)))
    }

    fn ns_per_particle_step(&self) -> Option<f64> {
        let n = self.outcome.n_particles as f64 * self.outcome.n_steps as f64;
        (n > 0.0).then(|| 1e9 * self.outcome.loop_wall / n)
    }

    /// One object on one line.
    pub(crate) fn json(&self) -> String {
        let summary = JsonSummary {
            results: self.folder.display().to_string(),
            figure: self.figure.map(|figure| figure.display().to_string()),
            plan_hash: self.plan_hash,
            particles: self.outcome.n_particles,
            steps: self.outcome.n_steps,
            wall: self.outcome.wall,
            loop_wall: self.outcome.loop_wall,
            cpu: self.outcome.cpu,
            compile_wall: self.compile_wall,
            write_wall: self.write_wall,
            ns_per_particle_step: self.ns_per_particle_step(),
            mass_defect: self.outcome.worst_defect(),
            threads: self.n_threads,
            state_bytes: self.outcome.state_bytes,
            peak_memory: self.peak_memory,
            errors: self.errors.iter().map(JsonError::new).collect(),
            measures: self.measures.iter().map(JsonMeasure::new).collect(),
            error_bars: self.error_bars.map(ErrorBars::json),
        };
        serde_json::to_string(&summary).expect("strings and numbers serialise") + "\n"
    }
}

fn error_cells(row: &ErrorRow) -> Vec<String> {
    let time = row.t.map_or("all".to_owned(), |t| format!("{} s", significant_time(t)));
    let mut cells = vec![row.reference.clone(), output_name(row), time];
    let relative = row.relative;
    let norms =
        [relative.map(|n| n.l1), relative.map(|n| n.l2), relative.map(|n| n.linf), relative_noise(row)];
    cells.extend(norms.map(|norm| shown(norm, 3)));
    cells.extend([shown(Some(row.norms.rmse), 3), row.unit.clone()]);
    cells
}

/// A number, or a dash where there is none.
fn shown(value: Option<f64>, n_digits: usize) -> String {
    value.filter(|value| value.is_finite()).map_or("–".to_owned(), |value| significant(value, n_digits))
}

/// The noise divided by the same norm of the reference as L2.
fn relative_noise(row: &ErrorRow) -> Option<f64> {
    let reference = row.norms.l2 / row.relative?.l2;
    row.noise.map(|noise| noise / reference)
}

fn output_name(row: &ErrorRow) -> String {
    let pair = row.species_b.as_ref().map(|b| format!(",{b}")).unwrap_or_default();
    format!("{} {}{pair}", row.kind, row.species_a)
}

/// Times are as the user wrote them, give or take a rounding of the unit.
fn significant_time(t: f64) -> String {
    let rounded = (t * 1e6).round() / 1e6;
    if rounded == 0.0 { significant(t, 6) } else { rounded.to_string() }
}

#[derive(Serialize)]
struct JsonSummary<'a> {
    results: String,
    figure: Option<String>,
    plan_hash: &'a str,
    particles: u64,
    steps: u64,
    wall: f64,
    loop_wall: f64,
    cpu: f64,
    compile_wall: f64,
    write_wall: f64,
    ns_per_particle_step: Option<f64>,
    mass_defect: f64,
    threads: usize,
    state_bytes: u64,
    peak_memory: Option<u64>,
    errors: Vec<JsonError<'a>>,
    measures: Vec<JsonMeasure<'a>>,
    /// Only if they were asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    error_bars: Option<Vec<JsonBar<'a>>>,
}

/// Norms and noise relative to the reference; null where that is zero.
#[derive(Serialize)]
struct JsonError<'a> {
    reference: &'a str,
    kind: &'a str,
    species: Vec<&'a str>,
    t: Option<f64>,
    l1: Option<f64>,
    l2: Option<f64>,
    linf: Option<f64>,
    noise: Option<f64>,
    /// Absolute, in `unit`.
    rmse: f64,
    unit: &'a str,
}

impl<'a> JsonError<'a> {
    fn new(row: &'a ErrorRow) -> Self {
        Self {
            reference: &row.reference,
            kind: &row.kind,
            species: std::iter::once(&*row.species_a).chain(row.species_b.as_deref()).collect(),
            t: row.t,
            l1: row.relative.map(|norms| norms.l1),
            l2: row.relative.map(|norms| norms.l2),
            linf: row.relative.map(|norms| norms.linf),
            noise: relative_noise(row).filter(|noise| noise.is_finite()),
            rmse: row.norms.rmse,
            unit: &row.unit,
        }
    }
}

#[derive(Serialize)]
struct JsonMeasure<'a> {
    name: &'a str,
    unit: &'a str,
    value: Option<f64>,
}

impl<'a> JsonMeasure<'a> {
    fn new(measure: &'a Value) -> Self {
        Self { name: &measure.name, unit: &measure.unit, value: measure.value }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use lamella::table::Norms;

    fn error(t: Option<f64>, relative: Option<f64>) -> ErrorRow {
        let norms = Norms { l1: 1.0, l2: 1.0, linf: 1.0, rmse: 1.0 };
        let relative = relative.map(|l2| Norms { l2, ..norms });
        ErrorRow {
            point: 0,
            replicate: 0,
            t,
            reference: "limit".to_owned(),
            output: 0,
            kind: "covariance".to_owned(),
            species_a: "A".to_owned(),
            species_b: Some("B".to_owned()),
            n: 300,
            n_empty: 0,
            noise: None,
            norms,
            relative,
            unit: "mol/m^3".to_owned(),
        }
    }

    fn outcome() -> Outcome {
        Outcome {
            labour: lamella::chemistry::Work::default(),
            n_steps: 755,
            n_particles: 1_000_000,
            mass_defect: vec![1e-15, 3e-15],
            loop_wall: 3.775,
            wall: 4.0,
            cpu: 7.9,
            state_bytes: 16_000_000,
            flow: None,
        }
    }

    fn summary<'a>(outcome: &'a Outcome, errors: &'a [ErrorRow], measures: &'a [Value]) -> Summary<'a> {
        Summary {
            folder: Path::new("results/gramling"),
            figure: None,
            plan_hash: "ab12",
            outcome,
            errors,
            measures,
            error_bars: None,
            n_threads: 2,
            peak_memory: Some(40_000_000),
            compile_wall: 0.01,
            write_wall: 0.05,
        }
    }

    #[test]
    fn the_text_has_errors_time_mass_and_place() {
        let outcome = outcome();
        let errors = [error(Some(619.0), Some(0.004567)), error(None, None)];
        let shown = summary(&outcome, &errors, &[]).text();
        for part in [
            "619 s",
            "all",
            "–",
            "5.00 ns per particle-step",
            "3.0e-15 relative",
            "peak 40.0 MB",
            "results/gramling",
        ] {
            assert!(shown.contains(part), "{part} in\n{shown}");
        }
    }

    #[test]
    fn many_rows_are_cut_and_said_to_be() {
        let outcome = outcome();
        let errors = vec![error(Some(1.0), Some(0.1)); 45];
        assert!(summary(&outcome, &errors, &[]).text().contains("… and 5 rows more"));
    }

    #[test]
    fn the_json_has_the_same_numbers() {
        let outcome = outcome();
        let measures = [Value { name: "err".to_owned(), unit: "1".to_owned(), value: None }];
        let errors = [error(None, Some(0.5))];
        let json = summary(&outcome, &errors, &measures).json();
        let value: serde_json::Value = serde_json::from_str(&json).expect("JSON");
        assert_eq!(value["errors"][0]["l2"], 0.5);
        assert_eq!(value["errors"][0]["species"], serde_json::json!(["A", "B"]));
        assert_eq!(value["measures"][0]["value"], serde_json::Value::Null);
        assert_eq!(value["mass_defect"], 3e-15);
    }

    #[test]
    fn what_is_no_number_is_a_dash() {
        let outcome = outcome();
        let mut row = error(None, Some(f64::NAN));
        row.norms.rmse = f64::INFINITY;
        let value = |value| Value { name: "m".to_owned(), unit: "1".to_owned(), value };
        let measures = [value(None), value(Some(f64::INFINITY)), value(Some(f64::NAN))];
        let shown = summary(&outcome, &[row], &measures).text();
        assert!(!shown.contains("inf") && !shown.contains("NaN"), "{shown}");
        // L2 and RMSE of the row, its absent noise, and three measures.
        assert_eq!(shown.matches('–').count(), 6, "{shown}");
    }
}

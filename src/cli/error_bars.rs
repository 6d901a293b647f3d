//! `lamella run --error`: the trials beside a run, and the error bars in words.

use super::progress::Progress;
use super::run::{Watch, run_failed};
use super::text::{duration, significant};
use super::{Exit, Stopped, Terminal};
use lamella::diagnostic::{Diagnostic, codes};
use lamella::engine::snapshot::Snapshot;
use lamella::engine::{self, RunError, Starts};
use lamella::estimate::{self, Advice, Trials};
use lamella::flow::FlowSeries;
use lamella::plan::Plan;
use lamella::scenario::Scenario;
use lamella::table::ErrorBarRow;
use serde::Serialize;
use std::time::Instant;

/// More lines than this are in the results, not on the terminal.
const MAX_LINES: usize = 40;

/// Error bars and what they cost.
pub(crate) struct ErrorBars {
    pub(crate) rows: Vec<ErrorBarRow>,
    advice: Option<Advice>,
    /// Particle-steps of the trials, divided by those of the run, and wall seconds.
    cost: f64,
    wall: f64,
}

/// The flow of a plan: that of the run, as long as nothing of it is another.
pub(crate) type FlowOf<'a> = dyn Fn(&Plan) -> Result<Option<FlowSeries>, RunError> + 'a;

impl ErrorBars {
    /// Runs the trials one after the other.
    pub(crate) fn find(
        plan: &Plan,
        scenario: &Scenario,
        n_axes: usize,
        snapshots: &[Snapshot],
        (n_threads, flow_of): (usize, &FlowOf),
        (terminal, watch): (&Terminal, &Watch),
    ) -> Result<Self, Stopped> {
        let begin = Instant::now();
        let trials = Trials::of(plan);
        let cost = trials.cost(plan);
        terminal.remark(&format!("error bars: {} trials, {cost:.1} times the run", trials.trials.len()));
        let mut of_trials = Vec::new();
        let starts = Starts::default();
        for trial in &trials.trials {
            let progress = Progress::new(terminal, trial.plan.particles.count, trial.plan.time.n_steps);
            let watch = Watch { progress, interrupt: watch.interrupt };
            let settings = engine::Settings {
                threads: Some(n_threads),
                takes_half_draws: trial.takes_half_draws,
                flow: flow_of(&trial.plan).map_err(|error| run_failed(&error, scenario, plan))?,
                starts: Some(starts.clone()),
                ..engine::Settings::default()
            };
            let mut seen = Vec::new();
            let mut sink = |snapshot| {
                seen.push(snapshot);
                Ok::<(), RunError>(())
            };
            let outcome = engine::run(&trial.plan, &settings, &watch, &mut sink);
            watch.progress.finish();
            outcome.map_err(|error| run_failed(&error, scenario, plan))?;
            of_trials.push(seen);
        }
        let bars = estimate::bars(plan, &trials, snapshots, &of_trials)
            .map_err(|reason| Stopped::new(Exit::Failed, Diagnostic::error(codes::R105, reason)))?;
        Ok(Self {
            rows: estimate::rows(plan, n_axes, &bars),
            advice: estimate::advice(&bars),
            cost,
            wall: begin.elapsed().as_secs_f64(),
        })
    }

    /// A line for each bar, the cost, and what would help.
    pub(crate) fn text(&self) -> String {
        // Totals and γ have a bar at every time: the one over all times is shown.
        let is_shown = |row: &&ErrorBarRow| row.t.is_none() == matches!(&*row.kind, "total" | "mixing");
        let mut lines = vec!["expected errors, found without a reference (L2)".to_owned()];
        lines.extend(self.rows.iter().filter(is_shown).take(MAX_LINES).map(line));
        let n_more = self.rows.iter().filter(is_shown).count().saturating_sub(MAX_LINES);
        if n_more > 0 {
            lines.push(format!("… and {n_more} rows more in error_bars/"));
        }
        lines.push(format!("found in {}, {:.1} times the run", duration(self.wall), self.cost));
        if let Some(advice) = &self.advice {
            lines.push(format!(
                "most for its cost: {}, which makes errors {} times as large{}",
                advice.remedy.text(),
                significant(advice.factor, 2),
                if advice.cost < 1.5 { String::new() } else { format!(" in {} times the time", advice.cost) }
            ));
        }
        lines.into_iter().map(|line| line + "\n").collect()
    }

    pub(crate) fn json(&self) -> Vec<JsonBar<'_>> {
        self.rows.iter().map(JsonBar::new).collect()
    }
}

/// `profile AB at 1510 s: ±1.3 % (particles 1.1 %, step 0.6 %, bins 0.1 %)`, the largest source first.
fn line(row: &ErrorBarRow) -> String {
    let percent = |value: f64| match (row.relative, 100.0 * value / row.size) {
        (None, _) => significant(value, 2),
        (Some(_), share) if share > 0.0 && share < 0.01 => "under 0.01 %".to_owned(),
        (Some(_), share) => format!("{} %", significant(share, 2)),
    };
    let mut sources = vec![("particles", row.from_particles), ("step", row.from_step)];
    sources.extend(row.from_bins.map(|bins| ("bins", bins)));
    sources.sort_by(|a, b| b.1.total_cmp(&a.1));
    let mut sources: Vec<String> =
        sources.into_iter().map(|(name, value)| format!("{name} {}", percent(value))).collect();
    if row.from_bins.is_none() {
        sources.push("bins not tried".to_owned());
    }
    let pair = row.species_b.as_ref().map(|b| format!(",{b}")).unwrap_or_default();
    let time = row.t.map(|t| format!(" at {} s", (t * 1e6).round() / 1e6)).unwrap_or_default();
    format!("{} {}{pair}{time}: ±{} ({})", row.kind, row.species_a, percent(row.total), sources.join(", "))
}

/// A bar with its sources, all as L2 norms in SI; `relative` to the result.
#[derive(Serialize)]
pub(crate) struct JsonBar<'a> {
    kind: &'a str,
    species: Vec<&'a str>,
    t: Option<f64>,
    total: f64,
    from_step: f64,
    from_particles: f64,
    from_bins: Option<f64>,
    relative: Option<f64>,
    unit: &'a str,
}

impl<'a> JsonBar<'a> {
    fn new(row: &'a ErrorBarRow) -> Self {
        Self {
            kind: &row.kind,
            species: std::iter::once(&*row.species_a).chain(row.species_b.as_deref()).collect(),
            t: row.t,
            total: row.total,
            from_step: row.from_step,
            from_particles: row.from_particles,
            from_bins: row.from_bins,
            relative: row.relative,
            unit: &row.unit,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn row() -> ErrorBarRow {
        ErrorBarRow {
            point: 0,
            replicate: 0,
            t: Some(1510.0),
            output: 0,
            kind: "profile".to_owned(),
            species_a: "AB".to_owned(),
            species_b: None,
            n: 300,
            size: 10.0,
            total: 0.13,
            from_step: 0.06,
            from_particles: 0.11,
            from_bins: Some(0.01),
            relative: Some(0.013),
            unit: "mol/m^3".to_owned(),
        }
    }

    #[test]
    fn a_line_names_the_largest_source_first() {
        let expected = "profile AB at 1510 s: ±1.3 % (particles 1.1 %, step 0.60 %, bins 0.10 %)";
        assert_eq!(line(&row()), expected);
        let tiny = ErrorBarRow { from_step: 1e-5, from_bins: Some(0.0), ..row() };
        assert!(line(&tiny).ends_with("(particles 1.1 %, step under 0.01 %, bins 0 %)"), "{}", line(&tiny));
        let other = ErrorBarRow { t: None, from_bins: None, from_step: 0.2, ..row() };
        assert_eq!(line(&other), "profile AB: ±1.3 % (step 2.0 %, particles 1.1 %, bins not tried)");
    }

    #[test]
    fn a_bar_of_nothing_is_absolute() {
        let nothing = ErrorBarRow {
            size: 0.0,
            total: 0.0,
            from_step: 0.0,
            from_particles: 0.0,
            from_bins: Some(0.0),
            relative: None,
            ..row()
        };
        assert_eq!(line(&nothing), "profile AB at 1510 s: ±0 (particles 0, step 0, bins 0)");
    }
}

//! `lamella run`: a scene, all the way to tables, errors and a figure.

use super::data::keep_of_run;
use super::error_bars::ErrorBars;
use super::files::{is_stdin, unwritable, write_whole};
use super::interrupt::Interrupt;
use super::load;
use super::progress::Progress;
use super::summary::Summary;
use super::sweep_folder::{holds_sweep, other_kind};
use super::text::{bytes, duration, grouped};
use super::{CommandResult, Exit, Stopped, Terminal, facts, machine, record};
use lamella::Checked;
use lamella::diagnostic::{Diagnostic, codes};
use lamella::engine::snapshot::{Outcome, Snapshot, Values};
use lamella::engine::{self, Control, RunError};
use lamella::flow::{FlowSeries, Flows};
use lamella::measure::{self, Evaluated};
use lamella::plan::Plan;
use lamella::plan::compile::{Compiled, Options};
use lamella::report::{self, CRATE_FILE, Provenance, Start};
use lamella::scenario::{Scenario, Settings};
use lamella::source::Sources;
use lamella::stop;
use lamella::table::{Record, Summary as Written, Swept, TableError, Writer};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

const FIGURE: &str = "figure.svg";
/// Folder of solved flows, in that of results.
pub(crate) const CACHE: &str = "cache";

/// Run a scene and write its tables
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Scene file; `-` is standard input
    file: PathBuf,
    /// Folder of the results [default: results/<scene>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Set a parameter, or particles, step, bins; such as v=2cm/s, particles=1e5
    #[arg(long, value_name = "NAME=VALUE", value_parser = load::parse_setting)]
    set: Vec<(String, String)>,
    /// Root of all random numbers, instead of the scene's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Threads; the results are the same for any number [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Find an error bar for each output, without a reference; takes up to five times the time
    #[arg(long)]
    error: bool,
    /// Draw figure.svg in the folder of the results
    #[arg(long)]
    plot: bool,
    /// Of several used scenes the one that this sweep is of [default: that of the first sweep]
    #[arg(long, value_name = "NAME")]
    sweep: Option<String>,
    /// Leave nothing out
    #[arg(long)]
    no_passes: bool,
    /// Solve for the flow anew, and keep it for no later run
    #[arg(long)]
    no_cache: bool,
}

impl Arguments {
    fn folder(&self) -> PathBuf {
        self.out.clone().unwrap_or_else(|| Path::new("results").join(scene_name(&self.file)))
    }

    fn n_threads(&self) -> usize {
        self.threads.map_or_else(machine::n_threads, usize::from)
    }
}

/// The file's name without its ending.
pub(crate) fn scene_name(file: &Path) -> String {
    if is_stdin(file) {
        return "stdin".to_owned();
    }
    file.file_stem().map_or_else(|| "scene".to_owned(), |stem| stem.to_string_lossy().into_owned())
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> CommandResult {
    let begin = Instant::now();
    let settings = Settings {
        set: arguments.set.clone(),
        seed: arguments.seed,
        sweep: arguments.sweep.clone(),
        ..Settings::default()
    };
    let checked = load::load(&arguments.file, &settings, arguments.no_passes)?;
    let asked = Asked {
        name: scene_name(&arguments.file),
        folder: arguments.folder(),
        n_threads: arguments.n_threads(),
        wants: Wants {
            figure: arguments.plot,
            error_bars: arguments.error,
            cache: (!arguments.no_cache).then(|| arguments.folder().join(CACHE)),
        },
        settings: arguments.set.clone(),
        file: Some(arguments.file.clone()),
        begin,
    };
    run_checked(checked, asked, terminal)
}

/// Runs texts that are no file of the user's, as they were run once.
pub(crate) fn run_sources(
    sources: Sources,
    name: &str,
    settings: &Settings,
    folder: &Path,
    n_threads: usize,
    wants: Wants,
    terminal: &Terminal,
) -> CommandResult {
    let begin = Instant::now();
    let options = Options { memory: machine::available_memory(), ..Options::default() };
    let checked = lamella::check(sources, settings, &options);
    let folder = folder.to_path_buf();
    let name = name.to_owned();
    let asked = Asked { name, folder, n_threads, wants, settings: settings.set.clone(), file: None, begin };
    run_checked(checked, asked, terminal)
}

/// What a run makes besides its tables.
#[derive(Debug, Clone)]
pub(crate) struct Wants {
    pub(crate) figure: bool,
    pub(crate) error_bars: bool,
    /// Where solved flows are found and kept.
    pub(crate) cache: Option<PathBuf>,
}

/// What a run is asked for besides its scene.
struct Asked {
    name: String,
    folder: PathBuf,
    n_threads: usize,
    wants: Wants,
    /// `--set name=value`
    settings: Vec<(String, String)>,
    /// Absent if it is none of the user's.
    file: Option<PathBuf>,
    begin: Instant,
}

fn run_checked(mut checked: Checked, asked: Asked, terminal: &Terminal) -> CommandResult {
    let interrupt = Interrupt::listen();
    if holds_sweep(&asked.folder) {
        return Err(other_kind(&asked.folder, "a sweep", "a run"));
    }
    terminal.diagnostics(&checked.diagnostics, &checked.sources);
    let (Some(compiled), Some(scenario)) = (checked.compiled.take(), checked.scenario.take()) else {
        return Ok(Exit::SceneWrong);
    };
    let compile_wall = asked.begin.elapsed().as_secs_f64();
    terminal.remark(&announcement(&compiled));
    if !compiled.left_out.is_empty() {
        terminal.diagnostics(&[compiled.left_out_note()], &checked.sources);
    }
    if let Some(folder) = &asked.wants.cache {
        checked.flows.keep_in(folder.clone());
    }
    let job = Job {
        flows: checked.flows.clone(),
        sources: &checked.sources,
        record: record::record(&checked, &scenario, &compiled, &asked.name),
        swept: record::swept(&scenario),
        folder: asked.folder,
        n_threads: asked.n_threads,
        wants: asked.wants,
        settings: asked.settings,
        facts: facts::facts(asked.file.as_deref(), asked.n_threads),
        compile_wall,
        compiled,
        scenario,
    };
    match job.run(terminal, &interrupt) {
        // What has a place in the scene is shown with its lines.
        Err(stopped) if stopped.message.primary_span().is_some() => {
            terminal.diagnostics(&[*stopped.message], &checked.sources);
            Ok(stopped.exit)
        }
        ended => ended,
    }
}

/// What is about to happen, in one line.
fn announcement(compiled: &Compiled) -> String {
    let plan = &compiled.plan;
    format!(
        "{} particles, {} steps, about {} on one core, {} of particles",
        grouped(plan.particles.count),
        grouped(plan.time.n_steps),
        duration(compiled.cost.cpu_seconds),
        bytes(compiled.cost.state_bytes)
    )
}

/// A compiled scene with all that its run needs.
struct Job<'a> {
    flows: Arc<Flows>,
    /// What flows and tables are read from; kept beside the tables of the run.
    sources: &'a Sources,
    compiled: Compiled,
    scenario: Scenario,
    record: Record,
    swept: Vec<Swept>,
    folder: PathBuf,
    n_threads: usize,
    wants: Wants,
    settings: Vec<(String, String)>,
    /// Of machine, compiler and repository.
    facts: Vec<(String, String)>,
    compile_wall: f64,
}

/// What a run has found, before anything of it has a name on disk.
struct Found {
    outcome: Outcome,
    snapshots: Vec<Snapshot>,
    evaluated: Evaluated,
    error_bars: Option<ErrorBars>,
    started: i64,
}

impl Job<'_> {
    fn run(&self, terminal: &Terminal, interrupt: &Interrupt) -> CommandResult {
        let mut writer =
            Writer::create(&self.folder, &self.compiled.plan, &self.record).map_err(table_failed)?;
        let found = self.simulate(&mut writer, terminal, interrupt)?;
        writer.error_bars(found.error_bars.as_ref().map(|bars| bars.rows.clone()).unwrap_or_default());
        let begin = Instant::now();
        let figure = self.wants.figure.then(|| {
            report::figure(&self.compiled.plan, &self.record, &found.snapshots, &found.evaluated.curves)
        });
        let errors = report::error_rows(&self.compiled.plan, self.record.n_axes, &found.evaluated.errors);
        let row = self.point(&found);
        let written = writer.finish(vec![row], &errors).map_err(table_failed)?;
        let figure_path = self.folder.join(FIGURE);
        match &figure {
            Some(figure) => write_whole(&figure_path, figure)?,
            // A figure of an earlier run must not stand beside the tables of this one.
            None => drop(std::fs::remove_file(&figure_path)),
        }
        let data = keep_of_run(&self.folder, self.sources)?;
        self.write_crate(found.started, &written, data)?;
        if self.wants.cache.as_ref() == Some(&self.folder.join(CACHE)) {
            self.flows.forget_others();
        }
        let measures = record::measures(&found.evaluated);
        let summary = Summary {
            folder: &self.folder,
            figure: figure.is_some().then_some(figure_path.as_path()),
            plan_hash: &self.compiled.hash,
            outcome: &found.outcome,
            errors: &errors,
            measures: &measures,
            error_bars: found.error_bars.as_ref(),
            n_threads: self.n_threads,
            peak_memory: machine::peak_memory(),
            compile_wall: self.compile_wall,
            write_wall: written.write_wall.max(begin.elapsed().as_secs_f64()),
        };
        if !terminal.is_quiet() {
            terminal.product(&if terminal.is_json() { summary.json() } else { summary.text() })?;
        }
        Ok(Exit::Done)
    }

    /// Tells where the tables come from.
    fn write_crate(&self, started: i64, written: &Written, data: Vec<String>) -> Result<(), Stopped> {
        let version = self.record.version.clone();
        let figure = self.wants.figure.then(|| FIGURE.to_owned());
        let provenance = Provenance {
            scene_name: &self.record.scene_name,
            title: self.record.title.as_deref(),
            citations: &self.record.citations,
            plan_hash: &self.compiled.hash,
            sweep: None,
            settings: &self.settings,
            seed: self.compiled.plan.seed,
            starts: &[Start { version, started, facts: self.facts.clone() }],
            started: Some(started),
            finished: Some(machine::now()),
            failure: None,
            files: written.files.iter().map(|file| file.name.clone()).chain(figure).chain(data).collect(),
        };
        let text =
            provenance.to_json().map_err(|reason| unwritable(&self.folder.join(CRATE_FILE), &reason))?;
        write_whole(&self.folder.join(CRATE_FILE), &text)
    }

    /// Runs the engine; snapshots go to the writer, and stay here if something is computed from them.
    fn simulate(
        &self,
        writer: &mut Writer,
        terminal: &Terminal,
        interrupt: &Interrupt,
    ) -> Result<Found, Stopped> {
        let plan = &self.compiled.plan;
        let started = machine::now();
        let progress = Progress::new(terminal, plan.particles.count, plan.time.n_steps);
        let watch = Watch { progress, interrupt };
        let mut snapshots = Vec::new();
        let mut refusal = None;
        let mut of_cells = None;
        let mut sink = |snapshot: Snapshot| {
            writer.write(&snapshot).map_err(|error| {
                let text = error.to_string();
                refusal = Some(error);
                RunError::Sink(text)
            })?;
            if !matches!(snapshot.values, Values::Particles { .. }) {
                snapshots.push(snapshot);
            }
            Ok(())
        };
        let outcome = self.flow_of(plan).and_then(|flow| {
            of_cells = flow.clone().filter(|_| plan.writes_flow);
            let threads = Some(self.n_threads);
            let settings = engine::Settings { threads, flow, ..engine::Settings::default() };
            engine::run(plan, &settings, &watch, &mut sink)
        });
        watch.progress.finish();
        let outcome = outcome.map_err(|error| {
            refusal.map_or_else(|| run_failed(&error, &self.scenario, plan), table_failed)
        })?;
        if let Some(flow) = of_cells {
            writer.flow(flow.flow(0).clone());
        }
        let evaluated = measure::evaluate(plan, &self.compiled.evaluation, &snapshots, &outcome)
            .map_err(measuring_failed)?;
        let find_bars = || {
            let (n_axes, followed) = (self.record.n_axes, (terminal, &watch));
            let flow_of = &|plan: &Plan| self.flow_of(plan);
            ErrorBars::find(plan, &self.scenario, n_axes, &snapshots, (self.n_threads, flow_of), followed)
        };
        let error_bars = self.wants.error_bars.then(find_bars).transpose()?;
        Ok(Found { outcome, snapshots, evaluated, error_bars, started })
    }

    fn flow_of(&self, plan: &Plan) -> Result<Option<FlowSeries>, RunError> {
        self.flows.of(plan, self.sources).map_err(|error| RunError::Flow(error.to_string()))
    }

    fn point(&self, found: &Found) -> lamella::table::PointRow {
        let errors = report::error_values(&self.compiled.plan, self.record.n_axes, &found.evaluated.errors);
        let values = errors.into_iter().chain(record::measures(&found.evaluated)).collect();
        let mut row = record::point(&self.compiled, self.swept.clone(), &found.outcome, values);
        row.compile_wall = self.compile_wall;
        row.threads = u32::try_from(self.n_threads).unwrap_or(u32::MAX);
        row.started = found.started;
        row
    }
}

/// What the engine is watched by.
pub(super) struct Watch<'a> {
    pub(super) progress: Progress<'a>,
    pub(super) interrupt: &'a Interrupt,
}

impl Control for Watch<'_> {
    fn step_done(&self, step: u64, _n_steps: u64) {
        self.progress.step_done(step);
    }

    fn is_cancelled(&self) -> bool {
        self.interrupt.is_requested()
    }
}

fn table_failed(error: TableError) -> Stopped {
    Stopped::new(Exit::Failed, Diagnostic::error(codes::F103, error.to_string()))
}

/// Checks refuse all of it that a scene shows; the run may still find more.
fn measuring_failed(reason: String) -> Stopped {
    Stopped::new(Exit::Failed, Diagnostic::error(codes::R105, reason))
}

pub(super) fn run_failed(error: &RunError, scenario: &Scenario, plan: &Plan) -> Stopped {
    let exit = if *error == RunError::Cancelled { Exit::Interrupted } else { Exit::Failed };
    Stopped::new(exit, stop::message(error, scenario, plan))
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = "lamella 1\nspecies A\ndomain line x = 0 m .. 1 m\nboundary left, right reflect\n\
        initial A = 1 mol/L/m * x\nparticles fluid 1\nrun to 1 s, step 1 s\noutput total A at t = 1 s\n";

    #[test]
    fn every_failure_of_a_run_has_its_code_exit_and_line() {
        let sources = Sources::single("s.lam".to_owned(), SCENE.to_owned());
        let checked = lamella::check(sources, &Settings::default(), &Options::default());
        let (scenario, compiled) = (checked.scenario.expect("right"), checked.compiled.expect("right"));
        let of = |error: RunError| {
            let stopped = run_failed(&error, &scenario, &compiled.plan);
            let line = stopped.message.primary_span().map(|span| checked.sources.line_column(span).0);
            (stopped.message.code.0, stopped.exit, line)
        };
        assert_eq!(of(RunError::Cancelled), ("R101", Exit::Interrupted, None));
        let lost = RunError::NonFinitePosition { step: 1, particle: 2 };
        assert_eq!(of(lost), ("R102", Exit::Failed, Some(7)));
        assert_eq!(of(RunError::OutOfMemory { bytes: 1 }), ("R103", Exit::Failed, Some(6)));
        assert_eq!(of(RunError::Plan("two".to_owned())), ("R104", Exit::Failed, None));
        assert_eq!(of(RunError::Sink("full".to_owned())), ("F103", Exit::Failed, None));
        let kind = lamella::plan::OutputKind::Total;
        let overflow = RunError::NonFiniteOutput { t: 1.0, kind, quantity: "A".to_owned() };
        assert_eq!(of(overflow), ("R102", Exit::Failed, Some(8)));
        let below = |step| RunError::NegativeConcentration {
            step,
            particle: 0,
            component: "A".to_owned(),
            value: -1.0,
        };
        assert_eq!(of(below(0)), ("R102", Exit::Failed, Some(5)));
        assert_eq!(of(below(1)), ("R102", Exit::Failed, Some(2)));
        let why = lamella::chemistry::Why::TooManySteps { t: 0.1, tried: 7, share: 0.1 };
        let slow = RunError::Chemistry { step: 1, particle: 0, what: "slow".to_owned(), why };
        assert_eq!(of(slow), ("R106", Exit::Failed, Some(7)));
        let why = lamella::chemistry::Why::NotFinite { component: 0, reaction: None };
        let wild = RunError::Chemistry { step: 1, particle: 0, what: "wild".to_owned(), why };
        assert_eq!(of(wild), ("R107", Exit::Failed, Some(2)));
        let stopped = measuring_failed("The measure `m` has no value.".to_owned());
        assert_eq!((stopped.message.code.0, stopped.exit), ("R105", Exit::Failed));
    }

    #[test]
    fn results_are_named_by_the_scene() {
        assert_eq!(scene_name(Path::new("a/b.c.lam")), "b.c");
        assert_eq!(scene_name(Path::new("-")), "stdin");
    }
}

//! `lamella sweep`: all points of a sweep, resumed where an earlier start stopped, as one set of tables.

use super::interrupt::Interrupt;
use super::run::{CACHE, scene_name};
use super::sweep_folder::{Folder, Shard, gather_and_tell};
use super::text::{duration, grouped};
use super::{CommandResult, Exit, Stopped, Terminal, facts, load, machine};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use lamella::diagnostic::{Diagnostic, codes};
use lamella::sweep::frame::Replicate;
use lamella::sweep::run::{Ending, Settings as RunSettings, Store, Surroundings, Tally, Watch};
use lamella::sweep::{Journal, Points, run as run_sweep};
use std::io::IsTerminal;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Run all points of a sweep, or of all sweeps of a scene; what is there already is not run again
#[derive(clap::Args, Clone)]
pub(crate) struct Arguments {
    /// Scene file
    file: PathBuf,
    /// Name of the sweep, if the scene has several [default: one after another]
    name: Option<String>,
    /// Sweep an axis without a `sweep` statement, such as step=1s,2s,4s
    #[arg(long, value_name = "AXIS=VALUES")]
    over: Vec<String>,
    /// Replicates of each point, with --over
    #[arg(long, value_name = "N", requires = "over")]
    replicates: Option<u32>,
    /// Folder of the results; of several sweeps, of a folder for each [default: results/<scene>-<sweep>]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Set a parameter at every point, such as v=2cm/s
    #[arg(long, value_name = "NAME=VALUE", value_parser = load::parse_setting)]
    set: Vec<(String, String)>,
    /// Root of all random numbers, instead of the sweep's
    #[arg(long, value_name = "N")]
    seed: Option<u64>,
    /// Threads; the results are the same for any number [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Stop at the first point that fails
    #[arg(long)]
    fail_fast: bool,
    /// Run again what failed, and nothing else
    #[arg(long)]
    retry_failed: bool,
    /// Run one share of the points, such as 0/4; `lamella gather` makes the tables
    #[arg(long, value_name = "K/N")]
    shard: Option<Shard>,
    /// Solve for flows anew, and keep them for no later start
    #[arg(long)]
    no_cache: bool,
}

impl Arguments {
    fn folder(&self, loaded: &load::Sweep) -> PathBuf {
        if let Some(out) = &self.out {
            return out.clone();
        }
        let sweep = &loaded.scene.sweep;
        let name = match self.over.is_empty() {
            true => format!("{}-{}", scene_name(&self.file), sweep.name),
            // Axes of the command line have no name of their own.
            false => {
                let axes = sweep.groups.iter().flatten().map(|axis| axis.target.name());
                let axes: Vec<&str> = axes.collect();
                format!("{}-over-{}", scene_name(&self.file), axes.join("-"))
            }
        };
        Path::new("results").join(name)
    }
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> CommandResult {
    if arguments.name.is_none() && arguments.over.is_empty() && !super::files::is_stdin(&arguments.file) {
        let names = load::names_of_sweeps(&arguments.file)?;
        if names.len() > 1 {
            return run_all(arguments, &names, terminal);
        }
    }
    run_one(arguments, terminal)
}

/// All sweeps of a scene, one after another: points that fail are no reason to leave the next sweep out, but an end of
/// the user's or of the disk is.
fn run_all(arguments: &Arguments, names: &[String], terminal: &Terminal) -> CommandResult {
    let mut worst = Exit::Done;
    for name in names {
        terminal.remark(&format!("sweep `{name}`"));
        let out = arguments.out.as_ref().map(|out| out.join(name));
        let own = Arguments { name: Some(name.clone()), out, ..arguments.clone() };
        match run_one(&own, terminal)? {
            Exit::Done => {}
            Exit::SceneWrong => return Ok(Exit::SceneWrong),
            other => worst = other,
        }
        if worst != Exit::Done && arguments.fail_fast {
            break;
        }
    }
    Ok(worst)
}

fn run_one(arguments: &Arguments, terminal: &Terminal) -> CommandResult {
    let interrupt = Interrupt::listen();
    let over = (!arguments.over.is_empty())
        .then(|| load::Over { axes: &arguments.over, replicates: arguments.replicates });
    let settings = lamella::scenario::Settings {
        set: arguments.set.clone(),
        seed: arguments.seed,
        ..lamella::scenario::Settings::default()
    };
    let loaded =
        load::load_sweep(&arguments.file, arguments.name.as_deref(), over.as_ref(), &settings, terminal)?;
    let Some(loaded) = loaded else { return Ok(Exit::SceneWrong) };
    let out = arguments.folder(&loaded);
    let threads = arguments.threads.map_or_else(machine::n_threads, usize::from);
    let pool = pool(threads)?;
    let points = plan_points(&loaded, &pool)?;
    if points.is_empty() {
        return Err(nothing_to_run(&points));
    }
    let shard = arguments.shard.unwrap_or_default();
    let mut folder = Folder::open(&out, shard)?;
    folder.must_hold(&loaded, &out)?;
    if !arguments.no_cache {
        loaded.scene.flows.keep_in(out.join(CACHE));
    }
    let session = loaded.session(machine::now(), facts::facts(Some(&arguments.file), threads));
    super::data::keep_of_sweep(&out, &loaded.scene.sources)?;
    let session = folder.journal.add_session(session).map_err(|error| failed(&error))?;
    announce(&points, &folder, terminal);
    if loaded.compiled.plan.writes_flow {
        terminal.remark("the cells of flows are written by `run` and `repro`, not by a sweep");
    }
    let watch = Progress::new(terminal, &interrupt, &out, &loaded, &points);
    let journal = Mutex::new(folder.journal);
    let settings = RunSettings {
        threads,
        memory: machine::available_memory().map(|bytes| bytes / 5 * 4),
        is_fail_fast: arguments.fail_fast,
        is_retry_only: arguments.retry_failed,
        shard: (shard.number, shard.of),
    };
    let around = surroundings();
    let store = Store { journal: &journal, others: &folder.others };
    let ended = run_sweep::run(&loaded.scene, &points, &store, session, &settings, &around, &watch);
    watch.finish();
    let (ending, tally) = ended.map_err(|error| failed(&error))?;
    folder.journal = journal.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    forget_failures(&out, &folder);
    tell(&tally, &ending, &out, terminal);
    match ending {
        Ending::Interrupted => {
            return Err(interrupted());
        }
        Ending::Failed => return Ok(Exit::Failed),
        Ending::Complete => {}
    }
    if shard.of > 1 {
        terminal
            .remark(&format!("this was shard {shard}; `lamella gather {}` makes the tables", out.display()));
        return Ok(if tally.n_failed > 0 { Exit::Failed } else { Exit::Done });
    }
    let journals: Vec<&Journal> = std::iter::once(&folder.journal).chain(&folder.others).collect();
    pool.install(|| gather_and_tell(&loaded, &points, &journals, &out, terminal))
}

pub(crate) fn pool(threads: usize) -> Result<rayon::ThreadPool, Stopped> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| Stopped::new(Exit::Failed, Diagnostic::error(codes::R103, error.to_string())))
}

/// All points of a sweep, unless somebody does not want to wait for them.
pub(crate) fn plan_points(loaded: &load::Sweep, pool: &rayon::ThreadPool) -> Result<Points, Stopped> {
    let interrupt = Interrupt::listen();
    pool.install(|| Points::of(&loaded.scene, &|| interrupt.is_requested())).ok_or_else(interrupted)
}

pub(crate) fn interrupted() -> Stopped {
    let message = Diagnostic::error(codes::R101, "the sweep was interrupted")
        .note("what was complete is kept: the same command goes on from there");
    Stopped::new(Exit::Interrupted, message)
}

fn nothing_to_run(points: &Points) -> Stopped {
    let n = points.n_skipped;
    let message = Diagnostic::error(codes::F127, "the sweep has no point")
        .found(format!("{n} combinations, all of them skipped"))
        .expected("one or more points for which no `skip` holds");
    Stopped::new(Exit::SceneWrong, message)
}

pub(crate) fn failed(error: &dyn std::fmt::Display) -> Stopped {
    Stopped::new(Exit::Failed, Diagnostic::error(codes::F103, error.to_string()))
}

pub(crate) fn surroundings() -> Surroundings {
    Surroundings {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        host: machine::host(),
        now: machine::now,
        peak_memory: machine::peak_memory,
        fault_every: std::env::var("LAMELLA_FAULT_EVERY").ok().and_then(|text| text.parse().ok()),
    }
}

fn announce(points: &Points, folder: &Folder, terminal: &Terminal) {
    let n_known: usize = folder.others.iter().map(Journal::len).sum::<usize>() + folder.journal.len();
    let skipped =
        if points.n_skipped > 0 { format!(", {} skipped", grouped(points.n_skipped)) } else { String::new() };
    let known = match n_known {
        0 => String::new(),
        n => format!("; {} replicates are recorded already", grouped(n as u64)),
    };
    terminal.remark(&format!("{} points{skipped}{known}", grouped(points.len() as u64)));
    for (from, to) in &folder.journal.damaged {
        terminal
            .remark(&format!("bytes {from} to {to} of the journal are damaged: what stood there runs again"));
    }
    let refused = points.list.iter().filter(|point| point.refusal.is_some()).count();
    if refused > 0 {
        terminal.remark(&format!("{refused} points are refused before they run; their rows say why"));
    }
}

/// Takes away the logs of failures that have ended well since.
fn forget_failures(out: &Path, folder: &Folder) {
    let failed = out.join("failed");
    for entry in std::fs::read_dir(&failed).into_iter().flatten().flatten() {
        let key = lamella::sweep::key_of(&entry.file_name().to_string_lossy());
        let is_done = key.and_then(|key| folder.journal.entry(&key)).is_some_and(|entry| entry.is_done());
        if is_done {
            let _ = std::fs::remove_dir_all(entry.path());
        }
    }
    // Fails, as it should, if anything is left inside.
    let _ = std::fs::remove_dir(&failed);
}

fn tell(tally: &Tally, ending: &Ending, out: &Path, terminal: &Terminal) {
    let run = format!("{} replicates run", grouped(tally.n_done));
    let reused =
        if tally.n_reused > 0 { format!(", {} known", grouped(tally.n_reused)) } else { String::new() };
    let left =
        if tally.n_left > 0 { format!(", {} left alone", grouped(tally.n_left)) } else { String::new() };
    let bad = match tally.n_failed {
        0 => String::new(),
        n => format!(", {} failed: see {}", grouped(n), out.join("failed").display()),
    };
    let end = if matches!(ending, Ending::Failed) { "; stopped at the first failure" } else { "" };
    terminal.remark(&format!("{run}{reused}{left}{bad}{end}"));
}

const BAR_PERIOD: Duration = Duration::from_millis(100);
const LINE_PERIOD: Duration = Duration::from_secs(10);

/// Shows how far the whole sweep is, and writes down what failed.
struct Progress<'a> {
    terminal: &'a Terminal,
    interrupt: &'a Interrupt,
    out: &'a Path,
    loaded: &'a load::Sweep,
    points: &'a Points,
    bar: Option<ProgressBar>,
    started: Instant,
    shown: Mutex<Instant>,
}

impl<'a> Progress<'a> {
    fn new(
        terminal: &'a Terminal,
        interrupt: &'a Interrupt,
        out: &'a Path,
        loaded: &'a load::Sweep,
        points: &'a Points,
    ) -> Self {
        let has_bar = !terminal.is_quiet() && !terminal.is_json() && std::io::stderr().is_terminal();
        let bar = has_bar.then(|| {
            let bar = ProgressBar::with_draw_target(Some(1000), ProgressDrawTarget::stderr());
            if let Ok(style) = ProgressStyle::with_template("{bar:30} {msg}") {
                bar.set_style(style.progress_chars("━╸ "));
            }
            bar
        });
        let started = Instant::now();
        Self { terminal, interrupt, out, loaded, points, bar, started, shown: Mutex::new(started) }
    }

    fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

impl Watch for Progress<'_> {
    fn is_cancelled(&self) -> bool {
        self.interrupt.is_requested()
    }

    fn replicate_ended(&self, tally: &Tally) {
        let period = if self.bar.is_some() { BAR_PERIOD } else { LINE_PERIOD };
        let Ok(mut shown) = self.shown.try_lock() else { return };
        if shown.elapsed() < period {
            return;
        }
        *shown = Instant::now();
        let state = state(tally, self.started.elapsed().as_secs_f64());
        match &self.bar {
            Some(bar) => {
                let whole = tally.cost_done + tally.cost_left;
                bar.set_position((1000.0 * tally.cost_done / whole.max(f64::MIN_POSITIVE)) as u64);
                bar.set_message(state);
            }
            None => self.terminal.remark(&state),
        }
    }

    fn replicate_failed(&self, number: u32, replicate: &Replicate) {
        let message = replicate.row.error_message.clone().unwrap_or_default();
        let combination = self.points.list[number as usize].combination;
        let point = self.loaded.scene.name(combination);
        let command = self.loaded.command(combination, replicate.row.seed);
        let text = format!(
            "point {number} ({point}), replicate {}, seed {}\n{}: {message}\n\nrepeat it alone:\n{command}\n",
            replicate.row.replicate,
            replicate.row.seed,
            replicate.row.error_code.as_deref().unwrap_or_default(),
        );
        let folder = self.out.join("failed").join(&replicate.row.key);
        // The row has the message, too: a log that cannot be written is no reason to stop.
        let _ = std::fs::create_dir_all(&folder).and_then(|()| std::fs::write(folder.join("log.txt"), text));
        if self.bar.is_none() {
            self.terminal.remark(&format!("point {number} ({point}) failed: {message}"));
        }
    }
}

fn state(tally: &Tally, elapsed: f64) -> String {
    let n_ended = tally.n_done + tally.n_failed + tally.n_reused + tally.n_left;
    let bad =
        if tally.n_failed > 0 { format!(", {} failed", grouped(tally.n_failed)) } else { String::new() };
    let left = if tally.cost_done > 0.0 {
        format!(", {} left", duration(elapsed * tally.cost_left / tally.cost_done))
    } else {
        String::new()
    };
    format!("{} of {} replicates{bad}{left}", grouped(n_ended), grouped(tally.n_total))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_state_tells_what_is_left_by_cost() {
        let tally = Tally {
            n_total: 1000,
            n_done: 100,
            n_failed: 1,
            n_reused: 10,
            n_left: 0,
            cost_done: 2.0,
            cost_left: 6.0,
        };
        assert_eq!(state(&tally, 10.0), "111 of 1 000 replicates, 1 failed, 30 s left");
        assert_eq!(state(&Tally { n_total: 5, ..Tally::default() }, 1.0), "0 of 5 replicates");
    }
}

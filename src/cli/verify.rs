//! `lamella verify` and `lamella repro`: the same again, and the same bytes.

use super::interrupt::Interrupt;
use super::sweep::{failed, pool, surroundings};
use super::sweep_folder::{Which, open, point_of};
use super::text::grouped;
use super::why::{check_replicate, is_sweep};
use super::{CommandResult, Exit, Stopped, Terminal, load, machine, run as run_command};
use lamella::diagnostic::{Diagnostic, codes};
use lamella::engine::Control;
use lamella::scenario::Settings;
use lamella::source::Sources;
use lamella::sweep::replicate::Task;
use lamella::sweep::{Journal, Points};
use std::path::{Path, PathBuf};

/// Run results again and compare them, byte by byte
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Folder of a run or a sweep
    folder: PathBuf,
    /// Compare so many points of a sweep, spread over all of them [default: all]
    #[arg(long, value_name = "N")]
    sample: Option<usize>,
    /// Threads [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> CommandResult {
    let threads = arguments.threads.map_or_else(machine::n_threads, usize::from);
    if is_sweep(&arguments.folder) {
        return verify_sweep(&arguments.folder, arguments.sample, threads, terminal);
    }
    verify_run(&arguments.folder, threads, terminal)
}

struct Ask<'a>(&'a Interrupt);

impl Control for Ask<'_> {
    fn step_done(&self, _step: u64, _n_steps: u64) {}

    fn is_cancelled(&self) -> bool {
        self.0.is_requested()
    }
}

fn verify_sweep(folder: &Path, sample: Option<usize>, threads: usize, terminal: &Terminal) -> CommandResult {
    let interrupt = Interrupt::listen();
    let (journals, loaded) = open(folder)?;
    let points = super::sweep::plan_points(&loaded, &pool(threads)?)?;
    let n = sample.unwrap_or(points.len()).clamp(1, points.len().max(1));
    let (mut n_same, mut different) = (0_u64, Vec::new());
    for idx in 0..n.min(points.len()) {
        let number = (idx * points.len() / n) as u32;
        for (replicate, is_same) in compare(&loaded, &points, number, &journals, threads, &interrupt)? {
            if is_same { n_same += 1 } else { different.push(format!("{number}/{replicate}")) }
        }
    }
    if different.is_empty() {
        terminal.product(&format!("{} replicates run again: the same bytes\n", grouped(n_same)))?;
        return Ok(Exit::Done);
    }
    let shown: Vec<&str> = different.iter().take(10).map(String::as_str).collect();
    let text = format!(
        "{} of {} replicates are not the same again",
        different.len(),
        different.len() as u64 + n_same
    );
    let message = Diagnostic::error(codes::F123, text)
        .note(format!("points {}", shown.join(", ")))
        .help("another version or another machine than the one that ran them may be the reason");
    Err(Stopped::new(Exit::Failed, message))
}

/// Runs the recorded replicates of a point again.
fn compare(
    loaded: &load::Sweep,
    points: &Points,
    number: u32,
    journals: &[Journal],
    threads: usize,
    interrupt: &Interrupt,
) -> Result<Vec<(u32, bool)>, Stopped> {
    let combination = points.list[number as usize].combination;
    let Ok((scenario, compiled)) = loaded.scene.compile(combination) else { return Ok(Vec::new()) };
    let around = surroundings();
    let mut verdicts = Vec::new();
    for replicate in 0.. {
        let (plan, key) = loaded.scene.replicate(&compiled.plan, combination, replicate);
        let found = journals.iter().find_map(|journal| Some((journal, journal.entry(&key)?)));
        let Some((journal, entry)) = found else { break };
        if !entry.is_done() {
            continue;
        }
        let recorded = journal.replicate(entry).map_err(|error| failed(&error))?;
        let task = Task {
            scene: &loaded.scene,
            scenario: &scenario,
            compiled: &compiled,
            plan,
            key,
            combination,
            replicate,
            session: 0,
            compile_wall: 0.0,
            memory: None,
        };
        let Some(again) = task.run(&Ask(interrupt), threads.max(2), &around) else {
            let message = Diagnostic::error(codes::R101, "the comparison was interrupted");
            return Err(Stopped::new(Exit::Interrupted, message));
        };
        verdicts.push((replicate, again.has_bytes_of(&recorded)));
    }
    Ok(verdicts)
}

/// A run of its own: again into a temporary folder, and all data files compared.
fn verify_run(folder: &Path, threads: usize, terminal: &Terminal) -> CommandResult {
    let read = |name: &str| {
        std::fs::read_to_string(folder.join(name)).map_err(|_| {
            let text = format!("{} holds neither a run nor a sweep", folder.display());
            let message =
                Diagnostic::error(codes::F121, text).help("give the folder that `run` or `sweep` wrote to");
            Stopped::new(Exit::SceneWrong, message)
        })
    };
    let document = lamella::plan::document::origin(&read("plan.yaml")?).map_err(|reason| {
        Stopped::new(Exit::Failed, Diagnostic::error(codes::F121, format!("plan.yaml is {reason}")))
    })?;
    let settings =
        Settings { set: document.settings.clone(), seed: Some(document.seed), ..Settings::default() };
    let name = document.scene_name();
    let mut sources = Sources::single(format!("{name}.lam"), read("scene.lam")?);
    for (name, text) in document.used() {
        sources.add(name, text);
    }
    let again = tempfile::Builder::new()
        .prefix(".lamella-verify-")
        .tempdir_in(folder)
        .map_err(|error| failed(&format!("cannot make a folder in {}: {error}", folder.display())))?;
    let exit = run_command::run_sources(sources, &name, &settings, again.path(), threads, terminal)?;
    if exit != Exit::Done {
        return Ok(exit);
    }
    let different = different_files(folder, again.path()).map_err(|error| failed(&error))?;
    if different.is_empty() {
        terminal.product("run again: the same bytes in all data files\n")?;
        return Ok(Exit::Done);
    }
    let message = Diagnostic::error(codes::F123, "the results are not the same again")
        .note(format!("different: {}", different.join(", ")))
        .help("another version or another machine than the one that ran them may be the reason");
    Err(Stopped::new(Exit::Failed, message))
}

/// Data files that are not equal; facts of a run and figures are no data.
fn different_files(first: &Path, second: &Path) -> std::io::Result<Vec<String>> {
    let mut different = Vec::new();
    for entry in std::fs::read_dir(second)? {
        let entry = entry?;
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.path().is_dir() {
            for part in std::fs::read_dir(entry.path())? {
                let part = format!("{name}/{}", part?.file_name().to_string_lossy());
                compare_file(first, second, part, &mut different)?;
            }
        } else if name == "columns.parquet" {
            compare_file(first, second, name, &mut different)?;
        }
    }
    different.sort();
    Ok(different)
}

fn compare_file(
    first: &Path,
    second: &Path,
    name: String,
    different: &mut Vec<String>,
) -> std::io::Result<()> {
    let own = std::fs::read(first.join(&name)).unwrap_or_default();
    if own != std::fs::read(second.join(&name))? {
        different.push(name);
    }
    Ok(())
}

/// Run one point of a sweep alone, with all its tables and a figure
#[derive(clap::Args)]
pub(crate) struct ReproArguments {
    /// Folder of the sweep
    folder: PathBuf,
    /// Number of the point, with that of a replicate: 12 or 12/3
    point: Which,
    /// Folder of the results [default: FOLDER/repro/POINT-REPLICATE]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Threads [default: all cores]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
}

pub(crate) fn repro(arguments: &ReproArguments, terminal: &Terminal) -> CommandResult {
    let threads = arguments.threads.map_or_else(machine::n_threads, usize::from);
    let (_, loaded) = open(&arguments.folder)?;
    let points = super::sweep::plan_points(&loaded, &pool(threads)?)?;
    let point = point_of(&points, arguments.point)?;
    check_replicate(&loaded, arguments.point)?;
    let Which { point: number, replicate } = arguments.point;
    let seed = loaded.scene.seed(point.combination, replicate);
    let out = arguments
        .out
        .clone()
        .unwrap_or_else(|| arguments.folder.join("repro").join(format!("{number}-{replicate}")));
    terminal.remark(&format!("point {number}/{replicate} ({})", loaded.scene.name(point.combination)));
    terminal.remark(&format!("the same by hand: {}", loaded.command(point.combination, seed)));
    let mut set = loaded.scene.settings.set.clone();
    set.extend(loaded.scene.assignments(point.combination));
    let sweep = Some(loaded.scene.sweep.name.clone()).filter(|_| loaded.scene.sweep.of.is_some());
    let settings = Settings { set, seed: Some(seed), sweep, ..Settings::default() };
    let texts = loaded.scene.sources.files().filter(|(_, file)| !file.name.starts_with("--"));
    let mut sources = Sources::default();
    for (_, file) in texts {
        sources.add(file.name.clone(), file.text.clone());
    }
    run_command::run_sources(sources, &loaded.scene_name, &settings, &out, threads, terminal)
}

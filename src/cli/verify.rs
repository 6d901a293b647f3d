//! `lamella verify` and `lamella repro`: the same again, and the same bytes.

use super::data::restore_of_run;
use super::run::{CACHE, Wants};
use super::sweep::{failed, pool};
use super::sweep_folder::{Which, open, point_of};
use super::why::{check_replicate, is_sweep};
use super::{CommandResult, Exit, Stopped, Terminal, machine, run as run_command, verify_sweep};
use lamella::diagnostic::{Diagnostic, codes};
use lamella::report::SWEEP_FILE;
use lamella::scenario::Settings;
use lamella::source::Sources;
use std::path::{Path, PathBuf};

/// Folder of the files of numbers that the scene reads.
const KEPT: &str = "data";
/// Folder of the table that only `run --error` writes.
const ERROR_BARS: &str = "error_bars";

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
    /// Solve for the flow anew, too
    #[arg(long)]
    no_cache: bool,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> CommandResult {
    let threads = arguments.threads.map_or_else(machine::n_threads, usize::from);
    let cache = (!arguments.no_cache).then(|| arguments.folder.join(CACHE));
    if is_sweep(&arguments.folder) {
        return verify_sweep::verify(&arguments.folder, arguments.sample, (threads, cache), terminal);
    }
    if arguments.folder.join(SWEEP_FILE).exists() {
        let text =
            format!("{} holds the tables of a sweep without their journal", arguments.folder.display());
        let message = Diagnostic::error(codes::F121, text)
            .help("what was run stands in the folder `journal`: put it back, or run the sweep again");
        return Err(Stopped::new(Exit::SceneWrong, message));
    }
    verify_run(&arguments.folder, threads, cache, terminal)
}

/// A run of its own: again into a temporary folder, and all data files compared.
fn verify_run(folder: &Path, threads: usize, cache: Option<PathBuf>, terminal: &Terminal) -> CommandResult {
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
    restore_of_run(folder, &document.data, &mut sources)?;
    let again = tempfile::Builder::new()
        .prefix(".lamella-verify-")
        .tempdir_in(folder)
        .map_err(|error| failed(&format!("cannot make a folder in {}: {error}", folder.display())))?;
    // Error bars are data: they are found again where there are some. A figure is none.
    let wants = Wants { figure: false, error_bars: folder.join(ERROR_BARS).is_dir(), cache };
    let hushed = terminal.hushed();
    let exit = run_command::run_sources(sources, &name, &settings, again.path(), threads, wants, &hushed)?;
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
        if name == KEPT {
            // The run was made from these: they have been looked at.
            continue;
        }
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

/// Notes the file if `second` has other bytes than `first`, or `first` has none.
pub(super) fn compare_file(
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
    loaded.scene.sources.data().iter().for_each(|file| sources.add_data(file.clone()));
    let cache = Some(arguments.folder.join(CACHE));
    let wants = Wants { figure: true, error_bars: false, cache };
    run_command::run_sources(sources, &loaded.scene_name, &settings, &out, threads, wants, terminal)
}

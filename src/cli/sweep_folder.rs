//! The folder of a sweep: its journals, `gather` and `status`.

use super::files::write_whole;
use super::sweep::{failed, pool};
use super::text::grouped;
use super::{CommandResult, Exit, Stopped, Terminal, load, machine};
use lamella::diagnostic::{Diagnostic, codes};
use lamella::report::{CRATE_FILE, ExpectationOutcome, Provenance, SWEEP_FILE, Start};
use lamella::sweep::frame::Session;
use lamella::sweep::gather::{Gather, GatherError, Gathered};
use lamella::sweep::{Journal, JournalError, Points, manifest};
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// One share of the points: those whose number leaves `number` when divided by `of`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Shard {
    pub(crate) number: u32,
    pub(crate) of: u32,
}

impl Default for Shard {
    fn default() -> Self {
        Self { number: 0, of: 1 }
    }
}

impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "expected K/N with K from 0 to N - 1, such as 0/4".to_owned();
        let (number, of) = text.split_once('/').ok_or_else(wrong)?;
        let (number, of) = (number.parse().map_err(|_| wrong())?, of.parse().map_err(|_| wrong())?);
        if number < of && of <= 10_000 { Ok(Self { number, of }) } else { Err(wrong()) }
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// A point and one of its replicates, `12` or `12/3`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Which {
    pub(crate) point: u32,
    pub(crate) replicate: u32,
}

impl FromStr for Which {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = |_| "expected POINT or POINT/REPLICATE, such as 12 or 12/3".to_owned();
        let (point, replicate) = text.split_once('/').unwrap_or((text, "0"));
        Ok(Self { point: point.parse().map_err(wrong)?, replicate: replicate.parse().map_err(wrong)? })
    }
}

/// The point that is asked for, or how many there are.
pub(crate) fn point_of(points: &Points, which: Which) -> Result<&lamella::sweep::Point, Stopped> {
    points.list.get(which.point as usize).ok_or_else(|| {
        let message = Diagnostic::error(codes::F122, format!("the sweep has no point {}", which.point));
        let expected = match points.len() {
            0 => "a sweep with points".to_owned(),
            n => format!("0 to {}", n - 1),
        };
        Stopped::new(Exit::SceneWrong, message.found(which.point.to_string()).expected(expected))
    })
}

/// An open folder.
pub(crate) struct Folder {
    pub(crate) journal: Journal,
    /// Of other shards: what they have need not run.
    pub(crate) others: Vec<Journal>,
}

impl Folder {
    pub(crate) fn open(out: &Path, shard: Shard) -> Result<Self, Stopped> {
        if !holds_sweep(out) && out.join("points.parquet").is_file() {
            return Err(other_kind(out, "the results of a run", "a sweep"));
        }
        let name = format!("shard-{:04}-of-{:04}.journal", shard.number, shard.of);
        let journal = Journal::open(&out.join("journal").join(&name)).map_err(|error| failed(&error))?;
        let paths = journal_paths(out).into_iter().filter(|path| path.file_name() != Some(name.as_ref()));
        let others: Result<Vec<Journal>, JournalError> = paths.map(|path| Journal::look(&path)).collect();
        Ok(Self { journal, others: others.map_err(|error| failed(&error))? })
    }

    /// Refuses a folder that holds another sweep: its tables would be lost.
    pub(crate) fn must_hold(&self, loaded: &load::Sweep, out: &Path) -> Result<(), Stopped> {
        let sessions = self.others.iter().chain([&self.journal]).flat_map(|journal| &journal.sessions);
        let Some(newest) = sessions.max_by_key(|session| session.started) else { return Ok(()) };
        let name = |path: &str| super::run::scene_name(Path::new(path));
        let scene = newest.sources.first().map(|(path, _)| name(path)).unwrap_or_default();
        if newest.sweep == loaded.scene.sweep.name && scene == loaded.scene_name {
            return Ok(());
        }
        let message = Diagnostic::error(codes::F126, format!("{} holds another sweep", out.display()))
            .found(format!("`{}` of {scene}", newest.sweep))
            .expected(format!("`{}` of {}", loaded.scene.sweep.name, loaded.scene_name))
            .help("give another folder with `--out`, or remove this one");
        Err(Stopped::new(Exit::SceneWrong, message))
    }
}

/// True of a folder that a sweep has written to.
pub(crate) fn holds_sweep(folder: &Path) -> bool {
    !journal_paths(folder).is_empty() || folder.join(SWEEP_FILE).is_file()
}

/// Refuses a folder that holds a sweep, for a run, or a run, for a sweep.
pub(crate) fn other_kind(folder: &Path, holds: &str, asks: &str) -> Stopped {
    let message = Diagnostic::error(codes::F125, format!("{} holds {holds}", folder.display()))
        .expected(format!("a folder of its own for {asks}"))
        .help("give another folder with `--out`, or remove this one");
    Stopped::new(Exit::SceneWrong, message)
}

/// Files of journals, in the order of their names.
fn journal_paths(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder.join("journal")).into_iter().flatten().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "journal"));
    paths.sort();
    paths
}

/// All journals of a folder, in the order of their names.
pub(crate) fn journals(folder: &Path) -> Result<Vec<Journal>, Stopped> {
    let paths = journal_paths(folder);
    let journals: Result<Vec<Journal>, JournalError> = paths.iter().map(|path| Journal::look(path)).collect();
    let journals = journals.map_err(|error| failed(&error))?;
    if journals.iter().all(|journal| journal.sessions.is_empty()) {
        let message = Diagnostic::error(codes::F121, format!("{} holds no sweep", folder.display()))
            .help("give the folder that `lamella sweep` wrote to");
        return Err(Stopped::new(Exit::SceneWrong, message));
    }
    Ok(journals)
}

/// The newest session of all journals.
pub(crate) fn newest(journals: &[Journal]) -> Option<&Session> {
    journals.iter().flat_map(|journal| &journal.sessions).max_by_key(|session| session.started)
}

/// Makes the tables of a sweep from the journals of all its shards
#[derive(clap::Args)]
pub(crate) struct GatherArguments {
    /// Folder of the sweep
    folder: PathBuf,
}

pub(crate) fn gather(arguments: &GatherArguments, terminal: &Terminal) -> CommandResult {
    let (journals, loaded) = open(&arguments.folder)?;
    let pool = pool(machine::n_threads())?;
    let points = super::sweep::plan_points(&loaded, &pool)?;
    let journals: Vec<&Journal> = journals.iter().collect();
    pool.install(|| gather_and_tell(&loaded, &points, &journals, &arguments.folder, terminal))
}

/// The journals of a folder and the sweep of their newest session.
pub(crate) fn open(folder: &Path) -> Result<(Vec<Journal>, load::Sweep), Stopped> {
    let journals = journals(folder)?;
    let loaded = newest(&journals).map(|session| load::load_session(folder, session)).transpose()?.flatten();
    let loaded = loaded.ok_or_else(|| {
        let text = format!("the scene in the journal of {} cannot be read by this version", folder.display());
        Stopped::new(Exit::SceneWrong, Diagnostic::error(codes::F121, text))
    })?;
    Ok((journals, loaded))
}

pub(crate) fn gather_of<'a>(
    loaded: &'a load::Sweep,
    points: &'a Points,
    journals: &'a [&'a Journal],
) -> Gather<'a> {
    Gather {
        scene: &loaded.scene,
        points,
        journals,
        base: &loaded.compiled,
        record: &loaded.record,
        reports: &loaded.scenario.reports,
        scene_name: &loaded.scene_name,
        version: env!("CARGO_PKG_VERSION"),
        is_cancelled: &is_interrupted,
    }
}

fn is_interrupted() -> bool {
    super::interrupt::Interrupt::listen().is_requested()
}

/// Writes the tables and says what is in them.
pub(crate) fn gather_and_tell(
    loaded: &load::Sweep,
    points: &Points,
    journals: &[&Journal],
    out: &Path,
    terminal: &Terminal,
) -> CommandResult {
    let gather = gather_of(loaded, points, journals);
    let gathered = gather.write(out).map_err(|error| match &error {
        GatherError::Interrupted => super::sweep::interrupted(),
        GatherError::Journal(_) | GatherError::Table(_) | GatherError::Description(_) => failed(&error),
    })?;
    manifest::write(out, &gathered.files).map_err(|error| {
        failed(&format!("cannot write {}: {error}", out.join(manifest::MANIFEST).display()))
    })?;
    write_crate(loaded, journals, &gathered, out)?;
    let report = super::report::write(out)?;
    if !terminal.is_quiet() {
        let text = if terminal.is_json() {
            json(&gathered, out, &report.page)
        } else {
            summary(&gathered, out, &report.page)
        };
        terminal.product(&text)?;
    }
    let is_well = gathered.is_met() && gathered.n_failed == 0 && gathered.n_missing == 0;
    Ok(if is_well { Exit::Done } else { Exit::Failed })
}

/// Tells where the tables come from, by the sessions that ran what stands in them.
fn write_crate(
    loaded: &load::Sweep,
    journals: &[&Journal],
    gathered: &Gathered,
    out: &Path,
) -> Result<(), Stopped> {
    let session = |(journal, number): &(usize, u32)| journals.get(*journal)?.sessions.get(*number as usize);
    let mut sessions: Vec<&Session> = gathered.sessions.iter().filter_map(session).collect();
    if sessions.is_empty() {
        // All points were refused before they ran.
        sessions.extend(journals.iter().flat_map(|journal| &journal.sessions));
    }
    let start = |session: &Session| Start {
        version: session.version.clone(),
        started: session.started,
        facts: session.facts.clone(),
    };
    let starts = Start::merged(sessions.into_iter().map(start).collect());
    let missing = match (gathered.n_failed, gathered.n_missing) {
        (0, 0) => None,
        (failed, 0) => Some(format!("{failed} replicates or points failed")),
        (failed, missing) => Some(format!("{failed} replicates or points failed, {missing} are missing")),
    };
    let files = gathered.files.iter().map(|file| file.name.clone());
    let provenance = Provenance {
        scene_name: &loaded.scene_name,
        title: loaded.record.title.as_deref(),
        citations: &loaded.record.citations,
        plan_hash: &loaded.record.plan_hash,
        sweep: Some(&gathered.description),
        settings: &loaded.scene.settings.set,
        seed: loaded.scene.root_seed(),
        starts: &starts,
        started: gathered.started,
        finished: gathered.finished,
        failure: missing,
        files: files
            .chain([manifest::MANIFEST, "report.html", "report/", "journal/"].map(str::to_owned))
            .collect(),
    };
    let text = provenance.to_json().map_err(|reason| failed(&reason))?;
    write_whole(&out.join(CRATE_FILE), &text)
}

fn summary(gathered: &Gathered, out: &Path, report: &Path) -> String {
    let mut lines = vec![
        ("points", grouped(gathered.n_points)),
        ("replicates", format!("{} done, {} failed", grouped(gathered.n_done), grouped(gathered.n_failed))),
    ];
    if gathered.n_missing > 0 {
        lines.push(("missing", format!("{} points are not complete", grouped(gathered.n_missing))));
    }
    if gathered.n_imprecise > 0 {
        let what = format!("{} points, after all replicates that are allowed", grouped(gathered.n_imprecise));
        lines.push(("imprecise", what));
    }
    for expectation in &gathered.description.expectations {
        let verdict = match expectation.outcome {
            ExpectationOutcome::Met => "met",
            ExpectationOutcome::NotMet => "NOT MET",
            ExpectationOutcome::Unknown => "not known",
        };
        lines.push(("expected", format!("{}: {verdict} ({})", expectation.text, expectation.detail)));
    }
    lines.push(("results", out.display().to_string()));
    lines.push(("report", report.display().to_string()));
    lines.into_iter().map(|(name, text)| format!("{name:<12}{text}\n")).collect()
}

/// One object on one line.
fn json(gathered: &Gathered, out: &Path, report: &Path) -> String {
    let summary = serde_json::json!({
        "results": out.display().to_string(),
        "report": report.display().to_string(),
        "points": gathered.n_points,
        "done": gathered.n_done,
        "failed": gathered.n_failed,
        "missing": gathered.n_missing,
        "imprecise": gathered.n_imprecise,
        "expectations": gathered.description.expectations,
    });
    format!("{summary}\n")
}

/// Tell what a sweep has and what is missing
#[derive(clap::Args)]
pub(crate) struct StatusArguments {
    /// Folder of the sweep
    folder: PathBuf,
}

pub(crate) fn status(arguments: &StatusArguments, terminal: &Terminal) -> CommandResult {
    let (journals, loaded) = open(&arguments.folder)?;
    let pool = pool(machine::n_threads())?;
    let points = super::sweep::plan_points(&loaded, &pool)?;
    let all: Vec<&Journal> = journals.iter().collect();
    let standing = pool.install(|| gather_of(&loaded, &points, &all).standing());
    let standing = standing.map_err(|error| failed(&error))?;
    let damaged: usize = journals.iter().map(|journal| journal.damaged.len()).sum();
    let problems = manifest::check(&arguments.folder);
    let state = State {
        sweep: loaded.scene.sweep.name.clone(),
        scene: loaded.scene_name.clone(),
        points: points.len() as u64,
        skipped: points.n_skipped,
        done: standing.n_done,
        failed: standing.n_failed,
        incomplete: standing.n_missing,
        journals: journals.len(),
        damaged_places: damaged,
        tables: problems.clone(),
    };
    let text = match terminal.is_json() {
        true => serde_json::to_string(&state).expect("strings and numbers serialise") + "\n",
        false => state.text(&arguments.folder),
    };
    terminal.product(&text)?;
    let is_well = problems.is_none_or(|problems| problems.is_empty());
    Ok(if is_well { Exit::Done } else { Exit::Failed })
}

/// What is there.
#[derive(serde::Serialize)]
struct State {
    sweep: String,
    scene: String,
    points: u64,
    skipped: u64,
    done: u64,
    failed: u64,
    /// Points with replicates that are missing.
    incomplete: u64,
    journals: usize,
    damaged_places: usize,
    /// Tables that are not what was written; null before there are any.
    tables: Option<Vec<manifest::Problem>>,
}

impl State {
    fn text(&self, folder: &Path) -> String {
        let lines = [
            ("sweep", format!("{} of {}", self.sweep, self.scene)),
            ("points", format!("{}, {} skipped", grouped(self.points), grouped(self.skipped))),
            ("replicates", format!("{} done, {} failed", grouped(self.done), grouped(self.failed))),
            ("incomplete", format!("{} points", grouped(self.incomplete))),
            ("journals", format!("{}, {} damaged places", self.journals, self.damaged_places)),
        ];
        let text: String = lines.into_iter().map(|(name, text)| format!("{name:<12}{text}\n")).collect();
        text + &match &self.tables {
            None => format!("{:<12}not made yet: `lamella gather` makes them\n", "tables"),
            Some(problems) if problems.is_empty() => format!("{:<12}as they were written\n", "tables"),
            Some(problems) => {
                let line = |problem: &manifest::Problem| {
                    format!("{:<12}{} {}\n", "tables", problem.name, problem.what)
                };
                let lines: String = problems.iter().map(line).collect();
                let folder = folder.display();
                format!("{lines}{:<12}`lamella gather {folder}` makes them again from the journals\n", "")
            }
        }
    }
}

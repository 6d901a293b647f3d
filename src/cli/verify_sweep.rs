//! `lamella verify` of a sweep: its replicates run again, its tables made again, and all of it compared.

use super::interrupt::Interrupt;
use super::sweep::{failed, plan_points, pool, surroundings};
use super::sweep_folder::{gather_of, open};
use super::text::grouped;
use super::verify::compare_file;
use super::{CommandResult, Exit, Stopped, Terminal, load};
use lamella::diagnostic::{Diagnostic, codes};
use lamella::engine::Control;
use lamella::plan::compile::Compiled;
use lamella::plan::evaluation::Evaluation;
use lamella::report::SWEEP_FILE;
use lamella::scenario::Scenario;
use lamella::sweep::journal::Entry;
use lamella::sweep::replicate::{Task, refresh};
use lamella::sweep::{Journal, Point, Points, Series, manifest};
use lamella::table::{Kind, read, scan};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Compares `sample` points, spread over all of them, and all tables.
pub(super) fn verify(
    folder: &Path,
    sample: Option<usize>,
    (threads, cache): (usize, Option<PathBuf>),
    terminal: &Terminal,
) -> CommandResult {
    let interrupt = Interrupt::listen();
    let (journals, loaded) = open(folder)?;
    if let Some(cache) = cache {
        loaded.scene.flows.keep_in(cache);
    }
    let pool = pool(threads)?;
    let points = plan_points(&loaded, &pool)?;
    let n = sample.unwrap_or(points.len()).clamp(1, points.len().max(1));
    let again = Again { loaded: &loaded, journals: &journals, threads, interrupt: &interrupt };
    let mut verdict = Verdict::default();
    for idx in 0..n.min(points.len()) {
        let number = idx * points.len() / n;
        again.compare(number, &points.list[number], &mut verdict)?;
    }
    let all: Vec<&Journal> = journals.iter().collect();
    verdict.tables = pool.install(|| tables(folder, &loaded, &points, &all))?;
    terminal.product(&verdict.text())?;
    match verdict.complaint(folder) {
        None => Ok(Exit::Done),
        Some(message) => Err(Stopped::new(Exit::Failed, message)),
    }
}

struct Ask<'a>(&'a Interrupt);

impl Control for Ask<'_> {
    fn step_done(&self, _step: u64, _n_steps: u64) {}

    fn is_cancelled(&self) -> bool {
        self.0.is_requested()
    }
}

/// What was compared, and what could not be. Replicates are named `point/replicate`.
#[derive(Default)]
struct Verdict {
    n_same: u64,
    different: Vec<String>,
    missing: Vec<String>,
    /// Failed when they were run: they have no results.
    n_failed: u64,
    /// Points that never ran, because a check refuses them.
    n_refused: u64,
    tables: Option<Tables>,
}

/// Tables that are there.
struct Tables {
    n_files: usize,
    /// Those that the journals do not give.
    different: BTreeSet<String>,
}

/// Runs replicates again.
struct Again<'a> {
    loaded: &'a load::Sweep,
    journals: &'a [Journal],
    threads: usize,
    interrupt: &'a Interrupt,
}

impl Again<'_> {
    /// Runs the recorded replicates of a point again; those that it needs and has not are missing.
    fn compare(&self, number: usize, point: &Point, verdict: &mut Verdict) -> Result<(), Stopped> {
        let scene = &self.loaded.scene;
        let compiled = scene.compile(point.combination).ok().filter(|_| point.refusal.is_none());
        let Some((scenario, compiled)) = compiled else {
            verdict.n_refused += 1;
            return Ok(());
        };
        let replicates = &scene.sweep.replicates;
        let (mut series, mut replicate) = (Series::default(), 0);
        while replicate < series.needed(replicates).0 {
            let name = format!("{number}/{replicate}");
            match self.one((&scenario, &compiled), point.combination, replicate)? {
                One::Missing => verdict.missing.push(name),
                One::Failed => {
                    verdict.n_failed += 1;
                    series.set(replicate, f64::NAN);
                }
                One::Compared { is_same, values } => {
                    if is_same {
                        verdict.n_same += 1;
                    } else {
                        verdict.different.push(name);
                    }
                    let own = |name: &str| values.iter().find(|value| value.name == name)?.value;
                    let value = replicates.until.as_ref().and_then(|until| own(&until.measure));
                    series.set(replicate, value.unwrap_or(f64::NAN));
                }
            }
            replicate += 1;
        }
        Ok(())
    }

    fn one(
        &self,
        (scenario, compiled): (&Scenario, &Compiled),
        combination: u64,
        replicate: u32,
    ) -> Result<One, Stopped> {
        let scene = &self.loaded.scene;
        let (plan, key) = scene.replicate(&compiled.plan, combination, replicate);
        let found = self.journals.iter().filter_map(|journal| Some((journal, journal.entry(&key)?)));
        let found: Option<(&Journal, Entry)> = found.min_by_key(|(_, entry)| !entry.is_done());
        let Some((journal, entry)) = found else { return Ok(One::Missing) };
        let mut recorded = journal.replicate(entry).map_err(|error| failed(&error))?;
        // Errors and measures are those of today's references: the tables have these, too.
        refresh(&mut recorded, scenario, compiled);
        if recorded.row.status != lamella::table::Status::Done {
            return Ok(One::Failed);
        }
        let task = Task {
            scene,
            scenario,
            compiled,
            plan,
            key,
            combination,
            replicate,
            session: 0,
            compile_wall: 0.0,
            memory: None,
        };
        let again = task.run(&Ask(self.interrupt), self.threads.max(2), &surroundings());
        let Some(again) = again else {
            let message = Diagnostic::error(codes::R101, "the comparison was interrupted");
            return Err(Stopped::new(Exit::Interrupted, message));
        };
        let timed = timed(&compiled.evaluation);
        let is_same = again.has_bytes_of(&recorded, &|name| timed.contains(name));
        Ok(One::Compared { is_same, values: recorded.row.values })
    }
}

/// What became of one replicate.
enum One {
    Missing,
    Failed,
    Compared { is_same: bool, values: Vec<lamella::table::Value> },
}

/// Names of the measures that hang on the clock.
fn timed(evaluation: &Evaluation) -> BTreeSet<&str> {
    let measures = evaluation.measures.iter().zip(evaluation.is_timed());
    measures.filter(|(_, is_timed)| *is_timed).map(|(measure, _)| measure.name.as_str()).collect()
}

/// Makes the tables again in a folder that is taken away, and compares them with those that are there;
/// nothing if there are none yet.
fn tables(
    folder: &Path,
    loaded: &load::Sweep,
    points: &Points,
    journals: &[&Journal],
) -> Result<Option<Tables>, Stopped> {
    let marks = [manifest::MANIFEST, SWEEP_FILE, "points.parquet"];
    if marks.iter().all(|name| !folder.join(name).exists()) {
        return Ok(None);
    }
    let again = tempfile::Builder::new()
        .prefix(".lamella-verify-")
        .tempdir_in(folder)
        .map_err(|error| failed(&format!("cannot make a folder in {}: {error}", folder.display())))?;
    let gathered = gather_of(loaded, points, journals).write(again.path()).map_err(|error| failed(&error))?;
    let names: BTreeSet<String> = gathered.files.into_iter().map(|file| file.name).collect();
    let mut different = Vec::new();
    for name in names.iter().map(String::as_str).chain(["plan.yaml", "scene.lam", SWEEP_FILE]) {
        if name != "points.parquet" {
            compare_file(folder, again.path(), name.to_owned(), &mut different)
                .map_err(|error| failed(&error))?;
        }
    }
    let timed = timed(&loaded.compiled.evaluation);
    if facts(folder, &timed) != facts(again.path(), &timed) {
        different.push("points.parquet".to_owned());
    }
    for part in Kind::ALL.iter().flat_map(|kind| scan::parts(folder, *kind)) {
        let name = part.strip_prefix(folder).unwrap_or(&part).display().to_string();
        if !names.contains(&name) {
            different.push(name);
        }
    }
    let listed = manifest::check(folder).unwrap_or_default().into_iter().map(|problem| problem.name);
    let different: BTreeSet<String> = different.into_iter().chain(listed).collect();
    Ok(Some(Tables { n_files: names.len(), different }))
}

/// The rows of `points.parquet` without times; nothing if it cannot be read.
fn facts(folder: &Path, timed: &BTreeSet<&str>) -> Option<Vec<String>> {
    let points = read::points(&folder.join("points.parquet")).ok()?;
    let fact = |mut point: read::Point| {
        (point.wall, point.cpu, point.started) = (0.0, 0.0, 0);
        point.values.retain(|value| !timed.contains(value.name.as_str()));
        // Texts of numbers are exact here.
        format!("{point:?}")
    };
    Some(points.into_iter().map(fact).collect())
}

impl Verdict {
    fn text(&self) -> String {
        let mut lines = vec![format!("{} replicates run again: the same bytes", grouped(self.n_same))];
        let count = |n: usize, what: &str| format!("{} {what}", grouped(n as u64));
        if !self.different.is_empty() {
            lines.push(count(self.different.len(), "replicates run again: other bytes"));
        }
        if !self.missing.is_empty() {
            lines.push(count(self.missing.len(), "replicates missing"));
        }
        if self.n_failed > 0 {
            lines.push(format!("{} replicates failed: not compared", grouped(self.n_failed)));
        }
        if self.n_refused > 0 {
            lines.push(format!("{} points refused before they ran: not compared", grouped(self.n_refused)));
        }
        lines.push(match &self.tables {
            None => "tables not made yet: not compared".to_owned(),
            Some(tables) if tables.different.is_empty() => {
                format!("{} tables: what the journals give", tables.n_files)
            }
            Some(tables) => count(tables.different.len(), "files are not what the journals give"),
        });
        lines.join("\n") + "\n"
    }

    /// Why the sweep is not verified.
    fn complaint(&self, folder: &Path) -> Option<Diagnostic> {
        let folder = folder.display();
        let error = |text: String| Diagnostic::error(codes::F123, text);
        let mut message = None;
        if !self.different.is_empty() {
            let n = grouped(self.different.len() as u64);
            let whole = grouped(self.different.len() as u64 + self.n_same);
            let message = message.get_or_insert_with(|| {
                error(format!("{n} of {whole} replicates are not the same again"))
                    .help("another version or another machine than the one that ran them may be the reason")
            });
            message.notes.push(format!("replicates {}", some(&self.different)));
        }
        if let Some(tables) = self.tables.as_ref().filter(|tables| !tables.different.is_empty()) {
            let message = message.get_or_insert_with(|| {
                error("the tables are not what the journals give".to_owned())
                    .help(format!("`lamella gather {folder}` makes them again"))
            });
            let names: Vec<String> = tables.different.iter().cloned().collect();
            message.notes.push(format!("files {}", some(&names)));
        }
        if !self.missing.is_empty() {
            let n = grouped(self.missing.len() as u64);
            let message = message.get_or_insert_with(|| {
                error(format!("{n} replicates of the sweep are missing"))
                    .help("`lamella sweep` with the same words goes on where it stopped")
            });
            message.notes.push(format!("missing {}", some(&self.missing)));
        }
        if message.is_none() && self.n_same == 0 {
            return Some(error("nothing could be compared: no replicate ended well".to_owned()));
        }
        message
    }
}

/// The first of many names.
fn some(names: &[String]) -> String {
    let more = if names.len() > 10 { ", …" } else { "" };
    names.iter().take(10).map(String::as_str).collect::<Vec<_>>().join(", ") + more
}

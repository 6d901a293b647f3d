//! `lamella why`: whether a point will run again, and which line of the scene is behind it.

use super::sweep::pool;
use super::sweep_folder::{Which, journals, newest, point_of};
use super::text::date;
use super::{CommandResult, Exit, Stopped, Terminal, load, machine};
use lamella::diagnostic::{Diagnostic, codes};
use lamella::sweep::journal::Entry;
use lamella::sweep::why::{Difference, changes, difference};
use lamella::sweep::{Journal, key_text};
use std::path::{Path, PathBuf};

/// Say why a point of a sweep will run again, or why it will not
#[derive(clap::Args)]
pub(crate) struct Arguments {
    /// Folder of the sweep
    folder: PathBuf,
    /// Number of the point, with that of a replicate: 12 or 12/3
    point: Which,
    /// Scene file of today [default: the one that was run]
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,
}

pub(crate) fn run(arguments: &Arguments, terminal: &Terminal) -> CommandResult {
    let journals = journals(&arguments.folder)?;
    let Some(session) = newest(&journals) else { return Ok(Exit::SceneWrong) };
    let path = arguments.scene.clone().unwrap_or_else(|| PathBuf::from(&session.sources[0].0));
    let Some(now) = load::load_session_at(session, &path, terminal)? else { return Ok(Exit::SceneWrong) };
    let points = super::sweep::plan_points(&now, &pool(machine::n_threads())?)?;
    let point = point_of(&points, arguments.point)?;
    check_replicate(&now, arguments.point)?;
    let name = now.scene.name(point.combination);
    let Which { point: number, replicate } = arguments.point;
    let (_, compiled) =
        now.scene.compile(point.combination).map_err(|message| Stopped { exit: Exit::Failed, message })?;
    let (plan, key) = now.scene.replicate(&compiled.plan, point.combination, replicate);
    let head = Head { point: number, replicate, name, key: key_text(&key) };
    if let Some((journal, entry)) = find(&journals, &key) {
        let (will_run, reason) = known(journal, entry)?;
        return head.tell(will_run, &reason, terminal);
    }
    let Some((old, old_plan)) =
        counterpart(&arguments.folder, &journals, &now, point.combination, replicate)?
    else {
        return head.tell(true, "no point with these values was ever run", terminal);
    };
    let Some(found) = difference(&old_plan, &plan) else {
        return head.tell(true, "it was run, but its record is damaged", terminal);
    };
    let reason = format!("`{}` was {} and is {}", found.path, found.before, found.now);
    let exit = head.tell(true, &reason, terminal)?;
    show(&old, &now, &found, terminal);
    Ok(exit)
}

/// Refuses a replicate that the sweep never runs.
pub(crate) fn check_replicate(loaded: &load::Sweep, which: Which) -> Result<(), Stopped> {
    let replicates = &loaded.scene.sweep.replicates;
    let most = replicates.until.as_ref().map_or(replicates.least, |until| until.most);
    if which.replicate < most {
        return Ok(());
    }
    let Which { point, replicate } = which;
    let expected = if most == 1 { "0".to_owned() } else { format!("0 to {}", most - 1) };
    let message = Diagnostic::error(codes::F122, format!("point {point} has no replicate {replicate}"));
    Err(Stopped::new(Exit::SceneWrong, message.found(replicate.to_string()).expected(expected)))
}

/// What is asked about.
struct Head {
    point: u32,
    replicate: u32,
    name: String,
    key: String,
}

impl Head {
    fn tell(&self, will_run: bool, reason: &str, terminal: &Terminal) -> CommandResult {
        let Self { point, replicate, name, key } = self;
        let text = if terminal.is_json() {
            let answer = serde_json::json!({
                "point": point, "replicate": replicate, "name": name, "key": key,
                "will_run": will_run, "reason": reason,
            });
            format!("{answer}\n")
        } else {
            let verdict = if will_run { "will run" } else { "will not run" };
            format!("point {point}/{replicate} ({name})\nkey {key}\n{verdict}: {reason}\n")
        };
        terminal.product(&text)?;
        Ok(Exit::Done)
    }
}

fn find<'j>(journals: &'j [Journal], key: &lamella::sweep::Key) -> Option<(&'j Journal, Entry)> {
    let found = journals.iter().filter_map(|journal| Some((journal, journal.entry(key)?)));
    found.min_by_key(|(_, entry)| !entry.is_done())
}

/// Whether a recorded replicate runs again, and why.
fn known(journal: &Journal, entry: Entry) -> Result<(bool, String), Stopped> {
    let recorded = journal.replicate(entry).map_err(|error| super::sweep::failed(&error))?;
    let when = date(recorded.row.finished);
    Ok(match (&recorded.row.error_code, &recorded.row.error_message) {
        (None, _) => (false, format!("complete since {when}, version {}", recorded.row.version)),
        (Some(code), message) => {
            (true, format!("it failed on {when} with {code}: {}", message.as_deref().unwrap_or_default()))
        }
    })
}

/// The newest session that ran a point with the same values, with that point's plan.
fn counterpart(
    folder: &Path,
    journals: &[Journal],
    now: &load::Sweep,
    combination: u64,
    replicate: u32,
) -> Result<Option<(load::Sweep, lamella::plan::Plan)>, Stopped> {
    let wanted = now.scene.assignments(combination);
    let mut sessions: Vec<(&Journal, usize)> = journals
        .iter()
        .flat_map(|journal| (0..journal.sessions.len()).map(move |idx| (journal, idx)))
        .collect();
    sessions.sort_by_key(|(journal, idx)| std::cmp::Reverse(journal.sessions[*idx].started));
    for (journal, idx) in sessions {
        let Some(old) = load::load_session(folder, &journal.sessions[idx])? else { continue };
        let n = old.scene.n_combinations();
        let Some(same) = (0..n).find(|&other| old.scene.assignments(other) == wanted) else { continue };
        let Ok((_, compiled)) = old.scene.compile(same) else { continue };
        let (plan, key) = old.scene.replicate(&compiled.plan, same, replicate);
        if find(journals, &key).is_some() {
            return Ok(Some((old, plan)));
        }
    }
    Ok(None)
}

/// The lines behind the difference, in the scene of today and in the one that was run.
fn show(old: &load::Sweep, now: &load::Sweep, found: &Difference, terminal: &Terminal) {
    let mut sources = now.scene.sources.clone();
    let shift: Vec<_> = old
        .scene
        .sources
        .files()
        .map(|(id, file)| (id, sources.add(format!("{} as it was run", file.name), file.text.clone())))
        .collect();
    let moved = |mut span: lamella::source::Span| {
        if let Some((_, to)) = shift.iter().find(|(from, _)| *from == span.file) {
            span.file = *to;
        }
        span
    };
    let all =
        changes((&old.scene.file, &old.scene.sources), (&now.scene.file, &now.scene.sources), &found.path);
    for change in all.iter().take(3) {
        let message = Diagnostic::remark(codes::F124, format!("this can be behind `{}`", found.path));
        let message = match (change.now, change.before) {
            (Some(now), Some(before)) => message.at(now, "now").also(moved(before), "as it was run"),
            (Some(now), None) => message.at(now, "new since then"),
            (None, Some(before)) => message.at(moved(before), "there no more"),
            (None, None) => continue,
        };
        terminal.diagnostics(&[message], &sources);
    }
    let changed = changed_files(old, now);
    for name in &changed {
        terminal.remark(&format!("{name} holds other numbers than it did"));
    }
    if all.is_empty() && changed.is_empty() {
        terminal.remark("the scene is written as it was: a setting, the seed or the version is another one");
    }
}

/// Files of numbers that are others today.
fn changed_files<'a>(old: &load::Sweep, now: &'a load::Sweep) -> Vec<&'a str> {
    let was = |name: &str| old.scene.sources.find_data(name).map(|file| file.hash.as_str());
    let files = now.scene.sources.data().iter();
    let changed = files.filter(|file| was(&file.name).is_some_and(|hash| hash != file.hash));
    changed.map(|file| file.name.as_str()).collect()
}

/// Whether a path is the folder of a sweep.
pub(crate) fn is_sweep(folder: &Path) -> bool {
    folder.join("journal").is_dir()
}

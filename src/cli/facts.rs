//! What a start of the program knows of its surroundings, for the provenance of results: machine, compiler,
//! repository of the scene. A fact that cannot be found is absent; none of them is worth a message.

use super::files::is_stdin;
use super::machine;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::mpsc;
use std::time::Duration;

/// A repository on a slow disk is not waited for any longer.
const PATIENCE: Duration = Duration::from_secs(2);

/// Bytes of git's answer that are looked at: that there is one says enough.
const MAX_ANSWER: u64 = 1 << 16;

/// By name, in the order in which they are shown. `scene` is absent if it is no file of the user's.
pub(crate) fn facts(scene: Option<&Path>, n_threads: usize) -> Vec<(String, String)> {
    let system = Some(std::env::consts::OS.to_owned()).map(|name| match kernel() {
        Some(kernel) => format!("{name} {kernel}"),
        None => name,
    });
    let machine = [
        ("host", Some(machine::host())),
        ("operating system", system),
        ("architecture", Some(std::env::consts::ARCH.to_owned())),
        ("processor", processor()),
        ("vector instructions", Some(lamella::maths::wide::Width::widest().name().to_owned())),
        ("threads", Some(n_threads.to_string())),
        ("compiler", Some(env!("LAMELLA_COMPILER").to_owned())),
    ];
    let repository = scene.filter(|scene| !is_stdin(scene)).map(repository).unwrap_or_default();
    let all = machine.into_iter().chain(repository);
    let known = all.filter_map(|(name, value)| Some((name.to_owned(), value?)));
    known.filter(|(_, value)| !value.is_empty()).collect()
}

fn kernel() -> Option<String> {
    Some(std::fs::read_to_string("/proc/sys/kernel/osrelease").ok()?.trim().to_owned())
}

fn processor() -> Option<String> {
    model_name(&std::fs::read_to_string("/proc/cpuinfo").ok()?)
}

/// Of the first processor.
fn model_name(text: &str) -> Option<String> {
    let line = text.lines().find_map(|line| line.strip_prefix("model name"))?;
    Some(line.trim_start_matches([' ', '\t', ':']).trim_end().to_owned())
}

/// Commit and state of the git repository that the scene lies in.
fn repository(scene: &Path) -> Vec<(&'static str, Option<String>)> {
    let Ok(scene) = scene.canonicalize() else { return Vec::new() };
    let Some(folder) = scene.parent() else { return Vec::new() };
    // git is asked only where there is something to ask for.
    if !folder.ancestors().any(|folder| folder.join(".git").exists()) {
        return Vec::new();
    }
    let commit = git(folder, &["rev-parse".into(), "--verify".into(), "HEAD".into()]);
    vec![("commit", commit), ("repository", state(folder, &scene))]
}

fn state(folder: &Path, scene: &Path) -> Option<String> {
    let changed = git(folder, &["status".into(), "--porcelain".into(), "--untracked-files=no".into()])?;
    // Results beside the scene are no change of it, but the scene itself must be there.
    let tracked = git(folder, &["ls-files".into(), "--".into(), scene.to_path_buf()])?;
    let state = match (tracked.is_empty(), changed.is_empty()) {
        (true, _) => "the scene is not committed",
        (false, true) => "as committed",
        (false, false) => "with changes that are not committed",
    };
    Some(state.to_owned())
}

/// What git says, without the last line break; nothing if it fails, is missing or takes too long.
fn git(folder: &Path, arguments: &[PathBuf]) -> Option<String> {
    let mut child = Command::new("git")
        // A repository may name programs of its own that git is to start; a look must not run them.
        .args(["-c", "core.fsmonitor=false", "-C"])
        .arg(folder)
        .args(arguments)
        .env("GIT_OPTIONAL_LOCKS", "0")
        // Set where git itself has started us, of a repository that need not be the scene's.
        .env_remove("GIT_DIR")
        .env_remove("GIT_WORK_TREE")
        .env_remove("GIT_INDEX_FILE")
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null())
        .spawn()
        .ok()?;
    let pipe = child.stdout.take()?;
    let (tell, told) = mpsc::channel();
    std::thread::spawn(move || {
        let mut answer = Vec::new();
        let is_read = pipe.take(MAX_ANSWER).read_to_end(&mut answer).is_ok();
        // Nobody listens any more if it took too long.
        let _ = tell.send(is_read.then_some(answer));
    });
    let Ok(answer) = told.recv_timeout(PATIENCE) else {
        let _ = child.kill();
        let _ = child.wait();
        return None;
    };
    let answer = answer?;
    // A longer answer was cut off, and with it git's way to end well.
    let is_cut = answer.len() as u64 == MAX_ANSWER;
    let is_well = child.wait().is_ok_and(|status| status.success());
    (is_well || is_cut).then(|| String::from_utf8_lossy(&answer).trim_end().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_processor_is_read_from_the_table_of_the_system() {
        let text = "processor\t: 0\nmodel name\t: Some CPU @ 2 GHz\nflags\t\t: fpu\nmodel name\t: Other\n";
        assert_eq!(model_name(text).as_deref(), Some("Some CPU @ 2 GHz"));
        assert_eq!(model_name("processor : 0\n"), None);
    }

    #[test]
    fn what_is_known_of_every_machine_is_told() {
        let facts = facts(None, 3);
        let value =
            |name: &str| facts.iter().find(|(other, _)| other == name).map(|(_, value)| value.as_str());
        assert_eq!(value("threads"), Some("3"));
        assert_eq!(value("architecture"), Some(std::env::consts::ARCH));
        assert!(value("compiler").is_some_and(|text| text.starts_with("rustc 1.")), "{facts:?}");
        assert!(value("vector instructions").is_some() && value("commit").is_none(), "{facts:?}");
    }
}

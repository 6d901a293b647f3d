//! From a path to a plan; what `check`, `plan` and `run` have in common.

use super::data::{add_data, restore_of_sweep};
use super::files::{display_name, is_stdin, read_scene};
use super::run::scene_name;
use super::{Exit, Stopped, Terminal, machine, record};
use lamella::Checked;
use lamella::diagnostic::{Diagnostic, codes};
use lamella::plan::compile::{Compiled, Options, Selection};
use lamella::scenario::{Scenario, Settings, sweeps, wanted_files};
use lamella::source::{FileId, RefusedFile, Sources};
use lamella::sweep::Scene;
use lamella::sweep::frame::Session;
use lamella::syntax::tree;
use lamella::table::Record;
use std::path::Path;

/// Reads a scene and takes it as far as it goes.
pub(crate) fn load(path: &Path, settings: &Settings, without_passes: bool) -> Result<Checked, Stopped> {
    let mut sources = Sources::single(display_name(path), read_scene(path)?);
    add_files(&mut sources, path);
    let passes = if without_passes { Selection::None } else { Selection::All };
    let options = Options { passes, memory: machine::available_memory() };
    let checked = lamella::check(sources, settings, &options);
    match settings.sweep.as_deref() {
        Some(name) if sweeps(&checked.file).all(|sweep| sweep.name.value != name) => {
            Err(no_sweep(&checked.file, Some(name)))
        }
        _ => Ok(checked),
    }
}

/// Puts the files that a scene names among its sources: scenes that it uses, and numbers that these read.
fn add_files(sources: &mut Sources, scene: &Path) {
    add_used(sources, scene);
    add_data(sources, scene);
}

/// Puts the files that a scene uses among its sources, or the reasons why they are not there.
fn add_used(sources: &mut Sources, scene: &Path) {
    let first = sources.file(FileId(0));
    for (name, path) in wanted_files(&first.name, &first.text) {
        match read_used(scene, &path) {
            Ok(text) => drop(sources.add(name, text)),
            Err((reason, is_outside)) => sources.refuse(RefusedFile { name, reason, is_outside }),
        }
    }
}

/// A file below the folder of the scene; else the reason, and whether it is that the file lies outside.
fn read_used(scene: &Path, path: &str) -> Result<String, (String, bool)> {
    if is_stdin(scene) {
        return Err(("a scene from standard input has no folder, so it can use no files".to_owned(), false));
    }
    let folder = match scene.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let file = folder.join(path);
    // Links are followed before the place is looked at; what cannot be followed cannot be read either.
    if let (Ok(root), Ok(place)) = (folder.canonicalize(), file.canonicalize())
        && !place.starts_with(&root)
    {
        return Err((format!("{} is a link that leads out of this folder", display_name(&file)), true));
    }
    read_scene(&file).map_err(|stopped| (stopped.message.message.clone(), false))
}

/// Names of all sweeps of a scene, right or wrong.
pub(crate) fn names_of_sweeps(path: &Path) -> Result<Vec<String>, Stopped> {
    let (file, _) = lamella::syntax::parse(FileId(0), &read_scene(path)?);
    Ok(sweeps(&file).map(|sweep| sweep.name.value.clone()).collect())
}

/// `--over AXIS=VALUES`: a sweep without a statement.
pub(crate) struct Over<'a> {
    pub(crate) axes: &'a [String],
    pub(crate) replicates: Option<u32>,
}

impl Over<'_> {
    /// The statement that the scene does not have.
    fn statement(&self) -> String {
        let axes: Vec<String> = self.axes.iter().map(|axis| axis.replacen('=', " ", 1)).collect();
        let replicates = self.replicates.map_or(String::new(), |n| format!("\n  replicates {n}"));
        format!("lamella 1\nsweep command_line {{\n  {}{replicates}\n}}\n", axes.join("\n  "))
    }
}

/// A scene with one of its sweeps, ready to be run.
pub(crate) struct Sweep {
    pub(crate) scene: Scene,
    /// Of the scene without a point.
    pub(crate) scenario: Scenario,
    pub(crate) compiled: Compiled,
    pub(crate) record: Record,
    /// As it was given on the command line.
    pub(crate) path: String,
    pub(crate) scene_name: String,
}

/// Reads a scene and picks its sweep; nothing if the scene is wrong, which has been told.
pub(crate) fn load_sweep(
    path: &Path,
    name: Option<&str>,
    over: Option<&Over>,
    settings: &Settings,
    terminal: &Terminal,
) -> Result<Option<Sweep>, Stopped> {
    if let (Some(name), Some(_)) = (name, over) {
        let text = format!("`{name}` names a sweep of the scene, and `--over` makes another one");
        let message = Diagnostic::error(codes::F120, text)
            .help("leave out the name, or write the axes of `--over` into the sweep");
        return Err(Stopped::new(Exit::SceneWrong, message));
    }
    let mut sources = Sources::single(display_name(path), read_scene(path)?);
    add_files(&mut sources, path);
    let further: Vec<(&str, String)> = over.map(|over| ("--over", over.statement())).into_iter().collect();
    let name = if over.is_some() { Some("command_line") } else { name };
    let names = (display_name(path), scene_name(path));
    let loaded = pick(sources, &further, name, settings, names, Some(terminal))?;
    loaded.map(Sweep::without_swept_settings).transpose()
}

/// The sweep of a session of a journal in a folder.
pub(crate) fn load_session(folder: &Path, session: &Session) -> Result<Option<Sweep>, Stopped> {
    let Some((path, text)) = session.sources.first() else { return Ok(None) };
    let mut sources = Sources::single(path, text);
    let (of_program, used): (Vec<_>, Vec<_>) =
        session.sources[1..].iter().partition(|(name, _)| name.starts_with("--"));
    for (name, text) in used {
        sources.add(name, text);
    }
    restore_of_sweep(folder, &session.data, &mut sources)?;
    let further: Vec<(&str, String)> =
        of_program.iter().map(|(name, text)| (name.as_str(), text.clone())).collect();
    let settings = Settings { set: session.set.clone(), seed: session.seed, ..Settings::default() };
    let names = (path.clone(), scene_name(Path::new(path)));
    pick(sources, &further, Some(&session.sweep), &settings, names, None)
}

/// The sweep of a session in the scene as it is today.
pub(crate) fn load_session_at(
    session: &Session,
    path: &Path,
    terminal: &Terminal,
) -> Result<Option<Sweep>, Stopped> {
    let mut sources = Sources::single(display_name(path), read_scene(path)?);
    add_files(&mut sources, path);
    let of_program = session.sources[1..].iter().filter(|(name, _)| name.starts_with("--"));
    let further: Vec<(&str, String)> = of_program.map(|(name, text)| (name.as_str(), text.clone())).collect();
    let settings = Settings { set: session.set.clone(), seed: session.seed, ..Settings::default() };
    let names = (display_name(path), scene_name(path));
    pick(sources, &further, Some(&session.sweep), &settings, names, Some(terminal))
}

fn pick(
    sources: Sources,
    further: &[(&str, String)],
    name: Option<&str>,
    settings: &Settings,
    (path, scene_name): (String, String),
    terminal: Option<&Terminal>,
) -> Result<Option<Sweep>, Stopped> {
    // What fits into memory is a matter of the machine that runs a point, and never of its tables.
    let options = Options { passes: Selection::All, memory: None };
    let settings = &Settings { sweep: name.map(str::to_owned), ..settings.clone() };
    let mut checked = lamella::check_with(sources, further, settings, &options);
    if let Some(terminal) = terminal {
        terminal.diagnostics(&checked.diagnostics, &checked.sources);
    }
    let (Some(compiled), Some(scenario)) = (checked.compiled.take(), checked.scenario.take()) else {
        return Ok(None);
    };
    let sweep = choose(&checked, &scenario, name)?;
    let record = record::record(&checked, &scenario, &compiled, &scene_name);
    // The statements of the used scene belong to every point.
    let file = lamella::base(&checked.whole, &checked.sources, sweep.of.as_deref());
    let scene = Scene::new(file, checked.sources, settings.clone(), options, &scenario, sweep);
    Ok(Some(Sweep { scene, scenario, compiled, record, path, scene_name }))
}

/// The sweep of that name, or the only one.
fn choose(
    checked: &Checked,
    scenario: &Scenario,
    name: Option<&str>,
) -> Result<lamella::scenario::sweep::Sweep, Stopped> {
    let n_sweeps = sweeps(&checked.whole).count();
    let found = match name {
        Some(name) => scenario.sweeps.iter().find(|sweep| sweep.name == name),
        None if n_sweeps == 1 => scenario.sweeps.first(),
        None => None,
    };
    found.cloned().ok_or_else(|| no_sweep(&checked.whole, name))
}

fn no_sweep(file: &tree::File, name: Option<&str>) -> Stopped {
    let names: Vec<String> = sweeps(file).map(|sweep| format!("`{}`", sweep.name.value)).collect();
    let what = match (name, names.is_empty()) {
        (_, true) => "the scene has no sweep".to_owned(),
        (Some(name), _) => format!("the scene has no sweep `{name}`"),
        (None, _) => "the scene has several sweeps".to_owned(),
    };
    let message = Diagnostic::error(codes::F120, what);
    let message = match names.is_empty() {
        true => message.help("write a `sweep` statement, or give `--over step=1s,2s`"),
        false => message.expected(names.join(", ")).help("name it after the file"),
    };
    Stopped::new(Exit::SceneWrong, message)
}

impl Sweep {
    /// Refuses `--set` of what an axis sets: it would have no effect.
    fn without_swept_settings(self) -> Result<Self, Stopped> {
        let axes: Vec<&str> =
            self.scene.sweep.groups.iter().flatten().map(|axis| axis.target.name()).collect();
        let set = &self.scene.settings.set;
        let Some((name, value)) = set.iter().find(|(name, _)| axes.contains(&name.trim())) else {
            return Ok(self);
        };
        let (name, sweep) = (name.trim(), &self.scene.sweep.name);
        let text = format!("`--set` gives `{name}` one value, and the sweep `{sweep}` gives it many");
        let message = Diagnostic::error(codes::W002, text)
            .found(format!("--set {name}={value}"))
            .expected(format!("`{name}` as an axis or as a setting"))
            .help(format!("leave out `--set {name}=…`, or take the axis out of the sweep"));
        Err(Stopped::new(Exit::SceneWrong, message))
    }

    /// What a journal remembers of this start.
    pub(crate) fn session(&self, started: i64, facts: Vec<(String, String)>) -> Session {
        let texts = self.scene.sources.files().filter(|(_, file)| file.name != "--set");
        let data = self.scene.sources.data().iter().map(|file| (file.name.clone(), file.hash.clone()));
        Session {
            sources: texts.map(|(_, file)| (file.name.clone(), file.text.clone())).collect(),
            data: data.collect(),
            set: self.scene.settings.set.clone(),
            seed: self.scene.settings.seed,
            sweep: self.scene.sweep.name.clone(),
            version: env!("CARGO_PKG_VERSION").to_owned(),
            started,
            facts,
        }
    }

    /// The command that runs one replicate of one point alone.
    pub(crate) fn command(&self, combination: u64, seed: u64) -> String {
        let mut words = vec!["lamella run".to_owned(), shell_word(&self.path)];
        let own = self.scene.settings.set.iter().cloned();
        for (name, value) in own.chain(self.scene.assignments(combination)) {
            words.push(format!("--set {}", shell_word(&format!("{name}={value}"))));
        }
        if self.scene.sweep.of.is_some() {
            words.push(format!("--sweep {}", shell_word(&self.scene.sweep.name)));
        }
        words.push(format!("--seed {seed}"));
        words.join(" ")
    }
}

/// A word that a shell leaves as it is.
pub(crate) fn shell_word(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_=./+,:".contains(c);
    if text.chars().all(is_plain) { text.to_owned() } else { format!("'{}'", text.replace('\'', "'\\''")) }
}

/// `name=value` of `--set`, as it was typed; the value is an expression of the language.
pub(crate) fn parse_setting(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => {
            Ok((name.to_owned(), value.to_owned()))
        }
        _ => Err("expected name=value, such as v=2cm/s".to_owned()),
    }
}

//! Wrong scenes, and what the user is told about them.
//!
//! Each `tests/diagnostics/<phase>/<the_mistake>.lam` has its rendered messages beside it in a `.txt`.
//! A line `# expect: U104 D001` demands these codes; a line `# set: name=value` is what `--set` would
//! do; `# memory: 1000` is a machine of so many bytes; `# left out` asks for the note of what the run
//! does without. Files that a scene uses stand in folders inside the phase. `LAMELLA_BLESS=1`
//! (`make bless`) writes the messages anew; look at the difference before you commit it.

use lamella::data::DataFile;
use lamella::diagnostic::Diagnostic;
use lamella::diagnostic::render::{self, Colour};
use lamella::plan::compile::Options;
use lamella::scenario::{Settings, wanted_data, wanted_files};
use lamella::source::Sources;
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/diagnostics")
}

/// All fixtures, in the order of their names.
fn fixtures() -> Vec<PathBuf> {
    let mut found = Vec::new();
    let phases = std::fs::read_dir(folder()).expect("the folder of fixtures is there");
    for phase in phases.flatten().filter(|phase| phase.path().is_dir()) {
        let files = std::fs::read_dir(phase.path()).expect("a phase can be listed").flatten();
        found.extend(
            files.map(|file| file.path()).filter(|path| path.extension().is_some_and(|e| e == "lam")),
        );
    }
    found.sort();
    found
}

/// The name that messages show: `<phase>/<the_mistake>.lam` on every machine.
fn name(path: &Path) -> String {
    let relative = path.strip_prefix(folder()).expect("a fixture lies in the folder");
    relative.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/")
}

fn read(path: &Path) -> String {
    std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn check(path: &Path) -> (Vec<Diagnostic>, Sources) {
    let text = read(path);
    let set = directives(&text, "# set:").map(|setting| {
        let (name, value) = setting.split_once('=').expect("name=value");
        (name.trim().to_owned(), value.trim().to_owned())
    });
    let memory = directives(&text, "# memory:").next().map(|bytes| bytes.parse().expect("a number of bytes"));
    let options = Options { memory, ..Options::default() };
    let settings = Settings { set: set.collect(), ..Settings::default() };
    let mut sources = Sources::single(name(path), text.clone());
    for (name, used) in wanted_files(&name(path), &text) {
        // What is not there is told by `check`.
        if let Ok(text) = std::fs::read_to_string(path.with_file_name(used)) {
            sources.add(name, text);
        }
    }
    for name in wanted_data(&sources) {
        if let Ok(bytes) = std::fs::read(folder().join(&name)) {
            sources.add_data(Arc::new(DataFile::new(name, bytes)));
        }
    }
    let checked = lamella::check(sources, &settings, &options);
    let mut diagnostics = checked.diagnostics;
    if directives(&text, "# left out").next().is_some() {
        diagnostics.extend(checked.compiled.as_ref().map(|compiled| compiled.left_out_note()));
    }
    (diagnostics, checked.sources)
}

/// What follows a mark at the start of a line.
fn directives<'a>(text: &'a str, mark: &'a str) -> impl Iterator<Item = &'a str> {
    text.lines().filter_map(move |line| line.strip_prefix(mark)).map(str::trim)
}

#[test]
fn every_mistake_is_told_as_agreed() {
    let is_blessing = std::env::var_os("LAMELLA_BLESS").is_some();
    let mut broken = Vec::new();
    for path in fixtures() {
        let (diagnostics, sources) = check(&path);
        let shown = render::text(&diagnostics, &sources, Colour::Plain);
        let snapshot = path.with_extension("txt");
        if is_blessing {
            std::fs::write(&snapshot, &shown).expect("a snapshot can be written");
        } else if !snapshot.exists() {
            broken.push(format!("{}: no snapshot; `make bless` writes it\n{shown}", name(&path)));
        } else if read(&snapshot) != shown {
            broken.push(format!("{}: agreed\n{}told\n{shown}", name(&path), read(&snapshot)));
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

#[test]
fn every_mistake_has_the_codes_it_expects_and_a_place() {
    let mut broken = Vec::new();
    for path in fixtures() {
        let (diagnostics, _) = check(&path);
        if diagnostics.is_empty() {
            broken.push(format!("{}: nothing was said", name(&path)));
        }
        for code in directives(&read(&path), "# expect:").flat_map(str::split_whitespace) {
            if !diagnostics.iter().any(|diagnostic| diagnostic.code.0 == code) {
                broken.push(format!("{}: {code} was not said", name(&path)));
            }
        }
        for diagnostic in diagnostics.iter().filter(|diagnostic| diagnostic.is_fatal()) {
            if diagnostic.primary_span().is_none() {
                broken.push(format!("{}: {} has no place", name(&path), diagnostic.code));
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// Every mistake in JSON has the same number of messages and points into the file.
#[test]
fn every_mistake_can_be_read_as_json() {
    for path in fixtures() {
        let (diagnostics, sources) = check(&path);
        let json = render::json(&diagnostics, &sources);
        assert_eq!(json.lines().count(), diagnostics.len(), "{}", name(&path));
        for line in json.lines() {
            let message: serde_json::Value = serde_json::from_str(line).expect("JSON");
            for label in message["labels"].as_array().expect("labels") {
                assert!(label["start"].as_u64() <= label["end"].as_u64(), "{}: {label}", name(&path));
            }
        }
    }
}

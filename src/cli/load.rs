//! From a path to a plan; what `check`, `plan` and `run` have in common.

use super::files::{display_name, is_stdin, read_scene};
use super::{Stopped, machine};
use lamella::Checked;
use lamella::plan::compile::{Options, Selection};
use lamella::scenario::{Settings, wanted_files};
use lamella::source::{FileId, RefusedFile, Sources};
use std::path::Path;

/// Reads a scene and takes it as far as it goes.
pub(crate) fn load(path: &Path, settings: &Settings, without_passes: bool) -> Result<Checked, Stopped> {
    let mut sources = Sources::single(display_name(path), read_scene(path)?);
    add_used(&mut sources, path);
    let passes = if without_passes { Selection::None } else { Selection::All };
    let options = Options { passes, memory: machine::available_memory() };
    Ok(lamella::check(sources, settings, &options))
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

/// `name=value` of `--set`, as it was typed; the value is an expression of the language.
pub(crate) fn parse_setting(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => {
            Ok((name.to_owned(), value.to_owned()))
        }
        _ => Err("expected name=value, such as v=2cm/s".to_owned()),
    }
}

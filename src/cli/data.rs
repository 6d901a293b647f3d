//! Files of numbers: from the folder of a scene to its sources, and into folders of results and out of them again.
//!
//! Owns these ways. May use the sources. It deliberately reads nothing of what is in a file.

use super::files::{display_name, is_stdin, read_data, write_whole_bytes};
use super::{Exit, Stopped};
use lamella::data::DataFile;
use lamella::diagnostic::{Diagnostic, codes};
use lamella::plan::document::NamedData;
use lamella::scenario::wanted_data;
use lamella::source::{FileId, RefusedFile, Sources};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Folder of a run's files of numbers, under the names by which the scene calls them.
const OF_RUN: &str = "data";
/// Folder of a sweep's files of numbers, under their hashes: those of several starts stand side by side.
const OF_SWEEP: &str = "journal/data";

/// Puts the files of numbers that a scene names among its sources, or the reasons why they are not there.
pub(crate) fn add_data(sources: &mut Sources, scene: &Path) {
    for name in wanted_data(sources) {
        match read(scene, &name) {
            Ok(bytes) => sources.add_data(Arc::new(DataFile::new(name, bytes))),
            Err((reason, is_outside)) => sources.refuse(RefusedFile { name, reason, is_outside }),
        }
    }
}

/// A file below the folder of the scene; else the reason, and whether it is that the file lies outside.
fn read(scene: &Path, name: &str) -> Result<Vec<u8>, (String, bool)> {
    if is_stdin(scene) {
        return Err(("a scene from standard input has no folder, so it can read no files".to_owned(), false));
    }
    let folder = match scene.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let file = Path::new(name);
    // Links are followed before the place is looked at; what cannot be followed cannot be read either.
    if let (Ok(root), Ok(place)) = (folder.canonicalize(), file.canonicalize())
        && !place.starts_with(&root)
    {
        return Err((format!("{} is a link that leads out of this folder", display_name(file)), true));
    }
    read_data(file).map_err(|stopped| (stopped.message.message.clone(), false))
}

/// The name of a file of numbers, counted from the folder of the scene.
fn relative<'n>(sources: &Sources, name: &'n str) -> &'n str {
    let scene = &sources.file(FileId(0)).name;
    let folder = scene.rfind(['/', '\\']).map_or("", |slash| &scene[..=slash]);
    name.strip_prefix(folder).unwrap_or(name)
}

/// What a plan says of the files of numbers of its scene.
pub(crate) fn named_data(sources: &Sources) -> Vec<NamedData> {
    let named = |file: &Arc<DataFile>| NamedData {
        name: relative(sources, &file.name).to_owned(),
        hash: file.hash.clone(),
    };
    sources.data().iter().map(named).collect()
}

/// Keeps the files of a run beside its tables; gives their names there.
pub(crate) fn keep_of_run(folder: &Path, sources: &Sources) -> Result<Vec<String>, Stopped> {
    let mut names = Vec::new();
    for file in sources.data() {
        let name = format!("{OF_RUN}/{}", relative(sources, &file.name));
        keep(&folder.join(&name), file)?;
        names.push(name);
    }
    Ok(names)
}

/// Keeps the files of a sweep beside its journals.
pub(crate) fn keep_of_sweep(folder: &Path, sources: &Sources) -> Result<(), Stopped> {
    sources.data().iter().try_for_each(|file| {
        let path = folder.join(OF_SWEEP).join(&file.hash);
        if path.exists() { Ok(()) } else { keep(&path, file) }
    })
}

fn keep(path: &Path, file: &DataFile) -> Result<(), Stopped> {
    if let Some(folder) = path.parent() {
        std::fs::create_dir_all(folder)
            .map_err(|error| super::files::unwritable(folder, &error.to_string()))?;
    }
    write_whole_bytes(path, &file.bytes)
}

/// Puts the files that a run has kept among the sources of its scene, which has no folder there.
pub(crate) fn restore_of_run(
    folder: &Path,
    data: &[NamedData],
    sources: &mut Sources,
) -> Result<(), Stopped> {
    let at = |file: &NamedData| folder.join(OF_RUN).join(&file.name);
    restore(data.iter().map(|file| (at(file), file.name.as_str(), file.hash.as_str())), sources)
}

/// The same of a sweep, for a session of its journal.
pub(crate) fn restore_of_sweep(
    folder: &Path,
    data: &[(String, String)],
    sources: &mut Sources,
) -> Result<(), Stopped> {
    let at = |hash: &String| folder.join(OF_SWEEP).join(hash);
    restore(data.iter().map(|(name, hash)| (at(hash), name.as_str(), hash.as_str())), sources)
}

fn restore<'a>(
    files: impl Iterator<Item = (PathBuf, &'a str, &'a str)>,
    sources: &mut Sources,
) -> Result<(), Stopped> {
    for (path, name, hash) in files {
        let file = DataFile::new(name, read_data(&path)?);
        if file.hash != hash {
            let text = format!("{} is not the file that was read: its bytes are others", display_name(&path));
            let message = Diagnostic::error(codes::F121, text).help("put the file back, or run again");
            return Err(Stopped::new(Exit::Failed, message));
        }
        sources.add_data(Arc::new(file));
    }
    Ok(())
}

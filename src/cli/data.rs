//! Files of numbers: from the folder of a scene to its sources.
//!
//! Owns this way. May use the sources. It deliberately reads nothing of what is in a file.

use super::files::{display_name, is_stdin, read_data};
use lamella::scenario::wanted_data;
use lamella::source::{DataFile, RefusedFile, Sources};
use std::path::Path;
use std::sync::Arc;

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

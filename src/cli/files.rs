//! Reading and writing of the user's files: each failure is one clear sentence.

use super::{Exit, Stopped};
use lamella::diagnostic::{Diagnostic, codes};
use std::io::{ErrorKind, Read, Write};
use std::path::Path;

/// Larger files are not scenes; the bound also ends the reading of devices that never end.
const MAX_SCENE_BYTES: u64 = 16 << 20;

/// Standard input is written `-`.
pub(crate) fn is_stdin(path: &Path) -> bool {
    path.as_os_str() == "-"
}

/// The name that messages show for a path.
pub(crate) fn display_name(path: &Path) -> String {
    if is_stdin(path) { "<stdin>".to_owned() } else { path.display().to_string() }
}

/// The text of a scene file, or of standard input for `-`.
pub(crate) fn read_scene(path: &Path) -> Result<String, Stopped> {
    let bytes = if is_stdin(path) {
        read_bounded(std::io::stdin().lock())
    } else if path.is_dir() {
        return Err(unreadable(path, "it is a directory, not a scene file"));
    } else {
        std::fs::File::open(path).and_then(read_bounded)
    };
    let bytes = bytes.map_err(|error| unreadable(path, &reason(&error)))?;
    if bytes.len() as u64 > MAX_SCENE_BYTES {
        return Err(unreadable(path, "it is larger than 16 MiB, which no scene is"));
    }
    String::from_utf8(bytes).map_err(|error| not_utf8(path, &error))
}

/// Larger files are no tables of numbers that a scene can hold in memory.
const MAX_DATA_BYTES: u64 = 4 << 30;

/// The bytes of a file of numbers.
pub(crate) fn read_data(path: &Path) -> Result<Vec<u8>, Stopped> {
    if path.is_dir() {
        return Err(unreadable(path, "it is a directory, not a file of numbers"));
    }
    let bytes = std::fs::File::open(path).and_then(|file| {
        let mut bytes = Vec::new();
        file.take(MAX_DATA_BYTES + 1).read_to_end(&mut bytes).map(|_| bytes)
    });
    let bytes = bytes.map_err(|error| unreadable(path, &reason(&error)))?;
    if bytes.len() as u64 > MAX_DATA_BYTES {
        return Err(unreadable(path, "it is larger than 4 GiB"));
    }
    Ok(bytes)
}

/// Writes a file whole or not at all; an existing file keeps its permissions.
pub(crate) fn write_whole(path: &Path, text: &str) -> Result<(), Stopped> {
    write_whole_bytes(path, text.as_bytes())
}

/// The same for bytes.
pub(crate) fn write_whole_bytes(path: &Path, bytes: &[u8]) -> Result<(), Stopped> {
    let failed = |error: &std::io::Error| unwritable(path, &reason(error));
    // Through a link, so that the link stays a link.
    let target = std::fs::canonicalize(path).unwrap_or_else(|_| path.to_owned());
    let folder = match target.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let mut file = tempfile::Builder::new()
        .prefix(".lamella.tmp-")
        .tempfile_in(folder)
        .map_err(|error| failed(&error))?;
    let permissions = match std::fs::metadata(&target) {
        Ok(metadata) => metadata.permissions(),
        Err(_) => default_permissions(),
    };
    file.write_all(bytes)
        .and_then(|()| file.as_file().set_permissions(permissions))
        .and_then(|()| file.as_file().sync_all())
        .map_err(|error| failed(&error))?;
    file.persist(&target).map_err(|error| failed(&error.error))?;
    Ok(())
}

/// Writes a file that must not exist yet.
pub(crate) fn write_new(path: &Path, text: &str) -> Result<(), Stopped> {
    let mut file = std::fs::File::create_new(path).map_err(|error| unwritable(path, &reason(&error)))?;
    file.write_all(text.as_bytes()).map_err(|error| unwritable(path, &reason(&error)))
}

pub(crate) fn unwritable(path: &Path, why: &str) -> Stopped {
    let message = format!("cannot write {}: {why}", display_name(path));
    Stopped::new(Exit::Failed, Diagnostic::error(codes::F103, message))
}

fn read_bounded(reader: impl Read) -> std::io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    reader.take(MAX_SCENE_BYTES + 1).read_to_end(&mut bytes)?;
    Ok(bytes)
}

fn unreadable(path: &Path, why: &str) -> Stopped {
    let message = format!("cannot read {}: {why}", display_name(path));
    Stopped::new(Exit::SceneWrong, Diagnostic::error(codes::F101, message))
}

fn not_utf8(path: &Path, error: &std::string::FromUtf8Error) -> Stopped {
    let position = error.utf8_error().valid_up_to();
    let line = error.as_bytes()[..position].iter().filter(|&&byte| byte == b'\n').count() + 1;
    let message = format!(
        "cannot read {}: it is not UTF-8 text, byte {position} (line {line}) starts no character",
        display_name(path)
    );
    let help = "save the file as UTF-8; from Latin-1: iconv -f latin1 -t utf-8";
    Stopped::new(Exit::SceneWrong, Diagnostic::error(codes::F102, message).help(help))
}

fn reason(error: &std::io::Error) -> String {
    match error.kind() {
        ErrorKind::NotFound => "no such file or folder".to_owned(),
        ErrorKind::PermissionDenied => "permission denied".to_owned(),
        ErrorKind::AlreadyExists => "it exists already".to_owned(),
        ErrorKind::IsADirectory => "it is a directory".to_owned(),
        ErrorKind::NotADirectory => "a part of the path is not a directory".to_owned(),
        ErrorKind::StorageFull => "no space left on the device".to_owned(),
        ErrorKind::ReadOnlyFilesystem => "the file system is read-only".to_owned(),
        _ => error.to_string(),
    }
}

#[cfg(unix)]
fn default_permissions() -> std::fs::Permissions {
    use std::os::unix::fs::PermissionsExt;
    std::fs::Permissions::from_mode(0o644)
}

//! What the tables of a sweep were when they were made: size and hash of each file.
//!
//! Owns `manifest.json`. May use the files of a folder. It deliberately mends nothing: tables are made
//! again from the journals.

use crate::table::WrittenFile;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{Read, Write};
use std::path::Path;

/// Its name in the folder of a sweep.
pub const MANIFEST: &str = "manifest.json";

#[derive(Debug, Serialize, Deserialize)]
struct Manifest {
    version: u32,
    files: Vec<Listed>,
}

#[derive(Debug, Serialize, Deserialize)]
struct Listed {
    name: String,
    bytes: u64,
    blake3: String,
}

/// A file that is not what it was.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Problem {
    pub name: String,
    pub what: &'static str,
}

/// Lists the files as they are now, whole or not at all.
pub fn write(folder: &Path, files: &[WrittenFile]) -> std::io::Result<()> {
    let listed = files.iter().map(|file| {
        let (bytes, blake3) = hash(&folder.join(&file.name))?;
        Ok(Listed { name: file.name.clone(), bytes, blake3 })
    });
    let manifest = Manifest { version: 1, files: listed.collect::<std::io::Result<_>>()? };
    let mut text = serde_json::to_string_pretty(&manifest)?;
    text.push('\n');
    let mut draft = tempfile::Builder::new().prefix(".manifest.tmp-").tempfile_in(folder)?;
    draft.write_all(text.as_bytes())?;
    draft.as_file().sync_all()?;
    draft.persist(folder.join(MANIFEST)).map_err(|error| error.error)?;
    Ok(())
}

/// Files that are missing or changed; nothing if there is no manifest, as before the first tables.
pub fn check(folder: &Path) -> Option<Vec<Problem>> {
    let text = std::fs::read_to_string(folder.join(MANIFEST)).ok()?;
    let Ok(manifest) = serde_json::from_str::<Manifest>(&text) else {
        return Some(vec![Problem { name: MANIFEST.to_owned(), what: "is damaged" }]);
    };
    let problem = |listed: &Listed| {
        let what = match hash(&folder.join(&listed.name)) {
            Err(_) => "is missing or cannot be read",
            Ok((bytes, _)) if bytes != listed.bytes => "has another size than it was written with",
            Ok((_, blake3)) if blake3 != listed.blake3 => "has other bytes than it was written with",
            Ok(_) => return None,
        };
        Some(Problem { name: listed.name.clone(), what })
    };
    Some(manifest.files.iter().filter_map(problem).collect())
}

/// Size and BLAKE3, read in pieces.
fn hash(path: &Path) -> std::io::Result<(u64, String)> {
    let (mut file, mut hasher) = (File::open(path)?, blake3::Hasher::new());
    let (mut piece, mut bytes) = (vec![0; 1 << 16], 0);
    loop {
        let n = file.read(&mut piece)?;
        if n == 0 {
            return Ok((bytes, hasher.finalize().to_hex().to_string()));
        }
        hasher.update(&piece[..n]);
        bytes += n as u64;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changed_and_missing_files_are_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        assert_eq!(check(folder.path()), None);
        let names = ["a", "b", "c", "d"];
        names.iter().for_each(|name| std::fs::write(path(name), format!("file {name}")).unwrap());
        let file = |name: &&str| WrittenFile { name: (*name).to_owned(), n_rows: 0, n_bytes: 6 };
        write(folder.path(), &names.iter().map(file).collect::<Vec<_>>()).unwrap();
        assert_eq!(check(folder.path()), Some(vec![]));
        std::fs::write(path("b"), "FILE b").unwrap();
        std::fs::write(path("c"), "file c and more").unwrap();
        std::fs::remove_file(path("d")).unwrap();
        let found = check(folder.path()).unwrap();
        let named: Vec<(&str, &str)> =
            found.iter().map(|problem| (problem.name.as_str(), problem.what)).collect();
        assert_eq!(named.len(), 3);
        assert!(named[0].0 == "b" && named[0].1.contains("other bytes"));
        assert!(named[1].0 == "c" && named[1].1.contains("another size"));
        assert!(named[2].0 == "d" && named[2].1.contains("missing"));
        std::fs::write(path(MANIFEST), "{").unwrap();
        assert_eq!(check(folder.path()).unwrap()[0].name, MANIFEST);
    }
}

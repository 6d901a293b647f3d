//! Solved flows in a folder, by what they follow from.
//!
//! Owns the form of its entries. May use the flow. It deliberately stops no run: an entry that is not there, is damaged
//! or cannot be written means that the flow is solved for, and nothing else.
//!
//! An entry is a line of text, the key, the counts, the numbers with all their bits, and the BLAKE3 of all that.

use super::memo::Key;
use super::{Cells, FaceFlow, Sink};
use std::io::Write;
use std::path::{Path, PathBuf};

const MARK: &[u8] = b"Lamella flow, version 1\n";
const HASH: usize = 32;
/// Flows of fewer cells are solved for in a moment.
pub const FEWEST_CELLS: usize = 20_000;
/// Bytes of all entries of a folder; what does not fit is not kept.
pub const MOST_BYTES: u64 = 2 << 30;

/// The name of an entry.
pub fn path(folder: &Path, key: &Key) -> PathBuf {
    let name: String = key[..16].iter().map(|byte| format!("{byte:02x}")).collect();
    folder.join(format!("{name}.flow"))
}

/// The flow of a key; nothing if there is no sound entry.
pub fn load(folder: &Path, key: &Key) -> Option<FaceFlow> {
    let bytes = std::fs::read(path(folder, key)).ok()?;
    let (body, hash) = bytes.split_at_checked(bytes.len().checked_sub(HASH)?)?;
    if blake3::hash(body).as_bytes() != hash {
        return None;
    }
    let mut rest = body.strip_prefix(MARK)?.strip_prefix(key.as_slice())?;
    let flow = take_flow(&mut rest)?;
    rest.is_empty().then_some(flow)
}

/// Keeps a flow, whole or not at all.
pub fn save(folder: &Path, key: &Key, flow: &FaceFlow) -> std::io::Result<()> {
    std::fs::create_dir_all(folder)?;
    let mut bytes = [MARK, key.as_slice()].concat();
    put_flow(flow, &mut bytes);
    let hash = blake3::hash(&bytes);
    bytes.extend_from_slice(hash.as_bytes());
    let own = path(folder, key);
    if size_without(folder, &own)? + bytes.len() as u64 > MOST_BYTES {
        return Ok(());
    }
    let mut file = tempfile::Builder::new().prefix(".lamella.tmp-").tempfile_in(folder)?;
    file.write_all(&bytes)?;
    file.as_file().sync_all()?;
    file.persist(own)?;
    Ok(())
}

/// Removes all entries but those of these keys.
pub fn keep_only(folder: &Path, keys: &[Key]) {
    let kept: Vec<PathBuf> = keys.iter().map(|key| path(folder, key)).collect();
    for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        if path.extension().is_some_and(|ending| ending == "flow") && !kept.contains(&path) {
            // What cannot be removed stays: it takes room, and is never wrong.
            drop(std::fs::remove_file(&path));
        }
    }
}

/// Bytes of the entries of a folder but one.
fn size_without(folder: &Path, own: &Path) -> std::io::Result<u64> {
    let mut sum = 0;
    for entry in std::fs::read_dir(folder)?.flatten() {
        if entry.path() != own {
            sum += entry.metadata().map_or(0, |metadata| metadata.len());
        }
    }
    Ok(sum)
}

fn put_flow(flow: &FaceFlow, out: &mut Vec<u8>) {
    flow.cells.edges().iter().for_each(|edges| put_numbers(edges, out));
    flow.flux.iter().for_each(|flux| put_numbers(flux, out));
    put_numbers(&flow.porosity, out);
    for optional in [&flow.head, &flow.conductivity] {
        out.push(u8::from(optional.is_some()));
        put_numbers(optional.as_deref().unwrap_or_default(), out);
    }
    put_count(flow.sinks.len(), out);
    for sink in &flow.sinks {
        put_count(sink.cell, out);
        out.extend_from_slice(&sink.rate.to_le_bytes());
        put_count(sink.owner, out);
    }
}

fn put_count(count: usize, out: &mut Vec<u8>) {
    out.extend_from_slice(&(count as u64).to_le_bytes());
}

fn put_numbers(numbers: &[f64], out: &mut Vec<u8>) {
    put_count(numbers.len(), out);
    numbers.iter().for_each(|number| out.extend_from_slice(&number.to_le_bytes()));
}

fn take_flow(rest: &mut &[u8]) -> Option<FaceFlow> {
    let edges = [take_numbers(rest)?, take_numbers(rest)?, take_numbers(rest)?];
    let cells = Cells::new(edges)?;
    let flux = [take_numbers(rest)?, take_numbers(rest)?, take_numbers(rest)?];
    let porosity = take_numbers(rest)?;
    let mut optional = || {
        let is_there = take_byte(rest)?;
        let numbers = take_numbers(rest)?;
        Some((is_there == 1).then_some(numbers))
    };
    let (head, conductivity) = (optional()?, optional()?);
    let n_sinks = take_count(rest)?;
    let mut sinks = Vec::new();
    for _ in 0..n_sinks {
        let cell = take_count(rest)?;
        let rate = f64::from_bits(take_word(rest)?);
        sinks.push(Sink { cell, rate, owner: take_count(rest)? });
    }
    let n = cells.n_cells();
    let optional = [&head, &conductivity];
    let is_sound = (0..3).all(|axis| flux[axis].len() == cells.n_faces(axis))
        && porosity.len() == n
        && optional.into_iter().flatten().all(|numbers| numbers.len() == n)
        && sinks.iter().all(|sink| sink.cell < n);
    is_sound.then_some(FaceFlow { cells, flux, porosity, head, conductivity, sinks })
}

fn take_byte(rest: &mut &[u8]) -> Option<u8> {
    let (&byte, after) = rest.split_first()?;
    *rest = after;
    Some(byte)
}

fn take_word(rest: &mut &[u8]) -> Option<u64> {
    let (word, after) = rest.split_first_chunk::<8>()?;
    *rest = after;
    Some(u64::from_le_bytes(*word))
}

fn take_count(rest: &mut &[u8]) -> Option<usize> {
    usize::try_from(take_word(rest)?).ok()
}

fn take_numbers(rest: &mut &[u8]) -> Option<Vec<f64>> {
    let n = take_count(rest)?;
    let (bytes, after) = rest.split_at_checked(n.checked_mul(8)?)?;
    *rest = after;
    Some(bytes.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn flow() -> FaceFlow {
        let cells = Cells::equal([0.0; 3], [3.0, 2.0, 1.0], [3, 2, 1]).unwrap();
        let flux = [0, 1, 2].map(|axis| (0..cells.n_faces(axis)).map(|face| face as f64 / 3.0).collect());
        let sinks = vec![Sink { cell: 4, rate: -0.0, owner: 1 << 32 }];
        FaceFlow {
            cells,
            flux,
            porosity: vec![0.3; 6],
            head: Some(vec![1e-300; 6]),
            conductivity: None,
            sinks,
        }
    }

    #[test]
    fn a_flow_comes_back_with_all_its_bits() {
        let folder = tempfile::tempdir().unwrap();
        let inner = folder.path().join("a/b");
        assert_eq!(load(&inner, &[7; 32]), None);
        save(&inner, &[7; 32], &flow()).unwrap();
        let back = load(&inner, &[7; 32]).unwrap();
        assert_eq!(back, flow());
        assert_eq!(back.sinks[0].rate.to_bits(), (-0.0_f64).to_bits());
        assert_eq!(load(&inner, &[8; 32]), None);
        save(&inner, &[9; 32], &flow()).unwrap();
        keep_only(&inner, &[[9; 32]]);
        assert_eq!((load(&inner, &[7; 32]), load(&inner, &[9; 32])), (None, Some(flow())));
        assert_eq!(std::fs::read_dir(&inner).unwrap().count(), 1, "nothing else is left behind");
    }

    /// Whatever happens to an entry, it is either what was kept or nothing.
    #[test]
    fn damage_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let key = [7; 32];
        save(folder.path(), &key, &flow()).unwrap();
        let file = path(folder.path(), &key);
        let whole = std::fs::read(&file).unwrap();
        for at in 0..whole.len() {
            let mut damaged = whole.clone();
            damaged[at] ^= 0x10;
            std::fs::write(&file, &damaged).unwrap();
            assert_eq!(load(folder.path(), &key), None, "byte {at}");
            std::fs::write(&file, &whole[..at]).unwrap();
            assert_eq!(load(folder.path(), &key), None, "cut at {at}");
        }
        // Another entry under this name, sound in itself.
        save(folder.path(), &[8; 32], &flow()).unwrap();
        std::fs::rename(path(folder.path(), &[8; 32]), &file).unwrap();
        assert_eq!(load(folder.path(), &key), None);
        // Sound sums over counts that fit nothing.
        let mut body = [MARK, key.as_slice()].concat();
        body.extend_from_slice(&u64::MAX.to_le_bytes());
        let hash = blake3::hash(&body);
        body.extend_from_slice(hash.as_bytes());
        std::fs::write(&file, &body).unwrap();
        assert_eq!(load(folder.path(), &key), None);
    }
}

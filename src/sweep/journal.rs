//! The memory of a sweep: an append-only file of frames, each with its checksum.
//!
//! Owns the file's form and its lock. May use `frame` and `codec`. It deliberately trusts no byte: a
//! frame that a killed program left behind is cut off, one that was damaged is named and not used.

use super::Key;
use super::codec::Code;
use super::frame::{Head, Replicate, Session};
use crate::table::Status;
use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{BufReader, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Begins every frame.
const MAGIC: [u8; 4] = *b"LmJ2";

/// Magic, kind, length.
const HEAD: usize = 16;

/// BLAKE3, the first half.
const CHECKSUM: usize = 16;

/// A frame that says it is longer is damaged.
const MAX_PAYLOAD: u64 = 1 << 36;

const REPLICATE: u32 = 1;
const SESSION: u32 = 2;

/// Longest time that a finished replicate waits to be safe from a loss of power; a program that is
/// killed loses nothing.
const SYNC: Duration = Duration::from_secs(2);

/// Wall seconds of a replicate that is synced as soon as it is written.
const WORTH_A_SYNC: f64 = 0.5;

/// Where a replicate stands, and what has to be known of it without reading it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    offset: u64,
    pub session: u32,
    pub status: Status,
}

impl Entry {
    pub fn is_done(&self) -> bool {
        self.status == Status::Done
    }
}

/// Why a journal cannot be used.
#[derive(Debug)]
pub enum JournalError {
    /// Another program writes to it.
    InUse(PathBuf),
    System {
        path: PathBuf,
        doing: &'static str,
        reason: std::io::Error,
    },
    /// It begins with something else than a journal of this version.
    Foreign(PathBuf),
    /// A worker of the sweep ended by itself: a fault of this program.
    Worker(String),
    /// A frame that was whole when the file was opened is not any more.
    Damaged {
        path: PathBuf,
        offset: u64,
    },
}

impl std::fmt::Display for JournalError {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::InUse(path) => write!(f, "{} is in use by another lamella", path.display()),
            Self::System { path, doing, reason } => {
                let full = reason.kind() == std::io::ErrorKind::StorageFull;
                let reason = if full { "no space left on the device".to_owned() } else { reason.to_string() };
                write!(f, "cannot {doing} {}: {reason}", path.display())
            }
            Self::Foreign(path) => {
                write!(f, "{} is no journal of this version: it is left as it is", path.display())
            }
            Self::Worker(what) => write!(f, "a fault of this program: {what}"),
            Self::Damaged { path, offset } => {
                write!(f, "{} is damaged at byte {offset}: it was changed while in use", path.display())
            }
        }
    }
}

/// An open journal.
pub struct Journal {
    path: PathBuf,
    file: File,
    end: u64,
    entries: HashMap<Key, Entry>,
    pub sessions: Vec<Session>,
    /// Byte ranges that hold no whole frame.
    pub damaged: Vec<(u64, u64)>,
    synced: Instant,
}

impl Journal {
    /// Opens or makes the file, and reads what is there. Bytes after the last whole frame are cut off if
    /// they are the beginning of one: that is what a killed program leaves.
    pub fn open(path: &Path) -> Result<Self, JournalError> {
        let fail = |doing| move |reason| JournalError::System { path: path.to_path_buf(), doing, reason };
        if let Some(folder) = path.parent() {
            std::fs::create_dir_all(folder).map_err(fail("make the folder of"))?;
        }
        let file =
            OpenOptions::new().read(true).append(true).create(true).open(path).map_err(fail("open"))?;
        match file.try_lock() {
            Err(std::fs::TryLockError::WouldBlock) => return Err(JournalError::InUse(path.to_path_buf())),
            // Some file systems know no locks.
            Ok(()) | Err(std::fs::TryLockError::Error(_)) => {}
        }
        let mut journal = Self::read(path, file)?;
        let length = journal.file.metadata().map_err(fail("read"))?.len();
        if journal.end < length {
            journal.file.set_len(journal.end).map_err(fail("cut"))?;
        }
        // The name of a new file is safe only when its folder is.
        if let Some(folder) = path.parent().filter(|_| length == 0) {
            File::open(folder).and_then(|folder| folder.sync_all()).map_err(fail("sync the folder of"))?;
        }
        journal.synced = Instant::now();
        Ok(journal)
    }

    /// Reads a journal that others may be writing to, without touching it.
    pub fn look(path: &Path) -> Result<Self, JournalError> {
        let fail = |reason| JournalError::System { path: path.to_path_buf(), doing: "read", reason };
        Self::read(path, File::open(path).map_err(fail)?)
    }

    fn read(path: &Path, file: File) -> Result<Self, JournalError> {
        let mut journal = Self {
            path: path.to_path_buf(),
            file,
            end: 0,
            entries: HashMap::new(),
            sessions: Vec::new(),
            damaged: Vec::new(),
            synced: Instant::now(),
        };
        journal.scan().map_err(|reason| journal.system("read", reason))?;
        if journal.end == 0 && journal.is_foreign().map_err(|reason| journal.system("read", reason))? {
            return Err(JournalError::Foreign(path.to_path_buf()));
        }
        Ok(journal)
    }

    /// Whether a file without a whole frame begins like none: not with the magic, nor with a part of it.
    fn is_foreign(&self) -> std::io::Result<bool> {
        let mut begin = Vec::new();
        let mut reader = self.file.try_clone()?;
        reader.seek(SeekFrom::Start(0))?;
        reader.take(MAGIC.len() as u64).read_to_end(&mut begin)?;
        Ok(!MAGIC.starts_with(&begin))
    }

    fn system(&self, doing: &'static str, reason: std::io::Error) -> JournalError {
        JournalError::System { path: self.path.clone(), doing, reason }
    }

    /// Reads all frames; `end` is that of the last whole one.
    fn scan(&mut self) -> std::io::Result<()> {
        let length = self.file.metadata()?.len();
        let mut reader = BufReader::with_capacity(1 << 20, self.file.try_clone()?);
        let mut offset = 0;
        let mut payload = Vec::new();
        while offset < length {
            reader.seek(SeekFrom::Start(offset))?;
            match read_frame(&mut reader, length - offset, &mut payload)? {
                Some((kind, size)) => {
                    self.note(kind, offset, &payload);
                    offset += size;
                    self.end = offset;
                }
                None => {
                    // The next frame that is whole, if there is one: what lies between is damaged.
                    let Some(next) = next_frame(&mut reader, offset + 1, length, &mut payload)? else {
                        // A frame that was being written when the program ended is no damage.
                        reader.seek(SeekFrom::Start(offset))?;
                        if !is_torn(&mut reader, length - offset)? {
                            self.damaged.push((offset, length));
                        }
                        break;
                    };
                    self.damaged.push((offset, next));
                    offset = next;
                }
            }
        }
        Ok(())
    }

    fn note(&mut self, kind: u32, offset: u64, mut payload: &[u8]) {
        match kind {
            REPLICATE => {
                if let Some(head) = Head::take(&mut payload) {
                    let (status, session) = (head.row.status, head.session);
                    self.entries.insert(head.key, Entry { offset, status, session });
                }
            }
            SESSION => self.sessions.extend(Session::take(&mut payload)),
            // A later version's frame.
            _ => {}
        }
    }

    pub fn entry(&self, key: &Key) -> Option<Entry> {
        self.entries.get(key).copied()
    }

    /// All replicates, in the order in which they were written.
    pub fn entries(&self) -> Vec<(Key, Entry)> {
        let mut list: Vec<(Key, Entry)> = self.entries.iter().map(|(key, entry)| (*key, *entry)).collect();
        list.sort_by_key(|(_, entry)| entry.offset);
        list
    }

    pub fn n_bytes(&self) -> u64 {
        self.end
    }

    /// Replicates of any ending.
    pub fn len(&self) -> usize {
        self.entries.len()
    }

    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Reads a replicate again; its checksum is looked at once more.
    pub fn replicate(&self, entry: Entry) -> Result<Replicate, JournalError> {
        let damaged = || JournalError::Damaged { path: self.path.clone(), offset: entry.offset };
        let mut head = [0; HEAD];
        read_at(&self.file, &mut head, entry.offset).map_err(|reason| self.system("read", reason))?;
        let size = size_of(&head).filter(|size| *size <= self.end - entry.offset).ok_or_else(damaged)?;
        let mut bytes = vec![0; size as usize];
        read_at(&self.file, &mut bytes, entry.offset).map_err(|reason| self.system("read", reason))?;
        let mut payload = Vec::new();
        let frame = read_frame(&mut &bytes[..], size, &mut payload);
        match frame {
            Ok(Some((REPLICATE, _))) => Replicate::take(&mut &payload[..]).ok_or_else(damaged),
            _ => Err(damaged()),
        }
    }

    pub fn add_session(&mut self, session: Session) -> Result<u32, JournalError> {
        self.append(SESSION, |frame| session.put(frame))?;
        self.sync()?;
        self.sessions.push(session);
        Ok(self.sessions.len() as u32 - 1)
    }

    pub fn add(&mut self, replicate: &Replicate) -> Result<(), JournalError> {
        let offset = self.end;
        self.append(REPLICATE, |frame| replicate.put(frame))?;
        let status = replicate.row.status;
        self.entries.insert(replicate.key, Entry { offset, status, session: replicate.session });
        // What took long to run is worth a sync of its own.
        if replicate.row.wall > WORTH_A_SYNC || self.synced.elapsed() > SYNC {
            self.sync()?;
        }
        Ok(())
    }

    /// One write per frame: a kill leaves it whole or cut, and a full disk is undone.
    fn append(&mut self, kind: u32, put: impl FnOnce(&mut Vec<u8>)) -> Result<(), JournalError> {
        let mut frame = vec![0; HEAD];
        put(&mut frame);
        let length = (frame.len() - HEAD) as u64;
        frame[..4].copy_from_slice(&MAGIC);
        frame[4..8].copy_from_slice(&kind.to_le_bytes());
        frame[8..HEAD].copy_from_slice(&length.to_le_bytes());
        let checksum = checksum(&frame);
        frame.extend_from_slice(&checksum);
        if let Err(reason) = self.file.write_all(&frame) {
            // Best effort: what stays is cut off when the file is opened again.
            let _ = self.file.set_len(self.end);
            return Err(self.system("write to", reason));
        }
        self.end += frame.len() as u64;
        Ok(())
    }

    pub fn sync(&mut self) -> Result<(), JournalError> {
        self.synced = Instant::now();
        self.file.sync_data().map_err(|reason| self.system("sync", reason))
    }
}

fn checksum(bytes: &[u8]) -> [u8; CHECKSUM] {
    let hash = *blake3::hash(bytes).as_bytes();
    std::array::from_fn(|idx| hash[idx])
}

/// The size of the frame that begins so; nothing if none does.
fn size_of(head: &[u8; HEAD]) -> Option<u64> {
    let length = u64::from_le_bytes(std::array::from_fn(|idx| head[8 + idx]));
    (head[..4] == MAGIC && length <= MAX_PAYLOAD).then(|| length + (HEAD + CHECKSUM) as u64)
}

/// Whether the last bytes are the beginning of a frame that is longer than they are.
fn is_torn(reader: &mut impl Read, left: u64) -> std::io::Result<bool> {
    let mut head = Vec::new();
    reader.take(HEAD as u64).read_to_end(&mut head)?;
    if head.len() < HEAD {
        return Ok(MAGIC.starts_with(&head[..head.len().min(MAGIC.len())]));
    }
    let head: [u8; HEAD] = std::array::from_fn(|idx| head[idx]);
    Ok(size_of(&head).is_some_and(|size| size > left))
}

/// Kind and size of the frame that begins here, its payload in `payload`; nothing if it is not whole.
fn read_frame(
    reader: &mut impl Read,
    left: u64,
    payload: &mut Vec<u8>,
) -> std::io::Result<Option<(u32, u64)>> {
    if left < (HEAD + CHECKSUM) as u64 {
        return Ok(None);
    }
    let mut head = [0; HEAD];
    reader.read_exact(&mut head)?;
    let kind = u32::from_le_bytes([head[4], head[5], head[6], head[7]]);
    let Some(size) = size_of(&head).filter(|size| *size <= left) else { return Ok(None) };
    let length = size - (HEAD + CHECKSUM) as u64;
    payload.clear();
    payload.extend_from_slice(&head);
    payload.resize(HEAD + length as usize, 0);
    reader.read_exact(&mut payload[HEAD..])?;
    let mut found = [0; CHECKSUM];
    reader.read_exact(&mut found)?;
    if checksum(payload) != found {
        return Ok(None);
    }
    payload.drain(..HEAD);
    Ok(Some((kind, size)))
}

/// The first whole frame at or after `from`.
fn next_frame(
    reader: &mut (impl Read + Seek),
    from: u64,
    length: u64,
    payload: &mut Vec<u8>,
) -> std::io::Result<Option<u64>> {
    const WINDOW: usize = 1 << 16;
    let mut start = from;
    while start + (HEAD + CHECKSUM) as u64 <= length {
        let mut window = vec![0; WINDOW.min((length - start) as usize)];
        reader.seek(SeekFrom::Start(start))?;
        reader.read_exact(&mut window)?;
        for place in window.windows(MAGIC.len()).enumerate().filter(|(_, w)| *w == MAGIC).map(|(idx, _)| idx)
        {
            let offset = start + place as u64;
            reader.seek(SeekFrom::Start(offset))?;
            if read_frame(reader, length - offset, payload)?.is_some() {
                return Ok(Some(offset));
            }
        }
        // The magic may lie across the end of the window.
        start += (window.len() - (MAGIC.len() - 1)).max(1) as u64;
    }
    Ok(None)
}

#[cfg(unix)]
fn read_at(file: &File, bytes: &mut [u8], offset: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, bytes, offset)
}

#[cfg(not(unix))]
fn read_at(file: &File, bytes: &mut [u8], offset: u64) -> std::io::Result<()> {
    let mut file = file.try_clone()?;
    file.seek(SeekFrom::Start(offset))?;
    file.read_exact(bytes)
}

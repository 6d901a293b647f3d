//! What a journal holds: finished replicates, and the sessions that ran them.
//!
//! Owns their content. May use the tables' rows and snapshots. It deliberately holds no point number:
//! that is a matter of the sweep's present definition.

use super::Key;
use super::codec::Code;
use crate::engine::snapshot::Snapshot;
use crate::table::{ErrorRow, PointRow};

/// A replicate that ended, well or not.
#[derive(Debug, Clone, PartialEq)]
pub struct Replicate {
    pub key: Key,
    /// Hash of the references and measures that its errors and values come from.
    pub evaluation: Key,
    /// Number of the session that ran it.
    pub session: u32,
    /// Point number and write time are filled in when tables are made.
    pub row: PointRow,
    pub errors: Vec<ErrorRow>,
    pub snapshots: Vec<Snapshot>,
}

impl Replicate {
    /// Whether results, errors and measures are the same, bit by bit. `is_timed` tells of the measures
    /// that hang on the clock, which are not compared.
    pub fn has_bytes_of(&self, other: &Self, is_timed: &dyn Fn(&str) -> bool) -> bool {
        let bytes = |replicate: &Self| {
            let mut bytes = Vec::new();
            replicate.snapshots.put(&mut bytes);
            replicate.errors.put(&mut bytes);
            replicate.row.status.put(&mut bytes);
            for value in replicate.row.values.iter().filter(|value| !is_timed(&value.name)) {
                value.name.put(&mut bytes);
                value.unit.put(&mut bytes);
                value.value.put(&mut bytes);
            }
            bytes
        };
        bytes(self) == bytes(other)
    }
}

/// One start of the program on this journal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Session {
    /// Names and texts of the scene's files.
    pub sources: Vec<(String, String)>,
    /// Names and hashes of the files of numbers.
    pub data: Vec<(String, String)>,
    /// `--set name=value`
    pub set: Vec<(String, String)>,
    pub seed: Option<u64>,
    pub sweep: String,
    pub version: String,
    /// Microseconds since 1970, UTC.
    pub started: i64,
    /// What was known of the machine and the repository, as pairs.
    pub facts: Vec<(String, String)>,
}

impl Code for Replicate {
    fn put(&self, out: &mut Vec<u8>) {
        self.key.put(out);
        self.evaluation.put(out);
        self.session.put(out);
        self.row.put(out);
        self.errors.put(out);
        self.snapshots.put(out);
    }

    fn take(input: &mut &[u8]) -> Option<Self> {
        Some(Self {
            key: Code::take(input)?,
            evaluation: Code::take(input)?,
            session: Code::take(input)?,
            row: Code::take(input)?,
            errors: Code::take(input)?,
            snapshots: Code::take(input)?,
        })
    }
}

/// The first parts of a replicate: enough to know it by.
pub struct Head {
    pub key: Key,
    pub session: u32,
    pub row: PointRow,
}

impl Head {
    pub fn take(input: &mut &[u8]) -> Option<Self> {
        let key = Key::take(input)?;
        Key::take(input)?;
        Some(Self { key, session: u32::take(input)?, row: PointRow::take(input)? })
    }
}

impl Code for (String, String) {
    fn put(&self, out: &mut Vec<u8>) {
        self.0.put(out);
        self.1.put(out);
    }

    fn take(input: &mut &[u8]) -> Option<Self> {
        Some((Code::take(input)?, Code::take(input)?))
    }
}

impl Code for Session {
    fn put(&self, out: &mut Vec<u8>) {
        self.sources.put(out);
        self.set.put(out);
        self.seed.put(out);
        self.sweep.put(out);
        self.version.put(out);
        self.started.put(out);
        self.facts.put(out);
        self.data.put(out);
    }

    fn take(input: &mut &[u8]) -> Option<Self> {
        let mut session = Self {
            sources: Code::take(input)?,
            data: Vec::new(),
            set: Code::take(input)?,
            seed: Code::take(input)?,
            sweep: Code::take(input)?,
            version: Code::take(input)?,
            started: Code::take(input)?,
            facts: Code::take(input)?,
        };
        // Journals of earlier versions end here.
        if !input.is_empty() {
            session.data = Code::take(input)?;
        }
        Some(session)
    }
}

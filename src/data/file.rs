//! A file of numbers: its bytes, and what has been made of them.
//!
//! Owns the memory of earlier answers, so that the points of a sweep read a file once. May use columns and grids. It
//! deliberately never reads from disk: bytes are given.

use super::columns::{self, Column, Columns};
use super::error::ReadError;
use super::grid;
use super::table::{Rule, Table};
use bytes::Bytes;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// Which function of a file: its columns, the number of coordinates, the value, the rule.
type Key = (String, usize, usize, Rule);

/// A file that a scene reads numbers from. Two with one name and one hash are the same.
pub struct DataFile {
    pub name: String,
    pub bytes: Bytes,
    /// BLAKE3 of the bytes.
    pub hash: String,
    known: Mutex<Known>,
}

#[derive(Default)]
struct Known {
    columns: BTreeMap<String, Result<Arc<Columns>, ReadError>>,
    tables: BTreeMap<Key, Result<Arc<Table>, ReadError>>,
}

impl DataFile {
    pub fn new(name: impl Into<String>, bytes: impl Into<Bytes>) -> Self {
        let bytes = bytes.into();
        let hash = blake3::hash(&bytes).to_hex().to_string();
        Self { name: name.into(), bytes, hash, known: Mutex::default() }
    }

    /// What a table of ours says that its columns are in, by their names.
    pub fn units(&self) -> BTreeMap<String, String> {
        if self.bytes.starts_with(super::parquet::MAGIC) {
            super::parquet::units(&self.bytes)
        } else {
            BTreeMap::new()
        }
    }

    /// The declared columns.
    pub fn columns(&self, wanted: &[Column]) -> Result<Arc<Columns>, ReadError> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        self.columns_in(&mut known, wanted)
    }

    fn columns_in(&self, known: &mut Known, wanted: &[Column]) -> Result<Arc<Columns>, ReadError> {
        let read = || columns::read(&self.bytes, wanted).map(Arc::new);
        known.columns.entry(format!("{wanted:?}")).or_insert_with(read).clone()
    }

    /// The function of the first `n_axes` of the declared columns that column `value` gives.
    pub fn table(
        &self,
        wanted: &[Column],
        n_axes: usize,
        value: usize,
        rule: Rule,
    ) -> Result<Arc<Table>, ReadError> {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let key = (format!("{wanted:?}"), n_axes, value, rule);
        if let Some(table) = known.tables.get(&key) {
            return table.clone();
        }
        let table = self
            .columns_in(&mut known, wanted)
            .and_then(|columns| grid::table(&columns, wanted, n_axes, value, rule).map(Arc::new));
        known.tables.insert(key, table.clone());
        table
    }
}

impl PartialEq for DataFile {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name && self.hash == other.hash
    }
}

impl Eq for DataFile {}

impl std::fmt::Debug for DataFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} ({} bytes, {})", self.name, self.bytes.len(), self.hash)
    }
}

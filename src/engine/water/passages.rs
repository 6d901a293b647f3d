//! Parcels that pass a place where somebody counts.
//!
//! Owns what is kept of a passage until the species are known. May use the books of masses. It deliberately counts
//! nothing: gates do.

use super::super::mass::book::What;

/// Which places are watched.
#[derive(Debug, Clone, Default)]
pub struct Watched {
    /// Per side, twice the axis plus its end.
    pub sides: Vec<bool>,
}

impl Watched {
    pub fn has(&self, side: usize) -> bool {
        self.sides.get(side).copied().unwrap_or(false)
    }
}

/// What passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cargo {
    /// A parcel with all it carries.
    Parcel,
    /// What a side took from a parcel that touched it.
    Exchange,
}

/// One passage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Passed<const D: usize> {
    pub what: What,
    pub cargo: Cargo,
    /// The side that a parcel comes in through.
    pub entered_by: Option<usize>,
    pub id: u64,
    /// s
    pub t: f64,
    /// Where the parcel was at the beginning of the step, m.
    pub place: [f64; D],
}

/// Passages in order, with the columns that are carried.
#[derive(Debug, Clone, PartialEq)]
pub struct Passages<const D: usize> {
    pub list: Vec<Passed<D>>,
    pub columns: Vec<Vec<f64>>,
}

impl<const D: usize> Default for Passages<D> {
    fn default() -> Self {
        Self { list: Vec::new(), columns: Vec::new() }
    }
}

impl<const D: usize> Passages<D> {
    /// Adds a passage with the value of each column.
    pub fn push(&mut self, passed: Passed<D>, n_columns: usize, value: impl Fn(usize) -> f64) {
        self.list.push(passed);
        self.columns.resize_with(n_columns, Vec::new);
        self.columns.iter_mut().enumerate().for_each(|(idx, column)| column.push(value(idx)));
    }

    /// Takes those of another, behind its own.
    pub fn append(&mut self, mut other: Self) {
        self.list.append(&mut other.list);
        self.columns.resize_with(other.columns.len().max(self.columns.len()), Vec::new);
        self.columns.iter_mut().zip(&mut other.columns).for_each(|(own, other)| own.append(other));
    }
}

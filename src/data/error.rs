//! What can be wrong with a file of another program.
//!
//! Owns the kinds of such mistakes and where they are. May use the messages' guesses. It deliberately
//! knows no file names and no statement: who opened the file adds them.

use crate::diagnostic::did_you_mean;
use std::fmt;

/// What to do about it differs by kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Not a file of this format.
    Foreign,
    /// Ends too early, or contradicts itself.
    Damaged,
    /// Sound, and of a form that is not read.
    Unsupported,
    /// A column or a record that is needed is not there.
    Missing,
    /// A value that is no number, not finite or out of its range.
    Value,
    /// Points that do not fill a rectilinear grid, each once.
    Points,
    /// Parts that do not belong together: shapes, counts, times.
    Mismatch,
}

/// Where it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// From 0.
    Byte(usize),
    /// Both from 1; columns count characters.
    Text { line: usize, column: usize },
    /// From 1.
    Row(usize),
}

#[derive(Debug, Clone, PartialEq)]
pub struct ReadError {
    pub kind: Kind,
    pub message: String,
    pub place: Option<Place>,
    /// What would work.
    pub help: Option<String>,
}

impl ReadError {
    pub fn new(kind: Kind, message: impl Into<String>) -> Self {
        Self { kind, message: message.into(), place: None, help: None }
    }

    pub fn at(self, place: Place) -> Self {
        Self { place: Some(place), ..self }
    }

    pub fn help(self, help: impl Into<String>) -> Self {
        Self { help: Some(help.into()), ..self }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Byte(byte) => write!(f, "byte {byte}"),
            Self::Text { line, column } => write!(f, "line {line}, column {column}"),
            Self::Row(row) => write!(f, "row {row}"),
        }
    }
}

impl fmt::Display for ReadError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(place) = &self.place {
            write!(f, "{place}: ")?;
        }
        write!(f, "{}", self.message)?;
        if let Some(help) = &self.help {
            write!(f, "; {help}")?;
        }
        Ok(())
    }
}

impl std::error::Error for ReadError {}

/// Where rows are in their file.
#[derive(Debug, Default)]
pub enum RowPlaces {
    #[default]
    Counted,
    Lines(Vec<u32>),
}

impl RowPlaces {
    pub fn of(&self, row: usize) -> Place {
        match self {
            Self::Counted => Place::Row(row + 1),
            Self::Lines(lines) => Place::Text { line: lines[row] as usize, column: 1 },
        }
    }
}

/// The message for a column that is not there, with those that are.
pub fn no_column<'a>(name: &str, known: impl Iterator<Item = &'a str> + Clone) -> ReadError {
    let has: Vec<_> = known.clone().map(|name| format!("`{name}`")).collect();
    let error = ReadError::new(Kind::Missing, format!("there is no column `{name}`"));
    match did_you_mean(name, known) {
        Some(near) => error.help(format!("did you mean `{near}`? The table has {}", has.join(", "))),
        None => error.help(format!("the table has {}", has.join(", "))),
    }
}

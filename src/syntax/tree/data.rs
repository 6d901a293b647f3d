//! The statement of tables of numbers.
//!
//! Owns its shape. May use the tree. It deliberately knows no file: a path is text here.

use super::{Name, Text};
use crate::source::Spanned;

/// `data plume = "plume.csv" (x [m], c [mg/L]) steps "doc"`
#[derive(Debug, Clone, PartialEq)]
pub struct Data {
    pub name: Name,
    /// Relative to the folder of the file that names it.
    pub path: Text,
    pub columns: Vec<DataColumn>,
    /// `steps`, `linear`
    pub rule: Option<Name>,
    pub doc: Option<Text>,
}

/// `c [mg/L]`; a plain number without brackets.
#[derive(Debug, Clone, PartialEq)]
pub struct DataColumn {
    pub name: Name,
    pub unit: Option<Spanned<String>>,
}

//! Tables of numbers: bytes of files in, columns and functions out.
//!
//! Owns the formats (CSV, Parquet), the way from rows to a function of one to three coordinates, and what it is
//! between and beyond its rows. May use the words. It deliberately opens no file and knows no statement: bytes and
//! columns are given.

pub mod cloud;
pub mod columns;
pub mod csv;
pub mod error;
mod file;
mod grid;
pub mod parquet;
pub mod table;

pub use cloud::Cloud;
pub use columns::{Column, Columns, MAX_NUMBERS};
pub use error::{Kind, Place, ReadError};
pub use file::DataFile;
pub use table::{Beyond, Lookup, Rule, Table};

#[cfg(test)]
mod columns_tests;
#[cfg(test)]
mod damage_tests;
#[cfg(test)]
mod table_tests;

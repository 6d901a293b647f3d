//! Flow fields that other programs wrote.
//!
//! Owns the formats and the way from each to discharge through faces. May use the flow and its words. It
//! deliberately opens no file and mends no flow: bytes come in, and what does not add up is there to be
//! seen in `FaceFlow::balance`.

pub mod axes;
pub mod centred;
pub mod csv;
pub mod modflow6;
pub mod npy;
pub mod parquet;
pub mod points;
pub mod table;
pub mod window;

mod bytes;
mod npy_header;

pub use crate::data::error;
pub use centred::Quantity;
pub use error::{Kind, Place, ReadError};

/// The porosity of a cell, from its number and its middle (m).
pub type PorosityOf<'a> = &'a dyn Fn(usize, [f64; 3]) -> f64;

#[cfg(test)]
mod damage_tests;
#[cfg(test)]
mod npy_tests;
#[cfg(test)]
mod table_tests;

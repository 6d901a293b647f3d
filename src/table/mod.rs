//! From snapshots to Parquet: long tables with units, whole or absent, the same bytes every time.
//!
//! Owns the layout of a run's folder, the schemas, the footers and the way files come to be. May
//! use `plan` and `engine::snapshot`. It deliberately computes nothing: errors and measures are
//! handed in.

mod bins;
mod cells;
mod density;
mod failure;
mod footer;
mod gather;
mod lists;
mod points;
pub mod read;
mod record;
mod rows;
pub mod scan;
mod schema;
mod sheet;
mod stress;
mod unit;
mod writer;

pub use bins::{Grid, centre};
pub use density::{DensityCell, DensityTable, write_density};
pub use failure::TableError;
pub use footer::{Footer, KEY as FOOTER_KEY, Parameter as FooterParameter, VERSION as FOOTER_VERSION};
pub use gather::Gatherer;
pub use points::{Shape, is_fixed as is_fixed_column};
pub use read::is_complete;
pub use record::{
    ErrorBarRow, ErrorRow, Norms, Parameter, PointRow, Record, Status, Swept, SweptValue, Value,
};
pub use schema::Kind;
pub use stress::{StressRow, write_stress};
pub use unit::{ValueUnit, integrated, si_text, value_dimension, value_unit};
pub use writer::{Summary, Writer, WrittenFile};

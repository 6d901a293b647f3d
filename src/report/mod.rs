//! What a person looks at: the figure of a run, and its errors as rows and columns of the tables.
//!
//! Owns panels, units that read well, and the drawing. May use `plan`, `engine::snapshot`, `table`
//! and `measure`. It deliberately computes no result: references and errors are handed in.

mod canvas;
mod color;
mod display;
mod errors;
mod figure;
mod heat;
mod panel;
mod panels;
mod scale;
mod sweep;

pub use errors::{error_rows, error_values};
pub use figure::figure;
pub use sweep::{
    ExpectationOutcome, ExpectedOrder, SWEEP_FILE, SWEEP_VERSION, SweepAxis, SweepDescription,
    SweepExpectation, SweepReplicates, SweepReport, SweepReportKind,
};

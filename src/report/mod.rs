//! What a person looks at: the figure of a run, its errors as rows and columns of the tables, and the
//! report of a folder of results, and where they come from.
//!
//! Owns panels, units that read well, and the drawing. May use `plan`, `engine::snapshot`, `table`
//! and `measure`. It deliberately computes no result: references and errors are handed in, and a report
//! makes means and fits of what stands in the tables.

mod calendar;
mod canvas;
mod clip;
mod color;
mod display;
mod errors;
mod figure;
mod heat;
mod moments;
mod notes;
mod page;
mod panel;
mod panels;
mod ro_crate;
mod scale;
mod sweep;

pub use errors::{error_rows, error_values};
pub use figure::figure;
pub use page::{FILE_STEMS, Page, ReportError, report};
pub use ro_crate::{CRATE_FILE, Provenance, Start};
pub use sweep::{
    ExpectationOutcome, ExpectedOrder, SWEEP_FILE, SWEEP_VERSION, SweepAxis, SweepDescription,
    SweepExpectation, SweepReplicates, SweepReport, SweepReportKind,
};

//! Lamella: scenes of Lagrangian reactive transport, from text to tables.
//!
//! The flow: [`syntax::tree::File`] → `Scenario` → [`plan::Plan`] → [`engine::snapshot::Snapshot`] → `Table` → `Report`.

pub mod catalog;
pub mod diagnostic;
pub mod engine;
pub mod maths;
pub mod measure;
pub mod plan;
pub mod scenario;
pub mod source;
pub mod syntax;
pub mod table;
pub mod units;

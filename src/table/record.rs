//! What the tables tell about a run beyond the numbers of its snapshots.
//!
//! Owns the shapes that the command line fills in. May use `units`. It deliberately asks neither
//! the clock nor the system: whoever runs the plan does.

use crate::units::Dimension;

/// Where a run comes from. All of it goes into the footer of every data file, so nothing here may
/// depend on the machine, the path or the hour.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Record {
    pub scene_name: String,
    /// The scene as `lamella fmt` lays it out, so that formatting a scene changes no byte of a table.
    pub scene_text: String,
    /// The scene letter by letter, for `scene.lam`.
    pub scene_source: String,
    pub title: Option<String>,
    pub citations: Vec<String>,
    /// Files of numbers that the scene reads: names from its folder, and hashes.
    pub data: Vec<(String, String)>,
    pub parameters: Vec<Parameter>,
    /// `(species, quoted text)`
    pub species_docs: Vec<(String, String)>,
    /// Axes of the scene's domain, 1 to 3, those included that the plan left out.
    pub n_axes: usize,
    pub plan_hash: String,
    pub plan_yaml: String,
    /// Version of Lamella.
    pub version: String,
}

/// A `param` with the value of this run.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    pub name: String,
    pub value_si: f64,
    /// SI unit, `m^2/s`.
    pub unit: String,
    pub dimension: Dimension,
    pub doc: Option<String>,
}

/// How a point ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Status {
    Done,
    Failed,
    Interrupted,
}

impl Status {
    pub fn text(self) -> &'static str {
        match self {
            Self::Done => "done",
            Self::Failed => "failed",
            Self::Interrupted => "interrupted",
        }
    }

    pub fn from_text(text: &str) -> Option<Self> {
        [Self::Done, Self::Failed, Self::Interrupted].into_iter().find(|status| status.text() == text)
    }
}

/// A row of `points.parquet`: one point of a sweep, or a run of its own.
#[derive(Debug, Clone, PartialEq)]
pub struct PointRow {
    pub point: u32,
    pub replicate: u32,
    /// Hash of the point's plan.
    pub key: String,
    /// Swept values, each a typed column.
    pub swept: Vec<Swept>,
    pub seed: u64,
    pub status: Status,
    pub error_code: Option<String>,
    pub error_message: Option<String>,
    /// Wall seconds of the engine, of its step loop, and CPU seconds of the engine.
    pub wall: f64,
    pub loop_wall: f64,
    pub cpu: f64,
    /// Wall seconds from text to plan.
    pub compile_wall: f64,
    /// Wall seconds of writing tables; the writer's own measurement if absent.
    pub write_wall: Option<f64>,
    /// Bytes.
    pub peak_memory: Option<u64>,
    pub particles: u64,
    /// s
    pub step: f64,
    pub duration: f64,
    pub steps: u64,
    /// Accepted sub-steps of integrators, all particles together; absent if nothing is integrated.
    pub sub_steps: Option<u64>,
    /// Largest relative defect of any component.
    pub mass_defect: Option<f64>,
    /// Measures and errors of references (`limit.profile.AB.l2`), each a column.
    pub values: Vec<Value>,
    pub version: String,
    pub numerics: u32,
    pub host: String,
    pub threads: u32,
    /// Microseconds since 1970, UTC.
    pub started: i64,
    pub finished: i64,
}

/// A swept value.
#[derive(Debug, Clone, PartialEq)]
pub struct Swept {
    pub name: String,
    pub value: SweptValue,
}

#[derive(Debug, Clone, PartialEq)]
pub enum SweptValue {
    /// SI value and unit.
    Real(f64, String),
    Integer(i64),
    Text(String),
}

/// A number computed from the results of a point; `None` where it is not defined.
#[derive(Debug, Clone, PartialEq)]
pub struct Value {
    pub name: String,
    pub unit: String,
    pub value: Option<f64>,
}

/// Norms of result − reference over one output of one quantity, at one time or over all.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorRow {
    pub point: u32,
    pub replicate: u32,
    /// Seconds; `None` is all times of the output together.
    pub t: Option<f64>,
    pub reference: String,
    /// Index into the plan's outputs.
    pub output: u16,
    /// `profile`, `map`, `covariance`, `total` or `mixing`.
    pub kind: String,
    pub species_a: String,
    /// The second of a pair.
    pub species_b: Option<String>,
    /// Values compared: bins that are not empty, times.
    pub n: u64,
    /// Bins left out because they hold no particle.
    pub n_empty: u64,
    /// SI; `unit` is that of the compared field.
    pub norms: Norms,
    /// The same divided by the norm of the reference over the same bins; `None` where that is zero.
    pub relative: Option<Norms>,
    /// The L2 norm that sampling noise alone would give.
    pub noise: Option<f64>,
    pub unit: String,
}

/// L1 and L2 are integrals over space (unit × m^d and unit × m^(d/2)), L∞ and RMSE have the unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Norms {
    pub l1: f64,
    pub l2: f64,
    pub linf: f64,
    pub rmse: f64,
}

/// The expected error of one quantity of one output, at one time or over all, in the norm L2.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorBarRow {
    pub point: u32,
    pub replicate: u32,
    /// Seconds; `None` is all times of the output together.
    pub t: Option<f64>,
    /// Index into the plan's outputs.
    pub output: u16,
    /// `profile`, `map`, `covariance`, `total` or `mixing`.
    pub kind: String,
    pub species_a: String,
    /// The second of a pair.
    pub species_b: Option<String>,
    /// Values that it is estimated from.
    pub n: u64,
    /// SI; `unit` is that of the field. The result's own norm, then that of its error and of its parts.
    pub size: f64,
    pub total: f64,
    pub from_step: f64,
    pub from_particles: f64,
    pub from_bins: Option<f64>,
    /// `None` where the result is zero.
    pub relative: Option<f64>,
    pub unit: String,
}

//! Results against references: errors, curves to draw, and the scene's own measures.
//!
//! Owns the comparison of snapshots with solutions. May use the words, the catalogue, `plan` and the
//! engine's snapshots. It deliberately writes no file and runs no step.

mod errors;
mod field;
mod grid;
mod observed;
mod reference;
mod scalar;
#[cfg(test)]
mod tests;

use crate::engine::snapshot::{Outcome, Snapshot};
use crate::plan::evaluation::Evaluation;
use crate::plan::{OutputKind, Plan, Quantity};

/// Everything that is computed from one run.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Evaluated {
    pub errors: Vec<ErrorRow>,
    pub curves: Vec<Curve>,
    pub measures: Vec<MeasureValue>,
}

/// The difference between one output and one reference, in SI units.
///
/// Over space the norms are integrals with the bin widths (along the axis of a profile, over all axes
/// of a map); a total or a γ has no bins, and its norms are plain sums over times. The reference is
/// averaged over each bin (Gauss–Legendre, three points or more per bin and axis). Bins without
/// particles are left out and counted.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorRow {
    /// Index into `Evaluation::references`, and its name.
    pub reference_idx: usize,
    pub reference: String,
    /// Index into `plan.outputs`, and its kind.
    pub output_idx: usize,
    pub kind: OutputKind,
    pub quantity: Quantity,
    /// s; `None` for the row over all times of the output.
    pub t: Option<f64>,
    /// ∫ |f − r| dx
    pub l1: f64,
    /// (∫ (f − r)² dx)^½
    pub l2: f64,
    /// max |f − r|
    pub l_inf: f64,
    /// (mean of (f − r)² over bins)^½
    pub rmse: f64,
    /// The norms divided by those of the reference; `None` where the reference is zero.
    pub l1_relative: Option<f64>,
    pub l2_relative: Option<f64>,
    pub l_inf_relative: Option<f64>,
    /// The L2 norm that sampling noise alone would give, `(∫ se² dx)^½`, where the output has standard
    /// errors. An `l2` near it is noise, an `l2` far above it is an error of the method or the model.
    pub noise: Option<f64>,
    /// Bins (or times) that were compared, and those left out for want of particles.
    pub n_bins: u64,
    pub n_empty: u64,
}

/// A reference to draw, in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    pub reference: String,
    /// Index into `plan.outputs`.
    pub output_idx: usize,
    pub quantity: Quantity,
    /// s; `None` for a curve over time, whose `x` are times.
    pub t: Option<f64>,
    pub x: Vec<f64>,
    pub y: Vec<f64>,
}

/// A named number of the scene; not a number where the scene asks for one that does not exist (0/0).
#[derive(Debug, Clone, PartialEq)]
pub struct MeasureValue {
    pub name: String,
    pub unit: String,
    pub value: f64,
}

/// What a run found for one quantity of one output, in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct Fields {
    /// Length, area or volume that a sum over bins is weighted with in a norm.
    pub weight: f64,
    pub times: Vec<FieldAt>,
}

/// Values at one time over the bins of an output, one value for a total or a γ.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldAt {
    /// s
    pub t: f64,
    pub values: Vec<f64>,
    /// False for a bin that no particle was in.
    pub is_filled: Vec<bool>,
}

/// The values of a quantity of an output, as references are compared with them.
pub fn fields(
    plan: &Plan,
    snapshots: &[Snapshot],
    output_idx: usize,
    quantity: Quantity,
) -> Result<Fields, String> {
    let series = observed::series(plan, snapshots, output_idx, (quantity, 0))?;
    let times = series.times.into_iter();
    let field =
        |time: observed::Observed| FieldAt { t: time.t, values: time.values, is_filled: time.is_filled };
    Ok(Fields { weight: series.grid.weight, times: times.map(field).collect() })
}

/// Compares the snapshots of a finished run with all references and computes all measures.
///
/// An error is one sentence: a reference that cannot be built, or fields that do not fit together.
pub fn evaluate(
    plan: &Plan,
    evaluation: &Evaluation,
    snapshots: &[Snapshot],
    outcome: &Outcome,
) -> Result<Evaluated, String> {
    let references = reference::Prepared::all(evaluation)?;
    let run = observed::Run { plan, snapshots, outcome };
    let mut evaluated = Evaluated::default();
    for reference in &references {
        for (output_idx, output) in plan.outputs.iter().enumerate() {
            if reference.applies_to(output) {
                let comparison = errors::Comparison::new(&run, reference, output_idx)?;
                evaluated.errors.extend(comparison.rows());
                evaluated.curves.extend(comparison.curves()?);
            }
        }
    }
    let values = scalar::values(&run, &references, evaluation)?;
    for (measure, value) in evaluation.measures.iter().zip(values) {
        evaluated.measures.push(MeasureValue {
            name: measure.name.clone(),
            unit: measure.unit.clone(),
            value,
        });
    }
    Ok(evaluated)
}

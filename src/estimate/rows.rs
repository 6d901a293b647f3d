//! Error bars in the shape of their table.
//!
//! Owns names and units of the rows. May use `table`. It deliberately computes no norm.

use super::ErrorBar;
use crate::plan::{OutputKind, Plan, Quantity};
use crate::table::{ErrorBarRow, Kind, si_text, value_dimension};
use crate::units::Dimension;

/// Rows for point 0, replicate 0.
pub fn rows(plan: &Plan, n_axes: usize, bars: &[ErrorBar]) -> Vec<ErrorBarRow> {
    bars.iter().map(|bar| row(plan, n_axes, bar)).collect()
}

fn row(plan: &Plan, n_axes: usize, bar: &ErrorBar) -> ErrorBarRow {
    let name = |idx: usize| plan.species.get(idx).map_or_else(String::new, |species| species.name.clone());
    let (species_a, species_b) = match bar.quantity {
        Quantity::Species(s) => (name(s), None),
        Quantity::Pair(a, b) => (name(a), Some(name(b))),
    };
    // Of a mixing state it is γ whose error is told.
    let dimension = match bar.kind {
        OutputKind::Mixing => Dimension::NONE,
        kind => value_dimension(plan, kind, bar.quantity, n_axes),
    };
    ErrorBarRow {
        point: 0,
        replicate: 0,
        t: bar.t,
        output: bar.output_idx as u16,
        kind: Kind::from(bar.kind).name().to_owned(),
        species_a,
        species_b,
        n: bar.n,
        size: bar.size,
        total: bar.parts.total,
        from_step: bar.parts.step,
        from_particles: bar.parts.particles,
        from_bins: bar.parts.bins,
        relative: bar.relative(),
        unit: si_text(dimension),
    }
}

//! Axes along which nothing varies are not walked.
//!
//! With constant coefficients the walk along the other axes has the same law without them: their
//! drift and their block of the dispersion tensor stay what they are.

use super::Draft;
use crate::plan::tape::Operation;
use crate::plan::{Output, OutputKind, Plan, Side};

pub(super) fn run(draft: &mut Draft) {
    // Sides, sources and flows of tracks have places along every axis.
    // Distances of parcels, by which they exchange, are those over all axes.
    if draft.plan.transport.is_some() || draft.plan.exchange.is_some() {
        return;
    }
    let mut axis_idx = 0;
    while axis_idx < draft.plan.axes.len() {
        if draft.plan.axes.len() > 1 && is_idle(&draft.plan, axis_idx) {
            let name = ["x", "y", "z"][draft.plan.axes[axis_idx].index];
            remove(&mut draft.plan, axis_idx);
            draft.leave_out(
                format!("axis `{name}`"),
                "no gradient, no flux through its sides, and no output along it",
            );
        } else {
            axis_idx += 1;
        }
    }
}

fn is_idle(plan: &Plan, axis_idx: usize) -> bool {
    let axis = &plan.axes[axis_idx];
    let input = axis.index as u16;
    let has_gradient = plan.components.iter().any(|component| reads(&component.initial.operations, input));
    let kinetics = plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
    let is_in_a_law = kinetics.is_some_and(|kinetics| reads(&kinetics.laws.operations, input));
    let is_closed = axis.low_side != Side::Open && axis.high_side != Side::Open;
    let is_shown = plan.outputs.iter().any(|output| shows(output, axis_idx));
    !has_gradient && !is_in_a_law && is_closed && !is_shown
}

fn reads(operations: &[Operation], input: u16) -> bool {
    operations.iter().any(|operation| matches!(operation, Operation::Input(column) if *column == input))
}

fn shows(output: &Output, axis_idx: usize) -> bool {
    match output.kind {
        OutputKind::Map | OutputKind::Particles | OutputKind::Moments | OutputKind::Dilution => true,
        OutputKind::Breakthrough | OutputKind::FirstPassage | OutputKind::Budget => true,
        OutputKind::Density | OutputKind::Kernels => true,
        OutputKind::Profile | OutputKind::Covariance => output.bins[axis_idx] > 1,
        OutputKind::Total | OutputKind::Mixing => false,
    }
}

fn remove(plan: &mut Plan, axis_idx: usize) {
    let n_axes = plan.axes.len();
    plan.axes.remove(axis_idx);
    plan.walk.drift.remove(axis_idx);
    for output in &mut plan.outputs {
        if !output.bins.is_empty() {
            output.bins.remove(axis_idx);
        }
    }
    // The block of B Bᵀ over the axes that stay, factorised again.
    let at = |row: usize, column: usize| {
        if column <= row { plan.walk.spread[row * (row + 1) / 2 + column] } else { 0.0 }
    };
    let stay: Vec<usize> = (0..n_axes).filter(|idx| *idx != axis_idx).collect();
    let product = |row: usize, column: usize| (0..n_axes).map(|k| at(row, k) * at(column, k)).sum::<f64>();
    let is_diagonal = (0..n_axes).all(|row| (0..row).all(|column| at(row, column) == 0.0));
    plan.walk.spread = if is_diagonal {
        // The factors themselves, not their squares' roots: the same bits as a scene without the axis.
        stay.iter()
            .enumerate()
            .flat_map(|(i, &row)| (0..=i).map(move |j| (i, j, row)))
            .map(|(i, j, row)| if i == j { at(row, row) } else { 0.0 })
            .collect()
    } else {
        let block: Vec<Vec<f64>> =
            stay.iter().map(|&row| stay.iter().map(|&column| product(row, column)).collect()).collect();
        crate::plan::lower::cholesky(&block)
    };
}

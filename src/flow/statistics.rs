//! Numbers that a flow in cells is known by: means and variances of velocity, effective conductivity.
//!
//! Owns these sums. May use flows and the plan's sides. It deliberately weighs all faces alike: cells are those of a
//! grid, and larger ones stand for no more of the field.

use super::FaceFlow;
use crate::plan::Plan;
use crate::plan::transport::{DarcySide, Flow};

/// Along x, y, z; not a number along axes without two cells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Statistics {
    /// m/s, of the water in its pores.
    pub mean: [f64; 3],
    /// m²/s²
    pub variance: [f64; 3],
    /// m/s, along the first axis with a head on either side; not a number without one.
    pub conductivity: f64,
}

impl Statistics {
    /// Statistics of the flow of a plan.
    ///
    /// - Equation: mean and variance of `q/φ` over the faces between two cells; `K = ⟨q⟩ L/Δh`.
    /// - Symbols: `q` specific discharge, φ mean porosity of the two cells, `⟨q⟩` mean over all faces of the axis, `L`
    ///   extent, `Δh` difference of the heads of its two sides.
    /// - Range: any flow.
    /// - Source: definitions.
    /// - Shape: seven numbers.
    pub fn of(plan: &Plan, flow: &FaceFlow) -> Self {
        let moments = [0, 1, 2].map(|axis| moments(&inner(flow, axis)));
        Self {
            mean: moments.map(|m| m.0),
            variance: moments.map(|m| m.1),
            conductivity: effective(plan, flow),
        }
    }
}

/// Velocities through the faces between two cells of an axis.
fn inner(flow: &FaceFlow, axis: usize) -> Vec<f64> {
    let n = flow.cells.n();
    let mut list = Vec::new();
    for cell in 0..flow.cells.n_cells() {
        let mut place = flow.cells.place(cell);
        if place[axis] + 1 == n[axis] {
            continue;
        }
        let face = flow.cells.faces(axis, place).1;
        place[axis] += 1;
        let porosity = 0.5 * (flow.porosity[cell] + flow.porosity[flow.cells.cell(place)]);
        list.push(flow.flux[axis][face] / porosity);
    }
    list
}

/// Mean and variance; both not a number without values.
fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / n)
}

fn effective(plan: &Plan, flow: &FaceFlow) -> f64 {
    let Some(Flow::Darcy(darcy)) = plan.transport.as_ref().map(|transport| &transport.flow) else {
        return f64::NAN;
    };
    for (axis, sides) in plan.axes.iter().zip(&darcy.sides) {
        let [DarcySide::Head(low), DarcySide::Head(high)] = *sides else { continue };
        return moments(&flow.flux[axis.index]).0 * (axis.high - axis.low) / (low - high);
    }
    f64::NAN
}

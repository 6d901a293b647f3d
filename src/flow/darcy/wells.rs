//! Wells and their screens.
//!
//! Owns the cells of a screen and their shares. May use cells. It deliberately has no head losses inside a well.

use super::DarcyError;
use crate::flow::Cells;

/// Water that a cell receives, m³/s; negative where it is taken out. With fewer axes per unit of what is missing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Well {
    pub cell: usize,
    pub rate: f64,
}

/// A well between two points that differ along one axis at most, or at a point if they are the same.
///
/// - Equation: `Q_c = Q K_c l_c / Σ K l`.
/// - Symbols: `l_c` length of the screen in a cell, `K_c` its conductivity.
/// - Range: screens along an axis; a point on an edge belongs to the upper cell.
/// - Source: the well is a line of one head; its cells share the rate as their transmissivities.
/// - Shape: one entry per cell that the screen meets.
pub fn wells(
    cells: &Cells,
    conductivity: &[f64],
    low: [f64; 3],
    high: [f64; 3],
    rate: f64,
) -> Result<Vec<Well>, DarcyError> {
    let outside = DarcyError::WellOutside { low, high };
    let (Some(first), Some(last)) = (place(cells, low), place(cells, high)) else { return Err(outside) };
    let Some(axis) = (0..3).find(|&axis| high[axis] > low[axis]) else {
        return Ok(vec![Well { cell: cells.cell(first), rate }]);
    };
    if (0..3).any(|other| other != axis && high[other] != low[other]) {
        return Err(outside);
    }
    let mut shares = Vec::new();
    for along in first[axis]..=last[axis] {
        let mut place = first;
        place[axis] = along;
        let edges = &cells.edges()[axis];
        let length = high[axis].min(edges[along + 1]) - low[axis].max(edges[along]);
        let cell = cells.cell(place);
        let conductivity = conductivity.get(cell).copied().unwrap_or(0.0);
        if length > 0.0 {
            shares.push((cell, conductivity * length));
        }
    }
    let sum: f64 = shares.iter().map(|&(_, share)| share).sum();
    Ok(shares.into_iter().map(|(cell, share)| Well { cell, rate: rate * share / sum }).collect())
}

/// The cell that holds a point.
fn place(cells: &Cells, point: [f64; 3]) -> Option<[usize; 3]> {
    let mut place = [0; 3];
    for axis in 0..3 {
        let edges = &cells.edges()[axis];
        let n = edges.len() - 1;
        if !(point[axis] >= edges[0] && point[axis] <= edges[n]) {
            return None;
        }
        place[axis] = edges.partition_point(|&edge| edge <= point[axis]).saturating_sub(1).min(n - 1);
    }
    Some(place)
}

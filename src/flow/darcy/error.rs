//! What is wrong with a flow problem, and where.
//!
//! Owns the checks and their words. May use the problem. It deliberately holds no spans: a problem has none.

use super::{ADDS_UP, Problem, Side};
use crate::flow::Cells;
use std::fmt;

/// Cells whose couplings can be numbered in 32 bits.
const MOST_CELLS: usize = 500_000_000;

/// Why there is no flow. Places count cells from 0 along each axis.
#[derive(Debug, Clone, PartialEq)]
pub enum DarcyError {
    /// Values that are not one per cell.
    Length {
        what: &'static str,
        found: usize,
        expected: usize,
    },
    TooLarge {
        n_cells: usize,
        limit: usize,
    },
    /// Not positive, or no number; the first such cell and its middle, m.
    Conductivity {
        place: [usize; 3],
        centre: [f64; 3],
        value: f64,
    },
    Anisotropy {
        axis: usize,
        value: f64,
    },
    /// A head or an inflow that is no number.
    Side {
        axis: usize,
        upper: bool,
    },
    /// One side periodic and the other not, or with another fall of the head.
    Periodic {
        axis: usize,
    },
    /// A well whose rate is no number, or that lies in no cell.
    WellRate {
        well: usize,
        rate: f64,
    },
    WellOutside {
        low: [f64; 3],
        high: [f64; 3],
    },
    WellCell {
        well: usize,
        cell: usize,
    },
    /// Nothing fixes the head, and more flows in than out: m³/s.
    NoFixedHead {
        into: f64,
        out: f64,
    },
    /// Water that still appears in the worst cell, by the through-flow.
    NotConverged {
        iterations: usize,
        imbalance: f64,
        place: [usize; 3],
    },
}

fn axis_name(axis: usize) -> &'static str {
    ["x", "y", "z"][axis.min(2)]
}

impl fmt::Display for DarcyError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Length { what, found, expected } => {
                write!(f, "{found} values of {what} for {expected} cells")
            }
            Self::TooLarge { n_cells, limit } => {
                write!(f, "{n_cells} cells are more than the {limit} that the solver can number")
            }
            Self::Conductivity { place, centre: [x, y, z], value } => write!(
                f,
                "the conductivity of cell {place:?} at ({x} m, {y} m, {z} m) is {value} m/s; it must be positive"
            ),
            Self::Anisotropy { axis, value } => {
                write!(f, "the anisotropy along {} is {value}; it must be positive", axis_name(*axis))
            }
            Self::Side { axis, upper } => {
                let end = if *upper { "upper" } else { "lower" };
                write!(f, "the {end} side along {} has a value that is no number", axis_name(*axis))
            }
            Self::Periodic { axis } => write!(
                f,
                "both sides along {} must be periodic, with the same fall of the head",
                axis_name(*axis)
            ),
            Self::WellRate { well, rate } => write!(f, "the rate of well {} is {rate}", well + 1),
            Self::WellOutside { low, high } => {
                write!(f, "the well from {low:?} to {high:?} (m) lies outside the domain")
            }
            Self::WellCell { well, cell } => {
                write!(f, "well {} lies in cell {cell}, which is not there", well + 1)
            }
            Self::NoFixedHead { into, out } => write!(
                f,
                "no side has a fixed head, and {into} m³/s flow in while {out} m³/s flow out: nothing can be steady"
            ),
            Self::NotConverged { iterations, imbalance, place } => write!(
                f,
                "the flow did not converge in {iterations} iterations: water appears in cell {place:?}, \
                 {imbalance:.1e} of what flows through the domain"
            ),
        }
    }
}

/// Whatever can be said before anything is solved.
pub fn check(problem: &Problem) -> Result<(), DarcyError> {
    let expected = problem.cells.n_cells();
    for (what, found) in [("conductivity", problem.conductivity.len()), ("porosity", problem.porosity.len())]
    {
        if found != expected {
            return Err(DarcyError::Length { what, found, expected });
        }
    }
    if expected > MOST_CELLS {
        return Err(DarcyError::TooLarge { n_cells: expected, limit: MOST_CELLS });
    }
    let is_positive = |value: f64| value > 0.0 && value.is_finite();
    if let Some(cell) = problem.conductivity.iter().position(|&value| !is_positive(value)) {
        let place = problem.cells.place(cell);
        let centre = problem.cells.centre(place);
        return Err(DarcyError::Conductivity { place, centre, value: problem.conductivity[cell] });
    }
    if let Some(axis) = (0..3).find(|&axis| !is_positive(problem.anisotropy[axis])) {
        return Err(DarcyError::Anisotropy { axis, value: problem.anisotropy[axis] });
    }
    for (well, &super::Well { cell, rate }) in problem.wells.iter().enumerate() {
        if cell >= expected {
            return Err(DarcyError::WellCell { well, cell });
        }
        if !rate.is_finite() {
            return Err(DarcyError::WellRate { well, rate });
        }
    }
    check_sides(problem)
}

fn check_sides(problem: &Problem) -> Result<(), DarcyError> {
    for (axis, sides) in problem.sides.iter().enumerate() {
        for (end, side) in sides.iter().enumerate() {
            let value = match *side {
                Side::NoFlow => 0.0,
                Side::Head(value) | Side::Inflow(value) | Side::Periodic { fall: value } => value,
            };
            if !value.is_finite() {
                return Err(DarcyError::Side { axis, upper: end == 1 });
            }
        }
        if sides.iter().any(|side| matches!(side, Side::Periodic { .. })) && sides[0] != sides[1] {
            return Err(DarcyError::Periodic { axis });
        }
    }
    if problem.sides.iter().flatten().any(|side| matches!(side, Side::Head(_))) {
        return Ok(());
    }
    let rates = problem.wells.iter().map(|well| well.rate);
    let sides = problem.sides.iter().enumerate().flat_map(|(axis, sides)| {
        let area = area_of_side(&problem.cells, axis);
        sides.iter().map(move |side| if let Side::Inflow(flux) = side { flux * area } else { 0.0 })
    });
    let (mut into, mut out) = (0.0, 0.0);
    for rate in rates.chain(sides) {
        into += f64::max(rate, 0.0);
        out += f64::max(-rate, 0.0);
    }
    if (into - out).abs() > ADDS_UP * into.max(out) {
        return Err(DarcyError::NoFixedHead { into, out });
    }
    Ok(())
}

/// m².
fn area_of_side(cells: &Cells, axis: usize) -> f64 {
    let length = |edges: &Vec<f64>| edges[edges.len() - 1] - edges[0];
    (0..3).filter(|&other| other != axis).map(|other| length(&cells.edges()[other])).product()
}

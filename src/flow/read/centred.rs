//! Discharge at the middles of cells into discharge through their faces.
//!
//! Owns the averaging. May use the flow. It deliberately does not make the result free of divergence:
//! `FaceFlow::balance` tells how far it is from that.

use super::error::{Kind, ReadError};
use crate::flow::{Cells, FaceFlow};

/// What the numbers of a file are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Water per area of the medium.
    Discharge,
    /// Discharge over porosity.
    PoreVelocity,
}

/// Values at the middles of cells, in SI units and in the order of the cells.
#[derive(Debug, Clone)]
pub struct Centred {
    pub cells: Cells,
    pub quantity: Quantity,
    /// Per axis of the domain.
    pub q: Vec<Vec<f64>>,
    pub porosity: Vec<f64>,
    pub head: Option<Vec<f64>>,
    pub conductivity: Option<Vec<f64>>,
}

/// Discharge through faces from that at the middles of cells.
///
/// - Equation: inside `q_f = (w₂ q₁ + w₁ q₂) / (w₁ + w₂)`; at an outer face the straight line through the two
///   cells next to it, held at 0 where it would turn the water around; 0 at faces of cells without pores.
/// - Symbols: `q₁, q₂` discharge in the two cells of a face, `w₁, w₂` their widths.
/// - Range: fields that are smooth on the scale of cells; others are not free of divergence afterwards.
/// - Source: linear interpolation; exact for discharge that is linear in each axis.
/// - Shape: one number per face.
pub fn into_faces(mut centred: Centred) -> Result<FaceFlow, ReadError> {
    check_porosity(&centred.porosity)?;
    if centred.quantity == Quantity::PoreVelocity {
        for q in &mut centred.q {
            q.iter_mut().zip(&centred.porosity).for_each(|(q, porosity)| *q *= porosity);
        }
    }
    let flux = [0, 1, 2].map(|axis| match centred.q.get(axis) {
        Some(q) => along(&centred.cells, &centred.porosity, q, axis),
        None => vec![0.0; centred.cells.n_faces(axis)],
    });
    let Centred { cells, porosity, head, conductivity, .. } = centred;
    Ok(FaceFlow { cells, flux, porosity, head, conductivity, sinks: Vec::new() })
}

/// A porosity lies between 0 (no pores, no water) and 1.
pub(super) fn check_porosity(porosity: &[f64]) -> Result<(), ReadError> {
    match porosity.iter().position(|porosity| !(0.0..=1.0).contains(porosity)) {
        None => Ok(()),
        Some(cell) => {
            let message = format!("the porosity of cell {} is {}", cell + 1, porosity[cell]);
            Err(ReadError::new(Kind::Value, message).help("a porosity lies between 0 and 1"))
        }
    }
}

fn along(cells: &Cells, porosity: &[f64], q: &[f64], axis: usize) -> Vec<f64> {
    let n = cells.n()[axis];
    let mut flux = vec![0.0; cells.n_faces(axis)];
    for cell in 0..cells.n_cells() {
        let place = cells.place(cell);
        let idx = place[axis];
        let (low, high) = cells.faces(axis, place);
        let neighbour = |idx: usize| {
            let mut place = place;
            place[axis] = idx;
            cells.cell(place)
        };
        let outer = |inner: usize| {
            let gradient =
                (q[cell] - q[neighbour(inner)]) / (cells.width(axis, idx) + cells.width(axis, inner));
            let straight = q[cell] + gradient * cells.width(axis, idx);
            if straight * q[cell] < 0.0 { 0.0 } else { straight }
        };
        if porosity[cell] == 0.0 {
            continue;
        }
        if idx == 0 {
            flux[low] = if n > 1 { outer(1) } else { q[cell] };
        }
        if idx + 1 == n {
            flux[high] = if n > 1 { outer(n - 2) } else { q[cell] };
        } else if porosity[neighbour(idx + 1)] > 0.0 {
            let (first, second) = (cells.width(axis, idx), cells.width(axis, idx + 1));
            flux[high] = (second * q[cell] + first * q[neighbour(idx + 1)]) / (first + second);
        }
    }
    flux
}

#[cfg(test)]
mod tests {
    use super::*;

    /// q = (x, -y) at the middles of uneven cells.
    fn stagnation(quantity: Quantity, porosity: f64) -> Centred {
        let x = vec![1.0, 1.5, 2.5, 2.75, 4.0];
        let y = vec![0.5, 1.0, 3.0];
        let cells = Cells::new([x, y, vec![0.0, 1.0]]).unwrap();
        let centres: Vec<_> = (0..cells.n_cells()).map(|cell| cells.centre(cells.place(cell))).collect();
        let q = vec![centres.iter().map(|at| at[0]).collect(), centres.iter().map(|at| -at[1]).collect()];
        let porosity = vec![porosity; cells.n_cells()];
        Centred { cells, quantity, q, porosity, head: None, conductivity: None }
    }

    #[test]
    fn a_linear_field_is_exact_at_faces_and_free_of_divergence() {
        let flow = into_faces(stagnation(Quantity::Discharge, 0.3)).unwrap();
        for (idx, x) in [1.0, 1.5, 2.5, 2.75, 4.0].into_iter().enumerate() {
            assert!((flow.flux[0][2 * idx] - x).abs() < 1e-14, "{:?}", flow.flux[0]);
        }
        assert!((flow.flux[1][2] + 3.0).abs() < 1e-14, "{:?}", flow.flux[1]);
        assert!(flow.balance().worst_divergence < 1e-14);
        let slower = into_faces(stagnation(Quantity::PoreVelocity, 0.5)).unwrap();
        assert_eq!(slower.flux[0][0], 0.5 * flow.flux[0][0]);
    }

    #[test]
    fn cells_without_pores_let_no_water_through() {
        let mut centred = stagnation(Quantity::Discharge, 0.3);
        let solid = centred.cells.cell([1, 1, 0]);
        centred.porosity[solid] = 0.0;
        let flow = into_faces(centred).unwrap();
        for axis in 0..2 {
            let (low, high) = flow.cells.faces(axis, [1, 1, 0]);
            assert_eq!((flow.flux[axis][low], flow.flux[axis][high]), (0.0, 0.0));
        }
        assert!(flow.balance().worst_of_through_flow > 0.1, "what the wall stops is reported");
        let mut wrong = stagnation(Quantity::Discharge, 0.3);
        wrong.porosity[3] = 1.5;
        assert_eq!(into_faces(wrong).unwrap_err().kind, Kind::Value);
    }

    #[test]
    fn an_outer_face_never_turns_the_water_around() {
        let cells = Cells::equal([0.0; 3], [2.0, 1.0, 1.0], [2, 1, 1]).unwrap();
        let q = vec![vec![1.0, 5.0]];
        let porosity = vec![0.3; 2];
        let flow = into_faces(Centred {
            cells,
            quantity: Quantity::Discharge,
            q,
            porosity,
            head: None,
            conductivity: None,
        });
        assert_eq!(flow.unwrap().flux[0], [0.0, 3.0, 7.0]);
    }
}

//! Conductances of faces: heads to fluxes, and the system for heads.
//!
//! Owns the two-point law and the sides. May use cells and the matrix. It deliberately keeps heads less a reference,
//! so that a datum far away costs no digits.

use super::matrix::Matrix;
use super::{Problem, Side};
use crate::flow::Cells;

pub struct System {
    /// Per axis and face: specific discharge by difference of head, 1/s; zero where the flux is given.
    conductance: [Vec<f64>; 3],
    sides: [[Side; 2]; 3],
    reference: f64,
}

/// What a face lies between: cells, or a side.
enum Neighbours {
    Cells(usize, usize),
    Lower(usize),
    Upper(usize),
    /// The last cell, the first.
    Around(usize, usize),
}

/// Calls `visit` with the number of each face normal to an axis, what it lies between, and a cell beside it.
fn for_each_face(
    cells: &Cells,
    axis: usize,
    is_periodic: bool,
    mut visit: impl FnMut(usize, Neighbours, [usize; 3]),
) {
    let n = cells.n();
    let stride: usize = n[axis + 1..].iter().product();
    let mut face = 0;
    let mut faces = n;
    faces[axis] += 1;
    let around = (n[axis] - 1) * stride;
    for i in 0..faces[0] {
        for j in 0..faces[1] {
            for k in 0..faces[2] {
                let mut place = [i, j, k];
                let along = place[axis];
                place[axis] = along.min(n[axis] - 1);
                let cell = cells.cell(place);
                let neighbours = match along {
                    0 if is_periodic => Neighbours::Around(cell + around, cell),
                    0 => Neighbours::Lower(cell),
                    _ if along == n[axis] && is_periodic => Neighbours::Around(cell, cell - around),
                    _ if along == n[axis] => Neighbours::Upper(cell),
                    _ => Neighbours::Cells(cell - stride, cell),
                };
                visit(face, neighbours, place);
                face += 1;
            }
        }
    }
}

impl System {
    pub fn new(problem: &Problem) -> Self {
        let cells = &problem.cells;
        let heads = problem.sides.iter().flatten().filter_map(|side| match side {
            Side::Head(head) => Some(*head),
            _ => None,
        });
        let (low, high) = heads
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), head| (low.min(head), high.max(head)));
        let reference = if low <= high { 0.5 * low + 0.5 * high } else { 0.0 };
        let conductance = [0, 1, 2].map(|axis| conductances(problem, cells, axis));
        let lessened = |side: Side| match side {
            Side::Head(head) => Side::Head(head - reference),
            other => other,
        };
        Self { conductance, sides: problem.sides.map(|sides| sides.map(lessened)), reference }
    }

    /// What was taken off all heads, m.
    pub fn reference(&self) -> f64 {
        self.reference
    }

    fn is_periodic(&self, axis: usize) -> bool {
        matches!(self.sides[axis][0], Side::Periodic { .. })
    }

    /// Fluxes of heads, with what the sides give.
    pub fn flux(&self, cells: &Cells, head: &[f64]) -> [Vec<f64>; 3] {
        [0, 1, 2].map(|axis| {
            let conductance = &self.conductance[axis];
            let mut flux = vec![0.0; cells.n_faces(axis)];
            for_each_face(cells, axis, self.is_periodic(axis), |face, neighbours, _| {
                flux[face] = match neighbours {
                    Neighbours::Cells(low, high) => conductance[face] * (head[low] - head[high]),
                    Neighbours::Lower(cell) => match self.sides[axis][0] {
                        Side::Head(side) => conductance[face] * (side - head[cell]),
                        Side::Inflow(flux) => flux,
                        _ => 0.0,
                    },
                    Neighbours::Upper(cell) => match self.sides[axis][1] {
                        Side::Head(side) => conductance[face] * (head[cell] - side),
                        Side::Inflow(flux) => -flux,
                        _ => 0.0,
                    },
                    Neighbours::Around(last, first) => match self.sides[axis][0] {
                        Side::Periodic { fall } => conductance[face] * ((head[last] - head[first]) + fall),
                        _ => 0.0,
                    },
                };
            });
            flux
        })
    }

    /// Adds the fluxes of a correction of heads; the sides do not change.
    pub fn add_flux(&self, cells: &Cells, head: &[f64], flux: &mut [Vec<f64>; 3]) {
        for (axis, flux) in flux.iter_mut().enumerate() {
            let conductance = &self.conductance[axis];
            for_each_face(cells, axis, self.is_periodic(axis), |face, neighbours, _| {
                let difference = match neighbours {
                    Neighbours::Cells(low, high) | Neighbours::Around(low, high) => head[low] - head[high],
                    Neighbours::Lower(cell) => -head[cell],
                    Neighbours::Upper(cell) => head[cell],
                };
                flux[face] += conductance[face] * difference;
            });
        }
    }

    /// The system of heads. Where nothing fixes a head, the first cell is anchored: as the right side adds
    /// up to zero, nothing flows there.
    pub fn matrix(&self, problem: &Problem) -> Matrix {
        let cells = &problem.cells;
        let n = cells.n();
        let n_cells = cells.n_cells();
        let mut matrix = Matrix { start: vec![0], anchor: vec![0.0; n_cells], ..Matrix::default() };
        for cell in 0..n_cells {
            let place = cells.place(cell);
            for axis in 0..3 {
                let area = cells.face_area(axis, place);
                let stride: usize = n[axis + 1..].iter().product();
                let (low, high) = cells.faces(axis, place);
                for (face, is_upper) in [(low, false), (high, true)] {
                    let at_side = place[axis] == if is_upper { n[axis] - 1 } else { 0 };
                    let conductance = area * self.conductance[axis][face];
                    let around = (n[axis] - 1) * stride;
                    let other = match (at_side, is_upper) {
                        (true, _) if !self.is_periodic(axis) => {
                            matrix.anchor[cell] += conductance;
                            continue;
                        }
                        (true, true) => cell - around,
                        (true, false) => cell + around,
                        (false, true) => cell + stride,
                        (false, false) => cell - stride,
                    };
                    if other != cell {
                        matrix.node.push(other as u32);
                        matrix.conductance.push(conductance);
                    }
                }
            }
            matrix.start.push(matrix.node.len() as u32);
        }
        if matrix.anchor.iter().all(|&anchor| anchor == 0.0) {
            let own: f64 = matrix.row(0).1.iter().sum();
            matrix.anchor[0] = if own > 0.0 { own } else { 1.0 };
        }
        matrix.close();
        matrix
    }
}

fn conductances(problem: &Problem, cells: &Cells, axis: usize) -> Vec<f64> {
    let sides = problem.sides[axis];
    let is_periodic = matches!(sides[0], Side::Periodic { .. });
    let factor = problem.anisotropy[axis];
    let last = cells.n()[axis] - 1;
    // Half a cell: s.
    let half =
        |cell: usize, along: usize| 0.5 * cells.width(axis, along) / (factor * problem.conductivity[cell]);
    let at_side = |side: Side, half: f64| if matches!(side, Side::Head(_)) { 1.0 / half } else { 0.0 };
    let mut conductance = vec![0.0; cells.n_faces(axis)];
    for_each_face(cells, axis, is_periodic, |face, neighbours, place| {
        conductance[face] = match neighbours {
            Neighbours::Cells(low, high) => 1.0 / (half(low, place[axis] - 1) + half(high, place[axis])),
            Neighbours::Around(low, high) => 1.0 / (half(low, last) + half(high, 0)),
            Neighbours::Lower(cell) => at_side(sides[0], half(cell, 0)),
            Neighbours::Upper(cell) => at_side(sides[1], half(cell, last)),
        };
    });
    conductance
}

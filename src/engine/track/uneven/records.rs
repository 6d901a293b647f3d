//! What particles read of cells of any width and porosity.
//!
//! Owns the records. May use `flow`. It deliberately divides no discharge by porosity: discharge is what goes on
//! through a face where porosity jumps.

use crate::flow::FaceFlow;

/// Numbers that a particle reads of its cell: discharge through the lower and the upper face of each axis, then
/// at the corners (last axis fastest), component by component, m/s, then 1/porosity.
pub const fn n_numbers<const D: usize>() -> usize {
    2 * D + (D << D) + 1
}

/// The same in fours.
pub const fn n_quads<const D: usize>() -> usize {
    n_numbers::<D>().div_ceil(4)
}

/// Faces of the cells along the axes of a scene.
struct Faces<'a, const D: usize> {
    n: [usize; D],
    axes: [usize; D],
    flow: &'a FaceFlow,
}

/// The records of all cells, four numbers at a time.
pub fn records<const D: usize>(flow: &FaceFlow, axes: [usize; D]) -> Vec<[f32; 4]> {
    let faces = Faces { n: axes.map(|axis| flow.cells.n()[axis]), axes, flow };
    let mut quads = vec![[0.0; 4]; flow.cells.n_cells() * n_quads::<D>()];
    for (cell, quads) in quads.chunks_exact_mut(n_quads::<D>()).enumerate() {
        let place = place(faces.n, cell);
        let mut k = 0;
        let mut put = |value: f64| {
            quads[k / 4][k % 4] = value as f32;
            k += 1;
        };
        for axis in 0..D {
            let [low, high] = faces.of_cell(place, axis);
            put(low);
            put(high);
        }
        for corner in 0..1_usize << D {
            let at: [usize; D] = std::array::from_fn(|axis| place[axis] + (corner >> (D - 1 - axis) & 1));
            (0..D).for_each(|axis| put(faces.at_corner(at, axis)));
        }
        let porosity = flow.porosity[cell];
        // Nothing moves where there is no water.
        put(if porosity > 0.0 { 1.0 / porosity } else { 0.0 });
    }
    quads
}

/// Places of a cell along the axes; the last is fastest.
pub fn place<const D: usize>(n: [usize; D], cell: usize) -> [usize; D] {
    let mut rest = cell;
    let mut place = [0; D];
    for axis in (0..D).rev() {
        place[axis] = rest % n[axis];
        rest /= n[axis];
    }
    place
}

/// Steps in an array from one place to the next along each axis.
pub fn strides<const D: usize>(n: [usize; D]) -> [usize; D] {
    let mut strides = [1; D];
    for axis in (0..D.saturating_sub(1)).rev() {
        strides[axis] = strides[axis + 1] * n[axis + 1];
    }
    strides
}

impl<const D: usize> Faces<'_, D> {
    fn flux(&self, axis: usize, place: [usize; D]) -> f64 {
        let mut n = self.n;
        n[axis] += 1;
        let face: usize = place.iter().zip(strides(n)).map(|(along, stride)| along * stride).sum();
        self.flow.flux[self.axes[axis]][face]
    }

    fn of_cell(&self, place: [usize; D], axis: usize) -> [f64; 2] {
        let mut upper = place;
        upper[axis] += 1;
        [self.flux(axis, place), self.flux(axis, upper)]
    }

    /// Discharge at a corner along an axis.
    ///
    /// - Equation: `q = Σ q_f A_f / Σ A_f` over the faces normal to the axis that touch the corner.
    /// - Symbols: `q_f` specific discharge, `A_f` area of a face.
    /// - Range: cells of any width; at an edge of the domain the faces that exist.
    /// - Source: methods, section 1.3.
    /// - Shape: one component at one corner, from up to 2^(D−1) faces.
    fn at_corner(&self, corner: [usize; D], axis: usize) -> f64 {
        let (mut flow, mut whole) = (0.0, 0.0);
        for choice in 0..1_usize << D {
            // The faces normal to the axis lie at the corner along it, on either side along the others.
            let side = |other: usize| choice >> other & 1;
            if side(axis) == 1 {
                continue;
            }
            let mut place = corner;
            let mut area = 1.0;
            let mut exists = true;
            for other in (0..D).filter(|&other| other != axis) {
                let along = (corner[other] + side(other)).checked_sub(1).filter(|&k| k < self.n[other]);
                exists &= along.is_some();
                place[other] = along.unwrap_or(0);
                area *= self.flow.cells.width(self.axes[other], place[other]);
            }
            if exists {
                flow += area * self.flux(axis, place);
                whole += area;
            }
        }
        flow / whole
    }
}

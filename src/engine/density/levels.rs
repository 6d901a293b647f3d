//! Smooth fields on coarse cells, and on finer ones from these.
//!
//! Owns the levels and what lies between their cells. May use fields and folding. It deliberately knows not what the fields are:
//! they bend within two cells of their level at the narrowest.

use super::lattice::{AXES, Field, Lattice, Window};
use super::patch::fold;

/// Weights of the six cells around a place a quarter of a cell beyond the third.
///
/// - Equation: Lagrange's polynomials through −2 … 3, at ¼.
/// - Symbols: cells of the coarse level.
/// - Range: waves of k per cell to 0.0035 k⁶.
/// - Source: definition.
/// - Shape: sums to 1.
const QUARTER: [f64; 6] =
    [77.0 / 8192.0, -693.0 / 8192.0, 6930.0 / 8192.0, 2310.0 / 8192.0, -495.0 / 8192.0, 63.0 / 8192.0];

/// A lattice whose cells are so many fine ones: powers of two, as far as an axis is such a multiple.
pub fn coarse(lattice: &Lattice, level: u32) -> (Lattice, [usize; AXES]) {
    let mut own = lattice.clone();
    let mut factors = [1; AXES];
    for axis in lattice.axes() {
        factors[axis] = 1 << level.min(lattice.cells[axis].trailing_zeros());
        own.cells[axis] /= factors[axis];
        own.edge[axis] *= factors[axis] as f64;
    }
    (own, factors)
}

/// Adds a field to one of the level below.
pub fn refine(lattice: &Lattice, window: &Window, (field, level): (Field, u32), below: &mut Field) {
    let (own, factors) = coarse(lattice, level);
    let (_, wanted) = coarse(lattice, level - 1);
    let target = Field::zeros(window, wanted);
    let mut field = field;
    for axis in lattice.axes().filter(|&axis| factors[axis] > wanted[axis]) {
        field = doubled(&field, &own, axis, (target.first[axis], target.cells[axis]));
    }
    below.values.iter_mut().zip(&field.values).for_each(|(sum, value)| *sum += value);
}

/// The field on cells half as long along an axis.
fn doubled(field: &Field, lattice: &Lattice, axis: usize, (first, n): (usize, usize)) -> Field {
    let mut fine = Field { first: field.first, cells: field.cells, values: Vec::new() };
    (fine.first[axis], fine.cells[axis]) = (first, n);
    fine.values = vec![0.0; fine.n() + super::lattice::PADDING];
    let inner: usize = field.cells[axis + 1..].iter().product();
    let outer: usize = field.cells[..axis].iter().product();
    for at in 0..n {
        let cell = first + at;
        // The first of two lies before the centre of the coarse one.
        let way = if cell % 2 == 0 { -1 } else { 1 };
        let mut nodes = [(0, 0.0); QUARTER.len()];
        for ((node, weight), place) in nodes.iter_mut().zip(QUARTER).zip(-2..) {
            let (own, sign, _) =
                fold(lattice.cells[axis], lattice.ends[axis], (cell / 2) as isize + way * place);
            // Beyond the window there is nothing.
            let is_there = own >= field.first[axis] && own < field.first[axis] + field.cells[axis];
            *node = if is_there { (own - field.first[axis], sign * weight) } else { (0, 0.0) };
        }
        for block in 0..outer {
            let target = (block * n + at) * inner;
            let target = &mut fine.values[target..target + inner];
            for (node, weight) in nodes {
                let source = (block * field.cells[axis] + node) * inner;
                let source = &field.values[source..source + inner];
                target.iter_mut().zip(source).for_each(|(sum, value)| *sum += weight * value);
            }
        }
    }
    fine
}

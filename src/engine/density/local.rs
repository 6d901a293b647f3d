//! Directions that kernels follow, and the axes that go with them.
//!
//! Owns directions by cell and their axes on any lattice. May use lattices. It deliberately chooses no size.

#![allow(clippy::needless_range_loop)] // An axis belongs to several arrays at once.

use super::frame::Frame;
use super::lattice::AXES;

/// What is less of a unit vector is taken for nothing.
const TINY: f64 = 1e-9;

/// Three vectors; rows and columns of axes that are not used are zero.
pub type Basis = [[f64; AXES]; AXES];

/// Which way kernels are stretched. Directions are vectors of any length on the axes of the lattice, the last ones; of one that
/// is zero, or no number, kernels are round.
#[derive(Debug, Clone, PartialEq, Default)]
pub enum Orientation {
    /// Along the axes of the lattice.
    #[default]
    Axes,
    /// All along one direction.
    All([f64; AXES]),
    /// Along one per cell with particles, in the order of the tally; those that are missing are zero.
    Each(Vec<[f64; AXES]>),
}

impl Orientation {
    fn of(&self, idx: usize) -> [f64; AXES] {
        match self {
            Self::Axes => [0.0; AXES],
            Self::All(direction) => *direction,
            Self::Each(directions) => directions.get(idx).copied().unwrap_or_default(),
        }
    }

    /// The axes of the kernel of a cell on the lattice of a frame, in its lengths, and whether it has no direction.
    ///
    /// - Equation: `a_k = (Π l)^{1/d} e_k/l`, component by component.
    /// - Symbols: `e_k` unit vectors, `l` lengths that are taken for one.
    /// - Range: a determinant of ±1: formulas for unit vectors hold as they are.
    /// - Source: a vector x has components x/l; methods, section 3.4.
    /// - Shape: rows.
    pub fn basis(&self, idx: usize, frame: &Frame) -> (Basis, bool) {
        let d = frame.kept.len();
        let direction = self.of(idx);
        let mut own = [0.0; AXES];
        for (own, &axis) in own[AXES - d..].iter_mut().zip(&frame.kept) {
            *own = direction[axis];
        }
        let unit = unit(own);
        let mut basis = axes_along(unit, d);
        for axis in basis[AXES - d..].iter_mut() {
            for (part, scale) in axis[AXES - d..].iter_mut().zip(&frame.scales) {
                *part *= frame.mean() / scale;
            }
        }
        (basis, unit.is_none())
    }
}

/// A direction, if it is one.
fn unit(vector: [f64; AXES]) -> Option<[f64; AXES]> {
    // Squares of what is very large or very small would be no numbers.
    let largest = vector.iter().fold(0.0_f64, |most, part| most.max(part.abs()));
    if !(largest > 0.0 && largest.is_finite() && vector.iter().all(|part| part.is_finite())) {
        return None;
    }
    let vector = vector.map(|part| part / largest);
    let length = vector.iter().map(|part| part * part).sum::<f64>().sqrt();
    Some(vector.map(|part| part / length))
}

/// A direction, and what is normal to it: in space first a horizontal vector, as the last axis is the vertical one and what is
/// spread upwards differs from what is spread sideways; then the third. Along a vertical direction those of the lattice.
fn axes_along(unit: Option<[f64; AXES]>, d: usize) -> Basis {
    let mut basis = [[0.0; AXES]; AXES];
    let Some(first) = unit.filter(|_| d > 1) else {
        (AXES - d..AXES).for_each(|axis| basis[axis][axis] = 1.0);
        return basis;
    };
    let [x, y, z] = first;
    if d == 2 {
        return [[0.0; AXES], first, [0.0, -z, y]];
    }
    let level = (x * x + y * y).sqrt();
    let second = if level > TINY { [-y / level, x / level, 0.0] } else { [0.0, 1.0, 0.0] };
    let third = [y * second[2] - z * second[1], z * second[0] - x * second[2], x * second[1] - y * second[0]];
    [first, second, third]
}

/// A bound along an axis of a kernel from those along the axes of a lattice.
///
/// - Equation: `1/√(Σ_i (a_i/b_i)²)`
/// - Symbols: `a` axis of the kernel, `b_i` bounds.
/// - Range: `b_i` along an axis of the lattice, and their common value along all if they are the same.
/// - Source: the ellipsoid with half-axes b_i.
/// - Shape: length.
pub fn bound(axis: [f64; AXES], bounds: impl Fn(usize) -> f64, used: std::ops::Range<usize>) -> f64 {
    let part = |i: usize| axis[i] / bounds(i);
    1.0 / used.map(|i| part(i) * part(i)).sum::<f64>().sqrt()
}

//! Bandwidths that are rounded to classes, and kernels that are worked out once for each.
//!
//! Owns the classes. May use taps. It deliberately rounds so little that no density shows it: half a class is 0.5 % of a
//! bandwidth, and the error of a density is least, and flat, at the best one.

use super::stencil::Lent;
use super::taps::{Line, Taps};
use crate::maths::vector::exp;

/// Logarithm of the ratio of two classes.
const STEP: f64 = 0.01;

/// The class of a bandwidth by its logarithm; all are over the shortest edge of a cell, so that no unit shows in them.
pub fn class_of(log: f64) -> i64 {
    (log / STEP).round() as i64
}

pub fn bandwidth_of(class: i64) -> f64 {
    exp(STEP * class as f64)
}

/// Kernels along an axis, far from its ends, by class.
#[derive(Debug, Clone)]
pub struct Table {
    first: i64,
    edge: f64,
    /// With the distance of the first cell from the one that the kernel stands in.
    kernels: Vec<(usize, Vec<f64>)>,
}

/// What fills in the cells of a line that a kernel of some bandwidth, in cells, reaches from one of them; and how far that is.
pub type Fill<'f> = &'f (dyn Fn(Line, f64, usize, &mut Taps) + Sync);

impl Table {
    /// Of all classes between two, on an axis of so many cells of a size; kernels end at so many bandwidths.
    pub fn new((first, last): (i64, i64), (n, edge): (usize, f64), reach: f64, fill: Fill) -> Self {
        let kernel = |class: i64| {
            let bandwidth = bandwidth_of(class) / edge;
            let reach = (reach * bandwidth).ceil() as usize + 1;
            // From every cell it reaches an end.
            if reach > n {
                return (usize::MAX, Vec::new());
            }
            let line = Line { n: 2 * reach + 1, factor: 1, ends: Default::default() };
            let mut taps = Taps::default();
            fill(line, bandwidth, reach, &mut taps);
            (reach - taps.first, taps.values)
        };
        Self { first, edge, kernels: (first..=last).map(kernel).collect() }
    }

    /// The kernel of a class in cell `b` of a line, worked out only where it reaches an end.
    pub fn lend<'t>(&'t self, line: Line, class: i64, b: usize, lent: &mut Lent<'t>, fill: Fill) {
        let at = (class - self.first).clamp(0, self.kernels.len() as i64 - 1);
        let (before, values) = &self.kernels[at as usize];
        if b < *before || b - before + values.len() > line.n {
            lent.shared = None;
            return fill(line, bandwidth_of(class) / self.edge, b, &mut lent.own);
        }
        lent.first = b - before;
        lent.shared = Some(values);
    }
}

//! Where the bins of an output lie.
//!
//! Owns the centres of bins and the order they are counted in. May use `plan`. It deliberately
//! knows no values.

use crate::plan::{Axis, Output, OutputKind, Plan};

/// Centre of bin `idx` of `n_bins` along an axis, m, frame coordinates.
///
/// Equation: x = ((2(n−i)−1) low + (2i+1) high) / (2n)
/// Symbols: n bins, i from 0; low, high the ends of the axis
/// Dimensions and range: m; 0 ≤ i < n
/// Source: the midpoint of equal bins, written so that a symmetric axis has exactly symmetric centres
/// Shape: one number
pub fn centre(axis: &Axis, n_bins: usize, idx: usize) -> f64 {
    let (n, i) = (n_bins as f64, idx as f64);
    ((2.0 * (n - i) - 1.0) * axis.low + (2.0 * i + 1.0) * axis.high) / (2.0 * n)
}

/// The grid of an output: which scene axis (0, 1, 2) has a coordinate, and which bin a row is.
#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    /// Per scene axis the centres along it and the number of rows between two of them.
    axes: [Option<(Vec<f64>, usize)>; 3],
    pub n_bins: usize,
}

impl Grid {
    /// First active axis slowest. A profile has no coordinate along an axis it averages over (one
    /// bin beside others with more); a map has all.
    pub fn new(plan: &Plan, output: &Output) -> Self {
        let n_bins = output.bins.iter().product();
        let is_averaged_over = |bins: usize| {
            bins == 1
                && matches!(output.kind, OutputKind::Profile | OutputKind::Covariance)
                && output.bins.iter().any(|&other| other > 1)
        };
        let mut axes = [None, None, None];
        let mut stride = n_bins;
        for (axis, &bins) in plan.axes.iter().zip(&output.bins) {
            stride /= bins.max(1);
            if axis.index < 3 && !is_averaged_over(bins) {
                axes[axis.index] = Some(((0..bins).map(|idx| centre(axis, bins, idx)).collect(), stride));
            }
        }
        Self { axes, n_bins }
    }

    /// Coordinate of a row along a scene axis, if the output has one.
    pub fn coordinate(&self, axis: usize, row: usize) -> Option<f64> {
        let (centres, stride) = self.axes[axis].as_ref()?;
        Some(centres[row / stride % centres.len()])
    }

    /// Centres along a scene axis.
    pub fn centres(&self, axis: usize) -> Option<&[f64]> {
        self.axes[axis].as_ref().map(|(centres, _)| centres.as_slice())
    }

    /// Rows between two bins that are neighbours along a scene axis.
    pub fn stride(&self, axis: usize) -> Option<usize> {
        self.axes[axis].as_ref().map(|(_, stride)| *stride)
    }
}

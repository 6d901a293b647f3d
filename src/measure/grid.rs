//! The bins of an output and the points inside them at which a reference is averaged.
//!
//! Owns bin geometry and its quadrature. May use `plan` and `maths`. It deliberately holds no values.

use crate::maths::quadrature::gauss_legendre;
use crate::plan::{Axis, Output, OutputKind, Plan};

/// Bins over the active axes, the first axis slowest; no axes for totals and γ.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Grid {
    pub(super) axes: Vec<BinnedAxis>,
    /// Length, area or volume that a sum over bins is weighted with.
    pub(super) weight: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct BinnedAxis {
    /// 0, 1, 2 for x, y, z of the scene.
    pub(super) index: usize,
    low: f64,
    width: f64,
    pub(super) n_bins: usize,
}

/// Points per panel of the bin averages: exact to degree five.
const POINTS: usize = 3;
/// A reference is resolved with at least this many panels along an axis, …
const PANELS_PER_AXIS: usize = 128;
/// … unless that would take more points than this.
const MOST_POINTS: usize = 4_000_000;

impl Grid {
    /// The bins of an output; an error if the plan is not well-formed.
    pub(super) fn of(plan: &Plan, output: &Output) -> Result<Self, String> {
        if !is_binned(output.kind) {
            return Ok(Self { axes: Vec::new(), weight: 1.0 });
        }
        if output.bins.len() != plan.axes.len() || output.bins.contains(&0) {
            return Err("An output must have at least one bin along every active axis.".into());
        }
        let axes: Vec<_> =
            plan.axes.iter().zip(&output.bins).map(|(axis, &n_bins)| BinnedAxis::new(axis, n_bins)).collect();
        let weight = weight(&axes, output.kind);
        Ok(Self { axes, weight })
    }

    pub(super) fn n_bins(&self) -> usize {
        self.axes.iter().map(|axis| axis.n_bins).product()
    }

    /// Index of a bin along each axis.
    pub(super) fn bin_along(&self, bin: usize, axis_idx: usize) -> usize {
        let inner: usize = self.axes[axis_idx + 1..].iter().map(|axis| axis.n_bins).product();
        bin / inner % self.axes[axis_idx].n_bins
    }

    /// Centre of every bin along axis `index` (0, 1, 2 for x, y, z); `None` without that axis.
    pub(super) fn centres(&self, index: usize) -> Option<Vec<f64>> {
        let axis_idx = self.axes.iter().position(|axis| axis.index == index)?;
        let axis = &self.axes[axis_idx];
        let centre = |bin| axis.low + (self.bin_along(bin, axis_idx) as f64 + 0.5) * axis.width;
        Some((0..self.n_bins()).map(centre).collect())
    }

    /// The axis of a profile: the first one that is cut into bins.
    pub(super) fn profile_axis(&self) -> Option<usize> {
        self.axes.iter().position(|axis| axis.n_bins > 1).or(if self.axes.is_empty() {
            None
        } else {
            Some(0)
        })
    }

    /// Nodes and weights along each axis; the weights inside a bin sum to one.
    pub(super) fn rules(&self) -> Vec<Rule> {
        let mut panels: Vec<usize> =
            self.axes.iter().map(|axis| PANELS_PER_AXIS.div_ceil(axis.n_bins)).collect();
        let n_points = |panels: &[usize]| -> usize {
            self.axes.iter().zip(panels).map(|(axis, panels)| axis.n_bins * panels * POINTS).product()
        };
        while n_points(&panels) > MOST_POINTS && panels.iter().any(|&n| n > 1) {
            panels.iter_mut().for_each(|n| *n = n.div_ceil(2));
        }
        self.axes.iter().zip(panels).map(|(axis, panels)| Rule::new(axis, panels)).collect()
    }
}

/// Whether an output has values per bin.
pub(super) fn is_binned(kind: OutputKind) -> bool {
    kind.is_binned()
}

/// A profile is integrated along its axis only, a map over all axes.
fn weight(axes: &[BinnedAxis], kind: OutputKind) -> f64 {
    let counts = |axis: &&BinnedAxis| kind == OutputKind::Map || axis.n_bins > 1 || axes.len() == 1;
    axes.iter().filter(counts).map(|axis| axis.width).product()
}

impl BinnedAxis {
    fn new(axis: &Axis, n_bins: usize) -> Self {
        Self { index: axis.index, low: axis.low, width: (axis.high - axis.low) / n_bins as f64, n_bins }
    }

    pub(super) fn centre(&self, bin: usize) -> f64 {
        self.low + (bin as f64 + 0.5) * self.width
    }

    /// Edges and centres in order: the points at which a curve is drawn.
    pub(super) fn edges_and_centres(&self) -> Vec<f64> {
        (0..=2 * self.n_bins).map(|half| self.low + 0.5 * half as f64 * self.width).collect()
    }
}

/// Quadrature along one axis: `per_bin` nodes for every bin.
pub(super) struct Rule {
    pub(super) index: usize,
    pub(super) per_bin: usize,
    pub(super) nodes: Vec<f64>,
    /// For one bin, the same for all.
    pub(super) weights: Vec<f64>,
}

impl Rule {
    fn new(axis: &BinnedAxis, panels: usize) -> Self {
        let (unit_nodes, unit_weights) = gauss_legendre(POINTS);
        let panel = axis.width / panels as f64;
        let nodes = (0..axis.n_bins * panels)
            .flat_map(|idx| {
                unit_nodes.iter().map(move |node| axis.low + panel * (idx as f64 + 0.5 + 0.5 * node))
            })
            .collect();
        let weights = (0..panels)
            .flat_map(|_| unit_weights.iter().map(|weight| 0.5 * weight / panels as f64))
            .collect();
        Self { index: axis.index, per_bin: panels * POINTS, nodes, weights }
    }
}

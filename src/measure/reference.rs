//! References, ready to be evaluated and averaged over bins.
//!
//! Owns bin averages of solutions. May use the catalogue, `plan` and `grid`. It deliberately knows no
//! results.

use super::grid::{Grid, Rule};
use super::observed::column;
use crate::catalog;
use crate::plan::Output;
use crate::plan::evaluation::{Evaluation, Reference, Solution};
use crate::plan::tape::Tape;

/// A reference with its solution built.
pub(super) struct Prepared<'a> {
    pub(super) idx: usize,
    pub(super) reference: &'a Reference,
    solution: Built<'a>,
    /// Whether it has no value, and is no number, where measured data have none.
    pub(super) has_gaps: bool,
}

enum Built<'a> {
    Expression(&'a Tape),
    Catalogue(Box<dyn catalog::reference::Solution>),
}

/// Points are evaluated in portions of this size.
const PORTION: usize = 4096;

impl<'a> Prepared<'a> {
    /// All references of an evaluation, in order.
    pub(super) fn all(evaluation: &'a Evaluation) -> Result<Vec<Self>, String> {
        evaluation.references.iter().enumerate().map(|(idx, reference)| Self::new(idx, reference)).collect()
    }

    fn new(idx: usize, reference: &'a Reference) -> Result<Self, String> {
        let solution = match &reference.solution {
            Solution::Expression(tape) => {
                // x, y, z and t.
                tape.check(4).map_err(|reason| format!("Reference `{}`: {reason}.", reference.name))?;
                Built::Expression(tape)
            }
            Solution::Catalogue { name, arguments } => {
                let item = catalog::reference::find(name)
                    .ok_or_else(|| format!("There is no reference `{name}` in the catalogue."))?;
                let built = (item.build)(arguments);
                Built::Catalogue(built.map_err(|reason| format!("Reference `{}`: {reason}", reference.name))?)
            }
        };
        let has_gaps = matches!(solution, Built::Expression(tape) if tape.reads_tables());
        Ok(Self { idx, reference, solution, has_gaps })
    }

    pub(super) fn applies_to(&self, output: &Output) -> bool {
        self.reference.outputs.contains(&output.kind) && column(output, self.reference.target).is_some()
    }

    /// Values at points; `positions` has three axes.
    pub(super) fn at(&self, t: f64, positions: &[Vec<f64>; 3]) -> Vec<f64> {
        let mut out = vec![0.0; positions[0].len()];
        match &self.solution {
            Built::Expression(tape) => {
                let time = vec![t; out.len()];
                let inputs = [&positions[0][..], &positions[1], &positions[2], &time];
                tape.evaluate_block(&inputs, &mut Vec::new(), &mut out);
            }
            Built::Catalogue(solution) => {
                solution.fill(t, [&positions[0], &positions[1], &positions[2]], &mut out);
            }
        }
        out
    }

    /// Means over the bins of a grid; the value at the origin if the grid has no axes.
    pub(super) fn bin_means(&self, t: f64, grid: &Grid) -> Vec<f64> {
        let rules = grid.rules();
        let per_bin: usize = rules.iter().map(|rule| rule.per_bin).product();
        let weights: Vec<f64> = (0..per_bin).map(|point| point_weight(&rules, point)).collect();
        let bins_at_once = (PORTION / per_bin).max(1);
        let n_bins = grid.n_bins();
        let mut means = Vec::with_capacity(n_bins);
        for first in (0..n_bins).step_by(bins_at_once) {
            let bins = first..(first + bins_at_once).min(n_bins);
            let values = self.at(t, &points(grid, &rules, bins, per_bin));
            means.extend(values.chunks_exact(per_bin).map(|values| dot(values, &weights)));
        }
        means
    }
}

fn dot(values: &[f64], weights: &[f64]) -> f64 {
    values.iter().zip(weights).map(|(value, weight)| value * weight).sum()
}

/// Weight of the `point`-th point of a bin, the last axis fastest.
fn point_weight(rules: &[Rule], mut point: usize) -> f64 {
    let mut weight = 1.0;
    for rule in rules.iter().rev() {
        weight *= rule.weights[point % rule.per_bin];
        point /= rule.per_bin;
    }
    weight
}

/// The points of some bins, bin by bin.
fn points(grid: &Grid, rules: &[Rule], bins: std::ops::Range<usize>, per_bin: usize) -> [Vec<f64>; 3] {
    let n_points = bins.len() * per_bin;
    let mut positions = [vec![0.0; n_points], vec![0.0; n_points], vec![0.0; n_points]];
    let mut idx = 0;
    for bin in bins {
        for point in 0..per_bin {
            let mut rest = point;
            for (axis_idx, rule) in rules.iter().enumerate().rev() {
                let node = grid.bin_along(bin, axis_idx) * rule.per_bin + rest % rule.per_bin;
                positions[rule.index][idx] = rule.nodes[node];
                rest /= rule.per_bin;
            }
            idx += 1;
        }
    }
    positions
}

//! Error norms of one output against one reference.
//!
//! Owns the rows and the curves. May use the other parts of `measure`. It deliberately prints nothing.

use super::field::Norms;
use super::grid::is_binned;
use super::observed::{Run, Series};
use super::reference::Prepared;
use super::{Curve, ErrorRow};
use crate::plan::OutputKind;

/// An output beside the bin means of a reference.
pub(super) struct Comparison<'a> {
    reference: &'a Prepared<'a>,
    kind: OutputKind,
    series: Series,
    /// Per time, over the bins.
    expected: Vec<Vec<f64>>,
}

impl<'a> Comparison<'a> {
    pub(super) fn new(run: &Run, reference: &'a Prepared<'a>, output_idx: usize) -> Result<Self, String> {
        let of = reference.reference;
        let series = run.series_of(output_idx, of.target, of.number)?;
        let expected =
            series.times.iter().map(|observed| reference.bin_means(observed.t, &series.grid)).collect();
        Ok(Self { reference, kind: run.output(output_idx).kind, series, expected })
    }

    /// A row per time and one over all times; only the latter for totals and γ.
    pub(super) fn rows(&self) -> Vec<ErrorRow> {
        let n_times = self.series.times.len();
        let mut rows = Vec::new();
        if is_binned(self.kind) {
            rows.extend((0..n_times).map(|idx| self.row(idx..idx + 1, Some(self.series.times[idx].t))));
        }
        if n_times > 0 {
            rows.push(self.row(0..n_times, None));
        }
        rows
    }

    fn row(&self, times: std::ops::Range<usize>, t: Option<f64>) -> ErrorRow {
        let mut difference = Norms::new(self.series.grid.weight);
        let mut size = Norms::new(self.series.grid.weight);
        let mut noise = Norms::new(self.series.grid.weight);
        let mut n_empty = 0;
        for (observed, expected) in self.series.times[times.clone()].iter().zip(&self.expected[times]) {
            for (bin, &expected) in expected.iter().enumerate() {
                let is_gap = self.reference.has_gaps && expected.is_nan();
                if !observed.is_filled[bin] || is_gap {
                    n_empty += 1;
                    continue;
                }
                difference.add(observed.values[bin] - expected);
                size.add(expected);
                // A bin of one particle has no standard error.
                let standard_error = observed.standard_errors.as_ref().map(|errors| errors[bin]);
                if let Some(standard_error) = standard_error.filter(|error| !error.is_nan()) {
                    noise.add(standard_error);
                }
            }
        }
        ErrorRow {
            reference_idx: self.reference.idx,
            reference: self.reference.reference.name.clone(),
            output_idx: self.series.output_idx,
            kind: self.kind,
            quantity: self.reference.reference.target,
            t,
            l1: difference.l1(),
            l2: difference.l2(),
            l_inf: difference.l_inf(),
            rmse: difference.rmse(),
            l1_relative: quotient(difference.l1(), size.l1()),
            l2_relative: quotient(difference.l2(), size.l2()),
            l_inf_relative: quotient(difference.l_inf(), size.l_inf()),
            noise: (noise.count() > 0).then(|| noise.l2()),
            n_bins: difference.count(),
            n_empty,
        }
    }

    /// The reference along the axis of a profile at every time, or over time; none for maps.
    pub(super) fn curves(&self) -> Result<Vec<Curve>, String> {
        let has_gaps = self.reference.has_gaps;
        let curve = |t, x: Vec<f64>, y: Vec<f64>| {
            // Where there are no data nothing is drawn.
            let points = x.into_iter().zip(y).filter(|(_, y)| !(has_gaps && y.is_nan()));
            let (x, y) = points.unzip();
            Curve {
                reference: self.reference.reference.name.clone(),
                output_idx: self.series.output_idx,
                quantity: self.reference.reference.target,
                t,
                x,
                y,
            }
        };
        let grid = &self.series.grid;
        let Some(axis_idx) = grid.profile_axis() else {
            let x = self.series.times.iter().map(|observed| observed.t).collect();
            let y = self.expected.iter().map(|expected| expected[0]).collect();
            return Ok(vec![curve(None, x, y)]);
        };
        if self.kind == OutputKind::Map {
            return Ok(Vec::new());
        }
        let axis = grid.axes[axis_idx];
        let times = self.series.times.iter().zip(&self.expected);
        Ok(times
            .map(|(observed, expected)| {
                if grid.axes.len() == 1 {
                    let x = axis.edges_and_centres();
                    let mut positions = [vec![0.0; x.len()], vec![0.0; x.len()], vec![0.0; x.len()]];
                    positions[axis.index].clone_from(&x);
                    let y = self.reference.at(observed.t, &positions);
                    curve(Some(observed.t), x, y)
                } else {
                    let x = (0..axis.n_bins).map(|bin| axis.centre(bin)).collect();
                    curve(Some(observed.t), x, expected.clone())
                }
            })
            .collect())
    }
}

fn quotient(error: f64, size: f64) -> Option<f64> {
    (size > 0.0).then(|| error / size)
}

//! What a run found for one quantity of one output.
//!
//! Owns the way from snapshots to columns. May use `plan` and the engine's snapshots. It deliberately
//! compares nothing.

use super::grid::Grid;
use crate::engine::snapshot::{Outcome, Snapshot, Values, counts};
use crate::plan::{Output, OutputKind, Plan, Quantity};

/// A finished run.
pub(super) struct Run<'a> {
    pub(super) plan: &'a Plan,
    pub(super) snapshots: &'a [Snapshot],
    pub(super) outcome: &'a Outcome,
}

/// Values at one time over the bins of a grid (one value if it has none).
pub(super) struct Observed {
    pub(super) t: f64,
    pub(super) values: Vec<f64>,
    pub(super) standard_errors: Option<Vec<f64>>,
    /// False for a bin that too few particles were in for a value.
    pub(super) is_filled: Vec<bool>,
}

/// All times of one quantity.
pub(super) struct Series {
    pub(super) output_idx: usize,
    pub(super) grid: Grid,
    pub(super) times: Vec<Observed>,
}

impl Run<'_> {
    pub(super) fn output(&self, output_idx: usize) -> &Output {
        &self.plan.outputs[output_idx]
    }

    /// The output of that kind with the quantity that has the bins and times of another one.
    pub(super) fn find(&self, kind: OutputKind, quantity: Quantity, like: &Output) -> Option<usize> {
        self.plan.outputs.iter().position(|output| {
            output.kind == kind
                && column(output, quantity).is_some()
                && output.bins == like.bins
                && output.times == like.times
                && output.station == like.station
        })
    }

    /// The first number of a quantity at all times of an output.
    pub(super) fn series(&self, output_idx: usize, quantity: Quantity) -> Result<Series, String> {
        self.series_of(output_idx, quantity, 0)
    }

    /// A number of a quantity at all times of an output.
    pub(super) fn series_of(
        &self,
        output_idx: usize,
        quantity: Quantity,
        number: usize,
    ) -> Result<Series, String> {
        series(self.plan, self.snapshots, output_idx, (quantity, number))
    }
}

/// The values of a quantity, or of one of its numbers, at all times of an output.
pub(super) fn series(
    plan: &Plan,
    snapshots: &[Snapshot],
    output_idx: usize,
    (quantity, number): (Quantity, usize),
) -> Result<Series, String> {
    let output = &plan.outputs[output_idx];
    let column = column(output, quantity).ok_or("the output lacks that species or pair.")?;
    let grid = Grid::of(plan, output)?;
    let times = snapshots
        .iter()
        .filter(|snapshot| snapshot.output_idx == output_idx)
        .map(|snapshot| observed(plan, snapshot, (column, number), grid.n_bins()))
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Series { output_idx, grid, times })
}

/// Where a quantity stands among those of an output; a pair is the same in either order.
pub(super) fn column(output: &Output, quantity: Quantity) -> Option<usize> {
    output.quantities.iter().position(|&listed| match (listed, quantity) {
        (Quantity::Pair(a, b), Quantity::Pair(c, d)) => (a, b) == (c, d) || (a, b) == (d, c),
        _ => listed == quantity,
    })
}

fn observed(
    plan: &Plan,
    snapshot: &Snapshot,
    (column, number): (usize, usize),
    n_bins: usize,
) -> Result<Observed, String> {
    let single = |value: Option<f64>| value.map(|value| (vec![value], None, vec![true]));
    // A bin without masses holds none; one without fluid says nothing.
    let least = u64::from(!plan.carries_mass());
    let found = match &snapshot.values {
        Values::Binned { mean, standard_error, n_particles } => mean.get(column).map(|mean| {
            (
                mean.clone(),
                standard_error.get(column).cloned(),
                filled(counts(n_particles, mean.len(), column), least),
            )
        }),
        Values::Covariance { covariance, n_particles } => {
            covariance.get(column).map(|values| (values.clone(), None, filled(n_particles, 2)))
        }
        Values::Total { amount } => single(amount.get(column).copied()),
        // γ has no value where nothing is mixed yet (M_mean = 0 but for rounding): left out like an empty bin.
        Values::Mixing(states) => states.get(column).map(|state| {
            (vec![state.gamma], None, vec![!(state.gamma.is_nan() && state.m_mean.is_finite())])
        }),
        Values::Particles { .. } => None,
        // A number of the only row; it may have no value, as a concentration where no water flows.
        Values::Rows(rows) => match rows.get(column).map(Vec::as_slice) {
            Some([row]) => row.numbers.get(number).map(|&value| (vec![value], None, vec![!value.is_nan()])),
            _ => None,
        },
    };
    match found {
        Some((values, standard_errors, is_filled)) if values.len() == n_bins && is_filled.len() == n_bins => {
            Ok(Observed { t: snapshot.t, values, standard_errors, is_filled })
        }
        _ => Err("The snapshots of an output do not have its bins and columns.".into()),
    }
}

fn filled(n_particles: &[u64], needed: u64) -> Vec<bool> {
    n_particles.iter().map(|&n| n >= needed).collect()
}

//! Passes over parcels that have kernels of their own.
//!
//! Owns the work on some of them. May use the operator and neighbours. It deliberately chooses nothing.

use super::around::Around;
use super::local::Metrics;
use super::operator::{Operator, Wanted};
use crate::catalog::kernel::Radial;
use crate::plan::exchange::Normalisation;

/// Some parcels of a pass, to be dispatched to wide or narrow code.
pub struct OnOwnKernels<'a, 'b, const D: usize, K> {
    pub operator: &'a Operator<'b, D>,
    pub metrics: Metrics<'b>,
    pub kernel: K,
    pub wanted: Wanted<'a>,
    pub first: usize,
    pub targets: &'a mut [&'b mut [f64]],
    pub around: &'a mut Around,
}

impl<const D: usize, K: Radial> pulp::NullaryFnOnce for OnOwnKernels<'_, '_, D, K> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { operator, metrics, kernel, wanted, first, targets, around } = self;
        let n = targets.first().map_or(0, |target| target.len());
        let square = operator.crowd.space.radius * operator.crowd.space.radius;
        for at in 0..n {
            let idx = first + at;
            around.find(&operator.crowd, &metrics, idx);
            match wanted {
                Wanted::Densities => {
                    around.weigh(kernel, square);
                    targets[0][at] = around.sum();
                }
                Wanted::Weighted(factors) => {
                    around.weigh(kernel, square);
                    targets[0][at] = around.sum_of(factors);
                }
                Wanted::Differences(columns) => {
                    around.force(kernel, square);
                    operator.normalise_own(&metrics, around, idx);
                    for column in 0..columns.len() {
                        let values = &columns[column];
                        targets[column][at] = around.difference(values, values[idx]);
                    }
                    if targets.len() > columns.len() {
                        targets[columns.len()][at] = around.sum_of_others();
                    }
                }
            }
        }
    }
}

impl<const D: usize> Operator<'_, D> {
    #[inline(always)]
    fn normalise_own(&self, metrics: &Metrics, around: &mut Around, idx: usize) {
        let own = self.factors[idx];
        match self.normalisation {
            Normalisation::Arithmetic => {
                around.share_by_mean(&self.factors, own, metrics.shares, metrics.shares[idx]);
            }
            Normalisation::Geometric | Normalisation::Sinkhorn => around.multiply(&self.factors, own),
        }
        if !self.caps.is_empty() {
            around.limit(&self.caps, self.caps[idx]);
        }
    }
}

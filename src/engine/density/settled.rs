//! When an iteration ends.
//!
//! Owns what is looked at for it. May use the search. It deliberately changes no kernel.

use super::adaptive::Search;
use super::kinds::Cell;
use super::limits::GROWTH;
use crate::maths::vector::pow;

/// From this loop on the running mean of the error may end the iteration.
const RUNNING: usize = 8;

/// Of all cells, those whose supports may still grow when the iteration ends.
const GROWING: f64 = 0.05;

/// What a loop may change of a cell.
pub(super) struct Before {
    h: f64,
    sigma: f64,
    rho: f64,
}

impl Before {
    pub(super) fn of(cell: &Cell) -> Self {
        Self { h: cell.h, sigma: cell.sigma, rho: cell.rho }
    }
}

/// What ends the iteration.
#[derive(Default)]
pub(super) struct Ends {
    pub(super) errors: Vec<f64>,
}

impl Search<'_> {
    /// Quadratic mean of the predicted squared errors of cells, per square of all particles.
    pub(super) fn error(&self) -> f64 {
        let (d, n) = (self.d, self.counts.iter().sum::<f64>());
        let error = |cell: &Cell| {
            let h = cell.h;
            let variance = cell.n / (self.constants.square * pow(h, d));
            (variance + 0.25 * cell.roughness * h * h * h * h) / (n * n)
        };
        let squares: f64 = self.cells.iter().map(|cell| error(cell) * error(cell)).sum();
        (squares / self.cells.len() as f64).sqrt()
    }
}

impl Ends {
    /// Whether anything has changed by less than the tolerance: the predicted error, densities, bandwidths, or from some loop
    /// on the running mean of the error.
    pub(super) fn are_reached(&mut self, search: &Search, old: &[Before]) -> bool {
        let cells = &search.cells;
        let root = |squares: f64| (squares / cells.len() as f64).sqrt();
        let total = search.error();
        let change = |new: f64, old: f64| (new / old - 1.0) * (new / old - 1.0);
        let pairs = || cells.iter().zip(old);
        let most = cells.iter().fold(0.0_f64, |most, cell| most.max(cell.rho));
        let most_old = old.iter().fold(0.0_f64, |most, cell| most.max(cell.rho));
        let of_densities = root(pairs().map(|(new, old)| change(new.rho / most, old.rho / most_old)).sum());
        let of_bandwidths = root(pairs().map(|(new, old)| change(new.h, old.h)).sum());
        let tolerance = search.adaptive.tolerance;
        let before = self.errors.last().copied();
        let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
        let mean_before = (self.errors.len() + 1 >= RUNNING).then(|| mean(&self.errors));
        self.errors.push(total);
        let of_error = before.is_some_and(|before| (total / before - 1.0).abs() < tolerance);
        let of_mean = mean_before.is_some_and(|before| (mean(&self.errors) / before - 1.0).abs() < tolerance);
        // Supports that grow as fast as they may are on their way, whatever else stands still.
        let is_growing = |(new, old): &(&Cell, &Before)| new.sigma >= (1.0 - 1e-9) * GROWTH * old.sigma;
        if (pairs().filter(is_growing).count() as f64) > GROWING * cells.len() as f64 {
            return false;
        }
        of_error || of_densities < tolerance || of_bandwidths < tolerance || of_mean
    }
}

//! Fields of errors, with the noise that is in them.
//!
//! Owns variances and their removal. May use nothing else of the crate. It deliberately knows neither
//! plans nor snapshots.

/// One value of an output and the errors in it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Cell {
    /// Of the run itself.
    pub value: f64,
    /// Variance of one run.
    pub noise: f64,
    /// Systematic errors: of the step, of a finite number of particles, and of bins.
    pub step: Estimate,
    pub bias: Estimate,
    pub bins: Estimate,
}

/// How the trials differ from the run.
#[derive(Debug, Clone, Copy)]
pub(super) struct Levers {
    /// Particles of the run divided by those of a trial, less one.
    pub fewer: f64,
    /// How many bins a halved bin makes, less one.
    pub crowding: f64,
    /// What halving takes away of the error of bins.
    pub bins: f64,
}

/// The differences that tell of particles and bins, for one value.
///
/// With `e` the error of bins of width `h` and `b` that of `n` particles per bin, of the orders `h²` and
/// `1/n`, the expected values are `smaller = fewer · b`, `halved = bins · e − crowding · b` and
/// `halved_smaller = bins · e − (1 + fewer) · crowding · b`.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Differences {
    /// Mean of the trials with fewer particles, less the run.
    pub smaller: Estimate,
    /// The run, less the same on half bins.
    pub halved: Estimate,
    /// Trials with fewer particles, less the same on half bins.
    pub halved_smaller: Estimate,
}

impl Differences {
    /// `b` from the run and smaller runs: other paths, much noise.
    fn direct(self, levers: Levers) -> Estimate {
        self.smaller.times(1.0 / levers.fewer)
    }

    /// `b` from what halving does to many and to few particles: the same paths, little noise.
    fn paired(self, levers: Levers) -> Estimate {
        self.halved.plus(self.halved_smaller.times(-1.0)).times(1.0 / (levers.fewer * levers.crowding))
    }

    /// `b` and `e`, with the share `direct` of `b` from the direct difference.
    pub fn resolve(self, levers: Levers, direct: f64) -> (Estimate, Estimate) {
        let paired = 1.0 - direct;
        let bias = self.direct(levers).times(direct).plus(self.paired(levers).times(paired));
        // Written in the three differences, which are independent of one another.
        let bins = self
            .halved
            .times(1.0 + paired / levers.fewer)
            .plus(self.halved_smaller.times(-paired / levers.fewer))
            .plus(self.smaller.times(direct * levers.crowding / levers.fewer));
        (bias, bins.times(1.0 / levers.bins))
    }
}

/// The share of the direct estimate of `b` that leaves the least variance in all values together.
pub(super) fn share_of_direct(cells: &[Differences], levers: Levers) -> f64 {
    let sum = |of: fn(Differences, Levers) -> Estimate| -> f64 {
        cells.iter().map(|cell| of(*cell, levers).variance).sum()
    };
    let (direct, paired) = (sum(Differences::direct), sum(Differences::paired));
    if direct + paired > 0.0 { paired / (direct + paired) } else { 0.0 }
}

/// A number and its variance.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Estimate {
    pub value: f64,
    pub variance: f64,
}

impl Estimate {
    pub fn times(self, factor: f64) -> Self {
        Self { value: factor * self.value, variance: factor * factor * self.variance }
    }

    /// The sum with an independent one.
    pub fn plus(self, other: Self) -> Self {
        Self { value: self.value + other.value, variance: self.variance + other.variance }
    }
}

/// Mean of independent values, and the variance of one of them.
///
/// - Equation: `x̄ = Σx/n`, `s² = Σ(x − x̄)²/(n − 1)`.
/// - Range: no variance for `n < 2` (zero).
/// - Source: the textbook estimators.
/// - Shape: two numbers.
pub(super) fn mean_and_variance(values: &[f64]) -> Estimate {
    let n = values.len() as f64;
    let value = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|x| (x - value) * (x - value)).sum();
    Estimate { value, variance: if values.len() < 2 { 0.0 } else { squares / (n - 1.0) } }
}

/// The factor by which a noisy field is shrunk so that noise alone vanishes.
///
/// - Equation: `k = max(0, 1 − Σ V / Σ e²)`.
/// - Symbols: `e` the field, `V` the variance of each of its values.
/// - Range: 0 to 1; a field of zeros keeps its zeros.
/// - Source: the positive-part estimator of James and Stein (1961) for a known variance.
/// - Shape: one number for the whole field.
pub(super) fn shrinkage(field: impl Iterator<Item = Estimate>) -> f64 {
    let (mut size, mut noise) = (0.0, 0.0);
    for estimate in field {
        size += estimate.value * estimate.value;
        noise += estimate.variance;
    }
    if size > 0.0 { (1.0 - noise / size).max(0.0) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_alone_vanishes_and_a_clear_field_stays() {
        let of = |value: f64, variance| std::iter::repeat_n(Estimate { value, variance }, 10);
        assert_eq!(shrinkage(of(1.0, 1.5)), 0.0);
        assert_eq!(shrinkage(of(1.0, 0.25)), 0.75);
        assert_eq!(shrinkage(of(0.0, 0.0)), 0.0);
    }

    #[test]
    fn differences_are_resolved_into_bias_and_bins() {
        let (e, b) = (0.3, -0.02);
        let levers = Levers { fewer: 3.0, crowding: 7.0, bins: 0.75 };
        let exact = |value| Estimate { value, variance: 1.0 };
        let cell = Differences {
            smaller: exact(3.0 * b),
            halved: exact(0.75 * e - 7.0 * b),
            halved_smaller: exact(0.75 * e - 4.0 * 7.0 * b),
        };
        for direct in [0.0, 0.3, 1.0] {
            let (bias, bins) = cell.resolve(levers, direct);
            assert!((bias.value - b).abs() < 1e-15 && (bins.value - e).abs() < 1e-15, "{bias:?} {bins:?}");
        }
        assert!(share_of_direct(&[cell], levers) < 0.1);
    }

    #[test]
    fn the_variance_is_that_of_one_value() {
        let found = mean_and_variance(&[1.0, 3.0]);
        assert_eq!((found.value, found.variance), (2.0, 2.0));
        assert_eq!(mean_and_variance(&[5.0]).variance, 0.0);
    }
}

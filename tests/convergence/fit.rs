//! Means of repeated runs, and the order that errors show.

use nalgebra::{Matrix3, Vector3};

/// Mean and its standard error.
#[derive(Debug, Clone, Copy)]
pub struct Estimate {
    pub mean: f64,
    pub standard_error: f64,
}

impl Estimate {
    pub fn of(values: &[f64]) -> Self {
        let n = values.len() as f64;
        let mean = values.iter().sum::<f64>() / n;
        let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
        Self { mean, standard_error: (variance / n).sqrt() }
    }

    pub fn minus(self, exact: f64) -> Self {
        Self { mean: self.mean - exact, ..self }
    }
}

/// The exponent `p` of `error = a hᵖ exp(c h)` and its standard error, by weighted least squares of the
/// logarithm. The last factor holds the next order of the error: without it a method of first order
/// shows 0.95 at steps that are large enough to see.
pub fn order(errors: &[(f64, Estimate)]) -> Estimate {
    let largest = errors.iter().map(|(h, _)| *h).fold(0.0, f64::max);
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (h, error) in errors {
        let row = Vector3::new(1.0, h.ln(), h / largest);
        let weight = (error.mean / error.standard_error).powi(2);
        normal += row * row.transpose() * weight;
        right += row * error.mean.abs().ln() * weight;
    }
    let covariance = normal.try_inverse().expect("three sizes at least");
    Estimate { mean: (covariance * right)[1], standard_error: covariance[(1, 1)].sqrt() }
}

/// Errors made up: the fit finds their order.
#[test]
fn the_fit_finds_the_order_it_was_given() {
    for wanted in [0.5, 1.0, 2.0] {
        let error =
            |h: f64| Estimate { mean: -3.0 * h.powf(wanted) * (-0.4 * h).exp(), standard_error: 1e-3 };
        let found = order(&[1.0, 0.5, 0.25, 0.125].map(|h| (h, error(h))));
        assert!((found.mean - wanted).abs() < 1e-10, "{found:?}");
        assert!(found.standard_error > 0.0 && found.standard_error < 0.1);
    }
}

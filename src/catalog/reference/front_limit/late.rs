//! The law of the slow zone long after the start: nearly normal.
//!
//! Owns its central moments as series in 1/(χt) and Edgeworth's expansion. May use `maths`. It
//! deliberately stops where the expansion no longer gives five digits (χt = 60, error 2e-6).

use super::Law;
use crate::maths::scalar::{erfc, exp};
use std::f64::consts::{PI, SQRT_2};
use std::sync::OnceLock;

/// Beyond this ξ the spread is below 3e-7 and the series are no longer needed.
const FARTHEST: f64 = 3.5;
/// Moments up to this one.
const N_MOMENTS: usize = 6;
/// Powers of 1/(χt) up to this one.
const N_POWERS: usize = 6;
/// Terms of each series, from its leading one on.
const N_TERMS: usize = 4;

pub(super) struct Late {
    age: f64,
}

impl Late {
    pub(super) fn new(age: f64) -> Self {
        Self { age }
    }
}

impl Law for Late {
    fn excess(&self, xi: f64, mean: f64, u: f64) -> f64 {
        if xi > FARTHEST {
            return 0.0;
        }
        let [variance, third, fourth, fifth, sixth] = std::array::from_fn(|i| moment(i + 2, xi, self.age));
        let spread = variance.sqrt();
        let z = (u - mean) / spread;
        // Also where the spread is zero: at infinite age.
        if z.is_nan() || z > 30.0 {
            return 0.0;
        }
        let standard = |moment: f64, power: i32| moment / spread.powi(power);
        let (third, fourth) = (standard(third, 3), standard(fourth, 4));
        let (fifth, sixth) = (standard(fifth, 5), standard(sixth, 6));
        let cumulants =
            [third, fourth - 3.0, fifth - 10.0 * third, sixth - 15.0 * fourth - 10.0 * third * third + 30.0];
        (spread * standard_excess(z, cumulants)).max(0.0)
    }
}

/// Expected excess of a nearly normal variable with mean 0 and variance 1.
///
/// Equation: `E[(Z − z)₊] = φ(z) − z Φ̄(z) + φ(z) Σ_j c_j He_{j−2}(z)`, where the density is
/// `φ (1 + Σ_j c_j He_j)`: the first four orders of Edgeworth's expansion.
/// Symbols: φ normal density, Φ̄ its tail, He_j Hermite's polynomials, λ3…λ6 the cumulants.
/// Dimensions and range: none; not negative up to the error of the expansion.
/// Source: Edgeworth 1905; coefficients as in Blinnikov & Moessner 1998, Astron. Astrophys. Suppl. 130.
/// Shape: −z for z → −∞, 0 for z → ∞.
fn standard_excess(z: f64, [l3, l4, l5, l6]: [f64; 4]) -> f64 {
    let mut hermite = [1.0; 11];
    hermite[1] = z;
    for n in 1..10 {
        hermite[n + 1] = z * hermite[n] - n as f64 * hermite[n - 1];
    }
    let corrections = l3 / 6.0 * hermite[1]
        + l4 / 24.0 * hermite[2]
        + l3 * l3 / 72.0 * hermite[4]
        + l5 / 120.0 * hermite[3]
        + l3 * l4 / 144.0 * hermite[5]
        + l3 * l3 * l3 / 1296.0 * hermite[7]
        + l6 / 720.0 * hermite[4]
        + (l4 * l4 / 1152.0 + l3 * l5 / 720.0) * hermite[6]
        + l3 * l3 * l4 / 1728.0 * hermite[8]
        + l3 * l3 * l3 * l3 / 31104.0 * hermite[10];
    let density = exp(-0.5 * z * z) / (2.0 * PI).sqrt();
    density * (1.0 + corrections) - 0.5 * z * erfc(z / SQRT_2)
}

/// `E[(W − ū)^n | ξ] = e^{−nξ²} Σ_k p_nk(ξ) (χt)^{−k}`
fn moment(n: usize, xi: f64, age: f64) -> f64 {
    let leading = n.div_ceil(2);
    let terms = leading..(leading + N_TERMS).min(N_POWERS + 1);
    let sum: f64 = terms.map(|k| value_of(&coefficients()[n][k], xi) / age.powi(k as i32)).sum();
    exp(-(n as f64) * xi * xi) * sum
}

/// A polynomial, lowest power first.
type Polynomial = Vec<f64>;

/// `p_nk` of the moments' series.
///
/// Equation: `(n/2) p_{n,k+1} = ¼p'' + (½−n) ξ p' + [(n²−n) ξ² + k − n/2] p − (n/2√π)(q' − 2(n−1) ξ q)
/// plus (n(n−1)/4π) r`, with `p = p_{n,k}`, `q = p_{n−1,k}`, `r = p_{n−2,k}`.
/// Symbols: n order of the moment, k power of 1/(χt).
/// Dimensions and range: none.
/// Source: `∂m_n/∂t = D [m_n'' + 2n ū' m_{n−1}' + n(n−1) ū'² m_{n−2}] − (nχ/2) m_n`, from the particle model.
/// Shape: polynomials of degree 2(k − n/2).
fn coefficients() -> &'static Vec<Vec<Polynomial>> {
    static COEFFICIENTS: OnceLock<Vec<Vec<Polynomial>>> = OnceLock::new();
    COEFFICIENTS.get_or_init(|| {
        let mut all: Vec<Vec<Polynomial>> = vec![vec![Polynomial::new(); N_POWERS + 1]; N_MOMENTS + 1];
        all[0][0] = vec![1.0];
        for k in 0..N_POWERS {
            for n in 2..=N_MOMENTS {
                all[n][k + 1] = next_power(n, k, &all[n][k], &all[n - 1][k], &all[n - 2][k]);
            }
        }
        all
    })
}

fn next_power(n: usize, k: usize, p: &[f64], q: &[f64], r: &[f64]) -> Polynomial {
    let (n, k) = (n as f64, k as f64);
    let beside = 0.5 * n / PI.sqrt();
    let (slope, q_slope) = (derivative(p), derivative(q));
    let mut sum = vec![0.0; p.len().max(q.len()).max(r.len()) + 3];
    add(&mut sum, 0, 0.25, &derivative(&slope));
    add(&mut sum, 1, 0.5 - n, &slope);
    add(&mut sum, 2, n * n - n, p);
    add(&mut sum, 0, k - 0.5 * n, p);
    add(&mut sum, 0, -beside, &q_slope);
    add(&mut sum, 1, 2.0 * (n - 1.0) * beside, q);
    add(&mut sum, 0, 0.25 * n * (n - 1.0) / PI, r);
    sum.iter_mut().for_each(|value| *value *= 2.0 / n);
    while sum.last() == Some(&0.0) {
        sum.pop();
    }
    sum
}

/// sum += factor · ξ^shift · polynomial
fn add(sum: &mut [f64], shift: usize, factor: f64, polynomial: &[f64]) {
    for (value, coefficient) in sum[shift..].iter_mut().zip(polynomial) {
        *value += factor * coefficient;
    }
}

fn derivative(polynomial: &[f64]) -> Polynomial {
    polynomial.iter().enumerate().skip(1).map(|(power, coefficient)| power as f64 * coefficient).collect()
}

fn value_of(polynomial: &[f64], xi: f64) -> f64 {
    polynomial.iter().rev().fold(0.0, |value, coefficient| value * xi + coefficient)
}

//! Expectation of `(V − v)₊` from the Legendre moments of V.
//!
//! Owns the expansion of the hinge. May use `maths`. It deliberately knows no equation of motion.

use crate::maths::scalar::exp;
use std::sync::OnceLock;

/// Legendre moments of degree 0 … N_MODES − 1 are used.
pub(super) const N_MODES: usize = 81;

/// `½ h_n(z)` for all n, so that `E[(V − v)₊] = Σ_n ½ h_n E[L_n(2V − 1)]`.
///
/// Equation: `h_n = ½ [(L_{n−2} − L_n)/(2n−1) − (L_n − L_{n+2})/(2n+3)](z)`, `z = 2v − 1`, for n ≥ 2;
/// h_0 = (1−z)²/4, h_1 = ½ − ¾z + ¼z³; each times exp(−36 (n/81)¹²).
/// Symbols: L_n Legendre's polynomials, V in 0…1.
/// Dimensions and range: none; 0 ≤ v ≤ 1.
/// Source: ∫_z^1 L_n = (L_{n−1} − L_{n+1})/(2n+1), twice; filter of Vandeven 1991 type, which keeps the
/// cut-off of the sum from ringing where the law of V is narrow.
/// Shape: oscillating, falling like n^(−5/2).
pub(super) fn hinge(v: f64) -> [f64; N_MODES] {
    let z = (2.0 * v - 1.0).clamp(-1.0, 1.0);
    let mut legendre = [0.0; N_MODES + 2];
    (legendre[0], legendre[1]) = (1.0, z);
    for n in 1..N_MODES + 1 {
        let n_real = n as f64;
        legendre[n + 1] =
            ((2.0 * n_real + 1.0) * z * legendre[n] - n_real * legendre[n - 1]) / (n_real + 1.0);
    }
    let filter = filter();
    let mut hinge = [0.0; N_MODES];
    hinge[0] = 0.125 * (1.0 - z) * (1.0 - z);
    hinge[1] = 0.25 - 0.375 * z + 0.125 * z * z * z;
    for n in 2..N_MODES {
        let n_real = n as f64;
        let below = (legendre[n - 2] - legendre[n]) / (2.0 * n_real - 1.0);
        let above = (legendre[n] - legendre[n + 2]) / (2.0 * n_real + 3.0);
        hinge[n] = 0.25 * (below - above) * filter[n];
    }
    hinge
}

fn filter() -> &'static [f64; N_MODES] {
    static FILTER: OnceLock<[f64; N_MODES]> = OnceLock::new();
    FILTER.get_or_init(|| std::array::from_fn(|n| exp(-36.0 * (n as f64 / N_MODES as f64).powi(12))))
}

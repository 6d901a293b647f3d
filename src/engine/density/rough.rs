//! Roughness of a density around a cell, by the shape of the kernel.
//!
//! Owns these sums. May use the fixed maths. It deliberately chooses no shape.

use crate::maths::vector::pow;

/// Sum of what two different axes have in common, of a lower triangle by rows.
pub fn crossed(psi: &[f64], d: usize) -> f64 {
    (0..d).flat_map(|i| (0..i).map(move |j| (i, j))).map(|(i, j)| psi[i * (i + 1) / 2 + j]).sum()
}

/// The net roughness of the shape that is least rough.
///
/// - Equation: `ψ` on a line; `2 ψ₁₂ + 2 √(ψ₁₁ψ₂₂)` in a plane; `3 (ψ₁₁ψ₂₂ψ₃₃)^{1/3} + 2 Σ ψ_ij (ψ_kk²/(ψ_iiψ_jj))^{1/6}` in
///   space.
/// - Symbols: `ψ_ij` locally averaged products of curvatures; k is the third axis.
/// - Range: ψ_ii above zero; the released code adds no cross term that is negative in space.
/// - Source: methods, (3.5), (3.6).
/// - Shape: never negative, but for rounding.
pub fn net_roughness(psi: &[f64], own: &[f64], is_released: bool) -> f64 {
    match own {
        [a] => *a,
        [a, b] => 2.0 * psi[1] + 2.0 * (a * b).sqrt(),
        [a, b, c] => {
            let cross = |psi: f64, third: f64, i: f64, j: f64| {
                let psi = if is_released { psi.max(0.0) } else { psi };
                2.0 * psi * pow(third * third / (i * j), 1.0 / 6.0)
            };
            3.0 * pow(a * b * c, 1.0 / 3.0)
                + cross(psi[1], *c, *a, *b)
                + cross(psi[3], *b, *a, *c)
                + cross(psi[4], *a, *b, *c)
        }
        _ => 0.0,
    }
}

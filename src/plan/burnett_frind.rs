//! The dispersion tensor with two lengths across the flow.
//!
//! Owns the formula. May use nothing else of the crate. It deliberately knows no place: a velocity is all it is given.

/// Tensor of constant dispersion in a uniform flow, m²/s.
///
/// - Equation: `D = |v| (α_L n nᵀ + Σ_k α_k t_k t_kᵀ) + D_m I` in the form of Burnett and Frind, with a
///   transverse length of its own for what is vertical.
/// - Symbols: `n = v/|v|`; α lengths along, across and vertically across the flow; `D_m` molecular.
/// - Range: any velocity; without flow the molecular part is left.
/// - Source: R. D. Burnett, E. O. Frind (1987), Water Resources Research 23(4), 695.
/// - Shape: 3 × 3, x, y, z.
pub fn uniform_tensor(velocity: [f64; 3], [along, across, vertical, own]: [f64; 4]) -> [[f64; 3]; 3] {
    let speed = velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
    let n = if speed > 0.0 { velocity.map(|v| v / speed) } else { [0.0; 3] };
    let square = n.map(|n| n * n);
    let mut tensor = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            let is_vertical = i == 2 || j == 2;
            let other = if is_vertical { vertical } else { across };
            let part = if i == j {
                let mut sum = along * square[i];
                for k in (0..3).filter(|&k| k != i) {
                    sum += if i == 2 || k == 2 { vertical } else { across } * square[k];
                }
                sum
            } else {
                (along - other) * n[i] * n[j]
            };
            tensor[i][j] = speed * part + if i == j { own } else { 0.0 };
        }
    }
    tensor
}

//! Flexible conjugate gradients.
//!
//! Owns the iteration. May use the matrix and the cycle. It deliberately knows no heads: its caller asks for
//! corrections.

use super::cycle::Cycle;
use super::matrix::{add, dot};

/// Solves `A x = b` from zero until the norm of the residual has fallen to a share, or iterations are used up.
///
/// - Equation: `z = M⁻¹ r`, `d = z − (z·Ad′/d′·Ad′) d′`, `x += (d·r/d·Ad) d`.
/// - Symbols: `M` the cycle, `d′` the direction before.
/// - Range: symmetric positive `A`; `M` may change from step to step.
/// - Source: Y. Notay (2000), SIAM J. Sci. Comput. 22, 1444, doi:10.1137/S1064827599362314.
/// - Shape: `b` becomes the residual, `x` the solution; the number of iterations.
pub fn solve(cycle: &mut Cycle, b: &mut [f64], x: &mut [f64], share: f64, most: usize) -> usize {
    let n = b.len();
    x.fill(0.0);
    let before = dot(b, b);
    let mut left = before;
    let (mut direction, mut image, mut step) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    let mut curvature = 0.0;
    let mut iterations = 0;
    while left > share * share * before && iterations < most {
        cycle.apply(b, &mut step);
        let back = if curvature > 0.0 { -dot(&step, &image) / curvature } else { 0.0 };
        for (direction, step) in direction.iter_mut().zip(&step) {
            *direction = step + back * *direction;
        }
        cycle.matrix().multiply(&direction, &mut image);
        curvature = dot(&direction, &image);
        if curvature <= 0.0 || !curvature.is_finite() {
            break;
        }
        let length = dot(&direction, b) / curvature;
        add(x, length, &direction);
        add(b, -length, &image);
        left = dot(b, b);
        iterations += 1;
    }
    iterations
}

//! Linear systems with five diagonals.
//!
//! Owns one solver. May use nothing else. It deliberately does not pivot: callers bring matrices whose
//! diagonal dominates or nearly so, as those of diffusion do.

/// The four diagonals beside the main one; entry `i` belongs to row `i`.
#[derive(Debug, Clone, Default)]
pub struct Sides {
    /// Columns i − 2, i − 1, i + 1, i + 2; entries that reach outside of the matrix are zero.
    pub rows: Vec<[f64; 4]>,
}

/// Scratch memory of [`solve`].
#[derive(Debug, Clone, Default)]
pub struct Scratch {
    upper: Vec<[f64; 2]>,
}

/// Solves `(factor · sides + diagonal) x = x`, replacing the right-hand side by the solution.
///
/// `diagonal(i)` gives the main diagonal.
pub fn solve(
    sides: &Sides,
    factor: f64,
    diagonal: impl Fn(usize) -> f64,
    x: &mut [f64],
    scratch: &mut Scratch,
) {
    scratch.upper.clear();
    let (mut before, mut twice_before) = ([0.0; 2], [0.0; 2]);
    let (mut x_before, mut x_twice_before) = (0.0, 0.0);
    for (i, (value, row)) in x.iter_mut().zip(&sides.rows).enumerate() {
        let far_left = factor * row[0];
        let left = factor * row[1] - twice_before[0] * far_left;
        let pivot = diagonal(i) - twice_before[1] * far_left - before[0] * left;
        let inverse = 1.0 / pivot;
        let upper = [(factor * row[2] - before[1] * left) * inverse, factor * row[3] * inverse];
        *value = (*value - x_twice_before * far_left - x_before * left) * inverse;
        (twice_before, before) = (before, upper);
        (x_twice_before, x_before) = (x_before, *value);
        scratch.upper.push(upper);
    }
    let (mut next, mut after_next) = (0.0, 0.0);
    for (value, upper) in x.iter_mut().zip(&scratch.upper).rev() {
        *value -= upper[0] * next + upper[1] * after_next;
        (after_next, next) = (next, *value);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solution_satisfies_the_system() {
        let n = 12;
        let inside = |i: usize, offset: i64| (0..n as i64).contains(&(i as i64 + offset));
        let entry = |i: usize, offset: i64| {
            if inside(i, offset) { 0.3 * offset as f64 - 0.1 * i as f64 } else { 0.0 }
        };
        let sides = Sides { rows: (0..n).map(|i| [-2, -1, 1, 2].map(|offset| entry(i, offset))).collect() };
        let diagonal = |i: usize| 6.0 + i as f64;
        let expected: Vec<f64> = (0..n).map(|i| 1.0 + (i as f64) * (i as f64 - 5.0)).collect();
        let at = |i: i64| usize::try_from(i).ok().and_then(|i| expected.get(i)).copied().unwrap_or(0.0);
        let mut x: Vec<f64> = (0..n)
            .map(|i| {
                let row = sides.rows[i];
                let i_signed = i as i64;
                let beside = row[0] * at(i_signed - 2)
                    + row[1] * at(i_signed - 1)
                    + row[2] * at(i_signed + 1)
                    + row[3] * at(i_signed + 2);
                0.5 * beside + diagonal(i) * expected[i]
            })
            .collect();
        solve(&sides, 0.5, diagonal, &mut x, &mut Scratch::default());
        for (value, expected) in x.iter().zip(&expected) {
            assert!((value - expected).abs() < 1e-12, "{value} instead of {expected}");
        }
    }
}

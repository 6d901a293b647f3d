//! Symmetric matrices of up to three rows, by their lower triangles.
//!
//! Owns their closed forms. May use nothing. It deliberately allocates nothing: parcels have one each.

/// Row by row, with room for three rows.
pub type Triangle = [f64; 6];

#[inline(always)]
pub fn determinant<const D: usize>(m: &Triangle) -> f64 {
    match D {
        1 => m[0],
        2 => m[0] * m[2] - m[1] * m[1],
        _ => {
            m[0] * (m[2] * m[5] - m[4] * m[4]) - m[1] * (m[1] * m[5] - m[4] * m[3])
                + m[3] * (m[1] * m[4] - m[2] * m[3])
        }
    }
}

/// The inverse, by cofactors over the determinant.
#[inline(always)]
pub fn inverse<const D: usize>(m: &Triangle, determinant: f64) -> Triangle {
    let one = 1.0 / determinant;
    match D {
        1 => [one, 0.0, 0.0, 0.0, 0.0, 0.0],
        2 => [m[2] * one, -m[1] * one, m[0] * one, 0.0, 0.0, 0.0],
        _ => [
            (m[2] * m[5] - m[4] * m[4]) * one,
            (m[3] * m[4] - m[1] * m[5]) * one,
            (m[0] * m[5] - m[3] * m[3]) * one,
            (m[1] * m[4] - m[2] * m[3]) * one,
            (m[1] * m[3] - m[0] * m[4]) * one,
            (m[0] * m[2] - m[1] * m[1]) * one,
        ],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn full(m: &Triangle, row: usize, column: usize) -> f64 {
        let (row, column) = (row.max(column), row.min(column));
        m[row * (row + 1) / 2 + column]
    }

    fn check<const D: usize>(m: Triangle) {
        let own = inverse::<D>(&m, determinant::<D>(&m));
        for row in 0..D {
            for column in 0..D {
                let product: f64 = (0..D).map(|k| full(&m, row, k) * full(&own, k, column)).sum();
                let wanted = if row == column { 1.0 } else { 0.0 };
                assert!((product - wanted).abs() < 1e-14, "{D} {row} {column} {product}");
            }
        }
    }

    #[test]
    fn inverses_are_inverses() {
        check::<1>([3.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
        check::<2>([3.0, 1.0, 2.0, 0.0, 0.0, 0.0]);
        check::<3>([3.0, 1.0, 2.0, -0.5, 0.75, 4.0]);
    }
}

//! Small symmetric systems, one per lane.
//!
//! Owns their factors, and which functions lanes call. May use the words. It deliberately does not pivot: the matrices are positive definite,
//! and each lane must do what it would do alone.

/// Exponential and logarithm of one lane.
pub(super) use crate::maths::vector::{exp as exp_of, ln as ln_of};

/// Columns of one number per lane.
pub(super) type Columns<const L: usize> = Vec<[f64; L]>;

/// A pivot below this part of its diagonal entry is rounding and counts as this part.
const MIN_PIVOT: f64 = 4e-16;
/// A diagonal entry below this is that of an absent species, which takes no part.
const ABSENT: f64 = 1e-290;

/// The factors of symmetric positive definite matrices.
///
/// Equation: `A = G D Gᵀ`; row by row, `t_l = a_jl − Σ_{m<l} t_m g_lm`, `g_jl = t_l/d_l`, `d_j = a_jj − Σ t_l g_jl`.
/// Symbols: `matrix` the lower triangle row by row; `factors` G with `1/d` on its diagonal.
/// Dimensions and range: any n.
/// Source: Golub & Van Loan 2013, Matrix Computations, §4.1.2 and §4.2.3.
/// Shape: n³/6 multiplications per lane, n divisions; rows of zeros answer zero. Returns the least part that a
/// pivot is of its diagonal entry: 0 for a singular matrix.
#[inline(always)]
pub(super) fn factor<const L: usize>(n: usize, matrix: &[[f64; L]], factors: &mut [[f64; L]]) -> [f64; L] {
    let mut least_part = [1.0; L];
    for j in 0..n {
        let row = j * (j + 1) / 2;
        let (above, own) = factors.split_at_mut(row);
        let mut pivot = matrix[row + j];
        for l in 0..j {
            let other = l * (l + 1) / 2;
            let mut t = matrix[row + l];
            for m in 0..l {
                for lane in 0..L {
                    t[lane] -= own[m][lane] * above[other + m][lane];
                }
            }
            own[l] = t;
        }
        for l in 0..j {
            let reciprocal = &above[l * (l + 1) / 2 + l];
            for lane in 0..L {
                let t = own[l][lane];
                own[l][lane] = t * reciprocal[lane];
                pivot[lane] -= t * own[l][lane];
            }
        }
        let diagonal = &matrix[row + j];
        for lane in 0..L {
            let least = MIN_PIVOT * diagonal[lane];
            let pivot = if pivot[lane] > least { pivot[lane] } else { least };
            let is_present = diagonal[lane] > ABSENT;
            own[j][lane] = if is_present { 1.0 / pivot } else { 0.0 };
            let part = if is_present { pivot / diagonal[lane] } else { 1.0 };
            least_part[lane] = if part < least_part[lane] { part } else { least_part[lane] };
        }
    }
    least_part
}

/// `x ← A⁻¹ x` with the factors of A.
#[inline(always)]
pub(super) fn solve<const L: usize>(n: usize, factors: &[[f64; L]], x: &mut [[f64; L]]) {
    for j in 0..n {
        let row = &factors[j * (j + 1) / 2..];
        let mut sum = x[j];
        for l in 0..j {
            for lane in 0..L {
                sum[lane] -= row[l][lane] * x[l][lane];
            }
        }
        x[j] = sum;
    }
    for j in 0..n {
        let reciprocal = &factors[j * (j + 1) / 2 + j];
        for lane in 0..L {
            x[j][lane] *= reciprocal[lane];
        }
    }
    for j in (0..n).rev() {
        let own = x[j];
        for l in 0..j {
            let cell = &factors[j * (j + 1) / 2 + l];
            for lane in 0..L {
                x[l][lane] -= cell[lane] * own[lane];
            }
        }
    }
}

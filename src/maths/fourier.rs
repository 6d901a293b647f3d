//! Fast Fourier transforms of sizes 2^a 3^b 5^c, along any axis of an array.
//!
//! Owns the transform and the choice of sizes. May use `maths`. It deliberately takes no crate for it: theirs
//! ask the system for sines, whose last bits depend on the machine.

use super::scalar;

/// Columns that are transformed together: wide enough for vectors, few enough for the cache.
const COLUMNS: usize = 64;

/// The smallest 2^a 3^b 5^c that is at least `n`.
pub fn good_size(n: usize) -> usize {
    let is_good = |mut size: usize| {
        for factor in [2, 3, 5] {
            while size.is_multiple_of(factor) {
                size /= factor;
            }
        }
        size == 1
    };
    let mut size = n.max(1);
    while !is_good(size) {
        size += 1;
    }
    size
}

/// Real and imaginary parts, apart.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Complex {
    pub re: Vec<f64>,
    pub im: Vec<f64>,
}

impl Complex {
    pub fn zeros(n: usize) -> Self {
        Self { re: vec![0.0; n], im: vec![0.0; n] }
    }
}

/// Transforms each axis of an array whose last axis is fastest; the sizes must be [`good_size`]s.
///
/// - Equation: `Y_k = Σ_j X_j exp(−2πi k·j/n)`.
/// - Symbols: `n` cells along an axis; no factor in front.
/// - Range: any finite numbers.
/// - Source: T. G. Stockham's self-sorting form in W. T. Cochran et al. (1967), Proc. IEEE 55, 1664,
///   doi:10.1109/PROC.1967.5957.
/// - Shape: the array is overwritten.
pub fn transform(data: &mut Complex, n: [usize; 3]) {
    for axis in 0..3 {
        let inner: usize = n[axis + 1..].iter().product();
        if n[axis] > 1 {
            along(data, n[axis], inner);
        }
    }
}

/// The same along one axis of `n` rows, with `inner` numbers side by side in each.
///
/// - Equation: `Y_k = Σ_j X_j exp(−2πi k j/n)` for each of them.
/// - Symbols: as for [`transform`].
/// - Range: any finite numbers; n a [`good_size`], at least one number.
/// - Source: as for [`transform`].
/// - Shape: the array is overwritten; what is longer than `n inner` holds several such blocks.
pub fn along(data: &mut Complex, n: usize, inner: usize) {
    let plan = Plan::new(n);
    let mut from = Complex::zeros(n * inner.min(COLUMNS));
    let mut to = from.clone();
    let n_outer = data.re.len() / (n * inner);
    for outer in 0..n_outer {
        for first in (0..inner).step_by(COLUMNS) {
            let width = COLUMNS.min(inner - first);
            let start = |row: usize| (outer * n + row) * inner + first;
            for row in 0..n {
                let (old, new) = (start(row)..start(row) + width, row * width..(row + 1) * width);
                from.re[new.clone()].copy_from_slice(&data.re[old.clone()]);
                from.im[new].copy_from_slice(&data.im[old]);
            }
            plan.run(&mut from, &mut to, width);
            for row in 0..n {
                let (old, new) = (row * width..(row + 1) * width, start(row)..start(row) + width);
                data.re[new.clone()].copy_from_slice(&from.re[old.clone()]);
                data.im[new].copy_from_slice(&from.im[old]);
            }
        }
    }
}

/// Factors of a size, and its roots of unity.
struct Plan {
    n: usize,
    factors: Vec<usize>,
    cos: Vec<f64>,
    sin: Vec<f64>,
}

impl Plan {
    fn new(n: usize) -> Self {
        let mut factors = Vec::new();
        let mut rest = n;
        for factor in [4, 2, 3, 5] {
            while rest.is_multiple_of(factor) {
                factors.push(factor);
                rest /= factor;
            }
        }
        let angle = |k: usize| -std::f64::consts::TAU * k as f64 / n as f64;
        let cos = (0..n).map(|k| scalar::cos(angle(k))).collect();
        let sin = (0..n).map(|k| scalar::sin(angle(k))).collect();
        Self { n, factors, cos, sin }
    }

    /// `exp(−2πi k/n)`.
    fn root(&self, k: usize) -> (f64, f64) {
        (self.cos[k % self.n], self.sin[k % self.n])
    }

    /// Transforms `width` columns in `from`; `to` is scratch memory.
    fn run(&self, from: &mut Complex, to: &mut Complex, width: usize) {
        let mut rest = self.n;
        let mut stride = width;
        for &factor in &self.factors {
            match factor {
                4 => self.quarter(from, to, rest, stride),
                2 => self.small::<2>(from, to, rest, stride),
                3 => self.small::<3>(from, to, rest, stride),
                _ => self.small::<5>(from, to, rest, stride),
            }
            std::mem::swap(from, to);
            rest /= factor;
            stride *= factor;
        }
    }

    /// One pass of any small factor, by its definition.
    fn small<const R: usize>(&self, from: &Complex, to: &mut Complex, rest: usize, stride: usize) {
        let part = rest / R;
        for p in 0..part {
            for k in 0..R {
                let (wr, wi) = self.root(p * k * (self.n / rest));
                let target = stride * (R * p + k);
                for q in 0..stride {
                    let (mut re, mut im) = (0.0, 0.0);
                    for j in 0..R {
                        let (c, s) = self.root(j * k % R * (self.n / R));
                        let (x, y) =
                            (from.re[q + stride * (p + part * j)], from.im[q + stride * (p + part * j)]);
                        re += x * c - y * s;
                        im += x * s + y * c;
                    }
                    to.re[target + q] = re * wr - im * wi;
                    to.im[target + q] = re * wi + im * wr;
                }
            }
        }
    }

    /// One pass of the factor 4, whose small transform needs no multiplication.
    fn quarter(&self, from: &Complex, to: &mut Complex, rest: usize, stride: usize) {
        let part = rest / 4;
        for p in 0..part {
            let roots = [0, 1, 2, 3].map(|k| self.root(p * k * (self.n / rest)));
            let column = |array: &[f64], j: usize| {
                let start = stride * (p + part * j);
                start..(start + stride).min(array.len())
            };
            let [a, b, c, d] = [0, 1, 2, 3].map(|j| &from.re[column(&from.re, j)]);
            let [e, f, g, h] = [0, 1, 2, 3].map(|j| &from.im[column(&from.im, j)]);
            let block = stride * 4 * p..stride * 4 * (p + 1);
            let (re, im) = (&mut to.re[block.clone()], &mut to.im[block]);
            for q in 0..stride {
                let (even_re, even_im) = (a[q] + c[q], e[q] + g[q]);
                let (odd_re, odd_im) = (b[q] + d[q], f[q] + h[q]);
                let (less_re, less_im) = (a[q] - c[q], e[q] - g[q]);
                // Times −i.
                let (turned_re, turned_im) = (f[q] - h[q], d[q] - b[q]);
                let sums = [
                    (even_re + odd_re, even_im + odd_im),
                    (less_re + turned_re, less_im + turned_im),
                    (even_re - odd_re, even_im - odd_im),
                    (less_re - turned_re, less_im - turned_im),
                ];
                for (k, ((x, y), (wr, wi))) in sums.into_iter().zip(roots).enumerate() {
                    re[stride * k + q] = x * wr - y * wi;
                    im[stride * k + q] = x * wi + y * wr;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition, term by term: rounding grows with the number of terms.
    #[test]
    fn every_size_agrees_with_the_sum_that_defines_it() {
        for n in [[60, 1, 1], [1, 16, 1], [4, 6, 10], [2, 3, 128], [8, 75, 1]] {
            let size: usize = n.iter().product();
            let mut data = Complex::zeros(size);
            for k in 0..size {
                data.re[k] = ((k * 37 + 11) % 101) as f64 / 101.0 - 0.4;
                data.im[k] = ((k * 53 + 29) % 89) as f64 / 89.0 - 0.6;
            }
            let start = data.clone();
            transform(&mut data, n);
            for k in (0..size).step_by(7) {
                let place = |k: usize| [k / (n[1] * n[2]), k / n[2] % n[1], k % n[2]];
                let (mut re, mut im) = (0.0, 0.0);
                for j in 0..size {
                    let turn: f64 =
                        (0..3).map(|axis| (place(k)[axis] * place(j)[axis]) as f64 / n[axis] as f64).sum();
                    let angle = -std::f64::consts::TAU * (turn - turn.floor());
                    let (c, s) = (scalar::cos(angle), scalar::sin(angle));
                    re += start.re[j] * c - start.im[j] * s;
                    im += start.re[j] * s + start.im[j] * c;
                }
                let error = (data.re[k] - re).abs() + (data.im[k] - im).abs();
                assert!(error < 1e-13 * size as f64, "{n:?}, {k}: {error}");
            }
        }
    }

    #[test]
    fn good_sizes_have_small_factors() {
        let sizes: Vec<usize> = [1, 7, 11, 200, 401, 799].into_iter().map(good_size).collect();
        assert_eq!(sizes, [1, 8, 12, 200, 405, 800]);
    }
}

//! How rough a density is, from the waves that counts consist of.
//!
//! Owns the waves that the ends of a lattice allow, and integrals of squared derivatives of smoothed counts. May use the fixed
//! maths and the lattice. It deliberately chooses no bandwidth: once the waves are known any number of them can be tried.

use super::lattice::{AXES, End, Lattice};
use crate::maths::fourier::{Complex, along, good_size};
use crate::maths::scalar;
use crate::maths::vector::exp_of_negative;
use std::f64::consts::{PI, TAU};

/// Lines that are transformed together.
const TOGETHER: usize = 128;

/// Exponents from which on a wave is nothing, whatever power of its number stands before it.
const NOTHING: f64 = 200.0;

/// Variance of a place within a cell, in its size squared.
const WITHIN_CELL: f64 = 1.0 / 12.0;

/// Waves along one axis.
///
/// - Equation: `√(2/L) cos(κ_k x)` or `√(2/L) sin(κ_k x)`, `κ_k = 2u(ak + e)/Δ`, `u = π/4n`.
/// - Symbols: `a` 4 for a periodic axis, else 2; `e` 0 between mirrors, 2 between sinks, 1 between one of each; `L = nΔ`.
/// - Range: n of them on n cells, of which those that are one in every cell have `√(1/L)`.
/// - Source: eigenfunctions of the second derivative with these ends; methods, section 2.3 (mirrors).
/// - Shape: orthonormal on the centres of cells.
#[derive(Debug, Clone, Copy)]
struct Waves {
    n: usize,
    a: usize,
    e: usize,
    is_sine: bool,
}

impl Waves {
    fn new(n: usize, ends: [End; 2]) -> Self {
        let (a, e, is_sine) = match ends.map(End::is_odd) {
            _ if ends.contains(&End::Wrap) => (4, 0, false),
            [false, false] => (2, 0, false),
            [true, true] => (2, 2, true),
            [false, true] => (2, 1, false),
            [true, false] => (2, 1, true),
        };
        Self { n, a, e, is_sine }
    }

    fn is_periodic(self) -> bool {
        self.a == 4
    }

    /// The number of a wave in the row, and whether it is a sine: on periodic axes sines stand behind cosines, backwards.
    fn wave(self, at: usize) -> (usize, bool) {
        match self.is_periodic() {
            true if 2 * at >= self.n => (self.n - at, true),
            _ => (at, self.is_sine),
        }
    }

    /// κ in units of one over the size of a cell.
    fn number(self, at: usize) -> f64 {
        let (k, _) = self.wave(at);
        PI * (self.a * k + self.e) as f64 / (2 * self.n) as f64
    }

    /// The squared factor of a wave times the size of a cell.
    fn square(self, at: usize) -> f64 {
        let (k, _) = self.wave(at);
        // In every cell of the same size: the wave of no number, and the shortest one where it is there.
        let turns = self.a * k + self.e;
        let is_flat = turns == 0 || turns == 2 * self.n;
        (if is_flat { 1.0 } else { 2.0 }) / self.n as f64
    }

    /// Amplitudes in place of values, of all lines along an axis.
    ///
    /// - Equation: `X_k = w(k² + k) Σ_b [c_b w(b²) v(2b + 1)] w̄((k − b)²)`, `w(m) = e^{−iuam}`, `v(m) = e^{−iuem}`.
    /// - Symbols: as for [`Waves`]; `(2b + 1)(ak + e)` is what stands in the exponents together.
    /// - Range: any number of cells, as the sum over b is a convolution of any good size.
    /// - Source: the chirp transform, by `2kb = k² + b² − (k − b)²`.
    /// - Shape: the real part for cosines, less the imaginary one for sines.
    fn transform(self, values: &mut [f64], inner: usize) {
        let n = self.n;
        let size = good_size(2 * n - 1);
        let roots = Roots::new(8 * n);
        let mut chirp = Complex::zeros(size);
        for j in 0..n {
            let (c, s) = roots.at(self.a, j, j);
            for at in [j, (size - j) % size] {
                (chirp.re[at], chirp.im[at]) = (c, s);
            }
        }
        along(&mut chirp, size, 1);
        let n_lines = values.len() / n;
        for first in (0..n_lines).step_by(TOGETHER) {
            let n_own = TOGETHER.min(n_lines - first);
            let place = |line: usize, b: usize| ((line / inner) * n + b) * inner + line % inner;
            let mut data = Complex::zeros(size * n_own);
            for b in 0..n {
                let (c, s) = roots.sum((self.a, b, b), (self.e, 2 * b + 1, 1));
                for own in 0..n_own {
                    let value = values[place(first + own, b)];
                    (data.re[b * n_own + own], data.im[b * n_own + own]) = (value * c, -value * s);
                }
            }
            along(&mut data, size, n_own);
            for (k, (hr, hi)) in chirp.re.iter().zip(&chirp.im).enumerate() {
                for at in k * n_own..(k + 1) * n_own {
                    let (x, y) = (data.re[at], data.im[at]);
                    // Conjugate, as a transform of that is the way back.
                    (data.re[at], data.im[at]) = (x * hr - y * hi, -(x * hi + y * hr));
                }
            }
            along(&mut data, size, n_own);
            for at in 0..n {
                let (k, is_sine) = self.wave(at);
                let (c, s) = roots.at(self.a, k, k + 1);
                let norm = self.square(at).sqrt() / size as f64;
                for own in 0..n_own {
                    let (x, y) = (data.re[k * n_own + own], -data.im[k * n_own + own]);
                    let amplitude = if is_sine { x * s - y * c } else { x * c + y * s };
                    values[place(first + own, at)] = norm * amplitude;
                }
            }
        }
    }
}

/// Cosines and sines of whole parts of a turn.
struct Roots {
    n: usize,
    values: Vec<(f64, f64)>,
}

impl Roots {
    fn new(n: usize) -> Self {
        let angle = |k: usize| TAU * k as f64 / n as f64;
        Self { n, values: (0..n).map(|k| (scalar::cos(angle(k)), scalar::sin(angle(k)))).collect() }
    }

    fn part(&self, (a, b, c): (usize, usize, usize)) -> u128 {
        a as u128 * b as u128 * c as u128
    }

    /// Of a product of whole numbers.
    fn at(&self, a: usize, b: usize, c: usize) -> (f64, f64) {
        self.values[(self.part((a, b, c)) % self.n as u128) as usize]
    }

    /// Of a sum of two products.
    fn sum(&self, one: (usize, usize, usize), other: (usize, usize, usize)) -> (f64, f64) {
        self.values[((self.part(one) + self.part(other)) % self.n as u128) as usize]
    }
}

/// Counts as waves. All lengths are in units of the smallest size of a cell.
#[derive(Debug, Clone)]
pub struct Spectrum {
    d: usize,
    cells: [usize; AXES],
    edge: [f64; AXES],
    /// Squared numbers of waves along each axis.
    numbers: [Vec<f64>; AXES],
    /// Squared amplitudes.
    powers: Vec<f64>,
    /// What particles that know nothing of each other have by themselves, in every wave.
    own: f64,
}

impl Spectrum {
    /// - Equation: `P_k = (Σ_b c_b φ_k(x_b))²`, of which `N/|Ω|` is by single particles.
    /// - Symbols: `c_b` counts, `N` their sum, `φ_k` products of waves, `|Ω|` volume.
    /// - Range: any counts.
    /// - Source: methods, section 2.3.
    /// - Shape: as many as cells.
    pub fn new(lattice: &Lattice, (cells, counts): (&[u32], &[f64])) -> Self {
        let unit = lattice.axes().map(|axis| lattice.edge[axis]).fold(f64::INFINITY, f64::min);
        let mut edge = [1.0; AXES];
        lattice.axes().for_each(|axis| edge[axis] = lattice.edge[axis] / unit);
        let mut values = vec![0.0; lattice.n_cells()];
        for (&cell, count) in cells.iter().zip(counts) {
            values[cell as usize] = *count;
        }
        let mut numbers = [const { Vec::new() }; AXES];
        for axis in 0..AXES {
            let n = lattice.cells[axis];
            let waves = Waves::new(n, lattice.ends[axis]);
            if axis + lattice.d < AXES {
                numbers[axis] = vec![0.0; n];
                continue;
            }
            waves.transform(&mut values, lattice.cells[axis + 1..].iter().product());
            numbers[axis] =
                (0..n).map(|at| waves.number(at) / edge[axis]).map(|number| number * number).collect();
        }
        let volume: f64 = edge.iter().product();
        values.iter_mut().for_each(|value| *value = *value * *value / volume);
        let own = counts.iter().sum::<f64>() / (volume * lattice.n_cells() as f64);
        Self { d: lattice.d, cells: lattice.cells, edge, numbers, powers: values, own }
    }

    /// Integrated products of second derivatives of counts that are smoothed by a Gaussian.
    ///
    /// - Equation: `ψ_ij = Σ_k κ_i² κ_j² [(P_k − N/|Ω|) e^{−Σ κ_a²(g_a² − Δ_a²/12)} + (N/|Ω|) e^{−Σ κ_a² g_a²}]`, or
    ///   `Σ_k κ_i² κ_j² P_k e^{−Σ κ_a² g_a²}` where that is rougher, as it is where particles stand in order.
    /// - Symbols: `g_a` standard deviation along axis a; `Δ_a` size of cells, whose variance pairs of particles have already.
    /// - Range: g of at least one cell; better where it is wider.
    /// - Source: methods, section 2.3; the variance within cells by expansion of the mean over a cell.
    /// - Shape: symmetric, for all axes; never negative on the diagonal in sum.
    pub fn products(&self, g: [f64; AXES]) -> [[f64; AXES]; AXES] {
        let first = AXES - self.d;
        let mut all = [const { [const { Vec::new() }; AXES] }; 2];
        for axis in 0..AXES {
            let variances = variances(g[axis] * g[axis], self.edge[axis]);
            for (fading, variance) in all.iter_mut().zip(variances) {
                fading[axis] = self.numbers[axis].iter().map(|number| faded(number * variance)).collect();
            }
        }
        let [plain, mut pairs] = [0, 1].map(|at| self.sums(&all[at]));
        let own = [0, 1].map(|at| self.own_sums(&all[at]));
        for i in first..AXES {
            for j in first..AXES {
                pairs[i][j] += own[0][i][j] - own[1][i][j];
            }
        }
        let trace = |of: &[[f64; AXES]; AXES]| (first..AXES).map(|axis| of[axis][axis]).sum::<f64>();
        if trace(&pairs) > trace(&plain) { pairs } else { plain }
    }

    /// `Σ_k κ_i² κ_j² P_k` with weights along each axis.
    fn sums(&self, weights: &[Vec<f64>; AXES]) -> [[f64; AXES]; AXES] {
        let mut products = [[0.0; AXES]; AXES];
        for (row, powers) in self.powers.chunks(self.cells[2]).enumerate() {
            let (x, y) = (row / self.cells[1], row % self.cells[1]);
            let weight = weights[0][x] * weights[1][y];
            if weight == 0.0 {
                continue;
            }
            let mut sums = [0.0; 3];
            for ((power, own), number) in powers.iter().zip(&weights[2]).zip(&self.numbers[2]) {
                let term = weight * power * own;
                sums[0] += term;
                sums[1] += term * number;
                sums[2] += term * number * number;
            }
            let (x, y) = (self.numbers[0][x], self.numbers[1][y]);
            products[0][0] += x * x * sums[0];
            products[0][1] += x * y * sums[0];
            products[1][1] += y * y * sums[0];
            products[0][2] += x * sums[1];
            products[1][2] += y * sums[1];
            products[2][2] += sums[2];
        }
        for (i, j) in [(1, 0), (2, 0), (2, 1)] {
            products[i][j] = products[j][i];
        }
        products
    }

    /// The same of what particles have by themselves.
    fn own_sums(&self, weights: &[Vec<f64>; AXES]) -> [[f64; AXES]; AXES] {
        let mut of_axes = [[0.0; 3]; AXES];
        for axis in 0..AXES {
            for (number, weight) in self.numbers[axis].iter().zip(&weights[axis]) {
                let terms = [1.0, *number, number * number];
                of_axes[axis].iter_mut().zip(terms).for_each(|(sum, term)| *sum += weight * term);
            }
        }
        let power = |axis: usize, i: usize, j: usize| usize::from(axis == i) + usize::from(axis == j);
        let product = |i, j| (0..AXES).map(|axis| of_axes[axis][power(axis, i, j)]).product::<f64>();
        std::array::from_fn(|i| std::array::from_fn(|j| self.own * product(i, j)))
    }

    /// The integral of a squared derivative of counts on a line that are smoothed by a Gaussian.
    ///
    /// - Equation: `Σ_k κ^{2s} P_k e^{−κ² t}`.
    /// - Symbols: `s` order, `t` variance; else as for [`Self::products`].
    /// - Range: one axis. What cells take of pairs of particles is not given back: high derivatives see little of them.
    /// - Source: methods, section 2.3, `f_s(t)`.
    /// - Shape: never negative; falls with t.
    pub fn roughness(&self, s: i32, t: f64) -> f64 {
        let waves = self.powers.iter().zip(&self.numbers[AXES - 1]);
        waves.map(|(power, number)| number.powi(s) * power * faded(number * t)).sum()
    }
}

/// A variance, and what of it pairs of particles in cells of a size do not have yet.
fn variances(all: f64, edge: f64) -> [f64; 2] {
    // Where cells are too coarse for it some smoothing has to be left.
    [all, (all - WITHIN_CELL * edge * edge).max(0.5 * all)]
}

/// `e^{−x}`, nothing where it does not matter.
fn faded(x: f64) -> f64 {
    if x < NOTHING { exp_of_negative(-x) } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENDS: [[End; 2]; 5] = [
        [End::Mirror; 2],
        [End::Wrap; 2],
        [End::Sink; 2],
        [End::Mirror, End::Sink],
        [End::Sink, End::Mirror],
    ];

    fn counts(n: usize) -> Vec<f64> {
        (0..n).map(|k| ((k * 37 + 11) % 101) as f64).collect()
    }

    /// Waves are orthonormal: nothing of a square is lost, and waves of single cells are those of their definition.
    #[test]
    fn waves_hold_all_of_a_square() {
        for ends in ENDS {
            for n in [1, 2, 3, 8, 13, 30] {
                for other in [1, 7] {
                    let lattice = Lattice::new(&[(n, 0.5, ends), (other, 0.2, ENDS[0])]);
                    let Some(lattice) = lattice else { continue };
                    let cells: Vec<u32> = (0..lattice.n_cells() as u32).collect();
                    let counts = counts(cells.len());
                    let spectrum = Spectrum::new(&lattice, (&cells, &counts));
                    let all: f64 = spectrum.powers.iter().sum();
                    let square = counts.iter().map(|count| count * count).sum::<f64>() / 2.5;
                    assert!((all / square - 1.0).abs() < 1e-12, "{ends:?}, {n}, {other}: {all} for {square}");
                }
            }
        }
    }

    #[test]
    fn amplitudes_are_sums_over_cells() {
        for ends in ENDS {
            for n in [1, 5, 12] {
                let waves = Waves::new(n, ends);
                let values = counts(n);
                let mut found = values.clone();
                waves.transform(&mut found, 1);
                for (at, found) in found.iter().enumerate() {
                    let (_, is_sine) = waves.wave(at);
                    let term = |(b, value): (usize, &f64)| {
                        let angle = waves.number(at) * (b as f64 + 0.5);
                        value * if is_sine { scalar::sin(angle) } else { scalar::cos(angle) }
                    };
                    let sum = waves.square(at).sqrt() * values.iter().enumerate().map(term).sum::<f64>();
                    assert!((found - sum).abs() < 1e-11, "{ends:?}, {n}, {at}: {found} for {sum}");
                }
            }
        }
    }
}

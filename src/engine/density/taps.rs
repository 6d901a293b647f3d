//! Kernels along one axis: what each cell has of one that stands in a cell.
//!
//! Owns Gaussians integrated over cells, their second derivatives, and what ends do with them. May use the fixed maths. It
//! deliberately knows no density: kernels in a plane or in space are products of these.

use super::lattice::{End, Lattice};
use crate::maths::scalar;
use crate::maths::vector;
use std::f64::consts::{FRAC_1_SQRT_2, PI};
use std::sync::OnceLock;

/// Standard deviations within which a kernel is, and those of its second derivative.
pub const REACH: f64 = 3.0;
pub const CURVATURE_REACH: f64 = 4.0;

/// Of the table of integrals, per standard deviation, and its end.
const STEPS: usize = 256;
const END: usize = 9;

/// `½ erf(u/√2)` and its derivative at every step.
fn table() -> &'static [[f64; 2]] {
    static TABLE: OnceLock<Vec<[f64; 2]>> = OnceLock::new();
    TABLE.get_or_init(|| {
        (0..=STEPS * END + 1)
            .map(|k| {
                let u = k as f64 / STEPS as f64;
                [0.5 * scalar::erf(u * FRAC_1_SQRT_2), bell(u) / STEPS as f64]
            })
            .collect()
    })
}

fn bell(u: f64) -> f64 {
    vector::exp_of_negative(-0.5 * u * u) / (2.0 * PI).sqrt()
}

/// `½ erf(u/√2)`: the integral of a normal density from 0 to u.
///
/// - Equation: cubic through values and slopes at steps of 1/256.
/// - Symbols: `u` in standard deviations.
/// - Range: any; right to 4e-13.
/// - Source: Hermite's interpolation, rest `h⁴/384 max|φ‴|`.
/// - Shape: odd, from −½ to ½.
#[derive(Clone, Copy)]
pub struct Integral(&'static [[f64; 2]]);

impl Integral {
    pub fn new() -> Self {
        Self(table())
    }

    #[inline(always)]
    pub fn at(self, u: f64) -> f64 {
        let size = u.abs();
        if size >= END as f64 {
            return 0.5_f64.copysign(u);
        }
        let place = size * STEPS as f64;
        let k = place as usize;
        let t = place - k as f64;
        let [low, low_slope] = self.0[k];
        let [high, high_slope] = self.0[k + 1];
        let rise = high - low;
        let bend = low_slope + high_slope - 2.0 * rise;
        let value = low + t * (low_slope + t * ((rise - low_slope - bend) + t * bend));
        value.copysign(u)
    }
}

/// An axis at a level: fine cells, how many of them make a cell of the level, and its ends.
#[derive(Debug, Clone, Copy)]
pub struct Line {
    pub n: usize,
    pub factor: usize,
    pub ends: [End; 2],
}

/// What the cells of a level have, from one on.
#[derive(Debug, Clone, Default)]
pub struct Taps {
    pub first: usize,
    pub values: Vec<f64>,
}

impl Taps {
    /// Of an axis that is not used.
    pub fn be_one(&mut self) {
        self.first = 0;
        self.values.clear();
        self.values.push(1.0);
    }
}

impl Line {
    /// An axis of a lattice, so many of whose cells make one.
    pub fn of(lattice: &Lattice, axis: usize, factor: usize) -> Self {
        Self { n: lattice.cells[axis], factor, ends: lattice.ends[axis] }
    }

    /// A kernel and what ends make of it: where its centre appears, in fine cells, and by which sign, as far as it reaches the
    /// line.
    fn images(self, centre: f64, reach: f64) -> impl Iterator<Item = (f64, f64)> {
        let n = self.n as f64;
        let is_ring = self.ends.contains(&End::Wrap);
        let [low, high]: [f64; 2] = self.ends.map(|end| if end.is_odd() { -1.0 } else { 1.0 });
        // Once, or twice where the line is shorter than the reach, and so on.
        let most = ((reach + n) / (2.0 * n)) as i32 + 1;
        let own = move |k: i32| {
            let times = k.unsigned_abs() as i32;
            if is_ring {
                return [(centre + 2.0 * n * f64::from(k), 1.0), (centre + n * f64::from(2 * k - 1), 1.0)];
            }
            let shifted = (centre + 2.0 * n * f64::from(k), (low * high).powi(times));
            let of_low = if k > 0 { k - 1 } else { 1 - k };
            let sign = low.powi(of_low) * high.powi(times);
            [shifted, (2.0 * n * f64::from(k) - centre, sign)]
        };
        // The kernel itself comes first, as sums are in this order.
        let all = std::iter::once(0).chain((1..=most).flat_map(|k| [k, -k])).flat_map(own);
        all.filter(move |(image, _)| image + reach > 0.0 && image - reach < n)
    }

    /// Cells of the level that are within reach of a centre.
    fn within(self, centre: f64, reach: f64) -> (usize, usize) {
        let last = (self.n - 1) as f64;
        let first = (centre - reach).clamp(0.0, last) as usize;
        // What touches an end by rounding does not reach the next cell.
        let end = (centre + reach - 1e-9).clamp(0.0, last) as usize;
        (first / self.factor, end / self.factor + 1)
    }

    /// Whether a kernel and its images are the same everywhere, to 3e-9: it is wider than twice the line, and nothing is lost.
    pub fn is_short_for(self, width: f64) -> bool {
        width > 2.0 * self.n as f64 && !self.ends.iter().any(|end| end.is_odd())
    }

    /// The same in every fine cell.
    pub fn fill_evenly(self, value: f64, taps: &mut Taps) {
        taps.first = 0;
        taps.values.clear();
        for cell in 0..self.n.div_ceil(self.factor) {
            taps.values.push(value * self.factor.min(self.n - cell * self.factor) as f64);
        }
    }

    /// Whether a kernel reaches no end, on fine cells.
    fn is_inside(self, centre: f64, reach: f64) -> bool {
        self.factor == 1 && centre - reach >= 0.0 && centre + reach <= self.n as f64
    }

    /// Room for all images.
    fn clear(self, centre: f64, reach: f64, taps: &mut Taps) {
        let (mut first, mut end) = self.within(centre, reach);
        for (image, _) in self.images(centre, reach).skip(1) {
            let own = self.within(image, reach);
            (first, end) = (first.min(own.0), end.max(own.1));
        }
        taps.first = first;
        taps.values.clear();
        taps.values.resize(end - first, 0.0);
    }

    /// A Gaussian in cell `b`, integrated over the cells of the level.
    ///
    /// - Equation: `½ [erf((b_k − x)/(√2 σ)) − erf((a_k − x)/(√2 σ))] / erf(r/(√2 σ))` over what is within `r = ⌈3 h⌉ + ½`.
    /// - Symbols: `a_k`, `b_k` ends of a cell; `x` centre of cell b; `σ` standard deviation, `h` the one that reach is by.
    /// - Range: all in fine cells; positive; sums to 1 with mirrored ends.
    /// - Source: methods, (4.1) and section 4.2.
    /// - Shape: cells from the first within reach.
    pub fn gaussian(self, integral: Integral, b: usize, sizes: (f64, f64), taps: &mut Taps) {
        self.gaussian_at(integral, b as f64 + 0.5, sizes, taps);
    }

    /// The same in a cell of the level.
    pub fn gaussian_of_cell(self, integral: Integral, cell: usize, sizes: (f64, f64), taps: &mut Taps) {
        let (low, high) = (cell * self.factor, ((cell + 1) * self.factor).min(self.n));
        self.gaussian_at(integral, 0.5 * (low + high) as f64, sizes, taps);
    }

    fn gaussian_at(self, integral: Integral, centre: f64, (deviation, width): (f64, f64), taps: &mut Taps) {
        if self.is_short_for(width) {
            return self.fill_evenly(1.0 / self.n as f64, taps);
        }
        let reach = (REACH * width).ceil() + 0.5;
        let per = 1.0 / deviation;
        let norm = 0.5 / integral.at(reach * per);
        if self.is_inside(centre, reach) {
            let mut below = integral.at(-0.5 * per);
            return even(centre, reach, taps, |z| {
                let above = integral.at((z + 0.5) * per);
                let value = norm * (above - below);
                below = above;
                value
            });
        }
        self.clear(centre, reach, taps);
        for (centre, sign) in self.images(centre, reach) {
            let (first, end) = self.within(centre, reach);
            let start = ((first * self.factor) as f64).max(centre - reach);
            let mut below = integral.at((start - centre) * per);
            for cell in first..end {
                let edge = (((cell + 1) * self.factor).min(self.n) as f64).min(centre + reach);
                let above = integral.at((edge - centre) * per);
                taps.values[cell - taps.first] += sign * norm * (above - below);
                below = above;
            }
        }
    }

    /// What the centres of the cells of the level have of something that is even, in cell `b`.
    pub fn sample(self, b: usize, reach: f64, value: &dyn Fn(f64) -> f64, taps: &mut Taps) {
        let centre = b as f64 + 0.5;
        if self.is_inside(centre, reach) {
            return even(centre, reach, taps, value);
        }
        self.clear(centre, reach, taps);
        for (centre, sign) in self.images(centre, reach) {
            let (first, end) = self.within(centre, reach);
            for cell in first..end {
                let (low, high) = (cell * self.factor, ((cell + 1) * self.factor).min(self.n));
                let z = (0.5 * (low + high) as f64 - centre).abs();
                if z <= reach {
                    taps.values[cell - taps.first] += sign * value(z);
                }
            }
        }
    }
}

/// What is even, in the middle of a fine cell: worked out from there on, and turned over.
#[inline(always)]
fn even(centre: f64, reach: f64, taps: &mut Taps, value: impl FnMut(f64) -> f64) {
    let n_beside = (reach - 0.5) as usize;
    taps.first = (centre - reach) as usize;
    taps.values.clear();
    taps.values.resize(n_beside, 0.0);
    taps.values.extend((0..=n_beside).map(|z| z as f64).map(value));
    for z in 1..=n_beside {
        taps.values[n_beside - z] = taps.values[n_beside + z];
    }
}

/// A second derivative of a Gaussian, integrated over fine cells, as factors along axes.
///
/// - Equation: `V_i[z] = −(1/(√(2π) ĝ_i³)) [(z+½) e^{−(z+½)²/2ĝ²} − (z−½) e^{−(z−½)²/2ĝ²}] Π_j ½ [erf(·) − erf(·)]`
/// - Symbols: `ĝ_j` bandwidth over the cells' size, by axis; `i` the axis of the derivative.
/// - Range: `|z| ≤ ⌈4 ĝ⌉`; positive entries are scaled so that the sum is 0, then all so that the sum of squares is the
///   integral's `3/(2^{d+2} π^{d/2} ĝ_i⁵ Π_{j≠i} ĝ_j)`; neither in the released code.
/// - Source: methods, (4.1b), (A.3), (A.4).
/// - Shape: even.
#[derive(Debug, Clone, Copy)]
pub struct Curvature {
    g: f64,
    pub reach: f64,
    /// Of positive and of negative entries.
    scales: [f64; 2],
}

impl Curvature {
    pub fn along(g: f64) -> Self {
        let scale = -1.0 / ((2.0 * PI).sqrt() * g * g * g);
        Self { g, reach: (CURVATURE_REACH * g).ceil() + 0.5, scales: [scale; 2] }
    }

    #[inline(always)]
    fn bare(&self, z: f64) -> f64 {
        let (high, low) = (z + 0.5, z - 0.5);
        let half = -0.5 / (self.g * self.g);
        high * vector::exp_of_negative(half * high * high) - low * vector::exp_of_negative(half * low * low)
    }

    #[inline(always)]
    pub fn at(&self, z: f64) -> f64 {
        let bare = self.bare(z);
        bare * self.scales[usize::from(bare > 0.0)]
    }

    /// Sum zero and the sum of squares of the integral, with the factors of other axes, given by their bandwidths.
    pub fn corrected(mut self, integral: Integral, d: usize, others: &[f64]) -> Self {
        let n = (self.reach - 0.5) as usize;
        let all = |z: usize| if z == 0 { 1.0 } else { 2.0 };
        // The sign is that of the derivative: entries of bare that are positive belong to negative values.
        let mut sums = [[0.0; 2]; 2];
        for z in 0..=n {
            let value = self.bare(z as f64);
            let own = &mut sums[usize::from(value > 0.0)];
            own[0] += all(z) * value;
            own[1] += all(z) * value * value;
        }
        let balance = -sums[1][0] / sums[0][0];
        self.scales[0] *= balance;
        let squares =
            self.scales[0] * self.scales[0] * sums[0][1] + self.scales[1] * self.scales[1] * sums[1][1];
        let of_others: f64 = others.iter().map(|&g| Smooth::new(integral, g).squares(n_of(g))).product();
        let g_others: f64 = others.iter().product();
        let exact = 3.0
            / (f64::from(1 << (d + 2))
                * PI.powi(d as i32 / 2)
                * if d % 2 == 1 { PI.sqrt() } else { 1.0 }
                * self.g.powi(5)
                * g_others);
        let scale = (exact / (squares * of_others)).sqrt();
        self.scales = self.scales.map(|own| own * scale);
        self
    }

    /// As the released code has it.
    pub fn scaled(mut self, factor: f64) -> Self {
        self.scales = self.scales.map(|own| own * factor);
        self
    }
}

fn n_of(g: f64) -> usize {
    (CURVATURE_REACH * g).ceil() as usize
}

/// A Gaussian integrated over a fine cell, not normalised.
#[derive(Clone, Copy)]
pub struct Smooth {
    integral: Integral,
    per: f64,
}

impl Smooth {
    pub fn new(integral: Integral, g: f64) -> Self {
        Self { integral, per: 1.0 / g }
    }

    #[inline(always)]
    pub fn at(&self, z: f64) -> f64 {
        self.integral.at((z + 0.5) * self.per) - self.integral.at((z - 0.5) * self.per)
    }

    fn squares(&self, n: usize) -> f64 {
        let square = |z: usize| self.at(z as f64) * self.at(z as f64);
        square(0) + 2.0 * (1..=n).map(square).sum::<f64>()
    }
}

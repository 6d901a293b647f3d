//! Fields smoothed by Gaussians of all widths at once: a few widths, each at the resolution that it needs, and values between.
//!
//! Owns the widths and what is read between them. May use fields, taps and bands. It deliberately knows not what the fields are.

use super::bands::{Band, smooth};
use super::lattice::{AXES, Field, Lattice, Window};
use super::taps::{Integral, Line};
use crate::maths::vector::ln;
use crate::maths::wide::Width;
use std::f64::consts::SQRT_2;

/// Cells of a level within the standard deviation of the narrowest Gaussian that is summed on it.
const RESOLVED: f64 = SQRT_2;

/// Widths over the smallest edge of a cell, at which ladders begin: the k-th is `2^{k/2}` of it. Sums with narrower ones are
/// cheap one by one.
const NARROWEST: f64 = 2.0 * SQRT_2;

/// A width of the ladder.
struct Rung {
    level: u32,
    factors: [usize; AXES],
    field: Field,
}

/// A smoothed field.
pub struct Ladder {
    /// As it was.
    pub field: Field,
    first: usize,
    rungs: Vec<Rung>,
    /// The width of rung zero, m.
    narrowest: f64,
}

/// What a cell reads of a ladder.
type Cubic = [(usize, [f64; 4]); AXES];

impl Ladder {
    /// A field on fine cells of a window, smoothed by widths that enclose a range, m.
    ///
    /// - Equation: `F_σ = Σ_k F_k w_k`, with variances of `σ² − (f² − 1) Δ²/6`.
    /// - Symbols: `F_k` means over cells of f fine ones; `w` the Gaussian integrated over them.
    /// - Range: σ at least √2 cells of its level where that is not the finest.
    /// - Source: methods, section 4.8; a mean over cells and a kernel cut to cells widen a kernel by Δ²/12 each.
    /// - Shape: rungs a factor of √2 apart.
    pub fn new(
        (lattice, integral, width): (&Lattice, Integral, Width),
        window: &Window,
        field: Field,
        (least, most): (f64, f64),
    ) -> Self {
        let smallest = lattice.axes().map(|axis| lattice.edge[axis]).fold(f64::INFINITY, f64::min);
        let narrowest = NARROWEST * smallest;
        let place = |width: f64| 2.0 * (ln((width / narrowest).max(1.0)) / std::f64::consts::LN_2);
        let (first, last) = (place(least) as usize, place(most) as usize + 1);
        let last = if most < narrowest { first } else { last + 1 };
        let mut rungs = Vec::new();
        let (mut level, mut coarse) = (0, None);
        for rung in first..last {
            let deviation = narrowest * power(rung);
            let wanted = lattice.level_of(deviation / RESOLVED);
            while level < wanted {
                let factors = [lattice.level(level), lattice.level(level + 1)];
                let finer = coarse.as_ref().unwrap_or(&field);
                coarse = Some(finer.coarsened(window, lattice.cells, factors));
                level += 1;
            }
            let factors = lattice.level(level);
            let coarse = coarse.as_ref().unwrap_or(&field);
            let mut smoothed = coarse.clone();
            for axis in lattice.axes() {
                let band = band(lattice, integral, (axis, factors[axis]), deviation);
                smooth(&mut smoothed, axis, &band, width);
            }
            rungs.push(Rung { level, factors, field: smoothed });
        }
        Self { field, first, rungs, narrowest }
    }

    /// Whether sums with a width are read here.
    pub fn has(&self, deviation: f64) -> bool {
        deviation >= self.narrowest && self.rungs.len() > 1
    }

    /// The field at a cell, for a width within the range.
    pub fn read(&self, lattice: &Lattice, cell: [usize; AXES], deviation: f64) -> f64 {
        let place = 2.0 * ln((deviation / self.narrowest).max(1.0)) / std::f64::consts::LN_2;
        let below = (place as usize).clamp(self.first, self.first + self.rungs.len() - 2) - self.first;
        let t = (place - (below + self.first) as f64).clamp(0.0, 1.0);
        let [low, high] = [&self.rungs[below], &self.rungs[below + 1]];
        let at_low = low.cubic(lattice, cell);
        let at_high = if low.level == high.level { at_low } else { high.cubic(lattice, cell) };
        (1.0 - t) * read(&low.field, &at_low) + t * read(&high.field, &at_high)
    }
}

/// `2^{k/2}`
fn power(k: usize) -> f64 {
    (1_u64 << (k / 2)) as f64 * if k % 2 == 1 { SQRT_2 } else { 1.0 }
}

/// A Gaussian along an axis of a level.
fn band(lattice: &Lattice, integral: Integral, (axis, factor): (usize, usize), deviation: f64) -> Band {
    let own = deviation / lattice.edge[axis];
    let variance = (own * own - ((factor * factor) as f64 - 1.0) / 6.0).max(0.25 * own * own);
    let line = Line { n: lattice.cells[axis], factor, ends: lattice.ends[axis] };
    Band::gaussian(line, integral, (variance.sqrt(), own))
}

impl Rung {
    /// Cells and weights along each axis with which a fine cell is read: Lagrange's cubic, or a cell itself.
    #[inline(always)]
    fn cubic(&self, lattice: &Lattice, cell: [usize; AXES]) -> Cubic {
        let mut cubic = Cubic::default();
        for axis in 0..AXES {
            let (factor, n, first) = (self.factors[axis], self.field.cells[axis], self.field.first[axis]);
            if factor == 1 || n < 4 {
                cubic[axis] = (cell[axis] / factor - first, [1.0, 0.0, 0.0, 0.0]);
                continue;
            }
            let x = (cell[axis] as f64 + 0.5) / factor as f64 - 0.5 - first as f64;
            let low = (x - 1.0).clamp(0.0, (n - 4) as f64) as usize;
            // The last cell of an axis may be narrower: its centre is nearer then.
            let n_all = lattice.cells[axis].div_ceil(factor);
            let missing = (n_all * factor - lattice.cells[axis]) as f64 / factor as f64;
            let nearer = if low + 4 + first == n_all { 0.5 * missing } else { 0.0 };
            cubic[axis] = (low, lagrange(x - low as f64, nearer));
        }
        cubic
    }
}

/// Weights of values at 0, 1, 2 and `3 − nearer` for a value at x.
fn lagrange(x: f64, nearer: f64) -> [f64; 4] {
    let last = 3.0 - nearer;
    let (a, b, c, d) = (x, x - 1.0, x - 2.0, x - last);
    [
        b * c * d / (-2.0 * last),
        a * c * d / (last - 1.0),
        a * b * d / (2.0 * (2.0 - last)),
        a * b * c / (last * (last - 1.0) * (last - 2.0)),
    ]
}

#[inline(always)]
fn read(field: &Field, cubic: &Cubic) -> f64 {
    let mut sum = 0.0;
    for (x, of_plane) in (cubic[0].0..).zip(cubic[0].1) {
        for (y, of_row) in (cubic[1].0..).zip(cubic[1].1) {
            let weight = of_plane * of_row;
            if weight == 0.0 {
                continue;
            }
            let start = (x * field.cells[1] + y) * field.cells[2] + cubic[2].0;
            for (value, tap) in field.values[start..start + 4].iter().zip(&cubic[2].1) {
                sum += weight * tap * value;
            }
        }
    }
    sum
}

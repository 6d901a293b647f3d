//! Fields smoothed by Gaussians of all widths at once: a few widths, each at the resolution that it needs, and values between.
//!
//! Owns the widths and what is read between them. May use fields, taps and bands. It deliberately knows not what the fields are.

use super::bands::{Band, smooth};
use super::lattice::{AXES, End, Field, Lattice, Window};
use super::taps::{Integral, Line};
use crate::maths::vector::{exp, ln};
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
    /// As it was, if widths are asked for that are read there.
    pub field: Option<Field>,
    first: usize,
    rungs: Vec<Rung>,
    /// The width of rung zero, m.
    narrowest: f64,
}

/// What a cell reads of a rung.
type Nodes = [([usize; 3], [f64; 3]); AXES];

/// What a cell reads of a ladder for a width: of two rungs, and where between them.
pub struct Reading {
    below: usize,
    nodes: [Nodes; 2],
    t: f64,
}

impl Ladder {
    /// A field on fine cells of a window, smoothed by widths that enclose a range, m.
    ///
    /// - Equation: `F_σ = Σ_k F_k w_k`, with variances of `σ² − (f² − 1) Δ²/6 − f² Δ²/4` where f > 1.
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
        let smallest = lattice.smallest();
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
        let field = (least < narrowest || rungs.len() < 2).then_some(field);
        Self { field, first, rungs, narrowest }
    }

    /// Whether sums with a width are read here.
    pub fn has(&self, deviation: f64) -> bool {
        self.field.is_none() || (deviation >= self.narrowest && self.rungs.len() > 1)
    }

    /// What a cell reads for a width within the range; the same on all ladders of one window and range.
    ///
    /// - Equation: `ln F` as a line in `1/σ²` between two rungs.
    /// - Symbols: `F` smoothed field.
    /// - Range: of one sign; else F itself is the line.
    /// - Source: where all is even F hangs on no width, and far from all that there is `ln F` goes as `−r²/2σ²`.
    /// - Shape: from 1 at the narrower rung to ½ at the wider one.
    #[inline(always)]
    pub fn reading(&self, lattice: &Lattice, cell: [usize; AXES], deviation: f64) -> Reading {
        let place = 2.0 * ln((deviation / self.narrowest).max(1.0)) / std::f64::consts::LN_2;
        let below = (place as usize).clamp(self.first, self.first + self.rungs.len() - 2) - self.first;
        let [low, high] = [&self.rungs[below], &self.rungs[below + 1]];
        let at_low = low.nodes(lattice, cell);
        let at_high = if low.level == high.level { at_low } else { high.nodes(lattice, cell) };
        let ratio = self.narrowest * power(below + self.first) / deviation;
        Reading { below, nodes: [at_low, at_high], t: (2.0 * (1.0 - ratio * ratio)).clamp(0.0, 1.0) }
    }

    /// The field on the two rungs of a reading, and where between them it is read.
    #[inline(always)]
    pub fn between(&self, reading: &Reading) -> ([f64; 2], f64) {
        let [low, high] = &reading.nodes;
        let rung = |k: usize| &self.rungs[reading.below + k].field;
        ([read(rung(0), low), read(rung(1), high)], reading.t)
    }

    /// The field there.
    #[inline(always)]
    pub fn read(&self, reading: &Reading) -> f64 {
        let ([narrow, wide], t) = self.between(reading);
        blended(narrow, wide, t)
    }
}

/// What lies between two values.
#[inline(always)]
pub fn blended(narrow: f64, wide: f64, t: f64) -> f64 {
    if narrow * wide > 0.0 { narrow * exp(t * ln(wide / narrow)) } else { (1.0 - t) * narrow + t * wide }
}

/// `2^{k/2}`
fn power(k: usize) -> f64 {
    (1_u64 << (k / 2)) as f64 * if k % 2 == 1 { SQRT_2 } else { 1.0 }
}

/// A Gaussian along an axis of a level.
fn band(lattice: &Lattice, integral: Integral, (axis, factor): (usize, usize), deviation: f64) -> Band {
    let own = deviation / lattice.edge[axis];
    let square = (factor * factor) as f64;
    let widened = if factor == 1 { 0.0 } else { (square - 1.0) / 6.0 + 0.25 * square };
    let variance = (own * own - widened).max(0.25 * own * own);
    let line = Line::of(lattice, axis, factor);
    Band::gaussian(line, integral, (variance.sqrt(), own))
}

impl Rung {
    /// Cells and weights along each axis with which a fine cell is read: a quadratic B-spline, or a cell itself.
    ///
    /// - Equation: `½ (½ − u)²`, `¾ − u²`, `½ (½ + u)²`.
    /// - Symbols: `u` distance from the centre of the nearest cell, in cells.
    /// - Range: never negative, so that what is read is not either; widens by a quarter of a cell squared.
    /// - Source: C. de Boor 1978, A Practical Guide to Splines.
    /// - Shape: three cells per axis; beyond an end they are those that kernels are mirrored to.
    #[inline(always)]
    fn nodes(&self, lattice: &Lattice, cell: [usize; AXES]) -> Nodes {
        let mut nodes = Nodes::default();
        for axis in 0..AXES {
            let (factor, n, first) = (self.factors[axis], self.field.cells[axis], self.field.first[axis]);
            // Factors are powers of two.
            let own = (cell[axis] >> factor.trailing_zeros()) - first;
            if factor == 1 {
                nodes[axis] = ([own; 3], [1.0, 0.0, 0.0]);
                continue;
            }
            let u = (cell[axis] as f64 + 0.5) / factor as f64 - (own + first) as f64 - 0.5;
            let spline = [0.5 * (0.5 - u) * (0.5 - u), 0.75 - u * u, 0.5 * (0.5 + u) * (0.5 + u)];
            if own > 0 && own + 1 < n {
                nodes[axis] = ([own - 1, own, own + 1], spline);
                continue;
            }
            let n_all = lattice.cells[axis].div_ceil(factor);
            let (places, weights) = &mut nodes[axis];
            *places = [own; 3];
            for (k, weight) in spline.into_iter().enumerate() {
                // Counted from one, as the first may stand before the beginning.
                let after = own + first + k;
                let (at, sign) = match (after, lattice.ends[axis]) {
                    (0, [End::Wrap, _]) => (n_all - 1, 1.0),
                    (0, [end, _]) => (0, if end.is_odd() { -1.0 } else { 1.0 }),
                    (after, [_, End::Wrap]) if after > n_all => (0, 1.0),
                    (after, [_, end]) if after > n_all => (n_all - 1, if end.is_odd() { -1.0 } else { 1.0 }),
                    _ => (after - 1, 1.0),
                };
                // Of windows that end before the domain does nothing is beyond.
                if at >= first && at < first + n {
                    (places[k], weights[k]) = (at - first, sign * weight);
                }
            }
        }
        nodes
    }
}

#[inline(always)]
fn read(field: &Field, nodes: &Nodes) -> f64 {
    let [(x, of_planes), (y, of_rows), (z, taps)] = *nodes;
    let mut sum = 0.0;
    for (plane, of_plane) in x.into_iter().zip(of_planes) {
        // Axes that are not used, or fine, have the first alone.
        if of_plane == 0.0 {
            continue;
        }
        for (row, of_row) in y.into_iter().zip(of_rows) {
            let weight = of_plane * of_row;
            if weight == 0.0 {
                continue;
            }
            let start = (plane * field.cells[1] + row) * field.cells[2];
            let at = |k: usize| taps[k] * field.values[start + z[k]];
            sum += weight * (at(0) + at(1) + at(2));
        }
    }
    sum
}

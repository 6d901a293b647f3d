//! Kernels that a scene writes, as tables of cubics.
//!
//! Owns the fit. May use tapes. It deliberately evaluates no expression while particles wait.

use crate::catalog::kernel::Radial;
use crate::plan::exchange::of_tape;
use crate::plan::tape::Tape;
use std::sync::Arc;

/// Intervals up to the end of the support.
const INTERVALS: usize = 1024;

/// Cubics of `W` and of `−W′/q`, by interval of q.
#[derive(Debug, Clone)]
pub struct Tabulated {
    inverse_width: f64,
    cubics: Arc<[[f64; 8]]>,
}

/// A table in use.
#[derive(Debug, Clone, Copy)]
pub struct Table<'a> {
    inverse_width: f64,
    cubics: &'a [[f64; 8]],
}

impl Tabulated {
    /// Fits a profile.
    ///
    /// - Equation: in each interval the cubic through four Chebyshev points.
    /// - Symbols: `q` distance over the bandwidth.
    /// - Range: 0 to the support; beyond it nothing.
    /// - Source: L. N. Trefethen, Approximation Theory and Approximation Practice (2013); its error is
    ///   `(w/2)⁴ f⁗/(2³ 4!)` for intervals of width w: 5e-15 f⁗ for a support of 2.
    /// - Shape: two cubics per interval.
    pub fn new(value: &Tape, support: f64) -> Self {
        let width = support / INTERVALS as f64;
        let cubic = |start: f64, of: &dyn Fn(f64) -> f64| {
            let nodes = [0, 1, 2, 3].map(|k| {
                let angle = std::f64::consts::PI * (2 * k + 1) as f64 / 8.0;
                0.5 - 0.5 * crate::maths::scalar::cos(angle)
            });
            newton(nodes, nodes.map(|node| of(start + node * width)))
        };
        let interval = |idx: usize| {
            let start = idx as f64 * width;
            let [a, b] = [0, 1].map(|which| {
                cubic(start, &|q| if which == 0 { of_tape(value, q).0 } else { of_tape(value, q).1 })
            });
            [a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]]
        };
        // One more, in which a distance just within the support may fall by rounding.
        let cubics = (0..=INTERVALS).map(|idx| interval(idx.min(INTERVALS - 1))).collect();
        Self { inverse_width: 1.0 / width, cubics }
    }

    pub fn radial(&self) -> Table<'_> {
        Table { inverse_width: self.inverse_width, cubics: &self.cubics }
    }
}

/// Coefficients by powers of the cubic through four points.
fn newton(nodes: [f64; 4], values: [f64; 4]) -> [f64; 4] {
    let mut divided = values;
    for order in 1..4 {
        for k in (order..4).rev() {
            divided[k] = (divided[k] - divided[k - 1]) / (nodes[k] - nodes[k - order]);
        }
    }
    let mut powers = [0.0; 4];
    for k in (0..4).rev() {
        // powers ← powers · (t − node_k) + divided_k
        for place in (0..4).rev() {
            let lower = if place > 0 { powers[place - 1] } else { 0.0 };
            powers[place] = lower - powers[place] * nodes[k];
        }
        powers[0] += divided[k];
    }
    powers
}

impl Table<'_> {
    #[inline(always)]
    fn at(self, q2: f64, first: usize) -> f64 {
        let along = q2.sqrt() * self.inverse_width;
        let idx = (along as usize).min(self.cubics.len() - 1);
        if idx >= INTERVALS {
            return 0.0;
        }
        let t = along - idx as f64;
        let cubic = &self.cubics[idx];
        cubic[first] + t * (cubic[first + 1] + t * (cubic[first + 2] + t * cubic[first + 3]))
    }
}

impl Radial for Table<'_> {
    #[inline(always)]
    fn value(self, q2: f64) -> f64 {
        self.at(q2, 0)
    }

    #[inline(always)]
    fn force(self, q2: f64) -> f64 {
        self.at(q2, 4)
    }
}

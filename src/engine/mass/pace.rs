//! How a rate that changes runs over time.
//!
//! Owns the pieces of time in which a rate is near a straight line, and their masses. May use nothing. It
//! deliberately knows neither places nor particles.

use std::collections::VecDeque;

/// Distance of a rate from a straight line that is not cut further, of the largest rate.
const STRAIGHT: f64 = 1e-4;
/// Doubt of the mass of a piece that is not cut further, of the whole mass.
const SURE: f64 = 1e-7;
/// Distance of the bounds of a rate, of the largest rate, beyond which there may be something between the points.
const LOOSE: f64 = 0.5;
/// Pieces, and numbers kept for them in all.
const MOST_PIECES: usize = 1 << 16;
const MOST_NUMBERS: usize = 1 << 22;
/// The shortest piece, of the whole time.
const SHORTEST: f64 = 1e-9;
/// How far from its ends a piece is looked at, so that a jump there counts to one side.
const MARGIN: f64 = 1e-6;
/// From there it is gone on to the ends along the line through the next point.
const ON: f64 = MARGIN / (0.25 - MARGIN);

/// A rate over pieces of time, each nearly a straight line.
#[derive(Debug, Clone, PartialEq)]
pub struct Pace {
    pieces: Vec<Piece>,
    total: f64,
    peak: f64,
}

#[derive(Debug, Clone, PartialEq)]
struct Piece {
    from: f64,
    to: f64,
    /// Rates at the ends.
    ends: [f64; 2],
    /// Mass that comes before it, and in it.
    before: f64,
    mass: f64,
}

/// What is known of a piece while it may still be cut.
struct Look {
    from: f64,
    to: f64,
    /// Per part of the rate, at five points.
    values: [Vec<f64>; 5],
}

impl Look {
    fn new(from: f64, to: f64, n_parts: usize, rates: &mut dyn FnMut(f64, &mut [f64])) -> Self {
        let length = to - from;
        let at = [MARGIN, 0.25, 0.5, 0.75, 1.0 - MARGIN].map(|part| from + part * length);
        let [mut a, b, c, d, mut e] = at.map(|t| {
            let mut values = vec![0.0; n_parts];
            rates(t, &mut values);
            values
        });
        for (end, inner) in [(&mut a, &b), (&mut e, &d)] {
            end.iter_mut().zip(inner).for_each(|(end, inner)| *end += ON * (*end - inner));
        }
        Self { from, to, values: [a, b, c, d, e] }
    }

    fn sum(&self, point: usize) -> f64 {
        self.values[point].iter().sum()
    }

    /// How far the parts are from straight lines, added up.
    fn bend(&self) -> f64 {
        let [a, b, c, d, e] = &self.values;
        let of = |k: usize| {
            let line = |part: f64| a[k] + part * (e[k] - a[k]);
            (b[k] - line(0.25)).abs().max((c[k] - line(0.5)).abs()).max((d[k] - line(0.75)).abs())
        };
        (0..a.len()).map(of).sum()
    }

    /// Mass of each part.
    ///
    /// - Equation: `∫ f dt = h (7 f₀ + 32 f₁ + 12 f₂ + 32 f₃ + 7 f₄)/90`.
    /// - Symbols: `f` rate at five even points, `h` length.
    /// - Range: pieces that are near a straight line; exact to the fifth power of time.
    /// - Source: Boole's rule.
    /// - Shape: one number per part.
    fn masses(&self) -> Vec<f64> {
        let [a, b, c, d, e] = &self.values;
        let length = self.to - self.from;
        let of = |k: usize| (7.0 * (a[k] + e[k]) + 32.0 * (b[k] + d[k]) + 12.0 * c[k]) / 90.0 * length;
        (0..a.len()).map(of).collect()
    }

    /// Masses against those of Simpson's rule on three of the points.
    fn doubt(&self) -> f64 {
        let [a, _, c, _, e] = &self.values;
        let simpson = |k: usize| (a[k] + 4.0 * c[k] + e[k]) / 6.0 * (self.to - self.from);
        self.masses().iter().enumerate().map(|(k, mass)| (mass - simpson(k)).abs()).sum()
    }

    fn mass(&self) -> f64 {
        self.masses().iter().sum()
    }
}

impl Pace {
    /// A rate of several parts between the first and the last of `edges`, which jumps at these at most, with the
    /// masses of the parts in each piece. `width` bounds how much the rate can change between two times.
    pub fn new(
        edges: &[f64],
        n_parts: usize,
        rates: &mut dyn FnMut(f64, &mut [f64]),
        width: &dyn Fn(f64, f64) -> f64,
    ) -> (Self, Vec<Vec<f64>>) {
        let whole = edges.last().copied().unwrap_or(0.0) - edges.first().copied().unwrap_or(0.0);
        let most = MOST_PIECES.min(MOST_NUMBERS / n_parts.max(1));
        let mut open: VecDeque<Look> = edges
            .windows(2)
            .filter(|pair| pair[0] < pair[1])
            .map(|pair| Look::new(pair[0], pair[1], n_parts, rates))
            .collect();
        let highest = |look: &Look| (0..5).map(|point| look.sum(point)).fold(0.0, f64::max);
        let mut peak = open.iter().map(highest).fold(0.0, f64::max);
        let mut whole_mass: f64 = open.iter().map(Look::mass).sum();
        let mut done: Vec<Look> = Vec::new();
        while let Some(look) = open.pop_front() {
            let is_short = look.to - look.from <= SHORTEST * whole;
            let is_straight = look.bend() <= STRAIGHT * peak && look.doubt() <= SURE * whole_mass;
            let is_known = is_straight && width(look.from, look.to) <= LOOSE * peak;
            if is_known || is_short || done.len() + open.len() + 2 > most {
                done.push(look);
                continue;
            }
            let middle = 0.5 * (look.from + look.to);
            whole_mass -= look.mass();
            for (from, to) in [(look.from, middle), (middle, look.to)] {
                let half = Look::new(from, to, n_parts, rates);
                peak = peak.max(highest(&half));
                whole_mass += half.mass();
                open.push_back(half);
            }
        }
        done.sort_by(|a, b| a.from.total_cmp(&b.from));
        let mut total = 0.0;
        let mut pieces = Vec::with_capacity(done.len());
        let mut masses = Vec::with_capacity(done.len());
        for look in &done {
            let own = look.masses();
            let mass = own.iter().sum();
            let ends = [look.sum(0).max(0.0), look.sum(4).max(0.0)];
            pieces.push(Piece { from: look.from, to: look.to, ends, before: total, mass });
            total += mass;
            masses.push(own);
        }
        (Self { pieces, total, peak }, masses)
    }

    pub fn total(&self) -> f64 {
        self.total
    }

    /// The largest rate that was seen.
    pub fn peak(&self) -> f64 {
        self.peak
    }

    /// Mass that has come by a time.
    pub fn before(&self, t: f64) -> f64 {
        let idx = self.pieces.partition_point(|piece| piece.to <= t);
        match self.pieces.get(idx) {
            Some(piece) if t > piece.from => {
                let [low, high] = piece.ends;
                let part = (t - piece.from) / (piece.to - piece.from);
                let sum = low + high;
                let share = if sum > 0.0 { part * (2.0 * low + (high - low) * part) / sum } else { part };
                piece.before + share * piece.mass
            }
            Some(piece) => piece.before,
            None => self.total,
        }
    }

    /// The time by which so much has come, and the number of its piece.
    ///
    /// - Equation: `s = F (a + b)/(a + √(a² (1 − F) + b² F))`, the root of `F (a + b) = 2 a s + (b − a) s²`.
    /// - Symbols: `a`, `b` rates at the ends of a piece, `F` share of its mass, `s` part of its time.
    /// - Range: rates that are not negative, one of them above zero.
    /// - Source: integral of a straight line.
    /// - Shape: one time.
    pub fn at(&self, mass: f64) -> (f64, usize) {
        let idx = self.pieces.partition_point(|piece| piece.before + piece.mass <= mass);
        let idx = idx.min(self.pieces.len().saturating_sub(1));
        let Some(piece) = self.pieces.get(idx) else { return (0.0, 0) };
        let share = if piece.mass > 0.0 { ((mass - piece.before) / piece.mass).clamp(0.0, 1.0) } else { 0.5 };
        let [low, high] = piece.ends;
        let root = low + (low * low * (1.0 - share) + high * high * share).sqrt();
        let part = if root > 0.0 { share * (low + high) / root } else { share };
        (piece.from + part.min(1.0) * (piece.to - piece.from), idx)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maths::scalar::{cos, exp, sin};

    fn of(edges: &[f64], rate: impl Fn(f64) -> f64) -> Pace {
        Pace::new(edges, 1, &mut |t, values| values[0] = rate(t), &|_, _| 0.0).0
    }

    #[test]
    fn masses_are_the_integrals() {
        let pace = of(&[0.0, 10.0], |t| 1.0 + sin(3.0 * t));
        let exact = |t: f64| t + (1.0 - cos(3.0 * t)) / 3.0;
        assert!((pace.total() - exact(10.0)).abs() < 1e-10, "{}", pace.total() - exact(10.0));
        for t in [0.1, 1.0, 2.345, 7.7, 9.99] {
            // Between the ends of pieces a straight line stands for the rate.
            assert!((pace.before(t) - exact(t)).abs() < 1e-5);
            let (back, _) = pace.at(pace.before(t));
            assert!((back - t).abs() < 1e-9, "{t} {back}");
        }
    }

    #[test]
    fn jumps_and_ramps_are_kept_as_they_are() {
        let pace = of(&[0.0, 2.0, 3.0, 8.0], |t| if (2.0..3.0).contains(&t) { 4.0 } else { 0.0 });
        assert_eq!(pace.pieces.len(), 3);
        assert!((pace.total() - 4.0).abs() < 1e-14);
        assert!((pace.at(1.0).0 - 2.25).abs() < 1e-14);
        let ramp = of(&[0.0, 2.0], |t| t);
        assert!(
            (ramp.total() - 2.0).abs() < 1e-8
                && (ramp.at(0.5 * ramp.total()).0 - 2.0_f64.sqrt()).abs() < 1e-8
        );
    }

    #[test]
    fn what_no_point_sees_is_found_by_its_bounds() {
        let rate = |t: f64| exp(-(t - 3.21) * (t - 3.21) / 2e-8);
        let width = |from: f64, to: f64| {
            let near = (3.21_f64).clamp(from, to);
            rate(near) - rate(from).min(rate(to))
        };
        let (pace, _) = Pace::new(&[0.0, 100.0], 1, &mut |t, values| values[0] = rate(t), &width);
        let exact = (std::f64::consts::TAU * 1e-8).sqrt();
        assert!((pace.total() / exact - 1.0).abs() < 1e-6, "{}", pace.total() / exact);
    }
}

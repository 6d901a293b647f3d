//! Planes that walks cross or touch.
//!
//! Owns the search for crossings, exact in law where drift and dispersion are constant near a plane. May use
//! lanes and draws. It deliberately books nothing: the caller does.

#![allow(clippy::needless_range_loop)] // Loops over lanes are hot.

use super::lanes::{LANES, Lane, Lanes};
use super::medium::Medium;
use super::walls::Stride;
use crate::maths::scalar::{cos, exp, ln};

/// `−ln` of the chance that a plane was touched, beyond which nobody asks.
const FAR: f64 = 37.0;
/// Draws of a displacement that belong to planes: those before are for sides and interfaces.
const FIRST_DRAW: u64 = 32;
const N_DRAWS: u64 = 32;

/// A plane normal to an axis, or a part of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Plane<const D: usize> {
    pub axis: usize,
    pub at: f64,
    /// Ends of the axes along which what leaves comes in at the other side: planes are there again and again.
    pub periods: [Option<(f64, f64)>; D],
    pub watch: Watch,
    pub part: Option<Part<D>>,
    /// Which draws it takes: parts of one plane share them, so that together they are the plane.
    pub draws: usize,
}

/// A part of a plane or of a side. Limits along its own axis say nothing; those at the ends of the domain are infinite.
#[derive(Debug, Clone, PartialEq)]
pub struct Part<const D: usize> {
    pub low: [f64; D],
    pub high: [f64; D],
}

impl<const D: usize> Part<D> {
    /// Whether a place of a plane normal to `axis` belongs to it.
    pub fn holds(&self, axis: usize, place: impl Fn(usize) -> f64) -> bool {
        (0..D).filter(|&other| other != axis).all(|other| {
            let at = place(other);
            at >= self.low[other] && at < self.high[other]
        })
    }
}

/// A part of a side that somebody watches.
#[derive(Debug, Clone, PartialEq)]
pub struct Gap<const D: usize> {
    /// Twice the axis, plus one at its upper end.
    pub side: usize,
    pub part: Part<D>,
}

/// What of a displacement counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Watch {
    /// The sides of the plane that it begins and ends on.
    Ends,
    /// Also the sides in between: what goes through and comes back counts twice.
    Times,
    /// Whether the plane was touched, once in a displacement.
    Touch,
}

/// A particle that went through a plane, or touched it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    pub lane: usize,
    /// Whether it went along the axis.
    pub is_forward: bool,
    /// Part of the displacement that was done.
    pub fraction: f64,
}

impl<const D: usize> Plane<D> {
    /// Calls `found` for every passage of a displacement. `free` is where it would end without sides, and
    /// `gone` the lanes that had left before it.
    #[inline(always)]
    pub fn crossings<M: Medium<D>>(
        &self,
        stride: &Stride<D, M>,
        free: &[Lane; D],
        lanes: &Lanes<D>,
        gone: u64,
        mut found: impl FnMut(Crossing),
    ) {
        let before = &stride.before[self.axis];
        // Around a period the way goes on; elsewhere it ends where the sides leave it.
        let after = self.after(self.axis, free, lanes);
        let mut spread = [0.0; LANES];
        if self.watch != Watch::Ends {
            spread = spread_of(stride, self.axis);
        }
        let mut near = 0_u64;
        for lane in 0..LANES {
            let is_near = match self.periods[self.axis] {
                Some(_) => true,
                None => is_near(before[lane] - self.at, after[lane] - self.at, spread[lane]),
            };
            near |= u64::from(is_near) << lane;
        }
        near &= lanes.occupied() & !gone;
        let mut across = None;
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            near &= near - 1;
            let way = Way { from: before[lane], to: after[lane], spread: spread[lane] };
            let draw = || {
                let what = FIRST_DRAW + self.draws as u64 % N_DRAWS;
                stride.draws.uniforms(lanes.ids[lane], stride.step, what)
            };
            self.passages(way, draw, |is_forward, fraction| {
                let is_in_part = self.part.as_ref().is_none_or(|part| {
                    let spreads = across.get_or_insert_with(|| {
                        let spreads: [Lane; D] = std::array::from_fn(|axis| spread_of(stride, axis));
                        spreads
                    });
                    let uniforms = draw();
                    part.holds(self.axis, |axis| {
                        let to = self.after(axis, free, lanes)[lane];
                        let way = Way { from: stride.before[axis][lane], to, spread: spreads[axis][lane] };
                        let first = if axis == (self.axis + 1) % D { 4 } else { 6 };
                        self.fold(axis, way.at(fraction, [uniforms[first], uniforms[first + 1]]))
                    })
                });
                if is_in_part {
                    found(Crossing { lane, is_forward, fraction });
                }
            });
        }
    }

    /// Where a displacement ends along an axis: on the way around a period, else where the sides leave it.
    fn after<'a>(&self, axis: usize, free: &'a [Lane; D], lanes: &'a Lanes<D>) -> &'a Lane {
        if self.periods[axis].is_some() { &free[axis] } else { &lanes.positions[axis] }
    }

    /// A place of a way around a period as one within it.
    fn fold(&self, axis: usize, at: f64) -> f64 {
        self.periods[axis].map_or(at, |(low, high)| low + (at - low).rem_euclid(high - low))
    }

    /// Passages of one way through the plane and its images.
    fn passages(&self, way: Way, draw: impl Fn() -> [f64; 8], mut found: impl FnMut(bool, f64)) {
        let (low, high) = (way.from.min(way.to), way.from.max(way.to));
        let period = self.periods[self.axis].map(|(low, high)| high - low);
        let (first, last) = match period {
            None => (0.0, 0.0),
            Some(period) => (((low - self.at) / period).floor(), ((high - self.at) / period).floor() + 1.0),
        };
        let mut soonest: Option<(bool, f64)> = None;
        let mut image = first;
        while image <= last {
            let at = self.at + image * period.unwrap_or(0.0);
            let relative = Way { from: way.from - at, to: way.to - at, spread: way.spread };
            image += 1.0;
            if !is_near(relative.from, relative.to, relative.spread) {
                continue;
            }
            match self.watch {
                Watch::Ends => {
                    let fraction = relative.from / (relative.from - relative.to);
                    found(relative.to > relative.from, fraction);
                }
                Watch::Times => relative.crossings(&draw(), &mut found),
                Watch::Touch => {
                    let touched = relative.touched(&draw());
                    let is_sooner = |&fraction: &f64| soonest.is_none_or(|(_, other)| fraction < other);
                    soonest =
                        touched.filter(is_sooner).map(|fraction| (relative.from < 0.0, fraction)).or(soonest);
                }
            }
        }
        if let Some((is_forward, fraction)) = soonest {
            found(is_forward, fraction);
        }
    }
}

/// `2 D Δt` of each lane along an axis.
fn spread_of<const D: usize, M: Medium<D>>(stride: &Stride<D, M>, axis: usize) -> Lane {
    let mut spread = [0.0; LANES];
    stride.medium.spread_along(stride.look, axis, &mut spread);
    for lane in 0..LANES {
        spread[lane] *= stride.leap.time[lane];
    }
    spread
}

/// Whether a way between two distances from a plane crosses it, or may have touched it.
#[inline(always)]
fn is_near(from: f64, to: f64, spread: f64) -> bool {
    ((from < 0.0) != (to < 0.0)) | (2.0 * from * to < FAR * spread)
}

/// A way between two distances from a plane, below and above zero on its two sides.
#[derive(Debug, Clone, Copy)]
struct Way {
    from: f64,
    to: f64,
    /// `2 D_n Δt`
    spread: f64,
}

impl Way {
    /// Where the way is after a part of it.
    ///
    /// - Equation: `x₀ + u (x₁ − x₀) + z √(s u(1 − u))` for one normal number `z`.
    /// - Symbols: as in [`Way::crossings`].
    /// - Range: any step; what the axes have in common beside their ends is left out.
    /// - Source: the law of the Brownian bridge.
    /// - Shape: one particle.
    fn at(self, part: f64, uniforms: [f64; 2]) -> f64 {
        let deviation = (self.spread * part * (1.0 - part)).max(0.0).sqrt();
        self.from + part * (self.to - self.from) + deviation * normal(uniforms[0], uniforms[1])
    }

    fn changes_side(self) -> bool {
        (self.from < 0.0) != (self.to < 0.0)
    }

    /// Parts of the way at which the plane is passed.
    ///
    /// - Equation: zeros of `d(u) = d₀ + (d₁ − d₀)u + z √(s u(1 − u))` for one normal number `z`.
    /// - Symbols: `d₀`, `d₁` distances before and after, `s = 2 D_n Δt`, `u` part of the way.
    /// - Range: any step. At each time the distance has the law of the Brownian bridge between its ends, so
    ///   that the mean of what is beyond the plane is exact at all times.
    /// - Source: mean and variance of the bridge; squared, `(c² + w²)u² + (2d₀c − w²)u + d₀² = 0` with
    ///   `c = d₁ − d₀`, `w = |z| √s`; a zero counts if `d₀ + cu` and `z` have opposite signs.
    /// - Shape: one particle: one zero where it changes sides, else none or two.
    fn crossings(self, uniforms: &[f64; 8], found: &mut impl FnMut(bool, f64)) {
        let z = normal(uniforms[1], uniforms[2]);
        let (d, c) = (self.from, self.to - self.from);
        let w = z * z * self.spread;
        let inside = w - 4.0 * d * self.to;
        let below = d < 0.0;
        if self.changes_side() {
            if w == 0.0 {
                return found(below, -d / c);
            }
            let root = (w * inside).sqrt();
            let b = w - 2.0 * d * c;
            // The smaller zero lies where the line still has the first sign: it needs `z` of the other one.
            let is_first = (z > 0.0) == below;
            // b > 0 here: d and c have opposite signs.
            let large = b + root;
            let u = if is_first { 2.0 * d * d / large } else { large / (2.0 * (c * c + w)) };
            found(below, u.clamp(0.0, 1.0));
        } else if inside > 0.0 && (z > 0.0) == below {
            let root = (w * inside).sqrt();
            let b = w - 2.0 * d * c;
            let scale = 0.5 / (c * c + w);
            let (first, second) = ((b - root) * scale, (b + root) * scale);
            if first >= 0.0 && second <= 1.0 {
                found(below, first);
                found(!below, second);
            }
        }
    }

    /// Part of the way at which the plane is touched first, if it is.
    ///
    /// - Equation: chance `e^{−2 d₀ d₁/s}` if both ends are on one side; then `τ = u/(1 + u)` with `u` of the
    ///   inverse Gaussian law with mean `|d₀/d₁|` and shape `d₀²/s`.
    /// - Symbols: as in [`Way::crossings`].
    /// - Range: any step; exact for constant drift and dispersion.
    /// - Source: the density of the first passage of a Brownian bridge, `τ^{−3/2} (1 − τ)^{−1/2}
    ///   e^{−d₀²/(2sτ) − d₁²/(2s(1 − τ))}`, in `u = τ/(1 − τ)`; drawn as by J. R. Michael, W. R. Schucany,
    ///   R. W. Haas (1976), doi:10.1080/00031305.1976.10479147.
    /// - Shape: one particle.
    fn touched(self, uniforms: &[f64; 8]) -> Option<f64> {
        let (from, to) = (self.from.abs(), self.to.abs());
        if !self.changes_side() && (self.spread <= 0.0 || uniforms[0] >= exp(-2.0 * from * to / self.spread))
        {
            return None;
        }
        if from == 0.0 {
            return Some(0.0);
        }
        if self.spread <= 0.0 {
            return Some(from / (from + to));
        }
        let mean = from / to.max(1e-12 * from);
        let z = normal(uniforms[1], uniforms[2]);
        let a = mean * mean * z * z * self.spread / (2.0 * from * from);
        let small = mean * mean / (mean + a + (a * (a + 2.0 * mean)).sqrt());
        let u = if uniforms[3] * (mean + small) <= mean { small } else { mean * mean / small };
        Some(u / (1.0 + u))
    }
}

/// A normal number from two uniform ones.
fn normal(a: f64, b: f64) -> f64 {
    (-2.0 * ln(a)).sqrt() * cos(2.0 * std::f64::consts::PI * b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maths::scalar::erfc;
    use crate::state::stream::{Purpose, Stream};

    fn uniforms(n: u64) -> impl Iterator<Item = [f64; 8]> {
        let stream = Stream::new(5, Purpose::Wall);
        (0..n).map(move |id| stream.uniforms_of(id, 0))
    }

    /// Reference: the law of the bridge, `P(d(u) > 0) = Φ(mean/deviation)`.
    #[test]
    fn at_each_time_as_many_are_beyond_as_the_bridge_says() {
        let n = 100_000_u64;
        for (from, to) in [(-0.3, 0.8), (-0.5, -0.2), (0.4, 0.1), (0.6, -0.1)] {
            let way = Way { from, to, spread: 1.3 };
            for part in [0.05, 0.3, 0.5, 0.9] {
                let mut beyond = if from < 0.0 { 0 } else { n as i64 };
                for uniforms in uniforms(n) {
                    way.crossings(&uniforms, &mut |is_forward, u| {
                        beyond += i64::from(u <= part) * if is_forward { 1 } else { -1 };
                    });
                }
                let deviation = (1.3 * part * (1.0 - part)).sqrt();
                let mean = from + (to - from) * part;
                let exact = 0.5 * erfc(-mean / deviation / 2.0_f64.sqrt());
                let found = beyond as f64 / n as f64;
                let bound = 4.5 * (exact * (1.0 - exact) / n as f64).sqrt();
                assert!((found - exact).abs() < bound, "{from} {to} {part}: {found} {exact}");
            }
        }
    }

    /// Reference: by the reflection principle a bridge has touched zero by the part `u` with probability
    /// `P(d(u) < 0) + E[e^{−2 d₀ d(u)/(su)}; d(u) > 0]`, here integrated.
    #[test]
    fn planes_are_touched_when_the_bridge_touches_them() {
        let n = 100_000_u64;
        for (from, to) in [(0.4, 0.3), (0.5, -0.7), (-0.2, 0.05)] {
            let way = Way { from, to, spread: 1.0 };
            for part in [0.1, 0.5, 0.95] {
                let came = uniforms(n).filter_map(|uniforms| way.touched(&uniforms)).filter(|&u| u <= part);
                let found = came.count() as f64 / n as f64;
                let sign = if from > 0.0 { 1.0 } else { -1.0 };
                let mean = sign * (from + (to - from) * part);
                let deviation = (part * (1.0 - part)).sqrt();
                let exact: f64 = (0..40_000)
                    .map(|k| {
                        let z = -8.0 + 16.0 * (f64::from(k) + 0.5) / 40_000.0;
                        let d = mean + deviation * z;
                        let touched = if d < 0.0 { 1.0 } else { exp(-2.0 * from.abs() * d / part) };
                        touched * exp(-0.5 * z * z) * 16.0 / 40_000.0 / (2.0 * std::f64::consts::PI).sqrt()
                    })
                    .sum();
                let bound = 4.5 * (exact * (1.0 - exact) / n as f64).sqrt() + 1e-6;
                assert!((found - exact).abs() < bound, "{from} {to} {part}: {found} {exact}");
            }
        }
    }

    #[test]
    fn around_a_period_a_way_passes_every_image() {
        let periods = [Some((0.0, 1.0))];
        let plane = Plane { axis: 0, at: 0.25, periods, watch: Watch::Ends, part: None, draws: 0 };
        let mut passages = Vec::new();
        let mut note = |is_forward, fraction: f64| passages.push((is_forward, fraction));
        let way = |from, to| Way { from, to, spread: 0.0 };
        plane.passages(way(0.5, 2.5), || [0.5; 8], &mut note);
        plane.passages(way(0.125, -0.875), || [0.5; 8], &mut note);
        plane.passages(way(0.5, 0.9), || [0.5; 8], &mut note);
        assert_eq!(passages, [(true, 0.375), (true, 0.875), (false, 0.875)]);
    }
}

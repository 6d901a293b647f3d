//! A walk with drift beside a plane at which drift, dispersion and porosity jump.
//!
//! Owns the law of one plane, exact at any step for coefficients that are constant on either side. May use `maths` and
//! draws. It deliberately knows neither media nor lanes.

use super::trips::Numbers;
use crate::maths::scalar::{erfc, exp, ln, sin};
use std::f64::consts::PI;

/// `−ln` of the chance of a touch below which nobody asks.
pub const FAR: f64 = 37.0;
/// √D of a side is at least so much of that of the other one: without dispersion its walk has no density.
const SMALLEST: f64 = 1e-7;

/// One side of a plane, along its normal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Side {
    /// m/s
    pub drift: f64,
    /// m²/s
    pub dispersion: f64,
    pub porosity: f64,
}

/// What walks do that begin on a plane; side 1 is above it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Law {
    /// Drift that goes on through the plane: as much water on either side, m/s.
    pub through: [f64; 2],
    /// √D, m/√s
    roots: [f64; 2],
    /// The same drift away from the plane over √D, 1/√s.
    away: [f64; 2],
    /// Chance of a side, `φ√D` over the sum.
    shares: [f64; 2],
    /// Share times drift over √D, of either side, 1/√s.
    pull: f64,
}

/// Where a walk from the plane is after a time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stay {
    pub side: usize,
    /// From the plane, m.
    pub distance: f64,
    /// Spent on the sides, s.
    pub times: [f64; 2],
}

impl Law {
    /// Of drift only what carries one flux `φ A` through the plane counts here: the smaller one, if both go one way.
    pub fn new(sides: [Side; 2]) -> Self {
        let flux = sides.map(|side| side.porosity.max(0.0) * side.drift);
        let flux = match flux[0] * flux[1] > 0.0 {
            true if flux[0].abs() < flux[1].abs() => flux[0],
            true => flux[1],
            false => 0.0,
        };
        let through = sides.map(|side| if flux == 0.0 { 0.0 } else { flux / side.porosity });
        let root = |side: usize| sides[side].dispersion.max(0.0).sqrt();
        let roots = [0, 1].map(|side| root(side).max(SMALLEST * root(1 - side)));
        let weights = [0, 1].map(|side| sides[side].porosity.max(0.0) * roots[side]);
        let sum = weights[0] + weights[1];
        let over = |value: f64, by: f64| if by > 0.0 { value / by } else { 0.0 };
        Self {
            through,
            roots,
            away: [over(-through[0], roots[0]), over(through[1], roots[1])],
            shares: weights.map(|weight| over(weight, sum)),
            pull: over(flux.abs(), sum),
        }
    }

    /// Times beyond this are better cut, s.
    pub fn longest(&self) -> f64 {
        if self.pull > 0.0 { 1.0 / (self.pull * self.pull) } else { f64::INFINITY }
    }

    /// Where a walk that begins on the plane is after a time, and how long it was on either side.
    ///
    /// - Equation: `u = (x − g)/√D` is a skew Brownian motion with the drift `b = A/√D` of its side. Without drift:
    ///   last zero `s = t sin²(πU/2)`; before it `t₂ = s p₂²U(p₁ + d)/d²`, `d = p₁ − U(p₁ − p₂)` above the plane, `t₁ = s − t₂`
    ///   below; after it a meander of length `m = t − s` on side `i` with the chance `p_i = φ_i√D_i/(φ₁√D₁ + φ₂√D₂)`.
    ///   With drift this is kept with a chance in proportion to `(p₁M₁ + p₂M₂) e^{−(b₁²t₁ + b₂²t₂)/4}`, the side drawn by
    ///   `p_i M_i`, `M = e^{−z²} + √π z erfc(−z)`, `z = β√m/2`.
    /// - Symbols: `g` the plane, `U` uniform, `β` drift away from the plane over √D.
    /// - Range: any time; exact for constant coefficients and one flux φA, for which Girsanov's weight has no local time.
    ///   Tries: `1 + h√(πt)`, `h = p_i b_i`.
    /// - Source: own; skew Brownian motion (A. Lejay 2006, doi:10.1214/154957807000000013), its excursions (J. Pitman,
    ///   M. Yor 1992, doi:10.1112/plms/s3-65.2.326); flow through a jump (P. Étoré, M. Martinez 2012, arXiv:1102.2565).
    /// - Shape: one walk.
    pub fn leave(&self, time: f64, numbers: &mut Numbers) -> Stay {
        if self.roots == [0.0; 2] || self.shares == [0.0; 2] {
            let side = usize::from(self.through[1] >= 0.0);
            let mut times = [0.0; 2];
            times[side] = time;
            return Stay { side, distance: self.through[side].abs() * time, times };
        }
        let bound = 1.0 + self.pull * (PI * time).sqrt();
        let [below, above] = self.shares;
        loop {
            let sine = sin(0.5 * PI * numbers.uniform());
            let last = time * sine * sine;
            let after = time - last;
            let uniform = numbers.uniform();
            let d = below - uniform * (below - above);
            let part = if d > 0.0 { above * above * uniform * (below + d) / (d * d) } else { 1.0 };
            let above_before = last * part.min(1.0);
            let mut times = [last - above_before, above_before];
            let half = 0.5 * after.sqrt();
            let weight = |side: usize| self.shares[side] * meander_weight(self.away[side] * half);
            let weights = [weight(0), weight(1)];
            let whole = weights[0] + weights[1];
            let loss = 0.25 * (square(self.away[0]) * times[0] + square(self.away[1]) * times[1]);
            if numbers.uniform() * bound >= whole * exp(-loss) {
                continue;
            }
            let side = usize::from(numbers.uniform() * whole >= weights[0]);
            times[side] += after;
            let distance = self.roots[side] * meander(self.away[side], after, numbers);
            return Stay { side, distance, times };
        }
    }
}

fn square(x: f64) -> f64 {
    x * x
}

/// `e^{−z²} + √π z erfc(−z)`
fn meander_weight(z: f64) -> f64 {
    (exp(-z * z) + PI.sqrt() * z * erfc(-z)).max(0.0)
}

/// The end of a meander with drift.
///
/// - Equation: density `∝ r e^{−(r − βm)²/4m}`, `r > 0`.
/// - Symbols: `β` drift, `m` time; variance `2m`.
/// - Range: any drift; at most four tries on average.
/// - Source: rejection from a normal and a Rayleigh law, from a Rayleigh law, or from a gamma law.
/// - Shape: one number.
fn meander(drift: f64, time: f64, numbers: &mut Numbers) -> f64 {
    let way = drift * time;
    if way > 0.0 {
        let rayleigh = (time / PI).sqrt();
        loop {
            let r = match numbers.uniform() * (rayleigh + way) < way {
                true => way + (2.0 * time).sqrt() * numbers.normal(),
                false => way + (-4.0 * time * ln(numbers.uniform())).sqrt(),
            };
            if r > 0.0 && numbers.uniform() * ((r - way).max(0.0) + way) < r {
                return r;
            }
        }
    }
    let is_weak = way * drift < 2.0;
    loop {
        let (r, chance) = match is_weak {
            true => {
                let r = (-4.0 * time * ln(numbers.uniform())).sqrt();
                (r, exp(0.5 * drift * r))
            }
            false => {
                let r = 2.0 / drift * ln(numbers.uniform() * numbers.uniform());
                (r, exp(-r * r / (4.0 * time)))
            }
        };
        if numbers.uniform() < chance {
            return r;
        }
    }
}

/// When a way first touched a plane, if it did, s.
///
/// - Equation: touched if `d₀d₁ ≤ 0`, or with the chance `e^{−d₀d₁/(Dt)}`; then `τ = tρ/(1 + ρ)`, `ρ` inverse Gaussian with
///   the mean `d₀/|d₁|` and the shape `d₀²/(2Dt)`.
/// - Symbols: `d₀ ≥ 0`, `d₁` distances from the plane before and after, `t` time of the way.
/// - Range: any; without dispersion the way is straight.
/// - Source: first passage of a Brownian bridge; J. R. Michael, W. R. Schucany, R. W. Haas (1976), doi:10.2307/2683801.
/// - Shape: one way.
pub fn touch([from, to]: [f64; 2], dispersion: f64, time: f64, numbers: &mut Numbers) -> Option<f64> {
    let spread = dispersion * time;
    if to > 0.0 && (spread <= 0.0 || from * to > FAR * spread) {
        return None;
    }
    if to > 0.0 && numbers.uniform() >= exp(-from * to / spread) {
        return None;
    }
    if from <= 0.0 {
        return Some(0.0);
    }
    if spread <= 0.0 {
        return Some(time * from / (from - to));
    }
    let shape = from * from / (2.0 * spread);
    let normal = numbers.normal();
    let uniform = numbers.uniform();
    if to == 0.0 {
        let ratio = shape / square(normal);
        return Some(time * if ratio.is_finite() { ratio / (1.0 + ratio) } else { 1.0 });
    }
    let mean = from / to.abs();
    let k = mean * square(normal) / (2.0 * shape);
    let d = 1.0 + k + (2.0 * k + k * k).sqrt();
    let ratio = if uniform * (1.0 + 1.0 / d) < 1.0 { mean / d } else { mean * d };
    Some(time * if ratio.is_finite() { ratio / (1.0 + ratio) } else { 1.0 })
}

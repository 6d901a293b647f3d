//! Planes at which dispersion or porosity jump.
//!
//! Owns the law of one plane, exact for coefficients that are constant on either side. May use lanes and draws.
//! It deliberately knows no formula of the coefficients: it asks the medium on both sides.

#![allow(clippy::needless_range_loop)] // Loops over lanes are hot.

use super::lanes::{LANES, Lanes};
use super::medium::{Medium, spread_at};
use super::walls::Stride;
use crate::maths::scalar::exp;

/// `−ln` of the chance that the plane was touched, beyond which nobody asks.
const FAR: f64 = 37.0;
/// Distance from the plane at which its sides are looked at, relative to its place and to a displacement.
const BESIDE: f64 = 1e-9;

/// A plane normal to an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interface {
    pub axis: usize,
    pub at: f64,
}

/// One side of the plane.
#[derive(Debug, Clone, Copy)]
struct Side {
    /// √D of the carrier, m/√s.
    root: f64,
    /// φ √D
    weight: f64,
}

impl Interface {
    /// Applies the plane to all displacements that touched it.
    #[inline(always)]
    pub fn apply<const D: usize, M: Medium<D>>(
        &self,
        idx: usize,
        stride: &Stride<D, M>,
        lanes: &mut Lanes<D>,
    ) {
        let mut spread = [0.0; LANES];
        stride.medium.spread_along(stride.look, self.axis, &mut spread);
        let mut near = 0_u64;
        for lane in 0..LANES {
            let from = stride.before[self.axis][lane] - self.at;
            let to = lanes.positions[self.axis][lane] - self.at;
            let is_near = 2.0 * from * to < FAR * spread[lane] * stride.leap.time[lane];
            near |= u64::from(is_near) << lane;
        }
        near &= lanes.occupied() & !lanes.gone;
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            near &= near - 1;
            self.cross(idx, stride, lanes, lane);
        }
    }

    /// The end of a displacement near the plane.
    ///
    /// - Equation: `u = (x − g)/√D`, `u* = u + √(2Δt) ξ`; if the plane is touched, `u* ← |u*|` with the chance
    ///   `p₂ = φ₂√D₂/(φ₁√D₁ + φ₂√D₂)`, else `−|u*|`; `x = g + u* √D(u*)`. It is touched if `u u* ≤ 0`, or with the
    ///   chance `e^{−u u*/Δt}`.
    /// - Symbols: `g` the plane; side 2 is above it.
    /// - Range: any step; exact for constant coefficients without drift.
    /// - Source: methods, section 1.3; skew Brownian motion (A. Lejay 2006, doi:10.1214/154957807000000013).
    /// - Shape: one particle.
    #[cold]
    #[inline(never)]
    fn cross<const D: usize, M: Medium<D>>(
        &self,
        idx: usize,
        stride: &Stride<D, M>,
        lanes: &mut Lanes<D>,
        lane: usize,
    ) {
        let dt = stride.leap.time[lane];
        let before = stride.before[self.axis][lane];
        let after = lanes.positions[self.axis][lane];
        let drift = stride.medium.drift(stride.look, self.axis, lane) * dt;
        let beside = BESIDE * (self.at.abs() + (after - before).abs()).max(f64::MIN_POSITIVE);
        let side = |offset: f64| {
            let mut place: [f64; D] = std::array::from_fn(|axis| stride.before[axis][lane]);
            place[self.axis] = self.at + offset;
            let root = (0.5 * spread_at(stride.medium, stride.carrier, place, self.axis)).sqrt();
            Side { root, weight: stride.medium.porosity(place) * root }
        };
        let (below, above) = (side(-beside), side(beside));
        let own = if before < self.at { below } else { above };
        if own.root == 0.0 || dt == 0.0 {
            return;
        }
        let from = (before - self.at) / own.root;
        let to = from + (after - before - drift) / own.root;
        let uniforms = stride.draws.uniforms(lanes.ids[lane], stride.step, 16 + idx as u64);
        let is_touched = from * to <= 0.0 || uniforms[0] < exp(-from * to / dt);
        if !is_touched {
            return;
        }
        let share = above.weight / (above.weight + below.weight);
        let end = if uniforms[1] < share { to.abs() * above.root } else { -to.abs() * below.root };
        lanes.positions[self.axis][lane] = self.at + end + drift;
    }
}

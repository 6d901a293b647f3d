//! What happens to walks at the sides of the domain.
//!
//! Owns the laws of walls, exact for drift and dispersion that are constant near them. May use lanes and
//! draws. It deliberately books nothing: what leaves is told to the caller.

#![allow(clippy::needless_range_loop)] // Loops over lanes are hot.

use super::lanes::{LANES, Lane, Lanes};
use super::medium::{Carrier, Leap, Medium};
use super::noise::Draws;
use crate::maths::scalar::{exp, ln};

/// `−ln` of the chance that a wall was touched, beyond which nobody asks.
const FAR: f64 = 37.0;

/// What a wall does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Law {
    Reflect,
    Absorb,
    /// `J = k c`, m/s.
    Partial(f64),
    /// What comes with the water leaves with it, and there is no gradient.
    Outflow,
    /// The same for a parcel of water, and what it carries is told about the touch.
    Wet,
}

/// A part of a wall: the first that holds a place decides, and the last one has no limits.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch<const D: usize> {
    pub low: [f64; D],
    pub high: [f64; D],
    pub law: Law,
}

/// One axis of the domain.
#[derive(Debug, Clone, PartialEq)]
pub enum Ends<const D: usize> {
    /// What leaves comes in at the other side.
    Periodic { low: f64, high: f64 },
    /// The lower wall and the upper one; `None` is open.
    Walls([Option<Wall<D>>; 2]),
}

#[derive(Debug, Clone, PartialEq)]
pub struct Wall<const D: usize> {
    pub at: f64,
    pub patches: Vec<Patch<D>>,
}

/// A particle that has left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exit {
    pub lane: usize,
    /// Twice the axis, plus one at its upper end.
    pub side: usize,
    pub patch: usize,
    /// Part of the displacement that was done.
    pub fraction: f64,
}

/// A parcel of water that has touched a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    pub lane: usize,
    /// Twice the axis, plus one at its upper end.
    pub side: usize,
    pub patch: usize,
    /// Push of the wall over the dispersion normal to it, `L/D`, s/m.
    pub push: f64,
    /// Along the active axes, m.
    pub place: [f64; 3],
}

/// What particles did at walls in a displacement.
#[derive(Debug, Clone, Default)]
pub struct Met {
    pub exits: Vec<Exit>,
    pub touches: Vec<Touch>,
}

/// One displacement of a group, before and after.
pub struct Stride<'a, const D: usize, M: Medium<D>> {
    pub medium: &'a M,
    pub look: &'a M::Look,
    pub carrier: &'a Carrier,
    pub leap: &'a Leap,
    pub before: &'a [Lane; D],
    pub draws: &'a Draws,
    /// Number of the displacement.
    pub step: u64,
}

/// A way between two distances from a wall; below 0 is beyond it.
#[derive(Debug, Clone, Copy)]
struct Way {
    from: f64,
    to: f64,
    /// `2 D_n Δt`
    spread: f64,
}

impl Way {
    /// Smallest distance on the way.
    ///
    /// - Equation: `m = ½ [d₀ + d₁ − √((d₁ − d₀)² − 2 s ln U)]`.
    /// - Symbols: `d₀`, `d₁` distances before and after, `s = 2 D_n Δt`, `U` uniform.
    /// - Range: `d₀ ≥ 0`; without dispersion the smaller end.
    /// - Source: methods, equation 1.8; minimum of a Brownian bridge (Asmussen, Glynn, Pitman 1995,
    ///   doi:10.1214/aoap/1177004597).
    /// - Shape: one particle.
    fn lowest(self, uniform: f64) -> f64 {
        let step = self.to - self.from;
        0.5 * (self.from + self.to - (step * step - 2.0 * self.spread * ln(uniform)).sqrt())
    }

    /// Chance that the wall was touched.
    fn touches(self) -> f64 {
        if self.to <= 0.0 || self.from <= 0.0 { 1.0 } else { exp(-2.0 * self.from * self.to / self.spread) }
    }

    /// Part of the way at which the wall is met.
    fn meeting(self) -> f64 {
        if self.to < 0.0 { self.from / (self.from - self.to) } else { 0.5 }
    }
}

/// Where a particle is after it met a wall.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fate {
    At(f64),
    Gone,
}

/// The end of a way.
struct End {
    fate: Fate,
    /// `L/D`, s/m.
    push: f64,
}

impl Law {
    /// The end of a way. `k` is the velocity with which what touches the wall leaves, m/s.
    ///
    /// - Equation: `d = d₁ + L`, `L = max(0, −m)`; survival `e^{−kL/D}`; absorbed if `m < 0`.
    /// - Symbols: `m` smallest distance of the free way, `L` push of the wall, `D` dispersion normal to it.
    /// - Range: any step; exact for constant drift and dispersion.
    /// - Source: methods, section 1.6; A. V. Skorokhod (1961), doi:10.1137/1106035; `E dL = D c(0) dt`, so that
    ///   killing at rate `k/D` per push is the flux `k c`.
    /// - Shape: one particle.
    fn end(self, way: Way, k: f64, dt: f64, uniforms: [f64; 2]) -> End {
        if self == Self::Absorb {
            let is_met = way.to < 0.0 || uniforms[0] < way.touches();
            let fate = if is_met { Fate::Gone } else { Fate::At(way.to) };
            return End { fate, push: 0.0 };
        }
        let length = (-way.lowest(uniforms[0])).max(0.0);
        // L / D, with D = s / (2 Δt).
        let push = match length > 0.0 {
            true if way.spread > 0.0 => 2.0 * length * dt / way.spread,
            true => f64::INFINITY,
            false => 0.0,
        };
        let is_lost = push > 0.0 && k > 0.0 && uniforms[1] >= exp(-(push * k));
        let fate = if is_lost { Fate::Gone } else { Fate::At((way.to + length).max(0.0)) };
        End { fate, push }
    }
}

impl<const D: usize> Ends<D> {
    /// Applies what happens at both ends of an axis.
    #[inline(always)]
    pub fn apply<M: Medium<D>>(
        &self,
        axis: usize,
        stride: &Stride<D, M>,
        lanes: &mut Lanes<D>,
        met: &mut Met,
    ) {
        match self {
            Self::Periodic { low, high } => wrap(&mut lanes.positions[axis], *low, *high),
            Self::Walls(walls) => {
                if walls.iter().all(Option::is_none) {
                    return;
                }
                let mut spread = [0.0; LANES];
                stride.medium.spread_along(stride.look, axis, &mut spread);
                for lane in 0..LANES {
                    spread[lane] *= stride.leap.time[lane];
                }
                let at = [0, 1].map(|end| walls[end].as_ref().map(|wall| wall.at));
                let near = near(at, &stride.before[axis], &lanes.positions[axis], &spread);
                let near = near & lanes.occupied() & !lanes.gone;
                if near != 0 {
                    for (end, wall) in walls.iter().enumerate() {
                        if let Some(wall) = wall {
                            wall.meet([axis, end], near & !lanes.gone, stride, lanes, &spread, met);
                        }
                    }
                }
            }
        }
    }
}

/// One bit per particle that may have touched either wall.
#[inline(always)]
fn near(at: [Option<f64>; 2], before: &Lane, after: &Lane, spread: &Lane) -> u64 {
    // A wall that is not there is far away.
    const NOWHERE: f64 = 1e300;
    let low = at[0].unwrap_or(-NOWHERE);
    let high = at[1].unwrap_or(NOWHERE);
    let mut is_near = [0_u8; LANES];
    let mut any = 0_u8;
    for lane in 0..LANES {
        let least = |x: f64| {
            let (above, below) = (x - low, high - x);
            if above < below { above } else { below }
        };
        let (from, to) = (least(before[lane]), least(after[lane]));
        let near = u8::from(to < 0.0) | u8::from(2.0 * from * to < FAR * spread[lane]);
        is_near[lane] = near;
        any |= near;
    }
    if any == 0 {
        return 0;
    }
    (0..LANES).fold(0, |mask, lane| mask | u64::from(is_near[lane]) << lane)
}

/// `x ← x − L ⌊(x − low)/L⌋`
#[inline(always)]
fn wrap(positions: &mut Lane, low: f64, high: f64) {
    let length = high - low;
    let mut n_outside = 0_u64;
    for x in positions.iter_mut() {
        let above = if *x < low { *x + length } else { *x };
        let inside = if above >= high { above - length } else { above };
        n_outside |= u64::from(!(inside >= low && inside <= high));
        *x = inside;
    }
    if n_outside != 0 {
        for x in positions.iter_mut().filter(|x| x.is_finite()) {
            *x = (low + (*x - low).rem_euclid(length)).clamp(low, high);
        }
    }
}

impl<const D: usize> Wall<D> {
    /// Works out what the wall does to the particles of a mask.
    #[cold]
    #[inline(never)]
    fn meet<M: Medium<D>>(
        &self,
        [axis, end]: [usize; 2],
        mut near: u64,
        stride: &Stride<D, M>,
        lanes: &mut Lanes<D>,
        spread: &Lane,
        met: &mut Met,
    ) {
        let sign = if end == 0 { 1.0 } else { -1.0 };
        let side = 2 * axis + end;
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            near &= near - 1;
            let from = (sign * (stride.before[axis][lane] - self.at)).max(0.0);
            let to = sign * (lanes.positions[axis][lane] - self.at);
            let way = Way { from, to, spread: spread[lane] };
            if !(to < 0.0 || 2.0 * from * to < FAR * spread[lane]) {
                continue;
            }
            let mut place: [f64; D] = std::array::from_fn(|other| lanes.positions[other][lane]);
            place[axis] = self.at;
            // In a corner a place may lie beyond another side: what has no limits reaches there, too.
            let found = self.patches.iter().position(|patch| patch.holds(&place, axis));
            let Some(patch) = found.or_else(|| self.patches.len().checked_sub(1)) else { continue };
            let Patch { low, high, law } = self.patches[patch];
            for other in (0..D).filter(|&other| other != axis) {
                place[other] = place[other].clamp(low[other], high[other]);
            }
            let k = match law {
                Law::Reflect | Law::Absorb => 0.0,
                Law::Partial(rate) => rate,
                Law::Outflow | Law::Wet => (-sign * stride.medium.velocity(place, axis)).max(0.0),
            } * stride.carrier.mobility;
            let uniforms = stride.draws.uniforms(lanes.ids[lane], stride.step, side as u64);
            let dt = stride.leap.time[lane];
            let End { fate, push } = law.end(way, k, dt, [uniforms[0], uniforms[1]]);
            if law == Law::Wet && push > 0.0 {
                let mut at = [0.0; 3];
                at[..D].copy_from_slice(&place);
                met.touches.push(Touch { lane, side, patch, push, place: at });
            }
            match fate {
                Fate::At(distance) => lanes.positions[axis][lane] = self.at + sign * distance,
                Fate::Gone => {
                    lanes.positions[axis][lane] = self.at;
                    lanes.gone |= 1 << lane;
                    met.exits.push(Exit { lane, side, patch, fraction: way.meeting() });
                }
            }
        }
    }
}

impl<const D: usize> Patch<D> {
    /// Whether a place of the wall belongs to this part of it.
    pub(super) fn holds(&self, place: &[f64; D], axis: usize) -> bool {
        (0..D).all(|other| {
            other == axis || (place[other] >= self.low[other] && place[other] <= self.high[other])
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_dispersion_walls_are_met_exactly() {
        let way = Way { from: 1.0, to: -0.5, spread: 0.0 };
        assert!(matches!(Law::Absorb.end(way, 0.0, 1.0, [0.5; 2]).fate, Fate::Gone));
        assert!(matches!(Law::Outflow.end(way, 1.0, 1.0, [0.5; 2]).fate, Fate::Gone));
        assert!(matches!(Law::Reflect.end(way, 0.0, 1.0, [0.5; 2]).fate, Fate::At(d) if d == 0.0));
        let away = Way { to: 2.0, ..way };
        assert!(matches!(Law::Absorb.end(away, 0.0, 1.0, [0.5; 2]).fate, Fate::At(d) if d == 2.0));
        assert!((way.meeting() - 2.0 / 3.0).abs() < 1e-15);
    }

    #[test]
    fn far_outside_a_period_comes_back() {
        let mut lane = [0.5; LANES];
        (lane[0], lane[1], lane[2]) = (7.25, -3.25, 1.0);
        wrap(&mut lane, 0.0, 1.0);
        assert_eq!([lane[0], lane[1], lane[2], lane[3]], [0.25, 0.75, 0.0, 0.5]);
    }
}

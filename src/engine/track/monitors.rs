//! Planes that walks cross.
//!
//! Owns the search for crossings. May use lanes. It deliberately books nothing: the caller does.

#![allow(clippy::needless_range_loop)] // Loops over lanes are hot.

use super::lanes::{LANES, Lane, Lanes};

/// A plane normal to an axis, or a part of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Plane<const D: usize> {
    pub axis: usize,
    pub at: f64,
    pub low: [f64; D],
    pub high: [f64; D],
}

/// A particle that went through a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossing {
    pub lane: usize,
    /// Whether it went along the axis.
    pub is_forward: bool,
    /// Part of the displacement that was done.
    pub fraction: f64,
}

impl<const D: usize> Plane<D> {
    /// Calls `found` for every particle that is on the other side now.
    #[inline(always)]
    pub fn crossings(
        &self,
        before: &[Lane; D],
        lanes: &Lanes<D>,
        gone: u64,
        mut found: impl FnMut(Crossing),
    ) {
        let (before, after) = (&before[self.axis], &lanes.positions[self.axis]);
        let mut crossed = [0_u8; LANES];
        let mut any = 0_u8;
        for lane in 0..LANES {
            let is_other = u8::from((before[lane] < self.at) != (after[lane] < self.at));
            crossed[lane] = is_other;
            any |= is_other;
        }
        if any == 0 {
            return;
        }
        for lane in (0..lanes.n).filter(|&lane| crossed[lane] != 0 && gone >> lane & 1 == 0) {
            let fraction = (self.at - before[lane]) / (after[lane] - before[lane]);
            if self.holds(lanes, lane) {
                found(Crossing { lane, is_forward: after[lane] > before[lane], fraction });
            }
        }
    }

    fn holds(&self, lanes: &Lanes<D>, lane: usize) -> bool {
        let inside = |axis: usize| {
            let x = lanes.positions[axis][lane];
            x >= self.low[axis] && x <= self.high[axis]
        };
        (0..D).all(|axis| axis == self.axis || inside(axis))
    }
}

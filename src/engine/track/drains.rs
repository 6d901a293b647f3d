//! Water that is taken out inside of the domain, and what it carries with it.
//!
//! Owns the chance of a particle to leave with that water. May use lanes and the draws. It deliberately knows no
//! well: a drain is a box in which water vanishes at a rate.

#![allow(clippy::needless_range_loop)] // Loops over lanes are hot.

use super::lanes::{LANES, Lane, Lanes};
use super::medium::{Carrier, Medium};
use super::walls::{Exit, Stride};
use crate::maths::scalar::exp;

/// The draws of drains, beside those of walls and interfaces.
const WHAT: u64 = 8;

/// A box from which water is taken.
///
/// - Equation: a particle leaves within Δt with the chance `1 − exp(−λ Δt/R)`, `λ = Q/(φ V)`, if it begins and ends
///   in the box, and with that of half the time if it does one of both.
/// - Symbols: `Q` water taken out, `φ V` water in the box, `R` retardation.
/// - Range: any step; right to the square of `λ Δt`, where water flows in and out of the box. It acts as if it were
///   mixed, as a cell of the flow is.
/// - Source: `d(φ R V c)/dt = −Q c`; the trapezoidal rule for the time inside.
/// - Shape: one box.
#[derive(Debug, Clone, PartialEq)]
pub struct Drain<const D: usize> {
    pub low: [f64; D],
    pub high: [f64; D],
    /// λ, 1/s
    pub rate: f64,
    /// What it is called in the books: the number of a side, counted on behind the last one.
    pub side: usize,
}

impl<const D: usize> Drain<D> {
    /// One bit for each lane that is in the box.
    #[inline(always)]
    fn inside(&self, positions: &[Lane; D]) -> u64 {
        let mut inside = u64::MAX;
        for axis in 0..D {
            let (low, high) = (self.low[axis], self.high[axis]);
            let of_axis = positions[axis].iter().enumerate();
            inside &= of_axis.fold(0, |mask, (lane, &x)| mask | u64::from(x >= low && x < high) << lane);
        }
        inside
    }

    /// Shortens displacements in the box to a share of the time that its water stays: velocities change by as
    /// much.
    #[inline(always)]
    pub fn limit(&self, carrier: &Carrier, share: f64, positions: &[Lane; D], time: &mut Lane) {
        let longest = share / (self.rate * carrier.mobility);
        let inside = self.inside(positions);
        for lane in 0..LANES {
            if inside >> lane & 1 == 1 && time[lane] > longest {
                time[lane] = longest;
            }
        }
    }

    /// Takes out what leaves at the end of a displacement.
    #[inline(always)]
    pub fn apply<M: Medium<D>>(
        &self,
        idx: usize,
        stride: &Stride<D, M>,
        lanes: &mut Lanes<D>,
        exits: &mut Vec<Exit>,
    ) {
        let before = self.inside(stride.before);
        let after = self.inside(&lanes.positions);
        let mut near = (before | after) & lanes.occupied() & !lanes.gone;
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            near &= near - 1;
            let part = if before & after & (1 << lane) == 0 { 0.5 } else { 1.0 };
            let stays = exp(-self.rate * stride.carrier.mobility * part * stride.leap.time[lane]);
            let uniforms = stride.draws.uniforms(lanes.ids[lane], stride.step, WHAT);
            if uniforms[idx % uniforms.len()] > stays {
                lanes.gone |= 1 << lane;
                exits.push(Exit { lane, side: self.side, patch: 0, fraction: 1.0 });
            }
        }
    }
}

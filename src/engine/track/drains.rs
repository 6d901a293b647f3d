//! Water that is taken out inside of the domain, and what it carries with it.
//!
//! Owns the chance of a particle to leave with that water. May use lanes and the draws. It deliberately knows no
//! well: a drain is a box in which water vanishes at a rate.

use super::lanes::Lanes;
use super::medium::Medium;
use super::walls::{Exit, Stride};
use crate::maths::scalar::exp;

/// The draws of drains, beside those of walls and interfaces.
const WHAT: u64 = 8;

/// A box from which water is taken.
///
/// - Equation: a particle that is in it leaves within Δt with the chance `1 − exp(−λ Δt/R)`, `λ = Q/(φ V)`.
/// - Symbols: `Q` water taken out, `φ V` water in the box, `R` retardation.
/// - Range: any step; the box acts as if it were mixed, as a cell of the flow is.
/// - Source: `d(φ R V c)/dt = −Q c`.
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
    /// Takes out what leaves at the end of a displacement.
    #[inline(always)]
    pub fn apply<M: Medium<D>>(
        &self,
        idx: usize,
        stride: &Stride<D, M>,
        lanes: &mut Lanes<D>,
        exits: &mut Vec<Exit>,
    ) {
        let mut inside = lanes.occupied() & !lanes.gone;
        for axis in 0..D {
            let (low, high) = (self.low[axis], self.high[axis]);
            let of_axis = lanes.positions[axis].iter().enumerate();
            inside &= of_axis.fold(0, |mask, (lane, &x)| mask | u64::from(x >= low && x < high) << lane);
        }
        while inside != 0 {
            let lane = inside.trailing_zeros() as usize;
            inside &= inside - 1;
            let stays = exp(-self.rate * stride.carrier.mobility * stride.leap.time[lane]);
            let uniforms = stride.draws.uniforms(lanes.ids[lane], stride.step, WHAT);
            if uniforms[idx % uniforms.len()] > stays {
                lanes.gone |= 1 << lane;
                exits.push(Exit { lane, side: self.side, patch: 0, fraction: 1.0 });
            }
        }
    }
}

//! The neighbours of one parcel with a kernel of its own, and their weights.
//!
//! Owns the sums over what is found. May use kernels. It deliberately writes to nothing but its own lists: every parcel
//! gathers for itself, so that sums never hang on threads.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::near::{LANES, folded};
use crate::catalog::kernel::Radial;

/// Numbers that are read or written together: rows are taken in whole pieces, beyond their ends.
pub(super) const PIECE: usize = 4;

/// Squared distances of what is near, later weights, row by row of cells.
#[derive(Debug, Default)]
pub struct Around {
    pub(super) weights: Vec<f64>,
    /// Something else of the same parcels.
    others: Vec<f64>,
    /// Where a row stands among all parcels, and how many it has.
    pub(super) rows: Vec<(usize, usize)>,
    pub(super) n: usize,
    /// `n`, and what is missing in the last lanes.
    end: usize,
    /// Where the parcel itself stands.
    own: usize,
}

impl Around {
    /// Where parcel `idx` itself stands in its rows.
    #[inline(always)]
    pub(super) fn find_own(&mut self, idx: usize) {
        let mut at = 0;
        self.own = 0;
        for row in 0..self.rows.len() {
            let (start, n) = self.rows[row];
            if idx >= start && idx < start + n {
                self.own = at + idx - start;
            }
            at += n;
        }
    }

    /// The rest of the last lanes is out of reach.
    #[inline(always)]
    pub(super) fn close(&mut self) {
        self.end = self.n.next_multiple_of(LANES);
        self.make_room(0);
        self.weights[self.n..self.end].fill(f64::MAX);
    }

    /// Room for `n` more, whole pieces and lanes.
    #[inline(always)]
    pub(super) fn make_room(&mut self, n: usize) {
        if self.weights.len() < self.n + n + LANES {
            self.grow(n);
        }
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self, n: usize) {
        let len = (self.n + n + LANES).next_power_of_two();
        self.weights.resize(len, 0.0);
        self.others.resize(len, 0.0);
    }

    /// Brings what an array has for the same parcels together.
    #[inline(always)]
    fn fetch(&mut self, source: &[f64]) {
        let mut at = 0;
        for row in 0..self.rows.len() {
            let (start, n) = self.rows[row];
            let whole = n.next_multiple_of(PIECE);
            let (target, _) = self.others[at..at + whole].as_chunks_mut::<PIECE>();
            let (pieces, _) = source[start..start + whole].as_chunks::<PIECE>();
            // A call to copy so few costs more than the loop.
            #[allow(clippy::manual_memcpy)]
            for piece in 0..target.len().min(pieces.len()) {
                target[piece] = pieces[piece];
            }
            at += n;
        }
        self.others[self.n..self.end].fill(1.0);
    }

    /// Squared distances become values of a kernel.
    #[inline(always)]
    pub fn weigh<K: Radial>(&mut self, kernel: K, square: f64) {
        for weight in &mut self.weights[..self.end] {
            let value = kernel.value(*weight);
            *weight = if *weight < square { value } else { 0.0 };
        }
    }

    /// Squared distances become what two exchange by.
    #[inline(always)]
    pub fn force<K: Radial>(&mut self, kernel: K, square: f64) {
        for weight in &mut self.weights[..self.end] {
            let value = kernel.force(*weight);
            *weight = if *weight < square { value } else { 0.0 };
        }
    }

    /// `w_ij ← 2 w_ij b_ij / (ρ_i + ρ_j)`, `b_ij = 2 b_i b_j/(b_i + b_j)`.
    #[inline(always)]
    pub fn share_by_mean(&mut self, densities: &[f64], own: f64, shares: &[f64], share: f64) {
        self.fetch(densities);
        let (weights, others) = (&mut self.weights[..self.end], &self.others[..self.end]);
        for idx in 0..weights.len() {
            weights[idx] *= 2.0 / (own + others[idx]);
        }
        self.fetch(shares);
        let (weights, others) = (&mut self.weights[..self.end], &self.others[..self.end]);
        for idx in 0..weights.len() {
            let sum = share + others[idx];
            // Two that exchange nothing.
            let mean = 2.0 * share * others[idx] / if sum > 0.0 { sum } else { 1.0 };
            weights[idx] *= mean;
        }
    }

    /// `w_ij ← w_ij s_i s_j`
    #[inline(always)]
    pub fn multiply(&mut self, factors: &[f64], own: f64) {
        self.fetch(factors);
        let (weights, others) = (&mut self.weights[..self.end], &self.others[..self.end]);
        for idx in 0..weights.len() {
            weights[idx] *= own * others[idx];
        }
    }

    /// `w_ij ← w_ij min(a_i, a_j)`
    #[inline(always)]
    pub fn limit(&mut self, caps: &[f64], own: f64) {
        self.fetch(caps);
        let (weights, others) = (&mut self.weights[..self.end], &self.others[..self.end]);
        for idx in 0..weights.len() {
            weights[idx] *= if others[idx] < own { others[idx] } else { own };
        }
    }

    /// Sum of all weights.
    #[inline(always)]
    pub fn sum(&self) -> f64 {
        let mut lanes = [0.0; LANES];
        let (pieces, _) = self.weights[..self.end].as_chunks::<LANES>();
        for piece in pieces {
            for lane in 0..LANES {
                lanes[lane] += piece[lane];
            }
        }
        folded(lanes)
    }

    /// Sum of the weights of all others.
    #[inline(always)]
    pub fn sum_of_others(&self) -> f64 {
        self.sum() - self.weights[self.own]
    }

    /// Sum of weights times factors.
    #[inline(always)]
    pub fn sum_of(&mut self, factors: &[f64]) -> f64 {
        self.difference(factors, 0.0)
    }

    /// `Σ_j w_ij (v_j − v_i)`
    #[inline(always)]
    pub fn difference(&mut self, values: &[f64], own: f64) -> f64 {
        self.fetch(values);
        let mut lanes = [0.0; LANES];
        let (weights, _) = self.weights[..self.end].as_chunks::<LANES>();
        let (others, _) = self.others[..self.end].as_chunks::<LANES>();
        for piece in 0..weights.len().min(others.len()) {
            let (weights, others) = (&weights[piece], &others[piece]);
            for lane in 0..LANES {
                lanes[lane] += weights[lane] * (others[lane] - own);
            }
        }
        folded(lanes)
    }
}

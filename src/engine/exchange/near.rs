//! The neighbours of one parcel, and their weights.
//!
//! Owns the search through cells and the sums over what is found. May use kernels and the space. It deliberately
//! writes to nothing but its own lists: every parcel gathers for itself, so that sums never hang on threads.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::space::Space;
use crate::catalog::kernel::Radial;

/// Lanes of a sum: the same for wide and narrow code.
const LANES: usize = 8;

/// Numbers that are read or written together: rows are taken in whole pieces, beyond their ends.
pub(super) const PIECE: usize = 4;

/// What every array of a crowd is longer than it, so that whole pieces can be read.
pub const PADDING: usize = PIECE;

/// Parcels in the order of cells.
#[derive(Clone, Copy)]
pub struct Crowd<'a, const D: usize> {
    pub space: &'a Space<D>,
    pub n: usize,
    /// Positions in the space, by axis.
    pub y: [&'a [f64]; D],
    /// Where each cell begins; one more than cells.
    pub first: &'a [u32],
}

/// Squared distances of what is near, later weights, row by row of cells.
#[derive(Debug, Default)]
pub struct Near {
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

impl Near {
    /// Finds everything within reach of parcel `idx`, and somewhat more.
    #[inline(always)]
    pub fn find<const D: usize>(&mut self, crowd: &Crowd<D>, idx: usize) {
        self.rows.clear();
        self.n = 0;
        let mut y = [0.0; D];
        for axis in 0..D {
            y[axis] = crowd.y[axis][idx];
        }
        self.look(crowd, y);
        self.find_own(idx);
        for image in crowd.space.images(y) {
            let y = image.of(y);
            if crowd.space.is_near(y) {
                self.look(crowd, y);
            }
        }
        self.close();
    }

    /// Where parcel `idx` itself stands in its rows.
    #[inline(always)]
    pub(super) fn find_own(&mut self, idx: usize) {
        let mut at = 0;
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

    /// Rows of cells that the kernel reaches from a place.
    #[inline(always)]
    fn look<const D: usize>(&mut self, crowd: &Crowd<D>, y: [f64; D]) {
        let space = crowd.space;
        let radius = space.reach();
        match D {
            1 => self.row(crowd, y, 0, radius),
            2 => {
                let last = space.along(0, y[0] + radius);
                for row in space.along(0, y[0] - radius)..=last {
                    let d = space.distance(0, row, y[0]);
                    self.row(crowd, y, row, space.rest(d * d));
                }
            }
            _ => {
                let last = space.along(0, y[0] + radius);
                for plane in space.along(0, y[0] - radius)..=last {
                    let d = space.distance(0, plane, y[0]);
                    let across = space.rest(d * d);
                    let (first, last) = (space.along(1, y[1] - across), space.along(1, y[1] + across));
                    for row in first..=last {
                        let e = space.distance(1, row, y[1]);
                        self.row(crowd, y, space.row(plane, row), space.rest(d * d + e * e));
                    }
                }
            }
        }
    }

    /// Squared distances along one row.
    #[inline(always)]
    fn row<const D: usize>(&mut self, crowd: &Crowd<D>, y: [f64; D], row: usize, reach: f64) {
        let space = crowd.space;
        let cell = row * space.row_length();
        let (low, high) = (space.along(D - 1, y[D - 1] - reach), space.along(D - 1, y[D - 1] + reach));
        let (start, end) = (crowd.first[cell + low] as usize, crowd.first[cell + high + 1] as usize);
        let n = end - start;
        if n == 0 {
            return;
        }
        self.rows.push((start, n));
        self.make_room(n);
        let whole = n.next_multiple_of(PIECE);
        let (target, _) = self.weights[self.n..self.n + whole].as_chunks_mut::<PIECE>();
        let mut columns = [&[][..]; D];
        for axis in 0..D {
            columns[axis] = crowd.y[axis][start..start + whole].as_chunks::<PIECE>().0;
        }
        for piece in 0..target.len() {
            let mut squares = [0.0; PIECE];
            for axis in 0..D {
                let column = &columns[axis][piece];
                for k in 0..PIECE {
                    let d = column[k] - y[axis];
                    squares[k] += d * d;
                }
            }
            target[piece] = squares;
        }
        self.n += n;
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

    /// `w_ij ← 2 w_ij / (ρ_i + ρ_j)`
    #[inline(always)]
    pub fn divide_by_mean(&mut self, densities: &[f64], own: f64) {
        self.fetch(densities);
        let (weights, others) = (&mut self.weights[..self.end], &self.others[..self.end]);
        for idx in 0..weights.len() {
            weights[idx] *= 2.0 / (own + others[idx]);
        }
    }

    /// `w_ij ← 2 w_ij b_ij / (ρ_i + ρ_j)`, `b_ij = 2 b_i b_j/(b_i + b_j)`.
    #[inline(always)]
    pub fn share_by_mean(&mut self, densities: &[f64], own: f64, shares: &[f64], share: f64) {
        self.divide_by_mean(densities, own);
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

#[inline(always)]
fn folded(lanes: [f64; LANES]) -> f64 {
    ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]))
}

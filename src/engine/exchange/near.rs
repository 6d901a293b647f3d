//! The neighbours of one parcel, and their weights.
//!
//! Owns the search through cells and the sums over what is found. May use kernels and the space. It deliberately
//! writes to nothing but its own lists: every parcel gathers for itself, so that sums never hang on threads.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::space::Space;
use crate::catalog::kernel::Radial;

/// Lanes of a sum: the same for wide and narrow code.
const LANES: usize = 8;

/// Parcels in the order of cells.
#[derive(Clone, Copy)]
pub struct Crowd<'a, const D: usize> {
    pub space: &'a Space<D>,
    /// Positions in the space, by axis.
    pub y: [&'a [f64]; D],
    /// Where each cell begins; one more than cells.
    pub first: &'a [u32],
}

/// Squared distances of what is near, later weights, row by row of cells.
#[derive(Debug, Default)]
pub struct Near {
    pub weights: Vec<f64>,
    /// Where a row stands among all parcels, and how many it has.
    pub rows: Vec<(usize, usize)>,
    n: usize,
    /// `n`, and what is missing in the last lanes.
    end: usize,
    /// Where the parcel itself stands.
    pub own: usize,
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
        let mut at = 0;
        for row in 0..self.rows.len() {
            let (start, n) = self.rows[row];
            if idx >= start && idx < start + n {
                self.own = at + idx - start;
            }
            at += n;
        }
        for image in crowd.space.images(y) {
            let y = image.of(y);
            if crowd.space.is_near(y) {
                self.look(crowd, y);
            }
        }
        // The rest of the last lanes is out of reach.
        self.end = self.n.next_multiple_of(LANES);
        if self.weights.len() < self.end {
            self.weights.resize(self.end, 0.0);
        }
        self.weights[self.n..self.end].fill(f64::MAX);
    }

    /// Rows of cells that the kernel reaches from a place.
    #[inline(always)]
    fn look<const D: usize>(&mut self, crowd: &Crowd<D>, y: [f64; D]) {
        let space = crowd.space;
        let radius = space.rest(0.0);
        match D {
            1 => self.row(crowd, y, 0, radius),
            2 => {
                let last = space.along(0, y[0] + radius);
                for row in space.along(0, y[0] - radius)..=last {
                    let d = space.distance(0, row, y[0]);
                    if d <= radius {
                        self.row(crowd, y, row, space.rest(d * d));
                    }
                }
            }
            _ => {
                let last = space.along(0, y[0] + radius);
                for plane in space.along(0, y[0] - radius)..=last {
                    let d = space.distance(0, plane, y[0]);
                    if d > radius {
                        continue;
                    }
                    let across = space.rest(d * d);
                    let (first, last) = (space.along(1, y[1] - across), space.along(1, y[1] + across));
                    for row in first..=last {
                        let e = space.distance(1, row, y[1]);
                        if e <= across {
                            self.row(crowd, y, space.row(plane, row), space.rest(d * d + e * e));
                        }
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
        let needed = self.n + n + LANES;
        if self.weights.len() < needed {
            self.weights.resize(needed.next_power_of_two(), 0.0);
        }
        let target = &mut self.weights[self.n..self.n + n];
        let mut columns = crowd.y;
        for axis in 0..D {
            columns[axis] = &crowd.y[axis][start..end];
        }
        for idx in 0..n {
            let mut square = 0.0;
            for axis in 0..D {
                let d = columns[axis][idx] - y[axis];
                square += d * d;
            }
            target[idx] = square;
        }
        self.n += n;
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
        let mut at = 0;
        for &(start, n) in &self.rows {
            let (weights, others) = (&mut self.weights[at..at + n], &densities[start..start + n]);
            for idx in 0..n {
                weights[idx] *= 2.0 / (own + others[idx]);
            }
            at += n;
        }
    }

    /// `w_ij ← w_ij s_i s_j`
    #[inline(always)]
    pub fn multiply(&mut self, factors: &[f64], own: f64) {
        let mut at = 0;
        for &(start, n) in &self.rows {
            let (weights, others) = (&mut self.weights[at..at + n], &factors[start..start + n]);
            for idx in 0..n {
                weights[idx] *= own * others[idx];
            }
            at += n;
        }
    }

    /// `w_ij ← w_ij min(a_i, a_j)`
    #[inline(always)]
    pub fn limit(&mut self, caps: &[f64], own: f64) {
        let mut at = 0;
        for &(start, n) in &self.rows {
            let (weights, others) = (&mut self.weights[at..at + n], &caps[start..start + n]);
            for idx in 0..n {
                weights[idx] *= if others[idx] < own { others[idx] } else { own };
            }
            at += n;
        }
    }

    /// Sum of all weights.
    #[inline(always)]
    pub fn sum(&self) -> f64 {
        let mut lanes = [0.0; LANES];
        let (chunks, _) = self.weights[..self.end].as_chunks::<LANES>();
        for chunk in chunks {
            for lane in 0..LANES {
                lanes[lane] += chunk[lane];
            }
        }
        folded(lanes)
    }

    /// Sum of weights times factors.
    #[inline(always)]
    pub fn sum_of(&self, factors: &[f64]) -> f64 {
        let mut lanes = [0.0; LANES];
        let mut at = 0;
        for &(start, n) in &self.rows {
            add(&mut lanes, &self.weights[at..at + n], &factors[start..start + n], 0.0);
            at += n;
        }
        folded(lanes)
    }

    /// `Σ_j w_ij (v_j − v_i)`
    #[inline(always)]
    pub fn difference(&self, values: &[f64], own: f64) -> f64 {
        let mut lanes = [0.0; LANES];
        let mut at = 0;
        for &(start, n) in &self.rows {
            add(&mut lanes, &self.weights[at..at + n], &values[start..start + n], own);
            at += n;
        }
        folded(lanes)
    }
}

/// Adds `weights · (values − own)`, each to the lane of its place in the row.
#[inline(always)]
fn add(lanes: &mut [f64; LANES], weights: &[f64], values: &[f64], own: f64) {
    let (weight_chunks, weight_rest) = weights.as_chunks::<LANES>();
    let (value_chunks, value_rest) = values.as_chunks::<LANES>();
    for idx in 0..weight_chunks.len().min(value_chunks.len()) {
        let (weights, values) = (&weight_chunks[idx], &value_chunks[idx]);
        for lane in 0..LANES {
            lanes[lane] += weights[lane] * (values[lane] - own);
        }
    }
    for lane in 0..weight_rest.len().min(value_rest.len()) {
        lanes[lane] += weight_rest[lane] * (value_rest[lane] - own);
    }
}

#[inline(always)]
fn folded(lanes: [f64; LANES]) -> f64 {
    ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]))
}

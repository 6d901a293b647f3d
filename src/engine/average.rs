//! Sums per bin and the means of carried values.
//!
//! Owns the histogram and what is made of it. May use `state`. It deliberately merges nothing in
//! parallel: partial sums are added in the order of groups, so that the bytes never depend on threads.

use super::program::Program;
use crate::state::particles::BLOCK;
use std::ops::Range;

/// Most groups of blocks that have sums of their own.
const MAX_GROUPS: usize = 32;

/// Most places of all partial sums together, if particles are not fewer.
const MAX_PLACES: u64 = 4 << 20;

/// Places of partial sums that are always allowed.
const MIN_PLACES: u64 = 256 << 10;

/// How many consecutive blocks share one array of sums.
///
/// A matter of the number of particles and of the bins alone: with the columns or with the other
/// outputs in it, a field that nobody reads would change the last bits of those that are read.
pub fn blocks_per_group(n_particles: u64, n_places: usize) -> usize {
    let n_blocks = n_particles.div_ceil(BLOCK as u64).max(1) as usize;
    let budget = n_particles.clamp(MIN_PLACES, MAX_PLACES);
    let n_groups = (budget / n_places.max(1) as u64).clamp(1, MAX_GROUPS as u64) as usize;
    n_blocks.div_ceil(n_groups.min(n_blocks))
}

/// Copies of a small histogram that neighbouring particles take in turn: without them each addition
/// would wait for the one before when neighbours share a bin.
pub fn lanes(n_slots: usize) -> usize {
    if n_slots <= 768 { 4 } else { 1 }
}

/// Adds a chunk to `sums`: per slot and lane a count and the columns.
#[inline(always)]
pub fn accumulate(
    slots: &[i32],
    columns: &[Vec<f64>],
    range: Range<usize>,
    n_lanes: usize,
    sums: &mut [f64],
) {
    match (columns, n_lanes) {
        ([a], 4) => accumulate_fixed::<1, 2, 4>(slots, [&a[range]], sums),
        ([a], _) => accumulate_fixed::<1, 2, 1>(slots, [&a[range]], sums),
        ([a, b], 4) => accumulate_fixed::<2, 3, 4>(slots, [&a[range.clone()], &b[range]], sums),
        ([a, b], _) => accumulate_fixed::<2, 3, 1>(slots, [&a[range.clone()], &b[range]], sums),
        _ => accumulate_any(slots, columns, range, n_lanes, sums),
    }
}

#[inline(always)]
fn accumulate_fixed<const C: usize, const S: usize, const L: usize>(
    slots: &[i32],
    columns: [&[f64]; C],
    sums: &mut [f64],
) {
    let (sums, _) = sums.as_chunks_mut::<S>();
    let columns = columns.map(|column| &column[..slots.len()]);
    for (idx, &slot) in slots.iter().enumerate() {
        let sum = &mut sums[slot as usize * L + idx % L];
        let mut particle = [1.0; S];
        for column in 0..C {
            particle[column + 1] = columns[column][idx];
        }
        for place in 0..S {
            sum[place] += particle[place];
        }
    }
}

#[inline(always)]
fn accumulate_any(
    slots: &[i32],
    columns: &[Vec<f64>],
    range: Range<usize>,
    n_lanes: usize,
    sums: &mut [f64],
) {
    let stride = columns.len() + 1;
    for (idx, &slot) in slots.iter().enumerate() {
        sums[(slot as usize * n_lanes + idx % n_lanes) * stride] += 1.0;
    }
    for (column_idx, column) in columns.iter().enumerate() {
        for (idx, (&slot, &value)) in slots.iter().zip(&column[range.clone()]).enumerate() {
            sums[(slot as usize * n_lanes + idx % n_lanes) * stride + column_idx + 1] += value;
        }
    }
}

/// Sums of lanes, in the order of lanes, added to the sums of a group.
pub fn fold_lanes(lane_sums: &[f64], n_lanes: usize, stride: usize, sums: &mut [f64]) {
    for (slot, target) in sums.chunks_mut(stride).enumerate() {
        for lane in lane_sums[slot * n_lanes * stride..][..n_lanes * stride].chunks(stride) {
            target.iter_mut().zip(lane).for_each(|(target, value)| *target += value);
        }
    }
}

/// Means per bin.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Means {
    /// Particles per slot; the last slot is outside.
    pub counts: Vec<f64>,
    /// Per column and slot; 0 where no particle is.
    pub columns: Vec<Vec<f64>>,
    /// Per component and slot: ū.
    pub mixed: Vec<Vec<f64>>,
    /// Per column the sum over all particles.
    pub totals: Vec<f64>,
}

impl Means {
    /// From merged sums (per slot a count and the columns).
    ///
    /// - Equation: `ū = Σ_i η_i W̄_i / Σ_i η_i` over the zones that are simulated.
    /// - Symbols: `W̄_i` the bin's mean of zone `i`, `η_i` its fraction.
    /// - Range: the slot outside has no mean.
    /// - Source: methods, sections 7.2 and 7.7: every zone's mean obeys the same coarse equation.
    /// - Shape: one value per component and slot.
    pub fn assign<const D: usize>(&mut self, program: &Program<D>, sums: &[f64]) {
        let stride = program.n_columns() + 1;
        let n_slots = sums.len() / stride;
        self.counts.clear();
        self.counts.extend(sums.iter().step_by(stride));
        self.columns.resize_with(stride - 1, Vec::new);
        self.totals.clear();
        for (column_idx, column) in self.columns.iter_mut().enumerate() {
            column.clear();
            let values = sums.iter().skip(column_idx + 1).step_by(stride);
            self.totals.push(values.clone().sum());
            column.extend(values.zip(&self.counts).map(|(sum, &n)| if n > 0.0 { sum / n } else { 0.0 }));
            column[n_slots - 1] = 0.0;
        }
        self.mixed.resize_with(program.n_components(), Vec::new);
        for (component, mixed) in self.mixed.iter_mut().enumerate() {
            mixed.clear();
            mixed.resize(n_slots, 0.0);
            for &(slot, weight) in &program.seen_weights {
                let column = &self.columns[component * program.roles.len() + slot];
                mixed.iter_mut().zip(column).for_each(|(mixed, mean)| *mixed += weight * mean);
            }
        }
    }
}

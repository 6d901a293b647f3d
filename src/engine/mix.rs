//! Exchange with the mean: the relaxation of mixing zones.
//!
//! Owns the exact exponential step. May use `state` and the means. It deliberately computes no means.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::average::Means;
use super::program::{Program, Role};
use crate::state::particles::CHUNK;
use std::ops::Range;

/// Relaxes a chunk towards the means of its bins; the last component with a value below its limit is
/// returned. The means that the particles saw are left in `targets`: one per component, or a single one
/// that is used again and again.
///
/// - Equation: `W ← W̄ + (W − W̄) e^{−χΔt/2}`.
/// - Symbols: `W̄` mean of this zone in the bin, `χ` rate, `decays` the exponential per slot.
/// - Range: any `χΔt ≥ 0`; outside open sides nothing changes.
/// - Source: Sole-Mari et al. (2020), the exchange with the mean; methods, section 7.2.
/// - Shape: columns of one chunk; conserves each bin's sum.
#[inline(always)]
pub fn relax<const D: usize>(
    program: &Program<D>,
    means: &Means,
    decays: &[Option<f64>],
    slots: &[i32],
    columns: &mut [&mut [f64]],
    targets: &mut [[f64; CHUNK]],
    limits: &[f64],
) -> Option<usize> {
    let mut below = None;
    let n_slots = program.roles.len();
    for (column_idx, column) in columns.iter_mut().enumerate() {
        let (component, slot) = (column_idx / n_slots, column_idx % n_slots);
        let last = targets.len() - 1;
        let target = &mut targets[component.min(last)];
        match (program.roles[slot], decays[slot]) {
            (Role::Relaxing(_), Some(decay)) => {
                gather(program, &means.columns[column_idx], slots, column, target);
                if approach(column, target, decay, limits[component]) {
                    below = Some(component);
                }
            }
            (Role::Mean, _) => {
                gather(program, &means.mixed[component], slots, column, target);
                column.copy_from_slice(&target[..slots.len()]);
            }
            (Role::Relaxing(_), None) | (Role::Fixed, _) => {}
        }
    }
    below
}

/// The mean that each particle sees; outside it is the particle's own value.
#[inline(always)]
pub fn gather<const D: usize>(
    program: &Program<D>,
    means: &[f64],
    slots: &[i32],
    own: &[f64],
    target: &mut [f64; CHUNK],
) {
    let n_bins = program.grid.n_bins() as i32;
    let n = slots.len();
    let target = &mut target[..n];
    if program.grid.has_open_side() {
        let own = &own[..n];
        for idx in 0..n {
            let slot = slots[idx];
            target[idx] = if slot < n_bins { means[slot as usize] } else { own[idx] };
        }
    } else {
        for idx in 0..n {
            target[idx] = means[slots[idx] as usize];
        }
    }
}

/// Says whether any value is now below the limit.
#[inline(always)]
fn approach(values: &mut [f64], target: &[f64; CHUNK], decay: f64, limit: f64) -> bool {
    let mut n_below = 0_u64;
    let target = &target[..values.len()];
    for idx in 0..values.len() {
        values[idx] = target[idx] + (values[idx] - target[idx]) * decay;
        n_below |= u64::from(values[idx] < limit);
    }
    n_below != 0
}

/// Splits the columns of a block at one chunk.
#[inline(always)]
pub fn cut(columns: &mut [Vec<f64>], range: Range<usize>) -> Vec<&mut [f64]> {
    columns.iter_mut().map(|column| &mut column[range.clone()]).collect()
}

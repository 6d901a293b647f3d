//! Exchange with the mean: the relaxation of mixing zones.
//!
//! Owns the exact exponential step. May use `state` and the means. It deliberately computes no means.

use super::average::Means;
use super::program::{Program, Role};
use crate::state::particles::CHUNK;
use std::ops::Range;

/// Lanes of the smallest value, so that the search vectorises.
const LANES: usize = 8;

/// Relaxes a chunk towards the means of its bins and returns the smallest value reached per component.
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
    mut see_lowest: impl FnMut(usize, f64),
) {
    let mut target = [0.0; CHUNK];
    let n_slots = program.roles.len();
    for (column_idx, column) in columns.iter_mut().enumerate() {
        let (component, slot) = (column_idx / n_slots, column_idx % n_slots);
        match (program.roles[slot], decays[slot]) {
            (Role::Relaxing(_), Some(decay)) => {
                gather(program, &means.columns[column_idx], slots, column, &mut target);
                see_lowest(component, approach(column, &target, decay));
            }
            (Role::Mean, _) => {
                gather(program, &means.mixed[component], slots, column, &mut target);
                column.copy_from_slice(&target[..slots.len()]);
            }
            (Role::Relaxing(_), None) | (Role::Fixed, _) => {}
        }
    }
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
    if program.grid.has_open_side() {
        for ((target, &slot), &own) in target.iter_mut().zip(slots).zip(own) {
            *target = if slot < n_bins { means[slot as usize] } else { own };
        }
    } else {
        for (target, &slot) in target.iter_mut().zip(slots) {
            *target = means[slot as usize];
        }
    }
}

#[inline(always)]
fn approach(values: &mut [f64], target: &[f64; CHUNK], decay: f64) -> f64 {
    let mut lowest = [f64::INFINITY; LANES];
    let (head, tail) = values.as_chunks_mut::<LANES>();
    let (target_head, _) = target.as_chunks::<LANES>();
    for (values, target) in head.iter_mut().zip(target_head) {
        for lane in 0..LANES {
            let value = target[lane] + (values[lane] - target[lane]) * decay;
            lowest[lane] = if value < lowest[lane] { value } else { lowest[lane] };
            values[lane] = value;
        }
    }
    let start = head.len() * LANES;
    for (value, &target) in tail.iter_mut().zip(&target[start..]) {
        *value = target + (*value - target) * decay;
        lowest[0] = if *value < lowest[0] { *value } else { lowest[0] };
    }
    lowest.into_iter().fold(f64::INFINITY, f64::min)
}

/// Splits the columns of a block at one chunk.
#[inline(always)]
pub fn cut(columns: &mut [Vec<f64>], range: Range<usize>) -> Vec<&mut [f64]> {
    columns.iter_mut().map(|column| &mut column[range.clone()]).collect()
}

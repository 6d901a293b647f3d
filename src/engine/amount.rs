//! The carried amount: what must not change.
//!
//! Owns sums over all particles and their defect. May use `state`. It deliberately multiplies by no
//! volume: all particles have the same.

use super::parallel;
use super::program::{Program, Role};
use super::react::Added;
use crate::state::particles::{Block, CHUNK};

/// Sums of one column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Amount {
    pub sum: f64,
    /// Σ|value|
    pub size: f64,
    pub lowest: f64,
    pub highest: f64,
}

impl Amount {
    const NONE: Self = Self { sum: 0.0, size: 0.0, lowest: f64::INFINITY, highest: f64::NEG_INFINITY };

    fn of(values: &[f64]) -> Self {
        values.chunks(CHUNK).map(Self::of_chunk).fold(Self::NONE, Self::add)
    }

    fn of_chunk(values: &[f64]) -> Self {
        values.iter().fold(Self::NONE, |amount, &value| {
            amount.add(Self { sum: value, size: value.abs(), lowest: value, highest: value })
        })
    }

    /// Of what lives in bins, as if particles carried it.
    pub fn of_bins(sum: f64) -> Self {
        Self { sum, size: sum.abs(), lowest: sum, highest: sum }
    }

    fn add(self, other: Self) -> Self {
        Self {
            sum: self.sum + other.sum,
            size: self.size + other.size,
            lowest: self.lowest.min(other.lowest),
            highest: self.highest.max(other.highest),
        }
    }

    /// Relative difference to what was there before and what reactions added.
    pub fn defect_of(sum: f64, before: &Self, added: Added) -> f64 {
        let scale = before.sum.abs().max(before.size).max(added.size);
        let defect = (sum - (before.sum + added.sum)).abs();
        if scale > 0.0 { defect / scale } else { defect }
    }
}

/// Amounts per column, added in the order of blocks.
pub fn amounts<const D: usize>(blocks: &[Block<D>], n_columns: usize) -> Vec<Amount> {
    let of_block =
        |idx: usize| -> Vec<Amount> { blocks[idx].columns.iter().map(|c| Amount::of(c)).collect() };
    let partial = parallel::map(blocks.len(), &of_block);
    let mut amounts = vec![Amount::NONE; n_columns];
    for block in partial {
        amounts.iter_mut().zip(block).for_each(|(amount, part)| *amount = amount.add(part));
    }
    amounts
}

/// The larger of two defects; one that is no number is the worst, and must not be passed over.
pub fn worse(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// Largest relative change per component over its columns, apart from what reactions `added` and what each column
/// `gained` as particles came and went.
pub fn defects<const D: usize>(
    program: &Program<D>,
    before: &[Amount],
    added: &[Added],
    sums: &[f64],
    gained: impl Fn(usize) -> Added,
) -> Vec<f64> {
    let n_slots = program.roles.len();
    let of_component = |component: usize| {
        let columns = (0..n_slots).filter(|&slot| program.roles[slot] != Role::Mean);
        let of_slot = |slot: usize| {
            let column = component * n_slots + slot;
            let mut all = added[component];
            all.add(gained(column));
            Amount::defect_of(sums[column], &before[column], all)
        };
        columns.map(of_slot).fold(0.0, worse)
    };
    (0..program.n_components()).map(of_component).collect()
}

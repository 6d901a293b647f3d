//! How far a species has spread: moments and dilution of what fluid particles carry.
//!
//! Owns these sums. May use the lab. It deliberately holds no state: sums are arrays that the caller merges in
//! order.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::super::mass::{PRODUCTS, dilution, product};
use super::super::program::Program;
use super::super::snapshot::{Row, Values};
use super::lab::Lab;

/// Second moments of a species.
pub const N_PRODUCTS: usize = PRODUCTS.len();

/// Per species `Σ c` and `Σ c x` along each axis.
#[inline(always)]
pub fn add_first<const D: usize>(lab: &Lab<D>, species: &[usize], sums: &mut [f64]) {
    for (sums, &idx) in sums.chunks_exact_mut(1 + D).zip(species) {
        let c = &lab.species[idx];
        for particle in 0..lab.n {
            sums[0] += c[particle];
            for axis in 0..D {
                sums[1 + axis] += c[particle] * lab.positions[axis][particle];
            }
        }
    }
}

/// Per species `Σ c (x_i − x̄_i)(x_j − x̄_j)`.
#[inline(always)]
pub fn add_second<const D: usize>(lab: &Lab<D>, species: &[usize], first: &[f64], sums: &mut [f64]) {
    let first = first.chunks_exact(1 + D);
    for ((sums, first), &idx) in sums.chunks_exact_mut(N_PRODUCTS).zip(first).zip(species) {
        let c = &lab.species[idx];
        let mean: [f64; D] = std::array::from_fn(|axis| first[1 + axis] / first[0]);
        for particle in 0..lab.n {
            let x: [f64; D] = std::array::from_fn(|axis| lab.positions[axis][particle] - mean[axis]);
            for (sum, (i, j)) in sums.iter_mut().zip(PRODUCTS) {
                if i < D && j < D {
                    *sum += c[particle] * x[i] * x[j];
                }
            }
        }
    }
}

/// Amount, centre and second central moments per species.
pub fn moments<const D: usize>(program: &Program<D>, n: usize, first: &[f64], second: &[f64]) -> Values {
    let volume = program.volume;
    let index = |axis: usize| program.plan.axes[axis].index;
    let row = |species: usize| {
        let first = &first[species * (1 + D)..][..1 + D];
        let second = &second[species * N_PRODUCTS..][..N_PRODUCTS];
        let mut numbers = vec![f64::NAN; 10];
        numbers[0] = volume * first[0];
        if first[0] != 0.0 {
            (0..D).for_each(|axis| numbers[1 + index(axis)] = first[1 + axis] / first[0]);
            for (sum, (i, j)) in second.iter().zip(PRODUCTS).filter(|(_, (i, j))| *i < D && *j < D) {
                numbers[4 + product(index(i), index(j))] = sum / first[0];
            }
        }
        vec![Row { place: 0, numbers }]
    };
    Values::Rows((0..n).map(row).collect())
}

/// Dilution per species, from means over equal bins: what is in one goes with its mean.
pub fn dilutions<const D: usize>(program: &Program<D>, n_bins: usize, n: usize, first: &[f64]) -> Values {
    let volume = program.plan.axes.iter().map(|axis| axis.high - axis.low).product();
    let row = |species: usize| {
        let of = |bin: usize| first[bin * (1 + n) + 1 + species].max(0.0);
        let masses: Vec<f64> = (0..n_bins).map(of).collect();
        vec![Row { place: 0, numbers: dilution(&masses, n_bins, volume) }]
    };
    Values::Rows((0..n).map(row).collect())
}

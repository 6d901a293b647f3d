//! Sums over particles that make an output.
//!
//! Owns what is summed per particle and how sums become values, except for mixing. May use the lab.
//! It deliberately holds no state: sums are arrays that the caller merges in order.

use super::super::program::Program;
use super::super::snapshot::Values;
use super::lab::Lab;
use super::mixing::Mixing;
use crate::plan::{Output, OutputKind, Quantity};
use crate::state::grid::Grid;
use crate::state::particles::CHUNK;

/// Lanes of a plain sum.
const LANES: usize = 8;

/// One output, ready to be summed.
pub enum Tally<'a, const D: usize> {
    /// Profile and map.
    Binned {
        grid: Grid<D>,
        species: Vec<usize>,
    },
    Covariance {
        grid: Grid<D>,
        pairs: Vec<(usize, usize)>,
    },
    Total {
        species: Vec<usize>,
    },
    Mixing(Mixing<'a, D>),
    /// Collected apart, as nothing is summed.
    Particles,
}

impl<'a, const D: usize> Tally<'a, D> {
    /// `None` if the output's bins do not make a grid.
    pub fn new(program: &Program<D>, output: &Output, mixing: Option<Mixing<'a, D>>) -> Option<Self> {
        Some(match output.kind {
            OutputKind::Profile | OutputKind::Map => {
                Self::Binned { grid: output_grid(program, output)?, species: species(output) }
            }
            OutputKind::Covariance => {
                Self::Covariance { grid: output_grid(program, output)?, pairs: pairs(output) }
            }
            OutputKind::Total => Self::Total { species: species(output) },
            OutputKind::Mixing => Self::Mixing(mixing?),
            OutputKind::Particles => Self::Particles,
        })
    }

    /// Bins over which it sums: what decides how blocks are grouped.
    pub fn n_places(&self) -> usize {
        match self {
            Self::Binned { grid, .. } | Self::Covariance { grid, .. } => grid.n_slots(),
            Self::Mixing(mixing) => mixing.n_slots(),
            Self::Total { .. } | Self::Particles => 1,
        }
    }

    /// Numbers that the first pass sums: for bins a count, then one number per column.
    pub fn n_first(&self) -> usize {
        match self {
            Self::Binned { grid, species } => grid.n_slots() * (1 + species.len()),
            Self::Covariance { grid, pairs } => grid.n_slots() * (1 + 2 * pairs.len()),
            Self::Total { species } => species.len(),
            Self::Mixing(mixing) => mixing.n_sums(),
            Self::Particles => 0,
        }
    }

    /// Numbers that the second pass sums: deviations from the means of the first.
    pub fn n_second(&self) -> usize {
        match self {
            Self::Binned { grid, species } => grid.n_slots() * species.len(),
            Self::Covariance { grid, pairs } => grid.n_slots() * pairs.len(),
            Self::Total { .. } | Self::Mixing(_) | Self::Particles => 0,
        }
    }

    /// Adds a chunk to the sums of the first pass.
    pub fn add_first(&self, lab: &Lab<D>, sums: &mut [f64]) {
        match self {
            Self::Binned { grid, species } => {
                let columns: Vec<&[f64; CHUNK]> = species.iter().map(|&idx| &lab.species[idx]).collect();
                add_binned(grid, lab, &columns, sums);
            }
            Self::Covariance { grid, pairs } => {
                let both = pairs.iter().flat_map(|&(a, b)| [&lab.unreacted[a], &lab.unreacted[b]]);
                add_binned(grid, lab, &both.collect::<Vec<_>>(), sums);
            }
            Self::Total { species } => {
                for (sum, &idx) in sums.iter_mut().zip(species) {
                    *sum += lane_sum(&lab.species[idx][..lab.n]);
                }
            }
            Self::Mixing(mixing) => mixing.add(lab, sums),
            Self::Particles => {}
        }
    }

    /// Adds a chunk to the sums of the second pass.
    pub fn add_second(&self, lab: &Lab<D>, first: &[f64], sums: &mut [f64]) {
        match self {
            Self::Binned { grid, species } => {
                let columns = species.iter().enumerate().map(|(column, &idx)| {
                    let (values, place) = (&lab.species[idx], 1 + column);
                    (values, place, values, place)
                });
                add_deviations(grid, lab, columns, 1 + species.len(), first, sums);
            }
            Self::Covariance { grid, pairs } => {
                let columns = pairs.iter().enumerate().map(|(pair, &(a, b))| {
                    (&lab.unreacted[a], 1 + 2 * pair, &lab.unreacted[b], 2 + 2 * pair)
                });
                add_deviations(grid, lab, columns, 1 + 2 * pairs.len(), first, sums);
            }
            Self::Total { .. } | Self::Mixing(_) | Self::Particles => {}
        }
    }

    /// The values of the output from both sums; `None` for particles.
    pub fn values(&self, program: &Program<D>, first: &[f64], second: &[f64]) -> Option<Values> {
        match self {
            Self::Binned { grid, species } => Some(binned(grid.n_bins(), species.len(), first, second)),
            Self::Covariance { grid, pairs } => Some(covariances(grid.n_bins(), pairs.len(), first, second)),
            Self::Total { .. } => {
                let volume = program.plan.particles.volume;
                Some(Values::Total { amount: first.iter().map(|sum| volume * sum).collect() })
            }
            Self::Mixing(mixing) => Some(Values::Mixing(mixing.states(first))),
            Self::Particles => None,
        }
    }
}

/// The grid of an output's bins.
pub fn output_grid<const D: usize>(program: &Program<D>, output: &Output) -> Option<Grid<D>> {
    let bins = <[usize; D]>::try_from(&output.bins[..]).ok()?;
    program.grid.with_bins(bins)
}

fn species(output: &Output) -> Vec<usize> {
    let only = |quantity: &Quantity| match *quantity {
        Quantity::Species(idx) => Some(idx),
        Quantity::Pair(..) => None,
    };
    output.quantities.iter().filter_map(only).collect()
}

/// The pairs of an output.
pub fn pairs(output: &Output) -> Vec<(usize, usize)> {
    let only = |quantity: &Quantity| match *quantity {
        Quantity::Pair(a, b) => Some((a, b)),
        Quantity::Species(_) => None,
    };
    output.quantities.iter().filter_map(only).collect()
}

fn add_binned<const D: usize>(grid: &Grid<D>, lab: &Lab<D>, columns: &[&[f64; CHUNK]], sums: &mut [f64]) {
    let mut slots = [0; CHUNK];
    grid.locate(lab.positions(), &mut slots[..lab.n]);
    let stride = columns.len() + 1;
    for (idx, &slot) in slots[..lab.n].iter().enumerate() {
        let target = &mut sums[slot as usize * stride..][..stride];
        target[0] += 1.0;
        for (target, column) in target[1..].iter_mut().zip(columns) {
            *target += column[idx];
        }
    }
}

/// Adds products of deviations; columns are `(a, place of a's sum, b, place of b's sum)`.
fn add_deviations<'l, const D: usize>(
    grid: &Grid<D>,
    lab: &'l Lab<D>,
    columns: impl Iterator<Item = (&'l [f64; CHUNK], usize, &'l [f64; CHUNK], usize)>,
    stride: usize,
    first: &[f64],
    sums: &mut [f64],
) {
    let mut slots = [0; CHUNK];
    grid.locate(lab.positions(), &mut slots[..lab.n]);
    let columns: Vec<_> = columns.collect();
    for (idx, &slot) in slots[..lab.n].iter().enumerate() {
        let bin = &first[slot as usize * stride..][..stride];
        let target = &mut sums[slot as usize * columns.len()..][..columns.len()];
        for (target, &(a, place_a, b, place_b)) in target.iter_mut().zip(&columns) {
            *target += (a[idx] - bin[place_a] / bin[0]) * (b[idx] - bin[place_b] / bin[0]);
        }
    }
}

/// Means and standard errors per bin.
///
/// - Equation: `c̄ = Σc / n`, `s = (Σ(c − c̄)² / ((n − 1) n))^½`.
/// - Symbols: `n` particles in the bin.
/// - Range: no mean for `n = 0`, no standard error for `n < 2` (not a number).
/// - Source: the textbook estimators.
/// - Shape: a column over the bins per species.
fn binned(n_bins: usize, n_columns: usize, first: &[f64], second: &[f64]) -> Values {
    let count = |bin: usize| first[bin * (1 + n_columns)];
    let mean = |bin: usize, column: usize| first[bin * (1 + n_columns) + 1 + column] / count(bin);
    let error = |bin: usize, column: usize| {
        let n = count(bin);
        if n < 2.0 { f64::NAN } else { (second[bin * n_columns + column] / ((n - 1.0) * n)).sqrt() }
    };
    Values::Binned {
        mean: (0..n_columns).map(|column| (0..n_bins).map(|bin| mean(bin, column)).collect()).collect(),
        standard_error: (0..n_columns)
            .map(|column| (0..n_bins).map(|bin| error(bin, column)).collect())
            .collect(),
        n_particles: (0..n_bins).map(|bin| count(bin) as u64).collect(),
    }
}

/// Unbiased covariances per bin: `Σ(a − ā)(b − b̄) / (n − 1)`; not a number for `n < 2`.
fn covariances(n_bins: usize, n_pairs: usize, first: &[f64], second: &[f64]) -> Values {
    let count = |bin: usize| first[bin * (1 + 2 * n_pairs)];
    let covariance = |bin: usize, pair: usize| {
        let n = count(bin);
        if n < 2.0 { f64::NAN } else { second[bin * n_pairs + pair] / (n - 1.0) }
    };
    Values::Covariance {
        covariance: (0..n_pairs).map(|pair| (0..n_bins).map(|bin| covariance(bin, pair)).collect()).collect(),
        n_particles: (0..n_bins).map(|bin| count(bin) as u64).collect(),
    }
}

/// A sum in fixed lanes, so that it vectorises and its error stays small.
#[inline(always)]
pub fn lane_sum(values: &[f64]) -> f64 {
    let (head, tail) = values.as_chunks::<LANES>();
    let mut lanes = [0.0; LANES];
    for values in head {
        for lane in 0..LANES {
            lanes[lane] += values[lane];
        }
    }
    let mut sum = 0.0;
    for value in lanes {
        sum += value;
    }
    for value in tail {
        sum += value;
    }
    sum
}

//! Sums over particles that make an output.
//!
//! Owns what is summed per particle and how sums become values, except for mixing. May use the lab.
//! It deliberately holds no state: sums are arrays that the caller merges in order.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::super::program::{Program, Term};
use super::super::run::Run;
use super::super::snapshot::Values;
use super::budget::{self, Budget};
use super::lab::Lab;
use super::mixing::Mixing;
use super::spread;
use crate::plan::{Output, OutputKind, Quantity, Station};
use crate::state::grid::Grid;
use crate::state::particles::CHUNK;

/// Lanes of a plain sum.
const LANES: usize = 8;

/// One output, ready to be summed.
pub enum Tally<'a, const D: usize> {
    /// Profile and map.
    Binned {
        bins: Bins<D>,
        species: Vec<usize>,
        follow: Follow,
    },
    Covariance {
        bins: Bins<D>,
        pairs: Vec<(usize, usize)>,
    },
    Total {
        species: Vec<usize>,
        /// Amounts of what lives in bins, over the volume of a particle; `None` for what particles carry.
        in_bins: Vec<Option<f64>>,
    },
    Mixing(Mixing<'a, D>),
    Moments {
        species: Vec<usize>,
    },
    /// Means in a box.
    Within {
        low: [f64; D],
        high: [f64; D],
        species: Vec<usize>,
    },
    Budget(Budget),
    Dilution {
        bins: Bins<D>,
        species: Vec<usize>,
    },
    /// Collected apart, particle by particle, as nothing is summed.
    Particles {
        species: Vec<usize>,
    },
}

/// The bins of an output.
pub struct Bins<const D: usize> {
    grid: Grid<D>,
    /// Whether they are the bins of the averages, in which the lab has put the particles already.
    is_shared: bool,
}

impl<const D: usize> Bins<D> {
    fn new(program: &Program<D>, output: &Output) -> Option<Self> {
        let grid = output_grid(program, output)?;
        let is_shared = grid == program.grid;
        Some(Self { grid, is_shared })
    }

    #[inline(always)]
    fn slots<'s>(&self, lab: &'s Lab<D>, own: &'s mut [i32; CHUNK]) -> &'s [i32] {
        if self.is_shared {
            return lab.slots();
        }
        self.grid.locate(lab.positions(), &mut own[..lab.n]);
        &own[..lab.n]
    }
}

/// What standard errors need to know of the means that particles see.
pub struct Follow {
    /// `1 − f`: how much of U is ū; 0 if nothing sees it.
    share: f64,
    /// Components, or 0 if nothing sees ū.
    n_components: usize,
}

impl Follow {
    fn new<const D: usize>(program: &Program<D>) -> Self {
        let fraction = |term: &Term| match *term {
            Term::Mean { fraction } => fraction,
            Term::Column { .. } => 0.0,
        };
        let of_bins: f64 = program.terms.iter().map(fraction).sum();
        let stored = |term: &Term| match *term {
            Term::Column { slot, fraction } if Some(slot) == program.mean_slot() => fraction,
            Term::Column { .. } | Term::Mean { .. } => 0.0,
        };
        let share = of_bins + program.terms.iter().map(stored).sum::<f64>();
        let n_components = if share > 0.0 { program.n_components() } else { 0 };
        Self { share, n_components }
    }
}

impl<'a, const D: usize> Tally<'a, D> {
    /// `None` if the output's bins do not make a grid.
    pub fn new(run: &Run<D>, output: &Output, mixing: Option<Mixing<'a, D>>) -> Option<Self> {
        let (program, immobile) = (&run.program, &run.reactions.immobile);
        let in_bins =
            |species: &[usize]| species.iter().map(|&idx| amount_in_bins(program, idx, immobile)).collect();
        Some(match output.kind {
            OutputKind::Profile | OutputKind::Map => {
                let follow = Follow::new(program);
                Self::Binned { bins: Bins::new(program, output)?, species: species(output), follow }
            }
            OutputKind::Covariance => {
                Self::Covariance { bins: Bins::new(program, output)?, pairs: pairs(output) }
            }
            OutputKind::Total => {
                let species = species(output);
                Self::Total { in_bins: in_bins(&species), species }
            }
            OutputKind::Mixing => Self::Mixing(mixing?),
            OutputKind::Particles | OutputKind::Density | OutputKind::Kernels => {
                Self::Particles { species: species(output) }
            }
            OutputKind::Moments => Self::Moments { species: species(output) },
            OutputKind::Dilution => {
                Self::Dilution { bins: Bins::new(program, output)?, species: species(output) }
            }
            OutputKind::Budget => {
                let species = species(output);
                Self::Budget(Budget {
                    accounts: species.iter().map(|&idx| run.account(idx)).collect(),
                    in_bins: in_bins(&species),
                    species,
                })
            }
            OutputKind::Breakthrough => {
                let Some(Station::Box { low, high }) = &output.station else { return None };
                Self::Within {
                    low: <[f64; D]>::try_from(&low[..]).ok()?,
                    high: <[f64; D]>::try_from(&high[..]).ok()?,
                    species: species(output),
                }
            }
            // Only particles that carry mass have it: a plan that asks for it is not run here.
            OutputKind::FirstPassage => return None,
        })
    }

    /// Species that are listed, particle by particle.
    pub fn listed(&self) -> &[usize] {
        match self {
            Self::Particles { species } => species,
            _ => &[],
        }
    }

    /// Bins over which it sums: what decides how blocks are grouped.
    pub fn n_places(&self) -> usize {
        match self {
            Self::Binned { bins, .. } | Self::Covariance { bins, .. } | Self::Dilution { bins, .. } => {
                bins.grid.n_slots()
            }
            Self::Mixing(mixing) => mixing.n_slots(),
            Self::Total { .. }
            | Self::Moments { .. }
            | Self::Within { .. }
            | Self::Budget(_)
            | Self::Particles { .. } => 1,
        }
    }

    /// Numbers that the first pass sums: for bins a count, then one number per column.
    pub fn n_first(&self) -> usize {
        match self {
            Self::Binned { bins, species, follow } => {
                bins.grid.n_slots() * (1 + species.len() * (1 + follow.n_components))
            }
            Self::Covariance { bins, pairs } => bins.grid.n_slots() * (1 + 2 * pairs.len()),
            Self::Total { species, .. } => species.len(),
            Self::Mixing(mixing) => mixing.n_sums(),
            Self::Moments { species } => species.len() * (1 + D),
            Self::Within { species, .. } => 1 + species.len(),
            Self::Budget(budget) => budget.species.len(),
            Self::Dilution { bins, species } => bins.grid.n_slots() * (1 + species.len()),
            Self::Particles { .. } => 0,
        }
    }

    /// Numbers that the second pass sums: deviations from the means of the first.
    pub fn n_second(&self) -> usize {
        match self {
            Self::Binned { bins, species, .. } => bins.grid.n_slots() * species.len(),
            Self::Covariance { bins, pairs } => bins.grid.n_slots() * pairs.len(),
            Self::Moments { species } => species.len() * spread::N_PRODUCTS,
            _ => 0,
        }
    }

    /// Adds a chunk to the sums of the first pass.
    #[inline(always)]
    pub fn add_first(&self, lab: &Lab<D>, sums: &mut [f64]) {
        match self {
            Self::Binned { bins, species, follow } => {
                let own = species.iter().map(|&idx| &lab.species[idx]);
                let slopes = species.iter().flat_map(|&idx| slopes_of(lab, idx, follow));
                add_binned(bins, lab, &own.chain(slopes).collect::<Vec<_>>(), sums);
            }
            Self::Covariance { bins, pairs } => {
                let both = pairs.iter().flat_map(|&(a, b)| [&lab.unreacted[a], &lab.unreacted[b]]);
                add_binned(bins, lab, &both.collect::<Vec<_>>(), sums);
            }
            Self::Total { species, .. } => {
                for (sum, &idx) in sums.iter_mut().zip(species) {
                    *sum += lane_sum(&lab.species[idx][..lab.n]);
                }
            }
            Self::Mixing(mixing) => mixing.add(lab, sums),
            Self::Moments { species } => spread::add_first(lab, species, sums),
            Self::Within { low, high, species } => budget::add_within(lab, low, high, species, sums),
            Self::Budget(budget) => budget.add(lab, sums),
            Self::Dilution { bins, species } => {
                let own = species.iter().map(|&idx| &lab.species[idx]);
                add_binned(bins, lab, &own.collect::<Vec<_>>(), sums);
            }
            Self::Particles { .. } => {}
        }
    }

    /// Adds a chunk to the sums of the second pass.
    #[inline(always)]
    pub fn add_second(&self, lab: &Lab<D>, first: &[f64], sums: &mut [f64]) {
        match self {
            Self::Binned { bins, species, follow } => {
                add_influences(bins, lab, species, follow, first, sums);
            }
            Self::Covariance { bins, pairs } => add_products(bins, lab, pairs, first, sums),
            Self::Moments { species } => spread::add_second(lab, species, first, sums),
            _ => {}
        }
    }

    /// The values of the output from both sums; `None` for particles.
    pub fn values(&self, program: &Program<D>, first: &[f64], second: &[f64]) -> Option<Values> {
        match self {
            Self::Binned { bins, species, follow } => {
                let stride = 1 + species.len() * (1 + follow.n_components);
                Some(binned(bins.grid.n_bins(), species.len(), stride, first, second))
            }
            Self::Covariance { bins, pairs } => {
                Some(covariances(bins.grid.n_bins(), pairs.len(), first, second))
            }
            Self::Total { in_bins, .. } => {
                let volume = program.volume;
                let sums = first.iter().zip(in_bins).map(|(sum, in_bins)| in_bins.unwrap_or(*sum));
                Some(Values::Total { amount: sums.map(|sum| volume * sum).collect() })
            }
            Self::Mixing(mixing) => Some(Values::Mixing(mixing.states(first))),
            Self::Moments { species } => Some(spread::moments(program, species.len(), first, second)),
            Self::Within { .. } => Some(budget::within(first)),
            Self::Budget(budget) => Some(budget.rows(program, first)),
            Self::Dilution { bins, species } => {
                Some(spread::dilutions(program, bins.grid.n_bins(), species.len(), first))
            }
            Self::Particles { .. } => None,
        }
    }
}

/// The grid of an output's bins.
pub fn output_grid<const D: usize>(program: &Program<D>, output: &Output) -> Option<Grid<D>> {
    let bins = <[usize; D]>::try_from(&output.bins[..]).ok()?;
    program.grid.with_bins(bins)
}

/// Sum over bins of a species that is made of what lives there, as if particles carried it.
fn amount_in_bins<const D: usize>(
    program: &Program<D>,
    species: usize,
    immobile: &[Vec<f64>],
) -> Option<f64> {
    let recipe = &program.species[species];
    let first = program.n_components();
    if recipe.terms.is_empty() || recipe.terms.iter().any(|&(k, _)| k < first) {
        return None;
    }
    let n_particles = program.plan.particles.count as f64;
    let n_bins = program.grid.n_bins();
    let of_bins = |bins: &[f64]| match &program.uneven {
        None => lane_sum(bins),
        Some(_) => program.sum_of_bins(bins),
    };
    let of_term = |&(k, coefficient): &(usize, f64)| coefficient * of_bins(&immobile[k - first][..n_bins]);
    let sum: f64 = recipe.terms.iter().map(of_term).sum();
    Some(n_particles * (recipe.constant + sum / n_bins as f64))
}

pub fn species(output: &Output) -> Vec<usize> {
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

/// Slopes of a species by each component, if anything follows the means.
#[inline(always)]
fn slopes_of<'l, const D: usize>(
    lab: &'l Lab<D>,
    species: usize,
    follow: &Follow,
) -> impl Iterator<Item = &'l [f64; CHUNK]> + use<'l, D> {
    let n = follow.n_components;
    lab.slopes[species * n..][..n].iter()
}

#[inline(always)]
fn add_binned<const D: usize>(bins: &Bins<D>, lab: &Lab<D>, columns: &[&[f64; CHUNK]], sums: &mut [f64]) {
    let mut own = [0; CHUNK];
    let slots = bins.slots(lab, &mut own);
    let stride = columns.len() + 1;
    for idx in 0..slots.len() {
        let target = &mut sums[slots[idx] as usize * stride..][..stride];
        target[0] += 1.0;
        for column in 0..columns.len() {
            target[column + 1] += columns[column][idx];
        }
    }
}

/// Adds products of deviations of pairs.
#[inline(always)]
fn add_products<const D: usize>(
    bins: &Bins<D>,
    lab: &Lab<D>,
    pairs: &[(usize, usize)],
    first: &[f64],
    sums: &mut [f64],
) {
    let mut own = [0; CHUNK];
    let slots = bins.slots(lab, &mut own);
    let stride = 1 + 2 * pairs.len();
    for idx in 0..slots.len() {
        let slot = slots[idx] as usize;
        let bin = &first[slot * stride..][..stride];
        let target = &mut sums[slot * pairs.len()..][..pairs.len()];
        for pair in 0..pairs.len() {
            let (a, b) = (&lab.unreacted[pairs[pair].0], &lab.unreacted[pairs[pair].1]);
            let mean = |place: usize| bin[place] / bin[0];
            target[pair] += (a[idx] - mean(1 + 2 * pair)) * (b[idx] - mean(2 + 2 * pair));
        }
    }
}

/// Adds squares of what each particle does to the mean of its bin.
///
/// - Equation: `i = C − C̄ + (1 − f) Σ_k S̄_k (m_k − m̄_k)`.
/// - Symbols: `S̄_k` the bin's mean of `∂C/∂U_k`, `m_k` the particle's value of component `k` in the
///   simulated zones, `m̄_k` their mean, of which every particle of the bin sees the share `1 − f`.
/// - Range: bins like those of the averages or coarser; in finer ones the second part is an upper bound.
/// - Source: the influence function of a mean whose terms depend on another mean (the delta method).
/// - Shape: per slot one sum per species.
#[inline(always)]
fn add_influences<const D: usize>(
    bins: &Bins<D>,
    lab: &Lab<D>,
    species: &[usize],
    follow: &Follow,
    first: &[f64],
    sums: &mut [f64],
) {
    let mut own = [0; CHUNK];
    let slots = bins.slots(lab, &mut own);
    let n_species = species.len();
    let stride = 1 + n_species * (1 + follow.n_components);
    for idx in 0..slots.len() {
        let slot = slots[idx] as usize;
        let bin = &first[slot * stride..][..stride];
        let target = &mut sums[slot * n_species..][..n_species];
        for column in 0..n_species {
            let mut influence = lab.species[species[column]][idx] - bin[1 + column] / bin[0];
            for k in 0..follow.n_components {
                let slope = bin[1 + n_species + column * follow.n_components + k] / bin[0];
                influence += follow.share * slope * lab.gaps[k][idx];
            }
            target[column] += influence * influence;
        }
    }
}

/// Means and standard errors per bin.
///
/// - Equation: `c̄ = Σc / n`, `s = (Σi² / ((n − 1) n))^½`.
/// - Symbols: `n` particles in the bin, `i` as in [`add_influences`]; without mixing zones `c − c̄`.
/// - Range: no mean for `n = 0`, no standard error for `n < 2` (not a number).
/// - Source: the textbook estimators.
/// - Shape: a column over the bins per species.
fn binned(n_bins: usize, n_columns: usize, stride: usize, first: &[f64], second: &[f64]) -> Values {
    let count = |bin: usize| first[bin * stride];
    let mean = |bin: usize, column: usize| first[bin * stride + 1 + column] / count(bin);
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

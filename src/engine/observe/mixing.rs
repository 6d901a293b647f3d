//! The mixing measures of pairs: M, M_mean, M_cov and γ.
//!
//! Owns their sums and the correction of their sampling bias. May use the lab and the means. It
//! deliberately looks at unreacted concentrations only.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::super::average::Means;
use super::super::program::Program;
use super::super::snapshot::MixingState;
use super::lab::Lab;
use super::tally::{lane_sum, pairs};
use crate::plan::Output;
use crate::state::grid::Grid;
use crate::state::particles::CHUNK;
use std::ops::Range;

/// Particles whose products are held at once.
const PART: usize = 64;

/// Mixing of the pairs of one output, within the bins that `means` are of.
///
/// Let `m = Σ_i η_i W_i / Σ_i η_i` over the simulated zones: bin means are means of `m`, and
/// `U − ū = f (m − m̄)` with `f = Σ_i η_i`, as an instant zone is always at the mean. So one sum per
/// pair of components, of the unbiased covariance of `m`, gives both the covariance of U (times `f²`)
/// and the bias of the product of two means (`cov_m / n`, for both means are of the same particles).
pub struct Mixing<'a, const D: usize> {
    /// Bins other than those of the averages.
    grid: Option<&'a Grid<D>>,
    means: &'a Means,
    /// Per bin `n / (n − 1)` and `1 / (n − 1)`, or 0 where there is no covariance and outside.
    weights: Vec<[f64; 2]>,
    /// Pairs of components whose sums are needed.
    products: Vec<(usize, usize)>,
    recipes: Vec<Recipe>,
    volume: f64,
    carried_fraction: f64,
}

/// Size of an M_mean that is rounding alone, relative to that of uniform fluids of the same amounts.
const ROUNDING: f64 = 1e-13;

/// A pair of species as constants and coefficients of components.
struct Recipe {
    a: (f64, Vec<(usize, f64)>),
    b: (f64, Vec<(usize, f64)>),
}

impl<'a, const D: usize> Mixing<'a, D> {
    pub fn new(program: &Program<D>, output: &Output, means: &'a Means, grid: Option<&'a Grid<D>>) -> Self {
        let of = |idx: usize| (program.species[idx].constant, program.species[idx].terms.clone());
        let recipes: Vec<Recipe> =
            pairs(output).into_iter().map(|(a, b)| Recipe { a: of(a), b: of(b) }).collect();
        let mut products = Vec::new();
        for recipe in &recipes {
            for &(k, _) in &recipe.a.1 {
                for &(l, _) in &recipe.b.1 {
                    products.push((k.min(l), k.max(l)));
                }
            }
        }
        products.sort_unstable();
        products.dedup();
        let n_bins = means.counts.len() - 1;
        let weight = |&n: &f64| if n > 1.0 { [n / (n - 1.0), 1.0 / (n - 1.0)] } else { [0.0; 2] };
        let mut weights: Vec<[f64; 2]> = means.counts[..n_bins].iter().map(weight).collect();
        weights.push([0.0; 2]);
        let volume = program.volume;
        Self { grid, means, weights, products, recipes, volume, carried_fraction: program.carried_fraction }
    }

    /// Bins, and the place outside.
    pub fn n_slots(&self) -> usize {
        self.means.counts.len()
    }

    /// Two sums per pair of components: of `n cov_m` and of `cov_m`, over bins.
    pub fn n_sums(&self) -> usize {
        2 * self.products.len()
    }

    /// Adds a chunk.
    #[inline(always)]
    pub fn add(&self, lab: &Lab<D>, sums: &mut [f64]) {
        let mut own_slots = [0; CHUNK];
        let slots = match self.grid {
            Some(grid) => {
                grid.locate(lab.positions(), &mut own_slots[..lab.n]);
                &own_slots[..lab.n]
            }
            None => lab.slots(),
        };
        for (&(k, l), sums) in self.products.iter().zip(sums.as_chunks_mut::<2>().0) {
            for start in (0..lab.n).step_by(PART) {
                let range = start..(start + PART).min(lab.n);
                let mut products = [0.0; PART];
                self.multiply(k, l, slots, lab, range.clone(), &mut products);
                let [weighted, biased] = self.weigh(&products, &slots[range]);
                sums[0] += lane_sum(&weighted);
                sums[1] += lane_sum(&biased);
            }
        }
    }

    /// Products of two deviations from the bin's means. In the bins of the averages the lab has gathered
    /// these means.
    #[inline(always)]
    fn multiply(
        &self,
        k: usize,
        l: usize,
        slots: &[i32],
        lab: &Lab<D>,
        range: Range<usize>,
        products: &mut [f64; PART],
    ) {
        let n = range.len().min(PART);
        let (a, b) = (&lab.simulated[k][range.clone()][..n], &lab.simulated[l][range.clone()][..n]);
        if self.grid.is_none() {
            let (mean_a, mean_b) = (&lab.mixed[k][range.clone()][..n], &lab.mixed[l][range][..n]);
            for idx in 0..n {
                products[idx] = (a[idx] - mean_a[idx]) * (b[idx] - mean_b[idx]);
            }
            return;
        }
        let (mean_a, mean_b) = (&self.means.mixed[k], &self.means.mixed[l]);
        let slots = &slots[range][..n];
        for idx in 0..n {
            let slot = slots[idx] as usize;
            products[idx] = (a[idx] - mean_a[slot]) * (b[idx] - mean_b[slot]);
        }
    }

    /// Products times both weights of their bin.
    #[inline(always)]
    fn weigh(&self, products: &[f64; PART], slots: &[i32]) -> [[f64; PART]; 2] {
        let mut both = [[0.0; PART]; 2];
        let [weighted, biased] = &mut both;
        for idx in 0..slots.len().min(PART) {
            let [weight, bias] = self.weights[slots[idx] as usize];
            weighted[idx] = products[idx] * weight;
            biased[idx] = products[idx] * bias;
        }
        both
    }

    /// The measures of each pair.
    ///
    /// - Equation: `M_mean = Σ_b V_b (c̄_a c̄_b − cov_m/n_b)`, `M_cov = Σ_b V_b f² cov_m`,
    ///   `M = M_mean + M_cov`, `γ = M_cov / M_mean`; `V_b = n_b v`.
    /// - Symbols: `c̄` means of unreacted concentrations in bin `b`, `n_b` particles, `v` the volume of
    ///   one, `cov_m` and `f` as above.
    /// - Range: `γ` is not a number where `M_mean` is 0 but for rounding; particles outside open sides do not count.
    /// - Source: Sole-Mari et al. (2020), M and γ; methods, section 7.5. The subtraction of `cov_m/n_b`
    ///   is the sampling bias of a product of two means.
    /// - Shape: one state per pair.
    pub fn states(&self, sums: &[f64]) -> Vec<MixingState> {
        self.recipes.iter().map(|recipe| self.state(recipe, sums.as_chunks::<2>().0)).collect()
    }

    fn state(&self, recipe: &Recipe, sums: &[[f64; 2]]) -> MixingState {
        let n_bins = self.weights.len() - 1;
        let mean = |(constant, terms): &(f64, Vec<(usize, f64)>), bin: usize| {
            constant
                + terms.iter().map(|&(k, coefficient)| coefficient * self.means.mixed[k][bin]).sum::<f64>()
        };
        let products = (0..n_bins)
            .map(|bin| self.means.counts[bin] * mean(&recipe.a, bin) * mean(&recipe.b, bin))
            .collect::<Vec<_>>();
        let (mut covariance, mut bias) = (0.0, 0.0);
        for &(k, coefficient_a) in &recipe.a.1 {
            for &(l, coefficient_b) in &recipe.b.1 {
                let Ok(idx) = self.products.binary_search(&(k.min(l), k.max(l))) else { continue };
                covariance += coefficient_a * coefficient_b * sums[idx][0];
                bias += coefficient_a * coefficient_b * sums[idx][1];
            }
        }
        // Below this M_mean is the rounding of values that cancel: fluids that nothing has mixed yet.
        let amount = |side: &(f64, Vec<(usize, f64)>)| {
            (0..n_bins).map(|bin| self.means.counts[bin] * mean(side, bin).abs()).sum::<f64>()
        };
        let n_inside = lane_sum(&self.means.counts[..n_bins]);
        let rounding = ROUNDING * self.volume * amount(&recipe.a) * amount(&recipe.b) / n_inside;
        let m_cov = self.volume * self.carried_fraction * self.carried_fraction * covariance;
        let m_mean = self.volume * (lane_sum(&products) - bias);
        MixingState {
            m: m_mean + m_cov,
            m_mean,
            m_cov,
            gamma: if m_mean.abs() <= rounding { f64::NAN } else { m_cov / m_mean },
        }
    }
}

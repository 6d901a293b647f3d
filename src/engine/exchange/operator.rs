//! What all parcels exchange: weights made of kernels, and the differences that they weigh.
//!
//! Owns the passes over all parcels. May use neighbours and `parallel`. It deliberately integrates nothing.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::super::parallel::{self, Pool};
use super::around::Around;
use super::local::Metrics;
use super::near::{Crowd, LANES, MOST_TARGETS, Near, PADDING, folded};
use super::own_kernels::OnOwnKernels;
use super::table::Tabulated;
use crate::catalog::kernel::{
    CubicSpline, Epanechnikov, Gaussian, QuinticSpline, Radial, WendlandC2, WendlandC4, WendlandC6,
};
use crate::maths::wide::Width;
use crate::plan::exchange::{Exchange, Kernel, Normalisation};

/// Parcels that a thread takes at once.
const PORTION: usize = 512;

/// Sums of Sinkhorn's weights are one to this.
const UNIT: f64 = 1e-12;
const MOST_ROUNDS: usize = 200;

/// A kernel, chosen once.
#[derive(Debug, Clone)]
pub enum Profile {
    Gaussian,
    CubicSpline,
    QuinticSpline,
    WendlandC2,
    WendlandC4,
    WendlandC6,
    Epanechnikov,
    Own(Tabulated),
}

impl Profile {
    pub fn new(exchange: &Exchange) -> Option<Self> {
        Some(match &exchange.kernel {
            Kernel::Profile { value, support, .. } => Self::Own(Tabulated::new(value, *support)),
            Kernel::Catalogue(name) => match name.as_str() {
                "gaussian" => Self::Gaussian,
                "cubic_spline" => Self::CubicSpline,
                "quintic_spline" => Self::QuinticSpline,
                "wendland_c2" => Self::WendlandC2,
                "wendland_c4" => Self::WendlandC4,
                "wendland_c6" => Self::WendlandC6,
                "epanechnikov" => Self::Epanechnikov,
                _ => return None,
            },
        })
    }
}

/// What two parcels exchange by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Weights {
    /// `−W′/q`: what disperses as a kernel does.
    Forces,
    /// `W`: parts of a mean.
    Values,
}

/// Everything that the weights of one set of positions are made of.
pub struct Operator<'a, const D: usize> {
    pub crowd: Crowd<'a, D>,
    /// Where kernels differ from parcel to parcel: shares are then in the weights.
    pub metrics: Option<Metrics<'a>>,
    pub profile: &'a Profile,
    pub normalisation: Normalisation,
    pub weights: Weights,
    pub width: Width,
    pub lists: &'a Pool<Near<D>>,
    pub own_lists: &'a Pool<Around>,
    /// Densities, or the factors of a product; by parcel.
    pub factors: Vec<f64>,
    /// What keeps sums of weights below one, by parcel; empty where nothing has to.
    pub caps: Vec<f64>,
}

/// What a pass works out for a parcel.
#[derive(Clone, Copy)]
pub(super) enum Wanted<'a> {
    /// `Σ_j w_ij`
    Densities,
    /// `Σ_j w_ij u_j`
    Weighted(&'a [f64]),
    /// Per column `Σ_j w_ij (v_j − v_i)`, and the sum of weights of all others.
    Differences(&'a [Vec<f64>]),
}

impl<'a, const D: usize> Operator<'a, D> {
    /// Weights for the positions as they are.
    ///
    /// - Equation: `ρ_i = Σ_j W_ij`; `G_ij 2/(ρ_i + ρ_j)`, `G_ij/√(ρ_i ρ_j)`, or `u_i G_ij u_j` with `u_i Σ_j W_ij u_j = 1`.
    /// - Symbols: `W` kernel, `G = −W′/q`, equal to W for a Gaussian.
    /// - Range: parcels of equal volume; symmetric in all three cases, which conserves what they carry.
    /// - Source: methods, section 6.3; R. Sinkhorn, P. Knopp 1967, doi:10.2140/pjm.1967.21.343.
    /// - Shape: one factor per parcel.
    pub fn weigh(&mut self) {
        self.factors.clear();
        let mut densities = vec![0.0; self.crowd.n + PADDING];
        self.pass(Wanted::Densities, &mut [&mut densities]);
        match self.normalisation {
            Normalisation::Arithmetic => {}
            Normalisation::Geometric => densities.iter_mut().for_each(|value| *value = 1.0 / value.sqrt()),
            Normalisation::Sinkhorn => {
                densities.iter_mut().for_each(|value| *value = 1.0 / value.sqrt());
                self.balance(&mut densities);
            }
        }
        if let Some(metrics) = self.metrics.filter(|_| self.normalisation != Normalisation::Arithmetic) {
            // The geometric mean of two shares is the product of their roots.
            densities.iter_mut().zip(metrics.shares).for_each(|(factor, share)| *factor *= share.sqrt());
        }
        self.factors = densities;
    }

    /// Sinkhorn's rounds: `u_i ← √(u_i / Σ_j W_ij u_j)`.
    fn balance(&self, u: &mut [f64]) {
        let mut sums = vec![0.0; u.len()];
        for _ in 0..MOST_ROUNDS {
            self.pass(Wanted::Weighted(u), &mut [&mut sums]);
            let mut worst: f64 = 0.0;
            for (u, sum) in u.iter_mut().zip(&sums).take(self.crowd.n) {
                worst = worst.max((*u * sum - 1.0).abs());
                *u = (*u / sum).sqrt();
            }
            if worst < UNIT {
                break;
            }
        }
    }

    /// Differences of columns, and last the sums of weights of all others.
    pub fn differences(&self, columns: &[Vec<f64>], targets: &mut [Vec<f64>]) {
        let mut targets: Vec<&mut [f64]> = targets.iter_mut().map(|target| &mut target[..]).collect();
        self.pass(Wanted::Differences(columns), &mut targets);
    }

    fn pass(&self, wanted: Wanted, targets: &mut [&mut [f64]]) {
        match self.profile {
            Profile::Gaussian => self.pass_with(Gaussian, wanted, targets),
            Profile::CubicSpline => self.pass_with(CubicSpline, wanted, targets),
            Profile::QuinticSpline => self.pass_with(QuinticSpline, wanted, targets),
            Profile::WendlandC2 => self.pass_with(WendlandC2, wanted, targets),
            Profile::WendlandC4 => self.pass_with(WendlandC4, wanted, targets),
            Profile::WendlandC6 => self.pass_with(WendlandC6, wanted, targets),
            Profile::Epanechnikov => self.pass_with(Epanechnikov, wanted, targets),
            Profile::Own(table) => self.pass_with(table.radial(), wanted, targets),
        }
    }

    fn pass_with<K: Radial + Sync>(&self, kernel: K, wanted: Wanted, targets: &mut [&mut [f64]]) {
        let n = self.crowd.n;
        let mut portions: Vec<Vec<&mut [f64]>> = (0..n.div_ceil(PORTION)).map(|_| Vec::new()).collect();
        for target in targets {
            portions.iter_mut().zip(target[..n].chunks_mut(PORTION)).for_each(|(own, part)| own.push(part));
        }
        if let Some(metrics) = self.metrics {
            parallel::for_each(&mut portions, &|idx, targets| {
                self.own_lists.lend(Default::default, |around| {
                    let (operator, first) = (self, idx * PORTION);
                    let own = OnOwnKernels { operator, metrics, kernel, wanted, first, targets, around };
                    self.width.run(own);
                });
            });
            return;
        }
        parallel::for_each(&mut portions, &|idx, targets| {
            self.lists.lend(Near::new, |near| {
                let (operator, first) = (self, idx * PORTION);
                self.width.run(OnPortion { operator, kernel, wanted, first, targets, near });
            });
        });
    }
}

/// Some parcels of a pass, to be dispatched to wide or narrow code.
struct OnPortion<'a, 'b, const D: usize, K> {
    operator: &'a Operator<'b, D>,
    kernel: K,
    wanted: Wanted<'a>,
    first: usize,
    targets: &'a mut [&'b mut [f64]],
    near: &'a mut Near<D>,
}

impl<const D: usize, K: Radial> pulp::NullaryFnOnce for OnPortion<'_, '_, D, K> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let operator = self.operator;
        let n = self.targets.first().map_or(0, |target| target.len());
        let sources = operator.sources(self.wanted);
        // One after the other: the sums of each parcel of a group.
        let n_sums = self.targets.len();
        let mut lanes = vec![[0.0; LANES]; MOST_TARGETS * n_sums];
        let mut at = 0;
        while at < n {
            let first = self.first + at;
            let n_targets = self.near.gather_round(&operator.crowd, first, n - at);
            for lanes in &mut lanes[..n_targets * n_sums] {
                *lanes = [0.0; LANES];
            }
            while self.near.fill(&operator.crowd, &sources) {
                for target in 0..n_targets {
                    self.near.find(&operator.crowd, first + target);
                    self.add(first + target, &mut lanes[target * n_sums..(target + 1) * n_sums]);
                }
            }
            for target in 0..n_targets {
                for sum in 0..n_sums {
                    self.targets[sum][at + target] = folded(lanes[target * n_sums + sum]);
                }
            }
            self.leave_out_itself(first, at, n_targets);
            at += n_targets;
        }
    }
}

impl<const D: usize, K: Radial> OnPortion<'_, '_, D, K> {
    /// Adds what the candidates at hand give to the sums of a parcel.
    #[inline(always)]
    fn add(&mut self, idx: usize, lanes: &mut [[f64; LANES]]) {
        let Self { operator, kernel, wanted, ref mut near, .. } = *self;
        let square = operator.crowd.space.radius * operator.crowd.space.radius;
        match wanted {
            Wanted::Densities => {
                near.weigh(kernel, square);
                near.sum(&mut lanes[0]);
            }
            Wanted::Weighted(_) => {
                near.weigh(kernel, square);
                near.difference(0, 0.0, &mut lanes[0]);
            }
            Wanted::Differences(columns) => {
                match operator.weights {
                    Weights::Forces => near.force(kernel, square),
                    Weights::Values => near.weigh(kernel, square),
                }
                let first = operator.normalise(near, idx);
                for column in 0..columns.len() {
                    near.difference(first + column, columns[column][idx], &mut lanes[column]);
                }
                if lanes.len() > columns.len() {
                    near.sum(&mut lanes[columns.len()]);
                }
            }
        }
    }

    /// Takes each parcel's own weight out of its sum of weights.
    #[inline(always)]
    fn leave_out_itself(&mut self, first: usize, at: usize, n_targets: usize) {
        let Wanted::Differences(columns) = self.wanted else { return };
        if self.targets.len() > columns.len() {
            let force = match self.operator.weights {
                Weights::Forces => self.kernel.force(0.0),
                Weights::Values => self.kernel.value(0.0),
            };
            for target in 0..n_targets {
                let own = self.operator.own_weight(force, first + target);
                self.targets[columns.len()][at + target] -= own;
            }
        }
    }
}

impl<'a, const D: usize> Operator<'a, D> {
    /// What a pass needs of every neighbour.
    fn sources<'s>(&'s self, wanted: Wanted<'s>) -> Vec<&'s [f64]> {
        match wanted {
            Wanted::Densities => Vec::new(),
            Wanted::Weighted(factors) => vec![factors],
            Wanted::Differences(columns) => {
                let caps = (!self.caps.is_empty()).then_some(&self.caps);
                [&self.factors].into_iter().chain(caps).chain(columns).map(|own| &own[..]).collect()
            }
        }
    }

    /// Forces become weights; the source that comes next.
    #[inline(always)]
    fn normalise(&self, near: &mut Near<D>, idx: usize) -> usize {
        let own = self.factors[idx];
        match self.normalisation {
            Normalisation::Arithmetic => near.divide_by_mean(0, own),
            Normalisation::Geometric | Normalisation::Sinkhorn => near.multiply(0, own),
        }
        if self.caps.is_empty() {
            return 1;
        }
        near.limit(1, self.caps[idx]);
        2
    }

    /// The weight of a parcel for itself, with the roundings of [`Self::normalise`].
    #[inline(always)]
    fn own_weight(&self, force: f64, idx: usize) -> f64 {
        let own = self.factors[idx];
        let weight = force
            * match self.normalisation {
                Normalisation::Arithmetic => 2.0 / (own + own),
                Normalisation::Geometric | Normalisation::Sinkhorn => own * own,
            };
        if self.caps.is_empty() { weight } else { weight * self.caps[idx] }
    }
}

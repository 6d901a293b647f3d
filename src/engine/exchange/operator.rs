//! What all parcels exchange: weights made of kernels, and the differences that they weigh.
//!
//! Owns the passes over all parcels. May use neighbours and `parallel`. It deliberately integrates nothing.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::super::parallel::{self, Pool};
use super::local::Metrics;
use super::near::{Crowd, Near, PADDING};
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

/// Everything that the weights of one set of positions are made of.
pub struct Operator<'a, const D: usize> {
    pub crowd: Crowd<'a, D>,
    /// Where kernels differ from parcel to parcel: shares are then in the weights.
    pub metrics: Option<Metrics<'a>>,
    pub profile: &'a Profile,
    pub normalisation: Normalisation,
    pub width: Width,
    pub lists: &'a Pool<Near>,
    /// Densities, or the factors of a product; by parcel.
    pub factors: Vec<f64>,
    /// What keeps sums of weights below one, by parcel; empty where nothing has to.
    pub caps: Vec<f64>,
}

/// What a pass works out for a parcel.
#[derive(Clone, Copy)]
enum Wanted<'a> {
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
    pub fn new(
        (crowd, metrics): (Crowd<'a, D>, Option<Metrics<'a>>),
        profile: &'a Profile,
        normalisation: Normalisation,
        width: Width,
        lists: &'a Pool<Near>,
    ) -> Self {
        let mut own = Self {
            crowd,
            metrics,
            profile,
            normalisation,
            width,
            lists,
            factors: Vec::new(),
            caps: Vec::new(),
        };
        let mut densities = vec![0.0; crowd.n + PADDING];
        own.pass(Wanted::Densities, &mut [&mut densities]);
        match normalisation {
            Normalisation::Arithmetic => {}
            Normalisation::Geometric => densities.iter_mut().for_each(|value| *value = 1.0 / value.sqrt()),
            Normalisation::Sinkhorn => {
                densities.iter_mut().for_each(|value| *value = 1.0 / value.sqrt());
                own.balance(&mut densities);
            }
        }
        if let Some(metrics) = metrics.filter(|_| normalisation != Normalisation::Arithmetic) {
            // The geometric mean of two shares is the product of their roots.
            densities.iter_mut().zip(metrics.shares).for_each(|(factor, share)| *factor *= share.sqrt());
        }
        own.factors = densities;
        own
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
        parallel::for_each(&mut portions, &|idx, targets| {
            self.lists.lend(
                || Box::new(Near::default()),
                |near| {
                    let (operator, first) = (self, idx * PORTION);
                    self.width.run(OnPortion { operator, kernel, wanted, first, targets, near });
                },
            );
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
    near: &'a mut Near,
}

impl<const D: usize, K: Radial> pulp::NullaryFnOnce for OnPortion<'_, '_, D, K> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { operator, kernel, wanted, first, targets, near } = self;
        let n = targets.first().map_or(0, |target| target.len());
        let square = operator.crowd.space.radius * operator.crowd.space.radius;
        for at in 0..n {
            let idx = first + at;
            match &operator.metrics {
                None => near.find(&operator.crowd, idx),
                Some(metrics) => near.find_within(&operator.crowd, metrics, idx),
            }
            match wanted {
                Wanted::Densities => {
                    near.weigh(kernel, square);
                    targets[0][at] = near.sum();
                }
                Wanted::Weighted(factors) => {
                    near.weigh(kernel, square);
                    targets[0][at] = near.sum_of(factors);
                }
                Wanted::Differences(columns) => {
                    near.force(kernel, square);
                    operator.normalise(near, idx);
                    for column in 0..columns.len() {
                        let values = &columns[column];
                        targets[column][at] = near.difference(values, values[idx]);
                    }
                    if targets.len() > columns.len() {
                        targets[columns.len()][at] = near.sum_of_others();
                    }
                }
            }
        }
    }
}

impl<const D: usize> Operator<'_, D> {
    #[inline(always)]
    fn normalise(&self, near: &mut Near, idx: usize) {
        let own = self.factors[idx];
        match (self.normalisation, &self.metrics) {
            (Normalisation::Arithmetic, None) => near.divide_by_mean(&self.factors, own),
            (Normalisation::Arithmetic, Some(metrics)) => {
                near.share_by_mean(&self.factors, own, metrics.shares, metrics.shares[idx]);
            }
            (Normalisation::Geometric | Normalisation::Sinkhorn, _) => near.multiply(&self.factors, own),
        }
        if !self.caps.is_empty() {
            near.limit(&self.caps, self.caps[idx]);
        }
    }
}

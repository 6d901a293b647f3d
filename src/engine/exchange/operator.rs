//! What all parcels exchange: weights made of kernels, and the differences that they weigh.
//!
//! Owns the passes over all parcels. May use neighbours and `parallel`. It deliberately integrates nothing.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::super::parallel::{self, Pool};
use super::around::Around;
use super::bands::Recalling;
use super::local::Metrics;
use super::near::{Crowd, LANES, MOST_TARGETS, Near, PADDING, Sources, folded};
use super::notes::{Noted, Notes};
use super::own_kernels::OnOwnKernels;
use super::table::Tabulated;
use crate::catalog::kernel::Radial;
use crate::maths::wide::Width;
use crate::plan::exchange::{Exchange, Kernel, Normalisation};

/// Parcels that a thread takes at once.
pub(super) const PORTION: usize = 512;

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

/// Work with a kernel that is known when it is compiled.
macro_rules! with_kernel {
    ($profile:expr, $kernel:ident => $work:expr) => {{
        use $crate::catalog::kernel;
        use $crate::engine::exchange::operator::Profile;
        match $profile {
            Profile::Gaussian => with_kernel!(@ kernel::Gaussian, $kernel => $work),
            Profile::CubicSpline => with_kernel!(@ kernel::CubicSpline, $kernel => $work),
            Profile::QuinticSpline => with_kernel!(@ kernel::QuinticSpline, $kernel => $work),
            Profile::WendlandC2 => with_kernel!(@ kernel::WendlandC2, $kernel => $work),
            Profile::WendlandC4 => with_kernel!(@ kernel::WendlandC4, $kernel => $work),
            Profile::WendlandC6 => with_kernel!(@ kernel::WendlandC6, $kernel => $work),
            Profile::Epanechnikov => with_kernel!(@ kernel::Epanechnikov, $kernel => $work),
            Profile::Own(table) => with_kernel!(@ table.radial(), $kernel => $work),
        }
    }};
    (@ $own:expr, $kernel:ident => $work:expr) => {{
        let $kernel = $own;
        $work
    }};
}
pub(super) use with_kernel;

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
    /// Densities, or the factors of a product; by parcel, from one on.
    pub factors: Vec<f64>,
    pub start: usize,
    /// What is known of pairs.
    pub notes: Notes,
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
        if self.notes.are_taken() && self.metrics.is_none() {
            let is_balanced = self.normalisation == Normalisation::Sinkhorn;
            self.note(if is_balanced { Noted::Values } else { self.noted() }, &mut densities, true);
        } else {
            self.pass(Wanted::Densities, &mut [&mut densities]);
        }
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
        with_kernel!(self.profile, kernel => self.pass_with(kernel, wanted, targets));
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
        let is_noted =
            self.notes.serve(kernel, self.is_by_forces() && matches!(wanted, Wanted::Differences(_)));
        parallel::for_each(&mut portions, &|idx, targets| {
            self.lists.lend(Near::new, |near| {
                let (operator, first) = (self, idx * PORTION);
                if let Some(note) = self.notes.whole(idx).filter(|_| is_noted) {
                    let own_force = self.own_force(kernel);
                    return self.width.run(Recalling {
                        operator,
                        wanted,
                        first,
                        targets,
                        near,
                        note,
                        own_force,
                    });
                }
                self.width.run(OnPortion { operator, kernel, wanted, first, targets, near });
            });
        });
    }
}

/// Some parcels of a pass, to be dispatched to wide or narrow code.
pub(super) struct OnPortion<'a, 'b, 'c, const D: usize, K> {
    pub operator: &'a Operator<'b, D>,
    pub kernel: K,
    pub wanted: Wanted<'a>,
    pub first: usize,
    pub targets: &'a mut [&'c mut [f64]],
    pub near: &'a mut Near<D>,
}

impl<const D: usize, K: Radial> pulp::NullaryFnOnce for OnPortion<'_, '_, '_, D, K> {
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
            let own_force = operator.own_force(self.kernel);
            operator.leave_out_itself((self.wanted, own_force), self.targets, (first, at, n_targets));
            at += n_targets;
        }
    }
}

impl<const D: usize, K: Radial> OnPortion<'_, '_, '_, D, K> {
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
                operator.differ(near, columns, idx, lanes);
            }
        }
    }
}

impl<'a, const D: usize> Operator<'a, D> {
    /// Adds differences, by forces that are at hand.
    #[inline(always)]
    pub(super) fn differ(
        &self,
        near: &mut Near<D>,
        columns: &[Vec<f64>],
        idx: usize,
        lanes: &mut [[f64; LANES]],
    ) {
        let first = self.normalise(near, idx);
        for column in 0..columns.len() {
            near.difference(first + column, columns[column][idx], &mut lanes[column]);
        }
        if lanes.len() > columns.len() {
            near.sum(&mut lanes[columns.len()]);
        }
    }

    /// Takes each parcel's own weight out of its sum of weights.
    #[inline(always)]
    pub(super) fn leave_out_itself(
        &self,
        (wanted, own_force): (Wanted, f64),
        targets: &mut [&mut [f64]],
        (first, at, n_targets): (usize, usize, usize),
    ) {
        let Wanted::Differences(columns) = wanted else { return };
        if targets.len() > columns.len() {
            for target in 0..n_targets {
                targets[columns.len()][at + target] -= self.own_weight(own_force, first + target);
            }
        }
    }

    pub(super) fn is_by_forces(&self) -> bool {
        self.weights == Weights::Forces
    }

    /// What notes have to be for differences.
    pub(super) fn noted(&self) -> Noted {
        match self.weights {
            Weights::Forces => Noted::Forces,
            Weights::Values => Noted::Values,
        }
    }

    /// What a parcel exchanges with itself by.
    #[inline(always)]
    pub(super) fn own_force<K: Radial>(&self, kernel: K) -> f64 {
        match self.weights {
            Weights::Forces => kernel.force(0.0),
            Weights::Values => kernel.value(0.0),
        }
    }

    /// What a pass needs of every neighbour.
    pub(super) fn sources<'s>(&'s self, wanted: Wanted<'s>) -> Sources<'s> {
        let start = self.start;
        let of = match wanted {
            Wanted::Densities => Vec::new(),
            Wanted::Weighted(factors) => vec![factors],
            Wanted::Differences(columns) => {
                let caps = (!self.caps.is_empty()).then_some(&self.caps);
                let others = caps.into_iter().chain(columns).map(|own| &own[start..]);
                [&self.factors[..]].into_iter().chain(others).collect()
            }
        };
        Sources { start, of }
    }

    /// Forces become weights; the source that comes next.
    #[inline(always)]
    fn normalise(&self, near: &mut Near<D>, idx: usize) -> usize {
        let own = self.factors[idx - self.start];
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
        let own = self.factors[idx - self.start];
        let weight = force
            * match self.normalisation {
                Normalisation::Arithmetic => 2.0 / (own + own),
                Normalisation::Geometric | Normalisation::Sinkhorn => own * own,
            };
        if self.caps.is_empty() { weight } else { weight * self.caps[idx] }
    }
}

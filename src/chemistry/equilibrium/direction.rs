//! The Newton step of many particles from the balances at a point, and the solves that it takes.
//!
//! Owns the factors of the Hessian and the borders that minerals and ionic strength add to it. May use the
//! compiled system and the point. It deliberately does not decide how far to go.

use super::lanes::{Columns, factor, ln_of, solve};
use super::point::Point;
use super::system::System;

/// Pivots of at least this part of the diagonal: logarithmic residuals give a direction.
const WELL_CONDITIONED: f64 = 0.5;

/// How each lane wants its step.
#[derive(Debug, Clone)]
pub(super) struct Wish<const L: usize> {
    /// Residuals as logarithms: straight across orders of magnitude where Newton's step takes one e-fold.
    pub is_far: [bool; L],
    /// Activities change with the step.
    pub is_coupled: [bool; L],
    /// Penalty of each saturation index, mol/m³: decides which minerals are active.
    pub penalty: Columns<L>,
    /// No mineral is active.
    pub is_hot: [bool; L],
    /// Minerals bind softly, which can be done for dependent ones, too.
    pub is_soft: [bool; L],
}

impl<const L: usize> Wish<L> {
    pub fn new(system: &System) -> Self {
        Self {
            is_far: [false; L],
            is_coupled: [false; L],
            penalty: vec![[1.0; L]; system.n_minerals],
            is_hot: [false; L],
            is_soft: [false; L],
        }
    }
}

/// A step, and the factors it came from.
#[derive(Debug, Clone)]
pub(super) struct Direction<const L: usize> {
    /// Change of ξ, of the amounts of minerals, of the ionic strength.
    pub xi: Columns<L>,
    pub amount: Columns<L>,
    pub ionic: [f64; L],
    /// How many e-folds the terms that dominate are too large, where logarithms do not help.
    pub stretch: [f64; L],
    /// Minerals bind softly: as wished, or since they depend on each other.
    pub is_soft: [bool; L],
    /// Least part of a pivot of its diagonal entry.
    pub least_part: [f64; L],
    /// Which minerals are held at saturation.
    pub active: Vec<[bool; L]>,
    factors: Columns<L>,
    /// `H⁻¹ ν_k` of each mineral, and their Schur complement as it is and factored.
    over_minerals: Columns<L>,
    schur: Columns<L>,
    schur_factors: Columns<L>,
    /// What a change of the ionic strength does to ξ and amounts, and what they do to it.
    answer_xi: Columns<L>,
    answer_amount: Columns<L>,
    ionic_slope: Columns<L>,
    ionic_pivot: [f64; L],
}

impl<const L: usize> Direction<L> {
    pub fn new(system: &System) -> Self {
        let (n, k) = (system.n_primaries, system.n_minerals);
        let columns = |count: usize| vec![[0.0; L]; count];
        Self {
            xi: columns(n),
            amount: columns(k),
            ionic: [0.0; L],
            stretch: [1.0; L],
            is_soft: [false; L],
            least_part: [1.0; L],
            active: vec![[false; L]; k],
            factors: columns(n * (n + 1) / 2),
            over_minerals: columns(n * k),
            schur: columns(k * (k + 1) / 2),
            schur_factors: columns(k * (k + 1) / 2),
            answer_xi: columns(n),
            answer_amount: columns(k),
            ionic_slope: columns(n),
            ionic_pivot: [-1.0; L],
        }
    }

    /// The step of every lane.
    ///
    /// Equation: `H δ + Vᵀ Δm + b δI = −F`, `V δ + D δI = −s`, `g·δ + (g_I − 1) δI = I − I(c)`.
    /// Symbols: V coefficients of active minerals, s their saturation indices, b and D slopes with I, g slopes
    /// of the ionic strength of the concentrations.
    /// Dimensions and range: δ without dimension, Δm in mol/m³, δI in mol/L.
    /// Source: methods 8.3 and 8.4; bordering: Golub & Van Loan 2013, Matrix Computations, §4.3.
    /// Shape: one factorisation of H; one more solve for each mineral, and one for the ionic strength.
    #[inline(always)]
    pub fn find(&mut self, system: &System, point: &Point<L>, wish: &Wish<L>) {
        self.prepare(system, point, wish);
        self.right_side(system, point, wish);
        let first = system.n_primaries + system.n_secondaries;
        for (k, row) in system.minerals().iter().enumerate() {
            let mut lost = [0.0; L];
            for lane in 0..L {
                // An inactive mineral loses all it has, and the balances what it has in them.
                lost[lane] = if self.active[k][lane] { 0.0 } else { point.amount[k][lane] };
                self.amount[k][lane] = -point.values[first + k][lane];
            }
            for entry in &row.entries {
                for lane in 0..L {
                    self.xi[entry.primary][lane] += entry.nu * lost[lane];
                }
            }
        }
        for lane in 0..L {
            self.ionic[lane] = point.ionic[lane] - point.ionic_out[lane];
        }
        self.resolve(system, wish);
        for (k, amount) in self.amount.iter_mut().enumerate() {
            for lane in 0..L {
                let lost = -point.amount[k][lane];
                amount[lane] = if self.active[k][lane] { amount[lane] } else { lost };
            }
        }
    }

    /// Factors and borders at a point.
    #[inline(always)]
    pub fn prepare(&mut self, system: &System, point: &Point<L>, wish: &Wish<L>) {
        self.least_part = factor(system.n_primaries, &point.hessian, &mut self.factors);
        if system.n_minerals > 0 {
            self.prepare_minerals(system, point, wish);
        }
        if wish.is_coupled.contains(&true) {
            self.prepare_ionic(system, point);
        }
    }

    /// From the right sides that stand in `xi`, `amount` and `ionic` to the answers, in place.
    #[inline(always)]
    pub fn resolve(&mut self, system: &System, wish: &Wish<L>) {
        let Self { xi, amount, .. } = self;
        let borders = (&self.factors[..], &self.active[..], &self.over_minerals[..], &self.schur_factors[..]);
        bordered(system, borders, xi, amount);
        if !wish.is_coupled.contains(&true) {
            self.ionic = [0.0; L];
            return;
        }
        let mut right = self.ionic;
        for (slope, xi) in self.ionic_slope.iter().zip(&*xi) {
            for lane in 0..L {
                right[lane] -= slope[lane] * xi[lane];
            }
        }
        for lane in 0..L {
            let change = right[lane] / self.ionic_pivot[lane];
            self.ionic[lane] = if wish.is_coupled[lane] { change } else { 0.0 };
        }
        let answers = self.answer_xi.iter().chain(&self.answer_amount);
        for (value, answer) in xi.iter_mut().chain(amount).zip(answers) {
            for lane in 0..L {
                let less = answer[lane] * self.ionic[lane];
                value[lane] -= if wish.is_coupled[lane] { less } else { 0.0 };
            }
        }
    }

    /// `−F`, or `−w ln(P/R)` far away: P is what makes F positive and R what makes it negative, and w turns
    /// the diagonal of H into that of `ln P − ln R`. Where one term dominates several balances, H has nearly
    /// its rank, which `−F` fits and logarithms do not: there Newton's step, one e-fold, is stretched.
    #[inline(always)]
    fn right_side(&mut self, system: &System, point: &Point<L>, wish: &Wish<L>) {
        for (xi, residual) in self.xi.iter_mut().zip(&point.residual) {
            for lane in 0..L {
                xi[lane] = -residual[lane];
            }
        }
        self.stretch = [1.0; L];
        if wish.is_far.contains(&true) {
            self.logarithmic_side(system, point, wish);
        }
    }

    #[inline(always)]
    fn logarithmic_side(&mut self, system: &System, point: &Point<L>, wish: &Wish<L>) {
        const LEAST: f64 = 1e-290;
        let n = system.n_primaries;
        let mut hottest = [0.0; L];
        let mut folds = [f64::MAX; L];
        for size in &point.size {
            for lane in 0..L {
                hottest[lane] = if size[lane] > hottest[lane] { size[lane] } else { hottest[lane] };
            }
        }
        for j in 0..n {
            let mut balance = point.values[j];
            for (row, c) in system.secondaries().iter().zip(&point.values[n..]) {
                for entry in row.entries.iter().filter(|entry| entry.primary == j) {
                    for lane in 0..L {
                        balance[lane] += entry.nu * entry.nu.abs() * c[lane];
                    }
                }
            }
            let diagonal = &point.hessian[j * (j + 1) / 2 + j];
            for lane in 0..L {
                let made = 0.5 * (point.size[j][lane] + point.residual[j][lane]);
                let used = 0.5 * (point.size[j][lane] - point.residual[j][lane]);
                let made = if made > LEAST { made } else { LEAST };
                let used = if used > LEAST { used } else { LEAST };
                let rising = 0.5 * (diagonal[lane] + balance[lane]);
                let falling = 0.5 * (diagonal[lane] - balance[lane]);
                let slope = rising / made + falling / used + 1e-3;
                let ratio = ln_of(made / used);
                let straight = -diagonal[lane] / slope * ratio;
                let is_straight = wish.is_far[lane] && self.least_part[lane] > WELL_CONDITIONED;
                self.xi[j][lane] = if is_straight { straight } else { self.xi[j][lane] };
                let is_hot = point.size[j][lane] > 0.01 * hottest[lane] && ratio.abs() < folds[lane];
                folds[lane] = if is_hot { ratio.abs() } else { folds[lane] };
            }
        }
        for lane in 0..L {
            let is_stretched = wish.is_far[lane] && self.least_part[lane] <= WELL_CONDITIONED;
            self.stretch[lane] = if is_stretched && folds[lane] > 1.0 { folds[lane] } else { 1.0 };
        }
    }

    #[inline(always)]
    fn prepare_minerals(&mut self, system: &System, point: &Point<L>, wish: &Wish<L>) {
        let (n, first) = (system.n_primaries, system.n_primaries + system.n_secondaries);
        for (k, row) in system.minerals().iter().enumerate() {
            let index = &point.values[first + k];
            for lane in 0..L {
                let pull = point.amount[k][lane] + wish.penalty[k][lane] * index[lane];
                self.active[k][lane] = pull > 0.0 && !wish.is_hot[lane];
            }
            let over = &mut self.over_minerals[k * n..(k + 1) * n];
            over.fill([0.0; L]);
            for entry in &row.entries {
                over[entry.primary] = [entry.nu; L];
            }
            solve(n, &self.factors, over);
        }
        for k in 0..system.n_minerals {
            for (l, row) in system.minerals()[..=k].iter().enumerate() {
                let mut sum = [0.0; L];
                for entry in &row.entries {
                    let over = &self.over_minerals[k * n + entry.primary];
                    for lane in 0..L {
                        sum[lane] += entry.nu * over[lane];
                    }
                }
                let other = if k == l { 1.0 } else { 0.0 };
                for lane in 0..L {
                    let both = self.active[k][lane] & self.active[l][lane];
                    self.schur[k * (k + 1) / 2 + l][lane] = if both { sum[lane] } else { other };
                }
            }
        }
        let least_part = factor(system.n_minerals, &self.schur, &mut self.schur_factors);
        for lane in 0..L {
            // Minerals that depend on each other leave no other way.
            self.is_soft[lane] = wish.is_soft[lane] || least_part[lane] < 1e-10;
        }
        if self.is_soft.contains(&true) {
            for k in 0..system.n_minerals {
                for lane in 0..L {
                    let is_soft = self.is_soft[lane] & self.active[k][lane];
                    let soft = if is_soft { 1.0 / wish.penalty[k][lane] } else { 0.0 };
                    self.schur[k * (k + 1) / 2 + k][lane] += soft;
                }
            }
            factor(system.n_minerals, &self.schur, &mut self.schur_factors);
        }
    }

    #[inline(always)]
    fn prepare_ionic(&mut self, system: &System, point: &Point<L>) {
        let n = system.n_primaries;
        self.answer_xi.fill([0.0; L]);
        self.ionic_pivot = [-1.0; L];
        for j in 0..n {
            for lane in 0..L {
                self.ionic_slope[j][lane] = system.ionic[j] * point.values[j][lane];
            }
        }
        for (i, row) in system.secondaries().iter().enumerate() {
            let (c, slope, weight) = (&point.values[n + i], &point.slopes[i], system.ionic[n + i]);
            for lane in 0..L {
                self.ionic_pivot[lane] += weight * c[lane] * slope[lane];
            }
            for entry in &row.entries {
                let (answer, own) =
                    (&mut self.answer_xi[entry.primary], &mut self.ionic_slope[entry.primary]);
                for lane in 0..L {
                    answer[lane] += entry.nu * c[lane] * slope[lane];
                    own[lane] += entry.nu * weight * c[lane];
                }
            }
        }
        for (answer, slope) in self.answer_amount.iter_mut().zip(&point.slopes[system.n_secondaries..]) {
            *answer = *slope;
        }
        let borders = (&self.factors[..], &self.active[..], &self.over_minerals[..], &self.schur_factors[..]);
        bordered(system, borders, &mut self.answer_xi, &mut self.answer_amount);
        for (slope, answer) in self.ionic_slope.iter().zip(&self.answer_xi) {
            for lane in 0..L {
                self.ionic_pivot[lane] -= slope[lane] * answer[lane];
            }
        }
    }
}

/// Factors of H, active minerals, `H⁻¹ν_k`, factors of their Schur complement.
type Borders<'a, const L: usize> = (&'a [[f64; L]], &'a [[bool; L]], &'a [[f64; L]], &'a [[f64; L]]);

/// `H x + Vᵀ a = r`, `V x = q` for active minerals, `a = 0` for others, in place of r and q.
#[inline(always)]
fn bordered<const L: usize>(
    system: &System,
    borders: Borders<'_, L>,
    x: &mut [[f64; L]],
    a: &mut [[f64; L]],
) {
    let (factors, active, over_minerals, schur) = borders;
    let n = system.n_primaries;
    solve(n, factors, x);
    if a.is_empty() {
        return;
    }
    for (k, row) in system.minerals().iter().enumerate() {
        let mut right = [0.0; L];
        for entry in &row.entries {
            for lane in 0..L {
                right[lane] += entry.nu * x[entry.primary][lane];
            }
        }
        for lane in 0..L {
            let right = right[lane] - a[k][lane];
            a[k][lane] = if active[k][lane] { right } else { 0.0 };
        }
    }
    solve(a.len(), schur, a);
    for (k, amount) in a.iter().enumerate() {
        for (x, over) in x.iter_mut().zip(&over_minerals[k * n..(k + 1) * n]) {
            for lane in 0..L {
                x[lane] -= over[lane] * amount[lane];
            }
        }
    }
}

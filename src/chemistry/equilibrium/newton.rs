//! Damped Newton iteration for many particles, each at its own pace.
//!
//! Owns how far a step goes, and when a particle is done. May use the rest of the equilibrium. It
//! deliberately has no particles: lanes are filled and emptied by the caller, and no lane looks at another.

use super::activity::{MAX_IONIC_STRENGTH, MIN_IONIC_STRENGTH};
use super::direction::{Direction, Wish};
use super::lanes::Columns;
use super::point::Point;
use super::system::System;

/// No component of a step in ln c is longer.
const MAX_STEP: f64 = 10.0;
/// Balances that agree to this part of their terms are as good as numbers are.
const EXACT: f64 = 1e-15;
/// Balances are solved.
const SOLVED: f64 = 1e-12;
/// Saturation indices and, relatively, ionic strengths are solved.
const SOLVED_LN: f64 = 1e-11;
/// A step of less than this leaves less than its square: 1e-14.
const LAST_STEP: f64 = 1e-7;
/// ... if the linear system was solved well: least part of a pivot of its diagonal entry.
const SOUND: f64 = 1e-8;
/// Steps beyond `SOLVED` that may still improve what is ill-conditioned.
const GRACE: u8 = 4;
/// Defects above this are those of another order of magnitude.
const FAR: f64 = 0.1;

/// Terms so many times larger than all totals are those of no solution near.
const HOT: f64 = 100.0;

/// How a lane fares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    Going,
    Done,
    Failed,
}

/// What is asked of the iteration.
#[derive(Debug, Clone, Copy)]
pub(super) struct Settings {
    pub max_evaluations: u32,
    /// Newton's step only, for which convergence is proved.
    pub is_plain: bool,
    /// Activity coefficients stay those of the ionic strength at the start.
    pub is_frozen: bool,
    /// Penalty of saturation indices, in scarcest totals.
    pub stiffness: f64,
}

/// What one lane remembers from step to step.
#[derive(Debug, Clone, Copy)]
struct Lane {
    is_idle: bool,
    /// Whatever holds at the next point is accepted.
    is_fresh: bool,
    evaluations: u32,
    /// Part of the step that was gone.
    part: f64,
    /// Merit and its slope along the step, at its start.
    merit: f64,
    slope: f64,
    defect: f64,
    grace: u8,
    /// Largest total.
    largest: f64,
    /// Largest sum of the terms of a balance.
    hottest: f64,
    /// Steps to go before logarithmic residuals are tried again.
    plain_left: u32,
}

const IDLE: Lane = Lane {
    is_idle: true,
    is_fresh: true,
    evaluations: 0,
    part: 1.0,
    merit: 0.0,
    slope: 0.0,
    defect: f64::MAX,
    grace: 0,
    largest: 1.0,
    hottest: 1.0,
    plain_left: 0,
};

#[derive(Debug, Clone)]
pub(super) struct Newton<const L: usize> {
    pub point: Point<L>,
    pub direction: Direction<L>,
    pub wish: Wish<L>,
    pub settings: Settings,
    lanes: [Lane; L],
    /// Where the step began, and the step.
    old_xi: Columns<L>,
    old_amount: Columns<L>,
    step_xi: Columns<L>,
    step_amount: Columns<L>,
}

impl<const L: usize> Newton<L> {
    pub fn new(system: &System, settings: Settings) -> Self {
        let columns = |count: usize| vec![[0.0; L]; count];
        Self {
            point: Point::new(system),
            direction: Direction::new(system),
            wish: Wish::new(system),
            settings,
            lanes: [IDLE; L],
            old_xi: columns(system.n_primaries),
            old_amount: columns(system.n_minerals),
            step_xi: columns(system.n_primaries),
            step_amount: columns(system.n_minerals),
        }
    }

    /// Begins anew in a lane, whose totals, ξ, amounts and ionic strength stand in the point.
    #[inline(always)]
    pub fn start(&mut self, system: &System, lane: usize) {
        let mut largest: f64 = 1e-30;
        for total in &self.point.total {
            largest = largest.max(total[lane].abs());
        }
        for (row, penalty) in system.minerals().iter().zip(&mut self.wish.penalty) {
            // As much as can be there: the scarcest of what it is made of.
            let mut scarcest = largest;
            for entry in row.entries.iter().filter(|entry| entry.nu > 0.0) {
                let total = self.point.total[entry.primary][lane].abs();
                scarcest = if total > 0.0 { scarcest.min(total) } else { scarcest };
            }
            penalty[lane] = self.settings.stiffness * scarcest;
        }
        let plain_left = if self.settings.is_plain { u32::MAX } else { 0 };
        self.lanes[lane] = Lane { is_idle: false, plain_left, largest, ..IDLE };
        self.wish.is_hot[lane] = false;
    }

    /// What would precipitate says nothing as long as some balance is far from solved and has terms far beyond
    /// all totals.
    #[inline(always)]
    fn weigh(&mut self, lane: usize) {
        let mut hottest: f64 = 0.0;
        for size in &self.point.size {
            hottest = hottest.max(size[lane]);
        }
        let is_far = self.point.defect[lane] > FAR;
        self.wish.is_hot[lane] = is_far && hottest > HOT * self.lanes[lane].largest;
        self.lanes[lane].hottest = hottest;
    }

    #[inline(always)]
    pub fn stop(&mut self, lane: usize) {
        self.lanes[lane].is_idle = true;
    }

    /// One evaluation of all lanes, and the next step of those that go on.
    #[inline(always)]
    pub fn advance(&mut self, system: &System) -> [Outcome; L] {
        self.point.evaluate(system);
        let mut outcomes = [Outcome::Going; L];
        let mut steps = [false; L];
        for lane in 0..L {
            if self.lanes[lane].is_idle {
                continue;
            }
            match self.judge(system, lane) {
                Verdict::Step => steps[lane] = true,
                Verdict::Again => {}
                Verdict::Done => outcomes[lane] = Outcome::Done,
                Verdict::Failed => outcomes[lane] = Outcome::Failed,
            }
        }
        if steps.contains(&true) {
            for lane in (0..L).filter(|&lane| steps[lane]) {
                self.wish(system, lane);
            }
            self.direction.find(system, &self.point, &self.wish);
            let largest = self.largest();
            for lane in 0..L {
                if steps[lane] && self.is_last(system, lane, largest[lane]) {
                    self.finish(system, lane);
                    outcomes[lane] = Outcome::Done;
                } else if steps[lane] {
                    self.go(system, lane, largest[lane]);
                }
            }
        }
        outcomes
    }

    /// Accepts the point of a lane, or not.
    #[inline(always)]
    fn judge(&mut self, system: &System, lane: usize) -> Verdict {
        let mut now = self.lanes[lane];
        now.evaluations += 1;
        let defect = self.point.defect[lane];
        let merit = self.merit(system, lane);
        let is_coupled = self.wish.is_coupled[lane] && !now.is_fresh;
        let slack = 1e-13 * self.point.magnitude[lane];
        let is_less = merit <= now.merit + 1e-4 * now.part * now.slope + slack || defect <= 0.5 * now.defect;
        let is_accepted = merit.is_finite() && (now.is_fresh || is_coupled || is_less);
        let verdict = if is_accepted {
            let is_exact = defect <= SOLVED && self.is_rest_solved(system, lane);
            now.grace += u8::from(is_exact);
            now.plain_left = now.plain_left.saturating_sub(u32::from(!self.settings.is_plain));
            if is_exact && (defect <= EXACT || now.grace > GRACE) {
                Verdict::Done
            } else if now.evaluations >= self.settings.max_evaluations {
                Verdict::Failed
            } else {
                Verdict::Step
            }
        } else if now.evaluations >= self.settings.max_evaluations || now.part < 1e-12 {
            Verdict::Failed
        } else {
            self.shorten(&mut now, lane);
            Verdict::Again
        };
        now.defect = if is_accepted { defect } else { now.defect };
        self.lanes[lane] = now;
        verdict
    }

    /// Half the step, or back to where it began to take another.
    #[inline(always)]
    fn shorten(&mut self, now: &mut Lane, lane: usize) {
        let was_far = self.wish.is_far[lane];
        now.part *= 0.5;
        let mut part = now.part;
        if was_far && now.part < 0.2 {
            now.plain_left = 4;
            now.is_fresh = true;
            part = 0.0;
        }
        for j in 0..self.old_xi.len() {
            self.point.xi[j][lane] = self.old_xi[j][lane] + part * self.step_xi[j][lane];
        }
        for k in 0..self.old_amount.len() {
            self.point.amount[k][lane] = self.old_amount[k][lane] + part * self.step_amount[k][lane];
        }
    }

    /// The function that steps make smaller: Φ, and the saturation of minerals as an augmented Lagrangian.
    #[inline(always)]
    fn merit(&self, system: &System, lane: usize) -> f64 {
        let first = system.n_primaries + system.n_secondaries;
        let mut merit = self.point.potential[lane];
        for k in 0..system.n_minerals {
            let penalty = self.wish.penalty[k][lane];
            let pull = self.old_or_own_amount(lane, k) + penalty * self.point.values[first + k][lane];
            let counts = pull > 0.0 && !self.wish.is_hot[lane];
            merit += if counts { pull * pull / (2.0 * penalty) } else { 0.0 };
        }
        merit
    }

    /// A step is judged with the amounts of its start.
    #[inline(always)]
    fn old_or_own_amount(&self, lane: usize, k: usize) -> f64 {
        if self.lanes[lane].is_fresh { self.point.amount[k][lane] } else { self.old_amount[k][lane] }
    }

    /// Saturation, its complementarity, and the ionic strength.
    #[inline(always)]
    fn is_rest_solved(&self, system: &System, lane: usize) -> bool {
        let first = system.n_primaries + system.n_secondaries;
        let mut is_solved = true;
        for k in 0..system.n_minerals {
            let (index, amount) = (self.point.values[first + k][lane], self.point.amount[k][lane]);
            is_solved &= amount >= 0.0 && index <= SOLVED_LN && (amount == 0.0 || index >= -SOLVED_LN);
        }
        if !system.is_ideal() && !self.settings.is_frozen {
            let (own, out) = (self.point.ionic[lane], self.point.ionic_out[lane]);
            is_solved &= (out - own).abs() <= SOLVED_LN * own + 2.0 * MIN_IONIC_STRENGTH;
        }
        is_solved
    }

    #[inline(always)]
    fn wish(&mut self, system: &System, lane: usize) {
        let defect = self.point.defect[lane];
        self.wish.is_far[lane] = defect > FAR && self.lanes[lane].plain_left == 0;
        self.wish.is_coupled[lane] = !system.is_ideal() && !self.settings.is_frozen && defect <= FAR;
        self.wish.is_soft[lane] = defect > 1e-4;
        if system.n_minerals > 0 {
            self.weigh(lane);
        }
    }

    /// The longest component of the step of each lane; without bound if one is not a number.
    #[inline(always)]
    fn largest(&self) -> [f64; L] {
        let mut largest = [0.0; L];
        let mut sum = [0.0; L];
        for step in &self.direction.xi {
            for lane in 0..L {
                let size = step[lane].abs();
                sum[lane] += size;
                largest[lane] = if size > largest[lane] { size } else { largest[lane] };
            }
        }
        for lane in 0..L {
            largest[lane] = if sum[lane].is_nan() { f64::INFINITY } else { largest[lane] };
        }
        largest
    }

    /// Whether what is left after the step needs no look: all logarithms change by less than `LAST_STEP`, the
    /// balances are linear up to its square, and the same minerals stay.
    #[inline(always)]
    fn is_last(&self, system: &System, lane: usize, largest: f64) -> bool {
        let ionic = self.point.ionic[lane];
        if !(largest <= LAST_STEP && self.direction.ionic[lane].abs() <= LAST_STEP * ionic) {
            return false;
        }
        if self.point.defect[lane] > FAR || self.direction.least_part[lane] < SOUND {
            return false;
        }
        if !system.is_ideal() && !self.settings.is_frozen && !self.wish.is_coupled[lane] {
            return false;
        }
        let first = system.n_primaries + system.n_secondaries;
        let mut is_last = !(system.n_minerals > 0 && self.direction.is_soft[lane]);
        for (i, row) in system.rows.iter().enumerate() {
            let change = self.change(system, i, row, lane);
            is_last &= change.abs() <= LAST_STEP;
            if i >= system.n_secondaries {
                let k = i - system.n_secondaries;
                let index = self.point.values[first + k][lane] + change;
                let amount = self.point.amount[k][lane] + self.direction.amount[k][lane];
                let is_active = self.direction.active[k][lane];
                is_last &=
                    if is_active { amount >= 0.0 && index.abs() <= SOLVED_LN } else { index <= SOLVED_LN };
            }
        }
        is_last
    }

    /// Change of the logarithm of a row with the step.
    #[inline(always)]
    fn change(&self, system: &System, i: usize, row: &super::system::Row, lane: usize) -> f64 {
        let mut change = 0.0;
        for entry in &row.entries {
            change += entry.nu * self.direction.xi[entry.primary][lane];
        }
        if !system.is_ideal() {
            change += self.point.slopes[i][lane] * self.direction.ionic[lane];
        }
        change
    }

    /// Takes the last step in first and second order.
    #[inline(always)]
    fn finish(&mut self, system: &System, lane: usize) {
        let n = system.n_primaries;
        for (i, row) in system.rows.iter().enumerate() {
            let change = self.change(system, i, row, lane);
            if i < system.n_secondaries {
                self.point.values[n + i][lane] *= 1.0 + change * (1.0 + 0.5 * change);
            } else {
                self.point.values[n + i][lane] += change;
                let k = i - system.n_secondaries;
                self.point.amount[k][lane] += self.direction.amount[k][lane];
            }
        }
        for j in 0..n {
            let change = self.direction.xi[j][lane];
            self.point.values[j][lane] *= 1.0 + change * (1.0 + 0.5 * change);
            self.point.xi[j][lane] += change;
        }
        self.point.ionic[lane] += self.direction.ionic[lane];
    }

    /// Takes a step, cut to its longest length.
    #[inline(always)]
    fn go(&mut self, system: &System, lane: usize, largest: f64) {
        let wished = self.direction.stretch[lane];
        let part = if largest * wished > MAX_STEP { MAX_STEP / largest } else { wished };
        let mut slope = 0.0;
        for j in 0..system.n_primaries {
            let step = part * self.direction.xi[j][lane];
            slope += step * self.point.residual[j][lane];
            self.old_xi[j][lane] = self.point.xi[j][lane];
            self.step_xi[j][lane] = step;
            self.point.xi[j][lane] += step;
        }
        let first = system.n_primaries + system.n_secondaries;
        let mut merit = self.point.potential[lane];
        for (k, row) in system.minerals().iter().enumerate() {
            let (own, penalty) = (self.point.amount[k][lane], self.wish.penalty[k][lane]);
            let pull = own + penalty * self.point.values[first + k][lane];
            let counts = pull > 0.0 && !self.wish.is_hot[lane];
            let pull = if counts { pull } else { 0.0 };
            // The residual has the amount in it; the merit pulls with more or less than that.
            for entry in &row.entries {
                slope += (pull - own) * entry.nu * self.step_xi[entry.primary][lane];
            }
            merit += if counts { pull * pull / (2.0 * penalty) } else { 0.0 };
            self.old_amount[k][lane] = own;
            let bound = HOT * (penalty / self.settings.stiffness + self.lanes[lane].hottest);
            let amount = (own + part * self.direction.amount[k][lane]).clamp(-bound, bound);
            self.step_amount[k][lane] = amount - own;
            self.point.amount[k][lane] = amount;
        }
        if self.wish.is_coupled[lane] {
            let ionic = self.point.ionic[lane] + part * self.direction.ionic[lane];
            self.point.ionic[lane] = ionic.clamp(MIN_IONIC_STRENGTH, 2.0 * MAX_IONIC_STRENGTH);
        }
        let now = &mut self.lanes[lane];
        now.is_fresh = false;
        now.part = 1.0;
        now.merit = merit;
        now.slope = slope;
    }

    /// Whether the balances of a lane are solved, if not as well as they should be.
    pub fn is_nearly_solved(&self, system: &System, lane: usize) -> bool {
        let is_number = self.point.potential[lane].is_finite();
        is_number && self.point.defect[lane] <= 50.0 * SOLVED && self.is_rest_solved(system, lane)
    }

    /// Evaluations that a lane has taken.
    pub fn evaluations(&self, lane: usize) -> u32 {
        self.lanes[lane].evaluations
    }
}

enum Verdict {
    Step,
    /// Another point on the same step.
    Again,
    Done,
    Failed,
}

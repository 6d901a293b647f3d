//! The explicit Runge–Kutta method of Dormand and Prince, for what is not stiff.
//!
//! Owns the coefficients and one step over lanes. May use the laws and the driver of steps. It
//! deliberately notices no stiffness: a particle that needs too many steps is handed on.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::integrate::{Lanes, Network, Stepper};
use super::laws::{LANES, Lane};
use super::rosenbrock::{combine, load, rates_of_place};
use crate::maths::vector;

const STAGES: usize = 7;

/// Rows of the stages; the last row is the result of order 5.
///
/// Source: J. R. Dormand and P. J. Prince 1980, J. Comput. Appl. Math. 6, 19,
/// doi:10.1016/0771-050X(80)90013-3.
const A: [[f64; STAGES]; STAGES] = [
    [0.0; STAGES],
    [0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0, 0.0],
];
const C: [f64; STAGES] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];
/// Result of order 5 less that of order 4.
const E: [f64; STAGES] =
    [71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339_200.0, 22.0 / 525.0, -1.0 / 40.0];

/// The method for a network.
#[derive(Debug)]
pub(super) struct Explicit<'a> {
    pub network: &'a Network,
}

/// Remembered sizes this many times longer than what values and slopes say are not trusted.
const TRUST: f64 = 10.0;
/// A remembered size is looked at if something would lose this share of itself over it.
const HARMLESS: f64 = 0.3;

impl Explicit<'_> {
    /// Stages hold `h f`. The last one is at the result, and is kept for the next step.
    #[inline(always)]
    fn evaluate(&self, lanes: &mut Lanes, stage: usize) {
        let system = &self.network.system;
        let n = system.n_components;
        let Lanes { y, new, stages, sum, ahead, rates, elapsed, step, t, .. } = lanes;
        let (at, is_last) = if stage == STAGES - 1 { (new, true) } else { (sum, false) };
        combine(n, &A[stage], Some(y), stages, at);
        load(&system.is_positive, at, rates);
        for l in 0..LANES {
            rates[system.n_variables + 3][l] = *t + (elapsed[l] + C[stage] * step[l]);
        }
        system.rates.run(rates);
        for (value, &place) in stages[stage * n..].iter_mut().zip(&system.rates.outputs) {
            let mut rate = rates[usize::from(place)];
            for l in 0..LANES {
                rate[l] *= step[l];
            }
            *value = rate;
        }
        if is_last {
            for (slope, &place) in ahead.iter_mut().zip(&system.rates.outputs) {
                *slope = rates[usize::from(place)];
            }
        }
    }

    /// Which lanes, as 1, remember nothing or a size over which something may run out.
    #[inline(always)]
    fn doubtful(&self, lanes: &Lanes, over: &Lane) -> Lane {
        let mut doubtful = [0.0; LANES];
        for l in 0..LANES {
            doubtful[l] = if lanes.wanted[l] > 0.0 { 0.0 } else { 1.0 };
        }
        for (i, &small) in self.network.small.iter().enumerate() {
            let (value, slope) = (&lanes.y[i], &lanes.slopes[i]);
            for l in 0..LANES {
                let falls = -slope[l] * over[l] > HARMLESS * (value[l].abs() + small);
                doubtful[l] = if falls { 1.0 } else { doubtful[l] };
            }
        }
        doubtful
    }

    /// Norms of values and slopes, or of slopes and their change to the rates that were found last, in
    /// tolerances; no value is smaller than what its slope would make of it over `over`.
    #[inline(always)]
    fn norms(&self, lanes: &Lanes, over: &Lane, is_bend: bool) -> [Lane; 2] {
        let system = &self.network.system;
        let mut sums = [[0.0; LANES]; 2];
        for (i, &place) in system.rates.outputs.iter().enumerate() {
            let (value, slope, later) = (&lanes.y[i], &lanes.slopes[i], &lanes.rates[usize::from(place)]);
            for l in 0..LANES {
                let (own, moved) = (value[l].abs(), (over[l] * slope[l]).abs());
                let size = if own > moved { own } else { moved };
                let scale = 1.0 / (self.network.small[i] + self.network.tolerance * size);
                let (first, second) =
                    if is_bend { (slope[l], later[l] - slope[l]) } else { (value[l], slope[l]) };
                sums[0][l] += first * scale * (first * scale);
                sums[1][l] += second * scale * (second * scale);
            }
        }
        let share = 1.0 / system.n_components as f64;
        for sum in &mut sums {
            for l in 0..LANES {
                sum[l] = (share * sum[l]).sqrt();
            }
        }
        sums
    }
}

impl Stepper for Explicit<'_> {
    const MOST_STEPS: u32 = 2_000;
    const KEEPS_SLOPES: bool = true;

    fn exponent(&self) -> f64 {
        5.0
    }

    fn local_share(&self) -> f64 {
        0.35
    }

    fn work(&self) -> (u64, u64) {
        (STAGES as u64 - 1, 0)
    }

    #[inline(always)]
    fn begin(&self, lanes: &mut Lanes) {
        let system = &self.network.system;
        let Lanes { y, rates, slopes, positions, elapsed, t, .. } = lanes;
        load(&system.is_positive, y, rates);
        rates_of_place(system.n_variables, positions, rates);
        for l in 0..LANES {
            rates[system.n_variables + 3][l] = *t + elapsed[l];
        }
        system.rates.run(rates);
        for (slope, &place) in slopes.iter_mut().zip(&system.rates.outputs) {
            *slope = rates[usize::from(place)];
        }
    }

    /// What is remembered, unless values and slopes say something else: a step much too long may have an
    /// error estimate that vanishes by chance.
    ///
    /// - Equation: `λ = |f(t + h₀, y + h₀ f) − f| / (h₀ |f|)`, `h₀ = 0.01 |y|/|f|`; `|f| λ⁴ h⁵ = 0.01`.
    /// - Symbols: `f` slopes, `|·|` in tolerances, λ the rate at which slopes change.
    /// - Range: at most 100 h₀ and the whole step.
    /// - Source: E. Hairer, S. P. Nørsett and G. Wanner 1993, Solving Ordinary Differential Equations I,
    ///   2nd ed., Springer, II.4; there time has no unit and `max(|f|, λ|f|)` stands for `|f| λ⁴`.
    /// - Shape: one size per lane.
    #[inline(always)]
    fn start(&self, lanes: &mut Lanes, dt: f64) -> u64 {
        let system = &self.network.system;
        let mut over = [dt; LANES];
        for l in 0..LANES {
            let wanted = lanes.wanted[l];
            over[l] = if wanted > 0.0 && wanted < dt { wanted } else { dt };
        }
        let doubtful = self.doubtful(lanes, &over);
        if doubtful == [0.0; LANES] {
            return 1;
        }
        let [values, slopes] = self.norms(lanes, &over, false);
        let mut short = [0.0; LANES];
        for l in 0..LANES {
            let guess = 0.01 * if values[l] > 1.0 { values[l] } else { 1.0 } / slopes[l];
            short[l] = if guess < over[l] { guess } else { over[l] };
        }
        let Lanes { y, slopes, sum, rates, elapsed, t, .. } = &mut *lanes;
        for ((sum, y), slope) in sum.iter_mut().zip(y.iter()).zip(slopes.iter()) {
            for l in 0..LANES {
                sum[l] = y[l] + short[l] * slope[l];
            }
        }
        load(&system.is_positive, sum, rates);
        for l in 0..LANES {
            rates[system.n_variables + 3][l] = *t + (elapsed[l] + short[l]);
        }
        system.rates.run(rates);
        let [slopes, bends] = self.norms(lanes, &over, true);
        for l in 0..LANES {
            let pace = bends[l] / (slopes[l] * short[l]);
            let size = vector::pow(0.01 * pace / slopes[l], 0.2) / pace;
            let size = if size < 100.0 * short[l] { size } else { 100.0 * short[l] };
            let size = if size < dt { size } else { dt };
            let remembered = lanes.wanted[l];
            let is_kept = doubtful[l] == 0.0 || (remembered > 0.0 && remembered <= TRUST * size);
            lanes.wanted[l] = if is_kept { remembered } else { size };
        }
        2
    }

    #[inline(always)]
    fn attempt(&self, lanes: &mut Lanes) {
        let n = self.network.system.n_components;
        let Lanes { stages, slopes, step, positions, rates, .. } = lanes;
        rates_of_place(self.network.system.n_variables, positions, rates);
        for (value, slope) in stages.iter_mut().zip(slopes.iter()) {
            let mut slope = *slope;
            for l in 0..LANES {
                slope[l] *= step[l];
            }
            *value = slope;
        }
        for stage in 1..STAGES {
            self.evaluate(lanes, stage);
        }
        let Lanes { error, stages, .. } = lanes;
        combine(n, &E, None, stages, error);
    }
}

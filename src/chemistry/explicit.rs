//! The explicit Runge–Kutta method of Dormand and Prince, for what is not stiff.
//!
//! Owns the coefficients and one step over lanes. May use the laws and the driver of steps. It
//! deliberately notices no stiffness: a particle that needs too many steps is handed on.

use super::integrate::{Lanes, Network, Stepper};
use super::laws::LANES;
use super::rosenbrock::{combine, load, rates_of_place};

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

impl Explicit<'_> {
    /// Stages hold `h f`.
    #[inline(always)]
    fn evaluate(&self, lanes: &mut Lanes, stage: usize) {
        let system = &self.network.system;
        let n = system.n_components;
        let Lanes { y, stages, sum, rates, elapsed, step, t, .. } = lanes;
        combine(n, &A[stage], Some(y), stages, sum);
        load(&system.is_positive, sum, rates);
        for l in 0..LANES {
            rates[system.n_variables + 3][l] = *t + (elapsed[l] + C[stage] * step[l]);
        }
        system.rates.run(rates);
        for (value, &place) in stages[stage * n..].iter_mut().zip(&system.rates.outputs) {
            let rate = &rates[usize::from(place)];
            for l in 0..LANES {
                value[l] = step[l] * rate[l];
            }
        }
    }
}

impl Stepper for Explicit<'_> {
    const MOST_STEPS: u32 = 2_000;

    fn exponent(&self) -> f64 {
        5.0
    }

    fn local_share(&self) -> f64 {
        0.35
    }

    fn work(&self) -> (u64, u64) {
        (STAGES as u64, 0)
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

    #[inline(always)]
    fn attempt(&self, lanes: &mut Lanes) {
        let n = self.network.system.n_components;
        let Lanes { stages, slopes, step, .. } = lanes;
        for (value, slope) in stages.iter_mut().zip(slopes.iter()) {
            for l in 0..LANES {
                value[l] = step[l] * slope[l];
            }
        }
        for stage in 1..STAGES {
            self.evaluate(lanes, stage);
        }
        let Lanes { y, new, error, stages, .. } = lanes;
        combine(n, &A[STAGES - 1], Some(y), stages, new);
        combine(n, &E, None, stages, error);
    }
}

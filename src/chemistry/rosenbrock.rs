//! A Rosenbrock method: L-stable steps with one factored matrix each and no iteration.
//!
//! Owns the coefficients and one step over lanes. May use the laws, sparse matrices and the driver of
//! steps. It deliberately controls no step size.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::aqueous::Aqueous;
use super::integrate::{Lanes, Network, Stepper};
use super::laws::{LANES, Lane};
use super::matrix::Symbolic;
use crate::maths::wide::Width;

/// Coefficients of
/// `(I/(hγ) − J) K_i = f(t + α_i h, Y_i) + Σ_{j<i} (c_ij/h) K_j + γ_i h ∂f/∂t`,
/// `Y_i = y + Σ a_ij K_j`, `y⁺ = y + Σ m_i K_i`, `error = Σ e_i K_i`.
#[derive(Debug)]
struct Tableau {
    gamma: f64,
    a: [[f64; STAGES]; STAGES],
    c: [[f64; STAGES]; STAGES],
    m: [f64; STAGES],
    e: [f64; STAGES],
    alpha: [f64; STAGES],
    gammas: [f64; STAGES],
}

const STAGES: usize = 6;

const A5: [f64; 4] =
    [1.221_224_509_226_641, 6.019_134_481_288_629, 12.537_083_329_320_87, -0.687_886_036_105_895];

/// Rodas4: order 4(3), stiffly accurate.
///
/// Source: E. Hairer and G. Wanner 1996, Solving Ordinary Differential Equations II, 2nd ed., Springer,
/// IV.7, code RODAS, method 1.
const RODAS4: Tableau = Tableau {
    gamma: 0.25,
    a: [
        [0.0; STAGES],
        [1.544, 0.0, 0.0, 0.0, 0.0, 0.0],
        [0.946_678_528_081_582_6, 0.255_701_169_898_328_4, 0.0, 0.0, 0.0, 0.0],
        [3.314_825_187_068_521, 2.896_124_015_972_201, 0.998_641_913_997_781_7, 0.0, 0.0, 0.0],
        [A5[0], A5[1], A5[2], A5[3], 0.0, 0.0],
        [A5[0], A5[1], A5[2], A5[3], 1.0, 0.0],
    ],
    c: [
        [0.0; STAGES],
        [-5.6688, 0.0, 0.0, 0.0, 0.0, 0.0],
        [-2.430_093_356_833_875, -0.206_359_915_709_191_5, 0.0, 0.0, 0.0, 0.0],
        [-0.107_352_905_815_137_5, -9.594_562_251_023_355, -20.470_286_148_096_16, 0.0, 0.0, 0.0],
        [
            7.496_443_313_967_647,
            -10.246_804_314_643_52,
            -33.999_903_528_199_05,
            11.708_908_932_061_6,
            0.0,
            0.0,
        ],
        [
            8.083_246_795_921_522,
            -7.981_132_988_064_893,
            -31.521_594_328_743_71,
            16.319_305_431_231_36,
            -6.058_818_238_834_054,
            0.0,
        ],
    ],
    m: [A5[0], A5[1], A5[2], A5[3], 1.0, 1.0],
    e: [0.0, 0.0, 0.0, 0.0, 0.0, 1.0],
    alpha: [0.0, 0.386, 0.21, 0.63, 1.0, 1.0],
    gammas: [0.25, -0.1043, 0.1035, -0.036_200_000_000_000_23, 0.0, 0.0],
};

/// A method for a network.
#[derive(Debug)]
pub(super) struct Rosenbrock<'a> {
    pub network: &'a Network,
    pub symbolic: &'a Symbolic,
    /// Rates are those of species in equilibrium.
    pub aqueous: Option<(&'a Aqueous, Width)>,
}

impl Stepper for Rosenbrock<'_> {
    const MOST_STEPS: u32 = 200_000;
    const KEEPS_SLOPES: bool = false;

    fn exponent(&self) -> f64 {
        4.0
    }

    fn local_share(&self) -> f64 {
        1.0
    }

    fn work(&self) -> (u64, u64) {
        (STAGES as u64, 1)
    }

    #[inline(always)]
    fn begin(&self, lanes: &mut Lanes) {
        let system = &self.network.system;
        let Lanes { y, full, slopes, positions, elapsed, t, aqueous, .. } = lanes;
        match (self.aqueous, aqueous) {
            (Some((model, width)), Some(own)) => {
                own.forget(elapsed);
                model.fill(width, y, full, own);
            }
            _ => load(&system.is_positive, y, full),
        }
        let n = system.n_variables;
        full[n..n + 3].copy_from_slice(positions);
        for l in 0..LANES {
            full[n + 3][l] = *t + elapsed[l];
        }
        system.full.run(full);
        for (slope, &place) in slopes.iter_mut().zip(&system.full.outputs) {
            *slope = full[usize::from(place)];
        }
        rates_of_place(n, positions, &mut lanes.rates);
    }

    fn start(&self, _: &mut Lanes, _: f64) -> u64 {
        0
    }

    #[inline(always)]
    fn attempt(&self, lanes: &mut Lanes) {
        let system = &self.network.system;
        let n = system.n_components;
        let mut inverse = [0.0; LANES];
        let mut diagonal = [0.0; LANES];
        for l in 0..LANES {
            inverse[l] = 1.0 / lanes.step[l];
            diagonal[l] = inverse[l] / RODAS4.gamma;
        }
        let places = &system.full.outputs[n..n + system.pattern.len()];
        match (self.aqueous, &mut lanes.aqueous) {
            (Some((model, width)), Some(own)) => {
                model.jacobian(width, &system.pattern, (&lanes.full, places), own);
                self.symbolic.fill(&diagonal, &own.jacobian, &own.places, &mut lanes.matrix);
            }
            _ => self.symbolic.fill(&diagonal, &lanes.full, places, &mut lanes.matrix),
        }
        self.symbolic.factor(&mut lanes.matrix);
        for stage in 0..STAGES {
            if stage > 0 {
                self.evaluate(lanes, stage);
            }
            self.right_side(lanes, stage, &inverse);
            let own = &mut lanes.stages[stage * n..(stage + 1) * n];
            self.symbolic.solve(&lanes.matrix, own);
        }
        let Lanes { y, new, error, stages, .. } = lanes;
        combine(n, &RODAS4.m, Some(y), stages, new);
        combine(n, &RODAS4.e, None, stages, error);
    }
}

impl Rosenbrock<'_> {
    /// Rates at the stage's own values and time.
    #[inline(always)]
    fn evaluate(&self, lanes: &mut Lanes, stage: usize) {
        let system = &self.network.system;
        let Lanes { y, stages, sum, rates, slopes, elapsed, step, t, aqueous, .. } = lanes;
        combine(system.n_components, &RODAS4.a[stage], Some(y), stages, sum);
        match (self.aqueous, aqueous) {
            (Some((model, width)), Some(own)) => model.fill(width, sum, rates, own),
            _ => load(&system.is_positive, sum, rates),
        }
        for l in 0..LANES {
            rates[system.n_variables + 3][l] = *t + (elapsed[l] + RODAS4.alpha[stage] * step[l]);
        }
        system.rates.run(rates);
        for (slope, &place) in slopes.iter_mut().zip(&system.rates.outputs) {
            *slope = rates[usize::from(place)];
        }
    }

    #[inline(always)]
    fn right_side(&self, lanes: &mut Lanes, stage: usize, inverse: &Lane) {
        let system = &self.network.system;
        let n = system.n_components;
        let (done, own) = lanes.stages.split_at_mut(stage * n);
        own[..n].copy_from_slice(&lanes.slopes);
        for (j, &coefficient) in RODAS4.c[stage][..stage].iter().enumerate() {
            if coefficient == 0.0 {
                continue;
            }
            for (target, earlier) in own[..n].iter_mut().zip(&done[j * n..]) {
                let mut sum = *target;
                for l in 0..LANES {
                    sum[l] += coefficient * inverse[l] * earlier[l];
                }
                *target = sum;
            }
        }
        if system.reads_time && RODAS4.gammas[stage] != 0.0 {
            let places = &system.full.outputs[n + system.pattern.len()..];
            for (target, &place) in own[..n].iter_mut().zip(places) {
                let by_time = &lanes.full[usize::from(place)];
                for l in 0..LANES {
                    target[l] += RODAS4.gammas[stage] * lanes.step[l] * by_time[l];
                }
            }
        }
    }
}

/// Copies values to a program's inputs; what is never negative, not below zero. NaN goes through.
#[inline(always)]
pub(super) fn load(is_positive: &[bool], y: &[Lane], registers: &mut [Lane]) {
    for ((value, &is_positive), register) in y.iter().zip(is_positive).zip(registers) {
        if is_positive {
            // A copy, here and elsewhere: what may overlap is not compiled wide.
            let mut lane = *value;
            for l in 0..LANES {
                lane[l] = if lane[l] < 0.0 { 0.0 } else { lane[l] };
            }
            *register = lane;
        } else {
            *register = *value;
        }
    }
}

#[inline(always)]
pub(super) fn rates_of_place(n: usize, positions: &[Lane; 3], rates: &mut [Lane]) {
    rates[n..n + 3].copy_from_slice(positions);
}

/// `y + Σ weight_j K_j`
#[inline(always)]
pub(super) fn combine(n: usize, weights: &[f64], y: Option<&[Lane]>, stages: &[Lane], out: &mut [Lane]) {
    for i in 0..n {
        let mut sum = y.map_or([0.0; LANES], |y| y[i]);
        for (j, &weight) in weights.iter().enumerate() {
            if weight != 0.0 {
                let stage = &stages[j * n + i];
                for l in 0..LANES {
                    sum[l] += weight * stage[l];
                }
            }
        }
        out[i] = sum;
    }
}

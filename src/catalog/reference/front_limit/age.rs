//! The law of the slow zone as the front ages.
//!
//! Owns the equations of its Legendre moments and their integration in time. May use `maths`, `legendre`
//! and `late`. It deliberately does not know η: one law serves every fraction.
//!
//! Particles that start right of the front (W = 0) have W = g V with g = 1 − e^{−χt/2} and V in 0…1, the
//! weighted mean of ū along their path; those from the left follow by symmetry, 1 − W = g V at −ξ.
//! With y = 2V − 1, `F_n(ξ) = E[L_n(y); start right | ξ]` obeys, for τ = χt and κ = τ/(2g),
//!
//! `τ ∂F_n/∂τ = ¼ F_n'' + ½ ξ F_n' + κ [(2ū − 1) S_n − n F_n − S_{n−1}]`, `S_n = Σ_{k = n−1, n−3, …} (2k+1) F_k`,
//!
//! exactly and mode by mode: no moment needs a higher one. At age zero the right-hand side is zero.

use super::late::Late;
use super::legendre::{N_MODES, hinge};
use super::{FARTHEST, Law};
use crate::maths::pentadiagonal::{Scratch, Sides, solve};
use crate::maths::scalar::{erfc, exp, expm1, ln};
use std::sync::{Arc, Mutex, PoisonError};

const N_POINTS: usize = 401;
const SPACING: f64 = 2.0 * FARTHEST / (N_POINTS - 1) as f64;
/// From here on the law is nearly normal.
const LATE: f64 = 60.0;
/// Before this age the law of V does not change (to 1e-3 of itself, times g = 5e-4).
const FIRST_AGE: f64 = 1e-3;
/// Steps in ln τ up to the age 1.1 and after it: the product is right to 1e-7 and 1e-6.
const YOUNG_STEP: f64 = 0.2;
const N_YOUNG_STEPS: usize = 35;
const STEP: f64 = 0.05;
/// Laws that are kept: the times of a few outputs.
const KEPT: usize = 32;

/// The slow zone, solved as far as it has been asked for. The law depends on the age only, so that all
/// references share one.
static SLOW_ZONE: SlowZone = SlowZone(Mutex::new(Progress { march: None, kept: Vec::new() }));

/// The law at an age χt ≥ 0.
pub(super) fn law(age: f64) -> Arc<dyn Law> {
    if age >= LATE { Arc::new(Late::new(age)) } else { SLOW_ZONE.at(age) }
}

struct SlowZone(Mutex<Progress>);

struct Progress {
    march: Option<March>,
    kept: Vec<(f64, Arc<dyn Law>)>,
}

impl SlowZone {
    /// The same for any order of calls: the march has fixed steps, and the last one to a requested age
    /// starts from the ages of the march.
    fn at(&self, age: f64) -> Arc<dyn Law> {
        let mut progress = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, law)) = progress.kept.iter().find(|(kept, _)| *kept == age) {
            return law.clone();
        }
        let n_steps = steps_to(age);
        let mut march = progress.march.take().filter(|march| march.n_steps <= n_steps).unwrap_or_default();
        march.advance(n_steps);
        let law: Arc<dyn Law> = Arc::new(march.law_at(age));
        progress.march = Some(march);
        if progress.kept.len() == KEPT {
            progress.kept.remove(0);
        }
        progress.kept.push((age, law.clone()));
        law
    }
}

/// ln τ after `n_steps` steps.
fn log_age(n_steps: usize) -> f64 {
    let n_young = n_steps.min(N_YOUNG_STEPS);
    ln(FIRST_AGE) + YOUNG_STEP * n_young as f64 + STEP * (n_steps - n_young) as f64
}

/// Whole steps that end at an age or before it.
fn steps_to(age: f64) -> usize {
    if age <= FIRST_AGE {
        return 0;
    }
    let n_young = ((ln(age) - log_age(0)) / YOUNG_STEP) as usize;
    if n_young < N_YOUNG_STEPS {
        return n_young;
    }
    N_YOUNG_STEPS + ((ln(age) - log_age(N_YOUNG_STEPS)).max(0.0) / STEP) as usize
}

/// `F_n` on the grid of ξ, mode after mode.
type Modes = Vec<f64>;

/// Time integration of the moments.
struct March {
    space: Space,
    n_steps: usize,
    modes: Modes,
}

impl Default for March {
    fn default() -> Self {
        let space = Space::new();
        let mut modes = vec![0.0; N_MODES * N_POINTS];
        space.solve(0.0, 1.0, 1.0, &mut modes);
        Self { space, n_steps: 0, modes }
    }
}

impl March {
    fn advance(&mut self, n_steps: usize) {
        while self.n_steps < n_steps {
            let start = log_age(self.n_steps);
            self.modes = self.space.step(&self.modes, start, log_age(self.n_steps + 1) - start);
            self.n_steps += 1;
        }
    }

    fn law_at(&self, age: f64) -> Young {
        let start = log_age(self.n_steps);
        let rest = if age > FIRST_AGE { ln(age) - start } else { 0.0 };
        let modes = if rest > 0.0 { self.space.step(&self.modes, start, rest) } else { self.modes.clone() };
        Young { modes, reach: -expm1(-0.5 * age) }
    }
}

/// κ(τ) = τ / (2 (1 − e^{−τ/2})), 1 at age zero.
fn averaging_rate(age: f64) -> f64 {
    -0.5 * age / expm1(-0.5 * age)
}

/// The operators on the grid of ξ from −5 to 5.
struct Space {
    /// ¼ ∂² + ½ ξ ∂ in differences of fourth order (second order beside the ends, where all is flat).
    sides: Sides,
    diagonal: Vec<f64>,
    /// 2ū − 1
    drift: Vec<f64>,
}

impl Space {
    fn new() -> Self {
        let (mut rows, mut diagonal, mut drift) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..N_POINTS {
            let xi = -FARTHEST + SPACING * i as f64;
            let (curve, slope) = (0.25 / (SPACING * SPACING), 0.5 * xi / SPACING);
            let (row, centre) = match i.min(N_POINTS - 1 - i) {
                // The values at the ends are given.
                0 => ([0.0; 4], 0.0),
                1 => ([0.0, curve - 0.5 * slope, curve + 0.5 * slope, 0.0], -2.0 * curve),
                _ => {
                    let (far, near) = (-curve / 12.0, curve * 4.0 / 3.0);
                    let (far_slope, near_slope) = (slope / 12.0, slope * 2.0 / 3.0);
                    ([far + far_slope, near - near_slope, near + near_slope, far - far_slope], -2.5 * curve)
                }
            };
            rows.push(row);
            diagonal.push(centre);
            drift.push(erfc(xi) - 1.0);
        }
        Self { sides: Sides { rows }, diagonal, drift }
    }

    /// Solves `(shift − weight · R) F = modes` in place, R the right-hand side above with rate κ.
    ///
    /// F_0 is known: the fraction that started right, 1 − ū. At the ends V is 0 or nobody started right.
    fn solve(&self, shift: f64, weight: f64, kappa: f64, modes: &mut [f64]) {
        let mut scratch = Scratch::default();
        // S_{n−1} and S_n, S_0 = 0, S_1 = F_0.
        let mut sum_before = vec![0.0; N_POINTS];
        let mut sum = vec![0.0; N_POINTS];
        let last = N_POINTS - 1;
        let weights = weight * kappa;
        for n in 0..N_MODES {
            let (solved, rest) = modes.split_at_mut(n * N_POINTS);
            let mode = &mut rest[..N_POINTS];
            if n == 0 {
                mode.iter_mut().zip(&self.drift).for_each(|(value, drift)| *value = 0.5 * (1.0 - drift));
                continue;
            }
            let before = &solved[(n - 1) * N_POINTS..];
            let factor = (2 * n - 1) as f64;
            for i in 0..N_POINTS {
                // S_n = S_{n−2} + (2n − 1) F_{n−1}
                (sum_before[i], sum[i]) = (sum[i], sum_before[i] + factor * before[i]);
                mode[i] += weights * (self.drift[i] * sum[i] - sum_before[i]);
            }
            (mode[0], mode[last]) = (0.0, if n % 2 == 0 { 1.0 } else { -1.0 });
            let decay = shift + weights * n as f64;
            let diagonal =
                |i: usize| if i == 0 || i == last { 1.0 } else { decay - weight * self.diagonal[i] };
            solve(&self.sides, -weight, diagonal, mode, &mut scratch);
        }
    }

    /// One step of `length` in ln τ from `start`.
    ///
    /// Alexander's method: three implicit stages, order three, L-stable (SIAM J. Numer. Anal. 14, 1977).
    fn step(&self, modes: &Modes, start: f64, length: f64) -> Modes {
        const G: f64 = 0.435_866_521_508_459_67;
        const B1: f64 = -1.5 * G * G + 4.0 * G - 0.25;
        const B2: f64 = 1.5 * G * G - 5.0 * G + 1.25;
        let kappa = |fraction: f64| averaging_rate(exp(start + fraction * length));
        let stage = |known: &Modes, fraction: f64| {
            let mut stage = known.clone();
            self.solve(1.0, G * length, kappa(fraction), &mut stage);
            stage
        };
        // The slope of a stage is (stage − known) / (G length).
        let first = stage(modes, G);
        let known = plus(modes, &[((1.0 - G) / (2.0 * G), &first, modes)]);
        let second = stage(&known, 0.5 * (1.0 + G));
        let known = plus(modes, &[(B1 / G, &first, modes), (B2 / G, &second, &known)]);
        stage(&known, 1.0)
    }
}

/// base + Σ factor · (a − b)
fn plus(base: &Modes, terms: &[(f64, &Modes, &Modes)]) -> Modes {
    let value = |(i, base): (usize, &f64)| {
        terms.iter().fold(*base, |sum, (factor, a, b)| sum + factor * (a[i] - b[i]))
    };
    base.iter().enumerate().map(value).collect()
}

/// The law at an age below [`LATE`].
struct Young {
    modes: Modes,
    /// g = 1 − e^{−χt/2}: the farthest that W can have come from its start.
    reach: f64,
}

impl Law for Young {
    /// Equation: `E[(W − u)₊] = g P(ξ, u/g) + (1−u) ū − g P(−ξ, 0) + g P(−ξ, (1−u)/g)`.
    fn excess(&self, xi: f64, mean: f64, u: f64) -> f64 {
        let right = self.reach * self.expected_excess(xi, u / self.reach);
        // Of those that started left, 1 − W = g V exceeds 1 − u or not: (a)₊ = a + (−a)₊.
        let nearly_all = (1.0 - u) / self.reach;
        if nearly_all >= 1.0 {
            return right + (1.0 - u) * mean - self.reach * self.expected_excess(-xi, 0.0);
        }
        let beyond = self.expected_excess(-xi, nearly_all) - self.expected_excess(-xi, 0.0);
        right + (1.0 - u) * mean + self.reach * beyond
    }
}

impl Young {
    /// `P(ξ, v) = E[(V − v)₊; start right | ξ]`, 0 for v ≥ 1.
    fn expected_excess(&self, xi: f64, v: f64) -> f64 {
        // Also for v = 0/0 at age zero.
        if v.is_nan() || v >= 1.0 {
            return 0.0;
        }
        let (first, weights) = interpolation(xi);
        let at = |n: usize| -> f64 {
            let values = &self.modes[n * N_POINTS + first..];
            weights.iter().zip(values).map(|(weight, value)| weight * value).sum()
        };
        if v == 0.0 {
            return 0.5 * (at(0) + at(1));
        }
        let sum: f64 = hinge(v).iter().enumerate().map(|(n, hinge)| hinge * at(n)).sum();
        sum.max(0.0)
    }
}

/// First point and weights of the six-point Lagrange interpolation at ξ.
fn interpolation(xi: f64) -> (usize, [f64; 6]) {
    let place = (xi + FARTHEST) / SPACING;
    let first = (place.floor() - 2.0).clamp(0.0, (N_POINTS - 6) as f64);
    let offset = place - first;
    let weights = std::array::from_fn(|j| {
        let others = (0..6).filter(|&k| k != j);
        others.fold(1.0, |product, k| product * (offset - k as f64) / (j as f64 - k as f64))
    });
    (first as usize, weights)
}

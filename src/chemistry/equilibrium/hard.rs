//! Particles that the fast iteration leaves: one at a time, slowly and surely.
//!
//! Owns the refusals and their proofs. May use the rest of the equilibrium. It deliberately ignores what a
//! particle remembers, so that its result is that of its totals alone.

use super::Refusal;
use super::activity::{MAX_IONIC_STRENGTH, MIN_IONIC_STRENGTH};
use super::fast::guess;
use super::feasible::{absent, infeasible};
use super::newton::{Newton, Outcome, Settings};
use super::precise::Problem;
use super::system::System;
use crate::maths::scalar;

/// What Newton's steps may take when each is one e-fold, and there are hundreds of them.
const MAX_EVALUATIONS: u32 = 4000;

/// Solves for the totals in lane 0 of the iteration's point.
pub(super) fn solve(system: &System, newton: &mut Newton<1>) -> Result<(), Refusal> {
    let totals: Vec<f64> = newton.point.total.iter().map(|total| total[0]).collect();
    if infeasible(system, &totals).is_some() {
        return Err(Refusal::Infeasible);
    }
    let none = vec![false; system.n_species()];
    if system.n_minerals > 0 && problem(system, newton, &totals, none).endless().is_some() {
        return Err(Refusal::Endless);
    }
    if system.is_ideal() {
        return at_fixed_activities(system, newton, MIN_IONIC_STRENGTH);
    }
    let ionic = ionic_strength(system, newton)?;
    at_fixed_activities(system, newton, ionic)?;
    // From the right activities at hand, the last digits of both together.
    newton.settings = Settings { max_evaluations: 40, is_plain: true, is_frozen: false, stiffness: 1.0 };
    newton.start(system, 0);
    let outcome = iterate(system, newton);
    if outcome == Outcome::Done { Ok(()) } else { Err(not_solved(newton)) }
}

/// The convex problem: activities of a given ionic strength.
fn at_fixed_activities(system: &System, newton: &mut Newton<1>, ionic: f64) -> Result<(), Refusal> {
    let n_first = if system.n_minerals > 0 { 1 } else { 2 };
    if by_sweeps(system, newton, ionic, &WAYS[..n_first]) {
        return Ok(());
    }
    newton.point.ionic[0] = ionic;
    let Err(refusal) = precisely(system, newton) else { return Ok(()) };
    if by_sweeps(system, newton, ionic, &WAYS[n_first..]) { Ok(()) } else { Err(refusal) }
}

/// Sweeps of continued fractions before the iteration, and whether its steps are Newton's alone.
const WAYS: [(usize, bool); 5] = [(0, true), (0, false), (10, true), (10, false), (100, true)];

fn by_sweeps(system: &System, newton: &mut Newton<1>, ionic: f64, ways: &[(usize, bool)]) -> bool {
    let stiffnesses: &[f64] = if system.n_minerals > 0 { &[1.0, 1e-2, 1e2, 1e4] } else { &[1.0] };
    for &(n_sweeps, is_plain) in ways {
        for &stiffness in stiffnesses {
            newton.settings =
                Settings { max_evaluations: MAX_EVALUATIONS, is_plain, is_frozen: true, stiffness };
            guess(system, &mut newton.point, 0);
            newton.point.ionic[0] = ionic;
            precondition(system, newton, n_sweeps);
            newton.start(system, 0);
            if iterate(system, newton) == Outcome::Done || newton.is_nearly_solved(system, 0) {
                return true;
            }
        }
    }
    false
}

/// The activities that the point has.
fn problem<'a>(
    system: &'a System,
    newton: &Newton<1>,
    totals: &'a [f64],
    is_absent: Vec<bool>,
) -> Problem<'a> {
    let (ionic, mut constants) = (newton.point.ionic, Vec::with_capacity(system.rows.len()));
    let root = [ionic[0].sqrt()];
    for row in &system.rows {
        let shapes = system.shapes.iter().zip(&row.weights);
        let terms = shapes.map(|(shape, weight)| weight * shape.value(&ionic, &root).0[0]);
        constants.push(row.ln_constant + terms.sum::<f64>());
    }
    Problem { system, totals, constants, is_absent }
}

/// In 32 digits, where 16 found no way.
fn precisely(system: &System, newton: &mut Newton<1>) -> Result<(), Refusal> {
    let totals: Vec<f64> = newton.point.total.iter().map(|total| total[0]).collect();
    let ionic = newton.point.ionic;
    guess(system, &mut newton.point, 0);
    newton.point.ionic = ionic;
    let start: Vec<f64> = newton.point.xi.iter().map(|xi| xi[0].max(-600.0)).collect();
    let is_absent = absent(system, &totals);
    let solution = problem(system, newton, &totals, is_absent).solve(&start);
    let solution = solution.map_err(|residual| Refusal::NotSolved { residual })?;
    let Newton { point, .. } = newton;
    let n_aqueous = system.n_primaries + system.n_secondaries;
    point.xi.iter_mut().zip(&solution.xi).for_each(|(xi, found)| *xi = [*found]);
    point.amount.iter_mut().zip(&solution.values[n_aqueous..]).for_each(|(amount, found)| *amount = [*found]);
    point.evaluate(system);
    // What doubles make of ln c is less than what is known.
    point.values[..n_aqueous].iter_mut().zip(&solution.values).for_each(|(value, found)| *value = [*found]);
    point.ionic_out = [system.ionic.iter().zip(&solution.values).map(|(weight, c)| weight * c).sum()];
    Ok(())
}

fn iterate(system: &System, newton: &mut Newton<1>) -> Outcome {
    loop {
        let [outcome] = newton.advance(system);
        if outcome != Outcome::Going {
            newton.stop(0);
            return outcome;
        }
    }
}

fn not_solved(newton: &Newton<1>) -> Refusal {
    Refusal::NotSolved { residual: newton.point.defect[0] }
}

/// The smallest ionic strength that its own activities reproduce, to a part in 10⁵.
///
/// Equation: `h(I) = I(c(I)) − I = 0` by regula falsi (Illinois) between 0, where h ≥ 0, and the first of
/// doubling ionic strengths at which h < 0.
/// Symbols: c(I) concentrations with the activities of I, a convex problem.
/// Dimensions and range: mol/L, up to `MAX_IONIC_STRENGTH`; beyond it no model holds and none is solved.
/// Source: Dowell & Jarratt 1971, BIT 11, 168.
/// Shape: h is continuous; it changes its sign once unless activities change faster than concentrations.
fn ionic_strength(system: &System, newton: &mut Newton<1>) -> Result<f64, Refusal> {
    let mut excess = |ionic: f64| {
        at_fixed_activities(system, newton, ionic)?;
        Ok(newton.point.ionic_out[0] - ionic)
    };
    let (mut low, mut high) = (MIN_IONIC_STRENGTH, 1e-12);
    let mut above = excess(low)?;
    if above <= 2.0 * MIN_IONIC_STRENGTH {
        return Ok(low);
    }
    let mut below = excess(high)?;
    while below > 0.0 {
        if high >= MAX_IONIC_STRENGTH {
            return Err(Refusal::IonicStrength { value: below + high });
        }
        (low, above) = (high, below);
        high = (2.0 * high).min(MAX_IONIC_STRENGTH);
        below = excess(high)?;
    }
    for _ in 0..100 {
        if high - low <= 1e-5 * high {
            break;
        }
        let inner = (low * below - high * above) / (below - above);
        let middle = if inner > low && inner < high { inner } else { 0.5 * (low + high) };
        let value = excess(middle)?;
        if value > 0.0 {
            (low, above, below) = (middle, value, 0.5 * below);
        } else {
            (high, below, above) = (middle, value, 0.5 * above);
        }
        if value.abs() <= 1e-6 * middle {
            return Ok(middle);
        }
    }
    Ok(0.5 * (low + high))
}

/// Positive continued fractions.
///
/// Equation: `c_j ← θ c_j (R/P)^{1/ν} + (1 − θ) c_j`, `θ = 0.9 − 0.8 min(r, 1/r)`, `r = R/P`.
/// Symbols: R what uses up total j, P what makes it; ν smallest positive coefficient.
/// Dimensions and range: as the balances.
/// Source: Carrayrou, Mosé & Behra 2002, AIChE J. 48, 894; methods 8.3.
/// Shape: goes towards the solution from anywhere, ever more slowly.
fn precondition(system: &System, newton: &mut Newton<1>, n_sweeps: usize) {
    for _ in 0..n_sweeps {
        newton.point.evaluate(system);
        let point = &mut newton.point;
        for j in 0..system.n_primaries {
            let made = 0.5 * (point.size[j][0] + point.residual[j][0]);
            let used = 0.5 * (point.size[j][0] - point.residual[j][0]);
            let ratio = used / made;
            if !(ratio > 0.0 && ratio.is_finite()) {
                continue;
            }
            let entries = system.secondaries().iter().flat_map(|row| &row.entries);
            let positive = entries.filter(|entry| entry.primary == j && entry.nu > 0.0).map(|entry| entry.nu);
            let least = positive.fold(1.0, f64::min);
            let theta = 0.9 - 0.8 * ratio.min(1.0 / ratio);
            let factor = theta * scalar::pow(ratio, 1.0 / least) + (1.0 - theta);
            point.xi[j][0] += scalar::ln(factor).clamp(-50.0, 50.0);
        }
    }
}

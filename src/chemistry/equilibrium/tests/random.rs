//! Ten thousand random systems.

use super::{defect, power, primary, solve, solve_one};
use crate::chemistry::equilibrium::feasible::infeasible;
use crate::chemistry::equilibrium::precise::Problem;
use crate::chemistry::equilibrium::{Refusal, Speciation};
use crate::maths::scalar::ln;
use crate::plan::chemistry::{Activity, Equilibrium, Mineral, Secondary};
use rand_chacha::ChaCha12Rng;
use rand_core::{Rng, SeedableRng};

pub(super) struct Dice(ChaCha12Rng);

impl Dice {
    pub fn new(seed: u64) -> Self {
        Self(ChaCha12Rng::seed_from_u64(seed))
    }

    pub fn below(&mut self, n: u64) -> u64 {
        self.0.next_u64() % n
    }

    pub fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// Up to 8 primaries and 30 complexes, ν from −1 to 3, K over 40 decades, totals from 1e-16 to 10.
pub(super) fn system(dice: &mut Dice) -> (Equilibrium, Vec<f64>) {
    let n = 1 + dice.below(8) as usize;
    let n_complexes = 1 + dice.below(30) as usize;
    let mut secondaries = Vec::new();
    for i in 0..n_complexes {
        let mut coefficients = Vec::new();
        for j in 0..n {
            if dice.below(3) > 0 || n == 1 {
                coefficients.push((j, dice.below(5) as f64 - 1.0));
            }
        }
        coefficients.retain(|c| c.1 != 0.0);
        let ln_constant = power(dice.uniform(-20.0, 20.0));
        secondaries.push(Secondary { species: n + i, charge: 0.0, ion_size: 0.0, ln_constant, coefficients });
    }
    let primaries = (0..n).map(|j| primary(j, 0.0, 0.0)).collect();
    let totals = (0..n)
        .map(|_| {
            let size = power(dice.uniform(-16.0, 1.0));
            let size = crate::maths::scalar::exp(size);
            match dice.below(12) {
                0 => 0.0,
                1 => -size,
                _ => size,
            }
        })
        .collect();
    (Equilibrium { primaries, secondaries, minerals: Vec::new(), activity: Activity::Ideal }, totals)
}

/// `ln C − ln K − Σ ν ln c` of the worst complex, over the size of its terms; what is nearly nothing is left out.
fn action(equilibrium: &Equilibrium, c: &[f64]) -> f64 {
    let n = equilibrium.primaries.len();
    let mut worst: f64 = 0.0;
    for (row, value) in equilibrium.secondaries.iter().zip(&c[n..]) {
        let is_little = |c: f64| c < 1e-240;
        if is_little(*value) || row.coefficients.iter().any(|&(j, _)| is_little(c[j])) {
            continue;
        }
        let terms = row.coefficients.iter().map(|&(j, nu)| -nu * ln(c[j]));
        let terms: Vec<f64> = terms.chain([ln(*value), -row.ln_constant]).collect();
        let size: f64 = terms.iter().map(|term| term.abs()).sum();
        worst = worst.max(terms.iter().sum::<f64>().abs() / (1.0 + size));
    }
    worst
}

/// A direction along which all species only rise and the totals fall proves that there is no solution.
fn is_proof(equilibrium: &Equilibrium, totals: &[f64], d: &[f64]) -> bool {
    let along = |row: &[(usize, f64)]| row.iter().map(|&(j, nu)| nu * d[j]).sum::<f64>();
    let rows = equilibrium.secondaries.iter().map(|s| along(&s.coefficients));
    let size: f64 = d.iter().map(|d| d.abs()).fold(0.0, f64::max);
    let is_rising = d.iter().copied().chain(rows).all(|rise| rise >= -1e-12 * size);
    let (fall, terms) = totals
        .iter()
        .zip(d)
        .fold((0.0, 0.0), |(sum, size), (total, d)| (sum + total * d, size + (total * d).abs()));
    is_rising && fall < -1e-11 * terms
}

#[test]
fn ten_thousand_random_systems_are_solved_or_refused_with_the_reason() {
    let mut dice = Dice::new(20_261_124);
    let (mut n_solved, mut n_infeasible) = (0, 0);
    for idx in 0..10_000 {
        let (equilibrium, totals) = system(&mut dice);
        let speciation = Speciation::new(&equilibrium).unwrap();
        let columns: Vec<Vec<f64>> = totals.iter().map(|&total| vec![total]).collect();
        let found = solve(&speciation, &columns, None);
        match found.effort {
            Ok(_) => {
                let c: Vec<f64> = found.concentrations.iter().map(|column| column[0]).collect();
                assert!(c.iter().all(|c| *c >= 0.0 && c.is_finite()), "system {idx} {c:?}");
                let (defect, action) = (defect(&equilibrium, &totals, &c), action(&equilibrium, &c));
                assert!(defect <= 1e-10, "system {idx}: {defect}");
                assert!(action <= 1e-13, "system {idx}: {action}");
                n_solved += 1;
            }
            Err((_, Refusal::Infeasible)) => {
                let proof = infeasible(&speciation.system, &totals).unwrap();
                assert!(is_proof(&equilibrium, &totals, &proof), "system {idx}: {totals:?}, {proof:?}");
                n_infeasible += 1;
            }
            Err(other) => panic!("system {idx}: {other:?}"),
        }
    }
    assert_eq!((n_solved, n_infeasible), (8481, 1519));
}
/// A thousand waters with complexes over 40 decades and up to four minerals: balances, saturation, presence.
#[test]
fn random_systems_with_minerals_are_at_or_below_saturation() {
    let mut dice = Dice::new(7);
    let mut n_present = 0;
    for idx in 0..1000 {
        let (mut equilibrium, mut totals) = system(&mut dice);
        totals.iter_mut().for_each(|total| *total = total.abs());
        equilibrium.secondaries.iter_mut().for_each(|s| s.coefficients.retain(|c| c.1 > 0.0));
        let n = totals.len() as u64;
        for k in 0..=dice.below(4) {
            let coefficients =
                (0..n).map(|j| (j as usize, dice.below(3) as f64)).filter(|c| c.1 > 0.0).collect();
            let ln_solubility = power(dice.uniform(-30.0, 0.0));
            equilibrium.minerals.push(Mineral { species: 100 + k as usize, ln_solubility, coefficients });
        }
        equilibrium.minerals.retain(|mineral| !mineral.coefficients.is_empty());
        let c = solve_one(&equilibrium, &totals).unwrap_or_else(|why| panic!("system {idx}: {why:?}"));
        assert!(defect(&equilibrium, &totals, &c) <= 1e-10, "system {idx}");
        let first = c.len() - equilibrium.minerals.len();
        for (mineral, amount) in equilibrium.minerals.iter().zip(&c[first..]) {
            let logs = mineral.coefficients.iter().map(|&(j, nu)| nu * ln(c[j]));
            let index = logs.sum::<f64>() - mineral.ln_solubility;
            assert!(*amount >= 0.0 && index < 1e-10, "system {idx}: {index}");
            assert!(*amount == 0.0 || index.abs() < 1e-10, "system {idx}: {amount} {index}");
            n_present += usize::from(*amount > 0.0);
        }
    }
    assert!(n_present > 200);
}

/// A thousand more with anything goes: ν from −1, K of minerals over 40 decades, totals of any sign and none. Each is
/// solved, or has a proof that it has no solution.
#[test]
fn random_systems_with_strange_minerals_are_solved_or_proved_to_have_no_solution() {
    let mut dice = Dice::new(8);
    let (mut n_solved, mut n_infeasible, mut n_endless, mut n_present) = (0, 0, 0, 0);
    for idx in 0..1000 {
        let (mut equilibrium, totals) = system(&mut dice);
        let n = totals.len() as u64;
        for k in 0..=dice.below(4) {
            let coefficients =
                (0..n).map(|j| (j as usize, dice.below(4) as f64 - 1.0)).filter(|c| c.1 != 0.0).collect();
            let ln_solubility = power(dice.uniform(-20.0, 20.0));
            equilibrium.minerals.push(Mineral { species: 100 + k as usize, ln_solubility, coefficients });
        }
        equilibrium.minerals.retain(|mineral| !mineral.coefficients.is_empty());
        match solve_one(&equilibrium, &totals) {
            Ok(c) => {
                let (defect, action) = (defect(&equilibrium, &totals, &c), action(&equilibrium, &c));
                assert!(defect <= 1e-10, "system {idx}: {defect}");
                assert!(action <= 1e-13, "system {idx}: {action}");
                n_present += assert_saturation(idx, &equilibrium, &c);
                n_solved += 1;
            }
            Err(Refusal::Infeasible) => {
                let speciation = Speciation::new(&equilibrium).unwrap();
                let proof = infeasible(&speciation.system, &totals).unwrap();
                let is_kept =
                    |m: &Mineral| m.coefficients.iter().map(|c| c.1 * proof[c.0]).sum::<f64>() > -1e-9;
                assert!(is_proof(&equilibrium, &totals, &proof), "system {idx}: {totals:?}, {proof:?}");
                assert!(equilibrium.minerals.iter().all(is_kept), "system {idx}: {proof:?}");
                n_infeasible += 1;
            }
            Err(Refusal::Endless) => {
                let speciation = Speciation::new(&equilibrium).unwrap();
                let constants = speciation.system.rows.iter().map(|row| row.ln_constant).collect();
                let is_absent = vec![false; speciation.species().len()];
                let system = &speciation.system;
                let proof = Problem { system, totals: &totals, constants, is_absent }.endless().unwrap();
                assert_endless(idx, &equilibrium, &proof);
                n_endless += 1;
            }
            Err(other) => panic!("system {idx}: {other:?}"),
        }
    }
    assert_eq!((n_solved, n_infeasible, n_endless), (839, 126, 35));
    assert!(n_present > 500, "{n_present}");
}

/// Minerals are at saturation where they are and below where not; how many are there.
fn assert_saturation(idx: usize, equilibrium: &Equilibrium, c: &[f64]) -> usize {
    let first = c.len() - equilibrium.minerals.len();
    let mut n_present = 0;
    for (mineral, amount) in equilibrium.minerals.iter().zip(&c[first..]) {
        assert!(*amount >= 0.0, "system {idx}: {amount}");
        // What has a part of nothing at all is decided by that alone.
        if mineral.coefficients.iter().any(|&(j, _)| c[j] < 1e-240) {
            assert!(*amount == 0.0, "system {idx}: {amount}");
            continue;
        }
        let terms: Vec<f64> = mineral.coefficients.iter().map(|&(j, nu)| nu * ln(c[j])).collect();
        let index = terms.iter().sum::<f64>() - mineral.ln_solubility;
        assert!(index < 1e-10, "system {idx}: {index}");
        assert!(*amount == 0.0 || index.abs() < 1e-10, "system {idx}: {amount} {index}");
        n_present += usize::from(*amount > 0.0);
    }
    n_present
}

/// Amounts of minerals that are nothing together, and form all the same.
fn assert_endless(idx: usize, equilibrium: &Equilibrium, proof: &[f64]) {
    assert!(proof.iter().all(|part| *part >= 0.0), "system {idx}: {proof:?}");
    let mut sum = vec![0.0; equilibrium.primaries.len()];
    let (mut gain, mut size) = (0.0, 0.0);
    for (mineral, part) in equilibrium.minerals.iter().zip(proof) {
        mineral.coefficients.iter().for_each(|&(j, nu)| sum[j] += part * nu);
        gain += part * mineral.ln_solubility;
        size += (part * mineral.ln_solubility).abs();
    }
    assert!(sum.iter().all(|sum: &f64| sum.abs() < 1e-12), "system {idx}: {proof:?} {sum:?}");
    assert!(gain < -1e-12 * size, "system {idx}: {gain}");
}

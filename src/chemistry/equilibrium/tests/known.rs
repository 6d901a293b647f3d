//! Closed forms, golden numbers of an independent solver, and what is refused.

use super::golden::GOLDEN;
use super::{carbonate, defect, mineral, power, primary, solve, solve_one};
use crate::chemistry::equilibrium::{MAX_IONIC_STRENGTH, Refusal, Speciation};
use crate::plan::chemistry::{Activity, Equilibrium, Secondary};

fn ideal(n: usize, secondaries: Vec<Secondary>) -> Equilibrium {
    let primaries = (0..n).map(|j| primary(j, 0.0, 0.0)).collect();
    Equilibrium { primaries, secondaries, minerals: Vec::new(), activity: Activity::Ideal }
}

fn complex(species: usize, ln_constant: f64, coefficients: &[(usize, f64)]) -> Secondary {
    Secondary { species, charge: 0.0, ion_size: 0.0, ln_constant, coefficients: coefficients.to_vec() }
}

fn assert_close(value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance * expected.abs(), "{value:e}, expected {expected:e}");
}

/// `c_AB = ½(s − √(s² − 4 u_A u_B))` in 50 digits: 0.29851838400966602…
#[test]
fn one_complex_has_the_closed_form() {
    let pair = ideal(2, vec![complex(2, power(3.0), &[(0, 1.0), (1, 1.0)])]);
    let c = solve_one(&pair, &[0.3, 0.5]).unwrap();
    assert_close(c[2], 0.298518384009666, 2e-15);
    assert_close(c[0] + c[2], 0.3, 1e-15);
    assert_close(c[1] + c[2], 0.5, 1e-15);
}

/// The general solver, kept from the closed form by a complex that is never there, against it.
#[test]
fn closed_forms_and_the_iteration_agree() {
    let forms: [(usize, &[(usize, f64)]); 3] =
        [(2, &[(0, 1.0), (1, 1.0)]), (1, &[(0, 2.0)]), (1, &[(0, -1.0)])];
    for (n, nus) in forms {
        for log_k in [-30.0, -6.0, 0.0, 3.0, 12.0, 40.0] {
            let closed = ideal(n, vec![complex(n, power(log_k), nus)]);
            let general = ideal(n, vec![complex(n, power(log_k), nus), complex(n + 1, -1e6, nus)]);
            assert!(Speciation::new(&closed).unwrap().closed.is_some());
            assert!(Speciation::new(&general).unwrap().closed.is_none());
            for totals in [[0.3, 0.5], [1e-16, 10.0], [2.0, 1.0], [7.0, 1e-9]] {
                let found = solve_one(&closed, &totals[..n]).unwrap();
                let other = solve_one(&general, &totals[..n]).unwrap();
                assert!(defect(&closed, &totals[..n], &found) < 1e-15);
                for (found, other) in found.iter().zip(&other) {
                    assert!(
                        (found - other).abs() <= 1e-13 * other.abs(),
                        "{nus:?} {log_k} {totals:?} {found:e} {other:e}"
                    );
                }
            }
        }
    }
    let water = ideal(1, vec![complex(1, power(-8.0), &[(0, -1.0)])]);
    assert_close(solve_one(&water, &[-5.0]).unwrap()[0], 2e-9, 1e-8);
    let neutral = solve_one(&water, &[0.0]).unwrap();
    assert_close(neutral[0], 1e-4, 2e-15);
    assert_eq!(neutral[0], neutral[1]);
}

#[test]
fn carbonate_and_calcite_match_an_independent_solver() {
    let mut n_calcite = 0;
    for golden in GOLDEN {
        let equilibrium = carbonate(golden.activity, golden.with_calcite);
        let found = solve_one(&equilibrium, &golden.totals).unwrap();
        for (found, expected) in found.iter().zip(&golden.found) {
            assert_close(*found, *expected, 1e-11);
        }
        assert!(defect(&equilibrium, &golden.totals, &found) < 1e-12);
        n_calcite += usize::from(found.len() == 10 && found[9] > 0.0);
    }
    assert_eq!((GOLDEN.len(), n_calcite), (24, 8));
}

#[test]
fn a_total_of_zero_is_a_concentration_of_zero() {
    let equilibrium = carbonate(Activity::Davies, true);
    let c = solve_one(&equilibrium, &[1.0, 2.0, 0.0]).unwrap();
    assert!([2, 6, 7, 8, 9].iter().all(|&species| c[species] == 0.0));
    assert!([0, 1, 3, 4, 5].iter().all(|&species| c[species] > 0.0));
    // B can come from A, but there is no A: so there is no B either, and nothing of both.
    let chain = ideal(2, vec![complex(2, power(9.0), &[(0, 1.0), (1, -1.0)])]);
    assert_eq!(solve_one(&chain, &[0.0, 0.0]).unwrap(), [0.0; 3]);
    // With a total of zero, but made of something: not zero.
    let split = ideal(2, vec![complex(2, power(0.0), &[(0, 1.0), (1, -1.0)])]);
    let c = solve_one(&split, &[1.0, 0.0]).unwrap();
    assert_close(c[1], c[2], 1e-14);
    assert!(c[1] > 0.5);
}

#[test]
fn what_has_no_equilibrium_is_refused_with_the_reason() {
    let pair = ideal(2, vec![complex(2, 1.0, &[(0, 1.0), (1, 1.0)])]);
    assert_eq!(solve_one(&pair, &[-1.0, 2.0]), Err(Refusal::Infeasible));
    assert_eq!(solve_one(&pair, &[1.0, f64::NAN]), Err(Refusal::NotFinite { primary: 1 }));
    let carbonate = |activity| carbonate(activity, false);
    assert_eq!(solve_one(&carbonate(Activity::Davies), &[1.0, -1e-9, 1.0]), Err(Refusal::Infeasible));
    let infinite = [f64::INFINITY, 1.0, 1.0];
    assert_eq!(solve_one(&carbonate(Activity::Ideal), &infinite), Err(Refusal::NotFinite { primary: 0 }));
    // 3 mol/L of calcium carbonate solution and its base: no model of these.
    for activity in [Activity::Davies, Activity::DebyeHuckel, Activity::ExtendedDebyeHuckel] {
        match solve_one(&carbonate(activity), &[3000.0, 1500.0, 1500.0]) {
            Err(Refusal::IonicStrength { value }) => assert!(value > MAX_IONIC_STRENGTH),
            other => panic!("{activity:?}: {other:?}"),
        }
    }
    let mut sizeless = super::carbonate(Activity::ExtendedDebyeHuckel, false);
    sizeless.primaries[1].ion_size = 0.0;
    assert!(Speciation::new(&sizeless).is_err());
}

/// A refused particle leaves the others alone, and the first one is named.
#[test]
fn the_first_refused_particle_is_named_and_the_others_are_solved() {
    let speciation = Speciation::new(&carbonate(Activity::Ideal, false)).unwrap();
    let mut totals = vec![vec![1.0; 30], vec![2.0; 30], vec![0.5; 30]];
    totals[1][21] = -1.0;
    totals[2][7] = -1.0;
    let found = solve(&speciation, &totals, None);
    assert_eq!(found.effort, Err((7, Refusal::Infeasible)));
    assert!(found.concentrations[0][21].is_nan() && found.concentrations[4][7].is_nan());
    let others = (0..30).filter(|idx| ![7, 21].contains(idx));
    assert!(others.into_iter().all(|idx| found.concentrations[4][idx] == found.concentrations[4][0]));
}

/// Two polymorphs: only the stable one is ever there, and hydroxide beside carbonate when both are too much.
#[test]
fn minerals_compete() {
    let mut equilibrium = carbonate(Activity::Ideal, true);
    equilibrium.minerals.push(mineral(10, -8.336, &[(1, 1.0), (2, 1.0)]));
    equilibrium.minerals.push(mineral(11, 22.8, &[(0, -2.0), (2, 1.0)]));
    let only_calcite = solve_one(&equilibrium, &[2.0, 2.0, 1.0]).unwrap();
    assert!(only_calcite[9] > 0.05 && only_calcite[10] == 0.0 && only_calcite[11] == 0.0);
    let both = solve_one(&equilibrium, &[-400.0, 20.0, 250.0]).unwrap();
    assert!(both[9] > 15.0 && both[10] == 0.0 && both[11] > 100.0, "{both:?}");
    let saturation = |row: &crate::plan::chemistry::Mineral| {
        let logs = row.coefficients.iter().map(|&(j, nu)| nu * crate::maths::scalar::ln(both[j]));
        logs.sum::<f64>() - row.ln_solubility
    };
    let [calcite, aragonite, portlandite] = [0, 1, 2].map(|k| saturation(&equilibrium.minerals[k]));
    assert!(calcite.abs() < 1e-11 && portlandite.abs() < 1e-11 && aragonite < -0.3);
}

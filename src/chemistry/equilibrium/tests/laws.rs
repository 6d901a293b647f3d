//! What holds for every system: order, neighbours, width, memory, slopes.

use super::random::Dice;
use super::{Found, carbonate, power, primary, solve, solve_one};
use crate::chemistry::equilibrium::{LANES, Speciation, Totals};
use crate::maths::wide::Width;
use crate::plan::chemistry::{Activity, Equilibrium, Secondary};
use proptest::prelude::*;

const MODELS: [Activity; 4] =
    [Activity::Ideal, Activity::DebyeHuckel, Activity::ExtendedDebyeHuckel, Activity::Davies];

/// Waters between acid and base, fresh and salty, some without calcium.
fn waters(n: usize, seed: u64) -> Vec<Vec<f64>> {
    let mut dice = Dice::new(seed);
    let mut totals = vec![Vec::new(), Vec::new(), Vec::new()];
    for _ in 0..n {
        let carbon = crate::maths::scalar::exp(power(dice.uniform(-4.0, 1.5)));
        totals[0].push(carbon * dice.uniform(-1.5, 3.0));
        totals[1].push(carbon);
        let calcium = carbon * crate::maths::scalar::exp(power(dice.uniform(-2.0, 0.7)));
        totals[2].push(if dice.below(6) == 0 { 0.0 } else { calcium });
    }
    totals
}

fn assert_same(a: &[Vec<f64>], b: &[Vec<f64>]) {
    let bits = |columns: &[Vec<f64>]| columns.iter().flatten().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(a), bits(b));
}

fn solve_with(speciation: &Speciation, totals: &[Vec<f64>], width: Width) -> Vec<Vec<f64>> {
    let mut concentrations = vec![vec![0.0; totals[0].len()]; speciation.species().len()];
    let totals: Vec<&[f64]> = totals.iter().map(Vec::as_slice).collect();
    let mut out: Vec<&mut [f64]> = concentrations.iter_mut().map(Vec::as_mut_slice).collect();
    let columns = Totals { totals: &totals, memory: &mut [], concentrations: &mut out };
    speciation.solve(width, columns, &mut speciation.workspace()).unwrap();
    concentrations
}

#[test]
fn a_particle_does_not_see_its_neighbours_nor_the_width_of_the_code() {
    let totals = waters(203, 1);
    for activity in MODELS {
        let speciation = Speciation::new(&carbonate(activity, true)).unwrap();
        let wide = solve_with(&speciation, &totals, Width::widest());
        assert_same(&wide, &solve_with(&speciation, &totals, Width::baseline()));
        let reversed: Vec<Vec<f64>> = totals.iter().map(|c| c.iter().rev().copied().collect()).collect();
        let mut back = solve_with(&speciation, &reversed, Width::widest());
        back.iter_mut().for_each(|column| column.reverse());
        assert_same(&wide, &back);
        for idx in 0..20 {
            let one: Vec<Vec<f64>> = totals.iter().map(|column| vec![column[idx]]).collect();
            let alone = solve_with(&speciation, &one, Width::widest());
            assert!(alone.iter().zip(&wide).all(|(alone, all)| alone[0].to_bits() == all[idx].to_bits()));
        }
    }
}

#[test]
fn a_memory_saves_work_and_changes_nothing_but_the_last_digits() {
    let totals = waters(500, 2);
    let moved: Vec<Vec<f64>> = totals.iter().map(|c| c.iter().map(|t| t * 1.003).collect()).collect();
    for activity in MODELS {
        for with_calcite in [false, true] {
            let speciation = Speciation::new(&carbonate(activity, with_calcite)).unwrap();
            let before: Found = solve(&speciation, &totals, None);
            let warm = solve(&speciation, &moved, Some(&before.memory));
            let cold = solve(&speciation, &moved, None);
            let (n_warm, n_cold) = (warm.effort.unwrap().evaluations, cold.effort.unwrap().evaluations);
            assert!(n_warm <= 4 * 500 && 2 * n_warm < n_cold, "{activity:?}: {n_warm} of {n_cold}");
            for (warm, cold) in warm.concentrations.iter().flatten().zip(cold.concentrations.iter().flatten())
            {
                assert!((warm - cold).abs() <= 1e-10 * cold.abs() + 1e-13, "{activity:?}: {warm:e} {cold:e}");
            }
        }
    }
}

/// Central differences of concentrations against the implicit derivatives.
#[test]
fn derivatives_are_those_of_the_concentrations() {
    let mut totals = waters(3 * LANES + 1, 3);
    let carbon = totals[1].clone();
    totals[2].iter_mut().zip(&carbon).for_each(|(ca, carbon)| *ca = ca.max(0.05 * carbon));
    let n = totals[0].len();
    for activity in MODELS {
        for with_calcite in [false, true] {
            let speciation = Speciation::new(&carbonate(activity, with_calcite)).unwrap();
            let n_species = speciation.species().len();
            let found = solve(&speciation, &totals, None).concentrations;
            let mut slopes = vec![vec![0.0; n]; n_species * 3];
            let given: Vec<&[f64]> = totals.iter().map(Vec::as_slice).collect();
            let known: Vec<&[f64]> = found.iter().map(Vec::as_slice).collect();
            let mut out: Vec<&mut [f64]> = slopes.iter_mut().map(Vec::as_mut_slice).collect();
            let mut workspace = speciation.workspace();
            speciation.derivatives(Width::widest(), &given, &known, &mut out, &mut workspace);
            for j in 0..3 {
                let shifted = |sign: f64| {
                    let mut moved = totals.clone();
                    moved[j].iter_mut().zip(&totals[1]).for_each(|(t, carbon)| *t += sign * 1e-5 * carbon);
                    solve(&speciation, &moved, None).concentrations
                };
                let (above, below) = (shifted(1.0), shifted(-1.0));
                for (s, idx) in (0..n_species).flat_map(|s| (0..n).map(move |idx| (s, idx))) {
                    let appears = with_calcite && (above[9][idx] > 0.0) != (below[9][idx] > 0.0);
                    let difference = (above[s][idx] - below[s][idx]) / (2e-5 * totals[1][idx]);
                    let error = (difference - slopes[s * 3 + j][idx]).abs();
                    assert!(
                        appears || error < 1e-5 * (1.0 + difference.abs()),
                        "{activity:?} {s} {j} {idx}: {error}"
                    );
                }
            }
        }
    }
}

/// At a total of zero a species has the slope with which it comes.
#[test]
fn what_is_absent_has_a_slope() {
    let equilibrium = carbonate(Activity::Ideal, false);
    let speciation = Speciation::new(&equilibrium).unwrap();
    let slope_at = |calcium: f64| {
        let totals = [[2.0], [2.1], [calcium]];
        let found = solve_one(&equilibrium, &[2.0, 2.1, calcium]).unwrap();
        let columns: Vec<[f64; 1]> = found.iter().map(|c| [*c]).collect();
        let known: Vec<&[f64]> = columns.iter().map(|c| c.as_slice()).collect();
        let given: Vec<&[f64]> = totals.iter().map(|c| c.as_slice()).collect();
        let mut slopes = vec![[0.0]; 27];
        let mut out: Vec<&mut [f64]> = slopes.iter_mut().map(|c| c.as_mut_slice()).collect();
        speciation.derivatives(Width::widest(), &given, &known, &mut out, &mut speciation.workspace());
        [2, 6, 7, 8].map(|species| slopes[species * 3 + 2][0])
    };
    let (zero, little) = (slope_at(0.0), slope_at(1e-9));
    assert!((zero.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    assert!(zero.iter().zip(little).all(|(a, b)| (a - b).abs() < 1e-8 * b));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    /// Names and order of primaries mean nothing, and constants of 40 decades in either direction hold.
    #[test]
    fn the_order_of_species_means_nothing(
        log_ks in prop::collection::vec(-40.0_f64..40.0, 4),
        sizes in prop::collection::vec(-12.0_f64..1.0, 3),
        turn in 1_usize..3,
    ) {
        let nus: [&[(usize, f64)]; 4] = [
            &[(0, 1.0), (1, 1.0)], &[(0, 2.0), (2, 1.0)], &[(1, 1.0), (2, -1.0)], &[(0, 1.0), (1, 1.0), (2, 3.0)],
        ];
        let build = |turn: usize| {
            let secondaries = nus.iter().zip(&log_ks).enumerate().map(|(i, (nus, log_k))| {
                let coefficients = nus.iter().map(|&(j, nu)| ((j + turn) % 3, nu)).collect();
                Secondary { species: 3 + i, charge: 0.0, ion_size: 0.0, ln_constant: power(*log_k), coefficients }
            });
            let primaries = (0..3).map(|j| primary(j, 0.0, 0.0)).collect();
            Equilibrium { primaries, secondaries: secondaries.collect(), minerals: vec![], activity: Activity::Ideal }
        };
        let totals: Vec<f64> = sizes.iter().map(|size| crate::maths::scalar::exp(power(*size))).collect();
        let turned: Vec<f64> = (0..3).map(|j| totals[(j + 3 - turn) % 3]).collect();
        let first = solve_one(&build(0), &totals).unwrap();
        let second = solve_one(&build(turn), &turned).unwrap();
        prop_assert!(super::defect(&build(0), &totals, &first) < 1e-12);
        let largest = totals.iter().fold(0.0, |a: f64, b| a.max(*b));
        for s in 0..7 {
            let other = second[if s < 3 { (s + turn) % 3 } else { s }];
            prop_assert!((first[s] - other).abs() <= 1e-9 * other + 1e-12 * largest, "{} {:e} {:e}", s, first[s], other);
        }
    }

    /// Sums over species are the totals, with all models of activities, with and without calcite.
    #[test]
    fn totals_are_conserved(hydrogen in -3.0_f64..6.0, carbon in 1e-6_f64..20.0, calcium in 0.0_f64..20.0) {
        for activity in MODELS {
            for with_calcite in [false, true] {
                let equilibrium = carbonate(activity, with_calcite);
                let c = solve_one(&equilibrium, &[hydrogen * carbon, carbon, calcium]).unwrap();
                prop_assert!(super::defect(&equilibrium, &[hydrogen * carbon, carbon, calcium], &c) < 1e-12);
                prop_assert!(c.iter().all(|c| *c >= 0.0));
            }
        }
    }
}

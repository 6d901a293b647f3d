//! Elimination of known systems, the arithmetic of constants, and what is refused.

use super::{Balance, Elimination, EliminationError, Written, eliminate};
use proptest::prelude::*;

fn balance(coefficients: &[(usize, f64)], ln_constant: f64) -> Balance {
    Balance { coefficients: coefficients.to_vec(), ln_constant }
}

fn written(species: usize, ln_constant: f64, coefficients: &[(usize, f64)]) -> Written {
    Written { species, ln_constant, coefficients: coefficients.to_vec() }
}

#[test]
fn a_complex_is_secondary_whichever_way_its_reaction_is_written() {
    let forwards = eliminate(&[false; 3], &[balance(&[(0, -1.0), (1, -1.0), (2, 1.0)], 2.0)]).unwrap();
    let backwards = eliminate(&[false; 3], &[balance(&[(0, 1.0), (1, 1.0), (2, -1.0)], -2.0)]).unwrap();
    assert_eq!(forwards.primaries, [0, 1]);
    assert_eq!(forwards.secondaries, [written(2, 2.0, &[(0, 1.0), (1, 1.0)])]);
    assert_eq!(forwards, backwards);
    let dimer = eliminate(&[false; 2], &[balance(&[(0, -2.0), (1, 1.0)], 1.0)]).unwrap();
    assert_eq!(dimer.secondaries, [written(1, 1.0, &[(0, 2.0)])]);
}

/// H 0, OH 1, CO3 2, HCO3 3, H2CO3 4, Ca 5, CaHCO3 6, calcite 7; step-wise dissociation as in tables.
fn carbonate() -> Vec<Balance> {
    vec![
        balance(&[(0, 1.0), (1, 1.0)], -1.0),
        balance(&[(4, -1.0), (0, 1.0), (3, 1.0)], -2.0),
        balance(&[(3, -1.0), (0, 1.0), (2, 1.0)], -4.0),
        balance(&[(6, -1.0), (5, 1.0), (3, 1.0)], -8.0),
        balance(&[(7, -1.0), (5, 1.0), (2, 1.0)], -16.0),
    ]
}

const MINERALS: [bool; 8] = [false, false, false, false, false, false, false, true];

#[test]
fn stepwise_constants_multiply() {
    let found = eliminate(&MINERALS, &carbonate()).unwrap();
    assert_eq!(found.primaries, [0, 2, 5]);
    let expected = [
        written(1, -1.0, &[(0, -1.0)]),
        written(3, 4.0, &[(0, 1.0), (1, 1.0)]),
        written(4, 6.0, &[(0, 2.0), (1, 1.0)]),
        written(6, 12.0, &[(0, 1.0), (1, 1.0), (2, 1.0)]),
    ];
    assert_eq!(found.secondaries, expected);
    assert_eq!(found.minerals, [written(7, -16.0, &[(1, 1.0), (2, 1.0)])]);
}

#[test]
fn a_mineral_that_dissolves_with_an_acid_is_written_over_primaries() {
    // CaCO3(s) + H ⇌ Ca + HCO3 with HCO3 ⇌ H + CO3: the product of both constants.
    let mut balances = carbonate();
    balances[4] = balance(&[(7, -1.0), (0, -1.0), (5, 1.0), (3, 1.0)], 5.0);
    let found = eliminate(&MINERALS, &balances).unwrap();
    assert_eq!(found.minerals, [written(7, 1.0, &[(1, 1.0), (2, 1.0)])]);
}

#[test]
fn reactions_that_add_up_to_nothing_are_named() {
    let mut balances = vec![balance(&[(9, -1.0), (10, 1.0)], 3.0)];
    balances.extend(carbonate());
    balances.push(balance(&[(4, -1.0), (0, 2.0), (2, 1.0)], -6.0));
    assert_eq!(
        eliminate(&MINERALS, &balances),
        Err(EliminationError::Redundant { reactions: vec![2, 3, 6] })
    );
    balances[6].ln_constant = -6.1;
    assert_eq!(
        eliminate(&MINERALS, &balances),
        Err(EliminationError::Contradiction { reactions: vec![2, 3, 6] })
    );
    let nothing = balance(&[(0, 1.0), (0, -1.0)], 0.0);
    assert_eq!(eliminate(&[], &[nothing]), Err(EliminationError::Redundant { reactions: vec![0] }));
}

#[test]
fn minerals_need_reactions_of_their_own() {
    // Gypsum ⇌ anhydrite and nothing else: neither dissolves.
    let only = balance(&[(0, -1.0), (1, 1.0)], 0.5);
    assert_eq!(eliminate(&[true, true], &[only]), Err(EliminationError::NoSolubility { mineral: 1 }));
    // With one solubility, that of the other follows.
    let balances = [balance(&[(0, -1.0), (1, 1.0)], 0.5), balance(&[(0, -1.0), (2, 1.0), (3, 1.0)], -8.0)];
    let found = eliminate(&[true, true, false, false], &balances);
    // K = e^0.5 says that the product is the more stable of the two, hence less soluble.
    let found = found.unwrap();
    assert_eq!(found.minerals[0], written(0, -8.0, &[(0, 1.0), (1, 1.0)]));
    assert_eq!(found.minerals[1], written(1, -8.5, &[(0, 1.0), (1, 1.0)]));
}

#[test]
fn the_phase_rule_is_kept() {
    // Two polymorphs of the same solubility.
    let polymorphs = |ln_other: f64| {
        let balances = [
            balance(&[(2, -1.0), (0, 1.0), (1, 1.0)], -8.0),
            balance(&[(3, -1.0), (0, 1.0), (1, 1.0)], ln_other),
        ];
        eliminate(&[false, false, true, true], &balances)
    };
    assert!(polymorphs(-7.0).is_ok());
    assert_eq!(polymorphs(-8.0), Err(EliminationError::PhaseRule { minerals: vec![2, 3] }));
    // Two oxides and the salt of both, at the one constant at which all three are stable.
    let three = |ln_salt: f64| {
        let balances = [
            balance(&[(2, -1.0), (0, 1.0)], -1.0),
            balance(&[(3, -1.0), (1, 1.0)], -2.0),
            balance(&[(4, -1.0), (0, 1.0), (1, 1.0)], ln_salt),
        ];
        eliminate(&[false, false, true, true, true], &balances)
    };
    assert!(three(-4.0).is_ok());
    assert_eq!(three(-3.0), Err(EliminationError::PhaseRule { minerals: vec![2, 3, 4] }));
    // One mineral dissolves to A, another takes A up: never both below saturation.
    let opposed = |ln_other: f64| {
        let balances = [balance(&[(1, -1.0), (0, 1.0)], -1.0), balance(&[(2, -1.0), (0, -1.0)], ln_other)];
        eliminate(&[false, true, true], &balances)
    };
    assert!(opposed(2.0).is_ok());
    assert_eq!(opposed(0.0), Err(EliminationError::NeverSaturated { minerals: vec![1, 2] }));
}

#[test]
fn an_activity_that_is_fixed_has_no_coefficients() {
    let found =
        eliminate(&[], &[balance(&[(0, 1.0)], -16.0), balance(&[(0, -1.0), (1, -1.0), (2, 1.0)], 1.0)]);
    let found = found.unwrap();
    assert_eq!(found.secondaries[0], written(0, -16.0, &[]));
    assert_eq!(found.secondaries[1], written(2, -15.0, &[(0, 1.0)]));
}

#[test]
fn nothing_is_eliminated_from_nothing() {
    assert_eq!(eliminate(&[false; 4], &[]), Ok(Elimination::default()));
}

/// Activities that follow from those of the primaries, by species.
fn activities(found: &Elimination, n: usize) -> Vec<f64> {
    let mut ln_a: Vec<f64> = (0..n).map(|species| 0.3 * species as f64 - 0.7).collect();
    for secondary in &found.secondaries {
        let over = secondary.coefficients.iter().map(|&(idx, nu)| nu * ln_a[found.primaries[idx]]);
        ln_a[secondary.species] = secondary.ln_constant + over.sum::<f64>();
    }
    ln_a
}

proptest! {
    /// Whatever is chosen, every reaction holds with the activities that follow, and totals count the same.
    #[test]
    fn every_reaction_holds_after_elimination(
        cells in prop::collection::vec(prop::collection::vec(-2_i8..=2, 7), 1..5),
        constants in prop::collection::vec(-40.0_f64..40.0, 5),
    ) {
        let balances: Vec<Balance> = cells.iter().zip(&constants).map(|(row, &ln_constant)| {
            let coefficients = row.iter().enumerate().map(|(s, &nu)| (s, f64::from(nu))).collect();
            Balance { coefficients, ln_constant }
        }).collect();
        if let Ok(found) = eliminate(&[false; 7], &balances) {
            prop_assert_eq!(found.secondaries.len(), balances.len());
            let ln_a = activities(&found, 7);
            for balance in &balances {
                let terms: Vec<f64> = balance.coefficients.iter().map(|&(s, nu)| nu * ln_a[s]).collect();
                let size = terms.iter().map(|term| term.abs()).sum::<f64>() + balance.ln_constant.abs();
                prop_assert!((terms.iter().sum::<f64>() - balance.ln_constant).abs() < 1e-10 * (1.0 + size));
                // A reaction turns no total into another.
                for (idx, &primary) in found.primaries.iter().enumerate() {
                    let written = |s: usize| found.secondaries.iter().find(|w| w.species == s);
                    let weight = |s: usize| written(s).map_or(f64::from(u8::from(s == primary)), |w| {
                        w.coefficients.iter().find(|c| c.0 == idx).map_or(0.0, |c| c.1)
                    });
                    let change: f64 = balance.coefficients.iter().map(|&(s, nu)| nu * weight(s)).sum();
                    prop_assert!(change.abs() < 1e-9);
                }
            }
        } else {
            let rank = nalgebra::DMatrix::from_fn(balances.len(), 7, |i, j| f64::from(cells[i][j])).rank(1e-9);
            prop_assert!(rank < balances.len());
        }
    }
}

//! The scene of `experiments/reactive_aquifer_2d`: what conservation says of it, and what masses say.

#[path = "support/scene.rs"]
mod scene;

use lamella::engine::snapshot::Values;
use lamella::plan::OutputKind;
use scene::{Finished, edited, run, tell};

const SCENE: &str = include_str!("../experiments/reactive_aquifer_2d/reactive_aquifer_2d.lam");

/// Amounts of the species of the scene at its times, mol/m.
fn totals(finished: &Finished) -> Vec<(f64, Vec<f64>)> {
    let own = finished.snapshots.iter().filter_map(|snapshot| match &snapshot.values {
        Values::Total { amount } => Some((snapshot.t / 86_400.0, amount.clone())),
        _ => None,
    });
    own.collect()
}

/// Means of the first species of the last map.
fn last_map(finished: &Finished, species: usize) -> Vec<f64> {
    let is_map = |idx: usize| finished.plan.outputs[idx].kind == OutputKind::Map;
    let mut own = finished.snapshots.iter().filter(|snapshot| is_map(snapshot.output_idx));
    match own.next_back().map(|snapshot| &snapshot.values) {
        Some(Values::Binned { mean, .. }) => mean[species].clone(),
        _ => panic!("no map"),
    }
}

/// Fewer parcels in fewer bins.
fn smaller() -> String {
    let text = edited(SCENE, "n   = 500_000", "n   = 100_000");
    let text = edited(&text, "average bins 150 x 60", "average bins 50 x 20");
    edited(&text, "on 150 x 60", "on 50 x 20")
}

/// Every parcel has A and B of c0 in all before they meet: A + B + 2 C is c0 times the water. What comes in is even, so
/// A + C grows evenly until the first of it has arrived.
#[test]
fn what_meets_in_an_aquifer_is_neither_made_nor_lost() {
    let finished = run(&smaller());
    finished.keeps_its_books();
    let totals = totals(&finished);
    let pore_water = 0.25 * 100.0 * 40.0;
    let rate = (totals[2].1[0] + totals[2].1[2]) / totals[2].0;
    for (t, amounts) in &totals {
        let [a, b, c] = amounts[..] else { panic!("three species") };
        tell(&format!("{t:.0} d: A {a:.2}, B {b:.2}, C {c:.2} mol/m"));
        // Parcels go out by chance, about a hundred of 100 000, and steps of half a cell hold 0.5 % of them back.
        assert!(((a + b + 2.0 * c) / pore_water - 1.0).abs() < 1e-2, "{t} d: {amounts:?}");
        if *t > 0.0 && *t < 31.0 {
            assert!(((a + c) / (rate * t) - 1.0).abs() < 1e-3, "{t} d: {amounts:?}");
        }
        assert!(a >= 0.0 && b >= 0.0 && c >= 0.0);
    }
    assert!(totals.iter().any(|(_, amounts)| amounts[2] > 20.0), "they meet");
}

/// Well mixed within bins, what has met follows from the means of two tracers: c = min(ā, b̄) in each bin. Masses of the
/// tracers, which know neither parcels nor reactions, give the same means, with noise of their own.
#[test]
fn masses_say_how_much_has_met() {
    let zones = "  fast: fraction 1 - eta, rate instant\n  slow: fraction eta,     rate chi\n";
    let mixed = edited(&edited(&smaller(), zones, "  all: fraction 1, rate instant\n"), "100_000", "400_000");
    let drop = |text: &str, piece: &str| edited(text, piece, "");
    let mixed = drop(&mixed, "param eta = 0.5 in 0 .. 1        \"slow mixing fraction\"\n");
    let mixed = drop(&mixed, "param chi = 0.1 /d               \"slow mixing rate\"\n");
    let parcels = run(&mixed);
    parcels.keeps_its_books();
    let masses = edited(&mixed, "particles fluid n stratified", "particles mass n");
    let masses =
        edited(&masses, "species A, B, C\nreaction meeting: A + B -> C @ instant\n", "species A, B\n");
    let masses = drop(&masses, "mixing zones {\n  all: fraction 1, rate instant\n}\naverage bins 50 x 20\n");
    let masses = edited(&masses, "map    A, B, C", "map    A, B");
    let masses = edited(&masses, "total  A, B, C", "total  A, B");
    let masses = drop(&masses, "output mixing A, B every 5 d\noutput moments C every 5 d\n");
    let masses = drop(&masses, "measure most = linf(total.C) \"largest amount of C\"\n");
    let masses = run(&masses);
    let per_bin = 0.25 * 4000.0 / 1000.0;
    let (a, b) = (last_map(&masses, 0), last_map(&masses, 1));
    let met: f64 = a.iter().zip(b).map(|(a, b)| a.min(b) * per_bin).sum();
    let found: f64 = last_map(&parcels, 2).iter().map(|c| c * per_bin).sum();
    tell(&format!("C {found:.2} mol/m in parcels, {met:.2} by masses"));
    // Both have some hundred particles in a bin: noise takes a little from the smaller of two means.
    assert!((found / met - 1.0).abs() < 0.05, "{found} {met}");
}

//! The two ends of mixing (P5-e): well mixed and not mixed at all.

use crate::support::*;
use lamella::engine::snapshot::{Snapshot, Values};
use lamella::plan::*;

const T: f64 = 600.0;

fn product(snapshots: &[Snapshot]) -> f64 {
    let product = snapshots.iter().find_map(|snapshot| match &snapshot.values {
        Values::Total { amount } => Some(amount[0]),
        _ => None,
    });
    product.unwrap() * 100.0
}

fn with(mixing: Option<Mixing>) -> Plan {
    let mut plan = front(100_000, 150, T, 5.0);
    plan.mixing = mixing;
    plan.outputs = front_outputs(150, vec![T], vec![T]);
    plan
}

fn well_mixed() -> Mixing {
    Mixing { zones: vec![zone("fast", 1.0, ZoneRate::Instant)], is_well_mixed: true, averaging: None }
}

/// ∫c̄_AB = 2√(Dt/π). The position of the front's particles scatters the product by less than
/// 2.4 N^-½ = 0.008 cm; allowed are four times that. Covariances vanish, as every U is its bin's mean.
#[test]
fn instant_exchange_is_well_mixed() {
    let (_, snapshots) = run(&with(Some(well_mixed())));
    let expected = 2.0 * (D * T / std::f64::consts::PI).sqrt() * 100.0;
    assert!((product(&snapshots) - expected).abs() < 0.03, "{} {expected}", product(&snapshots));
    for snapshot in &snapshots {
        match &snapshot.values {
            Values::Mixing(states) => assert_eq!(states[0].m_cov, 0.0),
            Values::Covariance { covariance, .. } => {
                assert!(covariance[0].iter().all(|value| value.abs() < 1e-25));
            }
            _ => {}
        }
    }
}

/// A very fast zone alone is the same limit: exchange within one step.
#[test]
fn fast_exchange_tends_to_well_mixed() {
    let zones = vec![zone("slow", 1.0, ZoneRate::Finite(1e3))];
    let (_, snapshots) = run(&with(Some(Mixing { zones, is_well_mixed: false, averaging: None })));
    // Means are passed on every step: D_num = Δ²/(12Δt) = 1.7e-8 of 1.3e-7 m²/s, 6 % of the product.
    let expected = 2.0 * ((D + 1e-6 / 60.0) * T / std::f64::consts::PI).sqrt() * 100.0;
    assert!((product(&snapshots) / expected - 1.0).abs() < 0.04, "{} {expected}", product(&snapshots));
}

#[test]
fn without_exchange_nothing_reacts() {
    let zones = vec![zone("slow", 1.0, ZoneRate::Finite(0.0))];
    for mixing in [None, Some(Mixing { zones, is_well_mixed: false, averaging: None })] {
        let (outcome, snapshots) = run(&with(mixing));
        assert_eq!(product(&snapshots), 0.0);
        assert_eq!(outcome.mass_defect, [0.0]);
        for snapshot in &snapshots {
            if let Values::Mixing(states) = &snapshot.values {
                // A·B = 0 on every particle: M = 0, up to the bias of few particles per bin.
                assert!(states[0].m.abs() < 1e-12, "{:?}", states[0]);
            }
        }
    }
}

//! Uniform particles stay uniform between reflecting and periodic sides, whatever the step.

use crate::support::*;
use lamella::engine::snapshot::Values;
use lamella::plan::*;

/// χ² per degree of freedom of the counts: its scatter is √(2/dof); allowed are five of it.
fn check(side: Side, dispersion: f64, drift: f64, n_axes: usize) {
    let bins = if n_axes == 1 { vec![100] } else { vec![10, 12] };
    let n_bins: usize = bins.iter().product();
    let n_particles = 200_000;
    let axes = (0..n_axes).map(|idx| axis(idx, -1.0, 1.0 + idx as f64, side, 1)).collect();
    let mut walk = walk(n_axes, dispersion);
    walk.drift.fill(drift);
    let mut plan = plain(axes, walk, n_particles, 20.0, 1.0);
    plan.particles.placement = Placement::Random;
    plan.outputs = vec![output(OutputKind::Map, vec![Quantity::Species(0)], bins, vec![20.0])];
    let (_, snapshots) = run(&plan);
    let Values::Binned { n_particles: counts, mean, standard_error } = &snapshots[0].values else { panic!() };
    assert_eq!(counts.iter().sum::<u64>(), n_particles);
    assert!(mean[0].iter().all(|&c| c == 1.0) && standard_error[0].iter().all(|&e| e == 0.0));
    let expected = n_particles as f64 / n_bins as f64;
    let square: f64 = counts.iter().map(|&n| (n as f64 - expected).powi(2) / expected).sum();
    let dof = n_bins as f64 - 1.0;
    assert!((square / dof - 1.0).abs() < 5.0 * (2.0 / dof).sqrt(), "{side:?} {dispersion}: {}", square / dof);
}

#[test]
fn between_reflecting_sides() {
    for dispersion in [1e-3, 0.1, 50.0] {
        check(Side::Reflect, dispersion, 0.0, 1);
    }
    check(Side::Reflect, 0.1, 0.0, 2);
}

#[test]
fn between_periodic_sides_with_drift() {
    for dispersion in [1e-3, 0.1, 50.0] {
        check(Side::Periodic, dispersion, 0.37, 1);
    }
    check(Side::Periodic, 0.1, -3.7, 2);
}

/// Outside open sides particles keep their values, count in totals and in no bin.
#[test]
fn open_sides_lose_no_amount() {
    let mut plan = front(20_000, 50, 40_000.0, 200.0);
    plan.axes[0].low_side = Side::Open;
    plan.axes[0].high_side = Side::Open;
    let quantities = vec![Quantity::Species(0), Quantity::Species(2)];
    let times = vec![0.0, 40_000.0];
    plan.reactions.clear();
    plan.outputs = vec![
        output(OutputKind::Total, quantities, vec![], times.clone()),
        output(OutputKind::Map, vec![Quantity::Species(0)], vec![50], times),
    ];
    let (outcome, snapshots) = run(&plan);
    assert!(outcome.mass_defect[0] < 1e-12);
    let mut totals = Vec::new();
    for snapshot in &snapshots {
        match &snapshot.values {
            Values::Total { amount } => totals.push(amount[0]),
            Values::Binned { n_particles, .. } => {
                let inside: u64 = n_particles.iter().sum();
                // A uniform start spread by √(2Dt) = 10 cm over a column of 15 cm: about half stay.
                assert_eq!(inside == 20_000, snapshot.t == 0.0);
                assert!(inside > 5_000);
            }
            other => panic!("{other:?}"),
        }
    }
    assert!((totals[1] / totals[0] - 1.0).abs() < 1e-12, "{totals:?}");
}

//! Outputs within a step: the law of the Brownian bridge, and exact relaxation.

use crate::support::*;
use lamella::engine::snapshot::{Snapshot, Values};
use lamella::plan::*;

fn positions(snapshot: &Snapshot) -> &[f64] {
    match &snapshot.values {
        Values::Particles { positions, .. } => &positions[0],
        other => panic!("{other:?}"),
    }
}

/// `Var X(θΔt) = 2DθΔt` and `Cov(X(θΔt), X(Δt)) = 2DθΔt`, with drift `vθΔt`; five scatters allowed.
#[test]
fn variance_and_covariance_grow_with_the_fraction() {
    let n_particles = 200_000;
    let (dispersion, dt, drift) = (0.3, 2.0, 0.8);
    let mut walk = walk(1, dispersion);
    walk.drift[0] = drift;
    let mut plan = plain(vec![axis(0, 0.0, 1.0, Side::Open, 1)], walk, n_particles, dt, dt);
    let fractions = [0.1, 0.5, 0.85];
    let mut times = vec![0.0];
    times.extend(fractions.map(|fraction| fraction * dt));
    times.push(dt);
    plan.outputs = vec![all_particles(&plan, times)];
    let (_, snapshots) = run(&plan);
    let (start, end) = (positions(&snapshots[0]), positions(&snapshots[4]));
    let n = n_particles as f64;
    for (snapshot, fraction) in snapshots[1..4].iter().zip(fractions) {
        let within = positions(snapshot);
        let variance = 2.0 * dispersion * fraction * dt;
        let moved = |p: usize| within[p] - start[p] - drift * fraction * dt;
        let moved_all = |p: usize| end[p] - start[p] - drift * dt;
        let mean = (0..within.len()).map(moved).sum::<f64>() / n;
        let square = (0..within.len()).map(|p| moved(p).powi(2)).sum::<f64>() / n;
        let product = (0..within.len()).map(|p| moved(p) * moved_all(p)).sum::<f64>() / n;
        let scatter = (variance * 2.0 * dispersion * dt + variance * variance).sqrt() / n.sqrt();
        assert!(mean.abs() < 5.0 * (variance / n).sqrt(), "{mean}");
        assert!((square - variance).abs() < 5.0 * variance * (2.0 / n).sqrt(), "{square} {variance}");
        assert!((product - variance).abs() < 5.0 * scatter, "{product} {variance}");
    }
}

/// Without motion the deviation of every particle decays by e^{−χt/2} at any time.
#[test]
fn relaxation_is_exact_within_a_step() {
    let mut plan = front(1000, 1, 1000.0, 400.0);
    plan.walk = walk(1, 0.0);
    plan.reactions.clear();
    let times = vec![0.0, 100.0, 399.0, 400.0, 617.0, 1000.0];
    plan.mixing = dual_rate(1.0, CHI);
    plan.outputs = vec![all_particles(&plan, times)];
    let (_, snapshots) = run(&plan);
    for snapshot in &snapshots {
        let Values::Particles { concentrations, .. } = &snapshot.values else { panic!() };
        let expected = 0.5 + 0.5 * (-0.5 * CHI * snapshot.t).exp();
        assert!((concentrations[0][0] - expected).abs() < 1e-12, "{}", snapshot.t);
    }
}

//! The mixing front of P5-a against its exact limit.

mod support;

use lamella::engine::snapshot::{Snapshot, Values};
use support::*;

fn profiles(snapshots: &[Snapshot]) -> Vec<(f64, &[Vec<f64>])> {
    snapshots
        .iter()
        .filter_map(|snapshot| match &snapshot.values {
            Values::Binned { mean, .. } => Some((snapshot.t, &mean[..])),
            _ => None,
        })
        .collect()
}

/// Limits of methods, section 7.6 (N → ∞): ∫c̄_AB in cm. At 2·10⁵ particles one run scatters by
/// 2.4 N^-½ = 0.0054 cm and is biased by −0.65 bins/N = −0.001 cm; four scatters and the bias are allowed.
#[test]
fn product_of_the_front_reaches_the_exact_limit() {
    let times = vec![619.0, 916.0, 1114.0, 1510.0];
    let limits = [0.826012, 1.045973, 1.177690, 1.414961];
    let mut plan = front(200_000, 300, 1510.0, 2.0);
    plan.outputs = front_outputs(300, times, vec![0.0, 500.0, 1000.0]);
    let (outcome, snapshots) = run(&plan);
    assert!(outcome.mass_defect.iter().all(|&defect| defect < 1e-12), "{:?}", outcome.mass_defect);
    for ((t, mean), limit) in profiles(&snapshots).into_iter().zip(limits) {
        let integral: f64 = mean[2].iter().sum::<f64>() * 0.05;
        assert!((integral - limit).abs() < 0.023, "{t}: {integral}");
    }
}

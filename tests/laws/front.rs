//! The mixing front of P5-a against its exact limit (methods, section 7.6).

use crate::support::*;
use lamella::engine::snapshot::Values;

const TIMES: [f64; 4] = [619.0, 916.0, 1114.0, 1510.0];

/// 3·10⁵ particles, 150 bins: one run scatters by 2.4 N^-½ = 0.0044 cm in ∫c̄_AB and by
/// 3e-4·√(10/3) = 5.5e-4 in ∫Σ; the bias −0.65 bins/N is 3e-4 cm, that of a bin of 0.1 cm, χΔ²/24,
/// is below 4e-7 cm²/s. Allowed are four scatters.
#[test]
fn product_and_covariance_of_the_front_reach_their_limits() {
    let products = [0.826012, 1.045973, 1.177690, 1.414961];
    let covariances = [-0.12054, -0.12292, -0.12111, -0.11390];
    let mut plan = front(300_000, 150, 1510.0, 2.0);
    plan.outputs = front_outputs(150, TIMES.to_vec(), vec![]);
    let (outcome, snapshots) = run(&plan);
    assert!(outcome.mass_defect.iter().all(|&defect| defect < 1e-12), "{:?}", outcome.mass_defect);
    let width = 15.0 / 150.0;
    for snapshot in &snapshots {
        let time_idx = TIMES.iter().position(|&t| t == snapshot.t).unwrap();
        match &snapshot.values {
            Values::Binned { mean, .. } => {
                let integral = mean[2].iter().sum::<f64>() * width;
                assert!((integral - products[time_idx]).abs() < 0.018, "{}: {integral}", snapshot.t);
                // A and AB together are what A was: half of the column.
                let sum: f64 = mean[0].iter().zip(&mean[2]).map(|(a, ab)| a + ab).sum();
                assert!((sum * width - 7.5).abs() < 0.05, "{sum}");
            }
            Values::Covariance { covariance, .. } => {
                let integral = covariance[0].iter().sum::<f64>() * width;
                assert!((integral - covariances[time_idx]).abs() < 0.0022, "{}: {integral}", snapshot.t);
            }
            other => panic!("{other:?}"),
        }
    }
}

/// The total is the sum over particles, the profile the mean over bins: with equal volumes of all
/// particles and none outside they are one number, up to the rounding of sums.
#[test]
fn total_is_the_volume_times_the_mean_of_particles() {
    let mut plan = front(50_000, 100, 100.0, 2.0);
    plan.outputs = front_outputs(60, vec![100.0], vec![100.0]);
    let (_, snapshots) = run(&plan);
    let volume = plan.particles.volume;
    let mut from_profile = 0.0;
    for snapshot in &snapshots {
        if let Values::Binned { mean, n_particles, .. } = &snapshot.values {
            from_profile = mean[2].iter().zip(n_particles).map(|(c, &n)| c * n as f64 * volume).sum();
        }
        if let Values::Total { amount } = &snapshot.values {
            assert!((amount[0] - from_profile).abs() < 1e-12 * from_profile);
        }
    }
}

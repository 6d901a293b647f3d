//! Mean and covariance of displacements in one to three dimensions (methods, section 10.0, item 1).

use crate::support::*;
use lamella::engine::snapshot::Values;
use lamella::plan::*;

/// Checks displacements against `drift·t` and `B Bᵀ t`: the law holds for any step. Scatter of a
/// covariance: √((C_ii C_jj + C_ij²)/N); allowed are five of it.
fn check(drift: Vec<f64>, spread: Vec<f64>, normals: Normals) {
    let n_axes = drift.len();
    let n_particles = 100_000;
    let duration = 10.0;
    let axes = (0..n_axes).map(|idx| axis(idx, 0.0, 1.0 + idx as f64, Side::Open, 1)).collect();
    let walk = Walk { drift: drift.clone(), spread: spread.clone(), normals };
    let mut plan = plain(axes, walk, n_particles, duration, 0.7);
    plan.outputs = vec![all_particles(&plan, vec![0.0, duration])];
    let (_, snapshots) = run(&plan);
    let [start, end] = [0, 1].map(|idx| match &snapshots[idx].values {
        Values::Particles { positions, .. } => positions,
        other => panic!("{other:?}"),
    });
    let n = n_particles as f64;
    let moved: Vec<Vec<f64>> =
        start.iter().zip(end).map(|(a, b)| a.iter().zip(b).map(|(a, b)| b - a).collect()).collect();
    let means: Vec<f64> = moved.iter().map(|axis: &Vec<f64>| axis.iter().sum::<f64>() / n).collect();
    let entry =
        |row: usize, column: usize| if column <= row { spread[row * (row + 1) / 2 + column] } else { 0.0 };
    let tensor = |i: usize, j: usize| (0..n_axes).map(|k| entry(i, k) * entry(j, k)).sum::<f64>() * duration;
    for i in 0..n_axes {
        let allowed = 5.0 * (tensor(i, i) / n).sqrt();
        assert!((means[i] - drift[i] * duration).abs() <= allowed + 1e-12, "mean {i}: {}", means[i]);
        for j in 0..=i {
            let products = moved[i].iter().zip(&moved[j]).map(|(a, b)| (a - means[i]) * (b - means[j]));
            let covariance = products.sum::<f64>() / n;
            let allowed = 5.0 * ((tensor(i, i) * tensor(j, j) + tensor(i, j).powi(2)) / n).sqrt();
            assert!(
                (covariance - tensor(i, j)).abs() <= allowed + 1e-12,
                "{i} {j}: {covariance} {}",
                tensor(i, j)
            );
        }
    }
}

#[test]
fn one_dimension() {
    check(vec![1.0], vec![0.45], Normals::Single);
    check(vec![-0.3], vec![0.45], Normals::Double);
}

#[test]
fn two_dimensions_with_the_full_tensor() {
    check(vec![1.0, 0.0], vec![0.45, -0.2, 0.15], Normals::Single);
}

#[test]
fn three_dimensions_with_the_full_tensor() {
    check(vec![1.0, -0.5, 0.25], vec![0.45, 0.1, 0.15, -0.2, 0.05, 0.3], Normals::Single);
    check(vec![1.0, -0.5, 0.25], vec![0.45, 0.1, 0.15, -0.2, 0.05, 0.3], Normals::Double);
}

#[test]
fn drift_alone_moves_all_alike() {
    check(vec![0.5, 0.0, -1.0], vec![0.0; 6], Normals::Single);
}

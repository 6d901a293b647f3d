//! Random media: statistics, balance, and how the work grows.

use super::*;

/// Mean, and variance by its square.
fn moments(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    (mean, values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / n)
}

/// The effective conductivity and the variances of velocity of 400 × 200 cells, 8 cells to a length, over six
/// samples, against an independent program's six (which also gives the bounds of the conductivity). One sample scatters
/// by 10, 10 and 15 % in the variances, so the difference of two means of six by 6, 6 and 9 %: 2.5 times that is allowed.
#[test]
fn random_media_flow_as_they_should() {
    let expected = [
        (0.25, (0.99, 0.03), 0.088, 0.029, 0.15),
        (1.0, (0.97, 0.06), 0.365, 0.131, 0.15),
        (4.0, (0.88, 0.13), 1.61, 0.73, 0.22),
    ];
    for (variance, (effective, bound), along, across, tolerance) in expected {
        let mut sums = [0.0; 3];
        for seed in 0..6 {
            let solution = solve(random_medium([400, 200, 1], variance, seed)).unwrap();
            assert!(solution.worst_imbalance < 1e-12);
            let (mean, x) = moments(&solution.flow.flux[0]);
            let (_, y) = moments(&solution.flow.flux[1]);
            for (sum, value) in sums.iter_mut().zip([400.0 * mean, x / (mean * mean), y / (mean * mean)]) {
                *sum += value / 6.0;
            }
        }
        assert!((sums[0] - effective).abs() < bound, "{variance}: {sums:?}");
        close(sums[1], along, tolerance);
        close(sums[2], across, tolerance);
    }
}

/// Edges four times as long need less than 1.5 times the iterations. Every flow balances, also with conductivity a
/// hundred times less or more across, and its fluxes are those of its heads.
#[test]
fn the_work_hardly_grows_with_the_grid() {
    for sizes in [[[64, 64, 1], [128, 128, 1], [256, 256, 1]], [[10, 10, 10], [20, 20, 20], [40, 40, 40]]] {
        let iterations = |n, across: f64| {
            let mut problem = random_medium(n, 4.0, 1);
            problem.anisotropy = [1.0, across, across];
            let solution = solve(problem).unwrap();
            assert!(solution.worst_imbalance < 1e-12, "{n:?}: {}", solution.worst_imbalance);
            assert!(solution.residual < 1e-12, "{n:?}: {}", solution.residual);
            solution.iterations
        };
        let counts = sizes.map(|n| iterations(n, 1.0));
        assert!(2 * counts[2] < 3 * counts[0], "{counts:?}");
        for across in [0.01, 100.0] {
            let count = iterations(sizes[1], across);
            assert!(count < 3 * counts[1], "{across}: {count}, {counts:?}");
        }
    }
}

#[test]
fn fluxes_are_those_of_the_heads() {
    let problem = random_medium([30, 20, 10], 4.0, 2);
    let flow = solve(problem.clone()).unwrap().flow;
    let head = flow.head.unwrap();
    let mean = flow.flux[0].iter().sum::<f64>() / flow.flux[0].len() as f64;
    for cell in 200..problem.cells.n_cells() {
        let (face, _) = problem.cells.faces(0, problem.cells.place(cell));
        let [low, high] = [cell - 200, cell].map(|cell| problem.conductivity[cell]);
        let flux = 2.0 / (1.0 / low + 1.0 / high) * (head[cell - 200] - head[cell]);
        assert!((flow.flux[0][face] - flux).abs() < 1e-9 * mean, "{face}");
    }
}

/// Contrasts that no number can hold are refused, or solved: nothing between.
#[test]
fn absurd_contrasts_end() {
    for contrast in [1e8, 1e16, 1e100, 1e300] {
        let mut problem = random_medium([20, 20, 1], 1.0, 9);
        for (cell, value) in problem.conductivity.iter_mut().enumerate() {
            *value *= if (cell * 7919) % 13 < 5 { contrast } else { 1.0 / contrast };
        }
        match solve(problem) {
            Ok(solution) => assert!(solution.flow.imbalance().iter().all(|rest| rest.is_finite())),
            Err(error) => assert!(matches!(error, DarcyError::NotConverged { .. }), "{error}"),
        }
    }
}

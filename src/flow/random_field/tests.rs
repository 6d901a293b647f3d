//! Covariances of samples against those that were asked for; refusals.

use super::*;

fn unit_cells(n: [usize; 3]) -> Cells {
    Cells::equal([0.0; 3], n.map(|n| n as f64), n).unwrap()
}

fn covariance_at(field: &RandomField, lag: [usize; 3]) -> f64 {
    // A length along an axis of one cell is not read, and may be anything.
    let axes = (0..3).filter(|&axis| lag[axis] > 0);
    let squares: f64 = axes.map(|axis| (lag[axis] as f64 / field.lengths[axis]).powi(2)).sum();
    let distance = if field.covariance == Covariance::Exponential { squares.sqrt() } else { squares };
    field.variance * exp(-distance)
}

/// Mean product of values a lag apart in one sample; the mean of the field is known to be zero.
fn product_at(cells: &Cells, values: &[f64], lag: [usize; 3]) -> f64 {
    let n = cells.n();
    let (mut sum, mut count) = (0.0, 0.0);
    for i in 0..n[0] - lag[0] {
        for j in 0..n[1] - lag[1] {
            for k in 0..n[2] - lag[2] {
                let other = cells.cell([i + lag[0], j + lag[1], k + lag[2]]);
                sum += values[cells.cell([i, j, k])] * values[other];
                count += 1.0;
            }
        }
    }
    sum / count
}

/// Means over samples agree with the covariance within four standard errors, which are at most 5 % of the
/// variance. The lags reach across the domain: a box that is too small would show there.
fn check(n: [usize; 3], covariance: Covariance, lengths: [f64; 3], lags: &[[usize; 3]]) {
    const SAMPLES: u64 = 200;
    let cells = unit_cells(n);
    let field = |seed| RandomField { covariance, variance: 2.5, lengths, seed };
    let mut sums = vec![(0.0, 0.0); lags.len()];
    for seed in 0..SAMPLES {
        let sample = field(seed).realise(&cells).unwrap();
        assert!(sample.clipped <= NEGLIGIBLE);
        for (sum, lag) in sums.iter_mut().zip(lags) {
            let product = product_at(&cells, &sample.values, *lag);
            *sum = (sum.0 + product, sum.1 + product * product);
        }
    }
    for ((sum, squares), lag) in sums.into_iter().zip(lags) {
        let mean = sum / SAMPLES as f64;
        let error = ((squares / SAMPLES as f64 - mean * mean) / SAMPLES as f64).sqrt();
        let expected = covariance_at(&field(0), *lag);
        assert!(
            (mean - expected).abs() < 4.0 * error,
            "{n:?} {covariance:?} {lag:?}: {mean}, not {expected}"
        );
        assert!(error < 0.05 * 2.5, "{lag:?}: {error}");
    }
}

#[test]
fn samples_have_the_covariance_that_was_asked_for() {
    for covariance in [Covariance::Exponential, Covariance::Gaussian] {
        check([400, 1, 1], covariance, [5.0, 0.0, f64::NAN], &[[0, 0, 0], [1, 0, 0], [5, 0, 0], [200, 0, 0]]);
        let lags = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [6, 0, 0], [0, 3, 0], [5, 2, 0], [50, 0, 0], [0, 30, 0]];
        check([64, 40, 1], covariance, [6.0, 3.0, 1.0], &lags);
        let lags = [[0, 0, 0], [2, 0, 0], [0, 2, 0], [0, 0, 2], [2, 1, 1], [10, 0, 0], [0, 6, 3]];
        check([16, 12, 10], covariance, [2.0, 1.0, 3.0], &lags);
    }
}

/// The bytes of a field belong to its seed. The number below was printed by this program: a change of it changes
/// every random medium.
#[test]
fn a_seed_gives_the_same_bytes_for_ever() {
    let cells = unit_cells([30, 20, 10]);
    let hash = |seed| {
        let field = RandomField {
            covariance: Covariance::Exponential,
            variance: 4.0,
            lengths: [3.0, 2.0, 1.0],
            seed,
        };
        let bytes: Vec<u8> = lognormal(1e-4, &field.realise(&cells).unwrap())
            .iter()
            .flat_map(|value| value.to_le_bytes())
            .collect();
        blake3::hash(&bytes).to_hex()[..16].to_owned()
    };
    assert_eq!(hash(7), hash(7));
    assert_ne!(hash(7), hash(8));
    assert_eq!(hash(7), "6b02645fba60a229");
}

#[test]
fn what_cannot_be_held_is_refused() {
    let field =
        RandomField { covariance: Covariance::Exponential, variance: 1.0, lengths: [8.0, 8.0, 8.0], seed: 1 };
    let cells = unit_cells([24, 24, 1]);
    // A box of 48 cells, six lengths: a share of 1.1e-4 is negative.
    let sample = field.realise_within(&cells, 48 * 48).unwrap();
    assert!((1e-5..1e-3).contains(&sample.clipped), "{}", sample.clipped);
    assert_eq!(sample.embedded, [48, 48, 1]);
    assert_eq!(field.realise(&cells).unwrap().clipped, 0.0);
    let long = RandomField { lengths: [1e4; 3], ..field };
    assert!(matches!(long.realise_within(&cells, 1 << 16), Err(FieldError::Indefinite { .. })));
    let large = field.realise(&unit_cells([1000, 1000, 1000])).unwrap_err();
    assert!(matches!(large, FieldError::TooLarge { embedded: [2000, 2000, 2000], .. }), "{large}");
    let reaching = RandomField { covariance: Covariance::Gaussian, lengths: [1e300; 3], ..field };
    assert!(matches!(reaching.realise(&cells), Err(FieldError::TooLarge { .. })));
    let wrong = RandomField { lengths: [1.0, 0.0, 1.0], ..field };
    assert_eq!(wrong.realise(&cells), Err(FieldError::Length { axis: 1, length: 0.0 }));
    let wrong = RandomField { variance: -1.0, ..field };
    assert_eq!(wrong.realise(&cells), Err(FieldError::Variance(-1.0)));
    let uneven = Cells::new([vec![0.0, 1.0, 3.0], vec![0.0, 1.0], vec![0.0, 1.0]]).unwrap();
    assert_eq!(field.realise(&uneven), Err(FieldError::UnequalCells { axis: 0 }));
}

#[test]
fn no_variance_is_no_field() {
    for covariance in [Covariance::Exponential, Covariance::Gaussian] {
        let field = RandomField { covariance, variance: 0.0, lengths: [8.0; 3], seed: 1 };
        let sample = field.realise(&unit_cells([20, 10, 1])).unwrap();
        assert!(sample.values.iter().all(|&value| value == 0.0));
    }
}

//! The limit against independent numbers.

use super::late::Late;
use super::{FRONT, age, integral, product};
use crate::maths::scalar::erfc;

const DISPERSION: f64 = 1.3e-7;

/// Values of the item at some x (m) and one time.
fn values(eta: f64, chi: f64, t: f64, x: &[f64]) -> Vec<f64> {
    let solution = (FRONT.build)(&[1.0, DISPERSION, eta, chi, 0.0, 0.0]).expect("in range");
    let zero = vec![0.0; x.len()];
    let mut out = vec![f64::NAN; x.len()];
    solution.fill(t, [x, &zero, &zero], &mut out);
    out
}

/// The column of Gramling et al., η = 0.5, χ = 1e-3 1/s, D = 1.3e-3 cm²/s. Totals and peaks were computed
/// beforehand by high-order differences for E[(W − u)₊] in (x/√t, u), to 2e-6 cm and 1e-7. The means over
/// |x| < 0.1 cm come from characteristic functions (see below), to 1e-7.
#[test]
fn column_experiment_is_met_to_all_digits() {
    let table = [
        (619.0, 0.826_012, 0.293_761_9, 0.293_380_8),
        (916.0, 1.045_973, 0.311_323_1, 0.311_051_2),
        (1114.0, 1.177_690, 0.321_973_6, 0.321_742_9),
        (1510.0, 1.414_961, 0.341_032_0, 0.340_852_4),
    ];
    for (t, total, peak, centre) in table {
        // Metres to centimetres.
        let found = integral(0.5, 1e-3 * t) * 2.0 * (DISPERSION * t).sqrt() * 100.0;
        assert!((found - total).abs() < 2e-6, "{t} s: total {found} instead of {total}");
        let found = values(0.5, 1e-3, t, &[0.0])[0];
        assert!((found - peak).abs() < 1.5e-7, "{t} s: peak {found} instead of {peak}");
        // The profile is even and smooth: the middles of 200 intervals give the mean to 1e-7.
        let x: Vec<f64> = (0..200).map(|idx| (f64::from(idx) + 0.5) * 5e-6).collect();
        let found = values(0.5, 1e-3, t, &x).iter().sum::<f64>() / 200.0;
        assert!((found - centre).abs() < 3e-7, "{t} s: mean {found} instead of {centre}");
    }
}

/// E[exp(ikW) | ξ] for k = 0, π, … 400π by the Feynman–Kac formula, each in one dimension: Strang splitting
/// of potential and diffusion with 300 and 600 steps in ln t, extrapolated, on 97 Chebyshev points; then
/// E[(W − u)₊] as a cosine series (numpy and scipy, in double precision). That way's own error: 5e-7 at
/// the ages up to 5 (difference to half the steps, divided by the order's 15).
#[test]
fn characteristic_functions_give_the_same_product() {
    let table = [
        (0.5, 0.619, [0.293_761_931, 0.240_556_557, 0.078_647_568]),
        (0.5, 1.51, [0.341_032_062, 0.272_803_278, 0.078_649_614]),
        (0.3, 2.0, [0.416_612_231, 0.285_803_822, 0.078_649_604]),
        (1.0, 0.2, [0.030_615_626, 0.025_506_579, 0.009_893_501]),
        (0.9, 5.0, [0.358_905_857, 0.270_347_310, 0.078_615_805]),
    ];
    for (eta, age, expected) in table {
        let law = age::law(age);
        for (xi, expected) in [0.0, 0.4, 1.0].into_iter().zip(expected) {
            let found = product(law.as_ref(), eta, xi);
            assert!((found - expected).abs() < 1e-6, "η {eta}, age {age}, ξ {xi}: {found}, not {expected}");
        }
    }
}

#[test]
fn no_slow_zone_is_well_mixed() {
    for age in [0.0, 0.3, 20.0, 100.0] {
        let law = age::law(age);
        for xi in [0.0, 0.2, 1.0, 3.0, 7.0, f64::INFINITY] {
            assert_eq!(product(law.as_ref(), 0.0, -xi), 0.5 * erfc(xi));
        }
    }
}

#[test]
fn fast_exchange_is_well_mixed() {
    // The deficit at the front is η √(2/π) σ with σ = 0.4/√age: 1e-5 at an age of 1e9 for η = 1.
    let law = age::law(1e11);
    for xi in [0.0, 0.01, 0.3, 1.0, 2.5] {
        assert!((product(law.as_ref(), 1.0, xi) - 0.5 * erfc(xi)).abs() < 1.1e-6);
    }
    assert!((product(age::law(1e300).as_ref(), 1.0, 0.0) - 0.5).abs() < 1e-12);
}

/// Without exchange W is 1 with probability ū and 0 otherwise.
fn without_exchange(eta: f64, xi: f64) -> f64 {
    let mean = 0.5 * erfc(xi);
    let smaller = |u: f64| u.min(1.0 - u);
    let shared = (1.0 - eta) * mean;
    mean * smaller(shared + eta) + (1.0 - mean) * smaller(shared)
}

#[test]
fn no_exchange_leaves_two_values() {
    for age in [0.0, 1e-300, 1e-12, 1e-9] {
        let law = age::law(age);
        for eta in [1e-12, 0.1, 0.5, 0.7, 0.999, 1.0] {
            for idx in 0..60 {
                let xi = 0.1 * f64::from(idx);
                let (found, expected) = (product(law.as_ref(), eta, xi), without_exchange(eta, xi));
                assert!((found - expected).abs() < 2e-9, "η {eta}, ξ {xi}: {found} instead of {expected}");
            }
        }
    }
}

#[test]
fn young_and_late_laws_meet() {
    let (young, late) = (age::law(59.999), Late::new(59.999));
    for eta in [0.1, 0.5, 0.9, 1.0] {
        for idx in 0..400 {
            let xi = 0.01 * f64::from(idx);
            let (a, b) = (product(young.as_ref(), eta, xi), product(&late, eta, xi));
            // Edgeworth's expansion is off by 2e-6 η here and falls like age^(−3).
            assert!((a - b).abs() < 3e-6, "η {eta}, ξ {xi}: {a} and {b}");
        }
    }
}

#[test]
fn order_of_times_does_not_matter() {
    let product_at = |age: f64| product(age::law(age).as_ref(), 0.7, 0.3).to_bits();
    let forwards = [0.11, 1.7, 3.1].map(product_at);
    // More laws than are kept, so that the march starts again.
    (0..40).for_each(|idx| drop(age::law(0.2 + 1e-3 * f64::from(idx))));
    let mut backwards = [3.1, 1.7, 0.11].map(product_at);
    backwards.reverse();
    assert_eq!(forwards, backwards);
}

#[test]
fn product_lies_between_the_limits_and_grows_with_the_rate() {
    for eta in [0.3, 0.8, 1.0] {
        for idx in 0..50 {
            let xi = 0.1 * f64::from(idx);
            let mut before = without_exchange(eta, xi);
            for age in [1e-4, 0.01, 0.3, 2.0, 12.0, 50.0, 70.0, 1e3, 1e6] {
                let now = product(age::law(age).as_ref(), eta, xi);
                assert!(now <= 0.5 * erfc(xi) && now > before - 1e-6, "η {eta}, ξ {xi}, age {age}");
                before = now;
            }
        }
    }
}

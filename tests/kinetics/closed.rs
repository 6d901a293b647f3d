//! Closed forms against numbers of 60 digits (mpmath 1.4: the textbook formulas, Lambert's W; inputs are
//! the doubles as written).

use super::network::{Network, step};
use lamella::plan::chemistry::Method;

/// `[a₀, b₀, k, t]` and a, b, extent at t.
const PAIRS: [([f64; 4], [f64; 3]); 10] = [
    ([1.0, 0.3, 2.0, 1.5], [0.7266966010566955, 0.026696601056695513, 0.27330339894330447]),
    ([0.3, 1.0, 2.0, 1.5], [0.026696601056695513, 0.7266966010566955, 0.27330339894330447]),
    ([1.0, 1.0, 3.0, 7.0], [0.045454545454545456, 0.045454545454545456, 0.9545454545454546]),
    ([1.0, 1.000000000001, 5.0, 2.0], [0.090909090908595, 0.09090909090959509, 0.909090909091405]),
    ([1.000000001, 1.0, 1000.0, 1.0], [0.0009990014990016228, 0.00099900049900154, 0.9990009995009984]),
    ([0.001, 1.0, 1e-06, 0.001], [0.000999999999, 0.999999999999, 9.999999994995e-13]),
    ([5.0, 1e-09, 0.01, 40.0], [4.999999999135335, 1.3533528326734288e-10, 8.646647167326572e-10]),
    ([1e-12, 1.0, 30.0, 1.0], [9.357622969111545e-26, 0.999999999999, 9.999999999999065e-13]),
    ([2.0, 1.5, 1000.0, 100.0], [0.5, 0.0, 1.5]),
    ([0.7, 0.7000001, 1000000.0, 10.0], [5.8197657514680296e-08, 1.5819765757306702e-07, 0.6999999418023425]),
];

/// `[c₀, K, V, t]` and what is left and gone at t.
const SATURATIONS: [([f64; 4], [f64; 2]); 12] = [
    ([1.0, 1.0, 0.5, 1.0], [0.7662486081617502, 0.23375139183824975]),
    ([1.0, 1e-12, 0.5, 1.0], [0.5000000000006931, 0.49999999999930683]),
    ([1.0, 1e-06, 1.0, 0.75], [0.25000138628881596, 0.749998613711184]),
    ([1.0, 0.001, 1.0, 1.01], [4.3468729955896846e-05, 0.9999565312700441]),
    ([2.0, 0.01, 0.1, 19.0], [0.1275258348888998, 1.8724741651111]),
    ([1.0, 1e12, 1.0, 1e12], [0.36787944117167487, 0.6321205588283252]),
    ([1.0, 1e12, 1.0, 1.0], [0.999999999999, 9.999999999985e-13]),
    ([1e-05, 0.01, 0.001, 30.0], [4.983439680907852e-07, 9.501656031909216e-06]),
    ([0.3, 0.2, 4.0, 5.0], [5.001667152767964e-44, 0.3]),
    ([1.0, 1e-09, 1.0, 2.0], [0.0, 1.0]),
    ([3.0, 1000.0, 7.0, 1e-09], [2.999999999979063, 2.0937188434623073e-11]),
    ([1e-09, 1000.0, 7.0, 400.0], [6.081006262527508e-11, 9.39189937374725e-10]),
];

fn check(found: f64, right: f64, relative: f64, what: &str) {
    assert!((found - right).abs() <= relative * right.abs(), "{what}: {found:e} {right:e}");
}

fn pair(k: f64) -> Network {
    let mut network = Network::new(3);
    network.mass_action(k, &[(0, 1.0), (1, 1.0)], &[(0, -1.0), (1, -1.0), (2, 1.0)]);
    network
}

#[test]
fn pairs_are_right_to_twelve_digits() {
    for ([a, b, k, t], right) in PAIRS {
        let (y, _) = step(&pair(k).reactor(Method::Pair, 1e-6, 1e-12), &[a, b, 0.0], 0.0, t).unwrap();
        for (found, right) in y.iter().zip(right) {
            check(*found, right, 1e-12, &format!("{a} {b} {k} {t}"));
        }
    }
}

/// 2 A → B, and A + 2 B → C with the rate k a b; the same integrated with error control.
#[test]
fn coefficients_other_than_one() {
    let mut twice = Network::new(2);
    twice.mass_action(0.7, &[(0, 2.0)], &[(0, -2.0), (1, 1.0)]);
    let (y, _) = step(&twice.reactor(Method::Pair, 1e-6, 1e-12), &[3.0, 0.5], 0.0, 4.0).unwrap();
    check(y[0], 3.0 / (1.0 + 2.0 * 0.7 * 4.0 * 3.0), 1e-14, "2 A");
    check(y[1], 0.5 + 0.5 * (3.0 - y[0]), 1e-14, "2 A → B");
    let mut uneven = Network::new(3);
    uneven.mass_action(0.7, &[(0, 1.0), (1, 1.0)], &[(0, -1.0), (1, -2.0), (2, 1.0)]);
    let mut growing = Network::new(3);
    growing.mass_action(0.7, &[(0, 1.0), (1, 1.0)], &[(0, -1.0), (1, 1.0), (2, 1.0)]);
    for network in [uneven, growing] {
        let start = [1.3, 0.4, 0.0];
        let (closed, _) = step(&network.reactor(Method::Pair, 1e-6, 1e-12), &start, 0.0, 3.0).unwrap();
        let (other, _) = step(&network.reactor(Method::Explicit, 1e-11, 1e-3), &start, 0.0, 3.0).unwrap();
        for (closed, other) in closed.iter().zip(other) {
            check(*closed, other, 1e-9, "uneven");
        }
    }
}

#[test]
fn saturation_is_right_to_twelve_digits() {
    for ([c, half, v, t], [left, gone]) in SATURATIONS {
        let mut network = Network::new(2);
        network.saturation(v, half, 0, &[(0, -1.0), (1, 1.0)]);
        let (y, _) = step(&network.reactor(Method::Saturation, 1e-6, 1e-12), &[c, 0.0], 0.0, t).unwrap();
        // Far down only ln c is right to 16 digits.
        let relative = if left < 1e-20 { 1e-12 * 100.0 } else { 1e-12 };
        check(y[0], left, relative, &format!("left of {c} {half} {v} {t}"));
        check(y[1], gone, 1e-12, &format!("gone of {c} {half} {v} {t}"));
    }
}

/// To the end of the scarcest, exactly.
#[test]
fn order_zero_stops_at_the_scarcest() {
    let mut network = Network::new(3);
    network.mass_action(0.1, &[], &[(0, -1.0), (1, -2.0), (2, 1.0)]);
    let reactor = network.reactor(Method::Zero, 1e-6, 1e-12);
    let (y, _) = step(&reactor, &[1.0, 1.0, 0.0], 0.0, 3.0).unwrap();
    y.iter().zip([0.7, 0.4, 0.3]).for_each(|(found, right)| check(*found, right, 1e-15, "order zero"));
    let (y, _) = step(&reactor, &[1.0, 1.0, 0.0], 0.0, 300.0).unwrap();
    assert_eq!(y, [0.5, 0.0, 0.5]);
    // The same law among others is integrated, and stops too.
    let (y, _) =
        step(&network.reactor(Method::Rosenbrock, 1e-6, 1e-6), &[1.0, 1.0, 0.0], 0.0, 300.0).unwrap();
    assert!((y[0] - 0.5).abs() < 1e-5 && (0.0..1e-11).contains(&y[1]), "{y:?}");
}

/// A decay chain in one call and in many.
#[test]
fn first_order_networks_are_propagated() {
    let mut network = Network::new(3);
    network.mass_action(0.6, &[(0, 1.0)], &[(0, -1.0), (1, 1.0)]);
    network.mass_action(0.3, &[(1, 1.0)], &[(1, -1.0), (2, 1.0)]);
    let reactor = network.reactor(Method::Exponential, 1e-6, 1e-12);
    let (once, _) = step(&reactor, &[1.0, 0.0, 0.0], 0.0, 2.0).unwrap();
    // Methods 1.7.
    for (found, right) in once.iter().zip([0.30119, 0.49523, 0.20357]) {
        assert!((found - right).abs() < 6e-6, "{found}");
    }
    let mut y = vec![1.0, 0.0, 0.0];
    for _ in 0..100 {
        y = step(&reactor, &y, 0.0, 0.02).unwrap().0;
    }
    y.iter().zip(once).for_each(|(many, once)| check(*many, once, 1e-14, "chain"));
    assert_eq!(reactor.propagator(2.0).unwrap().constant, [0.0; 3]);
}

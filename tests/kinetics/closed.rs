//! Closed forms against numbers of 60 digits (mpmath 1.4: the textbook formulas, Lambert's W; inputs are
//! the doubles as written).

use super::network::{Network, step};
use lamella::plan::chemistry::Method;

/// `[a₀, b₀, k, t]` and a, b, extent at t.
const PAIRS: [([f64; 4], [f64; 3]); 10] = [
    ([1.0, 0.3, 2.0, 1.5], [0.72669660105669553, 0.026696601056695514, 0.27330339894330447]),
    ([0.3, 1.0, 2.0, 1.5], [0.026696601056695514, 0.72669660105669553, 0.27330339894330447]),
    ([1.0, 1.0, 3.0, 7.0], [0.045454545454545455, 0.045454545454545455, 0.95454545454545455]),
    ([1.0, 1.000000000001, 5.0, 2.0], [0.090909090908594997, 0.090909090909595086, 0.909090909091405]),
    ([1.000000001, 1.0, 1000.0, 1.0], [0.00099900149900162279, 0.00099900049900154005, 0.99900099950099846]),
    ([0.001, 1.0, 1e-06, 0.001], [0.00099999999900000002, 0.999999999999, 9.999999994995e-13]),
    ([5.0, 1e-09, 0.01, 40.0], [4.9999999991353353, 1.3533528326734288e-10, 8.6466471673265718e-10]),
    ([1e-12, 1.0, 30.0, 1.0], [9.3576229691115455e-26, 0.999999999999, 9.999999999999064e-13]),
    ([2.0, 1.5, 1000.0, 100.0], [0.5, 0.0, 1.5]),
    ([0.7, 0.7000001, 1000000.0, 10.0], [5.8197657514680299e-8, 1.5819765757306702e-7, 0.69999994180234244]),
];

/// `[c₀, K, V, t]` and what is left and gone at t.
const SATURATIONS: [([f64; 4], [f64; 2]); 12] = [
    ([1.0, 1.0, 0.5, 1.0], [0.76624860816175026, 0.23375139183824974]),
    ([1.0, 1e-12, 0.5, 1.0], [0.50000000000069315, 0.49999999999930685]),
    ([1.0, 1e-06, 1.0, 0.75], [0.25000138628881598, 0.74999861371118402]),
    ([1.0, 0.001, 1.0, 1.01], [4.3468729955896848e-5, 0.9999565312700441]),
    ([2.0, 0.01, 0.1, 19.0], [0.12752583488889978, 1.8724741651111002]),
    ([1.0, 1e12, 1.0, 1e12], [0.36787944117167487, 0.63212055882832513]),
    ([1.0, 1e12, 1.0, 1.0], [0.999999999999, 9.999999999985e-13]),
    ([1e-05, 0.01, 0.001, 30.0], [4.9834396809078519e-7, 9.5016560319092156e-6]),
    ([0.3, 0.2, 4.0, 5.0], [5.0016671527679637e-44, 0.29999999999999999]),
    ([1.0, 1e-09, 1.0, 2.0], [0.0, 1.0]),
    ([3.0, 1000.0, 7.0, 1e-09], [2.9999999999790628, 2.0937188434623071e-11]),
    ([1e-09, 1000.0, 7.0, 400.0], [6.0810062625275081e-11, 9.3918993737472498e-10]),
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

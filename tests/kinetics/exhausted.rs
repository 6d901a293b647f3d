//! What is used up stays at zero, and what cannot be integrated is refused.

use super::network::{Network, redox_chain, step, steps};
use lamella::chemistry::Why;
use lamella::maths::operator::{Binary, Unary};
use lamella::plan::chemistry::Method;

/// Two acceptors and a donor that runs out, for K over nine decades: the plain form has a pole at c = −K.
#[test]
fn monod_chains_are_exhausted() {
    for half in [1e-9, 1e-7, 1e-5, 1e-3, 1e-1, 1.0] {
        for tolerance in [1e-3, 1e-4, 1e-6, 1e-8] {
            let mut network = Network::new(4);
            let (donor, acceptor, speed) = (network.monod(0, half), network.monod(1, half), network.k(2.0));
            let rate = network.times(donor, acceptor);
            let rate = network.times(rate, speed);
            network.reaction(&[(0, -1.0), (1, -0.5), (3, 1.0)], rate);
            let (donor, acceptor) = (network.monod(0, half), network.monod(2, half));
            let rate = network.times(donor, acceptor);
            network.reaction(&[(0, -1.0), (2, -1.0), (3, 1.0)], rate);
            let reactor = network.reactor(Method::Rosenbrock, tolerance, 1e-6);
            let (y, _) = step(&reactor, &[1.0, 0.3, 2.0, 0.0], 0.0, 100.0 * (1.0 + 10.0 * half)).unwrap();
            assert!(y.iter().all(|value| *value >= 0.0), "{y:?}");
            assert!(y[0] < 1e-6 * tolerance + 1e-12, "{half}: {y:?}");
            assert!((y[0] + y[3] - 1.0).abs() < 1e-13, "{y:?}");
            assert!((y[3] - 2.0 * (0.3 - y[1]) - (2.0 - y[2])).abs() < 1e-13, "{y:?}");
        }
    }
}

/// What is exhausted in the middle of a step is as right at its end as what is not; in the sub-step in which
/// a value falls by decades, too. References: DOP853 at 1e-13, and Radau at 1e-12 (scipy 1.17).
#[test]
fn redox_chains_end_within_ten_tolerances() {
    let start = [1.0, 0.05, 0.4, 0.8, 0.9];
    let cases = [
        (
            3600.0,
            [
                0.9442916184729081,
                0.014939345913740087,
                0.3907201971883405,
                0.7997737516762459,
                0.9052458790175605,
            ],
        ),
        (86_400.0, [0.338575200903601, 0.0, 9.113857025062828e-07, 0.7208592493371787, 0.9580731449015933]),
        (864_000.0, [1.8e-15, 0.0, 0.0, 0.4500000000000022, 0.9178988506423585]),
    ];
    for (t, right) in cases {
        for tolerance in [1e-3, 1e-4, 1e-6, 1e-8] {
            for method in [Method::Rosenbrock, Method::Explicit] {
                let (y, _) = step(&redox_chain().reactor(method, tolerance, 1e-6), &start, 0.0, t).unwrap();
                for (found, right) in y.iter().zip(right) {
                    let off = (found - right).abs() / (tolerance * right.max(1e-6));
                    assert!(off <= 10.0, "{t} {tolerance} {method:?}: {off} tolerances off: {y:?}");
                }
            }
        }
    }
}

/// Falling by many decades takes few attempts: the size of sub-steps follows what they met.
#[test]
fn attempts_are_few_where_a_donor_runs_out() {
    for (tolerance, most) in [(1e-4, 90), (1e-6, 250)] {
        let reactor = redox_chain().reactor(Method::Rosenbrock, tolerance, 1e-6);
        let (_, work) = step(&reactor, &[1.0, 0.05, 0.4, 0.8, 0.9], 0.0, 86_400.0).unwrap();
        assert!(work.steps + work.rejected <= most, "{work:?}");
        assert!(work.rejected * 8 <= work.steps, "{work:?}");
    }
}

/// Integrated and closed, for K over 12 decades, before the end and after it.
#[test]
fn integration_meets_the_closed_form() {
    for half in [1e-9, 1e-6, 1e-3, 1.0, 1e3] {
        for t in [0.5, 0.9, 1.5] {
            let mut network = Network::new(2);
            network.saturation(1.0 + half, half, 0, &[(0, -1.0), (1, 1.0)]);
            let closed = network.reactor(Method::Saturation, 1e-6, 1e-6);
            let (right, _) = step(&closed, &[1.0, 0.0], 0.0, t).unwrap();
            for tolerance in [1e-3, 1e-4, 1e-6, 1e-8] {
                for method in [Method::Rosenbrock, Method::Explicit] {
                    let reactor = network.reactor(method, tolerance, 1e-6);
                    let (y, _) = step(&reactor, &[1.0, 0.0], 0.0, t).unwrap();
                    for (found, right) in y.iter().zip(&right) {
                        let bound = 10.0 * tolerance * right.max(1e-6);
                        assert!((found - right).abs() <= bound, "{half} {t} {tolerance} {method:?}: {y:?}");
                    }
                }
            }
        }
    }
}

/// `dc/dt = −k c^α` ends after `c₀^(1−α)/(k (1 − α))`.
#[test]
fn fractional_orders_end() {
    for (alpha, end) in [(0.5, 2.0), (0.3, 1.0 / 0.7), (0.9, 10.0)] {
        let mut network = Network::new(2);
        network.mass_action(1.0, &[(0, alpha)], &[(0, -1.0), (1, 1.0)]);
        for tolerance in [1e-3, 1e-4, 1e-6, 1e-8] {
            let reactor = network.reactor(Method::Rosenbrock, tolerance, 1e-6);
            let (y, _) = step(&reactor, &[1.0, 0.0], 0.0, 0.5 * end).unwrap();
            let right = 0.5_f64.powf(1.0 / (1.0 - alpha));
            assert!((y[0] - right).abs() <= 10.0 * tolerance * right, "{alpha} {tolerance}: {y:?} {right}");
            let (y, _) = step(&reactor, &[1.0, 0.0], 0.0, 3.0 * end).unwrap();
            assert!((0.0..1e-6 * tolerance).contains(&y[0]) && (y[0] + y[1] - 1.0).abs() < 1e-13, "{y:?}");
        }
    }
}

/// A law that explodes, one that is no number, one that overflows.
#[test]
fn what_cannot_be_integrated_is_refused() {
    let explosion = {
        let mut network = Network::new(1);
        network.mass_action(1.0, &[(0, 2.0)], &[(0, 1.0)]);
        network
    };
    let no_number = {
        let mut network = Network::new(1);
        let (c, zero) = (network.c(0), network.k(0.0));
        let nothing = network.times(c, zero);
        let ratio = network.place(3);
        let ratio = network.binary(Binary::Divide, nothing, ratio);
        let ratio = network.binary(Binary::Subtract, ratio, c);
        let root = network.place(0);
        let minus = network.k(-1.0);
        let root = network.binary(Binary::Add, root, minus);
        let root = network.unary(Unary::Sqrt, root);
        let rate = network.times(ratio, root);
        network.reaction(&[(0, 1.0)], rate);
        network
    };
    let overflow = {
        let mut network = Network::new(1);
        let (c, large) = (network.c(0), network.k(1e6));
        let exponent = network.times(c, large);
        let rate = network.unary(Unary::Exp, exponent);
        network.reaction(&[(0, 1.0)], rate);
        network
    };
    for (network, is_number) in [(explosion, true), (no_number, false), (overflow, false)] {
        for method in [Method::Rosenbrock, Method::Explicit] {
            let failure = step(&network.reactor(method, 1e-6, 1e-9), &[1.0], 0.0, 2.0).unwrap_err();
            let is_as_said = match failure.why {
                Why::StepTooSmall { .. } => true,
                Why::NotFinite { component, .. } => !is_number || component == 0,
                _ => false,
            };
            assert!(is_as_said, "{failure:?}");
        }
    }
}

/// Neighbours, numbers of particles and remembered steps of others change no bit.
#[test]
fn particles_are_alone() {
    let mut network = Network::new(3);
    let (donor, speed) = (network.monod(0, 1e-3), network.k(0.3));
    let biomass = network.c(1);
    let rate = network.times(donor, speed);
    let rate = network.times(rate, biomass);
    network.reaction(&[(0, -1.0), (1, 0.2), (2, 0.8)], rate);
    let all: Vec<Vec<f64>> = (0..3)
        .map(|component| (0..203).map(|k| 0.01 + ((k * (component + 7)) % 31) as f64 / 10.0).collect())
        .collect();
    for method in [Method::Rosenbrock, Method::Explicit] {
        let reactor = network.reactor(method, 1e-6, 1e-9);
        let mut together = all.clone();
        steps(&reactor, &mut together, 0.0, 20.0, &mut vec![0.0; 203]).unwrap();
        let narrow = reactor.clone().with_width(lamella::maths::wide::Width::baseline());
        let mut slowly = all.clone();
        steps(&narrow, &mut slowly, 0.0, 20.0, &mut vec![0.0; 203]).unwrap();
        assert_eq!(together, slowly);
        for particle in [0, 1, 50, 202] {
            let start: Vec<f64> = all.iter().map(|column| column[particle]).collect();
            let (alone, _) = step(&reactor, &start, 0.0, 20.0).unwrap();
            for (column, alone) in together.iter().zip(alone) {
                assert_eq!(column[particle].to_bits(), alone.to_bits());
            }
        }
    }
}

/// From many starts, before anything runs out and long after it, without memory and with one that is far too
/// long: no step may be so long that the estimate of its error vanishes by chance. Reference: the other
/// method at 1e-10.
#[test]
fn explicit_steps_hold_ten_tolerances_from_many_starts() {
    const N: usize = 128;
    let column = |low: f64, high: f64| -> Vec<f64> {
        (0..N).map(|k| low + (high - low) * k as f64 / N as f64).collect()
    };
    let start = [column(0.2, 1.0), column(0.3, 0.0), column(0.5, 0.4), column(0.1, 1.0), column(0.1, 1.0)];
    for dt in [600.0, 3600.0, 20_000.0, 86_400.0] {
        let mut right = start.clone();
        let reference = redox_chain().reactor(Method::Rosenbrock, 1e-10, 1e-6);
        steps(&reference, &mut right, 0.0, dt, &mut []).unwrap();
        for tolerance in [1e-3, 1e-4, 1e-6, 1e-8] {
            for remembered in [0.0, 1e6] {
                let mut found = start.clone();
                let reactor = redox_chain().reactor(Method::Explicit, tolerance, 1e-6);
                steps(&reactor, &mut found, 0.0, dt, &mut [remembered; N]).unwrap();
                let mut worst = 0.0_f64;
                for (found, right) in found.iter().flatten().zip(right.iter().flatten()) {
                    worst = worst.max((found - right).abs() / (tolerance * right.max(1e-6)));
                }
                assert!(worst <= 10.0, "{dt} s, {tolerance}, {remembered}: {worst} tolerances off");
            }
        }
    }
}

//! Every kernel is what its file says: slopes, ends, and the identity that makes an exchange diffusion.

use super::{ALL, find};
use crate::maths::quadrature::integrate;

/// `∫ f(q) q^power dq` up to the end of the support, or to where nothing is left.
fn integral(f: fn(f64) -> f64, power: i32, support: f64) -> f64 {
    let end = support.min(12.0);
    let breaks: Vec<f64> = [0.0, 1.0, 2.0, 3.0].into_iter().filter(|at| *at < end).chain([end]).collect();
    integrate(|q| f(q * q) * q.powi(power), &breaks, 1e-14, 1e-13).value
}

#[test]
fn the_force_is_the_slope_over_the_distance() {
    for item in ALL {
        for k in 1..400 {
            let q = 0.0101 * k as f64;
            let near_edge = [1.0, 2.0, 3.0].iter().any(|edge| (q - edge).abs() < 1e-3);
            if near_edge {
                continue;
            }
            let e = 1e-5;
            let slope = ((item.value)((q + e) * (q + e)) - (item.value)((q - e) * (q - e))) / (2.0 * e);
            let scale = (item.value)(0.0);
            let found = (item.force)(q * q);
            // The difference quotient is right to e² W‴/6 and to rounding over e.
            assert!((found + slope / q).abs() < 1e-8 * scale.max(1.0) / q, "{} at {q}: {found}", item.name);
        }
        let (near, far) = ((item.force)(1e-20), (item.force)(1e-8));
        assert!((near - far).abs() < 1e-3 * near, "{} has no force at zero", item.name);
    }
}

#[test]
fn nothing_is_beyond_the_support_and_nothing_is_negative_within() {
    for item in ALL {
        let end = item.support.min(8.0);
        for k in 0..1000 {
            let q = end * k as f64 / 1000.0;
            assert!((item.value)(q * q) >= 0.0 && (item.force)(q * q) >= 0.0, "{} at {q}", item.name);
        }
        if item.support.is_finite() {
            for q in [item.support, item.support * 1.01, 1e3] {
                assert_eq!(((item.value)(q * q), (item.force)(q * q)), (0.0, 0.0), "{} at {q}", item.name);
            }
        }
        assert_eq!(find(item.name).map(|found| found.name), Some(item.name));
    }
}

/// By parts: `∫ (−W′/q) q^{d+1} dq = d ∫ W q^{d−1} dq`. With it every kernel gives the dispersion that is asked for.
#[test]
fn second_moments_of_forces_are_masses_of_kernels() {
    for item in ALL {
        for d in 1..=3 {
            let (second, mass) =
                (integral(item.force, d + 1, item.support), integral(item.value, d - 1, item.support));
            assert!((second / (f64::from(d) * mass) - 1.0).abs() < 1e-11, "{} in {d}: {second}", item.name);
        }
    }
}

/// Constants that normalise them in one, two and three dimensions, as their authors print them.
#[test]
fn masses_are_those_of_the_literature() {
    use std::f64::consts::PI;
    let surface = [2.0, 2.0 * PI, 4.0 * PI];
    for (name, constants) in [
        ("gaussian", [1.0 / (2.0 * PI).sqrt(), 1.0 / (2.0 * PI), 1.0 / (2.0 * PI * (2.0 * PI).sqrt())]),
        ("cubic_spline", [2.0 / 3.0, 10.0 / (7.0 * PI), 1.0 / PI]),
        ("quintic_spline", [1.0 / 120.0, 7.0 / (478.0 * PI), 1.0 / (120.0 * PI)]),
        ("wendland_c2", [f64::NAN, 7.0 / (4.0 * PI), 21.0 / (16.0 * PI)]),
        ("wendland_c4", [f64::NAN, 9.0 / (4.0 * PI), 495.0 / (256.0 * PI)]),
        ("wendland_c6", [f64::NAN, 78.0 / (28.0 * PI), 1365.0 / (512.0 * PI)]),
        ("epanechnikov", [0.75, 2.0 / PI, 15.0 / (8.0 * PI)]),
    ] {
        let item = find(name).unwrap();
        for d in 1..=3_usize {
            let mass = surface[d - 1] * integral(item.value, d as i32 - 1, item.support);
            let expected = 1.0 / constants[d - 1];
            if expected.is_finite() {
                assert!((mass / expected - 1.0).abs() < 1e-11, "{name} in {d}: {mass} for {expected}");
            }
        }
    }
}

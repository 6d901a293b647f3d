//! Items against numbers that were computed another way.
//!
//! mpmath means mpmath 1.3 with 30 digits and the formula as printed in the source, not as coded here.

use super::find;
use crate::maths::quadrature::integrate;
use crate::maths::special::dawson;

fn value(name: &str, arguments: &[f64], t: f64, x: f64) -> f64 {
    let solution = (find(name).expect(name).build)(arguments).expect(name);
    let mut out = [f64::NAN];
    solution.fill(t, [&[x], &[0.0], &[0.0]], &mut out);
    out[0]
}

fn assert_close(found: f64, expected: f64, relative: f64) {
    assert!((found - expected).abs() <= relative * expected.abs(), "{found} instead of {expected}");
}

#[test]
fn front_covariance_follows_the_printed_integral() {
    // mpmath, the integral over τ = t s².
    let table = [
        (0.0, 0.5, 1e-3, 619.0, -0.042_937_821_880_940_24),
        (0.01, 0.5, 1e-3, 1510.0, -0.022_386_524_732_835_94),
        (0.005, 0.9, 1.0, 100.0, -0.000_497_590_478_018_261_5),
        (0.02, 1.0, 1e-4, 50.0, -1.446_208_144_941_148_3e-8),
    ];
    for (x, eta, chi, t, expected) in table {
        // Scaled with c0² = 4.
        assert_close(
            value("front_covariance", &[2.0, 1.3e-7, eta, chi, 0.0, 0.0], t, x),
            4.0 * expected,
            1e-10,
        );
    }
}

#[test]
fn front_covariance_integrates_to_its_closed_form() {
    // ∫Σ dx = −η² c0² ℓ F(√χt)/√π with ℓ = √(2D/χ), which is γ times M of the mean, c0² √(2Dt/π).
    for (eta, chi, t) in [(0.5_f64, 1e-3_f64, 619.0_f64), (0.9, 1e-2, 1510.0), (1.0, 0.5, 2000.0)] {
        let solution = (find("front_covariance").expect("listed").build)(&[1.0, 1.3e-7, eta, chi, 0.0, 0.0]);
        let solution = solution.expect("in range");
        let density = |x: f64| {
            let mut out = [0.0];
            solution.fill(t, [&[x], &[0.0], &[0.0]], &mut out);
            out[0]
        };
        let half_width = (1.3e-7 * t).sqrt();
        let total = 2.0 * integrate(density, &[0.0, half_width, 12.0 * half_width], 1e-16, 1e-10).value;
        let expected =
            -eta * eta * (2.0 * 1.3e-7 / chi / std::f64::consts::PI).sqrt() * dawson((chi * t).sqrt());
        assert_close(total, expected, 1e-8);
        let mean = (2.0 * 1.3e-7 * t / std::f64::consts::PI).sqrt();
        assert_close(total / mean, value("front_gamma", &[eta, chi], t, 0.0), 1e-8);
    }
}

#[test]
fn one_zone_of_several_is_the_single_zone() {
    for t in [1.0, 900.0, 1e5] {
        let single = value("front_gamma", &[0.6, 2e-3], t, 0.0);
        assert_close(value("multirate_front_gamma", &[0.6, 2e-3, 0.0, 5.0, 0.0, 0.0], t, 0.0), single, 1e-14);
        // Two zones with one rate are one zone.
        assert_close(
            value("multirate_front_gamma", &[0.2, 2e-3, 0.3, 2e-3, 0.1, 2e-3], t, 0.0),
            single,
            1e-14,
        );
        let single = value("front_covariance", &[1.0, 1e-7, 0.6, 2e-3, 0.0, 0.0], t, 0.01);
        let zones = [1.0, 1e-7, 0.2, 2e-3, 0.3, 2e-3, 0.1, 2e-3, 0.0, 0.0];
        assert_close(value("multirate_front_covariance", &zones, t, 0.01), single, 1e-9);
    }
}

#[test]
fn too_many_fractions_are_refused() {
    let build = find("multirate_front_gamma").expect("listed").build;
    assert!(build(&[0.3, 1.0, 0.6, 1.0, 0.1, 1.0]).is_ok());
    assert!(build(&[0.3, 1.0, 0.6, 1.0, 0.2, 1.0]).is_err_and(|text| text.contains("eta1")));
}

#[test]
fn gaussian_closure_has_its_published_peak_and_product() {
    // An Eulerian run by differences, column at 619 s, c0 = 1: product 0.887 cm, peak 0.3346 (last digits ±1).
    let arguments = [1.0, 1.3e-7, 0.5, 1e-3, 0.0, 0.0];
    assert!((value("gaussian_closure", &arguments, 619.0, 0.0) - 0.3346).abs() < 1e-4);
    let profile = |x: f64| value("gaussian_closure", &arguments, 619.0, x);
    let product = 200.0 * integrate(profile, &[0.0, 0.01, 0.1], 1e-9, 1e-7).value;
    assert!((product - 0.887).abs() < 5e-4, "{product}");
}

#[test]
fn pulse_gamma_follows_the_printed_formula() {
    // mpmath; D and width chosen for χt₀ = width² χ / (2D), χ = 1.
    let table = [
        (1.0 / 15.0, 0.7852, 1.420_920_168_959_186_5),
        (1.0 / 15.0, 1e-6, 7.499_968_125_212_186e-6),
        (1.0 / 15.0, 30.0, 0.017_537_853_596_833_37),
        (500.0, 1e-3, 9.994_996_666_255_501e-7),
        (1000.0, 2.0, 0.000_431_913_742_045_138_5),
    ];
    for (initial_age, age, expected) in table {
        let found = value("pulse_gamma", &[1.0, 1.0, 0.5 / initial_age, 1.0], age, 0.0);
        // Early or slow, the bracket is a difference of nearly equal numbers.
        assert!((found - expected).abs() <= 1e-12 * expected + 1e-15, "{found} instead of {expected}");
    }
}

#[test]
fn pulse_covariance_follows_its_sources() {
    // scipy: the sources convolved by the trapezoid rule on 40,001 points, then integrated adaptively.
    let table = [
        (0.0, 0.6, 1e-3, 500.0, 0.019_807_079_668_601),
        (0.012, 0.6, 1e-3, 500.0, 0.031_320_091_854_107),
        (0.012, 1.0, 1e-3, 50.0, 0.028_711_271_770_487),
        (0.03, 0.3, 0.0, 2000.0, 0.008_061_003_247_154_7),
    ];
    for (x, eta, chi, t, expected) in table {
        assert_close(value("pulse_covariance", &[1.0, 0.01, 1e-7, eta, chi, 0.0, 0.0], t, x), expected, 1e-9);
    }
}

#[test]
fn pulse_covariance_integrates_to_gamma() {
    // ∫ c̄² dx = √π w²/σ for a pulse of peak 1 (c0 = 1).
    for (eta, chi, t) in [(0.5, 1e-3, 300.0), (0.9, 1e-2, 2000.0), (1.0, 1.0, 50.0), (1.0, 1e-6, 1e5)] {
        let (width, dispersion) = (0.01_f64, 1e-7);
        let sigma = (width * width + 2.0 * dispersion * t).sqrt();
        let arguments = [1.0, width, dispersion, eta, chi, 0.0, 0.0];
        let profile = |x: f64| value("pulse_covariance", &arguments, t, x);
        let total = 2.0 * integrate(profile, &[0.0, width, 3.0 * sigma, 14.0 * sigma], 1e-16, 1e-9).value;
        let mean = std::f64::consts::PI.sqrt() * width * width / sigma;
        assert_close(total / mean, value("pulse_gamma", &[eta, chi, dispersion, width], t, 0.0), 1e-7);
    }
}

#[test]
fn inflow_follows_the_printed_formulas() {
    // mpmath, v = 1e-4 m/s, D = 1e-6 m²/s: x, t, prescribed concentration, prescribed flux.
    let table = [
        (0.0, 10.0, 1.0, 0.309_790_956_031_231),
        (0.05, 600.0, 0.724_610_238_046_576_2, 0.606_859_573_655_351_4),
        (0.1, 600.0, 0.166_613_394_209_500_92, 0.111_020_452_804_551_8),
        (1.0, 5000.0, 3.853_314_435_531_962_5e-7, 2.531_860_964_478_181e-7),
        (0.3, 3000.0, 0.550_684_546_720_146_1, 0.498_436_266_256_602_35),
    ];
    for (x, t, concentration, flux) in table {
        // The exponent (x − vt)²/4Dt of the farthest point is 12: rounding grows by as much.
        assert_close(value("ogata_banks", &[1e-4, 1e-6, 3.0, 0.5], t, x + 0.5), 3.0 * concentration, 2e-13);
        assert_close(value("cauchy_inflow", &[1e-4, 1e-6, 3.0, 0.5], t, x + 0.5), 3.0 * flux, 2e-13);
    }
}

#[test]
fn decaying_inflow_follows_the_inverted_transform() {
    // mpmath, Talbot's inversion with 40 digits of `e^{rx}/s` and `w/(w − Er) e^{rx}/s`, r = (w − √(w² + 4E(s + k)))/2E,
    // v = 1e-4 m/s, D = 1e-6 m²/s: x, t, R, k, prescribed concentration, prescribed flux.
    let table = [
        (0.0, 50.0, 1.0, 5e-4, 1.0, 0.576_734_089_415_894_9),
        (0.05, 600.0, 2.0, 5e-4, 0.231_726_351_953_653_33, 0.142_405_564_826_383_22),
        (0.1, 3000.0, 2.0, 1e-3, 0.177_653_480_581_867_9, 0.149_982_706_145_967_4),
        (0.3, 3000.0, 1.0, 5e-4, 0.164_709_026_904_944_73, 0.146_578_216_303_567_3),
        (0.2, 1000.0, 1.0, 1e-7, 0.017_451_793_423_303_273, 0.010_951_391_893_011_993),
        (0.1, 1e6, 3.0, 2e-3, 0.014_705_341_890_567_208, 0.010_341_640_644_489_962),
    ];
    for (x, t, retardation, rate, concentration, flux) in table {
        let arguments = [1e-4, 1e-6, 3.0, rate, retardation, 0.5];
        // Terms of the flux boundary are w²/2kE times as large as the boundary's value, and rounded as such.
        let bound = 1e-12 + 1e-15 * 0.5 / (100.0 * rate * retardation) / flux;
        assert_close(value("decaying_ogata_banks", &arguments, t, x + 0.5), 3.0 * concentration, 1e-12);
        assert_close(value("decaying_cauchy_inflow", &arguments, t, x + 0.5), 3.0 * flux, bound);
    }
    // Both ways of working it out agree where one takes over from the other: kD/v² = 1e-6.
    for x in [0.05, 0.1] {
        let of = |rate: f64| value("decaying_cauchy_inflow", &[1e-4, 1e-6, 1.0, rate, 1.0, 0.0], 1000.0, x);
        assert_close(of(0.999_999e-8), of(1.000_001e-8), 1e-8);
    }
    // Without decay and retardation it is the plain inflow.
    let plain = value("cauchy_inflow", &[1e-4, 1e-6, 2.0, 0.0], 700.0, 0.08);
    assert_eq!(value("decaying_cauchy_inflow", &[1e-4, 1e-6, 2.0, 0.0, 1.0, 0.0], 700.0, 0.08), plain);
}

#[test]
fn flux_inflow_brings_what_enters() {
    // Amount in the half-space = velocity · inlet · t.
    let profile = |x: f64| value("cauchy_inflow", &[1e-4, 1e-6, 2.0, 0.0], 1000.0, x);
    assert_close(integrate(profile, &[0.0, 0.1, 0.6], 1e-14, 1e-12).value, 0.2, 1e-10);
}

#[test]
fn pulse_keeps_its_mass_and_obeys_the_transport_equation() {
    let arguments = [3.0, 0.02, 1e-6, 0.1, 2e-5, 0.05, 3e-6, -0.1, -1e-5, 0.03, 2e-6, 0.2, 3e-5];
    let pulse = (find("gaussian_pulse").expect("listed").build)(&arguments).expect("in range");
    let at = |t: f64, [x, y, z]: [f64; 3]| {
        let mut out = [0.0];
        pulse.fill(t, [&[x], &[y], &[z]], &mut out);
        out[0]
    };
    // ∂c/∂t = Σ D_i ∂²c/∂x_i² − v_i ∂c/∂x_i by central differences of second order.
    let (t, point, h, dt) = (300.0, [0.12, -0.09, 0.19], 2e-4, 0.05);
    let rate = (at(t + dt, point) - at(t - dt, point)) / (2.0 * dt);
    let mut expected = 0.0;
    for (axis, dispersion, velocity) in [(0, 1e-6, 2e-5), (1, 3e-6, -1e-5), (2, 2e-6, 3e-5)] {
        let moved = |step: f64| {
            let mut moved = point;
            moved[axis] += step;
            at(t, moved)
        };
        let (low, high) = (moved(-h), moved(h));
        expected +=
            dispersion * (high - 2.0 * at(t, point) + low) / (h * h) - velocity * (high - low) / (2.0 * h);
    }
    // Differences: h² and dt² over the squares of the pulse's scales, 1e-4; rounding 1e-16/h² · D.
    assert_close(rate, expected, 1e-3);
    // One axis alone: mass c0 w √(2π), for all times.
    let line = [3.0, 0.02, 1e-6, 0.1, 2e-5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    for t in [0.0, 50.0, 5e3] {
        let total =
            integrate(|x| value("gaussian_pulse", &line, t, x), &[-1.0, 0.1, 0.2, 2.0], 1e-14, 1e-12).value;
        assert_close(total, 3.0 * 0.02 * (2.0 * std::f64::consts::PI).sqrt(), 1e-10);
    }
}

#[test]
fn totals_are_integrals_of_their_profiles() {
    let (c0, dispersion, t) = (20.0, 1.3e-7, 900.0_f64);
    let scale = f64::sqrt(dispersion * t);
    let pairs: [(&str, &[f64], &str, &[f64]); 2] = [
        ("well_mixed_front", &[c0, dispersion, 0.0, 0.0], "well_mixed_total", &[c0, dispersion, 0.5, 4.0]),
        (
            "front_limit",
            &[c0, dispersion, 0.7, 2e-3, 0.0, 0.0],
            "front_total",
            &[c0, dispersion, 0.7, 2e-3, 0.5, 4.0],
        ),
    ];
    for (profile, profile_arguments, total, total_arguments) in pairs {
        let integral =
            integrate(|x| value(profile, profile_arguments, t, x), &[0.0, scale, 12.0 * scale], 1e-12, 1e-8)
                .value;
        assert_close(value(total, total_arguments, t, 0.0), 2.0 * integral * 2.0, 1e-6);
    }
}

#[test]
fn fronts_move_with_their_velocity() {
    for (name, arguments) in [
        ("step_front", &[2.0, 1e-7, 1e-4, 0.3, 0.5][..]),
        ("well_mixed_front", &[2.0, 1e-7, 1e-4, 0.3]),
        ("front_limit", &[2.0, 1e-7, 0.5, 1e-3, 0.3, 1e-4]),
        ("front_covariance", &[2.0, 1e-7, 0.5, 1e-3, 0.3, 1e-4]),
        ("gaussian_closure", &[2.0, 1e-7, 0.5, 1e-3, 0.3, 1e-4]),
    ] {
        let index = |wanted: &str| {
            find(name)
                .expect(name)
                .arguments
                .iter()
                .position(|argument| argument.name == wanted)
                .expect(wanted)
        };
        let mut resting = arguments.to_vec();
        resting[index("v")] = 0.0;
        resting[index("x0")] = 0.0;
        let (t, x) = (700.0, 0.005);
        let moved = value(name, arguments, t, 0.3 + 1e-4 * t + x);
        // Rounding of the position, a few 1e-17 m, over the width of the front, 1e-2 m.
        assert_close(moved, value(name, &resting, t, x), 1e-12);
    }
}

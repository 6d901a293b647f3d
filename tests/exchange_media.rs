//! Parcels that exchange where flow and dispersion vary, against closed forms and against sums that are written out.

#[path = "support/scene.rs"]
mod scene;

use lamella::engine::snapshot::Values;
use lamella::engine::{Settings as EngineSettings, Unattended};
use lamella::scenario::Settings;
use scene::{Finished, edited, run, run_with, tell};

const VARYING: &str = include_str!("../experiments/exchange_media/varying.lam");
const JUMP: &str = include_str!("../experiments/exchange_media/jump.lam");
const COLUMN: &str = include_str!("../experiments/exchange_media/column.lam");
const AQUIFER: &str = include_str!("../experiments/exchange_media/aquifer.lam");

fn with(text: &str, set: &[(&str, &str)]) -> Finished {
    let set = set.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
    run_with(text, &Settings { set, ..Settings::default() })
}

/// Particles of an output: positions by axis, and values of the first species.
fn parcels(finished: &Finished, idx: usize) -> (Vec<Vec<f64>>, Vec<f64>) {
    match &finished.snapshots[idx].values {
        Values::Particles { positions, concentrations } => (positions.clone(), concentrations[0].clone()),
        _ => panic!("no particles"),
    }
}

fn worst(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |worst: f64, (a, b)| worst.max((a - b).abs()))
}

/// D(x) = D₀ x²: constant coefficients in ln x. The error falls with the square of the bandwidth.
#[test]
fn dispersion_that_varies_is_of_second_order() {
    let [coarse, fine] = ["400", "800"].map(|n| {
        let finished = with(VARYING, &[("n", n)]);
        assert!(finished.measure("leak") < 1e-13);
        finished.measure("err")
    });
    assert!(coarse < 1e-3 && coarse / fine > 3.0, "{coarse} {fine}");
}

/// Two half-spaces: the error falls with the bandwidth itself, on either side of the contrast.
#[test]
fn dispersion_that_jumps_is_of_first_order() {
    // The bandwidth is at least the distance of parcels on either side.
    for (ratio, long, sizes) in [("20", "4", ["400", "800"]), ("0.05", "20", ["800", "1600"])] {
        let [coarse, fine] = sizes.map(|n| {
            let finished = with(JUMP, &[("n", n), ("ratio", ratio), ("long", long)]);
            assert!(finished.measure("leak") < 1e-13);
            finished.measure("err")
        });
        assert!(coarse < 0.03 && coarse / fine > 1.6, "{ratio} {coarse} {fine}");
    }
}

/// Third-type inflow: what comes in is what the water carries, and nothing disperses out against it.
#[test]
fn water_comes_in_with_what_it_carries() {
    let finished = run(COLUMN);
    assert!(finished.measure("err") < 1e-3);
    assert!(finished.measure("leak") < 1e-13);
}

/// Parcels of one species in a random flow; clean water comes in and drives water that is not.
fn stirred(normalise: &str, integrate: &str, [inside, far, coming]: [f64; 3]) -> String {
    let mut text = AQUIFER.to_owned();
    let settings = format!("mixing_fraction part, normalise {normalise}, integrate {integrate}");
    for (from, to) in [
        ("grid 100 x 40", "grid 50 x 20"),
        ("mixing_fraction part", &settings),
        ("output map   A, B, C at t = 20 d, 40 d on 100 x 40", "output particles A at t = 20 d, 40 d"),
        ("inflow A = 1 mol/m^3", &format!("inflow A = {coming} mol/m^3")),
        (
            "initial B = 1 mol/m^3",
            &format!("initial A = if x < 10 m then {inside} mol/m^3 else {far} mol/m^3"),
        ),
        ("reaction meeting: A + B -> C @ instant\n", ""),
        ("species A, B, C", "species A"),
        ("output total A, B, C every 5 d", ""),
        ("measure made = linf(total.C) \"largest amount of C\"\n", ""),
    ] {
        text = edited(&text, from, to);
    }
    text
}

/// Nothing gets beyond what there was, and constants stay: `1 − c` becomes `1 − c`.
#[test]
fn constants_and_bounds_are_kept_in_a_random_flow() {
    for (normalise, integrate) in [
        ("arithmetic", "explicit"),
        ("geometric", "implicit"),
        ("sinkhorn", "explicit"),
        ("arithmetic", "exponential"),
    ] {
        let own = with(&stirred(normalise, integrate, [0.75, 0.5, 0.25]), &[("n", "2000")]);
        let other = with(&stirred(normalise, integrate, [0.25, 0.5, 0.75]), &[("n", "2000")]);
        own.keeps_its_books();
        for idx in 0..2 {
            let (places, values) = parcels(&own, idx);
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            assert!(low >= 0.25 - 1e-13 && high <= 0.75 + 1e-13 && high - low > 0.1, "{low} .. {high}");
            let (same_places, others) = parcels(&other, idx);
            let ones: Vec<f64> = values.iter().zip(&others).map(|(a, b)| a + b).collect();
            let off = worst(&ones, &vec![1.0; ones.len()]);
            tell(&format!("{normalise} {integrate}: {low} .. {high}, constants to {off:e}"));
            assert!(off < 1e-13 && places == same_places);
        }
    }
}

/// Any number of threads, and narrow code: the same bits.
#[test]
fn threads_and_lanes_change_no_bit() {
    let text = stirred("arithmetic", "explicit", [0.75, 0.5, 0.25]);
    let plan = with(&text, &[("n", "3000")]).plan;
    let of = |threads: usize, is_narrow: bool| {
        let settings = EngineSettings { threads: Some(threads), is_narrow, ..EngineSettings::default() };
        let mut all: Vec<Vec<u64>> = Vec::new();
        lamella::engine::run(&plan, &settings, &Unattended, &mut |snapshot| {
            if let Values::Particles { positions, concentrations } = &snapshot.values {
                let columns = positions.iter().chain(concentrations);
                all.extend(columns.map(|column| column.iter().map(|value| value.to_bits()).collect()));
            }
            Ok(())
        })
        .expect("the scene runs");
        all
    };
    let one = of(1, false);
    assert!(one.len() == 6 && one[0].len() > 2000);
    assert!(of(2, false) == one && of(7, false) == one && of(2, true) == one);
}

/// A flow by expressions that is the same everywhere makes the kernels of a uniform one.
#[test]
fn kernels_that_are_alike_are_those_of_a_constant_dispersion() {
    const SCENE: &str = r#"lamella 1
title "A drop in oblique flow"
species A
domain rect x = 0 .. 20 m, y = 0 .. 20 m
flow uniform (2e-3 m/s, 1e-3 m/s)
dispersion longitudinal 1 m, transverse 0.2 m, molecular 1e-5 m^2/s
boundary left, right, bottom, top periodic
exchange kernel KERNEL, bandwidth BANDWIDTH, normalise NORMALISE
initial A = exp(-((x - 10 m)^2 + (y - 10 m)^2) / (2 m^2)) * 1 mol/m^3
particles fluid COUNT random
run to 200 s, step 50 s
output particles A at t = 200 s
"#;
    // The last one reaches farther than the domain is long: images of images.
    for (kernel, bandwidth, normalise, count) in [
        ("gaussian", "collocation", "arithmetic", "4000"),
        ("wendland_c2", "2 * spacing", "geometric", "4000"),
        ("gaussian", "1.5 * spacing", "sinkhorn", "4000"),
        ("gaussian", "8 m", "arithmetic", "300"),
    ] {
        let text = SCENE.replace("KERNEL", kernel).replace("BANDWIDTH", bandwidth).replace("COUNT", count);
        let uniform = text.replace("NORMALISE", normalise);
        let expression = edited(
            &uniform,
            "uniform (2e-3 m/s, 1e-3 m/s)",
            "velocity = (2e-3 m/s + 0 * y / (1 s), 1e-3 m/s + 0 * x / (1 s))",
        );
        let (one, other) = (run(&uniform), run(&expression));
        assert!(one.plan.exchange.as_ref().unwrap().spreading.is_none());
        assert!(other.plan.exchange.as_ref().unwrap().spreading.is_some());
        let ((places, values), (same, others)) = (parcels(&one, 0), parcels(&other, 0));
        assert!(places.iter().zip(&same).all(|(a, b)| worst(a, b) < 1e-9));
        let off = worst(&values, &others);
        tell(&format!("{kernel} {bandwidth} {normalise}: {off:e}"));
        assert!(off < 1e-9);
    }
}

/// One step of the exchange between all pairs and their images, as it is defined: `½ (H_i⁻¹ + H_j⁻¹)` where both kernels
/// reach, the harmonic mean of shares, the mean of densities.
fn written_out(
    (places, values): (&[Vec<f64>], &[f64]),
    tensor: &dyn Fn(f64, f64) -> [f64; 3],
    (dt, radius): (f64, f64),
    (extent, bandwidth): ([f64; 2], &dyn Fn(f64) -> f64),
) -> Vec<f64> {
    let n = values.len();
    let of = |i: usize| {
        let [xx, xy, yy] = tensor(places[0][i], places[1][i]);
        let mean = (xx * yy - xy * xy).sqrt();
        let h = bandwidth((2.0 * mean * dt).sqrt());
        let scale = mean / (h * h) / (xx * yy - xy * xy);
        ([yy * scale, -xy * scale, xx * scale], 2.0 * mean * dt / (h * h))
    };
    let own: Vec<([f64; 3], f64)> = (0..n).map(of).collect();
    let mut w = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..n {
            // Periodic along x, mirrored along y.
            for (k, m, flip) in
                (-2..=2).flat_map(|k| (-2..=2).flat_map(move |m| [(k, m, false), (k, m, true)]))
            {
                let sign = if flip { -1.0 } else { 1.0 };
                let dx = places[0][j] + f64::from(k) * extent[0] - places[0][i];
                let dy = sign * places[1][j] + 2.0 * f64::from(m) * extent[1] - places[1][i];
                let square = |[a, b, c]: [f64; 3]| a * dx * dx + 2.0 * b * dx * dy + c * dy * dy;
                let [a, b, c] = own[j].0;
                let (one, other) = (square(own[i].0), square([a, sign * b, c]));
                if one.max(other) < radius * radius {
                    w[i][j] += (-0.25 * (one + other)).exp();
                }
            }
        }
    }
    let density: Vec<f64> = w.iter().map(|row| row.iter().sum()).collect();
    let weight = |i: usize, j: usize| {
        let share = 2.0 * own[i].1 * own[j].1 / (own[i].1 + own[j].1);
        2.0 * share * w[i][j] / (density[i] + density[j])
    };
    (0..n).map(|i| values[i] + (0..n).map(|j| weight(i, j) * (values[j] - values[i])).sum::<f64>()).collect()
}

#[test]
fn exchange_in_a_cell_of_rolling_water_is_its_sum_over_pairs() {
    const SCENE: &str = r#"lamella 1
title "Rolling water"
species A
domain rect x = 0 .. 20 m, y = 0 .. 10 m
flow velocity = (a * sin(pi * x / 10 m) * cos(pi * y / 10 m), -a * cos(pi * x / 10 m) * sin(pi * y / 10 m))
let a = 1e-3 m/s
dispersion longitudinal 2 m, transverse 0.5 m, molecular 1e-4 m^2/s
boundary left, right periodic
boundary bottom, top reflect
exchange kernel gaussian, bandwidth BANDWIDTH, cutoff 4, compensate off
initial A = 1 mol/m^3 * (1 + sin(3 * x / (1 m) + 2 * y / (1 m)))
particles fluid 400 random
run to 300 s, step 300 s
output particles A at t = 0 s, 300 s
"#;
    let tensor = |x: f64, y: f64| {
        let (x, y) = (std::f64::consts::PI * x / 10.0, std::f64::consts::PI * y / 10.0);
        let (u, v) = (1e-3 * x.sin() * y.cos(), -1e-3 * x.cos() * y.sin());
        let speed = u.hypot(v);
        let along = 1.5 / speed;
        [along * u * u + 0.5 * speed + 1e-4, along * u * v, along * v * v + 0.5 * speed + 1e-4]
    };
    let spacing = (200.0_f64 / 400.0).sqrt();
    // The standard deviation of a Gaussian that ends at a = 4, by its fourth moment.
    let (a, cut): (f64, f64) = (4.0, (-8.0_f64).exp());
    let kappa = ((8.0 - cut * (a.powi(4) + 4.0 * a * a + 8.0)) / (8.0 * (1.0 - cut))).sqrt();
    // Shares of less than a half: no weight has to be cut down.
    let rules: [(&str, &dyn Fn(f64) -> f64); 2] = [
        ("1.5 * collocation", &|ell| 1.5 * ell / kappa),
        ("max(1.5 * collocation, 0.9 * spacing)", &|ell| (1.5 * ell / kappa).max(0.9 * spacing)),
    ];
    for (bandwidth, rule) in rules {
        let finished = run(&SCENE.replace("BANDWIDTH", bandwidth));
        let ((_, before), (places, after)) = (parcels(&finished, 0), parcels(&finished, 1));
        // What a parcel carries does not change on its way.
        let exact = written_out((&places, &before), &tensor, (300.0, 4.0), ([20.0, 10.0], rule));
        tell(&format!("{bandwidth}: {:e} of {:e}", worst(&after, &exact), worst(&before, &after)));
        assert!(worst(&before, &after) > 0.3 && worst(&after, &exact) < 1e-12);
    }
}

/// A dispersion that is no number stops the run instead of exchanging nothing.
#[test]
fn dispersion_that_is_none_stops_a_run() {
    let text = edited(VARYING, "dispersion D * (x/a)^2", "dispersion D * sqrt(x/a - 5)");
    let sources = lamella::source::Sources::single("scene.lam", text);
    let checked = lamella::check(sources, &Settings::default(), &lamella::plan::compile::Options::default());
    let compiled = checked.compiled.expect("a plan looks at few places");
    let settings = EngineSettings::default();
    let ended = lamella::engine::run(&compiled.plan, &settings, &Unattended, &mut |_| Ok(()));
    assert!(ended.is_err());
}

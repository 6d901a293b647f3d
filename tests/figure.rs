//! The figure of a run: the same bytes every time, well-formed, with everything that was asked for.

// The rows of points and errors are for the tests of tables.
#[allow(dead_code)]
mod common;

use lamella::engine::snapshot::{MixingState, Snapshot, Values};
use lamella::maths::scalar::{erfc, exp};
use lamella::measure::Curve;
use lamella::plan::{OutputKind, Plan, Quantity};
use lamella::report::figure;

const N_BINS: usize = 300;
const TIMES: [f64; 4] = [619.0, 916.0, 1114.0, 1510.0];

/// A front in a column of 15 cm: a species by the complementary error function, and its product.
fn front(x: f64, t: f64, is_product: bool) -> f64 {
    let z = x / (2.0 * (1.3e-7 * t).sqrt());
    if is_product { 10.0 * erfc(z.abs()) } else { 10.0 * erfc(z) }
}

/// A reproducible stand-in for sampling noise in −1 … 1.
fn noise(k: usize) -> f64 {
    let mixed = (k as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
    mixed as f64 / f64::from(1 << 23) - 1.0
}

fn centre(bin: usize) -> f64 {
    -0.075 + 0.15 * (bin as f64 + 0.5) / N_BINS as f64
}

fn column() -> (Plan, Vec<Snapshot>, Vec<Curve>) {
    let mut plan = common::plan();
    plan.axes.truncate(1);
    plan.species[2] = lamella::plan::Species { name: "AB".to_owned(), ..plan.species[0].clone() };
    let every: Vec<f64> = (1..=151).map(|k| 10.0 * f64::from(k)).collect();
    let output = |kind, quantities: Vec<Quantity>, bins: usize, times: &[f64]| lamella::plan::Output {
        kind,
        quantities,
        bins: if bins > 0 { vec![bins] } else { Vec::new() },
        times: times.to_vec(),
        unit: None,
        station: None,
    };
    plan.outputs = vec![
        output(OutputKind::Profile, vec![Quantity::Species(0), Quantity::Species(2)], N_BINS, &TIMES),
        output(OutputKind::Covariance, vec![Quantity::Pair(0, 1)], N_BINS, &TIMES),
        output(OutputKind::Total, vec![Quantity::Species(2)], 0, &every),
        output(OutputKind::Mixing, vec![Quantity::Pair(0, 1)], N_BINS, &every),
    ];
    let mut snapshots = Vec::new();
    let mut curves = Vec::new();
    let centres: Vec<f64> = (0..N_BINS).map(centre).collect();
    for t in TIMES {
        let mean = |is_product: bool, scale: f64| -> Vec<f64> {
            let value =
                |(k, x): (usize, &f64)| front(*x, t, is_product) * scale + 0.15 * noise(k + t as usize);
            centres.iter().enumerate().map(value).collect()
        };
        let n_particles = vec![3333; N_BINS];
        let values = Values::Binned {
            mean: vec![mean(false, 1.0), mean(true, 0.8)],
            standard_error: vec![vec![0.1; N_BINS]; 2],
            n_particles: n_particles.clone(),
        };
        snapshots.push(Snapshot { output_idx: 0, t, values });
        let bump = |x: f64| -20.0 * exp(-x * x / (4.0 * 1.3e-7 * t));
        let covariance = vec![centres.iter().enumerate().map(|(k, x)| bump(*x) + 0.3 * noise(k)).collect()];
        snapshots.push(Snapshot { output_idx: 1, t, values: Values::Covariance { covariance, n_particles } });
        for (reference, scale) in [("well_mixed", 1.0), ("limit", 0.8)] {
            let y = centres.iter().map(|x| front(*x, t, true) * scale).collect();
            let quantity = Quantity::Species(2);
            let x = centres.clone();
            curves.push(Curve { reference: reference.to_owned(), output_idx: 0, quantity, t: Some(t), x, y });
        }
    }
    let gamma = |t: f64| 0.4 * (1e-3 * t).sqrt() * exp(-1e-3 * t) + 0.002;
    for (k, t) in every.iter().enumerate() {
        let amount = Values::Total { amount: vec![0.0123 * t.sqrt()] };
        snapshots.push(Snapshot { output_idx: 2, t: *t, values: amount });
        let gamma = gamma(*t) * (1.0 + 0.03 * noise(k));
        let state = MixingState { m: 1.0, m_mean: 1.0, m_cov: gamma, gamma };
        snapshots.push(Snapshot { output_idx: 3, t: *t, values: Values::Mixing(vec![state]) });
    }
    let (x, y) = (every.clone(), every.iter().map(|t| gamma(*t)).collect());
    let quantity = Quantity::Pair(0, 1);
    curves.push(Curve { reference: "gamma_limit".to_owned(), output_idx: 3, quantity, t: None, x, y });
    (plan, snapshots, curves)
}

fn record() -> lamella::table::Record {
    lamella::table::Record {
        title: Some("CuEDTA front in a sand column <&>".to_owned()),
        n_axes: 1,
        ..common::record()
    }
}

/// Left beside the build for whoever wants to look.
fn keep(name: &str, svg: &str) {
    std::fs::write(std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name), svg).unwrap();
}

#[test]
fn a_column_has_a_panel_for_each_output() {
    let (plan, snapshots, curves) = column();
    let svg = figure(&plan, &record(), &snapshots, &curves);
    keep("column.svg", &svg);
    for text in ["(a) A", "(b) AB", "(c) cov(A, B)", "(d) total AB", "(e) γ(A, B)"] {
        assert!(svg.contains(text), "{text}");
    }
    for text in [
        "619 s",
        "1510 s",
        "well_mixed",
        "limit",
        "x (cm)",
        "concentration (mmol/L)",
        "amount (mol/m²)",
        "covariance (mmol²/L²)",
    ] {
        assert!(svg.contains(text), "{text}");
    }
    assert!(svg.contains("CuEDTA front in a sand column &lt;&amp;&gt;"));
    assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"));
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    assert_eq!(svg, figure(&plan, &record(), &snapshots, &curves), "the same results, the same bytes");
}

#[test]
fn a_map_is_drawn_as_coloured_cells() {
    let mut plan = common::plan();
    let n = (200, 80);
    plan.axes[0].high = 0.2;
    plan.axes[0].low = 0.0;
    plan.outputs = vec![lamella::plan::Output {
        kind: OutputKind::Map,
        quantities: vec![Quantity::Species(0), Quantity::Species(2)],
        bins: vec![n.0, n.1],
        times: vec![86_400.0 * 50.0],
        unit: None,
        station: None,
    }];
    let value = |k: usize| {
        let (x, y) = ((k / n.1) as f64 / n.0 as f64 - 0.4, (k % n.1) as f64 / n.1 as f64 - 0.5);
        exp(-20.0 * (x * x + y * y))
    };
    let mean: Vec<f64> = (0..n.0 * n.1).map(value).collect();
    let n_particles = (0..n.0 * n.1).map(|k| if k % n.1 < 5 { 0 } else { 10 }).collect();
    let grams = mean.iter().map(|value| 1e-4 * value).collect();
    let values = Values::Binned {
        standard_error: vec![vec![0.0; mean.len()]; 2],
        mean: vec![mean, grams],
        n_particles,
    };
    let svg = figure(&plan, &record(), &[Snapshot { output_idx: 0, t: 86_400.0 * 50.0, values }], &[]);
    keep("map.svg", &svg);
    assert!(svg.contains("(a) A at 50 d") && svg.contains("y (cm)") && svg.contains("mg/L"));
    // 16,000 cells with their own rectangle each would take 2 MB a panel.
    assert!(svg.len() < 2_000_000, "{} bytes", svg.len());
}

#[test]
fn every_kind_of_output_and_none_can_be_drawn() {
    let svg = figure(&common::plan(), &common::record(), &common::snapshots(), &[]);
    keep("all.svg", &svg);
    assert!(svg.contains("mg/L") && !svg.contains("NaN"));
    let mut plan = common::plan();
    plan.outputs.clear();
    assert!(figure(&plan, &common::record(), &[], &[]).contains("no output that can be drawn"));
}

#[test]
fn values_out_of_all_bounds_are_drawn_without_panic() {
    let (plan, mut snapshots, mut curves) = column();
    let hostile = [f64::NAN, f64::INFINITY, f64::MAX, f64::MIN, -0.0, 5e-324, 1e-300];
    for (k, value) in hostile.into_iter().enumerate() {
        for snapshot in &mut snapshots {
            match &mut snapshot.values {
                Values::Binned { mean, .. } => mean[0][k] = value,
                Values::Covariance { covariance, .. } => covariance[0].fill(value),
                Values::Total { amount } => amount[0] = value,
                Values::Mixing(states) => states[0].gamma = value,
                Values::Rows(_) | Values::Particles { .. } => {}
            }
        }
        curves.iter_mut().for_each(|curve| curve.y[k] = value);
        let svg = figure(&plan, &record(), &snapshots, &curves);
        assert!(svg.trim_end().ends_with("</svg>"));
    }
}

//! Parcels of water in flows that vary, with sides of every kind, held to closed forms.
//!
//! Bounds: four times the sampling noise of bins, or what the closed form of a step leaves. The closed forms stand in
//! the scenes.

#[path = "support/scene.rs"]
mod scene;

use lamella::engine::snapshot::{Snapshot, Values};
use lamella::engine::{RunError, Settings as EngineSettings, Unattended};
use lamella::plan::OutputKind;
use lamella::plan::compile::Options;
use lamella::scenario::Settings;
use lamella::source::Sources;
use scene::{Finished, edited, run, tell};

/// Snapshots of a scene, or why it stopped.
fn snapshots(text: &str, settings: &EngineSettings) -> Result<Vec<Snapshot>, RunError> {
    let sources = Sources::single("scene.lam", text);
    let checked = lamella::check(sources, &Settings::default(), &Options::default());
    let compiled = checked.compiled.unwrap_or_else(|| panic!("no plan: {:#?}", checked.diagnostics));
    let mut snapshots = Vec::new();
    lamella::engine::run(&compiled.plan, settings, &Unattended, &mut |snapshot| {
        snapshots.push(snapshot);
        Ok(())
    })?;
    Ok(snapshots)
}

/// Parcels per bin of the last output of a kind.
fn counts(finished: &Finished, kind: OutputKind) -> Vec<u64> {
    let mut own = finished.snapshots.iter().filter(|it| finished.plan.outputs[it.output_idx].kind == kind);
    match own.next_back().map(|snapshot| &snapshot.values) {
        Some(Values::Binned { n_particles, .. }) => n_particles.clone(),
        _ => panic!("no bins"),
    }
}

/// `Σ (n − E)²/E / bins`: 1 for parcels at random.
fn scatter(counts: &[u64], expected: impl Fn(usize) -> f64) -> f64 {
    let of = |(bin, &n): (usize, &u64)| (n as f64 - expected(bin)).powi(2) / expected(bin);
    counts.iter().enumerate().map(of).sum::<f64>() / counts.len() as f64
}

fn as_fluid(text: &str, from: &str, to: &str) -> String {
    edited(text, from, to)
}

#[test]
fn water_brings_its_tracer_in() {
    let text = include_str!("../experiments/transport_basics/inflow.lam");
    let finished = run(&as_fluid(text, "particles mass 400_000", "particles fluid 400_000"));
    finished.keeps_its_books();
    assert!(finished.measure("error") < 0.02);
    assert!(finished.measure("at_inlet") < 0.03);
}

/// A first-type condition in steps of half a day: what touches the wall carries what is held there.
#[test]
fn a_side_is_kept_at_its_concentration() {
    let text = "lamella 1
species A
domain line x = 0 .. 20 m
boundary left  concentration A = 1 mol/m^3
boundary right outflow
flow uniform 0.7 m/d
dispersion longitudinal 0 m, molecular 1 m^2/d
particles fluid 400_000
run to 1 d, step 0.5 d
output profile A at t = 0.5 d, 1 d on 50
reference exact for A = ogata_banks(velocity = 0.7 m/d, dispersion = 1 m^2/d, inlet = 1 mol/m^3)
measure error = l2(profile.A - exact) / l2(exact)
";
    let finished = run(text);
    finished.keeps_its_books();
    // 8000 parcels a bin, up to 0.6 % of c each where it varies: measured 0.7 %, with one step of 1 d as well.
    assert!(finished.measure("error") < 0.015);
    let coarse = run(&edited(&edited(text, "step 0.5 d", "step 1 d"), "t = 0.5 d, 1 d", "t = 1 d"));
    assert!(coarse.measure("error") < 0.015);
}

/// A half space beside a wall that absorbs, at once or at a rate; water stands still.
///
/// Closed forms: J. Crank, The Mathematics of Diffusion (1975), equations 3.13 and 3.35.
#[test]
fn walls_take_out_what_they_should() {
    let text = "lamella 1
param k = 1 m/d
param D = 1 m^2/d
param c0 = 1 mol/m^3
species A
domain line x = 0 .. 12 m
boundary left absorb
boundary right reflect
dispersion D
initial A = c0
particles fluid 400_000
run to 1 d, step 0.5 d
output profile A at t = 1 d on 60
output total A at t = 0.25 d, 1 d
let h = k / D
reference at_once for A = c0 * erf(x / sqrt(4 * D * t))
reference at_rate for A = c0 * (erf(x / sqrt(4 * D * t)) + exp(h * x + h^2 * D * t) * erfc(x / sqrt(4 * D * t) + h * sqrt(D * t)))
reference all_at_once for total A = c0 * (12 m - 2 * sqrt(D * t / pi))
reference all_at_rate for total A = c0 * (12 m - (exp(h^2 * D * t) * erfc(h * sqrt(D * t)) - 1 + 2 * h * sqrt(D * t / pi)) / h)
measure error   = linf(profile.A - at_once) / c0
measure error_k = linf(profile.A - at_rate) / c0
measure amount   = linf(total.A - all_at_once) / linf(all_at_once)
measure amount_k = linf(total.A - all_at_rate) / linf(all_at_rate)
";
    let finished = run(text);
    finished.keeps_its_books();
    // 6667 parcels a bin: 0.6 % of c at the wall.
    assert!(finished.measure("error") < 0.02);
    // 19 000 parcels per metre: what was taken is known to 0.3 % of itself.
    assert!(finished.measure("amount") < 1e-3);
    let rate = run(&edited(text, "left absorb", "left absorb rate k"));
    rate.keeps_its_books();
    assert!(rate.measure("error_k") < 0.02);
    assert!(rate.measure("amount_k") < 1e-3);
}

#[test]
fn shear_draws_a_cloud_out() {
    let text = include_str!("../experiments/transport_basics/shear.lam");
    let text = as_fluid(text, "particles mass 400_000", "particles fluid 400_000 stratified");
    let text = edited(&text, "on 60 x 32", "on 30 x 16");
    let finished = run(&text);
    finished.keeps_its_books();
    assert!(finished.measure("error") < 0.12);
    assert!(finished.measure("leak") < 3e-3);
}

const AQUIFER: &str = "lamella 1
species A, B, C
domain rect x = 0 .. 100 m, y = 0 .. 40 m
medium porosity 0.25
flow darcy {
  head left 10 m, right 9 m
  no_flow bottom, top
  conductivity lognormal(geometric_mean = 10 m/d, variance = 1, covariance = exponential(5 m, 5 m))
  grid 100 x 40
}
dispersion longitudinal 0.1 m, transverse 0.01 m, molecular 1e-4 m^2/d
boundary left inflow A = 1 mol/L
boundary right outflow
boundary bottom, top reflect
mixing zones {
  fast: fraction 0.5, rate instant
  slow: fraction 0.5, rate 0.1 /d
}
average bins 50 x 20
initial B = 1 mol/L
reaction meeting: A + B -> C @ instant
particles fluid 100_000
run to 600 d, step 2 d
seed 3
output map A, B, C at t = 60 d, 600 d on 20 x 8
output total A, B, C every 30 d
";

/// Water of a random aquifer is exchanged several times: parcels stay as dense as it is, and their number does.
#[test]
fn uniform_stays_uniform_in_a_random_flow() {
    let finished = run(&edited(AQUIFER, "step 2 d", "step auto(courant <= 0.25, dispersion <= 0.1)"));
    finished.keeps_its_books();
    let counts = counts(&finished, OutputKind::Map);
    let n: u64 = counts.iter().sum();
    tell(&format!("{n} parcels at the end, scatter {:.2}", scatter(&counts, |_| n as f64 / 160.0)));
    // What comes in is stratified; what goes out, and when, is chance: some hundred parcels.
    assert!((n as f64 - 1e5).abs() < 1.5e3, "{n} parcels");
    // 160 bins: 1 ± 0.11, and the interpolation of velocities across contrasts.
    let scatter = scatter(&counts, |_| n as f64 / 160.0);
    assert!((0.6..1.6).contains(&scatter), "{scatter}");
    // The water of the start is gone, and with it what reacted.
    let last = |species: usize| match &finished.snapshots.last().expect("totals").values {
        Values::Total { amount } => amount[species],
        _ => panic!("no totals"),
    };
    let pore_water = 0.25 * 100.0 * 40.0 * 1000.0;
    tell(&format!("left {:.2e} {:.2e} {:.2e} of A, B, C", last(0), last(1), last(2)));
    assert!(last(0) > 0.9 * pore_water && last(1) < 0.02 * pore_water);
}

/// A relation of what is there at first must hold for what comes in, or it is none.
#[test]
fn species_follow_from_others_only_if_sides_agree() {
    let n_carried = |text: &str| run(text).plan.components.len();
    let short = edited(&edited(AQUIFER, "run to 600 d", "run to 4 d"), "60 d, 600 d", "2 d, 4 d");
    let short = edited(&edited(&short, "every 30 d", "every 2 d"), "100_000", "50_000");
    // B = 1 mol/L − A holds in both waters, and B = 1 mol/L − A/2; two waters make one relation always.
    assert_eq!(n_carried(&short), 1);
    assert_eq!(n_carried(&edited(&short, "inflow A = 1 mol/L", "inflow A = 2 mol/L")), 1);
    assert_eq!(n_carried(&edited(&short, "inflow A = 1 mol/L", "concentration A = 1 mol/L")), 1);
    // Not so three, or ever others.
    let lower = "left y = 0 .. 20 m inflow A = 2 mol/L\nboundary left inflow A = 1 mol/L";
    assert_eq!(n_carried(&edited(&short, "left inflow A = 1 mol/L", lower)), 2);
    assert_eq!(n_carried(&edited(&short, "inflow A = 1 mol/L", "inflow A = 1 mol/L, B = y * 1 mol/L/m")), 2);
    // Clean water of a well has neither.
    let well = edited(&short, "  grid 100", "  well feed at (50 m, 20 m) rate 0.1 m^2/d\n  grid 100");
    assert_eq!(n_carried(&well), 2);
}

/// Two ways to run the same water: what nobody needs is left out, or everything is carried.
#[test]
fn books_are_kept_with_and_without_passes() {
    let short = edited(&edited(AQUIFER, "run to 600 d", "run to 20 d"), "60 d, 600 d", "10 d, 20 d");
    let text = edited(&edited(&short, "every 30 d", "every 10 d"), "100_000", "50_000");
    let text = edited(&text, "inflow A = 1 mol/L", "inflow A = 2 mol/L, C = 0.5 mol/L");
    run(&text).keeps_its_books();
    let sources = Sources::single("scene.lam", text.clone());
    let options = Options { passes: lamella::plan::Selection::None, ..Options::default() };
    let plan = lamella::check(sources, &Settings::default(), &options).compiled.expect("a plan").plan;
    let mut last = Vec::new();
    let outcome =
        lamella::engine::run(&plan, &EngineSettings::default(), &Unattended, &mut |snapshot: Snapshot| {
            if let Values::Total { amount } = snapshot.values {
                last = amount;
            }
            Ok(())
        })
        .expect("the scene runs");
    assert!(outcome.mass_defect.iter().all(|defect| *defect < 1e-12), "{:?}", outcome.mass_defect);
    let with = snapshots(&text, &EngineSettings::default()).expect("the scene runs");
    let Some(Values::Total { amount }) = with.last().map(|snapshot| &snapshot.values) else {
        panic!("no totals")
    };
    for (a, b) in amount.iter().zip(&last) {
        assert!((a - b).abs() <= 1e-9 * a.abs(), "{amount:?} {last:?}");
    }
}

/// Threads change no byte, and an output between two steps none of the others.
#[test]
fn order_and_outputs_change_nothing() {
    let short = edited(&edited(AQUIFER, "run to 600 d", "run to 20 d"), "60 d, 600 d", "10 d, 20 d");
    let text = edited(&edited(&short, "every 30 d", "every 10 d"), "100_000", "50_000");
    let bits = |snapshots: &[Snapshot]| format!("{snapshots:?}");
    let one = snapshots(&text, &EngineSettings { threads: Some(1), ..EngineSettings::default() });
    let two = snapshots(&text, &EngineSettings { threads: Some(2), ..EngineSettings::default() });
    let one = one.expect("the scene runs");
    assert!(bits(&one) == bits(&two.expect("the scene runs")), "threads change the results");
    let more = format!("{text}output profile A at t = 5 d, 11 d on 10\n");
    let more = snapshots(&more, &EngineSettings::default()).expect("the scene runs");
    let others: Vec<Snapshot> = more.into_iter().filter(|snapshot| snapshot.output_idx < 2).collect();
    assert!(bits(&one) == bits(&others), "an output between two steps disturbs the run");
}

/// Between two steps the amount that has come in is what it should be.
#[test]
fn water_is_looked_at_between_two_steps() {
    let text = "lamella 1
species A
domain line x = 0 .. 10 m
boundary left  inflow A = 2 mol/m^3
boundary right outflow
flow uniform 1 m/d
dispersion 0.1 m^2/d
particles fluid 100_000
run to 2 d, step 0.5 d
output total A at t = 0.2 d, 0.5 d, 1.3 d
reference mass for total A = 2 mol/m^3 * 1 m/d * t
measure error = linf(total.A - mass) / linf(mass)
";
    assert!(run(text).measure("error") < 1e-3);
}

/// Where porosity varies there is more water, and more parcels; a uniform concentration stays what it is.
#[test]
fn parcels_are_as_dense_as_water() {
    let text = "lamella 1
species A
domain rect x = 0 .. 10 m, y = 0 .. 2 m
medium porosity 0.2 + 0.1 * sin(2 * pi * x / 10 m)
flow velocity = (0.1 m/d / (0.2 + 0.1 * sin(2 * pi * x / 10 m)), 0 m/d)
dispersion 0.05 m^2/d
boundary left, right periodic
boundary bottom, top reflect
initial A = 1 mol/m^3
particles fluid 100_000
run to 20 d, step 0.1 d
output map A at t = 20 d on 20 x 1
output total A at t = 20 d
reference mass for total A = 0.2 * 20 m^2 * 1 mol/m^3
measure error = linf(total.A - mass) / linf(mass)
";
    let through = edited(text, "left, right periodic", "left inflow A = 1 mol/m^3");
    let through = edited(&through, "boundary bottom", "boundary right outflow\nboundary bottom");
    for text in [text, &through] {
        let finished = run(text);
        finished.keeps_its_books();
        let counts = counts(&finished, OutputKind::Map);
        let n: u64 = counts.iter().sum();
        let edge = |bin: usize| {
            let x = bin as f64 * 0.5;
            0.2 * x - 0.1 * 10.0 / std::f64::consts::TAU * (std::f64::consts::TAU * x / 10.0).cos()
        };
        let expected = |bin: usize| n as f64 * (edge(bin + 1) - edge(bin)) / 2.0;
        let scatter = scatter(&counts, expected);
        tell(&format!("{n} parcels, scatter {scatter:.2}"));
        // 20 bins: 1 ± 0.32.
        assert!(scatter < 2.3, "{scatter}: {counts:?}");
        // Parcels come in evenly and go out by chance.
        assert!(finished.measure("error") < 5e-3);
    }
}

/// A column in which what comes in decays: the steady profile.
///
/// Closed form: c = 2 c0/(1 + g) exp((1 − g) v x / 2D), g = √(1 + 4kD/v²), from v c − D c' = v c0 at the inlet.
#[test]
fn what_comes_in_later_has_reacted_for_a_shorter_time() {
    let text = "lamella 1
param k = 0.5 /d
param v = 1 m/d
param D = 0.5 m^2/d
species A, P
domain line x = 0 .. 16 m
boundary left  inflow A = 1 mol/m^3
boundary right outflow
flow uniform v
dispersion D
reaction decay: A -> P @ k
chemistry splitting strang
particles fluid 200_000
run to 40 d, step 0.1 d
output profile A, P at t = 40 d on 64
let g = sqrt(1 + 4 * k * D / v^2)
reference steady for A = 2 mol/m^3 / (1 + g) * exp((1 - g) * v * x / (2 * D))
measure error   = linf(profile.A - steady) / linf(steady)
measure balance = linf(profile.A + profile.P - 1 mol/m^3) / 1 mol/m^3
";
    let finished = run(text);
    finished.keeps_its_books();
    // 3125 parcels a bin, whose ages differ: 0.3 % of c0 in the first bins.
    assert!(finished.measure("error") < 0.015);
    // The water of the start had neither A nor P, and is gone but for some hundred-millionths.
    assert!(finished.measure("balance") < 1e-6);
}

/// Water that a well pumps in is clean, what it takes out leaves with what is in it, and parcels stay as dense.
#[test]
fn wells_bring_water_and_take_it() {
    let text = "lamella 1
species A
domain rect x = 0 .. 20 m, y = 0 .. 8 m
medium porosity 0.25
flow darcy {
  head left 10 m
  no_flow right, bottom, top
  conductivity 10 m/d
  well feed at (4.3 m, 3.6 m) rate 0.5 m^2/d
  well pump at (16.3 m, 4.6 m) rate -4 m^2/d
  grid 20 x 8
}
dispersion longitudinal 0.2 m, transverse 0.02 m, molecular 1e-4 m^2/d
boundary left inflow A = 8 mg/L
boundary right, bottom, top reflect
initial A = 8 mg/L
particles fluid 100_000
run to 40 d, step auto(courant <= 0.05, dispersion <= 0.01)
output map   A at t = 40 d on 20 x 8
output total A at t = 0 d, 40 d
";
    let finished = run(text);
    finished.keeps_its_books();
    let counts = counts(&finished, OutputKind::Map);
    let n: u64 = counts.iter().sum();
    let scatter = scatter(&counts, |_| n as f64 / 160.0);
    tell(&format!("{n} parcels, scatter {scatter:.2}"));
    assert!((n as f64 - 1e5).abs() < 2e3, "{n}");
    assert!(scatter < 2.0, "{scatter}");
    // The cell of the feed lets in 0.5 m²/d of clean water beside what flows through: between none and all of it.
    let amount = |snapshot: &Snapshot| match &snapshot.values {
        Values::Total { amount } => amount[0],
        _ => 0.0,
    };
    let (first, last) = (amount(&finished.snapshots[0]), amount(finished.snapshots.last().expect("a total")));
    // Of the water behind the feed an eighth is clean.
    tell(&format!("{:.3} of the amount is left", last / first));
    assert!(last < 0.95 * first && last > 0.85 * first);
}

/// A side that reflects lets no water through, and one for what goes out lets none in.
#[test]
fn sides_that_say_nothing_of_the_water_through_them_stop_the_run() {
    let text = "lamella 1
species A
domain line x = 0 .. 10 m
boundary left  inflow A = 2 mol/m^3
boundary right outflow
flow uniform 1 m/d
dispersion 0.1 m^2/d
particles fluid 1000
run to 2 d, step 0.5 d
output total A at t = 2 d
";
    for (from, to) in [("right outflow", "right reflect"), ("flow uniform 1", "flow uniform -1")] {
        let text = edited(text, from, to);
        let text =
            if to.contains('-') { edited(&text, "left  inflow A = 2 mol/m^3", "left inflow") } else { text };
        let error = snapshots(&text, &EngineSettings::default()).expect_err("water goes through");
        assert!(matches!(&error, RunError::Leak { side: 1, name: "right", .. }), "{error}");
    }
}

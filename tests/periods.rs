//! Flows and concentrations that change in time, from text to numbers, held to closed forms.
//!
//! Bounds: four times the sampling error, which is known, but where another is given with its reason.

use lamella::data::DataFile;
use lamella::engine::snapshot::{Outcome, Snapshot, Values};
use lamella::engine::{Settings as EngineSettings, Unattended};
use lamella::maths::scalar::{cos, erfc, exp};
use lamella::maths::special::erfcx;
use lamella::plan::compile::Options;
use lamella::plan::{OutputKind, Plan};
use lamella::scenario::Settings;
use lamella::source::Sources;
use std::sync::Arc;

const DAY: f64 = 86_400.0;

struct Finished {
    plan: Plan,
    snapshots: Vec<Snapshot>,
    outcome: Outcome,
}

fn run_on(text: &str, threads: Option<usize>) -> Finished {
    run_sources(Sources::single("scene.lam", text), threads)
}

fn run_sources(sources: Sources, threads: Option<usize>) -> Finished {
    let checked = lamella::check(sources, &Settings::default(), &Options::default());
    let compiled = checked.compiled.unwrap_or_else(|| panic!("no plan: {:#?}", checked.diagnostics));
    let mut snapshots: Vec<Snapshot> = Vec::new();
    let settings = EngineSettings { threads, ..EngineSettings::default() };
    let outcome = lamella::engine::run(&compiled.plan, &settings, &Unattended, &mut |snapshot| {
        snapshots.push(snapshot);
        Ok(())
    })
    .expect("the scene runs");
    let worst = outcome.mass_defect.iter().fold(0.0, |worst: f64, defect| worst.max(*defect));
    assert!(worst < 1e-12, "mass in = inside + out to {worst:e}");
    Finished { plan: compiled.plan, snapshots, outcome }
}

/// Measured numbers, shown by `cargo test -- --nocapture`.
#[expect(clippy::print_stdout, reason = "tests report what they measured")]
fn tell(report: &str) {
    println!("{report}");
}

fn run(text: &str) -> Finished {
    run_on(text, None)
}

impl Finished {
    /// Times in days and the numbers of the rows of the first species.
    fn rows(&self, kind: OutputKind, place: Option<&str>) -> Vec<(f64, Vec<f64>)> {
        let mut found = Vec::new();
        for snapshot in &self.snapshots {
            let output = &self.plan.outputs[snapshot.output_idx];
            let Values::Rows(rows) = &snapshot.values else { continue };
            let places = self.plan.places(output);
            for row in rows[0].iter().filter(|_| output.kind == kind) {
                if place.is_none_or(|place| places[usize::from(row.place)] == place) {
                    found.push((snapshot.t / DAY, row.numbers.clone()));
                }
            }
        }
        found
    }

    /// Mass, mean and variance along x.
    fn moments(&self, t: f64) -> [f64; 3] {
        let rows = self.rows(OutputKind::Moments, None);
        let (_, row) = rows.iter().find(|(own, _)| (own - t).abs() < 1e-9).expect("moments");
        [row[0], row[1], row[4]]
    }

    /// What came in and what went out by a door since the start.
    fn budget(&self, t: f64, door: &str) -> [f64; 2] {
        let rows = self.rows(OutputKind::Budget, Some(door));
        let (_, row) = rows.iter().find(|(own, _)| (own - t).abs() < 1e-9).expect("a budget");
        [row[1], row[2]]
    }

    /// The means of the bins at the last time, with their standard errors.
    fn profile(&self) -> Vec<[f64; 2]> {
        let found = self.snapshots.iter().rev().find_map(|snapshot| match &snapshot.values {
            Values::Binned { mean, standard_error, .. } => Some((&mean[0], &standard_error[0])),
            _ => None,
        });
        let (mean, error) = found.expect("a profile");
        mean.iter().zip(error).map(|(mean, error)| [*mean, *error]).collect()
    }
}

fn near(found: f64, expected: f64, bound: f64, what: &str) {
    assert!((found - expected).abs() <= bound, "{what}: {found} for {expected}, bound {bound:e}");
}

const N: f64 = 20_000.0;

/// A pulse in a flow along x; dispersion, flow and left side are given.
fn pulse(flow: &str, dispersion: &str) -> String {
    format!(
        "lamella 1
species S
domain line x = 0 m .. 60 m
boundary left inflow S = 0 mg/L
boundary right outflow
medium porosity 0.25
flow {flow}
dispersion {dispersion}
source pulse: S = 1 kg/m^2 at point(20 m)
particles mass 20_000
run to 5 d, step 0.5 d
output moments S at t = 2 d, 5 d
output budget S at t = 5 d
"
    )
}

/// A plan counts the steps that changes of the flow cut, as the run does, and shows long rows of flows by their ends.
#[test]
fn a_plan_tells_of_cut_steps_and_of_long_rows_of_flows() {
    let shown = |text: &str| {
        let sources = Sources::single("scene.lam", text);
        let checked = lamella::check(sources, &Settings::default(), &Options::default());
        lamella::plan::explain::explain(&checked.compiled.expect("a plan"), "scene.lam", None)
    };
    let once = pulse("uniform (if t < 2.2 d then 1 m/d else 2 m/d)", "0.02 m^2/d");
    let plan = shown(&once);
    assert!(plan.contains("10 steps of 43200 s to 432000 s, and 1 more: steps are cut"), "{plan}");
    assert_eq!(run(&once).outcome.n_steps, 11);
    let on_steps = shown(&pulse("uniform (if t < 2 d then 1 m/d else 2 m/d)", "0.02 m^2/d"));
    assert!(!on_steps.contains("are cut"), "{on_steps}");
    let often = shown(&pulse("uniform 1 m/d * (1 + t / 10 d) change every 1 h", "0.02 m^2/d"));
    // 119 changes, of which 11 and the last are shown.
    assert!(often.contains("… and 107 flows between"), "{often}");
    assert_eq!(often.lines().filter(|line| line.trim_start().starts_with("from ")).count(), 12);
}

/// `v` for 2.2 days, then `w`; the change lies within a step. Mean and variance are those of the equation, and the
/// same of a flow by heads: the porosity is a quarter, the column 60 m long.
#[test]
fn a_pulse_follows_a_flow_that_changes() {
    let uniform = "uniform (if t < 2.2 d then 1 m/d else 2 m/d)";
    let darcy = "darcy {
  head left if t < 2.2 d then 101 m else 102 m
  head right 100 m
  conductivity 15 m/d
  grid 60
}";
    let parts = "longitudinal 0.05 m, molecular 0.002 m^2/d";
    for (flow, dispersion, spread) in [
        (uniform, "0.02 m^2/d", [0.02 * 2.0, 0.02 * 5.0]),
        (uniform, parts, [0.05 * 2.0 + 0.004, 0.05 * 7.8 + 0.01]),
        (darcy, parts, [0.05 * 2.0 + 0.004, 0.05 * 7.8 + 0.01]),
    ] {
        let finished = run(&pulse(flow, dispersion));
        for (t, mean, spread) in [(2.0, 22.0, spread[0]), (5.0, 27.8, spread[1])] {
            let [mass, found, variance] = finished.moments(t);
            let expected: f64 = 2.0 * spread;
            near(mass, 1.0, 1e-12, "mass");
            near(found, mean, 4.0 * (expected / N).sqrt(), "mean");
            near(variance, expected, 4.0 * expected * (2.0 / N).sqrt(), "variance");
        }
    }
}

/// There and back: the mean is where it began, the spread is that of the whole way.
#[test]
fn what_is_pushed_and_pulled_comes_back_spread() {
    for (dispersion, spread) in
        [("0.02 m^2/d", 0.02 * 5.0), ("longitudinal 0.05 m, molecular 0 m^2/d", 0.05 * 5.0)]
    {
        let finished = run(&pulse("uniform (if t < 2.5 d then 1 m/d else -1 m/d)", dispersion));
        let [mass, mean, variance] = finished.moments(5.0);
        let expected: f64 = 2.0 * spread;
        near(mass, 1.0, 1e-12, "mass");
        near(mean, 20.0, 4.0 * (expected / N).sqrt(), "mean");
        near(variance, expected, 4.0 * expected * (2.0 / N).sqrt(), "variance");
    }
    // Where water leaves through a side of inflow, what it carries leaves with it.
    let text = pulse("uniform (if t < 1 d then 1 m/d else -20 m/d)", "0.02 m^2/d");
    let finished = run(&text);
    near(finished.budget(5.0, "left")[1], 1.0, 1e-12, "left through the side of inflow");
    near(finished.moments(5.0)[0], 0.0, 0.0, "mass");
}

/// Water that enters at 1, since the time 0, over the concentration that flows in.
///
/// - Equation: `c = ½ erfc a + √(v²t/πD) e^{−a²} − ½ (1 + vx/D + v²t/D) e^{−a²} erfcx b`, `a, b = (x ∓ vt)/√(4Dt)`.
/// - Source: E. T. Lindstrom et al. (1967), as van Genuchten and Alves (1982) print it.
fn third_type(x: f64, t: f64, v: f64, d: f64) -> f64 {
    if t <= 0.0 {
        return 0.0;
    }
    let s = (4.0 * d * t).sqrt();
    let (a, b) = ((x - v * t) / s, (x + v * t) / s);
    let front = exp(-a * a);
    0.5 * erfc(a) + (v * v * t / (std::f64::consts::PI * d)).sqrt() * front
        - 0.5 * (1.0 + v * x / d + v * v * t / d) * front * erfcx(b)
}

/// The same of a side that is held at 1 (A. Ogata, R. B. Banks 1961).
fn first_type(x: f64, t: f64, v: f64, d: f64) -> f64 {
    if t <= 0.0 {
        return 0.0;
    }
    let s = (4.0 * d * t).sqrt();
    let (a, b) = ((x - v * t) / s, (x + v * t) / s);
    0.5 * (erfc(a) + exp(-a * a) * erfcx(b))
}

/// Duhamel's integral `c(0) G(x, t) + ∫ c'(τ) G(x, t − τ) dτ`, by the midpoint rule.
fn duhamel(start: f64, slope: impl Fn(f64) -> f64, answer: impl Fn(f64) -> f64, t: f64) -> f64 {
    let n = 4000;
    let at = |k: usize| (k as f64 + 0.5) * t / f64::from(n);
    let sum: f64 = (0..n as usize).map(|k| slope(at(k)) * answer(t - at(k))).sum();
    start * answer(t) + sum * t / f64::from(n)
}

/// A column whose water comes in at what is given, 1 m/d and 0.1 m²/d, at 4 days in 40 bins over 8 m.
fn column(side: &str, step: &str) -> Finished {
    run(&column_text(side, step))
}

fn column_text(side: &str, step: &str) -> String {
    format!(
        "lamella 1
species S
domain line x = 0 m .. 8 m
boundary left {side}
boundary right outflow
medium porosity 0.25
flow uniform 1 m/d
dispersion 0.1 m^2/d
particles mass 60_000
run to 4 d, step {step}
output profile S at t = 4 d on 40
output budget S at t = 4 d
"
    )
}

/// Bins against a profile: χ² per bin, with a bias of `bias` allowed.
fn hold(finished: &Finished, profile: impl Fn(f64) -> f64, bias: f64, what: &str) {
    let bins = finished.profile();
    let (mut sum, mut n) = (0.0, 0.0);
    for (k, [mean, error]) in bins.iter().enumerate() {
        // A bin is 0.2 m wide: the mean over it, by three points.
        let x = (k as f64 + 0.5) * 0.2;
        let expected =
            (profile(x - 0.2 / 6.0_f64.sqrt()) + profile(x + 0.2 / 6.0_f64.sqrt())) * 0.25 + 0.5 * profile(x);
        // kg/m³ of 1 mg/L; where hardly anything is there is nothing to be held.
        if expected > 0.02 {
            let scatter = 1e3 * error;
            sum += (1e3 * mean - expected).powi(2) / (scatter * scatter + (bias * expected).powi(2));
            n += 1.0;
        }
    }
    assert!(
        n > 10.0 && sum / n < 1.0 + 4.0 * (2.0_f64 / n).sqrt(),
        "{what}: χ² {:.2} over {n} bins",
        sum / n
    );
}

#[test]
fn a_pulse_of_inflow_is_a_step_less_a_later_one() {
    let (from, to) = (0.7, 1.9);
    let finished = column("inflow S = if t > 0.7 d and t < 1.9 d then 1 mg/L else 0 mg/L", "0.5 d");
    let expected: f64 = 0.25 * 1e-3 * (to - from);
    near(finished.budget(4.0, "left")[0], expected, 1e-12 * expected, "mass that came in");
    let answer = |x: f64| third_type(x, 4.0 - from, 1.0, 0.1) - third_type(x, 4.0 - to, 1.0, 0.1);
    hold(&finished, answer, 0.0, "a pulse of inflow");
}

#[test]
fn a_wave_at_the_inlet_travels_down_the_column() {
    let omega = std::f64::consts::TAU / 1.6;
    let slope = |t: f64| omega * cos(omega * t);
    let answer = |x: f64| duhamel(1.0, slope, |t| third_type(x, t, 1.0, 0.1), 4.0);
    let finished = column("inflow S = 1 mg/L * (1 + sin(2 * 3.141592653589793 * t / 1.6 d))", "0.5 d");
    let expected = 0.25e-3 * (4.0 + (1.0 - cos(4.0 * omega)) / omega);
    near(finished.budget(4.0, "left")[0], expected, 1e-9 * expected, "mass that came in");
    hold(&finished, answer, 0.0, "a wave of inflow");
    // Held instead: concentrations within a step are those of one time, which is wrong by O(Δt²).
    let answer = |x: f64| duhamel(1.0, slope, |t| first_type(x, t, 1.0, 0.1), 4.0);
    let finished =
        column("concentration S = 1 mg/L * (1 + sin(2 * 3.141592653589793 * t / 1.6 d))", "0.05 d");
    hold(&finished, answer, 0.01, "a wave at a held side");
    let answer = |x: f64| first_type(x, 2.87, 1.0, 0.1) - first_type(x, 1.4, 1.0, 0.1);
    let finished = column("concentration S = if t > 1.13 d and t < 2.6 d then 1 mg/L else 0 mg/L", "0.5 d");
    hold(&finished, answer, 0.01, "a pulse at a held side");
}

/// Ten minutes of a hundred days: the mass is that of ten minutes, and comes at its time.
#[test]
fn a_short_pulse_in_a_long_run_is_not_missed() {
    let finished = run("lamella 1
species S
domain line x = 0 m .. 1000 m
boundary left inflow S = if t > 50 d and t < 50 d + 10 min then 7 mg/L else 0 mg/L
boundary right outflow
medium porosity 0.25
flow uniform 1 m/d
dispersion 0.1 m^2/d
source leak: S = if t > 70 d and t < 70 d + 1 min then 3 g/m^2/d else 0 g/m^2/d at point(500 m)
particles mass 5_000
run to 100 d, step 10 d
output moments S at t = 60 d
output budget S at t = 100 d
");
    let expected = 0.25 * 7e-3 / 144.0;
    near(finished.budget(100.0, "left")[0], expected, 1e-9 * expected, "mass of ten minutes");
    let leak = 3e-3 / 1440.0;
    near(finished.budget(100.0, "leak")[0], leak, 1e-9 * leak, "mass of a minute");
    // Ten minutes are 7 mm of way; what disperses back at the side moves the mean by D/v.
    let [_, mean, _] = finished.moments(60.0);
    let n = 5000.0 * expected / (expected + leak);
    near(mean, 10.0 - 0.0035 + 0.1, 4.0 * (2.0_f64 / n).sqrt() + 0.01, "mean after ten days");
}

/// A well puts in what another takes out, for three days; then both stand still.
const PAIR: &str = "lamella 1
species S
domain rect x = 0 .. 20 m, y = 0 .. 10 m
medium porosity 0.25
flow darcy {
  head left 10 m, right 10 m
  no_flow bottom, top
  conductivity 10 m/d
  well feed at (6.5 m, 5.5 m) rate (if t < 3 d then 3 m^2/d else 0 m^2/d) carrying S = 5 mg/L * (1 + t / 3 d)
  well pump at (13.5 m, 5.5 m) rate (if t < 3 d then -3 m^2/d else 0 m^2/d)
  grid 20 x 10
}
dispersion longitudinal 0.1 m, transverse 0.01 m, molecular 1e-4 m^2/d
boundary left, right inflow S = 0 mg/L
boundary bottom, top reflect
initial S = 2 mg/L
particles mass 20_000
run to 6 d, step auto(courant <= 0.25, dispersion <= 0.1)
output budget S at t = 3 d, 6 d
output moments S at t = 6 d
";

#[test]
fn wells_feed_and_take_while_they_run() {
    let finished = run(PAIR);
    // 3 m²/d for 3 d of 5 mg/L that grow to 10.
    let expected = 3.0 * 3.0 * 7.5e-3;
    for t in [3.0, 6.0] {
        near(finished.budget(t, "feed")[0], expected, 1e-9 * expected, "mass fed");
    }
    let taken = finished.budget(3.0, "pump")[1];
    assert!(taken > 0.01, "{taken} kg/m taken");
    assert_eq!(finished.budget(6.0, "pump")[1], taken, "a well that stands takes nothing");
    let inside = finished.moments(6.0)[0];
    let left: f64 = ["left", "right", "pump"].iter().map(|door| finished.budget(6.0, door)[1]).sum();
    let came = finished.budget(6.0, "feed")[0] + finished.budget(6.0, "initial")[0];
    near(inside + left, came, 1e-12 * came, "books");
    for threads in [1, 2] {
        let again = run_on(PAIR, Some(threads));
        assert_eq!(again.outcome.n_steps, finished.outcome.n_steps);
        assert_eq!(
            format!("{:?}", again.snapshots),
            format!("{:?}", finished.snapshots),
            "{threads} threads"
        );
    }
}

/// A box whose water is kept at a concentration that doubles at a time: what it holds doubles then.
#[test]
fn a_box_follows_the_concentration_that_it_is_kept_at() {
    let finished = run("lamella 1
species S
domain line x = 0 m .. 10 m
boundary left, right outflow
medium porosity 0.25
dispersion 1e-4 m^2/d
source pool: S = if t < 2.3 d then 4 mg/L else 8 mg/L in box(4 .. 6 m) during 0 .. 5 d
particles mass 50_000
run to 5 d, step 0.1 d
output moments S at t = 2.2 d, 5 d
");
    // √(4Dt/π) on either side of the box has diffused out.
    for (t, c) in [(2.2, 4e-3), (5.0, 8e-3)] {
        let low = 0.25 * c * 2.0;
        let most = low * (1.0 + (4.0 * 1e-4 * t / std::f64::consts::PI).sqrt());
        let mass = finished.moments(t)[0];
        assert!(mass > 0.995 * low && mass < 1.005 * most, "{mass} in {low} .. {most}");
    }
}

/// A flow that changes all the time is one of many steady ones.
#[test]
fn a_tide_is_cut_into_periods() {
    let flow = "uniform (1 m/d + 2 m/d * sin(2 * 3.141592653589793 * t / 1 d)) change every 1 h";
    let finished = run(&pulse(flow, "0.02 m^2/d"));
    assert_eq!(finished.plan.transport.as_ref().map(|transport| transport.changes.len()), Some(119));
    let [_, mean, variance] = finished.moments(5.0);
    let spread: f64 = 2.0 * 0.02 * 5.0;
    near(mean, 25.0, 4.0 * (spread / N).sqrt(), "mean");
    near(variance, spread, 4.0 * spread * (2.0 / N).sqrt(), "variance");
}

/// The scenes of `experiments/push_pull`.
#[test]
fn the_experiment_of_push_and_pull_is_as_expected() {
    let finished = run(include_str!("../experiments/push_pull/column.lam"));
    let spread: f64 = 0.25 + 2.0 * 0.1 * 12.0;
    let exact = |x: f64| exp(-x * x / (2.0 * spread)) / ((std::f64::consts::TAU * spread).sqrt() * 0.25);
    let (mut error, mut whole) = (0.0, 0.0);
    for (k, [mean, _]) in finished.profile().iter().enumerate() {
        let expected = exact(-9.75 + 0.5 * k as f64);
        error += (mean - expected).powi(2);
        whole += expected * expected;
    }
    tell(&format!("profile {:.4}, defect {:?}", (error / whole).sqrt(), finished.outcome.mass_defect));
    assert!((error / whole).sqrt() < 0.02);
    let finished = run(include_str!("../experiments/push_pull/doublet.lam"));
    let fed = finished.budget(6.0, "feed")[0];
    tell(&format!("fed {:e}, defect {:?}", fed / 0.0675 - 1.0, finished.outcome.mass_defect));
    near(fed, 0.0675, 1e-9 * 0.0675, "mass fed");
    assert_eq!(finished.budget(6.0, "pump")[1], finished.budget(3.0, "pump")[1]);
}

/// A table of steps says what comes in: its rows are found like switches, and bring what they say.
#[test]
fn a_table_of_steps_is_a_row_of_pulses() {
    let text = column_text("inflow S = inlet.c(t)", "0.5 d")
        .replace("species S\n", "species S\ndata inlet = \"inlet.csv\" (t [d], c [mg/L]) steps\n");
    let mut sources = Sources::single("scene.lam", text);
    let rows = b"t,c\n0,0\n1.234,4\n1.235,0\n3,1\n".to_vec();
    sources.add_data(Arc::new(DataFile::new("inlet.csv", rows)));
    let finished = run_sources(sources, None);
    let expected = 0.25e-3 * (4.0 * 0.001 + 1.0);
    near(finished.budget(4.0, "left")[0], expected, 1e-9 * expected, "mass that came in");
}

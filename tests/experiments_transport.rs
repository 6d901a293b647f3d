//! The scenes of `experiments/transport_basics`, from text to measures, held to closed forms.
//!
//! Bounds: four times the sampling noise that the run itself reports for its bins, or 1 % where the number of
//! particles makes the noise smaller than that. The closed forms stand in the scenes.

use lamella::engine::snapshot::{Outcome, Snapshot};
use lamella::engine::{Settings as EngineSettings, Unattended};
use lamella::measure::Evaluated;
use lamella::plan::compile::Options;
use lamella::scenario::Settings;
use lamella::source::Sources;

struct Finished {
    evaluated: Evaluated,
    outcome: Outcome,
}

/// Measured numbers, shown by `cargo test -- --nocapture`.
#[expect(clippy::print_stdout, reason = "tests report what they measured")]
fn tell(report: &str) {
    println!("{report}");
}

fn run(text: &str) -> Finished {
    let sources = Sources::single("scene.lam", text);
    let checked = lamella::check(sources, &Settings::default(), &Options::default());
    let compiled = checked.compiled.unwrap_or_else(|| panic!("no plan: {:#?}", checked.diagnostics));
    let mut snapshots: Vec<Snapshot> = Vec::new();
    let settings = EngineSettings::default();
    let outcome = lamella::engine::run(&compiled.plan, &settings, &Unattended, &mut |snapshot| {
        snapshots.push(snapshot);
        Ok(())
    })
    .expect("the scene runs");
    let evaluated = lamella::measure::evaluate(&compiled.plan, &compiled.evaluation, &snapshots, &outcome)
        .expect("results and references fit");
    Finished { evaluated, outcome }
}

impl Finished {
    fn measure(&self, name: &str) -> f64 {
        let found = self.evaluated.measures.iter().find(|measure| measure.name == name);
        let value = found.expect("the scene has the measure").value;
        tell(&format!("{name} {value:.3e}"));
        value
    }

    fn keeps_its_books(&self) {
        let worst = self.outcome.mass_defect.iter().fold(0.0, |worst: f64, defect| worst.max(*defect));
        assert!(worst < 1e-12, "mass in = inside + out to {worst:e}");
    }
}

/// The text with a piece replaced that must be there.
fn edited(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "the scene has no `{from}`");
    text.replace(from, to)
}

/// 200 000 particles: what is left of 0.52 of them is known to 0.2 %.
#[test]
fn a_wall_absorbs_in_one_step_what_it_should() {
    let finished = run(include_str!("../experiments/transport_basics/absorbing_wall.lam"));
    finished.keeps_its_books();
    assert!(finished.measure("error_total") < 0.01);
    assert!(finished.measure("error_profile") < 0.03);
}

#[test]
fn water_brings_its_tracer_in() {
    let finished = run(include_str!("../experiments/transport_basics/inflow.lam"));
    finished.keeps_its_books();
    assert!(finished.measure("error") < 0.02);
    // Five bins at the inlet with a noise of 0.8 % each.
    assert!(finished.measure("at_inlet") < 0.03);
}

#[test]
fn a_side_is_kept_at_its_concentration() {
    let finished = run(include_str!("../experiments/transport_basics/held_side.lam"));
    finished.keeps_its_books();
    assert!(finished.measure("error_A") < 0.02);
    assert!(finished.measure("error_B") < 0.02);
}

#[test]
fn a_pulse_spreads_along_and_across_the_flow() {
    let finished = run(include_str!("../experiments/transport_basics/moments.lam"));
    finished.keeps_its_books();
    assert!(finished.measure("error_map") < 0.03);
    assert!(finished.measure("leak") < 1e-12);
}

#[test]
fn shear_draws_a_cloud_out() {
    let finished = run(include_str!("../experiments/transport_basics/shear.lam"));
    finished.keeps_its_books();
    assert!(finished.measure("error") < 0.03);
    assert!(finished.measure("leak") < 1e-12);
}

#[test]
fn a_pulse_passes_a_jump_of_dispersion() {
    let finished = run(include_str!("../experiments/transport_basics/two_media.lam"));
    finished.keeps_its_books();
    assert!(finished.measure("error") < 0.02);
    assert!(finished.measure("jump") < 0.03);
}

/// Four times the particles and a quarter of the step: the noise halves, and no bias remains.
#[test]
fn what_is_uniform_stays_uniform() {
    let text = include_str!("../experiments/transport_basics/uniform_stays_uniform.lam");
    let finished = run(text);
    finished.keeps_its_books();
    // 2 000 particles in each of 100 bins: 2.24 %, known to 7 %.
    assert!(finished.measure("error") < 0.027);
    // The largest of 200 deviations is below 4 standard deviations.
    assert!(finished.measure("extreme") < 0.09);
    // The test can fail: without the drift ∇D particles gather where D is small.
    let coarse = run(&edited(text, "step 0.1 d", "step 5 d"));
    assert!(coarse.measure("error") > 0.05, "steps of the size of the wave must be seen");
}

/// Water that enters brings what the statement of its part of the side says, and nothing of the others; where
/// it is fast it brings more.
#[test]
fn parts_of_a_side_bring_their_own_water() {
    let scene = "lamella 1
species A, B
domain rect x = 0 .. 10 m, y = 0 .. 8 m
boundary left y = 2 .. 4 m inflow A = 4 mg/L
boundary left inflow A = 8 mg/L, B = 1 mg/L * y / 1 m
boundary right outflow
boundary bottom, top reflect
flow velocity = (0.25 m/d * y / 1 m, 0 m/d)
dispersion 1e-6 m^2/d
particles mass A 100_000, B 100_000
run to 4 d, step 0.5 d
output profile A along y at t = 4 d on 8 in mg/L
output total A, B every 1 d
# Fluxes: of A 0.25 (4 (4² - 2²)/2 + 8 (8² - 4² + 2²)/2), of B 0.25 (8³ - 4³ + 2³)/3 g/m/d.
reference of_A for total A = 0.25 * (24 + 208) * 1 g/m/d * t
reference of_B for total B = 0.25 * 456 / 3 * 1 g/m/d * t
# A column of 10 m: what entered within 4 d at y/4 m/d.
reference across for A = (if y > 2 m and y < 4 m then 4 mg/L else 8 mg/L) * y / 10 m
measure error_A = linf(total.A - of_A) / linf(of_A)
measure error_B = linf(total.B - of_B) / linf(of_B)
measure error   = linf(profile.A - across) / linf(across)
";
    let finished = run(scene);
    finished.keeps_its_books();
    // Steady inflow comes in equal shares of time: no noise, up to one particle of 100 000.
    assert!(finished.measure("error_A") < 1e-4);
    assert!(finished.measure("error_B") < 1e-4);
    // 25 000 particles in the largest bin.
    assert!(finished.measure("error") < 0.03);
}

//! The scenes of `experiments/chain_with_retardation`, from text to measures, held to closed forms.
//!
//! Bounds: 4.5 sampling errors of the particles that a number comes from, √(p(1 − p)/N) of a share.

use lamella::engine::snapshot::{Outcome, Snapshot, Values};
use lamella::engine::{Settings as EngineSettings, Unattended};
use lamella::measure::Evaluated;
use lamella::plan::compile::Options;
use lamella::plan::{OutputKind, Plan};
use lamella::scenario::Settings;
use lamella::source::Sources;

struct Finished {
    plan: Plan,
    snapshots: Vec<Snapshot>,
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
    Finished { plan: compiled.plan, snapshots, evaluated, outcome }
}

impl Finished {
    fn measure(&self, name: &str) -> f64 {
        let found = self.evaluated.measures.iter().find(|measure| measure.name == name);
        let value = found.expect("the scene has the measure").value;
        tell(&format!("{name} {value:.3e}"));
        value
    }

    /// Amount, mean and variance along x of a species at the end.
    fn moments(&self, species: usize) -> [f64; 3] {
        let is_of = |snapshot: &&Snapshot| self.plan.outputs[snapshot.output_idx].kind == OutputKind::Moments;
        let snapshot = self.snapshots.iter().rev().find(is_of).expect("moments");
        let Values::Rows(rows) = &snapshot.values else { panic!("no rows") };
        let numbers = &rows[species][0].numbers;
        tell(&format!("species {species}: {:.5} {:.5} {:.5}", numbers[0], numbers[1], numbers[4]));
        [numbers[0], numbers[1], numbers[4]]
    }

    fn keeps_its_books(&self) {
        let worst = self.outcome.mass_defect.iter().fold(0.0, |worst: f64, defect| worst.max(*defect));
        assert!(worst < 1e-12, "mass in and made = inside, out and taken to {worst:e}");
    }
}

/// 400 000 particles; the numbers of methods, section 1.7, have five digits.
#[test]
fn each_member_of_a_chain_moves_at_its_pace_in_one_step() {
    let finished = run(include_str!("../experiments/chain_with_retardation/chain.lam"));
    finished.keeps_its_books();
    for name in ["error_A", "error_B", "error_C"] {
        assert!(finished.measure(name) < 4.5 * (0.25_f64 / 4e5).sqrt());
    }
    let printed = [[0.30119, 2.0, 0.4], [0.49523, 1.45030, 0.37191], [0.20357, 1.09310, 0.30928]];
    for (species, [p, mean, variance]) in printed.into_iter().enumerate() {
        let n: f64 = 4e5 * p;
        let found = finished.moments(species);
        assert!((found[0] - p).abs() < 4.5 * (p * (1.0 - p) / 4e5).sqrt() + 1e-5);
        assert!((found[1] - mean).abs() < 4.5 * (variance / n).sqrt() + 1e-5);
        // Near a normal law: the variance of a variance is 2 s⁴/n.
        assert!((found[2] - variance).abs() < 4.5 * variance * (2.5 / n).sqrt() + 1e-5);
    }
}

/// Five steps of a half-life and more: 400 000 particles enter, 20 000 a day and meter in the first bins.
#[test]
fn a_decaying_solute_comes_to_rest_in_a_column() {
    let finished = run(include_str!("../experiments/chain_with_retardation/column.lam"));
    finished.keeps_its_books();
    assert!(finished.measure("error_A") < 0.02);
    assert!(finished.measure("error_all") < 0.02);
    assert!(finished.measure("at_rest") < 0.04);
}

/// Reference: time T in mobile water of a particle that begins there, K = kf + kb, b = kb/K, f = kf/K:
/// E T = bt + f(1 − e^{−Kt})/K, E T² = b²t² + 4bf/K (t − (1 − e^{−Kt})/K) + 2f²(1 − e^{−Kt}(1 + Kt))/K²; then
/// E X = v E T and Var X = 2D E T + v² Var T.
#[test]
fn mobile_and_immobile_water_exchange_in_two_steps() {
    let finished = run(include_str!("../experiments/chain_with_retardation/exchange.lam"));
    finished.keeps_its_books();
    for name in ["error_A", "error_S"] {
        assert!(finished.measure(name) < 4.5 * (0.25_f64 / 2e5).sqrt());
    }
    let (kf, kb, t) = (0.4_f64, 0.1, 10.0);
    let k = kf + kb;
    let (b, f, e) = (kb / k, kf / k, (-k * t).exp());
    let time = b * t + f * (1.0 - e) / k;
    let square = b * b * t * t
        + 4.0 * b * f / k * (t - (1.0 - e) / k)
        + 2.0 * f * f * (1.0 - e * (1.0 + k * t)) / (k * k);
    let variance = 0.2 * time + square - time * time;
    let [mobile, immobile] = [finished.moments(0), finished.moments(1)];
    let mean = mobile[0] * mobile[1] + immobile[0] * immobile[1];
    let second = |[p, mean, variance]: [f64; 3]| p * (variance + mean * mean);
    let found = second(mobile) + second(immobile) - mean * mean;
    tell(&format!("all: {mean:.5} {time:.5}, {found:.5} {variance:.5}"));
    assert!((mean - time).abs() < 4.5 * (variance / 2e5).sqrt());
    // Kurtosis below 6, as what rests is far behind.
    assert!((found - variance).abs() < 4.5 * variance * (5.0_f64 / 2e5).sqrt());
}

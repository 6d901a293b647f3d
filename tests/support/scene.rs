//! Scenes from text to measures, for tests that hold them to closed forms.
#![allow(dead_code)]

use lamella::engine::snapshot::{Outcome, Snapshot, Values};
use lamella::engine::{Settings as EngineSettings, Unattended};
use lamella::measure::Evaluated;
use lamella::plan::compile::Options;
use lamella::plan::{OutputKind, Plan};
use lamella::scenario::Settings;
use lamella::source::Sources;

pub struct Finished {
    pub plan: Plan,
    pub snapshots: Vec<Snapshot>,
    pub evaluated: Evaluated,
    pub outcome: Outcome,
}

/// Measured numbers, shown by `cargo test -- --nocapture`.
#[expect(clippy::print_stdout, reason = "tests report what they measured")]
pub fn tell(report: &str) {
    println!("{report}");
}

pub fn run(text: &str) -> Finished {
    run_with(text, &Settings::default())
}

pub fn run_with(text: &str, settings: &Settings) -> Finished {
    let sources = Sources::single("scene.lam", text);
    let checked = lamella::check(sources, settings, &Options::default());
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
    pub fn measure(&self, name: &str) -> f64 {
        let found = self.evaluated.measures.iter().find(|measure| measure.name == name);
        let value = found.expect("the scene has the measure").value;
        tell(&format!("{name} {value:.3e}"));
        value
    }

    /// Times and numbers of the only row of a species in outputs of a kind, by place.
    pub fn rows(&self, kind: OutputKind, species: usize, place: Option<&str>) -> Vec<(f64, Vec<f64>)> {
        let mut found = Vec::new();
        for snapshot in &self.snapshots {
            let output = &self.plan.outputs[snapshot.output_idx];
            let Values::Rows(rows) = &snapshot.values else { continue };
            if output.kind != kind {
                continue;
            }
            let places = self.plan.places(output);
            for row in rows.get(species).into_iter().flatten() {
                if place.is_none_or(|place| places[usize::from(row.place)] == place) {
                    found.push((snapshot.t / 86_400.0, row.numbers.clone()));
                }
            }
        }
        found
    }

    pub fn keeps_its_books(&self) {
        let worst = self.outcome.mass_defect.iter().fold(0.0, |worst: f64, defect| worst.max(*defect));
        assert!(worst < 1e-12, "mass in = inside + out to {worst:e}");
    }
}

/// The text with a piece replaced that must be there.
pub fn edited(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "the scene has no `{from}`");
    text.replace(from, to)
}

//! Every shipped scene under stress: it runs, or it says at a line why it does not.

#[path = "support/data.rs"]
mod data;

use lamella::plan::Options;
use lamella::scenario::{Scenario, Settings};
use lamella::source::Sources;
use lamella::stress::{Bounds, Fate, Knob, Trial, Verdict};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Steps of a trial: enough for exchange, motion and reaction to meet.
const STEPS: f64 = 3.0;

fn scenes() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("experiments");
    let folders = std::fs::read_dir(root).expect("the experiments are there").flatten();
    let files = folders.flat_map(|folder| std::fs::read_dir(folder.path()).into_iter().flatten().flatten());
    let is_scene = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "lam");
    let mut found: Vec<PathBuf> = files.map(|file| file.path()).filter(is_scene).collect();
    found.sort();
    found
}

/// A few steps of the scene, looked at in the end.
fn shorten(scenario: &mut Scenario) {
    let duration = scenario.run.duration.min(STEPS * scenario.run.step);
    scenario.run.duration = duration;
    scenario.references.clear();
    scenario.measures.clear();
    for output in &mut scenario.outputs {
        output.times = vec![duration];
    }
}

/// What is wrong with what came of a trial.
fn faults(verdict: &Verdict, tolerance: f64) -> Vec<String> {
    let mut found = Vec::new();
    let mut require = |is_right: bool, what: &str| {
        if !is_right {
            found.push(format!("{:?}: {what}: {verdict:?}", verdict.trial));
        }
    };
    let place = verdict.message.as_ref().and_then(|message| message.primary_span());
    match verdict.fate {
        Fate::Refused | Fate::Stopped => {
            require(place.is_some(), "no line");
            let helps = verdict
                .message
                .as_ref()
                .is_some_and(|message| !message.help.is_empty() || message.expected.is_some());
            require(helps, "no word of what would work");
        }
        Fate::Finished => {
            require(verdict.lowest.is_none_or(|lowest| lowest >= -tolerance), "below zero");
            require(verdict.mass_defect.is_some_and(|defect| defect < 1e-9), "mass is lost");
            require(verdict.error.is_none_or(|error| error < 100.0 * tolerance), "far from a tighter run");
        }
        Fate::MassLost | Fate::Negative => require(false, "wrong numbers"),
        Fate::TooLong => require(verdict.reason.is_some(), "no reason"),
    }
    found
}

#[test]
fn every_scene_runs_under_stress_or_says_at_a_line_why_not() {
    let mut bounds = Bounds { particles: 100, time: Duration::from_millis(300), flow: None };
    let (mut broken, mut n_finished, mut n_trials) = (Vec::new(), 0, 0);
    for path in scenes() {
        let text = std::fs::read_to_string(&path).expect("a scene can be read");
        let name = path.display().to_string();
        let sources = data::with_files(Sources::single(&*name, text), path.parent().expect("a folder"));
        let checked = lamella::check(sources, &Settings::default(), &Options::default());
        bounds.flow = data::read_flow(&checked);
        let mut scenario = checked.scenario.unwrap_or_else(|| panic!("{name} is wrong"));
        assert!(checked.compiled.is_some(), "{name} is refused");
        shorten(&mut scenario);
        for trial in Trial::all(&scenario, &Knob::ALL, 12, 6) {
            let verdict = trial.run(&scenario, &Options::default(), &bounds);
            n_trials += 1;
            n_finished += u32::from(verdict.fate == Fate::Finished);
            broken.extend(
                faults(&verdict, scenario.chemistry.tolerance).iter().map(|fault| format!("{name}: {fault}")),
            );
            let is_itself = verdict.trial.decades == 0;
            if is_itself && !matches!(verdict.fate, Fate::Finished | Fate::TooLong) {
                broken.push(format!("{name}: does not run as it is: {verdict:?}"));
            }
        }
    }
    assert!(broken.is_empty(), "{} faults\n{}", broken.len(), broken.join("\n"));
    // Trials that are cut short show nothing.
    assert!(3 * n_finished > 2 * n_trials, "{n_finished} of {n_trials} trials finished");
}

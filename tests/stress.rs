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

/// Measured numbers, shown by `cargo test -- --nocapture`.
#[expect(clippy::print_stdout, reason = "tests report what they measured")]
fn tell(report: &str) {
    println!("{report}");
}

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
        Fate::MassLost | Fate::Negative | Fate::Beyond => require(false, "wrong numbers"),
        Fate::TooLong => require(verdict.reason.is_some(), "no reason"),
    }
    found
}

#[test]
fn every_scene_runs_under_stress_or_says_at_a_line_why_not() {
    let mut bounds = Bounds { particles: 100, time: Duration::from_millis(300), flow: None };
    let (mut broken, mut n_finished, mut n_begun) = (Vec::new(), 0, 0);
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
            n_begun += u32::from(verdict.fate != Fate::Refused);
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
    tell(&format!("{n_finished} of {n_begun} trials that were not refused finished"));
    assert!(3 * n_finished > 2 * n_begun, "{n_finished} of {n_begun} trials that were not refused finished");
}

/// Parcels in disorder that exchange and walk: a front between 1 and 2 mol/m³.
fn crowd(d: usize, normalise: &str, integrate: &str) -> String {
    let (domain, sides, n, h, dt) = [
        ("line x = 0 m .. 1 m", "left, right", 60, 0.06, 5e-4),
        ("rect x = 0 m .. 1 m, y = 0 m .. 1 m", "left, right, bottom, top", 100, 0.12, 2e-3),
        (
            "box x = 0 m .. 1 m, y = 0 m .. 1 m, z = 0 m .. 1 m",
            "left, right, bottom, top, front, back",
            120,
            0.25,
            5e-3,
        ),
    ][d - 1];
    format!(
        "lamella 1\nparam part = 0.5 in 0 .. 1\nparam cut = 4 in 0 .. 1e12\nspecies A\ndomain {domain}\n\
         boundary {sides} reflect\ndispersion 1 m^2/s\n\
         exchange kernel gaussian, bandwidth {h} m, mixing_fraction part, cutoff cut, normalise {normalise}, \
         integrate {integrate}\n\
         initial A = if x < 0.5 m then 2 mol/m^3 else 1 mol/m^3\n\
         particles fluid {n} random\nrun to {end} s, step {dt} s\noutput total A at t = {end} s\n",
        end = STEPS * dt
    )
}

fn of_text(text: &str, set: &[(&str, String)]) -> lamella::Checked {
    let set = set.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect();
    lamella::check(
        Sources::single("crowd.lam", text),
        &Settings { set, ..Settings::default() },
        &Options::default(),
    )
}

const NORMALISATIONS: [&str; 3] = ["arithmetic", "geometric", "sinkhorn"];
const INTEGRATIONS: [&str; 3] = ["explicit", "implicit", "exponential"];

fn crowds() -> impl Iterator<Item = (String, String)> {
    (1..=3).flat_map(|d| {
        NORMALISATIONS.into_iter().flat_map(move |normalise| {
            INTEGRATIONS.into_iter().map(move |integrate| {
                (format!("{d}-D {normalise} {integrate}"), crowd(d, normalise, integrate))
            })
        })
    })
}

/// The share, the bandwidth and the step of every exchange by 10⁻¹⁰ to 10¹⁰: each trial is refused by a limit that is
/// named, at a line, or keeps to the values there were. Steps are turned with the duration, so that all are taken.
#[test]
fn exchanges_are_refused_or_bounded_over_twenty_decades() {
    let bounds = Bounds { particles: 1000, time: Duration::from_secs(30), flow: None };
    let (mut broken, mut n_finished, mut codes) = (Vec::new(), 0, std::collections::BTreeMap::new());
    for (name, text) in crowds() {
        let scenario = of_text(&text, &[]).scenario.expect("a scene");
        for trial in Trial::all(&scenario, &[Knob::Step, Knob::Bandwidth, Knob::Exchange], 10, 2) {
            let mut scenario = scenario.clone();
            if trial.knob == Knob::Step {
                scenario.run.duration *= 10_f64.powi(trial.decades);
                scenario.outputs.iter_mut().for_each(|output| output.times = vec![scenario.run.duration]);
            }
            let verdict = trial.run(&scenario, &Options::default(), &bounds);
            let code = verdict.message.as_ref().map(|message| message.code.to_string());
            broken.extend(faults(&verdict, 1e-12).iter().map(|fault| format!("{name}: {fault}")));
            match verdict.fate {
                Fate::Finished => n_finished += 1,
                Fate::Refused => *codes.entry(code.unwrap_or_default()).or_insert(0) += 1,
                _ => broken.push(format!("{name}: {verdict:?}")),
            }
        }
    }
    tell(&format!("{n_finished} finished, refused {codes:?}"));
    assert!(broken.is_empty(), "{} faults\n{}", broken.len(), broken.join("\n"));
    assert!(codes.keys().all(|code| matches!(code.as_str(), "N206" | "N207")), "{codes:?}");
    assert!(n_finished > 350 && codes.len() == 2);
}

/// What is a share of something in the scene, over the same decades as it is written: the part that is exchanged and
/// the cut-off.
#[test]
fn parts_and_cut_offs_are_refused_or_bounded_over_twenty_decades() {
    let bounds = Bounds { particles: 1000, time: Duration::from_secs(30), flow: None };
    let trial = Trial { knob: Knob::Step, decades: 0 };
    let (mut broken, mut n_finished, mut n_refused) = (Vec::new(), 0, 0);
    for (name, text) in crowds() {
        for (parameter, decades) in
            ["part", "cut"].into_iter().flat_map(|it| (-10..=10).map(move |k| (it, k)))
        {
            // A reach of ten bandwidths is long in space.
            let value = if parameter == "cut" { format!("5e{decades}") } else { format!("1e{decades}") };
            let checked = of_text(&text, &[(parameter, value)]);
            let Some(scenario) = checked.scenario.filter(|_| checked.compiled.is_some()) else {
                let told = checked.diagnostics.iter().find(|message| message.is_fatal());
                let told = told.filter(|it| it.primary_span().is_some() && it.expected.is_some());
                n_refused += 1;
                if told.is_none() {
                    broken.push(format!("{name} {parameter} 1e{decades}: {:?}", checked.diagnostics));
                }
                continue;
            };
            let verdict = trial.run(&scenario, &Options::default(), &bounds);
            n_finished += u32::from(verdict.fate == Fate::Finished);
            if verdict.fate != Fate::Finished || !faults(&verdict, 1e-12).is_empty() {
                broken.push(format!("{name} {parameter} 1e{decades}: {verdict:?}"));
            }
        }
    }
    tell(&format!("{n_finished} finished, {n_refused} refused"));
    assert!(broken.is_empty(), "{} faults\n{}", broken.len(), broken.join("\n"));
    assert!(n_finished > 27 * 11 && n_refused > 27 * 11);
}

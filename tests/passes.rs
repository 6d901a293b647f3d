//! Proof of omission: every scene gives the same numbers with and without the passes.
//!
//! Passes that only drop and fuse keep every bit. Those that replace arithmetic by an equivalent
//! (a conservation relation, fractions added before they multiply) change the last bits only.

#[path = "support/data.rs"]
mod data;

use lamella::engine::snapshot::{Snapshot, Values};
use lamella::engine::{Settings as EngineSettings, Unattended};
use lamella::flow::FlowSeries;
use lamella::plan::compile::{Compiled, Options, Selection};
use lamella::scenario::Settings;
use lamella::source::Sources;
use std::path::Path;

/// Particles of a run at most: ten blocks of them.
const PARTICLES: u64 = 10_000;

/// A scene with few particles and few steps: the proof needs no accuracy.
fn small(text: &str) -> String {
    let mut lines = Vec::new();
    // On a line neighbours go with the number of parcels, and what they exchange with its square.
    let n = if text.contains("\nexchange ") { "2_000" } else { "30_000" };
    for line in text.lines() {
        let line = if line.starts_with("particles fluid") {
            let placement = if line.contains("stratified") { " stratified" } else { "" };
            format!("particles fluid {n}{placement}")
        } else {
            line.to_owned()
        };
        lines.push(line);
    }
    lines.join("\n").replace("average bins 1500", "average bins 150")
}

fn compile(text: &str, passes: Selection) -> Compiled {
    compile_in(Path::new(""), text, passes).0
}

/// The plan of a scene of a folder, and its flow if that comes from files.
fn compile_in(folder: &Path, text: &str, passes: Selection) -> (Compiled, Option<FlowSeries>) {
    let mut sources = Sources::single("scene.lam", text);
    // One of the scenes uses this one.
    sources.add("used/column.lam", include_str!("scenes/used/column.lam"));
    let sources = data::with_files(sources, folder);
    let checked = lamella::check(sources, &Settings::default(), &Options { passes, memory: None });
    let flow = data::read_flow(&checked);
    (checked.compiled.unwrap_or_else(|| panic!("no plan: {:#?}", checked.diagnostics)), flow)
}

/// The snapshots of the first steps, of one particle in so many.
fn run((compiled, flow): &(Compiled, Option<FlowSeries>), one_in: u64) -> Vec<Snapshot> {
    let mut plan = compiled.plan.clone();
    plan.set_count((plan.particles.count / one_in).max(1));
    plan.time.n_steps = plan.time.n_steps.min(30);
    plan.time.duration = plan.time.duration.min(30.0 * plan.time.step);
    let end = plan.time.duration;
    for output in &mut plan.outputs {
        // A time on the steps, one between two steps, and the end.
        output.times = vec![0.0, 3.0 * plan.time.step, 10.3 * plan.time.step, end];
        output.times.retain(|t| *t <= end);
        output.times.dedup();
    }
    let mut snapshots = Vec::new();
    let settings = EngineSettings { threads: Some(2), flow: flow.clone(), ..EngineSettings::default() };
    lamella::engine::run(&plan, &settings, &Unattended, &mut |snapshot| {
        snapshots.push(snapshot);
        Ok(())
    })
    .expect("the scene runs");
    snapshots
}

fn columns(values: &Values) -> Vec<Vec<f64>> {
    match values {
        Values::Binned { mean, standard_error, n_particles } => {
            let counts = n_particles.iter().map(|n| *n as f64).collect();
            mean.iter().chain(standard_error).cloned().chain([counts]).collect()
        }
        Values::Covariance { covariance, n_particles } => {
            covariance.iter().cloned().chain([n_particles.iter().map(|n| *n as f64).collect()]).collect()
        }
        Values::Total { amount } => vec![amount.clone()],
        Values::Mixing(states) => states.iter().map(|s| vec![s.m, s.m_mean, s.m_cov, s.gamma]).collect(),
        Values::Particles { positions, concentrations } => {
            positions.iter().chain(concentrations).cloned().collect()
        }
        Values::Rows(rows) => {
            rows.iter().map(|rows| rows.iter().flat_map(|row| row.numbers.clone()).collect()).collect()
        }
    }
}

fn largest(column: &[f64]) -> f64 {
    column.iter().filter(|value| value.is_finite()).fold(0.0, |largest, value| largest.max(value.abs()))
}

/// Largest difference, relative to the largest value of its column; bits if `exactly`.
fn assert_same(a: &[Snapshot], b: &[Snapshot], tolerance: f64, scene: &str) {
    assert_eq!(a.len(), b.len(), "{scene}: number of snapshots");
    for (a, b) in a.iter().zip(b) {
        assert_eq!((a.output_idx, a.t), (b.output_idx, b.t), "{scene}");
        let largest_of_all = columns(&a.values).iter().map(|column| largest(column)).fold(0.0, f64::max);
        for (column_idx, (left, right)) in columns(&a.values).iter().zip(columns(&b.values)).enumerate() {
            // A column of rounding errors (the spread of a value that is one value) has the size of its output.
            let scale = largest(left).max(1e-4 * largest_of_all);
            for (idx, (x, y)) in left.iter().zip(&right).enumerate() {
                let is_same = if tolerance == 0.0 {
                    x.to_bits() == y.to_bits() || (x.is_nan() && y.is_nan()) || x == y
                } else {
                    (x - y).abs() <= tolerance * scale || (x.is_nan() && y.is_nan())
                };
                assert!(
                    is_same,
                    "{scene}: output {} at {} s, column {column_idx}, place {idx}: {x:e} and {y:e}",
                    a.output_idx, a.t
                );
            }
        }
    }
}

fn scenes() -> Vec<(String, String)> {
    let mut scenes = Vec::new();
    for root in ["experiments", "tests/scenes"] {
        let mut folders = vec![std::path::PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(root)];
        while let Some(folder) = folders.pop() {
            let mut entries: Vec<_> = std::fs::read_dir(&folder)
                .expect("a folder")
                .map(|entry| entry.expect("an entry").path())
                .collect();
            entries.sort();
            for path in entries {
                if path.is_dir() {
                    folders.push(path);
                } else if path.extension().is_some_and(|extension| extension == "lam") {
                    let text = std::fs::read_to_string(&path).expect("a scene");
                    scenes.push((path.display().to_string(), text));
                }
            }
        }
    }
    assert!(scenes.len() >= 9, "the shipped scenes are found");
    scenes
}

/// Holds all scenes, each with two choices of passes, to the same results; the number of scenes whose plans differ. The
/// engine sees the plan and nothing else, so that of equal plans nothing is learnt by running them.
fn hold(literal: Selection, lean: Selection, tolerance: f64) -> usize {
    let mut n_differing = 0;
    for (name, text) in scenes() {
        let (text, folder) = (small(&text), Path::new(&name).parent().expect("a folder"));
        let literal = compile_in(folder, &text, literal);
        let lean = compile_in(folder, &text, lean);
        if literal.0.plan == lean.0.plan || literal.0.plan.axes.len() != lean.0.plan.axes.len() {
            continue;
        }
        n_differing += 1;
        let one_in = literal.0.plan.particles.count.div_ceil(PARTICLES);
        assert_same(&run(&literal, one_in), &run(&lean, one_in), tolerance, &name);
    }
    n_differing
}

#[test]
fn passes_that_drop_and_fuse_keep_every_bit() {
    assert!(hold(Selection::None, Selection::KeepingBytes, 0.0) >= 40);
}

/// A conservation relation replaces a carried field by `α + β U`: one rounding at output instead of
/// one in each step. 30 steps of relative size 2⁻⁵³ stay far below 1e-13; covariances subtract
/// nearly equal numbers and keep three figures less.
#[test]
fn passes_that_replace_arithmetic_change_the_last_bits_only() {
    assert!(hold(Selection::KeepingBytes, Selection::All, 1e-10) >= 8);
}

/// The Gramling column with things that nothing reads: species, a reaction and functions, an output that
/// is there already, an empty zone, and a zone in two halves.
fn crowded(column: &str) -> String {
    column
        .replace("species AB", "species C, E, F\nspecies AB")
        .replace("  slow: fraction eta,     ", "  none: fraction 0, rate 3e-4 /s\n  slow: fraction eta / 2, ")
        .replace("rate chi\n", "rate chi\n  slower: fraction eta / 2, rate chi\n")
        + "\nparam unread = 3 mol/L\nreaction other: C + E -> F @ instant\n"
        + "initial C = A * A / c0\ninitial E = 2 * A + unread\noutput total AB every 10 s\n"
}

/// The engine sees the plan and nothing else: equal plans cost equal times.
#[test]
fn unused_things_are_left_out_of_the_run() {
    let column = small(include_str!("../experiments/gramling/gramling.lam"));
    let plain = compile(&column, Selection::All);
    let crowded = compile(&crowded(&column), Selection::All);
    assert_eq!(plain.plan, crowded.plan);
    assert_eq!(plain.hash, crowded.hash);
    for what in ["species `C`, `E`, `F`", "zone `none`", "zone `slower`", "output `total`", "`other`"] {
        let is_named = crowded.left_out.iter().any(|left_out| left_out.what.contains(what));
        assert!(is_named, "{what} in {:#?}", crowded.left_out);
    }
    assert!(compile(&self::crowded(&column), Selection::None).plan != plain.plan, "the passes do it");
}

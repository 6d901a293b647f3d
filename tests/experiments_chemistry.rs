//! The published experiments of batch chemistry, held to their expected numbers.

use lamella::engine::snapshot::{Snapshot, Values};
use lamella::engine::{Settings as EngineSettings, Unattended};
use lamella::measure::Evaluated;
use lamella::plan::Plan;
use lamella::plan::chemistry::Method;
use lamella::plan::compile::Options;
use lamella::scenario::Settings;
use lamella::source::Sources;

/// A scene of `experiments/` by its folder and name.
macro_rules! scene {
    ($path:literal) => {
        ($path, include_str!(concat!("../experiments/", $path, ".lam")))
    };
}

type Scene = (&'static str, &'static str);

/// A finished run.
struct Finished {
    plan: Plan,
    snapshots: Vec<Snapshot>,
    evaluated: Evaluated,
}

/// Measured numbers, shown by `cargo test -- --nocapture`.
#[expect(clippy::print_stdout, reason = "tests report what they measured")]
fn tell(report: &str) {
    println!("{report}");
}

fn run(text: &str, set: &[(&str, &str)]) -> Finished {
    let settings = Settings {
        set: set.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect(),
        ..Settings::default()
    };
    let checked = lamella::check(Sources::single("scene.lam", text), &settings, &Options::default());
    let compiled = checked.compiled.unwrap_or_else(|| panic!("no plan: {:#?}", checked.diagnostics));
    let mut snapshots = Vec::new();
    let outcome =
        lamella::engine::run(&compiled.plan, &EngineSettings::default(), &Unattended, &mut |snapshot| {
            snapshots.push(snapshot);
            Ok(())
        })
        .expect("the scene runs");
    let evaluated = lamella::measure::evaluate(&compiled.plan, &compiled.evaluation, &snapshots, &outcome)
        .expect("results and references fit");
    Finished { plan: compiled.plan, snapshots, evaluated }
}

impl Finished {
    fn method(&self) -> Method {
        self.plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref()).expect("rates").method
    }

    fn measure(&self, name: &str) -> f64 {
        let mut measures = self.evaluated.measures.iter();
        measures.find(|measure| measure.name == name).expect("the scene has the measure").value
    }

    /// All species of a profile on one bin, output by output.
    fn batches(&self) -> impl Iterator<Item = Vec<f64>> {
        self.snapshots.iter().map(|snapshot| match &snapshot.values {
            Values::Binned { mean, .. } => mean.iter().map(|bins| bins[0]).collect(),
            other => panic!("not a profile: {other:?}"),
        })
    }

    /// What every experiment promises: nothing below zero, and nothing lost.
    fn check(&self, name: &str) {
        for batch in self.batches() {
            assert!(batch.iter().all(|c| *c >= 0.0), "{name}: below zero in {batch:?}");
        }
        let leak = self.measure("leak");
        assert!(leak < 1e-13, "{name}: lost {leak}");
    }
}

const CLOSED: [(Scene, Method); 7] = [
    (scene!("kinetics_batch/zero_order"), Method::Zero),
    (scene!("kinetics_batch/decay_chain"), Method::Observed),
    (scene!("kinetics_batch/reversible"), Method::Observed),
    (scene!("kinetics_batch/second_order"), Method::Pair),
    (scene!("kinetics_batch/second_order_equal"), Method::Pair),
    (scene!("kinetics_batch/dimerisation"), Method::Pair),
    (scene!("kinetics_batch/michaelis_menten"), Method::Saturation),
];

#[test]
fn closed_forms_are_found_and_exact_for_any_step() {
    for ((name, text), method) in CLOSED {
        for step in ["0.03 h", "0.7 h", "6 h"] {
            // Steps of a chain that lives for weeks may be longer.
            let step = if name.ends_with("chain") { step.replace('h', "d") } else { step.to_owned() };
            let run = run(text, &[("step", &step)]);
            assert_eq!(run.method(), method, "{name}");
            run.check(name);
            let err = run.measure("err");
            tell(&format!("{name} step {step}: {err:.1e}"));
            assert!(err < 1e-9, "{name} with a step of {step}: {err}");
        }
    }
}

/// The same networks by both integrators, though there is a closed form.
#[test]
fn what_has_a_closed_form_is_also_integrated_within_ten_tolerances() {
    for ((name, text), _) in CLOSED {
        // A reactant at a constant rate ends below the floor, within 1e-5 s: that is stiff.
        let ends = name.ends_with("zero_order");
        // A tolerance is relative down to the floor, and so is what it is held against.
        let text = text.replace("(found - exact) / exact", "(found - exact) / max(exact, 1e-12 mol/L)");
        assert_eq!(ends, !text.contains("1e-12 mol/L"), "{name}");
        for integrator in if ends { &["rosenbrock"][..] } else { &["explicit", "rosenbrock"] } {
            for tolerance in [1e-4, 1e-6, 1e-8] {
                let chemistry =
                    format!("chemistry tolerance {tolerance}, floor 1e-12 mol/L, integrator {integrator}");
                let text = format!("{text}\n{chemistry}\n");
                let run = run(&text, &[]);
                run.check(name);
                let excess = run.measure("err") / tolerance;
                tell(&format!("{name} {integrator} {tolerance:.0e}: {excess:.1e} tolerances"));
                assert!(excess < 10.0, "{name}, {integrator}, {tolerance}: {excess} tolerances");
            }
        }
    }
}

const INTEGRATED: [Scene; 6] = [
    scene!("kinetics_batch/association"),
    scene!("stiff/robertson"),
    scene!("stiff/hires"),
    scene!("stiff/oregonator"),
    scene!("stiff/pollution"),
    scene!("stiff/brusselator"),
];

const TOLERANCES: [&str; 3] = ["1e-4", "1e-6", "1e-8"];

#[test]
fn what_is_integrated_is_within_ten_tolerances() {
    for (name, text) in INTEGRATED {
        for tolerance in TOLERANCES {
            check_excess(name, text, &[("tol", tolerance)]);
        }
    }
}

#[test]
fn a_chain_of_monod_reactions_runs_out_without_going_below_zero() {
    let (name, text) = scene!("stiff/monod_chain");
    for half in ["1e-9 mol/L", "1e-6 mol/L", "1e-3 mol/L", "1 mol/L"] {
        for tolerance in TOLERANCES {
            let run = check_excess(name, text, &[("tol", tolerance), ("Ks", half)]);
            let left = run.batches().last().expect("an output at the end");
            assert!(left[..3].iter().all(|c| *c <= 1e-9), "{half}, {tolerance}: left {left:?}");
        }
    }
}

fn check_excess(name: &str, text: &str, set: &[(&str, &str)]) -> Finished {
    let run = run(text, set);
    assert!(matches!(run.method(), Method::Explicit | Method::Rosenbrock), "{name}: {:?}", run.method());
    run.check(name);
    let (excess, work) = (run.measure("excess"), run.measure("work"));
    tell(&format!("{name} {set:?}: {excess:.1e} tolerances, {work} sub-steps"));
    assert!(excess < 10.0, "{name} with {set:?}: {excess} tolerances");
    run
}

/// At each of the three times, not only over the whole run.
#[test]
fn robertson_keeps_its_mass() {
    let (_, text) = scene!("stiff/robertson");
    for tolerance in TOLERANCES {
        let run = run(text, &[("tol", tolerance)]);
        assert_eq!(run.batches().count(), 3);
        for batch in run.batches() {
            let mass = batch.iter().sum::<f64>() / 1000.0;
            assert!((mass - 1.0).abs() < 1e-13, "{tolerance}: mass {mass} of {batch:?}");
        }
    }
}

const SPECIATION: [(Scene, &str, &[&str]); 5] = [
    (scene!("speciation/complex"), "K", &["1e-6 L/mol", "1 L/mol", "1e3 L/mol", "1e9 L/mol", "1e18 L/mol"]),
    (scene!("speciation/complex"), "B0", &["1 umol/L", "0.3 mmol/L", "1 mmol/L", "3 mmol/L", "1 mol/L"]),
    (scene!("speciation/carbonate"), "CT", &["1 umol/L", "1 mmol/L", "0.1 mol/L"]),
    (scene!("speciation/calcite"), "particles", &["6"]),
    (scene!("speciation/calcite"), "particles", &["600"]),
];

#[test]
fn speciation_is_that_of_closed_forms_and_of_an_independent_solver() {
    for ((name, text), what, values) in SPECIATION {
        for value in values {
            let run = run(text, &[(what, value)]);
            for snapshot in &run.snapshots {
                let Values::Binned { mean, .. } = &snapshot.values else { panic!("a profile") };
                assert!(mean.iter().flatten().all(|c| *c >= 0.0), "{name}: below zero in {mean:?}");
            }
            let err = run.measure("err");
            tell(&format!("{name}, {what} = {value}: {err:.1e}"));
            assert!(err < 1e-10, "{name}, {what} = {value}: {err}");
            if name.ends_with("calcite") {
                assert_eq!(run.measure("left"), 0.0, "calcite is left where all of it dissolves");
            }
        }
    }
}

/// One turn takes about seven seconds and a hundred sub-steps.
#[test]
fn an_oscillator_that_turns_too_often_for_one_step_says_so() {
    let (_, text) = scene!("stiff/brusselator");
    let long = text.replace("run to 20 s, step 20 s", "run to 20_000 s, step 20_000 s");
    assert_ne!(long, text);
    let checked =
        lamella::check(Sources::single("scene.lam", &*long), &Settings::default(), &Options::default());
    let plan = checked.compiled.expect("a plan").plan;
    let error = lamella::engine::run(&plan, &EngineSettings::default(), &Unattended, &mut |_| Ok(()))
        .expect_err("more sub-steps than one step may take");
    let message = error.to_string();
    tell(&message);
    assert!(message.contains("sub-steps, the most that one step may take"), "{message}");
}

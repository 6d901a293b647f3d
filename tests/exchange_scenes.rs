//! Exchange between parcels in scenes that use others, in trials beside a run, and over domains that a kernel outgrows.

use lamella::estimate::Trials;
use lamella::plan::compile::{Compiled, Options};
use lamella::plan::exchange::Kernel;
use lamella::scenario::Settings;
use lamella::source::Sources;

const LINE: &str = "lamella 1
species A
domain line x = 0 m .. 60 m
boundary left, right reflect
dispersion 1 m^2/s
initial A = exp(-(x - 30 m)^2 / 2 m^2) * 1 mol/m^3
particles fluid 240 ordered
run to 10 s, step 0.125 s
";
const OUTPUT: &str = "output total A at t = 10 s\n";

fn compile(sources: Sources) -> (Option<Compiled>, Vec<&'static str>) {
    let checked = lamella::check(sources, &Settings::default(), &Options::default());
    (checked.compiled, checked.diagnostics.iter().map(|told| told.code.0).collect())
}

fn scene(statement: &str) -> (Option<Compiled>, Vec<&'static str>) {
    compile(Sources::single("scene.lam", format!("{LINE}{OUTPUT}{statement}\n")))
}

fn plan_of(statement: &str) -> Compiled {
    let (compiled, codes) = scene(statement);
    compiled.unwrap_or_else(|| panic!("no plan of `{statement}`: {codes:?}"))
}

#[test]
fn a_kernel_and_a_parameter_may_be_those_of_a_used_scene() {
    let used = format!("{LINE}kernel W(q) = (1 - q^2)^3 support 1\nparam width = 6\n");
    let text = format!(
        "lamella 1\nuse \"base.lam\" as base\n{}exchange kernel base.W, bandwidth base.width * spacing, integrate implicit\n",
        "output total A at t = 10 s\n"
    );
    let mut sources = Sources::single("study.lam", text);
    sources.add("base.lam", used);
    let (compiled, codes) = compile(sources);
    let plan = compiled.unwrap_or_else(|| panic!("no plan: {codes:?}")).plan;
    let exchange = plan.exchange.as_ref().expect("an exchange");
    assert!(matches!(&exchange.kernel, Kernel::Profile { name, .. } if name == "W"));
    // Six mean distances of 0.25 m.
    assert!((exchange.sizes(&plan, 0.125).bandwidth - 1.5).abs() < 1e-14);
}

/// Ordered parcels that rest have no error of the step but that of their exchange.
#[test]
fn error_bars_ask_what_half_the_step_changes() {
    let n_trials = |statement: &str| Trials::of(&plan_of(statement).plan).trials.len();
    assert_eq!(n_trials("exchange bandwidth 1 m") - n_trials(""), 2);
}

/// Behind walls lie the images of all parcels, and sums run over them as well: 2 · 10⁴ · 5 / 0.25 of them.
#[test]
fn a_kernel_that_outgrows_its_domain_is_refused() {
    assert!(scene("exchange bandwidth 1e4 m").1.contains(&"N207"));
    let wide = scene("exchange bandwidth 40 m");
    assert!(wide.0.is_some() && wide.1 == ["N110"], "{:?}", wide.1);
}

/// A step that is longer than the run is as long as the run.
#[test]
fn a_step_beyond_the_end_exchanges_what_the_run_does() {
    let text = format!("{LINE}output total A at t = 0.125 s\nexchange bandwidth 0.6 m\n");
    let text = text.replace("run to 10 s, step 0.125 s", "run to 0.125 s, step 10 s");
    let (compiled, codes) = compile(Sources::single("scene.lam", text));
    assert!(compiled.is_some() && !codes.contains(&"N206"), "{codes:?}");
}

//! Measures of whole scenes: on which output they are taken.

use lamella::engine::{self, Settings, Unattended};
use lamella::measure;
use lamella::plan::compile::Options;
use lamella::source::Sources;

/// Ordered particles that do not move carry 2 mol/m³ through a length of 4 m.
const SCENE: &str = "lamella 1
species T, other
domain line x = 0 m .. 4 m
boundary left, right reflect
initial T = 2 mol/m^3
initial other = 1 mol/m^3
particles fluid 1000 ordered
run to 2 s, step 1 s
";

/// The measures of a scene whose outputs and measures are given.
fn measures(rest: &str) -> Vec<f64> {
    measures_of(&format!("{SCENE}{rest}"))
}

fn measures_of(scene: &str) -> Vec<f64> {
    let settings = lamella::scenario::Settings::default();
    let checked = lamella::check(Sources::single("scene.lam", scene), &settings, &Options::default());
    let compiled = checked.compiled.unwrap_or_else(|| panic!("{:#?}", checked.diagnostics));
    let mut snapshots = Vec::new();
    let mut sink = |snapshot| {
        snapshots.push(snapshot);
        Ok(())
    };
    let outcome =
        engine::run(&compiled.plan, &Settings::default(), &Unattended, &mut sink).expect("the scene runs");
    let found = measure::evaluate(&compiled.plan, &compiled.evaluation, &snapshots, &outcome);
    found.expect("has values").measures.iter().map(|measure| measure.value).collect()
}

fn assert_close(found: &[f64], expected: &[f64]) {
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.iter().zip(expected) {
        // Sums of a few equal numbers.
        assert!((a - b).abs() <= 1e-12 * b.abs(), "{found:?} instead of {expected:?}");
    }
}

/// `T - g` is -3 at every place: its L2 norm over 4 m is 6 for each of n times, times √n together.
#[test]
fn a_reference_takes_the_bins_and_times_of_its_partner() {
    let measures = measures(
        "output profile T at t = 1 s on 8
output map T at t = 0 s, 1 s, 2 s on 16
reference g for T = 5 mol/m^3
measure on_map     = l2(map.T - g)
measure on_profile = l2(profile.T - g)
measure swapped    = l2(g - map.T)
measure relative   = l2(g) / l2(map.T - g)
measure inner      = l2(abs(g) - 2 * map.T)
",
    );
    let three = 3.0_f64.sqrt();
    assert_close(&measures, &[6.0 * three, 6.0, 6.0 * three, 5.0 / 3.0, 2.0 * three]);
}

/// Two profiles with other bins, times and species: each norm is taken on the one that is meant.
#[test]
fn two_outputs_of_one_kind_are_told_apart_in_either_order() {
    let outputs = ["output profile T at t = 1 s on 8\n", "output profile other, T at t = 0 s, 2 s on 5\n"];
    let rest = "reference g for T = 5 mol/m^3
measure both    = l1(profile.T - profile.other)
measure first   = l1(profile.T - g) at t = 1 s
measure second  = l1(profile.T - g) at t = 2 s
measure partner = l1(g - profile.other)
";
    // |T - other| = 1, |T - g| = 3, |g - other| = 4 over 4 m, at both times of the second output or at one.
    let expected = [8.0, 12.0, 12.0, 32.0];
    assert_close(&measures(&format!("{}{}{rest}", outputs[0], outputs[1])), &expected);
    assert_close(&measures(&format!("{}{}{rest}", outputs[1], outputs[0])), &expected);
}

/// An output that stands twice is run once; norms on the second one find the first.
#[test]
fn a_repeated_output_shifts_no_measure() {
    let measures = measures(
        "output total T at t = 1 s
output total T at t = 1 s
output profile T at t = 1 s on 8
measure amount = maximum(total.T)
measure size   = integral(profile.T)
",
    );
    assert_close(&measures, &[8.0, 8.0]);
}

/// The flow carries 1 mol/m³ half out of 10 m: a reference of 2 mol/m³ is compared where there is fluid.
/// All norms of one output count the same bins, as the table `errors` does.
#[test]
fn an_empty_bin_is_left_out_of_a_reference_alone() {
    let scene = "lamella 1
species T
domain line x = 0 m .. 10 m
boundary left, right open
flow uniform 1 m/d
initial T = 1 mol/m^3
particles fluid 1000 ordered
run to 5 d, step 1 d
output profile T at t = 5 d on 20
reference g for T = 2 mol/m^3
measure relative = l2(profile.T - g) / l2(g)
measure size     = integral(g * x / x)
measure average  = mean(g)
measure inverse  = mean(1 / g) * mean(g)
";
    assert_close(&measures_of(scene), &[0.5, 10.0, 2.0, 1.0]);
}

/// Where nothing is left, no norm is zero: an error of zero would read as perfect.
#[test]
fn a_norm_of_nothing_is_undefined() {
    let norms = ["l1", "l2", "linf", "rmse", "integral", "mean", "minimum", "maximum"];
    let lines = norms.map(|norm| format!("measure of_{norm} = {norm}(profile.T) over x = 0 m .. 4 m\n"));
    let scene = "lamella 1
species T
domain line x = 0 m .. 10 m
boundary left, right open
flow uniform 1 m/d
initial T = 1 mol/m^3
particles fluid 1000 ordered
run to 5 d, step 1 d
output profile T at t = 5 d on 20
";
    let found = measures_of(&format!("{scene}{}", lines.concat()));
    assert_eq!(found.len(), norms.len());
    assert!(found.iter().all(|value| value.is_nan()), "{found:?}");
}

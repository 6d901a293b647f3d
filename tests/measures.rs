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
    run(scene).0
}

/// The measures of a scene, and the sub-steps that the engine counted.
fn run(scene: &str) -> (Vec<f64>, Option<u64>) {
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
    let values = found.expect("has values").measures.iter().map(|measure| measure.value).collect();
    (values, outcome.sub_steps())
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

/// T is 2 and `other` 1 mol/m³ everywhere; the references are 5 and 4, so that the relative errors are 3/5 and 3/4.
const TWO_ERRORS: &str = "output profile T at t = 1 s on 8
output profile other at t = 0 s, 2 s on 5
reference g for T = 5 mol/m^3
reference h for other = 4 mol/m^3
param tol = 1e-3
";

/// Wherever a measure stands, those that it names are found; columns stay as they are written.
#[test]
fn a_measure_names_others_in_any_order() {
    let measures = measures(&format!(
        "{TWO_ERRORS}measure excess = err / tol
measure digits = -log10(err)
measure err    = max(err_T, err_h)
measure err_T  = linf(profile.T - g) / linf(g)
measure least  = min(err_h, err_T)
measure err_h  = linf(profile.other - h) / linf(h)
measure length = integral(profile.T) at t = 1 s
measure half   = length / 2  at t = 0 s, 2 s
"
    ));
    assert_close(&measures, &[750.0, -(0.75_f64.log10()), 0.75, 0.6, 0.6, 0.75, 8.0, 4.0]);
}

/// Each keeps its own range and times: naming a measure is naming its value.
#[test]
fn a_named_measure_keeps_its_own_range_and_times() {
    let measures = measures(
        "output profile T at t = 0 s, 1 s, 2 s on 8
measure ratio = l1(profile.T) / part  over x = 0 m .. 2 m at t = 0 s, 1 s
measure part  = l1(profile.T) over x = 1 m .. 2 m at t = 2 s
measure again = part
",
    );
    // 2 mol/m³ over 2 m at two times by 2 mol/m³ over 1 m at one.
    assert_close(&measures, &[4.0, 2.0, 2.0]);
}

/// Functions of the language and of the scene, of numbers and bin by bin.
#[test]
fn functions_work_on_numbers_and_on_fields() {
    let measures = measures(
        "output profile T at t = 1 s on 4
reference g for T = 5 mol/m^3
let unit = 1 mol/m^3
fn relative(a, b) = linf(a - b) / linf(b)
fn capped(f) = min(f, relative(profile.T, g))
measure root    = integral(sqrt(profile.T))^2 / 4 m
measure logs    = mean(ln(profile.T / unit)) + exp(mean(log10(g / unit)))
measure larger  = mean(max(profile.T, g) - min(profile.T, g))
measure highest = maximum(min(x, 2.9 m) + 0 * x * profile.T / unit)
measure power   = maximum(pow(profile.T / unit, 3)) + pow(maximum(profile.T / unit), -1)
measure spread  = tanh(maximum(erf(x / 1 m * profile.T / (2 * unit)))) - sin(cos(minimum(profile.T) / unit)) - erfc(0.1 * steps)
measure error   = relative(profile.T, g)
measure low     = capped(0.3) + capped(0.9)
measure bent    = mean(2 * 3 * T_of(profile.T))
fn T_of(c) = if 1 < 2 then c else 2 * c
",
    );
    let (erf_of_7_halves, erf_of_fifth) = (0.9999992569016276_f64, 0.22270258921047845);
    let spread = erf_of_7_halves.tanh() - 2.0_f64.cos().sin() - (1.0 - erf_of_fifth);
    let logs = 2.0_f64.ln() + 5.0_f64.log10().exp();
    let expected = [8.0, logs, 3.0, 2.9, 8.5, spread, 0.6, 0.3 + 0.6, 12.0];
    assert_close(&measures, &expected);
}

/// A norm inside a function of the scene decides for the others, as it does where it is written.
#[test]
fn a_norm_inside_a_function_decides_for_the_others() {
    let measures = measures(
        "output profile T at t = 1 s on 8
output map T at t = 0 s, 1 s, 2 s on 16
reference g for T = 5 mol/m^3
fn relative(a, b) = l2(a - b) / l2(b)
measure on_map     = relative(map.T, g)
measure on_profile = l1(g) * relative(g, profile.T)
",
    );
    assert_close(&measures, &[0.6, 20.0 * 1.5]);
}

/// A decay of 2 per run that is integrated: at least one sub-step for each particle and step.
#[test]
fn sub_steps_are_those_of_the_engine() {
    let rest = "chemistry integrator explicit
reaction decay: T -> other @ 1 /s
output total T at t = 0 s, 2 s
measure each  = sub_steps / (particles * steps)
measure work  = sub_steps
measure loss  = ln(before / after)
measure before = maximum(total.T) at t = 0 s
measure after  = maximum(total.T) at t = 2 s
";
    let (measures, sub_steps) = run(&format!("{SCENE}{rest}"));
    assert_eq!(sub_steps.map(|n| n as f64), Some(measures[1]));
    assert!(measures[0] >= 1.0 && measures[0] == measures[1] / 2000.0, "{measures:?}");
    // The tolerance of the integrator, 1e-6 of each sub-step, gathers over a few of them.
    assert!((measures[2] - 2.0).abs() < 1e-5, "{measures:?}");
}

/// Nothing is integrated in these scenes.
#[test]
fn sub_steps_are_none_without_integration() {
    let measures = measures(
        "output total T at t = 1 s\nmeasure work = sub_steps / steps\nmeasure n = sub_steps + steps\n",
    );
    assert_eq!(measures, [0.0, 2.0]);
}

/// A chain of any length is no matter of the stack.
#[test]
fn a_long_chain_of_measures_has_a_value() {
    let n_measures = 5000;
    let lines: Vec<String> =
        (0..n_measures).map(|idx| format!("measure m{idx} = m{} + 1\n", idx + 1)).collect();
    let rest = format!("output total T at t = 1 s\n{}measure m{n_measures} = steps\n", lines.concat());
    let measures = measures(&rest);
    assert_eq!(measures[0], f64::from(n_measures) + 2.0);
    assert_eq!(measures[n_measures as usize], 2.0);
}

/// The form in the plan of what could be written before is the same: sweeps know their measures by it.
#[test]
fn the_plan_keeps_sums_and_products_of_constants_as_written() {
    let scene = format!(
        "{SCENE}output profile T at t = 1 s on 8
param D = 3
measure growth = linf(profile.T / (1 mol/m^3)) / (2 * D) - abs(-D + 1)^2
measure named  = growth * 2
"
    );
    let settings = lamella::scenario::Settings::default();
    let checked = lamella::check(Sources::single("scene.lam", scene), &settings, &Options::default());
    let compiled = checked.compiled.unwrap_or_else(|| panic!("{:#?}", checked.diagnostics));
    use lamella::maths::operator::{Binary, Unary};
    use lamella::plan::evaluation::Scalar;
    let number = |value| Box::new(Scalar::Number(value));
    let [growth, named] = &compiled.evaluation.measures[..] else { panic!("two measures") };
    let Scalar::Binary(Binary::Subtract, quotient, square) = &growth.value else { panic!("{growth:?}") };
    let Scalar::Binary(Binary::Divide, _, below) = &**quotient else { panic!("{quotient:?}") };
    assert_eq!(**below, Scalar::Binary(Binary::Multiply, number(2.0), number(3.0)));
    let negative = Box::new(Scalar::Unary(Unary::Negate, number(3.0)));
    let sum = Box::new(Scalar::Binary(Binary::Add, negative, number(1.0)));
    let size = Box::new(Scalar::Unary(Unary::Abs, sum));
    assert_eq!(**square, Scalar::Binary(Binary::Power, size, number(2.0)));
    assert_eq!(named.value, Scalar::Binary(Binary::Multiply, Box::new(Scalar::Measure(0)), number(2.0)));
}

/// Amount, spread and volume of a normal pulse over time: `moments` and `dilution` by name.
#[test]
fn outputs_in_rows_have_measures_and_references() {
    let scene = "lamella 1
let D = 0.1 m^2/s
let c0 = 1 mol/m^3
species A
domain line x = -20 m .. 20 m
boundary left, right reflect
dispersion D
initial A = c0 * exp(-(x / 1 m)^2)
particles fluid 100000 stratified
run to 10 s, step 2 s
seed 3
output moments  A every 5 s
output dilution A at t = 3 s, 10 s on 400
reference whole  for moments A  = c0 * 1 m * sqrt(pi)
reference volume for dilution A = sqrt(2 * pi * exp(1) * (0.5 m^2 + 2 * D * t))
measure amount = mean(moments.A)
measure amount_error = linf(moments.A - whole) / linf(whole)
measure volume_error = linf(dilution.A - volume) / linf(volume)
measure largest = linf(dilution.A)
";
    let found = measures_of(scene);
    assert!((found[0] / std::f64::consts::PI.sqrt() - 1.0).abs() < 1e-3, "{found:?}");
    assert!(found[1] < 1e-3 && found[2] > 0.0 && found[2] < 0.02, "{found:?}");
    let exact = (2.0 * std::f64::consts::PI * std::f64::consts::E * 2.5).sqrt();
    assert!((found[3] / exact - 1.0).abs() < 0.02, "{found:?}");
}

//! Exchange between parcels from the text of a scene to its plan, held to closed forms.

use lamella::Checked;
use lamella::plan::compile::{Compiled, Options, Selection};
use lamella::plan::exchange::{Cutoff, Exchange, Integration, Kernel, Normalisation, Sizes, plume_error};
use lamella::plan::{Stage, document};
use lamella::scenario::Settings;
use lamella::source::Sources;

/// A line of 60 m, 240 parcels, D = 1 m²/s, steps of 0.125 s: ℓ = √(2 D Δt) is 0.5 m, parcels lie 0.25 m apart.
const LINE: &str = "lamella 1
species A
domain line x = 0 m .. 60 m
boundary left, right reflect
dispersion 1 m^2/s
initial A = exp(-(x - 30 m)^2 / 2 m^2) * 1 mol/m^3
particles fluid 240 ordered
run to 10 s, step 0.125 s
output total A at t = 10 s
";

const BOX: &str = "lamella 1
species A
domain box x = 0 m .. 10 m, y = 0 m .. 10 m, z = 0 m .. 10 m
boundary left, right, bottom, top, front, back periodic
dispersion 1e-4 m^2/s
initial A = if x + y + z < 15 m then 1 mol/m^3 else 0
particles fluid 1000 ordered
run to 10 s, step 1 s
output total A at t = 10 s
";

const RECT: &str = "lamella 1
species A
domain rect x = 0 m .. 10 m, y = 0 m .. 10 m
boundary left, right, bottom, top reflect
dispersion ((2 m^2/s, 0.5 m^2/s), (0.5 m^2/s, 1 m^2/s))
initial A = if x < 5 m then 1 mol/m^3 else 0
particles fluid 10000 ordered
run to 0.01 s, step 0.001 s
output total A at t = 0.01 s
";

fn check(text: &str, settings: &Settings, options: &Options) -> Checked {
    lamella::check(Sources::single("scene.lam", text), settings, options)
}

fn compile_with(text: &str, settings: &Settings, options: &Options) -> Compiled {
    let checked = check(text, settings, options);
    let told = checked.diagnostics.iter().map(|told| format!("{}: {}", told.code, told.message));
    let told: Vec<String> = told.collect();
    checked.compiled.unwrap_or_else(|| panic!("no plan: {told:#?}\n{text}"))
}

fn compile(text: &str) -> Compiled {
    compile_with(text, &Settings::default(), &Options::default())
}

fn of(text: &str, statement: &str) -> Compiled {
    compile(&format!("{text}{statement}\n"))
}

fn exchange(compiled: &Compiled) -> &Exchange {
    compiled.plan.exchange.as_ref().expect("the plan has an exchange")
}

fn sizes(compiled: &Compiled) -> Sizes {
    exchange(compiled).sizes(&compiled.plan, compiled.plan.time.step)
}

fn codes(text: &str, statement: &str) -> Vec<&'static str> {
    let text = format!("{text}{statement}\n");
    let checked = check(&text, &Settings::default(), &Options::default());
    checked.diagnostics.iter().map(|told| told.code.0).collect()
}

fn edited(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "the scene has no `{from}`");
    text.replace(from, to)
}

/// Equal to so many parts of the second.
fn assert_near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{found} for {expected}");
}

#[test]
fn settings_reach_the_plan_and_the_rest_has_defaults() {
    let plain = of(LINE, "exchange kernel gaussian");
    let own = exchange(&plain);
    assert_eq!(own.kernel, Kernel::Catalogue("gaussian".into()));
    assert_eq!((own.normalisation, own.integration), (Normalisation::Arithmetic, Integration::Explicit));
    assert_eq!((own.cutoff, own.is_compensated), (Cutoff::Error(1e-5), true));
    assert_eq!(own.diffusion, [1.0]);
    let all = "exchange bandwidth 0.75 m, mixing_fraction 0.25, normalise sinkhorn, integrate exponential,
  kernel wendland_c4, cutoff 1.5, compensate off";
    let all = of(LINE, all);
    let own = exchange(&all);
    assert_eq!(own.kernel, Kernel::Catalogue("wendland_c4".into()));
    assert_eq!((own.normalisation, own.integration), (Normalisation::Sinkhorn, Integration::Exponential));
    assert_eq!((own.cutoff, own.is_compensated), (Cutoff::Radius(1.5), false));
    assert_eq!(own.diffusion, [0.25]);
    assert_eq!(own.bandwidth.evaluate(&[1.0, 1.0]), 0.75);
    let geometric = of(LINE, "exchange normalise geometric, integrate implicit, diffusion_error 1e-3");
    let own = exchange(&geometric);
    assert_eq!((own.normalisation, own.integration), (Normalisation::Geometric, Integration::Implicit));
    assert_eq!(own.cutoff, Cutoff::Error(1e-3));
}

/// With a cut at 8 bandwidths the fourth moment lacks a⁵ e^{−a²/2} of itself, below 1e-9.
#[test]
fn lengths_are_those_of_step_and_parcels() {
    let own = sizes(&of(LINE, "exchange cutoff 8"));
    assert_near(own.collocation, 0.5, 1e-9);
    assert_near(own.bandwidth, 0.5, 1e-9);
    assert_near(own.spacing, 0.25, 1e-15);
    assert_near(own.share, 1.0, 2e-9);
    assert_near(own.diffusion, 1.0, 1e-15);
    // 2 · 8 · 0.5 m at 0.25 m each.
    assert_near(own.neighbours, 32.0, 1e-9);
    let larger = sizes(&of(LINE, "exchange cutoff 8, bandwidth max(collocation, 3 * spacing)"));
    assert_near(larger.bandwidth, 0.75, 1e-12);
    // (ℓ/h)²
    assert_near(larger.share, 4.0 / 9.0, 2e-9);
    let smaller = sizes(&of(LINE, "exchange bandwidth min(collocation, spacing) / 1, integrate implicit"));
    assert_near(smaller.bandwidth, 0.25, 1e-12);
}

#[test]
fn neighbours_fill_a_ball_in_one_to_three_dimensions() {
    use std::f64::consts::PI;
    let reach: f64 = 4.0 * 1.5;
    let cases = [(LINE, 2.0 * reach), (RECT, PI * reach.powi(2)), (BOX, 4.0 / 3.0 * PI * reach.powi(3))];
    for (text, expected) in cases {
        let own = sizes(&of(text, "exchange bandwidth 1.5 * spacing, cutoff 4, integrate implicit"));
        assert_near(own.neighbours, expected, 1e-12);
    }
}

/// The relative error of the dispersion by the cut, as formulas and as they are printed for 3 to 6 bandwidths.
#[test]
fn what_a_cut_takes_is_what_the_formulas_say() {
    use lamella::maths::scalar::erf;
    let printed = [
        [2.67e-2, 1.07e-3, 1.5e-5, 7e-8],
        [5.05e-2, 2.69e-3, 4.7e-5, 2.7e-7],
        [8.22e-2, 5.72e-3, 1.2e-4, 9e-7],
    ];
    for (d, text) in [LINE, RECT, BOX].into_iter().enumerate() {
        for (idx, a) in [3.0, 4.0, 5.0, 6.0_f64].into_iter().enumerate() {
            let statement = format!("exchange bandwidth 2 * spacing, cutoff {a}, integrate implicit");
            let lost = 1.0 - sizes(&of(text, &statement)).fidelity;
            let g = (-0.5 * a * a).exp();
            let root = (2.0 / std::f64::consts::PI).sqrt();
            let inside = erf(a / std::f64::consts::SQRT_2);
            let expected = match d {
                0 => root * a * g / inside,
                1 => 0.5 * a * a * g / (1.0 - g),
                _ => root * a.powi(3) / 3.0 * g / (inside - root * a * g),
            };
            // Of numbers near one: what 1e-13 of the quadrature leaves.
            assert!((lost - expected).abs() < 1e-12, "{d} {a}: {lost} for {expected}");
            assert!((lost / printed[d][idx] - 1.0).abs() < 0.08, "{d} {a}: {lost}");
        }
    }
}

#[test]
fn a_cut_by_its_error_has_that_error() {
    for (text, error) in [(LINE, 1e-3), (RECT, 1e-5), (BOX, 1e-2)] {
        let own = sizes(&of(
            text,
            &format!("exchange bandwidth 2 * spacing, diffusion_error {error}, integrate implicit"),
        ));
        assert_near(1.0 - own.fidelity, error, 1e-6);
    }
}

/// κ² is the variance of a kernel along one axis. A cubic B-spline is the sum of four uniform numbers of width one, a
/// quintic one of six; those of the others follow from Beta functions.
#[test]
fn collocation_lengths_follow_the_variance_of_the_kernel() {
    let variances = [
        ("gaussian, cutoff 8", [1.0, 1.0, 1.0]),
        ("cubic_spline", [4.0 / 12.0, 31.0 / 98.0, 0.3]),
        ("quintic_spline", [6.0 / 12.0, f64::NAN, 7.0 / 15.0]),
        ("wendland_c2", [2.0 / 7.0, 5.0 / 18.0, 4.0 / 15.0]),
        ("wendland_c4", [12.0 / 55.0, 7.0 / 33.0, 8.0 / 39.0]),
        ("wendland_c6", [16.0 / 91.0, 6.0 / 35.0, 1.0 / 6.0]),
        ("epanechnikov", [0.2, 1.0 / 6.0, 1.0 / 7.0]),
    ];
    for (kernel, expected) in variances {
        for (text, variance) in [LINE, RECT, BOX].into_iter().zip(expected) {
            let compiled =
                of(text, &format!("exchange kernel {kernel}, bandwidth 3 * spacing, integrate implicit"));
            let own = sizes(&compiled);
            let step = (2.0 * own.diffusion * compiled.plan.time.step).sqrt();
            if variance.is_finite() {
                assert_near((step / own.collocation).powi(2), variance, 1e-8);
                assert_near((own.effective / own.bandwidth).powi(2), variance, 1e-8);
            }
        }
    }
}

/// The same profile by another way: the derivative of the expression against the one of the catalogue.
#[test]
fn a_profile_of_the_scene_is_the_kernel_that_it_writes() {
    let own = "kernel W(q) = (1 - q/2)^4 * (1 + 2*q) support 2 \"own\"\n";
    for text in [LINE, RECT, BOX] {
        let text = format!("{text}{own}");
        let found = of(&text, "exchange kernel W, bandwidth 3 * spacing, integrate implicit");
        let known = of(
            text.replace(own, "").as_str(),
            "exchange kernel wendland_c2, bandwidth 3 * spacing, integrate implicit",
        );
        assert!(
            matches!(&exchange(&found).kernel, Kernel::Profile { name, support, .. } if name == "W" && *support == 2.0)
        );
        let (found, known) = (sizes(&found), sizes(&known));
        for (a, b) in [
            (found.share, known.share),
            (found.effective, known.effective),
            (found.collocation, known.collocation),
        ] {
            assert_near(a, b, 1e-10);
        }
    }
    // Its own comes before that of the catalogue.
    let hidden = of(
        LINE,
        "exchange kernel epanechnikov, bandwidth 2 m\nkernel epanechnikov(q) = exp(-q^2/2) support 6",
    );
    assert!(matches!(exchange(&hidden).kernel, Kernel::Profile { .. }));
}

#[test]
fn dispersion_is_shared_between_exchange_and_walk() {
    let part = of(RECT, "exchange bandwidth 2 * spacing, mixing_fraction 0.25, integrate implicit");
    assert_eq!(exchange(&part).diffusion, [0.5, 0.125, 0.25]);
    // L Lᵀ = 2 · 0.75 D = ((3, 0.75), (0.75, 1.5)).
    let [b00, b10, b11] = part.plan.walk.spread[..] else { panic!("no triangle") };
    assert_near(b00 * b00, 3.0, 1e-14);
    assert_near(b10 * b00, 0.75, 1e-14);
    assert_near(b10 * b10 + b11 * b11, 1.5, 1e-14);
    let all = of(RECT, "exchange bandwidth 2 * spacing, integrate implicit");
    assert_eq!(all.plan.walk.spread, [0.0; 3]);
    assert_eq!(exchange(&all).diffusion, [2.0, 0.5, 1.0]);
    // (det D)^{1/2} = √1.75; parcels are 0.1 m apart, whatever the tensor.
    assert_near(sizes(&all).diffusion, 1.75_f64.sqrt(), 1e-14);
    assert_near(sizes(&all).spacing, 0.1, 1e-14);
}

#[test]
fn dispersion_by_lengths_in_uniform_flow_is_a_tensor_of_constants() {
    let text = edited(
        LINE,
        "dispersion 1 m^2/s",
        "dispersion longitudinal 0.5 m, molecular 0.5 m^2/s\nflow uniform 1 m/s",
    );
    let text = edited(&text, "left, right reflect", "left, right periodic");
    assert_eq!(exchange(&of(&text, "exchange kernel gaussian")).diffusion, [1.0]);
}

#[test]
fn stages_stand_in_their_order() {
    let all = "exchange bandwidth 1 m, mixing_fraction 0.5
species B
initial B = 1 mol/m^3 - A
reaction meet: A + B -> @ 1 m^3/mol/d
mixing zones { fast: fraction 0.5, rate instant; slow: fraction 0.5, rate 1 /h }
average bins 4";
    use Stage::*;
    let compiled = of(LINE, all);
    assert_eq!(compiled.plan.stages, [FusedReact, Move, Bound, Exchange, Average, Observe]);
    let plain = compile_with(
        &format!("{LINE}{all}\n"),
        &Settings::default(),
        &Options { passes: Selection::None, memory: None },
    );
    assert_eq!(plain.plan.stages, [Mix, React, Move, Bound, Exchange, Average, Observe]);
    assert_eq!(of(LINE, "exchange kernel gaussian").plan.stages, [Exchange, Observe]);
}

#[test]
fn relations_between_species_stay_and_axes_do_too() {
    let text = "species B
initial B = 2 mol/m^3 - A
output total B at t = 0.01 s
exchange bandwidth 2 * spacing, integrate implicit";
    let compiled = of(RECT, text);
    assert_eq!(compiled.plan.components.len(), 1);
    // Nothing varies along y, but distances do.
    assert_eq!(compiled.plan.axes.len(), 2);
    assert_eq!(compile(RECT).plan.axes.len(), 1);
}

#[test]
fn an_exchange_of_what_is_the_same_everywhere_is_left_out() {
    let text = edited(LINE, "exp(-(x - 30 m)^2 / 2 m^2) * 1 mol/m^3", "1 mol/m^3");
    let compiled = of(&text, "exchange kernel gaussian");
    assert_eq!((compiled.plan.exchange, compiled.plan.stages), (None, vec![Stage::Observe]));
    assert!(compiled.left_out.iter().any(|item| item.what == "exchange between parcels"));
}

#[test]
fn parameters_of_the_bandwidth_can_be_set_and_swept() {
    let text = format!(
        "{LINE}param a = 3\nexchange bandwidth a * spacing, kernel gaussian, integrate implicit
sweep widths {{ a 2, 3, 4 }}\n"
    );
    let set = |value: &str| {
        let settings = Settings { set: vec![("a".to_owned(), value.to_owned())], ..Settings::default() };
        compile_with(&text, &settings, &Options::default())
    };
    assert_near(sizes(&compile(&text)).bandwidth, 0.75, 1e-14);
    assert_near(sizes(&set("4")).bandwidth, 1.0, 1e-14);
    assert_ne!(set("4").hash, set("3").hash);
    assert_eq!(set("3").hash, compile(&text).hash);
}

#[test]
fn hash_and_document_know_the_exchange() {
    let text = format!(
        "{LINE}kernel W(q) = (1 - q^2)^3 support 1\nexchange kernel W, bandwidth 2 * spacing, integrate implicit\n"
    );
    let compiled = compile(&text);
    let in_centimetres = text.replace("2 * spacing", "200 cm / 1 m * spacing");
    assert_eq!(compile(&in_centimetres).hash, compiled.hash);
    let others = ["2.1 * spacing", "2 * spacing, compensate off", "2 * spacing, normalise sinkhorn"];
    for other in others {
        assert_ne!(compile(&text.replace("2 * spacing", other)).hash, compiled.hash, "{other}");
    }
    let checked = check(&text, &Settings::default(), &Options::default());
    let written = document::write(&compiled, checked.scenario.as_ref().expect("a scene"), &[], &[]);
    assert_eq!(document::read(&written).expect("a plan").0, compiled.plan);
}

/// The step of `step auto` knows what disperses, whether it walks or not.
#[test]
fn steps_and_bins_are_judged_by_all_dispersion() {
    let text = edited(LINE, "step 0.125 s", "step auto");
    let step = |statement: &str| of(&text, statement).plan.time.step;
    let walking = compile(&text).plan.time.step;
    assert_near(step("exchange kernel gaussian"), walking, 1e-12);
    assert_near(step("exchange mixing_fraction 0.3"), walking, 1e-12);
    let zones = "mixing zones { all: fraction 1, rate 0.01 /s }\naverage bins 4";
    let ratio = |statement: &str| {
        let compiled = of(LINE, &format!("{zones}\n{statement}"));
        let limit = compiled.limits.iter().find(|limit| limit.name.starts_with("numerical dispersion"));
        limit.expect("bins disperse").value
    };
    let walking = ratio("");
    assert_near(ratio("exchange bandwidth 1 m"), walking, 1e-12);
    assert_near(ratio("exchange bandwidth 1 m, mixing_fraction 0.3"), walking, 1e-12);
}

/// Coordinates and values of the order of cells, what a step works with, and ten bytes of each pair, in lanes of eight.
#[test]
fn memory_counts_what_is_sorted_and_weighed() {
    let (with, without) = (of(LINE, "exchange kernel gaussian"), compile(LINE).cost);
    let of_pairs = 240.0 * 10.0 * (sizes(&with).neighbours + 4.0);
    let expected = 8.0 * 240.0 * (2.0 + 3.0 + 4.0) + of_pairs;
    assert_eq!(with.cost.state_bytes - without.state_bytes, expected as u64);
    // Of many parcels not all pairs are remembered.
    let many = edited(LINE, "fluid 240", "fluid 1000000");
    let (with, without) = (of(&many, "exchange kernel gaussian").cost, compile(&many).cost);
    assert_eq!(with.state_bytes - without.state_bytes, 8_000_000 * 9 + (12 << 20));
}

/// 0.6404 D t |h² − ℓ²|/σ⁴ for D t = 10 m², h = 0.75 m, ℓ = 0.5 m, σ² = 21 m².
#[test]
fn the_leading_error_is_that_of_the_theory() {
    let compiled = of(LINE, "exchange bandwidth 0.75 m, cutoff 8");
    let own = sizes(&compiled);
    let error = |integration| plume_error(&own, integration, (1, 10.0, 0.125), 21_f64.sqrt());
    // The factor is √(7·5·3/16)/4 = 0.640434…
    let factor = (105.0_f64 / 16.0).sqrt() / 4.0;
    for (integration, excess) in [
        (Integration::Explicit, 0.5625 - 0.25),
        (Integration::Exponential, 0.5625),
        (Integration::Implicit, 0.5625 + 0.25),
    ] {
        assert_near(error(integration), factor * 10.0 * excess / 441.0, 1e-8);
    }
    // σ = (0.6404 · 10 · 0.3125 / 0.01)^{1/4} = 3.76 m.
    let text = lamella::plan::explain::explain(&compiled, "scene.lam", None);
    assert!(text.contains("whose standard deviation at the end is 3.76 m or more"), "{text}");
    assert!(
        text.contains("bandwidth h = 0.75 m: 1.5 of the collocation length of 0.5 m, 3 of the distance"),
        "{text}"
    );
    let text = lamella::plan::explain::explain(&of(LINE, "exchange kernel gaussian"), "scene.lam", None);
    assert!(text.contains("no leading error of the step"), "{text}");
}

/// With the collocation length of a kernel the share of a step is `M₀ M₄/(d (d + 2))` over the square of its mass: the
/// same at any step, one for a Gaussian, less for others. Only that of Wendland's C2 on a line is above, 15/14.
#[test]
fn collocation_suits_explicit_steps_at_any_step() {
    for item in lamella::catalog::kernel::ALL {
        for (text, step) in [(LINE, "0.125 s"), (RECT, "0.001 s"), (BOX, "1 s")] {
            for factor in ["", "20 * "] {
                let text = edited(text, step, &format!("{factor}{step}"));
                let statement = format!("exchange kernel {}, bandwidth collocation", item.name);
                let is_above = item.name == "wendland_c2" && text.contains("domain line");
                assert_eq!(codes(&text, &statement).contains(&"N206"), is_above, "{statement}\n{text}");
            }
        }
    }
    let own = sizes(&of(LINE, "exchange kernel wendland_c2, integrate implicit"));
    assert_near(own.share, 15.0 / 14.0, 1e-10);
    // √(15/14) = 1.0351
    assert!(!codes(LINE, "exchange kernel wendland_c2, bandwidth 1.04 * collocation").contains(&"N206"));
}

/// What the refusal names works, and a little less does not.
#[test]
fn the_step_and_the_bandwidth_that_are_named_work() {
    let statement = "exchange bandwidth 0.4 m, cutoff 8";
    let checked = check(&format!("{LINE}{statement}\n"), &Settings::default(), &Options::default());
    let refusal = checked.diagnostics.iter().find(|told| told.code.0 == "N206").expect("ℓ is 0.5 m");
    // β = (0.5/0.4)² = 1.5625, Δt = 0.08 s.
    assert!(
        refusal.help[0].contains("`step 0.08 s` or less, or use a bandwidth of `0.5 m` or more"),
        "{:?}",
        refusal.help
    );
    let shorter = |step: &str| codes(&edited(LINE, "step 0.125 s", step), statement);
    assert!(!shorter("step 0.08 s").contains(&"N206") && shorter("step 0.081 s").contains(&"N206"));
    assert!(!codes(LINE, "exchange bandwidth 0.5 m, cutoff 8").contains(&"N206"));
    assert!(codes(LINE, "exchange bandwidth 0.499 m, cutoff 8").contains(&"N206"));
    // Where the bandwidth follows the step, so does the share: no step would do.
    let following = check(
        &format!("{LINE}exchange bandwidth 0.8 * collocation\n"),
        &Settings::default(),
        &Options::default(),
    );
    let refusal = following.diagnostics.iter().find(|told| told.code.0 == "N206").expect("below ℓ");
    assert!(
        !refusal.help[0].contains("step") && refusal.help[0].contains("or of `collocation`"),
        "{:?}",
        refusal.help
    );
}

/// One mean distance for ordered parcels that rest, one and a half for those that walk, three for random ones that
/// rest on a line.
#[test]
fn warnings_begin_where_parcels_are_too_few() {
    let random = edited(LINE, "240 ordered", "240 random");
    let cases = [
        (LINE, "exchange bandwidth {} * spacing, integrate implicit", 1.0),
        (LINE, "exchange bandwidth {} * spacing, integrate implicit, mixing_fraction 0.5", 1.5),
        (&random, "exchange bandwidth {} * spacing, integrate implicit", 3.0),
        (RECT, "exchange bandwidth {} * spacing, integrate implicit", 1.0),
    ];
    for (text, statement, least) in cases {
        let told = |factor: f64| codes(text, &statement.replace("{}", &factor.to_string())).contains(&"N109");
        assert!(!told(least) && told(0.9 * least), "{statement}");
    }
}

/// A name of the scene in its own exchange, and words that are nothing elsewhere.
#[test]
fn words_of_length_belong_to_the_bandwidth() {
    assert!(codes(LINE, "param collocation = 1 m\nexchange bandwidth collocation").contains(&"D003"));
    // A constant of that name that the bandwidth does not speak of is its own.
    assert!(codes(LINE, "param spacing = 3\nexchange bandwidth 1 m, cutoff spacing").is_empty());
    assert!(codes(LINE, "exchange bandwidth 1 m, cutoff spacing").contains(&"D004"));
}

/// Any size of any number gives a plan or a message.
#[test]
fn extreme_numbers_are_answered() {
    for value in ["1e-300", "1e-160", "1e-9", "1", "1e9", "1e160", "1e300"] {
        for statement in
            ["kernel gaussian", "bandwidth 1 m", "bandwidth 2 * spacing", "bandwidth 1e300 * spacing"]
        {
            for text in [LINE, RECT, BOX] {
                let line = text.lines().find(|line| line.starts_with("dispersion")).expect("a dispersion");
                let text = edited(text, line, &format!("dispersion {value} m^2/s"));
                for integration in ["explicit", "implicit", "exponential"] {
                    let text = format!("{text}exchange {statement}, integrate {integration}\n");
                    let checked = check(&text, &Settings::default(), &Options::default());
                    assert!(checked.compiled.is_some() || !checked.diagnostics.is_empty(), "{text}");
                }
            }
        }
    }
}

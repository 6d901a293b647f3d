//! Reactions of particles that carry mass, by kernels and by pairs.
//!
//! References: closed forms of batches, converged finite volumes of interfaces (methods 10.1), and what must not change.

#[path = "support/scene.rs"]
mod scene;

use lamella::engine::{Settings as EngineSettings, Starts, Unattended};
use lamella::plan::{OutputKind, Plan};
use lamella::scenario::Settings;
use scene::{Finished, edited, run, run_with, tell};

fn with(text: &str, set: &[(&str, &str)], seed: u64) -> Finished {
    let set = set.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
    run_with(text, &Settings { set, seed: Some(seed), ..Settings::default() })
}

fn plan_of(text: &str) -> Plan {
    let sources = lamella::source::Sources::single("scene.lam", text);
    let checked = lamella::check(sources, &Settings::default(), &Default::default());
    checked.compiled.unwrap_or_else(|| panic!("{:#?}", checked.diagnostics)).plan
}

/// All snapshots, to the last digit.
fn shown(plan: &Plan, settings: &EngineSettings) -> Vec<String> {
    let mut found = Vec::new();
    lamella::engine::run(plan, settings, &Unattended, &mut |snapshot| {
        found.push(format!("{snapshot:?}"));
        Ok(())
    })
    .expect("the plan runs");
    found
}

/// Amounts at the last time, by species.
fn last(finished: &Finished) -> Vec<f64> {
    let of = |snapshot: &lamella::engine::snapshot::Snapshot| match &snapshot.values {
        lamella::engine::snapshot::Values::Total { amount } => Some(amount.clone()),
        _ => None,
    };
    finished.snapshots.iter().rev().find_map(of).expect("the scene has totals")
}

fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

const BATCH: &str = include_str!("../experiments/masses_batch/batch.lam");
const PAIRS: &str = include_str!("../experiments/masses_batch/pairs.lam");
const SEGREGATED: &str = include_str!("../experiments/masses_batch/segregated.lam");

/// P1-g: what is well mixed follows the law of the batch, for three rates; with kernels as wide as a density wants them, and, to
/// what their noise leaves, with those that reactions have.
#[test]
fn a_mixed_batch_follows_the_law_of_one_parcel() {
    assert!(run(BATCH).measure("err") < 5e-4);
    let rates = [("k * A * B / (0.5 mol/m^3 + A) * 1 mol/m^3", 0.2408), ("1 /s * sqrt(A * B)", 0.0498)];
    for (rate, left) in rates {
        let text = edited(BATCH, "@ k\n", &format!("@ {rate}\n"));
        let found: Vec<f64> = (1..5).map(|seed| last(&with(&text, &[], seed))[0]).collect();
        let (mean, error) = mean_and_error(&found);
        tell(&format!("{rate}: {mean:.4} ± {error:.4} for {left}"));
        assert!((mean - left).abs() < 0.002, "{mean} for {left}");
    }
    let narrow = edited(BATCH, "gaussian fixed { bandwidth 0.15 m, ", "gaussian adaptive { ");
    let found: Vec<f64> = (1..5).map(|seed| last(&with(&narrow, &[], seed))[0]).collect();
    let (mean, error) = mean_and_error(&found);
    tell(&format!("narrow kernels: {mean:.4} ± {error:.4}"));
    assert!((mean - 0.25).abs() < 0.01, "{mean}");
}

/// The same by pairs that meet: within the scatter of 6 runs in methods, 0.252 ± 0.002 for 0.25.
#[test]
fn pairs_follow_the_law_of_the_batch() {
    let found: Vec<f64> = (1..5).map(|seed| last(&with(PAIRS, &[("n", "400")], seed))[0]).collect();
    let (mean, error) = mean_and_error(&found);
    tell(&format!("pairs: {mean:.4} ± {error:.4}"));
    assert!(error < 0.012 && (mean - 0.25).abs() < 3.0 * error, "{mean} ± {error}");
}

/// P1-h: a fast reaction of few particles leaves what has no partner beside it.
#[test]
fn what_has_no_partner_waits() {
    let found: Vec<f64> = (1..9).map(|seed| with(SEGREGATED, &[], seed).measure("ratio")).collect();
    let (mean, error) = mean_and_error(&found);
    tell(&format!("segregated: {mean:.3} ± {error:.3}"));
    // Methods, 5.7, has 0.95 ± 0.04 and 0.88 ± 0.05 by pairs of particles; steps and cells are finite.
    assert!(error < 0.08 && (mean - 1.0).abs() < 3.0 * error, "{mean} ± {error}");
}

/// P1-i: kernels of the variance of a step's displacements are collocation, to the last bit.
#[test]
fn collocation_is_a_kernel_of_the_step_s_displacements() {
    let of = |kernel: &str| {
        let text = edited(PAIRS, "gaussian fixed { bandwidth 0.15 m, grid 5 mm, reactions pairs }", kernel);
        last(&with(&text, &[("n", "2000")], 7))
    };
    // √(2 · 10⁻⁴ m²/s · 20 ms)
    let fixed = of("gaussian fixed { bandwidth 2 mm, grid 5 mm, reactions pairs }");
    let collocation = of("collocation { grid 5 mm }");
    assert!(fixed[0] < 0.5 && fixed[0] > 0.2, "{fixed:?}");
    for (one, other) in fixed.iter().zip(&collocation) {
        assert!((one / other - 1.0).abs() < 1e-14, "{fixed:?} {collocation:?}");
    }
}

/// P1-a, b, d, e: the product at an interface, of 10⁴ particles and 4 seeds, within 2 % and what these seeds scatter.
#[test]
fn an_interface_makes_what_finite_volumes_make() {
    let scenes = [
        include_str!("../experiments/masses_interface/a.lam"),
        include_str!("../experiments/masses_interface/b.lam"),
        include_str!("../experiments/masses_interface/d.lam"),
        include_str!("../experiments/masses_interface/e.lam"),
    ];
    for (scene, name) in scenes.into_iter().zip(["a", "b", "d", "e"]) {
        let runs: Vec<Finished> = (1..5).map(|seed| with(scene, &[("n", "10000")], seed)).collect();
        runs.iter().for_each(Finished::keeps_its_books);
        let bias: Vec<f64> = runs.iter().map(|it| it.measure("bias")).collect();
        let (mean, error) = mean_and_error(&bias);
        tell(&format!("{name}: {mean:.4} ± {error:.4}"));
        assert!(error < 0.015 && mean.abs() < 0.02 + 2.0 * error, "{name}: {mean} ± {error}");
    }
    // A root of concentrations is seen with their noise.
    let scene = include_str!("../experiments/masses_interface/c.lam");
    let (mean, _) =
        mean_and_error(&(1..5).map(|seed| with(scene, &[], seed).measure("bias")).collect::<Vec<_>>());
    assert!(mean.abs() < 0.12, "{mean}");
    // Kernels that are best for the density make far too much.
    let wide = with(include_str!("../experiments/masses_interface/a.lam"), &[("narrowing", "1")], 1);
    assert!(wide.measure("bias") > 0.5);
}

const NETWORK: &str = "lamella 1
species A, B, C
species D immobile
reaction one: A + 2 B -> 3 C @ 2 m^3/mol/d * A * B
reaction two: C -> D @ 0.7 /d
reaction back: D -> C @ 0.2 /d
domain rect x = 0 m .. 10 m, y = 0 m .. 4 m
boundary left inflow A = 1 mol/m^3
boundary right outflow
boundary bottom, top reflect
medium porosity 0.3
flow uniform (0.3 m/d, 0 m/d)
dispersion 0.05 m^2/d
initial B = 1 mol/m^3
particles mass A 4000, B 3000, C 2000, D 500
kernel gaussian adaptive { grid 0.25 m }
run to 10 d, step 0.1 d
seed 3
output budget A, B, C, D at t = 10 d
output total A, B, C, D at t = 0 d, 10 d
output map A, B, C, D at t = 10 d on 20 x 8
output density C at t = 10 d
output kernels C at t = 10 d
";

/// What reactions take of one species and make of others stands in the proportions of their equations, and every mass is booked.
#[test]
fn reactions_keep_their_proportions() {
    let finished = run(NETWORK);
    finished.keeps_its_books();
    let reacted = |species: usize| {
        let rows = finished.rows(OutputKind::Budget, species, Some("reactions"));
        let (_, numbers) = &rows[0];
        numbers[0]
    };
    let [a, b, c, d] = [reacted(0), reacted(1), reacted(2), reacted(3)];
    assert!(a < -0.3, "{a}");
    assert!((b / a - 2.0).abs() < 1e-10, "{a} {b}");
    assert!(((c + d) / a + 3.0).abs() < 1e-10, "{a} {c} {d}");
    let before = |species: usize| finished.rows(OutputKind::Budget, species, Some("defect"))[0].1[0].abs();
    assert!((0..4).all(|species| before(species) < 1e-11 * a.abs()));
}

/// One plan and one seed are the same bits on any number of threads, with wide and narrow code.
#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let pairs = edited(
        NETWORK,
        "reaction one: A + 2 B -> 3 C @ 2 m^3/mol/d * A * B",
        "reaction one: A + B -> C @ 1 m^3/mol/d",
    );
    let pairs = edited(
        &pairs,
        "gaussian adaptive { grid 0.25 m }",
        "gaussian adaptive { grid 0.25 m, reactions pairs }",
    );
    for text in [NETWORK, &pairs] {
        let plan = plan_of(text);
        let of = |n_threads: usize, is_narrow: bool| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(n_threads).build().unwrap();
            pool.install(|| shown(&plan, &EngineSettings { is_narrow, ..EngineSettings::default() }))
        };
        let first = of(1, false);
        assert!(first == of(2, false) && first == of(3, true));
    }
}

/// A species that is not there at first gets particles as heavy as those of the others, where one number is given for all.
#[test]
fn what_is_made_has_as_many_particles_as_it_needs() {
    let text = "lamella 1
species A, B
domain line x = 0 m .. 1 m
boundary left, right reflect
dispersion 1e-3 m^2/s
initial B = 1 mol/m^3
reaction turn: B -> A @ 1 mol/m^3/s * B / (0.1 mol/m^3 + B)
particles mass 2000
run to 1 s, step 0.05 s
output kernels A at t = 1 s
output total A at t = 1 s
";
    for text in [text, &edited(text, "initial B", "initial A = 1e-3 mol/m^3, B")] {
        let finished = run(text);
        let amount = last(&finished)[0];
        let n = finished.rows(OutputKind::Kernels, 0, None)[0].1[5];
        tell(&format!("{n} particles of {amount} mol"));
        assert!((n / (2000.0 * amount) - 1.0).abs() < 0.05, "{n} {amount}");
    }
}

/// Both ways of a reversible reaction come to rest where they should, also in steps that are longer than that takes.
/// Reference: `5 c_B = 10 c_A²` with `c_A + 2 c_B = 2`.
#[test]
fn a_reversible_reaction_comes_to_rest() {
    let text = "lamella 1
species A, B
domain line x = 0 m .. 1 m
boundary left, right reflect
dispersion 1e-3 m^2/s
initial A = 2 mol/m^3
reaction turn: 2 A <-> B @ forward 10 m^3/mol/s, backward 5 /s
particles mass A 500, B 500
run to 2 s, step 0.05 s
output total A at t = 2 s
";
    let right = (-1.0 + 33.0_f64.sqrt()) / 8.0;
    for text in [text, &edited(text, "step 0.05 s", "step 1 s")] {
        let found: Vec<f64> = (1..5).map(|seed| last(&with(text, &[], seed))[0]).collect();
        let (mean, error) = mean_and_error(&found);
        tell(&format!("at rest: {mean:.4} ± {error:.4} of {right:.4}"));
        assert!((mean - right).abs() < 0.006, "{mean} of {right}");
    }
}

/// An integrated initial concentration of another run changes no byte, and one that differs in anything is another.
#[test]
fn runs_may_share_what_they_begin_with() {
    let scene = |centre: &str, porosity: &str| {
        format!(
            "lamella 1\nspecies A\ndomain line x = 0 m .. 10 m\nboundary left, right reflect\nmedium porosity {porosity}\n\
             dispersion 1e-3 m^2/s\ninitial A = 1 mol/m^2 / 1 m * exp(-(x - {centre})^2 / (1 m^2))\nparticles mass 500\n\
             run to 10 s, step 1 s\noutput profile A at t = 10 s on 50\n"
        )
    };
    let starts = Starts::default();
    for (centre, porosity) in [("3 m", "0.3"), ("3 m", "0.4"), ("6 m", "0.3"), ("3 m", "0.3")] {
        let plan = plan_of(&scene(centre, porosity));
        let of =
            |starts: Option<Starts>| shown(&plan, &EngineSettings { starts, ..EngineSettings::default() });
        assert!(of(Some(starts.clone())) == of(None), "{centre} {porosity}");
    }
}

const ONE: &str = "lamella 1
species A, B
reaction one: REACTION
domain line x = 0 m .. 10 m
boundary left, right periodic
flow uniform 1 m/d
dispersion 0.1 m^2/d
initial A = 1 mol/m^3, B = INITIAL
particles mass A 2000, B 2000
kernel KERNEL
run to 4 d, step 0.05 d
seed 5
output total A, B at t = 4 d
output kernels A at t = 4 d
";

fn one(reaction: &str, initial: &str, kernel: &str) -> Vec<f64> {
    let text = edited(&edited(ONE, "REACTION", reaction), "INITIAL", initial);
    let finished = run(&edited(&text, "KERNEL", kernel));
    finished.keeps_its_books();
    last(&finished).into_iter().map(|amount| amount / 10.0).collect()
}

/// Rates that hang on nothing but their own species have closed forms whatever kernels are: decay, growth, two of one kind, and a
/// pair of rates that comes to rest.
#[test]
fn closed_forms_of_one_species_are_met() {
    let wide = "gaussian fixed { bandwidth 2 m, grid 0.1 m, reactions masses }";
    let decay = one("A -> B @ 0.5 /d", "0", wide);
    assert!((decay[0] / (-2.0_f64).exp() - 1.0).abs() < 1e-9, "{decay:?}");
    assert!((decay[0] + decay[1] - 1.0).abs() < 1e-12);
    let growth = one("A -> 2 A @ 0.3 /d", "0", wide);
    assert!((growth[0] / 1.2_f64.exp() - 1.0).abs() < 1e-9, "{growth:?}");
    let like = one("2 A -> B @ 0.5 m^3/mol/d", "0", wide);
    assert!((like[0] / (1.0 / 5.0) - 1.0).abs() < 2e-3, "{like:?}");
    assert!((like[0] + 2.0 * like[1] - 1.0).abs() < 1e-12, "{like:?}");
    let rest = one("A <-> B @ forward 3 /d, backward 1 /d", "0", wide);
    // But for what is less than a particle of each, and waits.
    assert!((rest[0] - 0.25).abs() < 1e-3, "{rest:?}");
    // Two of one kind by pairs, and a decay of whole particles.
    let pairs = "gaussian fixed { bandwidth 1 m, grid 0.1 m, reactions pairs }";
    let like = one("2 A -> B @ 0.5 m^3/mol/d", "0", pairs);
    assert!((like[0] / 0.2 - 1.0).abs() < 0.1, "{like:?}");
    assert!((like[0] + 2.0 * like[1] - 1.0).abs() < 1e-12, "{like:?}");
    let decay = one("A -> B @ 0.5 /d", "0", pairs);
    assert!((decay[0] / (-2.0_f64).exp() - 1.0).abs() < 0.15, "{decay:?}");
}

/// The same text runs on both kinds of particles, and mixed batches of both end alike.
#[test]
fn one_word_changes_the_kind_of_particle() {
    let mass = last(&run(BATCH));
    let fluid = last(&run(&edited(BATCH, "particles mass A n, B n, C n", "particles fluid n")));
    for (one, other) in mass.iter().zip(&fluid) {
        assert!((one / other - 1.0).abs() < 1e-3, "{mass:?} {fluid:?}");
    }
    let instant = edited(BATCH, "@ k\n", "@ instant\n");
    let instant = edited(&instant, "initial A = c0, B = c0", "initial A = c0, B = 0.4 * c0");
    let mass = last(&run(&instant));
    assert!((mass[0] - 0.6).abs() < 0.01 && mass[1] < 0.01, "{mass:?}");
    assert!((mass[0] - mass[1] - 0.6).abs() < 1e-12, "{mass:?}");
}

const COLUMN: &str = "lamella 1
species A, B, C
reaction r: A + B -> C @ 1 m^3/mol/s
domain line x = 0 m .. 2 m
boundary left inflow A = 1 mol/m^3
boundary right outflow
flow uniform 0.5 m/s
dispersion 0.01 m^2/s
initial B = 1 mol/m^3
particles mass A 1000, B 1000, C 500
kernel gaussian adaptive { grid 0.02 m }
run to 5 s, step 0.02 s
seed 1
output budget A, B, C at t = 5 s
output breakthrough C at right every 0.5 s
output total A, B, C at t = 5 s
";

/// What reactions make leaves as all else does, and is counted where it does.
#[test]
fn what_is_made_may_leave() {
    for text in [COLUMN.to_owned(), edited(COLUMN, "species A, B, C", "species C, B, A")] {
        let finished = run(&text);
        finished.keeps_its_books();
        let product = finished.plan.species.iter().position(|species| species.name == "C").unwrap();
        let of = |place: &str| {
            let output =
                finished.plan.outputs.iter().find(|output| output.kind == OutputKind::Budget).unwrap();
            let is_product =
                |quantity: &lamella::plan::Quantity| *quantity == lamella::plan::Quantity::Species(product);
            let idx = output.quantities.iter().position(is_product).unwrap();
            finished.rows(OutputKind::Budget, idx, Some(place))[0].1.clone()
        };
        let (made, left) = (of("reactions")[1], of("right")[2]);
        assert!(made > 0.05 && left > 0.3 * made, "{made} made, {left} left");
        let through = finished.rows(OutputKind::Breakthrough, 0, None);
        let through = through.last().unwrap().1[2];
        assert!((through / left - 1.0).abs() < 1e-12, "{through} {left}");
    }
}

/// What nothing was known to weigh is made all the same: by a catalyst, of nothing, against the arrow; and traces of a product
/// make no crowd.
#[test]
fn all_that_is_made_is_there() {
    let wide = "gaussian fixed { bandwidth 1 m, grid 0.1 m, reactions masses }";
    let catalysis = one("A -> A + B @ 0.25 /d * A", "0", wide);
    assert!((catalysis[1] - 1.0).abs() < 1e-9, "{catalysis:?}");
    let source = one("-> B @ 0.25 mol/m^3/d", "0", wide);
    assert!((source[1] - 1.0).abs() < 1e-9, "{source:?}");
    let back = one("A -> B @ 1 /d * A - 3 /d * B", "0", wide);
    assert!((back[0] - 0.75).abs() < 2e-3, "{back:?}");
    let text = edited(&edited(ONE, "REACTION", "A -> B @ 0.5 /d * A"), "INITIAL", "1e-9 mol/m^3");
    let finished = run(&edited(&text, "KERNEL", wide));
    let sizes = finished.rows(OutputKind::Kernels, 0, None);
    assert!(sizes.is_empty() || sizes[0].1[5] < 3000.0, "{sizes:?}");
    assert!((last(&finished)[1] / 10.0 - (1.0 - (-2.0_f64).exp())).abs() < 1e-6);
}

/// Rates hang on what is dissolved, `u' = −k (u/R)²`, and mass is kept; pairs and masses agree. First order is of all mass.
#[test]
fn sorbed_mass_waits() {
    let text = edited(
        BATCH,
        "species A, B, C",
        "species A retardation 2\nspecies B retardation 2\nspecies C retardation 3",
    );
    let text = edited(&text, "initial A = c0, B = c0", "initial A = 0.5 * c0, B = 0.5 * c0");
    let masses = last(&run(&text));
    // 1/(1 + k t/4) at 3 s.
    assert!((masses[0] / (1.0 / 1.75) - 1.0).abs() < 2e-3, "{masses:?}");
    assert!((masses[0] + masses[2] - 1.0).abs() < 1e-12, "{masses:?}");
    let pairs = edited(&text, "grid 5 mm }", "grid 5 mm, reactions pairs }");
    let pairs = last(&run(&pairs));
    assert!((pairs[0] / (1.0 / 1.75) - 1.0).abs() < 0.05, "{pairs:?}");
    let first = edited(ONE, "species A, B", "species A retardation 2\nspecies B");
    let first = edited(&edited(&first, "REACTION", "A -> B @ 0.5 /d"), "INITIAL", "0");
    let first =
        run(&edited(&first, "KERNEL", "gaussian fixed { bandwidth 1 m, grid 0.1 m, reactions masses }"));
    assert!((last(&first)[0] / 20.0 / (-2.0_f64).exp() - 1.0).abs() < 1e-6);
}

/// Few heavy particles meet many light ones as often as they should.
#[test]
fn pairs_of_unequal_masses_keep_the_law() {
    let text = edited(PAIRS, "A n, B n, C n", "A 2000, B 50, C 1000");
    let found: Vec<f64> = (1..5).map(|seed| last(&with(&text, &[], seed))[0]).collect();
    let (mean, error) = mean_and_error(&found);
    tell(&format!("unequal: {mean:.4} ± {error:.4}"));
    assert!(error < 0.012 && (mean - 0.25).abs() < 3.0 * error, "{mean} ± {error}");
}

/// P2-d: in heterogeneous flow kernels along it make the best map, and those along axes a better one than one kernel for all.
#[test]
fn kernels_along_the_flow_map_a_plume_best() {
    use lamella::engine::snapshot::Values;
    let scene = include_str!("../experiments/kernels_in_aquifer/kernels_in_aquifer.lam");
    let along = "kernel gaussian adaptive { grid 0.5 m, orient flow }";
    let map = |kernel: &str, n: &str, seed: u64| -> Vec<f64> {
        let finished = with(&edited(scene, along, kernel), &[("n", n)], seed);
        let of = |snapshot: &lamella::engine::snapshot::Snapshot| match &snapshot.values {
            Values::Binned { mean, .. } => Some(mean[0].clone()),
            _ => None,
        };
        finished.snapshots.iter().find_map(of).expect("the scene has a map")
    };
    let truth = map("kernel histogram { grid 1 m }", "600000", 77);
    let size: f64 = truth.iter().map(|c| c * c).sum();
    let error = |kernel: &str| {
        let of = |seed: u64| {
            let found = map(kernel, "10500", seed);
            let off: f64 = found.iter().zip(&truth).map(|(a, b)| (a - b) * (a - b)).sum();
            (off / size).sqrt()
        };
        0.5 * (of(1) + of(2))
    };
    let errors = [
        error(along),
        error("kernel gaussian adaptive { grid 0.5 m }"),
        error("kernel gaussian global { grid 0.5 m }"),
        error("kernel histogram { grid 1 m }"),
    ];
    tell(&format!("along the flow, along axes, one, counted: {errors:.4?}"));
    assert!(errors[0] < 0.92 * errors[1] && errors[1] < 0.92 * errors[2] && errors[0] < 0.75 * errors[3]);
}

/// A line between two concentrations that are held: the density that is shown has their slope up to the sides.
#[test]
fn densities_know_sides_that_are_held() {
    let text = "lamella 1
title \"A line between two concentrations\"
species A
domain line x = 0 m .. 1 m
medium porosity 0.4
dispersion 1e-3 m^2/s
initial A = 1 mol/m^3 * (1 - 0.75 * x / (1 m))
boundary left concentration A = 1 mol/m^3
boundary right concentration A = 0.25 mol/m^3
particles mass 20_000
kernel gaussian adaptive { grid 5 mm }
run to 100 s, step 1 s
output profile A at t = 100 s on 200
reference exact for A = 1 mol/m^3 * (1 - 0.75 * x / (1 m))
measure low = l2(profile.A - exact) / l2(exact) over x = 0 m .. 0.05 m
measure high = l2(profile.A - exact) / l2(exact) over x = 0.95 m .. 1 m
";
    for seed in 1..4 {
        let finished = with(text, &[], seed);
        let [low, high] = ["low", "high"].map(|name| finished.measure(name));
        tell(&format!("held sides: {low:.2e}, {high:.2e}"));
        assert!(low < 0.01 && high < 0.03, "{low} {high}");
    }
}

//! Error bars without a reference, held against the errors that references tell.

use lamella::engine::snapshot::{Outcome, Snapshot, Values};
use lamella::engine::{self, Settings as EngineSettings, Unattended};
use lamella::estimate::{self, ErrorBar, Parts, Trials};
use lamella::measure::{self, ErrorRow};
use lamella::plan::Plan;
use lamella::plan::compile::{Compiled, Options};
use lamella::scenario::Settings;
use lamella::source::Sources;

/// Measured numbers, shown by `cargo test -- --nocapture`.
#[expect(clippy::print_stdout, reason = "tests report what they measured")]
fn tell(report: &str) {
    println!("{report}");
}

/// A scene of the experiments, made small.
struct Scene {
    name: &'static str,
    text: &'static str,
    /// Texts and what stands in their place.
    changes: &'static [(&'static str, &'static str)],
    /// References that are the exact answer to the scene.
    exact: &'static [&'static str],
}

const GRAMLING: &str = include_str!("../experiments/gramling/gramling.lam");
/// What else is known of the column, with the names of its parameters.
const KNOWN: (&str, &str) = (
    "reference limit ",
    "reference gamma for mixing A, B = front_gamma(eta = eta, chi = chi)\n\
     reference sigma for covariance A, B = front_covariance(c0 = c0, D = D, eta = eta, chi = chi)\n\
     reference amount for total AB = front_total(c0 = c0, D = D, eta = eta, chi = chi)\n\
     reference limit ",
);
const IN_COLUMN: &[&str] = &["limit", "gamma", "sigma", "amount"];

const FEWER: (&str, &str) = ("1_000_000", "200_000");

const SCENES: &[Scene] = &[
    Scene {
        name: "gramling",
        text: GRAMLING,
        changes: &[FEWER, ("step 2 s", "step 10 s")],
        exact: IN_COLUMN,
    },
    Scene {
        name: "gramling, coarse step",
        text: GRAMLING,
        changes: &[KNOWN, ("step 2 s", "step 300 s")],
        exact: IN_COLUMN,
    },
    Scene {
        name: "gramling, coarse bins",
        text: GRAMLING,
        changes: &[
            KNOWN,
            FEWER,
            ("step 2 s", "step 10 s"),
            ("average bins 300", "average bins 8"),
            ("1114 s, 1510 s\noutput cov", "1114 s, 1510 s on 300\noutput cov"),
        ],
        exact: IN_COLUMN,
    },
    Scene {
        name: "gramling, few particles",
        text: GRAMLING,
        changes: &[KNOWN, ("1_000_000", "6_000"), ("step 2 s", "step 10 s")],
        exact: IN_COLUMN,
    },
    Scene {
        name: "mixing front",
        text: include_str!("../experiments/mixing_front/mixing_front.lam"),
        changes: &[
            ("= 1e6 ", "= 1e5 "),
            ("30_000 s, step", "5000 s, step"),
            (", 10_000 s, 20_000 s, 30_000 s", ""),
        ],
        exact: &["theory"],
    },
    Scene {
        name: "mixing pulse",
        text: include_str!("../experiments/mixing_pulse/mixing_pulse.lam"),
        changes: &[
            ("= 1e6 ", "= 1e5 "),
            ("30_000 s, step", "5000 s, step"),
            (", 10_000 s, 20_000 s, 30_000 s", ""),
        ],
        exact: &["theory", "spread"],
    },
    Scene {
        name: "multirate",
        text: include_str!("../experiments/multirate/multirate.lam"),
        changes: &[
            ("= 1e6 ", "= 1e5 "),
            ("30_000 s, step", "5000 s, step"),
            (", 10_000 s, 20_000 s, 30_000 s", ""),
        ],
        exact: &["theory", "sigma"],
    },
    Scene {
        name: "numerical dispersion",
        text: include_str!("../experiments/numerical_dispersion/numerical_dispersion.lam"),
        changes: &[("2_000_000", "200_000")],
        exact: &["physical"],
    },
    Scene {
        name: "pulse, two axes",
        text: include_str!("../experiments/shear_free_pulse_2d/shear_free_pulse_2d.lam"),
        changes: &[("2_000_000", "200_000")],
        exact: &["exact"],
    },
    Scene {
        name: "pulse, three axes",
        text: include_str!("../experiments/shear_free_pulse_3d/shear_free_pulse_3d.lam"),
        changes: &[("4_000_000", "400_000")],
        exact: &["exact"],
    },
    Scene {
        name: "well mixed",
        text: include_str!("../experiments/limits/well_mixed.lam"),
        changes: &[("1_000_000", "100_000"), ("step 2 s", "step 10 s")],
        exact: &["mixed", "whole"],
    },
    Scene {
        name: "unmixed",
        text: include_str!("../experiments/limits/unmixed.lam"),
        changes: &[("200_000", "100_000"), ("step 2 s", "step 10 s")],
        exact: &["front", "nothing", "never"],
    },
];

impl Scene {
    fn compile(&self, seed: Option<u64>) -> Compiled {
        let mut text = self.text.to_owned();
        for (old, new) in self.changes {
            assert!(text.contains(old), "{}: no `{old}`", self.name);
            text = text.replace(old, new);
        }
        let settings = Settings { seed, ..Settings::default() };
        let checked = lamella::check(Sources::single("scene.lam", text), &settings, &Options::default());
        checked.compiled.unwrap_or_else(|| panic!("{}: no plan: {:#?}", self.name, checked.diagnostics))
    }
}

fn run(plan: &Plan, takes_half_draws: bool) -> (Vec<Snapshot>, Outcome) {
    let settings = EngineSettings { takes_half_draws, ..EngineSettings::default() };
    let mut snapshots = Vec::new();
    let outcome = engine::run(plan, &settings, &Unattended, &mut |snapshot| {
        snapshots.push(snapshot);
        Ok(())
    })
    .expect("the plan runs");
    (snapshots, outcome)
}

/// The error bar and the true error of each quantity that has an exact reference, over all times.
struct Compared {
    bar: ErrorBar,
    row: ErrorRow,
}

impl Compared {
    /// The bar divided by the true error. What is right to rounding on both sides is met.
    fn ratio(&self) -> f64 {
        let rounding = 1e-12 * self.bar.size;
        let (expected, found) = (self.bar.parts.total, self.row.l2);
        if expected <= rounding && found <= rounding { 1.0 } else { expected / found }
    }

    fn is_met(&self) -> bool {
        (0.5..=2.0).contains(&self.ratio())
    }

    fn tell(&self, scene: &Scene) {
        let Parts { total, step, particles, bins, .. } = self.bar.parts;
        tell(&format!(
            "{:24} {:9} {:10} ratio {:4.2}  true {:.2e}  bar {total:.2e}: step {step:.1e} particles {particles:.1e} bins {:.1e}",
            scene.name,
            self.row.reference,
            self.row.kind.word(),
            self.ratio(),
            self.row.l2,
            bins.unwrap_or(f64::NAN),
        ));
    }
}

fn compare(scene: &Scene, seed: Option<u64>) -> Vec<Compared> {
    let compiled = scene.compile(seed);
    let plan = &compiled.plan;
    let (snapshots, outcome) = run(plan, false);
    let trials = Trials::of(plan);
    assert!(trials.cost(plan) <= 4.0, "{}: {} times the run", scene.name, trials.cost(plan));
    let of_trials: Vec<Vec<Snapshot>> =
        trials.trials.iter().map(|trial| run(&trial.plan, trial.takes_half_draws).0).collect();
    let bars = estimate::bars(plan, &trials, &snapshots, &of_trials).expect("the trials fit");
    let evaluated = measure::evaluate(plan, &compiled.evaluation, &snapshots, &outcome).expect("references");
    let is_wanted = |row: &ErrorRow| row.t.is_none() && scene.exact.contains(&&*row.reference);
    let bar_of = |row: &ErrorRow| {
        let is_same = |bar: &&ErrorBar| {
            bar.output_idx == row.output_idx && bar.t == row.t && bar.quantity == row.quantity
        };
        bars.iter().find(is_same).unwrap_or_else(|| panic!("{}: no bar for {row:?}", scene.name)).clone()
    };
    let rows = evaluated.errors.into_iter().filter(is_wanted);
    rows.map(|row| Compared { bar: bar_of(&row), row }).collect()
}

/// The bar of the first exact reference of each scene, and the bars of all, against the true errors. An
/// error of one number is one draw of its law: it lies beyond a factor of two of its expected size in
/// four of ten cases, however good that is; so rows of a few correlated numbers are counted, not each
/// asserted. Any other seeds: LAMELLA_SOAK=1.
#[test]
fn error_bars_meet_the_true_errors_within_a_factor_of_two() {
    let is_soak = std::env::var_os("LAMELLA_SOAK").is_some();
    let seeds = if is_soak { vec![None, Some(1), Some(2), Some(3), Some(4), Some(5)] } else { vec![None] };
    for seed in seeds {
        let (mut n_scenes, mut n_rows, mut n_all) = (0, 0, 0);
        for scene in SCENES {
            let compared = compare(scene, seed);
            compared.iter().for_each(|compared| compared.tell(scene));
            let is_first = |compared: &&Compared| compared.row.reference == scene.exact[0];
            n_scenes += usize::from(compared.iter().find(is_first).is_some_and(Compared::is_met));
            n_rows += compared.iter().filter(|compared| compared.is_met()).count();
            n_all += compared.len();
        }
        tell(&format!("met: {n_scenes} of {} scenes, {n_rows} of {n_all} outputs", SCENES.len()));
        assert!(10 * n_scenes >= 9 * SCENES.len(), "{n_scenes} of {} scenes", SCENES.len());
        assert!(5 * n_rows >= 4 * n_all, "{n_rows} of {n_all} outputs");
    }
}

/// Where one source rules, it is the one that is named.
#[test]
fn the_largest_source_is_the_one_that_was_made_large() {
    let sources = |name: &str, reference: &str| {
        let scene = SCENES.iter().find(|scene| scene.name == name).expect("a scene of that name");
        let compared = compare(scene, None);
        let of = compared.iter().find(|compared| compared.row.reference == reference).expect("the reference");
        let Parts { step, particles, bins, .. } = of.bar.parts;
        (step, particles, bins.expect("bins were halved"))
    };
    let (step, particles, bins) = sources("gramling, coarse step", "gamma");
    assert!(step > 10.0 * particles.max(bins), "step {step}, particles {particles}, bins {bins}");
    let (step, particles, bins) = sources("gramling, coarse bins", "limit");
    assert!(bins > 4.0 * particles.max(step), "step {step}, particles {particles}, bins {bins}");
    let (step, particles, bins) = sources("gramling, few particles", "limit");
    assert!(particles > 4.0 * step.max(bins), "step {step}, particles {particles}, bins {bins}");
}

/// A run that takes the draws of half steps and a run of half the step walk on the same paths: the same
/// particles in every bin, on steps (100 s) and in the first and second half of one (31 s, 77 s), but for
/// those that rounding moves over an edge.
#[test]
fn half_draws_follow_the_paths_of_half_steps() {
    let text = "lamella 1\nspecies A\ndomain rect x = 0 m .. 1 m, y = 0 m .. 2 m\n\
        boundary left, right, bottom, top periodic\ndispersion (1e-4 m^2/s, 2e-4 m^2/s)\n\
        initial A = if x < 0.5 m and y < 1 m then 1 mol/L else 0 mol/L\n\
        particles fluid 20_000 stratified\nseed 3\nrun to 100 s, step 20 s\n\
        output map A at t = 31 s, 77 s, 100 s on 20 x 20\n";
    let plan = |text: &str| {
        let checked =
            lamella::check(Sources::single("a.lam", text), &Settings::default(), &Options::default());
        checked.compiled.unwrap_or_else(|| panic!("{:#?}", checked.diagnostics)).plan
    };
    let whole = plan(text);
    let half = plan(&text.replace("step 20 s", "step 10 s"));
    let n_elsewhere = |a: &[Snapshot], b: &[Snapshot]| -> Vec<u64> {
        let counts = |snapshot: &Snapshot| match &snapshot.values {
            Values::Binned { n_particles, .. } => n_particles.clone(),
            _ => panic!("a map is binned"),
        };
        let differing = |(a, b): (&Snapshot, &Snapshot)| {
            counts(a).iter().zip(counts(b)).map(|(a, b)| a.abs_diff(b)).sum::<u64>()
        };
        a.iter().zip(b).map(differing).collect()
    };
    let fine = run(&half, false).0;
    let coupled = n_elsewhere(&run(&whole, true).0, &fine);
    let apart = n_elsewhere(&run(&whole, false).0, &fine);
    assert_eq!(coupled.len(), 3);
    for (coupled, apart) in coupled.iter().zip(&apart) {
        assert!(*coupled <= 4 && *apart > 1000, "{coupled} particles elsewhere; uncoupled {apart}");
    }
}

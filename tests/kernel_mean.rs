//! Zones that exchange with means over the parcels around: books, bounds, closed forms, and sums that are written out.

#[path = "support/scene.rs"]
mod scene;

use lamella::engine::snapshot::Values;
use lamella::engine::{Settings as EngineSettings, Unattended};
use lamella::scenario::Settings;
use scene::{Finished, edited, run, run_with, tell};

const FRONT: &str = include_str!("../experiments/kernel_mean/front.lam");

fn with(text: &str, set: &[(&str, &str)]) -> Finished {
    let set = set.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
    run_with(text, &Settings { set, ..Settings::default() })
}

/// Values of the first species on the particles of an output, in the order of their places along the first axis.
fn parcels(finished: &Finished, idx: usize) -> Vec<(f64, f64)> {
    let Values::Particles { positions, concentrations } = &finished.snapshots[idx].values else {
        panic!("no particles")
    };
    let mut all: Vec<(f64, f64)> =
        positions[0].iter().copied().zip(concentrations[0].iter().copied()).collect();
    all.sort_by(|a, b| a.0.total_cmp(&b.0));
    all
}

/// Parcels in a row that rest, with one species.
const ROW: &str = "lamella 1
species A
domain line x = 0 m .. 1 m
boundary left, right reflect
mixing zones { all: fraction 1, rate RATE }
average kernel gaussian, bandwidth 0.02 m, cutoff 8
initial A = INITIAL
particles fluid 500 ordered
run to TIME, step TIME/4
output particles A at t = TIME
output total A at t = TIME
";

fn row(rate: &str, initial: &str, time: &str) -> String {
    ROW.replace("RATE", rate).replace("INITIAL", initial).replace("TIME", time)
}

/// What is always at the mean of a step is the step, smoothed by the kernel.
#[test]
fn an_instant_zone_is_the_smoothed_value() {
    let text = row("instant", "if x < 0.5 m then 2 mol/m^3 else 0", "4 s");
    let finished = run(&text);
    finished.keeps_its_books();
    let all = parcels(&finished, 0);
    let mut worst: f64 = 0.0;
    for (x, value) in all {
        let exact = libm::erfc((x - 0.5) / (2.0_f64.sqrt() * 0.02));
        worst = worst.max((value - exact).abs());
    }
    tell(&format!("a smoothed step: off by {worst:e}"));
    // The sum over parcels on either side of a jump is a midpoint rule: s²/24 times the largest slope of the kernel.
    let (s, h) = (1.0 / 500.0, 0.02);
    let slope = (-0.5_f64).exp() / (h * h * (2.0 * std::f64::consts::PI).sqrt());
    assert!(worst < 1.01 * 2.0 * s * s / 24.0 * slope, "{worst}");
}

/// A cosine decays by `exp(−(χt/2)(1 − e^{−k²h²/2}))`: the exponential of the sums, for any step.
#[test]
fn a_mode_decays_as_its_eigenvalue_says() {
    for (rate, time) in [("0.02 /s", "8 s"), ("0.001 /s", "800 s")] {
        let finished = run(&row(rate, "1 mol/m^3 + 0.5 mol/m^3 * cos(3*pi*x/(1 m))", time));
        finished.keeps_its_books();
        let (rate, time): (f64, f64) = if rate == "0.02 /s" { (0.02, 8.0) } else { (0.001, 800.0) };
        let k = 3.0 * std::f64::consts::PI;
        let left = (-(0.5 * rate * time) * (1.0 - (-0.5 * (k * 0.02) * (k * 0.02)).exp())).exp();
        let mut worst: f64 = 0.0;
        for (x, value) in parcels(&finished, 0) {
            worst = worst.max((value - 1.0 - 0.5 * left * (k * x).cos()).abs());
        }
        tell(&format!("a mode after {time} s: off by {worst:e}"));
        assert!(worst < 1e-11, "{worst}");
    }
}

/// Parcels at random in a plane, with a flow, walls and a reaction.
const PLANE: &str = "lamella 1
species A, B
species C
reaction meeting: A + B -> C @ 4e-3 m^3/mol/s * A * B
domain rect x = 0 m .. 2 m, y = 0 m .. 1 m
boundary left, right periodic
boundary bottom, top reflect
flow uniform (1e-3 m/s, 0 m/s)
dispersion 1e-4 m^2/s
mixing zones { fast: fraction 0.3, rate instant; slow: fraction 0.5, rate 5e-3 /s; still: fraction 0.2, rate 0 /s }
average kernel KERNEL
initial A = if x < 1 m then 1 mol/m^3 else 0, B = if x < 1 m then 0 else 1 mol/m^3
particles fluid 1500 random
run to 200 s, step 20 s
output particles A, B, C at t = 200 s
output total A, B, C every 50 s
output map A, C at t = 110 s on 8 x 4
";

const KERNELS: [&str; 4] = [
    "gaussian, bandwidth 0.08 m",
    "wendland_c2, bandwidth 0.2 m, normalise sinkhorn",
    "cubic_spline, bandwidth 5 * spacing, normalise geometric",
    "gaussian, bandwidth 0.3 m, cutoff 4, bins 8 x 4",
];

/// What A and C have together is what A had; nothing is beyond what there was.
#[test]
fn amounts_are_kept_with_reactions() {
    for kernel in KERNELS {
        let finished = run(&edited(PLANE, "KERNEL", kernel));
        finished.keeps_its_books();
        let at = |snapshot: &&lamella::engine::snapshot::Snapshot| {
            matches!(snapshot.values, Values::Particles { .. })
        };
        let Some(Values::Particles { concentrations, .. }) =
            finished.snapshots.iter().find(at).map(|snapshot| &snapshot.values)
        else {
            panic!("no particles")
        };
        let [a, b, c] = [0, 1, 2].map(|species| concentrations[species].iter().sum::<f64>());
        let n = concentrations[0].len() as f64;
        tell(&format!("{kernel}: {a} of A, {b} of B, {c} of C"));
        assert!((a + b + 2.0 * c - n).abs() < 1e-10 * n && c > 0.01 * n);
        assert!(concentrations.iter().flatten().all(|value| (-1e-9..=1.0 + 1e-9).contains(value)));
    }
}

/// Any number of threads, narrow code, and a plan without passes: the same bits.
#[test]
fn threads_and_lanes_change_no_bit() {
    for kernel in [KERNELS[0], KERNELS[1]] {
        let plan = run(&edited(PLANE, "KERNEL", kernel)).plan;
        let of = |threads: usize, is_narrow: bool| {
            let settings = EngineSettings { threads: Some(threads), is_narrow, ..EngineSettings::default() };
            let mut all = Vec::new();
            lamella::engine::run(&plan, &settings, &Unattended, &mut |snapshot| {
                all.push(format!("{:?}", snapshot.values));
                Ok(())
            })
            .unwrap();
            all
        };
        let one = of(1, false);
        assert!(one.len() > 4);
        assert_eq!(one, of(2, false));
        assert_eq!(one, of(7, false));
        assert_eq!(one, of(2, true));
    }
}

/// Without motion, dispersion and zones at a rate, parcels see their means from the first instant on, between steps as well.
#[test]
fn a_look_between_steps_sees_the_means() {
    let text = row("instant", "if x < 0.5 m then 2 mol/m^3 else 0", "4 s");
    let text = edited(&text, "output particles A at t = 4 s", "output particles A at t = 0 s, 1.3 s, 4 s");
    let finished = run(&text);
    let first = parcels(&finished, 0);
    let smoothed = first.iter().filter(|(_, value)| *value > 0.1 && *value < 1.9).count();
    assert!(smoothed > 15, "{smoothed}");
    let others: Vec<usize> = (1..finished.snapshots.len())
        .filter(|&idx| matches!(finished.snapshots[idx].values, Values::Particles { .. }))
        .collect();
    assert_eq!(others.len(), 2);
    for idx in others {
        assert_eq!(parcels(&finished, idx), first);
    }
}

/// The limit of infinitely many parcels, and no difference between kernels and bins as noisy as they are.
#[test]
fn the_front_goes_to_its_limit() {
    let finished = with(FRONT, &[("n", "3000"), ("dt", "20 s")]);
    assert!(finished.measure("leak") < 1e-13);
    let (err, blur) = (finished.measure("err"), finished.measure("blur"));
    let bins = edited(FRONT, "average kernel gaussian, bandwidth h", "average bins 23");
    let of_bins = with(&bins, &[("n", "3000"), ("dt", "20 s")]);
    tell(&format!(
        "kernels: {err}, {blur}; bins as noisy: {}, {}",
        of_bins.measure("err"),
        of_bins.measure("blur")
    ));
    assert!(err < 0.12 && blur < 0.15, "{err} {blur}");
    assert!(of_bins.measure("err") < 0.12);
}

/// What a run tells of its noise is the scatter over seeds; on bins narrower than the kernel, whose parcels all see the same mean,
/// it is on the safe side.
#[test]
fn standard_errors_are_no_smaller_than_the_scatter() {
    const SCENE: &str = "lamella 1
species A
domain line x = 0 m .. 2 m
boundary left, right reflect
dispersion 1e-4 m^2/s
mixing zones { a: fraction 1, rate instant }
average kernel gaussian, bandwidth 0.1 m
initial A = if x < 1 m then 1 mol/m^3 else 0
particles fluid 1000 random
run to 200 s, step 20 s
output profile A at t = 200 s on BINS
";
    for (bins, middle, range) in [("40", 15..25, 1.0..4.0), ("10", 4..6, 0.7..1.6)] {
        let (mut all, mut told) = (Vec::new(), 0.0);
        const N: u64 = 24;
        for seed in 1..=N {
            let settings = Settings { seed: Some(seed), ..Settings::default() };
            let finished = run_with(&edited(SCENE, "BINS", bins), &settings);
            let Values::Binned { mean, standard_error, .. } = &finished.snapshots[0].values else {
                panic!("no profile")
            };
            all.push(mean[0][middle.clone()].to_vec());
            told += standard_error[0][middle.clone()].iter().map(|own| own * own).sum::<f64>() / N as f64;
        }
        let mut found = 0.0;
        for bin in 0..middle.len() {
            let mean = all.iter().map(|own| own[bin]).sum::<f64>() / N as f64;
            found += all.iter().map(|own| (own[bin] - mean).powi(2)).sum::<f64>() / (N - 1) as f64;
        }
        let ratio = (told / found).sqrt();
        tell(&format!("{bins} bins: told over found {ratio}"));
        assert!(range.contains(&ratio), "{bins}: {ratio}");
    }
}

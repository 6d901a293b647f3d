//! Masses that react at rates of first order, held to closed forms and to the moments of methods, section 1.7.
//!
//! Bounds are sampling errors of the particles that a number comes from: 4.5 standard deviations, of a share
//! √(p(1 − p)/N), of a mean √(s²/n), of a variance √((κ − 1)/n) s² with the kurtosis κ of 6 that mixtures of
//! states do not exceed here.

use lamella::engine::snapshot::{Outcome, Snapshot, Values};
use lamella::engine::{Settings as EngineSettings, Unattended};
use lamella::plan::OutputKind;
use lamella::plan::compile::{Compiled, Options};
use lamella::scenario::Settings;
use lamella::source::Sources;
use nalgebra::{DMatrix, DVector};

struct Finished {
    compiled: Compiled,
    snapshots: Vec<Snapshot>,
    outcome: Outcome,
}

fn compile(text: &str) -> Compiled {
    let checked =
        lamella::check(Sources::single("scene.lam", text), &Settings::default(), &Options::default());
    checked.compiled.unwrap_or_else(|| panic!("no plan: {:#?}", checked.diagnostics))
}

fn run_on(text: &str, threads: Option<usize>) -> Finished {
    let compiled = compile(text);
    let mut snapshots = Vec::new();
    let settings = EngineSettings { threads, ..EngineSettings::default() };
    let outcome = lamella::engine::run(&compiled.plan, &settings, &Unattended, &mut |snapshot| {
        snapshots.push(snapshot);
        Ok(())
    })
    .expect("the scene runs");
    let worst = outcome.mass_defect.iter().fold(0.0, |worst: f64, defect| worst.max(*defect));
    assert!(worst < 1e-12, "books are off by {worst:e}");
    Finished { compiled, snapshots, outcome }
}

fn run(text: &str) -> Finished {
    run_on(text, None)
}

impl Finished {
    /// Numbers of the only row of a species in the last snapshot of a kind.
    fn last(&self, kind: OutputKind, species: usize) -> Vec<f64> {
        let is_of = |snapshot: &&Snapshot| self.compiled.plan.outputs[snapshot.output_idx].kind == kind;
        let snapshot = self.snapshots.iter().rev().find(is_of).expect("an output of that kind");
        let Values::Rows(rows) = &snapshot.values else { panic!("no rows") };
        rows[species][0].numbers.clone()
    }
}

/// First-order reactions of species that move at their own pace.
struct Network {
    /// `dc/dt = M c`, 1/s.
    rates: DMatrix<f64>,
    /// v/R, m/s, and D/R, m²/s.
    speed: Vec<f64>,
    spread: Vec<f64>,
}

/// Amount, mean and variance of each species from one unit of the first.
///
/// - Equation: `G = exp(t [[M, V, D], [0, M, V], [0, 0, M]])`, `p = G₁₁`, `mean = G₁₂/p`, `var = 2 G₁₃/p − mean²`.
/// - Source: methods, equation 1.7.
fn moments(network: &Network, t: f64) -> Vec<[f64; 3]> {
    let n = network.rates.nrows();
    let mut block = DMatrix::zeros(3 * n, 3 * n);
    let speed = DMatrix::from_diagonal(&DVector::from_vec(network.speed.clone()));
    let spread = DMatrix::from_diagonal(&DVector::from_vec(network.spread.clone()));
    for k in 0..3 {
        block.view_mut((k * n, k * n), (n, n)).copy_from(&network.rates);
    }
    for k in 0..2 {
        block.view_mut((k * n, (k + 1) * n), (n, n)).copy_from(&speed);
    }
    block.view_mut((0, 2 * n), (n, n)).copy_from(&spread);
    let g = exponential(block * t);
    (0..n)
        .map(|to| {
            let p = g[(to, 0)];
            let mean = g[(to, n)] / p;
            [p, mean, 2.0 * g[(to, 2 * n)] / p - mean * mean]
        })
        .collect()
}

/// `e^A` by its series after scaling, squared back: to 1e-12 for the sizes here.
fn exponential(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let n = matrix.nrows();
    let halvings = 12 + matrix.norm().log2().ceil().max(0.0) as i32;
    let small = matrix / 2.0_f64.powi(halvings);
    let mut term = DMatrix::identity(n, n);
    let mut sum = DMatrix::identity(n, n);
    for k in 1..12 {
        term = &term * &small / f64::from(k);
        sum += &term;
    }
    (0..halvings).fold(sum, |power, _| &power * &power)
}

/// Holds the moments of a run that began with one unit of the first species at 0. `weights` are the masses of
/// particles, in those of the first species.
fn hold(finished: &Finished, network: &Network, t: f64, n_particles: f64, weights: &[f64], case: &str) {
    for (species, [p, mean, variance]) in moments(network, t).into_iter().enumerate() {
        let found = finished.last(OutputKind::Moments, species);
        let share = p / weights[species];
        let n = n_particles * share;
        let bound = 4.5 * weights[species] * (share * (1.0 - share).max(0.0) / n_particles).sqrt() + 1e-12;
        assert!((found[0] - p).abs() < bound, "{case}, species {species}: amount {} {p}", found[0]);
        if n < 1000.0 {
            continue;
        }
        let bound = 4.5 * (variance / n).sqrt();
        assert!((found[1] - mean).abs() < bound, "{case}, species {species}: mean {} {mean}", found[1]);
        let bound = 4.5 * (5.0 / n).sqrt() * variance;
        assert!(
            (found[4] - variance).abs() < bound,
            "{case}, species {species}: variance {} {variance}",
            found[4]
        );
    }
}

/// The chain A → B → C of methods 1.7 with its species' retardations.
fn chain(species: &str, n: u64, duration: f64, step: &str) -> String {
    format!(
        "lamella 1
species {species}
reaction first:  A -> B @ 0.6 /s
reaction second: B -> C @ 0.3 /s
domain line x = -100 m .. 100 m
boundary left, right open
flow uniform 1 m/s
dispersion 0.1 m^2/s
source pulse: A = 1 mol/m^2 at point(0 m)
particles mass {n}
run to {duration} s, step {step}
output moments A, B, C at t = {duration} s
"
    )
}

fn chain_rates() -> DMatrix<f64> {
    DMatrix::from_row_slice(3, 3, &[-0.6, 0.0, 0.0, 0.6, -0.3, 0.0, 0.0, 0.3, 0.0])
}

/// Reference: methods, section 1.7, whose numbers are printed with five digits.
#[test]
fn a_chain_with_retardation_has_the_moments_of_its_law_at_any_step() {
    let network =
        Network { rates: chain_rates(), speed: vec![1.0, 0.5, 0.25], spread: vec![0.1, 0.05, 0.025] };
    let printed = [[0.30119, 2.0, 0.4], [0.49523, 1.45030, 0.37191], [0.20357, 1.09310, 0.30928]];
    for (exact, printed) in moments(&network, 2.0).iter().zip(printed) {
        assert!(exact.iter().zip(printed).all(|(a, b)| (a - b).abs() < 1e-5), "{exact:?} {printed:?}");
    }
    for step in ["2 s", "0.1 s"] {
        let text = chain("A, B retardation 2.0, C retardation 4.0", 400_000, 2.0, step);
        let finished = run(&text);
        assert!(finished.outcome.n_particles >= 400_000);
        hold(&finished, &network, 2.0, 400_000.0, &[1.0; 3], step);
    }
    for step in ["10 s", "0.5 s", "auto(courant <= 0.01, dispersion <= 0.01)"] {
        let text = chain("A, B retardation 2.0, C retardation 4.0", 100_000, 10.0, step);
        hold(&run(&text), &network, 10.0, 100_000.0, &[1.0; 3], step);
    }
}

/// One unit of A exchanges with what does not move, or with what spreads otherwise, at k Δt from 0.25
/// to 40. References: equation 1.7 with `1/R = 0`, and with diffusion of each species' own.
#[test]
fn exchange_has_the_moments_of_its_law_at_any_step() {
    let scene = |species: &str, step: &str| {
        format!(
            "lamella 1
species {species}
reaction exchange: A <-> S @ forward 2 /s, backward 1 /s
domain line x = -200 m .. 200 m
boundary left, right open
flow uniform 1 m/s
dispersion longitudinal 0.05 m, transverse 0 m, molecular 0.05 m^2/s
source pulse: A = 1 mol/m^2 at point(0 m)
particles mass 50_000
run to 20 s, step {step}
output moments A, S at t = 20 s
"
        )
    };
    let rates = DMatrix::from_row_slice(2, 2, &[-2.0, 1.0, 2.0, -1.0]);
    let cases: [(&str, [f64; 2], [f64; 2]); 4] = [
        ("A, S immobile", [1.0, 0.0], [0.1, 0.0]),
        ("A retardation 2.0, S retardation 5.0", [0.5, 0.2], [0.05, 0.02]),
        ("A diffusion 0.5 m^2/s, S", [1.0, 1.0], [0.55, 0.1]),
        ("A diffusion 0.5 m^2/s, S retardation 4.0, diffusion 1.0 m^2/s", [1.0, 0.25], [0.55, 0.2625]),
    ];
    for (species, speed, spread) in cases {
        let network = Network { rates: rates.clone(), speed: speed.to_vec(), spread: spread.to_vec() };
        for step in ["0.25 s", "20 s", "auto(courant <= 0.05, dispersion <= 0.05)"] {
            let finished = run(&scene(species, step));
            hold(&finished, &network, 20.0, 50_000.0, &[1.0; 2], &format!("{species}, {step}"));
        }
    }
}

/// Exchange that is as good as in equilibrium: thousands of turns to and fro in a step, of which some end elsewhere.
/// Reference: equation 1.7.
#[test]
fn fast_exchange_has_the_moments_of_its_law() {
    let scene = |step: &str| {
        format!(
            "lamella 1
species A, S immobile, B retardation 2.0
reaction exchange: A <-> S @ forward 1000 /s, backward 500 /s
reaction leak:     A -> B @ 0.2 /s
reaction fade:     S ->   @ 0.05 /s
domain line x = -200 m .. 200 m
boundary left, right open
flow uniform 1 m/s
dispersion 0.1 m^2/s
source pulse: A = 1 mol/m^2 at point(0 m)
particles mass 50_000
run to 10 s, step {step}
output moments A, S, B at t = 10 s
output breakthrough A, S, B at x = 2 m every 10 s
"
        )
    };
    let rates = DMatrix::from_row_slice(3, 3, &[-1000.2, 500.0, 0.0, 1000.0, -500.05, 0.0, 0.2, 0.0, 0.0]);
    let network = Network { rates, speed: vec![1.0, 0.0, 0.5], spread: vec![0.1, 0.0, 0.05] };
    for step in ["10 s", "0.5 s", "auto(courant <= 0.02, dispersion <= 0.02)"] {
        let finished = run(&scene(step));
        hold(&finished, &network, 10.0, 50_000.0, &[1.0; 3], step);
        // What rests passes no plane.
        assert_eq!(finished.last(OutputKind::Breakthrough, 1)[3], 0.0);
        assert!(finished.last(OutputKind::Breakthrough, 0)[3] > 5_000.0);
    }
}

/// Half-lives of a batch (Bateman): amounts in time, and what each reaction took and made.
#[test]
fn a_batch_decays_by_the_equations_of_bateman() {
    let (k1, k2) = (0.3_f64, 0.1_f64);
    let text = "lamella 1
species A, B, C
reaction a: A -> B @ 0.3 /d
reaction b: B -> C @ 0.1 /d
domain line x = 0 m .. 1 m
boundary left, right reflect
initial A = 2 mol/m^3
particles mass 200_000
run to 12 d, step 3 d
output budget A, B, C at t = 12 d
";
    let finished = run(text);
    let t = 12.0;
    let a = 2.0 * (-k1 * t).exp();
    let b = 2.0 * k1 / (k2 - k1) * ((-k1 * t).exp() - (-k2 * t).exp());
    let snapshot = finished.snapshots.last().expect("a budget");
    let places = finished.compiled.plan.places(&finished.compiled.plan.outputs[0]);
    let Values::Rows(rows) = &snapshot.values else { panic!("no rows") };
    let row = |species: usize, name: &str| {
        let place = places.iter().position(|place| place == name).expect("a row of that name");
        let found = rows[species].iter().find(|row| usize::from(row.place) == place).expect("that row");
        found.numbers.clone()
    };
    // 2 mol/m² in 200 000 particles: shares are known to 4.5 √(p(1 − p)/N), 0.5 % at most.
    for (species, exact) in [a, b, 2.0 - a - b].into_iter().enumerate() {
        let found = row(species, "inside")[0];
        assert!((found - exact).abs() < 2.0 * 4.5 * (0.25_f64 / 200_000.0).sqrt(), "{found} {exact}");
        assert!(row(species, "defect")[0].abs() < 1e-12);
    }
    let (taken, made) = (row(0, "a")[2], row(1, "a")[1]);
    assert!((taken - made).abs() < 1e-12 && (2.0 - taken - row(0, "inside")[0]).abs() < 1e-12);
    assert!((row(1, "b")[2] - row(2, "inside")[0]).abs() < 1e-12);
    assert_eq!((row(0, "a")[1], row(2, "a")[1]), (0.0, 0.0));
}

/// `A -> 0.7 B + 0.3 C`, a reaction beside it that makes two of one, and one in which half is lost.
#[test]
fn yields_are_kept() {
    let text = "lamella 1
species A, B, C, E
reaction split:  A -> 0.7 B + 0.3 C @ 0.5 /s
reaction double: A -> 2 E           @ 0.2 /s
reaction fade:   C -> 0.5 E         @ 0.4 /s
reaction loss:   B ->               @ 0.1 /s * B
domain line x = -50 m .. 50 m
boundary left, right open
flow uniform 1 m/s
dispersion 0.1 m^2/s
source pulse: A = 1 mol/m^2 at point(0 m)
particles mass 200_000
run to 3 s, step 1 s
output moments A, B, C, E at t = 3 s
";
    let rates = DMatrix::from_row_slice(
        4,
        4,
        &[-0.7, 0.0, 0.0, 0.0, 0.35, -0.1, 0.0, 0.0, 0.15, 0.0, -0.4, 0.0, 0.4, 0.0, 0.2, 0.0],
    );
    let network = Network { rates, speed: vec![1.0; 4], spread: vec![0.1; 4] };
    // A particle of E weighs as much as two of A, so that `double` makes one of one.
    hold(&run(text), &network, 3.0, 200_000.0, &[1.0, 1.0, 1.0, 2.0], "yields");
    // One reaction that makes less than it takes loses no particle.
    let less = text.replace("A -> 2 E ", "A -> 0.25 E ").replace("C -> 0.5 E", "C -> 0.25 E");
    let rates = DMatrix::from_row_slice(
        4,
        4,
        &[-0.7, 0.0, 0.0, 0.0, 0.35, -0.1, 0.0, 0.0, 0.15, 0.0, -0.4, 0.0, 0.05, 0.0, 0.1, 0.0],
    );
    let network = Network { rates, ..network };
    hold(&run(&less), &network, 3.0, 200_000.0, &[1.0, 1.0, 1.0, 0.25], "less");
}

/// Threads, and what else is looked at, change no byte.
#[test]
fn threads_change_nothing() {
    let text = chain("A, B retardation 2.0, C immobile", 60_000, 4.0, "0.5 s")
        .replace("B -> C @ 0.3 /s", "B <-> C @ forward 0.9 /s, backward 0.3 /s")
        + "output particles A, B, C at t = 4 s
output breakthrough A, B, C at x = 1 m every 0.5 s
";
    let (one, two) = (run_on(&text, Some(1)), run_on(&text, Some(2)));
    assert_eq!(one.snapshots.len(), two.snapshots.len());
    // Not a number is not equal to itself: by their text.
    for (a, b) in one.snapshots.iter().zip(&two.snapshots) {
        assert_eq!(format!("{:?}", a.values), format!("{:?}", b.values));
    }
}

/// Masses of a plane's passages by species are those that the books know to be beyond it.
#[test]
fn planes_see_what_particles_are_when_they_pass() {
    // Without dispersion A passes 1 m after 1 s, as what it has become by then: P(A) = e^{−0.6}.
    let text = chain("A, B, C", 200_000, 3.0, "3 s")
        .replace("dispersion 0.1 m^2/s\n", "")
        .replace("output moments A, B, C at t = 3 s", "output breakthrough A, B, C at x = 1 m every 3 s");
    let finished = run(&text);
    let network = Network { rates: chain_rates(), speed: vec![1.0; 3], spread: vec![0.0; 3] };
    let exact = exponential(network.rates * 1.0);
    for species in 0..3 {
        let p = exact[(species, 0)];
        let found = finished.last(OutputKind::Breakthrough, species);
        let bound = 4.5 * (p * (1.0 - p) / 200_000.0).sqrt();
        assert!((found[2] - p).abs() < bound, "species {species}: {} {p}", found[2]);
    }
}

/// The same lines of chemistry on particles of fluid and on particles that carry mass.
/// Reference: `exp(t M)` of all that there is, which transport does not change.
#[test]
fn the_same_chemistry_runs_on_both_kinds_of_particles() {
    let scene = |kind: &str| {
        format!(
            "lamella 1
species A, B, C, E
param k = 0.2 /d
reaction chain: A -> B @ k
reaction split: B -> 0.7 C + 0.3 E @ 0.3 /d * B
reaction both:  C <-> E @ forward 0.5 /d, backward k
reaction loss:  E -> @ 0.1 /d
domain line x = 0 m .. 40 m
boundary left, right open
initial A = 1 mol/m^3 * exp(-(x - 12 m)^2 / (2 m^2))
flow uniform 1 m/d
dispersion 0.1 m^2/d
particles {kind} 200_000
run to 6 d, step 2 d
output total A, B, C, E at t = 2 d, 6 d
output profile A, B, C, E at t = 6 d on 40
"
        )
    };
    let rates = DMatrix::from_row_slice(
        4,
        4,
        &[-0.2, 0.0, 0.0, 0.0, 0.2, -0.3, 0.0, 0.0, 0.0, 0.21, -0.5, 0.2, 0.0, 0.09, 0.5, -0.3],
    );
    let mass = (2.0 * std::f64::consts::PI).sqrt();
    let mut profiles = Vec::new();
    for kind in ["fluid", "mass"] {
        let finished = run(&scene(kind));
        for snapshot in &finished.snapshots {
            let exact = exponential(&rates * (snapshot.t / 86_400.0));
            match &snapshot.values {
                Values::Total { amount } => {
                    for (species, amount) in amount.iter().enumerate() {
                        let p = exact[(species, 0)];
                        // Fluid particles sample the pulse by their places: 200 000 over 40 m, 12 500 in it.
                        let n = if kind == "mass" { 200_000.0 } else { 12_500.0 };
                        let bound = 4.5 * mass * (0.25_f64 / n).sqrt();
                        assert!((amount - mass * p).abs() < bound, "{kind}: {amount} {}", mass * p);
                    }
                }
                Values::Binned { mean, .. } => profiles.push(mean.clone()),
                _ => panic!("an output that was not asked for"),
            }
        }
    }
    for (fluid, mass) in profiles[0].iter().zip(&profiles[1]) {
        let largest = fluid.iter().fold(0.0, |a: f64, &b| a.max(b));
        // The flow has taken all fluid from behind: no value there.
        let known = || fluid.iter().zip(mass).filter(|(fluid, _)| !fluid.is_nan());
        assert!(known().count() > 30);
        for (fluid, mass) in known() {
            // Thousands of particles in the bins that count: 2 % of the peak each.
            assert!((fluid - mass).abs() < 0.06 * largest + 1e-3, "{fluid} {mass}");
        }
    }
}

/// What a side at a concentration lets in decays on its way, within its first step too.
/// Reference: `decaying_ogata_banks`; parent and daughter together are as if nothing reacted.
#[test]
fn a_side_at_a_concentration_feeds_what_decays() {
    for step in ["2 d", "0.25 d"] {
        let text = format!(
            "lamella 1
species A retardation 2.0, B retardation 2.0
reaction decay: A -> B @ 0.8 /d
domain line x = 0 m .. 10 m
boundary left concentration A = 1 mol/m^3
boundary right outflow
flow uniform 1 m/d
dispersion 0.2 m^2/d
particles mass A 200_000, B 1
run to 4 d, step {step}
output profile A, B at t = 4 d on 50
reference decaying for A = decaying_ogata_banks(velocity = 1 m/d, dispersion = 0.2 m^2/d, inlet = 1 mol/m^3, rate = 0.8 /d, retardation = 2.0)
reference all for A = decaying_ogata_banks(velocity = 1 m/d, dispersion = 0.2 m^2/d, inlet = 1 mol/m^3, rate = 0 /d, retardation = 2.0)
measure error_A = l2(profile.A - decaying) / l2(decaying)
measure error_all = l2(profile.A + profile.B - all) / l2(all)
"
        );
        let finished = run(&text);
        let plan = &finished.compiled.plan;
        let evaluated = lamella::measure::evaluate(
            plan,
            &finished.compiled.evaluation,
            &finished.snapshots,
            &finished.outcome,
        )
        .expect("results and references fit");
        // 15 000 particles in each bin of 0.2 m that is full: 1 %.
        for measure in &evaluated.measures {
            assert!(measure.value < 0.02, "{step}: {} {}", measure.name, measure.value);
        }
    }
}

/// What no output reads is not followed, and what is left has the same law: here the same numbers.
#[test]
fn what_nobody_reads_is_left_out() {
    let all = chain("A, B retardation 2.0, C retardation 4.0", 20_000, 4.0, "1 s");
    let less = all.replace("output moments A, B, C", "output moments A");
    let compiled = compile(&less);
    let transport = compiled.plan.transport.as_ref().expect("masses");
    assert_eq!(transport.populations.len(), 1);
    let decay = transport.decay.as_ref().expect("A still goes");
    assert_eq!((decay.reactions.len(), decay.reactions[0].outcomes.len()), (1, 0));
    // Not all are drawn alike: numbers of particles are shared among fewer species.
    let network =
        Network { rates: DMatrix::from_row_slice(1, 1, &[-0.6]), speed: vec![1.0], spread: vec![0.1] };
    hold(&run(&less), &network, 4.0, 20_000.0, &[1.0], "A alone");
    let none = less.replace("reaction first:  A -> B @ 0.6 /s\n", "");
    assert!(compile(&none).plan.transport.expect("masses").decay.is_none());
}

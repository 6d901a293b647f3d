//! Finite rates with mixing zones and with what is immobile, held to closed forms and independent numbers.

use lamella::engine::snapshot::{Snapshot, Values};
use lamella::engine::{Settings as EngineSettings, Unattended};
use lamella::plan::compile::Options;
use lamella::plan::{OutputKind, Plan, Quantity};
use lamella::scenario::Settings;
use lamella::source::Sources;

const FRONT: &str = include_str!("../experiments/mixing_limited_kinetics/front.lam");
const LAWS: &str = include_str!("../experiments/mixing_limited_kinetics/laws.lam");
const REDOX: &str = include_str!("../experiments/redox_chain/redox_chain.lam");

struct Finished {
    plan: Plan,
    snapshots: Vec<Snapshot>,
    measures: Vec<(String, f64)>,
    mass_defect: f64,
}

#[expect(clippy::print_stdout, reason = "tests report what they measured")]
fn tell(report: &str) {
    println!("{report}");
}

fn run_on(text: &str, set: &[(&str, &str)], threads: Option<usize>) -> Finished {
    let set = set.iter().map(|(name, value)| ((*name).to_owned(), (*value).to_owned())).collect();
    let settings = Settings { set, ..Settings::default() };
    let checked = lamella::check(Sources::single("scene.lam", text), &settings, &Options::default());
    let compiled = checked.compiled.unwrap_or_else(|| panic!("no plan: {:#?}", checked.diagnostics));
    let mut snapshots = Vec::new();
    let settings = EngineSettings { threads, ..EngineSettings::default() };
    let outcome = lamella::engine::run(&compiled.plan, &settings, &Unattended, &mut |snapshot| {
        snapshots.push(snapshot);
        Ok(())
    })
    .expect("the scene runs");
    let evaluated = lamella::measure::evaluate(&compiled.plan, &compiled.evaluation, &snapshots, &outcome)
        .expect("results and references fit");
    let measures = evaluated.measures.iter().map(|measure| (measure.name.clone(), measure.value)).collect();
    Finished { plan: compiled.plan, snapshots, measures, mass_defect: outcome.worst_defect() }
}

fn run(text: &str, set: &[(&str, &str)]) -> Finished {
    run_on(text, set, None)
}

impl Finished {
    fn measure(&self, name: &str) -> f64 {
        self.measures.iter().find(|(own, _)| own == name).expect("the scene has the measure").1
    }

    /// Totals of a species over the times of the output.
    fn totals(&self, name: &str) -> Vec<f64> {
        let of = |snapshot: &Snapshot| {
            let output = &self.plan.outputs[snapshot.output_idx];
            let Values::Total { amount } = &snapshot.values else { return None };
            let is_own = |quantity: &Quantity| matches!(*quantity, Quantity::Species(idx) if self.plan.species[idx].name == name);
            output.quantities.iter().position(is_own).map(|column| amount[column])
        };
        self.snapshots.iter().filter_map(of).collect()
    }
}

/// `F(x) = e^{−x²} ∫₀ˣ e^{t²} dt` by Simpson's rule.
fn dawson(x: f64) -> f64 {
    let n = 400;
    let f = |t: f64| libm_exp(t * t - x * x);
    let h = x / f64::from(n);
    let sum: f64 = (0..=n)
        .map(|k| {
            f(f64::from(k) * h)
                * if k == 0 || k == n {
                    1.0
                } else if k % 2 == 1 {
                    4.0
                } else {
                    2.0
                }
        })
        .sum();
    sum * h / 3.0
}

fn libm_exp(x: f64) -> f64 {
    lamella::maths::scalar::exp(x)
}

/// A reaction so slow that it uses up next to nothing: its product is k ∫ M dt with the mixing state of
/// conservative fluids, M = c0² √(2Dt/π) (1 − η² F(√(χt)) / √(χt)), F Dawson's function. Both reactants
/// are there in 0.3 % less at the end, and 2,000 particles in a bin leave a product of means 0.5 % too high.
#[test]
fn a_slow_reaction_makes_the_integral_of_the_mixing_state() {
    let finished = run(FRONT, &[("k", "1e-4 L/mol/s"), ("particles", "200_000"), ("bins", "100")]);
    let (c0, d, eta, chi, k) = (20.0, 1.3e-7, 0.5, 1e-3, 1e-7);
    let m = |t: f64| {
        let s = (chi * t).sqrt();
        c0 * c0 * (2.0 * d * t / std::f64::consts::PI).sqrt() * (1.0 - eta * eta * dawson(s) / s)
    };
    let n = 1510;
    let integral: f64 = (0..n).map(|idx| m(f64::from(idx) + 0.5)).sum();
    let expected = k * integral / (c0 * 0.01);
    let product = finished.measure("product");
    tell(&format!("slow reaction: {product:.6} cm, expected {expected:.6} cm"));
    assert!((product / expected - 1.0).abs() < 0.01, "{product} {expected}");
    assert!(finished.mass_defect < 1e-12);
}

/// Between no reaction and an instant one, more with a faster law, and the instant one in the limit.
#[test]
fn finite_rates_lie_between_none_and_instant() {
    let product = |k: &str| {
        let finished = run(FRONT, &[("k", k), ("particles", "100_000"), ("bins", "50")]);
        assert!(finished.mass_defect < 1e-12, "{k}: {}", finished.mass_defect);
        (finished.measure("product"), finished.measure("ceiling"))
    };
    let mut before = 0.0;
    for k in ["1e-3 L/mol/s", "0.1 L/mol/s", "10 L/mol/s", "1e3 L/mol/s", "1e6 L/mol/s"] {
        let (own, ceiling) = product(k);
        tell(&format!("k = {k}: {own:.4} of {ceiling:.4} cm"));
        // Noise of 100,000 particles: 0.007 cm, see methods.md.
        assert!(own > before && own < ceiling + 0.014, "{k}: {own} after {before}, at most {ceiling}");
        before = own;
    }
    // The limit itself, within noise and the bias of bins of 0.3 cm.
    assert!((before / product("1 L/mol/s").1 - 1.0).abs() < 0.02, "{before}");
}

/// Four laws at a well-mixed front against finite volumes (1,600 cells, extrapolated; BDF 1e-8): product in
/// cm of c0 at 0.25, 0.5 and 1 s. Bins of 0.02 cm are a quarter of the front's width at first and make 5 %
/// too much there; 1,000 particles in a bin take 1.5 % at the end.
#[test]
fn laws_at_a_front_are_those_of_finite_volumes() {
    let finished = run(LAWS, &[("particles", "200_000"), ("bins", "200"), ("step", "0.02 s")]);
    let expected = [
        ("C1", [0.03211, 0.05824, 0.09453]),
        ("C2", [0.01884, 0.03749, 0.06734]),
        ("C3", [0.01567, 0.03738, 0.07823]),
        ("C4", [0.01759, 0.04225, 0.08665]),
    ];
    for (name, expected) in expected {
        for ((own, expected), tolerance) in
            finished.totals(name).into_iter().zip(expected).zip([0.06, 0.03, 0.02])
        {
            let own = own / (1000.0 * 0.01);
            assert!((own / expected - 1.0).abs() < tolerance, "{name}: {own} instead of {expected}");
        }
    }
    assert!(finished.mass_defect < 1e-12);
}

/// Four electrons for each carbon: what the acceptors took up, those in the bins among them, is what the
/// carbon gave.
#[test]
fn electrons_balance_in_the_redox_chain() {
    let finished = run(REDOX, &[("particles", "12_000"), ("bins", "60"), ("step", "0.5 h")]);
    let used = |name: &str| {
        let totals = finished.totals(name);
        totals[0] - totals[totals.len() - 1]
    };
    let given = 4.0 * used("C");
    let taken = 4.0 * used("O") + 5.0 * used("N") + 2.0 * used("Mn") + used("Fe") + 8.0 * used("S");
    assert!((taken / given - 1.0).abs() < 1e-10, "{taken} of {given}");
    for name in ["O", "N", "Mn", "Fe", "S"] {
        assert!(used(name) > 1e-3, "{name} is used: {}", used(name));
    }
    let highest = finished.totals("C")[0];
    for snapshot in &finished.snapshots {
        if let Values::Binned { mean, .. } = &snapshot.values {
            // Below zero by no more than the tolerance.
            assert!(mean.iter().flatten().all(|value| *value > -1e-6 * highest), "at {}", snapshot.t);
        }
    }
    assert!(finished.mass_defect < 1e-12, "{}", finished.mass_defect);
}

/// Sub-steps, zones and bins: the same bytes on any number of threads, and for a scene with one output more.
#[test]
fn kinetics_give_the_same_bytes_on_any_number_of_threads() {
    let set = [("particles", "20_000"), ("bins", "60"), ("step", "0.5 h")];
    let short = REDOX
        .replace("run to 10 d", "run to 1 d")
        .replace("1 d, 3 d, 10 d", "1 d")
        .replace("at t = 10 d", "at t = 1 d");
    let bits = |finished: &Finished| -> Vec<u64> {
        let profile = |snapshot: &&Snapshot| {
            finished.plan.outputs[snapshot.output_idx].kind == OutputKind::Profile && snapshot.t == 86_400.0
        };
        let columns = finished.snapshots.iter().filter(profile).flat_map(|snapshot| match &snapshot.values {
            Values::Binned { mean, .. } => mean.concat(),
            other => panic!("no profile: {other:?}"),
        });
        columns.map(f64::to_bits).collect()
    };
    let one = bits(&run_on(&short, &set, Some(1)));
    assert!(!one.is_empty());
    assert_eq!(one, bits(&run_on(&short, &set, Some(2))));
    assert_eq!(one, bits(&run_on(&short, &set, Some(7))));
    // Looking in between, on steps and off them, changes nothing.
    let more = short.clone() + "\noutput total O, Mn at t = 3 h, 7.3 h, 11.11 h\n";
    assert_eq!(one, bits(&run_on(&more, &set, Some(2))));
}

//! What reactions conserve stays, and results do not hang on what else a scene has or shows.

use lamella::engine::snapshot::{Snapshot, Values};
use lamella::engine::{Settings as EngineSettings, Unattended};
use lamella::plan::chemistry::Method;
use lamella::plan::compile::{Compiled, Options, Selection};
use lamella::plan::{Plan, Quantity};
use lamella::scenario::Settings;
use lamella::source::Sources;
use std::fmt::Write;

/// A front of A and B over half of which particles exchange with the mean, and half slowly.
const FRONT: &str = "lamella 1
domain line x = 0 m .. 1 m
boundary left, right periodic
dispersion 1e-2 m^2/d
average bins 20
mixing zones { fast: fraction 0.5, rate instant; slow: fraction 0.5, rate 0.5 /d }
particles fluid 4_000 stratified
initial A = if x < 0.5 m then 1 mol/L else 0, B = 1 mol/L - A
";

/// One particle.
const BATCH: &str = "lamella 1
domain line x = 0 m .. 1 m
boundary left, right reflect
particles fluid 1
";

struct Finished {
    plan: Plan,
    snapshots: Vec<Snapshot>,
    mass_defect: f64,
}

fn compile(text: &str, passes: Selection) -> Compiled {
    let options = Options { passes, memory: None };
    let checked = lamella::check(Sources::single("scene.lam", text), &Settings::default(), &options);
    checked.compiled.unwrap_or_else(|| panic!("no plan of {text}: {:#?}", checked.diagnostics))
}

fn run_with(text: &str, passes: Selection) -> Finished {
    let plan = compile(text, passes).plan;
    let mut snapshots = Vec::new();
    let outcome = lamella::engine::run(&plan, &EngineSettings::default(), &Unattended, &mut |snapshot| {
        snapshots.push(snapshot);
        Ok(())
    })
    .unwrap_or_else(|error| panic!("{error} in {text}"));
    Finished { plan, snapshots, mass_defect: outcome.worst_defect() }
}

fn run(text: &str) -> Finished {
    run_with(text, Selection::All)
}

impl Finished {
    /// All values of a species, over times and places of its outputs.
    fn values(&self, name: &str) -> Vec<f64> {
        let of = |snapshot: &Snapshot| -> Vec<f64> {
            let is_own = |quantity: &Quantity| matches!(*quantity, Quantity::Species(idx) if self.plan.species[idx].name == name);
            let quantities = &self.plan.outputs[snapshot.output_idx].quantities;
            let Some(column) = quantities.iter().position(is_own) else { return Vec::new() };
            match &snapshot.values {
                Values::Total { amount } => vec![amount[column]],
                Values::Binned { mean, .. } => mean[column].clone(),
                _ => Vec::new(),
            }
        };
        self.snapshots.iter().flat_map(of).collect()
    }

    fn last(&self, name: &str) -> f64 {
        *self.values(name).last().unwrap_or_else(|| panic!("`{name}` is shown"))
    }
}

/// A + B makes what reacts on, or stays behind: all that A was made into is there, at every step.
#[test]
fn products_that_react_on_or_stay_behind_make_no_mass() {
    let networks = [
        ("C, X", "reaction r: A + B -> C @ 100 L/mol/d\nreaction s: C -> X @ 50 /d"),
        (
            "C, X",
            "reaction r: A + B -> C @ 1 mol/L/d * monod(A, 1 mmol/L) * monod(B, 1 mmol/L)\nreaction s: C -> X @ 500 /d",
        ),
        ("X immobile", "reaction r: A + B -> X @ 100 L/mol/d"),
    ];
    for (species, reactions) in networks {
        let shown = species.replace(" immobile", "");
        let finished = |step: &str| {
            run(&format!(
                "{FRONT}species A, B, {species}\n{reactions}\noutput total A, B, {shown} every 0.5 d\nrun to 3 d, step {step}\n"
            ))
        };
        let mut ends = Vec::new();
        for step in ["0.1 d", "0.05 d", "0.025 d"] {
            let finished = finished(step);
            assert!(finished.mass_defect < 1e-12, "{reactions}: {}", finished.mass_defect);
            let (a, b, x) = (finished.values("A"), finished.values("B"), finished.values("X"));
            let c = if species.contains('C') { finished.values("C") } else { vec![0.0; a.len()] };
            assert_eq!(a.len(), 7);
            for t in 0..a.len() {
                // mol/m³ over one metre
                assert!(
                    (a[t] + c[t] + x[t] - 500.0).abs() < 1e-9,
                    "{reactions} {step} {t}: {a:?} {c:?} {x:?}"
                );
                assert!(
                    (b[t] + c[t] + x[t] - 500.0).abs() < 1e-9,
                    "{reactions} {step} {t}: {b:?} {c:?} {x:?}"
                );
            }
            ends.push(a[6]);
        }
        // Shorter steps change less and less, but for the noise of 200 particles in a bin.
        let changes: Vec<f64> = ends.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
        assert!(changes[0] < 8.0 && changes[1] < 0.75 * changes[0], "{reactions}: {ends:?}");
    }
}

/// An acid that has nothing to do with A, B and P changes nothing of them.
#[test]
fn an_unrelated_equilibrium_changes_nothing() {
    let text = |species: &str, rest: &str| {
        format!(
            "{FRONT}species A, B, P{species}\nreaction r: A + B -> P @ 100 L/mol/d\n{rest}\noutput total A, B, P{} every 1 d\nrun to 3 d, step 0.1 d\n",
            if species.is_empty() { "" } else { ", HL" }
        )
    };
    let alone = run(&text("", ""));
    let acid = "reaction acid: HL <-> H + L @ equilibrium(K = 1e-4 mol/L)\ninitial HL = 1 mmol/L";
    let beside = run(&text(", H, L, HL", acid));
    for name in ["A", "B", "P"] {
        for (own, other) in alone.values(name).iter().zip(beside.values(name)) {
            assert!((own - other).abs() <= 1e-5 * 500.0, "{name}: {own} {other}");
        }
    }
}

/// Rates that do not name what they take end with it, also where others are in equilibrium.
#[test]
fn rates_end_with_their_reactant_beside_an_equilibrium() {
    let acid = "species H, A, HA\nreaction acid: HA <-> H + A @ equilibrium(K = 1e-4 mol/L)\ninitial HA = 1 mmol/L\n";
    let finished = run(&format!(
        "{BATCH}{acid}species S, P, O\nreaction z: S -> P @ 0.1 /d * O\ninitial S = 1 mmol/L, O = 1 mmol/L\n\
         run to 20 d, step 1 d\noutput profile HA, S, P, O at t = 5 d, 20 d on 1\n"
    ));
    assert!((finished.values("S")[0] - 0.5).abs() < 1e-5, "{:?}", finished.values("S"));
    assert!((0.0..1e-6).contains(&finished.last("S")) && (finished.last("P") - 1.0).abs() < 1e-6);
    // What is taken is a part of a total: it ends with the total.
    let finished = run(&format!(
        "{BATCH}{acid}species P, O\nreaction y: A -> P @ 0.07 mmol/L/d * monod(O, 1 umol/L)\n\
         initial O = 1 mmol/L\nrun to 20 d, step 1 d\noutput profile HA, A, P at t = 5 d, 20 d on 1\n"
    ));
    assert!(
        (finished.last("P") - 1.0).abs() < 1e-6 && finished.last("HA") >= 0.0,
        "{:?}",
        finished.values("P")
    );
    let finished = run(&format!(
        "{BATCH}species H charge 1, OH charge -1, Ca charge 2, CO3 charge -2, HCO3 charge -1, Calcite mineral\n\
         reaction w: -> H + OH @ equilibrium(1e-14 mol^2/L^2)\n\
         reaction a: HCO3 <-> H + CO3 @ equilibrium(4.69e-11 mol/L)\n\
         reaction r: Calcite -> Ca + CO3 @ 1e-3 mol/L/d * (1 - Ca * CO3 / (3.3e-9 mol^2/L^2))\n\
         initial Calcite = 0.05 mmol/L\nrun to 10 d, step 0.5 d\noutput profile Ca, Calcite at t = 0.01 d, 1 d, 10 d on 1\n"
    ));
    for (calcite, calcium) in finished.values("Calcite").iter().zip(finished.values("Ca")) {
        assert!(*calcite >= 0.0 && (calcite + calcium - 0.05).abs() < 1e-12, "{calcite} {calcium}");
    }
}

/// Laws that are above zero at late times, or at negative places only.
#[test]
fn rates_end_with_their_reactant_at_any_time_and_place() {
    let law = |condition: &str, domain: &str| {
        format!(
            "lamella 1\ndomain line x = {domain}\nboundary left, right reflect\nparticles fluid 2 ordered\n\
             species A, B, O\nreaction r: A -> B @ (if {condition} then 1 mmol/L/d else 0 mmol/L/d) * monod(O, 1 umol/L)\n\
             initial A = 5 mmol/L, O = 1 mmol/L\nrun to 40 d, step 1 d\noutput profile A, B at t = 22 d, 40 d on 2\n"
        )
    };
    let late = run(&law("t > 20 d", "0 m .. 1 m"));
    let rate = 1.0 / (1.0 + 1e-3);
    assert!((late.values("B")[0] - 2.0 * rate).abs() < 1e-4, "{:?}", late.values("B"));
    assert!((late.last("B") - 5.0).abs() < 1e-5 && (0.0..1e-6).contains(&late.last("A")));
    let left = run(&law("x < 0 m", "-1 m .. 1 m"));
    let (a, b) = (left.values("A"), left.values("B"));
    assert!(
        (0.0..1e-6).contains(&a[2]) && (b[2] - 5.0).abs() < 1e-5 && (a[3], b[3]) == (5.0, 0.0),
        "{a:?} {b:?}"
    );
}

/// What no output reads ends a rate all the same.
#[test]
fn results_do_not_depend_on_what_is_shown() {
    let growth = "species X, S, O\nreaction g: S + 3 O -> 0.5 X @ 0.5 /d * X * monod(S, 0.1 mmol/L)\n\
                  initial S = 1 mmol/L, O = 1 mmol/L, X = 0.1 mmol/L\nrun to 20 d, step 1 d\n";
    for shown in ["X, S", "X, S, O", "X"] {
        let finished = run(&format!("{BATCH}{growth}output profile {shown} at t = 5 d, 20 d on 1\n"));
        assert!((finished.last("X") - 0.8 / 3.0).abs() < 1e-6, "{shown}: {:?}", finished.values("X"));
    }
    let acid = "species H, A, HA, S, P\nreaction acid: HA <-> H + A @ equilibrium(K = 1e-4 mol/L)\n\
                reaction z: S -> P @ 0.1 /d\ninitial HA = 1 mmol/L, S = 1 mmol/L\nrun to 20 d, step 1 d\n\
                output profile S, P at t = 5 d, 20 d on 1\n";
    let finished = run(&format!("{BATCH}{acid}"));
    assert!(finished.plan.chemistry.as_ref().is_some_and(|chemistry| chemistry.equilibrium.is_none()));
    assert!((finished.last("S") - lamella::maths::scalar::exp(-2.0)).abs() < 1e-12);
}

/// Numbers that are the same in each run of the test.
struct Dice(u64);

impl Dice {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) as usize) % n
    }
}

const NAMES: [&str; 5] = ["A", "B", "C", "D", "E"];

/// A few reactions that turn one species into another at rates that name what they like.
fn network(dice: &mut Dice) -> String {
    let n = 3 + dice.below(3);
    let mut text = format!("{BATCH}species {}\n", NAMES[..n].join(", "));
    for (idx, name) in NAMES[..n].iter().enumerate() {
        let value = dice.below(5);
        let _ = writeln!(text, "initial {name} = {} mmol/L", if idx == 0 { 1 } else { value });
    }
    for reaction in 0..2 + dice.below(3) {
        let (from, by) = (dice.below(n), 1 + dice.below(n - 1));
        let (from, to) = (NAMES[from], NAMES[(from + by) % n]);
        let (one, two) = (NAMES[dice.below(n)], NAMES[dice.below(n)]);
        let speed = 1 + dice.below(9);
        let rate = match dice.below(8) {
            0 => format!("0.0{speed} mmol/L/d"),
            1 => format!("0.{speed} /d * {one}"),
            2 => format!("0.{speed} L/mmol/d * {one} * {two}"),
            3 => format!("0.{speed} mmol/L/d * monod({one}, 0.1 mmol/L)"),
            4 => format!("0.{speed} mmol/L/d * monod({one}, 0.1 mmol/L) * inhibit({two}, 1 mmol/L)"),
            5 => format!("0.{speed} /d * {from}"),
            6 => format!("0.{speed} /d * ({from} - {to})"),
            _ => format!("0.{speed} /d * (if t > 3 d then {one} else {two})"),
        };
        let _ = writeln!(text, "reaction r{reaction}: {from} -> {to} @ {rate}");
    }
    text + "run to 10 d, step 0.5 d\n"
}

/// With all passes, with none, with one species shown or all: what is shown is the same within the tolerance.
#[test]
fn random_networks_do_not_depend_on_passes_and_outputs() {
    const TOLERANCE: f64 = 1e-6;
    let mut dice = Dice(7);
    let mut n_gated = 0;
    for _ in 0..150 {
        let text = network(&mut dice);
        let n = NAMES.iter().filter(|name| text.contains(&format!("initial {name} "))).count();
        let show = |names: &[&str]| {
            format!("{text}output profile {} at t = 2 d, 5 d, 10 d on 1\n", names.join(", "))
        };
        let whole = run_with(&show(&NAMES[..n]), Selection::None);
        let sum = |time: usize| NAMES[..n].iter().map(|name| whole.values(name)[time]).sum::<f64>();
        n_gated += usize::from(whole.plan.gates().iter().any(|gates| !gates.is_empty()));
        for time in 0..3 {
            assert!((sum(time) / sum(0) - 1.0).abs() < 1e-12, "{text}");
        }
        for name in &NAMES[..n] {
            assert!(whole.values(name).iter().all(|value| *value >= 0.0), "{text}: {name}");
            for (passes, names) in
                [(Selection::All, &NAMES[..n]), (Selection::All, &[*name]), (Selection::None, &[*name])]
            {
                let other = run_with(&show(names), passes);
                for (own, other) in whole.values(name).iter().zip(other.values(name)) {
                    // Each within ten tolerances of what is right.
                    let bound = 20.0 * TOLERANCE * sum(0);
                    assert!(
                        (own - other).abs() <= bound,
                        "{name} {names:?} {passes:?}: {own} {other} of {text}"
                    );
                }
            }
        }
    }
    assert!(n_gated > 50, "{n_gated}");
}

/// A plume leaves what has sorbed behind: where no particle is left, it waits.
#[test]
fn what_desorbs_where_nobody_is_stays() {
    let finished = run(
        "lamella 1\nspecies A, As immobile\nreaction sorb: A <-> As @ forward 6 /d, backward 3 /d\n\
         initial A = if x > 1 m and x < 2 m then 1 mmol/L else 0\nrun to 4 d, step 0.02 d\noutput total A, As every 1 d\n\
         domain line x = 0 m .. 10 m\nboundary left, right reflect\nflow uniform 1 m/d\ndispersion 0.02 m^2/d\n\
         average bins 200\nparticles fluid 40_000 stratified\n",
    );
    for (own, other) in finished.values("A").iter().zip(finished.values("As")) {
        assert!((own + other - 1.0).abs() < 1e-12, "{own} {other}");
    }
    assert!(finished.mass_defect < 1e-12);
}

/// `sqrt(A − 2)` of half a mole per litre is no number, and neither is the logarithm; at the end of its domain
/// a law ends.
#[test]
fn laws_outside_of_their_domain_stop_the_run() {
    let stopped = |law: &str| {
        let text = format!(
            "{BATCH}species A, B\nreaction r: A -> B @ {law}\nreaction q: B -> A @ 0.1 /d\ninitial A = 0.5 mol/L, B = 1 mol/L\n\
             run to 10 d, step 1 d\noutput profile A, B at t = 1 d on 1\n"
        );
        let plan = compile(&text, Selection::All).plan;
        lamella::engine::run(&plan, &EngineSettings::default(), &Unattended, &mut |_| Ok(()))
    };
    for law in [
        "1 mol/L/d * sqrt(A/(1 mol/L) - 2)",
        "1 mol/L/d * (A/(1 mol/L) - 2)^1.5",
        "-0.1 mol/L/d * ln(A/(1 mol/L) - 2)",
    ] {
        let error = stopped(law).expect_err(law).to_string();
        assert!(
            error.contains("particle 0") && error.contains("in reaction `r` is not a finite number"),
            "{error}"
        );
    }
    for law in [
        "1 mol/L/d * sqrt(max(0, A/(1 mol/L) - 2))",
        "1 mol/L/d * (if A > 2 mol/L then sqrt(A/(1 mol/L) - 2) else 0)",
    ] {
        assert!(stopped(law).is_ok(), "{law}");
    }
    // From 0.5 down to 0.2: c = 0.2 + (sqrt(0.3) − t/2)² in mol/L and d, which ends at 1.095 d.
    let finished = run(&format!(
        "{BATCH}species A, B\nreaction r: A -> B @ 1 mol/L/d * sqrt(A/(1 mol/L) - 0.2)\ninitial A = 0.5 mol/L\n\
         run to 10 d, step 1 d\noutput profile A, B at t = 1 d, 10 d on 1\n"
    ));
    let right = 1e3 * (0.2 + (0.3_f64.sqrt() - 0.5).powi(2));
    let a = finished.values("A");
    assert!((a[0] - right).abs() < 1e-5 * right && (a[1] - 200.0).abs() < 1e-3, "{a:?} {right}");
}

/// What the plan says is what runs: a rate with a gate is stiff at its end.
#[test]
fn gated_rates_are_planned_as_stiff() {
    let growth = "species X, S, O\nreaction g: S + 3 O -> 0.5 X @ 0.5 /d * X * monod(S, 0.1 mmol/L)\n\
                  initial S = 1 mmol/L, O = 1 mmol/L, X = 0.1 mmol/L\nrun to 20 d, step 1 d\n\
                  output profile X, S, O at t = 5 d, 20 d on 1\n";
    for asked in ["", "chemistry integrator explicit\n"] {
        let compiled = compile(&format!("{BATCH}{growth}{asked}"), Selection::All);
        let kinetics = compiled.plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
        assert_eq!(kinetics.map(|kinetics| kinetics.method), Some(Method::Rosenbrock), "{asked}");
        let text = lamella::plan::explain::explain(&compiled, "scene", None);
        assert!(text.contains("the rate of `g` does not see how much is left of O"), "{text}");
        assert_eq!(text.contains("`integrator explicit` is not taken"), !asked.is_empty(), "{text}");
    }
}

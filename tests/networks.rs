//! Networks from text to plan: which method is found, what is carried, what is left out.

use lamella::plan::chemistry::{Chemistry, Integrator, Kinetics, Law, Method, Splitting};
use lamella::plan::compile::{Compiled, Options, Selection};
use lamella::plan::tape::Tape;
use lamella::scenario::Settings;
use lamella::source::Sources;

/// A scene in which nothing moves, if `rest` does not say otherwise.
fn scene(rest: &str) -> String {
    format!(
        "lamella 1\ndomain line x = 0 m .. 1 m\nboundary left, right reflect\n\
         particles fluid 100 stratified\nrun to 1 d, step 0.1 d\n{rest}\n"
    )
}

fn compile_with(rest: &str, passes: Selection) -> Compiled {
    let options = Options { passes, memory: None };
    let checked = lamella::check(Sources::single("scene.lam", scene(rest)), &Settings::default(), &options);
    let messages: Vec<String> =
        checked.diagnostics.iter().map(|message| format!("{}: {}", message.code, message.message)).collect();
    checked.compiled.unwrap_or_else(|| panic!("no plan of {rest}: {messages:#?}"))
}

fn compile(rest: &str) -> Compiled {
    compile_with(rest, Selection::All)
}

fn chemistry(compiled: &Compiled) -> &Chemistry {
    compiled.plan.chemistry.as_ref().expect("something reacts")
}

fn kinetics(compiled: &Compiled) -> &Kinetics {
    chemistry(compiled).kinetics.as_ref().expect("something reacts at a rate")
}

const ABC: &str = "species A, B, C\ninitial A = x * 1 mol/L/m, B = 2 mol/L, C = 0.5 mol/L\n\
                   output total A, B, C at t = 1 d\n";

fn method_of(reactions: &str) -> Method {
    kinetics(&compile(&format!("{ABC}{reactions}"))).method
}

/// The rates of a plan at given concentrations, at x = 0.25 m and t = 100 s.
fn rates(compiled: &Compiled, concentrations: &[f64]) -> Vec<f64> {
    let laws = &kinetics(compiled).laws;
    let inputs = [&[0.25, 0.0, 0.0, 100.0], concentrations].concat();
    let rate = |register: &u16| {
        let tape = Tape { operations: laws.operations[..=usize::from(*register)].to_vec() };
        tape.evaluate(&inputs)
    };
    laws.rates.iter().map(rate).collect()
}

#[test]
fn the_structure_of_a_network_decides_its_method() {
    let k2 = "reaction r: A + B -> C @ 1 L/mol/d";
    for (reactions, method) in [
        ("reaction r: A -> B @ 1 /d\nreaction s: B -> C @ 0.2 /d * B", Method::Observed),
        (
            "reaction r: A <-> B @ forward 1 /d, backward 0.5 /d\nreaction s: -> C @ 1 mol/L/d",
            Method::Observed,
        ),
        ("reaction r: A -> 2 B @ 1 /d", Method::Observed),
        (k2, Method::Pair),
        ("reaction r: 2 A -> B @ 1 L/mol/d", Method::Pair),
        ("reaction r: A -> B @ 1 L/mol/d * A^2", Method::Pair),
        ("reaction r: A -> B @ 1 mol/L/d * monod(A, 0.1 mol/L)", Method::Saturation),
        ("reaction r: A -> B @ 1 mol/L/d / (1 + 0.1 mol/L / A)", Method::Saturation),
        ("reaction r: A -> B @ 1 mol/L/d", Method::Zero),
        // A rate that follows what is not spent, or only one of two that are.
        ("reaction r: A -> B @ 1 /d * C", Method::Rosenbrock),
        ("reaction r: A + B -> C @ 1 mol/L/d * monod(A, 0.1 mol/L)", Method::Rosenbrock),
        ("reaction r: A + B -> 2 B @ 1 L/mol/d", Method::Rosenbrock),
        ("reaction r: A -> B @ 1 /d * (1 + x / 1 m)", Method::Rosenbrock),
        ("reaction r: A -> B @ 1 /d * (1 + t / 1 d)", Method::Rosenbrock),
        ("reaction r: A + B -> C @ 1 L/mol/d\nreaction s: C -> @ 1 /d", Method::Rosenbrock),
    ] {
        let found = match method_of(reactions) {
            // Which of the two integrators depends on time scales, not on the structure.
            Method::Explicit => Method::Rosenbrock,
            found => found,
        };
        assert_eq!(found, method, "{reactions}");
    }
    for (asked, method) in [("explicit", Method::Explicit), ("rosenbrock", Method::Rosenbrock)] {
        assert_eq!(method_of(&format!("{k2}\nchemistry integrator {asked}")), method);
    }
}

#[test]
fn first_order_networks_are_propagated_in_steps_if_something_stays_behind() {
    let flow = "flow uniform 1 m/d\naverage bins 10\n";
    let moving =
        "species A, B\ninitial A = 1 mol/L\nreaction r: A -> B @ 1 /d\noutput total A, B at t = 1 d\n";
    let flow = flow.replace("flow", "dispersion 1e-9 m^2/s\n#");
    assert_eq!(kinetics(&compile(&format!("{flow}{moving}"))).method, Method::Observed);
    let resting = moving.replace("species A, B", "species B immobile, A");
    let compiled = compile(&format!("{flow}{resting}"));
    assert_eq!(kinetics(&compiled).method, Method::Exponential);
    let names: Vec<(&str, bool)> =
        compiled.plan.components.iter().map(|it| (it.name.as_str(), it.is_immobile)).collect();
    assert_eq!(names, [("A", false), ("B", true)], "what lives in bins comes last");
    // Where nothing moves, everything stays with its particle.
    let still = compile(&resting);
    assert!(still.plan.components.iter().all(|component| !component.is_immobile));
}

#[test]
fn rates_are_those_of_current_concentrations() {
    let compiled = compile_with(
        &format!(
            "{ABC}param Y = 1.5\nreaction r: 2 A + B -> Y C @ 3 L^2/mol^2/s\n\
             reaction s: C -> @ 2 /s * C * inhibit(A, 1 mol/L) * (x / 1 m) * (t / 1 s)"
        ),
        Selection::None,
    );
    let found = rates(&compiled, &[2000.0, 500.0, 100.0]);
    // 3e-6 m⁶/mol²/s · 2000² · 500; 2/s · 100 · 1/3 · 0.25 · 100
    for (found, right) in found.iter().zip([6000.0, 5000.0 / 3.0]) {
        assert!((found - right).abs() < 1e-12 * right, "{found} {right}");
    }
    let changes: Vec<_> = kinetics(&compiled).reactions.iter().map(|it| it.changes.clone()).collect();
    assert_eq!(changes, [vec![(0, -2.0), (1, -1.0), (2, 1.5)], vec![(2, -1.0)]]);
}

#[test]
fn a_zero_order_rate_ends_where_its_reactant_does() {
    let compiled = compile(&format!("{ABC}reaction r: A -> B @ 2 mol/L/s\nreaction s: B + C -> @ 1 L/mol/s"));
    let floor = chemistry(&compiled).floors[0];
    assert!((rates(&compiled, &[1.0, 1.0, 1.0])[0] - 2000.0).abs() < 1e-9);
    assert_eq!(rates(&compiled, &[0.0, 1.0, 1.0])[0], 0.0);
    assert!((rates(&compiled, &[0.5 * floor, 1.0, 1.0])[0] - 1000.0).abs() < 1e-9);
}

#[test]
fn both_ways_are_two_reactions() {
    let compiled = compile(&format!(
        "{ABC}reaction bind: A + B <-> C @ forward 2 L/mol/s, backward 3 /s * C * monod(B, 1 mol/L)"
    ));
    let names: Vec<&str> = kinetics(&compiled).reactions.iter().map(|it| it.name.as_str()).collect();
    assert_eq!(names, ["bind.forward", "bind.backward"]);
    let found = rates(&compiled, &[10.0, 1000.0, 5.0]);
    assert!((found[0] - 20.0).abs() < 1e-12 && (found[1] - 7.5).abs() < 1e-12, "{found:?}");
    assert_eq!(kinetics(&compiled).reactions[1].changes, [(0, 1.0), (1, 1.0), (2, -1.0)]);
}

#[test]
fn settings_reach_the_plan() {
    let reaction = "reaction r: A + B -> C @ 1 L/mol/d\n";
    let plain = compile(&format!("{ABC}{reaction}"));
    let defaults = chemistry(&plain);
    assert_eq!((defaults.tolerance, defaults.splitting), (1e-6, Splitting::Lie));
    // The largest initial value is 2 mol/L, that is 2000 mol/m³.
    assert!(defaults.floors.iter().all(|floor| (floor - 2e-6).abs() < 1e-18), "{:?}", defaults.floors);
    let set = compile(&format!(
        "{ABC}{reaction}chemistry tolerance 1e-8, floor 1e-12 mol/L, order 2, integrator explicit"
    ));
    let set = chemistry(&set);
    assert_eq!((set.tolerance, set.splitting), (1e-8, Splitting::Strang));
    assert_eq!(set.integrator, Integrator::Explicit);
    assert!(set.floors.iter().all(|floor| (floor - 1e-9).abs() < 1e-22), "{:?}", set.floors);
    // A floor in mass is for species in mass; where there are none it is refused.
    let mixed = format!("{ABC}{reaction}species M\ninitial M = 1 mg/L\noutput total M at t = 1 d\n");
    let other = compile(&format!("{mixed}chemistry floor 1 ug/L"));
    let n_default = chemistry(&other).floors.iter().filter(|floor| (**floor - 2e-6).abs() < 1e-18).count();
    assert_eq!(n_default, 3, "{:?}", chemistry(&other).floors);
    let text = scene(&format!("{ABC}{reaction}chemistry floor 1 ug/L"));
    let refused =
        lamella::check(Sources::single("scene.lam", text), &Settings::default(), &Options::default());
    assert!(refused.diagnostics.iter().any(|message| message.code.to_string() == "U104"));
}

#[test]
fn what_no_output_reads_does_not_react() {
    let network = "species A, B, C, D, E\ninitial A = x * 1 mol/L/m, C = 1 mol/L\n\
                   reaction one: A -> B @ 1 L/mol/d * A * C\nreaction two: B -> D @ 1 /d\n\
                   reaction three: C -> E @ 2 /d\n";
    let compiled = compile(&format!("{network}output total B at t = 1 d"));
    let names = |compiled: &Compiled| -> Vec<String> {
        kinetics(compiled).reactions.iter().map(|reaction| reaction.name.clone()).collect()
    };
    // C is named by the rate of `one`, so that what changes C is needed; D and E are read by nobody.
    assert_eq!(names(&compiled), ["one", "two", "three"]);
    let species: Vec<&str> = compiled.plan.species.iter().map(|species| species.name.as_str()).collect();
    assert_eq!(species, ["A", "B", "C"]);
    let literal = compile_with(&format!("{network}output total B at t = 1 d"), Selection::KeepingBytes);
    assert_eq!(literal.plan.species.len(), 5);
    // Of the rest only the decay of C is left, which is of first order.
    let only = compile(&format!("{network}output total E at t = 1 d"));
    assert_eq!(names(&only), ["three"]);
    assert_eq!(kinetics(&only).method, Method::Observed);
    assert_eq!(
        kinetics(&only).reactions[0].law,
        Law::MassAction { constant: 2.0 / 86400.0, orders: vec![(0, 1.0)] }
    );
    assert_eq!(kinetics(&only).laws.operations.len(), 3, "constant, C, product");
    // Nothing of the chemistry is read: it goes as a whole, also where every byte is kept.
    let tracer = format!("{network}species T\ninitial T = x * 2 mol/L/m\noutput total T at t = 1 d");
    assert!(compile_with(&tracer, Selection::KeepingBytes).plan.chemistry.is_none());
    assert_eq!(compile(&tracer).plan.components.len(), 1);
}

#[test]
fn relations_hold_among_what_does_not_react() {
    let carried = |compiled: &Compiled| -> Vec<String> {
        compiled.plan.components.iter().map(|component| component.name.clone()).collect()
    };
    let start = "initial A = x * 1 mol/L/m, B = 1 mol/L - A, T = 3 * A\noutput total A, B, C, T at t = 1 d\n";
    let scene = |species: &str, reaction: &str| compile(&format!("species {species}\n{start}{reaction}"));
    // Nothing reacts: B, C and T follow from A.
    assert_eq!(carried(&scene("A, B, C, T", "")), ["A"]);
    // A, B and C react: they are carried, and the tracer is 3 A no longer.
    let pair = scene("A, B, C, T", "reaction r: A + B -> C @ 1 L/mol/d");
    assert_eq!(carried(&pair), ["A", "B", "C", "T"]);
    // What no reaction changes keeps its relations, those that others feel included.
    let other = compile(
        "species A, T, B, U\ninitial A = 1 mol/L, T = x * 1 mol/L/m, U = 2 * T\n\
         reaction r: A -> B @ 1 L/mol/d * A * U\noutput total A, B, T, U at t = 1 d",
    );
    assert_eq!(carried(&other), ["A", "T", "B"]);
    assert_eq!(other.plan.species[3].terms, [(1, 2.0)]);
    assert_eq!(kinetics(&other).reactions[0].changes, [(0, -1.0), (2, 1.0)]);
}

#[test]
fn propagated_networks_carry_what_has_not_reacted() {
    let compiled = compile(
        "species A, B, C\ninitial A = x * 1 mol/L/m, B = 1 mol/L - A\n\
         reaction r: A -> B @ 1 /d\nreaction s: B -> C @ 2 /d\noutput total A, B, C at t = 1 d",
    );
    assert_eq!(kinetics(&compiled).method, Method::Observed);
    assert_eq!(compiled.plan.components.len(), 1, "B and C follow from A before they react");
    // The changes are those of species.
    assert_eq!(kinetics(&compiled).reactions[1].changes, [(1, -1.0), (2, 1.0)]);
}

const ACID: &str = "species H charge 1, OH charge -1, HA charge 0, Ac charge -1, M mineral, Ca charge 2\n\
                    reaction water: -> H + OH @ equilibrium(K = 1e-14 mol^2/L^2)\n\
                    reaction acid: HA <-> H + Ac @ equilibrium(1e-5 mol/L)\n\
                    reaction solid: M <-> Ca + 2 Ac @ equilibrium(1e-9 mol^3/L^3)\n";

#[test]
fn totals_of_primary_species_are_carried() {
    let scene = format!(
        "{ACID}initial HA = x * 1 mol/L/m, OH = x * x * 1 mol/L/m^2, M = exp(x / 1 m) * 1 mol/L\n\
         output total H, OH, HA, Ac, M, Ca at t = 1 d"
    );
    let compiled = compile_with(&scene, Selection::None);
    let plan = &compiled.plan;
    let equilibrium = chemistry(&compiled).equilibrium.as_ref().expect("equilibrium");
    let name = |species: usize| plan.species[species].name.as_str();
    let primaries: Vec<&str> = equilibrium.primaries.iter().map(|primary| name(primary.species)).collect();
    assert_eq!(primaries.len() + equilibrium.secondaries.len() + equilibrium.minerals.len(), 6);
    assert_eq!(equilibrium.minerals.len(), 1);
    assert!(plan.species.iter().all(|species| species.terms.len() <= 1));
    let x = 0.3;
    let start = |name: &str| match name {
        "HA" => 1000.0 * x,
        "OH" => 1000.0 * x * x,
        "M" => 1000.0 * f64::exp(x),
        _ => 0.0,
    };
    for (idx, primary) in equilibrium.primaries.iter().enumerate() {
        let share =
            |list: &[(usize, f64)]| list.iter().find(|(other, _)| *other == idx).map_or(0.0, |it| it.1);
        let mut total = start(name(primary.species));
        for secondary in &equilibrium.secondaries {
            total += share(&secondary.coefficients) * start(name(secondary.species));
        }
        for mineral in &equilibrium.minerals {
            total += share(&mineral.coefficients) * start(name(mineral.species));
        }
        let component = primary.terms[0].0;
        let found = plan.components[component].initial.evaluate(&[x, 0.0, 0.0, 0.0]);
        assert!((found - total).abs() < 1e-9, "{}: {found} {total}", name(primary.species));
    }
    for secondary in &equilibrium.secondaries {
        assert!(plan.species[secondary.species].terms.is_empty(), "{} is carried", name(secondary.species));
    }
}

/// Every reaction holds: ln K in mol/m³ is that of the constants as they were written.
#[test]
fn constants_of_equilibrium_are_per_cubic_metre() {
    let compiled = compile_with(
        "species A, B, AB, A2B\ninitial A = 1 mol/L\nreaction one: A + B <-> AB @ equilibrium(K = 1e3 L/mol)\n\
         reaction two: AB + A <-> A2B @ equilibrium(K = 1e2 L/mol)\noutput total A, B, AB, A2B at t = 1 d",
        Selection::None,
    );
    let equilibrium = chemistry(&compiled).equilibrium.as_ref().expect("equilibrium");
    let found: Vec<(usize, f64)> =
        equilibrium.secondaries.iter().map(|it| (it.species, it.ln_constant)).collect();
    let right = [(2, 1.0_f64.ln()), (3, 0.1_f64.ln())];
    assert_eq!(found.len(), 2);
    for ((species, found), (own, right)) in found.iter().zip(right) {
        assert_eq!(*species, own);
        assert!((found - right).abs() < 1e-12, "{found} {right}");
    }
    assert_eq!(equilibrium.secondaries[1].coefficients, [(0, 2.0), (1, 1.0)]);
}

#[test]
fn rates_change_the_totals_of_what_is_in_equilibrium() {
    let compiled = compile_with(
        &format!(
            "{ACID}initial HA = 1 mol/L, OH = x * 1 mol/L/m\nreaction loss: HA -> @ 1 /d\n\
             output total H, OH, HA, Ac, M, Ca at t = 1 d"
        ),
        Selection::None,
    );
    assert_eq!(kinetics(&compiled).method, Method::Rosenbrock);
    let equilibrium = chemistry(&compiled).equilibrium.as_ref().expect("equilibrium");
    let acid = compiled.plan.species.iter().position(|species| species.name == "HA").expect("HA");
    let secondary = equilibrium.secondaries.iter().find(|secondary| secondary.species == acid);
    let changes = &kinetics(&compiled).reactions[0].changes;
    let expected: Vec<(usize, f64)> = match secondary {
        Some(it) => it
            .coefficients
            .iter()
            .map(|(primary, nu)| (equilibrium.primaries[*primary].terms[0].0, -nu))
            .collect(),
        None => vec![(0, -1.0)],
    };
    let mut expected = expected;
    expected.sort_unstable_by_key(|(component, _)| *component);
    assert_eq!(*changes, expected);
    assert!(
        compile_with(&format!("{ACID}initial HA = 1 mol/L\noutput total H at t = 1 d"), Selection::All)
            .plan
            .chemistry
            .is_some()
    );
}

/// The ionic strength is that of all ions, also of those that take part in no equilibrium.
#[test]
fn other_ions_count_where_activities_are_asked_for() {
    let scene = |activity: &str| {
        let text = format!(
            "{ACID}species Na charge 1, Sugar\ninitial HA = x * 1 mol/L/m, Na = x * x * 1 mol/L/m^2, Sugar = x * 2 mol/L/m\n\
             chemistry activity {activity}\noutput total H, Na, Sugar at t = 1 d"
        );
        let compiled = compile_with(&text, Selection::None);
        let equilibrium = chemistry(&compiled).equilibrium.clone().expect("equilibrium");
        let name = |species: usize| compiled.plan.species[species].name.clone();
        equilibrium
            .primaries
            .iter()
            .map(|primary| (name(primary.species), primary.charge))
            .collect::<Vec<_>>()
    };
    let sodium = ("Na".to_owned(), 1.0);
    assert!(!scene("ideal").contains(&sodium));
    assert_eq!(scene("davies").last(), Some(&sodium));
    assert_eq!(scene("davies").len(), scene("ideal").len() + 1);
}

/// Spelling, order and units do not change what runs.
#[test]
fn the_plan_of_a_network_does_not_depend_on_its_writing() {
    let one = compile(&format!("{ABC}reaction r: A + B -> C @ 1 L/mol/d"));
    let two = compile(&format!("{ABC}reaction r: A + B -> C @ (1000 cm^3/mol/d) * A * B"));
    let law = |compiled: &Compiled| kinetics(compiled).reactions[0].law.clone();
    match (law(&one), law(&two)) {
        (Law::MassAction { constant: a, orders: first }, Law::MassAction { constant: b, orders: second }) => {
            assert!((a - b).abs() <= 1e-15 * a);
            assert_eq!(first, second);
        }
        other => panic!("{other:?}"),
    }
}

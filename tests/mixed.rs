//! Kinetics of species in equilibrium, against closed forms, and speciation of columns.

#[path = "support/mod.rs"]
mod support;

use lamella::chemistry::{Batch, Failure, Reactor, Scratch, Why, Work};
use lamella::maths::scalar::exp;
use lamella::maths::wide::Width;
use lamella::plan::chemistry::*;
use lamella::plan::tape::{Binary, Operation};
use lamella::plan::{Component, Plan};

const DIMERS: f64 = 2.0;
const RATE: f64 = 0.7;

/// 2 A ⇌ A₂ with `[A₂] = 2 [A]²`, A decays with 0.7 per second; what is carried is `A + 2 A₂`.
fn dimers(tolerance: f64) -> Plan {
    let axes = vec![support::axis(0, -1.0, 1.0, lamella::plan::Side::Reflect, 1)];
    let mut plan = support::plain(axes, support::walk(1, 1e-9), 10, 1.0, 0.1);
    plan.components =
        vec![Component { name: "A".into(), initial: support::constant(1.0), is_immobile: false }];
    plan.species =
        vec![support::species("A", 0.0, vec![(0, 1.0)]), support::species("A2", 0.0, vec![(0, 1.0)])];
    let primary = Primary { species: 0, charge: 0.0, ion_size: 0.0, constant: 0.0, terms: vec![(0, 1.0)] };
    let dimer = Secondary {
        species: 1,
        charge: 0.0,
        ion_size: 0.0,
        ln_constant: lamella::maths::scalar::ln(DIMERS),
        coefficients: vec![(0, 2.0)],
    };
    let operations =
        vec![Operation::Input(4), Operation::Constant(RATE), Operation::Binary(Binary::Multiply, 0, 1)];
    let law = Law::MassAction { constant: RATE, orders: vec![(0, 1.0)] };
    plan.chemistry = Some(Chemistry {
        kinetics: Some(Kinetics {
            reactions: vec![Kinetic { name: "decay".into(), changes: vec![(0, -1.0)], law }],
            laws: Laws { operations, rates: vec![2] },
            method: Method::Rosenbrock,
        }),
        equilibrium: Some(Equilibrium {
            primaries: vec![primary],
            secondaries: vec![dimer],
            minerals: vec![],
            activity: Activity::Ideal,
        }),
        tolerance,
        floors: vec![1e-9],
        splitting: Splitting::Lie,
        integrator: Integrator::default(),
    });
    plan
}

fn react(reactor: &Reactor, dt: f64, column: &mut [f64]) -> Result<Work, Failure> {
    let batch = Batch { positions: [&[], &[], &[]], t: 0.0, dt, components: &mut [column], memory: &mut [] };
    reactor.react(batch, &mut Scratch::default())
}

/// `ln a + 4 K a` falls by the rate times the time, from the a of the total; by bisection.
fn exact(total: f64, t: f64) -> f64 {
    let monomer = |total: f64| 2.0 * total / (1.0 + (1.0 + 8.0 * DIMERS * total).sqrt());
    let level = |a: f64| lamella::maths::scalar::ln(a) + 4.0 * DIMERS * a;
    let goal = level(monomer(total)) - RATE * t;
    let (mut low, mut high) = (1e-300, total);
    for _ in 0..2000 {
        let middle = 0.5 * (low + high);
        if level(middle) < goal { low = middle } else { high = middle }
    }
    low + 2.0 * DIMERS * low * low
}

#[test]
fn a_total_decays_as_its_monomer_does() {
    for tolerance in [1e-4, 1e-6, 1e-8] {
        let reactor = Reactor::new(&dimers(tolerance)).unwrap().unwrap();
        let totals: Vec<f64> = (0..37).map(|idx| exp(-6.0 + 0.3 * f64::from(idx))).collect();
        for dt in [1e-3, 0.3, 8.0] {
            let mut column = totals.clone();
            react(&reactor, dt, &mut column).unwrap();
            for (total, found) in totals.iter().zip(&column) {
                let exact = exact(*total, dt);
                assert!(
                    (found - exact).abs() <= 10.0 * tolerance * (exact + 1e-9),
                    "{total} {dt}: {found} {exact}"
                );
            }
        }
    }
}

/// The slope of a step with the total is that of the exact solution only with the right Jacobian: the work of a
/// wrong one would be many times more.
#[test]
fn the_jacobian_keeps_the_order_of_the_method() {
    let totals: Vec<f64> = (0..16).map(|idx| 0.5 + 0.1 * f64::from(idx)).collect();
    let steps = |tolerance: f64| {
        let reactor = Reactor::new(&dimers(tolerance)).unwrap().unwrap();
        react(&reactor, 2.0, &mut totals.clone()).unwrap().steps as f64
    };
    // Order 4 takes 10 times the steps for 10⁴ in tolerance, where order 2 takes 100 times.
    let growth = steps(1e-10) / steps(1e-6);
    assert!((4.0..25.0).contains(&growth), "{growth}");
}

#[test]
fn particles_do_not_see_their_neighbours() {
    let reactor = Reactor::new(&dimers(1e-6)).unwrap().unwrap();
    let totals: Vec<f64> = (0..53).map(|idx| 0.01 + 0.2 * f64::from(idx * 17 % 53)).collect();
    let mut all = totals.clone();
    react(&reactor, 1.5, &mut all).unwrap();
    let mut narrow = totals.clone();
    react(&reactor.clone().with_width(Width::baseline()), 1.5, &mut narrow).unwrap();
    assert_eq!(all, narrow);
    for (total, found) in totals.iter().zip(&all) {
        let mut one = [*total];
        react(&reactor, 1.5, &mut one).unwrap();
        assert_eq!(one[0], *found);
    }
}

#[test]
fn species_follow_from_totals_and_what_has_none_is_refused() {
    let mut plan = dimers(1e-6);
    plan.chemistry.as_mut().unwrap().kinetics = None;
    let reactor = Reactor::new(&plan).unwrap().unwrap();
    let totals = [1.0, 10.0, 0.0, 1e-12];
    let (mut a, mut a2) = ([0.0; 4], [0.0; 4]);
    reactor.speciate(&[&totals], &mut [&mut a, &mut a2], &mut Scratch::default()).unwrap();
    for ((a, a2), total) in a.iter().zip(&a2).zip(totals) {
        assert!((a + 2.0 * a2 - total).abs() <= 1e-15 * total);
        assert!((a2 - DIMERS * a * a).abs() <= 1e-14 * a2);
    }
    let failure =
        reactor.speciate(&[&[1.0, f64::NAN]], &mut [&mut a[..2], &mut a2[..2]], &mut Scratch::default());
    assert_eq!(failure, Err(Failure { particle: 1, why: Why::NotFinite { component: 0, reaction: None } }));
}

/// H⁺, CO₃²⁻, Ca²⁺ with OH⁻, HCO₃⁻, CO₂, CaCO₃(aq) and calcite; CO₂ leaves to the air.
fn degassing(tolerance: f64) -> Plan {
    let mut plan = dimers(tolerance);
    let ln_10 = std::f64::consts::LN_10;
    let names = ["H", "CO3", "Ca", "OH", "HCO3", "CO2", "CaCO3", "calcite"];
    plan.components = names[..3]
        .iter()
        .map(|name| Component { name: (*name).into(), initial: support::constant(1.0), is_immobile: false })
        .collect();
    plan.species = names
        .iter()
        .enumerate()
        .map(|(s, name)| support::species(name, 0.0, vec![(s.min(2), 1.0)]))
        .collect();
    let primary = |(species, charge): (usize, f64)| Primary {
        species,
        charge,
        ion_size: 0.0,
        constant: 0.0,
        terms: vec![(species, 1.0)],
    };
    // Charge, log K, and how much of each primary.
    type Complex<'a> = (f64, f64, &'a [(usize, f64)]);
    let complexes: [Complex<'_>; 4] = [
        (-1.0, -8.0, &[(0, -1.0)]),
        (-1.0, 7.329, &[(0, 1.0), (1, 1.0)]),
        (0.0, 10.681, &[(0, 2.0), (1, 1.0)]),
        (0.0, 0.224, &[(1, 1.0), (2, 1.0)]),
    ];
    let secondary = |(idx, (charge, log_k, nus)): (usize, &Complex<'_>)| Secondary {
        species: 3 + idx,
        charge: *charge,
        ion_size: 0.0,
        ln_constant: log_k * ln_10,
        coefficients: nus.to_vec(),
    };
    let calcite =
        Mineral { species: 7, ln_solubility: -2.48 * ln_10, coefficients: vec![(1, 1.0), (2, 1.0)] };
    let chemistry = plan.chemistry.as_mut().unwrap();
    chemistry.floors = vec![1e-9; 3];
    chemistry.equilibrium = Some(Equilibrium {
        primaries: [1.0, -2.0, 2.0].into_iter().enumerate().map(primary).collect(),
        secondaries: complexes.iter().enumerate().map(secondary).collect(),
        minerals: vec![calcite],
        activity: Activity::Davies,
    });
    let kinetics = chemistry.kinetics.as_mut().unwrap();
    kinetics.laws.operations[0] = Operation::Input(4 + 5);
    let law = Law::MassAction { constant: RATE, orders: vec![(5, 1.0)] };
    // CO₂ is CO₃ with two H.
    kinetics.reactions = vec![Kinetic { name: "air".into(), changes: vec![(0, -2.0), (1, -1.0)], law }];
    plan
}

#[test]
fn a_water_that_loses_carbon_dioxide_precipitates_calcite() {
    let waters = || {
        let at = |low: f64, high: f64| {
            (0..21).map(|i| low + (high - low) * f64::from(i) / 20.0).collect::<Vec<_>>()
        };
        [at(2.2, 6.0), at(2.0, 4.0), at(0.3, 1.6)]
    };
    let run = |tolerance: f64| {
        let reactor = Reactor::new(&degassing(tolerance)).unwrap().unwrap();
        let mut columns = waters();
        let [h, c, ca] = &mut columns;
        let components: &mut [&mut [f64]] = &mut [h, c, ca];
        let batch = Batch { positions: [&[], &[], &[]], t: 0.0, dt: 30.0, components, memory: &mut [] };
        reactor.react(batch, &mut Scratch::default()).unwrap();
        let mut species = vec![vec![0.0; 21]; 8];
        let given: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
        let mut out: Vec<&mut [f64]> = species.iter_mut().map(Vec::as_mut_slice).collect();
        reactor.speciate(&given, &mut out, &mut Scratch::default()).unwrap();
        (columns, species)
    };
    let (exact, species) = run(1e-11);
    assert!(species[7].iter().filter(|calcite| **calcite > 0.0).count() > 5, "{:?}", species[7]);
    for tolerance in [1e-4, 1e-6] {
        let (found, _) = run(tolerance);
        for (found, exact) in found.iter().flatten().zip(exact.iter().flatten()) {
            assert!((found - exact).abs() <= 10.0 * tolerance * exact.abs(), "{tolerance}: {found} {exact}");
        }
        // Calcium does not leave, and two H leave with each carbon.
        let before = waters();
        assert_eq!(found[2], before[2]);
        for idx in 0..21 {
            let lost = (before[0][idx] - found[0][idx]) - 2.0 * (before[1][idx] - found[1][idx]);
            assert!(lost.abs() < 1e-13 * before[0][idx]);
        }
    }
}

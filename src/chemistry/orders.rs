//! Orders of the methods, measured with fixed steps.

use super::explicit::Explicit;
use super::integrate::{Lanes, Network, Stepper};
use super::invariants::Invariants;
use super::laws::{Basis, LANES, System};
use super::matrix::Symbolic;
use super::rosenbrock::Rosenbrock;
use crate::maths::operator::{Binary, Unary};
use crate::maths::scalar::ln;
use crate::plan::Species;
use crate::plan::chemistry::{Kinetic, Kinetics, Law, Laws, Method};
use crate::plan::tape::Operation;
use std::f64::consts::LN_2;

/// `A → B` with `(1.5 + sin 3t) a²`, `B → A` with `b/(0.3 + b)`: neither linear nor autonomous.
fn network() -> Network {
    use Operation::{Constant, Input};
    let operations = vec![
        Input(3),
        Constant(3.0),
        Operation::Binary(Binary::Multiply, 0, 1),
        Operation::Unary(Unary::Sin, 2),
        Constant(1.5),
        Operation::Binary(Binary::Add, 3, 4),
        Input(4),
        Operation::Binary(Binary::Multiply, 6, 6),
        Operation::Binary(Binary::Multiply, 5, 7),
        Input(5),
        Constant(0.3),
        Operation::Binary(Binary::Add, 9, 10),
        Operation::Binary(Binary::Divide, 9, 11),
    ];
    let reaction = |from: usize, to: usize| Kinetic {
        name: String::new(),
        changes: vec![(from, -1.0), (to, 1.0)],
        law: Law::Expression,
    };
    let kinetics = Kinetics {
        reactions: vec![reaction(0, 1), reaction(1, 0)],
        laws: Laws { operations, rates: vec![8, 12] },
        method: Method::Rosenbrock,
    };
    let species: Vec<Species> = (0..2)
        .map(|idx| Species { name: String::new(), constant: 0.0, terms: vec![(idx, 1.0)], is_molar: true })
        .collect();
    let system = System::new(&kinetics, &species, 2, Basis::Components, &[1e-12; 2]).unwrap();
    Network { system, invariants: Invariants::default(), small: vec![1e-12; 2], tolerance: 1e-6 }
}

/// The first component at t = 2 after n equal steps, and the largest estimate of a step's error.
fn run<S: Stepper>(network: &Network, stepper: &S, n: u32) -> (f64, f64) {
    let mut lanes = Lanes::new(network, 7, 16);
    lanes.y = vec![[1.0; LANES], [0.2; LANES]];
    let (step, mut largest) = (2.0 / f64::from(n), 0.0_f64);
    lanes.step = [step; LANES];
    for k in 0..n {
        lanes.elapsed = [f64::from(k) * step; LANES];
        stepper.begin(&mut lanes);
        stepper.attempt(&mut lanes);
        largest = largest.max(lanes.error[0][0].abs());
        lanes.y.clone_from(&lanes.new);
    }
    (lanes.y[0][0], largest)
}

/// Slopes of error and estimate between two numbers of steps.
fn check<S: Stepper>(network: &Network, stepper: &S, n: u32, order: f64, estimate: f64) {
    let (right, _) = run(network, &Explicit { network }, 4000);
    let (coarse, fine) = (run(network, stepper, n), run(network, stepper, 2 * n));
    let slope = ln(((coarse.0 - right) / (fine.0 - right)).abs()) / LN_2;
    let estimated = ln(coarse.1 / fine.1) / LN_2;
    assert!((slope - order).abs() < 0.15, "order {slope} instead of {order}");
    assert!((estimated - estimate).abs() < 0.3, "the estimate falls with {estimated}, not {estimate}");
}

#[test]
fn the_orders_are_those_of_the_books() {
    let network = network();
    let symbolic = &Symbolic::new(2, &network.system.pattern);
    let network = &network;
    check(network, &Rosenbrock { network, symbolic, aqueous: None }, 400, 4.0, 4.0);
    check(network, &Explicit { network }, 192, 5.0, 5.0);
}

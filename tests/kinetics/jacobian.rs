//! Exact Jacobians against differences of the rates.

use super::network::Network;
use super::support;
use lamella::chemistry::laws::{Basis, LANES, System};
use lamella::maths::operator::{Binary, Unary};
use lamella::plan::Species;
use lamella::plan::chemistry::{Kinetic, Kinetics, Law, Laws, Method};
use lamella::plan::tape::Operation;
use proptest::prelude::*;
use proptest::test_runner::RngSeed;

const N: usize = 3;

fn system(kinetics: &Kinetics, species: &[Species]) -> System {
    System::new(kinetics, species, N, Basis::Components, &[1e-12; N]).unwrap()
}

/// `dy/dt`, the dense Jacobian and `∂/∂t dy/dt` at a state; positions are (0.3, −0.2, 0.7).
fn evaluate(system: &System, y: &[f64; N], t: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let mut registers = system.full.registers();
    for (register, value) in registers.iter_mut().zip(y.iter().chain(&[0.3, -0.2, 0.7, t])) {
        *register = [*value; LANES];
    }
    system.full.run(&mut registers);
    let value = |idx: usize| registers[usize::from(system.full.outputs[idx])][LANES - 1];
    let mut jacobian = vec![0.0; N * N];
    for (idx, (row, column)) in system.pattern.iter().enumerate() {
        jacobian[row * N + column] = value(N + idx);
    }
    let first = N + system.pattern.len();
    let by_time = (0..N).map(|idx| if system.reads_time { value(first + idx) } else { 0.0 }).collect();
    ((0..N).map(value).collect(), jacobian, by_time)
}

fn rates(system: &System, y: &[f64; N], t: f64) -> Vec<f64> {
    let mut registers = system.rates.registers();
    for (register, value) in registers.iter_mut().zip(y.iter().chain(&[0.3, -0.2, 0.7, t])) {
        *register = [*value; LANES];
    }
    system.rates.run(&mut registers);
    system.rates.outputs.iter().map(|&place| registers[usize::from(place)][0]).collect()
}

/// Counts entries that were compared. Differences of two widths that disagree say nothing: a kink or a
/// number out of range lies between.
fn compare(system: &System, y: &[f64; N], t: f64) -> Result<usize, String> {
    let (value, jacobian, by_time) = evaluate(system, y, t);
    for (full, plain) in value.iter().zip(rates(system, y, t)) {
        if full.to_bits() != plain.to_bits() && !(full.is_nan() && plain.is_nan()) {
            return Err(format!("two values: {full} {plain}"));
        }
    }
    let mut n_compared = 0;
    for column in 0..=N {
        let difference = |h: f64| -> Vec<f64> {
            let (mut low, mut high, mut times) = (*y, *y, [t, t]);
            if column < N {
                low[column] -= h;
                high[column] += h;
            } else {
                times = [t - h, t + h];
            }
            let (low, high) = (rates(system, &low, times[0]), rates(system, &high, times[1]));
            high.iter().zip(low).map(|(high, low)| (high - low) / (2.0 * h)).collect()
        };
        let (wide, narrow) = (difference(2e-5), difference(1e-5));
        for row in 0..N {
            let exact = if column < N { jacobian[row * N + column] } else { by_time[row] };
            let scale = narrow[row].abs() + value[row].abs() + 1.0;
            // Nor do those of what is out of proportion, as beside a pole.
            if (wide[row] - narrow[row]).abs() > 1e-6 * scale
                || scale > 1e6
                || !(wide[row] + exact).is_finite()
            {
                continue;
            }
            n_compared += 1;
            if (exact - narrow[row]).abs() > 1e-4 * scale {
                return Err(format!("{row} by {column}: {exact}, difference {}", narrow[row]));
            }
        }
    }
    Ok(n_compared)
}

/// Tapes whose later operations mostly read earlier ones.
fn operations() -> impl Strategy<Value = Vec<Operation>> {
    use Binary as B;
    use Unary as U;
    let unary = proptest::sample::select(vec![
        U::Negate,
        U::Abs,
        U::Sqrt,
        U::Exp,
        U::Ln,
        U::Log10,
        U::Sin,
        U::Cos,
        U::Tanh,
        U::Erf,
        U::Erfc,
        U::Not,
    ]);
    let binary = proptest::sample::select(vec![
        B::Add,
        B::Subtract,
        B::Multiply,
        B::Divide,
        B::Power,
        B::Minimum,
        B::Maximum,
        B::Less,
        B::Multiply,
        B::Divide,
        B::Add,
    ]);
    let operation = prop_oneof![
        2 => (-2.0..2.0_f64).prop_map(Operation::Constant),
        1 => (1_u8..4).prop_map(|value| Operation::Constant(f64::from(value))),
        3 => (0_u16..4 + N as u16).prop_map(Operation::Input),
        3 => (unary, any::<u16>()).prop_map(|(unary, a)| Operation::Unary(unary, a)),
        7 => (binary, any::<u16>(), any::<u16>()).prop_map(|(binary, a, b)| Operation::Binary(binary, a, b)),
        1 => (any::<u16>(), any::<u16>(), any::<u16>()).prop_map(|(a, b, c)| Operation::Select(a, b, c)),
    ];
    proptest::collection::vec(operation, 6..40).prop_map(|random| {
        let mut operations: Vec<Operation> = (0..4 + N as u16).map(Operation::Input).collect();
        for operation in random {
            let n = operations.len() as u16;
            operations.push(match operation {
                Operation::Unary(unary, a) => Operation::Unary(unary, a % n),
                Operation::Binary(binary, a, b) => Operation::Binary(binary, a % n, b % n),
                Operation::Select(a, b, c) => Operation::Select(a % n, b % n, c % n),
                other => other,
            });
        }
        operations
    })
}

/// Two reactions with the last two registers as rates; one species is a sum of components.
fn network(operations: Vec<Operation>) -> (Kinetics, Vec<Species>) {
    let last = operations.len() as u16 - 1;
    let reaction =
        |changes: Vec<(usize, f64)>| Kinetic { name: "r".to_owned(), changes, law: Law::Expression };
    let kinetics = Kinetics {
        reactions: vec![reaction(vec![(0, -1.0), (1, 2.0)]), reaction(vec![(1, -1.0), (2, 0.5)])],
        laws: Laws { operations, rates: vec![last, last - 1] },
        method: Method::Rosenbrock,
    };
    let species = vec![
        support::species("A", 0.0, vec![(0, 1.0)]),
        support::species("B", 0.1, vec![(1, 1.0), (2, 0.5)]),
        support::species("C", 0.0, vec![(2, 1.0)]),
    ];
    (kinetics, species)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 20_000, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..ProptestConfig::default() })]
    #[test]
    fn random_laws(operations in operations(), y in prop::array::uniform3(0.05..2.0_f64), t in 0.1..2.0_f64) {
        let (kinetics, species) = network(operations);
        if let Err(what) = compare(&system(&kinetics, &species), &y, t) {
            return Err(TestCaseError::fail(what));
        }
    }
}

/// Monod with inhibition, powers, minimum, Arrhenius-like time dependence: every entry is compared, at
/// many states.
#[test]
fn usual_laws() {
    let mut laws = Network::new(N);
    let (a, b) = (laws.monod(0, 0.2), laws.monod(1, 0.05));
    let (k, c) = (laws.k(0.3), laws.c(2));
    let sum = laws.binary(Binary::Add, k, c);
    let inhibited = laws.binary(Binary::Divide, k, sum);
    let t = laws.place(3);
    let warm = laws.unary(Unary::Sin, t);
    let mut rate = laws.times(a, b);
    rate = laws.times(rate, inhibited);
    rate = laws.times(rate, warm);
    laws.reaction(&[(0, -1.0), (1, -0.5), (2, 1.0)], rate);
    laws.mass_action(0.7, &[(0, 0.5), (2, 1.5)], &[(0, -1.0), (2, -1.0), (1, 1.0)]);
    laws.mass_action(0.2, &[(1, 2.0)], &[(1, -2.0), (0, 1.0)]);
    let (first, second) = (laws.c(0), laws.c(1));
    let least = laws.binary(Binary::Minimum, first, second);
    laws.reaction(&[(2, 1.0)], least);
    let system = system(&laws.kinetics(Method::Rosenbrock), &laws.species);
    let mut n_compared = 0;
    for k in 0..200_u32 {
        let part = |m: u32| 0.02 + f64::from((k * m) % 97) / 50.0;
        n_compared += compare(&system, &[part(31), 0.003 + part(57), part(11)], part(7)).unwrap();
    }
    assert!(n_compared > 2300, "{n_compared} of 2400");
}

/// At zero slopes are those towards the right, and finite.
#[test]
fn slopes_at_zero() {
    let slope = |build: &dyn Fn(&mut Network)| {
        let mut network = Network::new(N);
        build(&mut network);
        let system = system(&network.kinetics(Method::Rosenbrock), &network.species);
        evaluate(&system, &[0.0; N], 0.0).1[N]
    };
    let produced = [(1, 1.0)];
    assert_eq!(slope(&|n| n.mass_action(3.0, &[(0, 1.0)], &produced)), 3.0);
    assert_eq!(slope(&|n| n.mass_action(3.0, &[(0, 2.0)], &produced)), 0.0);
    // ε^(α − 1) with ε the size below which there is nothing: 1e-12.
    let root = slope(&|n| n.mass_action(3.0, &[(0, 0.5)], &produced));
    assert!((root / 3e6 - 1.0).abs() < 1e-12, "{root}");
    let third = slope(&|n| n.mass_action(1.0, &[(0, 1.5)], &produced));
    assert!((0.0..1e-5).contains(&third), "{third}");
    let monod = slope(&|n| {
        let rate = n.monod(0, 0.25);
        n.reaction(&produced, rate);
    });
    assert_eq!(monod, 4.0);
    for (unary, right) in [(Unary::Abs, 1.0), (Unary::Tanh, 1.0), (Unary::Exp, 1.0), (Unary::Cos, 0.0)] {
        let found = slope(&|n| {
            let c = n.c(0);
            let rate = n.unary(unary, c);
            n.reaction(&produced, rate);
        });
        assert_eq!(found, right, "{unary:?}");
    }
    let larger = slope(&|n| {
        let (c, zero) = (n.c(0), n.k(0.0));
        let rate = n.binary(Binary::Maximum, c, zero);
        n.reaction(&produced, rate);
    });
    assert_eq!(larger, 1.0);
}

//! Small networks, written as a test wants them, and taken over a time.

use super::support;
use lamella::chemistry::{Batch, Failure, Reactor, Scratch, Work};
use lamella::maths::operator::{Binary, Unary};
use lamella::plan::chemistry::{Chemistry, Kinetic, Kinetics, Law, Laws, Method, Splitting};
use lamella::plan::tape::{Operation, Register};
use lamella::plan::{Component, Plan, Species};

/// A network under construction: every species is a component.
#[derive(Clone)]
pub struct Network {
    pub species: Vec<Species>,
    pub n_components: usize,
    operations: Vec<Operation>,
    rates: Vec<Register>,
    reactions: Vec<Kinetic>,
}

impl Network {
    pub fn new(n: usize) -> Self {
        let species = (0..n).map(|idx| support::species(&format!("S{idx}"), 0.0, vec![(idx, 1.0)])).collect();
        Self { species, n_components: n, operations: vec![], rates: vec![], reactions: vec![] }
    }

    fn push(&mut self, operation: Operation) -> Register {
        self.operations.push(operation);
        (self.operations.len() - 1) as Register
    }

    pub fn k(&mut self, value: f64) -> Register {
        self.push(Operation::Constant(value))
    }

    pub fn c(&mut self, species: usize) -> Register {
        self.push(Operation::Input(4 + species as u16))
    }

    /// x, y, z, t
    pub fn place(&mut self, axis: u16) -> Register {
        self.push(Operation::Input(axis))
    }

    pub fn unary(&mut self, unary: Unary, a: Register) -> Register {
        self.push(Operation::Unary(unary, a))
    }

    pub fn binary(&mut self, binary: Binary, a: Register, b: Register) -> Register {
        self.push(Operation::Binary(binary, a, b))
    }

    pub fn times(&mut self, a: Register, b: Register) -> Register {
        self.binary(Binary::Multiply, a, b)
    }

    /// `c/(K + c)`
    pub fn monod(&mut self, species: usize, half: f64) -> Register {
        let (c, half) = (self.c(species), self.k(half));
        let sum = self.binary(Binary::Add, half, c);
        self.binary(Binary::Divide, c, sum)
    }

    pub fn reaction(&mut self, changes: &[(usize, f64)], rate: Register) {
        self.rates.push(rate);
        let name = format!("r{}", self.rates.len());
        self.reactions.push(Kinetic { name, changes: changes.to_vec(), law: Law::Expression });
    }

    pub fn mass_action(&mut self, constant: f64, orders: &[(usize, f64)], changes: &[(usize, f64)]) {
        let mut rate = self.k(constant);
        for &(species, order) in orders {
            let mut factor = self.c(species);
            if order != 1.0 {
                let exponent = self.k(order);
                factor = self.binary(Binary::Power, factor, exponent);
            }
            rate = self.times(rate, factor);
        }
        self.reaction(changes, rate);
        if let Some(last) = self.reactions.last_mut() {
            last.law = Law::MassAction { constant, orders: orders.to_vec() };
        }
    }

    pub fn saturation(&mut self, maximum: f64, half: f64, species: usize, changes: &[(usize, f64)]) {
        let (monod, maximum_register) = (self.monod(species, half), self.k(maximum));
        let rate = self.times(maximum_register, monod);
        self.reaction(changes, rate);
        if let Some(last) = self.reactions.last_mut() {
            last.law = Law::Saturation { maximum, half, species };
        }
    }

    pub fn kinetics(&self, method: Method) -> Kinetics {
        let laws = Laws { operations: self.operations.clone(), rates: self.rates.clone() };
        Kinetics { reactions: self.reactions.clone(), laws, method }
    }

    pub fn plan(&self, method: Method, tolerance: f64, floor: f64) -> Plan {
        let name = |idx: usize| format!("S{idx}");
        let component =
            |idx| Component { name: name(idx), initial: support::constant(0.0), is_immobile: false };
        let chemistry = Chemistry {
            kinetics: Some(self.kinetics(method)),
            equilibrium: None,
            tolerance,
            floors: vec![floor; self.n_components],
            splitting: Splitting::Lie,
            integrator: Default::default(),
        };
        Plan {
            species: self.species.clone(),
            components: (0..self.n_components).map(component).collect(),
            mixing: None,
            exchange: None,
            reactions: vec![],
            chemistry: Some(chemistry),
            ..support::front(10, 1, 1.0, 1.0)
        }
    }

    pub fn reactor(&self, method: Method, tolerance: f64, floor: f64) -> Reactor {
        Reactor::new(&self.plan(method, tolerance, floor)).unwrap().unwrap()
    }
}

/// Three acceptors that one donor and one biomass use after each other, each inhibited by the better ones.
pub fn redox_chain() -> Network {
    let mut network = Network::new(5);
    for (acceptor, rate) in [(1, 2e-5), (2, 1e-5), (3, 5e-6)] {
        let (donor, own, scale) = (network.monod(0, 0.1), network.monod(acceptor, 0.01), network.k(rate));
        let biomass = network.c(4);
        let mut rate = network.times(donor, own);
        rate = network.times(rate, scale);
        rate = network.times(rate, biomass);
        for better in 1..acceptor {
            let (c, k) = (network.c(better), network.k(0.02));
            let sum = network.binary(Binary::Add, k, c);
            let inhibition = network.binary(Binary::Divide, k, sum);
            rate = network.times(rate, inhibition);
        }
        network.reaction(&[(0, -1.0), (acceptor, -0.8), (4, 0.1)], rate);
    }
    network.mass_action(1e-7, &[(4, 1.0)], &[(4, -1.0)]);
    network
}

/// One particle from `t` over `dt`, without memory.
pub fn step(reactor: &Reactor, y: &[f64], t: f64, dt: f64) -> Result<(Vec<f64>, Work), Failure> {
    let mut columns: Vec<Vec<f64>> = y.iter().map(|&value| vec![value]).collect();
    let work = steps(reactor, &mut columns, t, dt, &mut [])?;
    Ok((columns.into_iter().map(|column| column[0]).collect(), work))
}

/// Columns of particles at the origin.
pub fn steps(
    reactor: &Reactor,
    columns: &mut [Vec<f64>],
    t: f64,
    dt: f64,
    memory: &mut [f32],
) -> Result<Work, Failure> {
    let mut components: Vec<&mut [f64]> = columns.iter_mut().map(|column| &mut column[..]).collect();
    let batch = Batch { positions: [&[]; 3], t, dt, components: &mut components, memory };
    reactor.react(batch, &mut Scratch::default())
}

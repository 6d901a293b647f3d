//! `dy/dt`, its Jacobian and its derivative by time, as programs made from the laws of a plan.
//!
//! Owns which variable stands for what, the rates' sums by the stoichiometry, and the gates of rates that
//! do not know that their reactant is exhausted. May use the graph and the plan. It deliberately picks no
//! integrator.

use super::code::Code;
use super::derive::{Derivative, safe_power};
use super::graph::{Graph, Id};
use crate::maths::interval::Interval;
use crate::maths::operator::{Binary, Unary};
use crate::plan::Species;
use crate::plan::chemistry::{Equilibrium, Kinetics};
use crate::plan::gates::{self, Gates};
use crate::plan::tape::Operation;
use std::collections::BTreeMap;

/// Arguments of roots may be below zero by what an error of this share of each concentration makes of them.
const ROUNDING: f64 = 1e-6;

/// What the variables of the programs are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Basis<'a> {
    /// Components; species are put in by their recipes.
    Components,
    /// Species, as speciation gives them; results are still those of components.
    Species(&'a Equilibrium),
}

/// Programs of a network. Inputs are the variables, then x, y, z, t.
#[derive(Debug, Clone)]
pub struct System {
    pub n_variables: usize,
    pub n_components: usize,
    /// Results: `dy/dt` of every component.
    pub rates: Code,
    /// Results: the rate of every reaction, to find the one that is no number.
    pub each: Code,
    /// Results: `dy/dt`, then the Jacobian's entries in the order of `pattern`, then `∂/∂t dy/dt` unless
    /// nothing reads the time.
    pub full: Code,
    /// `(component, variable)` of each entry that may be other than zero, row by row.
    pub pattern: Vec<(usize, usize)>,
    pub reads_time: bool,
    /// Components that are amounts, and therefore never below zero.
    pub is_positive: Vec<bool>,
    /// Whether some rate had to be told when its reactant is exhausted.
    pub is_gated: bool,
    /// Jacobian and rates at zero, if the Jacobian is constant: the network is of first order.
    pub linear: Option<Linear>,
}

/// `dy/dt = matrix · y + constant`
#[derive(Debug, Clone, PartialEq)]
pub struct Linear {
    pub matrix: Vec<f64>,
    pub constant: Vec<f64>,
}

impl System {
    /// `small` is, per component, the concentration below which none is left.
    pub fn new(
        kinetics: &Kinetics,
        species: &[Species],
        n_components: usize,
        basis: Basis<'_>,
        small: &[f64],
    ) -> Result<Self, String> {
        let mut builder = Builder::new(kinetics, species, n_components, basis, small);
        let rates = builder.rates()?;
        let n_gates = builder.n_gates;
        let dydt = builder.sums(&rates);
        let mut derivatives: Vec<Derivative> =
            (0..builder.n_variables).map(|variable| Derivative::new(variable as u16)).collect();
        let mut entries: BTreeMap<(usize, usize), Id> = BTreeMap::new();
        for (variable, derivative) in derivatives.iter_mut().enumerate() {
            let slopes: Vec<Id> = rates.iter().map(|&rate| derivative.of(&mut builder.graph, rate)).collect();
            for (component, entry) in builder.sums(&slopes).into_iter().enumerate() {
                if builder.graph.value(entry) != Some(0.0) {
                    entries.insert((component, variable), entry);
                }
            }
        }
        let mut by_time = Derivative::new((builder.n_variables + 3) as u16);
        let slopes: Vec<Id> = rates.iter().map(|&rate| by_time.of(&mut builder.graph, rate)).collect();
        let by_time = builder.sums(&slopes);
        let reads_time = by_time.iter().any(|&id| builder.graph.value(id) != Some(0.0));
        let pattern = entries.keys().copied().collect();
        let linear = builder.linear(&dydt, &entries);
        let mut roots = dydt.clone();
        roots.extend(entries.values());
        roots.extend(by_time.iter().filter(|_| reads_time));
        let n_inputs = builder.n_variables + 4;
        Ok(Self {
            n_variables: builder.n_variables,
            n_components,
            rates: Code::new(&builder.graph, n_inputs, &dydt)?,
            each: Code::new(&builder.graph, n_inputs, &rates)?,
            full: Code::new(&builder.graph, n_inputs, &roots)?,
            pattern,
            reads_time,
            is_positive: builder.is_positive,
            is_gated: n_gates > 0,
            linear,
        })
    }
}

struct Builder<'a> {
    kinetics: &'a Kinetics,
    species: &'a [Species],
    small: &'a [f64],
    n_components: usize,
    n_variables: usize,
    basis: Basis<'a>,
    is_positive: Vec<bool>,
    equilibrium: Option<&'a Equilibrium>,
    graph: Graph,
    n_gates: usize,
}

impl<'a> Builder<'a> {
    fn new(
        kinetics: &'a Kinetics,
        species: &'a [Species],
        n_components: usize,
        basis: Basis<'a>,
        small: &'a [f64],
    ) -> Self {
        let n_variables = if basis == Basis::Components { n_components } else { species.len() };
        let equilibrium = match basis {
            Basis::Components => None,
            Basis::Species(equilibrium) => Some(equilibrium),
        };
        let is_positive = gates::amounts(species, equilibrium, n_components);
        Self {
            kinetics,
            species,
            small,
            n_components,
            n_variables,
            basis,
            is_positive,
            equilibrium,
            graph: Graph::default(),
            n_gates: 0,
        }
    }

    /// The concentration of a species, never below zero.
    fn concentration(&mut self, species: usize) -> Id {
        if self.basis != Basis::Components {
            return self.graph.input(species as u16);
        }
        let recipe = &self.species[species];
        let mut sum = self.graph.constant(recipe.constant);
        let mut may_be_negative = recipe.constant < 0.0;
        for &(component, coefficient) in &recipe.terms {
            let input = self.graph.input(component as u16);
            let factor = self.graph.constant(coefficient);
            let term = self.graph.multiply(factor, input);
            sum = self.graph.add(sum, term);
            may_be_negative |= coefficient < 0.0 || !self.is_positive[component];
        }
        if !may_be_negative {
            return sum;
        }
        let zero = self.graph.constant(0.0);
        // The sum stands first: at zero its own slope counts.
        let is_positive = self.graph.binary(Binary::GreaterEqual, sum, zero);
        self.graph.select(is_positive, sum, zero)
    }

    /// The rates of all reactions: the tape, safe at zero, and gated where they would not stop.
    fn rates(&mut self) -> Result<Vec<Id>, String> {
        let operations = &self.kinetics.laws.operations;
        let mut ids: Vec<Id> = Vec::with_capacity(operations.len());
        for operation in operations {
            let read = |register: u16| ids[usize::from(register)];
            let id = match *operation {
                Operation::Constant(value) => self.graph.constant(value),
                Operation::Input(input) if input < 4 => self.graph.input(self.n_variables as u16 + input),
                Operation::Input(input) => self.concentration(usize::from(input) - 4),
                Operation::Unary(unary, a) => self.unary(unary, read(a)),
                Operation::Binary(Binary::Power, a, b) => self.power(read(a), read(b)),
                Operation::Binary(binary, a, b) => self.graph.binary(binary, read(a), read(b)),
                Operation::Select(a, b, c) => self.graph.select(read(a), read(b), read(c)),
                Operation::Table(ref lookup) => self.graph.table(&lookup.table, lookup.at.map(read)),
            };
            ids.push(id);
            if self.graph.len() > 1 << 20 {
                return Err("the rate laws are too large".to_owned());
            }
        }
        let rates: Vec<Id> =
            self.kinetics.laws.rates.iter().map(|&register| ids[usize::from(register)]).collect();
        let gates = gates::of(self.kinetics, self.species, self.equilibrium, self.n_components);
        Ok(rates.into_iter().zip(&gates).map(|(rate, gates)| self.gated(gates, rate)).collect())
    }

    fn reads_variables(&self, id: Id) -> bool {
        let is_reached = self.graph.reached(&[id]);
        (0..=id).any(|idx| {
            is_reached[idx as usize]
                && matches!(self.graph.node(idx), super::graph::Node::Input(input) if usize::from(input) < self.n_variables)
        })
    }

    /// The size below which the argument of a power counts as nothing: that of its components, if it is
    /// a sum of them.
    fn epsilon(&mut self, argument: Id) -> f64 {
        let mut largest = 0.0_f64;
        for variable in 0..self.n_variables {
            let slope = Derivative::new(variable as u16).of(&mut self.graph, argument);
            match self.graph.value(slope) {
                Some(slope) => {
                    let small = if self.basis == Basis::Components { self.small[variable] } else { 1e-18 };
                    largest = largest.max(slope.abs() * small);
                }
                None => return 1e-15,
            }
        }
        largest.clamp(1e-30, 1e30)
    }

    fn unary(&mut self, unary: Unary, a: Id) -> Id {
        match unary {
            Unary::Sqrt if self.reads_variables(a) => {
                let half = self.graph.constant(0.5);
                self.power(a, half)
            }
            Unary::Ln | Unary::Log10 if self.reads_variables(a) => {
                let epsilon = self.epsilon(a);
                let floor = self.graph.constant(epsilon);
                let raised = self.graph.binary(Binary::Maximum, a, floor);
                let value = self.graph.unary(unary, raised);
                self.within_domain(a, value)
            }
            _ => self.graph.unary(unary, a),
        }
    }

    /// Powers that are no products have slopes that are infinite at zero, or bases that may not be
    /// negative by a rounding.
    fn power(&mut self, a: Id, b: Id) -> Id {
        let is_product = self.graph.value(b).is_some_and(|b| b.fract() == 0.0 && b.abs() <= 16.0);
        let is_falling = self.graph.value(b).is_some_and(|b| b < 0.0);
        if is_product || is_falling || !self.reads_variables(a) {
            return self.graph.binary(Binary::Power, a, b);
        }
        let epsilon = self.epsilon(a);
        let value = safe_power(&mut self.graph, a, b, epsilon);
        self.within_domain(a, value)
    }

    /// A root, a power or a logarithm is no number where its argument is below zero by more than rounding.
    ///
    /// - Equation: no number for `a < −Σ_k |∂a/∂c_k| (10⁻⁶ |c_k| + ε_k)`, else the value.
    /// - Symbols: `c_k` the variables, `ε_k` the size below which none is left.
    /// - Range: arguments that are provably not negative are left alone.
    /// - Source: definition; what an error of 10⁻⁶ in every concentration makes of the argument.
    /// - Shape: one more selection.
    fn within_domain(&mut self, a: Id, value: Id) -> Id {
        let (n, is_positive, basis) = (self.n_variables, &self.is_positive, self.basis);
        let bounds = |input: u16| match usize::from(input) {
            variable if variable < n && (basis != Basis::Components || is_positive[variable]) => {
                Interval::AMOUNT
            }
            time if time == n + 3 => Interval::AMOUNT,
            _ => Interval::ANY,
        };
        if self.graph.bounds(a, &bounds).low >= 0.0 {
            return value;
        }
        let mut rounding = self.graph.constant(0.0);
        for variable in 0..self.n_variables {
            let slope = Derivative::new(variable as u16).of(&mut self.graph, a);
            if self.graph.value(slope) == Some(0.0) {
                continue;
            }
            let small = if self.basis == Basis::Components { self.small[variable] } else { 1e-18 };
            let (input, share) = (self.graph.input(variable as u16), self.graph.constant(ROUNDING));
            let (size, small) = (self.graph.unary(Unary::Abs, input), self.graph.constant(small));
            let size = self.graph.multiply(share, size);
            let (size, slope) = (self.graph.add(size, small), self.graph.unary(Unary::Abs, slope));
            let term = self.graph.multiply(slope, size);
            rounding = self.graph.add(rounding, term);
        }
        let lowest = self.graph.unary(Unary::Negate, rounding);
        let is_inside = self.graph.binary(Binary::GreaterEqual, a, lowest);
        let none = self.graph.constant(f64::NAN);
        self.graph.select(is_inside, value, none)
    }

    /// `Σ_k coefficient · value_k` per component.
    fn sums(&mut self, values: &[Id]) -> Vec<Id> {
        let mut sums = vec![self.graph.constant(0.0); self.n_components];
        for (reaction, &value) in self.kinetics.reactions.iter().zip(values) {
            for &(component, coefficient) in &reaction.changes {
                let factor = self.graph.constant(coefficient);
                let term = self.graph.multiply(factor, value);
                sums[component] = self.graph.add(sums[component], term);
            }
        }
        sums
    }

    /// The rate, faded out below `small` of each component that it would otherwise consume although
    /// nothing is left of it: forward ones by the reactants, backward ones by the products.
    fn gated(&mut self, gates: &Gates, rate: Id) -> Id {
        if gates.is_empty() {
            return rate;
        }
        self.n_gates += gates.forward.len() + gates.backward.len();
        let zero = self.graph.constant(0.0);
        let is_forward = self.graph.binary(Binary::GreaterEqual, rate, zero);
        let (forward, backward) = (self.gate(&gates.forward), self.gate(&gates.backward));
        let gate = self.graph.select(is_forward, forward, backward);
        self.graph.multiply(gate, rate)
    }

    fn gate(&mut self, components: &[usize]) -> Id {
        let one = self.graph.constant(1.0);
        let mut product = one;
        for &component in components {
            let input = self.amount(component);
            let scale = self.graph.constant(1.0 / self.small[component].max(1e-300));
            let share = self.graph.multiply(scale, input);
            let gate = self.graph.binary(Binary::Minimum, share, one);
            product = self.graph.multiply(product, gate);
        }
        product
    }

    /// What there is of a component that is an amount: its input, or the sum of its species.
    fn amount(&mut self, component: usize) -> Id {
        if self.basis == Basis::Components {
            return self.graph.input(component as u16);
        }
        let mut sum = self.graph.constant(0.0);
        for (species, share) in gates::parts(self.species, self.equilibrium, component) {
            let (input, factor) = (self.graph.input(species as u16), self.graph.constant(share));
            let term = self.graph.multiply(factor, input);
            sum = self.graph.add(sum, term);
        }
        sum
    }

    fn linear(&self, dydt: &[Id], entries: &BTreeMap<(usize, usize), Id>) -> Option<Linear> {
        let n = self.n_components;
        if self.basis != Basis::Components {
            return None;
        }
        let mut matrix = vec![0.0; n * n];
        for (&(row, column), &id) in entries {
            matrix[row * n + column] = self.graph.value(id)?;
        }
        // At zero nothing may be read but constants: neither positions nor the time.
        let is_reached = self.graph.reached(dydt);
        let reads_place = (0..self.graph.len() as Id).any(|id| {
            is_reached[id as usize]
                && matches!(self.graph.node(id), super::graph::Node::Input(input) if usize::from(input) >= n)
        });
        let values = self.graph.values(&vec![0.0; n + 4]);
        let constant = dydt.iter().map(|&id| values[id as usize]).collect();
        (!reads_place).then_some(Linear { matrix, constant })
    }
}

//! Expressions as a graph in which equal parts are one node.
//!
//! Owns the nodes, their sharing, folding and simplification. May use `maths`. It deliberately assumes
//! that numbers are finite where it drops a product with zero; what is not finite shows in the rates.

use crate::data::{Beyond, Lookup, Table};
use crate::maths::interval::Interval;
use crate::maths::operator::{Binary, Unary};
use crate::maths::vector;
use std::collections::HashMap;
use std::sync::Arc;

/// A node; operands stand before what reads them.
pub type Id = u32;

#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Node {
    /// The bits of a number.
    Constant(u64),
    Input(u16),
    Unary(Unary, Id),
    Binary(Binary, Id, Id),
    Select(Id, Id, Id),
    /// The value or a slope of a table at coordinates; those beyond its own count for nothing.
    Table(u16, Lookup, [Id; 3]),
}

/// Straight-line expressions over inputs; grows, and is never changed.
#[derive(Debug, Clone, Default)]
pub struct Graph {
    nodes: Vec<Node>,
    known: HashMap<Node, Id>,
    pub tables: Vec<Arc<Table>>,
}

impl Graph {
    pub fn node(&self, id: Id) -> Node {
        self.nodes[id as usize]
    }

    pub fn len(&self) -> usize {
        self.nodes.len()
    }

    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    fn push(&mut self, node: Node) -> Id {
        let nodes = &mut self.nodes;
        *self.known.entry(node).or_insert_with(|| {
            nodes.push(node);
            (nodes.len() - 1) as Id
        })
    }

    pub fn constant(&mut self, value: f64) -> Id {
        // One zero, and one NaN.
        let value = if value == 0.0 { 0.0 } else { value };
        self.push(Node::Constant(value.to_bits()))
    }

    pub fn input(&mut self, input: u16) -> Id {
        self.push(Node::Input(input))
    }

    /// The value, if the node is a constant.
    pub fn value(&self, id: Id) -> Option<f64> {
        match self.node(id) {
            Node::Constant(bits) => Some(f64::from_bits(bits)),
            _ => None,
        }
    }

    fn is(&self, id: Id, value: f64) -> bool {
        self.value(id) == Some(value)
    }

    pub fn unary(&mut self, unary: Unary, a: Id) -> Id {
        if let Some(value) = self.value(a) {
            return self.constant(apply_unary(unary, value));
        }
        match (unary, self.node(a)) {
            (Unary::Negate, Node::Unary(Unary::Negate, inner)) => inner,
            (Unary::Negate, Node::Binary(Binary::Subtract, b, c)) => self.binary(Binary::Subtract, c, b),
            // One logarithm serves both.
            (Unary::Log10, _) => {
                let ln = self.unary(Unary::Ln, a);
                let scale = self.constant(1.0 / std::f64::consts::LN_10);
                self.binary(Binary::Multiply, ln, scale)
            }
            _ => self.push(Node::Unary(unary, a)),
        }
    }

    pub fn binary(&mut self, binary: Binary, a: Id, b: Id) -> Id {
        if let (Some(a), Some(b)) = (self.value(a), self.value(b)) {
            return self.constant(apply_binary(binary, a, b));
        }
        match binary {
            Binary::Add => self.add(a, b),
            Binary::Subtract => self.subtract(a, b),
            Binary::Multiply => self.multiply(a, b),
            Binary::Divide => self.divide(a, b),
            Binary::Power => self.power(a, b),
            Binary::Minimum | Binary::Maximum if a == b => a,
            Binary::Minimum
            | Binary::Maximum
            | Binary::Equal
            | Binary::NotEqual
            | Binary::And
            | Binary::Or => self.push(Node::Binary(binary, a.min(b), a.max(b))),
            _ => self.push(Node::Binary(binary, a, b)),
        }
    }

    pub fn add(&mut self, a: Id, b: Id) -> Id {
        match (self.node(a), self.node(b)) {
            _ if self.is(a, 0.0) => b,
            _ if self.is(b, 0.0) => a,
            (_, Node::Unary(Unary::Negate, b)) => self.subtract(a, b),
            (Node::Unary(Unary::Negate, a), _) => self.subtract(b, a),
            (Node::Constant(x), Node::Constant(y)) => self.constant(f64::from_bits(x) + f64::from_bits(y)),
            _ => self.push(Node::Binary(Binary::Add, a.min(b), a.max(b))),
        }
    }

    pub fn subtract(&mut self, a: Id, b: Id) -> Id {
        match (self.node(a), self.node(b)) {
            _ if self.is(b, 0.0) => a,
            _ if a == b => self.constant(0.0),
            (_, Node::Unary(Unary::Negate, b)) => self.add(a, b),
            (Node::Constant(x), Node::Constant(y)) => self.constant(f64::from_bits(x) - f64::from_bits(y)),
            _ if self.is(a, 0.0) => self.unary(Unary::Negate, b),
            _ => self.push(Node::Binary(Binary::Subtract, a, b)),
        }
    }

    pub fn multiply(&mut self, a: Id, b: Id) -> Id {
        // A constant factor stands first.
        let (a, b) = if self.value(b).is_some() { (b, a) } else { (a, b) };
        match (self.node(a), self.node(b)) {
            (Node::Constant(x), Node::Constant(y)) => self.constant(f64::from_bits(x) * f64::from_bits(y)),
            _ if self.is(a, 0.0) => a,
            _ if self.is(a, 1.0) => b,
            _ if self.is(a, -1.0) => self.unary(Unary::Negate, b),
            (Node::Constant(x), Node::Binary(Binary::Multiply, c, d)) if self.value(c).is_some() => {
                let both = f64::from_bits(x) * self.value(c).unwrap_or(1.0);
                let both = self.constant(both);
                self.multiply(both, d)
            }
            (Node::Constant(x), Node::Unary(Unary::Negate, c)) => {
                let minus = self.constant(-f64::from_bits(x));
                self.multiply(minus, c)
            }
            (Node::Constant(_), _) => self.push(Node::Binary(Binary::Multiply, a, b)),
            // Constant factors come out, where they meet others.
            (_, Node::Binary(Binary::Multiply, c, d)) if self.value(c).is_some() => {
                let inner = self.multiply(a, d);
                self.multiply(c, inner)
            }
            (Node::Binary(Binary::Multiply, c, d), _) if self.value(c).is_some() => {
                let inner = self.multiply(d, b);
                self.multiply(c, inner)
            }
            (Node::Unary(Unary::Negate, c), _) => {
                let inner = self.multiply(c, b);
                self.unary(Unary::Negate, inner)
            }
            (_, Node::Unary(Unary::Negate, c)) => {
                let inner = self.multiply(a, c);
                self.unary(Unary::Negate, inner)
            }
            _ => self.push(Node::Binary(Binary::Multiply, a.min(b), a.max(b))),
        }
    }

    pub fn divide(&mut self, a: Id, b: Id) -> Id {
        if let Some(divisor) = self.value(b) {
            let inverse = 1.0 / divisor;
            if inverse.is_normal() {
                let inverse = self.constant(inverse);
                return self.multiply(inverse, a);
            }
        }
        match self.node(a) {
            _ if self.is(a, 0.0) => a,
            Node::Unary(Unary::Negate, inner) => {
                let quotient = self.divide(inner, b);
                self.unary(Unary::Negate, quotient)
            }
            Node::Binary(Binary::Multiply, c, d) if self.value(c).is_some() => {
                let quotient = self.divide(d, b);
                self.multiply(c, quotient)
            }
            _ => self.push(Node::Binary(Binary::Divide, a, b)),
        }
    }

    /// Whole powers up to 16 by multiplication, halves by a root.
    fn power(&mut self, a: Id, b: Id) -> Id {
        let Some(exponent) = self.value(b) else { return self.push(Node::Binary(Binary::Power, a, b)) };
        if exponent.abs() <= 16.0 && exponent.fract() == 0.0 {
            let size = self.whole_power(a, exponent.abs() as u32);
            if exponent >= 0.0 {
                return size;
            }
            let one = self.constant(1.0);
            return self.divide(one, size);
        }
        if exponent == 0.5 {
            return self.unary(Unary::Sqrt, a);
        }
        self.push(Node::Binary(Binary::Power, a, b))
    }

    fn whole_power(&mut self, a: Id, exponent: u32) -> Id {
        match exponent {
            0 => self.constant(1.0),
            1 => a,
            _ => {
                let half = self.whole_power(a, exponent / 2);
                let even = self.multiply(half, half);
                if exponent.is_multiple_of(2) { even } else { self.multiply(even, a) }
            }
        }
    }

    pub fn select(&mut self, condition: Id, then: Id, otherwise: Id) -> Id {
        match self.value(condition) {
            Some(value) if value != 0.0 => then,
            Some(_) => otherwise,
            None if then == otherwise => then,
            None => self.push(Node::Select(condition, then, otherwise)),
        }
    }

    /// The value of a table at coordinates.
    pub fn table(&mut self, table: &Arc<Table>, at: [Id; 3]) -> Id {
        let known = self.tables.iter().position(|own| own == table);
        let idx = known.unwrap_or_else(|| {
            self.tables.push(table.clone());
            self.tables.len() - 1
        });
        // Expressions have fewer operations than this index has values.
        self.push(Node::Table(idx as u16, Lookup::Value, at))
    }

    /// The slope of a table along one of its coordinates.
    pub fn slope(&mut self, table: u16, axis: usize, at: [Id; 3]) -> Id {
        self.push(Node::Table(table, Lookup::Slope(axis as u8), at))
    }

    /// Which of the nodes an expression reads, itself included.
    pub fn reached(&self, roots: &[Id]) -> Vec<bool> {
        let mut is_reached = vec![false; self.nodes.len()];
        roots.iter().for_each(|&root| is_reached[root as usize] = true);
        for idx in (0..self.nodes.len()).rev() {
            if is_reached[idx] {
                self.operands(idx as Id).for_each(|operand| is_reached[operand as usize] = true);
            }
        }
        is_reached
    }

    pub fn operands(&self, id: Id) -> impl Iterator<Item = Id> + use<> {
        let (operands, n) = match self.node(id) {
            Node::Constant(_) | Node::Input(_) => ([0; 3], 0),
            Node::Unary(_, a) => ([a, 0, 0], 1),
            Node::Binary(_, a, b) => ([a, b, 0], 2),
            Node::Select(a, b, c) => ([a, b, c], 3),
            Node::Table(_, _, at) => (at, 3),
        };
        operands.into_iter().take(n)
    }

    /// Between which numbers an expression stays, from the bounds of its inputs.
    pub fn bounds(&self, root: Id, of_input: &dyn Fn(u16) -> Interval) -> Interval {
        let is_reached = self.reached(&[root]);
        let mut list = vec![Interval::ANY; root as usize + 1];
        for id in (0..=root).filter(|&id| is_reached[id as usize]) {
            let read = |id: Id| list[id as usize];
            list[id as usize] = match self.node(id) {
                Node::Constant(bits) => Interval::of(f64::from_bits(bits)),
                Node::Input(input) => of_input(input),
                Node::Unary(unary, a) => Interval::unary(unary, read(a)),
                Node::Binary(binary, a, b) if a == b && binary == Binary::Multiply => {
                    Interval::binary(Binary::Power, read(a), Interval::of(2.0))
                }
                Node::Binary(binary, a, b) => Interval::binary(binary, read(a), read(b)),
                Node::Select(a, b, c) => Interval::select(read(a), read(b), read(c)),
                Node::Table(table, Lookup::Value, _) => {
                    let (low, high) = self.tables[usize::from(table)].range();
                    Interval::new(low, high)
                }
                Node::Table(..) => Interval::ANY,
            };
        }
        list[root as usize]
    }

    /// All values for given inputs, one after the other: for tests and for questions at compile time.
    pub fn values(&self, inputs: &[f64]) -> Vec<f64> {
        let mut values: Vec<f64> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let read = |id: Id| values[id as usize];
            values.push(match *node {
                Node::Constant(bits) => f64::from_bits(bits),
                Node::Input(input) => inputs[usize::from(input)],
                Node::Unary(unary, a) => apply_unary(unary, read(a)),
                Node::Binary(binary, a, b) => apply_binary(binary, read(a), read(b)),
                Node::Select(a, b, c) if read(a) != 0.0 => {
                    let _ = c;
                    read(b)
                }
                Node::Select(_, _, c) => read(c),
                Node::Table(table, lookup, at) => {
                    self.tables[usize::from(table)].look(lookup, at.map(read), Beyond::Hold)
                }
            });
        }
        values
    }
}

/// The value of an operator in programs: as in the plan's tapes, with the functions of [`vector`].
#[inline(always)]
pub fn apply_unary(unary: Unary, a: f64) -> f64 {
    match unary {
        Unary::Exp => vector::exp(a),
        Unary::Ln => vector::ln(a),
        Unary::Log10 => vector::log10(a),
        other => other.apply(a),
    }
}

#[inline(always)]
pub fn apply_binary(binary: Binary, a: f64, b: f64) -> f64 {
    match binary {
        Binary::Power => vector::pow_any(a, b),
        // NaN on either side goes through.
        Binary::Minimum => {
            let smaller = if b < a { b } else { a };
            if b.is_nan() { b } else { smaller }
        }
        Binary::Maximum => {
            let larger = if b > a { b } else { a };
            if b.is_nan() { b } else { larger }
        }
        other => other.apply(a, b),
    }
}

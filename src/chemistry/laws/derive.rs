//! Derivatives of expressions, as further expressions of the same graph.
//!
//! Owns the rules, and the powers and logarithms that are safe at zero. May use the graph. It
//! deliberately takes one-sided derivatives where there are two: those towards larger arguments.

use super::graph::{Graph, Id, Node};
use crate::data::Lookup;
use crate::maths::operator::{Binary, Unary};
use std::collections::HashMap;

/// Derivatives with respect to one input; remembers those it has taken.
#[derive(Debug)]
pub struct Derivative {
    input: u16,
    known: HashMap<Id, Id>,
}

impl Derivative {
    pub fn new(input: u16) -> Self {
        Self { input, known: HashMap::new() }
    }

    /// `∂ node / ∂ input`. Walks the operands first, so that deep expressions need no deep stack.
    pub fn of(&mut self, graph: &mut Graph, root: Id) -> Id {
        let is_reached = graph.reached(&[root]);
        for id in (0..=root).filter(|&id| is_reached[id as usize]) {
            if !self.known.contains_key(&id) {
                let derivative = self.rule(graph, id);
                self.known.insert(id, derivative);
            }
        }
        self.known[&root]
    }

    fn rule(&self, graph: &mut Graph, id: Id) -> Id {
        match graph.node(id) {
            Node::Constant(_) => graph.constant(0.0),
            Node::Input(input) => graph.constant(if input == self.input { 1.0 } else { 0.0 }),
            Node::Unary(unary, a) => {
                let da = self.known[&a];
                if graph.value(da) == Some(0.0) { da } else { unary_rule(graph, unary, id, a, da) }
            }
            Node::Binary(binary, a, b) => {
                let (da, db) = (self.known[&a], self.known[&b]);
                if graph.value(da) == Some(0.0) && graph.value(db) == Some(0.0) {
                    da
                } else {
                    binary_rule(graph, binary, id, [a, b], [da, db])
                }
            }
            Node::Select(condition, a, b) => {
                let (da, db) = (self.known[&a], self.known[&b]);
                graph.select(condition, da, db)
            }
            Node::Table(table, Lookup::Value, at) => self.table_rule(graph, table, at),
            // Nobody asks for a second derivative of a table, and between rows it is zero along each axis.
            Node::Table(..) => graph.constant(0.0),
        }
    }

    /// The chain rule over the coordinates of a table.
    fn table_rule(&self, graph: &mut Graph, table: u16, at: [Id; 3]) -> Id {
        let n_axes = graph.tables[usize::from(table)].n_axes();
        let mut sum = graph.constant(0.0);
        for (axis, id) in at.iter().enumerate().take(n_axes) {
            let inner = self.known[id];
            if graph.value(inner) == Some(0.0) {
                continue;
            }
            let slope = graph.slope(table, axis, at);
            let term = graph.multiply(slope, inner);
            sum = graph.add(sum, term);
        }
        sum
    }
}

fn unary_rule(graph: &mut Graph, unary: Unary, value: Id, a: Id, da: Id) -> Id {
    use std::f64::consts::FRAC_2_SQRT_PI;
    let slope = match unary {
        Unary::Negate => return graph.unary(Unary::Negate, da),
        Unary::Not => return graph.constant(0.0),
        Unary::Abs => {
            let (zero, minus) = (graph.constant(0.0), graph.unary(Unary::Negate, da));
            let is_positive = graph.binary(Binary::GreaterEqual, a, zero);
            return graph.select(is_positive, da, minus);
        }
        Unary::Exp => value,
        Unary::Ln => return graph.divide(da, a),
        Unary::Log10 => {
            let scaled = graph.constant(1.0 / std::f64::consts::LN_10);
            graph.divide(scaled, a)
        }
        Unary::Sqrt => {
            let half = graph.constant(0.5);
            graph.divide(half, value)
        }
        Unary::Sin => graph.unary(Unary::Cos, a),
        Unary::Cos => {
            let sine = graph.unary(Unary::Sin, a);
            graph.unary(Unary::Negate, sine)
        }
        Unary::Tanh => {
            let (one, square) = (graph.constant(1.0), graph.multiply(value, value));
            graph.subtract(one, square)
        }
        Unary::Erf | Unary::Erfc => {
            let square = graph.multiply(a, a);
            let minus = graph.unary(Unary::Negate, square);
            let bell = graph.unary(Unary::Exp, minus);
            let scale = graph.constant(if unary == Unary::Erf { FRAC_2_SQRT_PI } else { -FRAC_2_SQRT_PI });
            graph.multiply(scale, bell)
        }
    };
    graph.multiply(slope, da)
}

fn binary_rule(graph: &mut Graph, binary: Binary, value: Id, [a, b]: [Id; 2], [da, db]: [Id; 2]) -> Id {
    match binary {
        Binary::Add => graph.add(da, db),
        Binary::Subtract => graph.subtract(da, db),
        Binary::Multiply => {
            let (left, right) = (graph.multiply(da, b), graph.multiply(a, db));
            graph.add(left, right)
        }
        // (a/b)' = (a' − (a/b) b') / b: no square of b, which might be out of range.
        Binary::Divide => {
            let part = graph.multiply(value, db);
            let rest = graph.subtract(da, part);
            graph.divide(rest, b)
        }
        Binary::Power => power_rule(graph, value, [a, b], [da, db]),
        Binary::Minimum | Binary::Maximum => {
            // Where both are equal the one that leads to larger arguments: the larger slope of a maximum.
            let (or_equal, strictly) = match binary {
                Binary::Minimum => (Binary::LessEqual, Binary::Less),
                _ => (Binary::GreaterEqual, Binary::Greater),
            };
            let tied = graph.binary(binary, da, db);
            if tied == da {
                let is_first = graph.binary(or_equal, a, b);
                return graph.select(is_first, da, db);
            }
            let otherwise = if tied == db {
                db
            } else {
                let is_tied = graph.binary(Binary::Equal, a, b);
                graph.select(is_tied, tied, db)
            };
            let is_first = graph.binary(strictly, a, b);
            graph.select(is_first, da, otherwise)
        }
        _ => graph.constant(0.0),
    }
}

/// Where the exponent does not depend on the input, the base may be zero or negative.
fn power_rule(graph: &mut Graph, value: Id, [a, b]: [Id; 2], [da, db]: [Id; 2]) -> Id {
    let by_base = if is_raised(graph, a) {
        // A quotient costs less than a second power.
        let (lower, slope) = (graph.divide(value, a), graph.multiply(b, da));
        graph.multiply(slope, lower)
    } else {
        let one = graph.constant(1.0);
        let less = graph.subtract(b, one);
        let lower = graph.binary(Binary::Power, a, less);
        let slope = graph.multiply(b, lower);
        graph.multiply(slope, da)
    };
    if graph.value(db) == Some(0.0) {
        return by_base;
    }
    let ln = graph.unary(Unary::Ln, a);
    let product = graph.multiply(value, ln);
    let by_exponent = graph.multiply(product, db);
    graph.add(by_base, by_exponent)
}

/// Whether a node is `max(x, ε)` with ε > 0, and so never zero.
fn is_raised(graph: &Graph, id: Id) -> bool {
    let Node::Binary(Binary::Maximum, a, b) = graph.node(id) else { return false };
    [a, b].into_iter().any(|id| graph.value(id).is_some_and(|value| value > 0.0))
}

/// `a^b` whose derivative is finite at a = 0.
///
/// Equation: `a max(a, ε)^(b − 1)`: `a^b` above ε, and the straight line through zero below.
/// Symbols: a base, a concentration or the like; b > 0 exponent; ε the size below which a counts as none.
/// Dimensions and range: any a; negative below zero.
/// Source: definition; the usual regularisation of power laws at zero.
/// Shape: a power law that starts straight.
pub fn safe_power(graph: &mut Graph, a: Id, b: Id, epsilon: f64) -> Id {
    let floor = graph.constant(epsilon);
    let raised = graph.binary(Binary::Maximum, a, floor);
    if graph.value(b) == Some(0.5) {
        let root = graph.unary(Unary::Sqrt, raised);
        return graph.divide(a, root);
    }
    let one = graph.constant(1.0);
    let less = graph.subtract(b, one);
    let power = graph.binary(Binary::Power, raised, less);
    graph.multiply(a, power)
}

//! Resolved expressions: names gone, units gone, dimensions known.
//!
//! Owns the typed tree and its construction with folding of constants. May use the words.
//! It deliberately knows no names: `check` turns a written expression into this.

use crate::data::{Beyond, Lookup, Table};
use crate::maths::operator::{Binary, Unary};
use crate::source::Span;
use crate::units::Dimension;
use std::sync::Arc;

/// What kind of value an expression has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Type {
    /// The literal `0`, which fits any dimension.
    Zero,
    Number(Dimension),
    /// A condition.
    Truth,
}

impl Type {
    /// The dimension of a number; the literal zero counts as a plain number.
    pub fn dimension(self) -> Option<Dimension> {
        match self {
            Type::Zero => Some(Dimension::NONE),
            Type::Number(dimension) => Some(dimension),
            Type::Truth => None,
        }
    }

    /// The type of a sum, a comparison's sides or the branches of an `if`; `None` if they differ.
    pub fn unify(self, other: Type) -> Option<Type> {
        match (self, other) {
            (Type::Zero, Type::Number(_)) => Some(other),
            (Type::Number(_), Type::Zero) => Some(self),
            _ => (self == other).then_some(self),
        }
    }

    pub fn describe(self) -> String {
        match self {
            Type::Zero => "zero".to_owned(),
            Type::Number(dimension) => dimension.describe(),
            Type::Truth => "a condition".to_owned(),
        }
    }
}

/// A typed expression; all values in SI.
#[derive(Debug, Clone, PartialEq)]
pub struct Expr {
    pub span: Span,
    pub kind: Type,
    pub node: Node,
    /// Number of nodes, to bound what nested functions can grow to.
    pub size: u32,
}

#[derive(Debug, Clone, PartialEq)]
pub enum Node {
    Constant(f64),
    /// Coordinate 0, 1, 2 for x, y, z.
    Axis(usize),
    Time,
    /// The concentration of a species: the initial one in initial concentrations, the current one in rates.
    Species(usize),
    Unary(Unary, Box<Expr>),
    Binary(Binary, Box<Expr>, Box<Expr>),
    Select(Box<Expr>, Box<Expr>, Box<Expr>),
    /// A table of numbers at these coordinates.
    Table(Arc<Table>, Vec<Expr>),
}

impl Expr {
    pub fn constant(value: f64, kind: Type, span: Span) -> Self {
        Self { span, kind, node: Node::Constant(value), size: 1 }
    }

    pub fn leaf(node: Node, dimension: Dimension, span: Span) -> Self {
        Self { span, kind: Type::Number(dimension), node, size: 1 }
    }

    /// The value, if the expression is a constant.
    pub fn value(&self) -> Option<f64> {
        match self.node {
            Node::Constant(value) => Some(value),
            _ => None,
        }
    }

    pub fn unary(operator: Unary, a: Expr, kind: Type, span: Span) -> Self {
        if let Some(value) = a.value() {
            return Self::constant(operator.apply(value), kind, span);
        }
        let size = a.size.saturating_add(1);
        Self { span, kind, node: Node::Unary(operator, Box::new(a)), size }
    }

    pub fn binary(operator: Binary, a: Expr, b: Expr, kind: Type, span: Span) -> Self {
        if let (Some(left), Some(right)) = (a.value(), b.value()) {
            return Self::constant(operator.apply(left, right), kind, span);
        }
        let size = a.size.saturating_add(b.size).saturating_add(1);
        Self { span, kind, node: Node::Binary(operator, Box::new(a), Box::new(b)), size }
    }

    pub fn select(condition: Expr, then: Expr, otherwise: Expr, kind: Type, span: Span) -> Self {
        if let Some(value) = condition.value() {
            let chosen = if value != 0.0 { then } else { otherwise };
            return Self { span, kind, ..chosen };
        }
        let size = condition.size.saturating_add(then.size).saturating_add(otherwise.size).saturating_add(1);
        let node = Node::Select(Box::new(condition), Box::new(then), Box::new(otherwise));
        Self { span, kind, node, size }
    }

    /// A table at coordinates, as many as it has.
    pub fn table(table: Arc<Table>, at: Vec<Expr>, kind: Type, span: Span) -> Self {
        if let Some(values) = at.iter().map(Expr::value).collect::<Option<Vec<f64>>>() {
            return Self::constant(table.look(Lookup::Value, coordinates(&values), Beyond::Hold), kind, span);
        }
        let size = at.iter().fold(1_u32, |size, expr| size.saturating_add(expr.size));
        Self { span, kind, node: Node::Table(table, at), size }
    }

    /// Whether a species is named in it.
    pub fn names_species(&self) -> bool {
        let mut found = false;
        self.walk(&mut |expr| found |= matches!(expr.node, Node::Species(_)));
        found
    }

    /// Whether the time is named in it.
    pub fn reads_time(&self) -> bool {
        let mut found = false;
        self.walk(&mut |expr| found |= expr.node == Node::Time);
        found
    }

    /// Calls `visit` on this expression and everything below it.
    pub fn walk(&self, visit: &mut impl FnMut(&Expr)) {
        visit(self);
        match &self.node {
            Node::Constant(_) | Node::Axis(_) | Node::Time | Node::Species(_) => {}
            Node::Unary(_, a) => a.walk(visit),
            Node::Binary(_, a, b) => {
                a.walk(visit);
                b.walk(visit);
            }
            Node::Select(a, b, c) => {
                a.walk(visit);
                b.walk(visit);
                c.walk(visit);
            }
            Node::Table(_, at) => at.iter().for_each(|expr| expr.walk(visit)),
        }
    }
}

/// Up to three coordinates, zeros after them.
pub fn coordinates(values: &[f64]) -> [f64; 3] {
    std::array::from_fn(|axis| values.get(axis).copied().unwrap_or(0.0))
}

//! Expressions to tapes: shared sub-expressions once, constants already folded.

use super::tape::{Lookup, Operation, Register, Tape};
use crate::data::Beyond;
use crate::scenario::Species;
use crate::scenario::expression::{Expr, Node};
use std::collections::BTreeMap;

/// Column of x, y, z among the inputs of a tape; time follows.
pub const TIME_INPUT: u16 = 3;

/// Longest tape: registers are 16-bit numbers.
const MAX_OPERATIONS: usize = 65_000;

/// Compiles an expression over x, y, z, t; names of species stand for their initial
/// concentrations. `None` if it needs more operations than a tape can hold.
pub fn build_tape(expr: &Expr, species: &[Species]) -> Option<Tape> {
    tape(expr, species, Beyond::Hold)
}

/// The same for what results are held against: beyond the rows of a table there is nothing to compare.
pub fn build_reference(expr: &Expr, species: &[Species]) -> Option<Tape> {
    tape(expr, species, Beyond::Nothing)
}

fn tape(expr: &Expr, species: &[Species], beyond: Beyond) -> Option<Tape> {
    let mut builder = Builder::new(Some(species), beyond);
    let result = builder.add_expr(expr)?;
    if usize::from(result) + 1 != builder.operations.len() {
        // The last register is the result: repeat a shared one at the end.
        let operation = builder.operations[usize::from(result)].clone();
        builder.operations.push(operation);
    }
    Some(Tape { operations: builder.operations })
}

/// Compiles rates over x, y, z, t and the current concentrations of all species, as one program with a
/// register for each. `None` if it needs more operations than a tape can hold.
pub fn build_rates(rates: &[Expr]) -> Option<(Vec<Operation>, Vec<Register>)> {
    let mut builder = Builder::new(None, Beyond::Hold);
    let registers = rates.iter().map(|rate| builder.add_expr(rate)).collect::<Option<_>>()?;
    Some((builder.operations, registers))
}

/// Column of the first species among the inputs of rates.
pub const SPECIES_INPUT: u16 = TIME_INPUT + 1;

struct Builder<'s> {
    operations: Vec<Operation>,
    known: BTreeMap<Key, Register>,
    /// Names of species stand for the initial concentrations of these, or for current ones.
    initial: Option<&'s [Species]>,
    /// What tables are beyond their rows.
    beyond: Beyond,
}

/// An operation with the bits of its constant, so that equal ones are found.
#[derive(PartialEq, Eq, PartialOrd, Ord)]
enum Key {
    Constant(u64),
    Input(u16),
    Unary(crate::maths::operator::Unary, Register),
    Binary(crate::maths::operator::Binary, Register, Register),
    Select(Register, Register, Register),
    Table(String, [Register; 3]),
}

impl<'s> Builder<'s> {
    fn new(initial: Option<&'s [Species]>, beyond: Beyond) -> Self {
        Self { operations: Vec::new(), known: BTreeMap::new(), initial, beyond }
    }

    fn add_expr(&mut self, expr: &Expr) -> Option<Register> {
        match &expr.node {
            Node::Constant(value) => self.add(Operation::Constant(*value)),
            Node::Axis(index) => self.add(Operation::Input(u16::try_from(*index).ok()?)),
            Node::Time => self.add(Operation::Input(TIME_INPUT)),
            Node::Species(idx) => match self.initial {
                // Initial concentrations have no circles: `scenario` refused them.
                Some(species) => self.add_expr(&species[*idx].initial),
                None => self.add(Operation::Input(SPECIES_INPUT.checked_add(u16::try_from(*idx).ok()?)?)),
            },
            Node::Unary(operator, a) => {
                let a = self.add_expr(a)?;
                self.add(Operation::Unary(*operator, a))
            }
            Node::Binary(operator, a, b) => {
                let (a, b) = (self.add_expr(a)?, self.add_expr(b)?);
                self.add(Operation::Binary(*operator, a, b))
            }
            Node::Select(condition, then, otherwise) => {
                let condition = self.add_expr(condition)?;
                let (then, otherwise) = (self.add_expr(then)?, self.add_expr(otherwise)?);
                self.add(Operation::Select(condition, then, otherwise))
            }
            Node::Table(table, at) => {
                let registers = at.iter().map(|expr| self.add_expr(expr)).collect::<Option<Vec<_>>>()?;
                let first = *registers.first()?;
                let at = std::array::from_fn(|axis| registers.get(axis).copied().unwrap_or(first));
                self.add(Operation::Table(Lookup { table: table.clone(), at, beyond: self.beyond }))
            }
        }
    }

    fn add(&mut self, operation: Operation) -> Option<Register> {
        let key = match operation {
            Operation::Constant(value) => Key::Constant(value.to_bits()),
            Operation::Input(column) => Key::Input(column),
            Operation::Unary(operator, a) => Key::Unary(operator, a),
            Operation::Binary(operator, a, b) => Key::Binary(operator, a, b),
            Operation::Select(a, b, c) => Key::Select(a, b, c),
            Operation::Table(ref lookup) => Key::Table(lookup.table.hash().to_owned(), lookup.at),
        };
        if let Some(register) = self.known.get(&key) {
            return Some(*register);
        }
        if self.operations.len() >= MAX_OPERATIONS {
            return None;
        }
        let register = self.operations.len() as Register;
        self.operations.push(operation);
        self.known.insert(key, register);
        Some(register)
    }
}

//! Functions of rate laws: each is one file and one line in [`ALL`].
//!
//! Owns formulas, the rules of their dimensions and their sources. May use the words. It deliberately knows
//! no expressions of a scene: a formula is a row of steps that anyone can follow, with numbers or with trees.

mod activity;
mod arrhenius;
mod haldane;
mod inhibit;
mod monod;
#[cfg(test)]
mod tests;

use crate::maths::operator::{Binary, Unary};
use crate::units::Dimension;

/// Every function that a scene can call besides the built-in ones. A scene may define a function of such
/// a name itself; then its own holds.
pub const ALL: &[Item] =
    &[monod::ITEM, inhibit::ITEM, haldane::ITEM, arrhenius::ITEM, activity::DEBYE_HUCKEL, activity::DAVIES];

/// The item of that name.
pub fn find(name: &str) -> Option<&'static Item> {
    ALL.iter().find(|item| item.name == name)
}

/// One step of a formula: takes its operands from a stack and puts its result there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step {
    Argument(usize),
    Number(f64),
    Unary(Unary),
    Binary(Binary),
}

/// An argument with the wrong dimension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mismatch {
    pub argument: usize,
    pub expected: Dimension,
}

/// Dimensions of the arguments, `None` for the literal zero, which fits any, to that of the value.
pub type Rule = fn(&[Option<Dimension>]) -> Result<Dimension, Mismatch>;

/// What an argument may be.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bound {
    /// Zero or more.
    NotNegative,
    AboveZero,
}

impl Bound {
    pub fn allows(self, value: f64) -> bool {
        match self {
            Self::NotNegative => value >= 0.0,
            Self::AboveZero => value > 0.0,
        }
    }

    pub fn words(self) -> &'static str {
        match self {
            Self::NotNegative => "zero or more",
            Self::AboveZero => "above zero",
        }
    }
}

/// One function of the catalogue.
#[derive(Clone, Copy)]
pub struct Item {
    pub name: &'static str,
    /// Name and meaning of each argument, in order.
    pub arguments: &'static [(&'static str, &'static str)],
    pub dimension: Rule,
    /// Arguments that are bounded from below.
    pub bounds: &'static [(usize, Bound)],
    pub formula: &'static [Step],
    /// As users write it.
    pub equation: &'static str,
    /// One line for the language reference.
    pub summary: &'static str,
    /// Author, year, place.
    pub source: &'static str,
}

impl Item {
    /// Follows the formula on a stack of any values.
    pub fn follow<T: Clone>(
        &self,
        arguments: &[T],
        number: impl Fn(f64) -> T,
        unary: impl Fn(Unary, T) -> T,
        binary: impl Fn(Binary, T, T) -> T,
    ) -> Option<T> {
        let mut stack: Vec<T> = Vec::new();
        for step in self.formula {
            let value = match *step {
                Step::Argument(idx) => arguments.get(idx)?.clone(),
                Step::Number(value) => number(value),
                Step::Unary(operator) => unary(operator, stack.pop()?),
                Step::Binary(operator) => {
                    let right = stack.pop()?;
                    binary(operator, stack.pop()?, right)
                }
            };
            stack.push(value);
        }
        stack.pop()
    }

    /// The value on SI numbers.
    pub fn value(&self, arguments: &[f64]) -> Option<f64> {
        self.follow(arguments, |value| value, Unary::apply, Binary::apply)
    }
}

/// All arguments have one dimension; the value is a plain number.
fn ratio_of_alike(arguments: &[Option<Dimension>]) -> Result<Dimension, Mismatch> {
    let Some(expected) = arguments.iter().find_map(|dimension| *dimension) else {
        return Ok(Dimension::NONE);
    };
    match arguments.iter().position(|dimension| dimension.is_some_and(|found| found != expected)) {
        Some(argument) => Err(Mismatch { argument, expected }),
        None => Ok(Dimension::NONE),
    }
}

/// An argument of one fixed dimension.
fn expect(arguments: &[Option<Dimension>], argument: usize, expected: Dimension) -> Result<(), Mismatch> {
    match arguments.get(argument) {
        Some(Some(found)) if *found != expected => Err(Mismatch { argument, expected }),
        _ => Ok(()),
    }
}

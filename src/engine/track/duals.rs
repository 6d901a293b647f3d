//! Expressions over places with their gradients, 64 places at a time.
//!
//! Owns the registers. May use tapes and lanes. It deliberately knows no meaning of an expression.

#![allow(clippy::needless_range_loop)] // Loops over lanes are hot.

use super::lanes::{LANES, Lane};
use crate::data;
use crate::plan::tape::{Lookup, Operation, Tape, dual};

/// A number and its gradient, per lane.
#[derive(Debug, Clone)]
pub struct Dual<const D: usize> {
    pub value: Lane,
    pub slopes: [Lane; D],
}

impl<const D: usize> Dual<D> {
    pub const ZERO: Self = Self { value: [0.0; LANES], slopes: [[0.0; LANES]; D] };
}

/// Evaluates a tape and its gradient at 64 places; `axes` are the inputs that the axes stand for. All other
/// inputs are zero. The result is the last register.
///
/// - Equation: the chain rule, operation by operation.
/// - Symbols: registers hold values and slopes by each axis.
/// - Range: any tape that reads places.
/// - Source: A. Griewank, A. Walther, Evaluating Derivatives (2008), chapter 3.
/// - Shape: 64 lanes.
pub fn evaluate<const D: usize>(
    tape: &Tape,
    axes: [usize; D],
    positions: &[Lane; D],
    registers: &mut Vec<Dual<D>>,
) {
    registers.clear();
    for operation in &tape.operations {
        let mut result = Dual::<D>::ZERO;
        match *operation {
            Operation::Constant(value) => result.value = [value; LANES],
            Operation::Input(input) => {
                if let Some(axis) = axes.iter().position(|axis| *axis == usize::from(input)) {
                    result.value = positions[axis];
                    result.slopes[axis] = [1.0; LANES];
                }
            }
            Operation::Unary(operator, a) => {
                let a = &registers[usize::from(a)];
                for lane in 0..LANES {
                    let value = operator.apply(a.value[lane]);
                    result.value[lane] = value;
                    let slope = dual::unary(operator, a.value[lane], value);
                    for axis in 0..D {
                        result.slopes[axis][lane] = times(a.slopes[axis][lane], slope);
                    }
                }
            }
            Operation::Binary(operator, a, b) => {
                let (a, b) = (&registers[usize::from(a)], &registers[usize::from(b)]);
                for lane in 0..LANES {
                    let value = operator.apply(a.value[lane], b.value[lane]);
                    result.value[lane] = value;
                    let [by_a, by_b] = dual::binary(operator, a.value[lane], b.value[lane], value);
                    for axis in 0..D {
                        result.slopes[axis][lane] =
                            times(a.slopes[axis][lane], by_a) + times(b.slopes[axis][lane], by_b);
                    }
                }
            }
            Operation::Select(condition, a, b) => {
                let [c, a, b] = [condition, a, b].map(|register| &registers[usize::from(register)]);
                for lane in 0..LANES {
                    let taken = if c.value[lane] != 0.0 { a } else { b };
                    result.value[lane] = taken.value[lane];
                    for axis in 0..D {
                        result.slopes[axis][lane] = taken.slopes[axis][lane];
                    }
                }
            }
            Operation::Table(ref lookup) => table(lookup, registers, &mut result),
        }
        registers.push(result);
    }
}

/// A table and its gradient at 64 places.
fn table<const D: usize>(lookup: &Lookup, registers: &[Dual<D>], result: &mut Dual<D>) {
    let at = lookup.at.map(|register| &registers[usize::from(register)]);
    for lane in 0..LANES {
        let place = at.map(|register| register.value[lane]);
        result.value[lane] = lookup.table.look(data::Lookup::Value, place, lookup.beyond);
        for (own, register) in at.iter().enumerate().take(lookup.table.n_axes()) {
            let slope = lookup.table.slope(own, place);
            for axis in 0..D {
                result.slopes[axis][lane] += times(register.slopes[axis][lane], slope);
            }
        }
    }
}

/// What does not depend on a place stays so, however steep the rest is.
#[inline(always)]
fn times(slope: f64, factor: f64) -> f64 {
    if slope == 0.0 { 0.0 } else { slope * factor }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::tape::Binary;

    /// `y² x` and its gradient.
    #[test]
    fn gradients_follow_the_chain_rule() {
        let tape = Tape {
            operations: vec![
                Operation::Input(0),
                Operation::Input(1),
                Operation::Binary(Binary::Multiply, 1, 1),
                Operation::Binary(Binary::Multiply, 2, 0),
            ],
        };
        let mut registers = Vec::new();
        evaluate(&tape, [0, 1], &[[3.0; LANES], [2.0; LANES]], &mut registers);
        let result = &registers[3];
        assert_eq!((result.value[5], result.slopes[0][6], result.slopes[1][63]), (12.0, 4.0, 12.0));
    }
}

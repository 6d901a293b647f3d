//! Exact derivatives of tapes at a point, forward mode.
//!
//! Owns the derivative of each operation. May use `maths`. It deliberately works point by point: the plan
//! asks at a few states, runs have derivatives compiled into their own program.

use super::{Binary, Operation, Unary};
use crate::data;
use crate::maths::scalar;

/// Below this a power with an exponent under one is taken as steep as here.
const TINY: f64 = 1e-30;

/// Derivatives by the inputs that matter.
pub type Slopes = Vec<(usize, f64)>;

/// Values of all registers and their derivatives by `n` inputs from `first` on, register by register.
///
/// - Equation: the chain rule; `|a|`, `min`, `max` and `if` have the derivative of the side that is taken,
///   tables that towards larger coordinates.
/// - Symbols: `values[r]`; `(j, ∂(register r) / ∂(input first + j))` in `slopes[r]`, j rising, those left out
///   being zero.
/// - Range: any inputs; where a derivative is infinite so is the number.
/// - Source: A. Griewank, A. Walther, Evaluating Derivatives (2008), chapter 3.
/// - Shape: one point.
pub fn differentiate(
    operations: &[Operation],
    inputs: &[f64],
    first: usize,
    n: usize,
) -> (Vec<f64>, Vec<Slopes>) {
    let mut values = Vec::with_capacity(operations.len());
    let mut slopes: Vec<Slopes> = Vec::with_capacity(operations.len());
    for operation in operations {
        let at = |register: u16| values[usize::from(register)];
        // Value, and up to three registers with the partial derivative by each.
        let (value, parts): (f64, [Option<(u16, f64)>; 3]) = match *operation {
            Operation::Constant(value) => (value, [None; 3]),
            Operation::Input(input) => (inputs[usize::from(input)], [None; 3]),
            Operation::Unary(operator, a) => {
                let value = operator.apply(at(a));
                (value, [Some((a, unary(operator, at(a), value))), None, None])
            }
            Operation::Binary(operator, a, b) => {
                let value = operator.apply(at(a), at(b));
                let [by_a, by_b] = binary(operator, at(a), at(b), value);
                (value, [Some((a, by_a)), Some((b, by_b)), None])
            }
            Operation::Select(condition, a, b) => {
                let taken = if at(condition) != 0.0 { a } else { b };
                (at(taken), [Some((taken, 1.0)), None, None])
            }
            Operation::Table(ref lookup) => {
                let place = lookup.at.map(at);
                let value = lookup.table.look(data::Lookup::Value, place, lookup.beyond);
                let slope = |axis: usize| lookup.table.slope(axis, place);
                let parts = std::array::from_fn(|axis| Some((*lookup.reads().get(axis)?, slope(axis))));
                (value, parts)
            }
        };
        values.push(value);
        let mut own = Slopes::new();
        for (register, partial) in parts.into_iter().flatten().filter(|(_, partial)| *partial != 0.0) {
            own = plus(&own, &slopes[usize::from(register)], partial);
        }
        if let Operation::Input(input) = *operation
            && let Some(j) = usize::from(input).checked_sub(first).filter(|&j| j < n)
        {
            own.push((j, 1.0));
        }
        slopes.push(own);
    }
    (values, slopes)
}

/// `sum + factor · slopes`. What does not depend on an input stays so, however steep the rest is.
fn plus(sum: &Slopes, slopes: &Slopes, factor: f64) -> Slopes {
    let mut out = Slopes::with_capacity(sum.len() + slopes.len());
    let mut known = sum.iter().copied().peekable();
    for &(j, slope) in slopes.iter().filter(|(_, slope)| *slope != 0.0) {
        while let Some(earlier) = known.next_if(|(i, _)| *i < j) {
            out.push(earlier);
        }
        let before = known.next_if(|(i, _)| *i == j).map_or(0.0, |(_, value)| value);
        out.push((j, before + factor * slope));
    }
    out.extend(known);
    out
}

/// Derivative of `value = operator(a)`.
pub fn unary(operator: Unary, a: f64, value: f64) -> f64 {
    match operator {
        Unary::Negate => -1.0,
        Unary::Not => 0.0,
        Unary::Abs => a.signum(),
        Unary::Sqrt => 0.5 / value,
        Unary::Exp => value,
        Unary::Ln => 1.0 / a,
        Unary::Log10 => 1.0 / (a * std::f64::consts::LN_10),
        Unary::Sin => scalar::cos(a),
        Unary::Cos => -scalar::sin(a),
        Unary::Tanh => 1.0 - value * value,
        Unary::Erf => std::f64::consts::FRAC_2_SQRT_PI * scalar::exp(-a * a),
        Unary::Erfc => -std::f64::consts::FRAC_2_SQRT_PI * scalar::exp(-a * a),
    }
}

/// Derivatives of `value = a operator b` by `a` and by `b`.
pub fn binary(operator: Binary, a: f64, b: f64, value: f64) -> [f64; 2] {
    match operator {
        Binary::Add => [1.0, 1.0],
        Binary::Subtract => [1.0, -1.0],
        Binary::Multiply => [b, a],
        Binary::Divide => [1.0 / b, -value / b],
        Binary::Power => {
            let base = if b < 1.0 { a.max(TINY) } else { a };
            let by_exponent = if a > 0.0 { value * scalar::ln(a) } else { 0.0 };
            [b * Binary::Power.apply(base, b - 1.0), by_exponent]
        }
        Binary::Minimum => {
            if a <= b {
                [1.0, 0.0]
            } else {
                [0.0, 1.0]
            }
        }
        Binary::Maximum => {
            if a >= b {
                [1.0, 0.0]
            } else {
                [0.0, 1.0]
            }
        }
        Binary::Less
        | Binary::LessEqual
        | Binary::Greater
        | Binary::GreaterEqual
        | Binary::Equal
        | Binary::NotEqual
        | Binary::And
        | Binary::Or => [0.0, 0.0],
    }
}

#[cfg(test)]
mod tests {
    use super::super::Tape;
    use super::*;

    /// Central differences of every operation at points where it is smooth.
    #[test]
    fn slopes_are_those_of_differences() {
        let unary = [
            Unary::Negate,
            Unary::Abs,
            Unary::Sqrt,
            Unary::Exp,
            Unary::Ln,
            Unary::Log10,
            Unary::Sin,
            Unary::Cos,
            Unary::Tanh,
            Unary::Erf,
            Unary::Erfc,
        ];
        let binary = [
            Binary::Add,
            Binary::Subtract,
            Binary::Multiply,
            Binary::Divide,
            Binary::Power,
            Binary::Minimum,
            Binary::Maximum,
            Binary::Less,
        ];
        let mut tapes: Vec<Vec<Operation>> = Vec::new();
        let head = [Operation::Input(0), Operation::Input(1)];
        tapes.extend(unary.map(|operator| [&head[..], &[Operation::Unary(operator, 1)]].concat()));
        tapes.extend(binary.map(|operator| [&head[..], &[Operation::Binary(operator, 1, 0)]].concat()));
        tapes.push([&head[..], &[Operation::Select(0, 1, 0)]].concat());
        for operations in tapes {
            let tape = Tape { operations };
            for point in [[0.7, 1.3], [2.5, 0.4]] {
                let (values, slopes) = differentiate(&tape.operations, &point, 0, 2);
                assert_eq!(values[2].to_bits(), tape.evaluate(&point).to_bits());
                for j in 0..2 {
                    let h = 1e-6;
                    let moved = |by: f64| {
                        let mut moved = point;
                        moved[j] += by;
                        tape.evaluate(&moved)
                    };
                    let difference = (moved(h) - moved(-h)) / (2.0 * h);
                    // Central differences of smooth functions: h² and rounding over h.
                    let slope = slopes[2].iter().find(|(i, _)| *i == j).map_or(0.0, |(_, slope)| *slope);
                    assert!((slope - difference).abs() < 1e-8, "{tape:?} at {point:?} by {j}");
                }
            }
        }
    }

    #[test]
    fn a_root_at_zero_is_steep_but_finite() {
        let operations =
            [Operation::Input(0), Operation::Constant(0.5), Operation::Binary(Binary::Power, 0, 1)];
        let (values, slopes) = differentiate(&operations, &[0.0], 0, 1);
        assert_eq!(values[2], 0.0);
        assert!(matches!(slopes[2][..], [(0, slope)] if slope > 1e10 && slope.is_finite()), "{slopes:?}");
    }
}

//! Evaluation of tapes, point by point and block by block, with the same bits.
//!
//! Owns what each operation means. May use `maths`. It deliberately has no branch per point: whole
//! registers are computed one after the other.

use super::{Binary, Operation, Tape, Unary};
use crate::data;
use crate::maths::wide::Width;

/// Points that are evaluated together.
const LANE: usize = 256;

impl Tape {
    /// The value at one point. The tape must have passed [`Tape::check`] for these inputs.
    pub fn evaluate(&self, inputs: &[f64]) -> f64 {
        let mut registers: Vec<f64> = Vec::with_capacity(self.operations.len());
        for operation in &self.operations {
            let read = |register: u16| registers[usize::from(register)];
            registers.push(match *operation {
                Operation::Constant(value) => value,
                Operation::Input(input) => inputs[usize::from(input)],
                Operation::Unary(unary, a) => unary.apply(read(a)),
                Operation::Binary(binary, a, b) => binary.apply(read(a), read(b)),
                Operation::Select(condition, a, b) => select(read(condition), read(a), read(b)),
                Operation::Table(ref lookup) => {
                    lookup.table.look(data::Lookup::Value, lookup.at.map(read), lookup.beyond)
                }
            });
        }
        registers.last().copied().unwrap_or(f64::NAN)
    }

    /// The values at all points of the input columns, which are as long as `out`. `scratch` holds the
    /// registers and may be used again. The tape must have passed [`Tape::check`] for these inputs.
    pub fn evaluate_block(&self, inputs: &[&[f64]], scratch: &mut Vec<f64>, out: &mut [f64]) {
        let width = Width::widest();
        scratch.resize(self.operations.len() * LANE, 0.0);
        for start in (0..out.len()).step_by(LANE) {
            let end = (start + LANE).min(out.len());
            for (idx, operation) in self.operations.iter().enumerate() {
                let (written, rest) = scratch.split_at_mut(idx * LANE);
                let target = &mut rest[..end - start];
                width.run(Lane { operation, inputs, start, written, target });
            }
            let result = self.operations.len().saturating_sub(1) * LANE;
            out[start..end].copy_from_slice(&scratch[result..result + end - start]);
        }
    }
}

/// An operation on the points of a lane, compiled for what the machine has.
struct Lane<'a> {
    operation: &'a Operation,
    inputs: &'a [&'a [f64]],
    start: usize,
    written: &'a [f64],
    target: &'a mut [f64],
}

impl pulp::NullaryFnOnce for Lane<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { operation, inputs, start, written, target } = self;
        let n = target.len();
        let read = |register: u16| &written[usize::from(register) * LANE..][..n];
        match *operation {
            // It stays in its register, as no later lane is longer.
            Operation::Constant(value) if start == 0 => target.fill(value),
            Operation::Constant(_) => {}
            Operation::Input(input) => {
                target.copy_from_slice(&inputs[usize::from(input)][start..start + n]);
            }
            Operation::Unary(unary, a) => unary_lane(unary, read(a), target),
            Operation::Binary(binary, a, b) => binary_lane(binary, read(a), read(b), target),
            Operation::Select(condition, a, b) => {
                for (((value, &c), &a), &b) in
                    target.iter_mut().zip(read(condition)).zip(read(a)).zip(read(b))
                {
                    *value = select(c, a, b);
                }
            }
            Operation::Table(ref lookup) => {
                for (idx, value) in target.iter_mut().enumerate() {
                    let at = lookup.at.map(|register| read(register)[idx]);
                    *value = lookup.table.look(data::Lookup::Value, at, lookup.beyond);
                }
            }
        }
    }
}

/// One loop per operation, so that the choice is made once per lane.
#[inline(always)]
fn unary_lane(unary: Unary, a: &[f64], target: &mut [f64]) {
    macro_rules! each {
        ($($name:ident),*) => {
            match unary {
                $(Unary::$name => {
                    for (t, &a) in target.iter_mut().zip(a) {
                        *t = Unary::$name.apply(a);
                    }
                })*
            }
        };
    }
    each!(Negate, Not, Abs, Sqrt, Exp, Ln, Log10, Sin, Cos, Tanh, Erf, Erfc);
}

#[inline(always)]
fn binary_lane(binary: Binary, a: &[f64], b: &[f64], target: &mut [f64]) {
    if binary == Binary::Power && b.iter().all(|&b| b == 2.0) {
        // As `Power` has it, without a choice per point.
        for (t, &a) in target.iter_mut().zip(a) {
            *t = a * a;
        }
        return;
    }
    macro_rules! each {
        ($($name:ident),*) => {
            match binary {
                $(Binary::$name => {
                    for ((t, &a), &b) in target.iter_mut().zip(a).zip(b) {
                        *t = Binary::$name.apply(a, b);
                    }
                })*
            }
        };
    }
    each!(
        Add,
        Subtract,
        Multiply,
        Divide,
        Power,
        Minimum,
        Maximum,
        Less,
        LessEqual,
        Greater,
        GreaterEqual,
        Equal,
        NotEqual,
        And,
        Or
    );
}

#[inline(always)]
fn select(condition: f64, then: f64, otherwise: f64) -> f64 {
    if condition != 0.0 { then } else { otherwise }
}

#[cfg(test)]
mod tests {
    use super::*;

    const UNARY: [Unary; 12] = [
        Unary::Negate,
        Unary::Not,
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

    const BINARY: [Binary; 15] = [
        Binary::Add,
        Binary::Subtract,
        Binary::Multiply,
        Binary::Divide,
        Binary::Power,
        Binary::Minimum,
        Binary::Maximum,
        Binary::Less,
        Binary::LessEqual,
        Binary::Greater,
        Binary::GreaterEqual,
        Binary::Equal,
        Binary::NotEqual,
        Binary::And,
        Binary::Or,
    ];

    /// Every operation over every pair of awkward values: block and point evaluation agree bit by bit.
    #[test]
    fn block_and_point_give_the_same_bits() {
        let awkward = [0.0, -0.0, 1.0, -1.0, 0.5, 2.0, 1e-300, -3.7, 1e300, f64::INFINITY, f64::NAN, 700.0];
        let mut x = Vec::new();
        let mut y = Vec::new();
        for _ in 0..3 {
            for a in awkward {
                for b in awkward {
                    x.push(a);
                    y.push(b);
                }
            }
        }
        let mut tapes: Vec<Tape> = Vec::new();
        let head = [Operation::Input(0), Operation::Input(1), Operation::Constant(0.25)];
        for unary in UNARY {
            tapes.push(Tape { operations: [&head[..], &[Operation::Unary(unary, 0)]].concat() });
        }
        for binary in BINARY {
            tapes.push(Tape { operations: [&head[..], &[Operation::Binary(binary, 0, 1)]].concat() });
        }
        tapes.push(Tape { operations: [&head[..], &[Operation::Select(0, 1, 2)]].concat() });
        let (mut scratch, mut out) = (Vec::new(), vec![0.0; x.len()]);
        for tape in tapes {
            tape.check(2).unwrap();
            tape.evaluate_block(&[&x, &y], &mut scratch, &mut out);
            for idx in 0..x.len() {
                let point = tape.evaluate(&[x[idx], y[idx]]);
                assert!(
                    point.to_bits() == out[idx].to_bits() || (point.is_nan() && out[idx].is_nan()),
                    "{tape:?}"
                );
            }
        }
    }

    #[test]
    fn unsound_tapes_are_refused() {
        let tape = |operations| Tape { operations };
        assert!(tape(vec![]).check(4).is_err());
        assert!(tape(vec![Operation::Input(4)]).check(4).is_err());
        assert!(tape(vec![Operation::Unary(Unary::Abs, 0)]).check(4).is_err());
        assert!(tape(vec![Operation::Constant(1.0), Operation::Binary(Binary::Add, 0, 7)]).check(4).is_err());
        assert!(tape(vec![Operation::Constant(1.0), Operation::Unary(Unary::Abs, 0)]).check(0).is_ok());
    }
}

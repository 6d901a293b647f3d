//! What water carries that comes in, or that touches a side.
//!
//! Owns the values over the places of a side. May use tapes. It deliberately keeps no books.

use crate::maths::scalar::exp;
use crate::plan::tape::{Operation, Tape};
use crate::plan::transport::SideRule;

/// Points along each axis at which a range is looked for.
const POINTS: usize = 17;

/// A concentration for each component that parcels carry.
#[derive(Debug, Clone, PartialEq)]
pub struct Composition {
    values: Vec<Value>,
    /// Of the active axes among x, y, z.
    axes: Vec<usize>,
}

#[derive(Debug, Clone, PartialEq)]
enum Value {
    Constant(f64),
    Varies(Tape),
}

impl Composition {
    /// Of the first `n` tapes; what has none is 0.
    pub fn new(tapes: &[Tape], n: usize, axes: &[usize]) -> Self {
        let value = |component: usize| match tapes.get(component) {
            None => Value::Constant(0.0),
            Some(tape) => match tape.operations[..] {
                [Operation::Constant(value)] => Value::Constant(value),
                _ => Value::Varies(tape.clone()),
            },
        };
        Self { values: (0..n).map(value).collect(), axes: axes.to_vec() }
    }

    /// Of the water that comes in through a side.
    pub fn of_side(rule: &SideRule, n: usize, axes: &[usize]) -> Self {
        match rule {
            SideRule::Inflow(tapes) | SideRule::Held(tapes) => Self::new(tapes, n, axes),
            _ => Self::new(&[], n, axes),
        }
    }

    pub fn n(&self) -> usize {
        self.values.len()
    }

    /// The value of a component at a place.
    pub fn at(&self, component: usize, place: &[f64]) -> f64 {
        match &self.values[component] {
            Value::Constant(value) => *value,
            Value::Varies(tape) => {
                let mut inputs = [0.0; 4];
                self.axes.iter().zip(place).for_each(|(&axis, &x)| inputs[axis] = x);
                tape.evaluate(&inputs)
            }
        }
    }

    /// Lowest and highest value of a component over a box, as points of it show them.
    pub fn range(&self, component: usize, low: &[f64], high: &[f64]) -> (f64, f64) {
        if let Value::Constant(value) = self.values[component] {
            return (value, value);
        }
        let n = POINTS.pow(low.len() as u32);
        let place = |mut idx: usize| -> Vec<f64> {
            let along = |(low, high): (&f64, &f64)| {
                let part = (idx % POINTS) as f64 / (POINTS - 1) as f64;
                idx /= POINTS;
                low + part * (high - low)
            };
            low.iter().zip(high).map(along).collect()
        };
        (0..n)
            .map(|idx| self.at(component, &place(idx)))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(lowest, highest), value| {
                (lowest.min(value), highest.max(value))
            })
    }

    /// Gives a parcel these values in all its zones.
    pub fn put<const D: usize>(&self, place: [f64; D], idx: usize, n_slots: usize, columns: &mut [Vec<f64>]) {
        for component in 0..self.n() {
            let value = self.at(component, &place);
            columns[component * n_slots..][..n_slots].iter_mut().for_each(|column| column[idx] = value);
        }
    }
}

/// What a side does to what a parcel carries that touches it.
#[derive(Debug, Clone, PartialEq)]
pub enum Rinse {
    Nothing,
    /// The parcel carries what is held there.
    Held(Composition),
    /// It loses to the surface, `J = k c` in all, m/s.
    Partial(f64),
}

impl Rinse {
    pub fn new(rule: &SideRule, n: usize, axes: &[usize]) -> Self {
        match rule {
            SideRule::Held(_) | SideRule::Absorb => Self::Held(Composition::of_side(rule, n, axes)),
            SideRule::Partial(rate) => Self::Partial(*rate),
            _ => Self::Nothing,
        }
    }

    /// The value of a component after a touch.
    ///
    /// - Equation: held `c ← c_b`; absorbed `c ← 0`; at a rate `c ← c e^{−kL/D}`.
    /// - Symbols: `c_b` held concentration, `L` push of the wall, `D` dispersion normal to it, `push` their ratio.
    /// - Range: any step; exact in law for the mean concentration where drift and dispersion are constant near
    ///   the wall.
    /// - Source: seen backwards in time a parcel's path is one of the same walk with the flow turned round, and the
    ///   concentration is that of the wall it met first (held), or less by the chance to be lost there (rate):
    ///   `E dL = D c dt`, as for masses (methods, section 1.6).
    /// - Shape: one value.
    pub fn after(&self, component: usize, before: f64, push: f64, place: &[f64]) -> f64 {
        match self {
            Self::Nothing => before,
            Self::Held(composition) => composition.at(component, place),
            Self::Partial(rate) if *rate > 0.0 => before * exp(-rate * push),
            Self::Partial(_) => before,
        }
    }
}

//! Bounds of expressions whose inputs are known by their bounds only.
//!
//! Owns the rules of operators on intervals. May use the operators. It deliberately assumes that numbers are
//! finite where one factor is zero, and forgets that the same input may stand in two places: bounds may be
//! too wide, never too narrow.

use super::operator::{Binary, Unary};
use super::{scalar, vector};

/// All numbers from `low` to `high`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    pub low: f64,
    pub high: f64,
}

impl Interval {
    pub const ANY: Self = Self { low: f64::NEG_INFINITY, high: f64::INFINITY };
    pub const ZERO: Self = Self { low: 0.0, high: 0.0 };
    /// Zero and above.
    pub const AMOUNT: Self = Self { low: 0.0, high: f64::INFINITY };
    /// What is false or true.
    const TRUTH: Self = Self { low: 0.0, high: 1.0 };

    /// A bound that is no number says nothing.
    pub fn new(low: f64, high: f64) -> Self {
        let low = if low.is_nan() { f64::NEG_INFINITY } else { low };
        let high = if high.is_nan() { f64::INFINITY } else { high };
        Self { low, high }
    }

    pub fn of(value: f64) -> Self {
        Self::new(value, value)
    }

    fn value(self) -> Option<f64> {
        (self.low == self.high).then_some(self.low)
    }

    fn has(self, value: f64) -> bool {
        self.low <= value && value <= self.high
    }

    /// `None` if it may be either.
    fn truth(self) -> Option<bool> {
        if self == Self::ZERO {
            return Some(false);
        }
        (!self.has(0.0)).then_some(true)
    }

    fn of_truth(truth: Option<bool>) -> Self {
        truth.map_or(Self::TRUTH, |truth| Self::of(f64::from(u8::from(truth))))
    }

    fn union(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn negated(self) -> Self {
        Self { low: -self.high, high: -self.low }
    }

    pub fn unary(unary: Unary, a: Self) -> Self {
        if let Some(value) = a.value() {
            return Self::of(unary.apply(value));
        }
        let rising = |f: fn(f64) -> f64| Self::new(f(a.low), f(a.high));
        match unary {
            Unary::Negate => a.negated(),
            Unary::Not => Self::of_truth(a.truth().map(|truth| !truth)),
            Unary::Abs if a.low >= 0.0 => a,
            Unary::Abs => Self::new(0.0, a.high.max(-a.low)),
            Unary::Exp => Self::new(vector::exp(a.low).max(0.0), vector::exp(a.high)),
            Unary::Sqrt if a.low >= 0.0 => rising(f64::sqrt),
            Unary::Ln if a.low > 0.0 => rising(scalar::ln),
            Unary::Log10 if a.low > 0.0 => rising(scalar::log10),
            Unary::Sqrt | Unary::Ln | Unary::Log10 => Self::ANY,
            Unary::Sin | Unary::Cos => Self::new(-1.0, 1.0),
            Unary::Tanh | Unary::Erf => {
                Self::new(if a.low >= 0.0 { 0.0 } else { -1.0 }, if a.high <= 0.0 { 0.0 } else { 1.0 })
            }
            Unary::Erfc => Self::new(0.0, 2.0),
        }
    }

    pub fn binary(binary: Binary, a: Self, b: Self) -> Self {
        if let (Some(a), Some(b)) = (a.value(), b.value())
            && binary.apply(a, b).is_finite()
        {
            return Self::of(binary.apply(a, b));
        }
        match binary {
            Binary::Add => Self::new(a.low + b.low, a.high + b.high),
            Binary::Subtract => Self::new(a.low - b.high, a.high - b.low),
            Binary::Multiply => Self::product(a, b),
            Binary::Divide if a == Self::ZERO => a,
            Binary::Divide if b.low >= 0.0 || b.high <= 0.0 => Self::product(a, b.inverse()),
            Binary::Divide => Self::ANY,
            Binary::Power => Self::power(a, b),
            Binary::Minimum => Self::new(a.low.min(b.low), a.high.min(b.high)),
            Binary::Maximum => Self::new(a.low.max(b.low), a.high.max(b.high)),
            Binary::Less => Self::decided(a.high < b.low, a.low >= b.high),
            Binary::LessEqual => Self::decided(a.high <= b.low, a.low > b.high),
            Binary::Greater => Self::decided(b.high < a.low, b.low >= a.high),
            Binary::GreaterEqual => Self::decided(b.high <= a.low, b.low > a.high),
            Binary::Equal | Binary::NotEqual => {
                let is_apart = a.high < b.low || b.high < a.low;
                Self::of_truth(is_apart.then_some(binary == Binary::NotEqual))
            }
            Binary::And => Self::of_truth(match (a.truth(), b.truth()) {
                (Some(false), _) | (_, Some(false)) => Some(false),
                (Some(true), Some(true)) => Some(true),
                _ => None,
            }),
            Binary::Or => Self::of_truth(match (a.truth(), b.truth()) {
                (Some(true), _) | (_, Some(true)) => Some(true),
                (Some(false), Some(false)) => Some(false),
                _ => None,
            }),
        }
    }

    pub fn select(condition: Self, then: Self, otherwise: Self) -> Self {
        match condition.truth() {
            Some(true) => then,
            Some(false) => otherwise,
            None => then.union(otherwise),
        }
    }

    fn decided(is_always: bool, is_never: bool) -> Self {
        Self::of_truth(if is_always { Some(true) } else { is_never.then_some(false) })
    }

    fn product(a: Self, b: Self) -> Self {
        // Nothing of whatever there is.
        let times = |a: f64, b: f64| if a == 0.0 || b == 0.0 { 0.0 } else { a * b };
        let corners =
            [times(a.low, b.low), times(a.low, b.high), times(a.high, b.low), times(a.high, b.high)];
        Self::new(
            corners.into_iter().fold(f64::INFINITY, f64::min),
            corners.into_iter().fold(f64::NEG_INFINITY, f64::max),
        )
    }

    /// Of what has one sign.
    fn inverse(self) -> Self {
        if self.high <= 0.0 && self.low < 0.0 {
            return self.negated().inverse().negated();
        }
        let low = if self.low == 0.0 { f64::INFINITY } else { 1.0 / self.low };
        Self::new(if self.high == f64::INFINITY { 0.0 } else { 1.0 / self.high }, low)
    }

    fn power(a: Self, b: Self) -> Self {
        let exponent = b.value();
        if a.low < 0.0 {
            let is_even = exponent.is_some_and(|b| b.fract() == 0.0 && (0.5 * b).fract() == 0.0);
            return if is_even { Self::AMOUNT } else { Self::ANY };
        }
        if a == Self::ZERO && b.low > 0.0 {
            return a;
        }
        match exponent {
            Some(b) if b > 0.0 && a.high.is_finite() => {
                Self::new(scalar::pow(a.low, b), scalar::pow(a.high, b))
            }
            Some(b) if b > 0.0 => Self::new(scalar::pow(a.low, b), f64::INFINITY),
            _ => Self::AMOUNT,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers within two intervals give numbers within what the rule says.
    #[test]
    fn no_value_lies_outside() {
        use Binary::*;
        let ends = [f64::NEG_INFINITY, -2.0, -1.0, 0.0, 0.5, 1.0, 2.0, f64::INFINITY];
        let samples = [-1e3, -2.0, -1.5, -1.0, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 1e3];
        let intervals: Vec<Interval> = ends
            .iter()
            .flat_map(|&low| ends.iter().map(move |&high| (low, high)))
            .filter(|(low, high)| low <= high && (low.is_finite() || high != low))
            .map(|(low, high)| Interval { low, high })
            .collect();
        let within = |found: f64, bounds: Interval, what: &dyn std::fmt::Debug| {
            assert!(!found.is_finite() || bounds.has(found), "{what:?}: {found} is not in {bounds:?}");
        };
        let inside = |interval: Interval| samples.into_iter().filter(move |value| interval.has(*value));
        for &a in &intervals {
            use Unary::*;
            for unary in [Negate, Not, Abs, Sqrt, Exp, Ln, Log10, Sin, Cos, Tanh, Erf, Erfc] {
                inside(a).for_each(|x| within(unary.apply(x), Interval::unary(unary, a), &(unary, a, x)));
            }
            for &b in &intervals {
                for binary in [
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
                    Or,
                ] {
                    let bounds = Interval::binary(binary, a, b);
                    for (x, y) in inside(a).flat_map(|x| inside(b).map(move |y| (x, y))) {
                        within(binary.apply(x, y), bounds, &(binary, a, b, x, y));
                    }
                }
            }
        }
    }

    #[test]
    fn what_is_plain_is_seen() {
        let (amount, two) = (Interval::AMOUNT, Interval::of(2.0));
        let sum = Interval::binary(Binary::Add, two, amount);
        assert_eq!(sum, Interval { low: 2.0, high: f64::INFINITY });
        // c / (K + c)
        assert_eq!(Interval::binary(Binary::Divide, amount, sum).low, 0.0);
        assert_eq!(Interval::binary(Binary::Multiply, Interval::ZERO, Interval::ANY), Interval::ZERO);
        // if 0 > c then … else 1
        let never = Interval::binary(Binary::Greater, Interval::ZERO, amount);
        assert_eq!(Interval::select(never, Interval::ANY, two), two);
    }
}

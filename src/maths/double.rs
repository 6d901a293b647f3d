//! Numbers of 32 digits: a double and what it leaves of the number.
//!
//! Owns their arithmetic, and the exponential. May use nothing else. It deliberately is not fast: it is for what
//! 16 digits cannot decide.

use std::ops::{Add, AddAssign, Mul, Neg, Sub, SubAssign};

/// `high + low`, with `high` the nearest double.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Double {
    high: f64,
    low: f64,
}

/// Splits a double into two of 26 bits each.
const SPLIT: f64 = 134_217_729.0;

/// `a + b` and what is lost of it; exact if `|a| ≥ |b|`.
fn quick_sum(a: f64, b: f64) -> Double {
    let high = a + b;
    Double { high, low: b - (high - a) }
}

/// `a + b`, exact.
fn sum(a: f64, b: f64) -> Double {
    let high = a + b;
    let of_b = high - a;
    Double { high, low: (a - (high - of_b)) + (b - of_b) }
}

/// `a b`, exact (Dekker's product) from 1e-140 to 1e140.
fn product(a: f64, b: f64) -> Double {
    let high = a * b;
    let halves = |x: f64| {
        let top = SPLIT * x - (SPLIT * x - x);
        (top, x - top)
    };
    let ((a_top, a_rest), (b_top, b_rest)) = (halves(a), halves(b));
    let low = ((a_top * b_top - high) + a_top * b_rest + a_rest * b_top) + a_rest * b_rest;
    Double { high, low }
}

impl Double {
    pub const ZERO: Self = Self { high: 0.0, low: 0.0 };
    pub const ONE: Self = Self { high: 1.0, low: 0.0 };
    /// To 32 digits.
    const LN_2: Self = Self { high: std::f64::consts::LN_2, low: 2.319_046_813_846_299_6e-17 };

    /// The nearest double.
    pub fn nearest(self) -> f64 {
        self.high
    }

    pub fn abs(self) -> Self {
        if self.high < 0.0 { -self } else { self }
    }

    pub fn is_finite(self) -> bool {
        self.high.is_finite()
    }

    /// By long division, three digits of 53 bits.
    pub fn over(self, other: Self) -> Self {
        let first = self.high / other.high;
        let rest = self - other.times(first);
        let second = rest.high / other.high;
        let third = (rest - other.times(second)).high / other.high;
        quick_sum(first, second) + Self::from(third)
    }

    /// The product with a double.
    pub fn times(self, other: f64) -> Self {
        let both = product(self.high, other);
        quick_sum(both.high, both.low + self.low * other)
    }

    /// `e^x`.
    ///
    /// - Equation: `e^x = 2^k (1 + s)^512`, `s = e^r − 1`, `r = (x − k ln 2)/512`; `s ← 2s + s²` nine times.
    /// - Range: 0 below −700 and infinite above 700.
    /// - Source: Hida, Li & Bailey 2001, Algorithms for quad-double precision floating point arithmetic, §5.
    pub fn exponential(self) -> Self {
        if self.high < -700.0 {
            return Self::ZERO;
        }
        if self.high > 700.0 {
            return Self::from(f64::INFINITY);
        }
        let power = (self.high / std::f64::consts::LN_2).round();
        let rest = self - Self::LN_2.times(power);
        let r = Self { high: rest.high / 512.0, low: rest.low / 512.0 };
        let (mut s, mut term) = (r, r);
        // r is below 7e-4: its tenth power is below 1e-31 of it.
        for order in 2..=11 {
            term = (term * r).over(Self::from(f64::from(order)));
            s += term;
        }
        for _ in 0..9 {
            s = s.times(2.0) + s * s;
        }
        let mut value = Self::ONE + s;
        // In two halves: the power of two alone may be out of range.
        let exponent = power as i32;
        for part in [exponent / 2, exponent - exponent / 2] {
            let scale = f64::from_bits(((1023 + part) as u64) << 52);
            value = Self { high: value.high * scale, low: value.low * scale };
        }
        value
    }
}

impl From<f64> for Double {
    fn from(high: f64) -> Self {
        Self { high, low: 0.0 }
    }
}

impl Neg for Double {
    type Output = Self;

    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Add for Double {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let (high, low) = (sum(self.high, other.high), sum(self.low, other.low));
        let first = quick_sum(high.high, high.low + low.high);
        quick_sum(first.high, first.low + low.low)
    }
}

impl Sub for Double {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Double {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let both = product(self.high, other.high);
        quick_sum(both.high, both.low + (self.high * other.low + self.low * other.high))
    }
}

impl AddAssign for Double {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl SubAssign for Double {
    fn sub_assign(&mut self, other: Self) {
        *self = *self - other;
    }
}

impl PartialOrd for Double {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        let high = self.high.partial_cmp(&other.high)?;
        Some(high.then(self.low.partial_cmp(&other.low)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a double cannot hold: 1 + 2⁻⁹⁰ and its square, in whole numbers.
    #[test]
    fn sums_products_and_quotients_keep_what_doubles_lose() {
        let tiny = 2.0_f64.powi(-90);
        let a = Double::ONE + Double::from(tiny);
        assert_eq!((a - Double::ONE).nearest(), tiny);
        assert_eq!((a * a - Double::ONE).nearest(), 2.0 * tiny);
        let third = Double::ONE.over(Double::from(3.0));
        assert!((third.times(3.0) - Double::ONE).abs().nearest() < 1e-31);
        let x = Double::from(1e15) + Double::from(1.2345e-16);
        assert!(((x - Double::from(1e15)).nearest() - 1.2345e-16).abs() < 1e-17);
    }

    /// e and e^10 in 40 digits (mpmath), as a double and its rest.
    #[test]
    fn the_exponential_has_thirty_digits() {
        let e = Double::from(std::f64::consts::E) + Double::from(1.445_646_891_729_250_2e-16);
        assert!((Double::ONE.exponential() - e).abs().nearest() < 2e-31);
        for (a, b) in [(30.0, -12.5), (299.0, 1e-9), (-600.0, 599.75), (0.125, 1e-20)] {
            let (a, b) = (Double::from(a), Double::from(b));
            let (whole, parts) = ((a + b).exponential(), a.exponential() * b.exponential());
            assert!((whole - parts).abs().nearest() < 1e-29 * whole.nearest(), "{a:?} {b:?}");
        }
        assert_eq!(Double::from(-1e15).exponential(), Double::ZERO);
    }
}

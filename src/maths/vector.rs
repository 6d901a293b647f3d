//! Exponentials, logarithms and powers without branches, which vectorise in plain loops.
//!
//! Owns `exp`, `ln`, `pow` and their kin for laws that are evaluated over many particles. May use nothing
//! else of the crate. It deliberately fuses no multiplication with an addition and calls nothing: wide
//! code, narrow code and a single call give the same bits.

use std::f64::consts::LN_10;

/// Adding it rounds to a whole number, which then stands in the lowest bits; good for |x| < 2⁵¹.
const ROUND: f64 = 6_755_399_441_055_744.0;
const LN_2_HIGH: f64 = 6.931_471_803_691_238e-1;
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// `e^x`.
///
/// Equation: `e^x = 2ⁿ (1 + m)`, `m = e^r − 1`, `r = x − n ln 2`, `|r| ≤ ½ ln 2`.
/// Symbols: n the nearest whole number to `x / ln 2`.
/// Dimensions and range: none; any x, 0 below −745.2, infinite above 709.8, NaN for NaN; right to 1 ulp.
/// Source: W. J. Cody and W. Waite 1980, Software Manual for the Elementary Functions (reduction); Taylor
/// series of degree 13, whose rest is 1.2e-17 of m.
/// Shape: rises from 0 through 1 at x = 0.
#[inline(always)]
pub fn exp(x: f64) -> f64 {
    let (minus_one, low, high) = reduced(x);
    (1.0 + minus_one) * low * high
}

/// `(e^x, e^x − 1)`, both with their own small error.
///
/// Equation: `e^x − 1 = 2ⁿ m + (2ⁿ − 1)`.
/// Symbols: as for [`exp`].
/// Dimensions and range: none; x ≤ 700; `e^x − 1` is right to 3 ulp.
/// Source: definition.
/// Shape: the second is x near zero, and −1 far below.
#[inline(always)]
pub fn exp_and_less_one(x: f64) -> (f64, f64) {
    let (minus_one, low, high) = reduced(x);
    let scale = low * high;
    ((1.0 + minus_one) * low * high, minus_one * scale + (scale - 1.0))
}

/// `e^x` of what is not positive, for kernels: cheaper than [`exp`], and the same bits down to −708.
///
/// Equation: as for [`exp`], with one power of two.
/// Symbols: as there.
/// Dimensions and range: none; −708 to 0, below it e^−708 (3e-308); right to 1 ulp.
/// Source: as for [`exp`].
/// Shape: rises from nearly 0 to 1.
#[inline(always)]
pub fn exp_of_negative(x: f64) -> f64 {
    let (power, r) = reduced_negative(x);
    exp_near(r) * power
}

/// The two parts of [`exp_of_negative`]: a power of two, and the rest of the exponent.
#[inline(always)]
pub fn reduced_negative(x: f64) -> (f64, f64) {
    let x = if x < -708.0 { -708.0 } else { x };
    let n = x * std::f64::consts::LOG2_E + ROUND;
    let whole = n - ROUND;
    let r = (x - whole * LN_2_HIGH) - whole * LN_2_LOW;
    let power = f64::from_bits((n.to_bits() << 52).wrapping_add(1.0_f64.to_bits()));
    (power, r)
}

/// `e^r` of a rest.
#[inline(always)]
pub fn exp_near(r: f64) -> f64 {
    1.0 + exp_less_one_near(r)
}

/// `e^r − 1` and two powers of two: together `e^x`. Two, as one could not reach the smallest numbers.
#[inline(always)]
fn reduced(x: f64) -> (f64, f64, f64) {
    let above = if x < -746.0 { -746.0 } else { x };
    let x = if above > 710.0 { 710.0 } else { above };
    let n = (x * std::f64::consts::LOG2_E + ROUND) - ROUND;
    let r = (x - n * LN_2_HIGH) - n * LN_2_LOW;
    let half = n * 0.5 + ROUND;
    let rest = (n - (half - ROUND)) + ROUND;
    let power = |whole: f64| f64::from_bits((whole.to_bits() << 52).wrapping_add(1.0_f64.to_bits()));
    (exp_less_one_near(r), power(half), power(rest))
}

/// Taylor's series of `e^r − 1` for |r| ≤ 0.35, summed as a tree, which the processor overlaps.
#[inline(always)]
fn exp_less_one_near(r: f64) -> f64 {
    let square = r * r;
    let fourth = square * square;
    let a = 1.0 / 6.0 + r * (1.0 / 24.0);
    let b = 1.0 / 120.0 + r * (1.0 / 720.0);
    let c = 1.0 / 5040.0 + r * (1.0 / 40_320.0);
    let d = 1.0 / 362_880.0 + r * (1.0 / 3_628_800.0);
    let e = 1.0 / 39_916_800.0 + r * (1.0 / 479_001_600.0);
    let f = 1.0 / 6_227_020_800.0;
    let tail = (a + square * b) + fourth * ((c + square * d) + fourth * (e + square * f));
    r + (0.5 * square + square * r * tail)
}

/// The natural logarithm.
///
/// Equation: `ln x = n ln 2 + ln(1 + f)`, `x = 2ⁿ (1 + f)`, `1 + f ∈ [√½, √2)`; with `s = f/(2 + f)`,
/// `ln(1 + f) = f − (f²/2 − s (f²/2 + R(s²)))`.
/// Symbols: n, f from the bits of x.
/// Dimensions and range: none; −∞ at 0, NaN below, NaN for NaN; right to 1 ulp.
/// Source: FDLIBM, `e_log.c` (coefficients of R), Sun Microsystems 1993.
/// Shape: rises from −∞ through 0 at x = 1.
#[inline(always)]
pub fn ln(x: f64) -> f64 {
    const TINY: f64 = f64::MIN_POSITIVE;
    const ROOT_HALF: u64 = 0x3fe6_a09e_0000_0000;
    // 2⁵² as bits: a whole number below it, put in the lowest bits, is read back by a subtraction.
    const WHOLE: u64 = 0x4330_0000_0000_0000;
    let is_subnormal = x < TINY;
    let normal = if is_subnormal { x * 18_014_398_509_481_984.0 } else { x };
    let shifted = normal.to_bits().wrapping_add(1.0_f64.to_bits() - ROOT_HALF);
    let exponent = f64::from_bits((shifted >> 52) | WHOLE) - (4_503_599_627_370_496.0 + 1023.0);
    let n = if is_subnormal { exponent - 54.0 } else { exponent };
    let f = f64::from_bits((shifted & 0x000f_ffff_ffff_ffff).wrapping_add(ROOT_HALF)) - 1.0;
    let s = f / (2.0 + f);
    let z = s * s;
    let w = z * z;
    let odd =
        w * (3.999_999_999_940_942e-1 + w * (2.222_219_843_214_978_4e-1 + w * 1.531_383_769_920_937_3e-1));
    let even = z
        * (6.666_666_666_666_735e-1
            + w * (2.857_142_874_366_239e-1
                + w * (1.818_357_216_161_805e-1 + w * 1.479_819_860_511_658_6e-1)));
    let half_square = 0.5 * f * f;
    let value = n * LN_2_HIGH - ((half_square - (s * (half_square + (odd + even)) + n * LN_2_LOW)) - f);
    let value = if x == f64::INFINITY { x } else { value };
    let value = if x == 0.0 { f64::NEG_INFINITY } else { value };
    // Written so that NaN takes it, too.
    if x >= 0.0 { value } else { f64::NAN }
}

/// The decimal logarithm; as right as [`ln`] to 2 ulp.
#[inline(always)]
pub fn log10(x: f64) -> f64 {
    ln(x) * (1.0 / LN_10)
}

/// `x^y` for x ≥ 0.
///
/// Equation: `x^y = e^(y ln x)`.
/// Symbols: x base, y exponent.
/// Dimensions and range: none; 0 for `0^y` with y > 0, 1 for `x^0`; NaN for x < 0. Right to
/// `2 + 2 |y ln x|` ulp.
/// Source: definition.
/// Shape: a power law.
#[inline(always)]
pub fn pow(x: f64, y: f64) -> f64 {
    let value = exp(y * ln(x));
    if y == 0.0 { 1.0 } else { value }
}

/// `x^y` for any x: below zero y must be a whole number.
#[inline(always)]
pub fn pow_any(x: f64, y: f64) -> f64 {
    let size = pow(x.abs(), y);
    // Whole numbers above 2⁵¹ do not matter here: their powers are 0, 1 or infinite.
    let is_whole = (y + ROUND) - ROUND == y;
    let half = 0.5 * y;
    let is_even = (half + ROUND) - ROUND == half;
    let signed = if is_even { size } else { -size };
    let below = if is_whole { signed } else { f64::NAN };
    if x < 0.0 { below } else { size }
}

#[cfg(test)]
mod tests {
    use super::super::scalar;
    use super::super::wide::Width;
    use super::*;

    /// Distance in units of the last place of the right value; equal infinities are 0 apart.
    fn ulps(found: f64, right: f64) -> f64 {
        if found.to_bits() == right.to_bits() || (found.is_nan() && right.is_nan()) {
            return 0.0;
        }
        let ulp = (f64::from_bits(right.abs().to_bits() + 1) - right.abs()).max(f64::from_bits(1));
        (found - right).abs() / ulp
    }

    /// Numbers between 0 and 1, the same at every call.
    fn fractions(n: u32) -> impl Iterator<Item = f64> {
        (0..n).map(|k| f64::from(k.wrapping_mul(2_654_435_761)) / 4_294_967_296.0)
    }

    #[test]
    fn exp_for_kernels_has_the_bits_of_exp() {
        for u in fractions(400_000) {
            for x in [-u, -40.0 * u, -708.0 * u, -0.0, -1e-9 * u] {
                assert_eq!(exp_of_negative(x).to_bits(), exp(x).to_bits(), "{x}");
            }
            assert!(exp_of_negative(-708.0 - 1e300 * u) < 1e-300);
        }
    }

    /// The library is itself right to 1 ulp, which is added to the bound.
    #[test]
    fn exp_is_right_to_one_unit() {
        for u in fractions(400_000) {
            for x in [u * 1500.0 - 750.0, u * 2.0 - 1.0, u * 1e-8, 40.0 * u - 39.0] {
                assert!(ulps(exp(x), scalar::exp(x)) <= 2.0, "{x}: {} {}", exp(x), scalar::exp(x));
            }
            for x in [-40.0 * u, 3.0 * u - 1.5, -1e-6 * u, -1e-300 * u] {
                let (value, less_one) = exp_and_less_one(x);
                assert_eq!(value.to_bits(), exp(x).to_bits());
                let right = scalar::expm1(x);
                assert!(ulps(less_one, right) <= 4.0, "{x}: {less_one} {right}");
            }
        }
    }

    #[test]
    fn ln_is_right_to_one_unit() {
        for u in fractions(400_000) {
            let bits = (u * 9.218_868_437_227_405e18) as u64;
            for x in [f64::from_bits(bits), u, 0.7 + 0.75 * u, 1.0 + 1e-7 * u, f64::from_bits(bits >> 12)] {
                assert!(ulps(ln(x), scalar::ln(x)) <= 2.0, "{x}: {} {}", ln(x), scalar::ln(x));
            }
        }
    }

    #[test]
    fn pow_is_as_right_as_stated() {
        for (u, v) in fractions(300_000).zip(fractions(300_001).skip(1)) {
            for (x, y) in [(u, 4.0 * v), (1e3 * u, 8.0 * v - 4.0), (scalar::exp(60.0 * u - 30.0), 20.0 * v)] {
                if x == 0.0 {
                    continue;
                }
                let bound = 3.0 + 2.0 * (y * scalar::ln(x)).abs();
                let (found, right) = (pow(x, y), scalar::pow(x, y));
                assert!(ulps(found, right) <= bound, "{x}^{y}: {found} {right}");
            }
        }
    }

    #[test]
    fn special_values() {
        assert_eq!(exp(f64::NEG_INFINITY), 0.0);
        assert_eq!(exp(f64::INFINITY), f64::INFINITY);
        assert_eq!((exp(0.0), exp(-0.0)), (1.0, 1.0));
        assert!(exp(f64::NAN).is_nan() && ln(f64::NAN).is_nan() && pow(f64::NAN, 1.0).is_nan());
        assert_eq!(exp(-745.0), scalar::exp(-745.0));
        assert_eq!(exp(709.9), f64::INFINITY);
        assert_eq!((ln(0.0), ln(-0.0)), (f64::NEG_INFINITY, f64::NEG_INFINITY));
        assert_eq!(ln(f64::INFINITY), f64::INFINITY);
        assert_eq!(ln(1.0), 0.0);
        assert!(ln(-1.0).is_nan() && ln(f64::NEG_INFINITY).is_nan());
        assert_eq!((pow(0.0, 0.3), pow(0.0, 2.5), pow(0.0, 0.0)), (0.0, 0.0, 1.0));
        assert_eq!(pow(0.0, -1.0), f64::INFINITY);
        assert!(pow(-1.0, 2.0).is_nan() && pow_any(-1.0, 2.5).is_nan());
        assert_eq!((pow_any(-1.0, 3.0), pow_any(-1.0, 2.0), pow_any(-1.0, 0.0)), (-1.0, 1.0, 1.0));
    }

    struct All<'a>(&'a [f64], &'a mut [[f64; 5]]);

    impl pulp::NullaryFnOnce for All<'_> {
        type Output = ();
        #[inline(always)]
        fn call(self) {
            for (x, out) in self.0.iter().zip(self.1) {
                let (value, less_one) = exp_and_less_one(*x);
                *out = [value, less_one, ln(*x), pow(*x, 0.3), pow_any(*x, 3.0)];
            }
        }
    }

    /// Wide code, narrow code and single calls.
    #[test]
    fn all_widths_give_the_same_bits() {
        let mut xs: Vec<f64> = fractions(100_003).map(|u| 1600.0 * u - 800.0).collect();
        xs.extend([0.0, -0.0, f64::INFINITY, f64::NEG_INFINITY, 1e-310, f64::NAN]);
        let (mut wide, mut narrow) = (vec![[0.0; 5]; xs.len()], vec![[0.0; 5]; xs.len()]);
        Width::widest().run(All(&xs, &mut wide));
        Width::baseline().run(All(&xs, &mut narrow));
        for ((x, wide), narrow) in xs.iter().zip(wide).zip(narrow) {
            let single = [exp(*x), exp_and_less_one(*x).1, ln(*x), pow(*x, 0.3), pow_any(*x, 3.0)];
            for ((a, b), c) in wide.into_iter().zip(narrow).zip(single) {
                let is_same = a.to_bits() == b.to_bits() && b.to_bits() == c.to_bits();
                assert!(is_same || (a.is_nan() && b.is_nan() && c.is_nan()), "{x}: {a} {b} {c}");
            }
        }
    }
}

//! Special functions of diffusion that the port of musl's library lacks.
//!
//! Owns Dawson's integral, the scaled complementary error function and the exponential integral, to 1e-14 of the value.
//! May use `scalar`. It deliberately has no complex arguments.

use super::scalar::{erfc, exp, ln};

const SQRT_PI: f64 = 1.772_453_850_905_516;

/// Dawson's integral.
///
/// Equation: `F(x) = exp(−x²) ∫₀ˣ exp(y²) dy`.
/// Symbols: x any real number.
/// Dimensions and range: none; |F| ≤ 0.5411.
/// Source: Rybicki 1989, Computers in Physics 3(2), sampling theorem with step h, whose relative error
/// is exp(−(π/2h)²) = 7e-18 for h = 1/4; below 0.3 the Taylor series, above 12 the asymptotic series.
/// Shape: odd, x near zero, maximum 0.541 at x = 0.924, 1/(2x) far out.
pub fn dawson(x: f64) -> f64 {
    let size = x.abs();
    if size < 0.3 {
        dawson_series(x)
    } else if size < 12.0 {
        dawson_rybicki(size).copysign(x)
    } else {
        dawson_asymptotic(x)
    }
}

/// `F(x)/x`, smooth through zero.
///
/// Equation: `F(x)/x`, 1 at x = 0.
/// Symbols: x ≥ 0.
/// Dimensions and range: none; between 0 and 1.
/// Source: definition of [`dawson`].
/// Shape: falls from 1 like 1 − 2x²/3, then like 1/(2x²).
pub fn dawson_ratio(x: f64) -> f64 {
    if x.abs() < 1e-8 { 1.0 } else { dawson(x) / x }
}

/// The scaled complementary error function.
///
/// Equation: `erfcx(x) = exp(x²) erfc(x)`.
/// Symbols: x any real number.
/// Dimensions and range: none; infinite below about −26.6.
/// Source: definition, with x² carried in two parts, below 10; Laplace's continued fraction above
/// (Abramowitz & Stegun 1964, 7.1.14).
/// Shape: falls from 2 exp(x²) through 1 at x = 0 to 1/(x √π).
pub fn erfcx(x: f64) -> f64 {
    if x < 10.0 {
        let (high, low) = square_in_two_parts(x);
        let scale = exp(high);
        if scale.is_infinite() { scale } else { (scale + scale * low) * erfc(x) }
    } else {
        erfcx_continued_fraction(x)
    }
}

/// Σ (−1)^k 2^k x^(2k+1) / (2k+1)!!
fn dawson_series(x: f64) -> f64 {
    let mut term = x;
    let mut sum = x;
    for k in 1..20 {
        term *= -2.0 * x * x / f64::from(2 * k + 1);
        sum += term;
    }
    sum
}

/// `F(x) = π^{-1/2} Σ_{n odd} exp(−(x − n h)²) / n` for x > 0, summed around the n nearest to x/h.
fn dawson_rybicki(x: f64) -> f64 {
    const STEP: f64 = 0.25;
    // exp(−6.3²) = 6e-18: terms farther away than that do not count.
    let reach = 2 * (6.3 / (2.0 * STEP)) as i64 + 2;
    let nearest = 2 * (x / (2.0 * STEP)).floor() as i64 + 1;
    let mut sum = 0.0;
    let mut n = nearest - reach;
    while n <= nearest + reach {
        let distance = x - n as f64 * STEP;
        sum += exp(-distance * distance) / n as f64;
        n += 2;
    }
    sum / SQRT_PI
}

/// 1/(2x) Σ (2k−1)!! / (2x²)^k
fn dawson_asymptotic(x: f64) -> f64 {
    let mut term = 0.5 / x;
    let mut sum = term;
    for k in 1..12 {
        term *= f64::from(2 * k - 1) / (2.0 * x) / x;
        sum += term;
    }
    sum
}

/// x² = high + low exactly (Dekker's product).
fn square_in_two_parts(x: f64) -> (f64, f64) {
    let square = x * x;
    if !square.is_finite() {
        return (square, 0.0);
    }
    let shifted = 134_217_729.0 * x;
    let high = shifted - (shifted - x);
    let low = x - high;
    (square, ((high * high - square) + 2.0 * high * low) + low * low)
}

/// `1/√π · 1/(x + (1/2)/(x + (2/2)/(x + (3/2)/…)))`; 30 levels suffice from x = 10 on.
fn erfcx_continued_fraction(x: f64) -> f64 {
    let mut tail = x;
    for k in (1..=30).rev() {
        tail = x + 0.5 * f64::from(k) / tail;
    }
    1.0 / (SQRT_PI * tail)
}

/// The exponential integral E₁.
///
/// Equation: `E₁(x) = ∫ₓ^∞ e^{−u}/u du`.
/// Symbols: x > 0.
/// Dimensions and range: none; 0 beyond 745.
/// Source: Abramowitz & Stegun 1964; below 1 the series 5.1.11, `−C − ln x − Σ (−x)^k/(k k!)`, else the continued
/// fraction 5.1.22 in its even form, `e^{−x}/(x + 1 − 1/(x + 3 − 4/(x + 5 − …)))`.
/// Shape: falls from infinity like −ln x, then like e^{−x}/x.
pub fn exponential_integral(x: f64) -> f64 {
    const EULER: f64 = 0.577_215_664_901_532_9;
    if x < 1.0 {
        let (mut power, mut sum) = (1.0, 0.0);
        for k in 1..=20 {
            power *= -x / f64::from(k);
            sum += power / f64::from(k);
        }
        return -EULER - ln(x) - sum;
    }
    // From its end: at 1 the slowest case takes 120 levels.
    let mut tail = 0.0;
    for k in (1..=120).rev() {
        let k = f64::from(k);
        tail = k * k / (x + 2.0 * k + 1.0 - tail);
    }
    exp(-x) / (x + 1.0 - tail)
}

#[cfg(test)]
mod tests {
    use super::*;

    // mpmath 1.3, 40 digits: sqrt(pi)/2 · exp(−x²) · erfi(x) and exp(x²) · erfc(x).
    const DAWSON: [(f64, f64); 15] = [
        (1e-9, 1e-9),
        (0.1, 0.099_335_992_397_852_86),
        (0.2999, 0.282_548_617_604_080_84),
        (0.3, 0.282_631_665_021_311_93),
        (0.5, 0.424_436_383_502_022_3),
        (0.924_138_873, 0.541_044_224_635_181_6),
        (1.0, 0.538_079_506_912_768_4),
        (2.0, 0.301_340_388_923_791_95),
        (3.7, 0.140_751_174_115_415_4),
        (5.25, 0.097_069_628_473_201_89),
        (8.0, 0.063_000_198_707_553_38),
        (11.99, 0.041_847_996_382_177_88),
        (12.0, 0.041_812_876_453_988_26),
        (30.0, 0.016_675_941_401_059_175),
        (1e4, 0.000_050_000_000_25),
    ];
    const ERFCX: [(f64, f64); 14] = [
        (-5.0, 144_009_798_674.661_04),
        (-1.0, 5.008_980_080_762_283),
        (0.0, 1.0),
        (1e-3, 0.998_872_620_081_151_4),
        (0.5, 0.615_690_344_192_925_9),
        (1.0, 0.427_583_576_155_807),
        (2.0, 0.255_395_676_310_505_75),
        (4.4, 0.125_141_655_538_144_9),
        (7.0, 0.079_800_054_329_152_94),
        (9.99, 0.056_196_640_706_858_82),
        (10.0, 0.056_140_992_743_822_59),
        (12.0, 0.046_854_221_014_893_76),
        (50.0, 0.011_281_536_265_323_773),
        (1e6, 5.641_895_835_474_742e-7),
    ];

    #[test]
    fn values_are_right_to_1e_14() {
        for (x, expected) in DAWSON {
            assert!((dawson(x) - expected).abs() <= 1e-14 * expected, "dawson({x}) = {}", dawson(x));
            assert_eq!(dawson(-x), -dawson(x));
        }
        for (x, expected) in ERFCX {
            assert!((erfcx(x) - expected).abs() <= 1e-14 * expected, "erfcx({x}) = {}", erfcx(x));
        }
    }

    /// Reference: the series with 60 digits.
    #[test]
    fn exponential_integral_meets_its_values() {
        let table = [
            (1e-3, 6.331_539_364_136_149),
            (0.1, 1.822_923_958_419_390_7),
            (0.999, 0.219_752_182_022_944_54),
            (1.0, 0.219_383_934_395_520_27),
            (2.5, 0.024_914_917_870_269_735),
            (20.0, 9.835_525_290_649_882e-11),
        ];
        for (x, expected) in table {
            let found = exponential_integral(x);
            assert!((found - expected).abs() <= 1e-14 * expected, "{x}: {found} {expected}");
        }
    }

    #[test]
    fn far_arguments_stay_finite_or_infinite_never_undefined() {
        for size in [0.0, 1e-300, 1e-12, 1e12, 1e160, 1e300] {
            assert!(dawson(size).is_finite() && dawson_ratio(size).is_finite());
            assert!(erfcx(size).is_finite() && !erfcx(-size).is_nan());
        }
        assert_eq!(erfcx(-1e300), f64::INFINITY);
    }
}

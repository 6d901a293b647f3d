//! Normal numbers by Box–Muller, from raw words, in plain loops that the compiler vectorises.
//!
//! Owns the transform for 32-bit lanes and the one for tails. May use `maths`. It deliberately
//! draws no words itself and uses no fused multiply-add, so that wide and narrow code agree bit for bit.

use super::chacha::{DRAW, Words};
use super::scalar;

/// Pairs of normal numbers that one draw of words gives in 32-bit lanes.
const PAIRS: usize = DRAW / 2;

/// Standard normal numbers from one draw of words, in 32-bit arithmetic.
///
/// - Equation: `r = √(−2 ln u)`, `(r cos 2πv, r sin 2πv)`.
/// - Symbols: `u = (w + ½) 2⁻³¹` from the upper 31 bits of word `k`, `v = w 2⁻³²` from word `k + 512`.
/// - Range: `|ξ| ≤ 6.67`; the radius is right to about 1e-5 for `r > 0.02`, finer steps are lost.
/// - Source: G. E. P. Box and M. E. Muller (1958), Ann. Math. Stat. 29, 610, doi:10.1214/aoms/1177706645.
/// - Shape: number `k` takes the cosine, `k + 512` the sine; no branch.
#[inline(always)]
pub fn single(words: &Words, normals: &mut [f64; DRAW]) {
    let (radius_words, angle_words) = words.split_at(PAIRS);
    let mut narrow = [0.0_f32; DRAW];
    let (cosines, sines) = narrow.split_at_mut(PAIRS);
    for pair_idx in 0..PAIRS {
        let uniform = ((radius_words[pair_idx] >> 1) as i32 as f32 + 0.5) * (1.0 / 2_147_483_648.0);
        let radius = (-2.0 * ln_single(uniform)).sqrt();
        let (sine, cosine) = turn_single(angle_words[pair_idx]);
        cosines[pair_idx] = radius * cosine;
        sines[pair_idx] = radius * sine;
    }
    // Apart, as a loop is as narrow as its widest number.
    for (normal, narrow) in normals.iter_mut().zip(narrow) {
        *normal = f64::from(narrow);
    }
}

/// Standard normal numbers from two draws of words, in 64-bit arithmetic, for scenes that need tails.
///
/// - Equation: `r = √(−2 ln u)`, `(r cos 2πv, r sin 2πv)`.
/// - Symbols: `u`, `v` with 53 bits from words `k` and `k + 512` of both draws.
/// - Range: `|ξ| ≤ 8.66`.
/// - Source: G. E. P. Box and M. E. Muller (1958), Ann. Math. Stat. 29, 610, doi:10.1214/aoms/1177706645.
/// - Shape: number `k` takes the cosine, `k + 512` the sine.
pub fn double(high: &Words, low: &Words, normals: &mut [f64; DRAW]) {
    let (cosines, sines) = normals.split_at_mut(PAIRS);
    for pair_idx in 0..PAIRS {
        let radius = (-2.0 * scalar::ln(uniform_53(high[pair_idx], low[pair_idx]))).sqrt();
        let angle = std::f64::consts::TAU * uniform_53(high[pair_idx + PAIRS], low[pair_idx + PAIRS]);
        cosines[pair_idx] = radius * scalar::cos(angle);
        sines[pair_idx] = radius * scalar::sin(angle);
    }
}

/// `(n + ½) 2⁻⁵³` with `n` the upper 53 bits of two words, rounded to a double below 1.
#[inline(always)]
pub fn uniform_53(high: u32, low: u32) -> f64 {
    let bits = (u64::from(high) << 21) | u64::from(low >> 11);
    // The largest value is 1 − 2⁻⁵⁴, which would round to 1.
    ((bits as f64 + 0.5) * (1.0 / 9_007_199_254_740_992.0)).min(1.0 - f64::EPSILON / 2.0)
}

/// - Equation: `ln x = e ln 2 + ln(1 + z)`, `x = 2^e (1 + z)`, `1 + z ∈ [√½, √2)`.
/// - Symbols: `e` from the exponent bits; `ln(1 + z) = z − z²/2 + z³ P(z)`.
/// - Range: normal positive `x`; about one unit in the last place.
/// - Source: S. L. Moshier, Cephes library, `logf` (coefficients of `P`).
/// - Shape: no branch.
#[inline(always)]
fn ln_single(x: f32) -> f32 {
    const HALF_ROOT: i32 = 0x3f35_04f3;
    let bits = x.to_bits() as i32;
    let exponent = bits.wrapping_sub(HALF_ROOT) >> 23;
    let z = f32::from_bits(bits.wrapping_sub(exponent << 23) as u32) - 1.0;
    let e = exponent as f32;
    let mut p = 7.037_683_6e-2_f32;
    p = p * z - 1.151_461e-1;
    p = p * z + 1.167_699_9e-1;
    p = p * z - 1.242_014_1e-1;
    p = p * z + 1.424_932_3e-1;
    p = p * z - 1.666_805_8e-1;
    p = p * z + 2.000_071_5e-1;
    p = p * z - 2.499_999_4e-1;
    p = p * z + 3.333_333e-1;
    let square = z * z;
    let tail = p * z * square + e * -2.121_944_4e-4 - 0.5 * square;
    z + tail + e * 0.693_359_4
}

/// Sine and cosine of `2π w / 2³²`.
///
/// - Equation: `2πw/2³² = q π/2 + a`, `|a| ≤ π/4`; polynomials of `a`, swapped and signed by `q`.
/// - Symbols: `q` the quadrant, exact in integers.
/// - Range: any word; 1e-7 absolute.
/// - Source: S. L. Moshier, Cephes library, `sinf`, `cosf` (coefficients).
/// - Shape: no branch.
#[inline(always)]
fn turn_single(word: u32) -> (f32, f32) {
    const ANGLE: f32 = (std::f64::consts::TAU / 4_294_967_296.0) as f32;
    let quadrant = word.wrapping_add(1 << 29) >> 30;
    let a = word.wrapping_sub(quadrant << 30) as i32 as f32 * ANGLE;
    let z = a * a;
    let sine = ((-1.951_529_6e-4 * z + 8.332_161e-3) * z - 1.666_665_5e-1) * z * a + a;
    let cosine = ((2.443_315_7e-5 * z - 1.388_731_6e-3) * z + 4.166_664_6e-2) * z * z - 0.5 * z + 1.0;
    let is_odd = (quadrant & 1).wrapping_neg();
    let (s, c) = (sine.to_bits(), cosine.to_bits());
    let swapped_sine = (s & !is_odd) | (c & is_odd);
    let swapped_cosine = (c & !is_odd) | (s & is_odd);
    let sine_sign = (quadrant & 2) << 30;
    let cosine_sign = (quadrant.wrapping_add(1) & 2) << 30;
    (f32::from_bits(swapped_sine ^ sine_sign), f32::from_bits(swapped_cosine ^ cosine_sign))
}

#[cfg(test)]
mod tests {
    use super::super::chacha;
    use super::*;

    const KEY: [u32; 8] = [3, 1, 4, 1, 5, 9, 2, 6];

    fn singles(n_draws: u64) -> impl Iterator<Item = f64> {
        (0..n_draws).flat_map(|number| {
            let (mut words, mut normals) = ([0; DRAW], [0.0; DRAW]);
            chacha::draw(&KEY, 0, number, &mut words);
            single(&words, &mut normals);
            normals
        })
    }

    fn doubles(n_draws: u64) -> impl Iterator<Item = f64> {
        (0..n_draws).flat_map(|number| {
            let (mut high, mut low, mut normals) = ([0; DRAW], [0; DRAW], [0.0; DRAW]);
            chacha::draw(&KEY, 0, 2 * number, &mut high);
            chacha::draw(&KEY, 0, 2 * number + 1, &mut low);
            double(&high, &low, &mut normals);
            normals
        })
    }

    /// Moments 1, 2, 4, 6 of a normal number are 0, 1, 3, 15; the variances of their samples are 1, 2,
    /// 96 and 10170 over n. Four scatters are allowed.
    fn check_moments(normals: impl Iterator<Item = f64>) {
        let (mut n, mut sums, mut largest) = (0.0, [0.0; 4], 0.0_f64);
        for x in normals {
            let square = x * x;
            n += 1.0;
            for (sum, power) in sums.iter_mut().zip([x, square, square * square, square * square * square]) {
                *sum += power;
            }
            largest = largest.max(x.abs());
        }
        for ((sum, moment), variance) in
            sums.into_iter().zip([0.0, 1.0, 3.0, 15.0]).zip([1.0, 2.0, 96.0, 10170.0_f64])
        {
            assert!((sum / n - moment).abs() < 4.0 * (variance / n).sqrt(), "{moment}: {}", sum / n);
        }
        assert!((4.5..6.8).contains(&largest), "{largest}");
    }

    #[test]
    fn moments_are_those_of_normal_numbers() {
        check_moments(singles(4000));
        check_moments(doubles(500));
    }

    /// Neighbours and the two halves of a pair are uncorrelated: four scatters of 1/√n.
    #[test]
    fn pairs_are_uncorrelated() {
        let all: Vec<f64> = singles(2000).collect();
        for lag in [1, 8, 64, PAIRS] {
            let products = all.iter().zip(&all[lag..]).map(|(a, b)| a * b);
            let n = (all.len() - lag) as f64;
            assert!((products.sum::<f64>() / n).abs() < 4.0 / n.sqrt(), "lag {lag}");
        }
    }

    /// The extremes of the words give finite numbers.
    #[test]
    fn extreme_words_stay_finite() {
        for word in [0, 1, u32::MAX, 1 << 31, (1 << 31) - 1] {
            let mut normals = [f64::NAN; DRAW];
            single(&[word; DRAW], &mut normals);
            assert!(normals.iter().all(|x| x.abs() < 6.67), "{word}: {}", normals[0]);
            double(&[word; DRAW], &[word; DRAW], &mut normals);
            assert!(normals.iter().all(|x| x.abs() < 8.67), "{word}: {}", normals[0]);
        }
    }

    /// Against the 64-bit library: a few units of the last place of 32-bit numbers.
    #[test]
    fn functions_are_as_right_as_their_numbers() {
        for k in 0..100_000_u32 {
            let word = k.wrapping_mul(2_654_435_761);
            let angle = f64::from(word as i32) * (std::f64::consts::TAU / 4_294_967_296.0);
            let (sine, cosine) = turn_single(word);
            assert!((f64::from(sine) - scalar::sin(angle)).abs() < 1.5e-7, "{word}");
            assert!((f64::from(cosine) - scalar::cos(angle)).abs() < 1.5e-7, "{word}");
            let x = ((word >> 1) as i32 as f32 + 0.5) * (1.0 / 2_147_483_648.0);
            let exact = scalar::ln(f64::from(x));
            assert!((f64::from(ln_single(x)) - exact).abs() <= 1.5e-7 * exact.abs(), "{x}");
        }
    }

    /// The first numbers for ever: a change here is a change of `NUMERICS_VERSION`.
    #[test]
    fn first_numbers_are_pinned() {
        let hash = |normals: &mut dyn Iterator<Item = f64>| {
            let mut hasher = blake3::Hasher::new();
            normals.for_each(|x| {
                hasher.update(&x.to_bits().to_le_bytes());
            });
            hasher.finalize().to_hex().as_str()[..16].to_owned()
        };
        assert_eq!(hash(&mut singles(2)), "84a04859ffe53aec");
        assert_eq!(hash(&mut doubles(2)), "6be3013d931ad762");
    }
}

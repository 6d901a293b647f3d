//! Sums that do not depend on the order of their terms.
//!
//! Owns the rounding of terms to common quanta. May use nothing else of the crate. It deliberately sums no
//! slices itself: sums over particles are kept by whoever goes through them.

/// Bits of a double, the leading one included.
const DIGITS: i32 = 53;

/// The most terms that a sum may have: a thousand events for each of 10⁷ particles.
pub const MOST_TERMS: u64 = 1 << 34;

/// Three quanta, each much finer than the one before. Terms are rounded to multiples of them, whose sums are
/// exact.
///
/// - Equation: `v ≈ h + m + l`, `h = q₁ ⌊v/q₁⌉`, `m = q₂ ⌊(v − h)/q₂⌉`, `l = q₃ ⌊(v − h − m)/q₃⌉`; `Σh`, `Σm` and
///   `Σl` have no rounding.
/// - Symbols: `q₁ = 2^{e + n − 52}` for `|v| ≤ 2^e` and at most `2^n` terms; `q₂ = q₁ 2^{n − 52}`, `q₃` alike.
/// - Range: terms of size up to `largest`, at most `2^34` of them; an error of `2^{3n − 157}` of `largest`
///   per term, 2^-55 for 2^34 terms: that of a double.
/// - Source: J. Demmel, H. D. Nguyen (2015), IEEE Trans. Comput. 64, 2060, doi:10.1109/TC.2014.2345391
///   (pre-rounding, with three bins).
/// - Shape: one value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quanta {
    /// `1.5 · 2^52` quanta: what is added and taken away to round.
    coarse: f64,
    fine: f64,
    finest: f64,
}

/// A running sum.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sum {
    high: f64,
    middle: f64,
    low: f64,
}

impl Quanta {
    /// For terms of at most `largest` in size, and at most `n_terms` of them.
    pub fn new(largest: f64, n_terms: u64) -> Self {
        let n = i32::try_from(64 - n_terms.max(1).leading_zeros()).unwrap_or(34).min(34);
        let e = exponent(largest) + 1;
        let shift = |quantum: i32| 1.5 * power_of_two(quantum + DIGITS - 1);
        let coarse = e + n - (DIGITS - 1);
        // The rest of a term is half a coarse quantum at most.
        let fine = (coarse + n - (DIGITS - 1)).max(-1000);
        let finest = (fine + n - (DIGITS - 1)).max(-1000);
        Self { coarse: shift(coarse), fine: shift(fine), finest: shift(finest) }
    }

    /// Adds a term.
    #[inline(always)]
    pub fn add(self, sum: &mut Sum, term: f64) {
        let high = (term + self.coarse) - self.coarse;
        let rest = term - high;
        let middle = (rest + self.fine) - self.fine;
        let low = ((rest - middle) + self.finest) - self.finest;
        sum.high += high;
        sum.middle += middle;
        sum.low += low;
    }
}

impl Sum {
    /// Adds another sum of the same quanta.
    #[inline(always)]
    pub fn merge(&mut self, other: Self) {
        self.high += other.high;
        self.middle += other.middle;
        self.low += other.low;
    }

    pub fn value(self) -> f64 {
        self.high + (self.middle + self.low)
    }
}

/// `⌊log₂ x⌋` of a normal number; that of the smallest one for zero and less.
fn exponent(x: f64) -> i32 {
    if x.is_normal() { ((x.abs().to_bits() >> 52) as i32) - 1023 } else { -1022 }
}

/// `2^n`, between the smallest and the largest normal number.
fn power_of_two(n: i32) -> f64 {
    f64::from_bits(((n.clamp(-1022, 1023) + 1023) as u64) << 52)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of many sizes from a fixed recurrence.
    fn terms(n: usize) -> Vec<f64> {
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / 9_007_199_254_740_992.0
        };
        (0..n).map(|idx| (next() - 0.3) * [1.0, 1e-3, 1e-9][idx % 3]).collect()
    }

    #[test]
    fn any_order_gives_the_same_bits() {
        let mut terms = terms(100_000);
        let quanta = Quanta::new(1.0, terms.len() as u64);
        let sum = |terms: &[f64]| {
            let mut parts = [Sum::default(); 7];
            for (idx, &term) in terms.iter().enumerate() {
                quanta.add(&mut parts[idx % 7], term);
            }
            let mut whole = Sum::default();
            parts.iter().for_each(|&part| whole.merge(part));
            whole.value()
        };
        let forwards = sum(&terms);
        terms.reverse();
        assert_eq!(sum(&terms).to_bits(), forwards.to_bits());
        terms.sort_by(f64::total_cmp);
        assert_eq!(sum(&terms).to_bits(), forwards.to_bits());
        terms.rotate_left(333);
        assert_eq!(sum(&terms).to_bits(), forwards.to_bits());
    }

    /// Reference: whole multiples of 2⁻⁹⁰, which are exact in 128-bit integers.
    #[test]
    fn nothing_but_the_last_bits_is_lost() {
        let terms = terms(100_000);
        let quanta = Quanta::new(1.0, terms.len() as u64);
        let mut sum = Sum::default();
        terms.iter().for_each(|&term| quanta.add(&mut sum, term));
        let scale = power_of_two(90);
        let exact: i128 = terms.iter().map(|&term| (term * scale) as i128).sum();
        let error = (sum.value() * scale - exact as f64).abs() / scale;
        assert!(error <= 1e-15 * sum.value().abs() * 2.0 + 1e5 * 1e-20, "{error:e}");
    }

    /// Where no number of terms is known.
    #[test]
    fn equal_terms_add_up_to_the_last_bits() {
        let quanta = Quanta::new(1.0, MOST_TERMS);
        let mut sum = Sum::default();
        (0..300_000).for_each(|_| quanta.add(&mut sum, 1.0 / 3.0));
        assert!((sum.value() - 1e5).abs() < 1e-10, "{:e}", sum.value() - 1e5);
    }

    #[test]
    fn extreme_sizes_stay_numbers() {
        for largest in [0.0, f64::MIN_POSITIVE, 1e-300, 1e250] {
            let quanta = Quanta::new(largest, 1 << 20);
            let mut sum = Sum::default();
            quanta.add(&mut sum, largest);
            quanta.add(&mut sum, largest);
            assert!((sum.value() - 2.0 * largest).abs() <= 1e-12 * largest.max(1e-280), "{largest:e}");
        }
    }
}

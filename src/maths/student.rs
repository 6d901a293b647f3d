//! Student's t distribution, for intervals around what is fitted to a few points.

use super::scalar::{atan, sqrt};
use std::f64::consts::PI;

/// Beyond this many degrees of freedom the quantile differs from that of infinitely many by less than
/// 3 parts in 10⁵ (Cornish–Fisher: (z² + 1) / (4 ν) relatively), which no interval shows.
const MOST_DEGREES: u32 = 40_000;

/// Probability that |T| < t.
///
/// Equation: odd ν: 2/π (θ + sin θ (cos θ + 2/3 cos³θ + … + 2·4⋯(ν−3)/(3·5⋯(ν−2)) cos^(ν−2) θ));
/// even ν: sin θ (1 + 1/2 cos²θ + … + 1·3⋯(ν−3)/(2·4⋯(ν−2)) cos^(ν−2) θ); θ = atan(t / √ν)
/// Symbols: ν degrees of freedom
/// Dimensions and range: plain numbers; t ≥ 0, ν ≥ 1
/// Source: Abramowitz and Stegun, Handbook of Mathematical Functions, 26.7.3 and 26.7.4
pub fn within(t: f64, degrees: u32) -> f64 {
    let nu = f64::from(degrees);
    let cos = sqrt(nu / (nu + t * t));
    let sin = t / sqrt(nu + t * t);
    let square = cos * cos;
    let is_odd = degrees % 2 == 1;
    let (first, offset) = if is_odd { (cos, 1.0) } else { (1.0, 0.0) };
    // Terms by the ratio to the one before: of odd ν 2k/(2k+1), of even ν (2k−1)/(2k), each times cos²θ.
    let n_terms = if is_odd { (degrees - 1) / 2 } else { degrees / 2 };
    let (mut term, mut sum) = (first, 0.0);
    for k in 1..=n_terms {
        sum += term;
        let k = 2.0 * f64::from(k);
        term *= square * (k - 1.0 + offset) / (k + offset);
    }
    if is_odd { 2.0 / PI * (atan(t / sqrt(nu)) + sin * sum) } else { sin * sum }
}

/// The t that |T| stays below with this probability, which lies in 0 … 1: 12.706 for 0.95 and one degree.
pub fn quantile(probability: f64, degrees: u32) -> f64 {
    let degrees = degrees.clamp(1, MOST_DEGREES);
    let (mut low, mut high) = (0.0, 1.0);
    while within(high, degrees) < probability && high < 1e300 {
        (low, high) = (high, 2.0 * high);
    }
    // Halving ends at neighbouring numbers.
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return middle;
        }
        if within(middle, degrees) < probability { low = middle } else { high = middle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ν = 1: tan(π p / 2); ν = 2: p √(2 / (1 − p²)); others from tables with three decimals (Abramowitz
    /// and Stegun, table 26.10) and from mpmath with fifteen.
    #[test]
    fn quantiles_are_those_of_closed_forms_and_tables() {
        for p in [0.5f64, 0.9, 0.95, 0.99] {
            let one = libm::tan(PI * p / 2.0);
            let two = p * (2.0 / (1.0 - p * p)).sqrt();
            assert!((quantile(p, 1) / one - 1.0).abs() < 1e-13, "{p}: {} {one}", quantile(p, 1));
            assert!((quantile(p, 2) / two - 1.0).abs() < 1e-13, "{p}: {} {two}", quantile(p, 2));
        }
        let table = [(3, 3.182), (4, 2.776), (5, 2.571), (10, 2.228), (15, 2.131), (30, 2.042), (120, 1.980)];
        for (degrees, expected) in table {
            assert!((quantile(0.95, degrees) - expected).abs() <= 5e-4, "{degrees}");
        }
        let exact = [
            (3, 3.182_446_305_283_709_6),
            (7, 2.364_624_251_592_785_3),
            (24, 2.063_898_561_628_026),
            (1001, 1.962_336_705_280_88),
        ];
        for (degrees, expected) in exact {
            let found = quantile(0.95, degrees);
            assert!((found / expected - 1.0).abs() < 1e-13, "{degrees}: {found}");
        }
        assert!((quantile(0.95, u32::MAX) - 1.959_963_984_540_054).abs() < 1e-4);
    }
}

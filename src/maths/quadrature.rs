//! Integrals of smooth functions with a bound on the error.
//!
//! Owns Gauss–Legendre rules and adaptive Gauss–Kronrod integration. May use `scalar`. It deliberately
//! knows no infinite intervals: callers cut where the integrand vanishes.

use super::scalar::cos;

/// Nodes in −1…1 and weights of the Gauss–Legendre rule with `n` points, exact to degree 2n − 1.
pub fn gauss_legendre(n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut nodes = vec![0.0; n];
    let mut weights = vec![0.0; n];
    for i in 0..n {
        let mut x = -cos(std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5));
        let mut slope = 1.0;
        // Newton converges quadratically from this start; eight rounds are more than enough.
        for _ in 0..8 {
            let (value, derivative) = legendre_with_slope(n, x);
            slope = derivative;
            x -= value / derivative;
        }
        nodes[i] = x;
        weights[i] = 2.0 / ((1.0 - x * x) * slope * slope);
    }
    (nodes, weights)
}

fn legendre_with_slope(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (1.0, x);
    for k in 1..n {
        let k = k as f64;
        (before, value) = (value, ((2.0 * k + 1.0) * x * value - k * before) / (k + 1.0));
    }
    (value, n as f64 * (x * value - before) / (x * x - 1.0))
}

/// An integral and a bound on its error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Integral {
    pub value: f64,
    pub error: f64,
}

/// `∫ f` over the intervals between consecutive `breaks`, halved until the sum of the error bounds is
/// below `max(absolute, relative · |value|)` or 400 intervals are in use.
pub fn integrate(f: impl Fn(f64) -> f64, breaks: &[f64], absolute: f64, relative: f64) -> Integral {
    let mut parts: Vec<Part> = breaks
        .windows(2)
        .filter(|pair| pair[0] < pair[1])
        .map(|pair| Part::new(&f, pair[0], pair[1]))
        .collect();
    loop {
        let value: f64 = parts.iter().map(|part| part.value).sum();
        let error: f64 = parts.iter().map(|part| part.error).sum();
        let is_done = error <= absolute.max(relative * value.abs()) || parts.len() >= 400;
        let worst = (0..parts.len()).max_by(|&a, &b| parts[a].error.total_cmp(&parts[b].error));
        let Some(worst) = worst.filter(|_| !is_done) else {
            return Integral { value, error };
        };
        let Part { low, high, .. } = parts[worst];
        let middle = 0.5 * (low + high);
        parts[worst] = Part::new(&f, low, middle);
        parts.push(Part::new(&f, middle, high));
    }
}

struct Part {
    low: f64,
    high: f64,
    value: f64,
    error: f64,
}

impl Part {
    /// Kronrod's 15 points; the difference to Gauss' 7 points bounds the error.
    fn new(f: &impl Fn(f64) -> f64, low: f64, high: f64) -> Self {
        let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
        let middle = f(centre);
        let mut kronrod = KRONROD_WEIGHTS[7] * middle;
        let mut gauss = GAUSS_WEIGHTS[3] * middle;
        for idx in 0..7 {
            let pair = f(centre - half * KRONROD_NODES[idx]) + f(centre + half * KRONROD_NODES[idx]);
            kronrod += KRONROD_WEIGHTS[idx] * pair;
            if idx % 2 == 1 {
                gauss += GAUSS_WEIGHTS[idx / 2] * pair;
            }
        }
        Self { low, high, value: half * kronrod, error: half * (kronrod - gauss).abs() }
    }
}

// Piessens et al. 1983, QUADPACK, rule qk15.
const KRONROD_NODES: [f64; 7] = [
    0.991_455_371_120_812_6,
    0.949_107_912_342_758_5,
    0.864_864_423_359_769_1,
    0.741_531_185_599_394_4,
    0.586_087_235_467_691_1,
    0.405_845_151_377_397_2,
    0.207_784_955_007_898_47,
];
const KRONROD_WEIGHTS: [f64; 8] = [
    0.022_935_322_010_529_224,
    0.063_092_092_629_978_55,
    0.104_790_010_322_250_19,
    0.140_653_259_715_525_92,
    0.169_004_726_639_267_9,
    0.190_350_578_064_785_4,
    0.204_432_940_075_298_89,
    0.209_482_141_084_727_82,
];
const GAUSS_WEIGHTS: [f64; 4] =
    [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maths::scalar::exp;

    #[test]
    fn rules_are_exact_for_polynomials() {
        // ∫ x^k over −1…1 is 2/(k+1) for even k.
        for n in 1..=40 {
            let (nodes, weights) = gauss_legendre(n);
            for k in 0..(2 * n).min(24) {
                let sum: f64 = nodes.iter().zip(&weights).map(|(x, w)| w * x.powi(k as i32)).sum();
                let expected = if k % 2 == 0 { 2.0 / (k as f64 + 1.0) } else { 0.0 };
                assert!((sum - expected).abs() < 1e-14, "{n} points, degree {k}: {sum}");
            }
        }
    }

    #[test]
    fn adaptive_integral_keeps_its_bound() {
        // ∫₀¹⁰ exp(−1000 (x − 3)²) dx = √(π/1000); the far tails are below 1e-300.
        let peak = integrate(|x| exp(-1e3 * (x - 3.0) * (x - 3.0)), &[0.0, 10.0], 0.0, 1e-12);
        let expected = (std::f64::consts::PI / 1e3).sqrt();
        assert!((peak.value - expected).abs() < 1e-12 * expected && peak.error < 1e-12);
        // A kink away from the middle: ∫₀¹ |x − 1/3| dx = 5/18.
        let kink = integrate(|x| (x - 1.0 / 3.0).abs(), &[0.0, 1.0], 1e-11, 0.0);
        assert!((kink.value - 5.0 / 18.0).abs() <= 1e-11);
    }
}

//! First-order networks by the matrix exponential.
//!
//! Owns the exponential of a matrix over a time, and its use on columns. May use the plan. It
//! deliberately computes in twice the usual precision: the doublings of a stiff network lose half of it.

use crate::chemistry::reactor::Propagator;
use crate::maths::wide::Width;
use crate::plan::Species;
use crate::plan::chemistry::{Kinetics, Law};
use pulp::NullaryFnOnce;

/// A number as the sum of two; right to about 1e-32.
#[derive(Debug, Clone, Copy, Default)]
struct Double(f64, f64);

impl Double {
    #[inline]
    fn sum(a: f64, b: f64) -> Self {
        let sum = a + b;
        let from_b = sum - a;
        Self(sum, (a - (sum - from_b)) + (b - from_b))
    }

    /// Dekker's product: exact unless it is out of range.
    #[inline]
    fn product(a: f64, b: f64) -> Self {
        const SPLIT: f64 = 134_217_729.0;
        let product = a * b;
        let (scaled_a, scaled_b) = (SPLIT * a, SPLIT * b);
        let (high_a, high_b) = (scaled_a - (scaled_a - a), scaled_b - (scaled_b - b));
        let (low_a, low_b) = (a - high_a, b - high_b);
        Self(product, ((high_a * high_b - product) + high_a * low_b + low_a * high_b) + low_a * low_b)
    }

    #[inline]
    fn add(self, other: Self) -> Self {
        let Self(high, low) = Self::sum(self.0, other.0);
        let low = low + self.1 + other.1;
        let sum = high + low;
        Self(sum, low - (sum - high))
    }

    #[inline]
    fn multiply(self, other: Self) -> Self {
        let Self(high, low) = Self::product(self.0, other.0);
        let low = low + (self.0 * other.1 + self.1 * other.0);
        let product = high + low;
        Self(product, low - (product - high))
    }

    fn divide_by(self, divisor: f64) -> Self {
        let quotient = self.0 / divisor;
        let Self(high, low) = Self::product(quotient, divisor);
        let rest = ((self.0 - high) - low) + self.1;
        let correction = rest / divisor;
        let sum = quotient + correction;
        Self(sum, correction - (sum - quotient))
    }
}

fn multiply(n: usize, a: &[Double], b: &[Double], out: &mut [Double]) {
    for i in 0..n {
        let row = &mut out[i * n..(i + 1) * n];
        row.fill(Double::default());
        for k in 0..n {
            let factor = a[i * n + k];
            if factor.0 == 0.0 {
                continue;
            }
            for (target, entry) in row.iter_mut().zip(&b[k * n..(k + 1) * n]) {
                if entry.0 != 0.0 {
                    *target = target.add(factor.multiply(*entry));
                }
            }
        }
    }
}

/// The exponential of `M t`.
///
/// Equation: `e^{Mt} = (e^{−σ} e^{Mt 2^{−s} + σ I})^{2^s}`, the inner exponentials by Taylor's series.
/// Symbols: σ the size of the most negative diagonal entry of `Mt 2^{−s}`, s so that the norm is at most 1.
/// Dimensions and range: none; for a matrix without negative entries beside its diagonal no sum has terms
/// of different signs: every entry is positive or zero, and right by itself.
/// Source: J. Xue and Q. Ye 2008, Numer. Math. 110, 393, doi:10.1007/s00211-008-0167-8 (shift); doublings
/// multiply the relative error 1e-32 by 2^s.
/// Shape: a relaxation.
fn exponential(n: usize, matrix: &[Double], t: f64) -> Vec<f64> {
    let norm = (0..n)
        .map(|j| (0..n).map(|i| (matrix[i * n + j].0 * t).abs()).sum::<f64>())
        .fold(0.0_f64, |largest, sum| if sum > largest || sum.is_nan() { sum } else { largest });
    if !norm.is_finite() {
        return vec![f64::NAN; n * n];
    }
    let mut n_doublings = 0;
    let mut scale = 1.0;
    while norm * scale > 0.5 {
        n_doublings += 1;
        scale *= 0.5;
    }
    let mut inner: Vec<Double> = matrix
        .iter()
        .map(|entry| entry.multiply(Double(t, 0.0)))
        .map(|Double(high, low)| Double(high * scale, low * scale))
        .collect();
    let shift = (0..n).map(|i| -inner[i * n + i].0).fold(0.0_f64, f64::max);
    (0..n).for_each(|i| inner[i * n + i] = inner[i * n + i].add(Double(shift, 0.0)));
    let identity: Vec<Double> =
        (0..n * n).map(|at| Double(if at % (n + 1) == 0 { 1.0 } else { 0.0 }, 0.0)).collect();
    // Horner's scheme; 1/28! is 3e-30 and 1/30! 4e-33.
    let (mut sum, mut product) = (identity.clone(), identity.clone());
    for k in (1..=30_u32).rev() {
        multiply(n, &inner, &sum, &mut product);
        for ((target, entry), one) in sum.iter_mut().zip(&product).zip(&identity) {
            *target = entry.divide_by(f64::from(k)).add(*one);
        }
    }
    let damping = exponential_of(-shift);
    sum.iter_mut().for_each(|entry| *entry = entry.multiply(damping));
    for _ in 0..n_doublings {
        multiply(n, &sum, &sum, &mut product);
        std::mem::swap(&mut sum, &mut product);
    }
    sum.iter().map(|entry| entry.0).collect()
}

/// `e^x` for −1 ≤ x ≤ 0.
fn exponential_of(x: f64) -> Double {
    let mut sum = Double(1.0, 0.0);
    for k in (1..=32_u32).rev() {
        sum = sum.multiply(Double(x, 0.0)).divide_by(f64::from(k)).add(Double(1.0, 0.0));
    }
    sum
}

/// A first-order network `dy/dt = M y + b`. What leaves one component and enters another must cancel to
/// the last digit, or fast reversible reactions would make mass: sums are kept twice as precise.
#[derive(Debug, Clone)]
pub(in crate::chemistry) struct Exponential {
    n: usize,
    matrix: Vec<Double>,
    constant: Vec<Double>,
}

impl Exponential {
    pub fn new(n: usize, matrix: &[f64], constant: &[f64]) -> Self {
        let precise = |values: &[f64]| values.iter().map(|&value| Double(value, 0.0)).collect();
        Self { n, matrix: precise(matrix), constant: precise(constant) }
    }

    /// A network whose laws are all mass action of order one or zero, from the laws themselves: what
    /// species are as sums of components may then be negative. `None` for other networks.
    pub fn of_mass_action(kinetics: &Kinetics, species: &[Species], n: usize) -> Option<Self> {
        let mut network = Self::new(n, &vec![0.0; n * n], &vec![0.0; n]);
        for reaction in &kinetics.reactions {
            let Law::MassAction { constant: rate, orders } = &reaction.law else { return None };
            for &(row, coefficient) in &reaction.changes {
                let flux = Double::product(coefficient, *rate);
                match orders[..] {
                    [] if flux.0 >= 0.0 => network.constant[row] = network.constant[row].add(flux),
                    [(index, 1.0)] => {
                        let recipe = &species[index];
                        let constant = flux.multiply(Double(recipe.constant, 0.0));
                        network.constant[row] = network.constant[row].add(constant);
                        for &(column, factor) in &recipe.terms {
                            let entry = &mut network.matrix[row * n + column];
                            *entry = entry.add(flux.multiply(Double(factor, 0.0)));
                        }
                    }
                    _ => return None,
                }
            }
        }
        Some(network)
    }

    /// Over a time; a constant production is one more component that stays 1.
    pub fn propagator(&self, t: f64) -> Propagator {
        let n = self.n;
        if self.constant.iter().all(|entry| entry.0 == 0.0) {
            return Propagator { matrix: exponential(n, &self.matrix, t), constant: vec![0.0; n] };
        }
        let mut augmented = vec![Double::default(); (n + 1) * (n + 1)];
        for i in 0..n {
            augmented[i * (n + 1)..i * (n + 1) + n].copy_from_slice(&self.matrix[i * n..(i + 1) * n]);
            augmented[i * (n + 1) + n] = self.constant[i];
        }
        let whole = exponential(n + 1, &augmented, t);
        let row = |i: usize| &whole[i * (n + 1)..];
        Propagator {
            matrix: (0..n).flat_map(|i| row(i)[..n].to_vec()).collect(),
            constant: (0..n).map(|i| row(i)[n]).collect(),
        }
    }
}

impl Propagator {
    /// Applies it to columns; `old` holds what stood there before.
    pub(in crate::chemistry) fn apply(
        &self,
        width: Width,
        components: &mut [&mut [f64]],
        old: &mut Vec<f64>,
    ) {
        width.run(Apply { propagator: self, components, old });
    }
}

struct Apply<'a, 'b> {
    propagator: &'a Propagator,
    components: &'a mut [&'b mut [f64]],
    old: &'a mut Vec<f64>,
}

impl NullaryFnOnce for Apply<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { propagator, components, old } = self;
        let n = components.len();
        let length = components.first().map_or(0, |column| column.len());
        old.clear();
        for column in components.iter() {
            old.extend_from_slice(column);
        }
        for (i, column) in components.iter_mut().enumerate() {
            let row = &propagator.matrix[i * n..(i + 1) * n];
            let constant = propagator.constant[i];
            let is_untouched = constant == 0.0
                && row.iter().enumerate().all(|(j, &entry)| entry == if i == j { 1.0 } else { 0.0 });
            if is_untouched {
                continue;
            }
            column.fill(constant);
            for (j, &factor) in row.iter().enumerate() {
                if factor != 0.0 {
                    let source = &old[j * length..(j + 1) * length];
                    for (value, old) in column.iter_mut().zip(source) {
                        *value += factor * old;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::chemistry::{Kinetic, Laws, Method};

    fn close(found: &[f64], right: &[f64], relative: f64) {
        for (found, right) in found.iter().zip(right) {
            assert!((found - right).abs() <= relative * right.abs(), "{found} {right}");
        }
    }

    /// Decay chain A → B → C with rates 0.6 and 0.3 over 2: the closed form of Bateman.
    #[test]
    fn a_chain_is_batemans() {
        let chain = Exponential::new(3, &[-0.6, 0.0, 0.0, 0.6, -0.3, 0.0, 0.0, 0.3, 0.0], &[0.0; 3]);
        let (a, b) = (0.301_194_211_912_202_1, 0.548_811_636_094_026_4);
        let produced = 0.6 / 0.3 * (b - a);
        let right = [a, 0.0, 0.0, produced, b, 0.0, 1.0 - a - produced, 1.0 - b, 1.0];
        close(&chain.propagator(2.0).matrix, &right, 1e-15);
    }

    /// Rates over 12 decades and long times: columns sum to 1, nothing is negative, and the slow rate is
    /// as right as the fast one. A ⇌ B fast, B → C slow: eigenvalues of [[−f, f], [f, −f − s]].
    #[test]
    fn stiff_networks_keep_their_sums() {
        let (fast, slow) = (1e9, 1e-3);
        let reaction = |from: usize, to: usize, constant: f64| Kinetic {
            name: String::new(),
            changes: vec![(from, -1.0), (to, 1.0)],
            law: Law::MassAction { constant, orders: vec![(from, 1.0)] },
        };
        let kinetics = Kinetics {
            reactions: vec![reaction(0, 1, fast), reaction(1, 0, fast), reaction(1, 2, slow)],
            laws: Laws { operations: vec![], rates: vec![] },
            method: Method::Exponential,
        };
        let species: Vec<Species> = (0..3)
            .map(|idx| Species {
                name: String::new(),
                constant: 0.0,
                terms: vec![(idx, 1.0)],
                is_molar: true,
            })
            .collect();
        let network = Exponential::of_mass_action(&kinetics, &species, 3).unwrap();
        for t in [1e-12, 1e-3, 1.0, 1e3, 1e12] {
            let p = network.propagator(t).matrix;
            assert!(p.iter().all(|&entry| entry >= 0.0), "{t}: {p:?}");
            for j in 0..3 {
                let sum = p[j] + p[3 + j] + p[6 + j];
                assert!((sum - 1.0).abs() < 5e-16, "{t}: {sum}");
            }
            if t == 1e3 {
                // λ = −s/2 + s²/(8f) …, and the mean of both columns decays with it.
                let right = 0.5 * crate::maths::scalar::exp(-0.5 * slow * t);
                close(&[p[0], p[1]], &[right, right], 1e-9);
            }
        }
    }

    /// A → nothing with a rate of 1 beside a rate of 1e12.
    #[test]
    fn fast_neighbours_cost_no_digits() {
        let p = Exponential::new(2, &[-1e12, 0.0, 0.0, -1.0], &[0.0; 2]).propagator(3.0).matrix;
        close(&p, &[0.0, 0.0, 0.0, 0.049_787_068_367_863_944], 1e-15);
    }

    /// dy/dt = b − k y: y = y₀ e^{−kt} + (b/k)(1 − e^{−kt}).
    #[test]
    fn production_is_added() {
        let p = Exponential::new(1, &[-2.0], &[3.0]).propagator(0.7);
        let decay = 0.246_596_963_941_606_5;
        close(&p.matrix, &[decay], 1e-15);
        close(&p.constant, &[1.5 * (1.0 - decay)], 1e-15);
    }
}

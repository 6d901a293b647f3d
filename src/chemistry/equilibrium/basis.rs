//! Minerals that are there and the most abundant species as primary ones.
//!
//! Owns the change of basis. May use the compiled system and the words. It deliberately knows no balances.

use super::system::System;
use crate::maths::double::Double;

/// Coefficients are small fractions: below this they are none.
const NONE: f64 = 1e-20;

/// Species that all others are made of, and how.
///
/// Equation: `ν_s = Σ_b β_sb ν_b`; `ξ'_b = ν_b·ξ`, so that `ξ = B⁻¹ ξ'`, and totals turn into `T' = B⁻ᵀ T`.
/// Symbols: ν coefficients over primaries, B the rows ν_b.
/// Dimensions and range: any n.
/// Source: greedy basis of a matroid (Edmonds 1971, Mathematical Programming 1, 127); dominant species as
/// primaries: Bethke 2008, Geochemical and Biogeochemical Reaction Modeling, §4.3.
/// Shape: a species is made only of more abundant ones. A balance then has no terms that are beyond its basis species,
/// and derivatives of balances, scaled by their diagonal, are near those of independent ones.
pub(super) struct Basis {
    n: usize,
    /// B⁻¹, row by row.
    inverse: Vec<Vec<Double>>,
}

impl Basis {
    /// Of these minerals, which come first, and of concentrations of primaries and secondaries.
    pub fn new(system: &System, minerals: &[usize], c: &[f64]) -> Self {
        let n = system.n_primaries;
        let mut order: Vec<usize> = (0..c.len()).collect();
        order.sort_by(|&a, &b| c[b].total_cmp(&c[a]));
        let first = n + system.n_secondaries;
        let order = minerals.iter().map(|k| first + k).chain(order);
        // Rows [ν_b | e_b], reduced as they come.
        let mut rows: Vec<(usize, Vec<Double>)> = Vec::with_capacity(n);
        for species in order {
            let mut row = vec![Double::ZERO; 2 * n];
            match species.checked_sub(n) {
                None => row[species] = Double::ONE,
                Some(i) => {
                    let entries = &system.rows[i].entries;
                    entries.iter().for_each(|entry| row[entry.primary] = Double::from(entry.nu));
                }
            }
            row[n + rows.len()] = Double::ONE;
            for (pivot, other) in &rows {
                let factor = row[*pivot];
                subtract(&mut row, factor, other);
            }
            let Some(pivot) = (0..n).find(|&j| row[j] != Double::ZERO) else { continue };
            let by = row[pivot];
            row.iter_mut().for_each(|value| *value = value.over(by));
            for (_, other) in &mut rows {
                let factor = other[pivot];
                subtract(other, factor, &row);
            }
            rows.push((pivot, row));
            if rows.len() == n {
                break;
            }
        }
        rows.sort_by_key(|(pivot, _)| *pivot);
        Self { n, inverse: rows.into_iter().map(|(_, row)| row[n..].to_vec()).collect() }
    }

    /// `B⁻ᵀ x`: coefficients or totals over the basis.
    pub fn over(&self, x: impl IntoIterator<Item = (usize, f64)>) -> Vec<Double> {
        let mut sum = vec![Double::ZERO; self.n];
        let mut size = vec![0.0; self.n];
        for (j, x) in x {
            for b in 0..self.n {
                let part = self.inverse[j][b].times(x);
                sum[b] += part;
                size[b] += part.nearest().abs();
            }
        }
        let is_none = |(sum, size): (&Double, f64)| sum.nearest().abs() <= 1e-28 * size;
        sum.iter().zip(size).map(|pair| if is_none(pair) { Double::ZERO } else { *pair.0 }).collect()
    }

    /// `B⁻¹ x`: a change of `ln c` of primaries from that of the basis.
    pub fn back(&self, x: &[Double]) -> Vec<Double> {
        let row = |row: &Vec<Double>| row.iter().zip(x).fold(Double::ZERO, |sum, (a, x)| sum + *a * *x);
        self.inverse.iter().map(row).collect()
    }
}

fn subtract(row: &mut [Double], factor: Double, other: &[Double]) {
    if factor == Double::ZERO {
        return;
    }
    for (value, other) in row.iter_mut().zip(other) {
        let rest = *value - factor * *other;
        *value = if rest.nearest().abs() < NONE { Double::ZERO } else { rest };
    }
}

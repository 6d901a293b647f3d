//! Sums that no reaction changes, and their repair after roundings and clipped values.
//!
//! Owns the left null space of the stoichiometry. May use nothing else of the crate. It deliberately
//! changes values by factors only: what is zero stays zero, and signs stay.

use std::cmp::Ordering;

/// Rows `w` with `w · dy/dt = 0` for any rates.
#[derive(Debug, Clone, Default)]
pub struct Invariants {
    rows: Vec<Vec<(usize, f64)>>,
}

impl Invariants {
    /// `reactions` are the changes of each; components that nothing changes are left out.
    pub fn new(n: usize, reactions: &[Vec<(usize, f64)>]) -> Self {
        // Gauss–Jordan over the columns of the stoichiometry: each pivot writes one component by others.
        let mut rows: Vec<Vec<f64>> = reactions
            .iter()
            .map(|changes| {
                let mut row = vec![0.0; n];
                changes.iter().for_each(|&(component, coefficient)| row[component] += coefficient);
                row
            })
            .collect();
        let is_changed: Vec<bool> =
            (0..n).map(|component| rows.iter().any(|row| row[component] != 0.0)).collect();
        let mut pivots: Vec<(usize, usize)> = Vec::new();
        for idx in 0..rows.len() {
            let size = rows[idx].iter().fold(0.0_f64, |largest, entry| largest.max(entry.abs()));
            let original =
                reactions[idx].iter().fold(0.0_f64, |largest, (_, entry)| largest.max(entry.abs()));
            if size <= 1e-12 * original {
                continue;
            }
            let Some(column) = (0..n).max_by(|&a, &b| rows[idx][a].abs().total_cmp(&rows[idx][b].abs()))
            else {
                continue;
            };
            let pivot = rows[idx][column];
            rows[idx].iter_mut().for_each(|entry| *entry /= pivot);
            let own = rows[idx].clone();
            for (other, row) in rows.iter_mut().enumerate().filter(|(other, _)| *other != idx) {
                let factor = row[column];
                if factor != 0.0 {
                    row.iter_mut().zip(&own).for_each(|(entry, own)| *entry -= factor * own);
                    row[column] = 0.0;
                    let _ = other;
                }
            }
            pivots.push((idx, column));
        }
        let is_pivot = |component: usize| pivots.iter().any(|&(_, column)| column == component);
        let free = (0..n).filter(|&component| is_changed[component] && !is_pivot(component));
        let rows = free
            .map(|component| {
                let mut row = vec![(component, 1.0)];
                for &(idx, column) in &pivots {
                    // The reduced row says: change of `column` per change of the free component.
                    let entry = rows[idx][component];
                    if entry.abs() > 1e-12 {
                        row.push((column, -entry));
                    }
                }
                row.sort_by_key(|&(component, _)| component);
                row
            })
            .collect();
        Self { rows }
    }

    pub fn count(&self) -> usize {
        self.rows.len()
    }

    /// The sums and the sums of sizes, which say what a rounding is worth.
    pub fn totals(&self, y: &[f64], totals: &mut [f64]) {
        for (row, total) in self.rows.iter().zip(totals) {
            *total = row.iter().map(|&(component, weight)| weight * y[component]).sum();
        }
    }

    /// Restores the totals by the smallest relative changes.
    ///
    /// Equation: `y ← y + diag(|y|) Wᵀ λ`, `(W diag(|y|) Wᵀ) λ = totals − W y`.
    /// Symbols: W rows of invariants.
    /// Dimensions and range: concentrations; nothing is done where a component would lose more than itself.
    /// Source: least squares with the weights 1/|y|.
    /// Shape: a projection.
    pub fn restore(&self, y: &mut [f64], totals: &[f64], scratch: &mut Vec<f64>) {
        let m = self.rows.len();
        scratch.clear();
        scratch.resize(m * (m + 1), 0.0);
        let mut is_off = false;
        for (i, (row, total)) in self.rows.iter().zip(totals).enumerate() {
            let (mut sum, mut size) = (0.0, 0.0);
            for &(component, weight) in row {
                sum += weight * y[component];
                size += (weight * y[component]).abs();
            }
            scratch[i * (m + 1) + m] = total - sum;
            is_off |= (total - sum).abs() > 2.0 * f64::EPSILON * size;
        }
        if !is_off {
            return;
        }
        self.normal_matrix(y, scratch);
        solve_dense(m, scratch);
        let lambda = |i: usize| scratch[i * (m + 1) + m];
        // What a component changes by, as a part of itself, from all rows together.
        let factor = |component: usize| -> f64 {
            let own =
                |row: &Vec<(usize, f64)>| row.iter().find(|(other, _)| *other == component).map(|e| e.1);
            let parts = self.rows.iter().enumerate().filter_map(|(i, row)| Some(own(row)? * lambda(i)));
            parts.sum()
        };
        let touched: Vec<usize> = (0..y.len()).filter(|&component| factor(component) != 0.0).collect();
        if touched.iter().any(|&component| factor(component).partial_cmp(&-1.0) != Some(Ordering::Greater)) {
            return;
        }
        for component in touched {
            y[component] += y[component].abs() * factor(component);
        }
    }

    fn normal_matrix(&self, y: &[f64], scratch: &mut [f64]) {
        let m = self.rows.len();
        for (i, left) in self.rows.iter().enumerate() {
            for (j, right) in self.rows.iter().enumerate() {
                let mut sum = 0.0;
                for &(component, weight) in left {
                    for &(_, other) in right.iter().filter(|(other, _)| *other == component) {
                        sum += weight * other * y[component].abs();
                    }
                }
                scratch[i * (m + 1) + j] = sum;
            }
        }
    }
}

/// Gauss with pivots on an m × (m + 1) system; the solution stands in the last column. A pivot of nothing
/// gives a solution of nothing.
fn solve_dense(m: usize, a: &mut [f64]) {
    let width = m + 1;
    for k in 0..m {
        let best =
            (k..m).max_by(|&i, &j| a[i * width + k].abs().total_cmp(&a[j * width + k].abs())).unwrap_or(k);
        (0..width).for_each(|j| a.swap(k * width + j, best * width + j));
        let pivot = a[k * width + k];
        if pivot == 0.0 {
            (0..width).for_each(|j| a[k * width + j] = 0.0);
            continue;
        }
        (k..width).for_each(|j| a[k * width + j] /= pivot);
        for i in (0..m).filter(|&i| i != k) {
            let factor = a[i * width + k];
            if factor != 0.0 {
                (k..width).for_each(|j| a[i * width + j] -= factor * a[k * width + j]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A + B ⇌ C, C → 2 D: two sums are kept.
    fn example() -> Invariants {
        Invariants::new(5, &[vec![(0, -1.0), (1, -1.0), (2, 1.0)], vec![(2, -1.0), (3, 2.0)]])
    }

    #[test]
    fn rows_are_orthogonal_to_the_reactions() {
        let invariants = example();
        assert_eq!(invariants.count(), 2);
        for change in [[-1.0, -1.0, 1.0, 0.0, 0.0], [0.0, 0.0, -1.0, 2.0, 0.0]] {
            let mut totals = [0.0; 2];
            invariants.totals(&change, &mut totals);
            assert_eq!(totals, [0.0, 0.0]);
        }
    }

    #[test]
    fn totals_are_restored_and_zeros_stay() {
        let invariants = example();
        let (mut totals, mut scratch) = ([0.0; 2], Vec::new());
        invariants.totals(&[1.0, 2.0, 0.0, 1e-9, 7.0], &mut totals);
        let mut y = [1.0 + 1e-9, 2.0 - 3e-10, 0.0, 1e-9, 7.0];
        invariants.restore(&mut y, &totals, &mut scratch);
        let mut found = [0.0; 2];
        invariants.totals(&y, &mut found);
        for (found, right) in found.iter().zip(totals) {
            assert!((found - right).abs() <= 1e-15, "{found} {right}");
        }
        assert_eq!((y[2], y[4]), (0.0, 7.0));
    }
}

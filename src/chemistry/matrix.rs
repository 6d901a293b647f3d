//! Sparse matrices over lanes, factored in an order that is chosen once.
//!
//! Owns the elimination order, the fill-in and the flat lists of operations. May use lanes. It
//! deliberately does not pivot: the caller sees a bad pivot as a result that is not finite, and takes a
//! smaller step, with which the diagonal dominates.

use super::laws::{LANES, Lane};

/// `L U = d I − J` for a Jacobian with a known pattern.
#[derive(Debug, Clone)]
pub struct Symbolic {
    /// Where each entry of the Jacobian's pattern stands.
    entries: Vec<u32>,
    pivots: Vec<Pivot>,
    /// `(target, left, right)`: `a[target] −= a[left] a[right]`.
    updates: Vec<[u32; 3]>,
    /// `(slot, row)` of the entries below the pivots.
    lower: Vec<[u32; 2]>,
    /// `(slot, column)` of the entries right of the pivots.
    upper: Vec<[u32; 2]>,
    n_slots: usize,
}

/// One column of the elimination; the ranges are those of the lists of [`Symbolic`].
#[derive(Debug, Clone)]
struct Pivot {
    row: u32,
    slot: u32,
    lower: std::ops::Range<usize>,
    upper: std::ops::Range<usize>,
    updates: std::ops::Range<usize>,
}

impl Symbolic {
    /// Eliminates in Markowitz' order: the row and column that make least fill-in come first.
    pub fn new(n: usize, pattern: &[(usize, usize)]) -> Self {
        let mut slots = vec![u32::MAX; n * n];
        let mut n_slots = 0;
        let mut slot = |at: usize, slots: &mut Vec<u32>| {
            if slots[at] == u32::MAX {
                slots[at] = n_slots;
                n_slots += 1;
            }
            slots[at]
        };
        let entries = pattern.iter().map(|&(row, column)| slot(row * n + column, &mut slots)).collect();
        (0..n).for_each(|row| {
            slot(row * n + row, &mut slots);
        });
        let mut is_left = vec![true; n];
        let (mut pivots, mut updates, mut lower, mut upper) = (vec![], vec![], vec![], vec![]);
        for _ in 0..n {
            let row = cheapest(n, &slots, &is_left);
            is_left[row] = false;
            let rows: Vec<usize> = (0..n).filter(|&i| is_left[i] && slots[i * n + row] != u32::MAX).collect();
            let columns: Vec<usize> =
                (0..n).filter(|&j| is_left[j] && slots[row * n + j] != u32::MAX).collect();
            let starts = (lower.len(), upper.len(), updates.len());
            lower.extend(rows.iter().map(|&i| [slots[i * n + row], i as u32]));
            upper.extend(columns.iter().map(|&j| [slots[row * n + j], j as u32]));
            for &i in &rows {
                for &j in &columns {
                    let target = slot(i * n + j, &mut slots);
                    updates.push([target, slots[i * n + row], slots[row * n + j]]);
                }
            }
            pivots.push(Pivot {
                row: row as u32,
                slot: slots[row * n + row],
                lower: starts.0..lower.len(),
                upper: starts.1..upper.len(),
                updates: starts.2..updates.len(),
            });
        }
        Self { entries, pivots, updates, lower, upper, n_slots: n_slots as usize }
    }

    /// Numbers that a factored matrix needs.
    pub fn n_slots(&self) -> usize {
        self.n_slots
    }

    /// Writes `diagonal · I − J`; `jacobian` are registers, and `places` says which for each entry.
    #[inline(always)]
    pub fn fill(&self, diagonal: &Lane, jacobian: &[Lane], places: &[u16], a: &mut [Lane]) {
        a.iter_mut().for_each(|slot| *slot = [0.0; LANES]);
        for pivot in &self.pivots {
            a[pivot.slot as usize] = *diagonal;
        }
        for (&slot, &place) in self.entries.iter().zip(places) {
            let (mut value, entry) = (a[slot as usize], &jacobian[usize::from(place)]);
            for l in 0..LANES {
                value[l] -= entry[l];
            }
            a[slot as usize] = value;
        }
    }

    /// Factors in place; the diagonal then holds the inverse pivots.
    #[inline(always)]
    pub fn factor(&self, a: &mut [Lane]) {
        for pivot in &self.pivots {
            let mut inverse = a[pivot.slot as usize];
            for entry in &mut inverse {
                *entry = 1.0 / *entry;
            }
            a[pivot.slot as usize] = inverse;
            for &[slot, _] in &self.lower[pivot.lower.clone()] {
                let mut entry = a[slot as usize];
                for l in 0..LANES {
                    entry[l] *= inverse[l];
                }
                a[slot as usize] = entry;
            }
            for &[target, left, right] in &self.updates[pivot.updates.clone()] {
                let (left, right) = (a[left as usize], a[right as usize]);
                let mut value = a[target as usize];
                for l in 0..LANES {
                    value[l] -= left[l] * right[l];
                }
                a[target as usize] = value;
            }
        }
    }

    /// Solves in place with a factored matrix.
    #[inline(always)]
    pub fn solve(&self, a: &[Lane], b: &mut [Lane]) {
        for pivot in &self.pivots {
            let known = b[pivot.row as usize];
            for &[slot, row] in &self.lower[pivot.lower.clone()] {
                let (entry, mut value) = (&a[slot as usize], b[row as usize]);
                for l in 0..LANES {
                    value[l] -= entry[l] * known[l];
                }
                b[row as usize] = value;
            }
        }
        for pivot in self.pivots.iter().rev() {
            let mut value = b[pivot.row as usize];
            for &[slot, column] in &self.upper[pivot.upper.clone()] {
                let (entry, other) = (&a[slot as usize], &b[column as usize]);
                for l in 0..LANES {
                    value[l] -= entry[l] * other[l];
                }
            }
            let inverse = &a[pivot.slot as usize];
            for l in 0..LANES {
                value[l] *= inverse[l];
            }
            b[pivot.row as usize] = value;
        }
    }
}

/// The row that is left with the smallest product of other entries in its row and its column.
fn cheapest(n: usize, slots: &[u32], is_left: &[bool]) -> usize {
    let count =
        |at: &dyn Fn(usize) -> usize| (0..n).filter(|&k| is_left[k] && slots[at(k)] != u32::MAX).count() - 1;
    (0..n)
        .filter(|&row| is_left[row])
        .min_by_key(|&row| count(&|k| row * n + k) * count(&|k| k * n + row))
        .unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Random diagonally dominant patterns: the solution put back gives the right-hand side.
    #[test]
    fn solutions_satisfy_their_equations() {
        let mut state = 7_u64;
        let mut random = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / 9_007_199_254_740_992.0
        };
        for n in [1, 2, 5, 12, 30] {
            let mut pattern = Vec::new();
            (0..n).for_each(|row| {
                (0..n).for_each(|column| {
                    if random() < 0.25 {
                        pattern.push((row, column));
                    }
                })
            });
            let jacobian: Vec<Lane> =
                pattern.iter().map(|_| std::array::from_fn(|_| random() - 0.5)).collect();
            let places: Vec<u16> = (0..pattern.len() as u16).collect();
            let symbolic = Symbolic::new(n, &pattern);
            let mut a = vec![[0.0; LANES]; symbolic.n_slots()];
            let diagonal = [0.5 * n as f64 + 1.0; LANES];
            symbolic.fill(&diagonal, &jacobian, &places, &mut a);
            symbolic.factor(&mut a);
            let right: Vec<Lane> = (0..n).map(|_| std::array::from_fn(|_| random())).collect();
            let mut x = right.clone();
            symbolic.solve(&a, &mut x);
            for l in 0..LANES {
                let mut sums: Vec<f64> = (0..n).map(|row| diagonal[l] * x[row][l]).collect();
                for (&(row, column), entry) in pattern.iter().zip(&jacobian) {
                    sums[row] -= entry[l] * x[column][l];
                }
                for row in 0..n {
                    assert!((sums[row] - right[row][l]).abs() < 1e-13, "{n} {row}: {}", sums[row]);
                }
            }
        }
    }

    /// An arrow that points the wrong way fills up if its head is eliminated first, and not at all if it
    /// comes last.
    #[test]
    fn the_order_avoids_fill() {
        let n = 10;
        let pattern: Vec<(usize, usize)> = (1..n).flat_map(|k| [(0, k), (k, 0)]).collect();
        assert_eq!(Symbolic::new(n, &pattern).n_slots(), 3 * n - 2);
    }
}

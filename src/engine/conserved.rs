//! What reactions conserve, and whether they did.
//!
//! Owns the linear invariants of a network. May use the plan. It deliberately repairs nothing.

use super::amount::worse;
use super::react::Added;
use crate::plan::Plan;
use crate::plan::chemistry::Method;

/// Smaller pivots are zero: stoichiometric coefficients are not that far apart.
const ZERO: f64 = 1e-9;

/// Linear invariants `l · y` of the reactions that run in steps: a basis of the left null space of their
/// stoichiometry, without the components that no reaction touches.
///
/// - Equation: `Σ_k l_k N_kr = 0` for each reaction `r`.
/// - Symbols: `N_kr` what one unit of reaction `r` adds to component `k`.
/// - Range: coefficients within nine decades of one another.
/// - Source: Gauss–Jordan elimination.
/// - Shape: one vector over the components per invariant.
pub fn invariants(plan: &Plan) -> Vec<Vec<f64>> {
    let n = plan.components.len();
    let kinetics = plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
    // What is propagated when somebody looks changes no component.
    let kinetics = kinetics.filter(|kinetics| kinetics.method != Method::Observed);
    let reactions = kinetics.map_or(&[][..], |kinetics| &kinetics.reactions);
    let mut rows: Vec<Vec<f64>> = Vec::new();
    for reaction in reactions {
        let mut row = vec![0.0; n];
        reaction.changes.iter().for_each(|&(k, coefficient)| row[k] += coefficient);
        rows.push(row);
    }
    let is_touched: Vec<bool> = (0..n).map(|k| rows.iter().any(|row| row[k] != 0.0)).collect();
    let pivots = reduce(&mut rows);
    let free = (0..n).filter(|k| is_touched[*k] && !pivots.contains(k));
    let vector = |free: usize| {
        let mut vector = vec![0.0; n];
        vector[free] = 1.0;
        pivots.iter().zip(&rows).for_each(|(&pivot, row)| vector[pivot] = -row[free]);
        vector
    };
    free.map(vector).collect()
}

/// Brings rows to reduced echelon form and returns the column of each pivot.
fn reduce(rows: &mut [Vec<f64>]) -> Vec<usize> {
    let n_columns = rows.first().map_or(0, Vec::len);
    let mut pivots: Vec<usize> = Vec::new();
    for column in 0..n_columns {
        let rank = pivots.len();
        let best =
            (rank..rows.len()).max_by(|&a, &b| rows[a][column].abs().total_cmp(&rows[b][column].abs()));
        let Some(best) = best.filter(|&best| rows[best][column].abs() > ZERO) else { continue };
        rows.swap(rank, best);
        let factor = rows[rank][column];
        rows[rank].iter_mut().for_each(|entry| *entry /= factor);
        let head = rows[rank].clone();
        for (_, row) in rows.iter_mut().enumerate().filter(|(idx, _)| *idx != rank) {
            let factor = row[column];
            row.iter_mut().zip(&head).for_each(|(entry, head)| *entry -= factor * head);
        }
        pivots.push(column);
    }
    pivots
}

/// Per component the largest relative defect of the invariants that it takes part in, against what there
/// was, or has been added at most: how much has gone to and fro does not count.
pub fn defects(invariants: &[Vec<f64>], added: &[Added], peaks: &[f64], amounts: &[f64]) -> Vec<f64> {
    let mut defects = vec![0.0; added.len()];
    for vector in invariants {
        let sum: f64 = vector.iter().zip(added).map(|(l, added)| l * added.sum).sum();
        let sizes = peaks.iter().zip(amounts).map(|(peak, amount)| peak.max(*amount));
        let size: f64 = vector.iter().zip(sizes).map(|(l, size)| l.abs() * size).sum();
        let defect = if size > 0.0 { sum.abs() / size } else { sum.abs() };
        for (own, _) in defects.iter_mut().zip(vector).filter(|(_, l)| **l != 0.0) {
            *own = worse(*own, defect);
        }
    }
    defects
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reduced(rows: &[&[f64]]) -> (Vec<Vec<f64>>, Vec<usize>) {
        let mut rows: Vec<Vec<f64>> = rows.iter().map(|row| row.to_vec()).collect();
        let pivots = reduce(&mut rows);
        (rows, pivots)
    }

    #[test]
    fn a_reversible_pair_is_one_reaction() {
        let (rows, pivots) = reduced(&[&[-1.0, -2.0, 1.0], &[1.0, 2.0, -1.0]]);
        assert_eq!(pivots, [0]);
        assert_eq!(rows[0], [1.0, 2.0, -1.0]);
        assert_eq!(rows[1], [0.0; 3]);
    }

    #[test]
    fn what_is_lost_is_seen() {
        let added = |sum: f64| Added { sum, size: sum.abs() };
        let invariants = [vec![1.0, 0.0, 1.0]];
        let (none, peaks) = ([0.0; 3], [1.0, 5.0, 1.0]);
        assert_eq!(defects(&invariants, &[added(-1.0), added(5.0), added(1.0)], &peaks, &none), [0.0; 3]);
        let lost = defects(&invariants, &[added(-1.0), added(5.0), added(0.75)], &peaks, &none);
        assert_eq!(lost, [0.25 / 2.0, 0.0, 0.25 / 2.0]);
        // However often it went to and fro.
        let moved = |sum: f64| Added { sum, size: 1e6 };
        let seen = defects(&invariants, &[moved(-1.0), moved(5.0), moved(0.75)], &peaks, &[9.0, 0.0, 1.0]);
        assert_eq!(seen, [0.25 / 10.0, 0.0, 0.25 / 10.0]);
    }
}

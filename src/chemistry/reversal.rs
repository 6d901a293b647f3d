//! Reactions taken back where a particle would end below zero.
//!
//! Owns this correction. May use the plan. It deliberately knows no rate: what can be taken back is what the
//! products hold.

use crate::plan::Plan;

/// Passes over all reactions; each takes back what its products allow.
const PASSES: usize = 4;

/// The reactions of a plan, to be taken back.
///
/// With mixing zones a particle's concentration is in part the mean of its bin. When others use that up, a
/// particle that has used its own share already would be below zero: its conserved totals are those of a
/// mixture and allow a state at or above zero, but some of its product has to become reactant again. In the
/// limit of infinite rates this is what keeps a product at the smaller of two totals. A product below zero,
/// which others gave back, takes from its reactants in the same way.
#[derive(Debug, Clone)]
pub struct Reversal {
    reactions: Vec<Vec<(usize, f64)>>,
    /// Components that a reaction changes.
    changed: Vec<usize>,
}

impl Reversal {
    /// `None` if nothing reacts in steps, or if components are totals, which may be negative.
    pub fn new(plan: &Plan) -> Option<Self> {
        let chemistry = plan.chemistry.as_ref().filter(|chemistry| chemistry.equilibrium.is_none())?;
        let kinetics = chemistry.kinetics.as_ref().filter(|_| plan.reacts_in_steps())?;
        let reactions: Vec<Vec<(usize, f64)>> =
            kinetics.reactions.iter().map(|reaction| reaction.changes.clone()).collect();
        let changes = reactions.iter().flatten();
        let mut changed: Vec<usize> = changes.map(|&(k, _)| k).collect();
        changed.sort_unstable();
        changed.dedup();
        Some(Self { reactions, changed })
    }

    /// Moves reactions until no value of the first `n` particles is below zero, as far as the other side
    /// of each allows; what is conserved by the reactions stays.
    ///
    /// - Equation: `y ← y − x ν`, `x = min(max_s y_s / ν_s, min_p y_p / ν_p)` for negative reactants `s` of a
    ///   reaction and its products `p`; for negative products with the roles changed.
    /// - Symbols: `ν` changes of a reaction per unit of extent.
    /// - Range: any; reactions in their order, a few times over.
    /// - Source: irreversible reactions on conserved totals, methods, sections 7.2 and 7.6.
    /// - Shape: columns of one chunk.
    pub fn apply<C: AsMut<[f64]> + AsRef<[f64]>>(&self, columns: &mut [C], n: usize) {
        let is_below = |column: &usize| columns[*column].as_ref()[..n].iter().any(|&value| value < 0.0);
        if !self.changed.iter().any(is_below) {
            return;
        }
        for particle in 0..n {
            if self.changed.iter().any(|&k| columns[k].as_ref()[particle] < 0.0) {
                self.take_back(columns, particle);
            }
        }
    }

    #[cold]
    fn take_back<C: AsMut<[f64]> + AsRef<[f64]>>(&self, columns: &mut [C], particle: usize) {
        for _ in 0..PASSES {
            let mut is_done = true;
            for changes in &self.reactions {
                // Forward and back: how much is missing on one side, and how much the other can give.
                let (mut missing, mut given) = ([0.0_f64; 2], [f64::INFINITY; 2]);
                for &(k, nu) in changes.iter().filter(|(_, nu)| *nu != 0.0) {
                    let share = columns[k].as_ref()[particle] / nu.abs();
                    let (own, other) = if nu < 0.0 { (1, 0) } else { (0, 1) };
                    missing[own] = missing[own].max(-share);
                    given[other] = given[other].min(share.max(0.0));
                }
                let extent = missing[1].min(given[1]) - missing[0].min(given[0]);
                if extent != 0.0 {
                    is_done = false;
                    for &(k, nu) in changes {
                        let value = &mut columns[k].as_mut()[particle];
                        // What is brought up to zero is zero.
                        *value = if extent == *value / nu { 0.0 } else { *value - extent * nu };
                    }
                }
            }
            if is_done {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reversal(reactions: &[&[(usize, f64)]]) -> Reversal {
        let reactions: Vec<Vec<(usize, f64)>> = reactions.iter().map(|changes| changes.to_vec()).collect();
        let mut changed: Vec<usize> = reactions.iter().flatten().map(|&(k, _)| k).collect();
        changed.sort_unstable();
        changed.dedup();
        Reversal { reactions, changed }
    }

    #[test]
    fn a_product_gives_back_what_is_missing() {
        let reversal = reversal(&[&[(0, -1.0), (1, -1.0), (2, 1.0)]]);
        let mut columns = vec![vec![-0.25, 0.5], vec![2.0, 0.5], vec![1.0, 0.0]];
        reversal.apply(&mut columns, 2);
        assert_eq!(columns, [vec![0.0, 0.5], vec![2.25, 0.5], vec![0.75, 0.0]]);
        let mut columns = vec![vec![0.5], vec![2.0], vec![-0.25]];
        reversal.apply(&mut columns, 1);
        assert_eq!(columns, [vec![0.25], vec![1.75], vec![0.0]]);
    }

    /// Two steps of a chain: the second has to give back before the first can.
    #[test]
    fn chains_are_taken_back_from_their_end() {
        let reversal = reversal(&[&[(0, -1.0), (1, 1.0)], &[(1, -1.0), (2, 2.0)]]);
        let mut columns = vec![vec![-0.5], vec![0.0], vec![3.0]];
        reversal.apply(&mut columns, 1);
        // The intermediate is not below zero, so nothing asks the second reaction: the first has nothing to
        // give, and the value stays as it is.
        assert_eq!(columns, [vec![-0.5], vec![0.0], vec![3.0]]);
        let mut columns = vec![vec![-0.5], vec![0.75], vec![3.0]];
        reversal.apply(&mut columns, 1);
        assert_eq!(columns, [vec![0.0], vec![0.25], vec![3.0]]);
    }
}

//! Reactions taken back where a particle would end below zero.
//!
//! Owns this correction, and what is left below zero after it. May use the plan. It deliberately knows no
//! rate: what can be taken back is what the products hold.

use crate::plan::Plan;
use crate::plan::chemistry::Method;

/// Passes over all reactions; each takes back what its products allow.
const PASSES: usize = 4;
/// Reactions that are asked, one for the other, for one particle.
const MOST_ASKED: usize = 256;

/// The reactions of a plan, to be taken back.
///
/// With mixing zones a particle's concentration is in part the mean of its bin. When others use that up, a
/// particle that has used its own share already would be below zero: its conserved totals are those of a
/// mixture and allow a state at or above zero, but some of its product has to become reactant again. In the
/// limit of infinite rates this is what keeps a product at the smaller of two totals. A product below zero,
/// which others gave back, takes from its reactants in the same way.
///
/// Where the products went on to react, or stay in a bin that others have emptied, something may be missing
/// still. It is a deficit that the particle carries, see [`Reversal::carry`].
#[derive(Debug, Clone)]
pub struct Reversal {
    reactions: Vec<Vec<(usize, f64)>>,
    /// Components that a reaction changes and that are never negative.
    changed: Vec<usize>,
    /// Per component: totals that may have any sign are never missing.
    is_amount: Vec<bool>,
    /// Linear laws go on below zero as above it.
    is_linear: bool,
}

impl Reversal {
    /// `None` if nothing reacts in steps.
    pub fn new(plan: &Plan) -> Option<Self> {
        let kinetics = plan.chemistry.as_ref()?.kinetics.as_ref().filter(|_| plan.reacts_in_steps())?;
        let reactions = kinetics.reactions.iter().map(|reaction| reaction.changes.clone()).collect();
        Some(Self::of(reactions, plan.amounts(), kinetics.method == Method::Exponential))
    }

    /// The same for those who look: without reactions of what lives in bins, whose amounts are shown as they
    /// are and cannot give to one particle.
    pub fn shown(plan: &Plan) -> Option<Self> {
        let Self { mut reactions, is_amount, is_linear, .. } = Self::new(plan)?;
        let is_mobile = |&(k, _): &(usize, f64)| !plan.components[k].is_immobile;
        reactions.retain(|changes| changes.iter().all(is_mobile));
        (!reactions.is_empty()).then(|| Self::of(reactions, is_amount, is_linear))
    }

    fn of(reactions: Vec<Vec<(usize, f64)>>, is_amount: Vec<bool>, is_linear: bool) -> Self {
        let mut changed: Vec<usize> = reactions.iter().flatten().map(|&(k, _)| k).collect();
        changed.retain(|&k| is_amount[k]);
        changed.sort_unstable();
        changed.dedup();
        Self { reactions, changed, is_amount, is_linear }
    }

    /// Moves reactions until no value of the first `n` particles is below zero, as far as the other side
    /// of each allows; what is conserved by the reactions stays.
    ///
    /// - Equation: `y ← y − x ν`, `x = min(max_s y_s / ν_s, min_p y_p / ν_p)` for negative reactants `s` of a
    ///   reaction and its products `p`; for negative products with the roles changed. Where a product has
    ///   reacted on, that reaction is taken back first.
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
                self.take_back_chains(columns, particle);
            }
        }
    }

    /// What is still below zero does not react: it is taken out of `values` and of `before` alike, so that
    /// the change from one to the other is that of the reactions alone. A deficit stays with its particle
    /// until its zones have relaxed or a reaction has made up for it, and every conserved sum stays.
    ///
    /// - Equation: `U' = R(max(U, 0)) + min(U, 0)`
    /// - Symbols: `R` what the laws make of concentrations.
    /// - Range: any values.
    /// - Source: definition; `l · R(c) = l · c` for each invariant `l`, hence `l · U' = l · U`.
    /// - Shape: columns of one chunk.
    pub fn carry<C: AsMut<[f64]> + AsRef<[f64]>>(&self, values: &mut [C], before: &mut [C], n: usize) {
        if self.is_linear {
            return;
        }
        for &k in &self.changed {
            let (values, before) = (&mut values[k].as_mut()[..n], &mut before[k].as_mut()[..n]);
            for (value, before) in values.iter_mut().zip(before) {
                if *value < 0.0 {
                    *before -= *value;
                    *value = 0.0;
                }
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
                for &(k, nu) in changes.iter().filter(|(k, nu)| *nu != 0.0 && self.is_amount[*k]) {
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

    /// What is missing still is asked of products that have reacted on.
    #[cold]
    fn take_back_chains<C: AsMut<[f64]> + AsRef<[f64]>>(&self, columns: &mut [C], particle: usize) {
        let mut left = MOST_ASKED;
        for &k in &self.changed {
            let missing = -columns[k].as_ref()[particle];
            if missing > 0.0 {
                self.give(columns, particle, (k, missing), &mut Vec::new(), &mut left);
                let value = &mut columns[k].as_mut()[particle];
                if value.abs() <= 2.0 * f64::EPSILON * missing {
                    *value = 0.0;
                }
            }
        }
    }

    /// Brings up to `wanted` more of a component from the reactions that used it up, last ones first. Those
    /// in `asked` wait for this one.
    fn give<C: AsMut<[f64]> + AsRef<[f64]>>(
        &self,
        columns: &mut [C],
        particle: usize,
        (wanted_of, mut wanted): (usize, f64),
        asked: &mut Vec<usize>,
        left: &mut usize,
    ) {
        asked.push(wanted_of);
        for changes in self.reactions.iter().rev() {
            let own = changes.iter().find(|&&(k, nu)| k == wanted_of && nu < 0.0);
            let Some(&(_, own)) = own.filter(|_| *left > 0 && wanted > 0.0) else { continue };
            *left -= 1;
            let mut extent = wanted / -own;
            for &(k, nu) in changes.iter().filter(|&&(k, nu)| nu > 0.0 && self.is_amount[k]) {
                let held = columns[k].as_ref()[particle].max(0.0);
                if held < extent * nu && !asked.contains(&k) {
                    self.give(columns, particle, (k, extent * nu - held), asked, left);
                }
                extent = extent.min(columns[k].as_ref()[particle].max(0.0) / nu);
            }
            if extent > 0.0 {
                changes.iter().for_each(|&(k, nu)| columns[k].as_mut()[particle] -= extent * nu);
                wanted += extent * own;
            }
        }
        asked.pop();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reversal(reactions: &[&[(usize, f64)]]) -> Reversal {
        Reversal::of(reactions.iter().map(|changes| changes.to_vec()).collect(), vec![true; 8], false)
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
        for (first, second, right) in
            [(0.0, 3.0, [0.0, 0.0, 2.0]), (0.75, 3.0, [0.0, 0.25, 3.0]), (0.25, 3.0, [0.0, 0.0, 2.5])]
        {
            let mut columns = vec![vec![-0.5], vec![first], vec![second]];
            reversal.apply(&mut columns, 1);
            assert_eq!(columns.concat(), right);
        }
        // More than there is nobody gives.
        let mut columns = vec![vec![-0.5], vec![0.125], vec![0.25]];
        reversal.apply(&mut columns, 1);
        assert_eq!(columns.concat(), [-0.25, 0.0, 0.0]);
    }

    /// Reactions both ways, and one that ends where another begins, come to an end.
    #[test]
    fn circles_come_to_an_end() {
        let reversal = reversal(&[
            &[(0, -1.0), (1, 1.0)],
            &[(1, -1.0), (0, 1.0)],
            &[(1, -1.0), (2, 1.0)],
            &[(2, -1.0), (0, 1.0)],
        ]);
        let mut columns = vec![vec![-0.5], vec![0.0], vec![0.25]];
        reversal.apply(&mut columns, 1);
        assert_eq!(columns.concat(), [-0.25, 0.0, 0.0]);
    }

    #[test]
    fn what_is_missing_still_is_carried_past_the_reaction() {
        let reversal = reversal(&[&[(0, -1.0), (1, 1.0)]]);
        let (mut values, mut before) = (vec![vec![-0.5], vec![0.0]], vec![vec![-0.75], vec![0.25]]);
        reversal.carry(&mut values, &mut before, 1);
        assert_eq!((values.concat(), before.concat()), (vec![0.0, 0.0], vec![-0.25, 0.25]));
    }
}

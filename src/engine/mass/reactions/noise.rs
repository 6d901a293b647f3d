//! What noise of concentrations makes of rates.
//!
//! Owns the correction of laws that are bent. May use tapes, the plan and dense matrices. It deliberately corrects nothing where
//! what each reaction did does not show in the sum.

#![allow(clippy::needless_range_loop)] // A cell belongs to several columns at once.

use super::super::super::parallel;
use crate::plan::Plan;
use crate::plan::build_tape::SPECIES_INPUT;
use crate::plan::chemistry::{Kinetic, Kinetics, Law};
use crate::plan::tape::{Operation, Tape};
use crate::state::particles::CHUNK;
use nalgebra::DMatrix;
use std::ops::Range;

/// Laws of a plan, at least one of them bent.
#[derive(Debug, Clone)]
pub struct Noise {
    changes: Vec<Change>,
    /// What is dissolved of each species.
    shares: Vec<f64>,
}

/// Reactions that change the same in the same proportions, as both ways of a reversible one do.
#[derive(Debug, Clone)]
struct Change {
    /// What one extent changes, by species.
    net: Vec<f64>,
    /// What the change of each species says of the extent.
    extent: Vec<f64>,
    /// Rates, and how much of the extent each is.
    tapes: Vec<(f64, Tape)>,
    /// Species that they are bent in, or may be.
    species: Vec<usize>,
}

/// Of the largest singular value, what is as good as none.
const NONE: f64 = 1e-9;

/// Part of a rate beyond which noise is no small thing that could be corrected.
const MOST: f64 = 1.0;

impl Noise {
    /// Of a plan whose reactions are all at rates, some not linear in each species, and show in what changes.
    ///
    /// - Equation: `ξ = (Nᵀ N)⁻¹ Nᵀ Δc`.
    /// - Symbols: `N` net coefficients by species and change, of full column rank; `Δc` what a step has changed; `ξ` extents.
    /// - Range: reactions whose changes are parallel count as one; nothing where the rank is less.
    /// - Source: least squares, exact as Δc is a sum of such changes.
    /// - Shape: one row per change.
    pub fn new(plan: &Plan) -> Option<Self> {
        let kinetics = plan.chemistry.as_ref()?.kinetics.as_ref()?;
        if !plan.reactions.is_empty() {
            return None;
        }
        let mut changes: Vec<Change> = Vec::new();
        for (idx, reaction) in kinetics.reactions.iter().enumerate() {
            add(plan, kinetics, (idx, reaction), &mut changes)?;
        }
        // What comes to rest between two ways is left alone: the sum of rates says nothing of what noise does to either.
        let has_both_ways = |change: &&mut Change| change.tapes.iter().any(|(weight, _)| *weight < 0.0);
        changes.iter_mut().filter(has_both_ways).for_each(|change| change.species.clear());
        let is_straight = changes.iter().all(|change| change.species.is_empty());
        if is_straight || changes.len() > plan.species.len() {
            return None;
        }
        let net = DMatrix::from_fn(plan.species.len(), changes.len(), |row, column| changes[column].net[row]);
        let svd = net.svd(true, true);
        if svd.singular_values.min() <= NONE * svd.singular_values.max() {
            return None;
        }
        let inverse = svd.pseudo_inverse(0.0).ok()?;
        for (idx, change) in changes.iter_mut().enumerate() {
            change.extent = inverse.row(idx).iter().copied().collect();
        }
        let share = |own: &crate::plan::Species| own.terms.first().map_or(1.0, |(_, share)| *share);
        Some(Self { changes, shares: plan.species.iter().map(share).collect() })
    }

    /// By how much of itself a rate of estimated concentrations has to be changed to be that of the true ones on average.
    ///
    /// - Equation: `b = −Σ_s [r(c + σ_s) − 2 r(c) + r(c − σ_s)]/(2 r(c))`.
    /// - Symbols: `σ_s` standard error of a concentration, at most the concentration; `r` rate.
    /// - Range: -1 to 1; exact for quadratic laws with errors of the species that are independent. Rates of one change are added.
    /// - Source: methods, section 5.3, noise bias `½ r″ Var`, with differences over a standard error for derivatives.
    /// - Shape: with the rate, one per change and cell; none for changes whose laws are not bent.
    fn bends(&self, at: ([&[f64]; 3], f64), columns: &[&[f64]], variances: &[&[f64]]) -> Vec<Vec<[f64; 2]>> {
        let scaled = |(own, share): (&&[f64], &f64)| own.iter().map(|u| u * share).collect();
        let columns: Vec<Vec<f64>> = columns.iter().zip(&self.shares).map(scaled).collect();
        let of = |change: &Change| self.bends_of(change, at, &columns, variances);
        self.changes.iter().map(of).collect()
    }

    fn bends_of(
        &self,
        change: &Change,
        (places, t): ([&[f64]; 3], f64),
        columns: &[Vec<f64>],
        variances: &[&[f64]],
    ) -> Vec<[f64; 2]> {
        if change.species.is_empty() {
            return Vec::new();
        }
        let n = columns.first().map_or(0, Vec::len);
        let (zeros, times) = (vec![0.0; n], vec![t; n]);
        let mut scratch = Vec::new();
        let mut rate = |moved: Option<(usize, &[f64])>| {
            let along = |axis: &'_ usize| if places[*axis].is_empty() { &zeros[..] } else { places[*axis] };
            let mut inputs: Vec<&[f64]> = [0, 1, 2].iter().map(along).collect();
            inputs.push(&times);
            debug_assert_eq!(inputs.len(), usize::from(SPECIES_INPUT));
            inputs.extend(columns.iter().enumerate().map(|(species, own)| match moved {
                Some((other, values)) if other == species => values,
                _ => &own[..],
            }));
            let (mut rates, mut own) = (vec![0.0; n], vec![0.0; n]);
            for (weight, tape) in &change.tapes {
                tape.evaluate_block(&inputs, &mut scratch, &mut own);
                rates.iter_mut().zip(&own).for_each(|(sum, rate)| *sum += weight * rate);
            }
            rates
        };
        let middle = rate(None);
        let mut bends = vec![0.0; n];
        for &species in change.species.iter().filter(|&&species| !variances[species].is_empty()) {
            let (own, variance) = (&columns[species], variances[species]);
            let moved = |sign: f64| -> Vec<f64> {
                let share = self.shares[species];
                own.iter().zip(variance).map(|(c, var)| c + sign * (share * var.sqrt()).min(*c)).collect()
            };
            let (above, below) = (rate(Some((species, &moved(1.0)))), rate(Some((species, &moved(-1.0)))));
            for ((bend, middle), (above, below)) in
                bends.iter_mut().zip(&middle).zip(above.iter().zip(&below))
            {
                let bent = 0.5 * (above - 2.0 * middle + below) / middle;
                if bent.is_finite() {
                    *bend -= bent;
                }
            }
        }
        bends.iter().zip(middle).map(|(bend, rate)| [bend.clamp(-MOST, MOST), rate]).collect()
    }

    /// Multiplies what each change has done since `before`, as far as there is enough of everything for it.
    pub fn correct(
        &self,
        (places, t, dt): (&[Vec<f64>; 3], f64, f64),
        columns: &mut [Vec<f64>],
        before: &[Vec<f64>],
        variances: &[Vec<f64>],
    ) {
        let n = columns.first().map_or(0, Vec::len);
        let all = parallel::map(n.div_ceil(CHUNK), &|chunk| {
            let range = chunk * CHUNK..n.min((chunk + 1) * CHUNK);
            let places = places.each_ref().map(|axis| axis.get(range.clone()).unwrap_or_default());
            let (new, old) = (cut(columns, &range), cut(before, &range));
            self.more((&new, &old), &self.bends((places, t), &old, &cut(variances, &range)), dt)
        });
        for (chunk, more) in all.iter().enumerate() {
            for (column, more) in columns.iter_mut().zip(more) {
                // What does not change keeps its last digit.
                for (new, more) in column[chunk * CHUNK..].iter_mut().zip(more).filter(|it| *it.1 != 0.0) {
                    *new = (*new + more).max(0.0);
                }
            }
        }
    }

    /// What is to be added to each species.
    ///
    /// - Equation: `Σ_k ν_k b_k ξ_k (ξ_k/(r_k Δt))²`.
    /// - Symbols: `b_k` bend of a rate, `ξ_k` extent of the step, `ν_k` what one extent changes.
    /// - Range: steps of any length: what has run out does not hang on rates any more.
    /// - Source: second derivative of `c₀ − c₀/(1 + k c₀ Δt)` by c₀, exact for A² alone.
    /// - Shape: one per species and cell.
    fn more(&self, (new, old): (&[&[f64]], &[&[f64]]), bends: &[Vec<[f64; 2]>], dt: f64) -> Vec<Vec<f64>> {
        let n = new.first().map_or(0, |own| own.len());
        let mut all = vec![vec![0.0; n]; new.len()];
        for cell in 0..n {
            for (change, bends) in self.changes.iter().zip(bends).filter(|(_, own)| !own.is_empty()) {
                let mut extent = 0.0;
                for species in 0..new.len() {
                    extent += change.extent[species] * (new[species][cell] - old[species][cell]);
                }
                let [bend, rate] = bends[cell];
                let followed = extent / (rate * dt);
                let followed = if followed > 0.0 { followed.min(1.0) } else { 0.0 };
                for species in 0..new.len() {
                    all[species][cell] += change.net[species] * bend * followed * followed * extent;
                }
            }
            let mut part = 1.0_f64;
            for species in 0..new.len() {
                if all[species][cell] < 0.0 {
                    part = part.min(new[species][cell] / -all[species][cell]);
                }
            }
            all.iter_mut().for_each(|own| own[cell] *= part);
        }
        all
    }
}

/// Adds a reaction to those that change the same, or as one of its own; nothing where a component is no species.
fn add(
    plan: &Plan,
    kinetics: &Kinetics,
    (idx, reaction): (usize, &Kinetic),
    changes: &mut Vec<Change>,
) -> Option<()> {
    let mut net = vec![0.0; plan.species.len()];
    for &(component, change) in &reaction.changes {
        net[plan.species_of(component)?] += change;
    }
    if net.iter().all(|change| *change == 0.0) {
        return Some(());
    }
    let tape = kinetics.laws.tape(idx);
    let species: Vec<usize> = match &reaction.law {
        Law::MassAction { orders, .. } => {
            orders.iter().filter(|(_, order)| *order != 1.0).map(|(species, _)| *species).collect()
        }
        Law::Saturation { species, .. } => vec![*species],
        Law::Expression => (0..plan.species.len()).filter(|&species| reads(&tape, species)).collect(),
    };
    for change in changes.iter_mut() {
        let Some(weight) = ratio(&net, &change.net) else { continue };
        change.tapes.push((weight, tape));
        change.species.extend(species);
        change.species.sort_unstable();
        change.species.dedup();
        return Some(());
    }
    changes.push(Change { net, extent: Vec::new(), tapes: vec![(1.0, tape)], species });
    Some(())
}

/// Some cells of all columns that there are.
fn cut<'a>(all: &'a [Vec<f64>], range: &Range<usize>) -> Vec<&'a [f64]> {
    all.iter().map(|own| own.get(range.clone()).unwrap_or_default()).collect()
}

fn reads(tape: &Tape, species: usize) -> bool {
    let input = SPECIES_INPUT + species as u16;
    tape.operations.contains(&Operation::Input(input))
}

/// How many times a change is another one, if it is.
fn ratio(one: &[f64], other: &[f64]) -> Option<f64> {
    let first = other.iter().position(|own| *own != 0.0)?;
    let ratio = one[first] / other[first];
    let is_same =
        |(one, other): (&f64, &f64)| (one - ratio * other).abs() <= 1e-12 * one.abs().max(other.abs());
    (ratio != 0.0 && one.iter().zip(other).all(is_same)).then_some(ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn noise(reactions: &str) -> Option<Noise> {
        let text = format!(
            "lamella 1\nspecies A, B, C\n{reactions}domain line x = 0 m .. 1 m\nboundary left, right reflect\n\
             dispersion 1e-3 m^2/s\ninitial A = 1 mol/m^3\nparticles mass 100\nrun to 1 s, step 0.1 s\n\
             output total A, B, C at t = 1 s\n"
        );
        let sources = crate::source::Sources::single("s.lam", text);
        let checked = crate::check(sources, &Default::default(), &Default::default());
        Noise::new(&checked.compiled.unwrap_or_else(|| panic!("{:#?}", checked.diagnostics)).plan)
    }

    /// Reference: `E[k A²] = k (A² + σ²)`, so that what A² does is to be 1 − σ²/A² of what was found, and nothing else changes.
    #[test]
    fn each_reaction_is_corrected_by_its_own_law() {
        let own =
            noise("reaction one: A -> B @ 1 m^3/mol/s * A^2\nreaction two: B -> C @ 1 /s * B\n").unwrap();
        let before = [vec![2.0], vec![1.0], vec![0.0]];
        let places = [vec![0.5], Vec::new(), Vec::new()];
        // Extents of 0.1, as fast as its rate says, and 0.05.
        let mut after = [vec![1.9], vec![1.05], vec![0.05]];
        own.correct((&places, 0.0, 0.1 / 4.0), &mut after, &before, &[vec![0.4], vec![0.1], Vec::new()]);
        let right = [1.91, 1.04, 0.05];
        assert!(after.iter().zip(right).all(|(own, right)| (own[0] - right).abs() < 1e-14), "{after:?}");
        // Four times the time: it has run out of what it is made of.
        let mut after = [vec![1.9], vec![1.05], vec![0.05]];
        own.correct((&places, 0.0, 0.1), &mut after, &before, &[vec![0.4], vec![0.1], Vec::new()]);
        assert!((after[0][0] - 1.9 - 0.01 / 16.0).abs() < 1e-14, "{after:?}");
    }

    /// Both ways of a reversible reaction are one change, which is left alone, and one way in two parts is one law.
    #[test]
    fn both_ways_are_one() {
        let (there, back) =
            ("reaction there: A -> B @ 1 m^3/mol/s * A^2\n", "reaction back: 2 B -> 2 A @ 0.1 /s * B\n");
        assert!(noise(&format!("{there}{back}")).is_none());
        let own = noise(&format!("{there}reaction other: 2 A -> 2 B @ 0.1 /s * A\n")).unwrap();
        assert_eq!(own.changes.len(), 1);
        let bends = own.bends(([&[0.5], &[], &[]], 0.0), &[&[2.0], &[1.0], &[0.0]], &[&[0.4], &[], &[]]);
        // r = A² + 2 · 0.1 A.
        assert!((bends[0][0][0] + 0.4 / 4.4).abs() < 1e-14, "{bends:?}");
    }

    /// Round a ring extents do not show in what has changed.
    #[test]
    fn what_does_not_show_is_left_alone() {
        let ring = "reaction one: A -> B @ 1 m^3/mol/s * A^2\nreaction two: B -> C @ 1 m^3/mol/s * B^2\n\
                    reaction three: C -> A @ 1 m^3/mol/s * C^2\n";
        assert!(noise(ring).is_none());
        let many = "reaction one: A -> B @ 1 m^3/mol/s * A^2\nreaction a: A -> @ 1 m^3/mol/s * A^2\n\
                    reaction b: B -> @ 1 m^3/mol/s * B^2\nreaction c: C -> @ 1 m^3/mol/s * C^2\n";
        assert!(noise(many).is_none());
        assert!(noise("reaction one: A + B -> C @ 1 m^3/mol/s * A * B\n").is_none());
    }
}

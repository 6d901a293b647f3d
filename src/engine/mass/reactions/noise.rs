//! What noise of concentrations makes of rates.
//!
//! Owns the correction of laws that are bent. May use tapes, the plan and dense matrices. It deliberately corrects nothing where
//! what each reaction did does not show in the sum.

#![allow(clippy::needless_range_loop)] // A cell belongs to several columns at once.

use crate::plan::Plan;
use crate::plan::build_tape::SPECIES_INPUT;
use crate::plan::chemistry::{Kinetic, Kinetics, Law};
use crate::plan::tape::Tape;
use nalgebra::DMatrix;

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

/// Factors beyond which noise is no small thing that could be corrected.
const FACTORS: (f64, f64) = (0.0, 2.0);

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
        if changes.iter().all(|change| change.species.is_empty()) {
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

    /// What a rate of estimated concentrations has to be multiplied by to be that of the true ones on average.
    ///
    /// - Equation: `f = 1 − Σ_s [r(c + σ_s) − 2 r(c) + r(c − σ_s)]/(2 r(c))`.
    /// - Symbols: `σ_s` standard error of a concentration, at most the concentration; `r` rate.
    /// - Range: 0 to 2; exact for quadratic laws with errors of the species that are independent. Rates of one change are added.
    /// - Source: methods, section 5.3, noise bias `½ r″ Var`, with differences over a standard error for derivatives.
    /// - Shape: one per change and cell; none for changes whose laws are not bent.
    pub fn factors(
        &self,
        at: (&[Vec<f64>; 3], f64),
        columns: &[Vec<f64>],
        variances: &[Vec<f64>],
    ) -> Vec<Vec<f64>> {
        let scaled = |(own, share): (&Vec<f64>, &f64)| own.iter().map(|u| u * share).collect();
        let columns: Vec<Vec<f64>> = columns.iter().zip(&self.shares).map(scaled).collect();
        let of = |change: &Change| self.factors_of(change, at, &columns, variances);
        self.changes.iter().map(of).collect()
    }

    fn factors_of(
        &self,
        change: &Change,
        (places, t): (&[Vec<f64>; 3], f64),
        columns: &[Vec<f64>],
        variances: &[Vec<f64>],
    ) -> Vec<f64> {
        if change.species.is_empty() {
            return Vec::new();
        }
        let n = columns.first().map_or(0, Vec::len);
        let (zeros, times) = (vec![0.0; n], vec![t; n]);
        let mut scratch = Vec::new();
        let mut rate = |moved: Option<(usize, &[f64])>| {
            let along =
                |axis: &'_ usize| if places[*axis].is_empty() { &zeros[..] } else { &places[*axis][..] };
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
        let mut factors = vec![1.0; n];
        for &species in change.species.iter().filter(|&&species| !variances[species].is_empty()) {
            let (own, variance) = (&columns[species], &variances[species]);
            let moved = |sign: f64| -> Vec<f64> {
                let share = self.shares[species];
                own.iter().zip(variance).map(|(c, var)| c + sign * (share * var.sqrt()).min(*c)).collect()
            };
            let (above, below) = (rate(Some((species, &moved(1.0)))), rate(Some((species, &moved(-1.0)))));
            for ((factor, middle), (above, below)) in
                factors.iter_mut().zip(&middle).zip(above.iter().zip(&below))
            {
                let bent = 0.5 * (above - 2.0 * middle + below) / middle;
                if bent.is_finite() {
                    *factor -= bent;
                }
            }
        }
        factors.iter_mut().for_each(|factor| *factor = factor.clamp(FACTORS.0, FACTORS.1));
        factors
    }

    /// Multiplies what each change has done, as far as there is enough of everything for it.
    pub fn correct(&self, columns: &mut [Vec<f64>], before: &[Vec<f64>], factors: &[Vec<f64>]) {
        let n = columns.first().map_or(0, Vec::len);
        let mut more = vec![0.0; columns.len()];
        for cell in 0..n {
            more.fill(0.0);
            for (change, factors) in self.changes.iter().zip(factors).filter(|(_, own)| !own.is_empty()) {
                let extents = change.extent.iter().zip(columns.iter().zip(before));
                let extent: f64 = extents.map(|(part, (new, old))| part * (new[cell] - old[cell])).sum();
                let extent = (factors[cell] - 1.0) * extent;
                more.iter_mut().zip(&change.net).for_each(|(more, net)| *more += net * extent);
            }
            let mut part = 1.0_f64;
            for (new, more) in columns.iter().zip(&more).filter(|(_, more)| **more < 0.0) {
                part = part.min(new[cell] / -more);
            }
            // What does not change keeps its last digit.
            for (new, more) in columns.iter_mut().zip(&more).filter(|(_, more)| **more != 0.0) {
                new[cell] = (new[cell] + part * more).max(0.0);
            }
        }
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
    let species: Vec<usize> = match &reaction.law {
        Law::MassAction { orders, .. } => {
            orders.iter().filter(|(_, order)| *order != 1.0).map(|(species, _)| *species).collect()
        }
        Law::Saturation { species, .. } => vec![*species],
        Law::Expression => (0..plan.species.len()).collect(),
    };
    let tape = kinetics.laws.tape(idx);
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
        let factors = own.factors((&places, 0.0), &before, &[vec![0.4], vec![0.1], Vec::new()]);
        assert!((factors[0][0] - 0.9).abs() < 1e-14 && factors[1].is_empty(), "{factors:?}");
        // Extents of 0.1 and 0.05.
        let mut after = [vec![1.9], vec![1.05], vec![0.05]];
        own.correct(&mut after, &before, &factors);
        let right = [1.91, 1.04, 0.05];
        assert!(after.iter().zip(right).all(|(own, right)| (own[0] - right).abs() < 1e-14), "{after:?}");
    }

    /// Both ways of a reversible reaction are one change, whose law is their difference.
    #[test]
    fn both_ways_are_one() {
        let own =
            noise("reaction there: A -> B @ 1 m^3/mol/s * A^2\nreaction back: 2 B -> 2 A @ 0.1 /s * B\n");
        let own = own.unwrap();
        assert_eq!(own.changes.len(), 1);
        let before = [vec![2.0], vec![1.0], vec![0.0]];
        let places = [vec![0.5], Vec::new(), Vec::new()];
        let factors = own.factors((&places, 0.0), &before, &[vec![0.4], Vec::new(), Vec::new()]);
        // r = A² − 2 · 0.1 B.
        assert!((factors[0][0] - (1.0 - 0.4 / 3.8)).abs() < 1e-14, "{factors:?}");
    }

    /// Round a ring extents do not show in what has changed.
    #[test]
    fn what_does_not_show_is_left_alone() {
        let ring = "reaction one: A -> B @ 1 m^3/mol/s * A^2\nreaction two: B -> C @ 1 m^3/mol/s * B^2\n\
                    reaction three: C -> A @ 1 m^3/mol/s * C^2\n";
        assert!(noise(ring).is_none());
        assert!(noise("reaction one: A + B -> C @ 1 m^3/mol/s * A * B\n").is_none());
    }
}

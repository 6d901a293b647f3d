//! What noise of concentrations makes of a rate.
//!
//! Owns the correction of one law. May use tapes and the plan. It deliberately corrects nothing where several reactions share a
//! cell: what each of them did does not show in the sum.

use crate::plan::Plan;
use crate::plan::build_tape::SPECIES_INPUT;
use crate::plan::chemistry::Law;
use crate::plan::tape::Tape;

/// A law that is bent.
#[derive(Debug, Clone)]
pub struct Noise {
    tape: Tape,
    /// What is dissolved of each species.
    shares: Vec<f64>,
    /// Species that it is bent in, or may be.
    species: Vec<usize>,
}

/// Factors beyond which noise is no small thing that could be corrected.
const FACTORS: (f64, f64) = (0.0, 2.0);

impl Noise {
    /// Of a plan with one reaction at a rate, whose law is not linear in each species.
    pub fn new(plan: &Plan) -> Option<Self> {
        let kinetics = plan.chemistry.as_ref()?.kinetics.as_ref()?;
        let [reaction] = &kinetics.reactions[..] else { return None };
        if !plan.reactions.is_empty() {
            return None;
        }
        let species: Vec<usize> = match &reaction.law {
            Law::MassAction { orders, .. } => {
                orders.iter().filter(|(_, order)| *order != 1.0).map(|(species, _)| *species).collect()
            }
            Law::Saturation { species, .. } => vec![*species],
            Law::Expression => (0..plan.species.len()).collect(),
        };
        let share = |own: &crate::plan::Species| own.terms.first().map_or(1.0, |(_, share)| *share);
        let shares = plan.species.iter().map(share).collect();
        (!species.is_empty()).then_some(Self { tape: kinetics.laws.tape(0), shares, species })
    }

    /// What a rate of estimated concentrations has to be multiplied by to be that of the true ones on average.
    ///
    /// - Equation: `f = 1 − Σ_s [r(c + σ_s) − 2 r(c) + r(c − σ_s)]/(2 r(c))`.
    /// - Symbols: `σ_s` standard error of a concentration, at most the concentration; `r` rate.
    /// - Range: 0 to 2; exact for quadratic laws with errors of the species that are independent.
    /// - Source: methods, section 5.3, noise bias `½ r″ Var`, with differences over a standard error for derivatives.
    /// - Shape: one per cell.
    pub fn factors(
        &self,
        (places, t): (&[Vec<f64>; 3], f64),
        columns: &[Vec<f64>],
        variances: &[Vec<f64>],
    ) -> Vec<f64> {
        let n = columns.first().map_or(0, Vec::len);
        let scaled = |(own, share): (&Vec<f64>, &f64)| own.iter().map(|u| u * share).collect();
        let columns: Vec<Vec<f64>> = columns.iter().zip(&self.shares).map(scaled).collect();
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
            let mut rates = vec![0.0; n];
            self.tape.evaluate_block(&inputs, &mut scratch, &mut rates);
            rates
        };
        let middle = rate(None);
        let mut factors = vec![1.0; n];
        for &species in self.species.iter().filter(|&&species| !variances[species].is_empty()) {
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
}

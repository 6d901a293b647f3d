//! Speciation against closed forms, an independent solver in 50 digits, and itself.

mod golden;
mod known;
mod laws;
mod random;

use super::{Effort, Refusal, Speciation, Totals};
use crate::maths::wide::Width;
use crate::plan::chemistry::{Activity, Equilibrium, Mineral, Primary, Secondary};

/// ln of a power of ten.
pub(super) fn power(log10: f64) -> f64 {
    log10 * std::f64::consts::LN_10
}

pub(super) fn primary(species: usize, charge: f64, ion_size: f64) -> Primary {
    Primary { species, charge, ion_size, constant: 0.0, terms: vec![(species, 1.0)] }
}

/// A complex of concentrations in mol/L, turned to mol/m³: `log K` loses 3 for each Δν.
pub(super) fn secondary(
    species: usize,
    charge: f64,
    size: f64,
    log_k: f64,
    nus: &[(usize, f64)],
) -> Secondary {
    let order: f64 = nus.iter().map(|(_, nu)| nu).sum();
    let ln_constant = power(log_k + 3.0 * (1.0 - order));
    Secondary { species, charge, ion_size: size, ln_constant, coefficients: nus.to_vec() }
}

pub(super) fn mineral(species: usize, log_s: f64, nus: &[(usize, f64)]) -> Mineral {
    let order: f64 = nus.iter().map(|(_, nu)| nu).sum();
    Mineral { species, ln_solubility: power(log_s + 3.0 * order), coefficients: nus.to_vec() }
}

/// Constants at 25 °C as in phreeqc.dat (Parkhurst & Appelo 2013), rounded: H⁺ 0, CO₃²⁻ 1, Ca²⁺ 2; OH⁻, HCO₃⁻,
/// CO₂(aq), CaCO₃(aq), CaHCO₃⁺, CaOH⁺; calcite. Ion sizes of Kielland 1937, m.
pub(super) fn carbonate(activity: Activity, with_calcite: bool) -> Equilibrium {
    Equilibrium {
        primaries: vec![primary(0, 1.0, 9e-10), primary(1, -2.0, 4.5e-10), primary(2, 2.0, 6e-10)],
        secondaries: vec![
            secondary(3, -1.0, 3.5e-10, -14.0, &[(0, -1.0)]),
            secondary(4, -1.0, 4.25e-10, 10.329, &[(0, 1.0), (1, 1.0)]),
            secondary(5, 0.0, 0.0, 16.681, &[(0, 2.0), (1, 1.0)]),
            secondary(6, 0.0, 0.0, 3.224, &[(1, 1.0), (2, 1.0)]),
            secondary(7, 1.0, 6e-10, 11.435, &[(0, 1.0), (1, 1.0), (2, 1.0)]),
            secondary(8, 1.0, 6e-10, -12.78, &[(0, -1.0), (2, 1.0)]),
        ],
        minerals: if with_calcite { vec![mineral(9, -8.48, &[(1, 1.0), (2, 1.0)])] } else { Vec::new() },
        activity,
    }
}

/// Columns that come out.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Found {
    pub concentrations: Vec<Vec<f64>>,
    pub memory: Vec<Vec<f64>>,
    pub effort: Result<Effort, (usize, Refusal)>,
}

/// Solves columns of totals from a memory, or from nowhere.
pub(super) fn solve(speciation: &Speciation, totals: &[Vec<f64>], memory: Option<&[Vec<f64>]>) -> Found {
    let n = totals[0].len();
    let mut concentrations = vec![vec![0.0; n]; speciation.species().len()];
    let mut memory =
        memory.map_or_else(|| vec![vec![f64::NAN; n]; speciation.n_memory()], <[Vec<f64>]>::to_vec);
    let totals: Vec<&[f64]> = totals.iter().map(Vec::as_slice).collect();
    let effort = {
        let mut memory: Vec<&mut [f64]> = memory.iter_mut().map(Vec::as_mut_slice).collect();
        let mut out: Vec<&mut [f64]> = concentrations.iter_mut().map(Vec::as_mut_slice).collect();
        let columns = Totals { totals: &totals, memory: &mut memory, concentrations: &mut out };
        speciation.solve(Width::widest(), columns, &mut speciation.workspace())
    };
    Found { concentrations, memory, effort: effort.map_err(|refused| (refused.particle, refused.why)) }
}

/// One particle.
pub(super) fn solve_one(equilibrium: &Equilibrium, totals: &[f64]) -> Result<Vec<f64>, Refusal> {
    let speciation = Speciation::new(equilibrium).unwrap();
    let columns: Vec<Vec<f64>> = totals.iter().map(|&total| vec![total]).collect();
    let found = solve(&speciation, &columns, None);
    found.effort.map_err(|refused| refused.1)?;
    Ok(found.concentrations.iter().map(|column| column[0]).collect())
}

/// The worst balance, relative to the sum of its terms, recomputed from the concentrations alone.
pub(super) fn defect(equilibrium: &Equilibrium, totals: &[f64], c: &[f64]) -> f64 {
    let n = equilibrium.primaries.len();
    let rows = equilibrium.secondaries.iter().map(|s| &s.coefficients);
    let rows: Vec<_> = rows.chain(equilibrium.minerals.iter().map(|m| &m.coefficients)).collect();
    let mut worst: f64 = 0.0;
    for j in 0..n {
        let (mut sum, mut size) = (c[j] - totals[j], c[j].abs() + totals[j].abs());
        for (row, c) in rows.iter().zip(&c[n..]) {
            for &(_, nu) in row.iter().filter(|(primary, _)| *primary == j) {
                sum += nu * c;
                size += (nu * c).abs();
            }
        }
        // Terms below 1e-240 mol/m³ are those of absent species.
        worst = worst.max(sum.abs() / (size + 1e-240));
    }
    worst
}

//! Reactions in equilibrium as flat lists, ready to be evaluated over lanes of particles.
//!
//! Owns the compiled form and its checks. May use the plan's types. It deliberately has no iteration.

use super::activity::{self, Shape};
use crate::plan::chemistry::{Activity, Equilibrium};

/// One coefficient of a secondary species or a mineral.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Entry {
    pub primary: usize,
    pub nu: f64,
}

/// A species or a mineral over primary species: `ln C = ln K + Σ ν ξ + Σ_shape weight φ(I)`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Row {
    pub ln_constant: f64,
    pub entries: Vec<Entry>,
    /// One weight per shape: what activity coefficients add to the logarithm.
    pub weights: Vec<f64>,
    pub charge: f64,
}

/// The compiled system. Rows of secondaries first, then of minerals, whose constant is `−ln S`: their
/// logarithm is the saturation index.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct System {
    pub n_primaries: usize,
    pub n_secondaries: usize,
    pub n_minerals: usize,
    pub rows: Vec<Row>,
    /// `½·10⁻³ z²` of primaries, then of secondaries: mol/L of ionic strength for each mol/m³.
    pub ionic: Vec<f64>,
    /// Functions of the ionic strength of which `ln γ` is made; none if activities are concentrations.
    pub shapes: Vec<Shape>,
}

impl System {
    pub fn new(equilibrium: &Equilibrium) -> Result<Self, String> {
        let n = equilibrium.primaries.len();
        let shapes = activity::shapes(equilibrium);
        let model = equilibrium.activity;
        let of_primaries: Vec<Vec<f64>> = equilibrium
            .primaries
            .iter()
            .map(|primary| activity::weights(model, &shapes, primary.charge, primary.ion_size))
            .collect();
        let mut rows = Vec::new();
        for secondary in &equilibrium.secondaries {
            let own = activity::weights(model, &shapes, secondary.charge, secondary.ion_size);
            let given = (secondary.ln_constant, secondary.coefficients.as_slice());
            rows.push(row(given, &of_primaries, &own, secondary.charge)?);
        }
        for mineral in &equilibrium.minerals {
            let given = (-mineral.ln_solubility, mineral.coefficients.as_slice());
            rows.push(row(given, &of_primaries, &vec![0.0; shapes.len()], 0.0)?);
        }
        let charges = equilibrium.primaries.iter().map(|primary| primary.charge);
        let charges = charges.chain(equilibrium.secondaries.iter().map(|secondary| secondary.charge));
        Ok(Self {
            n_primaries: n,
            n_secondaries: equilibrium.secondaries.len(),
            n_minerals: equilibrium.minerals.len(),
            rows,
            ionic: charges.map(|charge| 0.5e-3 * charge * charge).collect(),
            shapes,
        })
    }

    /// Primaries, secondaries and minerals, in this order everywhere.
    pub fn n_species(&self) -> usize {
        self.n_primaries + self.n_secondaries + self.n_minerals
    }

    pub fn secondaries(&self) -> &[Row] {
        &self.rows[..self.n_secondaries]
    }

    pub fn minerals(&self) -> &[Row] {
        &self.rows[self.n_secondaries..]
    }

    pub fn is_ideal(&self) -> bool {
        self.shapes.is_empty()
    }

    /// Which primaries can only be absent, as stages: those of total 0 that occur with positive coefficients
    /// only, then those that do so once all species with the former are gone. 0 for what can be present.
    ///
    /// With [`ln_of_stage`] for `ln c`, every species that has one of them is exactly 0, as its coefficient of
    /// the earliest stage is positive and decides.
    pub fn absent(&self, totals: impl Fn(usize) -> f64, stages: &mut [u8]) -> bool {
        stages.fill(0);
        for stage in 1..=LAST_STAGE {
            let mut is_any = false;
            for j in 0..self.n_primaries {
                let is_earlier = |entry: &Entry| (1..stage).contains(&stages[entry.primary]);
                let can_come = self.rows.iter().any(|row| {
                    row.entries.iter().any(|entry| entry.primary == j && entry.nu < 0.0)
                        && !row.entries.iter().any(is_earlier)
                });
                if stages[j] == 0 && totals(j) == 0.0 && !can_come {
                    stages[j] = stage;
                    is_any = true;
                }
            }
            if !is_any {
                break;
            }
        }
        stages.iter().any(|&stage| stage > 0)
    }
}

/// Chains of absence longer than this are not followed; primaries are then nearly absent instead.
const LAST_STAGE: u8 = 4;

/// `ln c` that stands for 0 of a stage.
pub(super) fn ln_of_stage(stage: u8) -> f64 {
    -[0.0, 1e15, 1e12, 1e9, 1e6][stage.min(LAST_STAGE) as usize]
}

fn row(
    (ln_constant, coefficients): (f64, &[(usize, f64)]),
    of_primaries: &[Vec<f64>],
    own: &[f64],
    charge: f64,
) -> Result<Row, String> {
    if !ln_constant.is_finite() {
        return Err(format!("the logarithm {ln_constant} of a constant is not a number"));
    }
    let mut entries: Vec<Entry> = Vec::new();
    for &(primary, nu) in coefficients {
        if primary >= of_primaries.len() || !nu.is_finite() {
            return Err(format!("coefficient {nu} of primary species {primary}"));
        }
        match entries.iter_mut().find(|entry| entry.primary == primary) {
            Some(entry) => entry.nu += nu,
            None => entries.push(Entry { primary, nu }),
        }
    }
    entries.retain(|entry| entry.nu != 0.0);
    entries.sort_by_key(|entry| entry.primary);
    let weights = own.iter().enumerate().map(|(shape, own)| {
        entries.iter().map(|entry| entry.nu * of_primaries[entry.primary][shape]).sum::<f64>() - own
    });
    let weights = weights.collect();
    Ok(Row { ln_constant, entries, weights, charge })
}

/// What an equilibrium must keep: its model has charges where it needs them, its ions a size.
pub(super) fn check(equilibrium: &Equilibrium) -> Result<(), String> {
    let sizes = equilibrium.primaries.iter().map(|p| (p.species, p.charge, p.ion_size));
    let others = equilibrium.secondaries.iter().map(|s| (s.species, s.charge, s.ion_size));
    for (species, charge, ion_size) in sizes.chain(others) {
        let has_size = ion_size > 0.0 && ion_size.is_finite();
        if equilibrium.activity == Activity::ExtendedDebyeHuckel && charge != 0.0 && !has_size {
            return Err(format!("the ion-size parameter of species {species} is {ion_size} m"));
        }
    }
    Ok(())
}

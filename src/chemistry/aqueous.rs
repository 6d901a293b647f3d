//! Speciation between components and the species of a plan, for columns and for lanes.
//!
//! Owns the totals as sums of components, and which species follow from speciation and which from their
//! recipes. May use the equilibrium and the plan. It deliberately solves nothing itself.

use super::equilibrium::{Refusal, Speciation, Totals, Workspace};
use super::laws::{LANES, Lane};
use super::reactor::{Failure, Why};
use crate::maths::wide::Width;
use crate::plan::chemistry::Equilibrium;
use crate::plan::{Plan, Species};

/// The species of a plan of which some are in equilibrium.
#[derive(Debug, Clone)]
pub(super) struct Aqueous {
    n_components: usize,
    pub speciation: Speciation,
    /// Totals of primaries: constant, and `(component, coefficient)`.
    pub totals: Vec<(f64, Vec<(usize, f64)>)>,
    /// Totals that are never negative: what rounding leaves below zero is none.
    pub is_sum: Vec<bool>,
    pub recipes: Vec<Species>,
    /// Which column of the speciation a species is.
    pub rows: Vec<Option<usize>>,
}

/// What a thread needs, kept from call to call.
#[derive(Debug)]
pub(super) struct AqueousScratch {
    pub workspace: Workspace,
    totals: Vec<Vec<f64>>,
    concentrations: Vec<Vec<f64>>,
}

impl Aqueous {
    pub fn new(plan: &Plan, equilibrium: &Equilibrium) -> Result<Self, String> {
        let speciation = Speciation::new(equilibrium)?;
        let mut rows = vec![None; plan.species.len()];
        for (row, &species) in speciation.species().iter().enumerate() {
            *rows
                .get_mut(species)
                .ok_or_else(|| format!("species {species} in equilibrium is not there"))? = Some(row);
        }
        let totals: Vec<_> = equilibrium.primaries.iter().map(|p| (p.constant, p.terms.clone())).collect();
        let mut terms = totals.iter().flat_map(|(_, terms)| terms);
        if terms.any(|&(component, _)| component >= plan.components.len()) {
            return Err("a total is made of components that are not there".to_owned());
        }
        let is_sum = (0..totals.len()).map(|primary| speciation.is_sum(primary)).collect();
        let n_components = plan.components.len();
        Ok(Self { n_components, speciation, totals, is_sum, recipes: plan.species.clone(), rows })
    }

    pub fn scratch(&self) -> AqueousScratch {
        AqueousScratch {
            workspace: self.speciation.workspace(),
            totals: vec![Vec::new(); self.totals.len()],
            concentrations: vec![Vec::new(); self.speciation.species().len()],
        }
    }

    /// Concentrations of all species, and amounts of minerals, from components.
    pub fn speciate(
        &self,
        width: Width,
        components: &[&[f64]],
        species: &mut [&mut [f64]],
        scratch: &mut AqueousScratch,
    ) -> Result<(), Failure> {
        let n = species.first().map_or(0, |column| column.len());
        let AqueousScratch { workspace, totals, concentrations } = scratch;
        for column in totals.iter_mut().chain(&mut *concentrations) {
            column.resize(n, 0.0);
        }
        for (j, column) in totals.iter_mut().enumerate() {
            let (constant, terms) = &self.totals[j];
            add_up(*constant, terms, components, column);
            if self.is_sum[j] {
                column.iter_mut().for_each(|total| *total = if *total < 0.0 { 0.0 } else { *total });
            }
        }
        let columns = Totals { totals, memory: &mut [], concentrations };
        self.speciation
            .solve(width, columns, workspace)
            .map_err(|refused| Failure { particle: refused.particle, why: why(refused.why) })?;
        for ((recipe, row), column) in self.recipes.iter().zip(&self.rows).zip(species) {
            match row {
                Some(row) => column.copy_from_slice(&concentrations[*row]),
                None => add_up(recipe.constant, &recipe.terms, components, column),
            }
        }
        Ok(())
    }
}

/// Speciation within a method that steps lanes of particles.
#[derive(Debug, Clone)]
pub(super) struct AqueousLanes {
    workspace: Workspace,
    totals: Vec<Lane>,
    memory: Vec<Lane>,
    concentrations: Vec<Lane>,
    /// Slopes of concentrations with totals, then of rates with components, row by row.
    slopes: Vec<Lane>,
    pub jacobian: Vec<Lane>,
    pub places: Vec<u16>,
}

impl AqueousLanes {
    /// A particle that begins its step does not start from what was in its lane before.
    pub fn forget(&mut self, elapsed: &Lane) {
        for column in &mut self.memory {
            for (value, elapsed) in column.iter_mut().zip(elapsed) {
                *value = if *elapsed == 0.0 { f64::NAN } else { *value };
            }
        }
    }
}

impl Aqueous {
    pub fn lanes(&self) -> AqueousLanes {
        let (n, n_primaries, n_found) =
            (self.n_components, self.totals.len(), self.speciation.species().len());
        let lanes = |count: usize| vec![[0.0; LANES]; count];
        AqueousLanes {
            workspace: self.speciation.workspace(),
            totals: lanes(n_primaries),
            memory: lanes(self.speciation.n_memory()),
            concentrations: lanes(n_found),
            slopes: lanes(n_found * n_primaries),
            jacobian: lanes(n * n),
            places: (0..n * n).map(|place| place as u16).collect(),
        }
    }

    /// Components that are no sums of amounts may be negative.
    pub fn mark_signs(&self, is_positive: &mut [bool]) {
        for ((_, terms), is_sum) in self.totals.iter().zip(&self.is_sum) {
            for &(component, coefficient) in terms {
                is_positive[component] &= *is_sum && coefficient > 0.0;
            }
        }
    }

    /// Concentrations of species, into the registers of the rates. Where there is no equilibrium they are not
    /// numbers, which makes the step smaller.
    pub fn fill(&self, width: Width, y: &[Lane], registers: &mut [Lane], own: &mut AqueousLanes) {
        for (j, total) in own.totals.iter_mut().enumerate() {
            let (constant, terms) = &self.totals[j];
            *total = sum_up(*constant, terms, y, self.is_sum[j]);
        }
        let AqueousLanes { workspace, totals, memory, concentrations, .. } = own;
        let columns = Totals { totals, memory, concentrations };
        // A refusal shows in what was found.
        let _ = self.speciation.solve(width, columns, workspace);
        for ((recipe, row), register) in self.recipes.iter().zip(&self.rows).zip(registers) {
            *register = match row {
                Some(row) => own.concentrations[*row],
                None => sum_up(recipe.constant, &recipe.terms, y, true),
            };
        }
    }

    /// Slopes of `dy/dt` with components at what was filled last: `∂f/∂c ∂c/∂T ∂T/∂y`.
    pub fn jacobian(
        &self,
        width: Width,
        pattern: &[(usize, usize)],
        (registers, places): (&[Lane], &[u16]),
        own: &mut AqueousLanes,
    ) {
        let n = self.n_components;
        let AqueousLanes { workspace, totals, concentrations, slopes, jacobian, .. } = own;
        self.speciation.derivatives(width, totals, concentrations, slopes, workspace);
        jacobian.fill([0.0; LANES]);
        for (&(row, species), &place) in pattern.iter().zip(places) {
            let entry = &registers[usize::from(place)];
            let Some(found) = self.rows[species] else {
                for &(component, coefficient) in &self.recipes[species].terms {
                    add_product(&mut jacobian[row * n + component], coefficient, entry, &[1.0; LANES]);
                }
                continue;
            };
            for (j, (_, terms)) in self.totals.iter().enumerate() {
                let slope = &slopes[found * self.totals.len() + j];
                for &(component, coefficient) in terms {
                    add_product(&mut jacobian[row * n + component], coefficient, entry, slope);
                }
            }
        }
    }
}

fn sum_up(constant: f64, terms: &[(usize, f64)], y: &[Lane], is_sum: bool) -> Lane {
    let mut sum = [constant; LANES];
    for &(component, coefficient) in terms {
        for (sum, value) in sum.iter_mut().zip(&y[component]) {
            *sum += coefficient * value;
        }
    }
    // What rounding leaves below zero is none; NaN goes through.
    sum.map(|sum| if is_sum && sum < 0.0 { 0.0 } else { sum })
}

fn add_product(cell: &mut Lane, coefficient: f64, a: &Lane, b: &Lane) {
    for l in 0..LANES {
        cell[l] += coefficient * a[l] * b[l];
    }
}

/// `constant + Σ coefficient · component`
fn add_up(constant: f64, terms: &[(usize, f64)], components: &[&[f64]], column: &mut [f64]) {
    column.fill(constant);
    for &(component, coefficient) in terms {
        for (value, carried) in column.iter_mut().zip(components[component]) {
            *value += coefficient * carried;
        }
    }
}

fn why(refusal: Refusal) -> Why {
    match refusal {
        Refusal::NotFinite { primary } => Why::NotFinite { component: primary, reaction: None },
        Refusal::Infeasible => Why::Impossible,
        Refusal::Endless => Why::Endless,
        Refusal::IonicStrength { value } => Why::TooSalty { ionic_strength: value },
        Refusal::NotSolved { residual } => Why::NoEquilibrium { residual },
    }
}

//! Speciation: concentrations in equilibrium from totals, for many particles at a time.
//!
//! Owns everything between the totals of primary species and the concentrations of all. May use the words
//! and the plan's types. It deliberately knows no components, steps or rates: its callers do.
//!
//! The balances are solved for `ln c` by Newton's method, safeguarded by the convex function whose gradient
//! they are (methods 8.1). Particles are iterated in lanes, and a lane that is done is filled again. What is
//! not solved fast is solved slowly, or refused with the reason.

// Loops over lanes stay plain, so that they are compiled wide.
#![allow(clippy::needless_range_loop)]

mod activity;
mod basis;
mod closed;
mod derivative;
mod direction;
mod fast;
mod feasible;
mod hard;
mod lanes;
mod newton;
mod point;
mod precise;
mod quadratic;
mod system;

pub use activity::MAX_IONIC_STRENGTH;

use crate::maths::wide::Width;
use crate::plan::chemistry::Equilibrium;
use closed::Closed;
use derivative::Derivatives;
use fast::Fast;
use newton::{Newton, Settings};
use system::System;

/// Particles that are solved side by side.
pub const LANES: usize = 8;

/// Evaluations after which a particle is left to the slow way.
const FAST: Settings = Settings { max_evaluations: 60, is_plain: false, is_frozen: false, stiffness: 1.0 };

/// Reactions in equilibrium, compiled.
#[derive(Debug, Clone)]
pub struct Speciation {
    system: System,
    closed: Option<Closed>,
    /// Species of the plan: primaries, then secondaries, then minerals.
    species: Vec<usize>,
}

/// What a thread needs besides, kept from call to call so that no call allocates.
#[derive(Debug, Clone)]
pub struct Workspace {
    many: Newton<LANES>,
    one: Newton<1>,
    /// Particles left to the slow way.
    left: Vec<usize>,
    stages: Vec<u8>,
}

/// Particles to be speciated, as columns of equal length.
#[derive(Debug)]
pub struct Totals<'a, C, M> {
    /// One column per primary species, mol/m³.
    pub totals: &'a [C],
    /// One column per entry of [`Speciation::n_memory`], or none. What stands there is where the iteration
    /// begins, NaN being nowhere; where it ended stands there afterwards.
    pub memory: &'a mut [M],
    /// One column per species of [`Speciation::species`]: concentrations, and amounts of minerals.
    pub concentrations: &'a mut [M],
}

/// A particle without a result.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Refused {
    /// Its index in the columns.
    pub particle: usize,
    pub why: Refusal,
}

/// Why there is no equilibrium.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Refusal {
    /// A total is not a number.
    NotFinite { primary: usize },
    /// No amounts of species have these totals; proved.
    Infeasible,
    /// No water is at or below saturation of all minerals: they would form without end; proved.
    Endless,
    /// The model of activities holds up to [`MAX_IONIC_STRENGTH`], and this solution has more, mol/L.
    IonicStrength { value: f64 },
    /// The iteration did not end; what is left of the worst balance, relative to its terms.
    NotSolved { residual: f64 },
}

/// How much was done.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Effort {
    /// Evaluations of all balances of one particle.
    pub evaluations: u64,
    /// Particles that went the slow way.
    pub hard: u64,
}

impl Speciation {
    /// Compiles an equilibrium; an error names what is wrong with it.
    pub fn new(equilibrium: &Equilibrium) -> Result<Self, String> {
        system::check(equilibrium)?;
        let system = System::new(equilibrium)?;
        let species = equilibrium.primaries.iter().map(|primary| primary.species);
        let species = species.chain(equilibrium.secondaries.iter().map(|secondary| secondary.species));
        let species = species.chain(equilibrium.minerals.iter().map(|mineral| mineral.species)).collect();
        Ok(Self { closed: Closed::of(&system), system, species })
    }

    pub fn workspace(&self) -> Workspace {
        Workspace {
            many: Newton::new(&self.system, FAST),
            one: Newton::new(&self.system, FAST),
            left: Vec::new(),
            stages: vec![0; self.system.n_primaries],
        }
    }

    /// The species of the plan whose concentrations are found, in the order of the columns.
    pub fn species(&self) -> &[usize] {
        &self.species
    }

    /// Whether the total of a primary species is a sum of amounts, so that it is never negative.
    pub fn is_sum(&self, primary: usize) -> bool {
        let entries = self.system.rows.iter().flat_map(|row| &row.entries);
        entries.filter(|entry| entry.primary == primary).all(|entry| entry.nu > 0.0)
    }

    pub fn n_primaries(&self) -> usize {
        self.system.n_primaries
    }

    /// Numbers to remember of each particle: `ln c` of primaries, amounts of minerals, and the ionic strength
    /// unless activities are concentrations. None where there is a closed form.
    pub fn n_memory(&self) -> usize {
        let n_ionic = usize::from(!self.system.is_ideal());
        if self.closed.is_some() { 0 } else { self.system.n_primaries + self.system.n_minerals + n_ionic }
    }

    /// Concentrations of all species from totals. After a refusal the other particles are solved all the same,
    /// and the refused one that comes first is told.
    pub fn solve<C: AsRef<[f64]>, M: AsRef<[f64]> + AsMut<[f64]>>(
        &self,
        width: Width,
        columns: Totals<'_, C, M>,
        workspace: &mut Workspace,
    ) -> Result<Effort, Refused> {
        debug_assert_eq!(columns.totals.len(), self.system.n_primaries);
        debug_assert_eq!(columns.concentrations.len(), self.species.len());
        if let Some(closed) = self.closed {
            return self.solve_closed(closed, columns);
        }
        width.run(Fast { speciation: self, columns, workspace })
    }

    /// Derivatives of all concentrations with all totals, column `species × n_primaries + primary`, where both
    /// are known: `concentrations` are what [`Speciation::solve`] found for `totals`.
    pub fn derivatives<C: AsRef<[f64]>, D: AsRef<[f64]>, M: AsMut<[f64]>>(
        &self,
        width: Width,
        totals: &[C],
        concentrations: &[D],
        out: &mut [M],
        workspace: &mut Workspace,
    ) {
        debug_assert_eq!(out.len(), self.species.len() * self.system.n_primaries);
        let Workspace { many, stages, .. } = workspace;
        width.run(Derivatives { system: &self.system, totals, concentrations, out, newton: many, stages });
    }

    fn solve_closed<C: AsRef<[f64]>, M: AsMut<[f64]>>(
        &self,
        closed: Closed,
        columns: Totals<'_, C, M>,
    ) -> Result<Effort, Refused> {
        let mut refused = None;
        let first = columns.totals[0].as_ref();
        for (particle, &own) in first.iter().enumerate() {
            let other = columns.totals.get(1).map_or(0.0, |column| column.as_ref()[particle]);
            let found = closed.solve(own, other);
            for (column, value) in columns.concentrations.iter_mut().zip(found) {
                column.as_mut()[particle] = value;
            }
            if let Some(why) = closed.refusal(own, other).filter(|_| refused.is_none()) {
                refused = Some(Refused { particle, why });
            }
        }
        refused.map_or(Ok(Effort::default()), Err)
    }
}

#[cfg(test)]
mod tests;

//! What parcels carry through the places where somebody counts, and the accounts of doors.
//!
//! Owns the way from columns to amounts of species. May use the run and the gates of masses. It deliberately moves
//! nothing.

use super::super::error::RunError;
use super::super::mass::book::Event;
use super::super::observe::concentrations;
use super::super::program::{Program, Work};
use super::super::run::Run;
use super::passages::{Cargo, Passages};
use crate::maths::exact::Quanta;
use crate::plan::{Plan, Quantity};
use crate::state::particles::{BLOCK, Block};

/// Terms that a sum over passages may have.
const MOST_TERMS: u64 = 1 << 28;
/// How much larger than at the start and at sides a concentration may become.
const LARGER: f64 = 1_048_576.0;

/// Rounding of amounts of parcels of a `volume` that begin with concentrations up to `highest`.
pub fn quanta(volume: f64, highest: f64) -> Quanta {
    let largest = if highest > 0.0 { highest } else { 1.0 };
    Quanta::new(volume * largest * LARGER, MOST_TERMS)
}

/// Species whose passages are counted, and the outputs that do so.
fn counted(plan: &Plan) -> (Vec<usize>, Vec<usize>) {
    let is_gate = |output: &crate::plan::Output| output.kind.has_station();
    let outputs: Vec<usize> = (0..plan.outputs.len()).filter(|&idx| is_gate(&plan.outputs[idx])).collect();
    let quantities = outputs.iter().flat_map(|&idx| &plan.outputs[idx].quantities);
    let mut species: Vec<usize> = quantities
        .map(|quantity| match *quantity {
            Quantity::Species(a) | Quantity::Pair(a, _) => a,
        })
        .collect();
    species.sort_unstable();
    species.dedup();
    (species, outputs)
}

impl<const D: usize> Run<'_, D> {
    /// Makes sure that bins have means before the first parcel passes.
    pub fn prepare_gates(&mut self, step: u64) -> Result<(), RunError> {
        if self.gates.are_none() || !self.program.has_mixing() || !self.means.counts.is_empty() {
            return Ok(());
        }
        let still = self.program.mover.leap(0.0, 0.0);
        self.pass(Work { averages: true, ..Work::default() }, step, still, &[])
    }

    /// Counts passages of a step.
    pub fn count(&mut self, passages: &Passages<D>, step: u64) -> Result<(), RunError> {
        if passages.list.is_empty() || self.gates.are_none() {
            return Ok(());
        }
        let (species, outputs) = counted(self.program.plan);
        for first in (0..passages.list.len()).step_by(BLOCK) {
            let range = first..(first + BLOCK).min(passages.list.len());
            let block = block(passages, range.clone(), self.reactions.reactor.is_some())?;
            let values = concentrations(self, &block, &outputs, step)?;
            for (idx, passed) in passages.list[range].iter().enumerate() {
                for &own in &species {
                    let c = match passed.cargo {
                        Cargo::Parcel => values[own][idx],
                        Cargo::Exchange => exchanged(&self.program, &block, own, idx),
                    };
                    let mass = self.program.volume * c;
                    let event =
                        Event { what: passed.what, population: own, id: passed.id, mass, t: passed.t };
                    self.gates.note(&event, passed.entered_by, self.quanta);
                }
            }
        }
        Ok(())
    }

    /// What came in and went out of a species by each door, then what reactions made: amounts of what parcels carry.
    pub fn account(&self, species: usize) -> Vec<[f64; 2]> {
        let Some(water) = &self.water else { return Vec::new() };
        let (program, n) = (&self.program, self.program.n_components());
        let recipe = &program.species[species];
        let n_slots = program.roles.len();
        let total = |constant: f64, carried: &dyn Fn(usize) -> f64, resting: &dyn Fn(usize) -> f64| -> f64 {
            let of = |&(k, coefficient): &(usize, f64)| {
                coefficient * if k < n { carried(k) } else { resting(k - n) }
            };
            program.volume * (recipe.constant * constant + recipe.terms.iter().map(of).sum::<f64>())
        };
        let weighted = |column: &dyn Fn(usize) -> f64, k: usize| -> f64 {
            program.mean_weights.iter().map(|&(slot, weight)| weight * column(k * n_slots + slot)).sum()
        };
        let nothing = |_: usize| 0.0;
        let mut rows = Vec::new();
        for door in 0..water.book.n_doors() {
            let (gains, [n_in, n_out]) = (water.book.gains(door), water.book.parcels(door));
            let entered = total(n_in as f64, &|k| weighted(&|c| gains[c].entered, k), &nothing);
            let left = total(n_out as f64, &|k| weighted(&|c| gains[c].left, k), &nothing);
            rows.push([entered, left]);
        }
        let before = |k: usize| weighted(&|c| self.before[c].sum, k);
        let resting = |k: usize| self.reactions.immobile_before[k] * program.per_bin();
        rows[0][0] += total(program.plan.particles.count as f64, &before, &resting);
        if program.plan.has_joint_reactions() {
            let added = &self.reactions.added;
            let made = total(0.0, &|k| added[k].sum, &|k| added[n + k].sum);
            rows.push([made.max(0.0), (-made).max(0.0)]);
        }
        rows
    }
}

/// The amount of a species in what a side took from a parcel, over the volume of the parcel.
fn exchanged<const D: usize>(program: &Program<D>, block: &Block<D>, species: usize, idx: usize) -> f64 {
    let n_slots = program.roles.len();
    let of_component = |k: usize| -> f64 {
        let weights = program.mean_weights.iter();
        weights.map(|&(slot, weight)| weight * block.columns[k * n_slots + slot][idx]).sum()
    };
    let terms = program.species[species].terms.iter().filter(|(k, _)| *k < program.n_components());
    terms.map(|&(k, coefficient)| coefficient * of_component(k)).sum()
}

/// Passages as a block of parcels.
fn block<const D: usize>(
    passages: &Passages<D>,
    range: std::ops::Range<usize>,
    has_memory: bool,
) -> Result<Block<D>, RunError> {
    let n = range.len();
    let mut block = Block::<D>::new(0, n, passages.columns.len())
        .map_err(|_| RunError::OutOfMemory { bytes: (8 * n * (passages.columns.len() + D)) as u64 })?;
    if has_memory {
        block.memory.resize(n, 0.0);
    }
    for (idx, passed) in passages.list[range.clone()].iter().enumerate() {
        block.positions.iter_mut().zip(passed.place).for_each(|(axis, x)| axis[idx] = x);
        block.ids.push(passed.id);
    }
    for (own, column) in block.columns.iter_mut().zip(&passages.columns) {
        own.copy_from_slice(&column[range.clone()]);
    }
    Ok(block)
}

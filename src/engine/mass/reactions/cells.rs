//! What reacts in cells.
//!
//! Owns concentrations in cells and what becomes of them. May use `chemistry` and the plan. It deliberately knows no particle.

#![allow(clippy::needless_range_loop)] // A cell belongs to several columns at once.

use super::super::super::error::RunError;
use super::super::super::parallel::{self, Pool};
use super::super::super::program::unsound;
use super::super::super::reactions::explain;
use super::noise::Noise;
use crate::chemistry::{Batch, Failure, Reactor, Scratch, Work};
use crate::diagnostic::precise;
use crate::plan::chemistry::Kinetic;
use crate::plan::{InstantReaction, Plan};
use crate::state::particles::CHUNK;

/// The chemistry of cells.
#[derive(Debug, Clone)]
pub struct Vessel {
    reactor: Option<Reactor>,
    instant: Vec<InstantReaction>,
    pub noise: Option<Noise>,
    /// Whether something is made where there is nothing.
    pub makes_of_nothing: bool,
    /// The species of each component.
    species: Vec<usize>,
    n_species: usize,
    /// Sub-steps to begin with, by cell of the lattice.
    memory: Vec<f32>,
}

/// Cells that react, with columns of concentrations by species.
pub struct Content {
    pub cells: Vec<u32>,
    /// Centres along x, y and z; empty along axes that there are not.
    pub places: [Vec<f64>; 3],
    pub columns: Vec<Vec<f64>>,
    /// Squared standard errors of the same; empty where nobody asks.
    pub variances: Vec<Vec<f64>>,
}

impl Vessel {
    pub fn new(plan: &Plan, n_cells: usize) -> Result<Self, RunError> {
        let reactor = match plan.reacts_in_steps() {
            true => Reactor::new(plan).map_err(|what| unsound(&what))?,
            false => None,
        };
        let of_component = |component: usize| {
            plan.species_of(component).ok_or_else(|| unsound("a component that is no species"))
        };
        let kinetics = plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
        Ok(Self {
            reactor,
            instant: plan.reactions.clone(),
            noise: Noise::new(plan),
            makes_of_nothing: kinetics.is_some_and(|kinetics| {
                let takes = |it: &Kinetic| it.changes.iter().any(|(_, change)| *change < 0.0);
                !kinetics.reactions.iter().all(takes)
            }),
            species: (0..plan.components.len()).map(of_component).collect::<Result<_, _>>()?,
            n_species: plan.species.len(),
            memory: vec![0.0; n_cells],
        })
    }

    /// Takes all cells over a time from what there was before: rates first, then what is complete at once.
    pub fn react(
        &mut self,
        plan: &Plan,
        (content, before): (&mut Content, &[Vec<f64>]),
        (step, t, dt): (u64, f64, f64),
    ) -> Result<(), RunError> {
        debug_assert_eq!(content.columns.len(), self.n_species);
        if let Some(reactor) = &self.reactor {
            let mut chunks = chunks(content, &self.species, &self.memory);
            let scratches: Pool<Scratch> = Pool::new();
            parallel::for_each(&mut chunks, &|_, chunk| {
                scratches.lend(Default::default, |scratch| chunk.react(reactor, (t, dt), scratch));
            });
            let mut failed = None;
            for (idx, chunk) in chunks.iter().enumerate() {
                for (cell, own) in chunk.cells.iter().zip(&chunk.memory) {
                    self.memory[*cell as usize] = *own;
                }
                if let (Err(failure), None) = (chunk.result, failed) {
                    failed = Some((idx, failure));
                }
            }
            drop(chunks);
            if let Some((idx, failure)) = failed {
                return Err(refuse(plan, content, (step, idx * CHUNK + failure.particle), failure));
            }
        }
        if let Some(noise) = self.noise.as_ref().filter(|_| !content.variances.is_empty()) {
            let at = (&content.places, t + 0.5 * dt, dt);
            noise.correct(at, &mut content.columns, before, &content.variances);
        }
        for reaction in &self.instant {
            complete(reaction, &mut content.columns);
        }
        Ok(())
    }
}

/// A part of the cells.
struct Chunk<'a> {
    cells: &'a [u32],
    positions: [&'a [f64]; 3],
    components: Vec<&'a mut [f64]>,
    memory: Vec<f32>,
    result: Result<Work, Failure>,
}

impl Chunk<'_> {
    fn react(&mut self, reactor: &Reactor, (t, dt): (f64, f64), scratch: &mut Scratch) {
        let mut components: Vec<&mut [f64]> = self.components.iter_mut().map(|own| &mut **own).collect();
        let batch =
            Batch { positions: self.positions, t, dt, components: &mut components, memory: &mut self.memory };
        self.result = reactor.react(batch, scratch);
    }
}

fn chunks<'a>(content: &'a mut Content, species: &[usize], memory: &[f32]) -> Vec<Chunk<'a>> {
    let places = &content.places;
    let mut chunks: Vec<Chunk<'a>> = content
        .cells
        .chunks(CHUNK)
        .enumerate()
        .map(|(idx, cells)| {
            let range = idx * CHUNK..idx * CHUNK + cells.len();
            let along = |axis: &'a Vec<f64>| if axis.is_empty() { &axis[..] } else { &axis[range.clone()] };
            Chunk {
                cells,
                positions: places.each_ref().map(along),
                components: Vec::with_capacity(species.len()),
                memory: cells.iter().map(|&cell| memory[cell as usize]).collect(),
                result: Ok(Work::default()),
            }
        })
        .collect();
    let mut of_species: Vec<Option<&'a mut Vec<f64>>> = content.columns.iter_mut().map(Some).collect();
    for &own in species {
        let Some(column) = of_species[own].take() else { continue };
        for (chunk, part) in chunks.iter_mut().zip(column.chunks_mut(CHUNK)) {
            chunk.components.push(part);
        }
    }
    chunks
}

fn refuse(plan: &Plan, content: &Content, (step, at): (u64, usize), failure: Failure) -> RunError {
    let along = content.places.iter().filter_map(|axis| axis.get(at));
    let place: Vec<String> = along.map(|x| format!("{} m", precise(*x))).collect();
    let what = format!("in the cell at ({}): {}", place.join(", "), explain(plan, failure.why));
    RunError::Chemistry { step, particle: RunError::OF_NO_PARTICLE, what, why: failure.why }
}

/// `ξ = min_r c_r/ν_r`, taken of reactants and given to products.
fn complete(reaction: &InstantReaction, columns: &mut [Vec<f64>]) {
    let n = columns.first().map_or(0, Vec::len);
    for cell in 0..n {
        let extent = reaction.reactants.iter().map(|&(species, nu)| columns[species][cell] / nu);
        let extent = extent.fold(f64::INFINITY, f64::min);
        if !(extent > 0.0 && extent.is_finite()) {
            continue;
        }
        for &(species, nu) in &reaction.reactants {
            // The scarcest one is gone, to the last digit.
            let left = columns[species][cell] - nu * extent;
            let is_gone = left <= 4.0 * f64::EPSILON * columns[species][cell];
            columns[species][cell] = if is_gone { 0.0 } else { left };
        }
        for &(species, nu) in &reaction.products {
            columns[species][cell] += nu * extent;
        }
    }
}

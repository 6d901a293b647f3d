//! The initial state: positions, and the values of the components there.
//!
//! Owns the filling of new blocks. May use `state` and tapes. It deliberately applies no mixing: at
//! time 0 every stored zone has the value of the expression.

use super::error::RunError;
use super::mass::place::Cells;
use super::parallel;
use super::place::{Strata, place};
use super::program::Program;
use super::water;
use crate::plan::{Component, Plan, Species};
use crate::state::particles::{BLOCK, Block, state_bytes};

/// All blocks of the run.
///
/// They lie as dense as the water in `cells` where there are any.
pub fn blocks<const D: usize>(
    program: &Program<D>,
    cells: Option<&Cells<D>>,
) -> Result<Vec<Block<D>>, RunError> {
    let plan = program.plan;
    let n_particles = plan.particles.count;
    let bytes = state_bytes(n_particles, D, program.n_columns());
    let strata = Strata::<D>::new(&plan.axes, n_particles);
    let n_blocks = n_particles.div_ceil(BLOCK as u64) as usize;
    let blocks = parallel::map(n_blocks, &|block_idx| {
        let idx = block_idx as u64;
        let n_in_block = (n_particles - idx * BLOCK as u64).min(BLOCK as u64) as usize;
        let mut block = Block::<D>::new(idx, n_in_block, program.n_columns())
            .map_err(|_| RunError::OutOfMemory { bytes })?;
        match cells {
            None => place(
                &plan.axes,
                (plan.particles.placement, plan.particles.disorder),
                &strata,
                plan.seed,
                &mut block,
            ),
            Some(cells) => water::start::place(plan, cells, &mut block),
        }
        if plan.transport.is_some() {
            block.ids = (block.first()..block.first() + n_in_block as u64).collect();
        }
        fill(program, &mut block)?;
        Ok(block)
    });
    // The first block in order tells its error, whichever was found first.
    blocks.into_iter().collect()
}

/// Evaluates the initial expressions at the positions of a block.
fn fill<const D: usize>(program: &Program<D>, block: &mut Block<D>) -> Result<(), RunError> {
    let zeros = vec![0.0; block.n_particles];
    let mut inputs: [&[f64]; 4] = [&zeros; 4];
    for (axis, positions) in program.plan.axes.iter().zip(&block.positions) {
        inputs[axis.index] = positions;
    }
    let n_slots = program.roles.len();
    let mut scratch = Vec::new();
    let carried = &program.plan.components[..program.n_components()];
    for (component_idx, component) in carried.iter().enumerate() {
        let columns = &mut block.columns[component_idx * n_slots..][..n_slots];
        let Some((first, others)) = columns.split_first_mut() else { continue };
        component.initial.evaluate_block(&inputs, &mut scratch, first);
        if let Some(idx) = first.iter().position(|value| !value.is_finite()) {
            return Err(RunError::NonFiniteInitial {
                component: component.name.clone(),
                particle: block.idx * BLOCK as u64 + idx as u64,
                position: block.positions.iter().map(|axis| axis[idx]).collect(),
            });
        }
        others.iter_mut().for_each(|other| other.copy_from_slice(first));
    }
    check_signs(program, block)
}

/// Species restored from a relation are checked like carried ones: a negative start makes products
/// from nothing. Values of rounding size, relative to what they are made of, pass. What stands for a species in
/// equilibrium is its total, and that of hydrogen is below zero where there is more hydroxide.
fn check_signs<const D: usize>(program: &Program<D>, block: &Block<D>) -> Result<(), RunError> {
    let n_slots = program.roles.len();
    let is_carried = |species: &Species| species.terms.iter().all(|&(k, _)| k < program.n_components());
    let all = program.plan.species.iter().enumerate();
    let signed = all.filter(|(idx, species)| is_carried(species) && !may_be_negative(program.plan, *idx));
    for (_, species) in signed {
        for idx in 0..block.n_particles {
            let (mut value, mut size) = (species.constant, species.constant.abs());
            for &(component, coefficient) in &species.terms {
                let term = coefficient * block.columns[component * n_slots][idx];
                value += term;
                size += term.abs();
            }
            if value < -1e-12 * size {
                return Err(RunError::NegativeConcentration {
                    step: 0,
                    particle: block.idx * BLOCK as u64 + idx as u64,
                    component: species.name.clone(),
                    value,
                });
            }
        }
    }
    Ok(())
}

/// Whether a species is a primary one of which others take some away: its total has no sign.
fn may_be_negative(plan: &Plan, species: usize) -> bool {
    let Some(system) = plan.chemistry.as_ref().and_then(|chemistry| chemistry.equilibrium.as_ref()) else {
        return false;
    };
    let takes = |coefficients: &[(usize, f64)]| {
        coefficients.iter().any(|&(primary, nu)| system.primaries[primary].species == species && nu < 0.0)
    };
    system.secondaries.iter().any(|secondary| takes(&secondary.coefficients))
        || system.minerals.iter().any(|mineral| takes(&mineral.coefficients))
}

/// What lives in bins: the values of the expressions at their centres, per immobile component and slot. The
/// slot outside holds nothing.
pub fn immobile<const D: usize>(program: &Program<D>) -> Result<Vec<Vec<f64>>, RunError> {
    let n_bins = program.grid.n_bins();
    let mut centres = [const { Vec::new() }; 3];
    for (rank, axis) in program.plan.axes.iter().enumerate() {
        centres[axis.index] = (0..n_bins).map(|bin| program.grid.centre(bin)[rank]).collect();
    }
    let zeros = vec![0.0; n_bins];
    let of = |index: usize| if centres[index].is_empty() { &zeros[..] } else { &centres[index][..] };
    let inputs = [of(0), of(1), of(2), &zeros[..]];
    let mut scratch = Vec::new();
    let of_component = |component: &Component| {
        let mut values = vec![0.0; n_bins];
        component.initial.evaluate_block(&inputs, &mut scratch, &mut values);
        if let Some(bin) = values.iter().position(|value| !(value.is_finite() && *value >= 0.0)) {
            return Err(RunError::WrongInBin {
                component: component.name.clone(),
                position: program.grid.centre(bin).to_vec(),
                value: values[bin],
            });
        }
        values.push(0.0);
        Ok(values)
    };
    program.plan.components[program.n_components()..].iter().map(of_component).collect()
}

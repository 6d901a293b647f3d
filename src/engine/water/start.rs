//! Where parcels begin if porosity varies, and how many lie in a bin.
//!
//! Owns the density of water. May use places, grids and the plan. It deliberately reads no initial values.

use super::super::mass::place::Cells;
use super::super::mass::release::Sampling;
use super::super::mass::world::Site;
use crate::plan::Plan;
use crate::plan::tape::Operation;
use crate::state::grid::Grid;
use crate::state::particles::Block;
use crate::state::stream::{Purpose, Stream};

/// Water in each part of the domain; nothing where porosity is the same everywhere.
pub fn cells<const D: usize>(site: &Site<D>) -> Option<Cells<D>> {
    let is_constant = matches!(site.transport.porosity.operations[..], [Operation::Constant(_)]);
    if is_constant && site.pores().is_none() {
        return None;
    }
    Some(Cells::new(site.low, site.high, |centres| site.porosity(centres)))
}

/// Water of each bin over that of the mean one.
///
/// - Equation: `n ∫_bin φ / ∫ φ`.
/// - Symbols: φ porosity, `n` bins.
/// - Range: bins no finer than the cells that porosity is looked at in.
/// - Source: definition of porosity.
/// - Shape: one number per bin.
pub fn uneven<const D: usize>(cells: &Cells<D>, grid: &Grid<D>) -> Vec<f64> {
    let mut water = vec![0.0; grid.n_slots()];
    for (centre, mass) in cells.masses() {
        let mut slot = [0];
        grid.locate(std::array::from_fn(|axis| &centre[axis..=axis]), &mut slot);
        water[slot[0] as usize] += mass;
    }
    water.truncate(grid.n_bins());
    let scale = grid.n_bins() as f64 / cells.total();
    water.into_iter().map(|mass| mass * scale).collect()
}

/// Positions of the parcels of a block.
pub fn place<const D: usize>(plan: &Plan, cells: &Cells<D>, block: &mut Block<D>) {
    let stream = Stream::new(plan.seed, Purpose::Placement);
    let sampling = Sampling::new(&plan.particles, &stream);
    for idx in 0..block.n_particles {
        let count = block.number(idx);
        let uniforms = stream.uniforms_of(count, 0);
        let (share, uniforms) = sampling.draw(count, plan.particles.count, uniforms);
        let position = cells.at(share, &uniforms);
        block.positions.iter_mut().zip(position).for_each(|(axis, x)| axis[idx] = x);
    }
}

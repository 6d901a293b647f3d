//! Particles in cells lie in memory as they lie in space, where the flow is larger than a core's cache.
//!
//! What a particle reads of its cell comes from far away otherwise. Draws belong to particles and sums are exact,
//! so that the order of particles changes no byte.

use super::Draft;
use crate::plan::Plan;
use crate::plan::transport::{Flow, Order};

/// Bytes of a flow that a core's own cache holds beside all else.
const CACHE: usize = 512 << 10;
/// Bytes of the cells of one tile: they stay in the nearest cache.
const TILE: usize = 12 << 10;
/// Most tiles: as many streams of memory are written at once.
const MOST_TILES: usize = 4096;
/// Fewer particles are no work.
const FEWEST: u64 = 50_000;
/// Displacements of a particle from one sorting to the next: a sorting costs as much as five of them.
const DISPLACEMENTS: u64 = 64;

pub(super) fn run(draft: &mut Draft) {
    // Parcels of water are summed in the order in which they lie: another one would change last bits.
    if !draft.plan.carries_mass() {
        return;
    }
    // So are their masses where they react.
    if draft.plan.reacting().is_some() {
        return;
    }
    let Some(cells) = cells(&draft.plan) else { return };
    let n_axes = cells.len();
    let n_cells: usize = cells.iter().product();
    // Velocities at two faces for each axis and at all corners, in 32 bits.
    let bytes = n_cells.saturating_mul(4 * (2 * n_axes + (n_axes << n_axes)));
    let reason = if bytes <= CACHE {
        "the cells of the flow fit in the cache of a core"
    } else if draft.plan.particles.count < FEWEST {
        "there are few particles"
    } else {
        let tiles = tiles(&cells, (bytes / TILE).min(MOST_TILES));
        if let Some(transport) = &mut draft.plan.transport {
            transport.order = Some(Order { tiles, displacements: DISPLACEMENTS });
        }
        return;
    };
    draft.leave_out("sorting of particles by cell", reason);
}

/// Cells along each axis of a flow that has some.
fn cells(plan: &Plan) -> Option<Vec<usize>> {
    match &plan.transport.as_ref()?.flow {
        Flow::Darcy(darcy) => Some(darcy.cells.clone()),
        Flow::File(file) => Some(file.facts.cells.clone()),
        Flow::Uniform(_) | Flow::Expression(_) => None,
    }
}

/// About `n` tiles of as many cells along each axis.
fn tiles(cells: &[usize], n: usize) -> Vec<usize> {
    let n_cells: usize = cells.iter().product();
    let per_tile = (n_cells / n.max(1)).max(1);
    // The largest edge whose power does not exceed the cells of a tile.
    let power = |edge: usize| edge.saturating_pow(cells.len() as u32);
    let edge = (1..=per_tile).take_while(|&edge| power(edge) <= per_tile).last().unwrap_or(1);
    cells.iter().map(|&cells| cells.div_ceil(edge)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_have_equal_edges() {
        assert_eq!(tiles(&[400, 160], 256), [27, 11]);
        assert_eq!(tiles(&[100, 50, 50], 1000), [17, 9, 9]);
        assert_eq!(tiles(&[5], 100), [5]);
        assert!(tiles(&[10_000, 10_000], 4096).iter().product::<usize>() <= usize::from(u16::MAX));
    }
}

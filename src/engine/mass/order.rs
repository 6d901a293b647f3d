//! Particles of one place side by side in memory, so that what they read of the flow is near.
//!
//! Owns the sorting of flocks. May use grids and `parallel`. It deliberately touches no particle: none of what
//! follows hangs on their order.

use super::super::parallel;
use super::flock::Flock;
use super::world::Site;
use crate::state::grid::Grid;
use crate::state::particles::{BLOCK, CHUNK};

/// Bits of a place within a flock.
const PLACE_BITS: u32 = BLOCK.trailing_zeros();

/// When and how flocks are sorted.
pub struct Order<const D: usize> {
    tiles: Grid<D>,
    /// Displacements of a particle between two sortings.
    every: u64,
    /// Displacements of all since the last one; what begins is not sorted.
    since: u64,
}

impl<const D: usize> Order<D> {
    /// As the plan says; nothing if it says that the order does not matter.
    pub fn new(site: &Site<D>) -> Option<Self> {
        let order = site.transport.order.as_ref()?;
        let tiles: [usize; D] = order.tiles.clone().try_into().ok()?;
        let tiles = Grid::new(site.low, site.high, tiles, [false; D])?;
        Some(Self { tiles, every: order.displacements, since: u64::MAX })
    }

    /// Sorts if particles have moved enough.
    pub fn moved(&mut self, displacements: u64, flocks: &mut Vec<Flock<D>>) {
        self.since = self.since.saturating_add(displacements);
        let n_particles: usize = flocks.iter().map(Flock::len).sum();
        let is_due = self.since >= self.every.saturating_mul(n_particles as u64);
        // Places are counted in 32 bits; four thousand million particles stay as they are.
        if !is_due || flocks.len() >= 1 << (u32::BITS - PLACE_BITS) {
            return;
        }
        self.since = 0;
        let n_populations = flocks.iter().map(|flock| flock.population + 1).max().unwrap_or(0);
        let mut sorted = Vec::with_capacity(flocks.len());
        for population in 0..n_populations {
            let own: Vec<Flock<D>> = flocks.extract_if(.., |flock| flock.population == population).collect();
            // One flock is near to itself.
            if own.len() > 1 { sorted.extend(self.sort(&own)) } else { sorted.extend(own) }
        }
        *flocks = sorted;
    }

    /// The same particles by tile, and within a tile as they were.
    fn sort(&self, flocks: &[Flock<D>]) -> Vec<Flock<D>> {
        let population = flocks.first().map_or(0, |flock| flock.population);
        let places = self.places(flocks);
        let place = |&place: &u32| (place >> PLACE_BITS, place as usize & (BLOCK - 1));
        parallel::map(places.len().div_ceil(BLOCK), &|idx| {
            let range = &places[idx * BLOCK..((idx + 1) * BLOCK).min(places.len())];
            let of = |at: &u32| {
                let (flock, at) = place(at);
                (&flocks[flock as usize], at)
            };
            let ids = range.iter().map(|at| of(at).0.ids[of(at).1]).collect();
            let along = |axis: usize| range.iter().map(|at| of(at).0.positions[axis][of(at).1]).collect();
            let masses = range.iter().filter_map(|at| of(at).0.masses.get(of(at).1).copied()).collect();
            Flock { population, ids, positions: std::array::from_fn(along), masses }
        })
    }

    /// Flock and place within it of every particle, in the new order.
    fn places(&self, flocks: &[Flock<D>]) -> Vec<u32> {
        let tiles = parallel::map(flocks.len(), &|idx| self.tiles_of(&flocks[idx]));
        let mut first = vec![0_u64; self.tiles.n_bins() + 1];
        tiles.iter().flatten().for_each(|&tile| first[usize::from(tile) + 1] += 1);
        for tile in 1..first.len() {
            first[tile] += first[tile - 1];
        }
        let mut places = vec![0_u32; first.last().map_or(0, |&n| n as usize)];
        for (flock, tiles) in tiles.iter().enumerate() {
            for (at, &tile) in tiles.iter().enumerate() {
                let next = &mut first[usize::from(tile)];
                places[*next as usize] = (flock as u32) << PLACE_BITS | at as u32;
                *next += 1;
            }
        }
        places
    }

    fn tiles_of(&self, flock: &Flock<D>) -> Vec<u16> {
        let mut tiles = Vec::with_capacity(flock.len());
        let mut slots = [0_i32; CHUNK];
        for start in (0..flock.len()).step_by(CHUNK) {
            let range = start..(start + CHUNK).min(flock.len());
            let slots = &mut slots[..range.len()];
            self.tiles.locate(flock.positions.each_ref().map(|axis| &axis[range.clone()]), slots);
            tiles.extend(slots.iter().map(|&slot| slot as u16));
        }
        tiles
    }
}

#[cfg(test)]
mod tests {
    use super::super::flock;
    use super::*;

    fn order() -> Order<2> {
        let tiles = Grid::new([0.0; 2], [8.0, 4.0], [4, 2], [false; 2]).unwrap();
        Order { tiles, every: 10, since: u64::MAX }
    }

    fn cloud(n: usize) -> Vec<Flock<2>> {
        let mut flocks = Vec::new();
        for k in 0..n {
            // Beyond the domain, too: such a particle belongs to the nearest tile.
            let position = [(k * 7 % 101) as f64 * 0.1 - 1.0, (k * 13 % 37) as f64 * 0.1];
            flock::add(&mut flocks, k % 3, flock::id(1, k as u64), position);
        }
        flocks
    }

    fn listed(flocks: &[Flock<2>]) -> Vec<(u64, usize, [u64; 2])> {
        let of = |flock: &Flock<2>| {
            (0..flock.len())
                .map(|idx| (flock.ids[idx], flock.population, flock.position(idx).map(f64::to_bits)))
                .collect::<Vec<_>>()
        };
        flocks.iter().flat_map(of).collect()
    }

    #[test]
    fn sorting_keeps_every_particle_and_brings_tiles_together() {
        let mut flocks = cloud(100_000);
        let mut before = listed(&flocks);
        let mut order = order();
        order.moved(0, &mut flocks);
        for population in 0..3 {
            let own: Vec<&Flock<2>> = flocks.iter().filter(|flock| flock.population == population).collect();
            let tiles: Vec<u16> = own.iter().flat_map(|flock| order.tiles_of(flock)).collect();
            assert!(tiles.is_sorted(), "population {population}");
            assert!(own[..own.len() - 1].iter().all(|flock| flock.len() == BLOCK));
        }
        let mut after = listed(&flocks);
        assert_ne!(before, after);
        before.sort_unstable();
        after.sort_unstable();
        assert_eq!(before, after);
    }

    #[test]
    fn what_has_hardly_moved_is_not_sorted_again() {
        let mut flocks = cloud(100_000);
        let mut order = order();
        order.since = 0;
        let before = flocks.clone();
        order.moved(999_999, &mut flocks);
        assert_eq!(flocks, before);
        order.moved(1, &mut flocks);
        assert_ne!(flocks, before);
        assert_eq!(order.since, 0);
    }
}

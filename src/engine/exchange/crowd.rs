//! Parcels in the order of cells, with what they carry.
//!
//! Owns the sorting, and the way back. May use the space and `parallel`. It deliberately moves no parcel: places and draws
//! stay what they were.

use super::super::parallel;
use super::near::{Crowd, PADDING};
use super::space::Space;
use crate::state::particles::{BLOCK, Block};

/// Bits of a place within a block.
const PLACE_BITS: u32 = BLOCK.trailing_zeros();

/// Blocks that a number of 32 bits can count, with their places.
pub const MOST_BLOCKS: usize = 1 << (u32::BITS - PLACE_BITS);

#[derive(Debug, Clone, Default)]
pub struct Sorted {
    /// Positions in the space, one array per axis.
    pub y: Vec<Vec<f64>>,
    pub first: Vec<u32>,
    /// Block and place of each.
    places: Vec<u32>,
    /// By block: where each stands in the order.
    ranks: Vec<Vec<u32>>,
}

impl Sorted {
    pub fn crowd<'a, const D: usize>(&'a self, space: &'a Space<D>) -> Crowd<'a, D> {
        let mut y = [&[][..]; D];
        for (axis, own) in y.iter_mut().zip(&self.y) {
            *axis = own;
        }
        Crowd { space, n: self.places.len(), y, first: &self.first }
    }

    /// Whether all parcels are where they were when they were sorted, to the last bit.
    pub fn stands<const D: usize>(&self, space: &Space<D>, blocks: &[Block<D>]) -> bool {
        let n = self.places.len();
        // Parcels may have come and gone, in whatever block.
        let are_same = self.ranks.len() == blocks.len()
            && self.ranks.iter().zip(blocks).all(|(ranks, block)| ranks.len() == block.n_particles);
        if !are_same || n == 0 {
            return false;
        }
        let are_still = |first: usize, places: &[u32]| {
            places.iter().enumerate().all(|(idx, &place)| {
                let (block, at) = split(place);
                let x = std::array::from_fn(|axis| blocks[block].positions[axis][at]);
                let y = space.of(x);
                (0..D).all(|axis| y[axis].to_bits() == self.y[axis][first + idx].to_bits())
            })
        };
        // What walks is found out by the first of them.
        let parts: Vec<&[u32]> = self.places.chunks(BLOCK).collect();
        are_still(0, &self.places[..n.min(64)])
            && parallel::map(parts.len(), &|part| are_still(part * BLOCK, parts[part])).iter().all(|&own| own)
    }

    /// Sorts all parcels anew: by cell, and within a cell by number.
    pub fn sort<const D: usize>(&mut self, space: &Space<D>, blocks: &[Block<D>]) {
        self.ranks.resize_with(blocks.len(), Vec::new);
        let mut tasks: Vec<_> = self.ranks.iter_mut().zip(blocks).collect();
        parallel::for_each(&mut tasks, &|_, (cells, block)| {
            cells.clear();
            for idx in 0..block.n_particles {
                let x = std::array::from_fn(|axis| block.positions[axis][idx]);
                cells.push(space.cell(space.of(x)) as u32);
            }
        });
        self.first.clear();
        self.first.resize(space.n_cells() + 1, 0);
        self.ranks.iter().flatten().for_each(|&cell| self.first[cell as usize] += 1);
        let mut sum = 0;
        for first in &mut self.first {
            sum += std::mem::replace(first, sum);
        }
        self.places.resize(sum as usize, 0);
        for (block, cells) in self.ranks.iter_mut().enumerate() {
            for (at, cell) in cells.iter_mut().enumerate() {
                let next = &mut self.first[*cell as usize];
                self.places[*next as usize] = (block as u32) << PLACE_BITS | at as u32;
                *cell = *next;
                *next += 1;
            }
        }
        // Each has run on to the beginning of the next one.
        self.first.rotate_right(1);
        self.first[0] = 0;
        if let Some(last) = self.first.last_mut() {
            *last = sum;
        }
        self.place(space, blocks);
    }

    fn place<const D: usize>(&mut self, space: &Space<D>, blocks: &[Block<D>]) {
        self.y.resize_with(D, Vec::new);
        self.y.iter_mut().for_each(|axis| axis.resize(self.places.len() + PADDING, 0.0));
        let mut parts: Vec<(&[u32], Vec<&mut [f64]>)> =
            self.places.chunks(BLOCK).map(|part| (part, vec![])).collect();
        for axis in &mut self.y {
            parts.iter_mut().zip(axis.chunks_mut(BLOCK)).for_each(|(part, own)| part.1.push(own));
        }
        parallel::for_each(&mut parts, &|_, (places, y)| {
            for (idx, &place) in places.iter().enumerate() {
                let (block, at) = split(place);
                let x = std::array::from_fn(|axis| blocks[block].positions[axis][at]);
                for (axis, own) in space.of(x).into_iter().enumerate() {
                    y[axis][idx] = own;
                }
            }
        });
    }

    /// A column of all parcels, in the order of cells.
    pub fn gather<const D: usize>(&self, blocks: &[Block<D>], column: usize, target: &mut Vec<f64>) {
        self.bring(&|block| &blocks[block].columns[column], target);
    }

    /// What each block has for its parcels, in the order of cells.
    pub fn bring<'a>(&self, of_block: &(dyn Fn(usize) -> &'a [f64] + Sync), target: &mut Vec<f64>) {
        target.resize(self.places.len() + PADDING, 0.0);
        let mut parts: Vec<_> = self.places.chunks(BLOCK).zip(target.chunks_mut(BLOCK)).collect();
        parallel::for_each(&mut parts, &|_, (places, target)| {
            for (value, &place) in target.iter_mut().zip(*places) {
                let (block, at) = split(place);
                *value = of_block(block)[at];
            }
        });
    }

    /// Gives a column back; what comes out of it is the first value of which `is_wrong` says so, by block and place.
    pub fn give_back<const D: usize>(
        &self,
        blocks: &mut [Block<D>],
        column: usize,
        values: &[f64],
        limit: f64,
    ) -> Option<(usize, usize)> {
        let mut tasks: Vec<_> =
            self.ranks.iter().zip(blocks).map(|(ranks, block)| (ranks, block, None)).collect();
        parallel::for_each(&mut tasks, &|_, (ranks, block, wrong)| {
            let target = &mut block.columns[column];
            for (at, (value, &rank)) in target.iter_mut().zip(ranks.iter()).enumerate() {
                *value = values[rank as usize];
                // Not a number is not above the limit either.
                if !(*value >= limit && value.is_finite()) && wrong.is_none() {
                    *wrong = Some(at);
                }
            }
        });
        tasks.iter().enumerate().find_map(|(block, task)| task.2.map(|at| (block, at)))
    }
}

fn split(place: u32) -> (usize, usize) {
    ((place >> PLACE_BITS) as usize, place as usize & (BLOCK - 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::{Axis, Side};

    /// As many as before, but not the same: what stood behind in one block is now in another.
    #[test]
    fn parcels_that_come_and_go_do_not_stand() {
        let (low_side, high_side) = (Side::Open, Side::Open);
        let axes = [Axis { index: 0, low: 0.0, high: 1.0, low_side, high_side, bins: 1 }];
        let space = Space::<1>::new(&axes, &[1.0], (0.1, 5.0), 6).unwrap();
        let mut blocks = vec![Block::<1>::new(0, 3, 1).unwrap(), Block::new(1, 3, 1).unwrap()];
        for (idx, block) in blocks.iter_mut().enumerate() {
            block.ids = (0..3).map(|k| 3 * idx as u64 + k).collect();
            block.positions[0] = block.ids.iter().map(|&id| id as f64 / 6.0).collect();
        }
        let mut sorted = Sorted::default();
        assert!(!sorted.stands(&space, &blocks));
        sorted.sort(&space, &blocks);
        assert!(sorted.stands(&space, &blocks));
        let (one, other) = blocks.split_at_mut(1);
        one[0].take_from(&mut other[0], 1);
        assert!(!sorted.stands(&space, &blocks));
        blocks.truncate(1);
        assert!(!sorted.stands(&space, &blocks));
    }
}

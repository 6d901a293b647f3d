//! Blocks of parcels that grow and shrink.
//!
//! Owns how parcels are put away. May use `state`. It deliberately gives no meaning to the place of a parcel: its
//! identity is its number.

use crate::state::particles::{BLOCK, Block};

/// Fewer blocks are left as they are.
const FEW: usize = 16;

/// Puts parcels behind the others: into what is left of the last block, and into a new one.
pub fn append<const D: usize>(blocks: &mut Vec<Block<D>>, mut block: Block<D>) {
    if let Some(last) = blocks.last_mut() {
        let n = (BLOCK.saturating_sub(last.n_particles)).min(block.n_particles);
        last.take_from(&mut block, n);
    }
    if block.n_particles > 0 || blocks.is_empty() {
        block.idx = blocks.len() as u64;
        blocks.push(block);
    }
}

/// Fills blocks up again when they are half empty on the whole; one is kept though nothing is left.
pub fn gather<const D: usize>(blocks: &mut Vec<Block<D>>) {
    let n_particles: usize = blocks.iter().map(|block| block.n_particles).sum();
    if blocks.len() < FEW || n_particles * 2 > blocks.len() * BLOCK {
        return;
    }
    let all = std::mem::take(blocks);
    all.into_iter().for_each(|block| append(blocks, block));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block(first: u64, n: usize) -> Block<1> {
        let mut block = Block::new(0, n, 1).unwrap();
        block.ids = (first..first + n as u64).collect();
        block.columns[0] = block.ids.iter().map(|&id| id as f64).collect();
        block
    }

    #[test]
    fn nothing_is_lost_when_blocks_are_gathered() {
        let mut blocks: Vec<Block<1>> = Vec::new();
        let mut n = 0;
        for idx in 0..40 {
            let mut own = block(n, 100 * idx);
            own.idx = idx as u64;
            n += 100 * idx as u64;
            blocks.push(own);
        }
        gather(&mut blocks);
        let ids: Vec<u64> = blocks.iter().flat_map(|block| block.ids.iter().copied()).collect();
        assert_eq!(ids, (0..n).collect::<Vec<_>>(), "in the same order");
        for (idx, block) in blocks.iter().enumerate() {
            assert_eq!(block.idx, idx as u64);
            assert!(block.n_particles <= BLOCK && block.ids.len() == block.n_particles);
            assert!(block.columns[0].iter().zip(&block.ids).all(|(c, id)| *c == *id as f64));
        }
        assert!(blocks.len() < 16);
        append(&mut blocks, block(n, BLOCK));
        assert_eq!(blocks.iter().map(|block| block.n_particles as u64).sum::<u64>(), n + BLOCK as u64);
        assert!(blocks[..blocks.len() - 1].iter().all(|block| block.n_particles == BLOCK));
    }
}

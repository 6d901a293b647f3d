//! One pass over a block: any of mix, move, bound and average, chunk by chunk.
//!
//! Owns the order of work within a chunk. May use the stages and `state`. It deliberately knows
//! nothing of other blocks: a fused step and separate passes run this same code.

use super::average::{self, Means};
use super::mix;
use super::program::{Program, Work};
use super::react::{Bench, Chunk, Reaction};
use super::walk::{Leap, Noise, Place};
use crate::chemistry::Why;
use crate::maths::wide::Width;
use crate::state::particles::{Block, CHUNK, number};
use crate::state::stream::Stream;

/// What one thread needs to work on a chunk.
pub struct Scratch<const D: usize> {
    pub noise: Noise<D>,
    pub slots: [i32; CHUNK],
    /// The mean that each particle sees.
    pub target: [f64; CHUNK],
    /// Sums per slot and lane.
    pub sums: Vec<f64>,
    pub bench: Bench,
}

impl<const D: usize> Scratch<D> {
    pub fn new() -> Box<Self> {
        Box::new(Self {
            noise: [[0.0; CHUNK]; D],
            slots: [0; CHUNK],
            target: [0.0; CHUNK],
            sums: Vec::new(),
            bench: Bench::default(),
        })
    }
}

/// The first thing that went wrong in a group of blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Trouble {
    Position {
        particle: u64,
    },
    /// A value below the limit of its component, somewhere in a chunk: its block, its place there.
    Negative {
        component: usize,
        block: usize,
        first: usize,
    },
    Chemistry {
        particle: u64,
        why: Why,
    },
}

/// Constants of a pass, the same for all blocks.
pub struct Pass<'a, const D: usize> {
    pub program: &'a Program<'a, D>,
    pub work: Work,
    /// Number of the step, from 0.
    pub step: u64,
    pub leap: Leap<D>,
    pub stream: &'a Stream,
    /// Means and decays of the relaxation.
    pub means: &'a Means,
    pub decays: &'a [Option<f64>],
    pub reaction: Option<Reaction<'a, D>>,
    /// Smallest value allowed per component.
    pub limits: &'a [f64],
    pub n_lanes: usize,
    pub width: Width,
}

/// One block of a pass, to be dispatched to wide or narrow code.
pub struct OnBlock<'a, const D: usize> {
    pub pass: &'a Pass<'a, D>,
    pub block: &'a mut Block<D>,
    pub scratch: &'a mut Scratch<D>,
    pub trouble: &'a mut Option<Trouble>,
}

impl<const D: usize> pulp::NullaryFnOnce for OnBlock<'_, D> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { pass, block, scratch, trouble } = self;
        let program = pass.program;
        let mut columns = std::mem::take(&mut block.columns);
        for (chunk_idx, range) in block.chunks().enumerate() {
            if trouble.is_some() {
                // Only the first counts, and what fails may take long.
                break;
            }
            let n = range.len();
            let first = range.start;
            let slots = &mut scratch.slots[..n];
            let mut positions = block.positions.each_mut().map(|axis| &mut axis[range.clone()]);
            if pass.work.mixes {
                program.grid.locate(positions.each_ref().map(|axis| &**axis), slots);
                let mut chunk = mix::cut(&mut columns, range.clone());
                let target = std::slice::from_mut(&mut scratch.target);
                let below =
                    mix::relax(program, pass.means, pass.decays, slots, &mut chunk, target, pass.limits);
                if let Some(component) = below {
                    let block = block.idx as usize;
                    trouble.get_or_insert(Trouble::Negative { component, block, first });
                }
            }
            if let Some(reaction) = &pass.reaction {
                let positions = positions.each_ref().map(|axis| &**axis);
                if program.is_coupled() {
                    program.grid.locate(positions, slots);
                }
                let memory = match &mut block.memory[..] {
                    [] => &mut [][..],
                    memory => &mut memory[range.clone()],
                };
                let mut columns = mix::cut(&mut columns, range.clone());
                let chunk = Chunk { n, positions, slots, columns: &mut columns, memory };
                if let Err(failure) = reaction.react(chunk, &mut scratch.bench, &mut scratch.sums) {
                    let particle = number(&block.ids, block.idx, first + failure.particle);
                    trouble.get_or_insert(Trouble::Chemistry { particle, why: failure.why });
                }
            }
            if pass.work.moves {
                let place = Place { block_idx: block.idx, chunk_idx: chunk_idx as u64, step: pass.step };
                program.mover.draw(pass.width, pass.stream, place, &mut scratch.noise);
                pass.leap.apply(&mut positions, &scratch.noise);
            }
            if pass.work.bounds {
                for (rule, positions) in program.rules.iter().zip(&mut positions) {
                    if let Err(idx) = rule.apply(positions) {
                        let particle = number(&block.ids, block.idx, first + idx);
                        trouble.get_or_insert(Trouble::Position { particle });
                    }
                }
            }
            if pass.work.averages {
                program.grid.locate(positions.each_ref().map(|axis| &**axis), slots);
                average::accumulate(slots, &columns, range, pass.n_lanes, &mut scratch.sums);
            }
        }
        block.columns = columns;
    }
}

//! Particles as a structure of arrays, cut into blocks of fixed size.
//!
//! Owns positions and carried values. May use nothing else of the crate but `maths`' size of a draw.
//! It deliberately knows no meaning of a column.

use crate::maths::chacha::DRAW;

/// Particles that are worked on together in the first-level cache: one draw of random words.
pub const CHUNK: usize = DRAW;

/// Chunks of a block.
pub const CHUNKS_PER_BLOCK: usize = 8;

/// Particles of a block. Part of the numerics: streams and sums follow it.
pub const BLOCK: usize = CHUNK * CHUNKS_PER_BLOCK;

/// A run of consecutive particles with their own arrays.
#[derive(Debug, Clone, PartialEq)]
pub struct Block<const D: usize> {
    /// Number of this block; its first particle is `idx · BLOCK` where none come and go.
    pub idx: u64,
    pub n_particles: usize,
    /// Per active axis, m.
    pub positions: [Vec<f64>; D],
    /// Carried columns one after the other, each `n_particles` long.
    pub columns: Vec<Vec<f64>>,
    /// What an integrator keeps for each particle; empty if nothing needs it.
    pub memory: Vec<f32>,
    /// Numbers of particles that come and go; empty where they follow from the place.
    pub ids: Vec<u64>,
}

impl<const D: usize> Block<D> {
    /// Zeros for particles `idx · BLOCK …`, or the bytes that could not be had.
    pub fn new(idx: u64, n_particles: usize, n_columns: usize) -> Result<Self, u64> {
        let zeros = || {
            let mut array = Vec::new();
            array.try_reserve_exact(n_particles).map_err(|_| (n_particles * 8) as u64)?;
            array.resize(n_particles, 0.0);
            Ok(array)
        };
        let mut positions = [const { Vec::new() }; D];
        for axis in &mut positions {
            *axis = zeros()?;
        }
        let columns = (0..n_columns).map(|_| zeros()).collect::<Result<_, u64>>()?;
        Ok(Self { idx, n_particles, positions, columns, memory: Vec::new(), ids: Vec::new() })
    }

    /// Number of the first particle.
    pub fn first(&self) -> u64 {
        self.idx * BLOCK as u64
    }

    /// Number of a particle of the block.
    pub fn number(&self, idx: usize) -> u64 {
        number(&self.ids, self.idx, idx)
    }

    /// Puts what particle `from` carries, its position apart, in the place `to`.
    #[inline(always)]
    pub fn take_over(&mut self, to: usize, from: usize) {
        self.ids[to] = self.ids[from];
        self.columns.iter_mut().for_each(|column| column[to] = column[from]);
        if !self.memory.is_empty() {
            self.memory[to] = self.memory[from];
        }
    }

    /// Forgets all particles from `n_particles` on.
    pub fn truncate(&mut self, n_particles: usize) {
        self.n_particles = n_particles;
        self.ids.truncate(n_particles);
        self.memory.truncate(n_particles);
        self.positions.iter_mut().chain(&mut self.columns).for_each(|array| array.truncate(n_particles));
    }

    /// Takes the first `n` particles of another block, behind its own.
    pub fn take_from(&mut self, other: &mut Self, n: usize) {
        self.n_particles += n;
        other.n_particles -= n;
        self.ids.extend(other.ids.drain(..n));
        if !other.memory.is_empty() {
            self.memory.extend(other.memory.drain(..n));
        }
        let own = self.positions.iter_mut().chain(&mut self.columns);
        let others = other.positions.iter_mut().chain(&mut other.columns);
        own.zip(others).for_each(|(own, other)| own.extend(other.drain(..n)));
    }

    /// Ranges of the chunks within the block.
    pub fn chunks(&self) -> impl Iterator<Item = std::ops::Range<usize>> + use<D> {
        self.portions(CHUNK)
    }

    /// Ranges of `size` particles, the last one shorter.
    pub fn portions(&self, size: usize) -> impl Iterator<Item = std::ops::Range<usize>> + use<D> {
        let n_particles = self.n_particles;
        (0..n_particles).step_by(size).map(move |start| start..(start + size).min(n_particles))
    }
}

/// Number of particle `idx` of block `block_idx`, whose particles may have numbers of their own.
pub fn number(ids: &[u64], block_idx: u64, idx: usize) -> u64 {
    ids.get(idx).copied().unwrap_or(block_idx * BLOCK as u64 + idx as u64)
}

/// Bytes of the state of `n_particles` particles.
pub fn state_bytes(n_particles: u64, n_axes: usize, n_columns: usize) -> u64 {
    n_particles.saturating_mul(8 * (n_axes + n_columns) as u64)
}

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
    /// Number of this block; its first particle is `idx · BLOCK`.
    pub idx: u64,
    pub n_particles: usize,
    /// Per active axis, m.
    pub positions: [Vec<f64>; D],
    /// Carried columns one after the other, each `n_particles` long.
    pub columns: Vec<Vec<f64>>,
    /// What an integrator keeps for each particle; empty if nothing needs it.
    pub memory: Vec<f32>,
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
        Ok(Self { idx, n_particles, positions, columns, memory: Vec::new() })
    }

    /// Number of the first particle.
    pub fn first(&self) -> u64 {
        self.idx * BLOCK as u64
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

/// Bytes of the state of `n_particles` particles.
pub fn state_bytes(n_particles: u64, n_axes: usize, n_columns: usize) -> u64 {
    n_particles.saturating_mul(8 * (n_axes + n_columns) as u64)
}

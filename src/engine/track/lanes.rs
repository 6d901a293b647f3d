//! Particles side by side while they move.
//!
//! Owns the arrays of a group of particles. May use `maths`' number of lanes. It deliberately does nothing.

pub use crate::maths::chacha::LANES;

/// One number per particle.
pub type Lane = [f64; LANES];
/// One number in 32 bits per particle: displacements, not positions.
pub type Narrow = [f32; LANES];

/// A number of each lane. `map` of arrays calls a function per lane here, and costs a sixth of a plain walk.
#[inline(always)]
pub fn each(of: &Lane, value: impl Fn(f64) -> f64) -> Lane {
    let mut values = [0.0; LANES];
    for (to, &from) in values.iter_mut().zip(of) {
        *to = value(from);
    }
    values
}

/// A group of particles on their way. Lanes from `n` on hold copies of the first particle that nobody reads.
#[derive(Debug, Clone)]
pub struct Lanes<const D: usize> {
    pub n: usize,
    pub ids: [u64; LANES],
    /// m
    pub positions: [Lane; D],
    /// One bit per lane that has left.
    pub gone: u64,
}

impl<const D: usize> Lanes<D> {
    pub fn new() -> Self {
        Self { n: 0, ids: [0; LANES], positions: [[0.0; LANES]; D], gone: 0 }
    }

    /// Takes up to 64 particles.
    pub fn load(&mut self, ids: &[u64], positions: [&[f64]; D]) {
        self.n = ids.len().min(LANES);
        self.gone = 0;
        fill(&mut self.ids, ids);
        for (lane, positions) in self.positions.iter_mut().zip(positions) {
            fill(lane, positions);
        }
    }

    /// One bit per lane that holds a particle.
    pub fn occupied(&self) -> u64 {
        if self.n >= LANES { u64::MAX } else { (1 << self.n) - 1 }
    }
}

impl<const D: usize> Default for Lanes<D> {
    fn default() -> Self {
        Self::new()
    }
}

fn fill<T: Copy>(lane: &mut [T; LANES], values: &[T]) {
    let n = values.len().min(LANES);
    lane[..n].copy_from_slice(&values[..n]);
    if let Some(&first) = values.first() {
        lane[n..].fill(first);
    }
}

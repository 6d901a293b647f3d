//! Random streams: one key per purpose, one stream per block of particles, one place per step.
//!
//! Owns the derivation of keys and the numbering of draws. May use `maths`. It deliberately has no
//! state: leaving out a purpose, a step or a block shifts no other draw.

use crate::maths::chacha::{self, DRAW, Words};
use crate::maths::normal::{self, uniform_53};
use crate::maths::wide::Width;
use pulp::NullaryFnOnce;

/// What a draw is for. Each purpose has its own key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    Placement,
    Walk,
    /// Positions at times between two steps.
    Bridge,
}

/// The generator of one purpose under one root seed.
#[derive(Debug, Clone)]
pub struct Stream {
    key: [u32; 8],
}

impl Stream {
    /// The key is BLAKE3 of the seed and the purpose.
    pub fn new(seed: u64, purpose: Purpose) -> Self {
        let name = match purpose {
            Purpose::Placement => "placement",
            Purpose::Walk => "walk",
            Purpose::Bridge => "bridge",
        };
        let mut hasher = blake3::Hasher::new();
        hasher.update(b"lamella random stream 1\0");
        hasher.update(&seed.to_le_bytes());
        hasher.update(name.as_bytes());
        let mut key = [0; 8];
        let hash = hasher.finalize();
        for (word, bytes) in key.iter_mut().zip(hash.as_bytes().as_chunks::<4>().0) {
            *word = u32::from_le_bytes(*bytes);
        }
        Self { key }
    }

    /// Words of draw `number` of block `block_idx`.
    pub fn words(&self, width: Width, block_idx: u64, number: u64, words: &mut Words) {
        width.run(Draw { key: &self.key, block_idx, number, words });
    }

    /// Normal numbers in 32-bit arithmetic from draw `number`.
    pub fn single_normals(&self, width: Width, block_idx: u64, number: u64, normals: &mut [f64; DRAW]) {
        let mut words = [0; DRAW];
        self.words(width, block_idx, number, &mut words);
        width.run(Single { words: &words, normals });
    }

    /// Normal numbers in 64-bit arithmetic from draws `2·number` and `2·number + 1`.
    pub fn double_normals(&self, width: Width, block_idx: u64, number: u64, normals: &mut [f64; DRAW]) {
        let (mut high, mut low) = ([0; DRAW], [0; DRAW]);
        self.words(width, block_idx, 2 * number, &mut high);
        self.words(width, block_idx, 2 * number + 1, &mut low);
        normal::double(&high, &low, normals);
    }

    /// Uniform numbers in (0, 1) with 53 bits from the two draws `2·number` and `2·number + 1`.
    pub fn uniforms(&self, width: Width, block_idx: u64, number: u64, uniforms: &mut [f64; DRAW]) {
        let (mut high, mut low) = ([0; DRAW], [0; DRAW]);
        self.words(width, block_idx, 2 * number, &mut high);
        self.words(width, block_idx, 2 * number + 1, &mut low);
        for ((uniform, &high), &low) in uniforms.iter_mut().zip(&high).zip(&low) {
            *uniform = uniform_53(high, low);
        }
    }
}

struct Draw<'a> {
    key: &'a [u32; 8],
    block_idx: u64,
    number: u64,
    words: &'a mut Words,
}

impl NullaryFnOnce for Draw<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        chacha::draw(self.key, self.block_idx, self.number, self.words);
    }
}

struct Single<'a> {
    words: &'a Words,
    normals: &'a mut [f64; DRAW],
}

impl NullaryFnOnce for Single<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        normal::single(self.words, self.normals);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn purposes_seeds_and_blocks_differ() {
        let first = |seed, purpose, block_idx| {
            let mut words = [0; DRAW];
            Stream::new(seed, purpose).words(Width::baseline(), block_idx, 0, &mut words);
            words[0]
        };
        let reference = first(42, Purpose::Walk, 0);
        assert_ne!(reference, first(42, Purpose::Bridge, 0));
        assert_ne!(reference, first(43, Purpose::Walk, 0));
        assert_ne!(reference, first(42, Purpose::Walk, 1));
    }

    #[test]
    fn uniforms_stay_inside_the_open_interval() {
        assert!(uniform_53(0, 0) > 0.0);
        assert!(uniform_53(u32::MAX, u32::MAX) < 1.0);
        assert!((uniform_53(1 << 31, 0) - 0.5).abs() < 1e-15);
    }
}

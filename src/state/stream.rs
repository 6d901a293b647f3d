//! Random streams: one key per purpose, one stream per block of particles, one place per step.
//!
//! Owns the derivation of keys and the numbering of draws. May use `maths`. It deliberately has no
//! state: leaving out a purpose, a step or a block shifts no other draw.

use crate::maths::chacha::{self, DRAW, LANES, Words};
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
    /// Walks whose numbers belong to particles.
    Track,
    /// What single particles meet on such a walk.
    Wall,
    /// The same on the way to a time between two steps.
    BridgeWall,
    /// New particles.
    Release,
    /// Random conductivity.
    Conductivity,
    /// When single particles react first in a displacement.
    Wait,
    /// What they become, and all that follows within it.
    Turn,
    /// Both on the way to a time between two steps.
    BridgeWait,
    BridgeTurn,
    /// Walks through planes at which coefficients jump.
    Interface,
    /// The same on the way to a time between two steps.
    BridgeInterface,
    /// What reactions make of particles, and where.
    React,
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
            Purpose::Track => "track",
            Purpose::Wall => "wall",
            Purpose::BridgeWall => "bridge wall",
            Purpose::Release => "release",
            Purpose::Conductivity => "conductivity",
            Purpose::Wait => "wait",
            Purpose::Turn => "turn",
            Purpose::BridgeWait => "bridge wait",
            Purpose::BridgeTurn => "bridge turn",
            Purpose::Interface => "interface",
            Purpose::BridgeInterface => "bridge interface",
            Purpose::React => "react",
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

    /// Sixteen normal numbers for each of 64 particles in 32-bit arithmetic, a row of 64 per number.
    pub fn single_normals_each(
        &self,
        width: Width,
        particles: &[u64; LANES],
        number: u64,
        normals: &mut [f64; DRAW],
    ) {
        let mut words = [0; DRAW];
        width.run(DrawEach { key: &self.key, particles, number, words: &mut words });
        width.run(Single { words: &words, normals });
    }

    /// The same in 64-bit arithmetic, from draws `2·number` and `2·number + 1`.
    pub fn double_normals_each(
        &self,
        width: Width,
        particles: &[u64; LANES],
        number: u64,
        normals: &mut [f64; DRAW],
    ) {
        let (mut high, mut low) = ([0; DRAW], [0; DRAW]);
        width.run(DrawEach { key: &self.key, particles, number: 2 * number, words: &mut high });
        width.run(DrawEach { key: &self.key, particles, number: 2 * number + 1, words: &mut low });
        normal::double(&high, &low, normals);
    }

    /// Eight uniform numbers in (0, 1) with 53 bits for each of 64 particles, a row of 64 per number.
    pub fn uniforms_each(
        &self,
        width: Width,
        particles: &[u64; LANES],
        number: u64,
        uniforms: &mut [[f64; LANES]; 8],
    ) {
        let mut words = [0; DRAW];
        width.run(DrawEach { key: &self.key, particles, number, words: &mut words });
        let (rows, _) = words.as_chunks::<LANES>();
        for (row, pair) in uniforms.iter_mut().zip(rows.as_chunks::<2>().0) {
            for (lane, uniform) in row.iter_mut().enumerate() {
                *uniform = uniform_53(pair[0][lane], pair[1][lane]);
            }
        }
    }

    /// Eight uniform numbers in (0, 1) of one particle.
    pub fn uniforms_of(&self, particle: u64, number: u64) -> [f64; 8] {
        let words = chacha::block(&self.key, number, particle);
        std::array::from_fn(|idx| uniform_53(words[2 * idx], words[2 * idx + 1]))
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

struct DrawEach<'a> {
    key: &'a [u32; 8],
    particles: &'a [u64; LANES],
    number: u64,
    words: &'a mut Words,
}

impl NullaryFnOnce for DrawEach<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        chacha::draw_each(self.key, self.number, self.particles, self.words);
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

    /// The numbers of a particle are its own: they do not change with its neighbours or its lane.
    #[test]
    fn normals_of_a_particle_stay_with_it() {
        let stream = Stream::new(42, Purpose::Track);
        let particles: [u64; LANES] = std::array::from_fn(|lane| 1000 + lane as u64);
        let mut turned = particles;
        turned.reverse();
        for is_double in [false, true] {
            let draw = |particles: &[u64; LANES]| {
                let mut normals = [0.0; DRAW];
                if is_double {
                    stream.double_normals_each(Width::widest(), particles, 7, &mut normals);
                } else {
                    stream.single_normals_each(Width::baseline(), particles, 7, &mut normals);
                }
                normals
            };
            let (straight, reversed) = (draw(&particles), draw(&turned));
            for row in 0..DRAW / LANES {
                for lane in 0..LANES {
                    assert_eq!(straight[row * LANES + lane], reversed[row * LANES + LANES - 1 - lane]);
                }
            }
        }
        let (one, other) = (stream.uniforms_of(5, 3), stream.uniforms_of(6, 3));
        assert!(one.iter().zip(other).all(|(a, b)| *a > 0.0 && *a < 1.0 && *a != b));
    }

    #[test]
    fn uniforms_stay_inside_the_open_interval() {
        assert!(uniform_53(0, 0) > 0.0);
        assert!(uniform_53(u32::MAX, u32::MAX) < 1.0);
        assert!((uniform_53(1 << 31, 0) - 0.5).abs() < 1e-15);
    }
}

//! The floor: the bare loop of one step, written by hand for this one case.
//!
//! Words from `rand_chacha` by `fill_bytes`, Box–Muller in 32-bit lanes, move, reflect, bin, relax
//! towards the bin's mean, sum. No checks, no choices, nothing general.

#![allow(clippy::needless_range_loop)]

use lamella::maths::{normal, wide::Width};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

const CHUNK: usize = 1024;
const BLOCK: usize = 65_536;

/// Copies of the sums, so that neighbours in one bin do not wait for each other.
const LANES: usize = 4;

pub struct Floor {
    x: Vec<f64>,
    w: Vec<f64>,
    means: Vec<f64>,
    sums: Vec<[f64; 2]>,
    n_steps: u64,
}

struct Chunk<'a> {
    x: &'a mut [f64],
    w: &'a mut [f64],
    bytes: &'a [[u8; 4]],
    words: &'a mut [u32; CHUNK],
    normals: &'a mut [f64; CHUNK],
    means: &'a [f64],
    sums: &'a mut [[f64; 2]],
}

impl pulp::NullaryFnOnce for Chunk<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { x, w, bytes, words, normals, means, sums } = self;
        let bytes = &bytes[..x.len()];
        for idx in 0..bytes.len() {
            words[idx] = u32::from_le_bytes(bytes[idx]);
        }
        normal::single(words, normals);
        let (n, scale, last) = (x.len(), means.len() as f64, (means.len() - 1) as f64);
        let mut bins = [0_i32; CHUNK];
        locate(x, scale, last, &mut bins);
        for idx in 0..n {
            let mean = means[bins[idx] as usize];
            w[idx] = mean + (w[idx] - mean) * 0.999;
        }
        for idx in 0..n {
            let moved = (x[idx] + 3e-4 * normals[idx]).abs();
            x[idx] = if moved > 1.0 { 2.0 - moved } else { moved };
        }
        locate(x, scale, last, &mut bins);
        for idx in 0..n {
            let sum = &mut sums[bins[idx] as usize * LANES + idx % LANES];
            sum[0] += 1.0;
            sum[1] += w[idx];
        }
    }
}

/// Bins of positions between 0 and 1: the fastest way to whole numbers, which suits few bins only.
#[inline(always)]
fn locate(x: &[f64], scale: f64, last: f64, bins: &mut [i32; CHUNK]) {
    const SHIFT: f64 = 4_503_599_627_370_496.0;
    for idx in 0..x.len() {
        let along = x[idx] * scale - 0.5;
        let along = if along < last { along } else { last };
        let along = if along > 0.0 { along } else { 0.0 };
        bins[idx] = (along + SHIFT).to_bits() as i32;
    }
}

impl Floor {
    pub fn new(n_particles: usize, n_bins: usize) -> Self {
        let x: Vec<f64> = (0..n_particles).map(|p| (p as f64 + 0.5) / n_particles as f64).collect();
        let w = x.iter().map(|&x| f64::from(u8::from(x < 0.5))).collect();
        Self { x, w, means: vec![0.5; n_bins], sums: vec![[0.0; 2]; n_bins * LANES], n_steps: 0 }
    }

    pub fn step(&mut self, width: Width) {
        let (mut words, mut normals) = ([0; CHUNK], [0.0; CHUNK]);
        let mut bytes = [0; 4 * CHUNK];
        self.sums.fill([0.0; 2]);
        for (block, (x, w)) in self.x.chunks_mut(BLOCK).zip(self.w.chunks_mut(BLOCK)).enumerate() {
            let mut random = ChaCha8Rng::seed_from_u64(1);
            random.set_stream(block as u64);
            random.set_word_pos(u128::from(self.n_steps) * BLOCK as u128);
            for (x, w) in x.chunks_mut(CHUNK).zip(w.chunks_mut(CHUNK)) {
                random.fill_bytes(&mut bytes);
                let (words, normals) = (&mut words, &mut normals);
                width.run(Chunk {
                    x,
                    w,
                    bytes: bytes.as_chunks().0,
                    words,
                    normals,
                    means: &self.means,
                    sums: &mut self.sums,
                });
            }
        }
        for (mean, lanes) in self.means.iter_mut().zip(self.sums.chunks(LANES)) {
            let [count, sum] = lanes.iter().fold([0.0; 2], |all, lane| [all[0] + lane[0], all[1] + lane[1]]);
            *mean = sum / f64::max(count, 1.0);
        }
        self.n_steps += 1;
    }
}

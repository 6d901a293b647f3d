//! The floor: the bare loop of one step, written by hand for this one case.
//!
//! Words from `rand_chacha` by `fill_bytes`, Box–Muller in 32-bit lanes, move, reflect, bin, relax
//! towards the bin's mean, sum. No checks, no choices, nothing general.

use lamella::maths::{normal, wide::Width};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};

const CHUNK: usize = 1024;
const BLOCK: usize = 65_536;

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
    words: &'a [u32; CHUNK],
    normals: &'a mut [f64; CHUNK],
    means: &'a [f64],
    sums: &'a mut [[f64; 2]],
}

impl pulp::NullaryFnOnce for Chunk<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { x, w, words, normals, means, sums } = self;
        normal::single(words, normals);
        let scale = means.len() as f64;
        for ((x, w), noise) in x.iter_mut().zip(w.iter_mut()).zip(normals.iter()) {
            let mean = means[((*x * scale) as i32 as usize).min(means.len() - 1)];
            *w = mean + (*w - mean) * 0.999;
            let moved = (*x + 3e-4 * noise).abs();
            *x = if moved > 1.0 { 2.0 - moved } else { moved };
            let sum = &mut sums[((*x * scale) as i32 as usize).min(means.len() - 1)];
            sum[0] += 1.0;
            sum[1] += *w;
        }
    }
}

impl Floor {
    pub fn new(n_particles: usize, n_bins: usize) -> Self {
        let x: Vec<f64> = (0..n_particles).map(|p| (p as f64 + 0.5) / n_particles as f64).collect();
        let w = x.iter().map(|&x| f64::from(u8::from(x < 0.5))).collect();
        Self { x, w, means: vec![0.5; n_bins], sums: vec![[0.0; 2]; n_bins], n_steps: 0 }
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
                for (word, bytes) in words.iter_mut().zip(bytes.as_chunks::<4>().0) {
                    *word = u32::from_le_bytes(*bytes);
                }
                let (words, normals) = (&words, &mut normals);
                width.run(Chunk { x, w, words, normals, means: &self.means, sums: &mut self.sums });
            }
        }
        for (mean, sum) in self.means.iter_mut().zip(&self.sums) {
            *mean = sum[1] / sum[0].max(1.0);
        }
        self.n_steps += 1;
    }
}

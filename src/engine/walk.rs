//! Advection and dispersion of one step.
//!
//! Owns the move of positions. May use `maths`, `state` and the plan's words. It deliberately knows no
//! sides.

use crate::maths::chacha::DRAW;
use crate::maths::wide::Width;
use crate::plan::{Normals, Walk};
use crate::state::particles::{CHUNK, CHUNKS_PER_BLOCK};
use crate::state::stream::Stream;

/// Standard normal numbers of one chunk, per axis.
pub type Noise<const D: usize> = [[f64; CHUNK]; D];

/// Where in its stream a chunk of a step draws.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    pub block_idx: u64,
    pub chunk_idx: u64,
    pub step: u64,
}

/// `X ← X + drift·Δt + B ξ √Δt`.
#[derive(Debug, Clone, PartialEq)]
pub struct Mover<const D: usize> {
    drift: [f64; D],
    /// Lower triangle of B.
    spread: [[f64; D]; D],
    normals: Normals,
    /// Whether a draw is the normalised sum of two, those of half steps.
    pub takes_half_draws: bool,
}

impl<const D: usize> Mover<D> {
    /// `None` if the walk has not one drift per axis and one entry per place of the triangle.
    pub fn new(walk: &Walk) -> Option<Self> {
        let is_sound = walk.drift.len() == D && walk.spread.len() == D * (D + 1) / 2;
        if !is_sound || walk.drift.iter().chain(&walk.spread).any(|value| !value.is_finite()) {
            return None;
        }
        let mut spread = [[0.0; D]; D];
        for row in 0..D {
            spread[row][..=row].copy_from_slice(&walk.spread[row * (row + 1) / 2..][..=row]);
        }
        let drift = std::array::from_fn(|axis| walk.drift[axis]);
        Some(Self { drift, spread, normals: walk.normals, takes_half_draws: false })
    }

    /// Whether anything moves.
    pub fn is_moving(&self) -> bool {
        self.drift.iter().chain(self.spread.iter().flatten()).any(|&value| value != 0.0)
    }

    /// Constants of a move by `drift·time + B ξ·root`; a step of length `Δt` has `time = Δt` and
    /// `root = √Δt`.
    pub fn leap(&self, time: f64, root: f64) -> Leap<D> {
        Leap { drift: self.drift.map(|v| v * time), spread: self.spread.map(|row| row.map(|b| b * root)) }
    }

    /// Draws the noise of one chunk for the axes that have any. The place of a draw follows from block,
    /// chunk and step alone.
    pub fn draw(&self, width: Width, stream: &Stream, place: Place, noise: &mut Noise<D>) {
        if self.takes_half_draws {
            let mut second = [[0.0; CHUNK]; D];
            self.draw_once(width, stream, Place { step: 2 * place.step, ..place }, noise);
            self.draw_once(width, stream, Place { step: 2 * place.step + 1, ..place }, &mut second);
            for (first, second) in noise.iter_mut().flatten().zip(second.iter().flatten()) {
                *first = std::f64::consts::FRAC_1_SQRT_2 * (*first + second);
            }
            return;
        }
        self.draw_once(width, stream, place, noise);
    }

    /// The noise of one draw, whatever draws a step takes.
    pub fn draw_once(&self, width: Width, stream: &Stream, place: Place, noise: &mut Noise<D>) {
        let first = (place.step * CHUNKS_PER_BLOCK as u64 + place.chunk_idx) * D as u64;
        for (axis, noise) in noise.iter_mut().enumerate() {
            let number = first + axis as u64;
            if self.spread.iter().all(|row| row[axis] == 0.0) {
                noise.fill(0.0);
                continue;
            }
            match self.normals {
                Normals::Single => stream.single_normals(width, place.block_idx, number, noise),
                Normals::Double => stream.double_normals(width, place.block_idx, number, noise),
            }
        }
    }
}

/// The constants of one step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leap<const D: usize> {
    drift: [f64; D],
    spread: [[f64; D]; D],
}

impl<const D: usize> Leap<D> {
    /// Itô–Euler step of a chunk.
    ///
    /// - Equation: `X ← X + A Δt + B ξ √Δt`, `B Bᵀ = 2 D`.
    /// - Symbols: `A` drift, `B` lower triangle, `ξ` standard normal numbers.
    /// - Range: any step; exact in law for constant coefficients.
    /// - Source: Kloeden and Platen (1992), the Euler–Maruyama scheme.
    /// - Shape: one loop per axis.
    #[inline(always)]
    pub fn apply(&self, positions: &mut [&mut [f64]; D], noise: &Noise<D>) {
        for (axis, x) in positions.iter_mut().enumerate() {
            let (drift, spread) = (self.drift[axis], &self.spread[axis]);
            match axis {
                0 => {
                    for (x, n0) in x.iter_mut().zip(&noise[0]) {
                        *x += drift + spread[0] * n0;
                    }
                }
                1 => {
                    for ((x, n0), n1) in x.iter_mut().zip(&noise[0]).zip(&noise[1]) {
                        *x += drift + (spread[0] * n0 + spread[1] * n1);
                    }
                }
                _ => {
                    for (((x, n0), n1), n2) in x.iter_mut().zip(&noise[0]).zip(&noise[1]).zip(&noise[2]) {
                        *x += drift + (spread[0] * n0 + spread[1] * n1 + spread[2] * n2);
                    }
                }
            }
        }
    }
}

const _: () = assert!(CHUNK == DRAW);

//! What particles weigh.
//!
//! Owns the table of masses by where a particle comes from and what it is now. May use releases and the plan. It
//! deliberately keeps nothing of a single particle: its number and its population say it all.

use super::flock;
use super::release::Release;
use crate::plan::transport::Decay;

/// Masses of particles, mol or kg.
///
/// - Equation: `m = u w_b / w_a`.
/// - Symbols: `u` mass of a particle as it came in, as population `a`; `b` what it is now; `w` weights of the plan.
/// - Range: 1 for `w` where nothing reacts.
/// - Source: a reaction makes one particle of one; yields are in what it weighs.
/// - Shape: one number per population and origin.
#[derive(Debug, Clone, PartialEq)]
pub struct Units {
    masses: Vec<f64>,
    n_origins: usize,
}

impl Units {
    pub fn new<const D: usize>(releases: &[Release<D>], n_populations: usize, decay: Option<&Decay>) -> Self {
        let factor = |from: usize, to: usize| match decay {
            Some(decay) if from != to => decay.weights[to] / decay.weights[from],
            _ => 1.0,
        };
        let of = |to: usize| releases.iter().map(move |it| it.unit * factor(it.population, to));
        Self { masses: (0..n_populations).flat_map(of).collect(), n_origins: releases.len() }
    }

    pub fn n_origins(&self) -> usize {
        self.n_origins
    }

    /// Masses in a population, by origin.
    pub fn row(&self, population: usize) -> &[f64] {
        &self.masses[population * self.n_origins..][..self.n_origins]
    }

    /// Mass of a particle.
    pub fn of(&self, population: usize, id: u64) -> f64 {
        self.masses[population * self.n_origins + flock::origin(id)]
    }

    /// Mass of so many particles of each origin.
    pub fn sum(&self, population: usize, counts: impl Iterator<Item = f64>) -> f64 {
        counts.zip(self.row(population)).map(|(n, unit)| n * unit).sum()
    }

    pub fn largest(&self) -> f64 {
        self.masses.iter().fold(0.0, |a: f64, &b| a.max(b))
    }
}

//! Particles that reactions make.
//!
//! Owns where they begin, and what is too little for one yet. May use flocks and streams. It deliberately knows no chemistry.

use super::super::super::density::Lattice;
use super::super::flock::{self, Flock};
use crate::state::stream::Stream;

/// More of a population than this, in numbers of particles that it was to have, are not made: they become heavier.
const MOST_OF_COUNT: f64 = 2.0;

/// What makes particles of one population.
#[derive(Debug, Clone)]
pub struct Maker {
    pub population: usize,
    pub origin: usize,
    /// Mass of a particle, and how many there were to be.
    pub unit: f64,
    pub count: f64,
    pub n_made: u64,
    /// Made, but too little for a particle.
    pub pending: f64,
}

/// What was made in a step: cells, rising, and the mass in each.
#[derive(Default)]
pub struct Gains {
    pub cells: Vec<u32>,
    pub masses: Vec<f64>,
}

impl Maker {
    /// Makes particles of what a step has made and of what was left before.
    ///
    /// - Equation: particles at cumulated mass `s + (u − r) + j u` round the cells, `r ← r + G − n u`.
    /// - Symbols: `G` mass made, `s` a uniform part of it, `u` mass of a particle, `r` what was left.
    /// - Range: `n = ⌊(r + G)/u⌋` particles, each anywhere in its cell.
    /// - Source: systematic sampling (W. G. Cochran 1977, Sampling Techniques, chapter 8): each place has its share on average,
    ///   and mass is kept to the last digit.
    /// - Shape: one population.
    pub fn make<const D: usize>(
        &mut self,
        gains: &Gains,
        inside: f64,
        (lattice, low): (&Lattice, &[f64; D]),
        (stream, turn): (&Stream, u64),
        flocks: &mut Vec<Flock<D>>,
    ) {
        let whole: f64 = gains.masses.iter().sum();
        if whole.is_nan() || whole <= 0.0 {
            return;
        }
        let all = inside + self.pending + whole;
        let unit = self.unit.max(all / (MOST_OF_COUNT * self.count));
        let n = ((self.pending + whole) / unit).floor();
        let first = unit - self.pending.min(unit);
        self.pending += whole - n * unit;
        if n < 1.0 {
            return;
        }
        let offset = stream.uniforms_of(flock::id(self.origin, turn), 1)[0] * whole;
        let place = |j: u64| (offset + first + j as f64 * unit) % whole;
        let mut places: Vec<f64> = (0..n as u64).map(place).collect();
        places.sort_unstable_by(f64::total_cmp);
        let (mut at, mut before) = (0, 0.0);
        for place in places {
            while at + 1 < gains.cells.len() && before + gains.masses[at] <= place {
                before += gains.masses[at];
                at += 1;
            }
            let id = flock::id(self.origin, self.n_made);
            self.n_made += 1;
            let uniforms = stream.uniforms_of(id, 0);
            let cell = lattice.cell(gains.cells[at] as usize);
            let first = lattice.axes().start;
            let position = std::array::from_fn(|axis| {
                let edge = lattice.edge[first + axis];
                low[axis] + (cell[first + axis] as f64 + uniforms[axis]) * edge
            });
            flock::add_weighed(flocks, self.population, (id, position, Some(unit)));
        }
    }
}

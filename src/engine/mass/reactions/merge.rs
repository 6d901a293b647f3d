//! Particles that have become too light.
//!
//! Owns which of two takes the other's mass, and what is gone. May use flocks and streams. It deliberately moves nothing: the
//! one that stays is where it was.

use super::super::flock::Flock;
use super::census::OUTSIDE;
use crate::state::stream::Stream;

/// Parts of a unit below which a particle joins another one of its cell, and below which it is gone.
const LIGHT: f64 = 1.0 / 16.0;
const NOTHING: f64 = 1e-12;

/// Joins light particles of a cell, two by two, and takes out what has no mass; returns the mass that is gone.
///
/// - Equation: `m ← m_1 + m_2`, at `x_1` with chance `m_1/m`, else at `x_2`.
/// - Symbols: `m` masses, `x` places of two particles of a cell.
/// - Range: particles below a sixteenth of a unit.
/// - Source: roulette of weights: mass is kept, and the mean of any moment.
/// - Shape: one population; `places` are the cells of its particles, by flock.
pub fn merge<const D: usize>(
    flocks: &mut [&mut Flock<D>],
    places: &[Vec<u32>],
    unit: f64,
    (stream, turn): (&Stream, u64),
) -> f64 {
    let mut light: Vec<(u32, usize, usize)> = Vec::new();
    let mut gone = 0.0;
    let mut is_changed = false;
    for (number, (flock, places)) in flocks.iter_mut().zip(places).enumerate() {
        for (idx, &cell) in places.iter().enumerate() {
            let mass = flock.masses[idx];
            if mass >= LIGHT * unit {
                continue;
            }
            if mass < NOTHING * unit {
                gone += mass;
                flock.masses[idx] = 0.0;
                is_changed = true;
            } else if cell != OUTSIDE {
                light.push((cell, number, idx));
            }
        }
    }
    light.sort_unstable();
    for of_cell in light.chunk_by(|one, other| one.0 == other.0) {
        // One that others join until it is heavy enough.
        let mut open: Option<(usize, usize)> = None;
        for &(_, other, at) in of_cell {
            let Some((own, idx)) = open else {
                open = Some((other, at));
                continue;
            };
            is_changed = true;
            let (mass, more) = (flocks[own].masses[idx], flocks[other].masses[at]);
            let stays = stream.uniforms_of(flocks[own].ids[idx], 2 + turn)[0] * (mass + more) < mass;
            let (to, from) = if stays { ((own, idx), (other, at)) } else { ((other, at), (own, idx)) };
            flocks[from.0].masses[from.1] = 0.0;
            flocks[to.0].masses[to.1] = mass + more;
            open = Some(to).filter(|_| mass + more < LIGHT * unit);
        }
    }
    if is_changed {
        flocks.iter_mut().for_each(|flock| compact(*flock));
    }
    gone
}

/// Takes out what has no mass; flocks without masses stay as they are.
pub fn compact<const D: usize>(flock: &mut Flock<D>) {
    let mut kept = 0;
    for idx in 0..flock.len() {
        if flock.masses[idx] > 0.0 {
            flock.keep(kept, idx);
            kept += 1;
        }
    }
    flock.truncate(kept);
}

//! The reaction of what particles carry, chunk by chunk.
//!
//! Owns the way from stored zones to concentrations and back, what lives in bins, and the budget of what
//! reactions add. May use `chemistry`, `state` and the means. It deliberately knows no rate law.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::average::Means;
use super::mix;
use super::observe::lane_sum;
use super::program::{Program, Term, total};
use crate::chemistry::{Batch, Failure, Reactor, Reversal, Scratch, Work as Labour};
use crate::state::particles::CHUNK;

/// A time over which particles react.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// Where it begins, s.
    pub t: f64,
    /// s
    pub dt: f64,
}

/// What reactions added to a component: over all particles, in units of concentration.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Added {
    pub sum: f64,
    /// Σ|change|
    pub size: f64,
}

impl Added {
    pub fn add(&mut self, other: Self) {
        self.sum += other.sum;
        self.size += other.size;
    }
}

/// What one thread needs to let a chunk react.
#[derive(Default)]
pub struct Bench {
    /// Per component the concentration in the particle as a whole.
    values: Vec<[f64; CHUNK]>,
    before: Vec<[f64; CHUNK]>,
    mixed: Vec<[f64; CHUNK]>,
    chemistry: Scratch,
    /// Per column, before a reaction.
    sums: Vec<f64>,
    /// Of all chunks of a group.
    pub added: Vec<Added>,
    pub labour: Labour,
}

impl Bench {
    pub fn clear<const D: usize>(&mut self, program: &Program<D>) {
        let n_components = program.plan.components.len();
        for columns in [&mut self.values, &mut self.before] {
            columns.resize(n_components, [0.0; CHUNK]);
        }
        self.mixed.resize(program.n_components(), [0.0; CHUNK]);
        self.added.clear();
        self.added.resize(n_components, Added::default());
        self.labour = Labour::default();
    }
}

/// What is the same for all chunks of a pass.
pub struct Reaction<'a, const D: usize> {
    pub program: &'a Program<'a, D>,
    pub reactor: &'a Reactor,
    pub reversal: Option<&'a Reversal>,
    /// Over which the particles react, one after the other.
    pub spans: &'a [Span],
    pub means: &'a Means,
    /// Per immobile component and slot, the concentration in the fluid of the bin.
    pub immobile: &'a [Vec<f64>],
}

/// A chunk: where its particles are and what they carry.
pub struct Chunk<'a, const D: usize> {
    pub n: usize,
    pub positions: [&'a [f64]; D],
    pub slots: &'a [i32],
    pub columns: &'a mut [&'a mut [f64]],
    pub memory: &'a mut [f32],
}

impl<const D: usize> Reaction<'_, D> {
    /// Lets the particles of a chunk react. What happens to what lives in bins is summed into `sums`, per
    /// slot one number for each immobile component.
    ///
    /// - Equation: `U = Σ_i η_i W_i`; `U → U'` by the laws; `W_i ← W_i + (U' − U)`.
    /// - Symbols: `W_i` the value of zone `i`, `η_i` its fraction, ū for an instant zone.
    /// - Range: any `U`, with what [`Reversal`] makes of one below zero; a zone may be below zero though the
    ///   particle is not.
    /// - Source: Sole-Mari et al. (2020): the same reaction in every zone; methods, sections 7.1 and 7.2.
    /// - Shape: columns of one chunk.
    pub fn react(&self, chunk: Chunk<'_, D>, bench: &mut Bench, sums: &mut [f64]) -> Result<(), Failure> {
        let Chunk { n, positions, slots, columns, memory } = chunk;
        if self.is_single() {
            return self.react_in_place(n, positions, columns, memory, bench);
        }
        self.gather(slots, columns, bench, n);
        for (before, values) in bench.before.iter_mut().zip(&bench.values) {
            before[..n].copy_from_slice(&values[..n]);
        }
        if let Some(reversal) = self.reversal {
            reversal.apply(&mut bench.values, n);
            reversal.carry(&mut bench.values, &mut bench.before, n);
        }
        let places = self.places(positions);
        let mut values: Vec<&mut [f64]> = bench.values.iter_mut().map(|column| &mut column[..n]).collect();
        for span in self.spans {
            let mut components: Vec<&mut [f64]> = values.iter_mut().map(|column| &mut **column).collect();
            let labour = self.reactor.react(
                Batch {
                    positions: places,
                    t: span.t,
                    dt: span.dt,
                    components: &mut components,
                    memory: &mut *memory,
                },
                &mut bench.chemistry,
            )?;
            add_work(&mut bench.labour, &labour);
        }
        drop(values);
        self.scatter(slots, columns, bench, n);
        self.leave(slots, bench, sums, n);
        Ok(())
    }

    /// Whether what is stored is what reacts: no zones, and nothing in bins.
    fn is_single(&self) -> bool {
        let stores_one = self.program.roles.len() == 1;
        stores_one
            && self.immobile.is_empty()
            && matches!(self.program.terms[..], [Term::Column { fraction: 1.0, .. }])
    }

    /// Positions along x, y, z; nothing along axes that were left out.
    fn places<'p>(&self, positions: [&'p [f64]; D]) -> [&'p [f64]; 3] {
        let mut places: [&[f64]; 3] = [&[]; 3];
        for (axis, positions) in self.program.plan.axes.iter().zip(positions) {
            places[axis.index] = positions;
        }
        places
    }

    /// The same where nothing has to be gathered. The budget is that of the chunk's sums.
    fn react_in_place(
        &self,
        n: usize,
        positions: [&[f64]; D],
        columns: &mut [&mut [f64]],
        memory: &mut [f32],
        bench: &mut Bench,
    ) -> Result<(), Failure> {
        let positions = self.places(positions);
        bench.sums.clear();
        bench.sums.extend(columns.iter().map(|column| lane_sum(&column[..n])));
        for span in self.spans {
            let mut components: Vec<&mut [f64]> = columns.iter_mut().map(|column| &mut **column).collect();
            let batch = Batch {
                positions,
                t: span.t,
                dt: span.dt,
                components: &mut components,
                memory: &mut *memory,
            };
            let labour = self.reactor.react(batch, &mut bench.chemistry)?;
            add_work(&mut bench.labour, &labour);
        }
        for ((added, before), column) in bench.added.iter_mut().zip(&bench.sums).zip(&*columns) {
            let sum = lane_sum(&column[..n]) - before;
            added.add(Added { sum, size: sum.abs() });
        }
        Ok(())
    }

    /// The concentration in each particle as a whole, and what lives in its bin.
    fn gather(&self, slots: &[i32], columns: &[&mut [f64]], bench: &mut Bench, n: usize) {
        let program = self.program;
        let n_slots = program.roles.len();
        let sees_mean = program.terms.iter().any(|term| matches!(term, Term::Mean { .. }));
        for component in 0..program.n_components() {
            let own = &columns[component * n_slots..][..n_slots];
            if sees_mean {
                let target = &mut bench.mixed[component];
                // Outside the bins a particle is its own mean.
                mix::gather(program, &self.means.mixed[component], slots, own[0], target);
            }
            let mixed = &bench.mixed[component][..n];
            total(&program.terms, own, mixed, &mut bench.values[component][..n]);
        }
        let counts = &self.means.counts;
        for (values, bins) in bench.values[program.n_components()..].iter_mut().zip(self.immobile) {
            for idx in 0..n {
                let slot = slots[idx] as usize;
                values[idx] =
                    if counts[slot] > 0.0 { bins[slot] * self.share(slot, counts[slot]) } else { 0.0 };
            }
        }
    }

    /// Fluid of a bin against that of the particles in it: what lives in the bin is shared out among them.
    fn share(&self, bin: usize, n_particles: f64) -> f64 {
        self.program.expected(bin) / n_particles
    }

    /// Adds what the reaction changed to every zone.
    fn scatter(&self, slots: &[i32], columns: &mut [&mut [f64]], bench: &mut Bench, n: usize) {
        let program = self.program;
        let n_slots = program.roles.len();
        let n_bins = program.grid.n_bins() as i32;
        for component in 0..program.n_components() {
            let (after, before) = (&mut bench.values[component][..n], &bench.before[component][..n]);
            if !self.immobile.is_empty() && program.grid.has_open_side() {
                // What is outside of the bins has nothing to react with.
                for idx in 0..n {
                    after[idx] = if slots[idx] < n_bins { after[idx] } else { before[idx] };
                }
            }
            let mut added = Added::default();
            for idx in 0..n {
                let change = after[idx] - before[idx];
                added.sum += change;
                added.size += change.abs();
            }
            bench.added[component].add(added);
            let own = &mut columns[component * n_slots..][..n_slots];
            for column in own {
                for idx in 0..n {
                    column[idx] += after[idx] - before[idx];
                }
            }
        }
    }

    /// Sums what becomes of the bins.
    fn leave(&self, slots: &[i32], bench: &mut Bench, sums: &mut [f64], n: usize) {
        let first = self.program.n_components();
        let n_immobile = self.immobile.len();
        let n_bins = self.program.grid.n_bins();
        let (before, after) = (&bench.before[first..], &bench.values[first..]);
        for j in 0..n_immobile {
            let mut added = Added::default();
            for idx in (0..n).filter(|&idx| (slots[idx] as usize) < n_bins) {
                let change = after[j][idx] - before[j][idx];
                sums[slots[idx] as usize * n_immobile + j] += change;
                added.sum += change;
                added.size += change.abs();
            }
            bench.added[first + j].add(added);
        }
    }
}

pub fn add_work(sum: &mut Labour, part: &Labour) {
    sum.steps += part.steps;
    sum.rejected += part.rejected;
    sum.rates += part.rates;
    sum.factored += part.factored;
}

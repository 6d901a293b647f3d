//! A chunk of particles as it is at the observed instant, in scratch memory.
//!
//! Owns the view of a state that is not disturbed by being looked at. May use the stages and `state`.
//! It deliberately writes to no particle.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::super::average::Means;
use super::super::mix;
use super::super::program::{Program, Role, total};
use super::super::run::Run;
use super::super::step::Scratch;
use super::super::walk::{Leap, Noise, Place};
use super::chemistry::{self, Needs};
use crate::maths::wide::Width;
use crate::state::particles::{Block, CHUNK};
use crate::state::stream::Stream;
use std::ops::Range;

/// Which instant is looked at.
pub enum Instant<const D: usize> {
    /// The state after the steps done so far.
    Now,
    /// Within the next step.
    Between(Between<D>),
}

/// A point of the next step, reached by a Brownian bridge.
pub struct Between<const D: usize> {
    /// Number of a draw and a leap that come first: the half step that is over, if draws are of half
    /// steps.
    before: Option<(u64, Leap<D>)>,
    /// Number of the draw that `along` follows.
    step: u64,
    /// Number of the bridge's draws, from the bits of the time: other outputs do not shift it.
    bridge: u64,
    along: Leap<D>,
    across: Leap<D>,
    pub decays: Vec<Option<f64>>,
}

impl<const D: usize> Instant<D> {
    /// Particles that are looked at together: little enough for the first-level cache, but whole
    /// chunks where random numbers are drawn.
    pub fn portion(&self) -> usize {
        match self {
            Self::Now => CHUNK / 4,
            Self::Between(_) => CHUNK,
        }
    }

    /// The instant `fraction` of the way into step `step` of length `dt`.
    pub fn between(program: &Program<D>, step: u64, fraction: f64, t: f64, dt: f64) -> Self {
        let mover = &program.mover;
        let decays = program.decays(fraction * dt);
        let (mut before, mut step, mut fraction, mut dt) = (None, step, fraction, dt);
        if mover.takes_half_draws {
            (step, fraction, dt) = (2 * step, 2.0 * fraction, 0.5 * dt);
            if fraction >= 1.0 {
                before = Some((step, mover.leap(dt, dt.sqrt())));
                (step, fraction) = (step + 1, fraction - 1.0);
            }
        }
        Self::Between(Between {
            before,
            step,
            bridge: t.to_bits() >> 12,
            along: mover.leap(fraction * dt, fraction * dt.sqrt()),
            across: mover.leap(0.0, (fraction * (1.0 - fraction) * dt).sqrt()),
            decays,
        })
    }
}

impl<const D: usize> Between<D> {
    /// Takes positions to the instant.
    #[inline(always)]
    fn place(
        &self,
        program: &Program<D>,
        draws: &Draws,
        at: (u64, u64),
        positions: &mut [&mut [f64]; D],
        noise: &mut Noise<D>,
    ) {
        let place = |step| Place { block_idx: at.0, chunk_idx: at.1, step };
        if let Some((step, leap)) = &self.before {
            program.mover.draw_once(draws.width, draws.walk, place(*step), noise);
            leap.apply(positions, noise);
        }
        program.mover.draw_once(draws.width, draws.walk, place(self.step), noise);
        self.along.apply(positions, noise);
        program.mover.draw_once(draws.width, draws.bridge, place(self.bridge), noise);
        self.across.apply(positions, noise);
        for (rule, positions) in program.rules.iter().zip(positions) {
            // A position that is not finite stops the step itself.
            let _ = rule.apply(positions);
        }
    }

    /// Takes the particles of a block to the instant.
    pub fn carry(&self, program: &Program<D>, draws: &Draws, block: &mut Block<D>) {
        let mut noise = [[0.0; CHUNK]; D];
        for (chunk_idx, range) in block.chunks().enumerate() {
            let mut positions = block.positions.each_mut().map(|axis| &mut axis[range.clone()]);
            self.place(program, draws, (block.idx, chunk_idx as u64), &mut positions, &mut noise);
        }
    }
}

/// Where random numbers come from.
pub struct Draws<'a> {
    pub width: Width,
    pub walk: &'a Stream,
    pub bridge: &'a Stream,
}

/// Positions, bins and values of one chunk at the instant.
pub struct Lab<const D: usize> {
    pub n: usize,
    pub positions: [[f64; CHUNK]; D],
    /// Bins of the averages.
    pub slots: [i32; CHUNK],
    /// Carried columns.
    pub columns: Vec<Vec<f64>>,
    /// Per component `Σ η_i W_i / Σ η_i` over the simulated zones: what bin means are made of.
    pub simulated: Vec<[f64; CHUNK]>,
    /// Per component ū as the particle sees it.
    pub mixed: Vec<[f64; CHUNK]>,
    /// Per component what it is made of, without the mean of it that the particle sees.
    pub gaps: Vec<[f64; CHUNK]>,
    /// Whether `mixed` holds the means of this instant already.
    is_mixed_known: bool,
    /// Per component U.
    pub components: Vec<[f64; CHUNK]>,
    /// Per species, as if nothing had reacted, and as it is.
    pub unreacted: Vec<[f64; CHUNK]>,
    pub species: Vec<[f64; CHUNK]>,
    /// Per species and component the slope of the reacted concentration by U.
    pub slopes: Vec<[f64; CHUNK]>,
    /// Numbers of the particles.
    pub numbers: Vec<u64>,
    /// Per species, where some are in equilibrium.
    speciated: Vec<[f64; CHUNK]>,
    solver: crate::chemistry::Scratch,
    scratch: Box<Scratch<D>>,
}

impl<const D: usize> Lab<D> {
    pub fn new(program: &Program<D>) -> Box<Self> {
        let n_species = program.plan.species.len();
        let zeros = |n| vec![[0.0; CHUNK]; n];
        Box::new(Self {
            n: 0,
            positions: [[0.0; CHUNK]; D],
            slots: [0; CHUNK],
            columns: vec![vec![0.0; CHUNK]; program.n_columns()],
            simulated: zeros(program.n_components()),
            mixed: zeros(program.n_components()),
            gaps: zeros(program.n_components()),
            is_mixed_known: false,
            components: zeros(program.plan.components.len()),
            unreacted: zeros(n_species),
            species: zeros(n_species),
            slopes: zeros(n_species * program.n_components()),
            numbers: Vec::new(),
            speciated: zeros(if program.has_equilibrium() { n_species } else { 0 }),
            solver: crate::chemistry::Scratch::default(),
            scratch: Scratch::new(),
        })
    }

    #[inline(always)]
    pub fn positions(&self) -> [&[f64]; D] {
        self.positions.each_ref().map(|axis| &axis[..self.n])
    }

    #[inline(always)]
    pub fn slots(&self) -> &[i32] {
        &self.slots[..self.n]
    }
}

/// Fills a lab with one chunk: positions, bins and carried values at the instant, before any mixing
/// within the step that the instant lies in.
#[inline(always)]
pub fn load<const D: usize>(
    run: &Run<D>,
    instant: &Instant<D>,
    block: &Block<D>,
    range: Range<usize>,
    lab: &mut Lab<D>,
) {
    let program = &run.program;
    let n = range.len();
    lab.n = n;
    if run.reactions.speciation.is_some() {
        lab.numbers.clear();
        lab.numbers.extend(range.clone().map(|idx| block.number(idx)));
    }
    for axis in 0..D {
        lab.positions[axis][..n].copy_from_slice(&block.positions[axis][range.clone()]);
    }
    for (target, source) in lab.columns.iter_mut().zip(&block.columns) {
        target.resize(n, 0.0);
        target.copy_from_slice(&source[range.clone()]);
    }
    let mut positions = lab.positions.each_mut().map(|axis| &mut axis[..n]);
    let slots = &mut lab.slots[..n];
    program.grid.locate(positions.each_ref().map(|axis| &**axis), slots);
    lab.is_mixed_known = false;
    if let Some(decays) = &run.pending {
        let mut columns = mix::cut(&mut lab.columns, 0..n);
        // A value out of range is reported by the step itself.
        mix::relax(program, &run.means, decays, slots, &mut columns, &mut lab.mixed, &run.limits);
        lab.is_mixed_known = sees_mean(program);
    }
    if let Instant::Between(between) = instant {
        let chunk_idx = (range.start / CHUNK) as u64;
        let draws = Draws { width: run.width, walk: &run.walk, bridge: &run.bridge };
        between.place(program, &draws, (block.idx, chunk_idx), &mut positions, &mut lab.scratch.noise);
        program.grid.locate(positions.each_ref().map(|axis| &**axis), slots);
        lab.is_mixed_known = false;
    }
}

/// Whether the mean that a relaxation leaves behind is ū: with one simulated zone it is.
#[inline(always)]
fn sees_mean<const D: usize>(program: &Program<D>) -> bool {
    matches!(program.roles[..], [Role::Relaxing(_)])
}

/// From carried values to concentrations, once the means of the instant are known.
#[inline(always)]
pub fn resolve<const D: usize>(
    run: &Run<D>,
    instant: &Instant<D>,
    means: &Means,
    needs: &Needs,
    lab: &mut Lab<D>,
) {
    let (program, n) = (&run.program, lab.n);
    if let Instant::Between(between) = instant {
        let (slots, mut columns) = (&lab.slots[..n], mix::cut(&mut lab.columns, 0..n));
        // A value out of range is reported by the step itself.
        mix::relax(program, means, &between.decays, slots, &mut columns, &mut lab.mixed, &run.limits);
        lab.is_mixed_known = sees_mean(program);
    }
    let n_slots = program.roles.len();
    for component in 0..program.n_components() {
        let columns = &lab.columns[component * n_slots..][..n_slots];
        if needs.simulated {
            weighted(&program.seen_weights, columns, &mut lab.simulated[component][..n]);
        }
        if needs.mixed && !lab.is_mixed_known {
            let own = &lab.simulated[component][..n];
            let target = &mut lab.mixed[component];
            mix::gather(program, &means.mixed[component], &lab.slots[..n], own, target);
        }
        if needs.any() {
            let (mixed, target) = (&lab.mixed[component][..n], &mut lab.components[component][..n]);
            total(&program.terms, columns, mixed, target);
        }
        if needs.slopes {
            let gap = &mut lab.gaps[component][..n];
            match program.mean_slot() {
                None => subtract(&lab.simulated[component][..n], &lab.mixed[component][..n], gap),
                Some(slot) => {
                    let mut values = [0.0; CHUNK];
                    weighted(&program.mean_weights, columns, &mut values[..n]);
                    subtract(&values[..n], &columns[slot][..n], gap);
                }
            }
        }
    }
    for (target, bins) in lab.components[program.n_components()..].iter_mut().zip(&run.reactions.immobile) {
        for idx in 0..n {
            target[idx] = bins[lab.slots[idx] as usize];
        }
    }
    if needs.any()
        && let Some(reversal) = &run.reactions.shown
    {
        reversal.apply(&mut lab.components, n);
    }
    chemistry::speciate(program, needs, n, &lab.components, &mut lab.unreacted, &mut lab.species);
    if needs.any() {
        equilibrate(run, lab);
    }
    if needs.slopes {
        chemistry::slopes(program, needs, n, &lab.unreacted, &mut lab.slopes);
    }
}

/// Concentrations of what is in equilibrium. A failure is kept for the end of the observation.
#[inline(never)] // Rare beside the rest, and a solver of its own.
fn equilibrate<const D: usize>(run: &Run<D>, lab: &mut Lab<D>) {
    let Some(speciation) = &run.reactions.speciation else { return };
    let n = lab.n;
    let components: Vec<&[f64]> = lab.components.iter().map(|column| &column[..n]).collect();
    let mut species: Vec<&mut [f64]> = lab.speciated.iter_mut().map(|column| &mut column[..n]).collect();
    if let Err(failure) = speciation.reactor.speciate(&components, &mut species, &mut lab.solver) {
        speciation.fail(lab.numbers[failure.particle], failure.why);
    }
    for &idx in &speciation.species {
        lab.species[idx][..n].copy_from_slice(&lab.speciated[idx][..n]);
    }
}

#[inline(always)]
fn subtract(a: &[f64], b: &[f64], target: &mut [f64]) {
    for idx in 0..target.len() {
        target[idx] = a[idx] - b[idx];
    }
}

#[inline(always)]
fn weighted(weights: &[(usize, f64)], columns: &[Vec<f64>], target: &mut [f64]) {
    for (rank, &(slot, weight)) in weights.iter().enumerate() {
        let column = &columns[slot][..target.len()];
        for idx in 0..target.len() {
            let value = weight * column[idx];
            target[idx] = if rank == 0 { value } else { target[idx] + value };
        }
    }
}

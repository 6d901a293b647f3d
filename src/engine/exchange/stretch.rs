//! The order of work in a step of parcels that walk.
//!
//! Owns who takes which portions through both sums, and when. May use the operator and sums with notes. It deliberately
//! changes no number: sums have the bits that they have one after the other.
//!
//! A step of parcels that walk has two sums: densities, and differences weighed with them. Every thread takes stretches of
//! portions through both in the order of cells, the second as soon as all that is near has its density, so that few notes are
//! needed at once and whoever made them reads them. What is near an end of a stretch waits until all stretches are done.

use super::super::parallel;
use super::bands::{Noting, Recalling};
use super::near::{Near, PADDING};
use super::notes::{Note, Notes, Sheets};
use super::operator::{OnPortion, Operator, PORTION, Wanted, with_kernel};
use crate::catalog::kernel::Radial;
use crate::plan::exchange::Normalisation;
use std::sync::Arc;

/// Stretches per thread, at most: threads that are slow leave some to others.
const PER_THREAD: usize = 4;

/// A stretch is longer than what waits at its ends, by so much.
const LONGER: f64 = 15.0;

/// Portions side by side.
struct Stretch<'t, 'b> {
    /// The first of them.
    portion: usize,
    notes: &'t mut [Note],
    targets: &'t mut [Vec<&'b mut [f64]>],
    factors: &'t mut [f64],
}

/// How far a stretch has come.
struct Progress {
    /// Portions that have their densities, but wait for those of others, with notes.
    waiting: Vec<usize>,
    /// Sheets of those that wait until all stretches are done.
    n_kept: usize,
    /// Sheets that these may have.
    most_kept: usize,
    /// Sheets of the longest note so far.
    n_sheets: usize,
}

impl<const D: usize> Operator<'_, D> {
    /// As [`Self::differences`], and before them the weights, where [`Self::prepare`] has left them out.
    pub fn first_differences(&mut self, columns: &[Vec<f64>], targets: &mut [Vec<f64>]) {
        if !self.factors.is_empty() {
            return self.differences(columns, targets);
        }
        with_kernel!(self.profile, kernel => self.in_stretches(kernel, columns, targets));
    }

    fn in_stretches<K: Radial + Sync>(&mut self, kernel: K, columns: &[Vec<f64>], targets: &mut [Vec<f64>]) {
        let n = self.crowd.n;
        let n_portions = n.div_ceil(PORTION);
        let mut notes = self.notes.take();
        notes.of.resize_with(n_portions, Note::default);
        let mut portions: Vec<Vec<&mut [f64]>> = (0..n_portions).map(|_| Vec::new()).collect();
        for target in targets {
            portions.iter_mut().zip(target[..n].chunks_mut(PORTION)).for_each(|(own, part)| own.push(part));
        }
        let n_stretches = self.n_stretches(n_portions);
        let length = n_portions.div_ceil(n_stretches).max(1);
        let most_kept = notes.sheets.most() / (2 * n_stretches);
        let mut factors = std::mem::take(&mut self.factors);
        factors.resize(n + PADDING, 0.0);
        let parts = notes.of.chunks_mut(length).zip(portions.chunks_mut(length));
        let mut stretches: Vec<Stretch> = parts
            .zip(factors[..n].chunks_mut(length * PORTION))
            .enumerate()
            .map(|(idx, ((notes, targets), factors))| Stretch {
                portion: idx * length,
                notes,
                targets,
                factors,
            })
            .collect();
        parallel::for_each(&mut stretches, &|_, stretch| {
            self.walk_along(kernel, columns, stretch, (&notes.sheets, most_kept));
        });
        self.factors = factors;
        self.finish(kernel, columns, (&mut notes, &mut portions));
        self.notes = notes;
    }

    /// Few stretches where what waits at their ends is a large part of them.
    fn n_stretches(&self, n_portions: usize) -> usize {
        let n_threads = parallel::n_threads();
        let waits = self.crowd.space.reached_share() * n_portions as f64 + 1.0;
        let most = n_portions as f64 / (n_threads as f64 * LONGER * waits);
        n_threads * (most as usize).clamp(1, PER_THREAD)
    }

    /// The same without any parcel before one.
    fn from(&self, start: usize, factors: Vec<f64>) -> Self {
        Self { start, factors, notes: Notes::new(self.notes.sheets.clone()), caps: Vec::new(), ..*self }
    }

    /// Takes a stretch through both sums.
    fn walk_along<K: Radial + Sync>(
        &self,
        kernel: K,
        columns: &[Vec<f64>],
        stretch: &mut Stretch,
        (store, most_kept): (&Arc<Sheets>, usize),
    ) {
        let n = stretch.factors.len();
        let start = stretch.portion * PORTION;
        let mut own = self.from(start, vec![0.0; n + PADDING]);
        let sheets = Sheets::of_thread(store);
        let mut progress = Progress { waiting: Vec::new(), n_kept: 0, most_kept, n_sheets: 1 };
        let mut densities = [0.0; PORTION];
        self.lists.lend(Near::new, |near| {
            for at in 0..stretch.notes.len() {
                let n_own = PORTION.min(n - at * PORTION);
                let densities = &mut densities[..n_own];
                let note = &mut stretch.notes[at];
                if sheets.n_left() >= progress.n_sheets {
                    note.begin(&sheets);
                }
                own.find_densities(kernel, start + at * PORTION, densities, (near, note, &sheets));
                let factors = &mut own.factors[at * PORTION..at * PORTION + n_own];
                for (factor, density) in factors.iter_mut().zip(&*densities) {
                    *factor = match own.normalisation {
                        Normalisation::Arithmetic => *density,
                        _ => 1.0 / density.sqrt(),
                    };
                }
                progress.wait(at, (start, n), note, &sheets);
                let known = start + at * PORTION + n_own;
                let mut waiting = std::mem::take(&mut progress.waiting);
                waiting.retain(|&at| {
                    let is_ready = stretch.notes[at].span.1 <= known;
                    if is_ready {
                        let targets = &mut std::mem::take(&mut stretch.targets[at]);
                        let first = start + at * PORTION;
                        own.find_differences(kernel, columns, (first, targets), (near, &stretch.notes[at]));
                        stretch.notes[at].forget(&sheets);
                    }
                    !is_ready
                });
                progress.waiting = waiting;
            }
        });
        stretch.factors.copy_from_slice(&own.factors[..n]);
    }

    /// Differences of the portions that have none yet.
    fn finish<K: Radial + Sync>(
        &self,
        kernel: K,
        columns: &[Vec<f64>],
        (notes, portions): (&mut Notes, &mut [Vec<&mut [f64]>]),
    ) {
        let left = portions.iter_mut().enumerate().filter(|(_, targets)| !targets.is_empty());
        let mut left: Vec<(usize, &mut Vec<&mut [f64]>)> = left.collect();
        parallel::for_each(&mut left, &|_, (idx, targets)| {
            let (first, wanted) = (*idx * PORTION, Wanted::Differences(columns));
            self.lists.lend(Near::new, |near| match notes.whole(*idx) {
                Some(note) => self.find_differences(kernel, columns, (first, targets), (near, note)),
                None => self.width.run(OnPortion { operator: self, kernel, wanted, first, targets, near }),
            });
        });
        notes.forget();
    }

    fn find_densities<K: Radial + Sync>(
        &self,
        kernel: K,
        first: usize,
        densities: &mut [f64],
        (near, note, sheets): (&mut Near<D>, &mut Note, &Sheets),
    ) {
        let (operator, notes_forces) = (self, self.is_by_forces());
        self.width.run(Noting { operator, kernel, first, densities, near, note, sheets, notes_forces });
    }

    fn find_differences<K: Radial + Sync>(
        &self,
        kernel: K,
        columns: &[Vec<f64>],
        (first, targets): (usize, &mut [&mut [f64]]),
        (near, note): (&mut Near<D>, &Note),
    ) {
        let (operator, wanted, own_force) = (self, Wanted::Differences(columns), self.own_force(kernel));
        self.width.run(Recalling { operator, wanted, first, targets, near, note, own_force });
    }
}

impl Progress {
    /// A new portion waits, if it has notes. Those that need densities beyond the stretch, or of its far end, of which they see
    /// an image, have a part of the room at most: it would not be free before that.
    fn wait(&mut self, at: usize, (start, n): (usize, usize), note: &mut Note, sheets: &Sheets) {
        if !note.is_whole() {
            return;
        }
        let n_own = note.n_sheets();
        self.n_sheets = self.n_sheets.max(n_own);
        let (from, until) = note.span;
        let is_beyond = from < start || until > start + n;
        let is_far = until > start + at * PORTION + n / 2;
        if !is_beyond && !is_far {
            return self.waiting.push(at);
        }
        if self.n_kept + n_own > self.most_kept {
            return note.forget(sheets);
        }
        self.n_kept += n_own;
        if !is_beyond {
            self.waiting.push(at);
        }
    }
}

//! Sums that note what they find of pairs, and sums that are made of such notes.
//!
//! Owns the choice of what is noted, and the order of work in a step of parcels that walk. May use the operator, neighbours and
//! notes. It deliberately changes no number: sums have the bits that they have without notes.
//!
//! A step of parcels that walk has two sums: densities, and differences weighed with them. Portions are taken through both in
//! the order of cells, the second as soon as all that is near has its density, so that few notes are needed at once.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::super::parallel;
use super::near::{LANES, MOST_TARGETS, Near, PADDING, folded};
use super::notes::{Note, Noted, Notes, Reader, Sheets};
use super::operator::{OnPortion, Operator, PORTION, Wanted, with_kernel};
use crate::catalog::kernel::Radial;
use crate::plan::exchange::{Integration, Normalisation};
use std::ops::Range;

/// Portions per thread that are begun together.
const TOGETHER: usize = 2;

/// Densities of some parcels, noted.
pub struct Noting<'a, 'b, const D: usize, K> {
    pub operator: &'a Operator<'b, D>,
    pub kernel: K,
    pub first: usize,
    pub densities: &'a mut [f64],
    pub near: &'a mut Near<D>,
    pub note: &'a mut Note,
    pub sheets: &'a Sheets,
    pub notes_forces: bool,
}

impl<const D: usize, K: Radial> pulp::NullaryFnOnce for Noting<'_, '_, D, K> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { operator, kernel, first, densities, near, note, sheets, notes_forces } = self;
        let crowd = &operator.crowd;
        let square = crowd.space.radius * crowd.space.radius;
        let n = densities.len();
        let mut lanes = [[0.0; LANES]; MOST_TARGETS];
        let mut at = 0;
        while at < n {
            let n_targets = near.gather_round(crowd, first + at, n - at);
            let until = near.until();
            note.until = if until > note.until { until } else { note.until };
            for lanes in &mut lanes[..n_targets] {
                *lanes = [0.0; LANES];
            }
            while near.fill(crowd, &[]) {
                for target in 0..n_targets {
                    near.find(crowd, first + at + target);
                    let room = if note.is_whole() { note.room(near.n_found(), sheets) } else { None };
                    match room {
                        Some((found, noted)) => {
                            near.weigh_and_note((kernel, square, notes_forces), found, noted);
                        }
                        None => near.weigh(kernel, square),
                    }
                    near.sum(&mut lanes[target]);
                }
            }
            for target in 0..n_targets {
                densities[at + target] = folded(lanes[target]);
            }
            at += n_targets;
        }
    }
}

/// A sum of some parcels, of what is noted of them.
pub struct Recalling<'a, 'b, 'c, const D: usize> {
    pub operator: &'a Operator<'b, D>,
    pub wanted: Wanted<'a>,
    pub first: usize,
    pub targets: &'a mut [&'c mut [f64]],
    pub near: &'a mut Near<D>,
    pub note: &'a Note,
    /// What a parcel exchanges with itself by.
    pub own_force: f64,
}

impl<const D: usize> pulp::NullaryFnOnce for Recalling<'_, '_, '_, D> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let operator = self.operator;
        let n = self.targets.first().map_or(0, |target| target.len());
        let sources = operator.sources(self.wanted);
        let n_sums = self.targets.len();
        let mut lanes = vec![[0.0; LANES]; MOST_TARGETS * n_sums];
        let mut reader = self.note.read();
        let mut at = 0;
        while at < n {
            let first = self.first + at;
            let n_targets = self.near.gather_round(&operator.crowd, first, n - at);
            for lanes in &mut lanes[..n_targets * n_sums] {
                *lanes = [0.0; LANES];
            }
            while self.near.fill_again(&operator.crowd, &sources) {
                for target in 0..n_targets {
                    let lanes = &mut lanes[target * n_sums..(target + 1) * n_sums];
                    self.add(first + target, &mut reader, lanes);
                }
            }
            for target in 0..n_targets {
                for sum in 0..n_sums {
                    self.targets[sum][at + target] = folded(lanes[target * n_sums + sum]);
                }
            }
            operator.leave_out_itself((self.wanted, self.own_force), self.targets, (first, at, n_targets));
            at += n_targets;
        }
    }
}

impl<const D: usize> Recalling<'_, '_, '_, D> {
    /// Adds what the candidates at hand give to the sums of a parcel.
    #[inline(always)]
    fn add(&mut self, idx: usize, reader: &mut Reader, lanes: &mut [[f64; LANES]]) {
        let Self { operator, wanted, ref mut near, .. } = *self;
        let (found, noted) = reader.next();
        if let (Wanted::Differences([column]), true) = (wanted, operator.caps.is_empty()) {
            let (first, rest) = lanes.split_at_mut(1);
            let mut all = [0.0; LANES];
            let all = rest.first_mut().unwrap_or(&mut all);
            let is_mean = operator.normalisation == Normalisation::Arithmetic;
            let own = (is_mean, operator.factors[idx], column[idx]);
            return near.recall_and_differ((found, noted), own, (&mut first[0], all));
        }
        near.recall(found, noted);
        match wanted {
            Wanted::Densities => near.sum(&mut lanes[0]),
            Wanted::Weighted(_) => near.difference(0, 0.0, &mut lanes[0]),
            Wanted::Differences(columns) => operator.differ(near, columns, idx, lanes),
        }
    }
}

/// A portion in one of its two sums.
enum Task<'t, 'b> {
    Densities { idx: usize, densities: &'t mut [f64], note: &'t mut Note },
    Differences { idx: usize, targets: &'t mut [&'b mut [f64]], note: &'t Note },
}

/// How far a step of parcels that walk has come.
struct Progress {
    /// Portions that have their densities.
    n_done: usize,
    /// Those of them that wait for the densities of others, with notes.
    waiting: Vec<usize>,
    /// Sheets of the longest note so far.
    n_sheets: usize,
}

impl<const D: usize> Operator<'_, D> {
    /// What has to be known before a step is: weights, but where they are made along with the first differences, and notes
    /// where they serve more than once.
    pub fn prepare(&mut self, integration: Integration, is_at_rest: bool) {
        let takes_notes = self.notes.are_taken() && self.metrics.is_none();
        if !is_at_rest {
            self.notes.forget();
            self.factors.clear();
            let is_one_sum = integration == Integration::Explicit;
            if takes_notes && is_one_sum && self.normalisation != Normalisation::Sinkhorn {
                return;
            }
            self.weigh();
            if is_one_sum {
                return;
            }
        }
        let is_known = with_kernel!(self.profile, kernel => self.notes.serve(kernel, self.is_by_forces()));
        if takes_notes && !is_known {
            self.notes.forget();
            let mut densities = vec![0.0; self.crowd.n];
            self.note(self.noted(), &mut densities, false);
        }
    }

    /// Sums of weights, which are noted as long as there is room; or no more than are noted.
    pub fn note(&mut self, noted: Noted, densities: &mut [f64], needs_all: bool) {
        let mut notes = self.notes.take();
        notes.noted = noted;
        notes.of.resize_with(self.crowd.n.div_ceil(PORTION), Note::default);
        let portions = densities[..self.crowd.n].chunks_mut(PORTION);
        let mut tasks: Vec<(&mut Note, &mut [f64])> = notes.of.iter_mut().zip(portions).collect();
        let (sheets, notes_forces) = (&*notes.sheets, noted == Noted::Forces);
        with_kernel!(self.profile, kernel => parallel::for_each(&mut tasks, &|idx, (note, densities)| {
            if !needs_all && sheets.n_left() == 0 {
                return;
            }
            note.begin(sheets);
            self.lists.lend(Near::new, |near| {
                let (operator, first) = (self as &Self, idx * PORTION);
                self.width.run(Noting { operator, kernel, first, densities, near, note, sheets, notes_forces });
            });
        }));
        self.notes = notes;
    }

    /// As [`Self::differences`], and before them the weights, where [`Self::prepare`] has left them out.
    pub fn first_differences(&mut self, columns: &[Vec<f64>], targets: &mut [Vec<f64>]) {
        if !self.factors.is_empty() {
            return self.differences(columns, targets);
        }
        with_kernel!(self.profile, kernel => self.in_bands(kernel, columns, targets));
    }

    fn in_bands<K: Radial + Sync>(&mut self, kernel: K, columns: &[Vec<f64>], targets: &mut [Vec<f64>]) {
        let n = self.crowd.n;
        let n_portions = n.div_ceil(PORTION);
        let mut notes = self.notes.take();
        notes.of.resize_with(n_portions, Note::default);
        self.factors.resize(n + PADDING, 0.0);
        let mut portions: Vec<Vec<&mut [f64]>> = (0..n_portions).map(|_| Vec::new()).collect();
        for target in targets {
            portions.iter_mut().zip(target[..n].chunks_mut(PORTION)).for_each(|(own, part)| own.push(part));
        }
        let mut progress = Progress { n_done: 0, waiting: Vec::new(), n_sheets: 1 };
        while progress.n_done < n_portions || !progress.waiting.is_empty() {
            self.go_on(kernel, columns, &mut notes, (&mut portions, &mut progress));
        }
        self.notes = notes;
        // What had no room.
        let left = portions.iter_mut().enumerate().filter(|(_, targets)| !targets.is_empty());
        let mut left: Vec<(usize, &mut Vec<&mut [f64]>)> = left.collect();
        parallel::for_each(&mut left, &|_, (idx, targets)| {
            self.lists.lend(Near::new, |near| {
                let (operator, wanted) = (self as &Self, Wanted::Differences(columns));
                self.width.run(OnPortion { operator, kernel, wanted, first: *idx * PORTION, targets, near });
            });
        });
    }

    /// Densities of the next portions, and differences of those that waited and know all that is near.
    fn go_on<K: Radial + Sync>(
        &mut self,
        kernel: K,
        columns: &[Vec<f64>],
        notes: &mut Notes,
        (portions, progress): (&mut [Vec<&mut [f64]>], &mut Progress),
    ) {
        let (n, n_done) = (self.crowd.n, progress.n_done);
        let n_new = progress.n_next(notes).min(portions.len() - n_done);
        let n_noted = notes.sheets.n_left() / progress.n_sheets;
        let known = (n_done * PORTION).min(n);
        notes.fresh.resize(n_new * PORTION, 0.0);
        let (old, new) = notes.of.split_at_mut(n_done);
        let mut tasks = Vec::with_capacity(n_new + progress.waiting.len());
        for (at, (note, own)) in new.iter_mut().zip(notes.fresh.chunks_mut(PORTION)).enumerate() {
            let idx = n_done + at;
            if at < n_noted {
                note.begin(&notes.sheets);
            }
            tasks.push(Task::Densities { idx, densities: &mut own[..PORTION.min(n - idx * PORTION)], note });
        }
        let is_ready = |idx: usize| old[idx].until <= known;
        let (ready, waiting) = progress.waiting.iter().partition(|&&idx| is_ready(idx));
        let ready: Vec<usize> = ready;
        progress.waiting = waiting;
        let mut targets: Vec<Vec<&mut [f64]>> =
            ready.iter().map(|&idx| std::mem::take(&mut portions[idx])).collect();
        for (&idx, targets) in ready.iter().zip(&mut targets) {
            tasks.push(Task::Differences { idx, targets, note: &old[idx] });
        }
        parallel::for_each(&mut tasks, &|_, task| self.take_on(kernel, columns, task, &notes.sheets));
        ready.iter().for_each(|&idx| notes.of[idx].forget(&notes.sheets));
        let end = ((n_done + n_new) * PORTION).min(n);
        for (factor, density) in self.factors[known..end].iter_mut().zip(&notes.fresh) {
            *factor = match self.normalisation {
                Normalisation::Arithmetic => *density,
                _ => 1.0 / density.sqrt(),
            };
        }
        progress.wait(n_done..n_done + n_new, notes);
    }

    fn take_on<K: Radial + Sync>(&self, kernel: K, columns: &[Vec<f64>], task: &mut Task, sheets: &Sheets) {
        self.lists.lend(Near::new, |near| match task {
            Task::Densities { idx, densities, note } => {
                let (operator, first, notes_forces) = (self, *idx * PORTION, self.is_by_forces());
                self.width.run(Noting {
                    operator,
                    kernel,
                    first,
                    densities,
                    near,
                    note,
                    sheets,
                    notes_forces,
                });
            }
            Task::Differences { idx, targets, note } => {
                let (operator, first, wanted) = (self, *idx * PORTION, Wanted::Differences(columns));
                let own_force = self.own_force(kernel);
                self.width.run(Recalling { operator, wanted, first, targets, near, note, own_force });
            }
        });
    }
}

impl Progress {
    /// Portions to begin together: enough for all threads, but no more than a third of the room is good for.
    fn n_next(&self, notes: &Notes) -> usize {
        let n_threads = parallel::n_threads();
        (notes.sheets.most() / (3 * self.n_sheets)).clamp(n_threads, TOGETHER * n_threads)
    }

    /// New portions wait, if they have notes. Those that need the densities of the far end, of which they see an image, have
    /// half of the room at most: it would not be free before that.
    fn wait(&mut self, new: Range<usize>, notes: &mut Notes) {
        let far = notes.of.len() / 2;
        let is_far = |idx: usize, note: &Note| note.until > (idx + far) * PORTION;
        let of_far = |idx: &usize| if is_far(*idx, &notes.of[*idx]) { notes.of[*idx].n_sheets() } else { 0 };
        let mut n_far: usize = self.waiting.iter().map(of_far).sum();
        for idx in new.clone() {
            let note = &mut notes.of[idx];
            let n_own = note.n_sheets();
            self.n_sheets = self.n_sheets.max(n_own);
            if is_far(idx, note) && 2 * (n_far + n_own) > notes.sheets.most() {
                note.forget(&notes.sheets);
            } else if is_far(idx, note) {
                n_far += n_own;
            }
        }
        self.n_done = new.end;
        self.waiting.extend(new.filter(|&idx| notes.of[idx].is_whole()));
    }
}

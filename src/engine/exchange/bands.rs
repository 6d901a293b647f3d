//! Sums that note what they find of pairs, and sums that are made of such notes.
//!
//! Owns the choice of what is noted. May use the operator, neighbours and notes. It deliberately changes no number: sums have
//! the bits that they have without notes.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::super::parallel;
use super::near::{LANES, MOST_TARGETS, Near, Sources, folded};
use super::notes::{Note, Noted, Reader, Sheets};
use super::operator::{Operator, PORTION, Wanted, with_kernel};
use crate::catalog::kernel::Radial;
use crate::plan::exchange::{Integration, Normalisation};

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
        let none = Sources::default();
        let mut at = 0;
        while at < n {
            let n_targets = near.gather_round(crowd, first + at, n - at);
            note.span = near.widen(note.span);
            for lanes in &mut lanes[..n_targets] {
                *lanes = [0.0; LANES];
            }
            while near.fill(crowd, &none) {
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
            let own = (is_mean, operator.factors[idx - operator.start], column[idx]);
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
}

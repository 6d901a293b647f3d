//! The batch: lanes filled with particles and emptied again.
//!
//! Owns loading and storing. May use the rest of the equilibrium. It deliberately decides nothing about the
//! iteration.

use super::activity::{MAX_IONIC_STRENGTH, MIN_IONIC_STRENGTH};
use super::newton::{Newton, Outcome};
use super::point::Point;
use super::system::{System, ln_of_stage};
use super::{Effort, LANES, Refusal, Refused, Speciation, Totals, Workspace, hard};
use crate::maths::scalar;
use pulp::NullaryFnOnce;

/// One call of [`Speciation::solve`].
pub(super) struct Fast<'a, 'c, C, M> {
    pub speciation: &'c Speciation,
    pub columns: Totals<'a, C, M>,
    pub workspace: &'c mut Workspace,
}

impl<C: AsRef<[f64]>, M: AsRef<[f64]> + AsMut<[f64]>> NullaryFnOnce for Fast<'_, '_, C, M> {
    type Output = Result<Effort, Refused>;

    #[inline(always)]
    fn call(self) -> Self::Output {
        let Self { speciation, mut columns, workspace } = self;
        let system = &speciation.system;
        let Workspace { many, one, left, stages } = workspace;
        left.clear();
        let mut batch = Batch { system, columns: &mut columns, stages, next: 0, refused: None };
        let mut effort = Effort::default();
        let mut particles = [None; LANES];
        for (lane, particle) in particles.iter_mut().enumerate() {
            *particle = batch.load(many, lane);
        }
        while particles.iter().any(Option::is_some) {
            let outcomes = many.advance(system);
            for (lane, particle) in particles.iter_mut().enumerate() {
                let Some(idx) = *particle else { continue };
                match outcomes[lane] {
                    Outcome::Going => continue,
                    Outcome::Done => batch.store(&many.point, lane, idx),
                    Outcome::Failed => left.push(idx),
                }
                effort.evaluations += u64::from(many.evaluations(lane));
                *particle = batch.load(many, lane);
            }
        }
        effort.hard = left.len() as u64;
        for &idx in left.iter() {
            batch.take(&mut one.point, 0, idx);
            match hard::solve(system, one) {
                Ok(()) => batch.store(&one.point, 0, idx),
                Err(why) => batch.refuse(idx, why),
            }
        }
        batch.refused.map_or(Ok(effort), Err)
    }
}

struct Batch<'a, 'c, 'd, C, M> {
    system: &'d System,
    columns: &'c mut Totals<'a, C, M>,
    stages: &'d mut [u8],
    next: usize,
    refused: Option<Refused>,
}

impl<C: AsRef<[f64]>, M: AsRef<[f64]> + AsMut<[f64]>> Batch<'_, '_, '_, C, M> {
    /// Fills a lane with the next particle that has totals.
    #[inline(always)]
    fn load(&mut self, newton: &mut Newton<LANES>, lane: usize) -> Option<usize> {
        let n_particles = self.columns.totals.first().map_or(0, |column| column.as_ref().len());
        while self.next < n_particles {
            let idx = self.next;
            self.next += 1;
            let not_finite = self.columns.totals.iter().position(|column| !column.as_ref()[idx].is_finite());
            if let Some(primary) = not_finite {
                self.refuse(idx, Refusal::NotFinite { primary });
                continue;
            }
            self.take(&mut newton.point, lane, idx);
            self.recall(&mut newton.point, lane, idx);
            newton.start(self.system, lane);
            return Some(idx);
        }
        newton.stop(lane);
        None
    }

    /// The totals of a particle, and a first guess.
    #[inline(always)]
    fn take<const L: usize>(&mut self, point: &mut Point<L>, lane: usize, idx: usize) {
        let mut is_zero = false;
        for (total, column) in point.total.iter_mut().zip(self.columns.totals) {
            total[lane] = column.as_ref()[idx];
            is_zero |= total[lane] == 0.0;
        }
        self.stages.fill(0);
        if is_zero {
            self.system.absent(|j| self.columns.totals[j].as_ref()[idx], self.stages);
        }
        for (place, stage) in point.stages.iter_mut().zip(&*self.stages) {
            place[lane] = *stage;
        }
        guess(self.system, point, lane);
    }

    /// Where the particle's last iteration ended, as far as it is known and still means something.
    #[inline(always)]
    fn recall<const L: usize>(&mut self, point: &mut Point<L>, lane: usize, idx: usize) {
        let Point { xi, amount, ionic, stages, .. } = point;
        let mut memory = self.columns.memory.iter().map(|column| column.as_ref()[idx]);
        for ((xi, stage), known) in xi.iter_mut().zip(&*stages).zip(memory.by_ref()) {
            let is_used = stage[lane] == 0 && known.abs() < LARGEST_LN;
            xi[lane] = if is_used { known } else { xi[lane] };
        }
        for (amount, known) in amount.iter_mut().zip(memory.by_ref()) {
            amount[lane] = if known.is_finite() { known } else { 0.0 };
        }
        if let Some(known) = memory.next().filter(|known| *known >= MIN_IONIC_STRENGTH) {
            ionic[lane] = known.min(MAX_IONIC_STRENGTH);
        }
    }

    /// Writes what was found, unless its activities mean nothing.
    #[inline(always)]
    fn store<const L: usize>(&mut self, point: &Point<L>, lane: usize, idx: usize) {
        let found = point.values[..self.system.n_primaries + self.system.n_secondaries].iter();
        for (column, value) in self.columns.concentrations.iter_mut().zip(found.chain(&point.amount)) {
            column.as_mut()[idx] = value[lane];
        }
        let ends = point.xi.iter().chain(&point.amount).chain([&point.ionic]);
        for (column, value) in self.columns.memory.iter_mut().zip(ends) {
            column.as_mut()[idx] = value[lane];
        }
        if point.ionic[lane] > MAX_IONIC_STRENGTH {
            self.refuse(idx, Refusal::IonicStrength { value: point.ionic[lane] });
        }
    }

    fn refuse(&mut self, particle: usize, why: Refusal) {
        for column in self.columns.concentrations.iter_mut().chain(&mut *self.columns.memory) {
            column.as_mut()[particle] = f64::NAN;
        }
        if self.refused.is_none_or(|first| particle < first.particle) {
            self.refused = Some(Refused { particle, why });
        }
    }
}

/// `ln c` of larger size are not remembered: they stand for absent species.
const LARGEST_LN: f64 = 1e5;

/// Where the iteration begins without a memory: all of each total as its primary, and a little of those whose
/// totals are not positive.
#[inline(always)]
pub(super) fn guess<const L: usize>(system: &System, point: &mut Point<L>, lane: usize) {
    let mut largest: f64 = 1e-30;
    let mut ionic = 0.0;
    for (total, weight) in point.total.iter().zip(&system.ionic) {
        largest = largest.max(total[lane].abs());
        ionic += weight * total[lane].abs();
    }
    for j in 0..system.n_primaries {
        let total = point.total[j][lane];
        let start = if total > 0.0 { total } else { 1e-4 * largest };
        let stage = point.stages[j][lane];
        point.xi[j][lane] = if stage > 0 { ln_of_stage(stage) } else { scalar::ln(start) };
    }
    for amount in &mut point.amount {
        amount[lane] = 0.0;
    }
    point.ionic[lane] = if system.is_ideal() { MIN_IONIC_STRENGTH } else { ionic.clamp(1e-9, 0.5) };
}

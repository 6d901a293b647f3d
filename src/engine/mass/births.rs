//! What comes into being during a run, and what makes room for it.
//!
//! Owns the booking of births, and boxes that are filled again. May use releases and books. It deliberately moves
//! nothing.

use super::super::error::RunError;
use super::super::parallel;
use super::super::track::medium::Medium;
use super::super::track::tracker::{EARLIEST, Steps};
use super::book::{Event, What};
use super::flock;
use super::release::{Birth, Kind, Release, Window};
use super::run::Run;
use crate::state::particles::BLOCK;

/// Blocks that begin together.
const BLOCKS_PER_ROUND: usize = 64;

impl<const D: usize, M: Medium<D>> Run<'_, D, M> {
    /// What is there at the start, a round of blocks at a time: a hundred million births are not held twice.
    pub fn start(&mut self) -> Result<(), RunError> {
        for origin in 0..self.releases.len() {
            let n = self.releases[origin].n_at_start();
            let block = BLOCK as u64;
            for round in (0..n).step_by(BLOCKS_PER_ROUND * BLOCK) {
                let n_blocks = (n - round).div_ceil(block).min(BLOCKS_PER_ROUND as u64) as usize;
                let (release, stream) = (&self.releases[origin], &self.stream);
                let born = parallel::map(n_blocks, &|idx| {
                    let first = round + idx as u64 * block;
                    release.at_start(stream, first..(first + block).min(n))
                });
                for births in born {
                    self.book_births(&births, 0.0, 0.0);
                    let has_own = self.reactions.is_some();
                    for birth in births {
                        let mass = has_own.then(|| self.units.of(birth.population, birth.id));
                        let particle = (birth.id, birth.position, mass);
                        flock::add_weighed(&mut self.flocks, birth.population, particle);
                    }
                }
            }
        }
        Ok(())
    }

    /// What begins within steps, by step.
    pub fn births(&mut self, steps: Steps, part: f64) -> Vec<Vec<Birth<D>>> {
        let Steps { first, end, t, dt } = steps;
        let later: Vec<&Release<D>> =
            self.releases.iter().filter(|release| release.n_at_start() == 0).collect();
        if later.is_empty() {
            return Vec::new();
        }
        let (stream, period) = (&self.stream, self.period);
        let window = |step: u64| Window { step, t: t + (step - first) as f64 * dt, dt, period, part };
        let born = parallel::map((end - first) as usize, &|idx| {
            let mut births = Vec::new();
            for release in &later {
                release.births(stream, window(first + idx as u64), &mut births);
            }
            births
        });
        for (step, births) in (first..end).zip(&born) {
            self.book_births(births, window(step).t, dt);
        }
        born
    }

    fn book_births(&mut self, births: &[Birth<D>], t: f64, dt: f64) {
        let mut events = Vec::new();
        for birth in births {
            self.entry(birth, t + birth.entered.max(EARLIEST) * dt, &mut events);
            self.note(&events);
            events.clear();
        }
    }

    /// What happens with a birth.
    fn entry(&self, birth: &Birth<D>, t: f64, events: &mut Vec<Event>) {
        let origin = flock::origin(birth.id);
        let mass = self.units.of(birth.population, birth.id);
        let event = |what: What| Event { what, population: birth.population, id: birth.id, mass, t };
        events.push(event(What::Entered { origin }));
        let place = |axis: usize| birth.position[axis];
        if let Kind::Held { axis, sign, .. } = self.releases[origin].kind {
            // It has come from the side to where it is: planes on that way were crossed.
            for (plane, of) in self.tracker.planes.iter().enumerate().filter(|(_, of)| of.axis == axis) {
                let is_in_part = of.part.as_ref().is_none_or(|part| part.holds(axis, place));
                if sign * (birth.position[axis] - of.at) > 0.0 && is_in_part {
                    events.push(event(What::Crossed { plane, is_forward: sign > 0.0 }));
                }
            }
        }
        let side = self.side_of(birth.id);
        for (idx, gap) in self.tracker.gaps.iter().enumerate() {
            if side == Some(gap.side) && gap.part.holds(gap.side / 2, place) {
                let plane = self.tracker.planes.len() + idx;
                events.push(event(What::Crossed { plane, is_forward: false }));
            }
        }
    }

    /// Takes out what is in the boxes that are filled again at `t`.
    pub fn empty_boxes(&mut self, t: f64) {
        let mut events = Vec::new();
        for release in &self.releases {
            let Kind::Filled { boxes, from, to, .. } = &release.kind else { continue };
            let Some((_, low, high)) = boxes.get(self.period) else { continue };
            if t < *from || t >= *to {
                continue;
            }
            let inside = |x: [f64; D]| (0..D).all(|axis| x[axis] >= low[axis] && x[axis] <= high[axis]);
            for flock in self.flocks.iter_mut().filter(|flock| flock.population == release.population) {
                let mut kept = 0;
                for idx in 0..flock.len() {
                    let (id, position) = (flock.ids[idx], flock.position(idx));
                    if inside(position) {
                        let what = What::Replaced { origin: release.origin };
                        let of_number = || self.units.of(flock.population, id);
                        let mass = flock.masses.get(idx).copied().unwrap_or_else(of_number);
                        events.push(Event { what, population: flock.population, id, mass, t });
                        continue;
                    }
                    flock.keep(kept, idx);
                    kept += 1;
                }
                flock.truncate(kept);
            }
        }
        self.note(&events);
    }
}

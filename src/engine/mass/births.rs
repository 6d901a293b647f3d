//! What comes into being during a run, and what makes room for it.
//!
//! Owns the booking of births, and boxes that are filled again. May use releases and books. It deliberately moves
//! nothing.

use super::super::error::RunError;
use super::super::track::medium::Medium;
use super::super::track::tracker::EARLIEST;
use super::book::{Event, What};
use super::flock;
use super::release::{Birth, Kind, Window};
use super::run::Run;

impl<const D: usize, M: Medium<D>> Run<'_, D, M> {
    /// What is there at the start.
    pub fn start(&mut self) -> Result<(), RunError> {
        let window = Window { step: 0, t: 0.0, dt: 1.0, period: 0, part: 1.0 };
        let mut births = Vec::new();
        for release in &self.releases {
            if matches!(release.kind, Kind::Steady { from: 0.0, to: 0.0, .. }) {
                release.births(&self.stream, window, &mut births);
            }
        }
        self.book_births(&births, 0.0, 0.0);
        for birth in births {
            flock::add(&mut self.flocks, birth.population, birth.id, birth.position);
        }
        Ok(())
    }

    pub fn book_births(&mut self, births: &[Birth<D>], t: f64, dt: f64) {
        for birth in births {
            let origin = flock::origin(birth.id);
            let event = |what: What| Event {
                what,
                population: birth.population,
                id: birth.id,
                mass: self.units.of(birth.population, birth.id),
                t: t + birth.entered.max(EARLIEST) * dt,
            };
            let mut events = vec![event(What::Entered { origin })];
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
            self.note(&events);
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
                        let mass = self.units.of(flock.population, id);
                        events.push(Event { what, population: flock.population, id, mass, t });
                        continue;
                    }
                    flock.set(kept, id, position);
                    kept += 1;
                }
                flock.truncate(kept);
            }
        }
        self.note(&events);
    }
}

//! Blocks of particles that turn into others while they move.
//!
//! Owns the work on one such block, and what leaves its population. May use the tracker, flocks and books. It
//! deliberately sorts nothing: what is of another population now is handed back.

use super::super::track::lanes::LANES;
use super::super::track::medium::Medium;
use super::super::track::tracker::{Bench, Steps, Tracker};
use super::super::track::turning::{Company, Fates, Newborn};
use super::book::Log;
use super::flock::Flock;
use super::march::{Trouble, Yield};
use super::units::Units;

/// What all blocks of a pass share.
pub struct Pass<'a, const D: usize, M: Medium<D>> {
    pub tracker: &'a Tracker<D, M>,
    pub company: Company<'a>,
    pub units: &'a Units,
    pub steps: Steps,
    pub newborn: Option<Newborn<'a>>,
}

/// One block, to be dispatched to wide or narrow code.
pub struct OnTurning<'a, const D: usize, M: Medium<D>> {
    pub pass: Pass<'a, D, M>,
    pub flock: &'a mut Flock<D>,
    pub bench: &'a mut Bench<D, M>,
    pub found: &'a mut Yield<D>,
}

impl<const D: usize, M: Medium<D>> pulp::NullaryFnOnce for OnTurning<'_, D, M> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        go_on_turning(&self.pass, self.flock, self.bench, self.found);
    }
}

/// Takes a block through steps, 64 particles at a time; those that leave, or turn, are taken out.
#[inline(always)]
fn go_on_turning<const D: usize, M: Medium<D>>(
    pass: &Pass<D, M>,
    flock: &mut Flock<D>,
    bench: &mut Bench<D, M>,
    found: &mut Yield<D>,
) {
    let n = flock.len();
    let mut kept = 0;
    bench.displacements = 0;
    for first in (0..n).step_by(LANES) {
        let range = first..(first + LANES).min(n);
        bench.lanes.load(&flock.ids[range.clone()], flock.positions.each_ref().map(|x| &x[range.clone()]));
        bench.fates.get_or_insert_with(Fates::new).states = [flock.population; LANES];
        let (events, turned) = (&mut found.events, &mut found.turned);
        let (units, n_ways) = (pass.units, pass.company.chain.n_ways());
        let own = (&[][..], &[][..]);
        let mut log = Log { population: flock.population, units, own, events, turned, n_ways };
        let result = pass.tracker.advance_turning(pass.company, pass.steps, pass.newborn, bench, &mut log);
        if let Err(problem) = result {
            found.trouble.get_or_insert(Trouble::SubSteps(problem));
        }
        let Some(states) = bench.fates.as_ref().map(|fates| &fates.states) else { continue };
        let lanes = &bench.lanes;
        for lane in (0..range.len()).filter(|lane| lanes.gone >> lane & 1 == 0) {
            let (id, position) = (lanes.ids[lane], lanes.positions.each_ref().map(|axis| axis[lane]));
            if position.iter().any(|x| !x.is_finite()) {
                found.trouble.get_or_insert(Trouble::Position { id, step: pass.steps.first });
            }
            if states[lane] == flock.population {
                flock.set(kept, id, position);
                kept += 1;
            } else {
                found.moved.push((states[lane], id, position));
            }
        }
    }
    flock.truncate(kept);
    found.displacements += bench.displacements;
}

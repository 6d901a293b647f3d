//! Blocks of particles on their way through steps, on all threads.
//!
//! Owns the work on one block and what came of it. May use the tracker, flocks and books. It deliberately knows no
//! calendar.

use super::super::error::RunError;
use super::super::parallel;
use super::super::track::lanes::{LANES, Lane};
use super::super::track::medium::{Carrier, Medium};
use super::super::track::tracker::{Bench, Steps, TooManySubSteps, Tracker};
use super::super::track::turning::{Company, Newborn};
use super::book::{Event, Log};
use super::flock::{self, Flock};
use super::release::Birth;
use super::run::Run;
use super::turn::{OnTurning, Pass};
use super::units::Units;
use std::cmp::Reverse;

/// What came of a group of blocks.
pub struct Yield<const D: usize> {
    pub events: Vec<Event>,
    /// Per way and origin what has turned; empty if nothing has.
    pub turned: Vec<u128>,
    /// What is of another population now.
    pub moved: Vec<(usize, u64, [f64; D])>,
    pub trouble: Option<Trouble>,
    pub displacements: u64,
}

impl<const D: usize> Default for Yield<D> {
    fn default() -> Self {
        Self { events: Vec::new(), turned: Vec::new(), moved: Vec::new(), trouble: None, displacements: 0 }
    }
}

#[derive(Debug, Clone, Copy)]
pub enum Trouble {
    SubSteps(TooManySubSteps),
    Position { id: u64, step: u64 },
}

impl<const D: usize, M: Medium<D>> Run<'_, D, M> {
    pub fn move_flocks(&mut self, steps: Steps) -> Result<(), RunError> {
        let (tracker, carriers, units, benches) = (&self.tracker, &self.carriers, &self.units, &self.benches);
        let company = self.chain.as_ref().map(|chain| Company { chain, carriers: &self.paces });
        let mut tasks: Vec<(usize, &mut Flock<D>, Yield<D>)> =
            self.flocks.iter_mut().enumerate().map(|(idx, flock)| (idx, flock, Yield::default())).collect();
        // What took most displacements the last time begins first; any order gives the same bytes.
        let last = &self.last_displacements;
        tasks.sort_by_key(|(idx, ..)| Reverse(last.get(*idx).copied().unwrap_or(0)));
        parallel::for_each(&mut tasks, &|_, (_, flock, found)| {
            let turning = company.filter(|company| company.chain.turns(flock.population));
            if turning.is_none() && carriers[flock.population].mobility == 0.0 {
                return;
            }
            benches.lend(
                || Box::new(tracker.bench()),
                |bench| match turning {
                    Some(company) => {
                        let newborn = None;
                        let pass = Pass { tracker, company, units, steps, newborn };
                        tracker.width.run(OnTurning { pass, flock, bench, found });
                    }
                    None => {
                        let carrier = &carriers[flock.population];
                        let entered = None;
                        tracker.width.run(OnFlock {
                            tracker,
                            carrier,
                            units,
                            steps,
                            entered,
                            flock,
                            bench,
                            found,
                        });
                    }
                },
            );
        });
        tasks.sort_unstable_by_key(|(idx, ..)| *idx);
        let found: Vec<Yield<D>> = tasks.into_iter().map(|(.., found)| found).collect();
        self.last_displacements = found.iter().map(|found| found.displacements).collect();
        let mut moved = Vec::new();
        for mut found in found {
            moved.append(&mut found.moved);
            self.take(found)?;
        }
        flock::spread(&mut self.flocks, moved);
        Ok(())
    }

    fn take(&mut self, found: Yield<D>) -> Result<(), RunError> {
        self.note(&found.events);
        self.book.turn(&found.turned);
        self.displacements += found.displacements;
        match found.trouble {
            None => Ok(()),
            Some(Trouble::Position { id, step }) => {
                Err(RunError::NonFinitePosition { step: step + 1, particle: flock::count(id) })
            }
            Some(Trouble::SubSteps(TooManySubSteps { id, step })) => {
                Err(RunError::TooManySubSteps { step: step + 1, particle: flock::count(id) })
            }
        }
    }

    /// Takes what begins within steps to the end of the last one, and keeps it: births by step.
    pub fn move_newborn(&mut self, births: Vec<Vec<Birth<D>>>, steps: Steps) -> Result<(), RunError> {
        let mut groups = Vec::new();
        for (idx, mut births) in births.into_iter().enumerate() {
            let steps =
                Steps { first: steps.first + idx as u64, t: steps.t + idx as f64 * steps.dt, ..steps };
            births.sort_by_key(|birth| birth.population);
            for own in births.chunk_by(|one, other| one.population == other.population) {
                let units = self.units.row(own[0].population);
                let units = self.reactions.is_some().then_some(units);
                groups.extend(own.chunks(LANES).map(|group| Group::new(group, steps, units)));
            }
        }
        let run = &*self;
        parallel::for_each(&mut groups, &|_, group| run.move_group(group));
        for Group { flock, mut found, .. } in groups {
            let moved = std::mem::take(&mut found.moved);
            self.take(found)?;
            for idx in 0..flock.len() {
                let mass = flock.masses.get(idx).copied();
                let particle = (flock.ids[idx], flock.position(idx), mass);
                flock::add_weighed(&mut self.flocks, flock.population, particle);
            }
            flock::spread(&mut self.flocks, moved);
        }
        Ok(())
    }

    fn move_group(&self, group: &mut Group<D>) {
        let Group { flock, births, entered, steps, found } = group;
        let (tracker, units, steps) = (&self.tracker, &self.units, *steps);
        let carrier = &self.carriers[flock.population];
        match self.chain.as_ref().filter(|chain| chain.turns(flock.population)) {
            Some(chain) => {
                let mut ages: Lane = [0.0; LANES];
                for (age, birth) in ages.iter_mut().zip(births.iter()) {
                    let release = &self.releases[flock::origin(birth.id)];
                    *age = release.age(&self.stream, birth, (steps.dt, self.period));
                }
                let company = Company { chain, carriers: &self.paces };
                let newborn = Some(Newborn { entered, ages: &ages });
                let pass = Pass { tracker, company, units, steps, newborn };
                self.benches.lend(
                    || Box::new(tracker.bench()),
                    |bench| tracker.width.run(OnTurning { pass, flock, bench, found }),
                );
            }
            None if carrier.mobility > 0.0 => {
                let entered = Some(&*entered);
                self.benches.lend(
                    || Box::new(tracker.bench()),
                    |bench| {
                        tracker.width.run(OnFlock {
                            tracker,
                            carrier,
                            units,
                            steps,
                            entered,
                            flock,
                            bench,
                            found,
                        });
                    },
                );
            }
            None => {}
        }
    }
}

/// Up to 64 newborn particles of one population and step.
struct Group<const D: usize> {
    flock: Flock<D>,
    births: Vec<Birth<D>>,
    entered: Lane,
    steps: Steps,
    found: Yield<D>,
}

impl<const D: usize> Group<D> {
    /// With masses of their own where units are given.
    fn new(births: &[Birth<D>], steps: Steps, units: Option<&[f64]>) -> Self {
        let mut flock = Flock::new(births[0].population);
        let mut entered: Lane = [0.0; LANES];
        for (entered, birth) in entered.iter_mut().zip(births) {
            let mass = units.map(|units| units[flock::origin(birth.id)]);
            flock.push_weighed(birth.id, birth.position, mass);
            *entered = birth.entered;
        }
        Self { flock, births: births.to_vec(), entered, steps, found: Yield::default() }
    }
}

/// One block, to be dispatched to wide or narrow code.
struct OnFlock<'a, const D: usize, M: Medium<D>> {
    tracker: &'a Tracker<D, M>,
    carrier: &'a Carrier,
    units: &'a Units,
    steps: Steps,
    entered: Option<&'a Lane>,
    flock: &'a mut Flock<D>,
    bench: &'a mut Bench<D, M>,
    found: &'a mut Yield<D>,
}

impl<const D: usize, M: Medium<D>> pulp::NullaryFnOnce for OnFlock<'_, D, M> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        go_on(
            self.tracker,
            self.carrier,
            self.units,
            self.steps,
            self.entered,
            self.flock,
            self.bench,
            self.found,
        );
    }
}

/// Takes a block through steps, 64 particles at a time; those that leave are taken out.
#[allow(clippy::too_many_arguments)] // All of it is one pass over one block.
#[inline(always)]
fn go_on<const D: usize, M: Medium<D>>(
    tracker: &Tracker<D, M>,
    carrier: &Carrier,
    units: &Units,
    steps: Steps,
    entered: Option<&Lane>,
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
        let (events, turned) = (&mut found.events, &mut found.turned);
        let own = if flock.masses.is_empty() { 0..0 } else { range.clone() };
        let own = (&flock.ids[own.clone()], &flock.masses[own]);
        let mut log = Log { population: flock.population, units, own, events, turned, n_ways: 0 };
        if let Err(problem) = tracker.advance(carrier, steps, entered, bench, &mut log) {
            found.trouble.get_or_insert(Trouble::SubSteps(problem));
        }
        let lanes = &bench.lanes;
        for lane in 0..range.len() {
            if lanes.gone >> lane & 1 == 1 {
                continue;
            }
            flock.ids[kept] = lanes.ids[lane];
            for axis in 0..D {
                let x = lanes.positions[axis][lane];
                if !x.is_finite() {
                    let id = lanes.ids[lane];
                    found.trouble.get_or_insert(Trouble::Position { id, step: steps.first });
                }
                flock.positions[axis][kept] = x;
            }
            if let Some(&mass) = flock.masses.get(first + lane) {
                flock.masses[kept] = mass;
            }
            kept += 1;
        }
    }
    flock.truncate(kept);
    found.displacements += bench.displacements;
}

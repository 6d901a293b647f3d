//! The loop over steps of particles that carry mass.
//!
//! Owns the state of such a run and its checks. May use all of the folder. It deliberately works on no single
//! particle: trackers do.

use super::super::clock::Clock;
use super::super::control::{Control, Settings};
use super::super::error::RunError;
use super::super::parallel::{self, Pool};
use super::super::schedule::{Due, schedule, step_length};
use super::super::snapshot::{Outcome, Snapshot};
use super::super::track::lanes::{LANES, Lane};
use super::super::track::medium::{Carrier, Medium};
use super::super::track::monitors::Plane;
use super::super::track::noise::Draws;
use super::super::track::tracker::{Bench, EARLIEST, Steps, TooManySubSteps, Tracker};
use super::super::track::walls::Ends;
use super::book::{Book, Event, Log, What};
use super::flock::{self, Flock};
use super::gate::Gates;
use super::observe::Scene;
use super::release::{Birth, Kind, Release, Window};
use super::world::Site;
use crate::chemistry::Work;
use crate::maths::exact::{MOST_TERMS, Quanta};
use crate::maths::wide::Width;
use crate::plan::{Normals, Station};
use crate::state::stream::{Purpose, Stream};

/// Steps that a block is taken through before the next one.
const TILE: u64 = 8;

pub type Sink<'a> = &'a mut (dyn FnMut(Snapshot) -> Result<(), RunError> + Send);

/// Everything that lives as long as the run.
struct Run<'a, const D: usize, M: Medium<D>> {
    site: &'a Site<'a, D>,
    tracker: Tracker<D, M>,
    carriers: Vec<Carrier>,
    releases: Vec<Release<D>>,
    units: Vec<f64>,
    stream: Stream,
    flocks: Vec<Flock<D>>,
    book: Book,
    quanta: Quanta,
    /// Outputs of what passes places.
    gates: Gates,
    benches: Pool<Bench<D, M>>,
    displacements: u64,
}

/// What came of a group of blocks.
#[derive(Default)]
struct Yield {
    events: Vec<Event>,
    trouble: Option<Trouble>,
    displacements: u64,
}

#[derive(Debug, Clone, Copy)]
enum Trouble {
    SubSteps(TooManySubSteps),
    Position { id: u64, step: u64 },
}

/// Runs in a medium.
pub fn go<const D: usize, M: Medium<D>>(
    site: &Site<D>,
    medium: M,
    settings: &Settings,
    control: &dyn Control,
    sink: Sink,
) -> Result<Outcome, RunError> {
    let mut clock = Clock::start();
    let mut dues = schedule(site.plan)?;
    let width = if settings.is_narrow { Width::baseline() } else { Width::widest() };
    let mut run = Run::new(site, medium, width, &mut dues)?;
    let mut loop_clock = Clock::start();
    let mut dues = dues.iter().peekable();
    let n_steps = site.plan.time.n_steps;
    let mut step = 0;
    run.start()?;
    loop {
        let mut snapshots = run.gates.ready(step);
        while let Some(due) = dues.next_if(|due| due.steps == step) {
            snapshots.extend(run.observe(due)?);
        }
        snapshots.sort_by(|a, b| a.t.total_cmp(&b.t).then(a.output_idx.cmp(&b.output_idx)));
        for snapshot in snapshots {
            loop_clock.away(|| clock.away(|| sink(snapshot)))?;
        }
        if control.is_cancelled() {
            return Err(RunError::Cancelled);
        }
        if step == n_steps {
            break;
        }
        let next_due = dues.peek().map_or(n_steps, |due| due.steps.max(step + 1));
        let end = next_due.min(step + run.tile_length()).min(n_steps);
        // The last step may have another length.
        let end = if end == n_steps && step + 1 < n_steps { n_steps - 1 } else { end };
        run.tile(step, end)?;
        step = end;
        control.step_done(step, n_steps);
    }
    let loop_wall = loop_clock.wall();
    let mass_defect = run.defects();
    Ok(Outcome {
        n_steps,
        n_particles: site.plan.particles.count,
        mass_defect,
        labour: Work { steps: run.displacements, ..Work::default() },
        loop_wall,
        wall: clock.wall(),
        cpu: clock.cpu(),
        state_bytes: site.plan.particles.count * 8 * (D as u64 + 1),
    })
}

impl<'a, const D: usize, M: Medium<D>> Run<'a, D, M> {
    fn new(site: &'a Site<'a, D>, medium: M, width: Width, dues: &mut Vec<Due>) -> Result<Self, RunError> {
        let mut tracker = site.tracker(medium, width)?;
        let mut planes: Vec<Plane> = Vec::new();
        let period = |axis: usize| match tracker.ends[axis] {
            Ends::Periodic { low, high } => Some(high - low),
            Ends::Walls(_) => None,
        };
        let water = |station: &Station| site.water(&tracker.medium, station);
        let gates = Gates::new(site.plan, dues, &mut planes, period, water);
        tracker.planes = planes;
        let releases = site.releases(&tracker)?;
        let units: Vec<f64> = releases.iter().map(|release| release.unit).collect();
        let largest = units.iter().fold(0.0, |a: f64, &b| a.max(b));
        let doors = releases.iter().map(|release| release.door).collect();
        let n_doors = 1 + site.transport.sources.len() + 2 * D + site.transport.drains().len();
        Ok(Self {
            carriers: site.carriers(),
            book: Book::new(units.clone(), doors, n_doors, site.transport.populations.len()),
            // Particles that are refilled count again and again; sums are over what happened, too.
            quanta: Quanta::new(largest, MOST_TERMS),
            gates,
            stream: Stream::new(site.plan.seed, Purpose::Release),
            flocks: Vec::new(),
            benches: Pool::new(),
            displacements: 0,
            site,
            tracker,
            releases,
            units,
        })
    }

    fn note(&mut self, events: &[Event]) {
        let n_sides = 2 * D + self.site.transport.drains().len();
        for event in events {
            self.book.note(event, n_sides);
            if !self.gates.are_none() {
                self.gates.note(event, self.side_of(event.id), self.quanta);
            }
        }
    }

    /// The side that a particle came in through.
    fn side_of(&self, id: u64) -> Option<usize> {
        self.releases[flock::origin(id)].door.checked_sub(1 + self.site.transport.sources.len())
    }

    /// What is there at the start.
    fn start(&mut self) -> Result<(), RunError> {
        let window = Window { step: 0, t: 0.0, dt: 1.0 };
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

    fn book_births(&mut self, births: &[Birth<D>], t: f64, dt: f64) {
        for birth in births {
            let origin = flock::origin(birth.id);
            let event = |what: What| Event {
                what,
                population: birth.population,
                id: birth.id,
                mass: self.units[origin],
                t: t + birth.entered.max(EARLIEST) * dt,
            };
            let mut events = vec![event(What::Entered { origin })];
            if let Kind::Held { axis, sign, .. } = self.releases[origin].kind {
                // It has come from the side to where it is: planes on that way were crossed.
                for (plane, of) in self.tracker.planes.iter().enumerate().filter(|(_, of)| of.axis == axis) {
                    if sign * (birth.position[axis] - of.at) > 0.0 {
                        events.push(event(What::Crossed { plane, is_forward: sign > 0.0 }));
                    }
                }
            }
            self.note(&events);
        }
    }

    /// Steps that can be taken together from one: what fills a box again looks at every step.
    fn tile_length(&self) -> u64 {
        let fills = |release: &Release<D>| matches!(release.kind, Kind::Filled { .. });
        if self.releases.iter().any(fills) { 1 } else { TILE }
    }

    /// Takes out what is in the boxes that are filled again at `t`.
    fn empty_boxes(&mut self, t: f64) {
        let mut events = Vec::new();
        for release in &self.releases {
            let Kind::Filled { low, high, from, to, .. } = &release.kind else { continue };
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
                        let mass = self.units[flock::origin(id)];
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

    /// Takes everything through steps of equal length.
    fn tile(&mut self, first: u64, end: u64) -> Result<(), RunError> {
        let time = &self.site.plan.time;
        self.advance(Steps { first, end, t: first as f64 * time.step, dt: step_length(time, first) })
    }

    fn advance(&mut self, steps: Steps) -> Result<(), RunError> {
        let Steps { first, end, t, dt } = steps;
        self.empty_boxes(t);
        let mut newborn: Vec<Vec<Birth<D>>> = Vec::new();
        for step in first..end {
            let window = Window { step, t: t + (step - first) as f64 * dt, dt };
            let mut births = Vec::new();
            for release in &self.releases {
                if !matches!(release.kind, Kind::Steady { from: 0.0, to: 0.0, .. }) {
                    release.births(&self.stream, window, &mut births);
                }
            }
            self.book_births(&births, window.t, dt);
            newborn.push(births);
        }
        self.move_flocks(steps)?;
        for (step, births) in (first..end).zip(newborn) {
            let t = t + (step - first) as f64 * dt;
            self.move_newborn(births, Steps { first: step, end, t, dt })?;
        }
        flock::gather(&mut self.flocks);
        Ok(())
    }

    fn move_flocks(&mut self, steps: Steps) -> Result<(), RunError> {
        let (tracker, carriers, units, benches) = (&self.tracker, &self.carriers, &self.units, &self.benches);
        let mut tasks: Vec<(&mut Flock<D>, Yield)> =
            self.flocks.iter_mut().map(|flock| (flock, Yield::default())).collect();
        parallel::for_each(&mut tasks, &|_, (flock, found)| {
            if carriers[flock.population].mobility == 0.0 {
                return;
            }
            benches.lend(
                || Box::new(tracker.bench()),
                |bench| {
                    let carrier = &carriers[flock.population];
                    tracker.width.run(OnFlock { tracker, carrier, units, steps, flock, bench, found });
                },
            );
        });
        let found: Vec<Yield> = tasks.into_iter().map(|(_, found)| found).collect();
        found.into_iter().try_for_each(|found| self.take(found))
    }

    fn take(&mut self, found: Yield) -> Result<(), RunError> {
        self.note(&found.events);
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

    /// Takes what begins within a step to the end of the tile, and keeps it.
    fn move_newborn(&mut self, mut births: Vec<Birth<D>>, steps: Steps) -> Result<(), RunError> {
        births.sort_by_key(|birth| birth.population);
        let mut rest = &births[..];
        while let Some(first) = rest.first() {
            let n = rest.iter().take(LANES).take_while(|birth| birth.population == first.population).count();
            let (group, others) = rest.split_at(n);
            rest = others;
            let mut flock = Flock::new(first.population);
            let mut entered: Lane = [0.0; LANES];
            for (lane, birth) in group.iter().enumerate() {
                flock.push(birth.id, birth.position);
                entered[lane] = birth.entered;
            }
            let carrier = self.carriers[flock.population];
            let mut found = Yield::default();
            if carrier.mobility > 0.0 {
                let (tracker, units) = (&self.tracker, &self.units);
                self.benches.lend(
                    || Box::new(tracker.bench()),
                    |bench| {
                        go_on(tracker, &carrier, units, steps, Some(&entered), &mut flock, bench, &mut found)
                    },
                );
            }
            self.take(found)?;
            for idx in 0..flock.len() {
                flock::add(&mut self.flocks, flock.population, flock.ids[idx], flock.position(idx));
            }
        }
        Ok(())
    }

    fn scene(&self) -> Scene<'_, D> {
        Scene {
            site: self.site,
            flocks: &self.flocks,
            units: &self.units,
            quanta: self.quanta,
            book: &self.book,
        }
    }

    /// The outputs of a time; between two steps those of a copy that goes a part of the next one.
    ///
    /// - Equation: `X(t + f Δt) = X(t) + A f Δt + √(2D f Δt) ξ`, sides and sources over `f Δt`, with draws that
    ///   nothing else uses.
    /// - Symbols: `f` part of the step.
    /// - Range: as right in law as a step of that length.
    /// - Source: the Markov property of the walk.
    /// - Shape: everything is as it was when this returns.
    fn observe(&mut self, due: &Due) -> Result<Vec<Snapshot>, RunError> {
        if due.fraction == 0.0 {
            return self.look(due);
        }
        let plan = self.site.plan;
        let aside = Draws::aside(plan.seed, D, plan.walk.normals == Normals::Double);
        let draws = std::mem::replace(&mut self.tracker.draws, aside);
        let planes = std::mem::take(&mut self.tracker.planes);
        let gates = std::mem::take(&mut self.gates);
        let (flocks, book, displacements) = (self.flocks.clone(), self.book.clone(), self.displacements);
        let steps = Steps {
            first: due.steps,
            end: due.steps + 1,
            t: due.steps as f64 * plan.time.step,
            dt: due.fraction * step_length(&plan.time, due.steps),
        };
        let found = self.advance(steps).and_then(|()| self.look(due));
        (self.flocks, self.book, self.displacements) = (flocks, book, displacements);
        (self.tracker.draws, self.tracker.planes, self.gates) = (draws, planes, gates);
        found
    }

    fn look(&self, due: &Due) -> Result<Vec<Snapshot>, RunError> {
        let scene = self.scene();
        due.outputs.iter().map(|&output_idx| scene.observe(output_idx, due.t)).collect()
    }

    /// Per population |inside + left − entered| / entered.
    fn defects(&self) -> Vec<f64> {
        let scene = self.scene();
        let defect = |population: usize| {
            let (entered, left) = self.book.whole(population);
            let error = (scene.inside(population) + left - entered).abs();
            if entered > 0.0 { error / entered } else { error }
        };
        (0..self.carriers.len()).map(defect).collect()
    }
}

/// One block, to be dispatched to wide or narrow code.
struct OnFlock<'a, const D: usize, M: Medium<D>> {
    tracker: &'a Tracker<D, M>,
    carrier: &'a Carrier,
    units: &'a [f64],
    steps: Steps,
    flock: &'a mut Flock<D>,
    bench: &'a mut Bench<D, M>,
    found: &'a mut Yield,
}

impl<const D: usize, M: Medium<D>> pulp::NullaryFnOnce for OnFlock<'_, D, M> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        go_on(self.tracker, self.carrier, self.units, self.steps, None, self.flock, self.bench, self.found);
    }
}

/// Takes a block through steps, 64 particles at a time; those that leave are taken out.
#[allow(clippy::too_many_arguments)] // All of it is one pass over one block.
#[inline(always)]
fn go_on<const D: usize, M: Medium<D>>(
    tracker: &Tracker<D, M>,
    carrier: &Carrier,
    units: &[f64],
    steps: Steps,
    entered: Option<&Lane>,
    flock: &mut Flock<D>,
    bench: &mut Bench<D, M>,
    found: &mut Yield,
) {
    let n = flock.len();
    let mut kept = 0;
    bench.displacements = 0;
    for first in (0..n).step_by(LANES) {
        let range = first..(first + LANES).min(n);
        bench.lanes.load(&flock.ids[range.clone()], flock.positions.each_ref().map(|x| &x[range.clone()]));
        let mut log = Log { population: flock.population, units, events: &mut found.events };
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
            kept += 1;
        }
    }
    flock.truncate(kept);
    found.displacements += bench.displacements;
}

//! The loop over steps of particles that carry mass.
//!
//! Owns the state of such a run and its checks. May use all of the folder. It deliberately works on no single
//! particle: trackers do.

use super::super::clock::Clock;
use super::super::control::{Control, Settings};
use super::super::error::RunError;
use super::super::parallel::{self, Pool};
use super::super::program::unsound;
use super::super::schedule::{Due, schedule, step_length};
use super::super::snapshot::{Outcome, Snapshot};
use super::super::track::cells::{CellMedium, Dispersivity};
use super::super::track::formula::{Formula, Spreading};
use super::super::track::lanes::{LANES, Lane};
use super::super::track::medium::{Carrier, Medium};
use super::super::track::tracker::{Bench, Steps, TooManySubSteps, Tracker};
use super::super::track::uniform::Uniform;
use super::book::{Book, Event, Log, What};
use super::flock::{self, Flock};
use super::observe::Scene;
use super::release::{Birth, Kind, Release, Window};
use super::world::Site;
use crate::chemistry::Work;
use crate::flow::build;
use crate::maths::exact::{MOST_TERMS, Quanta};
use crate::maths::wide::Width;
use crate::plan::Plan;
use crate::plan::tape::{Operation, Tape};
use crate::plan::transport::{Dispersion, Flow};
use crate::state::stream::{Purpose, Stream};
use std::sync::Arc;

/// Steps that a block is taken through before the next one.
const TILE: u64 = 8;

type Sink<'a> = &'a mut (dyn FnMut(Snapshot) -> Result<(), RunError> + Send);

/// Runs a plan of masses; the medium is matched here, once.
pub fn run<const D: usize>(
    plan: &Plan,
    settings: &Settings,
    control: &dyn Control,
    sink: Sink,
) -> Result<Outcome, RunError> {
    let flow = match &settings.flow {
        Some(flow) => Some(flow.clone()),
        None => build::of(plan)
            .map_err(|error| RunError::Flow(error.to_string()))?
            .map(|solution| Arc::new(solution.flow)),
    };
    let site = Site::<D>::new(plan, flow)?;
    match (&site.transport.flow, &site.transport.dispersion) {
        (Flow::Uniform(velocity), Dispersion::Constant(_) | Dispersion::Velocity { .. })
            if is_constant(&site.transport.porosity) =>
        {
            let velocity: [f64; D] =
                velocity.clone().try_into().map_err(|_| unsound("a velocity that does not fit the axes"))?;
            go(&site, uniform(plan, velocity, &site.transport.dispersion)?, settings, control, sink)
        }
        (Flow::Uniform(_) | Flow::Expression(_), _) => go(&site, formula(&site)?, settings, control, sink),
        (
            Flow::Darcy(_) | Flow::File(_),
            Dispersion::Velocity { longitudinal, transverse, molecular, .. },
        ) => {
            let flow = site.flow.as_ref().ok_or_else(|| unsound("a flow that nobody solved"))?;
            let axes = std::array::from_fn(|axis| plan.axes[axis].index);
            let dispersivity =
                Dispersivity { longitudinal: *longitudinal, transverse: *transverse, molecular: *molecular };
            let medium = CellMedium::<D>::new(flow, axes, dispersivity)
                .ok_or_else(|| unsound("cells that are not equal, or porosity that varies"))?;
            go(&site, medium, settings, control, sink)
        }
        _ => Err(unsound("flow and dispersion that do not go together yet")),
    }
}

fn is_constant(tape: &Tape) -> bool {
    matches!(tape.operations[..], [Operation::Constant(_)])
}

/// A medium of expressions.
fn formula<const D: usize>(site: &Site<D>) -> Result<Formula<D>, RunError> {
    let constant = |value: f64| Tape { operations: vec![Operation::Constant(value)] };
    let velocity: Vec<Tape> = match &site.transport.flow {
        Flow::Uniform(velocity) => velocity.iter().map(|&v| constant(v)).collect(),
        Flow::Expression(tapes) => tapes.clone(),
        Flow::Darcy(_) | Flow::File(_) => return Err(unsound("a flow without expressions")),
    };
    let spreading = match &site.transport.dispersion {
        Dispersion::Constant(triangle) => Spreading::Constant(triangle_of(triangle)?, 0.0),
        Dispersion::Isotropic(tape) => Spreading::Isotropic(tape.clone()),
        Dispersion::Velocity { longitudinal, transverse, molecular, .. } => Spreading::Velocity {
            longitudinal: *longitudinal,
            transverse: *transverse,
            molecular: *molecular,
        },
    };
    Ok(Formula {
        axes: std::array::from_fn(|axis| site.plan.axes[axis].index),
        velocity: velocity.try_into().map_err(|_| unsound("a velocity that does not fit the axes"))?,
        spreading,
        porosity: site.transport.porosity.clone(),
        width: std::array::from_fn(|axis| site.high[axis] - site.low[axis]),
    })
}

/// A lower triangle, row by row.
fn triangle_of<const D: usize>(entries: &[f64]) -> Result<[[f64; D]; D], RunError> {
    if entries.len() != D * (D + 1) / 2 {
        return Err(unsound("a dispersion that does not fit the axes"));
    }
    let mut tensor = [[0.0; D]; D];
    for (row, target) in tensor.iter_mut().enumerate() {
        target[..=row].copy_from_slice(&entries[row * (row + 1) / 2..][..=row]);
    }
    Ok(tensor)
}

/// A uniform medium from constants, or from lengths along the velocity.
fn uniform<const D: usize>(
    plan: &Plan,
    velocity: [f64; D],
    dispersion: &Dispersion,
) -> Result<Uniform<D>, RunError> {
    let mut tensor = [[0.0; D]; D];
    let mut own = 0.0;
    match dispersion {
        Dispersion::Constant(triangle) => tensor = triangle_of(triangle)?,
        Dispersion::Velocity { longitudinal, transverse, molecular, .. } => {
            let speed = velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
            own = *molecular;
            for i in 0..D {
                for j in 0..=i {
                    let along = if speed > 0.0 { velocity[i] * velocity[j] / speed } else { 0.0 };
                    tensor[i][j] = (longitudinal - transverse) * along;
                    if i == j {
                        tensor[i][j] += transverse * speed + molecular;
                    }
                }
            }
        }
        Dispersion::Isotropic(_) => return Err(unsound("a dispersion that varies in a uniform medium")),
    }
    let width = std::array::from_fn(|axis| plan.axes[axis].high - plan.axes[axis].low);
    Ok(Uniform { velocity, dispersion: tensor, molecular: own, width })
}

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

fn go<const D: usize, M: Medium<D>>(
    site: &Site<D>,
    medium: M,
    settings: &Settings,
    control: &dyn Control,
    sink: Sink,
) -> Result<Outcome, RunError> {
    let mut clock = Clock::start();
    let dues = schedule(site.plan)?;
    let width = if settings.is_narrow { Width::baseline() } else { Width::widest() };
    let mut run = Run::new(site, medium, width)?;
    let mut loop_clock = Clock::start();
    let mut dues = dues.iter().peekable();
    let n_steps = site.plan.time.n_steps;
    let mut step = 0;
    run.start()?;
    loop {
        while let Some(due) = dues.next_if(|due| due.steps == step) {
            for snapshot in run.observe(due)? {
                loop_clock.away(|| clock.away(|| sink(snapshot)))?;
            }
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
    fn new(site: &'a Site<'a, D>, medium: M, width: Width) -> Result<Self, RunError> {
        let tracker = site.tracker(medium, width)?;
        let releases = site.releases(&tracker)?;
        let units: Vec<f64> = releases.iter().map(|release| release.unit).collect();
        let largest = units.iter().fold(0.0, |a: f64, &b| a.max(b));
        // Particles that are refilled count again and again; sums are over what happened, too.
        let quanta = Quanta::new(largest, MOST_TERMS);
        Ok(Self {
            carriers: site.carriers(),
            book: Book::new(quanta, site.transport.populations.len()),
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
        events.iter().for_each(|event| self.book.note(event));
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
            self.book.note(&Event {
                what: What::Entered { origin },
                population: birth.population,
                mass: self.units[origin],
                t: t + birth.entered * dt,
            });
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
                        events.push(Event { what, population: flock.population, mass, t });
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
        let dt = step_length(time, first);
        let t = first as f64 * time.step;
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
        self.move_flocks(Steps { first, end, t, dt })?;
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

    fn observe(&self, due: &Due) -> Result<Vec<Snapshot>, RunError> {
        let scene =
            Scene { site: self.site, flocks: &self.flocks, units: &self.units, quanta: self.book.quanta };
        due.outputs.iter().map(|&output_idx| scene.observe(output_idx, due.t)).collect()
    }

    /// Per population |inside + left − entered| / entered.
    fn defects(&self) -> Vec<f64> {
        let scene =
            Scene { site: self.site, flocks: &self.flocks, units: &self.units, quanta: self.book.quanta };
        let defect = |population: usize| {
            let account = &self.book.accounts[population];
            let (entered, left) = (account.entered.value(), account.left.value());
            let error = (scene.inside(population) + left - entered).abs();
            if entered > 0.0 { error / entered } else { error }
        };
        (0..self.book.accounts.len()).map(defect).collect()
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

//! The loop over steps of particles that carry mass.
//!
//! Owns the state of such a run and its checks. May use all of the folder. It deliberately works on no single
//! particle: trackers do.

use super::super::clock::Clock;
use super::super::control::{Control, Settings};
use super::super::error::RunError;
use super::super::parallel::Pool;
use super::super::schedule::{Due, schedule};
use super::super::snapshot::{Outcome, Snapshot};
use super::super::track::fates::Chain;
use super::super::track::medium::{Carrier, Medium, spread_at};
use super::super::track::noise::Draws;
use super::super::track::tracker::{Bench, Steps, Tracker};
use super::super::track::walls::Ends;
use super::book::{Book, Event};
use super::flock::{self, Flock};
use super::gate::{Gates, Monitors};
use super::media::Media;
use super::observe::Scene;
use super::order::Order;
use super::parts::Drafts;
use super::reactions::{Reactions, Turn};
use super::release::{Kind, Release};
use super::units::Units;
use super::world::Site;
use crate::chemistry::Work;
use crate::flow::statistics::Statistics;
use crate::maths::exact::{MOST_TERMS, Quanta};
use crate::maths::wide::Width;
use crate::plan::Normals;
use crate::state::stream::{Purpose, Stream};
use std::sync::OnceLock;

/// Steps that a block is taken through before the next one.
const TILE: u64 = 8;

pub type Sink<'a> = &'a mut (dyn FnMut(Snapshot) -> Result<(), RunError> + Send);

/// Everything that lives as long as the run.
pub struct Run<'a, const D: usize, M: Medium<D>> {
    pub site: &'a Site<'a, D>,
    pub tracker: Tracker<D, M>,
    /// What particles become on their way, if anything.
    pub chain: Option<Chain>,
    /// Carriers of what turns, one per kind of dispersion.
    pub paces: Vec<Carrier>,
    pub carriers: Vec<Carrier>,
    pub releases: Vec<Release<D>>,
    pub units: Units,
    pub stream: Stream,
    pub flocks: Vec<Flock<D>>,
    pub book: Book,
    pub quanta: Quanta,
    /// Outputs of what passes places.
    pub gates: Gates,
    pub benches: Pool<Bench<D, M>>,
    pub displacements: u64,
    /// By flock, in the last steps: only to begin with the dearest.
    pub last_displacements: Vec<u64>,
    /// Absent where it does not matter how particles lie in memory.
    order: Option<Order<D>>,
    /// Reactions by kernels, if particles react so.
    pub reactions: Option<Reactions<D>>,
    /// The number of the flow.
    pub period: usize,
}

/// Runs in the medium of each period.
pub fn go<const D: usize, M: Medium<D>>(
    site: &Site<D>,
    media: Media<M>,
    settings: &Settings,
    control: &dyn Control,
    sink: Sink,
) -> Result<Outcome, RunError> {
    let mut clock = Clock::start();
    let calendar = &site.calendar;
    let mut dues = schedule(site.plan, calendar)?;
    let width = if settings.is_narrow { Width::baseline() } else { Width::widest() };
    let mut run = Run::new(site, media, width, &mut dues)?;
    let mut loop_clock = Clock::start();
    let mut dues = dues.iter().peekable();
    let n_steps = calendar.n_steps();
    let mut step = 0;
    run.start()?;
    loop {
        run.enter(step, media)?;
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
        let end = calendar.even_until(step, next_due.min(step + run.tile_length()));
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
        flow: site.flow.as_ref().map(|flow| Statistics::of(site.plan, flow)),
    })
}

impl<'a, const D: usize, M: Medium<D>> Run<'a, D, M> {
    fn new(
        site: &'a Site<'a, D>,
        media: Media<M>,
        width: Width,
        dues: &mut Vec<Due>,
    ) -> Result<Self, RunError> {
        let mut tracker = site.tracker(media(0)?, width)?;
        let period = |axis: usize| match tracker.ends[axis] {
            Ends::Periodic { low, high } => Some((low, high)),
            Ends::Walls(_) => None,
        };
        let periods = std::array::from_fn(period);
        let mut monitors = Monitors { planes: Vec::new(), gaps: Vec::new(), periods };
        let mut gates = Gates::new(site.plan, &site.calendar, dues, &mut monitors);
        (tracker.planes, tracker.gaps) = (monitors.planes, monitors.gaps);
        let mut drafts = Drafts::new(site)?;
        for (number, &from) in site.starts.iter().enumerate() {
            // One medium at a time: they may be large.
            let later = if number == 0 { None } else { Some(media(number)?) };
            let medium = later.as_ref().unwrap_or(&tracker.medium);
            gates.look(from, |station| site.water(medium, station, number));
            drafts.look(site, medium);
        }
        let chain =
            site.transport.decay.as_ref().map(|decay| Chain::new(decay, &site.carriers(), site.plan.seed));
        let mut releases = drafts.releases(site)?;
        // Its particles come from somewhere, too: before anybody counts origins.
        let reactions = Reactions::new(site, &mut releases, width)?;
        let n_populations = site.transport.populations.len();
        let units = Units::new(&releases, n_populations, site.transport.decay.as_ref());
        let doors = releases.iter().map(|release| release.door).collect();
        let n_doors = 1 + site.transport.sources.len() + 2 * D + site.transport.outlets().len();
        let ways = chain.as_ref().map_or_else(Vec::new, Chain::ways);
        let mut book = Book::new(units.clone(), doors, n_doors, n_populations, ways);
        // Particles that are refilled count again and again; sums are over what happened, too.
        let mut quanta = Quanta::new(units.largest(), MOST_TERMS);
        if let Some(reactions) = &reactions {
            quanta = reactions.quanta();
            book = book.with_masses(quanta, n_populations);
        }
        Ok(Self {
            carriers: site.carriers(),
            book,
            quanta,
            gates,
            stream: Stream::new(site.plan.seed, Purpose::Release),
            flocks: Vec::new(),
            benches: Pool::new(),
            displacements: 0,
            last_displacements: Vec::new(),
            order: Order::new(site),
            reactions,
            period: 0,
            site,
            tracker,
            paces: chain.as_ref().map_or_else(Vec::new, |chain| chain.carriers(&site.carriers())),
            chain,
            releases,
            units,
        })
    }

    /// Takes on the flow of a step.
    fn enter(&mut self, step: u64, media: Media<M>) -> Result<(), RunError> {
        let period = self.site.period(step.min(self.site.calendar.n_steps().saturating_sub(1)));
        if period != self.period {
            self.period = period;
            self.tracker.medium = media(period)?;
            self.tracker.drains = self.site.drains(period);
            // What is kept for a thread is of the medium before.
            self.benches = Pool::new();
        }
        Ok(())
    }

    pub fn note(&mut self, events: &[Event]) {
        let n_sides = 2 * D + self.site.transport.outlets().len();
        for event in events {
            self.book.note(event, n_sides);
            if !self.gates.are_none() {
                self.gates.note(event, self.side_of(event.id), self.quanta);
            }
        }
    }

    /// The side that a particle came in through.
    pub fn side_of(&self, id: u64) -> Option<usize> {
        self.releases[flock::origin(id)].door.checked_sub(1 + self.site.transport.sources.len())
    }

    /// Steps that can be taken together from one: what fills a box again looks at every step.
    fn tile_length(&self) -> u64 {
        let fills = |release: &Release<D>| matches!(release.kind, Kind::Filled { .. });
        if self.reactions.is_some() || self.releases.iter().any(fills) { 1 } else { TILE }
    }

    /// Takes everything through steps of equal length.
    fn tile(&mut self, first: u64, end: u64) -> Result<(), RunError> {
        let calendar = &self.site.calendar;
        let before = self.displacements;
        self.advance(Steps { first, end, t: calendar.start(first), dt: calendar.length(first) }, 1.0)?;
        if let Some(order) = &mut self.order {
            order.moved(self.displacements - before, &mut self.flocks);
        }
        Ok(())
    }

    /// Takes everything through steps, or through a part of one.
    fn advance(&mut self, steps: Steps, part: f64) -> Result<(), RunError> {
        let half = self.reactions.as_ref().is_some_and(|reactions| reactions.is_symmetric);
        if half {
            self.react((2 * steps.first, steps.first), (steps.t, 0.5 * steps.dt))?;
        }
        self.empty_boxes(steps.t);
        let newborn = self.births(steps, part);
        self.move_flocks(steps)?;
        self.move_newborn(newborn, steps)?;
        let span = if half { (steps.t + 0.5 * steps.dt, 0.5 * steps.dt) } else { (steps.t, steps.dt) };
        self.react((2 * steps.first + 1, steps.first), span)?;
        flock::gather(&mut self.flocks);
        Ok(())
    }

    /// Reactions by kernels over a time, in one of two turns of a step.
    fn react(&mut self, (turn, step): (u64, u64), span: (f64, f64)) -> Result<(), RunError> {
        let Some(reactions) = &mut self.reactions else { return Ok(()) };
        let stock = (&mut self.flocks, &self.units, &mut self.book);
        let (medium, carriers) = (&self.tracker.medium, &self.carriers);
        let variances = |population: usize, at: [f64; D], dt: f64| {
            std::array::from_fn(|axis| dt * spread_at(medium, &carriers[population], at, axis))
        };
        reactions.react(self.site, &variances, stock, (Turn { turn, step }, span.0, span.1))
    }

    fn scene(&self, t: f64) -> Scene<'_, D> {
        let (mut heaviest, mut quanta) = (self.units.largest(), self.quanta);
        let mut pending = Vec::new();
        if let Some(reactions) = &self.reactions {
            let masses = self.flocks.iter().flat_map(|flock| &flock.masses);
            heaviest = masses.fold(heaviest, |most, &mass| most.max(mass));
            (quanta, pending) = (Quanta::new(heaviest, MOST_TERMS), reactions.pending());
        }
        let (site, flocks, units, book) = (self.site, &self.flocks[..], &self.units, &self.book);
        let width = self.tracker.width;
        let kernels = site.transport.populations.iter().map(|_| OnceLock::new()).collect();
        Scene { site, flocks, units, heaviest, quanta, book, width, t, pending, kernels }
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
        let gaps = std::mem::take(&mut self.tracker.gaps);
        let gates = std::mem::take(&mut self.gates);
        let chain = self.chain.clone();
        self.chain = chain.as_ref().map(|chain| chain.aside(plan.seed));
        let (flocks, book, displacements) = (self.flocks.clone(), self.book.clone(), self.displacements);
        let reactions = self.reactions.clone();
        let steps = Steps {
            first: due.steps,
            end: due.steps + 1,
            t: self.site.calendar.start(due.steps),
            dt: due.fraction * self.site.calendar.length(due.steps),
        };
        let found = self.advance(steps, due.fraction).and_then(|()| self.look(due));
        (self.flocks, self.book, self.displacements) = (flocks, book, displacements);
        self.reactions = reactions;
        (self.tracker.draws, self.tracker.planes, self.tracker.gaps) = (draws, planes, gaps);
        self.gates = gates;
        self.chain = chain;
        found
    }

    fn look(&self, due: &Due) -> Result<Vec<Snapshot>, RunError> {
        let scene = self.scene(due.t);
        due.outputs.iter().map(|&output_idx| scene.observe(output_idx, due.t)).collect()
    }

    /// Per population |inside + left − entered| / entered, with what reactions take and make.
    fn defects(&self) -> Vec<f64> {
        let scene = self.scene(self.site.plan.time.duration);
        let defect = |population: usize| {
            let (entered, left) = self.book.whole(population);
            let made = self.book.net(population);
            let error = (scene.inside(population) + left - entered - made).abs();
            let whole = entered + made.max(0.0);
            if whole > 0.0 { error / whole } else { error }
        };
        (0..self.carriers.len()).map(defect).collect()
    }
}

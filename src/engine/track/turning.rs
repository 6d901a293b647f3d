//! Groups of particles that turn into others on their way.
//!
//! Owns the order of work where states, walking times and walls meet. May use the tracker and `fates`. It
//! deliberately stores no books: what happens is told with the population that it happened to.

use super::fates::{Chain, Close, Draw, Piece, Span, Spent, TooManyTurns};
use super::lanes::{LANES, Lane, Lanes, each};
use super::medium::{Carrier, Medium};
use super::monitors::Crossing;
use super::tracker::{Bench, EARLIEST, Events, MOST_SUB_STEPS, Steps, TooManySubSteps, Tracker};
use super::walls::Exit;

/// Added to the numbers of steps for what particles have become before they are seen first.
const BEFORE: u64 = 1 << 43;

/// What turning particles tell besides.
pub trait Turns: Events {
    /// What happens next happens to a particle of this population.
    fn is_now(&mut self, population: usize);
    /// A particle has taken a way so often.
    fn turned(&mut self, id: u64, way: usize, n: u64);
}

/// What a group walks with while it turns.
#[derive(Clone, Copy)]
pub struct Company<'a> {
    pub chain: &'a Chain,
    /// Carriers of the water's pace, one per kind of dispersion.
    pub carriers: &'a [Carrier],
}

/// When particles of a group begin.
#[derive(Clone, Copy)]
pub struct Newborn<'a> {
    /// Part of the first step that is over.
    pub entered: &'a Lane,
    /// How long they have been there before that, s.
    pub ages: &'a Lane,
}

/// The states of 64 particles, and their ways through one displacement.
pub struct Fates {
    pub states: [usize; LANES],
    /// What is left of the step, s.
    left: Lane,
    /// Times of the displacement, and what counts for the walk, s.
    time: Lane,
    walk: Lane,
    /// The longest walk that criteria allow, s.
    most: Lane,
    /// First uniform numbers of eight displacements, and which ones they are.
    rows: [[f64; LANES]; 8],
    number: Option<u64>,
    pieces: Vec<Piece>,
    /// Pieces of each particle that turns: from, to.
    ranges: [(usize, usize); LANES],
    /// What becomes of a particle at the end; `None` if it is gone.
    ends: [Option<usize>; LANES],
    /// Where a particle was among its pieces as it left.
    cuts: [Option<Spot>; LANES],
}

impl Fates {
    pub fn new() -> Box<Self> {
        Box::new(Self {
            states: [0; LANES],
            left: [0.0; LANES],
            time: [0.0; LANES],
            walk: [0.0; LANES],
            most: [f64::INFINITY; LANES],
            rows: [[0.5; LANES]; 8],
            number: None,
            pieces: Vec::new(),
            ranges: [(0, 0); LANES],
            ends: [None; LANES],
            cuts: [None; LANES],
        })
    }

    /// One bit per particle that has something of the step left.
    fn going(&self) -> u64 {
        (0..LANES).fold(0, |mask, lane| mask | u64::from(self.left[lane] > 0.0) << lane)
    }

    /// The dispersion that most of these particles have.
    fn kind(&self, chain: &Chain, going: u64) -> usize {
        let mut counts = [0_u8; LANES];
        for lane in (0..LANES).filter(|lane| going >> lane & 1 == 1) {
            // Kinds beyond the number of lanes share a count; the choice is of pace, not of law.
            if let Some(kind) = chain.kind(self.states[lane]) {
                counts[kind % LANES] += 1;
            }
        }
        let most = counts.iter().max().copied().unwrap_or(0);
        let is_most = |lane: &usize| {
            going >> lane & 1 == 1
                && chain.kind(self.states[*lane]).is_some_and(|kind| counts[kind % LANES] == most)
        };
        (0..LANES).find(is_most).and_then(|lane| chain.kind(self.states[lane])).unwrap_or(0)
    }

    /// What becomes of each particle in one displacement.
    fn draw(
        &mut self,
        chain: &Chain,
        ids: &[u64; LANES],
        (number, kind, going): (u64, usize, u64),
    ) -> Result<(), usize> {
        self.pieces.clear();
        self.cuts = [None; LANES];
        let row = self.rows[(number % 8) as usize];
        for lane in 0..LANES {
            (self.time[lane], self.walk[lane]) = (0.0, 0.0);
            let state = self.states[lane];
            self.ranges[lane] = (self.pieces.len(), self.pieces.len());
            self.ends[lane] = Some(state);
            let waits = chain.kind(state).is_some_and(|own| own != kind);
            if going >> lane & 1 == 0 || waits {
                continue;
            }
            let span = Span { left: self.left[lane], most: self.most[lane], kind: Some(kind) };
            let mut spent = chain.stay(state, span);
            // 1 − e^{−kt} is less than kt.
            if row[lane] <= chain.rate(state) * spent.time {
                let draw = Draw { id: ids[lane], number };
                let found = chain.follow(draw, state, span, row[lane], &mut self.pieces);
                let (end, becomes) = found.map_err(|TooManyTurns| lane)?;
                (spent, self.ends[lane]) = (end, becomes);
                self.ranges[lane].1 = self.pieces.len();
            }
            (self.time[lane], self.walk[lane]) = (spent.time, spent.walk);
            self.left[lane] = if spent.time >= self.left[lane] { 0.0 } else { self.left[lane] - spent.time };
        }
        Ok(())
    }

    /// Where a particle was when it had walked so long, and in which state.
    fn at(&self, chain: &Chain, lane: usize, draw: Draw, walk: f64) -> Spot {
        let (from, to) = self.ranges[lane];
        let state = self.states[lane];
        let mut before = Spent::default();
        if from == to {
            let time = chain.time_of(state, walk).min(self.time[lane]);
            return Spot { time, state, over: 0, trips: 0 };
        }
        let mut last = Spot { time: self.time[lane], state, over: 0, trips: 0 };
        for (over, piece) in self.pieces[from..to].iter().enumerate() {
            let whole = piece.end.walk - before.walk;
            if whole > 0.0 {
                let part = ((walk - before.walk) / whole).clamp(0.0, 1.0);
                let (state, trips) = chain.amid(draw, piece, part);
                let time = before.time + part * (piece.end.time - before.time);
                last = Spot { time, state, over, trips };
                if piece.end.walk >= walk {
                    break;
                }
            }
            before = piece.end;
        }
        last
    }

    /// Takes what has become of each particle, and tells it. `gone` are those that had left before.
    fn settle<const D: usize>(&mut self, gone: u64, lanes: &mut Lanes<D>, events: &mut impl Turns) {
        for lane in (0..lanes.n).filter(|lane| gone >> lane & 1 == 0) {
            let (from, end) = self.ranges[lane];
            let to = self.cuts[lane].map_or(end, |cut| (from + cut.over).min(end));
            let id = lanes.ids[lane];
            self.pieces[from..to].iter().for_each(|piece| tell(id, piece, events));
            if let Some(cut) = self.cuts[lane]
                && let Some(Piece { state, close: Close::Trips { ways, .. }, .. }) =
                    self.pieces[to..end].first()
            {
                events.turned(id, ways[0], cut.trips + u64::from(cut.state != *state));
                events.turned(id, ways[1], cut.trips);
            }
            match self.ends[lane] {
                Some(state) => self.states[lane] = state,
                // It is the end of the particle unless it has left before.
                None => lanes.gone |= 1 << lane,
            }
        }
    }

    /// What particles have become in the time before they are seen first.
    fn grow<const D: usize>(
        &mut self,
        chain: &Chain,
        step: u64,
        ages: &Lane,
        lanes: &mut Lanes<D>,
        events: &mut impl Turns,
    ) -> Result<(), TooManySubSteps> {
        for lane in (0..lanes.n).filter(|lane| ages[*lane] > 0.0) {
            let draw = Draw { id: lanes.ids[lane], number: BEFORE + step };
            let span = Span { left: ages[lane], most: f64::INFINITY, kind: None };
            self.pieces.clear();
            let found = chain.follow(draw, self.states[lane], span, chain.early(draw), &mut self.pieces);
            let (_, becomes) = found.map_err(|TooManyTurns| TooManySubSteps { id: draw.id, step })?;
            self.pieces.iter().for_each(|piece| tell(draw.id, piece, events));
            match becomes {
                Some(state) => self.states[lane] = state,
                None => lanes.gone |= 1 << lane,
            }
        }
        Ok(())
    }
}

/// Tells the turns of a piece.
fn tell(id: u64, piece: &Piece, events: &mut impl Turns) {
    match piece.close {
        Close::End => {}
        Close::Way(way) => events.turned(id, way, 1),
        Close::Trips { ways, n, .. } => ways.into_iter().for_each(|way| events.turned(id, way, n)),
    }
}

/// A moment on the way of a particle.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Spot {
    /// Since the displacement began, s.
    time: f64,
    state: usize,
    /// Pieces that are over.
    over: usize,
    /// Round trips of the next one that are over.
    trips: u64,
}

/// Tells what happens on a displacement with its time and the population at that time.
struct Told<'a, E> {
    company: Company<'a>,
    fates: &'a mut Fates,
    events: &'a mut E,
    /// Number of the displacement, and when it began, s.
    number: u64,
    start: Lane,
    earliest: f64,
}

impl<E: Turns> Told<'_, E> {
    /// Where a particle is after so much of its walk, and when.
    fn place(&mut self, id: u64, lane: usize, walk: f64) -> (f64, Spot) {
        let draw = Draw { id, number: self.number };
        let spot = self.fates.at(self.company.chain, lane, draw, walk);
        self.events.is_now(spot.state);
        ((self.start[lane] + spot.time).max(self.earliest), spot)
    }
}

impl<E: Turns> Events for Told<'_, E> {
    fn left(&mut self, id: u64, exit: Exit, walk: f64) {
        let (t, spot) = self.place(id, exit.lane, walk);
        self.fates.cuts[exit.lane] = Some(spot);
        self.events.left(id, exit, t);
    }

    fn crossed(&mut self, id: u64, plane: usize, crossing: Crossing, walk: f64) {
        let (t, _) = self.place(id, crossing.lane, walk);
        self.events.crossed(id, plane, crossing, t);
    }
}

impl<const D: usize, M: Medium<D>> Tracker<D, M> {
    /// Takes the group of the bench through its steps while its particles turn; they begin in the states of
    /// `bench.fates`, and end there.
    #[inline(always)]
    pub fn advance_turning(
        &self,
        company: Company,
        steps: Steps,
        newborn: Option<Newborn>,
        bench: &mut Bench<D, M>,
        events: &mut impl Turns,
    ) -> Result<(), TooManySubSteps> {
        let Some(mut fates) = bench.fates.take() else { return Ok(()) };
        bench.normals.clear();
        fates.number = None;
        let mut result = Ok(());
        if let Some(newborn) = newborn {
            result = fates.grow(company.chain, steps.first, newborn.ages, &mut bench.lanes, events);
        }
        let mut late = newborn.map(|newborn| newborn.entered);
        for step in steps.first..steps.end {
            let t = steps.t + (step - steps.first) as f64 * steps.dt;
            fates.left = [steps.dt; LANES];
            if let Some(entered) = late.take() {
                fates.left = entered.map(|entered| steps.dt * (1.0 - entered));
            }
            let moment = Steps { first: step, end: step + 1, t, dt: steps.dt };
            result = result.and_then(|()| self.step_turning(company, moment, &mut fates, bench, events));
            if result.is_err() || bench.lanes.gone & bench.lanes.occupied() == bench.lanes.occupied() {
                break;
            }
        }
        bench.fates = Some(fates);
        result
    }

    /// One step, in displacements that end where the walk is long enough or has another dispersion.
    #[inline(always)]
    fn step_turning(
        &self,
        company: Company,
        Steps { first: step, t, dt, .. }: Steps,
        fates: &mut Fates,
        bench: &mut Bench<D, M>,
        events: &mut impl Turns,
    ) -> Result<(), TooManySubSteps> {
        let chain = company.chain;
        let is_whole = self.criteria.is_none() && !self.is_cut();
        let is_single = is_whole && company.carriers.len() == 1;
        for sub_step in 0..MOST_SUB_STEPS {
            let going = fates.going() & bench.lanes.occupied() & !bench.lanes.gone;
            if going == 0 {
                return Ok(());
            }
            let number = if is_single { step } else { step * MOST_SUB_STEPS + sub_step };
            let kind = fates.kind(chain, going);
            let carrier = &company.carriers[kind];
            self.medium.look(carrier, &bench.lanes.positions, &mut bench.look);
            if !is_whole {
                let at = (&bench.look, &bench.lanes.positions);
                self.limit(carrier, self.criteria.as_ref(), at, dt, &mut fates.most);
            }
            if fates.number != Some(number / 8) {
                fates.number = Some(number / 8);
                chain.first(self.width, &bench.lanes.ids, number / 8, &mut fates.rows);
            }
            let start = each(&fates.left, |left| t + (dt - left));
            let drawn = fates.draw(chain, &bench.lanes.ids, (number, kind, going));
            drawn.map_err(|lane| TooManySubSteps { id: bench.lanes.ids[lane], step })?;
            bench.displacements += u64::from(going.count_ones());
            let gone = bench.lanes.gone;
            if fates.walk.iter().any(|walk| *walk > 0.0) {
                bench.leap.assign(&fates.walk);
                let earliest = t + EARLIEST * dt;
                let mut told = Told { company, fates, events, number, start, earliest };
                // Times are those of the walk: what is told is placed by the pieces.
                self.displace(carrier, number, (&[0.0; LANES], f64::NEG_INFINITY), bench, &mut told);
            }
            fates.settle(gone, &mut bench.lanes, events);
        }
        let going = fates.going() & bench.lanes.occupied() & !bench.lanes.gone;
        match going {
            0 => Ok(()),
            _ => Err(TooManySubSteps { id: bench.lanes.ids[going.trailing_zeros() as usize], step }),
        }
    }
}

//! What particles become on their way by reactions of first order, and when.
//!
//! Owns the law of waiting times and the record of a displacement's way through the states. May use carriers and
//! random streams. It deliberately moves nothing: it says how much of a time counts for the walk.

use super::lanes::LANES;
use super::medium::Carrier;
use super::trips::{self, Numbers, Stop};
use crate::maths::scalar::log1p;
use crate::maths::wide::Width;
use crate::plan::transport::Decay;
use crate::state::stream::{Purpose, Stream};

/// Turns of one particle in one displacement that are followed; round trips between two states count once.
pub const MOST_TURNS: u64 = 1 << 20;
/// A displacement is cut where it is longer than what is allowed by more than this.
const SLIVER: f64 = 1.0001;

/// From one population to another by a reaction, or to nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Way {
    pub reaction: usize,
    pub from: usize,
    pub to: Option<usize>,
}

/// The states of particles, one per population, and the ways between them.
///
/// - Equation: `P(wait > t) = e^{−k t}`, `k = Σ k_r` over the reactions of the state; way `w` of reaction `r` is
///   taken with the chance `p_w k_r/k`. The walk goes on for `τ = Σ t_k/R_k` over the states on the way.
/// - Symbols: `t_k` time in state `k`, `R_k` retardation there (`1/R = 0` if it is immobile).
/// - Range: any step: states and times are exact in law, and so is a displacement over `τ` wherever the walk over a
///   step of that length is, as velocity and dispersion both are over `R`.
/// - Source: methods, section 1.7, whose probabilities, means and variances are those of this law.
/// - Shape: one particle and displacement.
#[derive(Debug, Clone)]
pub struct Chain {
    states: Vec<State>,
    ways: Vec<Way>,
    waits: Stream,
    turns: Stream,
}

#[derive(Debug, Clone)]
struct State {
    /// Part of a time that counts for the walk.
    mobility: f64,
    /// States of one kind have the same dispersion; `None` rests and fits all of them.
    kind: Option<usize>,
    /// Chance per time to turn, 1/s.
    rate: f64,
    /// Numbers of ways, each with the share of all turns up to it.
    ways: Vec<(usize, f64)>,
    /// The state that it goes to and fro with, and the ways there and back.
    mate: Option<(usize, [usize; 2])>,
}

/// A part of a displacement that is spent in one state, or to and fro between two.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    pub state: usize,
    /// What was over at its end.
    pub end: Spent,
    pub close: Close,
}

/// How a piece ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Close {
    /// With the displacement.
    End,
    /// By a way.
    Way(usize),
    /// After so many round trips by these two ways, in the state that it began in.
    Trips { other: usize, ways: [usize; 2], n: u64 },
}

/// Time since a displacement began.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Spent {
    /// s
    pub time: f64,
    /// What of it counted for the walk, s.
    pub walk: f64,
}

/// How long a displacement may be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// What is left of the step, s.
    pub left: f64,
    /// The most that may count for the walk, s.
    pub most: f64,
    /// The dispersion that the walk has; any if nothing walks.
    pub kind: Option<usize>,
}

/// A particle and the number of its displacement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Draw {
    pub id: u64,
    pub number: u64,
}

/// A particle turned more often than is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct TooManyTurns;

impl Chain {
    /// The reactions of a plan whose populations walk as `carriers`.
    pub fn new(decay: &Decay, carriers: &[Carrier], seed: u64) -> Self {
        let mut kinds: Vec<Option<f64>> = Vec::new();
        let mut kind = |carrier: &Carrier| {
            let number = kinds.iter().position(|other| *other == carrier.molecular);
            (carrier.mobility > 0.0).then(|| {
                number.unwrap_or_else(|| {
                    kinds.push(carrier.molecular);
                    kinds.len() - 1
                })
            })
        };
        let mut ways = Vec::new();
        let mut states = Vec::new();
        for (population, carrier) in carriers.iter().enumerate() {
            let own = decay.reactions.iter().enumerate().filter(|(_, turn)| turn.population == population);
            let rate: f64 = own.clone().map(|(_, turn)| turn.rate).sum();
            let mut state =
                State { mobility: carrier.mobility, kind: kind(carrier), rate, ways: Vec::new(), mate: None };
            let mut share = 0.0;
            for (reaction, turn) in own {
                let part = turn.rate / rate;
                let gone = 1.0 - turn.outcomes.iter().map(|(_, chance)| chance).sum::<f64>();
                let gone = (gone > 1e-12).then_some((None, gone));
                let made = turn.outcomes.iter().map(|&(to, chance)| (Some(to), chance));
                for (to, chance) in made.chain(gone) {
                    share += part * chance;
                    state.ways.push((ways.len(), share));
                    ways.push(Way { reaction, from: population, to });
                }
            }
            states.push(state);
        }
        mates(&mut states, &ways);
        Self {
            states,
            ways,
            waits: Stream::new(seed, Purpose::Wait),
            turns: Stream::new(seed, Purpose::Turn),
        }
    }

    /// The same with draws of its own, for a look ahead.
    pub fn aside(&self, seed: u64) -> Self {
        Self {
            waits: Stream::new(seed, Purpose::BridgeWait),
            turns: Stream::new(seed, Purpose::BridgeTurn),
            ..self.clone()
        }
    }

    pub fn ways(&self) -> Vec<Way> {
        self.ways.clone()
    }

    /// Whether particles of a population turn into others.
    pub fn turns(&self, population: usize) -> bool {
        self.states[population].rate > 0.0
    }

    pub fn n_ways(&self) -> usize {
        self.ways.len()
    }

    pub fn rate(&self, state: usize) -> f64 {
        self.states[state].rate
    }

    /// Kinds of dispersion: numbers below this.
    fn n_kinds(&self) -> usize {
        self.states.iter().filter_map(|state| state.kind).max().map_or(1, |kind| kind + 1)
    }

    /// The dispersion of a state; `None` if it rests.
    pub fn kind(&self, state: usize) -> Option<usize> {
        self.states[state].kind
    }

    /// Carriers of the water's pace, one for each kind of dispersion.
    pub fn carriers(&self, carriers: &[Carrier]) -> Vec<Carrier> {
        let of = |kind: usize| {
            let own = self.states.iter().position(|state| state.kind == Some(kind));
            Carrier { mobility: 1.0, molecular: own.and_then(|own| carriers[own].molecular) }
        };
        (0..self.n_kinds()).map(of).collect()
    }

    /// First numbers of 64 particles in eight displacements.
    pub fn first(&self, width: Width, ids: &[u64; LANES], number: u64, rows: &mut [[f64; LANES]; 8]) {
        self.waits.uniforms_each(width, ids, number, rows);
    }

    /// Time that a walk takes in a state, s.
    pub fn time_of(&self, state: usize, walk: f64) -> f64 {
        let mobility = self.states[state].mobility;
        if mobility > 0.0 { walk / mobility } else { 0.0 }
    }

    /// First number of what is no displacement.
    pub fn early(&self, draw: Draw) -> f64 {
        // Turns have the blocks up to a quarter of this one.
        let block = draw.number.wrapping_mul(MOST_TURNS).wrapping_add(MOST_TURNS / 2);
        self.turns.uniforms_of(draw.id, block)[0]
    }

    /// What a displacement is without a turn.
    pub fn stay(&self, state: usize, span: Span) -> Spent {
        let mobility = self.states[state].mobility;
        let walk = mobility * span.left;
        if walk > SLIVER * span.most {
            return Spent { time: span.most / mobility, walk: span.most };
        }
        Spent { time: span.left, walk }
    }

    /// The way of a particle through the states, piece by piece; where it ends: at the end of the span, where
    /// dispersion changes, or with the particle. `first` is the first uniform number.
    pub fn follow(
        &self,
        draw: Draw,
        mut state: usize,
        span: Span,
        first: f64,
        pieces: &mut Vec<Piece>,
    ) -> Result<(Spent, Option<usize>), TooManyTurns> {
        let mut spent = Spent::default();
        let mut uniform = first;
        let mut numbers = Numbers::new(&self.turns, draw.id, draw.number.wrapping_mul(MOST_TURNS));
        let mut next = Next::Any;
        for _ in 0..MOST_TURNS {
            let own = &self.states[state];
            let rest = Span { left: span.left - spent.time, most: span.most - spent.walk, ..span };
            if next == Next::Any
                && let Some(trips) = self.trips(state, rest, &mut numbers)
            {
                spent = Spent { time: spent.time + trips.spent.time, walk: spent.walk + trips.spent.walk };
                pieces.push(Piece { state, end: spent, close: trips.close });
                next = trips.next;
                // What is left of the wait is as long as it was.
                uniform = numbers.uniform();
                continue;
            }
            let stay = self.stay(state, rest);
            let wait = if own.rate > 0.0 { -log1p(-uniform) / own.rate } else { f64::INFINITY };
            if wait >= stay.time {
                let is_whole = stay.time == rest.left;
                let time = if is_whole { span.left } else { spent.time + stay.time };
                let end = Spent { time, walk: spent.walk + stay.walk };
                pieces.push(Piece { state, end, close: Close::End });
                return Ok((end, Some(state)));
            }
            spent.time += wait;
            spent.walk += own.mobility * wait;
            let way = self.choose(state, &mut next, numbers.uniform());
            pieces.push(Piece { state, end: spent, close: Close::Way(way) });
            let Some(to) = self.ways[way].to else { return Ok((spent, None)) };
            state = to;
            if span.kind.is_some() && self.states[to].kind.is_some_and(|kind| Some(kind) != span.kind) {
                return Ok((spent, Some(to)));
            }
            uniform = numbers.uniform();
        }
        Err(TooManyTurns)
    }

    /// Round trips to the state that most turns go to, if many of them surely fit.
    fn trips(&self, state: usize, rest: Span, numbers: &mut Numbers) -> Option<Trips> {
        let (other, ways) = self.states[state].mate?;
        let fits = |kind: usize| span_has(rest, kind);
        if !self.states[other].kind.is_none_or(fits) {
            return None;
        }
        let stop = |own: usize, way: usize| Stop {
            rate: self.states[own].rate,
            share: self.states[own].share_of(way),
            mobility: self.states[own].mobility,
        };
        let stops = [stop(state, ways[0]), stop(other, ways[1])];
        let n = trips::fitting(stops, rest.left, rest.most)?;
        let made = trips::made(stops, n, numbers);
        let next = match made < n {
            false => Next::Any,
            true if numbers.uniform() * trips::elsewhere(stops) < 1.0 - stops[0].share => Next::Not(other),
            true => Next::Through { other, back: state },
        };
        let mut times = [0.0; 2];
        if made >= 1.0 {
            times = stops.map(|stop| numbers.gamma(made) / stop.rate);
        }
        let time = (times[0] + times[1]).min(rest.left);
        let walk = (times[0] * stops[0].mobility + times[1] * stops[1].mobility).min(rest.most);
        Some(Trips { spent: Spent { time, walk }, close: Close::Trips { other, ways, n: made as u64 }, next })
    }

    /// The way of a turn; what is known of it is used up.
    fn choose(&self, state: usize, next: &mut Next, uniform: f64) -> usize {
        let ways = &self.states[state].ways;
        let (wanted, unwanted, then) = match *next {
            Next::Any => {
                let at = ways.partition_point(|(_, share)| *share < uniform);
                return ways[at.min(ways.len() - 1)].0;
            }
            Next::Not(to) => (None, Some(to), Next::Any),
            Next::Through { other, back } => (Some(other), None, Next::Not(back)),
        };
        *next = then;
        let fits = |way: usize| {
            let to = self.ways[way].to;
            wanted.is_none_or(|wanted| to == Some(wanted)) && unwanted.is_none_or(|not| to != Some(not))
        };
        let share = |idx: usize| ways[idx].1 - if idx == 0 { 0.0 } else { ways[idx - 1].1 };
        let whole: f64 = (0..ways.len()).filter(|&idx| fits(ways[idx].0)).map(share).sum();
        let mut sum = 0.0;
        let mut last = ways[0].0;
        for idx in (0..ways.len()).filter(|&idx| fits(ways[idx].0)) {
            sum += share(idx);
            last = ways[idx].0;
            if sum >= uniform * whole {
                break;
            }
        }
        last
    }

    /// Where a particle is in the midst of round trips, after a part of them: in which of the two states, and after
    /// how many whole ones.
    ///
    /// - Equation: chance of the first: `μ₁/R₁ / (μ₁/R₁ + μ₂/R₂)`, `μ = 1/k`; `⌊f n⌋` trips.
    /// - Symbols: `f` part of the walk.
    /// - Range: 16 trips and more.
    /// - Source: waiting times in any order are equally likely.
    /// - Shape: one particle; right to one part in the number of trips.
    pub fn amid(&self, draw: Draw, piece: &Piece, part: f64) -> (usize, u64) {
        let Close::Trips { other, n, .. } = piece.close else { return (piece.state, 0) };
        let pace = |state: usize| self.states[state].mobility / self.states[state].rate;
        let (own, its) = (pace(piece.state), pace(other));
        let block = draw.number.wrapping_mul(MOST_TURNS).wrapping_add(MOST_TURNS / 2 + 1);
        let uniform = self.turns.uniforms_of(draw.id, block)[0];
        let state = if uniform * (own + its) < own { piece.state } else { other };
        (state, ((part * n as f64) as u64).min(n.saturating_sub(1)))
    }
}

/// Whether states of a kind go on within a span.
fn span_has(span: Span, kind: usize) -> bool {
    span.kind.is_none_or(|own| own == kind)
}

/// What is known of the next turn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Next {
    Any,
    /// Not to this state.
    Not(usize),
    /// To one state, and from there not back.
    Through {
        other: usize,
        back: usize,
    },
}

/// Round trips that were made.
struct Trips {
    spent: Spent,
    close: Close,
    next: Next,
}

impl State {
    /// Share of all turns that go by a way.
    fn share_of(&self, way: usize) -> f64 {
        let Some(idx) = self.ways.iter().position(|(own, _)| *own == way) else { return 0.0 };
        // The last one goes up to 1, whatever the sum of the others is rounded to.
        let up_to = if idx + 1 == self.ways.len() { 1.0 } else { self.ways[idx].1 };
        up_to - if idx == 0 { 0.0 } else { self.ways[idx - 1].1 }
    }
}

/// For each state the one that it goes to and fro with most, and the two ways.
fn mates(states: &mut [State], ways: &[Way]) {
    let between = |from: usize, to: usize| {
        let mut own = ways.iter().enumerate().filter(|(_, way)| way.from == from && way.to == Some(to));
        match (own.next(), own.next()) {
            (Some((way, _)), None) => Some(way),
            // By two ways it is not known which.
            _ => None,
        }
    };
    for state in 0..states.len() {
        let mut best: Option<(f64, usize, [usize; 2])> = None;
        for other in (0..states.len()).filter(|other| *other != state) {
            let (Some(there), Some(back)) = (between(state, other), between(other, state)) else { continue };
            let chance = states[state].share_of(there) * states[other].share_of(back);
            if best.is_none_or(|(least, ..)| chance > least) {
                best = Some((chance, other, [there, back]));
            }
        }
        states[state].mate = best.map(|(_, other, ways)| (other, ways));
    }
}

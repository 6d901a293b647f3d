//! What entered, what left, and what is there.
//!
//! Owns the books of a run. May use the tracker's words. It deliberately keeps no particle and sums no mass:
//! it counts particles of equal mass, so that nothing is rounded.

use super::super::track::fates::Way;
use super::super::track::monitors::Crossing;
use super::super::track::tracker::Events;
use super::super::track::turning::Turns;
use super::super::track::walls::Exit;
use super::flock;
use super::total::Total;
use super::units::Units;
use crate::maths::exact::{Quanta, Sum};

/// What can happen to a particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum What {
    Entered {
        origin: usize,
    },
    Left {
        side: usize,
        patch: usize,
    },
    Crossed {
        plane: usize,
        is_forward: bool,
    },
    /// Taken out by what fills its place again.
    Replaced {
        origin: usize,
    },
}

/// Something that happened, with the mass it happened to.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    pub what: What,
    pub population: usize,
    pub id: u64,
    /// mol or kg
    pub mass: f64,
    /// s
    pub t: f64,
}

/// Events of a group while it moves.
pub struct Log<'a> {
    /// What those are that something happens to.
    pub population: usize,
    pub units: &'a Units,
    /// Numbers and masses of those that have one of their own.
    pub own: (&'a [u64], &'a [f64]),
    pub events: &'a mut Vec<Event>,
    /// Per way and origin what has turned; empty as long as nothing has.
    pub turned: &'a mut Vec<u128>,
    pub n_ways: usize,
}

impl Log<'_> {
    fn note(&mut self, id: u64, what: What, t: f64) {
        let (ids, masses) = self.own;
        let own = ids.iter().position(|other| *other == id).map(|at| masses[at]);
        let mass = own.unwrap_or_else(|| self.units.of(self.population, id));
        self.events.push(Event { what, population: self.population, id, mass, t });
    }
}

impl Events for Log<'_> {
    fn left(&mut self, id: u64, exit: Exit, t: f64) {
        self.note(id, What::Left { side: exit.side, patch: exit.patch }, t);
    }

    fn crossed(&mut self, id: u64, plane: usize, crossing: Crossing, t: f64) {
        self.note(id, What::Crossed { plane, is_forward: crossing.is_forward }, t);
    }
}

impl Turns for Log<'_> {
    fn is_now(&mut self, population: usize) {
        self.population = population;
    }

    fn turned(&mut self, id: u64, way: usize, times: u64) {
        let n = self.units.n_origins();
        if self.turned.is_empty() {
            self.turned.resize(self.n_ways * n, 0);
        }
        self.turned[way * n + flock::origin(id)] += u128::from(times);
    }
}

/// The books of all populations: numbers of particles by where they are from and what they came through.
#[derive(Debug, Clone)]
pub struct Book {
    units: Units,
    /// The door of an origin: 0 is the start, then sources, then sides.
    doors: Vec<usize>,
    n_doors: usize,
    /// Per population and origin.
    entered: Vec<u64>,
    /// Per population, door and origin.
    left: Vec<u64>,
    /// What turns into what.
    ways: Vec<Way>,
    /// Per way and origin.
    turned: Vec<u128>,
    /// Where particles have masses of their own.
    own: Option<Own>,
}

/// Sums of masses that reactions have changed.
#[derive(Debug, Clone)]
struct Own {
    quanta: Quanta,
    /// Per population and door.
    left: Vec<Sum>,
    /// Per population: what reactions made and took.
    reacted: Vec<[Total; 2]>,
}

impl Book {
    /// `doors` by origin; sides, and wells behind them, are the last `n_sides` of all doors.
    pub fn new(
        units: Units,
        doors: Vec<usize>,
        n_doors: usize,
        n_populations: usize,
        ways: Vec<Way>,
    ) -> Self {
        let n = units.n_origins();
        Self {
            units,
            doors,
            n_doors,
            entered: vec![0; n_populations * n],
            left: vec![0; n_populations * n_doors * n],
            turned: vec![0; ways.len() * n],
            ways,
            own: None,
        }
    }

    /// The books of particles whose masses change.
    pub fn with_masses(mut self, quanta: Quanta, n_populations: usize) -> Self {
        let left = vec![Sum::default(); n_populations * self.n_doors];
        self.own = Some(Own { quanta, left, reacted: vec![Default::default(); n_populations] });
        self
    }

    /// What reactions have made of a population, and what they have taken, in a step.
    pub fn react(&mut self, population: usize, made: f64, taken: f64) {
        if let Some(own) = &mut self.own {
            own.reacted[population][0].add(made);
            own.reacted[population][1].add(taken);
        }
    }

    pub fn note(&mut self, event: &Event, n_sides: usize) {
        let n = self.units.n_origins();
        let origin = flock::origin(event.id);
        let door = match event.what {
            What::Entered { .. } => {
                self.entered[event.population * n + origin] += 1;
                return;
            }
            What::Left { side, .. } => self.n_doors - n_sides + side,
            What::Replaced { origin } => self.doors[origin],
            What::Crossed { .. } => return,
        };
        self.left[(event.population * self.n_doors + door) * n + origin] += 1;
        if let Some(own) = &mut self.own {
            own.quanta.add(&mut own.left[event.population * self.n_doors + door], event.mass);
        }
    }

    /// Adds what has turned, per way and origin.
    pub fn turn(&mut self, counts: &[u128]) {
        self.turned.iter_mut().zip(counts).for_each(|(sum, n)| *sum += n);
    }

    pub fn n_doors(&self) -> usize {
        self.n_doors
    }

    /// What came through a door since the start.
    pub fn entered(&self, population: usize, door: usize) -> f64 {
        let n = self.units.n_origins();
        let counts = self.entered[population * n..][..n].iter().zip(&self.doors);
        let own: Vec<u64> = counts.map(|(&n, &other)| if other == door { n } else { 0 }).collect();
        self.units.sum(population, own.iter().map(|&n| n as f64))
    }

    /// What went through a door since the start.
    pub fn left(&self, population: usize, door: usize) -> f64 {
        if let Some(own) = &self.own {
            return own.left[population * self.n_doors + door].value();
        }
        let n = self.units.n_origins();
        let counts = &self.left[(population * self.n_doors + door) * n..][..n];
        self.units.sum(population, counts.iter().map(|&n| n as f64))
    }

    /// What a reaction made of a population since the start, and what it took.
    pub fn turned(&self, population: usize, reaction: usize) -> (f64, f64) {
        if let Some(own) = &self.own {
            let [made, taken] = own.reacted[population].map(Total::value);
            return (made, taken);
        }
        let n = self.units.n_origins();
        let mut counts = [vec![0_u128; n], vec![0_u128; n]];
        for (idx, way) in self.ways.iter().enumerate().filter(|(_, way)| way.reaction == reaction) {
            let is_of = [way.to == Some(population), way.from == population];
            for (sums, _) in counts.iter_mut().zip(is_of).filter(|(_, is_of)| *is_of) {
                sums.iter_mut().zip(&self.turned[idx * n..][..n]).for_each(|(sum, count)| *sum += count);
            }
        }
        let [made, taken] = counts.map(|counts| self.units.sum(population, counts.iter().map(|&n| n as f64)));
        (made, taken)
    }

    /// What all reactions made of a population less what they took: particles are counted first, as many may have
    /// gone to and fro.
    pub fn net(&self, population: usize) -> f64 {
        if let Some(own) = &self.own {
            let [made, taken] = own.reacted[population].map(Total::value);
            return made - taken;
        }
        let n = self.units.n_origins();
        let mut net = vec![0_i128; n];
        for (idx, way) in self.ways.iter().enumerate() {
            let sign = i128::from(way.to == Some(population)) - i128::from(way.from == population);
            net.iter_mut().zip(&self.turned[idx * n..][..n]).for_each(|(sum, &n)| *sum += sign * n as i128);
        }
        self.units.sum(population, net.iter().map(|&n| n as f64))
    }

    pub fn n_reactions(&self) -> usize {
        // Masses change by all reactions together.
        let of_masses = usize::from(self.own.is_some());
        self.ways.iter().map(|way| way.reaction + 1).max().unwrap_or(of_masses)
    }

    /// Everything that came, and everything that went, through doors.
    pub fn whole(&self, population: usize) -> (f64, f64) {
        let doors = 0..self.n_doors;
        let entered = doors.clone().map(|door| self.entered(population, door)).sum();
        (entered, doors.map(|door| self.left(population, door)).sum())
    }
}

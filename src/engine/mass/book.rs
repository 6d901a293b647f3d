//! What entered, what left, and what is there.
//!
//! Owns the books of a run. May use the tracker's words. It deliberately keeps no particle and sums no mass:
//! it counts particles of equal mass, so that nothing is rounded.

use super::super::track::monitors::Crossing;
use super::super::track::tracker::Events;
use super::super::track::walls::Exit;
use super::flock;

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

/// Events of one population while a group moves.
pub struct Log<'a> {
    pub population: usize,
    /// Mass of a particle by origin.
    pub units: &'a [f64],
    pub events: &'a mut Vec<Event>,
}

impl Log<'_> {
    fn note(&mut self, id: u64, what: What, t: f64) {
        let mass = self.units[flock::origin(id)];
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

/// The books of all populations: numbers of particles by where they are from and what they came through.
#[derive(Debug, Clone)]
pub struct Book {
    /// Mass of a particle by origin.
    units: Vec<f64>,
    /// The door of an origin: 0 is the start, then sources, then sides.
    doors: Vec<usize>,
    n_doors: usize,
    /// Per population and origin.
    entered: Vec<u64>,
    /// Per population, door and origin.
    left: Vec<u64>,
}

impl Book {
    /// `doors` by origin; sides, and wells behind them, are the last `n_sides` of all doors.
    pub fn new(units: Vec<f64>, doors: Vec<usize>, n_doors: usize, n_populations: usize) -> Self {
        let n = units.len();
        Self {
            units,
            doors,
            n_doors,
            entered: vec![0; n_populations * n],
            left: vec![0; n_populations * n_doors * n],
        }
    }

    pub fn note(&mut self, event: &Event, n_sides: usize) {
        let n = self.units.len();
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
    }

    pub fn n_doors(&self) -> usize {
        self.n_doors
    }

    /// Mass of so many particles of each origin.
    pub fn mass(&self, counts: &[u64]) -> f64 {
        counts.iter().zip(&self.units).map(|(&n, unit)| n as f64 * unit).sum()
    }

    /// What came through a door since the start.
    pub fn entered(&self, population: usize, door: usize) -> f64 {
        let n = self.units.len();
        let counts = self.entered[population * n..][..n].iter().zip(&self.doors);
        let own: Vec<u64> = counts.map(|(&n, &other)| if other == door { n } else { 0 }).collect();
        self.mass(&own)
    }

    /// What went through a door since the start.
    pub fn left(&self, population: usize, door: usize) -> f64 {
        let n = self.units.len();
        self.mass(&self.left[(population * self.n_doors + door) * n..][..n])
    }

    /// Everything that came, and everything that went.
    pub fn whole(&self, population: usize) -> (f64, f64) {
        let doors = 0..self.n_doors;
        let entered = doors.clone().map(|door| self.entered(population, door)).sum();
        (entered, doors.map(|door| self.left(population, door)).sum())
    }
}

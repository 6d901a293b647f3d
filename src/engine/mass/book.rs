//! What entered, what left, and what is there.
//!
//! Owns the books of a run. May use `maths`' exact sums. It deliberately keeps no particle.

use super::super::track::monitors::Crossing;
use super::super::track::tracker::Events;
use super::super::track::walls::Exit;
use super::flock;
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
        self.events.push(Event { what, population: self.population, mass, t });
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

/// Sums of a population since the start.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Account {
    pub entered: Sum,
    pub left: Sum,
}

/// The books of all populations.
#[derive(Debug, Clone)]
pub struct Book {
    pub quanta: Quanta,
    pub accounts: Vec<Account>,
}

impl Book {
    pub fn new(quanta: Quanta, n_populations: usize) -> Self {
        Self { quanta, accounts: vec![Account::default(); n_populations] }
    }

    pub fn note(&mut self, event: &Event) {
        let account = &mut self.accounts[event.population];
        match event.what {
            What::Entered { .. } => self.quanta.add(&mut account.entered, event.mass),
            What::Left { .. } | What::Replaced { .. } => self.quanta.add(&mut account.left, event.mass),
            What::Crossed { .. } => {}
        }
    }
}

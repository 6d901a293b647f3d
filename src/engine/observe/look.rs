//! Looking at one chunk: load, resolve and add, compiled wide as a whole.
//!
//! Owns the order of this work. May use the lab and the tallies. It deliberately is one operation: what
//! is called from wide code without being part of it is compiled for the oldest machine.

use super::super::average::{Means, accumulate};
use super::super::run::Run;
use super::chemistry::Needs;
use super::lab::{self, Instant, Lab};
use super::tally::Tally;
use crate::state::grid::Grid;
use crate::state::particles::{Block, CHUNK};
use std::ops::Range;

/// What is summed.
#[derive(Clone, Copy)]
pub enum Sums<'a, const D: usize> {
    /// Counts and carried columns per bin.
    Columns {
        grid: &'a Grid<D>,
    },
    /// The first sums of outputs, each from its place on.
    First {
        tallies: &'a [&'a Tally<'a, D>],
        at: &'a [usize],
    },
    /// The second sums, which need the first.
    Second {
        tallies: &'a [&'a Tally<'a, D>],
        first: &'a [f64],
        first_at: &'a [usize],
        at: &'a [usize],
    },
    None,
}

impl<const D: usize> Sums<'_, D> {
    #[inline(always)]
    fn add(self, lab: &Lab<D>, target: &mut [f64]) {
        match self {
            Self::Columns { grid } => {
                let mut slots = [0; CHUNK];
                grid.locate(lab.positions(), &mut slots[..lab.n]);
                accumulate(&slots[..lab.n], &lab.columns, 0..lab.n, 1, target);
            }
            Self::First { tallies, at } => {
                for (idx, tally) in tallies.iter().enumerate() {
                    tally.add_first(lab, &mut target[at[idx]..at[idx + 1]]);
                }
            }
            Self::Second { tallies, first, first_at, at } => {
                for (idx, tally) in tallies.iter().enumerate() {
                    let first = &first[first_at[idx]..first_at[idx + 1]];
                    tally.add_second(lab, first, &mut target[at[idx]..at[idx + 1]]);
                }
            }
            Self::None => {}
        }
    }
}

/// One chunk at the instant, with concentrations if means are given, added to `target`.
pub struct Look<'a, const D: usize> {
    pub run: &'a Run<'a, D>,
    pub instant: &'a Instant<D>,
    pub resolved: Option<(&'a Means, &'a Needs)>,
    pub block: &'a Block<D>,
    pub range: Range<usize>,
    pub lab: &'a mut Lab<D>,
    pub sums: Sums<'a, D>,
    pub target: &'a mut [f64],
}

impl<const D: usize> pulp::NullaryFnOnce for Look<'_, D> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { run, instant, resolved, block, range, lab, sums, target } = self;
        lab::load(run, instant, block, range, lab);
        if let Some((means, needs)) = resolved {
            lab::resolve(run, instant, means, needs, lab);
        }
        sums.add(lab, target);
    }
}

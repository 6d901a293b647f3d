//! Parcels of water in any flow: they come in with it, go out with it, and meet its sides on the way.
//!
//! Owns what a step does to where they are, and the books of what comes and goes. May use `track`, the builders
//! of `mass` and the plan. It deliberately knows no chemistry: what parcels carry are columns of numbers.

mod book;
mod composition;
mod course;
mod gates;
mod inlets;
mod parcels;
mod passages;
pub mod start;

pub use book::Book;
pub use gates::quanta;

use super::error::RunError;
use super::mass::book::What;
use super::mass::gate::Gates;
use super::mass::media::{flow_of, in_medium};
use super::mass::place::Cells;
use super::mass::release::{Birth, Window};
use super::mass::world::Site;
use super::parallel;
use super::program::Program;
use super::schedule::Due;
use super::track::tracker::{EARLIEST, Steps, TooManySubSteps};
use super::{control::Settings, mass::flock};
use crate::flow::FlowSeries;
use crate::maths::wide::Width;
use crate::state::particles::{BLOCK, Block};
use crate::state::stream::{Purpose, Stream};
use book::Moved;
use course::{Current, Launch, Launched};
use inlets::Inlet;
use passages::{Cargo, Passages, Passed, Watched};
use std::sync::Arc;

/// Particles that a run may have, over those that it begins with: the water in a domain stays the same.
const MOST_OVER: u64 = 4;
/// The same in all, where there are few.
const MOST_FEW: u64 = 1 << 20;

/// The water of a run, on its way.
pub struct Water<const D: usize> {
    current: Arc<dyn Current<D>>,
    inlets: Arc<Vec<Inlet<D>>>,
    /// Per component the lowest and highest value that sides give.
    pub ranges: Vec<(f64, f64)>,
    /// Water in each part of the domain, where porosity varies.
    cells: Option<Cells<D>>,
    stream: Stream,
    pub book: Book,
    n_slots: usize,
    has_memory: bool,
    most: u64,
    watched: Watched,
    /// Displacements done, one per particle.
    pub displacements: u64,
    /// The flow on cells, if it is on cells.
    flow: Option<FlowSeries>,
}

/// What came of the parcels of a block in a step.
struct Passage<const D: usize> {
    moved: Moved,
    passages: Passages<D>,
    trouble: Option<Trouble>,
    displacements: u64,
}

impl<const D: usize> Passage<D> {
    fn new(moved: Moved) -> Self {
        Self { moved, passages: Passages::default(), trouble: None, displacements: 0 }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Trouble {
    SubSteps(TooManySubSteps),
    Position { id: u64, step: u64 },
}

impl<const D: usize> Water<D> {
    /// The water of a plan that has tracks; the program learns how much of it a particle is.
    ///
    /// Outputs of what passes leave `dues` for the gates.
    pub fn new(
        program: &mut Program<D>,
        settings: &Settings,
        width: Width,
        dues: &mut Vec<Due>,
    ) -> Result<(Self, Gates), RunError> {
        let plan = program.plan;
        let flow = flow_of(plan, settings)?;
        let site = Site::<D>::new(plan, flow.clone())?;
        let cells = start::cells(&site);
        if let Some(cells) = &cells {
            program.volume = cells.total() / plan.particles.count as f64;
            program.uneven = Some(start::uneven(cells, &program.grid));
        }
        let n_slots = program.roles.len();
        let volume = program.volume;
        let launch = Launch { width, volume, n_slots, n: program.n_components(), dues };
        let Launched { current, inlets, ranges, gates, watched } = in_medium(&site, launch)?;
        let water = Self {
            current,
            watched,
            inlets: Arc::new(inlets),
            ranges,
            cells,
            stream: Stream::new(plan.seed, Purpose::Release),
            book: Book::new(plan.doors().len(), program.n_columns()),
            n_slots,
            has_memory: plan.reacts_in_steps(),
            most: plan.particles.count.saturating_mul(MOST_OVER).max(MOST_FEW),
            displacements: 0,
            flow,
        };
        Ok((water, gates))
    }

    /// Takes all parcels through a step, and lets in what comes with the water. What passed is returned.
    pub fn flow_on(&mut self, blocks: &mut Vec<Block<D>>, steps: Steps) -> Result<Passages<D>, RunError> {
        let mut passages = Passages::default();
        let (fresh, entered): (Vec<Block<D>>, Vec<Vec<f64>>) =
            self.newcomers(steps, &mut passages)?.into_iter().unzip();
        let n = blocks.len();
        blocks.extend(fresh);
        let late = |idx: usize| if idx < n { &[][..] } else { &entered[idx - n][..] };
        let mut tasks: Vec<(&mut Block<D>, &[f64], Passage<D>)> = blocks
            .iter_mut()
            .enumerate()
            .map(|(idx, block)| (block, late(idx), Passage::new(self.book.blank())))
            .collect();
        let (current, watched) = (&self.current, &self.watched);
        parallel::for_each(&mut tasks, &|_, (block, entered, passage)| {
            current.carry(steps, entered, watched, block, passage);
        });
        let found: Vec<Passage<D>> = tasks.into_iter().map(|(_, _, passage)| passage).collect();
        for mut passage in found {
            passages.append(std::mem::take(&mut passage.passages));
            self.take(passage)?;
        }
        let newcomers = blocks.split_off(n);
        newcomers.into_iter().for_each(|block| parcels::append(blocks, block));
        parcels::gather(blocks);
        self.check_number(blocks)?;
        Ok(passages)
    }

    /// Parcels that come in within a step, and the part of it that is over when they do.
    fn newcomers(
        &mut self,
        steps: Steps,
        passages: &mut Passages<D>,
    ) -> Result<Vec<(Block<D>, Vec<f64>)>, RunError> {
        let window = Window { step: steps.first, t: steps.t, dt: steps.dt, period: 0, part: 1.0 };
        let mut list: Vec<(Block<D>, Vec<f64>)> = Vec::new();
        for inlet in self.inlets.iter() {
            let mut births: Vec<Birth<D>> = Vec::new();
            inlet.release.births(&self.stream, window, &mut births);
            for births in births.chunks(BLOCK) {
                let block = self.block(births, inlet)?;
                self.book.enter(inlet.release.door, births.len(), &block.columns);
                self.note_entries(inlet, births, &block, window, passages);
                list.push((block, births.iter().map(|birth| birth.entered).collect()));
            }
        }
        Ok(list)
    }

    /// Notes what comes in through a side that somebody watches.
    fn note_entries(
        &self,
        inlet: &Inlet<D>,
        births: &[Birth<D>],
        block: &Block<D>,
        window: Window,
        passages: &mut Passages<D>,
    ) {
        let Some(side) = inlet.release.door.checked_sub(1).filter(|&side| self.watched.has(side)) else {
            return;
        };
        for (idx, birth) in births.iter().enumerate() {
            let passed = Passed {
                what: What::Entered { origin: inlet.release.origin },
                cargo: Cargo::Parcel,
                entered_by: Some(side),
                id: birth.id,
                t: window.t + birth.entered.max(EARLIEST) * window.dt,
                place: birth.position,
            };
            passages.push(passed, block.columns.len(), |column| block.columns[column][idx]);
        }
    }

    fn block(&self, births: &[Birth<D>], inlet: &Inlet<D>) -> Result<Block<D>, RunError> {
        let n = births.len();
        let n_columns = self.book.n_columns();
        let mut block = Block::<D>::new(0, n, n_columns)
            .map_err(|_| RunError::OutOfMemory { bytes: (8 * n * (n_columns + D + 1)) as u64 })?;
        block.ids = births.iter().map(|birth| birth.id).collect();
        if self.has_memory {
            block.memory.resize(n, 0.0);
        }
        for (idx, birth) in births.iter().enumerate() {
            for axis in 0..D {
                block.positions[axis][idx] = birth.position[axis];
            }
            inlet.composition.put(birth.position, idx, self.n_slots, &mut block.columns);
        }
        Ok(block)
    }

    fn take(&mut self, passage: Passage<D>) -> Result<(), RunError> {
        self.book.take(&passage.moved);
        self.displacements += passage.displacements;
        match passage.trouble {
            None => Ok(()),
            Some(Trouble::Position { id, step }) => {
                Err(RunError::NonFinitePosition { step: step + 1, particle: flock::count(id) })
            }
            Some(Trouble::SubSteps(TooManySubSteps { id, step })) => {
                Err(RunError::TooManySubSteps { step: step + 1, particle: flock::count(id) })
            }
        }
    }

    /// What comes in without going out must not fill the memory.
    fn check_number(&self, blocks: &[Block<D>]) -> Result<(), RunError> {
        let n: u64 = blocks.iter().map(|block| block.n_particles as u64).sum();
        if n <= self.most {
            return Ok(());
        }
        Err(RunError::OutOfMemory { bytes: 8 * n * (self.book.n_columns() + D + 1) as u64 })
    }

    /// The flows on cells, if they are on cells.
    pub fn flow(&self) -> Option<FlowSeries> {
        self.flow.clone()
    }

    /// Where parcels begin if porosity varies.
    pub fn cells(&self) -> Option<&Cells<D>> {
        self.cells.as_ref()
    }

    /// The same, to go another way from here.
    pub fn copy(&self) -> Self {
        Self {
            current: self.current.clone(),
            inlets: self.inlets.clone(),
            ranges: self.ranges.clone(),
            cells: None,
            stream: self.stream.clone(),
            book: self.book.clone(),
            n_slots: self.n_slots,
            has_memory: self.has_memory,
            most: self.most,
            watched: Watched::default(),
            displacements: 0,
            flow: self.flow.clone(),
        }
    }
}

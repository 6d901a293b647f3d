//! Random numbers of single particles: the same whatever the order they are worked on.
//!
//! Owns the numbering of draws by particle and step. May use `maths` and `state`. It deliberately keeps no
//! numbers: they follow from seed, particle and step.

use super::lanes::{LANES, Lane};
use super::trips::Numbers;
use crate::maths::chacha::DRAW;
use crate::maths::wide::Width;
use crate::state::stream::{Purpose, Stream};

/// Normal numbers that one draw has for each particle.
pub const PER_DRAW: usize = DRAW / LANES;

/// Two to this power is how many blocks of numbers an axis has in a displacement.
const BLOCKS: u32 = 18;

/// The normals of 64 particles, a row per number.
#[derive(Debug, Clone)]
pub struct Normals {
    rows: [f64; DRAW],
    /// What the rows are: those of a draw.
    number: Option<u64>,
}

impl Normals {
    pub fn new() -> Box<Self> {
        Box::new(Self { rows: [0.0; DRAW], number: None })
    }

    /// Forgets: other particles come.
    pub fn clear(&mut self) {
        self.number = None;
    }

    pub fn row(&self, idx: usize) -> &Lane {
        let (rows, _) = self.rows.as_chunks::<LANES>();
        &rows[idx]
    }
}

/// Streams of a walk.
#[derive(Debug, Clone)]
pub struct Draws {
    walk: Stream,
    wall: Stream,
    interface: Stream,
    is_double: bool,
    /// Normals of a displacement.
    per_step: usize,
}

impl Draws {
    /// Normals for `per_step` numbers a displacement, at most 16.
    pub fn new(seed: u64, per_step: usize, is_double: bool) -> Self {
        Self {
            walk: Stream::new(seed, Purpose::Track),
            wall: Stream::new(seed, Purpose::Wall),
            interface: Stream::new(seed, Purpose::Interface),
            is_double,
            per_step: per_step.clamp(1, PER_DRAW),
        }
    }

    /// Draws of their own for a look ahead, which leaves all others as they are.
    pub fn aside(seed: u64, per_step: usize, is_double: bool) -> Self {
        Self {
            walk: Stream::new(seed, Purpose::Bridge),
            wall: Stream::new(seed, Purpose::BridgeWall),
            interface: Stream::new(seed, Purpose::BridgeInterface),
            ..Self::new(seed, per_step, is_double)
        }
    }

    /// Displacements that one draw serves.
    pub fn steps_per_draw(&self) -> u64 {
        (PER_DRAW / self.per_step) as u64
    }

    /// Makes sure that `normals` has those of a displacement; the first of its rows is returned.
    #[inline(always)]
    pub fn prepare(&self, width: Width, ids: &[u64; LANES], step: u64, normals: &mut Normals) -> usize {
        let per_draw = self.steps_per_draw();
        let number = step / per_draw;
        if normals.number != Some(number) {
            normals.number = Some(number);
            if self.is_double {
                self.walk.double_normals_each(width, ids, number, &mut normals.rows);
            } else {
                self.walk.single_normals_each(width, ids, number, &mut normals.rows);
            }
        }
        (step % per_draw) as usize * self.per_step
    }

    /// Uniform numbers in (0, 1) of one particle in one displacement, for what is rare. `what` tells the
    /// events of a displacement apart.
    pub fn uniforms(&self, id: u64, step: u64, what: u64) -> [f64; 8] {
        self.wall.uniforms_of(id, step * 64 + what)
    }

    /// Any number of them for what one particle does at the interfaces of an axis in one displacement.
    pub fn at_interfaces(&self, id: u64, step: u64, axis: usize) -> Numbers<'_> {
        Numbers::new(&self.interface, id, (step * 4 + axis as u64) << BLOCKS)
    }
}

//! A field that is summed with the supports of cells.
//!
//! Owns the choice between ladders and single sums. May use both. It deliberately knows not what the field is.

use super::direct;
use super::kinds::Cell;
use super::ladder::Ladder;
use super::lattice::{AXES, Field, Lattice, Window};
use super::taps::{Integral, Taps};
use crate::maths::wide::Width;

/// A field that is summed with wide kernels.
pub enum Smoothed {
    Fast(Ladder),
    Direct(Field),
}

impl Smoothed {
    pub fn new(
        tools: (&Lattice, Integral, Width),
        (is_fast, window): (bool, &Window),
        field: Field,
        range: (f64, f64),
    ) -> Self {
        if is_fast { Self::Fast(Ladder::new(tools, window, field, range)) } else { Self::Direct(field) }
    }

    /// With the support of a cell.
    pub fn at(&self, tools: (&Lattice, Integral, Width), cell: &Cell, taps: &mut [Taps; AXES]) -> f64 {
        match self {
            Self::Fast(ladder) if ladder.has(cell.sigma) => ladder.read(tools.0, cell.at, cell.sigma),
            _ => self.sum(tools, cell, taps),
        }
    }

    /// With a narrower and a wider support, and where between them that of a cell is.
    pub fn between(
        &self,
        tools: (&Lattice, Integral, Width),
        cell: &Cell,
        taps: &mut [Taps; AXES],
    ) -> ([f64; 2], f64) {
        match self {
            Self::Fast(ladder) if ladder.has(cell.sigma) => ladder.between(tools.0, cell.at, cell.sigma),
            _ => ([self.sum(tools, cell, taps); 2], 0.0),
        }
    }

    fn sum(&self, tools: (&Lattice, Integral, Width), cell: &Cell, taps: &mut [Taps; AXES]) -> f64 {
        let field = match self {
            Self::Fast(ladder) => &ladder.field,
            Self::Direct(field) => field,
        };
        let mut sum = [0.0];
        direct::sums(tools, &[field], (cell.at, cell.sigma), taps, &mut sum);
        sum[0]
    }
}

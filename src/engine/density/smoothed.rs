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

    /// Whether nothing is kept at full resolution.
    pub fn is_small(&self) -> bool {
        matches!(self, Self::Fast(ladder) if ladder.field.is_none())
    }

    /// With the support of a cell.
    pub fn at(&self, tools: (&Lattice, Integral, Width), cell: &Cell, taps: &mut [Taps; AXES]) -> f64 {
        let mut value = [0.0];
        Self::all_at(std::slice::from_ref(self), tools, cell, (taps, &mut value));
        value[0]
    }

    /// Several fields of one window, for the same supports, with that of a cell.
    pub fn all_at(
        all: &[Self],
        tools: (&Lattice, Integral, Width),
        cell: &Cell,
        (taps, values): (&mut [Taps; AXES], &mut [f64]),
    ) {
        let reading = match all.first() {
            Some(Self::Fast(ladder)) if ladder.has(cell.sigma) => {
                Some(ladder.reading(tools.0, cell.at, cell.sigma))
            }
            _ => None,
        };
        for (own, value) in all.iter().zip(values) {
            *value = match (own, &reading) {
                (Self::Fast(ladder), Some(reading)) => ladder.read(reading),
                _ => own.sum(tools, cell, taps),
            };
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
            Self::Fast(ladder) if ladder.has(cell.sigma) => {
                ladder.between(&ladder.reading(tools.0, cell.at, cell.sigma))
            }
            _ => ([self.sum(tools, cell, taps); 2], 0.0),
        }
    }

    fn sum(&self, tools: (&Lattice, Integral, Width), cell: &Cell, taps: &mut [Taps; AXES]) -> f64 {
        let field = match self {
            Self::Fast(ladder) => ladder.field.as_ref(),
            Self::Direct(field) => Some(field),
        };
        let mut sum = [0.0];
        if let Some(field) = field {
            direct::sums(tools, &[field], (cell.at, cell.sigma), taps, &mut sum);
        }
        sum[0]
    }
}

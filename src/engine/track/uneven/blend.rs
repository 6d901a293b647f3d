//! Flow on cells with a dispersion that does not follow the velocity.
//!
//! Owns the sum of both. May use cells and expressions. It deliberately works out neither.

#![allow(clippy::needless_range_loop)] // Loops over lanes are hot.

use super::super::formula::{self, Formula};
use super::super::lanes::{LANES, Lane, Lanes};
use super::super::medium::{Carrier, Criteria, Leap, Medium};
use super::super::walls::Stride;
use super::{Chance, Look, UnevenMedium};

/// Drift of cells without dispersivities, spread of expressions without velocity.
#[derive(Debug, Clone, PartialEq)]
pub struct Blend<const D: usize> {
    pub cells: UnevenMedium<D>,
    pub spreading: Formula<D>,
}

/// Coefficients of both.
#[derive(Debug, Clone)]
pub struct Looks<const D: usize> {
    of_cells: Look<D>,
    of_spreading: formula::Look<D>,
}

impl<const D: usize> Medium<D> for Blend<D> {
    type Look = Looks<D>;

    fn blank(&self) -> Looks<D> {
        Looks { of_cells: self.cells.blank(), of_spreading: self.spreading.blank() }
    }

    fn look(&self, carrier: &Carrier, positions: &[Lane; D], look: &mut Looks<D>) {
        let by_flow = Carrier { molecular: Some(0.0), ..*carrier };
        self.cells.look(&by_flow, positions, &mut look.of_cells);
        self.spreading.look(carrier, positions, &mut look.of_spreading);
    }

    fn displace(&self, look: &Looks<D>, leap: &Leap, normals: [&Lane; D], positions: &mut [Lane; D]) {
        self.cells.displace(&look.of_cells, leap, normals, positions);
        self.spreading.displace(&look.of_spreading, leap, normals, positions);
    }

    /// The dispersion of a place is the same on both sides of a face; only the room jumps.
    fn settle(&self, stride: &Stride<D, Self>, lanes: &mut Lanes<D>) {
        if let Some(jumps) = &self.cells.jumps {
            let Looks { of_cells, of_spreading } = stride.look;
            let chance = Chance { tensor: &|lane| of_spreading.tensor(lane), even: None };
            jumps.settle((&self.cells, &of_cells.around), stride, &chance, lanes);
        }
    }

    fn spread_along(&self, look: &Looks<D>, axis: usize, spread: &mut Lane) {
        self.spreading.spread_along(&look.of_spreading, axis, spread);
    }

    fn longest(&self, look: &Looks<D>, criteria: &Criteria, time: &mut Lane) {
        self.cells.longest(&look.of_cells, criteria, time);
        let mut number = [0.0; LANES];
        for axis in 0..D {
            let mut spread = [0.0; LANES];
            self.spread_along(look, axis, &mut spread);
            for lane in 0..LANES {
                let inverse = f64::from(look.of_cells.around.inverse_width[axis][lane]);
                number[lane] += 0.5 * spread[lane] * inverse * inverse;
            }
        }
        for lane in 0..LANES {
            time[lane] = time[lane].min(criteria.dispersion / number[lane]);
        }
    }

    fn drift(&self, look: &Looks<D>, axis: usize, lane: usize) -> f64 {
        self.cells.drift(&look.of_cells, axis, lane) + self.spreading.drift(&look.of_spreading, axis, lane)
    }

    fn tensor(&self, look: &Looks<D>, lane: usize) -> [[f64; D]; D] {
        look.of_spreading.tensor(lane)
    }

    fn porosity(&self, place: [f64; D]) -> f64 {
        self.cells.porosity(place)
    }

    fn velocity(&self, place: [f64; D], axis: usize) -> f64 {
        self.cells.velocity(place, axis)
    }
}

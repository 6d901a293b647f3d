//! What lies around 64 places in cells of any width.
//!
//! Owns the interpolation. May use rulers and records. It deliberately keeps discharges in 32 bits, as
//! `track::cells` does.

#![allow(clippy::needless_range_loop)] // Loops over lanes are hot.

use super::super::lanes::{LANES, Lane, Narrow};
use super::records::{n_numbers, n_quads};
use super::ruler::Ruler;

/// Corners of a cell in three dimensions.
pub const CORNERS: usize = 8;
const MOST_NUMBERS: usize = 4 * n_quads::<3>();

/// Records and fractions of 64 places.
#[derive(Debug, Clone)]
pub struct Around<const D: usize> {
    pub place: [[u32; LANES]; D],
    pub index: [u32; LANES],
    fraction: [Narrow; D],
    pub inverse_width: [Narrow; D],
    numbers: [Narrow; MOST_NUMBERS],
    /// One component at the corners, while it is worked out.
    pub values: [Narrow; CORNERS],
}

impl<const D: usize> Around<D> {
    pub fn new() -> Self {
        Self {
            place: [[0; LANES]; D],
            index: [0; LANES],
            fraction: [[0.0; LANES]; D],
            inverse_width: [[0.0; LANES]; D],
            numbers: [[0.0; LANES]; MOST_NUMBERS],
            values: [[0.0; LANES]; CORNERS],
        }
    }

    /// Reads what lies around the places.
    #[inline(always)]
    pub fn gather(
        &mut self,
        rulers: &[Ruler; D],
        strides: &[usize; D],
        quads: &[[f32; 4]],
        positions: &[Lane; D],
    ) {
        self.index.fill(0);
        for axis in 0..D {
            rulers[axis].locate(
                &positions[axis],
                &mut self.place[axis],
                &mut self.fraction[axis],
                &mut self.inverse_width[axis],
            );
            for lane in 0..LANES {
                self.index[lane] += self.place[axis][lane] * strides[axis] as u32;
            }
        }
        for lane in 0..LANES {
            let first = self.index[lane] as usize * n_quads::<D>();
            for (q, own) in quads[first..first + n_quads::<D>()].iter().enumerate() {
                for k in 0..4 {
                    self.numbers[4 * q + k][lane] = own[k];
                }
            }
        }
    }

    /// Discharge between the two faces of an axis.
    #[inline(always)]
    pub fn between_faces(&self, axis: usize, lane: usize) -> f32 {
        let (low, high) = (self.numbers[2 * axis][lane], self.numbers[2 * axis + 1][lane]);
        low + self.fraction[axis][lane] * (high - low)
    }

    /// 1/porosity.
    #[inline(always)]
    pub fn inverse_porosity(&self) -> &Narrow {
        &self.numbers[n_numbers::<D>() - 1]
    }

    /// One component between the corners, left in `values[0]`, and its gradient in `slopes[axis][0]`.
    ///
    /// - Equation: multilinear interpolation, one axis after the other from the last.
    /// - Symbols: fractions of the cell along each axis; gradients over the widths of each particle's cell.
    /// - Range: fractions from 0 to 1.
    /// - Source: methods, section 1.3 (LaBolle et al. 1996, doi:10.1029/95WR03528).
    /// - Shape: 64 lanes, one loop over them for each pair of corners.
    #[inline(always)]
    pub fn between(&mut self, component: usize, slopes: &mut [[Narrow; CORNERS / 2]; D]) {
        let last = D - 1;
        for k in 0..1_usize << last {
            let first = 2 * D + 2 * k * D + component;
            for lane in 0..LANES {
                let (low, high) = (self.numbers[first][lane], self.numbers[first + D][lane]);
                let step = high - low;
                slopes[last][k][lane] = step * self.inverse_width[last][lane];
                self.values[k][lane] = low + self.fraction[last][lane] * step;
            }
        }
        for axis in (0..last).rev() {
            let part = &self.fraction[axis];
            for k in 0..1_usize << axis {
                for other in axis + 1..D {
                    for lane in 0..LANES {
                        let (low, high) = (slopes[other][2 * k][lane], slopes[other][2 * k + 1][lane]);
                        slopes[other][k][lane] = low + part[lane] * (high - low);
                    }
                }
                for lane in 0..LANES {
                    let (low, high) = (self.values[2 * k][lane], self.values[2 * k + 1][lane]);
                    let step = high - low;
                    slopes[axis][k][lane] = step * self.inverse_width[axis][lane];
                    self.values[k][lane] = low + part[lane] * step;
                }
            }
        }
    }
}

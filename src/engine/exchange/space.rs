//! The space in which kernels are round: positions over the bandwidth, in the metric of the dispersion.
//!
//! Owns the map to it, the cells that order particles there, and the images of sides. May use the plan's words. It
//! deliberately holds no particle.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use crate::plan::exchange::determinant;
use crate::plan::{Axis, Side};

/// Cells within a radius along rows, where ranges are cut closely; across them they are as wide as a group of so many
/// parcels, but neither wider than the radius nor narrower than a part of it.
const ALONG: f64 = 8.0;
const GROUP: f64 = 8.0;
const NARROWEST: f64 = 0.3;

/// Added to ranges, over the radius: rounding must not cut off what is just within it.
const SLACK: f64 = 1e-9;

/// Of the coordinates, added to the ends of a cell.
const ULPS: f64 = 4.0 * f64::EPSILON;

/// Added to a number of moderate size it leaves the nearest whole number in the low bits.
const SHIFT: f64 = 4_503_599_627_370_496.0;
const LOW_BITS: u64 = (1 << 32) - 1;

/// A copy of all particles beyond a side: `y ← sign · y + shift`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Image<const D: usize> {
    pub sign: [f64; D],
    pub shift: [f64; D],
}

#[derive(Debug, Clone)]
pub struct Space<const D: usize> {
    /// Upper triangle, row by row: `y = U x`.
    rows: [[f64; D]; D],
    /// Where the kernel ends.
    pub radius: f64,
    low: [f64; D],
    high: [f64; D],
    inverse_edge: [f64; D],
    edge: [f64; D],
    cells: [usize; D],
    /// Number of the last cell.
    last: [f64; D],
    /// How far parcels that look for neighbours together lie apart at most.
    pub together: [f64; D],
    reach: f64,
    reach_square: f64,
    slack: f64,
    /// Between which parcels may be along each axis: beyond an open side anywhere.
    within: [(f64, f64); D],
    /// Without the particles themselves.
    images: Vec<Image<D>>,
}

impl<const D: usize> Space<D> {
    /// The space of a dispersion (lower triangle) and a bandwidth.
    ///
    /// - Equation: `|y|² = xᵀ D⁻¹ x · (det D)^{1/d} / h²`, `y = U x`.
    /// - Symbols: `D` dispersion, `h` bandwidth, `U` upper triangle.
    /// - Range: positive definite dispersion.
    /// - Source: methods, section 6.4, for a constant tensor.
    /// - Shape: nothing if the tensor has no inverse.
    pub fn new(
        axes: &[Axis],
        diffusion: &[f64],
        (bandwidth, radius): (f64, f64),
        n_particles: u64,
    ) -> Option<Self> {
        let rows = metric::<D>(diffusion, bandwidth)?;
        let mut space = Self {
            rows,
            radius,
            low: [0.0; D],
            high: [0.0; D],
            inverse_edge: [1.0; D],
            edge: [1.0; D],
            cells: [1; D],
            last: [0.0; D],
            together: [0.0; D],
            reach: radius * (1.0 + SLACK),
            reach_square: radius * radius,
            slack: radius * SLACK,
            within: [(f64::NEG_INFINITY, f64::INFINITY); D],
            images: Vec::new(),
        };
        space.enclose(axes);
        space.within = space.reached(axes);
        space.divide(n_particles);
        let reach = std::array::from_fn(|axis| space.radius / space.rows[axis][axis]);
        space.images = space.images_of(axes, reach);
        Some(space)
    }

    /// The space of the scene itself, with cells for kernels of a mean reach along each axis, m, that end at a radius,
    /// and images for the widest of them.
    pub fn plain(
        axes: &[Axis],
        radius: f64,
        (reach, widest): ([f64; D], [f64; D]),
        n_particles: u64,
    ) -> Self {
        let (low, high) = (|axis: usize| axes[axis].low, |axis: usize| axes[axis].high);
        let mut rows = [[0.0; D]; D];
        (0..D).for_each(|axis| rows[axis][axis] = 1.0);
        let mut space = Self {
            rows,
            radius,
            low: std::array::from_fn(low),
            high: std::array::from_fn(high),
            inverse_edge: [1.0; D],
            edge: [1.0; D],
            cells: [1; D],
            last: [0.0; D],
            together: [0.0; D],
            // No distance is asked of it.
            reach: 0.0,
            reach_square: 0.0,
            slack: 0.0,
            within: [(f64::NEG_INFINITY, f64::INFINITY); D],
            images: Vec::new(),
        };
        // Half of a reach across: rows that a kernel touches hold less that is out of reach. A cell is no smaller than the
        // last bits of a place.
        let least = |axis: usize| 1e-9 * (high(axis) - low(axis));
        let part = |axis: usize| if axis + 1 == D { 1.0 / ALONG } else { 0.5 };
        space.cut(n_particles, std::array::from_fn(|axis| (part(axis) * reach[axis]).max(least(axis))));
        space.within = space.reached(axes);
        space.images = space.images_of(axes, widest);
        space
    }

    /// The extent of an axis of the box.
    pub fn bounds(&self, axis: usize) -> (f64, f64) {
        (self.low[axis], self.high[axis])
    }

    pub fn all_images(&self) -> &[Image<D>] {
        &self.images
    }

    /// Where a cell along an axis begins and ends; the outer ones have no end.
    #[inline(always)]
    pub fn strip(&self, axis: usize, cell: usize) -> (f64, f64) {
        // Rounding must not part a place from its cell.
        let slack = ULPS * (self.low[axis].abs() + self.high[axis].abs());
        let begin = self.low[axis] + self.edge[axis] * cell as f64;
        let low = if cell == 0 { f64::NEG_INFINITY } else { begin - slack };
        let high = if cell + 1 == self.cells[axis] { f64::INFINITY } else { begin + self.edge[axis] + slack };
        (low, high)
    }

    #[inline(always)]
    pub fn of(&self, x: [f64; D]) -> [f64; D] {
        let mut y = [0.0; D];
        for row in 0..D {
            for column in row..D {
                y[row] += self.rows[row][column] * x[column];
            }
        }
        y
    }

    /// The box around the corners of the domain.
    fn enclose(&mut self, axes: &[Axis]) {
        (self.low, self.high) = ([f64::INFINITY; D], [f64::NEG_INFINITY; D]);
        for corner in 0..1_usize << D {
            let is_high = |axis: usize| corner >> axis & 1 == 1;
            let x = std::array::from_fn(|axis| if is_high(axis) { axes[axis].high } else { axes[axis].low });
            let y = self.of(x);
            for axis in 0..D {
                self.low[axis] = self.low[axis].min(y[axis]);
                self.high[axis] = self.high[axis].max(y[axis]);
            }
        }
    }

    /// Cells of a part of the radius, not many more than particles.
    fn divide(&mut self, n_particles: u64) {
        let volume: f64 = (0..D).map(|axis| self.high[axis] - self.low[axis]).product();
        let wide = crate::maths::scalar::pow(GROUP * volume / n_particles.max(1) as f64, 1.0 / D as f64);
        let wide = wide.min(self.radius).max(NARROWEST * self.radius);
        self.together = [wide; D];
        let mut edge = [wide; D];
        edge[D - 1] = self.radius / ALONG;
        self.cut(n_particles, edge);
    }

    /// Cells of about these edges, wider where they would be more than twice as many as particles.
    fn cut(&mut self, n_particles: u64, mut edge: [f64; D]) {
        let most = (2 * n_particles.clamp(512, 1 << 30)) as f64;
        let lengths: [f64; D] = std::array::from_fn(|axis| self.high[axis] - self.low[axis]);
        for _ in 0..64 {
            let n: f64 = (0..D).map(|axis| (lengths[axis] / edge[axis]).ceil().max(1.0)).product();
            if n <= most {
                break;
            }
            edge.iter_mut().for_each(|edge| *edge *= 1.25);
        }
        for axis in 0..D {
            let n = (lengths[axis] / edge[axis]).ceil().clamp(1.0, most);
            self.cells[axis] = n as usize;
            self.last[axis] = n - 1.0;
            self.edge[axis] = lengths[axis] / n;
            self.inverse_edge[axis] = n / lengths[axis];
        }
    }

    pub fn n_cells(&self) -> usize {
        self.cells.iter().product()
    }

    /// Cells along the last axis: what lies side by side in memory.
    pub fn row_length(&self) -> usize {
        self.cells[D - 1]
    }

    /// Row of a plane, in three dimensions.
    #[inline(always)]
    pub fn row(&self, plane: usize, row: usize) -> usize {
        plane * self.cells[D - 2] + row
    }

    /// Cell along an axis; what is outside belongs to the first or the last one.
    #[inline(always)]
    pub fn along(&self, axis: usize, y: f64) -> usize {
        let cell = (y - self.low[axis]) * self.inverse_edge[axis];
        // Also what is no number becomes 0.
        let cell = if cell > 0.0 { cell } else { 0.0 };
        let cell = if cell < self.last[axis] { cell } else { self.last[axis] };
        let nearest = (cell + SHIFT) - SHIFT;
        let whole = if nearest > cell { nearest - 1.0 } else { nearest };
        ((whole + SHIFT).to_bits() & LOW_BITS) as usize
    }

    #[inline(always)]
    pub fn cell(&self, y: [f64; D]) -> usize {
        let mut cell = 0;
        for axis in 0..D {
            cell = cell * self.cells[axis] + self.along(axis, y[axis]);
        }
        cell
    }

    /// Distance along an axis from a range of places to a cell of it; the first and the last cell have no end.
    #[inline(always)]
    pub fn gap(&self, axis: usize, cell: usize, low: f64, high: f64) -> f64 {
        let cell = cell as f64;
        let start = self.low[axis] + cell * self.edge[axis];
        let below = if cell > 0.0 { start - high } else { 0.0 };
        let above = if cell < self.last[axis] { low - (start + self.edge[axis]) } else { 0.0 };
        let farther = if below > above { below } else { above };
        if farther > 0.0 { farther } else { 0.0 }
    }

    /// The radius, and a little more.
    #[inline(always)]
    pub fn reach(&self) -> f64 {
        self.reach
    }

    /// What is left of the radius beside a square of a distance, a little more rather than less.
    #[inline(always)]
    pub fn rest(&self, square: f64) -> f64 {
        let rest = self.reach_square - square;
        (if rest > 0.0 { rest } else { 0.0 }).sqrt() + self.slack
    }

    /// Images that reach a box; none of those of most.
    #[inline(always)]
    pub fn images(&self, (low, high): ([f64; D], [f64; D])) -> &[Image<D>] {
        let mut is_inside = true;
        for axis in 0..D {
            is_inside &=
                low[axis] - self.low[axis] > self.radius && self.high[axis] - high[axis] > self.radius;
        }
        // In a sheared box the corners hide the sides.
        if is_inside && !self.is_sheared() { &[] } else { &self.images }
    }

    fn is_sheared(&self) -> bool {
        (0..D).any(|row| (row + 1..D).any(|column| self.rows[row][column] != 0.0))
    }

    /// The box of the domain, without end where a side is open.
    fn reached(&self, axes: &[Axis]) -> [(f64, f64); D] {
        let is_open = |axis: &Axis| axis.low_side == Side::Open || axis.high_side == Side::Open;
        if self.is_sheared() && axes.iter().any(is_open) {
            return [(f64::NEG_INFINITY, f64::INFINITY); D];
        }
        let end = |side: Side, end: f64, far: f64| if side == Side::Open { far } else { end };
        std::array::from_fn(|axis| {
            let low = end(axes[axis].low_side, self.low[axis], f64::NEG_INFINITY);
            (low, end(axes[axis].high_side, self.high[axis], f64::INFINITY))
        })
    }

    /// The part of all rows of cells that are within the radius on one side.
    pub fn reached_share(&self) -> f64 {
        (self.radius * self.inverse_edge[0] + 1.0) / self.cells[0] as f64
    }

    /// Whether any parcel may be within the radius of a box.
    #[inline(always)]
    pub fn is_near(&self, (low, high): ([f64; D], [f64; D])) -> bool {
        let mut is_near = true;
        for axis in 0..D {
            let (first, last) = self.within[axis];
            is_near &= high[axis] > first - self.radius && low[axis] < last + self.radius;
        }
        is_near
    }

    /// All combinations of the images of single axes, for kernels of a reach along each, m.
    fn images_of(&self, axes: &[Axis], reach: [f64; D]) -> Vec<Image<D>> {
        let still = Image::NONE;
        let mut all = vec![still];
        for (axis, own) in axes.iter().enumerate() {
            let is_coupled = (0..D).any(|other| {
                other != axis && (self.rows[axis][other] != 0.0 || self.rows[other][axis] != 0.0)
            });
            let mut column = [0.0; D];
            (0..D).for_each(|row| column[row] = self.rows[row][axis]);
            let length = own.high - own.low;
            // As many images as a kernel can reach over.
            let n = (reach[axis] / length).min(64.0) as i64 + 1;
            let is_mirror = |side: Side| side == Side::Reflect && !is_coupled;
            let mut options = Vec::new();
            if own.low_side == Side::Periodic {
                for k in (-n..=n).filter(|&k| k != 0) {
                    options.push((1.0, column.map(|u| u * length * k as f64)));
                }
            } else {
                let scale = column[axis];
                let (low, high) = (scale * own.low, scale * own.high);
                let mut at = |sign: f64, value: f64| {
                    let mut shift = [0.0; D];
                    shift[axis] = value;
                    options.push((sign, shift));
                };
                match (is_mirror(own.low_side), is_mirror(own.high_side)) {
                    (true, true) => {
                        for k in -n..=n {
                            let period = 2.0 * (high - low) * k as f64;
                            at(-1.0, 2.0 * low + period);
                            if k != 0 {
                                at(1.0, period);
                            }
                        }
                    }
                    (true, false) => at(-1.0, 2.0 * low),
                    (false, true) => at(-1.0, 2.0 * high),
                    (false, false) => {}
                }
            }
            let mut more = Vec::new();
            for image in &all {
                for (sign, shift) in &options {
                    let mut own = *image;
                    own.sign[axis] *= sign;
                    (0..D).for_each(|row| own.shift[row] += shift[row]);
                    more.push(own);
                }
            }
            all.extend(more);
        }
        all.retain(|image| *image != still);
        all
    }
}

impl<const D: usize> Image<D> {
    /// What is where it is.
    pub const NONE: Self = Self { sign: [1.0; D], shift: [0.0; D] };

    /// Where a place appears.
    #[inline(always)]
    pub fn of(&self, y: [f64; D]) -> [f64; D] {
        let mut image = y;
        for axis in 0..D {
            image[axis] = self.sign[axis] * y[axis] + self.shift[axis];
        }
        image
    }

    /// The box in which a box appears.
    #[inline(always)]
    pub fn of_box(&self, (low, high): ([f64; D], [f64; D])) -> ([f64; D], [f64; D]) {
        let mut image = (low, high);
        for axis in 0..D {
            let low = self.sign[axis] * low[axis] + self.shift[axis];
            let high = self.sign[axis] * high[axis] + self.shift[axis];
            (image.0[axis], image.1[axis]) = if low < high { (low, high) } else { (high, low) };
        }
        image
    }
}

/// The upper triangle `U` with `UᵀU = D⁻¹ (det D)^{1/d} / h²`.
fn metric<const D: usize>(diffusion: &[f64], bandwidth: f64) -> Option<[[f64; D]; D]> {
    let mean = crate::maths::scalar::pow(determinant(diffusion, D), 1.0 / D as f64);
    let mut tensor = nalgebra::SMatrix::<f64, D, D>::zeros();
    for row in 0..D {
        for column in 0..=row {
            let entry = diffusion[row * (row + 1) / 2 + column] / mean;
            tensor[(row, column)] = entry;
            tensor[(column, row)] = entry;
        }
    }
    let is_diagonal = (0..D).all(|row| (0..row).all(|column| tensor[(row, column)] == 0.0));
    let mut rows = [[0.0; D]; D];
    if is_diagonal {
        // Without a detour through an inverse, so that equal entries stay equal.
        (0..D).for_each(|axis| rows[axis][axis] = (1.0 / tensor[(axis, axis)]).sqrt() / bandwidth);
    } else {
        let inverse = inverse(tensor)?;
        let lower = nalgebra::linalg::Cholesky::new(inverse)?.l();
        for row in 0..D {
            for column in row..D {
                rows[row][column] = lower[(column, row)] / bandwidth;
            }
        }
    }
    rows.iter().flatten().all(|entry| entry.is_finite()).then_some(rows)
}

fn inverse<const D: usize>(tensor: nalgebra::SMatrix<f64, D, D>) -> Option<nalgebra::SMatrix<f64, D, D>> {
    nalgebra::linalg::Cholesky::new(tensor).map(|factor| factor.inverse())
}

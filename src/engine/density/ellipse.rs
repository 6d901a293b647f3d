//! Gaussians whose axes are not those of the lattice: what cells around one have of it.
//!
//! Owns these values. May use the fixed maths. It deliberately knows no ends: cells are counted from the one that a kernel stands
//! in, and may be beyond all lattices.

#![allow(clippy::needless_range_loop)] // An axis belongs to several arrays at once.

use super::lattice::AXES;
use super::local::Basis;
use super::taps::{CURVATURE_REACH, REACH};
use crate::maths::vector::exp_of_negative;

/// The variance of a cell, in squared cells.
const OF_CELL: f64 = 1.0 / 12.0;

/// What is this much within a bound is within it, so that rounding cannot tell two sides apart.
const ROUNDING: f64 = 1e-9;

/// Lanes of a sum.
pub const LANES: usize = 4;
const LANE: [f64; LANES] = [0.0, 1.0, 2.0, 3.0];

/// A row of cells along the last axis.
#[derive(Debug, Clone, Copy)]
pub struct Row {
    pub x: isize,
    pub y: isize,
    pub first: isize,
    pub n: usize,
    /// Where its values begin, with zeros up to whole pieces.
    pub start: usize,
}

/// Values on cells around one.
#[derive(Debug, Default)]
pub struct Stencil {
    pub rows: Vec<Row>,
    pub values: Vec<f64>,
    pub reach: [isize; AXES],
}

/// An end of a kernel: where a coordinate of its own is beyond a bound.
#[derive(Debug, Clone, Copy, Default)]
struct Bar {
    of: [f64; AXES],
    bound: f64,
    /// Over the last component; zero where that is nothing.
    per: f64,
}

/// A Gaussian on cells of edge one.
#[derive(Debug)]
pub struct Ellipse {
    d: usize,
    precision: Basis,
    /// Ends of kernels, by axis; none of those for curvatures.
    bars: Option<[Bar; AXES]>,
    /// Squared distance, in standard deviations, at which curvatures end, and what the Gaussian is there: no step is left.
    radius: f64,
    edge: f64,
    /// Where it stands, from the centre of its cell.
    offset: [f64; AXES],
    pub reach: [isize; AXES],
}

impl Ellipse {
    /// With some axes, bandwidths along them, and edges of cells, all in one unit; of a kernel, or of one for curvatures.
    ///
    /// - Equation: `C_ij = Σ_k h_k² a_ki a_kj/(Δ_i Δ_j) + δ_ij/12`; ends where `|ξ_k| = 3 √C_kk + ½`. For curvatures without the
    ///   twelfth, and ends where `zᵀC⁻¹z = 16`.
    /// - Symbols: `a_k` axes, `ξ_k` coordinates on them, `C_kk` their variance.
    /// - Range: any bandwidths above zero.
    /// - Source: methods, sections 3.4 and 4.1; a Gaussian integrated over cells has their variance more.
    /// - Shape: a box along its axes for kernels, as the others have; an ellipsoid for curvatures.
    pub fn new(
        d: usize,
        (axes, widths, edges): (&Basis, [f64; AXES], [f64; AXES]),
        is_curvature: bool,
    ) -> Self {
        let used = AXES - d..AXES;
        let mut own = *axes;
        let mut covariance = [[0.0; AXES]; AXES];
        for k in used.clone() {
            (0..AXES).for_each(|i| own[k][i] /= edges[i]);
            for i in used.clone() {
                for j in used.clone() {
                    covariance[i][j] += widths[k] * widths[k] * own[k][i] * own[k][j];
                }
            }
        }
        let of_cell = if is_curvature { 0.0 } else { OF_CELL };
        used.clone().for_each(|i| covariance[i][i] += of_cell);
        let (precision, _) = inverse(&covariance, d);
        let (inverse_axes, _) = inverse(&own, d);
        let mut ellipse = Self {
            d,
            precision,
            bars: None,
            radius: CURVATURE_REACH * CURVATURE_REACH,
            edge: if is_curvature { exp_of_negative(-0.5 * CURVATURE_REACH * CURVATURE_REACH) } else { 0.0 },
            offset: [0.0; AXES],
            reach: [0; AXES],
        };
        let mut bars = [Bar::default(); AXES];
        for k in used.clone() {
            // Coordinates are products with columns of the inverse, as axes are rows.
            let bar = [inverse_axes[0][k], inverse_axes[1][k], inverse_axes[2][k]];
            let size = bar.iter().map(|part| part * part).sum::<f64>().sqrt();
            let deviation = form(&covariance, bar).sqrt();
            bars[k] = Bar { of: bar, bound: REACH * deviation + 0.5 * size - ROUNDING, per: 0.0 };
        }
        for i in used.clone() {
            let of_bars: f64 = used.clone().map(|k| bars[k].bound * own[k][i].abs()).sum();
            let reach = if is_curvature { CURVATURE_REACH * covariance[i][i].sqrt() } else { of_bars };
            ellipse.reach[i] = (reach + ROUNDING) as isize;
        }
        for bar in &mut bars {
            // Along a row that is parallel to it, nothing.
            if bar.of[2].abs() * (ellipse.reach[2] as f64) > ROUNDING * bar.bound {
                bar.per = 1.0 / bar.of[2];
            }
        }
        ellipse.bars = (!is_curvature).then_some(bars);
        ellipse
    }

    /// The same beside the centre of its cell.
    pub fn beside(mut self, offset: [f64; AXES]) -> Self {
        (0..AXES).filter(|&axis| offset[axis] != 0.0).for_each(|axis| self.reach[axis] += 1);
        Self { offset, ..self }
    }

    /// The same behind a mirror across an axis.
    pub fn turned_over(mut self, axis: usize) -> Self {
        for other in (0..AXES).filter(|&other| other != axis) {
            self.precision[axis][other] = -self.precision[axis][other];
            self.precision[other][axis] = -self.precision[other][axis];
        }
        for bar in self.bars.iter_mut().flatten() {
            bar.of[axis] = -bar.of[axis];
            bar.per = if axis == 2 { -bar.per } else { bar.per };
        }
        self
    }

    /// The least that its standard deviation can be along any line, in cells.
    pub fn narrowest(&self) -> f64 {
        1.0 / (AXES - self.d..AXES).map(|i| self.precision[i][i]).sum::<f64>().sqrt()
    }

    /// What part of a row is within it.
    #[inline(always)]
    fn within(&self, x: f64, y: f64) -> (f64, f64) {
        let (mut low, mut high) = (-(self.reach[2] as f64), self.reach[2] as f64);
        match &self.bars {
            Some(bars) => {
                for bar in &bars[AXES - self.d..] {
                    let at = bar.of[0] * x + bar.of[1] * y;
                    if bar.per == 0.0 {
                        if at.abs() > bar.bound {
                            return (1.0, 0.0);
                        }
                        continue;
                    }
                    let (middle, half) = (-at * bar.per, bar.bound * bar.per.abs());
                    (low, high) = (low.max(middle - half), high.min(middle + half));
                }
            }
            None => {
                let [of_square, of_one, of_row] = self.row(x, y);
                let root = of_one * of_one - of_square * (of_row - self.radius);
                if root < 0.0 {
                    return (1.0, 0.0);
                }
                let (middle, half) = (-of_one / of_square, root.sqrt() / of_square);
                (low, high) = (low.max(middle - half), high.min(middle + half));
            }
        }
        (low, high)
    }

    /// The squared distance along a row: of k², of 2k, and of none.
    #[inline(always)]
    fn row(&self, x: f64, y: f64) -> [f64; 3] {
        let of = &self.precision;
        [of[2][2], of[0][2] * x + of[1][2] * y, of[0][0] * x * x + 2.0 * of[0][1] * x * y + of[1][1] * y * y]
    }

    /// `e^{−½ zᵀC⁻¹z} − e` at the centres of cells, over their sum. At the centre of its cell it is even: half of it is worked out.
    #[inline(always)]
    pub fn fill(&self, stencil: &mut Stencil) {
        stencil.rows.clear();
        stencil.values.clear();
        stencil.reach = self.reach;
        let [of_x, of_y, _] = self.reach;
        let mut sums = [0.0; LANES];
        let is_even = self.offset == [0.0; AXES];
        for x in -of_x..if is_even { 0 } else { of_x + 1 } {
            for y in -of_y..=of_y {
                self.fill_row((x, y), stencil, &mut sums);
            }
        }
        let mut n_half = 0;
        if is_even {
            for y in -of_y..0 {
                self.fill_row((0, y), stencil, &mut sums);
            }
            n_half = stencil.rows.len();
            sums = sums.map(|sum| 2.0 * sum);
            self.fill_row((0, 0), stencil, &mut sums);
        }
        let per = 1.0 / ((sums[0] + sums[2]) + (sums[1] + sums[3]));
        stencil.values.iter_mut().for_each(|value| *value *= per);
        let half = stencil.values.len();
        for at in (0..n_half).rev() {
            let Row { x, y, first, n, start } = stencil.rows[at];
            let own = stencil.values.len();
            stencil.rows.push(Row { x: -x, y: -y, first: 1 - first - n as isize, n, start: own });
            stencil.values.resize(own + n.next_multiple_of(LANES), 0.0);
            let (known, new) = stencil.values.split_at_mut(half);
            let source = &known[start..start + n];
            let target = &mut new[own - half..own - half + n];
            target.iter_mut().zip(source.iter().rev()).for_each(|(target, source)| *target = *source);
        }
    }

    #[inline(always)]
    fn fill_row(&self, (x, y): (isize, isize), stencil: &mut Stencil, sums: &mut [f64; LANES]) {
        let [of_x, of_y, of_z] = self.offset;
        let (from_x, from_y) = (x as f64 - of_x, y as f64 - of_y);
        let (low, high) = self.within(from_x, from_y);
        let (low, high) = ((low + of_z).ceil() as isize, (high + of_z).floor() as isize);
        if low > high {
            return;
        }
        let (n, start) = ((high - low) as usize + 1, stencil.values.len());
        stencil.rows.push(Row { x, y, first: low, n, start });
        stencil.values.resize(start + n.next_multiple_of(LANES), 0.0);
        let (pieces, _) = stencil.values[start..].as_chunks_mut::<LANES>();
        let [of_square, of_one, of_row] = self.row(from_x, from_y);
        let (mut z, last, edge) =
            (LANE.map(|lane| low as f64 - of_z + lane), high as f64 - of_z + 0.5, self.edge);
        let mut own_sums = *sums;
        for piece in pieces {
            for lane in 0..LANES {
                let own = z[lane];
                let square = of_row + own * (2.0 * of_one + own * of_square);
                let value = exp_of_negative(-0.5 * square) - edge;
                piece[lane] = if own > last { 0.0 } else { value };
                own_sums[lane] += piece[lane];
                z[lane] = own + LANES as f64;
            }
        }
        *sums = own_sums;
    }
}

fn form(matrix: &Basis, vector: [f64; AXES]) -> f64 {
    let mut form = 0.0;
    for i in 0..AXES {
        for j in 0..AXES {
            form += matrix[i][j] * vector[i] * vector[j];
        }
    }
    form
}

/// The inverse of the last rows and columns, and the determinant.
fn inverse(matrix: &Basis, d: usize) -> (Basis, f64) {
    let mut own = *matrix;
    (0..AXES - d).for_each(|i| own[i][i] = 1.0);
    let minor = |i: usize, j: usize| {
        let (a, b, c, d) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        own[a][c] * own[b][d] - own[a][d] * own[b][c]
    };
    let determinant: f64 = (0..AXES).map(|j| own[0][j] * minor(0, j)).sum();
    let mut inverse = [[0.0; AXES]; AXES];
    for i in AXES - d..AXES {
        for j in AXES - d..AXES {
            inverse[i][j] = minor(j, i) / determinant;
        }
    }
    (inverse, determinant)
}

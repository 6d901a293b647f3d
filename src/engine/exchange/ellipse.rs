//! The neighbours of one parcel where kernels differ from parcel to parcel.
//!
//! Owns the ellipse that they lie in, and their distances in the mean metric of each pair. May use cells and lists. It
//! deliberately weighs nothing.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::around::{Around, PIECE};
use super::local::Metrics;
use super::matrix::{Triangle, determinant, inverse};
use super::near::Crowd;

/// Added to extents, relative: rounding must not cut off what is just within them.
const SLACK: f64 = 1e-9;

/// Everything that the kernel of a parcel reaches: `rᵀ Q r < a²/2`.
struct Ellipse<const D: usize> {
    /// Lower triangle of `Q`, half of a metric, and of its inverse.
    form: Triangle,
    inverse: Triangle,
    /// a²/2, and half the extent along each axis.
    square: f64,
    half: [f64; D],
}

impl<const D: usize> Ellipse<D> {
    #[inline(always)]
    fn new(form: &Triangle, radius: f64) -> Self {
        let inverse = inverse::<D>(form, determinant::<D>(form));
        let square = 0.5 * radius * radius * (1.0 + SLACK);
        let mut half = [0.0; D];
        for axis in 0..D {
            half[axis] = (square * inverse[axis * (axis + 1) / 2 + axis]).sqrt() * (1.0 + SLACK);
        }
        Self { form: *form, inverse, square, half }
    }

    /// What of a strip of the first axis, as an offset, is within.
    #[inline(always)]
    fn clipped(&self, axis: usize, (low, high): (f64, f64)) -> (f64, f64) {
        (low.max(-self.half[axis]), high.min(self.half[axis]))
    }

    /// Extent along the second axis where the offset along the first lies in a strip.
    ///
    /// - Equation: `v = m u ± √((b − s u²)/q)`; `m = p₀₁/p₀₀`, `s = 1/p₀₀`, `q = p₀₀/(p₀₀ p₁₁ − p₀₁²)`.
    /// - Symbols: `b` half the square of the radius, `p` the inverse of `Q` over both axes, u and v offsets.
    /// - Range: the largest v over a strip is at `u = p₀₁ v_max/p₁₁`, or at the end of the strip that is nearest.
    /// - Source: the shadow of an ellipsoid, by completing squares.
    /// - Shape: from, to.
    #[inline(always)]
    fn across(&self, (low, high): (f64, f64)) -> (f64, f64) {
        let (p00, p01, p11) = (self.inverse[0], self.inverse[1], self.inverse[2]);
        let spread = (p11 - p01 * p01 / p00).max(0.0);
        let at = |u: f64| {
            let rest = (self.square - u * u / p00).max(0.0);
            p01 / p00 * u + (rest * spread).sqrt()
        };
        let best = p01 / p11 * self.half[1];
        let clamp = |u: f64| {
            if u < low {
                low
            } else if u > high {
                high
            } else {
                u
            }
        };
        let slack = SLACK * self.half[1];
        let highest = at(clamp(best));
        // The ellipse is its own mirror image through its middle.
        let clamp = |u: f64| {
            if u < -high {
                -high
            } else if u > -low {
                -low
            } else {
                u
            }
        };
        let lowest = -at(clamp(best));
        (lowest - slack, highest + slack)
    }

    /// Extent along the third axis above a rectangle of the others; from above to where nothing is.
    ///
    /// - Equation: `w = m·(u, v) ± √((b − f)/q₂₂)`, `m = −(q₂₀, q₂₁)/q₂₂`,
    ///   `f = v²/p₁₁ + (u − v p₀₁/p₁₁)²/(p₀₀ − p₀₁²/p₁₁)`.
    /// - Symbols: `q` entries of `Q`, `p` of its inverse, `f` the least over the rectangle, term by term.
    /// - Range: somewhat too far where an ellipse is oblique.
    /// - Source: as above.
    /// - Shape: from, to.
    #[inline(always)]
    fn above(&self, u: (f64, f64), v: (f64, f64)) -> (f64, f64) {
        let q22 = self.form[5];
        let a = times(-self.form[3] / q22, u);
        let b = times(-self.form[4] / q22, v);
        let (p00, p01, p11) = (self.inverse[0], self.inverse[1], self.inverse[2]);
        let leaned = times(-p01 / p11, v);
        let (du, dv) = (nearest((u.0 + leaned.0, u.1 + leaned.1)), nearest(v));
        let rest = self.square - dv * dv / p11 - du * du / (p00 - p01 * p01 / p11);
        if rest < 0.0 {
            return (1.0, -1.0);
        }
        let root = (rest / q22).sqrt();
        let (half, slack) = (self.half[D - 1], SLACK * self.half[D - 1]);
        ((a.0 + b.0 - root - slack).max(-half), (a.1 + b.1 + root + slack).min(half))
    }
}

/// A multiple of an interval.
#[inline(always)]
fn times(factor: f64, (low, high): (f64, f64)) -> (f64, f64) {
    if factor < 0.0 { (factor * high, factor * low) } else { (factor * low, factor * high) }
}

/// What of an interval is nearest to zero, without its sign.
#[inline(always)]
fn nearest((low, high): (f64, f64)) -> f64 {
    if low > 0.0 {
        low
    } else if high < 0.0 {
        -high
    } else {
        0.0
    }
}

impl Around {
    /// Finds everything that the kernel of parcel `idx` reaches, with distances in the mean metric of each pair, and somewhat
    /// more, which is out of reach.
    #[inline(always)]
    pub fn find<const D: usize>(&mut self, crowd: &Crowd<D>, metrics: &Metrics, idx: usize) {
        self.rows.clear();
        self.n = 0;
        let mut y = [0.0; D];
        for axis in 0..D {
            y[axis] = crowd.y[axis][idx];
        }
        let mut own = [0.0; 6];
        for entry in 0..D * (D + 1) / 2 {
            own[entry] = metrics.halves[entry][idx];
        }
        let space = crowd.space;
        let ellipse = Ellipse::<D>::new(&own, space.radius);
        self.look_within(crowd, metrics, y, &own, &ellipse);
        self.find_own(idx);
        let mut is_inside = true;
        for axis in 0..D {
            let (low, high) = space.bounds(axis);
            is_inside &= y[axis] - low > ellipse.half[axis] && high - y[axis] > ellipse.half[axis];
        }
        if !is_inside {
            for image in space.all_images() {
                let y = image.of(y);
                let mut is_near = true;
                for axis in 0..D {
                    let (low, high) = space.bounds(axis);
                    is_near &= y[axis] > low - ellipse.half[axis] && y[axis] < high + ellipse.half[axis];
                }
                if is_near {
                    // Its kernel is mirrored as well.
                    let mut own = own;
                    for row in 0..D {
                        for column in 0..row {
                            own[row * (row + 1) / 2 + column] *= image.sign[row] * image.sign[column];
                        }
                    }
                    let ellipse = Ellipse::<D>::new(&own, space.radius);
                    self.look_within(crowd, metrics, y, &own, &ellipse);
                }
            }
        }
        self.close();
    }

    /// Rows of cells that an ellipse around a place meets.
    #[inline(always)]
    fn look_within<const D: usize>(
        &mut self,
        crowd: &Crowd<D>,
        metrics: &Metrics,
        y: [f64; D],
        own: &Triangle,
        ellipse: &Ellipse<D>,
    ) {
        let space = crowd.space;
        let half = &ellipse.half;
        let offsets = |axis: usize, cell: usize| {
            let (low, high) = space.strip(axis, cell);
            ellipse.clipped(axis, (low - y[axis], high - y[axis]))
        };
        match D {
            1 => self.row_within(crowd, metrics, (y, own), 0, (-half[0], half[0])),
            2 => {
                for row in space.along(0, y[0] - half[0])..=space.along(0, y[0] + half[0]) {
                    let range = ellipse.across(offsets(0, row));
                    self.row_within(crowd, metrics, (y, own), row, range);
                }
            }
            _ => {
                for plane in space.along(0, y[0] - half[0])..=space.along(0, y[0] + half[0]) {
                    let u = offsets(0, plane);
                    let across = ellipse.across(u);
                    let (first, last) = (space.along(1, y[1] + across.0), space.along(1, y[1] + across.1));
                    for row in first..=last {
                        let range = ellipse.above(u, offsets(1, row));
                        if range.0 <= range.1 {
                            self.row_within(crowd, metrics, (y, own), space.row(plane, row), range);
                        }
                    }
                }
            }
        }
    }

    /// Squared distances along one row: `rᵀ (½ H_i⁻¹ + ½ H_j⁻¹) r`, where both kernels reach.
    #[inline(always)]
    fn row_within<const D: usize>(
        &mut self,
        crowd: &Crowd<D>,
        metrics: &Metrics,
        (y, own): ([f64; D], &Triangle),
        row: usize,
        range: (f64, f64),
    ) {
        let space = crowd.space;
        let cell = row * space.row_length();
        let (low, high) = (space.along(D - 1, y[D - 1] + range.0), space.along(D - 1, y[D - 1] + range.1));
        let (start, end) = (crowd.first[cell + low] as usize, crowd.first[cell + high + 1] as usize);
        let n = end - start;
        if n == 0 {
            return;
        }
        self.rows.push((start, n));
        self.make_room(n);
        let whole = n.next_multiple_of(PIECE);
        let (target, _) = self.weights[self.n..self.n + whole].as_chunks_mut::<PIECE>();
        let mut columns = [&[][..]; D];
        for axis in 0..D {
            columns[axis] = crowd.y[axis][start..start + whole].as_chunks::<PIECE>().0;
        }
        let mut halves = [&[][..]; 6];
        for entry in 0..D * (D + 1) / 2 {
            halves[entry] = metrics.halves[entry][start..start + whole].as_chunks::<PIECE>().0;
        }
        let most = 0.5 * space.radius * space.radius;
        for piece in 0..target.len() {
            let mut offsets = [[0.0; PIECE]; D];
            for axis in 0..D {
                for k in 0..PIECE {
                    offsets[axis][k] = columns[axis][piece][k] - y[axis];
                }
            }
            let (mut of_own, mut of_other) = ([0.0; PIECE], [0.0; PIECE]);
            for axis in 0..D {
                for other in 0..=axis {
                    let entry = axis * (axis + 1) / 2 + other;
                    let twice = if other == axis { 1.0 } else { 2.0 };
                    for k in 0..PIECE {
                        let product = twice * offsets[axis][k] * offsets[other][k];
                        of_own[k] += own[entry] * product;
                        of_other[k] += halves[entry][piece][k] * product;
                    }
                }
            }
            let mut squares = [0.0; PIECE];
            for k in 0..PIECE {
                let larger = if of_own[k] > of_other[k] { of_own[k] } else { of_other[k] };
                let sum = of_own[k] + of_other[k];
                squares[k] = if larger < most { sum } else { f64::MAX };
            }
            target[piece] = squares;
        }
        self.n += n;
    }
}

//! Smoothing along one axis of a field.
//!
//! Owns the pass: the same taps for all cells but those near an end. May use fields, taps and `parallel`. It deliberately works
//! only where there is something.

use super::super::parallel::{self, Pool};
use super::lattice::{AXES, End, Field};
use super::taps::{Integral, Line, REACH, Taps};
use crate::maths::wide::Width;

/// What each cell of an axis takes of its neighbours.
#[derive(Debug, Clone, Default)]
pub struct Band {
    /// Of cells far from the ends, from `reach` cells before them on.
    pub taps: Vec<f64>,
    pub reach: usize,
    /// Of the first cells, and of the last ones, where they are not those of cells beyond the ends.
    pub ends: [Vec<Taps>; 2],
    pub n: usize,
    pub sides: [End; 2],
}

impl Band {
    /// A Gaussian on the cells of a level, integrated over them.
    pub fn gaussian(line: Line, integral: Integral, (deviation, width): (f64, f64)) -> Self {
        let reach = ((REACH * width).ceil() / line.factor as f64).ceil() as usize + 1;
        Self::of((line, reach), true, &|line, cell, taps| {
            line.gaussian_of_cell(integral, cell, (deviation, width), taps);
        })
    }

    /// What cells of a level take, none from farther than a reach: `fill` knows it of each cell. Where kernels and their
    /// images are not just added, as where they are squared, cells near an end have taps of their own.
    pub fn of((line, reach): (Line, usize), is_sum: bool, fill: &dyn Fn(Line, usize, &mut Taps)) -> Self {
        let n = line.n.div_ceil(line.factor);
        let of_cell = |line: Line, cell: usize| {
            let mut taps = Taps::default();
            fill(line, cell, &mut taps);
            taps
        };
        let is_long = reach < n;
        let far = Line { n: (2 * reach + 1) * line.factor, ..line };
        let Taps { first, mut values } = if is_long { of_cell(far, reach) } else { Taps::default() };
        let reach = reach - first.min(reach);
        values.truncate(2 * reach + 1);
        // Fine cells beyond an end are those that it mirrors. Coarse ones are not, where the last one is narrower.
        let is_folded = is_long && line.factor == 1 && is_sum;
        let n_ends = if is_folded { 0 } else { (reach + 1).min(n) };
        let ends = [0, 1]
            .map(|end| (0..n_ends).map(|k| of_cell(line, if end == 0 { k } else { n - 1 - k })).collect());
        Self { reach, taps: values, ends, n, sides: line.ends }
    }

    /// The taps of a cell that is near an end, where they are its own.
    fn near_end(&self, cell: usize) -> Option<&Taps> {
        let [first, last] = &self.ends;
        let from_end = self.n - 1 - cell;
        first.get(cell).or_else(|| last.get(from_end))
    }

    /// What stands in a cell, perhaps beyond an end: another one, and by which sign.
    #[inline(always)]
    fn folded(&self, cell: isize) -> Option<(usize, f64)> {
        let n = self.n as isize;
        let (end, mirrored, shifted) = match (cell < 0, cell >= n) {
            (false, false) => return Some((cell as usize, 1.0)),
            (true, _) => (self.sides[0], -1 - cell, cell + n),
            _ => (self.sides[1], 2 * n - 1 - cell, cell - n),
        };
        let (other, sign) = match end {
            End::Mirror => (mirrored, 1.0),
            End::Wrap => (shifted, 1.0),
            End::Sink | End::Held(_) => (mirrored, -1.0),
        };
        (other >= 0 && other < n).then_some((other as usize, sign))
    }
}

/// Values that are looked at together.
const PIECE: usize = 8;

/// Rows that threads take together, and values of a row that they take side by side.
const ROWS: usize = 16;
const SEGMENT: usize = 64;

/// Smooths a field along an axis.
pub fn smooth(field: &mut Field, axis: usize, band: &Band, width: Width) {
    let (n, length, first) = (field.n(), field.cells[AXES - 1], field.first[axis]);
    if n == 0 {
        return;
    }
    let buffers: Pool<Vec<f64>> = Pool::new();
    if axis + 1 == AXES {
        let mut portions: Vec<&mut [f64]> = field.values[..n].chunks_mut(ROWS * length).collect();
        return parallel::for_each(&mut portions, &|_, rows| {
            buffers.lend(Default::default, |buffer| {
                width.run(Rows { rows, length, first, band, buffer });
            });
        });
    }
    // Rows side by side along the axis, cut into segments.
    let stride = if axis == 1 { 1 } else { field.cells[1] };
    let n_along = field.cells[axis];
    let n_segments = length.div_ceil(SEGMENT);
    let n_lines = n / length / n_along;
    let mut lines: Vec<Vec<&mut [f64]>> =
        (0..n_lines * n_segments).map(|_| Vec::with_capacity(n_along)).collect();
    for (row, values) in field.values[..n].chunks_mut(length).enumerate() {
        let line = row / (stride * n_along) * stride + row % stride;
        for (segment, values) in values.chunks_mut(SEGMENT).enumerate() {
            lines[line * n_segments + segment].push(values);
        }
    }
    parallel::for_each(&mut lines, &|_, rows| {
        buffers.lend(Default::default, |buffer| width.run(Across { rows, first, band, buffer }));
    });
}

/// The first value that is not zero, and the end of such; in whole pieces, as a few zeros more do no harm.
#[inline(always)]
fn extent(row: &[f64]) -> (usize, usize) {
    let (mut low, mut high) = (usize::MAX, 0);
    for (at, piece) in row.chunks(PIECE).enumerate() {
        let mut bits = 0;
        for value in piece {
            bits |= value.to_bits();
        }
        if bits != 0 {
            low = low.min(at * PIECE);
            high = (at + 1) * PIECE;
        }
    }
    (low.min(row.len()), high.min(row.len()))
}

struct Rows<'a> {
    rows: &'a mut [f64],
    length: usize,
    first: usize,
    band: &'a Band,
    buffer: &'a mut Vec<f64>,
}

impl pulp::NullaryFnOnce for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { rows, length, first, band, buffer } = self;
        for row in rows.chunks_mut(length) {
            let own = extent(row);
            if own.0 < own.1 {
                within_row(row, first, band, buffer);
            }
        }
    }
}

/// Parts of rows that lie side by side along an axis.
struct Across<'a, 'f> {
    rows: &'a mut [&'f mut [f64]],
    first: usize,
    band: &'a Band,
    buffer: &'a mut Vec<f64>,
}

impl pulp::NullaryFnOnce for Across<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { rows, first, band, buffer } = self;
        let n = rows[0].len();
        let (mut begin, mut end) = (usize::MAX, 0);
        let (mut low, mut high) = (n, 0);
        buffer.clear();
        for (at, row) in rows.iter().enumerate() {
            buffer.extend_from_slice(row);
            let own = extent(row);
            if own.0 < own.1 {
                (begin, end) = (begin.min(at), at + 1);
                (low, high) = (low.min(own.0), high.max(own.1));
            }
        }
        if begin >= end {
            return;
        }
        for (at, row) in rows.iter_mut().enumerate() {
            let target = &mut row[low..high];
            target.fill(0.0);
            let cell = first + at;
            let (start, taps) = match band.near_end(cell) {
                Some(taps) => (taps.first as isize, &taps.values[..]),
                None => (cell as isize - band.reach as isize, &band.taps[..]),
            };
            for (k, tap) in taps.iter().enumerate() {
                let Some((other, sign)) = band.folded(start + k as isize) else { continue };
                if other < first + begin || other >= first + end {
                    continue;
                }
                let tap = sign * tap;
                let other = (other - first) * n;
                let source = &buffer[other + low..other + high];
                for (value, source) in target.iter_mut().zip(source) {
                    *value += tap * source;
                }
            }
        }
    }
}

/// Smooths a row along itself.
#[inline(always)]
fn within_row(row: &mut [f64], first: usize, band: &Band, buffer: &mut Vec<f64>) {
    let (n, reach) = (row.len(), band.reach);
    // With what stands beyond both ends of the row.
    buffer.clear();
    let beyond = |at: isize| match band.folded(first as isize + at) {
        Some((cell, sign)) if cell >= first && cell < first + n => sign * row[cell - first],
        _ => 0.0,
    };
    for at in 0..reach {
        buffer.push(beyond(at as isize - reach as isize));
    }
    buffer.extend_from_slice(row);
    for at in 0..reach {
        buffer.push(beyond((n + at) as isize));
    }
    row.fill(0.0);
    let (low, high) = extent(buffer);
    for (k, tap) in band.taps.iter().enumerate() {
        let (from, to) = (low.saturating_sub(k), high.saturating_sub(k).min(n));
        if from < to {
            for (value, source) in row[from..to].iter_mut().zip(&buffer[from + k..to + k]) {
                *value += tap * source;
            }
        }
    }
    let [of_first, of_last] = [&band.ends[0], &band.ends[1]].map(Vec::len);
    let begin = of_first.saturating_sub(first).min(n);
    let end = (band.n - of_last).saturating_sub(first).clamp(begin, n);
    for at in (0..begin).chain(end..n) {
        let Some(taps) = band.near_end(first + at) else { continue };
        let mut sum = 0.0;
        for (cell, tap) in (taps.first..).zip(&taps.values) {
            if cell >= first && cell < first + n {
                sum += tap * buffer[reach + cell - first];
            }
        }
        row[at] = sum;
    }
}

//! Sums over the cells that products of taps reach.
//!
//! Owns the two directions: from sources to cells, and from cells to a place. May use taps, fields and `parallel`. It
//! deliberately adds in the order of sources, whatever the number of threads.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::super::parallel;
use super::lattice::{AXES, Field};
use super::taps::Taps;
use crate::maths::wide::Width;

/// Sources that are worked on together, and those of a thread at once.
const TOGETHER: usize = 4096;
const PORTION: usize = 64;

/// Parts of a field that each of several threads adds to.
const SLABS: usize = 8;

/// Lanes of a sum.
const LANES: usize = 4;

/// What a source spreads: for each field, along each axis.
pub struct Spread<'s, 't> {
    pub weight: &'s mut f64,
    pub taps: &'s mut [[Lent<'t>; AXES]],
}

/// Taps that are worked out once for many sources, or for one.
#[derive(Default)]
pub struct Lent<'t> {
    pub first: usize,
    pub shared: Option<&'t [f64]>,
    pub own: Taps,
}

impl Lent<'_> {
    /// Those of an axis that is not used.
    pub fn be_one(&mut self) {
        self.first = 0;
        self.shared = Some(&[1.0]);
    }

    #[inline(always)]
    fn first(&self) -> usize {
        if self.shared.is_some() { self.first } else { self.own.first }
    }

    /// The same taps, to be worked on.
    pub fn copy_to(&self, taps: &mut Taps) {
        taps.first = self.first();
        taps.values.clear();
        taps.values.extend_from_slice(self.values());
    }

    #[inline(always)]
    fn values(&self) -> &[f64] {
        self.shared.unwrap_or(&self.own.values)
    }
}

/// Adds what sources spread to fields. `of` fills in what source `idx` does.
pub fn scatter<'t>(
    (n, width): (usize, Width),
    fields: &mut [Field],
    of: &(dyn Fn(usize, Spread<'_, 't>) + Sync),
) {
    let (n_fields, n_most) = (fields.len(), n.min(TOGETHER));
    let mut weights = vec![0.0; n_most];
    let mut taps: Vec<[Lent<'t>; AXES]> = Vec::new();
    taps.resize_with(n_most * n_fields, Default::default);
    for first in (0..n).step_by(TOGETHER) {
        let n_own = TOGETHER.min(n - first);
        let of_sources = taps[..n_own * n_fields].chunks_mut(PORTION * n_fields);
        let mut portions: Vec<_> = weights[..n_own].chunks_mut(PORTION).zip(of_sources).collect();
        parallel::for_each(&mut portions, &|portion, (weights, taps)| {
            for (at, (weight, taps)) in weights.iter_mut().zip(taps.chunks_mut(n_fields)).enumerate() {
                of(first + portion * PORTION + at, Spread { weight, taps });
            }
        });
        let (weights, taps) = (&weights[..n_own], &taps[..n_own * n_fields]);
        for (idx, field) in fields.iter_mut().enumerate() {
            let mut slabs = slabs_of(field);
            parallel::for_each(&mut slabs, &|_, slab| {
                width.run(Adding { slab, weights, taps, idx });
            });
        }
    }
}

/// A part of a field.
pub(super) struct Slab<'f> {
    pub(super) first: [usize; AXES],
    pub(super) end: [usize; AXES],
    pub(super) cells: [usize; AXES],
    pub(super) values: &'f mut [f64],
}

/// Cut along the first axis that has more than one cell.
pub(super) fn slabs_of(field: &mut Field) -> Vec<Slab<'_>> {
    let n = field.n();
    let axis = (0..AXES).find(|&axis| field.cells[axis] > 1).unwrap_or(AXES - 1);
    let per_cell: usize = field.cells[axis + 1..].iter().product();
    let n_slabs = match parallel::n_threads() {
        1 => 1,
        n_threads => SLABS * n_threads,
    };
    let length = field.cells[axis].div_ceil(n_slabs);
    let (first, cells) = (field.first, field.cells);
    let cut = |(idx, values)| {
        let mut slab =
            Slab { first, end: std::array::from_fn(|axis| first[axis] + cells[axis]), cells, values };
        slab.first[axis] = first[axis] + idx * length;
        slab.end[axis] = slab.end[axis].min(slab.first[axis] + length);
        slab.cells[axis] = slab.end[axis] - slab.first[axis];
        slab
    };
    field.values[..n].chunks_mut(length * per_cell).enumerate().map(cut).collect()
}

struct Adding<'a, 'f, 't> {
    slab: &'a mut Slab<'f>,
    weights: &'a [f64],
    /// Of all fields, by source.
    taps: &'a [[Lent<'t>; AXES]],
    idx: usize,
}

impl pulp::NullaryFnOnce for Adding<'_, '_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let n_fields = self.taps.len() / self.weights.len();
        for source in 0..self.weights.len() {
            add(self.slab, &self.taps[source * n_fields + self.idx], self.weights[source]);
        }
    }
}

/// Adds a product of taps to what there is of a slab.
#[inline(always)]
fn add(slab: &mut Slab, taps: &[Lent; AXES], weight: f64) {
    let (mut low, mut high) = ([0; AXES], [0; AXES]);
    for axis in 0..AXES {
        low[axis] = taps[axis].first().max(slab.first[axis]);
        high[axis] = (taps[axis].first() + taps[axis].values().len()).min(slab.end[axis]);
        if low[axis] >= high[axis] {
            return;
        }
    }
    let last = &taps[2].values()[low[2] - taps[2].first()..high[2] - taps[2].first()];
    let part = Part { low, high, weight, last };
    match last.len().div_ceil(LANES) {
        1 => part.add::<1>(slab, taps),
        2 => part.add::<2>(slab, taps),
        3 => part.add::<3>(slab, taps),
        4 => part.add::<4>(slab, taps),
        5 => part.add::<5>(slab, taps),
        6 => part.add::<6>(slab, taps),
        7 | 8 => part.add::<8>(slab, taps),
        9 | 10 => part.add::<10>(slab, taps),
        11 | 12 => part.add::<12>(slab, taps),
        _ => part.add::<0>(slab, taps),
    }
}

/// The part of a product of taps that lies in a slab.
struct Part<'a> {
    low: [usize; AXES],
    high: [usize; AXES],
    weight: f64,
    /// Taps along the last axis.
    last: &'a [f64],
}

impl Part<'_> {
    /// Adds it, a row in so many pieces: with zeros at the end, as whole pieces cost less than what is left of one.
    #[inline(always)]
    fn add<const PIECES: usize>(&self, slab: &mut Slab, taps: &[Lent; AXES]) {
        let Self { low, high, weight, last } = *self;
        let mut padded = [[0.0; LANES]; PIECES];
        if PIECES > 0 {
            padded.as_flattened_mut()[..last.len()].copy_from_slice(last);
        }
        let (planes, rows) = (&taps[0], &taps[1]);
        for x in low[0]..high[0] {
            let of_plane = weight * planes.values()[x - planes.first()];
            let first = ((x - slab.first[0]) * slab.cells[1]) * slab.cells[2] + low[2] - slab.first[2];
            for y in low[1]..high[1] {
                let of_row = of_plane * rows.values()[y - rows.first()];
                let start = first + (y - slab.first[1]) * slab.cells[2];
                let end = (start + slab.cells[2]).min(slab.values.len());
                let row = &mut slab.values[start..end];
                let (pieces, _) = row.as_chunks_mut::<LANES>();
                match pieces.first_chunk_mut::<PIECES>() {
                    Some(pieces) if PIECES > 0 => {
                        for piece in 0..PIECES {
                            for lane in 0..LANES {
                                pieces[piece][lane] += of_row * padded[piece][lane];
                            }
                        }
                    }
                    _ => {
                        for at in 0..last.len() {
                            row[at] += of_row * last[at];
                        }
                    }
                }
            }
        }
    }
}

/// Sums over fields of one window, each with the same product of taps. Along the last axis taps have zeros at the end up to
/// whole pieces.
pub struct Gathering<'a> {
    pub taps: &'a [Taps; AXES],
    pub fields: &'a [&'a Field],
    pub sums: &'a mut [f64],
}

impl pulp::NullaryFnOnce for Gathering<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { taps, fields, sums } = self;
        let (last, _) = taps[2].values.as_chunks::<LANES>();
        for (field, sum) in fields.iter().zip(sums) {
            let mut lanes = [0.0; LANES];
            for (x, of_plane) in (taps[0].first..).zip(&taps[0].values) {
                for (y, of_row) in (taps[1].first..).zip(&taps[1].values) {
                    let weight = of_plane * of_row;
                    let start = field.row(x, y) + taps[2].first - field.first[2];
                    let (row, _) = field.values[start..start + last.len() * LANES].as_chunks::<LANES>();
                    let mut own = [0.0; LANES];
                    for (values, taps) in row.iter().zip(last) {
                        for lane in 0..LANES {
                            own[lane] += values[lane] * taps[lane];
                        }
                    }
                    for lane in 0..LANES {
                        lanes[lane] += weight * own[lane];
                    }
                }
            }
            *sum = (lanes[0] + lanes[2]) + (lanes[1] + lanes[3]);
        }
    }
}

impl Taps {
    /// Zeros up to whole pieces.
    pub fn pad(&mut self) {
        let n = self.values.len().next_multiple_of(LANES);
        self.values.resize(n, 0.0);
    }

    /// Cuts off what a field does not have: there is nothing.
    pub fn cut(&mut self, field: &Field, axis: usize) {
        let (low, high) = (field.first[axis], field.first[axis] + field.cells[axis]);
        let end = (self.first + self.values.len()).min(high);
        let skipped = low.saturating_sub(self.first).min(self.values.len());
        self.values.truncate(end.saturating_sub(self.first));
        self.values.drain(..skipped.min(self.values.len()));
        self.first = self.first.max(low);
    }
}

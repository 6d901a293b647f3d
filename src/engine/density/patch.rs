//! What kernels along any axes have in the cells of a lattice, and sums of that.
//!
//! Owns the folding at ends, and the order of sums. May use fields, slabs and `parallel`. It deliberately adds in the order of
//! sources, whatever the number of threads.

use super::super::parallel;
use super::ellipse::{Ellipse, LANES, Row, Stencil};
use super::lattice::{AXES, End, Field, Lattice};
use super::stencil::{Slab, slabs_of};
use crate::maths::wide::Width;

/// Values of sources that are worked on together, and their number, at most.
const TOGETHER: usize = 1 << 18;
const MOST: usize = 4096;

/// Sources of a thread at once.
const PORTION: usize = 16;

/// Cells along the last axis of a lattice, and where their values begin.
#[derive(Debug, Clone, Copy)]
struct Span {
    x: usize,
    y: usize,
    first: usize,
    n: usize,
    start: usize,
    /// Values with the zeros that follow.
    padded: usize,
}

/// What a source has in the cells of a lattice.
#[derive(Debug, Default)]
pub struct Patch {
    weight: f64,
    stencil: Stencil,
    spans: Vec<Span>,
    /// Cells that it lies within.
    low: [usize; AXES],
    end: [usize; AXES],
}

/// What stands in a cell, perhaps beyond an end: another one, by which sign, and whether it is mirrored.
pub fn fold(n: usize, ends: [End; 2], mut cell: isize) -> (usize, f64, bool) {
    let n = n as isize;
    let (mut sign, mut is_mirrored) = (1.0, false);
    while cell < 0 || cell >= n {
        let (end, mirrored) = if cell < 0 { (ends[0], -1 - cell) } else { (ends[1], 2 * n - 1 - cell) };
        if ends.contains(&End::Wrap) {
            cell = cell.rem_euclid(n);
            continue;
        }
        cell = mirrored;
        is_mirrored = !is_mirrored;
        if end.is_odd() {
            sign = -sign;
        }
    }
    (cell as usize, sign, is_mirrored)
}

impl Patch {
    /// Of a source in a cell, perhaps beyond an end, or its square. One that is alone has no images behind ends that change signs.
    ///
    /// - Equation: `W[z] = e^{−½ zᵀC⁻¹z}/Σ_z`; cells beyond ends are those that they are mirrored to.
    /// - Symbols: z cells from the source.
    /// - Range: any.
    /// - Source: methods, sections 3.4 and 4.2.
    /// - Shape: sums to 1 between mirrors.
    pub fn fill(
        &mut self,
        lattice: &Lattice,
        (at, ellipse): ([isize; AXES], &Ellipse),
        weight: f64,
        (is_squared, is_alone): (bool, bool),
        width: Width,
    ) {
        self.weight = weight;
        width.run(Filling { stencil: &mut self.stencil, ellipse });
        self.spans.clear();
        let is_inside = (0..AXES).all(|axis| {
            let (at, reach) = (at[axis], self.stencil.reach[axis]);
            at >= reach && at + reach < lattice.cells[axis] as isize
        });
        if is_inside {
            let place = |axis: usize, own: isize| (at[axis] + own) as usize;
            self.spans.extend(self.stencil.rows.iter().map(|row| Span {
                x: place(0, row.x),
                y: place(1, row.y),
                first: place(2, row.first),
                n: row.n,
                start: row.start,
                padded: row.n.next_multiple_of(LANES),
            }));
        } else {
            self.fold(lattice, at, is_alone);
        }
        if is_squared {
            if !is_inside {
                self.merge();
            }
            self.stencil.values.iter_mut().for_each(|value| *value *= *value);
        }
        (self.low, self.end) = ([usize::MAX; AXES], [0; AXES]);
        for span in &self.spans {
            let (first, end) = ([span.x, span.y, span.first], [span.x + 1, span.y + 1, span.first + span.n]);
            for axis in 0..AXES {
                self.low[axis] = self.low[axis].min(first[axis]);
                self.end[axis] = self.end[axis].max(end[axis]);
            }
        }
    }

    /// Rows beyond ends are put where they appear.
    fn fold(&mut self, lattice: &Lattice, at: [isize; AXES], is_alone: bool) {
        let Self { stencil: Stencil { rows, values, .. }, spans, .. } = self;
        let one = |axis: usize, own: isize| {
            let (n, ends, cell) = (lattice.cells[axis], lattice.ends[axis], at[axis] + own);
            let is_beyond = (cell < 0 && ends[0].is_odd()) || (cell >= n as isize && ends[1].is_odd());
            let (cell, sign, is_mirrored) = fold(n, ends, cell);
            (cell, if is_alone && is_beyond { 0.0 } else { sign }, is_mirrored)
        };
        for &Row { x, y, first, n, start } in rows.iter() {
            let ((x, of_x, _), (y, of_y, _)) = (one(0, x), one(1, y));
            let mut done = 0;
            while done < n {
                // What ends lie between is folded differently.
                let (length, here) = (lattice.cells[2] as isize, first + done as isize);
                let rest = length - (at[2] + here).rem_euclid(length);
                let n_own = rest.min((n - done) as isize) as usize;
                let (z, of_z, is_mirrored) = one(2, here);
                let own = &mut values[start + done..start + done + n_own];
                own.iter_mut().for_each(|value| *value *= of_x * of_y * of_z);
                if is_mirrored {
                    own.reverse();
                }
                let first = if is_mirrored { z + 1 - n_own } else { z };
                spans.push(Span { x, y, first, n: n_own, start: start + done, padded: n_own });
                done += n_own;
            }
        }
    }

    /// Cells that are there several times are put together, as their squares do not add.
    fn merge(&mut self) {
        self.spans.sort_by_key(|span| (span.x, span.y, span.first, span.start));
        let (values, mut merged, mut spans) = (&self.stencil.values, Vec::new(), Vec::<Span>::new());
        for span in &self.spans {
            let is_next =
                |last: &&mut Span| last.x == span.x && last.y == span.y && span.first <= last.first + last.n;
            let start = match spans.last_mut().filter(is_next) {
                Some(last) => {
                    last.n = last.n.max(span.first + span.n - last.first);
                    last.padded = last.n;
                    merged.resize(last.start + last.n, 0.0);
                    last.start + span.first - last.first
                }
                None => {
                    spans.push(Span { start: merged.len(), padded: span.n, ..*span });
                    merged.resize(merged.len() + span.n, 0.0);
                    merged.len() - span.n
                }
            };
            for (sum, value) in merged[start..].iter_mut().zip(&values[span.start..span.start + span.n]) {
                *sum += value;
            }
        }
        (self.stencil.values, self.spans) = (merged, spans);
    }
}

/// Works out the values of a kernel.
struct Filling<'a> {
    stencil: &'a mut Stencil,
    ellipse: &'a Ellipse,
}

impl pulp::NullaryFnOnce for Filling<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.ellipse.fill(self.stencil);
    }
}

/// Adds what sources have to a field. `of` fills in what source `idx` has; a source has about so many values, at most.
pub fn scatter(
    (n, most): (usize, usize),
    field: &mut Field,
    width: Width,
    of: &(dyn Fn(usize, &mut Patch) + Sync),
) {
    let n_together = (TOGETHER / most.max(1)).clamp(PORTION, MOST);
    let mut patches: Vec<Patch> = Vec::new();
    patches.resize_with(n.min(n_together), Patch::default);
    for first in (0..n).step_by(n_together) {
        let n_own = n_together.min(n - first);
        let mut portions: Vec<&mut [Patch]> = patches[..n_own].chunks_mut(PORTION).collect();
        parallel::for_each(&mut portions, &|portion, own| {
            for (at, patch) in own.iter_mut().enumerate() {
                of(first + portion * PORTION + at, patch);
            }
        });
        let patches = &patches[..n_own];
        parallel::for_each(&mut slabs_of(field), &|_, slab| width.run(Adding { slab, patches }));
    }
}

struct Adding<'a, 'f> {
    slab: &'a mut Slab<'f>,
    patches: &'a [Patch],
}

impl pulp::NullaryFnOnce for Adding<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Slab { first, end, .. } = *self.slab;
        for patch in self.patches {
            if (0..AXES).any(|axis| patch.low[axis] >= end[axis] || patch.end[axis] <= first[axis]) {
                continue;
            }
            for span in &patch.spans {
                add(self.slab, span, patch.weight, &patch.stencil.values);
            }
        }
    }
}

/// Adds what a slab has of a row.
#[inline(always)]
fn add(slab: &mut Slab, span: &Span, weight: f64, all: &[f64]) {
    let Slab { first, end, cells, values } = slab;
    let (low, high) = (span.first.max(first[2]), (span.first + span.n).min(end[2]));
    let is_here = span.x >= first[0] && span.x < end[0] && span.y >= first[1] && span.y < end[1];
    if !is_here || low >= high {
        return;
    }
    let at = ((span.x - first[0]) * cells[1] + span.y - first[1]) * cells[2] + low - first[2];
    // Zeros may go to the next row: whole pieces cost less than what is left of one.
    let is_whole = high - low == span.n && at + span.padded <= values.len();
    let n = if is_whole { span.padded } else { high - low };
    let (pieces, rest) = values[at..at + n].as_chunks_mut::<LANES>();
    let start = span.start + low - span.first;
    let (own, of_rest) = all[start..start + n].as_chunks::<LANES>();
    for (piece, own) in pieces.iter_mut().zip(own) {
        for lane in 0..LANES {
            piece[lane] += weight * own[lane];
        }
    }
    for (value, own) in rest.iter_mut().zip(of_rest) {
        *value += weight * own;
    }
}

/// A cell as sources are placed by.
pub fn inside(at: [usize; AXES]) -> [isize; AXES] {
    at.map(|at| at as isize)
}

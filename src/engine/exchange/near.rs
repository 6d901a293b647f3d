//! The neighbours of some parcels that lie together, and their weights.
//!
//! Owns the search through cells and the sums over what is found. May use kernels and the space. It deliberately
//! writes to nothing but its own lists: every parcel gathers for itself, so that sums never hang on threads.
//!
//! What may be near any of the parcels of a group is copied together once. Each of them then sifts it, thirty-two at a
//! time, and works with what is left.

#![allow(clippy::needless_range_loop)] // Zipped iterators are not always inlined; these loops are hot.

use super::picks::{ONES, ROOM, SETS, pick, pick_two};
use super::space::{Image, Space};
use crate::catalog::kernel::Radial;

/// Lanes of a sum: the same for wide and narrow code.
pub const LANES: usize = 8;

/// Numbers that are read or written together: rows are taken in whole pieces, beyond their ends.
const PIECE: usize = 4;

/// What every array of a crowd is longer than it, so that whole pieces can be read.
pub const PADDING: usize = PIECE;

/// Parcels of a group, at most.
pub const MOST_TARGETS: usize = 16;

/// Where one stands that is near nobody.
const NOBODY: usize = ROOM - 1;
const MOST: usize = ROOM - SIFTED;
const FAR: f64 = 1e150;

/// Candidates sifted at once: the bits of a mask.
const SIFTED: usize = 32;

/// Parcels in the order of cells.
#[derive(Clone, Copy)]
pub struct Crowd<'a, const D: usize> {
    pub space: &'a Space<D>,
    pub n: usize,
    /// Positions in the space, by axis.
    pub y: [&'a [f64]; D],
    /// Where each cell begins; one more than cells.
    pub first: &'a [u32],
}

/// What candidates have beside their places.
#[derive(Default)]
pub struct Sources<'a> {
    /// The first parcel that there is anything of.
    pub start: usize,
    pub of: Vec<&'a [f64]>,
}

/// Candidates side by side in memory, seen at once through an image.
#[derive(Debug, Clone, Copy)]
struct Row<const D: usize> {
    start: usize,
    end: usize,
    image: Image<D>,
}

/// Lists of a group, reused from one to the next.
pub struct Near<const D: usize> {
    rows: Vec<Row<D>>,
    /// Rows that are copied, and how much of the next one.
    n_rows: usize,
    n_within: usize,
    /// Candidates: places, and what else they have.
    places: [[f64; ROOM]; D],
    carried: Vec<[f64; ROOM]>,
    /// Theirs, and what is missing in the last thirty-two.
    n: usize,
    /// Squared distances of the candidates from one parcel, and which of them are near.
    squares: [f64; ROOM],
    found: [u8; 2 * ROOM],
    n_found: usize,
    /// Of those that are near: squared distances, later weights, and something else.
    weights: [f64; ROOM],
    others: [f64; ROOM],
    values: [f64; ROOM],
}

impl<const D: usize> Near<D> {
    pub fn new() -> Box<Self> {
        Box::new(Self {
            rows: Vec::new(),
            n_rows: 0,
            n_within: 0,
            places: [[0.0; ROOM]; D],
            carried: Vec::new(),
            n: 0,
            // Beyond all candidates stands nobody.
            squares: [f64::MAX; ROOM],
            found: [0; 2 * ROOM],
            n_found: 0,
            weights: [0.0; ROOM],
            others: [0.0; ROOM],
            values: [0.0; ROOM],
        })
    }

    /// How many parcels from `first` on lie together, of `n`; and finds the rows of cells that the kernel reaches from
    /// any of them.
    #[inline(always)]
    pub fn gather_round(&mut self, crowd: &Crowd<D>, first: usize, n: usize) -> usize {
        let space = crowd.space;
        let (mut low, mut high) = ([0.0; D], [0.0; D]);
        for axis in 0..D {
            (low[axis], high[axis]) = (crowd.y[axis][first], crowd.y[axis][first]);
        }
        let mut n_targets = 1;
        while n_targets < n && n_targets < MOST_TARGETS {
            let mut is_together = true;
            for axis in 0..D {
                let y = crowd.y[axis][first + n_targets];
                is_together &= (y - crowd.y[axis][first]).abs() <= space.together[axis];
            }
            if !is_together {
                break;
            }
            for axis in 0..D {
                let y = crowd.y[axis][first + n_targets];
                low[axis] = if y < low[axis] { y } else { low[axis] };
                high[axis] = if y > high[axis] { y } else { high[axis] };
            }
            n_targets += 1;
        }
        self.rows.clear();
        (self.n_rows, self.n_within) = (0, 0);
        self.look(crowd, (low, high), Image::NONE);
        for &image in space.images((low, high)) {
            let seen = image.of_box((low, high));
            if space.is_near(seen) {
                self.look(crowd, seen, image);
            }
        }
        n_targets
    }

    /// Rows of cells that the kernel reaches from a box.
    #[inline(always)]
    fn look(&mut self, crowd: &Crowd<D>, (low, high): ([f64; D], [f64; D]), image: Image<D>) {
        let space = crowd.space;
        let radius = space.reach();
        let planes =
            if D > 1 { space.along(0, low[0] - radius)..=space.along(0, high[0] + radius) } else { 0..=0 };
        for plane in planes {
            let d = if D > 1 { space.gap(0, plane, low[0], high[0]) } else { 0.0 };
            let rows = if D > 2 {
                let across = space.rest(d * d);
                space.along(1, low[1] - across)..=space.along(1, high[1] + across)
            } else {
                0..=0
            };
            for row in rows {
                let e = if D > 2 { space.gap(1, row, low[1], high[1]) } else { 0.0 };
                let reach = if D > 1 { space.rest(d * d + e * e) } else { radius };
                let line = if D > 2 { space.row(plane, row) } else { plane };
                let cell = line * space.row_length();
                let from = space.along(D - 1, low[D - 1] - reach);
                let to = space.along(D - 1, high[D - 1] + reach);
                let (start, end) = (crowd.first[cell + from] as usize, crowd.first[cell + to + 1] as usize);
                if end > start {
                    self.rows.push(Row { start, end, image });
                }
            }
        }
    }

    /// Widens a span to where the first of all candidates stands, and the last, and one.
    #[inline(always)]
    pub fn widen(&self, (mut from, mut until): (usize, usize)) -> (usize, usize) {
        for row in 0..self.rows.len() {
            let Row { start, end, .. } = self.rows[row];
            from = if start < from { start } else { from };
            until = if end > until { end } else { until };
        }
        (from, until)
    }

    /// Copies the next candidates together, with what they have in each of the sources; whether there were any left.
    #[inline(always)]
    pub fn fill(&mut self, crowd: &Crowd<D>, sources: &Sources) -> bool {
        self.copy::<true>(crowd, sources)
    }

    /// The same without places: of these is known who is near.
    #[inline(always)]
    pub fn fill_again(&mut self, crowd: &Crowd<D>, sources: &Sources) -> bool {
        self.copy::<false>(crowd, sources)
    }

    #[inline(always)]
    fn copy<const HAS_PLACES: bool>(&mut self, crowd: &Crowd<D>, sources: &Sources) -> bool {
        if self.n_rows == self.rows.len() {
            return false;
        }
        if self.carried.len() < sources.of.len() {
            self.carried.resize(sources.of.len(), [1.0; ROOM]);
        }
        let mut n = 0;
        while self.n_rows < self.rows.len() && n < MOST {
            let Row { start, end, image } = self.rows[self.n_rows];
            let start = start + self.n_within;
            let taken = if end - start > MOST - n { MOST - n } else { end - start };
            self.n_within += taken;
            if start + taken == end {
                self.n_rows += 1;
                self.n_within = 0;
            }
            let whole = taken.next_multiple_of(PIECE);
            for axis in 0..if HAS_PLACES { D } else { 0 } {
                let (sign, shift) = (image.sign[axis], image.shift[axis]);
                let (source, _) = crowd.y[axis][start..start + whole].as_chunks::<PIECE>();
                let (target, _) = self.places[axis][n..n + whole].as_chunks_mut::<PIECE>();
                for piece in 0..target.len().min(source.len()) {
                    for k in 0..PIECE {
                        // The image of an image is the place itself.
                        target[piece][k] = sign * (source[piece][k] - shift);
                    }
                }
            }
            for column in 0..sources.of.len() {
                let from = start - sources.start;
                let (source, _) = sources.of[column][from..from + whole].as_chunks::<PIECE>();
                let (target, _) = self.carried[column][n..n + whole].as_chunks_mut::<PIECE>();
                // A call to copy so few costs more than the loop.
                #[allow(clippy::manual_memcpy)]
                for piece in 0..target.len().min(source.len()) {
                    target[piece] = source[piece];
                }
            }
            n += taken;
        }
        self.n = n.next_multiple_of(SIFTED);
        for axis in 0..if HAS_PLACES { D } else { 0 } {
            for place in &mut self.places[axis][n..self.n] {
                *place = FAR;
            }
        }
        true
    }

    /// Finds the candidates that are near parcel `idx`, and their squared distances.
    #[inline(always)]
    pub fn find(&mut self, crowd: &Crowd<D>, idx: usize) {
        let mut y = [0.0; D];
        for axis in 0..D {
            y[axis] = crowd.y[axis][idx];
        }
        self.sift(y, crowd.space.radius * crowd.space.radius);
        let end = self.n_found.next_multiple_of(LANES);
        for at in self.n_found..end {
            (self.found[2 * at], self.found[2 * at + 1]) = (NOBODY as u8, (NOBODY >> 8) as u8);
        }
        self.n_found = end;
        pick(&self.squares, &self.found, &mut self.weights[..end]);
    }

    /// Numbers of the candidates within the radius of a place, in their order.
    #[inline(always)]
    fn sift(&mut self, y: [f64; D], square: f64) {
        let mut columns = [&[][..]; D];
        for axis in 0..D {
            columns[axis] = self.places[axis][..self.n].as_chunks::<SIFTED>().0;
        }
        let (squares, _) = self.squares[..self.n].as_chunks_mut::<SIFTED>();
        let mut n = 0;
        for block in 0..squares.len() {
            // Of known length, so that nothing is checked within the loop.
            let mut places = [&[0.0; SIFTED]; D];
            for axis in 0..D {
                places[axis] = &columns[axis][block];
            }
            let squares = &mut squares[block];
            // One loop each: nested ones are vectorised across pieces.
            for at in 0..SIFTED {
                let mut sum = 0.0;
                for axis in 0..D {
                    let d = places[axis][at] - y[axis];
                    sum += d * d;
                }
                squares[at] = sum;
            }
            let mut mask = 0_u32;
            for at in 0..SIFTED {
                mask |= if squares[at] < square { 1 << at } else { 0 };
            }
            for piece in 0..SIFTED / LANES {
                let bits = (mask >> (piece * LANES)) as u8;
                let first = (block * SIFTED + piece * LANES) as u64 * ONES;
                let [low, high] = SETS[usize::from(bits)];
                // Calls to copy so few bytes are not inlined; an assignment is one store.
                if let Some(target) = self.found[2 * n..].first_chunk_mut::<LANES>() {
                    *target = (low + first).to_le_bytes();
                }
                if let Some(target) = self.found[2 * n + LANES..].first_chunk_mut::<LANES>() {
                    *target = (high + first).to_le_bytes();
                }
                n += bits.count_ones() as usize;
            }
        }
        self.n_found = n;
    }

    /// Squared distances become values of a kernel.
    #[inline(always)]
    pub fn weigh<K: Radial>(&mut self, kernel: K, square: f64) {
        if K::HAS_PARTS {
            return self.weigh_in_parts(kernel, square);
        }
        for weight in &mut self.weights[..self.n_found] {
            let value = kernel.value(*weight);
            *weight = if *weight < square { value } else { 0.0 };
        }
    }

    /// The same in two loops: what waits for each other within one of them is half as much.
    #[inline(always)]
    fn weigh_in_parts<K: Radial>(&mut self, kernel: K, square: f64) {
        let (weights, rests) = (&mut self.weights[..self.n_found], &mut self.others[..self.n_found]);
        for at in 0..weights.len() {
            let (scale, rest) = kernel.parts(weights[at]);
            rests[at] = rest;
            weights[at] = if weights[at] < square { scale } else { 0.0 };
        }
        for at in 0..weights.len() {
            weights[at] *= kernel.of_rest(rests[at]);
        }
    }

    /// Squared distances become what two exchange by.
    #[inline(always)]
    pub fn force<K: Radial>(&mut self, kernel: K, square: f64) {
        if K::IS_ITS_OWN_FORCE {
            return self.weigh(kernel, square);
        }
        for weight in &mut self.weights[..self.n_found] {
            let value = kernel.force(*weight);
            *weight = if *weight < square { value } else { 0.0 };
        }
    }

    /// How many were found, and what is missing in the last lanes.
    #[inline(always)]
    pub fn n_found(&self) -> usize {
        self.n_found
    }

    /// Squared distances become values of a kernel; these, or what two exchange by, are noted with whose they are.
    #[inline(always)]
    pub fn weigh_and_note<K: Radial>(
        &mut self,
        (kernel, square, notes_forces): (K, f64, bool),
        found: &mut [u8],
        noted: &mut [f64],
    ) {
        let n = self.n_found.min(noted.len());
        let (found, _) = found.as_chunks_mut::<{ 2 * LANES }>();
        let (source, _) = self.found[..2 * n].as_chunks::<{ 2 * LANES }>();
        // A call to copy so few costs more than the loop.
        #[allow(clippy::manual_memcpy)]
        for piece in 0..found.len().min(source.len()) {
            found[piece] = source[piece];
        }
        if notes_forces && !K::IS_ITS_OWN_FORCE {
            let (weights, noted) = (&self.weights[..n], &mut noted[..n]);
            for at in 0..n {
                let force = kernel.force(weights[at]);
                noted[at] = if weights[at] < square { force } else { 0.0 };
            }
            return self.weigh(kernel, square);
        }
        self.weigh(kernel, square);
        let (weights, noted) = (&self.weights[..n], &mut noted[..n]);
        #[allow(clippy::manual_memcpy)]
        for at in 0..n {
            noted[at] = weights[at];
        }
    }

    /// What was noted of one parcel and the candidates at hand.
    #[inline(always)]
    pub fn recall(&mut self, found: &[u8], noted: &[f64]) {
        self.n_found = noted.len();
        self.found[..found.len()].copy_from_slice(found);
        self.weights[..noted.len()].copy_from_slice(noted);
    }

    /// The same of the first two sources: adds the differences of the second, with forces that are divided by means of the
    /// first or multiplied by it, and the sum of weights.
    #[inline(always)]
    pub fn recall_and_differ(
        &mut self,
        (found, noted): (&[u8], &[f64]),
        (is_mean, factor, own): (bool, f64, f64),
        (lanes, all_lanes): (&mut [f64; LANES], &mut [f64; LANES]),
    ) {
        let [factors, column, ..] = &self.carried[..] else { return };
        let n = noted.len();
        let (others, values) = (&mut self.others[..n], &mut self.values[..n]);
        pick_two((factors, column), found, others, values);
        let (others, _) = others.as_chunks::<LANES>();
        let (values, _) = values.as_chunks::<LANES>();
        let (noted, _) = noted.as_chunks::<LANES>();
        let (mut sums, mut all) = (*lanes, *all_lanes);
        let n = others.len().min(values.len()).min(noted.len());
        // A choice within the loop would keep it from being vectorised.
        if is_mean {
            for piece in 0..n {
                for lane in 0..LANES {
                    let weight = noted[piece][lane] * (2.0 / (factor + others[piece][lane]));
                    all[lane] += weight;
                    sums[lane] += weight * (values[piece][lane] - own);
                }
            }
        } else {
            for piece in 0..n {
                for lane in 0..LANES {
                    let weight = noted[piece][lane] * (factor * others[piece][lane]);
                    all[lane] += weight;
                    sums[lane] += weight * (values[piece][lane] - own);
                }
            }
        }
        (*lanes, *all_lanes) = (sums, all);
    }

    /// `w_ij ← 2 w_ij / (ρ_i + ρ_j)`
    #[inline(always)]
    pub fn divide_by_mean(&mut self, column: usize, own: f64) {
        let (weights, others) = self.weights_and(column);
        for at in 0..weights.len() {
            weights[at] *= 2.0 / (own + others[at]);
        }
    }

    /// `w_ij ← w_ij s_i s_j`
    #[inline(always)]
    pub fn multiply(&mut self, column: usize, own: f64) {
        let (weights, others) = self.weights_and(column);
        for at in 0..weights.len() {
            weights[at] *= own * others[at];
        }
    }

    /// `w_ij ← w_ij min(a_i, a_j)`
    #[inline(always)]
    pub fn limit(&mut self, column: usize, own: f64) {
        let (weights, others) = self.weights_and(column);
        for at in 0..weights.len() {
            weights[at] *= if others[at] < own { others[at] } else { own };
        }
    }

    /// Weights, and what those that are near have in a column.
    #[inline(always)]
    fn weights_and(&mut self, column: usize) -> (&mut [f64], &[f64]) {
        let end = self.n_found;
        pick(&self.carried[column], &self.found, &mut self.others[..end]);
        (&mut self.weights[..end], &self.others[..end])
    }

    /// Adds all weights.
    #[inline(always)]
    pub fn sum(&self, lanes: &mut [f64; LANES]) {
        let mut sums = *lanes;
        let (pieces, _) = self.weights[..self.n_found].as_chunks::<LANES>();
        for piece in pieces {
            for lane in 0..LANES {
                sums[lane] += piece[lane];
            }
        }
        *lanes = sums;
    }

    /// Adds `Σ_j w_ij (v_j − v_i)`.
    #[inline(always)]
    pub fn difference(&mut self, column: usize, own: f64, lanes: &mut [f64; LANES]) {
        let mut sums = *lanes;
        let (weights, others) = self.weights_and(column);
        let (weights, _) = weights.as_chunks::<LANES>();
        let (others, _) = others.as_chunks::<LANES>();
        for piece in 0..weights.len().min(others.len()) {
            for lane in 0..LANES {
                sums[lane] += weights[piece][lane] * (others[piece][lane] - own);
            }
        }
        *lanes = sums;
    }
}

/// A sum of lanes, in a fixed order.
#[inline(always)]
pub fn folded(lanes: [f64; LANES]) -> f64 {
    ((lanes[0] + lanes[4]) + (lanes[2] + lanes[6])) + ((lanes[1] + lanes[5]) + (lanes[3] + lanes[7]))
}

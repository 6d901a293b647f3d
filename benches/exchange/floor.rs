//! The floor: the bare sum over neighbours, written by hand for this one case.
//!
//! Parcels sorted by cells as long as the kernel, `Σ_j W(|x_i − x_j|) (v_j − v_i)` over the three cells of each row that are
//! contiguous in memory, four at once. No sides (parcels around the box are there, and are no targets), no choices, no other
//! sum.

#![allow(clippy::needless_range_loop)]

use lamella::maths::{vector, wide::Width};
use rand_chacha::ChaCha8Rng;
use rand_core::{Rng, SeedableRng};
use rustix::time::{ClockId, clock_gettime};

/// Parcels taken at once.
const PIECE: usize = 8;

/// More than any parcel has in the cells around it.
const MOST: usize = 4096;

/// A kernel over `r²` in the units of its end, by number: the cheapest polynomial, and the Gaussian cut at six bandwidths.
pub const POLYNOMIAL: u8 = 0;
pub const GAUSSIAN: u8 = 1;

pub struct Floor<const D: usize> {
    /// Places in units of the kernel's end, and what is carried, in the order of cells.
    y: [Vec<f64>; D],
    values: Vec<f64>,
    first: Vec<usize>,
    /// Cells along each axis.
    n: usize,
    n_targets: usize,
    sums: Vec<f64>,
}

#[inline(always)]
fn weight<const KERNEL: u8>(q2: f64) -> f64 {
    if KERNEL == POLYNOMIAL {
        let rest = 1.0 - q2;
        rest * rest * rest
    } else {
        vector::exp(-18.0 * q2)
    }
}

struct Sums<'a, const D: usize, const KERNEL: u8>(&'a mut Floor<D>);

impl<const D: usize, const KERNEL: u8> pulp::NullaryFnOnce for Sums<'_, D, KERNEL> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Floor { y, values, first, n, sums, .. } = self.0;
        let n = *n;
        let (mut squares, mut others) = ([0.0; MOST], [0.0; MOST]);
        let n_lines = n.pow(D as u32 - 1);
        for line in 0..n_lines {
            // The outermost cells are no targets: they hold what lies around the box.
            let (a, b) = (line / n, line % n);
            let is_outer = |at: usize| at == 0 || at + 1 == n;
            if is_outer(b) || (D == 3 && is_outer(a)) {
                continue;
            }
            for cell in line * n + 1..line * n + n - 1 {
                for i in first[cell]..first[cell + 1] {
                    let (own, mut m) = (values[i], 0);
                    for plane in 0..if D == 3 { 3 } else { 1 } {
                        for row in 0..3 {
                            let across = if D == 3 { (plane * n + row) * n } else { row * n };
                            let middle = cell + across - if D == 3 { n * n + n } else { n };
                            let (start, end) = (first[middle - 1], first[middle + 2]);
                            let whole = (end - start).next_multiple_of(PIECE);
                            let squares = &mut squares[m..m + whole];
                            let others = &mut others[m..m + whole];
                            let mut columns = [&[][..]; D];
                            for axis in 0..D {
                                columns[axis] = &y[axis][start..start + whole];
                            }
                            let carried = &values[start..start + whole];
                            for at in 0..whole {
                                let mut square = 0.0;
                                for axis in 0..D {
                                    let d = columns[axis][at] - y[axis][i];
                                    square += d * d;
                                }
                                squares[at] = square;
                                others[at] = carried[at] - own;
                            }
                            m += end - start;
                        }
                    }
                    let whole = m.next_multiple_of(PIECE);
                    squares[m..whole].fill(2.0);
                    for square in &mut squares[..whole] {
                        let weight = weight::<KERNEL>(*square);
                        *square = if *square < 1.0 { weight } else { 0.0 };
                    }
                    let (weights, others) = (&squares[..whole], &others[..whole]);
                    let mut lanes = [0.0; PIECE];
                    for (weights, others) in
                        weights.as_chunks::<PIECE>().0.iter().zip(others.as_chunks::<PIECE>().0)
                    {
                        for k in 0..PIECE {
                            lanes[k] += weights[k] * others[k];
                        }
                    }
                    sums[i] = lanes.iter().sum();
                }
            }
        }
    }
}

impl<const D: usize> Floor<D> {
    /// Random parcels: about `n_targets` of them in a box, and as dense around it.
    pub fn new(n_targets: usize, neighbours: f64) -> Self {
        let ball = [2.0, std::f64::consts::PI, 4.0 / 3.0 * std::f64::consts::PI][D - 1];
        let density = neighbours / ball;
        let inner = (n_targets as f64 / density).powf(1.0 / D as f64).round().max(1.0) as usize;
        let n = inner + 2;
        let n_cells = n.pow(D as u32);
        let mut random = ChaCha8Rng::seed_from_u64(1);
        let mut uniform = || random.next_u64() as f64 / 18_446_744_073_709_551_616.0 * n as f64;
        let n_all = (n_cells as f64 * density) as usize;
        let mut places: Vec<[f64; D]> = Vec::new();
        for _ in 0..n_all {
            let mut place = [0.0; D];
            place.iter_mut().for_each(|x| *x = uniform().min(n as f64 - 1e-9));
            places.push(place);
        }
        let cell = |place: &[f64; D]| place.iter().fold(0, |cell, &x| cell * n + x as usize);
        places.sort_by_key(cell);
        let mut first = vec![0; n_cells + 1];
        places.iter().for_each(|place| first[cell(place) + 1] += 1);
        (0..n_cells).for_each(|idx| first[idx + 1] += first[idx]);
        let mut y = std::array::from_fn(|axis| places.iter().map(|place| place[axis]).collect::<Vec<_>>());
        y.iter_mut().for_each(|axis| axis.extend([0.0; PIECE]));
        let values: Vec<f64> = places.iter().map(|place| place[0].sin()).chain([0.0; PIECE]).collect();
        let is_inner = |place: &&[f64; D]| place.iter().all(|&x| x >= 1.0 && x < n as f64 - 1.0);
        let n_targets = places.iter().filter(is_inner).count();
        Self { y, values, first, n, n_targets, sums: vec![0.0; n_all] }
    }

    /// Nanoseconds of processor time of one sum of one parcel; the least of so many turns.
    pub fn measure<const KERNEL: u8>(&mut self, n_turns: usize) -> f64 {
        let width = Width::widest();
        let mut least = f64::INFINITY;
        for _ in 0..n_turns {
            let start = cpu();
            width.run(Sums::<D, KERNEL>(self));
            least = least.min((cpu() - start) / self.n_targets as f64);
        }
        std::hint::black_box(&self.sums);
        least
    }
}

/// Processor time of this process so far, ns.
fn cpu() -> f64 {
    let now = clock_gettime(ClockId::ProcessCPUTime);
    now.tv_sec as f64 * 1e9 + now.tv_nsec as f64
}

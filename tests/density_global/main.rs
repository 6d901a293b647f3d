//! Densities by kernels of one size: closed forms, sums over pairs of particles, numbers of the literature.

mod errors;
mod pairs;
mod ways;

use lamella::engine::density::*;
use lamella::maths::scalar::{cos, erf, exp, ln, pow};
use lamella::maths::wide::Width;
use std::f64::consts::{PI, TAU};

pub const CLOSED: [End; 2] = [End::Mirror; 2];

/// Random numbers: splitmix64.
pub struct Random(u64);

impl Random {
    pub fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut bits = self.0;
        bits = (bits ^ (bits >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        bits = (bits ^ (bits >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        bits ^= bits >> 31;
        ((bits >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    pub fn normal(&mut self) -> f64 {
        (-2.0 * ln(self.uniform())).sqrt() * cos(TAU * self.uniform())
    }

    pub fn normals(&mut self, n: usize, deviation: f64) -> Vec<f64> {
        (0..n).map(|_| deviation * self.normal()).collect()
    }

    /// Half of them around −2, half around 2: methods, 10.2, P2-a.
    pub fn mixture(&mut self, n: usize) -> Vec<f64> {
        let one = |random: &mut Self| match random.uniform() < 0.5 {
            true => -2.0 + 0.2 * random.normal(),
            false => 2.0 + 1.5 * random.normal(),
        };
        (0..n).map(|_| one(self)).collect()
    }
}

/// Mean, and standard deviation of single ones.
pub fn spread(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (n - 1.0);
    (mean, square.sqrt())
}

pub fn bell(x: f64, deviation: f64) -> f64 {
    exp(-0.5 * (x / deviation) * (x / deviation)) / ((2.0 * PI).sqrt() * deviation)
}

pub fn mixture(x: f64) -> f64 {
    0.5 * bell(x + 2.0, 0.2) + 0.5 * bell(x - 2.0, 1.5)
}

pub fn line(cells: usize, edge: f64, ends: [End; 2]) -> Lattice {
    Lattice::new(&[(cells, edge, ends)]).unwrap()
}

pub fn density(lattice: &Lattice, tally: &Tally, rule: Rule) -> Global {
    global(lattice, tally, rule, Weighing::OfAll, Width::widest()).unwrap()
}

/// The normal density in d dimensions on cells of a box, with places of its particles.
pub struct Cloud {
    pub d: usize,
    pub lattice: Lattice,
    pub half: f64,
    pub truth: Vec<f64>,
}

impl Cloud {
    pub fn new(d: usize, half: f64, cells: usize) -> Self {
        let edge = 2.0 * half / cells as f64;
        let lattice = Lattice::new(&vec![(cells, edge, CLOSED); d]).unwrap();
        let x = |at: usize| -half + edge * (at as f64 + 0.5);
        let of_cell = |idx: usize| {
            let cell = lattice.cell(idx);
            lattice.axes().map(|axis| bell(x(cell[axis]), 1.0)).product()
        };
        let truth = (0..lattice.n_cells()).map(of_cell).collect();
        Self { d, lattice, half, truth }
    }

    pub fn tally(&self, places: &[Vec<f64>], masses: Option<&[f64]>) -> Tally {
        let places: Vec<&[f64]> = places.iter().map(|own| &own[..]).collect();
        Tally::of(&self.lattice, &vec![-self.half; self.d], &places, masses)
    }

    pub fn sample(&self, seed: u64, n: usize) -> Tally {
        let mut random = Random(seed);
        self.tally(&(0..self.d).map(|_| random.normals(n, 1.0)).collect::<Vec<_>>(), None)
    }

    /// One mass for each cell.
    pub fn masses(&self, of_cell: impl Fn([usize; 3]) -> f64) -> Tally {
        let n = self.lattice.n_cells();
        let place = |cell: usize, axis: usize| -self.half + self.lattice.edge[axis] * (cell as f64 + 0.5);
        let places: Vec<Vec<f64>> = self
            .lattice
            .axes()
            .map(|axis| (0..n).map(|idx| place(self.lattice.cell(idx)[axis], axis)).collect())
            .collect();
        let masses: Vec<f64> = (0..n).map(|idx| of_cell(self.lattice.cell(idx))).collect();
        self.tally(&places, Some(&masses))
    }

    pub fn square_of(&self, value: impl Fn(usize) -> f64) -> f64 {
        (0..self.truth.len()).map(|idx| value(idx) * value(idx)).sum::<f64>() * self.lattice.volume()
    }
}

/// `MISE(h)` of Gaussian kernels for a normal density: methods, section 2.2.
pub fn closed_form(d: usize, n: f64, h: f64) -> f64 {
    closed_parts(d, n, h).iter().sum()
}

/// What particles by themselves have of it, and the rest.
pub fn closed_parts(d: usize, n: f64, h: f64) -> [f64; 2] {
    let (d, square) = (d as f64, h * h);
    let factor = pow(4.0 * PI, -0.5 * d);
    let rest = (1.0 - 1.0 / n) * pow(1.0 + square, -0.5 * d) - 2.0 * pow(1.0 + 0.5 * square, -0.5 * d) + 1.0;
    [factor / (n * pow(h, d)), factor * rest]
}

//! Where particles that carry mass begin.
//!
//! Owns the map from a share of a mass to a place. May use `maths`. It deliberately draws nothing: shares and
//! uniform numbers are given.

use super::running::Running;
use super::spots::Spots;
use crate::maths::scalar::{cos, ln, sin};
use std::sync::Arc;

/// Mass spread over places.
#[derive(Debug, Clone, PartialEq)]
pub enum Place<const D: usize> {
    Point([f64; D]),
    Line([f64; D], [f64; D]),
    Box([f64; D], [f64; D]),
    /// Centre, standard deviations, and what becomes of tails beyond the sides.
    Gaussian([f64; D], [f64; D], [Tail; D]),
    Cells(Cells<D>),
    Faces(Faces<D>),
    Spots(Spots<D>),
}

/// What becomes of what lies beyond the two sides of an axis: it is mirrored where there is a wall, and comes in
/// again at the other side where they are periodic.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tail {
    pub low: Option<f64>,
    pub high: Option<f64>,
    pub is_periodic: bool,
}

impl Tail {
    fn folded(self, x: f64) -> f64 {
        match (self.low, self.high) {
            (Some(low), Some(high)) => {
                let width = high - low;
                let period = if self.is_periodic { width } else { 2.0 * width };
                let rest = (x - low) - period * ((x - low) / period).floor();
                low + if rest > width { period - rest } else { rest }
            }
            (Some(low), None) if x < low => 2.0 * low - x,
            (None, Some(high)) if x > high => 2.0 * high - x,
            _ => x,
        }
    }
}

/// Equal cells with a mass each.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells<const D: usize> {
    low: [f64; D],
    width: [f64; D],
    n: [usize; D],
    masses: Running,
}

/// Rectangles of one side with a weight each.
#[derive(Debug, Clone, PartialEq)]
pub struct Faces<const D: usize> {
    corners: Arc<[([f64; D], [f64; D])]>,
    weights: Running,
}

/// Cells that an initial concentration is looked at in, in all.
const MOST_CELLS: f64 = 1_048_576.0;

impl<const D: usize> Cells<D> {
    /// Cells over a domain. `mass` gives the masses per volume at a list of centres.
    pub fn new(low: [f64; D], high: [f64; D], mass: impl Fn(&[[f64; D]]) -> Vec<f64>) -> Self {
        let n = shape(low, high);
        let width: [f64; D] = std::array::from_fn(|axis| (high[axis] - low[axis]) / n[axis] as f64);
        let volume: f64 = width.iter().product();
        let n_cells: usize = n.iter().product();
        let mut cells = Self { low, width, n, masses: Running::new(Vec::new()) };
        let mut sums = Vec::with_capacity(n_cells);
        // A million roundings would show in the total: what each of them loses is kept.
        let (mut sum, mut lost) = (0.0_f64, 0.0_f64);
        for first in (0..n_cells).step_by(4096) {
            let centres: Vec<[f64; D]> =
                (first..(first + 4096).min(n_cells)).map(|cell| cells.inside(cell, [0.5; D])).collect();
            for mass in mass(&centres) {
                let term = mass * volume - lost;
                let next = sum + term;
                lost = (next - sum) - term;
                sum = next;
                sums.push(sum);
            }
        }
        cells.masses = Running::new(sums);
        cells
    }

    pub fn total(&self) -> f64 {
        self.masses.total()
    }

    /// The place that a share of the mass comes before.
    pub fn at(&self, share: f64, uniforms: &[f64; 8]) -> [f64; D] {
        let (cell, part) = self.masses.find(share * self.total());
        // Along one axis the share itself is the best draw; it is one of several otherwise.
        let fraction = std::array::from_fn(|axis| if D == 1 { part } else { uniforms[axis] });
        self.inside(cell, fraction)
    }

    /// The middle of each cell, with its mass.
    pub fn masses(&self) -> impl Iterator<Item = ([f64; D], f64)> + '_ {
        let before = [0.0].into_iter().chain(self.masses.sums().iter().copied());
        let own = self.masses.sums().iter().zip(before).map(|(sum, before)| sum - before);
        own.enumerate().map(|(cell, mass)| (self.inside(cell, [0.5; D]), mass))
    }

    fn inside(&self, cell: usize, fraction: [f64; D]) -> [f64; D] {
        let mut rest = cell;
        let mut place = [0.0; D];
        for axis in (0..D).rev() {
            // What is left for the first axis is its own cell; divisions are slow.
            let own = if axis == 0 { rest } else { rest % self.n[axis] };
            place[axis] = self.low[axis] + (own as f64 + fraction[axis]) * self.width[axis];
            if axis > 0 {
                rest /= self.n[axis];
            }
        }
        place
    }
}

/// Cells of nearly equal sides; the shortest axis first, so that a thin domain leaves its cells to the others.
fn shape<const D: usize>(low: [f64; D], high: [f64; D]) -> [usize; D] {
    let length: [f64; D] = std::array::from_fn(|axis| high[axis] - low[axis]);
    let mut order: [usize; D] = std::array::from_fn(|axis| axis);
    order.sort_by(|&a, &b| length[a].total_cmp(&length[b]));
    let mut n = [1; D];
    let mut left = MOST_CELLS;
    for (rank, &axis) in order.iter().enumerate() {
        let rest = &order[rank..];
        let shape: f64 = rest.iter().map(|&other| length[axis] / length[other]).product();
        let along = crate::maths::scalar::pow(left * shape, 1.0 / rest.len() as f64);
        n[axis] = (along * (1.0 + 1e-12)).clamp(1.0, left) as usize;
        left /= n[axis] as f64;
    }
    n
}

impl<const D: usize> Faces<D> {
    pub fn new(faces: Vec<([f64; D], [f64; D], f64)>) -> Self {
        let weights = Running::of(faces.iter().map(|face| face.2));
        Self { corners: faces.into_iter().map(|(low, high, _)| (low, high)).collect(), weights }
    }

    /// The same rectangles with other weights, one list after another.
    pub fn in_time(corners: &[([f64; D], [f64; D])], weights: &[Vec<f64>]) -> Vec<Self> {
        let corners: Arc<[([f64; D], [f64; D])]> = corners.into();
        let of =
            |own: &Vec<f64>| Self { corners: corners.clone(), weights: Running::of(own.iter().copied()) };
        weights.iter().map(of).collect()
    }

    pub fn total(&self) -> f64 {
        self.weights.total()
    }

    /// A place by the weights.
    pub fn at(&self, uniforms: &[f64; 8]) -> [f64; D] {
        let (face, _) = self.weights.find(uniforms[3] * self.total());
        let (low, high) = &self.corners[face];
        std::array::from_fn(|axis| low[axis] + uniforms[axis] * (high[axis] - low[axis]))
    }
}

impl<const D: usize> Place<D> {
    /// The place of a particle: `share` from 0 to 1 of the mass comes before it, `uniforms` are its own.
    pub fn at(&self, share: f64, uniforms: &[f64; 8]) -> [f64; D] {
        let between = |low: &[f64; D], high: &[f64; D]| {
            std::array::from_fn(|axis| low[axis] + uniforms[axis] * (high[axis] - low[axis]))
        };
        match self {
            Self::Point(place) => *place,
            Self::Line(from, to) => std::array::from_fn(|axis| from[axis] + share * (to[axis] - from[axis])),
            Self::Box(low, high) => between(low, high),
            Self::Gaussian(centre, deviation, tails) => {
                let normals = normals(uniforms);
                std::array::from_fn(|axis| tails[axis].folded(centre[axis] + deviation[axis] * normals[axis]))
            }
            Self::Cells(cells) => cells.at(share, uniforms),
            Self::Faces(faces) => faces.at(uniforms),
            Self::Spots(spots) => spots.at(share),
        }
    }
}

/// Box–Muller of four uniform numbers.
fn normals(uniforms: &[f64; 8]) -> [f64; 4] {
    let pair = |u: f64, v: f64| {
        let radius = (-2.0 * ln(u)).sqrt();
        let angle = std::f64::consts::TAU * v;
        [radius * cos(angle), radius * sin(angle)]
    };
    let ([a, b], [c, d]) = (pair(uniforms[0], uniforms[1]), pair(uniforms[2], uniforms[4]));
    [a, b, c, d]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_are_folded_into_the_domain() {
        let wall = Tail { low: Some(1.0), high: Some(3.0), is_periodic: false };
        for (x, folded) in [(1.5, 1.5), (0.5, 1.5), (3.25, 2.75), (6.0, 2.0), (-3.5, 1.5)] {
            assert!((wall.folded(x) - folded).abs() < 1e-15, "{x} is folded to {}", wall.folded(x));
        }
        let around = Tail { is_periodic: true, ..wall };
        for (x, folded) in [(1.5, 1.5), (0.5, 2.5), (3.25, 1.25), (-3.5, 2.5)] {
            assert!((around.folded(x) - folded).abs() < 1e-15, "{x} comes in at {}", around.folded(x));
        }
        let half = Tail { high: None, ..wall };
        assert_eq!((half.folded(0.5), half.folded(9.0)), (1.5, 9.0));
    }

    #[test]
    fn shares_follow_the_mass() {
        // Mass on the right half only: every share lies there, the median in its middle.
        let cells = Cells::new([0.0], [2.0], |xs| xs.iter().map(|x| f64::from(x[0] > 1.0)).collect());
        assert!((cells.total() - 1.0).abs() < 1e-5);
        let place = Place::Cells(cells);
        for (share, x) in [(0.001, 1.001), (0.5, 1.5), (0.999, 1.999)] {
            assert!((place.at(share, &[0.5; 8])[0] - x).abs() < 1e-5);
        }
        let faces = Faces::new(vec![([0.0, 0.0], [0.0, 1.0], 1.0), ([0.0, 1.0], [0.0, 2.0], 3.0)]);
        let uniforms = |face: f64| [0.5, 0.5, 0.5, face, 0.5, 0.5, 0.5, 0.5];
        let place = Place::Faces(faces);
        assert_eq!(place.at(0.0, &uniforms(0.2)), [0.0, 0.5]);
        assert_eq!(place.at(0.0, &uniforms(0.3)), [0.0, 1.5]);
    }

    #[test]
    fn cells_are_many_but_not_too_many() {
        assert_eq!(shape([0.0], [3.0]), [1 << 20]);
        let n = shape([0.0, 0.0], [200.0, 80.0]);
        assert!(n[0] * n[1] <= 1 << 20 && n[0] * n[1] > 1 << 19, "{n:?}");
        let n = shape([0.0, 0.0, 0.0], [1e3, 1.0, 1e-3]);
        assert!(n.iter().product::<usize>() <= 1 << 21 && n.iter().all(|&n| n >= 1), "{n:?}");
    }
}

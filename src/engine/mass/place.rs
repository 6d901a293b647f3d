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
    masses: Arc<Running>,
}

/// Rectangles of one side with a weight each.
#[derive(Debug, Clone, PartialEq)]
pub struct Faces<const D: usize> {
    corners: Arc<[([f64; D], [f64; D])]>,
    weights: Running,
}

/// Cells that an initial concentration is looked at in, in all.
const MOST_CELLS: f64 = 1_048_576.0;

/// Cells that are looked at together.
const BATCH: usize = 1024;

/// Parts of a cell along each axis beside a jump, by the number of axes, and in all, at most.
const PARTS: [usize; 3] = [1, 16, 6];
const MOST_PARTS: usize = 4 * 1_048_576;

/// Of the larger one of two neighbours, what is a jump between them.
const JUMP: f64 = 0.25;

/// Of the largest mass of a cell, what is next to nothing.
const NOTHING: f64 = 1e-9;

impl<const D: usize> Cells<D> {
    /// Cells over a domain. `mass` gives the masses per volume at a list of centres.
    ///
    /// - Equation: `M = Σ m_i V`.
    /// - Symbols: `m_i` mass per volume at the centre of a cell, or its mean over parts of one beside a jump; `V` volume.
    /// - Range: any; a box in a plane is right to a sixteenth of a cell at each side.
    /// - Source: midpoint rule.
    /// - Shape: running sums, which never fall where no mass is below zero.
    pub fn new(low: [f64; D], high: [f64; D], mass: impl Fn(&[[f64; D]]) -> Vec<f64>) -> Self {
        let mut cells = Self::with(low, high, Arc::new(Running::new(Vec::new())));
        cells.masses = Arc::new(cells.integrated(mass));
        cells
    }

    /// The same, with sums that were worked out before.
    pub fn with(low: [f64; D], high: [f64; D], masses: Arc<Running>) -> Self {
        let n = shape(low, high);
        let width = std::array::from_fn(|axis| (high[axis] - low[axis]) / n[axis] as f64);
        Self { low, width, n, masses }
    }

    fn integrated(&self, mass: impl Fn(&[[f64; D]]) -> Vec<f64>) -> Running {
        let volume: f64 = self.width.iter().product();
        let n_cells: usize = self.n.iter().product();
        let mut sums = Vec::with_capacity(n_cells);
        for first in (0..n_cells).step_by(BATCH) {
            let centres: Vec<[f64; D]> =
                (first..(first + BATCH).min(n_cells)).map(|cell| self.inside(cell, [0.5; D])).collect();
            sums.extend(mass(&centres));
        }
        self.refine(&mut sums, &mass);
        // A million roundings would show in the total: what each of them loses is kept.
        let (mut sum, mut lost) = (0.0_f64, 0.0_f64);
        for own in &mut sums {
            let term = *own * volume - lost;
            let next = sum + term;
            lost = (next - sum) - term;
            sum = next;
            *own = sum;
        }
        Running::new(sums)
    }

    /// Sums that [`Self::with`] takes.
    pub fn sums(&self) -> Arc<Running> {
        self.masses.clone()
    }

    /// Takes means over parts of cells beside a jump, as along lines cells are small enough, unless there are too many.
    fn refine(&self, masses: &mut [f64], mass: &dyn Fn(&[[f64; D]]) -> Vec<f64>) {
        let along = PARTS[D - 1];
        let n_parts = along.pow(D as u32);
        if along == 1 {
            return;
        }
        let most = masses.iter().fold(0.0_f64, |most, own| most.max(own.abs()));
        let jumps: Vec<usize> =
            (0..masses.len()).filter(|&cell| self.is_beside_jump(masses, cell, NOTHING * most)).collect();
        if jumps.len().saturating_mul(n_parts) > MOST_PARTS {
            return;
        }
        let part = |cell: usize, mut part: usize| {
            let fraction = std::array::from_fn(|_| {
                let own = part % along;
                part /= along;
                (own as f64 + 0.5) / along as f64
            });
            self.inside(cell, fraction)
        };
        for some in jumps.chunks(BATCH / n_parts) {
            let places: Vec<[f64; D]> =
                some.iter().flat_map(|&cell| (0..n_parts).map(move |own| part(cell, own))).collect();
            for (cell, own) in some.iter().zip(mass(&places).chunks(n_parts)) {
                masses[*cell] = own.iter().sum::<f64>() / n_parts as f64;
            }
        }
    }

    /// Whether a neighbour along an axis has much more, or much less; what is next to nothing does not count.
    fn is_beside_jump(&self, masses: &[f64], cell: usize, nothing: f64) -> bool {
        let own = masses[cell];
        let differs = |other: f64| {
            let most = own.abs().max(other.abs());
            most > nothing && (own - other).abs() > JUMP * most
        };
        let mut stride = 1;
        for n in self.n.into_iter().rev() {
            // At the ends of an axis these are of another row, which is looked at closely for nothing.
            let beside = [cell.checked_sub(stride), Some(cell + stride)].into_iter().flatten();
            if beside.filter_map(|other| masses.get(other)).any(|&other| differs(other)) {
                return true;
            }
            stride *= n;
        }
        false
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

    /// Boxes and balls have their volume, wherever the sides of cells are.
    #[test]
    fn jumps_are_looked_at_closely() {
        let is_in = |x: f64, low: f64, high: f64| x >= low && x <= high;
        let of_box = |places: &[[f64; 2]]| -> Vec<f64> {
            places.iter().map(|p| f64::from(is_in(p[0], 20.0, 30.0) && is_in(p[1], 50.0, 150.0))).collect()
        };
        // Cells are 0.28 m long: looked at in their middles alone they have 1022 of 1000.
        let total = Cells::new([0.0, 0.0], [400.0, 200.0], of_box).total();
        assert!((total / 1000.0 - 1.0).abs() < 2e-3, "{total}");
        let of_ball = |places: &[[f64; 3]]| -> Vec<f64> {
            let square = |p: &[f64; 3]| p.iter().map(|x| (x - 0.31) * (x - 0.31)).sum::<f64>();
            places.iter().map(|p| f64::from(square(p) <= 0.05 * 0.05)).collect()
        };
        let volume = 4.0 / 3.0 * std::f64::consts::PI * 0.05_f64.powi(3);
        let total = Cells::new([0.0; 3], [1.0; 3], of_ball).total();
        assert!((total / volume - 1.0).abs() < 3e-3, "{total} {volume}");
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

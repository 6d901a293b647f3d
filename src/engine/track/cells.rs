//! Velocities on rectilinear cells: linear between faces for the drift, between corners for dispersion.
//!
//! Owns the interpolation of one flow. May use `flow` and lanes. It deliberately keeps velocities in 32 bits:
//! six parts in 1e8 of a velocity, and half the memory.

#![allow(clippy::needless_range_loop)] // Loops over lanes are hot, and zips of many arrays hard to read.

use super::lanes::{LANES, Lane, Narrow};
use super::medium::{Carrier, Criteria, Leap, Medium};
use crate::flow::FaceFlow;

/// Corners of a cell in three dimensions.
const CORNERS: usize = 8;
/// Numbers that are read together.
const GROUP: usize = 4;
/// Fours of numbers that a particle reads there.
const MOST_QUADS: usize = n_quads::<3>();

/// Dispersivities, m, and molecular diffusion, m²/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dispersivity {
    pub longitudinal: f64,
    pub transverse: f64,
    pub molecular: f64,
}

/// A flow on cells with equal porosity.
#[derive(Debug, Clone, PartialEq)]
pub struct CellMedium<const D: usize> {
    ruler: [Ruler; D],
    strides: [usize; D],
    /// Per cell what a particle in it reads: pore velocities through the lower and the upper face of each axis,
    /// then those at the corners (last axis fastest), component by component, m/s; four at a time.
    quads: Vec<[f32; GROUP]>,
    dispersivity: Dispersivity,
}

/// Edges along one axis.
#[derive(Debug, Clone, PartialEq)]
struct Ruler {
    low: f64,
    inverse_width: f64,
    n: usize,
}

/// Coefficients of 64 particles.
#[derive(Debug, Clone)]
pub struct Look<const D: usize> {
    /// m/s
    drift: [Narrow; D],
    /// √(2 D_L), √(2 D_T), m/√s
    along: Narrow,
    across: Narrow,
    /// Unit vector of the velocity.
    direction: [Narrow; D],
    /// Pore velocity of the faces, over R, m/s.
    speed: [Narrow; D],
    around: Around<D>,
}

impl<const D: usize> CellMedium<D> {
    /// From the flow over the axes `axes` of the scene. `None` if cells are not equal along an axis, or if the
    /// porosity is not the same everywhere.
    pub fn new(flow: &FaceFlow, axes: [usize; D], dispersivity: Dispersivity) -> Option<Self> {
        let porosity = *flow.porosity.first()?;
        let is_even = flow.porosity.iter().all(|other| *other == porosity);
        let n = axes.map(|axis| flow.cells.n()[axis]);
        let mut ruler = Vec::with_capacity(D);
        for axis in axes {
            ruler.push(Ruler::new(&flow.cells.edges()[axis])?);
        }
        let ruler: [Ruler; D] = ruler.try_into().ok()?;
        if !is_even || porosity <= 0.0 {
            return None;
        }
        let faces =
            Faces { n, velocity: axes.map(|axis| flow.flux[axis].iter().map(|q| q / porosity).collect()) };
        Some(Self { ruler, strides: strides(n), quads: faces.records(), dispersivity })
    }

    /// Velocities around each place: two faces per axis, and all corners.
    #[inline(always)]
    fn gather(&self, positions: &[Lane; D], around: &mut Around<D>) {
        let Around { place, fraction, index, quads, .. } = around;
        for axis in 0..D {
            let Ruler { low, inverse_width, n } = self.ruler[axis];
            let last = (n as f64).next_down();
            let (x, place, fraction) = (&positions[axis], &mut place[axis], &mut fraction[axis]);
            for lane in 0..LANES {
                let along = (x[lane] - low) * inverse_width;
                let along = if along > 0.0 { along } else { 0.0 };
                let along = if along < last { along } else { last };
                // On a face either cell will do: both say the same there.
                let shifted = (along - 0.5) + SHIFT;
                place[lane] = shifted.to_bits() as i32;
                fraction[lane] = (along - (shifted - SHIFT)) as f32;
            }
        }
        number(place, &self.strides, index);
        // Four particles at a time, so that sixteen numbers are turned round in registers.
        let (groups, _) = index.as_chunks::<GROUP>();
        for (group, cells) in groups.iter().enumerate() {
            // Loops: what is handed to a function is not compiled wide.
            let mut records: [&[[f32; GROUP]]; GROUP] = [&[]; GROUP];
            for lane in 0..GROUP {
                let first = cells[lane] as usize * n_quads::<D>();
                records[lane] = &self.quads[first..first + n_quads::<D>()];
            }
            for q in 0..n_quads::<D>() {
                for k in 0..GROUP {
                    let mut turned = [0.0; GROUP];
                    for lane in 0..GROUP {
                        turned[lane] = records[lane][q][k];
                    }
                    quads[GROUP * q + k].as_chunks_mut::<GROUP>().0[group] = turned;
                }
            }
        }
    }
}

/// Numbers that a particle reads of its cell.
const fn n_numbers<const D: usize>() -> usize {
    2 * D + (D << D)
}

/// The same in fours.
const fn n_quads<const D: usize>() -> usize {
    n_numbers::<D>().div_ceil(4)
}

/// Pore velocities through the faces normal to each axis.
struct Faces<const D: usize> {
    n: [usize; D],
    velocity: [Vec<f64>; D],
}

impl<const D: usize> Faces<D> {
    fn strides(&self, axis: usize) -> [usize; D] {
        let mut n = self.n;
        n[axis] += 1;
        strides(n)
    }

    /// What particles read, cell by cell.
    fn records(&self) -> Vec<[f32; 4]> {
        let n_cells: usize = self.n.iter().product();
        let mut quads = vec![[0.0; 4]; n_cells * n_quads::<D>()];
        for cell in 0..n_cells {
            let mut rest = cell;
            let mut place = [0; D];
            for axis in (0..D).rev() {
                place[axis] = rest % self.n[axis];
                rest /= self.n[axis];
            }
            let mut k = 0;
            let mut put = |value: f64| {
                quads[cell * n_quads::<D>() + k / 4][k % 4] = value as f32;
                k += 1;
            };
            for axis in 0..D {
                let strides = self.strides(axis);
                let face: usize = (0..D).map(|other| place[other] * strides[other]).sum();
                put(self.velocity[axis][face]);
                put(self.velocity[axis][face + strides[axis]]);
            }
            for corner in 0..1_usize << D {
                let at: [usize; D] = std::array::from_fn(|axis| place[axis] + (corner >> (D - 1 - axis) & 1));
                (0..D).for_each(|axis| put(self.at_corner(at, axis)));
            }
        }
        quads
    }

    /// Mean over the faces that touch a corner; they all have the same area.
    fn at_corner(&self, place: [usize; D], axis: usize) -> f64 {
        let strides = self.strides(axis);
        let (mut sum, mut count) = (0.0, 0.0);
        for choice in 0..1_usize << D {
            // The faces normal to the axis lie at the corner along it, on either side along the others.
            let side = |other: usize| choice >> other & 1;
            if side(axis) == 1 {
                continue;
            }
            let along = |other: usize| match other == axis {
                true => Some(place[other]),
                false => (place[other] + side(other)).checked_sub(1).filter(|&k| k < self.n[other]),
            };
            let face: Option<usize> = (0..D).map(|other| Some(along(other)? * strides[other])).sum();
            if let Some(face) = face {
                sum += self.velocity[axis][face];
                count += 1.0;
            }
        }
        sum / count
    }
}

/// Numbers of places in an array of these strides.
#[inline(always)]
fn number<const D: usize>(place: &[[i32; LANES]; D], strides: &[usize; D], index: &mut [i32; LANES]) {
    index.fill(0);
    for axis in 0..D {
        let stride = strides[axis] as i32;
        for lane in 0..LANES {
            index[lane] += place[axis][lane] * stride;
        }
    }
}

/// Added to a number of moderate size it leaves the nearest whole number in the low bits.
const SHIFT: f64 = 6_755_399_441_055_744.0;

fn strides<const D: usize>(n: [usize; D]) -> [usize; D] {
    let mut strides = [1; D];
    for axis in (0..D.saturating_sub(1)).rev() {
        strides[axis] = strides[axis + 1] * n[axis + 1];
    }
    strides
}

impl Ruler {
    fn new(edges: &[f64]) -> Option<Self> {
        let (&low, &high) = (edges.first()?, edges.last()?);
        let n = edges.len() - 1;
        let width = (high - low) / n as f64;
        let is_even = |(idx, edge): (usize, &f64)| (edge - low - width * idx as f64).abs() <= 1e-9 * width;
        edges.iter().enumerate().all(is_even).then_some(Self { low, inverse_width: 1.0 / width, n })
    }
}

/// What lies around 64 places.
#[derive(Debug, Clone)]
struct Around<const D: usize> {
    place: [[i32; LANES]; D],
    fraction: [Narrow; D],
    index: [i32; LANES],
    /// The records of the cells, four numbers at a time.
    quads: [Narrow; GROUP * MOST_QUADS],
}

impl<const D: usize> Around<D> {
    #[inline(always)]
    fn new() -> Self {
        Self {
            place: [[0; LANES]; D],
            fraction: [[0.0; LANES]; D],
            index: [0; LANES],
            quads: [[0.0; LANES]; GROUP * MOST_QUADS],
        }
    }

    /// Number `k` of the record of a lane.
    #[inline(always)]
    fn at(&self, k: usize, lane: usize) -> f32 {
        self.quads[k][lane]
    }

    /// Velocity between the two faces of an axis.
    #[inline(always)]
    fn between_faces(&self, axis: usize, lane: usize) -> f32 {
        let (low, high) = (self.at(2 * axis, lane), self.at(2 * axis + 1, lane));
        low + self.fraction[axis][lane] * (high - low)
    }

    /// One component between the corners, and its gradient.
    ///
    /// - Equation: multilinear interpolation, one axis after the other from the last.
    /// - Symbols: fractions of the cell along each axis; gradients over `1 / inverse_width`.
    /// - Range: fractions from 0 to 1.
    /// - Source: methods, section 1.3 (LaBolle et al. 1996, doi:10.1029/95WR03528).
    /// - Shape: one particle; the loop over lanes around it is one loop.
    #[inline(always)]
    fn between(&self, component: usize, inverse_width: &[f32; D], lane: usize) -> (f32, [f32; D]) {
        let first = 2 * D + component;
        let mut c = [0.0; CORNERS];
        for corner in 0..1_usize << D {
            c[corner] = self.at(first + corner * D, lane);
        }
        let mut u = [0.0; D];
        for axis in 0..D {
            u[axis] = self.fraction[axis][lane];
        }
        let mut slope = [0.0; D];
        // Written out: loops whose length hangs on a loop around them would keep the lanes apart.
        let value = match D {
            1 => {
                let along = Edge::new(c[0], c[1], u[0]);
                slope[0] = along.step * inverse_width[0];
                along.value
            }
            2 => {
                let ends = [Edge::new(c[0], c[1], u[1]), Edge::new(c[2], c[3], u[1])];
                let (value, slopes) = face(ends, u[0], [inverse_width[0], inverse_width[1]]);
                (slope[0], slope[1]) = (slopes[0], slopes[1]);
                value
            }
            _ => {
                let width = [inverse_width[1], inverse_width[2]];
                let low = [Edge::new(c[0], c[1], u[2]), Edge::new(c[2], c[3], u[2])];
                let high = [Edge::new(c[4], c[5], u[2]), Edge::new(c[6], c[7], u[2])];
                let (low, high) = (face(low, u[1], width), face(high, u[1], width));
                let along = Edge::new(low.0, high.0, u[0]);
                slope[0] = along.step * inverse_width[0];
                slope[1] = Edge::new(low.1[0], high.1[0], u[0]).value;
                slope[2] = Edge::new(low.1[1], high.1[1], u[0]).value;
                along.value
            }
        };
        (value, slope)
    }
}

/// Between two numbers.
#[derive(Clone, Copy)]
struct Edge {
    value: f32,
    step: f32,
}

impl Edge {
    #[inline(always)]
    fn new(low: f32, high: f32, u: f32) -> Self {
        let step = high - low;
        Self { value: low + u * step, step }
    }
}

/// Between two edges: the value, and the gradient across them and along them.
#[inline(always)]
fn face(ends: [Edge; 2], u: f32, inverse_width: [f32; 2]) -> (f32, [f32; 2]) {
    let across = Edge::new(ends[0].value, ends[1].value, u);
    let along = Edge::new(ends[0].step * inverse_width[1], ends[1].step * inverse_width[1], u);
    (across.value, [across.step * inverse_width[0], along.value])
}

impl<const D: usize> Medium<D> for CellMedium<D> {
    type Look = Look<D>;

    fn blank(&self) -> Look<D> {
        Look {
            drift: [[0.0; LANES]; D],
            along: [0.0; LANES],
            across: [0.0; LANES],
            direction: [[0.0; LANES]; D],
            speed: [[0.0; LANES]; D],
            around: Around::new(),
        }
    }

    /// Coefficients of a displacement.
    ///
    /// - Equation: `A = (v + ∇·D)/R`,
    ///   `(∇·D)_i = α_T ∂_i V + (α_L − α_T) [Σ_j (v_j ∂_j v_i + v_i ∂_j v_j)/V − Σ_j v_i v_j ∂_j V/V²]`.
    /// - Symbols: `v` between faces in the drift, between corners in `D`; `V = |v|`, `∂_i V = Σ_k v_k ∂_i v_k/V`.
    /// - Range: any velocity; where it is zero only molecular diffusion is left.
    /// - Source: methods, sections 1.2 and 1.3 (Salamon et al. 2006, doi:10.1016/j.jconhyd.2006.05.005).
    /// - Shape: 64 particles.
    #[inline(always)]
    fn look(&self, carrier: &Carrier, positions: &[Lane; D], look: &mut Look<D>) {
        let Look { drift, along: root_along, across: root_across, direction, speed, around } = look;
        self.gather(positions, around);
        let mobility = carrier.mobility as f32;
        let along = self.dispersivity.longitudinal as f32;
        let across = self.dispersivity.transverse as f32;
        let molecular = carrier.molecular.unwrap_or(self.dispersivity.molecular) as f32;
        let mut inverse_width = [0.0_f32; D];
        for axis in 0..D {
            inverse_width[axis] = self.ruler[axis].inverse_width as f32;
        }
        for lane in 0..LANES {
            let (mut n, mut slopes) = ([0.0_f32; D], [[0.0_f32; D]; D]);
            let mut square = f32::MIN_POSITIVE;
            for i in 0..D {
                (n[i], slopes[i]) = around.between(i, &inverse_width, lane);
                square += n[i] * n[i];
            }
            let magnitude = square.sqrt();
            let inverse = 1.0 / magnitude;
            let mut speed_slope = [0.0_f32; D];
            let mut rest = 0.0;
            for i in 0..D {
                n[i] *= inverse;
                direction[i][lane] = n[i];
            }
            for i in 0..D {
                for k in 0..D {
                    speed_slope[i] += n[k] * slopes[k][i];
                }
                rest += slopes[i][i] - n[i] * speed_slope[i];
            }
            root_along[lane] = (2.0 * mobility * (along * magnitude + molecular)).sqrt();
            root_across[lane] = (2.0 * mobility * (across * magnitude + molecular)).sqrt();
            for i in 0..D {
                let mut turning = n[i] * rest;
                for j in 0..D {
                    turning += n[j] * slopes[i][j];
                }
                let spreading = across * speed_slope[i] + (along - across) * turning;
                let flow = around.between_faces(i, lane);
                speed[i][lane] = flow * mobility;
                drift[i][lane] = (flow + spreading) * mobility;
            }
        }
    }

    /// - Equation: `B ξ = b ξ + (a − b) n (n·ξ)`, `a = √(2D_L)`, `b = √(2D_T)`.
    /// - Symbols: `n` the direction of flow; its covariance is `b² (I − nnᵀ) + a² nnᵀ = 2D`.
    /// - Range: any direction.
    /// - Source: methods, section 1.2.
    /// - Shape: 64 particles.
    #[inline(always)]
    fn displace(&self, look: &Look<D>, leap: &Leap, normals: [&Lane; D], positions: &mut [Lane; D]) {
        let mut xi = [[0.0_f32; LANES]; D];
        let mut projection = [0.0_f32; LANES];
        for axis in 0..D {
            for lane in 0..LANES {
                xi[axis][lane] = normals[axis][lane] as f32;
            }
            for lane in 0..LANES {
                projection[lane] += look.direction[axis][lane] * xi[axis][lane];
            }
        }
        for axis in 0..D {
            for lane in 0..LANES {
                let (a, b) = (look.along[lane], look.across[lane]);
                let kick = b * xi[axis][lane] + (a - b) * projection[lane] * look.direction[axis][lane];
                xi[axis][lane] =
                    look.drift[axis][lane] * leap.narrow_time[lane] + kick * leap.narrow_root[lane];
            }
        }
        for axis in 0..D {
            for lane in 0..LANES {
                positions[axis][lane] += f64::from(xi[axis][lane]);
            }
        }
    }

    #[inline(always)]
    fn spread_along(&self, look: &Look<D>, axis: usize, spread: &mut Lane) {
        for lane in 0..LANES {
            let n = look.direction[axis][lane];
            let (a, b) = (look.along[lane], look.across[lane]);
            spread[lane] = f64::from(b * b + n * n * (a * a - b * b));
        }
    }

    #[inline(always)]
    fn longest(&self, look: &Look<D>, criteria: &Criteria, time: &mut Lane) {
        let inverse_width: [f32; D] = std::array::from_fn(|axis| self.ruler[axis].inverse_width as f32);
        let (courant, dispersion) = ((1.0 / criteria.courant) as f32, (0.5 / criteria.dispersion) as f32);
        for lane in 0..LANES {
            let (mut flow, mut spread) = (0.0_f32, 0.0_f32);
            let (a, b) = (look.along[lane], look.across[lane]);
            for axis in 0..D {
                let n = look.direction[axis][lane];
                flow += look.speed[axis][lane].abs() * inverse_width[axis];
                spread += (b * b + n * n * (a * a - b * b)) * inverse_width[axis] * inverse_width[axis];
            }
            let rate = (flow * courant).max(spread * dispersion);
            time[lane] = f64::from(1.0 / rate.max(f32::MIN_POSITIVE));
        }
    }

    fn drift(&self, look: &Look<D>, axis: usize, lane: usize) -> f64 {
        f64::from(look.drift[axis][lane])
    }

    fn tensor(&self, look: &Look<D>, lane: usize) -> [[f64; D]; D] {
        let (along, across) = (f64::from(look.along[lane]), f64::from(look.across[lane]));
        let n: [f64; D] = std::array::from_fn(|axis| f64::from(look.direction[axis][lane]));
        let own = |i: usize, j: usize| if i == j { across * across } else { 0.0 };
        let entry = |i: usize, j: usize| 0.5 * (own(i, j) + (along * along - across * across) * n[i] * n[j]);
        std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
    }

    fn porosity(&self, _: [f64; D]) -> f64 {
        1.0
    }

    fn velocity(&self, place: [f64; D], axis: usize) -> f64 {
        let mut around = Around::new();
        self.gather(&place.map(|x| [x; LANES]), &mut around);
        f64::from(around.between_faces(axis, 0))
    }
}

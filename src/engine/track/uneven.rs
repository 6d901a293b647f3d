//! Flow on cells of any width and porosity, with up to three dispersivities.
//!
//! Owns drift and spread there. May use `flow` and lanes. It deliberately leaves equal cells with one porosity and
//! two dispersivities to `track::cells`, which is faster.

#![allow(clippy::needless_range_loop)] // Loops over lanes are hot.

mod around;
mod blend;
mod jumps;
pub(super) mod records;
pub(super) mod ruler;

use super::lanes::{LANES, Lane, Lanes, Narrow};
use super::medium::{Carrier, Criteria, Leap, Medium};
use super::walls::Stride;
use crate::flow::FaceFlow;
use around::{Around, CORNERS};
pub use blend::Blend;
use jumps::{Chance, Jumps};
use records::{records, strides};
use ruler::Ruler;

/// Dispersivities, m, and molecular diffusion, m²/s.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lengths {
    pub longitudinal: f64,
    pub transverse: f64,
    /// Vertically across the flow, where that is another one than `transverse`: in three dimensions only.
    pub vertical: Option<f64>,
    pub molecular: f64,
}

/// A flow on cells.
#[derive(Debug, Clone, PartialEq)]
pub struct UnevenMedium<const D: usize> {
    rulers: [Ruler; D],
    strides: [usize; D],
    quads: Vec<[f32; 4]>,
    /// Per cell.
    porosity: Vec<f64>,
    /// Absent where the porosity is the same everywhere.
    jumps: Option<Jumps>,
    lengths: Lengths,
}

/// Coefficients of 64 particles.
#[derive(Debug, Clone)]
pub struct Look<const D: usize> {
    /// m/s
    drift: [Narrow; D],
    /// √(2 D), m/√s, along the flow, across it upwards, and across it on the level.
    along: Narrow,
    across: Narrow,
    level: Narrow,
    /// Unit vectors of the flow, and on the level across it.
    direction: [Narrow; D],
    sideways: [Narrow; 2],
    /// Pore velocity of the faces, over R, m/s.
    speed: [Narrow; D],
    around: Around<D>,
    /// Per component and axis the gradient, while it is worked out.
    slopes: [[[Narrow; CORNERS / 2]; D]; D],
}

impl<const D: usize> Look<D> {
    /// Dispersion tensor of a lane, over R, m²/s.
    fn tensor(&self, lane: usize) -> [[f64; D]; D] {
        let [a, b, c] = [&self.along, &self.across, &self.level].map(|root| f64::from(root[lane]));
        let n: [f64; D] = std::array::from_fn(|axis| f64::from(self.direction[axis][lane]));
        let level = |axis: usize| self.sideways.get(axis).map_or(0.0, |t| f64::from(t[lane]));
        // Without a third length there is no direction on the level.
        let entry = |i: usize, j: usize| {
            let own = if i == j { b * b } else { 0.0 };
            0.5 * (own + (a * a - b * b) * n[i] * n[j] + (c * c - b * b) * level(i) * level(j))
        };
        std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
    }
}

impl<const D: usize> UnevenMedium<D> {
    /// From the flow over the axes `axes` of the scene.
    pub fn new(flow: &FaceFlow, axes: [usize; D], lengths: Lengths) -> Self {
        let rulers = axes.map(|axis| Ruler::new(&flow.cells.edges()[axis]));
        let n = axes.map(|axis| flow.cells.n()[axis]);
        let vertical = lengths.vertical.filter(|vertical| D == 3 && *vertical != lengths.transverse);
        Self {
            rulers,
            strides: strides(n),
            quads: records(flow, axes),
            porosity: flow.porosity.clone(),
            jumps: Jumps::new(n, &flow.porosity),
            lengths: Lengths { vertical, ..lengths },
        }
    }

    fn cell(&self, place: [f64; D]) -> usize {
        (0..D).map(|axis| self.rulers[axis].cell(place[axis]) * self.strides[axis]).sum()
    }

    /// Speeds, unit vectors and `√(2 D)` of all directions.
    ///
    /// - Equation: eigenvectors `n = q/|q|`, `t = (q_y, −q_x, 0)/q_h`, `n × t` with the values `2(α_L V + D_m)`,
    ///   `2((α_H q_h² + α_V q_z²)/|q|² V + D_m)`, `2(α_V V + D_m)`, all over R.
    /// - Symbols: `q` discharge between corners, `q_h² = q_x² + q_y²`, `V = |q|/φ`, α lengths along, on the level
    ///   across and upwards across; `D_m` molecular.
    /// - Range: any discharge; where it is vertical or zero the last two are equal, and `t` is not asked for.
    /// - Source: the tensor of R. D. Burnett, E. O. Frind (1987), Water Resources Research 23(4), 695; its
    ///   eigenvectors follow by multiplication. P. C. Lichtner, S. Kelkar, B. Robinson (2002),
    ///   doi:10.1029/2000WR000127, give tensors of such axes.
    /// - Shape: 64 particles.
    #[inline(always)]
    fn spread(&self, carrier: &Carrier, look: &mut Look<D>) -> Narrow {
        let mobility = carrier.mobility as f32;
        let along = self.lengths.longitudinal as f32;
        let level = self.lengths.transverse as f32;
        let across = self.lengths.vertical.unwrap_or(self.lengths.transverse) as f32;
        let molecular = mobility * carrier.molecular.unwrap_or(self.lengths.molecular) as f32;
        let mut share = [0.0_f32; LANES];
        for lane in 0..LANES {
            let mut square = f32::MIN_POSITIVE;
            for i in 0..D {
                square += look.direction[i][lane] * look.direction[i][lane];
            }
            let speed = square.sqrt();
            let inverse = 1.0 / speed;
            for i in 0..D {
                look.direction[i][lane] *= inverse;
            }
            share[lane] = mobility * look.around.inverse_porosity()[lane];
            let speed = speed * share[lane];
            // In a cell without water nothing spreads either.
            let own = if share[lane] > 0.0 { molecular } else { 0.0 };
            look.along[lane] = (2.0 * (along * speed + own)).sqrt();
            look.across[lane] = (2.0 * (across * speed + own)).sqrt();
            if self.lengths.vertical.is_some() {
                let (x, y) = (look.direction[0][lane], look.direction[1][lane]);
                let square = x * x + y * y;
                let inverse = 1.0 / square.max(f32::MIN_POSITIVE).sqrt();
                look.sideways[0][lane] = y * inverse;
                look.sideways[1][lane] = -x * inverse;
                let length = across + (level - across) * square;
                look.level[lane] = (2.0 * (length * speed + own)).sqrt();
            }
        }
        share
    }

    /// Adds what the third dispersivity does to the divergence of the tensor.
    ///
    /// - Equation: `∇·(γ T/|q|)`, `T = [[q_y², −q_x q_y], [−q_x q_y, q_x²]]` on the level, `γ = α_H − α_V`.
    /// - Symbols: as in `spread`; `slopes[k][i][0] = ∂_i q_k`.
    /// - Range: any discharge.
    /// - Source: the product rule.
    /// - Shape: two components, 64 particles.
    #[inline(always)]
    fn turn_sideways(&self, look: &Look<D>, rise: &[Narrow; D], spreading: &mut [Narrow; D]) {
        let Some(vertical) = self.lengths.vertical else { return };
        let excess = (self.lengths.transverse - vertical) as f32;
        let slopes = &look.slopes;
        for lane in 0..LANES {
            let (x, y) = (look.direction[0][lane], look.direction[1][lane]);
            let (xx, xy) = (slopes[0][0][0][lane], slopes[0][1][0][lane]);
            let (yx, yy) = (slopes[1][0][0][lane], slopes[1][1][0][lane]);
            let (by_x, by_y) = (rise[0][lane], rise[1][lane]);
            spreading[0][lane] += excess * (2.0 * y * yx - x * yy - y * xy - y * y * by_x + x * y * by_y);
            spreading[1][lane] += excess * (2.0 * x * xy - x * yx - y * xx - x * x * by_y + x * y * by_x);
        }
    }
}

impl<const D: usize> Medium<D> for UnevenMedium<D> {
    type Look = Look<D>;

    fn blank(&self) -> Look<D> {
        Look {
            drift: [[0.0; LANES]; D],
            along: [0.0; LANES],
            across: [0.0; LANES],
            level: [0.0; LANES],
            direction: [[0.0; LANES]; D],
            sideways: [[0.0; LANES]; 2],
            speed: [[0.0; LANES]; D],
            around: Around::new(),
            slopes: [[[[0.0; LANES]; CORNERS / 2]; D]; D],
        }
    }

    /// Coefficients of a displacement.
    ///
    /// - Equation: `A = [q + ∇·(φD)]/(φR)`, with `φD` of the discharge between corners as
    ///   [`track::cells`](super::cells) has `D` of the velocity.
    /// - Symbols: `q` specific discharge between faces, `φ` porosity of the cell, `R` retardation.
    /// - Range: any discharge; where it is zero only molecular diffusion is left. `φ` jumps at faces: `jumps` mends
    ///   what went over one.
    /// - Source: methods, sections 1.2 and 1.3; `φD = α|q|` needs no porosity.
    /// - Shape: 64 particles.
    #[inline(always)]
    fn look(&self, carrier: &Carrier, positions: &[Lane; D], look: &mut Look<D>) {
        look.around.gather(&self.rulers, &self.strides, &self.quads, positions);
        for component in 0..D {
            look.around.between(component, &mut look.slopes[component]);
            look.direction[component] = look.around.values[0];
        }
        let share = self.spread(carrier, look);
        let mut rise = [[0.0_f32; LANES]; D];
        let mut rest = [0.0_f32; LANES];
        for i in 0..D {
            for lane in 0..LANES {
                let mut sum = 0.0;
                for k in 0..D {
                    sum += look.direction[k][lane] * look.slopes[k][i][0][lane];
                }
                rise[i][lane] = sum;
                rest[lane] += look.slopes[i][i][0][lane] - look.direction[i][lane] * sum;
            }
        }
        let along = self.lengths.longitudinal as f32;
        let across = self.lengths.vertical.unwrap_or(self.lengths.transverse) as f32;
        let mut spreading = [[0.0_f32; LANES]; D];
        for i in 0..D {
            for lane in 0..LANES {
                let mut turning = look.direction[i][lane] * rest[lane];
                for j in 0..D {
                    turning += look.direction[j][lane] * look.slopes[i][j][0][lane];
                }
                spreading[i][lane] = across * rise[i][lane] + (along - across) * turning;
            }
        }
        self.turn_sideways(look, &rise, &mut spreading);
        for i in 0..D {
            for lane in 0..LANES {
                let flow = look.around.between_faces(i, lane);
                look.speed[i][lane] = flow * share[lane];
                look.drift[i][lane] = (flow + spreading[i][lane]) * share[lane];
            }
        }
    }

    /// - Equation: `B ξ = b ξ + (a − b) n (n·ξ) + (c − b) t (t·ξ)`, `a`, `b`, `c` the roots along, upwards and on the
    ///   level across.
    /// - Symbols: `n`, `t` unit vectors of the flow and on the level across it.
    /// - Range: any direction; the last term only where there is a third length.
    /// - Source: the eigenvectors in `spread`.
    /// - Shape: 64 particles.
    #[inline(always)]
    fn displace(&self, look: &Look<D>, leap: &Leap, normals: [&Lane; D], positions: &mut [Lane; D]) {
        let mut kick = [[0.0_f32; LANES]; D];
        for lane in 0..LANES {
            let xi: [f32; D] = std::array::from_fn(|axis| normals[axis][lane] as f32);
            let mut projection = 0.0;
            for axis in 0..D {
                projection += look.direction[axis][lane] * xi[axis];
            }
            let (a, b) = (look.along[lane], look.across[lane]);
            for axis in 0..D {
                kick[axis][lane] = b * xi[axis] + (a - b) * projection * look.direction[axis][lane];
            }
            if self.lengths.vertical.is_some() {
                let t = [look.sideways[0][lane], look.sideways[1][lane]];
                let across = (look.level[lane] - b) * (t[0] * xi[0] + t[1] * xi[1]);
                kick[0][lane] += across * t[0];
                kick[1][lane] += across * t[1];
            }
        }
        for axis in 0..D {
            for lane in 0..LANES {
                let way = look.drift[axis][lane] * leap.narrow_time[lane]
                    + kick[axis][lane] * leap.narrow_root[lane];
                positions[axis][lane] += f64::from(way);
            }
        }
    }

    #[inline(always)]
    fn settle(&self, stride: &Stride<D, Self>, lanes: &mut Lanes<D>) {
        if let Some(jumps) = &self.jumps {
            let Stride { look, carrier, .. } = *stride;
            let own = carrier.molecular.unwrap_or(self.lengths.molecular) * carrier.mobility;
            let chance = Chance { tensor: &|lane| look.tensor(lane), even: Some(own) };
            jumps.settle((self, &look.around), stride, &chance, lanes);
        }
    }

    #[inline(always)]
    fn spread_along(&self, look: &Look<D>, axis: usize, spread: &mut Lane) {
        for lane in 0..LANES {
            let n = look.direction[axis][lane];
            let (a, b) = (look.along[lane], look.across[lane]);
            spread[lane] = f64::from(b * b + n * n * (a * a - b * b));
        }
        if self.lengths.vertical.is_some() && axis < 2 {
            for lane in 0..LANES {
                let t = look.sideways[axis][lane];
                let (b, c) = (look.across[lane], look.level[lane]);
                spread[lane] += f64::from(t * t * (c * c - b * b));
            }
        }
    }

    #[inline(always)]
    fn longest(&self, look: &Look<D>, criteria: &Criteria, time: &mut Lane) {
        let (courant, dispersion) = ((1.0 / criteria.courant) as f32, (0.5 / criteria.dispersion) as f32);
        let mut spread = [[0.0; LANES]; D];
        for axis in 0..D {
            self.spread_along(look, axis, &mut spread[axis]);
        }
        for lane in 0..LANES {
            let (mut flow, mut number) = (0.0_f32, 0.0_f32);
            for axis in 0..D {
                let inverse = look.around.inverse_width[axis][lane];
                flow += look.speed[axis][lane].abs() * inverse;
                number += spread[axis][lane] as f32 * inverse * inverse;
            }
            let rate = (flow * courant).max(number * dispersion);
            time[lane] = f64::from(1.0 / rate.max(f32::MIN_POSITIVE));
        }
    }

    fn drift(&self, look: &Look<D>, axis: usize, lane: usize) -> f64 {
        f64::from(look.drift[axis][lane])
    }

    fn tensor(&self, look: &Look<D>, lane: usize) -> [[f64; D]; D] {
        look.tensor(lane)
    }

    fn porosity(&self, place: [f64; D]) -> f64 {
        self.porosity[self.cell(place)]
    }

    fn velocity(&self, place: [f64; D], axis: usize) -> f64 {
        let mut around = Around::new();
        around.gather(&self.rulers, &self.strides, &self.quads, &place.map(|x| [x; LANES]));
        let porosity = self.porosity[around.index[0] as usize];
        if porosity > 0.0 { f64::from(around.between_faces(axis, 0)) / porosity } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::flow::Cells;
    use crate::plan::burnett_frind::uniform_tensor;

    /// Reference: the tensor of the plan. Discharge is kept in 32 bits.
    #[test]
    fn the_tensor_is_that_of_uniform_flow_in_every_direction() {
        let edges = || vec![0.0, 0.5, 2.0];
        let mut state = 1_u64;
        let mut next = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / 4_503_599_627_370_496.0 - 1.0
        };
        let mut velocities: Vec<[f64; 3]> = (0..50).map(|_| [next(), next(), next()]).collect();
        velocities.extend([[0.0, 0.0, 0.8], [0.0, 0.0, -0.8], [0.0; 3], [1e-7, 0.0, 1.0], [0.0, 2.0, 0.0]]);
        for v in velocities {
            let cells = Cells::new([edges(), edges(), edges()]).unwrap();
            let flux = [0, 1, 2].map(|axis| vec![0.2 * v[axis]; cells.n_faces(axis)]);
            let porosity = vec![0.2; cells.n_cells()];
            let flow = FaceFlow { cells, flux, porosity, head: None, conductivity: None, sinks: vec![] };
            let lengths =
                Lengths { longitudinal: 1.0, transverse: 0.3, vertical: Some(0.02), molecular: 1e-3 };
            let medium = UnevenMedium::new(&flow, [0, 1, 2], lengths);
            let mut look = medium.blank();
            let carrier = Carrier { mobility: 0.5, molecular: None };
            medium.look(&carrier, &[[0.3; LANES], [0.7; LANES], [1.9; LANES]], &mut look);
            let exact = uniform_tensor(v, [1.0, 0.3, 0.02, 1e-3]);
            let found = look.tensor(9);
            let largest = exact.iter().flatten().fold(0.0_f64, |a, b| a.max(b.abs()));
            for i in 0..3 {
                for j in 0..3 {
                    assert!((found[i][j] - 0.5 * exact[i][j]).abs() < 1e-6 * largest, "{v:?} {i} {j}");
                }
                assert!((f64::from(look.drift[i][9]) - 0.5 * v[i]).abs() < 1e-6);
                let mut spread = [0.0; LANES];
                medium.spread_along(&look, i, &mut spread);
                assert!((spread[9] - exact[i][i]).abs() < 1e-6 * largest);
            }
        }
    }

    /// Reference: differences of the tensor itself over a 32nd of a cell, right to the square of it.
    #[test]
    fn the_drift_is_the_divergence_of_the_tensor() {
        let cells = Cells::equal([0.0; 3], [1.0; 3], [1; 3]).unwrap();
        // Faces that let more through at one end: corners have those of their faces, so ∂v/∂x alone along each axis.
        let flux = [vec![0.5, 0.8], vec![0.3, 0.1], vec![-0.6, -0.7]];
        let flow =
            FaceFlow { cells, flux, porosity: vec![0.5], head: None, conductivity: None, sinks: vec![] };
        let lengths = Lengths { longitudinal: 1.0, transverse: 0.3, vertical: Some(0.02), molecular: 1e-3 };
        let medium = UnevenMedium::new(&flow, [0, 1, 2], lengths);
        let place = [0.3, 0.6, 0.2];
        let look_at = |place: [f64; 3]| {
            let mut look = medium.blank();
            medium.look(&Carrier::WATER, &place.map(|x| [x; LANES]), &mut look);
            look
        };
        let look = look_at(place);
        let h = 1.0 / 64.0;
        for i in 0..3 {
            let mut divergence = 0.0;
            for j in 0..3 {
                let at = |offset: f64| {
                    let mut place = place;
                    place[j] += offset;
                    look_at(place).tensor(0)[i][j]
                };
                divergence += (at(h) - at(-h)) / (2.0 * h);
            }
            let found = f64::from(look.drift[i][0] - look.speed[i][0]);
            assert!((found - divergence).abs() < 1e-4, "{i}: {found} {divergence}");
        }
    }
}

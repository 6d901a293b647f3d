//! Velocity, dispersion and porosity by expressions of the place.
//!
//! Owns their combination into drift and spread. May use tapes and lanes. It deliberately interpolates
//! nothing: gradients are exact.

#![allow(clippy::needless_range_loop)] // Loops over lanes are hot.

use super::duals::{self, Dual};
use super::lanes::{LANES, Lane};
use super::medium::{Carrier, Criteria, Leap, Medium};
use crate::plan::tape::{Operation, Tape};

/// How water spreads.
#[derive(Debug, Clone, PartialEq)]
pub enum Spreading<const D: usize> {
    /// Lower triangle of a constant tensor, m²/s, with its molecular part.
    Constant([[f64; D]; D], f64),
    /// The same in all directions, m²/s, over the place.
    Isotropic(Tape),
    /// Lengths, m, and molecular diffusion, m²/s.
    Velocity { longitudinal: f64, transverse: f64, transverse_vertical: f64, molecular: f64 },
}

/// A medium by expressions.
#[derive(Debug, Clone, PartialEq)]
pub struct Formula<const D: usize> {
    /// The inputs of tapes that the axes stand for.
    pub axes: [usize; D],
    /// m/s
    pub velocity: [Tape; D],
    pub spreading: Spreading<D>,
    pub porosity: Tape,
    /// Size that the criteria of sub-steps refer to, m.
    pub width: [f64; D],
}

/// Coefficients of 64 particles, and registers of the tapes.
#[derive(Debug, Clone)]
pub struct Look<const D: usize> {
    drift: [Lane; D],
    /// Lower triangle of `B`: of a constant tensor, or of one along and across the flow.
    spread: [[Lane; D]; D],
    registers: Vec<Dual<D>>,
    velocity: [Dual<D>; D],
}

impl<const D: usize> Look<D> {
    /// Dispersion tensor of a lane, over R, m²/s.
    pub fn tensor(&self, lane: usize) -> [[f64; D]; D] {
        let entry = |i: usize, j: usize| -> f64 {
            (0..=i.min(j)).map(|k| 0.5 * self.spread[i][k][lane] * self.spread[j][k][lane]).sum()
        };
        std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
    }
}

impl<const D: usize> Formula<D> {
    fn evaluate(&self, tape: &Tape, positions: &[Lane; D], registers: &mut Vec<Dual<D>>) -> Dual<D> {
        duals::evaluate(tape, self.axes, positions, registers);
        registers.pop().unwrap_or(Dual::ZERO)
    }

    /// Whether the porosity is the same everywhere, so that its gradient need not be asked for.
    fn is_even(&self) -> bool {
        matches!(self.porosity.operations[..], [Operation::Constant(_)])
    }

    /// Tensor `D` and its divergence at the lanes, of water.
    ///
    /// - Equation: `D = (α_T V + D_m) I + (α_L − α_T) v vᵀ/V`, `(∇·D)_i = Σ_j ∂_j D_ij`.
    /// - Symbols: `V = |v|`, `∂_j V = Σ_k v_k ∂_j v_k / V`.
    /// - Range: any velocity; the dispersion of flow is zero where the velocity is.
    /// - Source: methods, equations 0.2 and 1.3.
    /// - Shape: 64 lanes.
    fn tensor(&self, carrier: &Carrier, positions: &[Lane; D], look: &mut Look<D>) -> [[Lane; D]; D] {
        let mut tensor = [[[0.0; LANES]; D]; D];
        match &self.spreading {
            Spreading::Constant(constant, molecular) => {
                let own = carrier.molecular.map_or(0.0, |own| own - molecular);
                for i in 0..D {
                    for j in 0..=i {
                        let value = constant[i][j] + if i == j { own } else { 0.0 };
                        tensor[i][j] = [value; LANES];
                        tensor[j][i] = [value; LANES];
                    }
                }
            }
            Spreading::Isotropic(tape) => {
                let dispersion = self.evaluate(tape, positions, &mut look.registers);
                for i in 0..D {
                    tensor[i][i] = dispersion.value;
                    for lane in 0..LANES {
                        look.drift[i][lane] += dispersion.slopes[i][lane];
                    }
                }
            }
            Spreading::Velocity { longitudinal, transverse, transverse_vertical, molecular } => {
                let molecular = carrier.molecular.unwrap_or(*molecular);
                // Only in space two directions across the flow can differ.
                let across = if D == 3 { *transverse_vertical } else { *transverse };
                for lane in 0..LANES {
                    along_flow(look, lane, [*longitudinal, across, molecular], &mut tensor);
                }
                if across != *transverse {
                    for lane in 0..LANES {
                        on_the_level(look, lane, transverse - across, &mut tensor);
                    }
                }
            }
        }
        tensor
    }
}

/// Dispersion by the lengths of a medium, at one lane.
fn along_flow<const D: usize>(
    look: &mut Look<D>,
    lane: usize,
    [along, across, molecular]: [f64; 3],
    tensor: &mut [[Lane; D]; D],
) {
    let mut v = [0.0; D];
    for i in 0..D {
        v[i] = look.velocity[i].value[lane];
    }
    let slope = |i: usize, j: usize| look.velocity[i].slopes[j][lane];
    let speed = v.iter().map(|v| v * v).sum::<f64>().sqrt();
    let inverse = if speed > 0.0 { 1.0 / speed } else { 0.0 };
    let mut rise = [0.0; D];
    for j in 0..D {
        rise[j] = (0..D).map(|k| v[k] * slope(k, j)).sum::<f64>() * inverse;
    }
    let mut drift = [0.0; D];
    for i in 0..D {
        for j in 0..D {
            tensor[i][j][lane] = (along - across) * v[i] * v[j] * inverse;
            let product = v[j] * slope(i, j) + v[i] * slope(j, j);
            drift[i] += (along - across) * (product - v[i] * v[j] * rise[j] * inverse) * inverse;
        }
        tensor[i][i][lane] += across * speed + molecular;
        drift[i] += across * rise[i];
    }
    for i in 0..D {
        look.drift[i][lane] += drift[i];
    }
}

/// What the length on the level across the flow adds to that upwards across it, at one lane.
///
/// - Equation: `E = γ T/V`, `T = [[v_y², −v_x v_y], [−v_x v_y, v_x²]]` on the level; its divergence by the product rule.
/// - Symbols: `γ = α_H − α_V`, `V = |v|`.
/// - Range: any velocity.
/// - Source: R. D. Burnett, E. O. Frind (1987), Water Resources Research 23(4), 695.
/// - Shape: 3 × 3; only x and y have entries.
fn on_the_level<const D: usize>(look: &mut Look<D>, lane: usize, excess: f64, tensor: &mut [[Lane; D]; D]) {
    let mut v = [0.0; D];
    for i in 0..D {
        v[i] = look.velocity[i].value[lane];
    }
    let speed = v.iter().map(|v| v * v).sum::<f64>().sqrt();
    if speed == 0.0 {
        return;
    }
    let slope = |i: usize, j: usize| look.velocity[i].slopes[j][lane];
    let rise = |j: usize| (0..D).map(|k| v[k] * slope(k, j)).sum::<f64>() / speed;
    let (x, y) = (v[0] / speed, v[1] / speed);
    let (by_x, by_y) = (rise(0), rise(1));
    let factor = excess * speed;
    tensor[0][0][lane] += factor * y * y;
    tensor[1][1][lane] += factor * x * x;
    tensor[0][1][lane] -= factor * x * y;
    tensor[1][0][lane] -= factor * x * y;
    let of_x = 2.0 * y * slope(1, 0) - x * slope(1, 1) - y * slope(0, 1) - y * y * by_x + x * y * by_y;
    let of_y = 2.0 * x * slope(0, 1) - x * slope(1, 0) - y * slope(0, 0) - x * x * by_y + x * y * by_x;
    look.drift[0][lane] += excess * of_x;
    look.drift[1][lane] += excess * of_y;
}

impl<const D: usize> Medium<D> for Formula<D> {
    type Look = Look<D>;

    fn blank(&self) -> Look<D> {
        Look {
            drift: [[0.0; LANES]; D],
            spread: [[[0.0; LANES]; D]; D],
            registers: Vec::new(),
            velocity: [const { Dual::ZERO }; D],
        }
    }

    /// - Equation: `A = [v + ∇·D + D ∇ln φ]/R`, `B Bᵀ = 2D/R`.
    /// - Symbols: `φ` porosity, `R` retardation.
    /// - Range: differentiable expressions; a jump needs an interface.
    /// - Source: methods, equations 1.1 and 1.2.
    /// - Shape: 64 particles.
    fn look(&self, carrier: &Carrier, positions: &[Lane; D], look: &mut Look<D>) {
        for axis in 0..D {
            look.velocity[axis] = self.evaluate(&self.velocity[axis], positions, &mut look.registers);
            look.drift[axis] = look.velocity[axis].value;
        }
        let tensor = self.tensor(carrier, positions, look);
        if !self.is_even() {
            let porosity = self.evaluate(&self.porosity, positions, &mut look.registers);
            for i in 0..D {
                for j in 0..D {
                    for lane in 0..LANES {
                        look.drift[i][lane] +=
                            tensor[i][j][lane] * porosity.slopes[j][lane] / porosity.value[lane];
                    }
                }
            }
        }
        for axis in 0..D {
            for lane in 0..LANES {
                look.drift[axis][lane] *= carrier.mobility;
            }
        }
        for lane in 0..LANES {
            root(&tensor, 2.0 * carrier.mobility, lane, &mut look.spread);
        }
    }

    fn displace(&self, look: &Look<D>, leap: &Leap, normals: [&Lane; D], positions: &mut [Lane; D]) {
        for i in 0..D {
            for lane in 0..LANES {
                let mut kick = 0.0;
                for j in 0..=i {
                    kick += look.spread[i][j][lane] * normals[j][lane];
                }
                positions[i][lane] += look.drift[i][lane] * leap.time[lane] + kick * leap.root[lane];
            }
        }
    }

    fn spread_along(&self, look: &Look<D>, axis: usize, spread: &mut Lane) {
        spread.fill(0.0);
        for row in &look.spread[axis][..=axis] {
            for lane in 0..LANES {
                spread[lane] += row[lane] * row[lane];
            }
        }
    }

    fn longest(&self, look: &Look<D>, criteria: &Criteria, time: &mut Lane) {
        for lane in 0..LANES {
            let (mut courant, mut dispersion) = (0.0, 0.0);
            for i in 0..D {
                courant += look.velocity[i].value[lane].abs() / self.width[i];
                let spread: f64 = look.spread[i][..=i].iter().map(|row| row[lane] * row[lane]).sum();
                dispersion += 0.5 * spread / (self.width[i] * self.width[i]);
            }
            time[lane] = (criteria.courant / courant).min(criteria.dispersion / dispersion);
        }
    }

    fn drift(&self, look: &Look<D>, axis: usize, lane: usize) -> f64 {
        look.drift[axis][lane]
    }

    fn tensor(&self, look: &Look<D>, lane: usize) -> [[f64; D]; D] {
        look.tensor(lane)
    }

    fn porosity(&self, place: [f64; D]) -> f64 {
        self.evaluate(&self.porosity, &place.map(|x| [x; LANES]), &mut Vec::new()).value[0]
    }

    fn porosities(&self, places: &[Lane; D], porosity: &mut Lane) {
        *porosity = self.evaluate(&self.porosity, places, &mut Vec::new()).value;
    }

    fn velocity(&self, place: [f64; D], axis: usize) -> f64 {
        self.evaluate(&self.velocity[axis], &place.map(|x| [x; LANES]), &mut Vec::new()).value[0]
    }
}

/// Lower triangle of a root of `factor · tensor` at one lane; a pivot that is rounding counts as zero.
fn root<const D: usize>(tensor: &[[Lane; D]; D], factor: f64, lane: usize, spread: &mut [[Lane; D]; D]) {
    for i in 0..D {
        for j in 0..=i {
            let mut rest = factor * tensor[i][j][lane];
            for k in 0..j {
                rest -= spread[i][k][lane] * spread[j][k][lane];
            }
            let diagonal = spread[j][j][lane];
            spread[i][j][lane] = if i == j {
                if rest > 1e-14 * factor * tensor[i][i][lane] { rest.sqrt() } else { 0.0 }
            } else if diagonal > 0.0 {
                rest / diagonal
            } else {
                0.0
            };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::burnett_frind::uniform_tensor;
    use crate::plan::tape::Binary;

    const LENGTHS: [f64; 4] = [1.0, 0.3, 0.02, 0.001];

    /// `a + b s t` of two inputs.
    fn tape(a: f64, b: f64, [s, t]: [u16; 2]) -> Tape {
        let operations = vec![
            Operation::Input(s),
            Operation::Input(t),
            Operation::Constant(b),
            Operation::Binary(Binary::Multiply, 0, 1),
            Operation::Binary(Binary::Multiply, 3, 2),
            Operation::Constant(a),
            Operation::Binary(Binary::Add, 4, 5),
        ];
        Tape { operations }
    }

    fn medium(a: [f64; 3], b: [f64; 3]) -> Formula<3> {
        let velocity = [tape(a[0], b[0], [1, 2]), tape(a[1], b[1], [0, 2]), tape(a[2], b[2], [0, 1])];
        let [longitudinal, transverse, transverse_vertical, molecular] = LENGTHS;
        let spreading = Spreading::Velocity { longitudinal, transverse, transverse_vertical, molecular };
        let porosity = Tape { operations: vec![Operation::Constant(0.3)] };
        Formula { axes: [0, 1, 2], velocity, spreading, porosity, width: [1.0; 3] }
    }

    fn velocity([x, y, z]: [f64; 3], a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
        [a[0] + b[0] * y * z, a[1] + b[1] * x * z, a[2] + b[2] * x * y]
    }

    /// Reference: the tensor of the plan, at upright, level, oblique and no flow; its divergence by differences over
    /// 1e-5, which are right to the square of that.
    #[test]
    fn two_lengths_across_the_flow_give_the_tensor_of_burnett_and_frind() {
        let bent = [0.3, -0.7, 0.4];
        for (a, b) in [
            ([1.0, 0.5, -0.7], bent),
            ([0.0, 0.0, 2.0], [0.0; 3]),
            ([0.0, 0.0, -1.0], [0.0; 3]),
            ([0.0; 3], [0.0; 3]),
            ([-0.2, 1.5, 0.01], bent),
        ] {
            let medium = medium(a, b);
            let place = [0.4, -0.6, 0.9];
            let mut look = medium.blank();
            medium.look(&Carrier::WATER, &place.map(|x| [x; LANES]), &mut look);
            let v = velocity(place, a, b);
            let exact = uniform_tensor(v, LENGTHS);
            let h = 1e-5;
            for i in 0..3 {
                let mut drift = v[i];
                for j in 0..3 {
                    let root = |row: usize, k: usize| look.spread[row][k][5];
                    let found: f64 = (0..=i.min(j)).map(|k| 0.5 * root(i, k) * root(j, k)).sum();
                    assert!((found - exact[i][j]).abs() < 1e-13, "{v:?} {i} {j}");
                    let at = |offset: f64| {
                        let mut place = place;
                        place[j] += offset;
                        uniform_tensor(velocity(place, a, b), LENGTHS)[i][j]
                    };
                    drift += (at(h) - at(-h)) / (2.0 * h);
                }
                assert!((look.drift[i][5] - drift).abs() < 1e-9, "{v:?} {i}: {} {drift}", look.drift[i][5]);
            }
        }
    }
}

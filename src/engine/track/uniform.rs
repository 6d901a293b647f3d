//! One velocity and one dispersion tensor everywhere.
//!
//! Owns the constants. May use lanes. It deliberately looks at no place.

use super::lanes::{LANES, Lane};
use super::medium::{Carrier, Criteria, Leap, Medium};

/// A uniform medium.
#[derive(Debug, Clone, PartialEq)]
pub struct Uniform<const D: usize> {
    /// m/s
    pub velocity: [f64; D],
    /// Lower triangle of the dispersion tensor of water, m²/s.
    pub dispersion: [[f64; D]; D],
    /// Molecular part of it, which a species may have its own of, m²/s.
    pub molecular: f64,
    /// Size that the criteria of sub-steps refer to, m.
    pub width: [f64; D],
}

/// Drift and spread of a carrier.
#[derive(Debug, Clone, PartialEq)]
pub struct Constants<const D: usize> {
    drift: [f64; D],
    spread: [[f64; D]; D],
}

impl<const D: usize> Uniform<D> {
    /// Tensor `2 D / R` of a carrier, lower triangle.
    fn tensor(&self, carrier: &Carrier) -> [[f64; D]; D] {
        let own = carrier.molecular.map_or(0.0, |molecular| molecular - self.molecular);
        let mut tensor = self.dispersion;
        for (axis, row) in tensor.iter_mut().enumerate() {
            row[axis] += own;
            row.iter_mut().for_each(|entry| *entry *= 2.0 * carrier.mobility);
        }
        tensor
    }
}

/// Lower triangle `B` with `B Bᵀ` the tensor; a pivot that is rounding counts as zero.
fn root<const D: usize>(tensor: &[[f64; D]; D]) -> [[f64; D]; D] {
    let mut b = [[0.0; D]; D];
    for i in 0..D {
        for j in 0..=i {
            let rest = tensor[i][j] - (0..j).map(|k| b[i][k] * b[j][k]).sum::<f64>();
            b[i][j] = if i == j {
                if rest > 1e-14 * tensor[i][i] { rest.sqrt() } else { 0.0 }
            } else if b[j][j] > 0.0 {
                rest / b[j][j]
            } else {
                0.0
            };
        }
    }
    b
}

impl<const D: usize> Medium<D> for Uniform<D> {
    type Look = Constants<D>;

    fn blank(&self) -> Constants<D> {
        Constants { drift: [0.0; D], spread: [[0.0; D]; D] }
    }

    #[inline(always)]
    fn look(&self, carrier: &Carrier, _: &[Lane; D], look: &mut Constants<D>) {
        look.drift = self.velocity.map(|v| v * carrier.mobility);
        look.spread = root(&self.tensor(carrier));
    }

    #[inline(always)]
    fn displace(&self, look: &Constants<D>, leap: &Leap, normals: [&Lane; D], positions: &mut [Lane; D]) {
        for (axis, x) in positions.iter_mut().enumerate() {
            let mut kick = [0.0; LANES];
            for (&b, normals) in look.spread[axis][..=axis].iter().zip(normals) {
                for lane in 0..LANES {
                    kick[lane] += b * normals[lane];
                }
            }
            let drift = look.drift[axis];
            for lane in 0..LANES {
                x[lane] += drift * leap.time[lane] + kick[lane] * leap.root[lane];
            }
        }
    }

    #[inline(always)]
    fn spread_along(&self, look: &Constants<D>, axis: usize, spread: &mut Lane) {
        spread.fill(look.spread[axis].iter().map(|b| b * b).sum());
    }

    fn longest(&self, look: &Constants<D>, criteria: &Criteria, time: &mut Lane) {
        let mut courant = 0.0;
        let mut dispersion = 0.0;
        for axis in 0..D {
            courant += look.drift[axis].abs() / self.width[axis];
            let spread: f64 = look.spread[axis].iter().map(|b| b * b).sum();
            dispersion += 0.5 * spread / (self.width[axis] * self.width[axis]);
        }
        time.fill((criteria.courant / courant).min(criteria.dispersion / dispersion));
    }

    fn drift(&self, look: &Constants<D>, axis: usize, _: usize) -> f64 {
        look.drift[axis]
    }

    fn tensor(&self, look: &Constants<D>, _: usize) -> [[f64; D]; D] {
        let entry = |i: usize, j: usize| -> f64 {
            0.5 * (0..=i.min(j)).map(|k| look.spread[i][k] * look.spread[j][k]).sum::<f64>()
        };
        std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))
    }

    fn porosity(&self, _: [f64; D]) -> f64 {
        1.0
    }

    fn velocity(&self, _: [f64; D], axis: usize) -> f64 {
        self.velocity[axis]
    }
}

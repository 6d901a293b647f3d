//! Means over the parcels around, which mixing zones exchange with.
//!
//! Owns the plan's words of such a mean and its sizes. May use those of an exchange, which makes the same sums. It
//! deliberately disperses nothing.

use super::Plan;
use super::exchange::{Cutoff, Exchange, Integration, Kernel, Normalisation, radial_moment};
use super::tape::Tape;
use serde::{Deserialize, Serialize};

/// A mean with a kernel, in place of that of a bin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Averaging {
    pub kernel: Kernel,
    /// Bandwidth h, m, over the inputs of [`Exchange::bandwidth`], of which the distance of parcels alone has a meaning.
    pub bandwidth: Tape,
    pub cutoff: Cutoff,
    pub normalisation: Normalisation,
}

/// What follows from a plan for its means.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extents {
    /// Mean distance of parcels, m.
    pub spacing: f64,
    /// m
    pub bandwidth: f64,
    /// Where the kernel ends, in bandwidths.
    pub radius: f64,
    /// Within the radius, on average.
    pub neighbours: f64,
    /// Mean square of the distance along an axis, m².
    pub variance: f64,
    /// Parcels in the mean of a bin that is as noisy.
    pub effective: f64,
}

impl Averaging {
    /// The sums over parcels that make the mean, as those of an exchange.
    pub fn as_exchange(&self, d: usize) -> Exchange {
        let unit = |row: usize, column: usize| f64::from(u8::from(row == column));
        Exchange {
            kernel: self.kernel.clone(),
            bandwidth: self.bandwidth.clone(),
            diffusion: (0..d).flat_map(|row| (0..=row).map(move |column| unit(row, column))).collect(),
            spreading: None,
            cutoff: self.cutoff,
            is_compensated: false,
            normalisation: self.normalisation,
            integration: Integration::Exponential,
        }
    }

    /// Everything that follows for a plan.
    ///
    /// - Equation: variance `h² M₂/(d M₀)`; parcels in the mean `M₀²/∫W² · h^d/s^d` over the unit ball's surface.
    /// - Symbols: `M_k = ∫ W q^{d−1+k} dq` up to the radius, `h` bandwidth, `s` mean distance of parcels.
    /// - Range: parcels that lie at random; ordered ones make less noise.
    /// - Source: moments of the kernel; the variance of a weighted mean of independent values.
    /// - Shape: one set of numbers.
    pub fn extents(&self, plan: &Plan) -> Extents {
        let d = plan.axes.len();
        let exchange = self.as_exchange(d);
        let sizes = exchange.sizes(plan, plan.time.step);
        let (profile, _) = exchange.profile();
        let moment = |k: usize| radial_moment(|q| profile(q).0, d - 1 + k, sizes.radius);
        let square = radial_moment(|q| profile(q).0 * profile(q).0, d - 1, sizes.radius);
        let surface = [2.0, 2.0 * std::f64::consts::PI, 4.0 * std::f64::consts::PI][d.clamp(1, 3) - 1];
        let h = sizes.bandwidth;
        Extents {
            spacing: sizes.spacing,
            bandwidth: h,
            radius: sizes.radius,
            neighbours: sizes.neighbours,
            variance: h * h * moment(2) / (d as f64 * moment(0)),
            effective: surface * moment(0) * moment(0) / square
                * (0..d).map(|_| h / sizes.spacing).product::<f64>(),
        }
    }
}

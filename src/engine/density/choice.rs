//! Sizes and shapes of kernels, from what is known of a cell.
//!
//! Owns these formulas. May use roughness and classes. It deliberately sums nothing.

use super::adaptive::Search;
use super::classes::{bandwidth_of, class_of};
use super::kinds::{Cell, Shape, Variant};
use super::lattice::{AXES, Lattice};
use super::limits::{GROWTH, Limits};
use super::rough::{crossed, net_roughness};
use crate::maths::vector::{exp, ln, pow};
use std::f64::consts::PI;

/// Where one direction has more of all roughness than this, the released code takes half of it for isotropic.
const DOMINANT: f64 = 0.85;

/// Logarithms of what is the same for all cells.
pub(super) struct Constants {
    pub(super) support: f64,
    pub(super) curvature: f64,
    pub(super) curvature_bounds: [f64; 2],
    /// `(4π)^{d/2}`, not its logarithm.
    pub(super) square: f64,
    /// The smallest edge of a cell.
    pub(super) unit: f64,
}

impl Constants {
    pub(super) fn new(lattice: &Lattice, limits: &Limits) -> Self {
        let d = lattice.d as f64;
        Self {
            curvature_bounds: limits.curvature.map(ln),
            square: pow(4.0 * PI, 0.5 * d),
            unit: ln(lattice.smallest()),
            support: 0.25 * ln((d + 2.0) * pow(8.0 * PI, 0.5 * d) / 4.0),
            curvature: ln((1.0 + pow(2.0, 0.5 * d + 2.0)) / (3.0 * pow(2.0, 4.0 / (d + 4.0)))) / (d + 6.0)
                + ln(d + 2.0) / (d + 4.0)
                - ln(d + 4.0) / (d + 6.0),
        }
    }
}

impl Search<'_> {
    /// `σ = [(d+2)(8π)^{d/2}/4]^{1/4} n^{1/2} h^{1+d/4} ρ^{−1/4}`, within its bounds.
    pub(super) fn widen(&self, cell: &mut Cell, n: f64) {
        let d = self.d;
        let logs = 0.5 * ln(n) + (1.0 + 0.25 * d) * ln(cell.h) - 0.25 * ln(cell.rho);
        let [low, high] = self.limits.support;
        cell.sigma = exp(self.constants.support + logs).min(GROWTH * cell.sigma).clamp(low, high);
    }

    /// Bandwidths of curvatures.
    ///
    /// - Equation: `g_i = α N_v^β h [1/((d+4) s_i⁴) Σ_j a_ij/s_j²]^{−1/(d+6)}`, `N_v = (√(8π) σ)^d n²/ρ`.
    /// - Symbols: `a_ij` 5 for i = j, else 1; `α` and `β` as in the source.
    /// - Range: within bounds.
    /// - Source: methods, (4.3).
    /// - Shape: one per axis, m.
    pub(super) fn choose_curvature(&self, cell: &mut Cell) {
        let d = self.d;
        let beta = 2.0 / ((d + 4.0) * (d + 6.0));
        let virtual_n = d * ln((8.0 * PI).sqrt() * cell.sigma) + 2.0 * ln(cell.n) - ln(cell.rho);
        let common = self.constants.curvature + beta * virtual_n + ln(cell.h);
        if self.is_oriented {
            return self.choose_curvature_along(cell, common);
        }
        let smallest = self.lattice.smallest();
        let ([low, high], unit) = (self.constants.curvature_bounds, self.constants.unit);
        for axis in self.lattice.axes() {
            let of_other = |other: usize| {
                let s = cell.s[other];
                (if other == axis { 5.0 } else { 1.0 }) / (s * s)
            };
            let sum: f64 = self.lattice.axes().map(of_other).sum();
            let square = cell.s[axis] * cell.s[axis];
            let log = common - ln(sum / ((d + 4.0) * square * square)) / (d + 6.0);
            let log = log.clamp(low, high);
            cell.g_class[axis] = class_of(log - unit);
            cell.g[axis] =
                if self.adaptive.is_fast { smallest * bandwidth_of(cell.g_class[axis]) } else { exp(log) };
        }
    }

    /// Size and shape of a kernel, from roughness: the triangle ψ_ij by rows.
    pub(super) fn choose(&self, cell: &mut Cell) {
        let d = self.lattice.d;
        let psi = cell.psi;
        let psi = &psi[..d * (d + 1) / 2];
        let own: [f64; AXES] = std::array::from_fn(|i| if i < d { psi[i * (i + 3) / 2] } else { 0.0 });
        let own = &own[..d];
        let is_round =
            self.adaptive.shape == Shape::Round || cell.is_stagnant || own.iter().any(|&psi| psi <= 0.0);
        let is_released = self.adaptive.variant == Variant::Released;
        let round = own.iter().sum::<f64>() + 2.0 * crossed(psi, d);
        let mut roughness = if is_round { round } else { net_roughness(psi, own, is_released) };
        let all: f64 = own.iter().sum();
        if is_released && own.iter().any(|own| own / all > DOMINANT) {
            roughness = 0.5 * roughness + 0.5 * all;
        }
        cell.roughness = roughness.max(0.0);
        cell.h = if cell.roughness > 0.0 {
            pow(self.d * cell.n / (self.constants.square * cell.roughness), 1.0 / (self.d + 4.0))
        } else {
            0.0
        };
        let mean: f64 = own.iter().product();
        let mut others = 1.0;
        for axis in self.lattice.axes() {
            let psi = own[axis + d - AXES];
            cell.s[axis] = match (is_round || d == 1, is_released) {
                (true, _) => 1.0,
                (_, true) if axis + 1 == AXES => 1.0 / others,
                (_, true) => pow(roughness / psi, 0.25 / self.d),
                (_, false) => pow(psi, -0.25) * pow(mean, 0.25 / self.d),
            };
            others *= cell.s[axis];
        }
    }
}

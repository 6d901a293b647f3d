//! The mass balances of many particles at one point of the iteration, lane by lane.
//!
//! Owns the residuals, their derivatives and the function they are the gradient of. May use the compiled
//! system. It deliberately takes no step.
//!
//! Everything here is compiled into wide code: plain loops over lanes, inlined into their caller.

use super::activity::MIN_IONIC_STRENGTH;
use super::lanes::{Columns, exp_of};
use super::system::System;

/// Logarithms above this are cut: e³⁰⁰ mol/m³ is as far from a solution as any number.
const MAX_LN: f64 = 300.0;

/// Where the iteration of each lane is, and what holds there.
#[derive(Debug, Clone)]
pub(super) struct Point<const L: usize> {
    pub total: Columns<L>,
    /// Which primaries are absent: see [`System::absent`].
    pub stages: Vec<[u8; L]>,
    /// `ln c` of the primaries.
    pub xi: Columns<L>,
    /// Amounts of the minerals.
    pub amount: Columns<L>,
    /// Ionic strength, mol/L, with which activities are taken.
    pub ionic: [f64; L],
    /// Concentrations of primaries and secondaries; then the saturation indices of the minerals.
    pub values: Columns<L>,
    /// `F_j = c_j + Σ ν C + Σ ν m − T_j`
    pub residual: Columns<L>,
    /// `c_j + Σ |ν| C + Σ |ν| m + |T_j|`
    pub size: Columns<L>,
    /// Lower triangle of the Hessian of Φ, row by row.
    pub hessian: Columns<L>,
    /// Φ, and the size of its terms.
    pub potential: [f64; L],
    pub magnitude: [f64; L],
    /// Largest `|F_j|` / size.
    pub defect: [f64; L],
    /// Ionic strength of the concentrations.
    pub ionic_out: [f64; L],
    /// Slopes of all rows with the ionic strength: d ln C / dI.
    pub slopes: Columns<L>,
}

#[inline(always)]
fn exp<const L: usize>(x: &[f64; L]) -> [f64; L] {
    let mut y = [0.0; L];
    for lane in 0..L {
        y[lane] = exp_of(if x[lane] > MAX_LN { MAX_LN } else { x[lane] });
    }
    y
}

/// Balances of terms below this, mol/m³, are those of species that are absent.
pub(super) const NOTHING: f64 = 1e-250;

impl<const L: usize> Point<L> {
    pub fn new(system: &System) -> Self {
        let n = system.n_primaries;
        let columns = |count: usize| vec![[0.0; L]; count];
        Self {
            total: columns(n),
            stages: vec![[0; L]; n],
            xi: columns(n),
            amount: columns(system.n_minerals),
            ionic: [MIN_IONIC_STRENGTH; L],
            values: columns(system.n_species()),
            residual: columns(n),
            size: columns(n),
            hessian: columns(n * (n + 1) / 2),
            potential: [0.0; L],
            magnitude: [0.0; L],
            defect: [0.0; L],
            ionic_out: [0.0; L],
            slopes: columns(system.rows.len()),
        }
    }

    /// All that depends on the point.
    ///
    /// Equation: `Φ = Σ e^ξ_j + Σ C_i − Σ T_j ξ_j`, `F = ∂Φ/∂ξ + Σ ν m`, `H = ∂²Φ/∂ξ²`.
    /// Symbols: see the fields.
    /// Dimensions and range: concentrations in mol/m³.
    /// Source: methods 8.1 (convex in ξ for fixed activity coefficients).
    /// Shape: one pass over the coefficients.
    #[inline(always)]
    pub fn evaluate(&mut self, system: &System) {
        let n = system.n_primaries;
        self.logarithms(system);
        self.potential = [0.0; L];
        self.magnitude = [0.0; L];
        self.hessian.fill([0.0; L]);
        for j in 0..n {
            self.values[j] = exp(&self.xi[j]);
            let (c, total, xi) = (self.values[j], self.total[j], self.xi[j]);
            for lane in 0..L {
                self.residual[j][lane] = c[lane] - total[lane];
                self.size[j][lane] = c[lane] + total[lane].abs();
                let work = total[lane] * xi[lane];
                self.potential[lane] += c[lane] - work;
                self.magnitude[lane] += c[lane] + work.abs();
            }
            self.hessian[j * (j + 1) / 2 + j] = c;
        }
        for (i, row) in system.secondaries().iter().enumerate() {
            let c = exp(&self.values[n + i]);
            self.values[n + i] = c;
            // What does not change would only hide what does.
            let part = if row.entries.is_empty() { 0.0 } else { 1.0 };
            for lane in 0..L {
                self.potential[lane] += part * c[lane];
                self.magnitude[lane] += part * c[lane];
            }
            for (place, entry) in row.entries.iter().enumerate() {
                let (j, nu) = (entry.primary, entry.nu);
                let (residual, size) = (&mut self.residual[j], &mut self.size[j]);
                let mut part = [0.0; L];
                for lane in 0..L {
                    part[lane] = nu * c[lane];
                    residual[lane] += part[lane];
                    size[lane] += part[lane].abs();
                }
                for other in &row.entries[..=place] {
                    let cell = &mut self.hessian[j * (j + 1) / 2 + other.primary];
                    for lane in 0..L {
                        cell[lane] += part[lane] * other.nu;
                    }
                }
            }
        }
        self.add_minerals(system);
        self.measure(system);
    }

    /// ln C of secondaries and saturation indices, with activity coefficients.
    #[inline(always)]
    fn logarithms(&mut self, system: &System) {
        let n = system.n_primaries;
        for (i, row) in system.rows.iter().enumerate() {
            let mut ln = [row.ln_constant; L];
            for entry in &row.entries {
                let xi = &self.xi[entry.primary];
                for lane in 0..L {
                    ln[lane] += entry.nu * xi[lane];
                }
            }
            self.values[n + i] = ln;
        }
        if system.shapes.is_empty() {
            return;
        }
        let mut root = [0.0; L];
        for lane in 0..L {
            root[lane] = self.ionic[lane].sqrt();
        }
        self.slopes.fill([0.0; L]);
        for (place, shape) in system.shapes.iter().enumerate() {
            let (value, slope) = shape.value(&self.ionic, &root);
            for (i, row) in system.rows.iter().enumerate() {
                let weight = row.weights[place];
                let (ln, sum) = (&mut self.values[n + i], &mut self.slopes[i]);
                for lane in 0..L {
                    ln[lane] += weight * value[lane];
                    sum[lane] += weight * slope[lane];
                }
            }
        }
    }

    #[inline(always)]
    fn add_minerals(&mut self, system: &System) {
        for (row, amount) in system.minerals().iter().zip(&self.amount) {
            for entry in &row.entries {
                let (residual, size) = (&mut self.residual[entry.primary], &mut self.size[entry.primary]);
                for lane in 0..L {
                    let part = entry.nu * amount[lane];
                    residual[lane] += part;
                    size[lane] += part.abs();
                }
            }
        }
    }

    #[inline(always)]
    fn measure(&mut self, system: &System) {
        self.defect = [0.0; L];
        for (residual, size) in self.residual.iter().zip(&self.size) {
            for lane in 0..L {
                let relative = residual[lane].abs() / (size[lane] + NOTHING);
                self.defect[lane] = if relative > self.defect[lane] { relative } else { self.defect[lane] };
            }
        }
        if system.shapes.is_empty() {
            return;
        }
        self.ionic_out = [0.0; L];
        for (weight, c) in system.ionic.iter().zip(&self.values) {
            for lane in 0..L {
                self.ionic_out[lane] += weight * c[lane];
            }
        }
    }
}

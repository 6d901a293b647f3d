//! Densities of the fourth order: the density by wider kernels, put right by what it says of the particles themselves.
//!
//! Owns the correction. May use the search. It deliberately finds no kernel: those that are best for the second order are made
//! wider by one factor.

use super::adaptive::{Search, mirrored};
use super::lattice::{Field, Lattice, Window};
use crate::maths::vector::pow;

/// How much wider kernels are than those that are best without a correction.
const WIDER: f64 = 1.6;

impl Search<'_> {
    /// The density of masses, and variances for squares, on a window.
    ///
    /// - Equation: `ρ = f Σ_b (m_b/f_b) W_b/V`, `f = Σ_b m_b W_b/V`, times what keeps the sum of f.
    /// - Symbols: `m_b` mass in cell b, `f_b` what f is there, `W` kernels, 1.6 times as wide as best for f.
    /// - Range: above zero; what f has too little of at a peak, particles have more of than f says, so that the bias is of h⁴.
    /// - Source: M. C. Jones, O. Linton, J. P. Nielsen 1995: A simple bias reduction method for density estimation, Biometrika 82,
    ///   327, doi:10.1093/biomet/82.2.327; all of the mass stays, but not with each particle.
    /// - Shape: the standard error is that of the kernel `2W − W∗W`, `√(4 − 4 (2/3)^{d/2} + 2^{−d/2})` times that of W.
    pub(super) fn fourth(&mut self, (counts, squares): (&[f64], &[f64]), window: &Window) -> [Field; 2] {
        let mut cells = std::mem::take(&mut self.cells);
        for cell in &mut cells {
            let wanted = cell.s.map(|s| WIDER * cell.h * s);
            self.limit(cell, wanted);
        }
        self.cells = cells;
        let mut density = self.density_of((counts, 1.0), window, false);
        let mut variance = self.density_of((squares, 0.0), window, true);
        let ratios: Vec<f64> = self
            .cells
            .iter()
            .zip(counts)
            .map(|(cell, count)| {
                let [x, y, z] = cell.at;
                let own = density.values[density.row(x, y) + z - density.first[2]];
                if own > 0.0 { count / own } else { 0.0 }
            })
            .collect();
        // Ratios have no sign to turn over at an end.
        let even = mirrored(self.lattice);
        let ratios = self.on(&even).density_of((&ratios, 1.0), window, false);
        let before: f64 = density.values.iter().sum();
        density.values.iter_mut().zip(&ratios.values).for_each(|(own, ratio)| *own *= ratio);
        let after: f64 = density.values.iter().sum();
        let d = self.d;
        let factor = 4.0 - 4.0 * pow(2.0 / 3.0, 0.5 * d) + pow(0.5, 0.5 * d);
        if after > 0.0 {
            density.values.iter_mut().for_each(|own| *own *= before / after);
        }
        variance.values.iter_mut().for_each(|own| *own *= factor);
        [density, variance]
    }

    /// The same kernels on a lattice with other ends.
    fn on<'b>(&'b self, lattice: &'b Lattice) -> Search<'b> {
        let (adaptive, limits, constants) = (self.adaptive, self.limits.clone(), self.constants.clone());
        let (counts, cells, rho, held) = (Vec::new(), self.cells.clone(), Default::default(), None);
        let (integral, width, per_mass, d, is_oriented) =
            (self.integral, self.width, 1.0, self.d, self.is_oriented);
        Search {
            lattice,
            adaptive,
            is_oriented,
            limits,
            integral,
            width,
            counts,
            cells,
            rho,
            held,
            per_mass,
            d,
            constants,
        }
    }
}

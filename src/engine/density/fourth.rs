//! Densities of the fourth order: the density by wider kernels, put right by what it says of the particles themselves.
//!
//! Owns the correction. May use the search. It deliberately finds no kernel: those that are best for the second order are made
//! wider by one factor.

use super::adaptive::Search;
use super::kinds::Cell;
use super::lattice::{AXES, Field, Window};
use crate::maths::vector::pow;

/// How much wider kernels are than those that are best without a correction.
pub const WIDER: f64 = 1.6;

impl Search<'_> {
    /// The density of masses, and variances for squares, on all of the lattice.
    ///
    /// - Equation: `ρ = f Σ_b (m_b/f_b) W_b/V`, `f = Σ_b m_b W_b/V`, times what keeps the mass of each cloud apart.
    /// - Symbols: `m_b` mass in cell b, `f_b` what f is there, `W` kernels, 1.6 times as wide as best for f.
    /// - Range: no ends that turn signs over, where wider kernels lose more; above zero; what f has too little of at a peak,
    ///   particles have more of than f says, so that the bias is of h⁴.
    /// - Source: M. C. Jones, O. Linton, J. P. Nielsen 1995: A simple bias reduction method for density estimation, Biometrika 82,
    ///   327, doi:10.1093/biomet/82.2.327; all of the mass stays, but not with each particle.
    /// - Shape: the standard error is that of the kernel `2W − W∗W`, `√(4 − 4 (2/3)^{d/2} + 2^{−d/2})` times that of W.
    pub(super) fn fourth(&mut self, (counts, squares): (&[f64], &[f64])) -> [Field; 2] {
        let window = &Window { first: [0; AXES], end: self.lattice.cells };
        let mut cells = std::mem::take(&mut self.cells);
        for cell in &mut cells {
            let wanted = cell.s.map(|s| WIDER * cell.h * s);
            self.limit(cell, wanted);
        }
        self.cells = cells;
        let mut density = self.density_of((counts, 1.0), window, false);
        let mut variance = self.density_of((squares, 0.0), window, true);
        let ratio = |(cell, count): (&Cell, &f64)| {
            let [x, y, z] = cell.at;
            let own = density.values[density.row(x, y) + z];
            if own > 0.0 { count / own } else { 0.0 }
        };
        let ratios: Vec<f64> = self.cells.iter().zip(counts).map(ratio).collect();
        let ratios = self.density_of((&ratios, 1.0), window, false);
        self.scale(&mut density, &ratios);
        let d = self.d;
        let factor = 4.0 - 4.0 * pow(2.0 / 3.0, 0.5 * d) + pow(0.5, 0.5 * d);
        variance.values.iter_mut().for_each(|own| *own *= factor);
        [density, variance]
    }

    /// Multiplies by ratios, and by what each cloud that is apart from the others, beyond the reach of kernels, needs to keep its
    /// mass.
    fn scale(&self, density: &mut Field, ratios: &Field) {
        let cells = self.lattice.cells;
        let place = |[x, y, z]: [usize; AXES]| (x * cells[1] + y) * cells[2] + z;
        let mut is_known = vec![false; self.lattice.n_cells()];
        for from in &self.cells {
            let mut cloud = vec![from.at];
            if std::mem::replace(&mut is_known[place(from.at)], true) {
                continue;
            }
            let (mut before, mut after, mut next) = (0.0, 0.0, 0);
            while let Some(&at) = cloud.get(next) {
                next += 1;
                before += density.values[place(at)];
                after += density.values[place(at)] * ratios.values[place(at)];
                for axis in self.lattice.axes() {
                    for beside in self.lattice.beside(at[axis], axis) {
                        let mut other = at;
                        other[axis] = beside;
                        if density.values[place(other)] > 0.0
                            && !std::mem::replace(&mut is_known[place(other)], true)
                        {
                            cloud.push(other);
                        }
                    }
                }
            }
            let scale = if after > 0.0 { before / after } else { 1.0 };
            cloud.iter().for_each(|&at| density.values[place(at)] *= scale * ratios.values[place(at)]);
        }
    }
}

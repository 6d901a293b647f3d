//! How concentrations in equilibrium change with totals.
//!
//! Owns the implicit derivatives. May use the rest of the equilibrium. It deliberately iterates nothing: the
//! concentrations are given, and solved.

use super::LANES;
use super::activity::MIN_IONIC_STRENGTH;
use super::lanes::ln_of;
use super::newton::Newton;
use super::system::System;
use pulp::NullaryFnOnce;

/// `ln c` of absent primaries by stage: little enough to bind nothing, and enough to have a slope.
const LN_OF_LITTLE: [f64; 5] = [-50.0, -400.0, -200.0, -100.0, -50.0];

/// One call of [`super::Speciation::derivatives`].
pub(super) struct Derivatives<'a, 'c, C, D, M> {
    pub system: &'c System,
    pub totals: &'a [C],
    pub concentrations: &'a [D],
    pub out: &'a mut [M],
    pub newton: &'c mut Newton<LANES>,
    pub stages: &'c mut [u8],
}

impl<C: AsRef<[f64]>, D: AsRef<[f64]>, M: AsMut<[f64]>> NullaryFnOnce for Derivatives<'_, '_, C, D, M> {
    type Output = ();

    #[inline(always)]
    fn call(mut self) {
        let n_particles = self.totals.first().map_or(0, |column| column.as_ref().len());
        let mut first = 0;
        while first < n_particles {
            let n_lanes = (n_particles - first).min(LANES);
            self.load(first, n_lanes);
            self.newton.point.evaluate(self.system);
            self.hold_minerals();
            let Newton { point, direction, wish, .. } = &mut *self.newton;
            wish.is_coupled = [!self.system.is_ideal(); LANES];
            wish.is_soft = [false; LANES];
            wish.is_hot = [false; LANES];
            wish.penalty.fill([1.0; LANES]);
            direction.prepare(self.system, point, wish);
            for j in 0..self.system.n_primaries {
                self.column(j, first, n_lanes);
            }
            first += n_lanes;
        }
    }
}

impl<C: AsRef<[f64]>, D: AsRef<[f64]>, M: AsMut<[f64]>> Derivatives<'_, '_, C, D, M> {
    #[inline(always)]
    fn load(&mut self, first: usize, n_lanes: usize) {
        let point = &mut self.newton.point;
        let n = self.system.n_primaries;
        for lane in 0..LANES {
            let idx = first + lane.min(n_lanes - 1);
            self.stages.fill(0);
            if self.totals.iter().any(|column| column.as_ref()[idx] == 0.0) {
                self.system.absent(|j| self.totals[j].as_ref()[idx], self.stages);
            }
            for (j, stage) in self.stages.iter().enumerate() {
                let known = self.concentrations[j].as_ref()[idx];
                let ln = ln_of(if known > 0.0 { known } else { 1.0 });
                let little = LN_OF_LITTLE[*stage as usize];
                point.xi[j][lane] = if known > 0.0 { ln } else { little };
                point.total[j][lane] = self.totals[j].as_ref()[idx];
            }
            let mut ionic = MIN_IONIC_STRENGTH;
            for (weight, column) in self.system.ionic.iter().zip(self.concentrations) {
                ionic += weight * column.as_ref()[idx];
            }
            point.ionic[lane] = ionic;
            for (k, amount) in point.amount.iter_mut().enumerate() {
                amount[lane] = self.concentrations[n + self.system.n_secondaries + k].as_ref()[idx];
            }
        }
    }

    /// What is there is saturated, what is not is not.
    #[inline(always)]
    fn hold_minerals(&mut self) {
        let point = &mut self.newton.point;
        let first = self.system.n_primaries + self.system.n_secondaries;
        for (k, amount) in point.amount.iter().enumerate() {
            for lane in 0..LANES {
                point.values[first + k][lane] = if amount[lane] > 0.0 { 0.0 } else { -1.0 };
            }
        }
    }

    /// All derivatives with total j.
    ///
    /// Equation: `∂ξ/∂T_j = M⁻¹ e_j`, `∂C_i/∂T_j = C_i (Σ_l ν_il ∂ξ_l/∂T_j + D_i ∂I/∂T_j)`.
    /// Symbols: M the bordered Newton matrix, D slopes of ln C with the ionic strength I.
    /// Dimensions and range: mol/m³ per mol/m³; at T_j = 0 the derivative from the right.
    /// Source: implicit function theorem; methods 8.5.
    /// Shape: for a primary without complexes 1 and 0.
    #[inline(always)]
    fn column(&mut self, j: usize, first: usize, n_lanes: usize) {
        let Newton { point, direction, wish, .. } = &mut *self.newton;
        let (n, n_aqueous) = (self.system.n_primaries, self.system.n_primaries + self.system.n_secondaries);
        direction.xi.fill([0.0; LANES]);
        direction.amount.fill([0.0; LANES]);
        direction.xi[j] = [1.0; LANES];
        direction.ionic = [0.0; LANES];
        direction.resolve(self.system, wish);
        for s in 0..self.system.n_species() {
            let mut change = [0.0; LANES];
            if s < n {
                change = direction.xi[s];
            } else if s < n_aqueous {
                for entry in &self.system.rows[s - n].entries {
                    for lane in 0..LANES {
                        change[lane] += entry.nu * direction.xi[entry.primary][lane];
                    }
                }
                for lane in 0..LANES {
                    change[lane] += point.slopes[s - n][lane] * direction.ionic[lane];
                }
            } else {
                change = direction.amount[s - n_aqueous];
            }
            if s < n_aqueous {
                for lane in 0..LANES {
                    change[lane] *= point.values[s][lane];
                }
            }
            self.out[s * n + j].as_mut()[first..first + n_lanes].copy_from_slice(&change[..n_lanes]);
        }
    }
}

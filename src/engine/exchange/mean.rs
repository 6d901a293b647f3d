//! Zones that exchange with the means over the parcels around, and the mean that a parcel stores.
//!
//! Owns this use of the sums of an exchange. May use the operator. It deliberately knows no bin.

use super::super::control::Settings;
use super::super::error::RunError;
use super::super::program::{Program, Role, unsound};
use super::integrate;
use super::operator::{Operator, Weights};
use super::{Exchange, Wrong};
use crate::maths::wide::Width;
use crate::plan::exchange::Integration;
use crate::state::particles::Block;

/// Rest of the series of a step, relative to the values: noise of means is far above it.
const REST: f64 = 1e-12;

impl<const D: usize> Exchange<D> {
    /// The sums of a kernel mean; nothing where zones exchange with the means of bins.
    pub fn of_means(program: &Program<D>, settings: &Settings) -> Result<Option<Self>, RunError> {
        let plan = program.plan;
        let averaging = plan.averaging();
        let Some(averaging) = averaging else { return Ok(None) };
        let planned = averaging.as_exchange(D);
        planned.check(D).map_err(|reason| unsound(&reason))?;
        Self::of(plan, planned, None, settings).map(Some)
    }

    /// Zones exchange over `dt`, and the mean is taken of what they then are.
    ///
    /// - Equation: `W ← e^{−(χΔt/2)(⟨1⟩ − Ŵ)} W`, `⟨1⟩_p = Σ_q ŵ_pq`; `ū_p = m_p + Σ_q ŵ_pq (m_q − m_p)`, `m = Σ_i η_i W_i/Σ_i η_i`.
    /// - Symbols: `ŵ_pq = 2 W_pq/(ρ_p + ρ_q)` or as else normalised, `χ` rate and `η` fraction of a zone.
    /// - Range: any `χΔt`; both conserve sums to rounding, and no value gets beyond the others.
    /// - Source: methods, section 7.3, from the symmetric form of the exchange with the mean; Sole-Mari et al. (2020).
    /// - Shape: the zones' columns and the mean's, in blocks.
    pub fn blend(
        &mut self,
        program: &Program<D>,
        blocks: &mut [Block<D>],
        (dt, width): (f64, Width),
        limits: &[f64],
    ) -> Result<Option<Wrong>, RunError> {
        let n_slots = program.roles.len();
        let all: Vec<usize> = (0..program.n_columns()).collect();
        if all.is_empty() {
            return Ok(None);
        }
        let relaxes = program.roles.iter().any(|role| matches!(role, Role::Relaxing(_)));
        let integration = if relaxes { Integration::Exponential } else { Integration::Explicit };
        self.on_columns(blocks, (&all, Weights::Values, width), integration, &mut |operator, columns| {
            for (slot, role) in program.roles.iter().enumerate() {
                if let Role::Relaxing(rate) = role {
                    approach(operator, columns, (slot, n_slots), 0.5 * rate * dt);
                }
            }
            if let Some(slot) = program.mean_slot() {
                take_means(operator, columns, (slot, n_slots), &program.mean_weights);
            }
        })?;
        Ok(self.give_back(blocks, &all, (limits, n_slots)))
    }
}

/// A zone of all components approaches its mean.
fn approach<const D: usize>(
    operator: &mut Operator<D>,
    columns: &mut [Vec<f64>],
    (slot, n_slots): (usize, usize),
    share: f64,
) {
    if share <= 0.0 {
        return;
    }
    let mut own: Vec<Vec<f64>> = columns.iter_mut().skip(slot).step_by(n_slots).map(std::mem::take).collect();
    integrate::exponential(operator, (share, REST), &mut own);
    columns.iter_mut().skip(slot).step_by(n_slots).zip(own).for_each(|(column, own)| *column = own);
}

/// The mean over zones of each parcel, then over the parcels around it.
fn take_means<const D: usize>(
    operator: &mut Operator<D>,
    columns: &mut [Vec<f64>],
    (slot, n_slots): (usize, usize),
    weights: &[(usize, f64)],
) {
    let n = columns.first().map_or(0, Vec::len);
    let mut means: Vec<Vec<f64>> = Vec::with_capacity(columns.len() / n_slots);
    for zones in columns.chunks(n_slots) {
        let mut mean = vec![0.0; n];
        for &(zone, weight) in weights {
            mean.iter_mut().zip(&zones[zone]).for_each(|(mean, value)| *mean += weight * value);
        }
        means.push(mean);
    }
    integrate::step(operator, Integration::Explicit, 1.0, &mut means);
    columns.iter_mut().skip(slot).step_by(n_slots).zip(means).for_each(|(column, mean)| *column = mean);
}

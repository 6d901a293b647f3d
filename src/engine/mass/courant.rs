//! Steps that are too long for the flow on cells.
//!
//! Owns the largest Courant number of a run. May use `flow` and the plan. It deliberately refuses nothing: what is too
//! long is divided.

use super::super::track::medium::Criteria;
use super::world::Site;
use crate::flow::FaceFlow;

/// Courant number up to which a step without criteria is one displacement.
const LONG: f64 = 0.5;
/// What particles keep where it is longer.
const USUAL: Criteria = Criteria { courant: 0.25, dispersion: 0.1 };

impl<const D: usize> Site<'_, D> {
    /// How particles divide steps: as the scene says, or by criteria of ours where a step would carry water
    /// through more than half a cell, or renew more than half of a cell that a well takes water from.
    pub fn criteria(&self) -> Option<Criteria> {
        if let Some(sub) = self.transport.sub_steps {
            return Some(Criteria { courant: sub.courant, dispersion: sub.dispersion });
        }
        let periods = 0..self.starts.len();
        let worst = periods.map(|period| self.rate(period)).fold(0.0, f64::max);
        (worst * self.plan.time.step > LONG).then_some(USUAL)
    }

    /// The largest Courant number per time of a flow, 1/s.
    ///
    /// - Equation: `max Σ_i |q_i|/(φ R Δx_i)` over cells, `max Q/(φ R V)` over those of wells.
    /// - Symbols: `q_i` the larger discharge of the two faces of an axis, `Q` water taken out of a cell, `R` the smallest
    ///   retardation.
    /// - Range: flows on cells; zero without one.
    /// - Source: definition.
    /// - Shape: one number.
    fn rate(&self, period: usize) -> f64 {
        let Some(flow) = self.face_flow(period) else { return 0.0 };
        let carriers = self.carriers();
        let fastest = carriers.iter().map(|carrier| carrier.mobility).fold(0.0, f64::max);
        // Parcels of water are no carriers.
        let mobility = if carriers.is_empty() { 1.0 } else { fastest };
        let cells = (0..flow.cells.n_cells()).map(|cell| self.crossings(flow, cell)).fold(0.0, f64::max);
        let wells = self.drains(period).iter().map(|drain| drain.rate).fold(0.0, f64::max);
        mobility * cells.max(wells)
    }

    /// How often the water of a cell crosses it in a time, 1/s.
    fn crossings(&self, flow: &FaceFlow, cell: usize) -> f64 {
        let (place, porosity) = (flow.cells.place(cell), flow.porosity[cell]);
        if porosity <= 0.0 {
            return 0.0;
        }
        let along = |axis: usize| {
            let (low, high) = flow.cells.faces(axis, place);
            let flux = flow.flux[axis][low].abs().max(flow.flux[axis][high].abs());
            flux / (porosity * flow.cells.width(axis, place[axis]))
        };
        self.plan.axes.iter().map(|axis| along(axis.index)).sum()
    }
}

//! The plan's transport as loops want it.
//!
//! Owns what all builders of walls and releases read, and the tracker they make. May use the plan, `flow` and
//! `track`. It deliberately runs nothing.

use super::super::error::RunError;
use super::super::program::unsound;
use super::super::track::interfaces::Interface;
use super::super::track::medium::{Carrier, Criteria, Medium};
use super::super::track::noise::Draws;
use super::super::track::tracker::Tracker;
use super::super::track::walls::Ends;
use crate::flow::FaceFlow;
use crate::maths::wide::Width;
use crate::plan::tape::Tape;
use crate::plan::transport::Transport;
use crate::plan::{Normals, Plan};
use std::sync::Arc;

/// What the builders read.
pub struct Site<'a, const D: usize> {
    pub plan: &'a Plan,
    pub transport: &'a Transport,
    pub flow: Option<Arc<FaceFlow>>,
    pub low: [f64; D],
    pub high: [f64; D],
}

impl<'a, const D: usize> Site<'a, D> {
    pub fn new(plan: &'a Plan, flow: Option<Arc<FaceFlow>>) -> Result<Self, RunError> {
        let transport = plan.transport.as_ref().ok_or_else(|| unsound("no transport"))?;
        let axis = |value: fn(&crate::plan::Axis) -> f64| std::array::from_fn(|idx| value(&plan.axes[idx]));
        Ok(Self { plan, transport, flow, low: axis(|a| a.low), high: axis(|a| a.high) })
    }

    /// A tape at places, at a time.
    pub fn evaluate(&self, tape: &Tape, places: &[[f64; D]], t: f64) -> Vec<f64> {
        let mut inputs = [const { Vec::new() }; 4];
        for (idx, input) in inputs.iter_mut().enumerate() {
            let axis = self.plan.axes.iter().position(|axis| axis.index == idx);
            *input = match axis {
                Some(axis) => places.iter().map(|place| place[axis]).collect(),
                None => vec![if idx == 3 { t } else { 0.0 }; places.len()],
            };
        }
        let inputs: Vec<&[f64]> = inputs.iter().map(|input: &Vec<f64>| &input[..]).collect();
        let mut values = vec![0.0; places.len()];
        tape.evaluate_block(&inputs, &mut Vec::new(), &mut values);
        values
    }

    pub fn carriers(&self) -> Vec<Carrier> {
        let carrier = |population: &crate::plan::transport::Population| Carrier {
            mobility: if population.is_mobile { 1.0 / population.retardation } else { 0.0 },
            molecular: population.molecular,
        };
        self.transport.populations.iter().map(carrier).collect()
    }

    pub fn tracker<M: Medium<D>>(&self, medium: M, width: Width) -> Result<Tracker<D, M>, RunError> {
        let is_double = self.plan.walk.normals == Normals::Double;
        let mut ends: Vec<Ends<D>> = Vec::with_capacity(D);
        for axis in 0..D {
            ends.push(self.ends(axis)?);
        }
        Ok(Tracker {
            medium,
            ends: ends.try_into().map_err(|_| unsound("sides that do not fit the axes"))?,
            planes: Vec::new(),
            gaps: Vec::new(),
            drains: self.drains(),
            draws: Draws::new(self.plan.seed, D, is_double),
            interfaces: self
                .transport
                .interfaces
                .iter()
                .map(|interface| Interface { axis: interface.axis, at: interface.at })
                .collect(),
            criteria: self
                .transport
                .sub_steps
                .map(|sub| Criteria { courant: sub.courant, dispersion: sub.dispersion }),
            width,
        })
    }
}

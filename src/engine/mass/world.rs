//! The plan's transport as loops want it.
//!
//! Owns what all builders of walls and releases read, and the tracker they make. May use the plan, `flow` and
//! `track`. It deliberately runs nothing.

use super::super::calendar::Calendar;
use super::super::error::RunError;
use super::super::program::unsound;
use super::super::track::interfaces::Interfaces;
use super::super::track::medium::{Carrier, Medium};
use super::super::track::noise::Draws;
use super::super::track::tracker::Tracker;
use super::super::track::walls::Ends;
use super::initial::Starts;
use crate::flow::{FaceFlow, FlowSeries};
use crate::maths::wide::Width;
use crate::plan::tape::{Operation, Tape};
use crate::plan::transport::Transport;
use crate::plan::{Normals, Plan};
use std::sync::Arc;

/// What the builders read.
pub struct Site<'a, const D: usize> {
    pub plan: &'a Plan,
    pub transport: &'a Transport,
    /// The flow on cells at the start, if it is on cells; all of them have the same cells and porosity.
    pub flow: Option<Arc<FaceFlow>>,
    series: Option<FlowSeries>,
    /// When each flow begins, s; the first at 0.
    pub starts: Vec<f64>,
    pub calendar: Calendar,
    pub low: [f64; D],
    pub high: [f64; D],
    /// What other runs of the program may have integrated before.
    pub starts_known: Option<Starts>,
}

impl<'a, const D: usize> Site<'a, D> {
    pub fn new(plan: &'a Plan, series: Option<FlowSeries>) -> Result<Self, RunError> {
        let transport = plan.transport.as_ref().ok_or_else(|| unsound("no transport"))?;
        let axis = |value: fn(&crate::plan::Axis) -> f64| std::array::from_fn(|idx| value(&plan.axes[idx]));
        let mut starts = match &series {
            Some(series) => series.periods().iter().map(|period| period.from).collect(),
            None => transport.starts(),
        };
        starts.retain(|&from| from == 0.0 || from < plan.time.duration);
        let (low, high) = (axis(|a| a.low), axis(|a| a.high));
        let calendar = Calendar::new(&plan.time, &starts);
        let flow = series.as_ref().map(|series| series.flow(0).clone());
        let mut site =
            Self { plan, transport, flow, series, starts, calendar, low, high, starts_known: None };
        let changes: Vec<f64> = site.starts.iter().copied().chain(site.switches_of_held()).collect();
        site.calendar = Calendar::new(&plan.time, &changes);
        Ok(site)
    }

    /// The number of the flow at a time.
    pub fn period_at(&self, t: f64) -> usize {
        self.starts.partition_point(|&from| from <= t).saturating_sub(1)
    }

    /// The number of the flow during a step.
    pub fn period(&self, step: u64) -> usize {
        match self.starts.len() {
            1 => 0,
            _ => self.period_at(self.calendar.start(step) + 0.5 * self.calendar.length(step)),
        }
    }

    /// The parts of a time window by flows: number, from, to.
    pub fn periods_within(&self, from: f64, to: f64) -> Vec<(usize, f64, f64)> {
        let ends = self.starts.iter().skip(1).copied().chain([f64::INFINITY]);
        let parts = self.starts.iter().zip(ends).enumerate();
        parts
            .map(|(period, (&start, end))| (period, start.max(from), end.min(to)))
            .filter(|(_, from, to)| from < to)
            .collect()
    }

    /// The flow on cells of a period, if it is on cells.
    pub fn face_flow(&self, period: usize) -> Option<&FaceFlow> {
        self.series.as_ref().map(|series| &**series.flow(period))
    }

    /// A tape at places, at a time.
    pub fn evaluate(&self, tape: &Tape, places: &[[f64; D]], t: f64) -> Vec<f64> {
        if let [Operation::Constant(value)] = tape.operations[..] {
            return vec![value; places.len()];
        }
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

    /// A place of the active axes among x, y and z.
    pub fn in_space(&self, place: &[f64; D]) -> [f64; 3] {
        let mut all = [0.0; 3];
        self.plan.axes.iter().zip(place).for_each(|(axis, &x)| all[axis.index] = x);
        all
    }

    pub fn carriers(&self) -> Vec<Carrier> {
        let carrier = |population: &crate::plan::transport::Population| Carrier {
            mobility: if population.is_mobile { 1.0 / population.retardation } else { 0.0 },
            molecular: population.molecular,
        };
        self.transport.populations.iter().map(carrier).collect()
    }

    /// What particles meet at the start.
    pub fn tracker<M: Medium<D>>(&self, medium: M, width: Width) -> Result<Tracker<D, M>, RunError> {
        let is_double = self.plan.walk.normals == Normals::Double;
        let mut ends: Vec<Ends<D>> = Vec::with_capacity(D);
        for axis in 0..D {
            ends.push(self.ends(axis)?);
        }
        let ends: [Ends<D>; D] = ends.try_into().map_err(|_| unsound("sides that do not fit the axes"))?;
        let planes: Vec<(usize, f64)> =
            self.transport.interfaces.iter().map(|interface| (interface.axis, interface.at)).collect();
        Ok(Tracker {
            medium,
            interfaces: Interfaces::of_axes(&planes, &ends),
            ends,
            planes: Vec::new(),
            gaps: Vec::new(),
            drains: self.drains(0),
            draws: Draws::new(self.plan.seed, D, is_double),
            criteria: self.criteria(),
            width,
        })
    }
}

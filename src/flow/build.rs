//! From the words of a plan to a flow.
//!
//! Owns the translation. May use the plan and the solvers. It deliberately reads no file: whoever has read one
//! hands the flow over.

use super::darcy::{self, Problem, Side, Solution};
use super::random_field::{self, RandomField, lognormal};
use super::series::{Period, SeriesError};
use super::{Cells, FlowSeries, darcy::DarcyError, random_field::FieldError};
use crate::plan::Plan;
use crate::plan::tape::Tape;
use crate::plan::transport::{Changed, Conductivity, Covariance, Darcy, DarcySide, Flow, Transport, Well};
use std::fmt;
use std::sync::Arc;

/// Why a plan has no flow.
#[derive(Debug, Clone, PartialEq)]
pub enum FlowError {
    Cells,
    Field(FieldError),
    Darcy(DarcyError),
    /// What is wrong with a file.
    File(String),
    Series(SeriesError),
}

impl fmt::Display for FlowError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cells => write!(f, "the cells of the flow have no extent"),
            Self::Field(error) => write!(f, "{error}"),
            Self::Darcy(error) => write!(f, "{error}"),
            Self::File(error) => write!(f, "{error}"),
            Self::Series(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for FlowError {}

/// Solves for the flow that a plan begins with; nothing if the plan needs no cells, or if they come from a file.
pub fn of(plan: &Plan) -> Result<Option<Solution>, FlowError> {
    let Some((_, flow)) = darcy_of(plan) else { return Ok(None) };
    let ground = Ground::new(plan, flow)?;
    ground.solve(plan, flow, &flow.sides, &rates(flow)).map(Some)
}

/// Solves for all flows of a plan, one after another; nothing if it needs no cells, or if they come from a file.
pub fn series(plan: &Plan) -> Result<Option<FlowSeries>, FlowError> {
    let Some((transport, flow)) = darcy_of(plan) else { return Ok(None) };
    let ground = Ground::new(plan, flow)?;
    let first = ground.solve(plan, flow, &flow.sides, &rates(flow))?;
    let mut periods = vec![Period { from: 0.0, flow: Arc::new(first.flow) }];
    for change in &transport.changes {
        let Changed::Darcy { sides, rates } = &change.flow else { continue };
        let solution = ground.solve(plan, flow, sides, rates)?;
        periods.push(Period { from: change.from, flow: Arc::new(solution.flow) });
    }
    FlowSeries::new(periods).map(Some).map_err(FlowError::Series)
}

fn darcy_of(plan: &Plan) -> Option<(&Transport, &Darcy)> {
    let transport = plan.transport.as_ref()?;
    match &transport.flow {
        Flow::Darcy(flow) => Some((transport, flow)),
        Flow::Uniform(_) | Flow::Expression(_) | Flow::File(_) => None,
    }
}

fn rates(flow: &Darcy) -> Vec<f64> {
    flow.wells.iter().map(|well| well.rate).collect()
}

/// What stays the same while heads and wells change.
#[derive(Clone)]
struct Ground {
    cells: Cells,
    conductivity: Vec<f64>,
    porosity: Vec<f64>,
}

impl Ground {
    fn new(plan: &Plan, flow: &Darcy) -> Result<Self, FlowError> {
        let cells = cells(plan, flow).ok_or(FlowError::Cells)?;
        let conductivity = conductivity(plan, flow, &cells)?;
        let porosity = match &plan.transport {
            Some(transport) => at_centres(&transport.porosity, &cells),
            None => vec![1.0; cells.n_cells()],
        };
        Ok(Self { cells, conductivity, porosity })
    }

    fn solve(
        &self,
        plan: &Plan,
        flow: &Darcy,
        written: &[[DarcySide; 2]],
        rates: &[f64],
    ) -> Result<Solution, FlowError> {
        let Self { cells, conductivity, porosity } = self.clone();
        let mut sides = [[Side::NoFlow; 2]; 3];
        let mut anisotropy = [1.0; 3];
        for (idx, axis) in plan.axes.iter().enumerate() {
            if let (Some(written), Some(factor)) = (written.get(idx), flow.anisotropy.get(idx)) {
                sides[axis.index] = written.map(side);
                anisotropy[axis.index] = *factor;
            }
        }
        let mut wells = Vec::new();
        let mut owners = Vec::new();
        for (owner, (well, &rate)) in flow.wells.iter().zip(rates).enumerate() {
            wells.extend(well_cells(plan, well, rate, &cells, &conductivity).map_err(FlowError::Darcy)?);
            owners.resize(wells.len(), owner);
        }
        let problem = Problem { cells, conductivity, anisotropy, porosity, sides, wells };
        let mut solution = darcy::solve(problem).map_err(FlowError::Darcy)?;
        // The parts of a screen belong to one well.
        solution.flow.sinks.iter_mut().zip(owners).for_each(|(sink, owner)| sink.owner = owner);
        Ok(solution)
    }
}

/// The cells of a well, each with its part of the rate.
pub fn well_cells(
    plan: &Plan,
    well: &Well,
    rate: f64,
    cells: &Cells,
    conductivity: &[f64],
) -> Result<Vec<darcy::Well>, DarcyError> {
    let place = |ends: &[f64]| {
        let mut place = [0.5; 3];
        plan.axes.iter().zip(ends).for_each(|(axis, &end)| place[axis.index] = end);
        place
    };
    darcy::wells(cells, conductivity, place(&well.low), place(&well.high), rate)
}

/// Cells over the domain; an axis that it does not have is one cell from 0 to 1.
fn cells(plan: &Plan, flow: &Darcy) -> Option<Cells> {
    let (mut low, mut high, mut n) = ([0.0; 3], [1.0; 3], [1; 3]);
    for (idx, axis) in plan.axes.iter().enumerate() {
        (low[axis.index], high[axis.index]) = (axis.low, axis.high);
        n[axis.index] = (*flow.cells.get(idx)?).max(1);
    }
    Cells::equal(low, high, n)
}

fn side(side: DarcySide) -> Side {
    match side {
        DarcySide::Head(head) => Side::Head(head),
        DarcySide::Flux(flux) => Side::Inflow(flux),
        DarcySide::NoFlow => Side::NoFlow,
        DarcySide::Periodic => Side::Periodic { fall: 0.0 },
    }
}

fn conductivity(plan: &Plan, flow: &Darcy, cells: &Cells) -> Result<Vec<f64>, FlowError> {
    match &flow.conductivity {
        Conductivity::Expression(tape) => Ok(at_centres(tape, cells)),
        Conductivity::Lognormal { geometric_mean, variance, covariance, lengths, seed } => {
            let mut along = [1.0; 3];
            plan.axes.iter().zip(lengths).for_each(|(axis, &length)| along[axis.index] = length);
            let covariance = match covariance {
                Covariance::Exponential => random_field::Covariance::Exponential,
                Covariance::Gaussian => random_field::Covariance::Gaussian,
            };
            let field = RandomField { covariance, variance: *variance, lengths: along, seed: *seed };
            let field = field.realise(cells).map_err(FlowError::Field)?;
            Ok(lognormal(*geometric_mean, &field))
        }
    }
}

/// A tape of x, y, z and the time 0 at the middle of every cell.
fn at_centres(tape: &Tape, cells: &Cells) -> Vec<f64> {
    let n = cells.n_cells();
    let mut inputs = [const { Vec::new() }; 4];
    for (axis, input) in inputs.iter_mut().enumerate() {
        *input = match axis {
            3 => vec![0.0; n],
            axis => (0..n).map(|cell| cells.centre(cells.place(cell))[axis]).collect(),
        };
    }
    let inputs: Vec<&[f64]> = inputs.iter().map(|input: &Vec<f64>| &input[..]).collect();
    let mut values = vec![0.0; n];
    tape.evaluate_block(&inputs, &mut Vec::new(), &mut values);
    values
}

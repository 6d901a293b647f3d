//! From the words of a plan to a flow.
//!
//! Owns the translation. May use the plan and the solvers. It deliberately reads no file: whoever has read one
//! hands the flow over.

use super::darcy::{self, Problem, Side, Solution};
use super::random_field::{self, RandomField, lognormal};
use super::{Cells, darcy::DarcyError, random_field::FieldError};
use crate::plan::Plan;
use crate::plan::tape::Tape;
use crate::plan::transport::{Conductivity, Covariance, Darcy, DarcySide, Flow};
use std::fmt;

/// Why a plan has no flow.
#[derive(Debug, Clone, PartialEq)]
pub enum FlowError {
    Cells,
    Field(FieldError),
    Darcy(DarcyError),
    /// What is wrong with a file.
    File(String),
}

impl fmt::Display for FlowError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Cells => write!(f, "the cells of the flow have no extent"),
            Self::Field(error) => write!(f, "{error}"),
            Self::Darcy(error) => write!(f, "{error}"),
            Self::File(error) => write!(f, "{error}"),
        }
    }
}

impl std::error::Error for FlowError {}

/// Solves for the flow of a plan; nothing if the plan needs no cells, or if they come from a file.
pub fn of(plan: &Plan) -> Result<Option<Solution>, FlowError> {
    match plan.transport.as_ref().map(|transport| &transport.flow) {
        Some(Flow::Darcy(flow)) => solve(plan, flow).map(Some),
        Some(Flow::Uniform(_) | Flow::Expression(_) | Flow::File(_)) | None => Ok(None),
    }
}

fn solve(plan: &Plan, flow: &Darcy) -> Result<Solution, FlowError> {
    let cells = cells(plan, flow).ok_or(FlowError::Cells)?;
    let mut sides = [[Side::NoFlow; 2]; 3];
    let mut anisotropy = [1.0; 3];
    for (idx, axis) in plan.axes.iter().enumerate() {
        if let (Some(written), Some(factor)) = (flow.sides.get(idx), flow.anisotropy.get(idx)) {
            sides[axis.index] = written.map(side);
            anisotropy[axis.index] = *factor;
        }
    }
    let conductivity = conductivity(plan, flow, &cells)?;
    let porosity = match &plan.transport {
        Some(transport) => at_centres(&transport.porosity, &cells),
        None => vec![1.0; cells.n_cells()],
    };
    let mut wells = Vec::new();
    let mut owners = Vec::new();
    for (owner, well) in flow.wells.iter().enumerate() {
        let place = |ends: &[f64]| {
            let mut place = [0.5; 3];
            plan.axes.iter().zip(ends).for_each(|(axis, &end)| place[axis.index] = end);
            place
        };
        let found = darcy::wells(&cells, &conductivity, place(&well.low), place(&well.high), well.rate);
        wells.extend(found.map_err(FlowError::Darcy)?);
        owners.resize(wells.len(), owner);
    }
    let problem = Problem { cells, conductivity, anisotropy, porosity, sides, wells };
    let mut solution = darcy::solve(problem).map_err(FlowError::Darcy)?;
    // The parts of a screen belong to one well.
    solution.flow.sinks.iter_mut().zip(owners).for_each(|(sink, owner)| sink.owner = owner);
    Ok(solution)
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

//! From flow and dispersion of a plan to the medium of a walk.
//!
//! Owns the choice of the medium. May use the plan and `track`. It deliberately knows no particle.

use super::super::control::{Control, Settings};
use super::super::error::RunError;
use super::super::program::unsound;
use super::super::snapshot::Outcome;
use super::super::track::cells::{CellMedium, Dispersivity};
use super::super::track::formula::{Formula, Spreading};
use super::super::track::medium::{Carrier, Medium};
use super::super::track::paths::{Pathed, Paths};
use super::super::track::uneven::{Blend, Lengths, UnevenMedium};
use super::super::track::uniform::Uniform;
use super::run::{Sink, go};
use super::world::Site;
use crate::flow::{FaceFlow, FlowSeries, build};
use crate::plan::Plan;
use crate::plan::burnett_frind::uniform_tensor;
use crate::plan::tape::{Operation, Tape};
use crate::plan::transport::{Changed, Dispersion, Flow};

/// The medium of each flow.
pub type Media<'a, M> = &'a dyn Fn(usize) -> Result<M, RunError>;

/// What is done in a medium, whichever it is.
pub trait InMedium<const D: usize> {
    type Output;

    /// `media` makes the medium of each flow.
    fn go<M: Medium<D> + Send + 'static>(
        self,
        site: &Site<D>,
        media: Media<M>,
    ) -> Result<Self::Output, RunError>;
}

/// A run of masses.
struct Masses<'a> {
    settings: &'a Settings,
    control: &'a dyn Control,
    sink: Sink<'a>,
}

impl<const D: usize> InMedium<D> for Masses<'_> {
    type Output = Outcome;

    fn go<M: Medium<D> + Send + 'static>(self, site: &Site<D>, media: Media<M>) -> Result<Outcome, RunError> {
        go(site, media, self.settings, self.control, self.sink)
    }
}

/// Runs a plan of masses.
pub fn run<const D: usize>(
    plan: &Plan,
    settings: &Settings,
    control: &dyn Control,
    sink: Sink,
) -> Result<Outcome, RunError> {
    let mut site = Site::<D>::new(plan, flow_of(plan, settings)?)?;
    site.starts_known = settings.starts.clone();
    in_medium(&site, Masses { settings, control, sink })
}

/// The flows of a plan, if they have to be solved or read.
pub fn flow_of(plan: &Plan, settings: &Settings) -> Result<Option<FlowSeries>, RunError> {
    match &settings.flow {
        Some(flow) => Ok(Some(flow.clone())),
        None => build::series(plan).map_err(|error| RunError::Flow(error.to_string())),
    }
}

/// Does something in the media of a plan, which are matched here, once.
pub fn in_medium<const D: usize, W: InMedium<D>>(site: &Site<D>, what: W) -> Result<W::Output, RunError> {
    let plan = site.plan;
    match (&site.transport.flow, &site.transport.dispersion) {
        (Flow::Uniform(first), Dispersion::Constant(_) | Dispersion::Velocity { .. })
            if is_constant(&site.transport.porosity) =>
        {
            let medium = |period: usize| {
                let velocity = match changed(site, period) {
                    Some(Changed::Uniform(velocity)) => velocity.clone(),
                    _ => first.clone(),
                };
                let velocity =
                    velocity.try_into().map_err(|_| unsound("a velocity that does not fit the axes"))?;
                uniform(plan, velocity, &site.transport.dispersion)
            };
            what.go(site, &medium)
        }
        (Flow::Uniform(_) | Flow::Expression(_), _) => what.go(site, &|period| formula(site, period)),
        (
            Flow::Darcy(_) | Flow::File(_),
            Dispersion::Velocity { longitudinal, transverse, transverse_vertical, molecular },
        ) => {
            let lengths = Lengths {
                longitudinal: *longitudinal,
                transverse: *transverse,
                vertical: (D == 3).then_some(*transverse_vertical).filter(|vertical| vertical != transverse),
                molecular: *molecular,
            };
            on_cells(site, lengths, what)
        }
        (Flow::Darcy(_) | Flow::File(_), Dispersion::Constant(triangle))
            if triangle.iter().all(|entry| *entry == 0.0) =>
        {
            let none = Lengths { longitudinal: 0.0, transverse: 0.0, vertical: None, molecular: 0.0 };
            on_cells(site, none, what)
        }
        (Flow::Darcy(_) | Flow::File(_), Dispersion::Constant(_) | Dispersion::Isotropic(_)) => {
            let none = Lengths { longitudinal: 0.0, transverse: 0.0, vertical: None, molecular: 0.0 };
            let axes = std::array::from_fn(|axis| plan.axes[axis].index);
            let medium = |period: usize| {
                let cells = UnevenMedium::<D>::new(solved(site, period)?, axes, none);
                Ok(Blend { cells, spreading: formula(site, period)? })
            };
            what.go(site, &medium)
        }
    }
}

/// A walk on cells: those that are equal in everything have the faster way.
fn on_cells<const D: usize, W: InMedium<D>>(
    site: &Site<D>,
    lengths: Lengths,
    what: W,
) -> Result<W::Output, RunError> {
    let axes = std::array::from_fn(|axis| site.plan.axes[axis].index);
    let Lengths { longitudinal, transverse, vertical, molecular } = lengths;
    let is_still = [longitudinal, transverse, vertical.unwrap_or(0.0)].iter().all(|length| *length == 0.0);
    let follows_paths = |carrier: Carrier| carrier.molecular.unwrap_or(molecular) == 0.0;
    // Parcels of water, which are no carriers, touch walls on their way and walk in steps.
    if is_still && site.carriers().into_iter().any(follows_paths) {
        let pathed = |period: usize| {
            let flow = solved(site, period)?;
            let paths = Paths::new(flow, axes, &site.drains(period));
            let medium = UnevenMedium::<D>::new(flow, axes, lengths);
            Ok(Pathed { medium, paths, molecular })
        };
        return what.go(site, &pathed);
    }
    let even = |period: usize| {
        let flow = solved(site, period)?;
        Ok(CellMedium::<D>::new(flow, axes, Dispersivity { longitudinal, transverse, molecular }))
    };
    // All flows have the same cells and porosity.
    if vertical.is_none() && even(0)?.is_some() {
        return what.go(site, &|period| even(period)?.ok_or_else(|| unsound("cells that are not equal")));
    }
    what.go(site, &|period| Ok(UnevenMedium::<D>::new(solved(site, period)?, axes, lengths)))
}

/// The flow on cells of a period.
fn solved<'a, const D: usize>(site: &'a Site<D>, period: usize) -> Result<&'a FaceFlow, RunError> {
    site.face_flow(period).ok_or_else(|| unsound("a flow that nobody solved"))
}

/// What the flow has become in a period after the first.
fn changed<'a, const D: usize>(site: &Site<'a, D>, period: usize) -> Option<&'a Changed> {
    let change = site.transport.changes.get(period.checked_sub(1)?)?;
    Some(&change.flow)
}

fn is_constant(tape: &Tape) -> bool {
    matches!(tape.operations[..], [Operation::Constant(_)])
}

/// A medium of expressions.
fn formula<const D: usize>(site: &Site<D>, period: usize) -> Result<Formula<D>, RunError> {
    let constant = |value: f64| Tape { operations: vec![Operation::Constant(value)] };
    let uniform = |velocity: &[f64]| velocity.iter().map(|&v| constant(v)).collect();
    let velocity: Vec<Tape> = match (changed(site, period), &site.transport.flow) {
        (Some(Changed::Uniform(velocity)), _) | (None, Flow::Uniform(velocity)) => uniform(velocity),
        (Some(Changed::Expression(tapes)), _) | (None, Flow::Expression(tapes)) => tapes.clone(),
        // Cells have the velocity, and the porosity.
        _ => vec![constant(0.0); D],
    };
    let spreading = match &site.transport.dispersion {
        Dispersion::Constant(triangle) => Spreading::Constant(triangle_of(triangle)?, 0.0),
        Dispersion::Isotropic(tape) => Spreading::Isotropic(tape.clone()),
        Dispersion::Velocity { longitudinal, transverse, transverse_vertical, molecular } => {
            Spreading::Velocity {
                longitudinal: *longitudinal,
                transverse: *transverse,
                transverse_vertical: *transverse_vertical,
                molecular: *molecular,
            }
        }
    };
    Ok(Formula {
        axes: std::array::from_fn(|axis| site.plan.axes[axis].index),
        velocity: velocity.try_into().map_err(|_| unsound("a velocity that does not fit the axes"))?,
        spreading,
        porosity: match site.flow {
            Some(_) => constant(1.0),
            None => site.transport.porosity.clone(),
        },
        width: std::array::from_fn(|axis| site.high[axis] - site.low[axis]),
    })
}

/// A lower triangle, row by row.
fn triangle_of<const D: usize>(entries: &[f64]) -> Result<[[f64; D]; D], RunError> {
    if entries.len() != D * (D + 1) / 2 {
        return Err(unsound("a dispersion that does not fit the axes"));
    }
    let mut tensor = [[0.0; D]; D];
    for (row, target) in tensor.iter_mut().enumerate() {
        target[..=row].copy_from_slice(&entries[row * (row + 1) / 2..][..=row]);
    }
    Ok(tensor)
}

/// A uniform medium from constants, or from lengths along the velocity.
fn uniform<const D: usize>(
    plan: &Plan,
    velocity: [f64; D],
    dispersion: &Dispersion,
) -> Result<Uniform<D>, RunError> {
    let mut tensor = [[0.0; D]; D];
    let mut own = 0.0;
    match dispersion {
        Dispersion::Constant(triangle) => tensor = triangle_of(triangle)?,
        Dispersion::Velocity { longitudinal, transverse, transverse_vertical, molecular }
            if D == 3 && transverse != transverse_vertical =>
        {
            own = *molecular;
            let along = std::array::from_fn(|axis| velocity[axis]);
            let all = uniform_tensor(along, [*longitudinal, *transverse, *transverse_vertical, own]);
            for i in 0..D {
                tensor[i][..=i].copy_from_slice(&all[i][..=i]);
            }
        }
        Dispersion::Velocity { longitudinal, transverse, molecular, .. } => {
            let speed = velocity.iter().map(|v| v * v).sum::<f64>().sqrt();
            own = *molecular;
            for i in 0..D {
                for j in 0..=i {
                    let along = if speed > 0.0 { velocity[i] * velocity[j] / speed } else { 0.0 };
                    tensor[i][j] = (longitudinal - transverse) * along;
                    if i == j {
                        tensor[i][j] += transverse * speed + molecular;
                    }
                }
            }
        }
        Dispersion::Isotropic(_) => return Err(unsound("a dispersion that varies in a uniform medium")),
    }
    let width = std::array::from_fn(|axis| plan.axes[axis].high - plan.axes[axis].low);
    Ok(Uniform { velocity, dispersion: tensor, molecular: own, width })
}

//! Transport along tracks, from the scenario to what the engine walks in.
//!
//! Owns the lowering of flow, dispersion, sides, sources and populations. May use the scenario and the tape.
//! It deliberately solves no flow; what can be seen without one is checked in `transport_limits`.

use super::Axis;
use super::build_tape::build_tape;
use super::burnett_frind::uniform_tensor;
use super::lower::too_large;
use super::lower_chemistry::Network;
use super::lower_exchange::walking_part;
use super::periods::{Periods, TimedSide};
use super::shares;
use super::tape::{Binary, Operation, Tape};
use super::transport::{
    Change, Changed, Conductivity, Darcy, Decay, Dispersion, FileFlow, Flow, Interface, Patch, Population,
    Region, SideRule, Source, Strength, Transport, Well,
};
use crate::diagnostic::codes::R104;
use crate::diagnostic::{Diagnostic, any_fatal};
use crate::scenario::expression::{Expr, Type};
use crate::scenario::transport as written;
use crate::scenario::{self, Scenario};
use crate::source::Span;
use crate::units::Dimension;

/// A transport, and warnings.
type Told = (Option<Transport>, Vec<Diagnostic>);

/// The transport of a scene; none where the walk of fluid with constant coefficients says everything.
pub(super) fn transport(
    scenario: &Scenario,
    axes: &[Axis],
    network: &Network,
    decay: Option<Decay>,
) -> Result<Told, Vec<Diagnostic>> {
    let is_of_fluid = scenario.particles.shares.is_none();
    if is_of_fluid && is_plain(scenario) {
        return Ok((None, Vec::new()));
    }
    let totals = is_of_fluid.then_some((&network.totals[..], network.components.len()));
    let mut lowering = Lowering { scenario, axes, totals, problems: Vec::new() };
    let transport = lowering.transport(decay);
    match transport {
        Some(transport) if !any_fatal(&lowering.problems) => Ok((Some(transport), lowering.problems)),
        _ => Err(lowering.problems),
    }
}

/// Whether flow, dispersion and porosity are the same everywhere, and sides simple.
fn is_plain(scenario: &Scenario) -> bool {
    let flow = scenario.flow.as_ref().map(|flow| &flow.value);
    let is_bare = |patch: &written::Patch| {
        let rule = &patch.rule;
        let is_simple = *rule == written::SideRule::Reflect
            || *rule == written::SideRule::Periodic
            || *rule == written::SideRule::Open;
        patch.limits.is_empty() && is_simple
    };
    matches!(flow, None | Some(written::Flow::Uniform(_)))
        && !matches!(
            scenario.dispersion.as_ref().map(|dispersion| &dispersion.value),
            Some(written::Dispersion::Isotropic(_))
        )
        && scenario.medium.as_ref().is_none_or(|porosity| porosity.value.value().is_some())
        && scenario.domain.axes.iter().flat_map(|axis| axis.patches.iter().flatten()).all(is_bare)
}

/// The dispersion of a scene over the axes of its domain.
pub(super) fn dispersion(scenario: &Scenario, axes: &[Axis]) -> Result<Dispersion, Vec<Diagnostic>> {
    let mut lowering = Lowering { scenario, axes, totals: None, problems: Vec::new() };
    match lowering.dispersion() {
        Some((dispersion, _)) => Ok(dispersion),
        None => Err(lowering.problems),
    }
}

/// `value` everywhere.
pub(super) fn constant(value: f64) -> Tape {
    Tape { operations: vec![Operation::Constant(value)] }
}

/// What one unit of each species adds to the components, and how many of these there are.
type Totals<'a> = (&'a [Vec<(usize, f64)>], usize);

struct Lowering<'a> {
    scenario: &'a Scenario,
    axes: &'a [Axis],
    /// With fluid.
    totals: Option<Totals<'a>>,
    problems: Vec<Diagnostic>,
}

impl Lowering<'_> {
    fn transport(&mut self, decay: Option<Decay>) -> Option<Transport> {
        let (flow, changes) = self.flow()?;
        let (dispersion, own) = self.dispersion()?;
        // What is exchanged does not walk.
        let dispersion = dispersion.times(walking_part(self.scenario), self.axes.len());
        let porosity = match &self.scenario.medium {
            Some(porosity) => self.tape(&porosity.value, porosity.span)?,
            None => constant(1.0),
        };
        let sides = self.sides()?;
        let sources: Vec<Option<Source>> =
            self.scenario.sources.iter().map(|source| self.source(source)).collect();
        let sources = sources.into_iter().collect::<Option<_>>()?;
        let is_of_fluid = self.totals.is_some();
        let populations = if is_of_fluid { Vec::new() } else { self.populations(own)? };
        let is_on_cells = matches!(flow, Flow::Darcy(_) | Flow::File(_));
        // Cells have porosities of their own, and faces between them.
        let of_porosity = Some(&porosity).filter(|_| !is_on_cells);
        let interfaces = self.interfaces(&jumping(&flow, &changes, &dispersion, of_porosity));
        let mut transport = Transport {
            flow,
            changes,
            dispersion,
            porosity,
            sides,
            sources,
            populations,
            is_of_fluid,
            decay,
            sub_steps: None,
            interfaces,
            order: None,
        };
        if is_of_fluid {
            return Some(transport);
        }
        let counts = shares::counts(self.scenario, self.axes, &transport);
        transport.populations.iter_mut().zip(counts).for_each(|(population, count)| population.count = count);
        Some(transport)
    }

    fn tape(&mut self, expr: &Expr, span: Span) -> Option<Tape> {
        let tape = build_tape(expr, &self.scenario.species);
        if tape.is_none() {
            self.problems.push(too_large(span));
        }
        tape
    }

    /// The entries of the active axes.
    fn along_axes(&self, all: [f64; 3]) -> Vec<f64> {
        self.axes.iter().map(|axis| all[axis.index]).collect()
    }

    fn flow(&mut self) -> Option<(Flow, Vec<Change>)> {
        let scenario = self.scenario;
        let frame = scenario.domain.frame;
        let flow = match scenario.flow.as_ref().map(|flow| (&flow.value, flow.span)) {
            None => Flow::Uniform(self.along_axes(frame.map(|v| 0.0 - v))),
            Some((written::Flow::Uniform(velocity), _)) => {
                let relative = [0, 1, 2].map(|index| velocity[index] - frame[index]);
                Flow::Uniform(self.along_axes(relative))
            }
            Some((written::Flow::Expression(list, changes), span)) => {
                let tapes: Vec<Option<Tape>> = list.iter().map(|expr| self.tape(expr, expr.span)).collect();
                let tapes: Vec<Tape> = tapes.into_iter().collect::<Option<_>>()?;
                return self.periods().velocity(&tapes, changes, span);
            }
            Some((written::Flow::Darcy(darcy), span)) => return self.darcy(darcy, span),
            Some((written::Flow::File(flow), span)) => {
                let Some(facts) = flow.facts.clone() else {
                    self.problems.push(unread(span));
                    return None;
                };
                Flow::File(Box::new(FileFlow { file: flow.file.clone(), facts }))
            }
        };
        Some((flow, Vec::new()))
    }

    fn periods(&mut self) -> Periods<'_> {
        let duration = self.scenario.run.duration;
        Periods { axes: self.axes, duration, problems: &mut self.problems }
    }

    fn darcy(&mut self, darcy: &written::Darcy, span: Span) -> Option<(Flow, Vec<Change>)> {
        let conductivity = match &darcy.conductivity {
            written::Conductivity::Expression(expr) => {
                Conductivity::Expression(self.tape(expr, darcy.conductivity_span)?)
            }
            written::Conductivity::Lognormal { geometric_mean, variance, covariance, lengths, seed } => {
                Conductivity::Lognormal {
                    geometric_mean: *geometric_mean,
                    variance: *variance,
                    covariance: *covariance,
                    lengths: lengths.clone(),
                    seed: seed.unwrap_or(self.scenario.seed),
                }
            }
        };
        let mut sides = Vec::new();
        for [low, high] in &darcy.sides {
            sides.push([self.darcy_side(low)?, self.darcy_side(high)?]);
        }
        let (mut wells, mut rates) = (Vec::new(), Vec::new());
        for well in &darcy.wells {
            rates.push(self.tape(&well.rate, well.rate.span)?);
            let carrying = match well.carrying.is_empty() {
                true => Vec::new(),
                false => self.concentrations(&well.carrying)?,
            };
            let (low, high) = (self.along_axes(well.low), self.along_axes(well.high));
            wells.push(Well { name: well.name.clone(), low, high, rate: 0.0, carrying });
        }
        let first = Darcy {
            cells: darcy.cells.clone(),
            sides: Vec::new(),
            conductivity,
            anisotropy: darcy.anisotropy.clone(),
            wells,
        };
        self.periods().darcy(first, &sides, &rates, &darcy.changes, span)
    }

    fn darcy_side(&mut self, side: &written::DarcySide) -> Option<TimedSide> {
        Some(match side {
            written::DarcySide::Head(head) => TimedSide::Head(self.tape(head, head.span)?),
            written::DarcySide::Flux(flux) => TimedSide::Flux(self.tape(flux, flux.span)?),
            written::DarcySide::NoFlow => TimedSide::NoFlow,
            written::DarcySide::Periodic => TimedSide::Periodic,
        })
    }

    /// Dispersion, and the molecular part that a species has instead of its own if it is not in there.
    fn dispersion(&mut self) -> Option<(Dispersion, Option<f64>)> {
        let scenario = self.scenario;
        let triangle = |tensor: [[f64; 3]; 3]| {
            let rows = self.axes.iter().enumerate();
            rows.flat_map(|(i, row)| {
                self.axes[..=i].iter().map(move |column| tensor[row.index][column.index])
            })
            .collect()
        };
        let Some(dispersion) = &scenario.dispersion else {
            return Some((Dispersion::Constant(triangle([[0.0; 3]; 3])), None));
        };
        Some(match &dispersion.value {
            written::Dispersion::Tensor(tensor) => (Dispersion::Constant(triangle(*tensor)), None),
            written::Dispersion::Isotropic(expr) => {
                (Dispersion::Isotropic(self.tape(expr, dispersion.span)?), None)
            }
            written::Dispersion::Parts { longitudinal, transverse, transverse_vertical, molecular } => {
                let is_moving = scenario.domain.frame.iter().any(|v| *v != 0.0);
                let uniform = match scenario.flow.as_ref().map(|flow| &flow.value) {
                    Some(written::Flow::Uniform(velocity)) => Some(*velocity),
                    _ => None,
                };
                if let (true, Some(velocity)) = (is_moving, uniform) {
                    // Lengths multiply the velocity of the water, not that in the frame.
                    let lengths = [*longitudinal, *transverse, *transverse_vertical, 0.0];
                    let tensor = uniform_tensor(velocity, lengths);
                    return Some((Dispersion::Constant(triangle(tensor)), Some(*molecular)));
                }
                // In a vertical section what is across is vertical.
                let is_section = self.axes.len() == 2 && self.axes.iter().any(|axis| axis.index == 2);
                let parts = Dispersion::Velocity {
                    longitudinal: *longitudinal,
                    transverse: if is_section { *transverse_vertical } else { *transverse },
                    transverse_vertical: *transverse_vertical,
                    molecular: *molecular,
                };
                (parts, None)
            }
        })
    }

    fn sides(&mut self) -> Option<Vec<[Vec<Patch>; 2]>> {
        let mut sides = Vec::new();
        for axis in &self.scenario.domain.axes {
            let [low, high] = &axis.patches;
            sides.push([self.patches(low)?, self.patches(high)?]);
        }
        Some(sides)
    }

    fn patches(&mut self, list: &[written::Patch]) -> Option<Vec<Patch>> {
        let mut patches = Vec::new();
        for patch in list {
            let rule = match &patch.rule {
                written::SideRule::Reflect => SideRule::Reflect,
                written::SideRule::Periodic => SideRule::Periodic,
                written::SideRule::Open => SideRule::Open,
                written::SideRule::Absorb => SideRule::Absorb,
                written::SideRule::Partial(rate) => SideRule::Partial(*rate),
                written::SideRule::Outflow => SideRule::Outflow,
                written::SideRule::Inflow(list) => SideRule::Inflow(self.concentrations(list)?),
                written::SideRule::Held(list) => SideRule::Held(self.concentrations(list)?),
            };
            let limit = |index: usize| patch.limits.iter().find(|(other, ..)| *other == index);
            let low = self.axes.iter().map(|axis| limit(axis.index).map_or(axis.low, |it| it.1)).collect();
            let high = self.axes.iter().map(|axis| limit(axis.index).map_or(axis.high, |it| it.2)).collect();
            patches.push(Patch { low, high, rule });
        }
        Some(patches)
    }

    /// One tape for each species of the scene, or for each component that fluid carries; what is not named is not
    /// there.
    fn concentrations(&mut self, list: &[(usize, Expr)]) -> Option<Vec<Tape>> {
        if let Some((totals, n_components)) = self.totals {
            return (0..n_components).map(|component| self.total(list, totals, component)).collect();
        }
        let mut tapes = vec![constant(0.0); self.scenario.species.len()];
        for (species, expr) in list {
            tapes[*species] = self.tape(expr, expr.span)?;
        }
        Some(tapes)
    }

    /// What concentrations of species are of a component.
    fn total(
        &mut self,
        list: &[(usize, Expr)],
        totals: &[Vec<(usize, f64)>],
        component: usize,
    ) -> Option<Tape> {
        let mut sum: Option<Expr> = None;
        for (species, expr) in list {
            let share = totals[*species].iter().find(|(other, _)| *other == component);
            let Some(&(_, nu)) = share else { continue };
            let (kind, span) = (expr.kind, expr.span);
            let factor = Expr::constant(nu, Type::Number(Dimension::NONE), span);
            let own = match nu {
                1.0 => expr.clone(),
                _ => Expr::binary(Binary::Multiply, factor, expr.clone(), kind, span),
            };
            sum = Some(match sum {
                None => own,
                Some(before) => Expr::binary(Binary::Add, before, own, kind, span),
            });
        }
        match sum {
            None => Some(constant(0.0)),
            Some(expr) => self.tape(&expr, expr.span),
        }
    }

    fn source(&mut self, source: &written::Source) -> Option<Source> {
        let along = |all| self.along_axes(all);
        let region = match &source.region {
            written::Region::Point(at) => Region::Point(along(*at)),
            written::Region::Line(from, to) => Region::Line(along(*from), along(*to)),
            written::Region::Box(low, high) => Region::Box(along(*low), along(*high)),
            written::Region::Gaussian(centre, deviation) => {
                Region::Gaussian(along(*centre), along(*deviation))
            }
            written::Region::Table(cloud) => Region::Table(cloud.clone()),
        };
        let strength = match &source.strength {
            written::Strength::Pulse(amount) => Strength::Pulse(*amount),
            written::Strength::Rate(rate) => match rate.value() {
                Some(rate) => Strength::Rate(rate),
                None => Strength::RateInTime(self.tape(rate, rate.span)?),
            },
            written::Strength::Held(c) => match c.value() {
                Some(c) => Strength::Held(c),
                None => Strength::HeldInTime(self.tape(c, c.span)?),
            },
        };
        let during = source.during.unwrap_or((0.0, 0.0));
        Some(Source { name: source.name.clone(), species: source.species, region, strength, during })
    }

    fn populations(&mut self, own: Option<f64>) -> Option<Vec<Population>> {
        let mut list = Vec::new();
        for (idx, species) in self.scenario.species.iter().enumerate() {
            list.push(Population {
                species: idx,
                count: 0,
                retardation: species.retardation,
                molecular: species.diffusion.or(own),
                is_mobile: !species.is_immobile,
                initial: self.tape(&species.initial, species.span)?,
                made: None,
            });
        }
        Some(list)
    }

    /// Planes at which a comparison of a coordinate with a number switches one of some coefficients.
    fn interfaces(&self, coefficients: &[Coefficient]) -> Vec<Interface> {
        let mut list: Vec<Interface> = Vec::new();
        for &(tape, only) in coefficients {
            for (input, at) in tape.operations.iter().filter_map(|operation| threshold(tape, operation)) {
                let Some(axis) = self.axes.iter().position(|axis| axis.index == usize::from(input)) else {
                    continue;
                };
                let is_inside = self.axes[axis].low < at && at < self.axes[axis].high;
                let interface = Interface { axis, at };
                if only.is_none_or(|only| only == axis) && is_inside && !list.contains(&interface) {
                    list.push(interface);
                }
            }
        }
        list.sort_by(|a, b| a.axis.cmp(&b.axis).then(a.at.total_cmp(&b.at)));
        list
    }
}

/// A coefficient, and the only axis across which its jumps count, if there is one.
type Coefficient<'a> = (&'a Tape, Option<usize>);

/// What may jump at a plane: dispersion, porosity, and the velocity through it; any velocity where dispersion follows it.
fn jumping<'a>(
    flow: &'a Flow,
    changes: &'a [Change],
    dispersion: &'a Dispersion,
    porosity: Option<&'a Tape>,
) -> Vec<Coefficient<'a>> {
    let of_dispersion = if let Dispersion::Isotropic(tape) = dispersion { Some(tape) } else { None };
    let mut list: Vec<Coefficient> =
        of_dispersion.into_iter().chain(porosity).map(|tape| (tape, None)).collect();
    let follows = matches!(dispersion, Dispersion::Velocity { .. });
    let first = if let Flow::Expression(tapes) = flow { Some(tapes) } else { None };
    let later = changes.iter().filter_map(|change| match &change.flow {
        Changed::Expression(tapes) => Some(tapes),
        _ => None,
    });
    for tapes in first.into_iter().chain(later) {
        list.extend(tapes.iter().enumerate().map(|(axis, tape)| (tape, (!follows).then_some(axis))));
    }
    list
}

/// Whoever makes a plan of such a scene has to read its files before.
fn unread(span: Span) -> Diagnostic {
    Diagnostic::error(R104, "the files of the flow have not been read")
        .at(span, "a flow from files")
        .found("no facts of the flow")
        .expected("files that were read before the plan is made")
}

/// The input and the number that an operation compares.
fn threshold(tape: &Tape, operation: &Operation) -> Option<(u16, f64)> {
    let Operation::Binary(operator, a, b) = *operation else { return None };
    if !matches!(operator, Binary::Less | Binary::LessEqual | Binary::Greater | Binary::GreaterEqual) {
        return None;
    }
    match (&tape.operations[usize::from(a)], &tape.operations[usize::from(b)]) {
        (Operation::Input(input), Operation::Constant(at))
        | (Operation::Constant(at), Operation::Input(input)) => Some((*input, *at)),
        _ => None,
    }
}

/// Drift in the frame and the tensor of a walk of fluid.
pub(super) fn of_fluid(scenario: &Scenario) -> ([f64; 3], [[f64; 3]; 3]) {
    let velocity = match scenario.flow.as_ref().map(|flow| &flow.value) {
        Some(written::Flow::Uniform(velocity)) => *velocity,
        _ => [0.0; 3],
    };
    let tensor = match scenario.dispersion.as_ref().map(|dispersion| &dispersion.value) {
        Some(written::Dispersion::Tensor(tensor)) => *tensor,
        Some(&written::Dispersion::Parts { longitudinal, transverse, transverse_vertical, molecular }) => {
            uniform_tensor(velocity, [longitudinal, transverse, transverse_vertical, molecular])
        }
        Some(written::Dispersion::Isotropic(_)) | None => [[0.0; 3]; 3],
    };
    (velocity, tensor)
}

/// Porosity that is the same everywhere; 1 without a medium.
pub(super) fn porosity_of_fluid(scenario: &scenario::Scenario) -> f64 {
    scenario.medium.as_ref().and_then(|porosity| porosity.value.value()).unwrap_or(1.0)
}

//! Scenario to plan, literally: everything the scene says, nothing left out yet.

use super::averaging::Averaging;
use super::build_tape::build_reference;
use super::evaluation::{self, Evaluation};
use super::exchange::Exchange;
use super::kernels::Reacting;
use super::lower_chemistry::{self, Network};
use super::lower_decay;
use super::lower_exchange;
use super::lower_transport::{self, of_fluid};
use super::{
    Axis, InstantReaction, Mixing, NUMERICS_VERSION, Normals, Output, OutputUnit, Particles, Plan, Quantity,
    Stage, Time, Walk, Zone, ZoneRate, auto_step, kernel_limits, kernels, medium_limits, method, shares,
    side_water, start_rates, transport_limits,
};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{D008, M005};
use crate::scenario::transport::Auto;
use crate::scenario::{self, Scenario};

/// A plan with what computes references and measures from its results, and warnings.
pub type Lowered = (Plan, Evaluation, Vec<Diagnostic>);

/// Lowers a scenario; what is refused is too large for a tape, or chemistry without a solution.
pub fn lower(scenario: &Scenario) -> Result<Lowered, Vec<Diagnostic>> {
    let mut problems = Vec::new();
    let evaluation = evaluation(scenario, &mut problems);
    if !problems.is_empty() {
        return Err(problems);
    }
    let n_axes = scenario.domain.axes.len();
    let bins = scenario.bins.as_ref().map_or_else(|| vec![1; n_axes], |bins| bins.value.clone());
    let axes: Vec<Axis> =
        scenario.domain.axes.iter().zip(bins).map(|(axis, bins)| lower_axis(axis, bins)).collect();
    let (decay, needs_kernels) = lower_decay::decay(scenario)?;
    let network = lower_chemistry::network(scenario, &axes)?;
    let (transport, told) = lower_transport::transport(scenario, &axes, &network, decay)?;
    let exchange = lower_exchange::exchange(scenario, &axes, transport.as_ref())?;
    let averaging = lower_exchange::averaging(scenario)?;
    let Network { species, components, chemistry, mut warnings, .. } = network;
    warnings.extend(told);
    let instant: Vec<InstantReaction> = scenario.reactions.iter().filter_map(lower_reaction).collect();
    let mut transport = transport;
    let reacts = needs_kernels && (chemistry.is_some() || !instant.is_empty());
    let kernels = kernels::lower(scenario, &axes, &mut transport, (reacts, chemistry.as_ref(), &instant));
    let extent: f64 = axes.iter().map(|axis| axis.high - axis.low).product();
    // A particle is a volume of water.
    let porosity = match &transport {
        Some(transport) if transport.is_of_fluid => shares::mean(&transport.porosity, &axes),
        _ => lower_transport::porosity_of_fluid(scenario),
    };
    let mut plan = Plan {
        numerics: NUMERICS_VERSION,
        walk: walk(scenario),
        particles: particles(scenario, extent * porosity),
        species,
        components,
        stages: stages(exchange.as_ref(), averaging.as_ref()),
        mixing: scenario.mixing.as_ref().map(|mixing| lower_mixing(mixing, averaging)),
        exchange,
        reactions: instant,
        chemistry,
        transport,
        kernels,
        time: Time::new(scenario.run.duration, scenario.run.step),
        outputs: scenario.outputs.iter().map(lower_output).collect(),
        writes_flow: scenario.flow_table.is_some(),
        seed: scenario.seed,
        axes,
    };
    if !plan.walk.drift.iter().chain(&plan.walk.spread).copied().all(f64::is_finite) {
        return Err(vec![unbounded_walk(scenario, &plan)]);
    }
    kernel_limits::refuse(scenario, &plan)?;
    plan.outputs.extend(kernels::shown(&plan));
    only_what_it_has(&mut plan);
    if let Some(auto) = scenario.run.auto {
        choose_step(scenario, &mut plan, auto)?;
    }
    if let Some(transport) = &plan.transport {
        let found = transport_limits::check(scenario, &plan.axes, transport);
        if !found.is_empty() {
            return Err(found);
        }
        warnings.extend(side_water::check(scenario, &plan));
        warnings.extend(medium_limits::check(scenario, &plan));
    }
    method::choose(&mut plan);
    if plan.reacts_in_steps() && !plan.carries_mass() {
        plan.stages.insert(1, Stage::React);
    }
    Ok((plan, evaluation, warnings))
}

/// A parcel is its share of the water.
fn particles(scenario: &Scenario, water: f64) -> Particles {
    let written = &scenario.particles;
    Particles {
        count: written.count,
        placement: written.placement,
        disorder: written.disorder,
        volume: water / written.count as f64,
    }
}

/// A step as a scene without passes takes it.
fn stages(exchange: Option<&Exchange>, averaging: Option<&Averaging>) -> Vec<Stage> {
    let mut stages = vec![Stage::Mix, Stage::Move, Stage::Bound];
    stages.extend(exchange.map(|_| Stage::Exchange));
    stages.extend(averaging.map(|_| Stage::KernelMean));
    stages.extend([Stage::Average, Stage::Observe]);
    stages
}

/// What particles of a kind do not have is not in their plan.
fn only_what_it_has(plan: &mut Plan) {
    if plan.carries_mass() {
        only_masses(plan);
    } else if plan.transport.is_some() {
        only_tracks(plan);
    }
}

/// Masses carry nothing beside their position, and walk by `transport` alone.
fn only_masses(plan: &mut Plan) {
    let reacts = plan.reacting().is_some();
    if !reacts {
        plan.components.clear();
        plan.species.iter_mut().for_each(|species| species.terms.clear());
        plan.chemistry = None;
    } else {
        kernels::retard(plan);
    }
    only_tracks(plan);
    let decays = plan.transport.as_ref().is_some_and(|transport| transport.decay.is_some());
    plan.stages = match (decays, reacts) {
        (true, _) => vec![Stage::React, Stage::Move, Stage::Observe],
        (false, true) => vec![Stage::Move, Stage::Estimate, Stage::React, Stage::Observe],
        (false, false) => vec![Stage::Move, Stage::Observe],
    };
    let populations = plan.transport.iter().flat_map(|transport| &transport.populations);
    plan.particles.count = populations.fold(0, |sum: u64, it| sum.saturating_add(it.count)).max(1);
}

/// What `transport` moves is not moved again, and meets its sides on the way.
fn only_tracks(plan: &mut Plan) {
    plan.walk.drift.fill(0.0);
    plan.walk.spread.fill(0.0);
    plan.stages.retain(|stage| *stage != Stage::Bound);
}

/// `step auto`: a step by the criteria, which the particles of a flow in cells divide further.
fn choose_step(scenario: &Scenario, plan: &mut Plan, auto: Auto) -> Result<(), Vec<Diagnostic>> {
    let duration = scenario.run.duration;
    let exchanged = plan.exchange.as_ref().map_or(0.0, |exchange| {
        (0..plan.axes.len()).map(|axis| exchange.largest_along(plan, axis)).fold(0.0, f64::max)
    });
    let chosen = match &plan.transport {
        Some(transport) => {
            auto_step::of_masses(&plan.axes, &plan.outputs, transport, auto, (duration, exchanged))
        }
        None => auto_step::of_fluid(plan, auto, duration),
    };
    let chosen = slow_enough(plan, chosen, auto, duration);
    let n_steps = duration / chosen.step;
    if n_steps > scenario::MAX_STEPS {
        let message = Diagnostic::error(M005, "the run would have too many steps")
            .at(scenario.run.step_span, format!("{n_steps:.3e} steps by these criteria"))
            .found(format!("{n_steps:.3e} steps"))
            .expected("at most 1e12")
            .help("use larger bins or cells, or a `step` of your own");
        return Err(vec![message]);
    }
    plan.time = Time::new(duration, chosen.step);
    if let Some(transport) = &mut plan.transport {
        transport.sub_steps = chosen.sub_steps;
    }
    Ok(())
}

/// The bound of reactions in a step of a scene whose particles react by kernels: transport and they take turns.
const REACTION: f64 = 0.1;

/// A step in which nothing reacts by more than the criterion says.
fn slow_enough(plan: &Plan, chosen: auto_step::Chosen, auto: Auto, duration: f64) -> auto_step::Chosen {
    let usual = plan.reacting().map(|_| REACTION);
    let Some(bound) = auto.reaction.or(usual) else { return chosen };
    let Some(rates) = start_rates::start_rates(plan) else { return chosen };
    let rates = if plan.reacting() == Some(Reacting::Pairs) { rates.losses } else { rates.speeds };
    let fastest = rates.into_iter().fold(0.0, f64::max);
    if fastest * chosen.step <= bound {
        return chosen;
    }
    let step = auto_step::whole(bound / fastest, duration);
    let step = auto_step::fitting(&plan.outputs, step, duration).unwrap_or(step);
    auto_step::Chosen { step, ..chosen }
}

/// Numbers that can be written may have a difference or a product that is none.
fn unbounded_walk(scenario: &Scenario, plan: &Plan) -> Diagnostic {
    let is_drift = !plan.walk.drift.iter().copied().all(f64::is_finite);
    let written = |span: Option<crate::source::Span>| span.unwrap_or(scenario.domain.span);
    let (what, place) = if is_drift {
        ("the velocity in the frame", written(scenario.flow.as_ref().map(|flow| flow.span)))
    } else {
        ("the dispersion", written(scenario.dispersion.as_ref().map(|tensor| tensor.span)))
    };
    Diagnostic::error(M005, format!("{what} is out of range"))
        .at(place, "too large for a displacement")
        .found("an infinite displacement")
        .expected("a size that numbers can hold")
}

fn lower_axis(axis: &scenario::Axis, bins: usize) -> Axis {
    Axis {
        index: axis.index,
        low: axis.low,
        high: axis.high,
        low_side: axis.low_side,
        high_side: axis.high_side,
        bins,
    }
}

/// Drift in the frame and the Cholesky factor of 2 D over the axes of the domain.
fn walk(scenario: &Scenario) -> Walk {
    let (velocity, tensor) = of_fluid(scenario);
    // What is exchanged does not walk.
    let part = lower_exchange::walking_part(scenario);
    let indices: Vec<usize> = scenario.domain.axes.iter().map(|axis| axis.index).collect();
    let drift = indices.iter().map(|&index| velocity[index] - scenario.domain.frame[index]).collect();
    let doubled: Vec<Vec<f64>> = indices
        .iter()
        .map(|&row| indices.iter().map(|&column| 2.0 * (part * tensor[row][column])).collect())
        .collect();
    let normals = if scenario.run.are_normals_double { Normals::Double } else { Normals::Single };
    Walk { drift, spread: cholesky(&doubled), normals }
}

/// Lower triangle L, row by row, with L Lᵀ = A for a symmetric positive semi-definite A.
///
/// - Equation: `l_ij = (a_ij − Σ_{k<j} l_ik l_jk) / l_jj`, `l_ii = √(a_ii − Σ_{k<i} l_ik²)`.
/// - Symbols: A = 2 D over the active axes.
/// - Dimensions and range: m²/s to m/√s; a vanishing pivot gives a zero column.
/// - Source: G. H. Golub, C. F. Van Loan, Matrix Computations, section 4.2.
/// - Shape: n × n to n(n+1)/2 entries.
pub(super) fn cholesky(a: &[Vec<f64>]) -> Vec<f64> {
    let n = a.len();
    let mut l = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in 0..=i {
            let rest = a[i][j] - (0..j).map(|k| l[i][k] * l[j][k]).sum::<f64>();
            l[i][j] = if i == j {
                // Rounding may leave a tiny negative pivot of a singular tensor.
                if rest > 1e-14 * a[i][i] { rest.sqrt() } else { 0.0 }
            } else if l[j][j] > 0.0 {
                rest / l[j][j]
            } else {
                0.0
            };
        }
    }
    (0..n).flat_map(|i| l[i][..=i].to_vec()).collect()
}

pub(super) fn too_large(span: crate::source::Span) -> Diagnostic {
    Diagnostic::error(D008, "this expression is too large")
        .at(span, "more than 65,000 operations")
        .found("more than 65,000 operations")
        .expected("a smaller expression")
}

fn lower_mixing(mixing: &scenario::Mixing, averaging: Option<Averaging>) -> Mixing {
    let zone = |zone: &scenario::Zone| Zone {
        name: zone.name.clone(),
        fraction: zone.fraction,
        rate: zone.rate.map_or(ZoneRate::Instant, ZoneRate::Finite),
        is_stored: true,
    };
    Mixing {
        zones: mixing.zones.iter().map(zone).collect(),
        is_well_mixed: mixing.zones.iter().all(|zone| zone.rate.is_none()),
        averaging,
    }
}

fn lower_reaction(reaction: &scenario::Reaction) -> Option<InstantReaction> {
    (reaction.rate == scenario::Rate::Instant).then(|| InstantReaction {
        name: reaction.name.clone(),
        reactants: reaction.reactants.clone(),
        products: reaction.products.clone(),
    })
}

fn lower_output(output: &scenario::Output) -> Output {
    let quantities = if output.kind.is_of_pairs() {
        output.pairs.iter().map(|&(a, b)| Quantity::Pair(a, b)).collect()
    } else {
        output.species.iter().map(|&species| Quantity::Species(species)).collect()
    };
    Output {
        kind: output.kind,
        quantities,
        bins: output.bins.clone(),
        times: output.times.clone(),
        unit: output.unit.as_ref().map(|(text, factor)| OutputUnit { text: text.clone(), factor: *factor }),
        station: output.station.clone(),
    }
}

fn evaluation(scenario: &Scenario, problems: &mut Vec<Diagnostic>) -> Evaluation {
    let mut references = Vec::new();
    for reference in &scenario.references {
        let solution = match &reference.solution {
            scenario::Solution::Catalogue { name, arguments } => {
                evaluation::Solution::Catalogue { name: (*name).to_owned(), arguments: arguments.clone() }
            }
            scenario::Solution::Expression(expr) => match build_reference(expr, &scenario.species) {
                Some(tape) => evaluation::Solution::Expression(tape),
                None => {
                    problems.push(too_large(reference.span));
                    continue;
                }
            },
        };
        let target = match reference.target {
            scenario::Target::Concentration(a) | scenario::Target::Course(_, a, _) => Quantity::Species(a),
            scenario::Target::Covariance(a, b) | scenario::Target::Mixing(a, b) => Quantity::Pair(a, b),
        };
        let outputs = reference.target.outputs().to_vec();
        let (name, number) = (reference.name.clone(), reference.target.number());
        references.push(evaluation::Reference { name, outputs, target, number, solution });
    }
    let measures = scenario.measures.iter().map(lower_measure).collect();
    Evaluation { references, measures }
}

fn lower_measure(measure: &scenario::Measure) -> evaluation::Measure {
    evaluation::Measure {
        name: measure.name.clone(),
        value: lower_scalar(&measure.value),
        over: measure.over,
        times: measure.times.clone(),
        unit: measure.dimension.unit_text(),
        doc: measure.doc.clone(),
    }
}

fn lower_scalar(scalar: &scenario::Scalar) -> evaluation::Scalar {
    use evaluation::Scalar as To;
    use scenario::Scalar as From;
    match scalar {
        From::Number(value) => To::Number(*value),
        From::Fact(fact) => To::Fact(*fact),
        From::Measure(idx) => To::Measure(*idx),
        From::Norm(norm, output_idx, field) => To::Norm(*norm, *output_idx, Box::new(lower_field(field))),
        From::Unary(operator, a) => To::Unary(*operator, Box::new(lower_scalar(a))),
        From::Binary(operator, a, b) => {
            To::Binary(*operator, Box::new(lower_scalar(a)), Box::new(lower_scalar(b)))
        }
    }
}

fn lower_field(field: &scenario::Field) -> evaluation::Field {
    use evaluation::Field as To;
    use scenario::Field as From;
    match field {
        From::Number(value) => To::Number(*value),
        From::Position(index) => To::Position(*index),
        From::Output(kind, target, number) => {
            let quantity = match *target {
                scenario::FieldTarget::Species(a) => Quantity::Species(a),
                scenario::FieldTarget::Pair(a, b) => Quantity::Pair(a, b),
            };
            if *number == 0 { To::Output(*kind, quantity) } else { To::Column(*kind, quantity, *number) }
        }
        From::Reference(idx) => To::Reference(*idx),
        From::Unary(operator, a) => To::Unary(*operator, Box::new(lower_field(a))),
        From::Binary(operator, a, b) => {
            To::Binary(*operator, Box::new(lower_field(a)), Box::new(lower_field(b)))
        }
    }
}

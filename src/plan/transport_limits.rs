//! What can be seen of flow, porosity and conductivity before anything is solved.
//!
//! Owns the looks at sample points and their messages. May use `scenario` for the places. It deliberately
//! refuses only what is wrong at a place that it can name.

use super::Axis;
use super::build_tape::build_tape;
use super::in_time::{is_timed, switches};
use super::limits::short;
use super::shares::places;
use super::tape::Tape;
use super::tape::dual::differentiate;
use super::transport::{Conductivity, Flow, Transport};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{M005, M029, M031};
use crate::scenario::Scenario;
use crate::scenario::expression::Expr;
use crate::scenario::transport as written;
use crate::source::Span;

/// Largest divergence times extent over the largest discharge.
const LARGEST_DIVERGENCE: f64 = 1e-6;
/// Times at which what enters is looked at, beside those between its switches.
const TIMES: usize = 64;

/// Everything that is wrong with the fields of a scene with masses.
pub(super) fn check(scenario: &Scenario, axes: &[Axis], transport: &Transport) -> Vec<Diagnostic> {
    let mut problems = amounts(scenario, axes);
    if let Some(medium) = &scenario.medium {
        let is_right = |value: f64| value > 0.0 && value <= 1.0;
        let rule = "above 0, at most 1";
        problems.extend(outside(
            axes,
            &transport.porosity,
            "the porosity",
            "",
            medium.value.span,
            is_right,
            rule,
        ));
    }
    let flow = scenario.flow.as_ref().map(|flow| (&flow.value, flow.span));
    match (&transport.flow, flow) {
        (Flow::Uniform(_) | Flow::Expression(_), Some((_, span))) => {
            let of = |flow: &Flow| match flow {
                Flow::Expression(tapes) => divergence(axes, tapes, &transport.porosity, span),
                _ => None,
            };
            problems.extend(transport.flows().iter().find_map(of));
        }
        (Flow::Darcy(darcy), Some((written::Flow::Darcy(own), _))) => {
            if let Conductivity::Expression(tape) = &darcy.conductivity {
                let is_right = |value: f64| value > 0.0 && value.is_finite();
                let span = own.conductivity_span;
                problems.extend(outside(
                    axes,
                    tape,
                    "the conductivity",
                    " m/s",
                    span,
                    is_right,
                    "above zero",
                ));
            }
            problems.extend(idle(own, &transport.flows()));
        }
        _ => {}
    }
    problems
}

/// Wells whose water carries something, and which never put any in.
fn idle(written: &written::Darcy, flows: &[Flow]) -> Vec<Diagnostic> {
    let gives = |idx: usize| {
        let rate = |flow: &Flow| match flow {
            Flow::Darcy(darcy) => darcy.wells.get(idx).map_or(0.0, |well| well.rate),
            _ => 0.0,
        };
        flows.iter().map(rate).any(|rate| rate > 0.0)
    };
    let told = |(idx, well): (usize, &written::Well)| {
        let (_, carried) = well.carrying.first().filter(|_| !gives(idx))?;
        let message =
            Diagnostic::error(M031, format!("well `{}` carries something and puts no water in", well.name))
                .at(carried.span, "what its water carries")
                .also(well.rate.span, "zero or below at all times: water is taken out, with what is in it")
                .found("a rate that is never above zero")
                .expected("a rate above zero at some time, or nothing carried")
                .help("leave `carrying` out, or turn the sign of the rate round");
        Some(message)
    };
    written.wells.iter().enumerate().filter_map(told).collect()
}

/// Concentrations and rates that enter and are below zero at some place or time.
fn amounts(scenario: &Scenario, axes: &[Axis]) -> Vec<Diagnostic> {
    let mut list: Vec<(&Expr, String)> = Vec::new();
    let name = |species: usize| scenario.species.get(species).map_or("", |species| species.name.as_str());
    for patch in scenario.domain.axes.iter().flat_map(|axis| axis.patches.iter().flatten()) {
        if let written::SideRule::Inflow(own) | written::SideRule::Held(own) = &patch.rule {
            list.extend(
                own.iter().map(|(species, c)| (c, format!("the concentration of `{}`", name(*species)))),
            );
        }
    }
    for source in &scenario.sources {
        if let written::Strength::Rate(value) | written::Strength::Held(value) = &source.strength {
            list.push((value, format!("what source `{}` gives", source.name)));
        }
    }
    if let Some(written::Flow::Darcy(darcy)) = scenario.flow.as_ref().map(|flow| &flow.value) {
        for well in &darcy.wells {
            list.extend(well.carrying.iter().map(|(_, c)| (c, format!("what well `{}` carries", well.name))));
        }
    }
    let is_new = |(expr, _): &(&Expr, String)| expr.value().is_none();
    list.into_iter()
        .filter(is_new)
        .filter_map(|(expr, what)| below_zero(scenario, axes, expr, &what))
        .collect()
}

fn below_zero(scenario: &Scenario, axes: &[Axis], expr: &Expr, what: &str) -> Option<Diagnostic> {
    let tape = build_tape(expr, &scenario.species)?;
    let duration = scenario.run.duration;
    let middle = |axis: &Axis| (axis.index, 0.5 * (axis.low + axis.high));
    let mut place = [0.0; 3];
    axes.iter().map(middle).for_each(|(index, x)| place[index] = x);
    let mut edges = switches(&tape, place, 0.0, duration);
    edges.truncate(TIMES);
    edges.extend((0..=TIMES).map(|k| duration * k as f64 / TIMES as f64));
    edges.sort_by(f64::total_cmp);
    let times: Vec<f64> = match is_timed(&tape) {
        true => edges.windows(2).map(|pair| 0.5 * (pair[0] + pair[1])).collect(),
        false => vec![0.0],
    };
    for t in times {
        let mut all = places(axes, usize::MAX);
        all.iter_mut().for_each(|place| place[3] = t);
        let is_wrong = |place: &&[f64; 4]| {
            let value = tape.evaluate(&place[..]);
            !(value >= 0.0 && value.is_finite())
        };
        let Some(place) = all.iter().find(is_wrong) else { continue };
        let found =
            format!("{} (SI) at {}, t = {} s", short(tape.evaluate(place)), shown(axes, place), short(t));
        let message = Diagnostic::error(M005, format!("{what} is out of range"))
            .at(expr.span, format!("this is {found}"))
            .found(found)
            .expected("zero or more at all places and times");
        return Some(message);
    }
    None
}

fn outside(
    axes: &[Axis],
    tape: &Tape,
    what: &str,
    unit: &str,
    span: Span,
    is_right: impl Fn(f64) -> bool,
    rule: &str,
) -> Option<Diagnostic> {
    let all = places(axes, tape.operations.len());
    let (place, value) =
        all.iter().map(|place| (place, tape.evaluate(place))).find(|(_, value)| !is_right(*value))?;
    let message = Diagnostic::error(M005, format!("{what} is out of range"))
        .at(span, format!("{}{unit} at {}", short(value), shown(axes, place)))
        .found(format!("{}{unit} at {}", short(value), shown(axes, place)))
        .expected(rule);
    Some(message)
}

fn shown(axes: &[Axis], place: &[f64; 4]) -> String {
    let of = |axis: &Axis| format!("{} = {} m", ["x", "y", "z"][axis.index], short(place[axis.index]));
    axes.iter().map(of).collect::<Vec<_>>().join(", ")
}

/// Water that appears or vanishes in a flow given by expressions.
///
/// - Equation: `∇·(φv) = Σ_i ∂(φ v_i)/∂x_i`, by derivatives of the expressions, against `max |φv| / L`.
/// - Symbols: φ porosity, `v` velocity, `L` longest extent.
/// - Range: sample points in the middles of equal parts of the domain; jumps between them are not seen.
/// - Source: conservation of water of constant density.
/// - Shape: the worst place, if it is beyond `LARGEST_DIVERGENCE`.
fn divergence(axes: &[Axis], tapes: &[Tape], porosity: &Tape, span: Span) -> Option<Diagnostic> {
    let n_operations = tapes.iter().chain([porosity]).map(|tape| tape.operations.len()).max()?;
    let longest = axes.iter().map(|axis| axis.high - axis.low).fold(0.0, f64::max);
    let mut largest: f64 = 0.0;
    let mut worst: Option<([f64; 4], f64)> = None;
    let slope_along = |slopes: &[(usize, f64)], index: usize| {
        slopes.iter().find(|(input, _)| *input == index).map_or(0.0, |(_, slope)| *slope)
    };
    for place in places(axes, n_operations) {
        let (values, slopes) = differentiate(&porosity.operations, &place, 0, 3);
        let (phi, of_phi) = (values.last()?, slopes.last()?);
        let mut sum = 0.0;
        let mut square = 0.0;
        for (axis, tape) in axes.iter().zip(tapes) {
            let (values, slopes) = differentiate(&tape.operations, &place, 0, 3);
            let (v, of_v) = (values.last()?, slopes.last()?);
            sum += phi * slope_along(of_v, axis.index) + v * slope_along(of_phi, axis.index);
            square += (phi * v) * (phi * v);
        }
        if !square.is_finite() {
            let message = Diagnostic::error(M005, "the velocity is out of range")
                .at(span, format!("no finite number at {}", shown(axes, &place)))
                .found(format!("no finite number at {}", shown(axes, &place)))
                .expected("a finite velocity everywhere in the domain");
            return Some(message);
        }
        largest = largest.max(square.sqrt());
        if worst.is_none_or(|(_, before)| sum.abs() > before.abs()) {
            worst = Some((place, sum));
        }
    }
    let (place, value) = worst?;
    if value.abs() * longest <= LARGEST_DIVERGENCE * largest {
        return None;
    }
    let at = shown(axes, &place);
    let what = if value > 0.0 { "water appears" } else { "water vanishes" };
    let message = Diagnostic::error(M029, "this flow does not keep its water")
        .at(span, format!("{what} at {at}"))
        .found(format!("a divergence of {} /s at {at}", short(value)))
        .expected(format!(
            "a divergence of porosity times velocity below {} /s, 1e-6 of the largest discharge over the extent",
            short(LARGEST_DIVERGENCE * largest / longest)
        ))
        .help("velocities from a stream function, u = dψ/dy and v = -dψ/dx over the porosity, have none");
    Some(message)
}

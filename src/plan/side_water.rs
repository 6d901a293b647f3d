//! Sides of the domain whose rule and water do not agree, as far as it is known before a flow is solved for.
//!
//! Owns these messages (N111). May use `scenario` for the places. It deliberately refuses nothing: masses have a meaning
//! at such sides, though rarely the one that is meant, and clean water may come in anywhere; parcels of water have none
//! there, which stops their run (R108).

use super::Axis;
use super::Plan;
use super::limits::short;
use super::tape::Tape;
use super::transport::{Darcy, DarcySide, Flow};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::N111;
use crate::scenario::Scenario;
use crate::scenario::transport::{Patch, SideRule};

/// Water through a side that counts as none, over the largest discharge times its area.
pub const NONE: f64 = 1e-6;
/// Points along each axis of a side at which expressions are looked at, with one and with two other axes.
const POINTS: [usize; 2] = [256, 24];

/// Water through a patch over all periods, as shares of the largest discharge times its area; what is not known of a
/// direction is absent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Through {
    pub inwards: Option<f64>,
    pub outwards: Option<f64>,
}

/// Every patch whose rule says another thing than the flow.
pub(super) fn check(scenario: &Scenario, plan: &Plan) -> Vec<Diagnostic> {
    let Some(transport) = &plan.transport else { return Vec::new() };
    let flows = transport.flows();
    let mut found = Vec::new();
    for side in 0..2 * plan.axes.len() {
        let [axis, end] = [side / 2, side % 2];
        for (idx, patch) in scenario.domain.axes[axis].patches[end].iter().enumerate() {
            let through = match &transport.flow {
                Flow::Uniform(_) | Flow::Expression(_) => given(plan, &flows, side, idx),
                Flow::Darcy(_) => solved(&flows, side),
                // Whoever reads the files looks at their faces.
                Flow::File(_) => continue,
            };
            found.extend(message(patch, plan.side_name(side), through, plan.carries_mass()));
        }
    }
    found
}

/// What is to be said of a patch.
pub fn message(patch: &Patch, name: &str, through: Through, is_of_mass: bool) -> Option<Diagnostic> {
    let is_some = |share: Option<f64>| share.filter(|share| *share > NONE);
    let (inwards, outwards) = (is_some(through.inwards), is_some(through.outwards));
    let told = |share: f64, way: &str| match share.is_finite() {
        true => format!("water that {way}: {} % of the largest discharge", short(100.0 * share)),
        false => format!("water that {way}"),
    };
    match &patch.rule {
        SideRule::Inflow(_) if through.inwards.is_some() && inwards.is_none() => {
            let message = Diagnostic::warning(N111, format!("no water comes in through side `{name}`"))
                .at(patch.span, "what this side lets in comes with the water")
                .expected("water that comes in");
            Some(match outwards {
                Some(share) => message
                    .found(told(share, "goes out"))
                    .help(format!("write `boundary {name} outflow`, or turn the flow round")),
                None => message.found("no water at all").help(
                    "let the flow have a head or a flux there; from MODFLOW name the package of this side in the braces",
                ),
            })
        }
        SideRule::Reflect | SideRule::Partial(_) if is_of_mass => outwards.map(|share| {
            let does = if patch.rule == SideRule::Reflect { "reflects" } else { "absorbs at a rate" };
            Diagnostic::warning(N111, format!("water goes out through side `{name}`, which {does}"))
                .at(patch.span, "mass stays behind and gathers here")
                .found(told(share, "goes out"))
                .expected("no water out of it, or a side that mass leaves through")
                .help(format!("`boundary {name} outflow` lets mass go with the water"))
        }),
        _ => None,
    }
}

/// Water of flows that are numbers or formulas, at points of the side.
fn given(plan: &Plan, flows: &[Flow], side: usize, idx: usize) -> Through {
    let [axis, end] = [side / 2, side % 2];
    let sign = if end == 0 { 1.0 } else { -1.0 };
    let Some(transport) = &plan.transport else { return Through { inwards: None, outwards: None } };
    let holds = |patch: &super::transport::Patch, place: &[f64; 4]| {
        plan.axes.iter().enumerate().all(|(own, of)| {
            own == axis || (patch.low[own] <= place[of.index] && place[of.index] <= patch.high[own])
        })
    };
    let patches = &transport.sides[axis][end];
    let at = if end == 0 { plan.axes[axis].low } else { plan.axes[axis].high };
    let mut points = across(&plan.axes, axis, at);
    // The first patch that holds a place decides.
    points.retain(|place| patches.iter().position(|patch| holds(patch, place)) == Some(idx));
    let (mut inwards, mut outwards, mut largest) = (0.0_f64, 0.0_f64, 0.0_f64);
    for flow in flows {
        let velocity = |axis: usize, place: &[f64; 4]| match flow {
            Flow::Uniform(all) => all[axis],
            Flow::Expression(tapes) => tapes[axis].evaluate(place),
            Flow::Darcy(_) | Flow::File(_) => 0.0,
        };
        let (mut own_in, mut own_out) = (0.0, 0.0);
        for place in &points {
            let q = sign * velocity(axis, place) * transport.porosity.evaluate(place);
            own_in += q.max(0.0);
            own_out += (-q).max(0.0);
        }
        inwards = inwards.max(own_in / points.len().max(1) as f64);
        outwards = outwards.max(own_out / points.len().max(1) as f64);
        largest = largest.max(fastest(plan, &transport.porosity, velocity));
    }
    if points.is_empty() || !(inwards + outwards).is_finite() {
        return Through { inwards: None, outwards: None };
    }
    let share = |water: f64| Some(if largest > 0.0 { water / largest } else { 0.0 });
    Through { inwards: share(inwards), outwards: share(outwards) }
}

/// Largest discharge along an axis at points of the domain.
fn fastest(plan: &Plan, porosity: &Tape, velocity: impl Fn(usize, &[f64; 4]) -> f64) -> f64 {
    let places = super::shares::places(&plan.axes, usize::MAX);
    let at = |place: &[f64; 4]| {
        let phi = porosity.evaluate(place);
        (0..plan.axes.len()).map(|axis| (phi * velocity(axis, place)).abs()).fold(0.0, f64::max)
    };
    places.iter().map(at).filter(|q| q.is_finite()).fold(0.0, f64::max)
}

/// Middles of equal parts of a side.
fn across(axes: &[Axis], normal: usize, at: f64) -> Vec<[f64; 4]> {
    let n = POINTS[axes.len().clamp(2, 3) - 2];
    let mut first = [0.0; 4];
    first[axes[normal].index] = at;
    let mut list = vec![first];
    for axis in axes.iter().enumerate().filter(|(own, _)| *own != normal).map(|(_, axis)| axis) {
        let middle = |idx: usize| axis.low + (axis.high - axis.low) * (idx as f64 + 0.5) / n as f64;
        let mut wider = Vec::with_capacity(list.len() * n);
        for place in &list {
            for idx in 0..n {
                let mut place = *place;
                place[axis.index] = middle(idx);
                wider.push(place);
            }
        }
        list = wider;
    }
    list
}

/// What is sure of a flow that is still to be solved for: the sign of a flux, that water flows out where the head is
/// nowhere lower and nothing else takes any, and in where it is nowhere higher and nothing else gives any.
///
/// - Equation: a solution of `∇·(K∇h) = 0` takes its least and largest values at its sides.
/// - Symbols: `h` head, `K` conductivity.
/// - Range: any conductivity; wells are sinks and sources inside.
/// - Source: maximum principle of elliptic equations.
/// - Shape: shares, infinite where water flows and nobody knows how much.
fn solved(flows: &[Flow], side: usize) -> Through {
    let mut all = Through { inwards: Some(0.0), outwards: Some(0.0) };
    let larger = |a: Option<f64>, b: Option<f64>| a.zip(b).map(|(a, b)| a.max(b));
    for flow in flows {
        let Flow::Darcy(darcy) = flow else { continue };
        let own = one_solution(darcy, side);
        all = Through {
            inwards: larger(all.inwards, own.inwards),
            outwards: larger(all.outwards, own.outwards),
        };
    }
    all
}

fn one_solution(darcy: &Darcy, side: usize) -> Through {
    let some = |is_there: bool| Some(if is_there { f64::INFINITY } else { 0.0 });
    let sides = || darcy.sides.iter().flatten();
    let head = match darcy.sides[side / 2][side % 2] {
        DarcySide::NoFlow | DarcySide::Periodic => {
            return Through { inwards: some(false), outwards: some(false) };
        }
        DarcySide::Flux(q) => return Through { inwards: some(q > 0.0), outwards: some(q < 0.0) },
        DarcySide::Head(head) => head,
    };
    let heads = || sides().filter_map(|side| if let DarcySide::Head(h) = side { Some(*h) } else { None });
    let fluxes = || sides().filter_map(|side| if let DarcySide::Flux(q) = side { Some(*q) } else { None });
    let given = || fluxes().chain(darcy.wells.iter().map(|well| well.rate));
    let (takes, gives) = (given().any(|rate| rate < 0.0), given().any(|rate| rate > 0.0));
    let is_lowest = !takes && heads().all(|other| other >= head);
    let is_highest = !gives && heads().all(|other| other <= head);
    let moves = takes || gives || heads().any(|other| other != head);
    match (is_lowest, is_highest) {
        _ if !moves => Through { inwards: some(false), outwards: some(false) },
        (true, _) => Through { inwards: some(false), outwards: some(true) },
        (_, true) => Through { inwards: some(true), outwards: some(false) },
        _ => Through { inwards: None, outwards: None },
    }
}

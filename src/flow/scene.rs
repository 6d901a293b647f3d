//! Files of a scene's flow: read before its plan is made, and what is wrong with them.
//!
//! Owns these messages. May use the scenario and the readers. It deliberately refuses no flow for its balance: it tells
//! how much is missing.

use super::files::Trouble;
use super::read::window::Extent;
use super::store::Flows;
use super::{FaceFlow, FlowSeries};
use crate::diagnostic::codes::{M005, M026, M033, N205};
use crate::diagnostic::{Diagnostic, number};
use crate::plan::build_tape::build_tape;
use crate::plan::side_water::{self, Through};
use crate::plan::tape::{Operation, Tape};
use crate::plan::transport::FlowFacts;
use crate::scenario::transport::{FileFlow, Flow, Patch, side_names};
use crate::scenario::{Domain, Output, Particles, Scenario, Station};
use crate::source::{Sources, Span};

/// Divergence in a cell, relative to mean discharge over cell size, above which concentrations show it.
const LARGEST_DIVERGENCE: f64 = 1e-2;

/// Reads the files of a scenario's flow, if it has some, and tells the scenario what is in them.
pub fn attach(scenario: &mut Scenario, sources: &Sources, flows: &Flows) -> Vec<Diagnostic> {
    let axes: Vec<Extent> =
        scenario.domain.axes.iter().map(|axis| (axis.index, axis.low, axis.high)).collect();
    let has_z = axes.iter().any(|(index, ..)| *index == 2);
    let porosity = match &scenario.medium {
        None => Some(Tape { operations: vec![Operation::Constant(1.0)] }),
        Some(porosity) => build_tape(&porosity.value, &scenario.species),
    };
    let Some(flow) = &mut scenario.flow else { return Vec::new() };
    let span = flow.span;
    // An expression that is too large for a tape is told by the plan.
    let (Flow::File(own), Some(porosity)) = (&mut flow.value, porosity) else { return Vec::new() };
    match flows.read(&own.file, &axes, &porosity, sources) {
        Err(trouble) => vec![refusal(own, &trouble)],
        Ok(loaded) => {
            own.facts = Some(loaded.facts.clone());
            let changes = changing(&scenario.particles, &loaded.facts, span);
            let outputs = scenario.outputs.iter().filter_map(|output| unknown_outlet(output, &loaded.facts));
            let packages = super::packages::check(own, &loaded.packages, has_z);
            // A name that is wrong tells why a side has no water.
            let sides = match packages.iter().any(Diagnostic::is_fatal) {
                true => Vec::new(),
                false => sides(&scenario.domain, &loaded.flows, scenario.particles.shares.is_some()),
            };
            let all = warning(&loaded.facts, span).into_iter().chain(changes).chain(outputs);
            all.chain(packages).chain(sides).collect()
        }
    }
}

/// Parcels of water in a flow that changes.
fn changing(particles: &Particles, facts: &FlowFacts, span: Span) -> Option<Diagnostic> {
    if particles.shares.is_some() || facts.changes.is_empty() {
        return None;
    }
    let message = Diagnostic::error(M026, "fluid particles have no flow that changes in time")
        .at(span, "not with particles of fluid")
        .also(particles.kind_span, "particles of fluid")
        .found(format!("{} flows one after another", facts.changes.len() + 1))
        .expected("what parcels of water can do")
        .help("write `particles mass` and a number, or save the budget of one time step");
    Some(message)
}

/// An output at a well that the files do not have.
fn unknown_outlet(output: &Output, facts: &FlowFacts) -> Option<Diagnostic> {
    let Some(Station::Well(name)) = &output.station else { return None };
    if facts.outlets.iter().any(|outlet| outlet.name == *name) {
        return None;
    }
    let names: Vec<String> = facts.outlets.iter().map(|outlet| format!("`{}`", outlet.name)).collect();
    let expected =
        if names.is_empty() { "another place: nothing takes water out".to_owned() } else { names.join(", ") };
    let message = Diagnostic::error(M005, format!("the flow has no `{name}` that takes water out"))
        .at(output.span, "what leaves with the water of a well is counted")
        .found(format!("`{name}`"))
        .expected(expected);
    Some(message)
}

/// Sides whose rule and water do not agree.
fn sides(domain: &Domain, flows: &FlowSeries, is_of_mass: bool) -> Vec<Diagnostic> {
    let all: Vec<&FaceFlow> = flows.periods().iter().map(|period| &*period.flow).collect();
    let largest = |flow: &&FaceFlow| flow.flux.iter().flatten().fold(0.0, |max: f64, q| max.max(q.abs()));
    let largest = all.iter().map(largest).fold(0.0, f64::max);
    let indices: Vec<usize> = domain.axes.iter().map(|axis| axis.index).collect();
    let mut found = Vec::new();
    for axis in &domain.axes {
        let names = side_names(axis.index, &indices)[0];
        for (end, patches) in axis.patches.iter().enumerate() {
            for (idx, patch) in patches.iter().enumerate() {
                let water = all.iter().map(|flow| through(flow, [axis.index, end], patches, idx));
                let most = |a: [f64; 3], b: [f64; 3]| [a[0].max(b[0]), a[1].max(b[1]), b[2]];
                let [inwards, outwards, area] = water.fold([0.0; 3], most);
                let share = |water: f64| if largest > 0.0 { water / (largest * area) } else { 0.0 };
                let through = Through { inwards: Some(share(inwards)), outwards: Some(share(outwards)) };
                if area > 0.0 {
                    found.extend(side_water::message(patch, names[end], through, is_of_mass));
                }
            }
        }
    }
    found
}

/// Water in and out through the faces whose middles lie in a patch, m³/s, and their area, m².
fn through(flow: &FaceFlow, [axis, end]: [usize; 2], patches: &[Patch], idx: usize) -> [f64; 3] {
    let (edges, n) = (flow.cells.edges(), flow.cells.n());
    let middle =
        |axis: usize, place: [usize; 3]| 0.5 * (edges[axis][place[axis]] + edges[axis][place[axis] + 1]);
    let holds = |patch: &Patch, place: [usize; 3]| {
        patch.limits.iter().all(|&(other, low, high)| (low..=high).contains(&middle(other, place)))
    };
    let layer = if end == 0 { 0 } else { n[axis] - 1 };
    let mut sums = [0.0; 3];
    for cell in 0..flow.cells.n_cells() {
        let place = flow.cells.place(cell);
        if place[axis] != layer || patches.iter().position(|patch| holds(patch, place)) != Some(idx) {
            continue;
        }
        let (low, high) = flow.cells.faces(axis, place);
        let area = flow.cells.face_area(axis, place);
        let inwards = if end == 0 { flow.flux[axis][low] } else { -flow.flux[axis][high] };
        sums[0] += area * inwards.max(0.0);
        sums[1] += area * (-inwards).max(0.0);
        sums[2] += area;
    }
    sums
}

fn refusal(flow: &FileFlow, trouble: &Trouble) -> Diagnostic {
    let name = flow.file.files.get(trouble.file).map_or("", |file| file.name.as_str());
    let span = flow.spans.get(trouble.file).copied().unwrap_or_default();
    let error = &trouble.error;
    let place = error.place.as_ref().map(|place| format!("{place} of ")).unwrap_or_default();
    let message = Diagnostic::error(M033, format!("the flow cannot be read: {}", error.message))
        .at(span, format!("in {place}\"{name}\""))
        .found(error.message.clone())
        .expected("a file that holds the flow of this domain");
    match &error.help {
        Some(help) => message.help(help.clone()),
        None => message,
    }
}

fn warning(facts: &FlowFacts, span: Span) -> Option<Diagnostic> {
    let [worst, typical] = facts.divergence;
    if worst <= LARGEST_DIVERGENCE {
        return None;
    }
    let message = Diagnostic::warning(N205, "the flow of these files does not keep its water")
        .at(span, format!("in one cell {} of what crosses such a cell appears or vanishes", number(worst)))
        .found(format!("a relative divergence of {}, root mean square {}", number(worst), number(typical)))
        .expected(format!("at most {LARGEST_DIVERGENCE} in every cell"))
        .help("particles gather where water vanishes; discharge through faces keeps its balance, means of cells do not");
    Some(message)
}

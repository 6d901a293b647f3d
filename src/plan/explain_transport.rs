//! The transport of a plan in words.
//!
//! Owns these lines. May use the plan. It deliberately works nothing out.

use super::Plan;
use super::explain::grouped;
use super::in_time::is_timed;
use super::tape::{Operation, Tape};
use super::transport::{
    Change, Changed, Conductivity, Covariance, Darcy, DarcySide, Dispersion, FileFlow, Flow, Patch, Region,
    SideRule, Source, Strength, Transport,
};
use crate::diagnostic::number;

/// Flows one after another that are shown.
const SHOWN: usize = 12;

/// Flow, dispersion, sides, sources, populations and sub-steps; nothing for a walk of fluid.
pub(super) fn lines(plan: &Plan) -> Vec<String> {
    let Some(transport) = &plan.transport else { return Vec::new() };
    let mut lines = flow_lines(plan, &transport.flow);
    let changes = &transport.changes;
    // The first and the last ones show a rule; ten thousand lines show nothing.
    let is_shown = |idx: usize| changes.len() <= SHOWN || idx < SHOWN - 1 || idx + 1 == changes.len();
    for (idx, change) in changes.iter().enumerate().filter(|(idx, _)| is_shown(*idx)) {
        if idx >= SHOWN && idx + 1 == changes.len() {
            lines.push(format!("  … and {} flows between", idx + 1 - SHOWN));
        }
        lines.extend(change_lines(plan, transport, change));
    }
    let part = if plan.exchange.is_some() { "what walks of the " } else { "" };
    lines.push(format!("{part}{}", dispersion_line(&transport.dispersion)));
    lines.extend(path_line(plan, transport));
    lines.push(format!("porosity: {}", tape(&transport.porosity, "")));
    lines.extend(cell_line(transport));
    for interface in &transport.interfaces {
        let axis = plan.axes.get(interface.axis).map_or("", |axis| axis_name(axis.index));
        lines.push(format!("coefficients jump at {axis} = {} m", number(interface.at)));
    }
    side_lines(plan, transport, &mut lines);
    lines.extend(transport.sources.iter().map(|source| source_line(plan, source)));
    if transport.is_of_fluid {
        lines.push("parcels come in and go out with the water".to_owned());
    }
    for population in &transport.populations {
        let mut line =
            format!("{} particles of {}", grouped(population.count), name(plan, population.species));
        if population.retardation != 1.0 {
            line += &format!(", retardation {}", number(population.retardation));
        }
        if let Some(molecular) = population.molecular {
            line += &format!(", molecular diffusion {} m^2/s", number(molecular));
        }
        if !population.is_mobile {
            line += ", immobile";
        }
        lines.push(line);
    }
    lines.push(match transport.sub_steps {
        None if matches!(transport.flow, Flow::Darcy(_) | Flow::File(_)) => {
            "steps: one displacement of each particle in a step, more if water crosses half a cell in one".to_owned()
        }
        None => "steps: one displacement of each particle in a step".to_owned(),
        Some(sub_steps) => format!(
            "steps: each particle divides a step so that its Courant number is at most {} and its dispersion number at most {}",
            number(sub_steps.courant),
            number(sub_steps.dispersion)
        ),
    });
    if let Some(order) = &transport.order {
        let tiles: Vec<String> = order.tiles.iter().map(ToString::to_string).collect();
        lines.push(format!(
            "memory: particles are sorted by {} tiles about every {} displacements",
            tiles.join(" x "),
            order.displacements
        ));
    }
    lines
}

fn axis_name(index: usize) -> &'static str {
    ["x", "y", "z"][index]
}

fn name(plan: &Plan, species: usize) -> &str {
    plan.species.get(species).map_or("", |species| species.name.as_str())
}

/// What a tape of a side is of: a species, or with fluid a component.
fn carrier(plan: &Plan, idx: usize) -> &str {
    match plan.carries_mass() {
        true => name(plan, idx),
        false => plan.components.get(idx).map_or("", |component| component.name.as_str()),
    }
}

fn tape(tape: &Tape, unit: &str) -> String {
    match tape.operations.as_slice() {
        [Operation::Constant(value)] => format!("{}{unit}", number(*value)),
        operations if is_timed(tape) => {
            format!("an expression of {} operations that changes in time", operations.len())
        }
        operations => format!("an expression of {} operations", operations.len()),
    }
}

fn list(values: &[f64]) -> String {
    values.iter().map(|value| number(*value)).collect::<Vec<_>>().join(", ")
}

/// The first numbers of a long list, and the last.
fn shortened(values: &[f64]) -> String {
    match values {
        [first @ .., last] if values.len() > SHOWN => {
            format!("{}, …, {}", list(&first[..SHOWN - 1]), number(*last))
        }
        all => list(all),
    }
}

fn flow_lines(plan: &Plan, flow: &Flow) -> Vec<String> {
    match flow {
        Flow::Uniform(velocity) => vec![format!("flow: uniform, ({}) m/s in the frame", list(velocity))],
        Flow::Expression(tapes) => {
            let parts: Vec<String> = tapes.iter().map(|part| tape(part, " m/s")).collect();
            vec![format!("flow: velocity ({})", parts.join(", "))]
        }
        Flow::Darcy(darcy) => darcy_lines(plan, darcy),
        Flow::File(flow) => file_lines(flow),
    }
}

fn file_lines(flow: &FileFlow) -> Vec<String> {
    let names: Vec<&str> = flow.file.files.iter().map(|file| file.name.as_str()).collect();
    let cells: Vec<String> = flow.facts.cells.iter().map(ToString::to_string).collect();
    let mut lines = vec![format!("flow: read from {} on {} cells", names.join(", "), cells.join(" x "))];
    lines.extend(flow.file.files.iter().map(|file| format!("  {}: BLAKE3 {}", file.name, file.hash)));
    if !flow.facts.changes.is_empty() {
        let n = flow.facts.changes.len() + 1;
        lines.push(format!(
            "  {n} steady flows one after another, the later ones from {} s",
            shortened(&flow.facts.changes)
        ));
    }
    lines.push(format!("  pore velocity: root mean square {} m/s", number(flow.facts.speed)));
    let [worst, typical] = flow.facts.divergence;
    lines.push(format!(
        "  water that appears or vanishes: {} of the through-flow in the worst cell, which is {} of what crosses such \
         a cell; root mean square {}",
        number(flow.facts.missing),
        number(worst),
        number(typical)
    ));
    let outlets: Vec<&str> = flow.facts.outlets.iter().map(|outlet| outlet.name.as_str()).collect();
    if !outlets.is_empty() {
        lines.push(format!("  water is taken out by {}", outlets.join(", ")));
    }
    lines
}

/// What of the flow is new from a time on.
fn change_lines(plan: &Plan, transport: &Transport, change: &Change) -> Vec<String> {
    let from = format!("  from {} s", number(change.from));
    match (&change.flow, &transport.flow) {
        (Changed::Uniform(velocity), _) => vec![format!("{from}: uniform, ({}) m/s", list(velocity))],
        (Changed::Expression(tapes), _) => {
            let parts: Vec<String> = tapes.iter().map(|part| tape(part, " m/s")).collect();
            vec![format!("{from}: velocity ({})", parts.join(", "))]
        }
        (Changed::Darcy { sides, rates }, Flow::Darcy(first)) => {
            let mut parts: Vec<String> =
                plan.axes.iter().zip(sides).map(|(axis, ends)| ends_text(axis.index, ends)).collect();
            let wells = first.wells.iter().zip(rates);
            let unit = rate_unit(plan);
            parts.extend(
                wells.map(|(well, rate)| format!("well {}, rate {} {unit}", well.name, number(*rate))),
            );
            vec![format!("{from}: {}", parts.join("; "))]
        }
        _ => Vec::new(),
    }
}

/// The unit of a well's rate.
fn rate_unit(plan: &Plan) -> &'static str {
    ["m/s", "m^2/s", "m^3/s"][plan.axes.len().clamp(1, 3) - 1]
}

fn ends_text(axis: usize, ends: &[DarcySide; 2]) -> String {
    let side = |side: &DarcySide| match side {
        DarcySide::Head(head) => format!("head {} m", number(*head)),
        DarcySide::Flux(flux) => format!("flux {} m/s inwards", number(*flux)),
        DarcySide::NoFlow => "no flow".to_owned(),
        DarcySide::Periodic => "periodic".to_owned(),
    };
    format!("along {}: {} / {}", axis_name(axis), side(&ends[0]), side(&ends[1]))
}

fn darcy_lines(plan: &Plan, darcy: &Darcy) -> Vec<String> {
    let cells: Vec<String> = darcy.cells.iter().map(ToString::to_string).collect();
    let mut lines = vec![format!("flow: Darcy on {} cells", cells.join(" x "))];
    for (axis, ends) in plan.axes.iter().zip(&darcy.sides) {
        lines.push(format!("  {}", ends_text(axis.index, ends)));
    }
    lines.push(match &darcy.conductivity {
        Conductivity::Expression(of) => format!("  conductivity {}", tape(of, " m/s")),
        Conductivity::Lognormal { geometric_mean, variance, covariance, lengths, seed } => format!(
            "  conductivity lognormal: geometric mean {} m/s, variance {} of ln K, {} covariance over ({}) m, seed {seed}",
            number(*geometric_mean),
            number(*variance),
            match covariance {
                Covariance::Exponential => "exponential",
                Covariance::Gaussian => "Gaussian",
            },
            list(lengths)
        ),
    });
    if darcy.anisotropy.iter().any(|factor| *factor != 1.0) {
        lines.push(format!("  anisotropy ({})", list(&darcy.anisotropy)));
    }
    for well in &darcy.wells {
        let place = if well.low == well.high {
            format!("at ({}) m", list(&well.low))
        } else {
            format!("from ({}) to ({}) m", list(&well.low), list(&well.high))
        };
        let carrying = if well.carrying.is_empty() {
            String::new()
        } else {
            format!(", carrying {}", carried(plan, &well.carrying))
        };
        let unit = rate_unit(plan);
        lines.push(format!("  well {} {place}, rate {} {unit}{carrying}", well.name, number(well.rate)));
    }
    lines
}

fn dispersion_line(dispersion: &Dispersion) -> String {
    match dispersion {
        Dispersion::Constant(triangle) => format!("dispersion: lower triangle ({}) m^2/s", list(triangle)),
        Dispersion::Isotropic(of) => format!("dispersion: {}", tape(of, " m^2/s")),
        Dispersion::Velocity { longitudinal, transverse, transverse_vertical, molecular } => format!(
            "dispersion: longitudinal {} m, transverse {} m, vertical {} m, molecular {} m^2/s",
            number(*longitudinal),
            number(*transverse),
            number(*transverse_vertical),
            number(*molecular)
        ),
    }
}

/// What follows the flow on cells without spreading.
fn path_line(plan: &Plan, transport: &Transport) -> Option<String> {
    let molecular = match &transport.dispersion {
        Dispersion::Velocity { longitudinal, transverse, transverse_vertical, molecular }
            if [longitudinal, transverse, transverse_vertical].into_iter().all(|length| *length == 0.0) =>
        {
            *molecular
        }
        Dispersion::Constant(triangle) if triangle.iter().all(|entry| *entry == 0.0) => 0.0,
        _ => return None,
    };
    let is_on_cells = matches!(transport.flow, Flow::Darcy(_) | Flow::File(_));
    let still =
        transport.populations.iter().filter(|of| of.is_mobile && of.molecular.unwrap_or(molecular) == 0.0);
    let names: Vec<&str> = still.map(|of| name(plan, of.species)).collect();
    let says = |names: &str| format!("paths: {names} exactly with the water from cell to cell, at any step");
    (is_on_cells && !names.is_empty()).then(|| says(&names.join(", ")))
}

/// What porosity that varies means on cells.
fn cell_line(transport: &Transport) -> Option<String> {
    let is_on_cells = matches!(transport.flow, Flow::Darcy(_));
    let varies = !matches!(transport.porosity.operations[..], [Operation::Constant(_)]);
    (is_on_cells && varies).then(|| "  each cell has that of its middle; faces between are jumps".to_owned())
}

fn side_lines(plan: &Plan, transport: &Transport, lines: &mut Vec<String>) {
    for (axis_idx, ends) in transport.sides.iter().enumerate() {
        let Some(axis) = plan.axes.get(axis_idx) else { continue };
        for (patches, at) in ends.iter().zip([axis.low, axis.high]) {
            for patch in patches {
                let part = part(plan, patch, axis_idx);
                let rule = rule(plan, &patch.rule);
                lines.push(format!("side {} = {} m{part}: {rule}", axis_name(axis.index), number(at)));
            }
        }
    }
}

/// The limits of a part of a side.
fn part(plan: &Plan, patch: &Patch, normal: usize) -> String {
    let mut text = String::new();
    for (idx, axis) in plan.axes.iter().enumerate().filter(|(idx, _)| *idx != normal) {
        if (patch.low[idx], patch.high[idx]) != (axis.low, axis.high) {
            text += &format!(
                ", {} = {} .. {} m",
                axis_name(axis.index),
                number(patch.low[idx]),
                number(patch.high[idx])
            );
        }
    }
    text
}

/// Concentrations of all species.
fn carried(plan: &Plan, tapes: &[Tape]) -> String {
    // Concentrations of masses are those of a species; parcels carry components, amounts as all of chemistry.
    let unit = |idx: usize| match plan.species.get(idx).filter(|_| plan.carries_mass()) {
        Some(species) => {
            if species.is_molar {
                " mol/m^3"
            } else {
                " kg/m^3"
            }
        }
        None => " (SI)",
    };
    let of = |(idx, of): (usize, &Tape)| format!("{} = {}", carrier(plan, idx), tape(of, unit(idx)));
    let parts: Vec<String> = tapes.iter().enumerate().map(of).collect();
    if parts.is_empty() { "nothing".to_owned() } else { parts.join(", ") }
}

fn rule(plan: &Plan, rule: &SideRule) -> String {
    match rule {
        SideRule::Reflect => "reflect".to_owned(),
        SideRule::Periodic => "periodic".to_owned(),
        SideRule::Open => "open".to_owned(),
        SideRule::Absorb => "absorb".to_owned(),
        SideRule::Partial(rate) => format!("absorb at {} m/s", number(*rate)),
        SideRule::Outflow => "outflow".to_owned(),
        SideRule::Inflow(tapes) => format!("inflow with {}", carried(plan, tapes)),
        SideRule::Held(tapes) => format!("held at {}", carried(plan, tapes)),
    }
}

fn source_line(plan: &Plan, source: &Source) -> String {
    let region = match &source.region {
        Region::Point(at) => format!("at the point ({}) m", list(at)),
        Region::Line(from, to) => format!("along the line from ({}) to ({}) m", list(from), list(to)),
        Region::Box(low, high) => format!("in the box from ({}) to ({}) m", list(low), list(high)),
        Region::Gaussian(centre, deviation) => {
            format!("in a Gaussian about ({}) m with ({}) m", list(centre), list(deviation))
        }
        Region::Table(cloud) => format!("at the {} places of a table", cloud.n_rows()),
    };
    let unit =
        if plan.species.get(source.species).is_some_and(|species| species.is_molar) { "mol" } else { "kg" };
    let per = ["/m^2", "/m", ""][plan.axes.len().clamp(1, 3) - 1];
    let (from, to) = source.during;
    let window = format!("from {} to {} s", number(from), number(to));
    let what = match &source.strength {
        Strength::Pulse(amount) => format!("{} {unit}{per} at once", number(*amount)),
        Strength::Rate(rate) => format!("{} {unit}{per}/s {window}", number(*rate)),
        Strength::Held(c) => format!("held at {} {unit}/m^3 {window}", number(*c)),
        Strength::RateInTime(of) => format!("{}, in {unit}{per}/s, {window}", tape(of, "")),
        Strength::HeldInTime(of) => format!("held at {}, in {unit}/m^3, {window}", tape(of, "")),
    };
    format!("source {}: {} of {} {region}", source.name, what, name(plan, source.species))
}

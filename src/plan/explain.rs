//! The plan in words: what runs, in which order, what it costs, what was left out and why.

use super::compile::Compiled;
use super::cost::{Cost, n_stored_values};
use super::{Mixing, Normals, Plan, Quantity, Stage, ZoneRate};
use super::{explain_exchange, explain_kernels, explain_reactions, explain_transport};
use crate::diagnostic::number;
use std::fmt::Write as _;

/// The text of `lamella plan`.
pub fn explain(compiled: &Compiled, name: &str, title: Option<&str>) -> String {
    let mut text = String::new();
    let _ = writeln!(text, "plan of {name}");
    if let Some(title) = title {
        let _ = writeln!(text, "  {title}");
    }
    let _ = writeln!(text, "  hash {}", compiled.hash);
    section(&mut text, "what runs", &scene_lines(&compiled.plan));
    section(&mut text, "transport", &explain_transport::lines(&compiled.plan));
    section(&mut text, "exchange", &explain_exchange::lines(&compiled.plan));
    section(&mut text, "means over the parcels around", &explain_exchange::mean_lines(&compiled.plan));
    section(&mut text, "kernels", &explain_kernels::lines(&compiled.plan));
    section(&mut text, "each step, in this order", &step_lines(compiled));
    section(&mut text, "what particles carry", &field_lines(&compiled.plan));
    section(&mut text, "reactions", &explain_reactions::lines(&compiled.plan));
    section(&mut text, "outputs", &output_lines(&compiled.plan));
    section(&mut text, "what it costs", &cost_lines(compiled));
    section(&mut text, "limits", &limit_lines(compiled));
    section(&mut text, "left out", &left_out_lines(compiled));
    text
}

fn section(text: &mut String, heading: &str, lines: &[String]) {
    if lines.is_empty() {
        return;
    }
    let _ = writeln!(text, "\n{heading}");
    for line in lines {
        let _ = writeln!(text, "  {line}");
    }
}

fn axis_name(index: usize) -> &'static str {
    ["x", "y", "z"][index]
}

/// A whole number with blanks between thousands.
pub fn grouped(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::new();
    for (idx, digit) in digits.chars().enumerate() {
        if idx > 0 && (digits.len() - idx).is_multiple_of(3) {
            text.push(' ');
        }
        text.push(digit);
    }
    text
}

fn scene_lines(plan: &Plan) -> Vec<String> {
    let mut lines = vec![
        format!(
            "{} {} particles, {} placement{}, seed {}",
            grouped(plan.particles.count),
            if plan.carries_mass() { "mass" } else { "fluid" },
            plan.particles.placement.word(),
            if plan.particles.disorder > 0.0 {
                format!(" with disorder {}", number(plan.particles.disorder))
            } else {
                String::new()
            },
            plan.seed
        )
        .to_lowercase(),
    ];
    for (idx, axis) in plan.axes.iter().enumerate() {
        if plan.transport.is_some() {
            let (name, low, high) = (axis_name(axis.index), number(axis.low), number(axis.high));
            let bins = if plan.carries_mass() { String::new() } else { format!(", {} bins", axis.bins) };
            lines.push(format!("axis {name}: {low} .. {high} m{bins}"));
            continue;
        }
        let b = &plan.walk.spread[idx * (idx + 1) / 2..][..=idx];
        let dispersion = 0.5 * b.iter().map(|b| b * b).sum::<f64>();
        lines.push(format!(
            "axis {}: {} .. {} m ({} / {}), {} bins, drift {} m/s, {} {} m^2/s",
            axis_name(axis.index),
            number(axis.low),
            number(axis.high),
            axis.low_side.word(),
            axis.high_side.word(),
            axis.bins,
            number(plan.walk.drift[idx]),
            if plan.exchange.is_some() { "dispersion by walk" } else { "dispersion" },
            number(dispersion),
        ));
    }
    let time = &plan.time;
    lines.push(format!(
        "{} steps of {} s to {} s{}",
        grouped(time.n_steps),
        number(time.step),
        number(time.duration),
        match plan.transport.as_ref().map_or(0, |transport| transport.n_cuts(time)) {
            0 => String::new(),
            n => format!(", and {} more: steps are cut where a flow begins within them", grouped(n)),
        }
    ));
    let normals = match plan.walk.normals {
        Normals::Single => "normal numbers in 32-bit lanes (largest about 6.6 standard deviations)",
        Normals::Double => "normal numbers in 64 bits",
    };
    lines.push(normals.to_owned());
    lines
}

fn stage_words(stage: Stage) -> &'static str {
    match stage {
        Stage::React => "react: what the particles carry reacts at its rates",
        Stage::Mix => "mix: relax towards the means of the bins",
        Stage::Move => "move: drift and dispersion",
        Stage::Bound => "bound: apply the sides of the domain",
        Stage::Exchange => "exchange: parcels and those around them exchange what they carry",
        Stage::KernelMean => "kernel mean: zones exchange with the means over the parcels around",
        Stage::Average => "average: sums and means per bin",
        Stage::Estimate => "estimate: concentrations in cells, by kernels of particles",
        Stage::FusedReact => "mix and react in one pass over memory",
        Stage::FusedStep => "mix, move, bound and average in one pass over memory",
        Stage::Observe => "observe: outputs that are due",
    }
}

fn step_lines(compiled: &Compiled) -> Vec<String> {
    let decays = compiled.plan.transport.as_ref().is_some_and(|transport| transport.decay.is_some());
    let words = |stage: Stage| match stage {
        Stage::React if decays => "react: particles become others on their way, each at a time of its own",
        _ => stage_words(stage),
    };
    let line = |(stage, cost): &(Stage, f64)| match stage {
        Stage::Observe => words(*stage).to_owned(),
        _ => format!("{}   (about {cost:.1} ns per particle)", words(*stage)),
    };
    compiled.cost.stages.iter().map(line).collect()
}

/// Zones, and what is stored of them.
fn zone_lines(mixing: &Mixing) -> Vec<String> {
    let mut lines = Vec::new();
    for zone in &mixing.zones {
        let rate = match zone.rate {
            ZoneRate::Instant => "instant".to_owned(),
            ZoneRate::Finite(rate) => format!("rate {} /s", number(rate)),
        };
        let stored = if zone.is_stored { "stored" } else { "not stored" };
        lines.push(format!("zone {}: fraction {}, {rate}, {stored}", zone.name, number(zone.fraction)));
    }
    if mixing.is_well_mixed {
        lines.push(match mixing.averaging {
            None => {
                "every zone is instant: particles carry an unmixed value, means are taken at outputs".into()
            }
            Some(_) => "every zone is instant: particles carry an unmixed value and its mean".into(),
        });
    } else if mixing.stores_mean() {
        lines.push("the mean that instant zones are at is stored".into());
    }
    lines
}

fn field_lines(plan: &Plan) -> Vec<String> {
    let mut lines = Vec::new();
    if plan.carries_mass() {
        return vec!["a mass of one species each, beside the position".to_owned()];
    }
    let n_values = n_stored_values(plan);
    let carried = plan.components.iter().filter(|component| !component.is_immobile);
    let names: Vec<&str> = carried.map(|component| component.name.as_str()).collect();
    if names.is_empty() {
        lines.push("positions only".to_owned());
    } else {
        let values = if n_values == 1 { "one value".to_owned() } else { format!("{n_values} values") };
        lines.push(format!("{}: {values} each, beside the position", names.join(", ")));
    }
    lines.extend(explain_reactions::immobile_line(plan));
    lines.extend(plan.mixing.iter().flat_map(zone_lines));
    for species in &plan.species {
        let is_itself = matches!(species.terms.as_slice(), [(component, factor)]
            if *factor == 1.0 && plan.components[*component].name == species.name && species.constant == 0.0);
        if is_itself {
            continue;
        }
        let terms: Vec<String> = species
            .terms
            .iter()
            .map(|(component, factor)| {
                let sign = if *factor < 0.0 { '-' } else { '+' };
                let size = if factor.abs() == 1.0 { String::new() } else { number(factor.abs()) + " " };
                format!(" {sign} {size}{}", plan.components[*component].name)
            })
            .collect();
        lines.push(format!(
            "{} before reaction = {}{}",
            species.name,
            number(species.constant),
            terms.concat()
        ));
    }
    for reaction in &plan.reactions {
        let side = |list: &[(usize, f64)]| {
            let term = |(species, nu): &(usize, f64)| match *nu {
                1.0 => plan.species[*species].name.clone(),
                nu => format!("{} {}", number(nu), plan.species[*species].name),
            };
            list.iter().map(term).collect::<Vec<_>>().join(" + ")
        };
        lines.push(format!(
            "reaction {}: {} -> {}, complete, worked out at outputs",
            reaction.name,
            side(&reaction.reactants),
            side(&reaction.products)
        ));
    }
    lines
}

fn output_lines(plan: &Plan) -> Vec<String> {
    let name = |idx: usize| plan.species[idx].name.as_str();
    let line = |output: &super::Output| {
        let quantities: Vec<String> = output
            .quantities
            .iter()
            .map(|quantity| match *quantity {
                Quantity::Species(a) => name(a).to_owned(),
                Quantity::Pair(a, b) => format!("({}, {})", name(a), name(b)),
            })
            .collect();
        let bins: Vec<String> = output.bins.iter().map(ToString::to_string).collect();
        let on = if bins.is_empty() { String::new() } else { format!(" on {} bins", bins.join(" x ")) };
        let times = match output.times.as_slice() {
            [] => "never".to_owned(),
            [only] => format!("at {} s", number(*only)),
            [first, .., last] => {
                format!("at {} times from {} to {} s", output.times.len(), number(*first), number(*last))
            }
        };
        let place = place_text(plan, output);
        format!("{} of {}{place}{on}, {times}", output.kind.word(), quantities.join(", "))
    };
    let of_flow = plan.writes_flow.then(|| "flow: a row for each of its cells".to_owned());
    plan.outputs.iter().map(line).chain(of_flow).collect()
}

/// Where an output is taken.
fn place_text(plan: &Plan, output: &super::Output) -> String {
    let Some(station) = &output.station else { return String::new() };
    let words = plan.places(output).join(", ");
    let known = ["x", "y", "z"].iter().zip(plan.position(station)).filter_map(|(name, at)| Some((name, at?)));
    let position: Vec<String> = known.map(|(name, at)| format!("{name} = {} m", number(at))).collect();
    format!(" at {words} ({})", position.join(", "))
}

/// With the displacements in each, where particles take steps of their own.
fn particle_steps(cost: &Cost) -> String {
    let own = format!("{} particle-steps", number(cost.particle_steps));
    let n = cost.displacements_per_step;
    if n > 1.0 { format!("{own} of about {} displacements", number((10.0 * n).round() / 10.0)) } else { own }
}

fn cost_lines(compiled: &Compiled) -> Vec<String> {
    let cost = &compiled.cost;
    let mib = |bytes: u64| number((bytes as f64 / f64::from(1u32 << 20) * 10.0).round() / 10.0);
    vec![
        particle_steps(cost),
        format!("about {} s on one core", number((cost.cpu_seconds * 100.0).round() / 100.0)),
        format!(
            "{} MiB of particle state, {} MiB of sums over bins, {} MiB of outputs",
            mib(cost.state_bytes),
            mib(cost.bin_bytes),
            mib(cost.output_bytes)
        ),
    ]
}

fn limit_lines(compiled: &Compiled) -> Vec<String> {
    let line = |limit: &super::limits::Limit| {
        format!("{} = {}   ({}; {})", limit.name, number(limit.value), limit.formula, limit.advice)
    };
    compiled.limits.iter().map(line).collect()
}

fn left_out_lines(compiled: &Compiled) -> Vec<String> {
    compiled.left_out.iter().map(|item| format!("{}: {}", item.what, item.why)).collect()
}

//! Limits of reactions by kernels.
//!
//! Owns these numbers and verdicts. May use the scenario for the places. It deliberately finds no bandwidth: kernels follow from
//! particles.

use super::Plan;
use super::kernels::{Manner, Reacting};
use super::limits::{Limit, round_down, short};
use super::start_rates::start_rates;
use crate::diagnostic::codes::{M038, N207, N208};
use crate::diagnostic::{Diagnostic, precise};
use crate::scenario::{Rate, Reaction, Scenario};

/// Part of a particle that may react in a step: more of it, and partners run out within the step.
const MOST_LOSS: f64 = 0.1;

/// Reactions that pairs of particles cannot do.
pub(super) fn refuse(scenario: &Scenario, plan: &Plan) -> Result<(), Vec<Diagnostic>> {
    if plan.reacting() != Some(Reacting::Pairs) {
        return Ok(());
    }
    let place = scenario.estimation.as_ref().map_or(scenario.particles.kind_span, |own| {
        own.reacting.as_ref().map_or(own.span, |reacting| reacting.span)
    });
    let told = |(reaction, found): (&Reaction, String)| {
        Diagnostic::error(M038, "pairs of particles cannot do this reaction")
            .at(reaction.span, "not by pairs")
            .also(place, "pairs are asked for here")
            .found(found)
            .expected("a rate of one or two species that the reaction takes")
            .help("use `reactions masses`, which does all of them")
    };
    let wrong = |reaction: &'_ Reaction| -> Option<String> {
        let net = super::lower_chemistry::net(reaction);
        let n_taken = net.iter().filter(|(_, nu)| *nu < 0.0).count();
        match (&reaction.rate, n_taken) {
            (Rate::Instant, _) => Some("an instant reaction".to_owned()),
            (_, 0) => Some("a reaction that takes nothing".to_owned()),
            (_, 1 | 2) => None,
            (_, n) => Some(format!("{n} species that are taken")),
        }
    };
    let all = scenario.reactions.iter().filter_map(|reaction| Some((reaction, wrong(reaction)?)));
    let refused: Vec<Diagnostic> = all.map(told).collect();
    if refused.is_empty() { Ok(()) } else { Err(refused) }
}

pub(super) fn check(
    scenario: &Scenario,
    plan: &Plan,
    limits: &mut Vec<Limit>,
    diagnostics: &mut Vec<Diagnostic>,
) {
    diagnostics.extend(too_fine(scenario, plan));
    let Some(reacting) = plan.reacting() else { return };
    let Some(rates) = start_rates(plan) else { return };
    let most = rates.losses.iter().copied().fold(0.0, f64::max);
    let loss = most * plan.time.step;
    limits.push(Limit {
        name: "part of a reactant that reacts in a step, at the start".into(),
        formula: "nu r dt / c",
        value: loss,
        advice: match reacting {
            Reacting::Pairs => "at most 0.1: partners must not run out within a step",
            Reacting::Masses => {
                "any: chemistry has sub-steps; transport and reaction take turns, as well as this is small"
            }
        },
    });
    if reacting == Reacting::Masses || loss <= MOST_LOSS * (1.0 + 1e-6) {
        return;
    }
    let fastest = rates.losses.iter().position(|own| *own == most).unwrap_or(0);
    let kinetics = plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
    let name = kinetics.map_or("", |kinetics| kinetics.reactions[fastest].name.as_str());
    let step = MOST_LOSS / most;
    let mut message = Diagnostic::refused(
        N208,
        format!(
            "step {} s cannot resolve `{name}` by pairs: c/(nu r) = {} s, allowed {} s",
            short(plan.time.step),
            short(1.0 / most),
            short(step)
        ),
    )
    .at(scenario.run.step_span, format!("{} of a reactant in a step", short(loss)))
    .found(format!("nu r dt / c = {}", precise(short_value(loss))))
    .expected(format!("at most {MOST_LOSS}"))
    .help(format!(
        "use `step {}` or less, `step auto`, or `reactions masses`, which has sub-steps of its own",
        round_down(step)
    ));
    if let Some(reaction) = scenario.reaction(name) {
        message = message.also(reaction.span, "the fastest reaction");
    }
    diagnostics.push(message);
}

/// A kernel of a given size that the cells or the domain cannot hold.
fn too_fine(scenario: &Scenario, plan: &Plan) -> Option<Diagnostic> {
    let kernels = plan.kernels.as_ref().filter(|kernels| kernels.manner == Manner::Fixed)?;
    let [h, _] = kernels.bandwidth?;
    let place = scenario.estimation.as_ref()?.bandwidth.as_ref()?.span;
    let edges: Vec<f64> = (plan.axes.iter().zip(&kernels.cells))
        .filter(|(_, n)| **n > 1)
        .map(|(axis, &n)| (axis.high - axis.low) / n as f64)
        .collect();
    let widest = edges.iter().copied().fold(0.0, f64::max);
    let extents = plan.axes.iter().zip(&kernels.cells).filter(|(_, n)| **n > 1);
    let most = extents.map(|(axis, &n)| (axis.high - axis.low) * (0.9 - 1.0 / n as f64) / 3.0);
    let most = most.fold(f64::INFINITY, f64::min);
    let least = 0.4 * widest;
    let slack = 1.0 + 1e-9;
    if h * slack >= least && h <= most * slack {
        return None;
    }
    let help = match h < least {
        true => format!("use `grid {} m` or less, or a larger bandwidth", short(2.5 * h)),
        false => "use a smaller bandwidth: a kernel should end within the domain".to_owned(),
    };
    Some(
        Diagnostic::refused(N207, "the cells or the domain cannot hold a kernel of this size")
            .at(place, format!("{} m", short(h)))
            .found(format!("{} m", short(h)))
            .expected(format!("from {} to {} m", short(least), short(most)))
            .help(help),
    )
}

/// Three figures.
fn short_value(value: f64) -> f64 {
    short(value).parse().unwrap_or(value)
}

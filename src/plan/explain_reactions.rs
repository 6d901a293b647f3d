//! Chemistry in words: which laws, how they are integrated, what is in equilibrium.
//!
//! Owns these lines of `lamella plan`. May use the plan. It deliberately decides nothing.

use super::chemistry::{
    Activity, Chemistry, Equilibrium, Integrator, Kinetic, Kinetics, Law, Method, Splitting,
};
use super::kernels::Reacting;
use super::transport::{Decay, Turn};
use super::{Component, Plan, Species};
use crate::diagnostic::number;

/// Lines of the section on reactions; none without chemistry.
pub(super) fn lines(plan: &Plan) -> Vec<String> {
    if let Some(decay) = plan.transport.as_ref().and_then(|transport| transport.decay.as_ref()) {
        return decay_lines(plan, decay);
    }
    let Some(chemistry) = &plan.chemistry else { return Vec::new() };
    let mut lines = Vec::new();
    if let Some(kinetics) = &chemistry.kinetics {
        lines.extend(kinetics.reactions.iter().map(|reaction| reaction_line(plan, kinetics, reaction)));
        let meets = plan.reacting() == Some(Reacting::Pairs);
        if meets {
            lines.push("by pairs of particles that meet, each at most once in a step".to_owned());
        } else {
            lines.push(method_line(kinetics.method).to_owned());
        }
        if has_error_control(kinetics.method) && !meets {
            lines.extend(gate_lines(plan, chemistry, kinetics));
            lines.push(format!(
                "tolerance {} relative, {}",
                number(chemistry.tolerance),
                floor_text(chemistry)
            ));
        }
        if kinetics.method != Method::Observed {
            lines.push(splitting_line(plan, chemistry).to_owned());
        }
    }
    if let Some(equilibrium) = &chemistry.equilibrium {
        lines.extend(equilibrium_lines(plan, equilibrium));
    }
    lines
}

/// Reactions of particles that carry mass.
fn decay_lines(plan: &Plan, decay: &Decay) -> Vec<String> {
    let name = |population: usize| {
        let species =
            plan.transport.as_ref().and_then(|it| it.populations.get(population)).map(|it| it.species);
        species.and_then(|idx| plan.species.get(idx)).map_or("?", |species| species.name.as_str())
    };
    let line = |turn: &Turn| {
        let outcome = |&(to, chance): &(usize, f64)| {
            let weight = decay.weights[to] / decay.weights[turn.population];
            match chance * weight {
                yields if (yields - 1.0).abs() < 1e-12 => name(to).to_owned(),
                yields => format!("{} {}", number(yields), name(to)),
            }
        };
        let outcomes: Vec<String> = turn.outcomes.iter().map(outcome).collect();
        let becomes = if outcomes.is_empty() { "nothing".to_owned() } else { outcomes.join(" + ") };
        format!("{}: {} becomes {becomes}, {} /s", turn.name, name(turn.population), number(turn.rate))
    };
    let mut lines: Vec<String> = decay.reactions.iter().map(line).collect();
    lines.push("first order: waiting times of single particles, exact in law for any step".to_owned());
    if decay.weights.iter().any(|weight| *weight != decay.weights[0]) {
        lines.push(
            "a reaction that makes more or less than it takes makes heavier or lighter particles".to_owned(),
        );
    }
    lines
}

/// Rates that have to be told the end of what they take.
fn gate_lines(plan: &Plan, chemistry: &Chemistry, kinetics: &Kinetics) -> Vec<String> {
    let mut lines = Vec::new();
    for (reaction, gates) in kinetics.reactions.iter().zip(plan.gates()).filter(|(_, it)| !it.is_empty()) {
        let mut names: Vec<&str> = gates.components().map(|idx| &*plan.components[idx].name).collect();
        names.dedup();
        let (names, one) = (names.join(", "), if names.len() == 1 { "it" } else { "them" });
        lines.push(format!(
            "the rate of `{}` does not see how much is left of {names}: it ends with {one}",
            reaction.name
        ));
    }
    if !lines.is_empty() && chemistry.integrator == Integrator::Explicit {
        lines.push("`integrator explicit` is not taken: such an end is stiff".to_owned());
    }
    lines
}

fn has_error_control(method: Method) -> bool {
    matches!(method, Method::Explicit | Method::Rosenbrock)
}

/// `decay: A -1, B +1; mass action, k = 0.1`
fn reaction_line(plan: &Plan, kinetics: &Kinetics, reaction: &Kinetic) -> String {
    // First-order networks that are worked out when observed change species, all others components.
    let name = |idx: usize| match kinetics.method {
        Method::Observed => plan.species.get(idx).map_or("?", |species| species.name.as_str()),
        _ => plan.components.get(idx).map_or("?", |component| component.name.as_str()),
    };
    let change = |&(idx, coefficient): &(usize, f64)| {
        let sign = if coefficient < 0.0 { '-' } else { '+' };
        format!("{} {sign}{}", name(idx), number(coefficient.abs()))
    };
    let changes: Vec<String> = reaction.changes.iter().map(change).collect();
    format!("{}: {}; {}", reaction.name, changes.join(", "), law_text(plan, &reaction.law))
}

fn law_text(plan: &Plan, law: &Law) -> String {
    let name = |idx: usize| plan.species.get(idx).map_or("?", |species| species.name.as_str());
    match law {
        Law::MassAction { constant, orders } if orders.is_empty() => {
            format!("zero order, {} in SI", number(*constant))
        }
        Law::MassAction { constant, orders } => {
            let power = |&(species, order): &(usize, f64)| match order {
                1.0 => name(species).to_owned(),
                order => format!("{}^{}", name(species), number(order)),
            };
            let powers: Vec<String> = orders.iter().map(power).collect();
            format!("mass action, {} {} in SI", number(*constant), powers.join(" "))
        }
        Law::Saturation { maximum, half, species } => {
            let species = name(*species);
            format!("saturating, {} {species} / ({} + {species}) in SI", number(*maximum), number(*half))
        }
        Law::Expression => "a law of its own".to_owned(),
    }
}

fn method_line(method: Method) -> &'static str {
    match method {
        Method::Observed => "first-order network: matrix exponential when observed, exact for any step",
        Method::Exponential => "first-order network: matrix exponential in each step, exact",
        Method::Pair => "one reaction of second order: closed form, exact",
        Method::Saturation => "one saturating reaction: closed form (Lambert W), exact",
        Method::Zero => "one reaction of order zero: closed form, to the end of its scarcest reactant",
        Method::Explicit => "explicit: Dormand-Prince 5(4), sub-steps per particle",
        Method::Rosenbrock => "implicit: Rodas4, L-stable, exact Jacobian, sub-steps per particle",
    }
}

fn floor_text(chemistry: &Chemistry) -> String {
    let lowest = chemistry.floors.iter().copied().fold(f64::INFINITY, f64::min);
    let highest = chemistry.floors.iter().copied().fold(0.0, f64::max);
    if lowest == highest || chemistry.floors.is_empty() {
        format!("above {} in SI", number(highest))
    } else {
        format!("above {} to {} in SI", number(lowest), number(highest))
    }
}

fn splitting_line(plan: &Plan, chemistry: &Chemistry) -> &'static str {
    let is_coupled =
        plan.mixing.is_some() || plan.has_immobile() || plan.exchange.is_some() || plan.reacting().is_some();
    match chemistry.splitting {
        _ if !is_coupled => "every particle is a batch of its own: taking turns with motion has no error",
        Splitting::Lie => "transport and reaction in turns: first order in the step (Lie)",
        Splitting::Strang => "half a reaction, transport, half a reaction: second order in the step (Strang)",
    }
}

fn equilibrium_lines(plan: &Plan, equilibrium: &Equilibrium) -> Vec<String> {
    let name = |idx: usize| plan.species.get(idx).map_or("?", |species: &Species| species.name.as_str());
    let primaries: Vec<&str> = equilibrium.primaries.iter().map(|primary| name(primary.species)).collect();
    let product = |coefficients: &[(usize, f64)]| {
        let power = |&(j, order): &(usize, f64)| match order {
            1.0 => primaries[j].to_owned(),
            order => format!("{}^{}", primaries[j], number(order)),
        };
        coefficients.iter().map(power).collect::<Vec<_>>().join(" ")
    };
    let mut lines = vec![format!("in equilibrium: totals of {} are carried", primaries.join(", "))];
    for secondary in &equilibrium.secondaries {
        let constant = number(secondary.ln_constant / std::f64::consts::LN_10);
        lines.push(format!(
            "{} = 10^{constant} {} in SI",
            name(secondary.species),
            product(&secondary.coefficients)
        ));
    }
    for mineral in &equilibrium.minerals {
        let constant = number(mineral.ln_solubility / std::f64::consts::LN_10);
        lines.push(format!(
            "mineral {}: {} <= 10^{constant} in SI",
            name(mineral.species),
            product(&mineral.coefficients)
        ));
    }
    lines.push(
        match equilibrium.activity {
            Activity::Ideal => "activities are concentrations",
            Activity::DebyeHuckel => "activities after Debye and Hückel, limiting law",
            Activity::ExtendedDebyeHuckel => "activities after Debye and Hückel, with ion sizes",
            Activity::Davies => "activities after Davies",
        }
        .to_owned(),
    );
    lines
}

/// Names of what lives in bins.
pub(super) fn immobile_line(plan: &Plan) -> Option<String> {
    let own: Vec<&str> =
        plan.components.iter().filter(|c: &&Component| c.is_immobile).map(|c| c.name.as_str()).collect();
    (!own.is_empty()).then(|| format!("{}: in the bins of the averages, not on particles", own.join(", ")))
}

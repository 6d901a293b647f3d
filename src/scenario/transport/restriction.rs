//! What particles of a kind cannot do in this version, told at the statement that asks for it.
//!
//! Owns these messages (M025, M026). May use the scenario. It deliberately changes nothing.

use super::super::check::Checker;
use super::super::expression::Expr;
use super::super::{OutputKind, Scenario};
use super::{Dispersion, Flow, SideRule};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{M025, M026};
use crate::source::Span;

/// Reports everything that the particles of a scene cannot do.
pub fn check(checker: &mut Checker<'_>, scenario: &Scenario) {
    if scenario.particles.shares.is_some() {
        of_mass(checker, scenario);
    } else {
        of_fluid(checker, scenario);
    }
}

/// What masses cannot do yet: one message for each kind of statement.
fn of_mass(checker: &mut Checker<'_>, scenario: &Scenario) {
    let mut wrong: Vec<(&str, Span, &str)> = Vec::new();
    if let Some(mixing) = &scenario.mixing {
        wrong.push(("mixing zones", mixing.span, "use `particles fluid`, or leave the zones out"));
    }
    if let Some(output) = scenario.outputs.iter().find(|output| output.kind.is_of_pairs()) {
        let help = match output.kind {
            OutputKind::Covariance => "`profile` and `map` give means and their errors",
            _ => "`total` gives the mass of each species",
        };
        wrong.push(("covariances within bins", output.span, help));
    }
    if let Some(span) = moving_walls(scenario) {
        wrong.push((
            "walls that move with the frame",
            span,
            "leave `frame moving` out, or let the sides be `open`",
        ));
    }
    for (what, span, help) in wrong {
        checker.report(
            Diagnostic::error(M025, format!("mass particles have no {what} yet"))
                .at(span, "not with particles that carry mass")
                .also(scenario.particles.kind_span, "particles that carry mass")
                .found(what)
                .expected("transport of species, and reactions of first order")
                .help(help),
        );
    }
}

/// A moving frame is a change of coordinates of uniform flow without walls, and of nothing else.
fn moving_walls(scenario: &Scenario) -> Option<Span> {
    if scenario.domain.frame.iter().all(|v| *v == 0.0) {
        return None;
    }
    let is_bare = |rule: &SideRule| matches!(rule, SideRule::Open | SideRule::Periodic);
    let patches = scenario.domain.axes.iter().flat_map(|axis| axis.patches.iter().flatten());
    let has_walls = patches.into_iter().any(|patch| !is_bare(&patch.rule));
    let is_uniform = matches!(scenario.flow.as_ref().map(|flow| &flow.value), None | Some(Flow::Uniform(_)));
    (has_walls || !is_uniform || !scenario.sources.is_empty()).then_some(scenario.domain.span)
}

/// What only masses can do so far.
fn of_fluid(checker: &mut Checker<'_>, scenario: &Scenario) {
    let mut wrong: Vec<(String, Span)> = Vec::new();
    for axis in &scenario.domain.axes {
        for patch in axis.patches.iter().flatten() {
            let word = match patch.rule {
                SideRule::Reflect | SideRule::Periodic | SideRule::Open if patch.limits.is_empty() => {
                    continue;
                }
                SideRule::Reflect | SideRule::Periodic | SideRule::Open => "parts of sides",
                SideRule::Absorb | SideRule::Partial(_) => "sides that absorb",
                SideRule::Outflow => "outflow",
                SideRule::Inflow(_) => "inflow",
                SideRule::Held(_) => "sides with a concentration",
            };
            wrong.push((word.to_owned(), patch.span));
        }
    }
    if let Some(source) = scenario.sources.first() {
        wrong.push(("sources".into(), source.span));
    }
    match scenario.flow.as_ref().map(|flow| (&flow.value, flow.span)) {
        Some((Flow::Expression(_) | Flow::Darcy(_) | Flow::File(_), span)) => {
            wrong.push(("flow that varies in space".into(), span))
        }
        Some((Flow::Uniform(_), _)) | None => {}
    }
    if let Some(dispersion) = &scenario.dispersion
        && matches!(dispersion.value, Dispersion::Isotropic(_))
    {
        wrong.push(("dispersion that varies in space".into(), dispersion.span));
    }
    if let Some(medium) = &scenario.medium
        && Expr::value(&medium.value).is_none()
    {
        wrong.push(("porosity that varies in space".into(), medium.span));
    }
    for species in &scenario.species {
        if let Some(span) = species.own_transport {
            wrong.push(("species with a retardation or diffusion of their own".into(), span));
        }
    }
    // A side in a list of sides, a species in a list of species: one message for each kind.
    let mut told: Vec<&str> = Vec::new();
    for (what, span) in &wrong {
        if told.contains(&what.as_str()) {
            continue;
        }
        told.push(what);
        checker.report(
            Diagnostic::error(M026, format!("fluid particles have no {what} yet"))
                .at(*span, "not with particles of fluid")
                .also(scenario.particles.kind_span, "particles of fluid")
                .found(what.clone())
                .expected("sides that are `reflect`, `periodic` or `open`, and what is the same everywhere")
                .help("write `particles mass` and a number: particles that carry mass can do this"),
        );
    }
}

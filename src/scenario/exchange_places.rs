//! Scenes in which parcels cannot exchange with those around them, told at the statement that stands against it.
//!
//! Owns these messages (M036). May use the scenario. It deliberately asks nothing of numbers: whether there is
//! dispersion along all axes is known when a plan is made.

use super::Scenario;
use super::check::Checker;
use super::transport::{Dispersion, Flow, SideRule};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::M036;
use crate::source::Span;

/// What stands against an exchange: the words for it, where it is, and what would do.
type Against = (&'static str, Option<Span>, &'static str);

/// Reports everything in a scene that its exchange cannot be beside.
pub(super) fn check(checker: &mut Checker<'_>, scenario: &Scenario) {
    let Some(exchange) = &scenario.exchange else { return };
    for (found, place, help) in against(scenario) {
        let message = Diagnostic::error(M036, "parcels of water cannot exchange in this scene");
        let message = match place {
            Some(place) => message.at(place, found).also(exchange.span, "the exchange"),
            None => message.at(exchange.span, "this exchange"),
        };
        checker.report(
            message
                .found(found)
                .expected("parcels in uniform flow, constant dispersion, and sides that reflect, are periodic or open")
                .help(help),
        );
    }
}

fn against(scenario: &Scenario) -> Vec<Against> {
    let mut list: Vec<Against> = Vec::new();
    if scenario.particles.shares.is_some() {
        list.push((
            "particles that carry mass: there is nothing between them to exchange",
            Some(scenario.particles.kind_span),
            "write `particles fluid` and a number, or leave `exchange` out",
        ));
    }
    if let Some(flow) = scenario.flow.as_ref().filter(|flow| !matches!(flow.value, Flow::Uniform(_))) {
        list.push(("a flow that varies", Some(flow.span), "use `flow uniform`"));
    }
    match scenario.dispersion.as_ref().map(|dispersion| (&dispersion.value, dispersion.span)) {
        None => list.push((
            "no dispersion, which is what an exchange does",
            None,
            "add for example `dispersion 1e-9 m^2/s`",
        )),
        Some((Dispersion::Isotropic(_), span)) => list.push((
            "dispersion that varies with the place",
            Some(span),
            "give the dispersion one value, or a tensor of constants",
        )),
        Some(_) => {}
    }
    if let Some(medium) = scenario.medium.as_ref().filter(|medium| medium.value.value().is_none()) {
        list.push(("porosity that varies with the place", Some(medium.span), "give the porosity one value"));
    }
    if let Some(span) = side_with_a_rule(scenario) {
        let help = "let the sides reflect, be periodic or open, each as a whole";
        list.push(("a side that lets water in or out, or takes what it carries", Some(span), help));
    }
    list
}

/// The first side that is more than a wall, periodic or open.
fn side_with_a_rule(scenario: &Scenario) -> Option<Span> {
    let patches = scenario.domain.axes.iter().flat_map(|axis| axis.patches.iter().flatten());
    let is_simple = |rule: &SideRule| matches!(rule, SideRule::Reflect | SideRule::Periodic | SideRule::Open);
    patches.into_iter().find(|patch| !patch.limits.is_empty() || !is_simple(&patch.rule)).map(|it| it.span)
}

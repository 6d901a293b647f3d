//! Scenes in which parcels cannot exchange with those around them, told at the statement that stands against it.
//!
//! Owns these messages (M036). May use the scenario. It deliberately asks nothing of numbers: whether there is
//! dispersion along all axes is known when a plan is made.

use super::Scenario;
use super::check::Checker;
use super::transport::SideRule;
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
                .expected("parcels of water, dispersion, and sides that take nothing from parcels")
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
    if scenario.dispersion.is_none() {
        list.push((
            "no dispersion, which is what an exchange does",
            None,
            "add for example `dispersion 1e-9 m^2/s`",
        ));
    }
    if let Some(span) = side_that_takes(scenario) {
        let help = "let the side reflect, be periodic or open, or let water in or out (`inflow`, `outflow`)";
        list.push(("a side that takes or gives what parcels carry", Some(span), help));
    }
    list
}

/// The first side that takes or gives what parcels carry without the parcels themselves: they touch it by walking, and
/// what is exchanged does not walk.
fn side_that_takes(scenario: &Scenario) -> Option<Span> {
    let patches = scenario.domain.axes.iter().flat_map(|axis| axis.patches.iter().flatten());
    let takes = |rule: &SideRule| matches!(rule, SideRule::Absorb | SideRule::Partial(_) | SideRule::Held(_));
    patches.into_iter().find(|patch| takes(&patch.rule)).map(|it| it.span)
}

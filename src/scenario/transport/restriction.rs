//! What particles of a kind cannot do in this version, told at the statement that asks for it.
//!
//! Owns these messages (M025, M026). May use the scenario. It deliberately changes nothing.

use super::super::check::Checker;
use super::super::expression::Expr;
use super::super::{OutputKind, Rate, Scenario};
use super::{DarcySide, Dispersion, Flow, Patch, SideRule};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{M025, M026, M032};
use crate::source::Span;

/// Reports everything that the particles of a scene cannot do.
pub fn check(checker: &mut Checker<'_>, scenario: &Scenario) {
    super::super::station::check_wells(checker, scenario);
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

/// The first expression of flow or sides that reads the time.
fn changing(scenario: &Scenario) -> Option<Span> {
    let mut list: Vec<&Expr> = Vec::new();
    match scenario.flow.as_ref().map(|flow| &flow.value) {
        Some(Flow::Expression(exprs, _)) => list.extend(exprs),
        Some(Flow::Darcy(darcy)) => {
            list.extend(darcy.sides.iter().flatten().filter_map(DarcySide::value));
            list.extend(darcy.wells.iter().map(|well| &well.rate));
        }
        Some(Flow::Uniform(_) | Flow::File(_)) | None => {}
    }
    for patch in scenario.domain.axes.iter().flat_map(|axis| axis.patches.iter().flatten()) {
        if let SideRule::Inflow(own) | SideRule::Held(own) = &patch.rule {
            list.extend(own.iter().map(|(_, c)| c));
        }
    }
    list.into_iter().find(|expr| expr.reads_time()).map(|expr| expr.span)
}

/// What only masses can do.
fn of_fluid(checker: &mut Checker<'_>, scenario: &Scenario) {
    let mut wrong: Vec<(&str, Span, &str)> = Vec::new();
    const MASSES: &str = "write `particles mass` and a number: particles that carry mass can do this";
    if let Some(source) = scenario.sources.first() {
        wrong.push(("sources", source.span, MASSES));
    }
    if let Some(span) = scenario.species.iter().find_map(|species| species.own_transport) {
        wrong.push(("species with a retardation or diffusion of their own", span, MASSES));
    }
    let patches: Vec<&Patch> =
        scenario.domain.axes.iter().flat_map(|axis| axis.patches.iter().flatten()).collect();
    let brings = |patch: &&&Patch| matches!(patch.rule, SideRule::Inflow(_) | SideRule::Held(_));
    let is_open = patches.iter().any(|patch| patch.rule == SideRule::Open);
    if let Some(patch) = patches.iter().find(brings).filter(|_| is_open) {
        let help = "let the `open` sides be `outflow`: what comes in must be able to go";
        wrong.push(("sides that let water in beside `open` ones", patch.span, help));
    }
    let rests = |patch: &&&Patch| match &patch.rule {
        SideRule::Inflow(list) | SideRule::Held(list) => {
            list.iter().any(|(species, _)| scenario.species[*species].is_immobile)
        }
        _ => false,
    };
    if let Some(patch) = patches.iter().find(rests) {
        let help = "leave the species that stays where it is out of this statement";
        wrong.push(("water that brings what stays where it is", patch.span, help));
    }
    let is_plain = |patch: &&Patch| {
        patch.limits.is_empty()
            && matches!(patch.rule, SideRule::Reflect | SideRule::Periodic | SideRule::Open)
    };
    let is_plain = is_uniform(scenario) && patches.iter().all(is_plain);
    counted(checker, scenario, is_plain);
    if let Some(span) = moving_walls(scenario).filter(|_| !is_plain) {
        let help = "leave `frame moving` out, or let the sides be `open`";
        wrong.push(("walls that move with the frame", span, help));
    }
    if let Some(span) = changing(scenario) {
        wrong.push(("flow or sides that change in time", span, MASSES));
    }
    if let Some(Flow::Darcy(darcy)) = scenario.flow.as_ref().map(|flow| &flow.value)
        && let Some((_, carried)) = darcy.wells.iter().find_map(|well| well.carrying.first())
    {
        wrong.push(("wells that carry something", carried.span, MASSES));
    }
    // What one edit mends is one mistake.
    let (of_masses, others): (Vec<_>, Vec<_>) = wrong.into_iter().partition(|(_, _, help)| *help == MASSES);
    let names: Vec<&str> = of_masses.iter().map(|(what, ..)| *what).collect();
    if let Some(((_, span, help), rest)) = of_masses.split_first() {
        let message = no_fluid(scenario, &names.join(", no "), *span, help);
        checker.report(rest.iter().fold(message, |message, (_, span, _)| message.also(*span, "nor this")));
    }
    for (what, span, help) in others {
        checker.report(no_fluid(scenario, what, span, help));
    }
}

fn no_fluid(scenario: &Scenario, what: &str, span: Span, help: &str) -> Diagnostic {
    Diagnostic::error(M026, format!("fluid particles have no {what}"))
        .at(span, "not with particles of fluid")
        .also(scenario.particles.kind_span, "particles of fluid")
        .found(what)
        .expected("what parcels of water can do")
        .help(help)
}

/// Outputs of what passes need water that is followed on its way, and amounts that are carried.
fn counted(checker: &mut Checker<'_>, scenario: &Scenario, is_plain: bool) {
    let counted = scenario.outputs.iter().filter(|output| output.kind.counts_passages());
    for output in counted {
        let word = output.kind.word();
        let mut report = |what: &str, found: String, expected: &str, help: &str| {
            checker.report(
                Diagnostic::error(M032, format!("`{word}` {what}"))
                    .at(output.span, "what comes and goes is counted")
                    .also(scenario.particles.kind_span, "particles of fluid")
                    .found(found)
                    .expected(expected)
                    .help(help),
            );
        };
        if is_plain {
            report(
                "needs particles that carry mass, or water that comes in and goes out",
                "fluid in uniform flow between sides that nothing goes through".into(),
                "`particles mass`, or sides such as `inflow` and `outflow`",
                "with fluid particles `profile`, `map`, `total`, `moments` and `dilution` tell where a species is",
            );
            return;
        }
        let at_once = |species: &&usize| reacts_at_once(scenario, **species);
        if output.kind == OutputKind::Budget
            && let Some(&species) = output.species.iter().find(at_once)
        {
            let name = &scenario.species[species].name;
            report(
                "is of what parcels carry",
                format!("`{name}`, which follows from what they carry when somebody looks"),
                "species without instant reactions or equilibria",
                "leave it out; `total` gives its amount, `breakthrough` what leaves through a side",
            );
            return;
        }
    }
}

/// Whether a species is worked out when somebody looks.
fn reacts_at_once(scenario: &Scenario, species: usize) -> bool {
    let is_at_once = |rate: &Rate| matches!(rate, Rate::Instant | Rate::Equilibrium(_));
    scenario
        .reactions
        .iter()
        .filter(|reaction| is_at_once(&reaction.rate))
        .any(|own| own.reactants.iter().chain(&own.products).any(|(other, _)| *other == species))
}

/// Whether coefficients are the same everywhere.
fn is_uniform(scenario: &Scenario) -> bool {
    let flow = scenario.flow.as_ref().map(|flow| &flow.value);
    let dispersion = scenario.dispersion.as_ref().map(|dispersion| &dispersion.value);
    matches!(flow, None | Some(Flow::Uniform(_)))
        && !matches!(dispersion, Some(Dispersion::Isotropic(_)))
        && scenario.medium.as_ref().is_none_or(|medium| Expr::value(&medium.value).is_some())
}

//! Species and reactions to components, rates and equilibria.
//!
//! Owns what particles carry for the sake of chemistry: one component for each species, mobile ones first,
//! and in equilibrium one for the total of each primary species. May use `eliminate`, the tape and the
//! scenario. It deliberately leaves nothing out: the passes do.

use super::build_tape::{build_rates, build_tape};
use super::chemistry::{
    Activity, Chemistry, Equilibrium, Kinetic, Kinetics, Law, Laws, Method, Mineral, Primary, Secondary,
};
use super::eliminate::{Balance, Elimination, EliminationError, Written, eliminate};
use super::law::recognise;
use super::lower::too_large;
use super::{Axis, Component, Species};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{M022, M023, M024};
use crate::maths::operator::Binary;
use crate::scenario::expression::{Expr, Node, Type};
use crate::scenario::{self, Rate, Scenario};
use crate::units::Dimension;

/// What chemistry makes of the species of a scene.
pub(super) struct Network {
    pub species: Vec<Species>,
    pub components: Vec<Component>,
    pub chemistry: Option<Chemistry>,
    /// What one unit of each species adds to the components.
    pub totals: Vec<Vec<(usize, f64)>>,
    pub warnings: Vec<Diagnostic>,
}

/// Of the largest initial value of its kind: below it, accuracy is absolute.
const FLOOR: f64 = 1e-9;

pub(super) fn network(scenario: &Scenario, axes: &[Axis]) -> Result<Network, Vec<Diagnostic>> {
    let found = eliminated(scenario).map_err(|message| vec![*message])?;
    let carried = Carried::new(scenario, &found);
    let mut problems = Vec::new();
    check_outputs(scenario, &carried, &mut problems);
    check_settings(scenario, &carried, &mut problems);
    let components = components(scenario, &carried, &mut problems);
    if crate::diagnostic::any_fatal(&problems) {
        return Err(problems);
    }
    let floors = floors(scenario, axes, &carried, &components);
    let kinetics = kinetics(scenario, &carried, &floors, &mut problems);
    if crate::diagnostic::any_fatal(&problems) {
        return Err(problems);
    }
    let equilibrium = equilibrium(scenario, &found, &carried);
    let settings = &scenario.chemistry;
    let chemistry = (kinetics.is_some() || equilibrium.is_some()).then_some(Chemistry {
        kinetics,
        equilibrium,
        tolerance: settings.tolerance,
        floors,
        splitting: settings.splitting,
        integrator: settings.integrator,
    });
    let species = |(idx, species): (usize, &scenario::Species)| Species {
        name: species.name.clone(),
        constant: 0.0,
        terms: carried.component_of[idx].map(|component| (component, 1.0)).into_iter().collect(),
        is_molar: species.dimension == Dimension::MOLAR_CONCENTRATION,
    };
    let species = scenario.species.iter().enumerate().map(species).collect();
    let totals = (0..scenario.species.len()).map(|species| carried.totals(species)).collect();
    Ok(Network { species, components, chemistry, totals, warnings: problems })
}

/// Which species have a component, and which totals the others add to.
struct Carried<'f> {
    /// Species of the components, in their order.
    order: Vec<usize>,
    component_of: Vec<Option<usize>>,
    found: &'f Elimination,
}

impl<'f> Carried<'f> {
    fn new(scenario: &Scenario, found: &'f Elimination) -> Self {
        let is_written = |species: &usize| {
            found.secondaries.iter().chain(&found.minerals).any(|written| written.species == *species)
        };
        let is_immobile = |species: &usize| is_immobile(scenario, *species);
        let own: Vec<usize> = (0..scenario.species.len()).filter(|species| !is_written(species)).collect();
        // What lives in bins comes last.
        let (resting, moving): (Vec<usize>, Vec<usize>) = own.into_iter().partition(is_immobile);
        let order = [moving, resting].concat();
        let component_of =
            (0..scenario.species.len()).map(|species| order.iter().position(|own| *own == species)).collect();
        Self { order, component_of, found }
    }

    /// How a species over primary ones is written, if it is.
    fn written(&self, species: usize) -> Option<&Written> {
        self.found.secondaries.iter().chain(&self.found.minerals).find(|it| it.species == species)
    }

    /// What one unit of a species adds to the components.
    fn totals(&self, species: usize) -> Vec<(usize, f64)> {
        match (self.component_of[species], self.written(species)) {
            (Some(component), _) => vec![(component, 1.0)],
            (None, Some(written)) => {
                let total = |(primary, nu): &(usize, f64)| {
                    Some((self.component_of[self.found.primaries[*primary]]?, *nu))
                };
                written.coefficients.iter().filter_map(total).collect()
            }
            (None, None) => Vec::new(),
        }
    }
}

/// Where nothing moves, everything stays with its particle.
fn is_immobile(scenario: &Scenario, species: usize) -> bool {
    scenario.species[species].is_immobile && scenario.has_transport()
}

fn eliminated(scenario: &Scenario) -> Result<Elimination, Box<Diagnostic>> {
    let is_mineral: Vec<bool> = scenario.species.iter().map(|species| species.is_mineral).collect();
    let mut balances = Vec::new();
    let mut reactions = Vec::new();
    for reaction in &scenario.reactions {
        let Rate::Equilibrium(constant) = reaction.rate else { continue };
        let reactants = reaction.reactants.iter().map(|(species, nu)| (*species, -nu));
        let coefficients = reactants.chain(reaction.products.iter().copied()).collect();
        balances.push(Balance { coefficients, ln_constant: crate::maths::scalar::ln(constant) });
        reactions.push(reaction);
    }
    eliminate(&is_mineral, &balances).map_err(|error| Box::new(impossible(scenario, &reactions, &error)))
}

fn impossible(
    scenario: &Scenario,
    reactions: &[&scenario::Reaction],
    error: &EliminationError,
) -> Diagnostic {
    let name = |species: &usize| format!("`{}`", scenario.species[*species].name);
    let names = |list: &[usize]| list.iter().map(name).collect::<Vec<_>>().join(", ");
    let of_reactions = |list: &[usize], message: &str, found: &str, help: &str| {
        let mut told = Diagnostic::error(M022, message);
        for (place, &idx) in list.iter().enumerate() {
            let span = reactions[idx].span;
            told = if place == 0 { told.at(span, "this one") } else { told.also(span, "and this one") };
        }
        told.found(found).expected("reactions of which none follows from the others").help(help)
    };
    let of_minerals = |list: &[usize], message: &str, found: &str| {
        let mut told = Diagnostic::error(M022, message);
        for (place, &species) in list.iter().enumerate() {
            let span = scenario.species[species].span;
            told = if place == 0 { told.at(span, "this mineral") } else { told.also(span, "and this one") };
        }
        told.found(found)
    };
    match error {
        EliminationError::Redundant { reactions } => of_reactions(
            reactions,
            "one reaction in equilibrium says what the others say already",
            "reactions that add up to nothing",
            "delete one of them",
        ),
        EliminationError::Contradiction { reactions } => of_reactions(
            reactions,
            "reactions in equilibrium contradict each other",
            "reactions that add up to nothing, with constants that do not",
            "delete one of them, or correct its constant",
        ),
        EliminationError::NoSolubility { mineral } => of_minerals(
            &[*mineral],
            &format!("nothing says when {} dissolves", name(mineral)),
            "only reactions that are also those of other minerals",
        )
        .expected("a reaction in equilibrium of this mineral and what it dissolves into"),
        EliminationError::PhaseRule { minerals } => of_minerals(
            minerals,
            &format!("{} would be in equilibrium in any proportion", names(minerals)),
            "more phases than the phase rule allows",
        )
        .expected("minerals that are not saturated together in every solution"),
        EliminationError::NeverSaturated { minerals } => of_minerals(
            minerals,
            &format!("no solution is at or below saturation with {}", names(minerals)),
            "solubilities that exclude each other",
        )
        .expected("constants with which all of them can be dissolved"),
    }
}

/// Means over particles exist of what is carried: of totals, not of single species in equilibrium.
fn check_outputs(scenario: &Scenario, carried: &Carried<'_>, problems: &mut Vec<Diagnostic>) {
    for output in &scenario.outputs {
        let members = output.pairs.iter().flat_map(|&(a, b)| [a, b]);
        let Some(species) = members.into_iter().find(|&idx| carried.written(idx).is_some()) else { continue };
        let name = &scenario.species[species].name;
        let primaries: Vec<String> = (carried.found.primaries.iter())
            .map(|&idx| format!("`{}`", scenario.species[idx].name))
            .collect();
        problems.push(
            Diagnostic::error(M023, format!("`{name}` has no `{}`", output.kind.word()))
                .at(output.span, format!("`{name}` follows from others in equilibrium"))
                .also(scenario.species[species].span, "this species")
                .found(format!("`{name}`"))
                .expected(format!("species whose totals are carried: {}", primaries.join(", ")))
                .note("for these the totals are meant, free and bound together"),
        );
    }
}

/// Settings that lack what they need, or have nothing to act on.
fn check_settings(scenario: &Scenario, carried: &Carried<'_>, problems: &mut Vec<Diagnostic>) {
    let found = carried.found;
    let settings = &scenario.chemistry;
    let Some(span) = settings.span else { return };
    let reacts = scenario.reactions.iter().any(|reaction| reaction.rate != Rate::Instant);
    if !reacts {
        problems.push(
            Diagnostic::warning(M024, "`chemistry` has nothing to act on")
                .at(span, "no reaction at a rate or in equilibrium")
                .found("no such reaction")
                .expected("a reaction with a rate or in equilibrium")
                .help("leave the statement out"),
        );
        return;
    }
    if settings.activity == Activity::Ideal {
        return;
    }
    let written = found.secondaries.iter().map(|written| written.species);
    let members: Vec<&scenario::Species> =
        found.primaries.iter().copied().chain(written).map(|idx| &scenario.species[idx]).collect();
    if members.is_empty() {
        problems.push(
            Diagnostic::warning(M024, "`activity` has nothing to act on")
                .at(span, "no reaction in equilibrium")
                .found("no such reaction")
                .expected("a reaction in equilibrium")
                .help("rate laws take `davies(z, I)` and `debye_huckel(z, I)` as factors"),
        );
    } else if let Some(species) = members.iter().find(|species| species.charge.is_none()) {
        problems.push(
            Diagnostic::error(M024, format!("the activity of `{}` needs its charge", species.name))
                .at(species.span, "without `charge`")
                .also(span, "activities are asked for here")
                .found("no `charge`")
                .expected("the charge of every species in equilibrium")
                .help("add for example `charge 2`, `charge -1`, or `charge 0`"),
        );
    } else if let Some(species) = spectators(scenario, carried)
        .into_iter()
        .map(|idx| &scenario.species[idx])
        .find(|species| species.dimension == Dimension::MASS_CONCENTRATION)
    {
        problems.push(
            Diagnostic::error(M024, format!("the ionic strength needs `{}` as an amount", species.name))
                .at(species.span, "a mass concentration, with a charge")
                .also(span, "activities are asked for here")
                .found(Dimension::MASS_CONCENTRATION.describe())
                .expected(Dimension::MOLAR_CONCENTRATION.describe())
                .help("give its initial concentration in mol/L, or leave its `charge` out"),
        );
    } else if settings.activity == Activity::ExtendedDebyeHuckel
        && let Some(species) =
            members.iter().find(|species| species.charge != Some(0.0) && species.ion_size.is_none())
    {
        problems.push(
            Diagnostic::error(M024, format!("the activity of `{}` needs its size", species.name))
                .at(species.span, "without `ion_size`")
                .also(span, "extended Debye-Hückel is asked for here")
                .found("no `ion_size`")
                .expected("the size of every ion in equilibrium")
                .help("add for example `ion_size 6e-10 m`, or take `activity davies`"),
        );
    }
}

fn components(scenario: &Scenario, carried: &Carried<'_>, problems: &mut Vec<Diagnostic>) -> Vec<Component> {
    let mut list = Vec::new();
    for (component, &own) in carried.order.iter().enumerate() {
        let species = &scenario.species[own];
        let mut initial = species.initial.clone();
        for written in carried.found.secondaries.iter().chain(&carried.found.minerals) {
            let other = &scenario.species[written.species].initial;
            let totals = carried.totals(written.species);
            let share = totals.iter().find(|(idx, _)| *idx == component).map(|(_, nu)| *nu);
            if let Some(nu) = share.filter(|_| other.value() != Some(0.0)) {
                let (kind, span) = (initial.kind, initial.span);
                let factor = Expr::constant(nu, Type::Number(Dimension::NONE), span);
                let added = Expr::binary(Binary::Multiply, factor, other.clone(), kind, span);
                initial = Expr::binary(Binary::Add, initial, added, kind, span);
            }
        }
        match build_tape(&initial, &scenario.species) {
            Some(initial) => list.push(Component {
                name: species.name.clone(),
                initial,
                is_immobile: is_immobile(scenario, own),
            }),
            None => problems.push(too_large(species.initial.span)),
        }
    }
    list
}

/// Per component: what the scene says for its dimension, or a small part of the largest initial value.
fn floors(scenario: &Scenario, axes: &[Axis], carried: &Carried<'_>, components: &[Component]) -> Vec<f64> {
    let points = super::time_scales::sample_points(axes);
    let largest = |dimension: Dimension| {
        let own = |component: &usize| scenario.species[carried.order[*component]].dimension == dimension;
        let largest = (0..components.len())
            .filter(own)
            .flat_map(|idx| points.iter().map(move |&[x, y, z]| (idx, [x, y, z, 0.0])))
            .map(|(idx, inputs)| components[idx].initial.evaluate(&inputs).abs())
            .filter(|value| value.is_finite())
            .fold(0.0, f64::max);
        // A scene that starts with nothing has no scale: one mol/m³ or kg/m³.
        if largest > 0.0 { largest } else { 1.0 }
    };
    let of = |dimension: Dimension| match scenario.chemistry.floor {
        Some((floor, own)) if own == dimension => floor,
        _ => FLOOR * largest(dimension),
    };
    let (molar, mass) = (of(Dimension::MOLAR_CONCENTRATION), of(Dimension::MASS_CONCENTRATION));
    let is_molar = |species: &usize| scenario.species[*species].dimension == Dimension::MOLAR_CONCENTRATION;
    carried.order.iter().map(|species| if is_molar(species) { molar } else { mass }).collect()
}

/// Reactions at finite rates, those that change nothing left out.
fn kinetics(
    scenario: &Scenario,
    carried: &Carried<'_>,
    floors: &[f64],
    problems: &mut Vec<Diagnostic>,
) -> Option<Kinetics> {
    let mut reactions = Vec::new();
    let mut rates = Vec::new();
    for reaction in &scenario.reactions {
        let (law, rate) = match &reaction.rate {
            Rate::Instant | Rate::Equilibrium(_) => continue,
            Rate::MassAction(constant) => mass_action(scenario, constant, &reaction.reactants),
            Rate::Law(rate) => (recognise(rate), rate.clone()),
        };
        let net = net(reaction);
        let rate = until_nothing_is_left(scenario, carried, floors, rate, &net);
        let mut changes: Vec<(usize, f64)> = Vec::new();
        for (species, nu) in net {
            for (component, share) in carried.totals(species) {
                match changes.iter_mut().find(|(known, _)| *known == component) {
                    Some((_, sum)) => *sum += nu * share,
                    None => changes.push((component, nu * share)),
                }
            }
        }
        changes.retain(|(_, change)| change.abs() > 1e-14);
        changes.sort_unstable_by_key(|(component, _)| *component);
        if !changes.is_empty() {
            reactions.push(Kinetic { name: reaction.name.clone(), changes, law });
            rates.push(rate);
        }
    }
    if reactions.is_empty() {
        return None;
    }
    let Some((operations, rates)) = build_rates(&rates) else {
        let largest = scenario.reactions.iter().max_by_key(|reaction| match &reaction.rate {
            Rate::Law(rate) | Rate::MassAction(rate) => rate.size,
            Rate::Instant | Rate::Equilibrium(_) => 0,
        });
        problems.extend(largest.map(|reaction| too_large(reaction.rate_span)));
        return None;
    };
    Some(Kinetics { reactions, laws: Laws { operations, rates }, method: Method::Rosenbrock })
}

/// What one unit of extent makes of each species.
pub(super) fn net(reaction: &scenario::Reaction) -> Vec<(usize, f64)> {
    let mut list: Vec<(usize, f64)> = Vec::new();
    let reactants = reaction.reactants.iter().map(|(species, nu)| (*species, -nu));
    for (species, nu) in reactants.chain(reaction.products.iter().copied()) {
        match list.iter_mut().find(|(known, _)| *known == species) {
            Some((_, sum)) => *sum += nu,
            None => list.push((species, nu)),
        }
    }
    list.retain(|(_, nu)| nu.abs() > 1e-14);
    list
}

/// `k Π c^ν` and, where k is a constant, what kind of law it is.
pub(super) fn mass_action(scenario: &Scenario, constant: &Expr, reactants: &[(usize, f64)]) -> (Law, Expr) {
    let span = constant.span;
    let plain = Type::Number(Dimension::NONE);
    let mut rate = constant.clone();
    for &(idx, nu) in reactants {
        let species = Expr::leaf(Node::Species(idx), scenario.species[idx].dimension, span);
        let factor = match nu {
            1.0 => species,
            _ => Expr::binary(Binary::Power, species, Expr::constant(nu, plain, span), plain, span),
        };
        rate = Expr::binary(Binary::Multiply, rate, factor, plain, span);
    }
    (recognise(&rate), rate)
}

/// A rate that names no species would go on where a reactant has run out: it ends within the floor.
fn until_nothing_is_left(
    scenario: &Scenario,
    carried: &Carried<'_>,
    floors: &[f64],
    rate: Expr,
    net: &[(usize, f64)],
) -> Expr {
    if rate.names_species() {
        return rate;
    }
    let span = rate.span;
    let plain = Type::Number(Dimension::NONE);
    let spent = net.iter().filter(|(_, nu)| *nu < 0.0);
    spent.fold(rate, |rate, &(idx, _)| {
        let totals = carried.totals(idx);
        let floor = totals.first().map_or(FLOOR, |(component, _)| floors[*component]);
        let species = Expr::leaf(Node::Species(idx), scenario.species[idx].dimension, span);
        let left = Expr::binary(Binary::Divide, species, Expr::constant(floor, plain, span), plain, span);
        let share = Expr::binary(Binary::Minimum, Expr::constant(1.0, plain, span), left, plain, span);
        Expr::binary(Binary::Multiply, rate, share, plain, span)
    })
}

/// Ions that take part in no equilibrium: where activities are asked for, the ionic strength is theirs, too.
fn spectators(scenario: &Scenario, carried: &Carried<'_>) -> Vec<usize> {
    if scenario.chemistry.activity == Activity::Ideal {
        return Vec::new();
    }
    let is_ion = |species: &usize| {
        scenario.species[*species].charge.is_some_and(|charge| charge != 0.0)
            && !carried.found.primaries.contains(species)
            && carried.written(*species).is_none()
            && !is_immobile(scenario, *species)
    };
    (0..scenario.species.len()).filter(is_ion).collect()
}

fn equilibrium(scenario: &Scenario, found: &Elimination, carried: &Carried<'_>) -> Option<Equilibrium> {
    if found.primaries.is_empty() && found.secondaries.is_empty() && found.minerals.is_empty() {
        return None;
    }
    let charge = |species: usize| scenario.species[species].charge.unwrap_or(0.0);
    let ion_size = |species: usize| scenario.species[species].ion_size.unwrap_or(0.0);
    let primary = |&species: &usize| Primary {
        species,
        charge: charge(species),
        ion_size: ion_size(species),
        constant: 0.0,
        terms: carried.totals(species),
    };
    let secondary = |written: &Written| Secondary {
        species: written.species,
        charge: charge(written.species),
        ion_size: ion_size(written.species),
        ln_constant: written.ln_constant,
        coefficients: written.coefficients.clone(),
    };
    let mineral = |written: &Written| Mineral {
        species: written.species,
        ln_solubility: written.ln_constant,
        coefficients: written.coefficients.clone(),
    };
    let others = spectators(scenario, carried);
    Some(Equilibrium {
        primaries: found.primaries.iter().chain(&others).map(primary).collect(),
        secondaries: found.secondaries.iter().map(secondary).collect(),
        minerals: found.minerals.iter().map(mineral).collect(),
        activity: scenario.chemistry.activity,
    })
}

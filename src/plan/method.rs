//! How rates are integrated, as far as the structure of the network says it.
//!
//! Owns the choice between closed forms and integrators. May use the plan's types. It deliberately looks at
//! no number but those that must be constant: time scales are looked at elsewhere.

use super::Plan;
use super::chemistry::{Integrator, Kinetic, Kinetics, Law, Method};

/// Chooses again after the network has changed. A network that is propagated when somebody looks stays so:
/// its parts are networks of that kind.
pub(super) fn choose(plan: &mut Plan) {
    let species_of = species_of_components(plan);
    let immobile: Vec<bool> = plan.components.iter().map(|component| component.is_immobile).collect();
    let changes_water = plan.transport.as_ref().is_some_and(super::transport::Transport::changes_water);
    // What has left is not there when somebody looks.
    let changes_water = changes_water || plan.outputs.iter().any(|output| output.kind.counts_passages());
    // Particles that carry mass carry what has reacted.
    let changes_water = changes_water || plan.reacting().is_some();
    let Some(chemistry) = &mut plan.chemistry else { return };
    let is_closed = chemistry.equilibrium.is_none();
    let integrator = chemistry.integrator;
    let Some(kinetics) = &mut chemistry.kinetics else { return };
    if kinetics.method == Method::Observed {
        return;
    }
    kinetics.method = match (integrator, species_of) {
        (Integrator::Explicit, _) => Method::Explicit,
        (Integrator::Rosenbrock, _) => Method::Rosenbrock,
        (Integrator::Auto, Some(species_of)) if is_closed => {
            let method = match closed_form(kinetics, &species_of, &immobile) {
                // Water that comes in later has reacted for a shorter time.
                Method::Observed if changes_water => Method::Exponential,
                method => method,
            };
            if method == Method::Observed {
                // What particles carry stays unreacted: the changes are those of species.
                let changes = kinetics.reactions.iter_mut().flat_map(|reaction| &mut reaction.changes);
                changes.for_each(|(component, _)| *component = species_of[*component]);
            }
            method
        }
        (Integrator::Auto, _) => Method::Rosenbrock,
    };
}

/// The species that each component is; `None` if one is no species by itself.
fn species_of_components(plan: &Plan) -> Option<Vec<usize>> {
    let of = |component: usize| {
        plan.species.iter().position(|species| species.constant == 0.0 && species.terms == [(component, 1.0)])
    };
    (0..plan.components.len()).map(of).collect()
}

fn closed_form(kinetics: &Kinetics, species_of: &[usize], immobile: &[bool]) -> Method {
    let consumed = |reaction: &Kinetic| -> Vec<usize> {
        let below = reaction.changes.iter().filter(|(_, change)| *change < 0.0);
        below.map(|(component, _)| species_of[*component]).collect()
    };
    let is_first_order = |reaction: &Kinetic| match &reaction.law {
        Law::MassAction { orders, .. } => match orders[..] {
            [] => consumed(reaction).is_empty(),
            // What is consumed in proportion to something else could end below zero.
            [(species, 1.0)] => consumed(reaction).iter().all(|other| *other == species),
            _ => false,
        },
        Law::Saturation { .. } | Law::Expression => false,
    };
    if kinetics.reactions.iter().all(is_first_order) {
        let named = |reaction: &Kinetic| match &reaction.law {
            Law::MassAction { orders, .. } => orders.iter().map(|(species, _)| *species).collect(),
            Law::Saturation { .. } | Law::Expression => Vec::new(),
        };
        let is_immobile = |species: usize| {
            species_of.iter().position(|other| *other == species).is_some_and(|component| immobile[component])
        };
        let touches_bins = kinetics.reactions.iter().any(|reaction| {
            reaction.changes.iter().any(|(component, _)| immobile[*component])
                || named(reaction).into_iter().any(is_immobile)
        });
        return if touches_bins { Method::Exponential } else { Method::Observed };
    }
    let [reaction] = &kinetics.reactions[..] else { return Method::Rosenbrock };
    let consumed = consumed(reaction);
    match &reaction.law {
        Law::MassAction { orders, .. } if orders.is_empty() => Method::Zero,
        Law::MassAction { orders, .. } => {
            let is_pair = match orders[..] {
                [(_, first), (_, second)] => first == 1.0 && second == 1.0,
                [(_, power)] => power == 2.0,
                _ => false,
            };
            let is_spent = orders.iter().all(|(species, _)| consumed.contains(species));
            if is_pair && is_spent && consumed.len() == orders.len() {
                Method::Pair
            } else {
                Method::Rosenbrock
            }
        }
        Law::Saturation { species, .. } if consumed == [*species] => Method::Saturation,
        Law::Saturation { .. } | Law::Expression => Method::Rosenbrock,
    }
}

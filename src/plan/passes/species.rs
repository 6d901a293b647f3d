//! Liveness of species, backwards from the outputs: what nobody reads is neither carried nor reacted.

use super::{Draft, network};
use crate::plan::evaluation::{Field, Scalar};
use crate::plan::transport::{SideRule, Transport};
use crate::plan::{Plan, Quantity, Stage};

pub(super) fn run(draft: &mut Draft) {
    let is_read = read_species(&draft.plan);
    let names: Vec<String> = draft.plan.species.iter().map(|species| species.name.clone()).collect();
    let dead: Vec<&str> =
        names.iter().zip(&is_read).filter(|(_, is_read)| !**is_read).map(|(name, _)| name.as_str()).collect();
    let is_live = |reaction: &crate::plan::InstantReaction| {
        reaction.reactants.iter().chain(&reaction.products).any(|(species, _)| is_read[*species])
    };
    let idle: Vec<String> =
        draft.plan.reactions.iter().filter(|r| !is_live(r)).map(|r| r.name.clone()).collect();
    draft.plan.reactions.retain(is_live);
    for name in idle {
        draft.leave_out(format!("reaction `{name}`"), "no output reads any of its species");
    }
    if !dead.is_empty() {
        let word = if dead.len() == 1 { "species" } else { "species " };
        let list = dead.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        draft.leave_out(format!("{} {list}", word.trim()), "no output reads it, alone or through a reaction");
    }
    let is_chemistry_read = network::species_of_chemistry(&draft.plan)
        .iter()
        .zip(&is_read)
        .any(|(own, is_read)| *own && *is_read);
    if !is_chemistry_read && draft.plan.chemistry.take().is_some() {
        draft.leave_out("reactions at rates and in equilibrium", "no output reads any of their species");
    }
    remove(draft, &is_read);
    let Some(transport) = &mut draft.plan.transport else { return };
    if transport.decay.as_ref().is_some_and(|decay| decay.reactions.is_empty()) {
        transport.decay = None;
        draft.plan.stages.retain(|stage| *stage != Stage::React);
        draft.leave_out("reactions", "no output reads any of their species");
    }
}

/// Species that outputs name, the reactants of every instant reaction that touches one of these, and
/// everything that the kinetics or equilibria which touch one of these are about.
fn read_species(plan: &Plan) -> Vec<bool> {
    let chemical = network::species_of_chemistry(plan);
    let mut is_read = vec![false; plan.species.len()];
    for quantity in plan.outputs.iter().flat_map(|output| &output.quantities) {
        match *quantity {
            Quantity::Species(a) => is_read[a] = true,
            Quantity::Pair(a, b) => {
                is_read[a] = true;
                is_read[b] = true;
            }
        }
    }
    loop {
        let before = is_read.clone();
        for reaction in &plan.reactions {
            let touches =
                reaction.reactants.iter().chain(&reaction.products).any(|(species, _)| is_read[*species]);
            if touches {
                reaction.reactants.iter().for_each(|(species, _)| is_read[*species] = true);
            }
        }
        for turn in plan.transport.iter().flat_map(|it| &it.decay).flat_map(|decay| &decay.reactions) {
            // Of what is read one must know what it comes from, not what it becomes.
            is_read[turn.population] |= turn.outcomes.iter().any(|(to, _)| is_read[*to]);
        }
        if (0..is_read.len()).any(|species| is_read[species] && chemical[species]) {
            is_read.iter_mut().zip(&chemical).for_each(|(is_read, chemical)| *is_read |= chemical);
        }
        if before == is_read {
            return is_read;
        }
    }
}

/// Drops the species that are not read, with their components, and renumbers the rest.
pub(super) fn remove(draft: &mut Draft, is_read: &[bool]) {
    let mut next = 0;
    let renumbered: Vec<Option<usize>> = is_read
        .iter()
        .map(|is_read| {
            let number = is_read.then_some(next);
            next += usize::from(*is_read);
            number
        })
        .collect();
    let plan = &mut draft.plan;
    retain_by(&mut plan.species, is_read);
    let is_carried: Vec<bool> = (0..plan.components.len())
        .map(|component| {
            plan.species.iter().any(|species| species.terms.iter().any(|(idx, _)| *idx == component))
        })
        .collect();
    retain_by(&mut plan.components, &is_carried);
    let new_component = |old: usize| is_carried[..old].iter().filter(|is_carried| **is_carried).count();
    if let Some(transport) = &mut plan.transport {
        renumber_transport(transport, is_read, &is_carried, &renumbered);
        if !transport.is_of_fluid {
            let populations = transport.populations.iter();
            plan.particles.count = populations.fold(0, |sum: u64, it| sum.saturating_add(it.count)).max(1);
        }
    }
    if let Some(chemistry) = &mut plan.chemistry {
        network::renumber(chemistry, &is_carried, &renumbered);
    }
    for species in &mut plan.species {
        species.terms.iter_mut().for_each(|(component, _)| *component = new_component(*component));
    }
    let renumber = |list: &mut Vec<(usize, f64)>| {
        *list = list.iter().filter_map(|(species, nu)| Some((renumbered[*species]?, *nu))).collect();
    };
    for reaction in &mut plan.reactions {
        renumber(&mut reaction.reactants);
        renumber(&mut reaction.products);
    }
    let quantity = |quantity: &mut Quantity| match quantity {
        Quantity::Species(a) => *a = renumbered[*a].unwrap_or(0),
        Quantity::Pair(a, b) => {
            *a = renumbered[*a].unwrap_or(0);
            *b = renumbered[*b].unwrap_or(0);
        }
    };
    plan.outputs.iter_mut().flat_map(|output| &mut output.quantities).for_each(quantity);
    renumber_evaluation(draft, &renumbered, &quantity);
}

/// Masses of species that nobody reads are not put in: no other species feels them. What becomes one of them is
/// gone.
fn renumber_transport(
    transport: &mut Transport,
    is_read: &[bool],
    is_carried: &[bool],
    renumbered: &[Option<usize>],
) {
    if let Some(decay) = &mut transport.decay {
        retain_by(&mut decay.weights, is_read);
        decay.reactions.retain(|turn| is_read[turn.population]);
        for turn in &mut decay.reactions {
            turn.population = renumbered[turn.population].unwrap_or(0);
            let outcomes = std::mem::take(&mut turn.outcomes);
            turn.outcomes =
                outcomes.into_iter().filter_map(|(to, chance)| Some((renumbered[to]?, chance))).collect();
        }
    }
    transport.populations.retain(|population| is_read[population.species]);
    transport.sources.retain(|source| is_read[source.species]);
    let of = |species: &mut usize| *species = renumbered[*species].unwrap_or(0);
    transport.populations.iter_mut().for_each(|population| of(&mut population.species));
    transport.sources.iter_mut().for_each(|source| of(&mut source.species));
    let is_kept = if transport.is_of_fluid { is_carried } else { is_read };
    retain_carried(transport, is_kept);
}

/// Keeps what sides bring of species, or of components.
pub(super) fn retain_carried(transport: &mut Transport, is_kept: &[bool]) {
    for patch in transport.sides.iter_mut().flatten().flatten() {
        if let SideRule::Inflow(tapes) | SideRule::Held(tapes) = &mut patch.rule {
            retain_by(tapes, is_kept);
        }
    }
}

/// References to species that nobody observes go; measures keep pointing at the right ones.
fn renumber_evaluation(draft: &mut Draft, renumbered: &[Option<usize>], quantity: &impl Fn(&mut Quantity)) {
    let lives = |target: &Quantity| match *target {
        Quantity::Species(a) => renumbered[a].is_some(),
        Quantity::Pair(a, b) => renumbered[a].is_some() && renumbered[b].is_some(),
    };
    let is_kept: Vec<bool> =
        draft.evaluation.references.iter().map(|reference| lives(&reference.target)).collect();
    retain_by(&mut draft.evaluation.references, &is_kept);
    draft.evaluation.references.iter_mut().for_each(|reference| quantity(&mut reference.target));
    // A measure can only name references that some output is compared with (M015), so none is lost here.
    for measure in &mut draft.evaluation.measures {
        renumber_scalar(&mut measure.value, &is_kept, quantity);
    }
}

fn renumber_scalar(scalar: &mut Scalar, is_kept: &[bool], quantity: &impl Fn(&mut Quantity)) {
    match scalar {
        Scalar::Number(_) | Scalar::Fact(_) | Scalar::Measure(_) => {}
        Scalar::Norm(_, _, field) => renumber_field(field, is_kept, quantity),
        Scalar::Unary(_, a) => renumber_scalar(a, is_kept, quantity),
        Scalar::Binary(_, a, b) => {
            renumber_scalar(a, is_kept, quantity);
            renumber_scalar(b, is_kept, quantity);
        }
    }
}

fn renumber_field(field: &mut Field, is_kept: &[bool], quantity: &impl Fn(&mut Quantity)) {
    match field {
        Field::Number(_) | Field::Position(_) => {}
        Field::Output(_, target) | Field::Column(_, target, _) => quantity(target),
        Field::Reference(idx) => *idx = is_kept[..*idx].iter().filter(|is_kept| **is_kept).count(),
        Field::Unary(_, a) => renumber_field(a, is_kept, quantity),
        Field::Binary(_, a, b) => {
            renumber_field(a, is_kept, quantity);
            renumber_field(b, is_kept, quantity);
        }
    }
}

/// Keeps the entries whose flag is set.
pub(super) fn retain_by<T>(list: &mut Vec<T>, is_kept: &[bool]) {
    let mut flags = is_kept.iter();
    list.retain(|_| flags.next().copied().unwrap_or(true));
}

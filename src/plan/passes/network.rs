//! Reactions whose course no output reads, and the species that only they concern.
//!
//! Liveness runs backwards: a species that is read needs its components; a component needs every reaction
//! that changes it; a reaction needs the species that its rate names, and those that it would take although
//! there are none. What is in equilibrium is needed as a whole or not at all.

use super::{Draft, species};
use crate::plan::build_tape::SPECIES_INPUT;
use crate::plan::chemistry::{Chemistry, Equilibrium, Kinetics, Law, Method};
use crate::plan::tape::{Operation, Register};
use crate::plan::{Plan, Quantity, method};

pub(super) fn run(draft: &mut Draft) {
    let plan = &draft.plan;
    let Some(kinetics) = plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref()) else {
        return;
    };
    let needs = needs(plan, kinetics);
    let names: Vec<String> = plan.species.iter().map(|species| format!("`{}`", species.name)).collect();
    let dead: Vec<String> =
        names.into_iter().zip(&needs.species).filter(|(_, it)| !**it).map(|it| it.0).collect();
    let idle: Vec<String> = (kinetics.reactions.iter().zip(&needs.reactions))
        .filter(|(_, is_needed)| !**is_needed)
        .map(|(reaction, _)| reaction.name.clone())
        .collect();
    if dead.is_empty() && idle.is_empty() {
        return;
    }
    for name in idle {
        draft.leave_out(
            format!("reaction `{name}`"),
            "no output reads what it changes, alone or through a rate",
        );
    }
    if !dead.is_empty() {
        draft
            .leave_out(format!("species {}", dead.join(", ")), "no output and no rate that matters reads it");
    }
    let Some(chemistry) = &mut draft.plan.chemistry else { return };
    let is_empty = keep_reactions(chemistry, &needs.reactions);
    let is_idle = |equilibrium: &Equilibrium| !equilibrium.members().iter().any(|idx| needs.species[*idx]);
    if chemistry.equilibrium.as_ref().is_some_and(is_idle) {
        chemistry.equilibrium = None;
    }
    if is_empty && chemistry.equilibrium.is_none() {
        draft.plan.chemistry = None;
    }
    species::remove(draft, &needs.species);
    method::choose(&mut draft.plan);
}

/// Keeps these reactions; whether none is left.
fn keep_reactions(chemistry: &mut Chemistry, is_kept: &[bool]) -> bool {
    let Some(kinetics) = &mut chemistry.kinetics else { return true };
    species::retain_by(&mut kinetics.reactions, is_kept);
    species::retain_by(&mut kinetics.laws.rates, is_kept);
    shorten(kinetics);
    let is_empty = kinetics.reactions.is_empty();
    if is_empty {
        chemistry.kinetics = None;
    }
    is_empty
}

/// Leaves operations out that no rate needs.
fn shorten(kinetics: &mut Kinetics) {
    let laws = &mut kinetics.laws;
    let mut is_used = vec![false; laws.operations.len()];
    laws.rates.iter().for_each(|rate| is_used[usize::from(*rate)] = true);
    for idx in (0..laws.operations.len()).rev() {
        if is_used[idx] {
            laws.operations[idx].reads().into_iter().for_each(|it| is_used[usize::from(it)] = true);
        }
    }
    let place =
        |old: Register| is_used[..usize::from(old)].iter().filter(|is_used| **is_used).count() as Register;
    for operation in &mut laws.operations {
        match operation {
            Operation::Constant(_) | Operation::Input(_) => {}
            Operation::Unary(_, a) => *a = place(*a),
            Operation::Binary(_, a, b) => [a, b].into_iter().for_each(|it| *it = place(*it)),
            Operation::Select(a, b, c) => [a, b, c].into_iter().for_each(|it| *it = place(*it)),
            Operation::Table(lookup) => lookup.at.iter_mut().for_each(|it| *it = place(*it)),
        }
    }
    laws.rates.iter_mut().for_each(|rate| *rate = place(*rate));
    species::retain_by(&mut laws.operations, &is_used);
}

struct Needs {
    species: Vec<bool>,
    reactions: Vec<bool>,
}

fn needs(plan: &Plan, kinetics: &Kinetics) -> Needs {
    let mut needs =
        Needs { species: vec![false; plan.species.len()], reactions: vec![false; kinetics.reactions.len()] };
    for quantity in plan.outputs.iter().flat_map(|output| &output.quantities) {
        match *quantity {
            Quantity::Species(a) => needs.species[a] = true,
            Quantity::Pair(a, b) => (needs.species[a], needs.species[b]) = (true, true),
        }
    }
    let together = plan.chemistry.as_ref().and_then(|chemistry| chemistry.equilibrium.as_ref());
    let together = together.map(Equilibrium::members).unwrap_or_default();
    let laws: Vec<Vec<usize>> = (0..kinetics.reactions.len()).map(|idx| named(kinetics, idx)).collect();
    let carriers = carriers(plan, kinetics);
    let gates = plan.gates();
    loop {
        let before = needs.species.clone();
        for reaction in &plan.reactions {
            if reaction.reactants.iter().chain(&reaction.products).any(|(species, _)| needs.species[*species])
            {
                reaction.reactants.iter().for_each(|(species, _)| needs.species[*species] = true);
            }
        }
        if together.iter().any(|species| needs.species[*species]) {
            together.iter().for_each(|species| needs.species[*species] = true);
        }
        for (idx, reaction) in kinetics.reactions.iter().enumerate() {
            let mut changed = reaction.changes.iter().flat_map(|(item, _)| &carriers[*item]);
            needs.reactions[idx] |= changed.any(|species| needs.species[*species]);
            if needs.reactions[idx] {
                laws[idx].iter().for_each(|species| needs.species[*species] = true);
                // A closed form ends where the scarcest of what it uses up does.
                let is_closed = matches!(kinetics.method, Method::Pair | Method::Saturation | Method::Zero);
                let spent = reaction.changes.iter().filter(|(_, change)| is_closed && *change < 0.0);
                // And a rate that does not know its end, where that of its gates is.
                let ends = spent.map(|(item, _)| *item).chain(gates[idx].components());
                ends.flat_map(|item| &carriers[item]).for_each(|species| needs.species[*species] = true);
            }
        }
        if before == needs.species {
            return needs;
        }
    }
}

/// The species that each component, or species, which reactions change is seen in.
fn carriers(plan: &Plan, kinetics: &Kinetics) -> Vec<Vec<usize>> {
    if kinetics.method == Method::Observed {
        return (0..plan.species.len()).map(|species| vec![species]).collect();
    }
    let mut list = vec![Vec::new(); plan.components.len()];
    for (idx, species) in plan.species.iter().enumerate() {
        species.terms.iter().for_each(|(component, _)| list[*component].push(idx));
    }
    list
}

/// The species that a rate names.
fn named(kinetics: &Kinetics, reaction: usize) -> Vec<usize> {
    let mut open = vec![kinetics.laws.rates[reaction]];
    let mut is_seen = vec![false; kinetics.laws.operations.len()];
    let mut list = Vec::new();
    while let Some(register) = open.pop() {
        if std::mem::replace(&mut is_seen[usize::from(register)], true) {
            continue;
        }
        let operation = &kinetics.laws.operations[usize::from(register)];
        if let Operation::Input(input) = *operation
            && input >= SPECIES_INPUT
        {
            list.push(usize::from(input - SPECIES_INPUT));
        }
        open.extend(operation.reads());
    }
    list
}

/// Which species react at rates or are in equilibrium, or are named in a rate.
pub(super) fn species_of_chemistry(plan: &Plan) -> Vec<bool> {
    let mut list = vec![false; plan.species.len()];
    let Some(chemistry) = &plan.chemistry else { return list };
    if let Some(kinetics) = &chemistry.kinetics {
        let carriers = carriers(plan, kinetics);
        for (idx, reaction) in kinetics.reactions.iter().enumerate() {
            let changed = reaction.changes.iter().flat_map(|(item, _)| carriers[*item].clone());
            changed.chain(named(kinetics, idx)).for_each(|species| list[species] = true);
        }
    }
    if let Some(equilibrium) = &chemistry.equilibrium {
        equilibrium.members().into_iter().for_each(|species| list[species] = true);
    }
    list
}

/// Species and components get the numbers that they have once others are gone; what is gone is named no more.
pub(super) fn renumber(chemistry: &mut Chemistry, is_carried: &[bool], species: &[Option<usize>]) {
    species::retain_by(&mut chemistry.floors, is_carried);
    let component = |old: usize| {
        is_carried[old].then(|| is_carried[..old].iter().filter(|is_carried| **is_carried).count())
    };
    let number = |old: usize| species[old].unwrap_or(0);
    if let Some(kinetics) = &mut chemistry.kinetics {
        let is_observed = kinetics.method == Method::Observed;
        for reaction in &mut kinetics.reactions {
            let changes = std::mem::take(&mut reaction.changes);
            let place = |item: usize| if is_observed { species[item] } else { component(item) };
            reaction.changes =
                changes.into_iter().filter_map(|(item, change)| Some((place(item)?, change))).collect();
            match &mut reaction.law {
                Law::MassAction { orders, .. } => orders.iter_mut().for_each(|(s, _)| *s = number(*s)),
                Law::Saturation { species, .. } => *species = number(*species),
                Law::Expression => {}
            }
        }
        for operation in &mut kinetics.laws.operations {
            if let Operation::Input(input) = operation
                && *input >= SPECIES_INPUT
            {
                *input = SPECIES_INPUT + number(usize::from(*input - SPECIES_INPUT)) as u16;
            }
        }
    }
    let Some(equilibrium) = &mut chemistry.equilibrium else { return };
    for primary in &mut equilibrium.primaries {
        primary.species = number(primary.species);
        let terms = std::mem::take(&mut primary.terms);
        primary.terms =
            terms.into_iter().filter_map(|(item, factor)| Some((component(item)?, factor))).collect();
    }
    equilibrium.secondaries.iter_mut().for_each(|secondary| secondary.species = number(secondary.species));
    equilibrium.minerals.iter_mut().for_each(|mineral| mineral.species = number(mineral.species));
}

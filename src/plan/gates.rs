//! Which rates would go on where nothing is left of what they take.
//!
//! Owns this question, the one source for what is left out, how rates are integrated, and the gates that
//! end them. May use the tape and bounds of expressions. It deliberately asks no numbers: a rate is
//! only trusted to stop if that follows from how it is written, for all places, times and concentrations.

use super::Species;
use super::build_tape::SPECIES_INPUT;
use super::chemistry::{Equilibrium, Kinetics, Method};
use super::tape::Operation;
use crate::maths::interval::Interval;

/// Components that a rate has to be told the end of.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Gates {
    /// Taken where the rate is above zero.
    pub forward: Vec<usize>,
    /// Taken where it is below.
    pub backward: Vec<usize>,
}

impl Gates {
    pub fn is_empty(&self) -> bool {
        self.forward.is_empty() && self.backward.is_empty()
    }

    /// All components of either direction.
    pub fn components(&self) -> impl Iterator<Item = usize> + '_ {
        self.forward.iter().chain(&self.backward).copied()
    }
}

/// Which components are amounts, and so never negative: those that are a species by themselves, and in
/// equilibrium totals that only add up.
pub fn amounts(species: &[Species], equilibrium: Option<&Equilibrium>, n_components: usize) -> Vec<bool> {
    (0..n_components).map(|component| !parts(species, equilibrium, component).is_empty()).collect()
}

/// The species that an amount is made of, each with its share: `U = Σ share · c`. None if the component is no
/// amount. Where nothing is left of the component, nothing is left of these.
pub fn parts(species: &[Species], equilibrium: Option<&Equilibrium>, component: usize) -> Vec<(usize, f64)> {
    let own = |terms: &[(usize, f64)], constant: f64| match *terms {
        [(only, coefficient)] if only == component && constant == 0.0 && coefficient > 0.0 => {
            Some(coefficient)
        }
        _ => None,
    };
    let members = equilibrium.map(Equilibrium::members).unwrap_or_default();
    if let Some(equilibrium) = equilibrium {
        let mut reads = equilibrium.primaries.iter().enumerate().filter(|(_, primary)| {
            primary.terms.iter().any(|&(other, coefficient)| other == component && coefficient != 0.0)
        });
        match (reads.next(), reads.next()) {
            (None, _) => {}
            (Some((idx, primary)), None) if equilibrium.is_sum(idx) => {
                let Some(coefficient) = own(&primary.terms, primary.constant) else { return Vec::new() };
                let share = |(species, nu): (usize, f64)| (species, nu / coefficient);
                return equilibrium.total(idx).into_iter().map(share).collect();
            }
            _ => return Vec::new(),
        }
    }
    let mut free = species.iter().enumerate().filter(|(idx, _)| !members.contains(idx));
    let found = free.find_map(|(idx, species)| Some((idx, 1.0 / own(&species.terms, species.constant)?)));
    found.into_iter().collect()
}

/// Per reaction the components that its rate may take although there are none.
pub fn of(
    kinetics: &Kinetics,
    species: &[Species],
    equilibrium: Option<&Equilibrium>,
    n_components: usize,
) -> Vec<Gates> {
    let mut list = vec![Gates::default(); kinetics.reactions.len()];
    // There the changes are those of species, and every rate is that of its own reactant.
    if kinetics.method == Method::Observed {
        return list;
    }
    for component in 0..n_components {
        let parts = parts(species, equilibrium, component);
        let takes = kinetics.reactions.iter().any(|it| it.changes.iter().any(|(own, _)| *own == component));
        if parts.is_empty() || !takes {
            continue;
        }
        let is_none = |species: usize| parts.iter().any(|(own, _)| *own == species);
        let bounds = bounds(&kinetics.laws.operations, &is_none);
        for (idx, reaction) in kinetics.reactions.iter().enumerate() {
            let rate = bounds[usize::from(kinetics.laws.rates[idx])];
            for &(_, change) in reaction.changes.iter().filter(|(own, _)| *own == component) {
                if change < 0.0 && rate.high > 0.0 {
                    list[idx].forward.push(component);
                } else if change > 0.0 && rate.low < 0.0 {
                    list[idx].backward.push(component);
                }
            }
        }
    }
    list
}

/// Between which numbers each register stays, without some of the species.
fn bounds(operations: &[Operation], is_none: &dyn Fn(usize) -> bool) -> Vec<Interval> {
    let mut list: Vec<Interval> = Vec::with_capacity(operations.len());
    for operation in operations {
        let read = |register: u16| list[usize::from(register)];
        let bounds = match *operation {
            Operation::Constant(value) => Interval::of(value),
            Operation::Input(input) if input >= SPECIES_INPUT => {
                if is_none(usize::from(input - SPECIES_INPUT)) { Interval::ZERO } else { Interval::AMOUNT }
            }
            Operation::Input(3) => Interval::AMOUNT,
            Operation::Input(_) => Interval::ANY,
            Operation::Unary(unary, a) => Interval::unary(unary, read(a)),
            Operation::Binary(binary, a, b) => Interval::binary(binary, read(a), read(b)),
            Operation::Select(a, b, c) => Interval::select(read(a), read(b), read(c)),
            Operation::Table(ref lookup) => {
                let (low, high) = lookup.table.range();
                Interval::new(low, high)
            }
        };
        list.push(bounds);
    }
    list
}

impl super::Plan {
    /// See [`of`].
    pub fn gates(&self) -> Vec<Gates> {
        let Some(chemistry) = &self.chemistry else { return Vec::new() };
        let Some(kinetics) = &chemistry.kinetics else { return Vec::new() };
        of(kinetics, &self.species, chemistry.equilibrium.as_ref(), self.components.len())
    }

    /// See [`amounts`].
    pub fn amounts(&self) -> Vec<bool> {
        let equilibrium = self.chemistry.as_ref().and_then(|chemistry| chemistry.equilibrium.as_ref());
        amounts(&self.species, equilibrium, self.components.len())
    }
}

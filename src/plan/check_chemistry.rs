//! Whether the chemistry of a plan is well-formed.
//!
//! Owns these conditions. May use the plan's types. It deliberately judges no number beyond its being one.

use super::Plan;
use super::build_tape::SPECIES_INPUT;
use super::check::{check_operations, require};
use super::chemistry::{Chemistry, Equilibrium, Kinetics, Law, Method};

impl Plan {
    pub(super) fn check_chemistry(&self) -> Result<(), String> {
        let is_last = |idx: usize| self.components[idx..].iter().all(|component| component.is_immobile);
        let first = self.components.iter().position(|component| component.is_immobile);
        require(first.is_none_or(is_last), || "immobile components do not come last".into())?;
        let Some(chemistry) = &self.chemistry else { return Ok(()) };
        require(chemistry.kinetics.is_some() || chemistry.equilibrium.is_some(), || {
            "chemistry without reactions".into()
        })?;
        let tolerance = chemistry.tolerance;
        require(tolerance > 0.0 && tolerance < 1.0, || format!("a tolerance of {tolerance}"))?;
        let are_floors_right = chemistry.floors.len() == self.components.len()
            && chemistry.floors.iter().all(|floor| *floor > 0.0 && floor.is_finite());
        require(are_floors_right, || "one floor above zero is needed for each component".into())?;
        if let Some(kinetics) = &chemistry.kinetics {
            self.check_kinetics(chemistry, kinetics)?;
        }
        chemistry.equilibrium.as_ref().map_or(Ok(()), |equilibrium| self.check_equilibrium(equilibrium))
    }

    fn check_kinetics(&self, chemistry: &Chemistry, kinetics: &Kinetics) -> Result<(), String> {
        let n_species = self.species.len();
        let laws = &kinetics.laws;
        require(!kinetics.reactions.is_empty(), || "kinetics without reactions".into())?;
        require(laws.rates.len() == kinetics.reactions.len(), || "one rate per reaction is needed".into())?;
        check_operations(&laws.operations, usize::from(SPECIES_INPUT) + n_species)
            .map_err(|reason| format!("rates: {reason}"))?;
        let is_there = |rate: &u16| usize::from(*rate) < laws.operations.len();
        require(laws.rates.iter().all(is_there), || "a rate has no operation".into())?;
        let n_items = if kinetics.method == Method::Observed { n_species } else { self.components.len() };
        for reaction in &kinetics.reactions {
            let are_changes_right = reaction
                .changes
                .iter()
                .all(|(item, change)| *item < n_items && change.is_finite() && *change != 0.0);
            let is_law_right = match &reaction.law {
                Law::MassAction { constant, orders } => {
                    let are_right = orders.iter().all(|(species, n)| *species < n_species && *n > 0.0);
                    are_right && *constant >= 0.0 && constant.is_finite()
                }
                Law::Saturation { maximum, half, species } => {
                    *maximum > 0.0 && *half > 0.0 && *species < n_species
                }
                Law::Expression => true,
            };
            require(are_changes_right && is_law_right, || {
                format!("reaction `{}` is not well-formed", reaction.name)
            })?;
        }
        self.check_method(chemistry, kinetics)
    }

    /// A closed form needs the laws that it is one of.
    fn check_method(&self, chemistry: &Chemistry, kinetics: &Kinetics) -> Result<(), String> {
        let is_one = kinetics.reactions.len() == 1 && chemistry.equilibrium.is_none();
        let law = &kinetics.reactions[0].law;
        let is_linear = |law: &Law| match law {
            Law::MassAction { orders, .. } => matches!(orders[..], [] | [(_, 1.0)]),
            Law::Saturation { .. } | Law::Expression => false,
        };
        let are_linear = kinetics.reactions.iter().all(|reaction| is_linear(&reaction.law));
        let is_right = match kinetics.method {
            Method::Observed | Method::Exponential => are_linear && chemistry.equilibrium.is_none(),
            Method::Pair => {
                let order = |orders: &[(usize, f64)]| orders.iter().map(|(_, n)| n).sum::<f64>();
                is_one && matches!(law, Law::MassAction { orders, .. } if order(orders) == 2.0)
            }
            Method::Saturation => is_one && matches!(law, Law::Saturation { .. }),
            Method::Zero => is_one && matches!(law, Law::MassAction { orders, .. } if orders.is_empty()),
            Method::Explicit | Method::Rosenbrock => true,
        };
        require(is_right, || "the rates are not what their method is for".into())
    }

    fn check_equilibrium(&self, equilibrium: &Equilibrium) -> Result<(), String> {
        let n_species = self.species.len();
        let n_primaries = equilibrium.primaries.len();
        for primary in &equilibrium.primaries {
            let is_right = primary.species < n_species
                && primary.constant.is_finite()
                && primary.terms.iter().all(|(component, _)| *component < self.components.len());
            require(is_right, || "a primary species is not well-formed".into())?;
        }
        let secondaries =
            equilibrium.secondaries.iter().map(|it| (it.species, it.ln_constant, &it.coefficients));
        let minerals = equilibrium.minerals.iter().map(|it| (it.species, it.ln_solubility, &it.coefficients));
        for (species, ln_constant, coefficients) in secondaries.chain(minerals) {
            let is_right = species < n_species
                && ln_constant.is_finite()
                && coefficients.iter().all(|(primary, nu)| *primary < n_primaries && nu.is_finite());
            require(is_right, || "a species in equilibrium is not well-formed".into())?;
            let is_carried = !self.species[species].terms.is_empty();
            require(!is_carried, || {
                format!("`{}` is carried and in equilibrium", self.species[species].name)
            })?;
        }
        Ok(())
    }
}

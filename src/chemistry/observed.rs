//! First-order networks that commute with transport: nothing reacts until somebody looks.
//!
//! Owns how species follow from unreacted components at a time. May use the reactor's propagator. It
//! deliberately carries nothing: the plan's recipes stay what they are.

use super::reactor::Reactor;
use crate::plan::chemistry::Method;
use crate::plan::tape::{Operation, Tape};
use crate::plan::{Component, Plan, Species};

/// A network of this kind.
#[derive(Debug, Clone)]
pub struct Observed {
    /// Of a plan in which every species is carried.
    reactor: Reactor,
    unreacted: Vec<Species>,
}

impl Observed {
    /// `None` if the plan's chemistry is of another kind.
    pub fn new(plan: &Plan) -> Result<Option<Self>, String> {
        let kinetics = plan.chemistry.as_ref().and_then(|chemistry| chemistry.kinetics.as_ref());
        if kinetics.is_none_or(|kinetics| kinetics.method != Method::Observed) {
            return Ok(None);
        }
        let initial = Tape { operations: vec![Operation::Constant(0.0)] };
        let component = |species: &Species| Component {
            name: species.name.clone(),
            initial: initial.clone(),
            is_immobile: false,
        };
        let identity = |(idx, species): (usize, &Species)| Species {
            constant: 0.0,
            terms: vec![(idx, 1.0)],
            ..species.clone()
        };
        let carried = Plan {
            components: plan.species.iter().map(component).collect(),
            species: plan.species.iter().enumerate().map(identity).collect(),
            ..plan.clone()
        };
        let reactor = Reactor::new(&carried)?;
        Ok(reactor.map(|reactor| Self { reactor, unreacted: plan.species.clone() }))
    }

    /// How species follow from the unreacted components at a time.
    ///
    /// - Equation: `c(t) = E(t) U + e(t)`, `U_s = α_s + Σ_k β_sk U_k`, so
    ///   `c_s = (e_s + Σ_r E_sr α_r) + Σ_k (Σ_r E_sr β_rk) U_k`.
    /// - Symbols: `U` unreacted concentrations, which transport and exchange leave linear; `E`, `e` the
    ///   propagator of the network.
    /// - Range: any `t ≥ 0`; the laws have constant coefficients and all species move alike.
    /// - Source: operators that commute; methods, section 1.7.
    /// - Shape: one recipe per species.
    pub fn recipes(&self, t: f64) -> Option<Vec<Species>> {
        let propagator = self.reactor.propagator(t)?;
        let n = self.unreacted.len();
        let recipe = |row: usize| {
            let factors = &propagator.matrix[row * n..][..n];
            let mut species = Species {
                constant: propagator.constant[row],
                terms: Vec::new(),
                ..self.unreacted[row].clone()
            };
            for (factor, source) in factors.iter().zip(&self.unreacted).filter(|(factor, _)| **factor != 0.0)
            {
                species.constant += factor * source.constant;
                for &(component, coefficient) in &source.terms {
                    match species.terms.iter_mut().find(|(known, _)| *known == component) {
                        Some((_, sum)) => *sum += factor * coefficient,
                        None => species.terms.push((component, factor * coefficient)),
                    }
                }
            }
            species.terms.sort_unstable_by_key(|&(component, _)| component);
            species
        };
        Some((0..n).map(recipe).collect())
    }
}

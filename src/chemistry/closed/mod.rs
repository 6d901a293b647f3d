//! Networks whose solution over a step is known.
//!
//! Owns the closed forms. May use `maths` and the plan. It deliberately has no tolerance: each is right
//! to about 1e-12, whatever the step.

pub(super) mod exponential;
pub(super) mod pair;
pub(super) mod saturation;
pub(super) mod zero;

use crate::plan::Species;

/// What one reaction does to the components: `y_i ← y_i + coefficient_i ξ`.
pub(super) type Changes = Vec<(usize, f64)>;

/// A species along one reaction: `c(ξ) = c(0) + slope ξ`.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Line {
    pub constant: f64,
    pub terms: Vec<(usize, f64)>,
    pub slope: f64,
    /// The component that it is, if it is one and nothing else.
    pub own: Option<usize>,
}

impl Line {
    pub fn new(species: &Species, changes: &[(usize, f64)]) -> Self {
        let change = |component: usize| {
            changes.iter().filter(|(other, _)| *other == component).map(|(_, c)| c).sum::<f64>()
        };
        let slope =
            species.terms.iter().map(|&(component, coefficient)| coefficient * change(component)).sum();
        let own = match (&species.terms[..], species.constant) {
            (&[(component, 1.0)], 0.0) => Some(component),
            _ => None,
        };
        Self { constant: species.constant, terms: species.terms.clone(), slope, own }
    }

    /// Concentrations of particles `start..`, never below zero; NaN goes through.
    #[inline(always)]
    pub fn read(&self, components: &[&mut [f64]], start: usize, out: &mut [f64]) {
        out.fill(self.constant);
        for &(component, coefficient) in &self.terms {
            let column = &components[component][start..start + out.len()];
            for (value, carried) in out.iter_mut().zip(column) {
                *value += coefficient * carried;
            }
        }
        for value in out {
            *value = if *value < 0.0 { 0.0 } else { *value };
        }
    }
}

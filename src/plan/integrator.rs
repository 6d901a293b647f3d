//! The choice between explicit and implicit integration, by what a step would cost with either.
//!
//! Owns this choice and the numbers of sub-steps that it expects. May use the time scales and the
//! gates of rates. It deliberately leaves alone what a closed form has decided.

use super::Plan;
use super::chemistry::{Chemistry, Integrator, Method};
use super::time_scales::TimeScales;
use crate::maths::scalar::pow;

/// Sub-steps that one step of a particle is expected to take, and what they cost in explicit ones.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Expected {
    pub explicit: f64,
    pub implicit: f64,
    /// What an implicit sub-step costs, in explicit ones.
    pub price: f64,
}

/// |λ|h up to which Dormand and Prince's method is stable: E. Hairer, S. P. Nørsett and G. Wanner 1993,
/// Solving Ordinary Differential Equations I, 2nd ed., Springer, II.4 and IV.2 of the second volume.
const STABLE: f64 = 3.3;

/// Sub-steps for each time that a value changes by the factor e, at a tolerance of 1e-4: guesses between what
/// the networks of `make bench` and of `experiments/stiff` take, which differ by factors of two and more. They
/// grow with the order of the method.
const EXPLICIT_PER_FOLDING: f64 = 0.8;
const IMPLICIT_PER_FOLDING: f64 = 1.2;

impl Expected {
    pub(super) fn new(scales: &TimeScales, chemistry: &Chemistry, n_components: usize) -> Self {
        let fineness = 1e-4 / chemistry.tolerance;
        let accurate = EXPLICIT_PER_FOLDING * pow(fineness, 0.2) * scales.way.foldings;
        let stable = scales.way.relaxations / STABLE;
        Self {
            explicit: 1.0 + accurate.max(stable),
            implicit: 1.0 + IMPLICIT_PER_FOLDING * pow(fineness, 0.25) * scales.way.foldings,
            price: price(n_components),
        }
    }

    fn is_explicit(&self) -> bool {
        self.explicit <= self.price * self.implicit
    }
}

/// Measured with 3, 5, 10 and 20 components by `make bench`: 1.4 to 1.5 in chains, 1.3 to 3.8 where each
/// component meets all others; between the two.
fn price(n_components: usize) -> f64 {
    1.3 + 0.06 * n_components as f64
}

pub(super) fn choose(plan: &mut Plan, scales: Option<&TimeScales>) {
    let n = plan.components.len();
    // What is faded out near zero is stiff there, whatever the scene asks for.
    let is_gated = plan.gates().iter().any(|gates| !gates.is_empty());
    let Some(chemistry) = plan.chemistry.as_mut() else { return };
    let is_free = chemistry.integrator == Integrator::Auto && !is_gated;
    let expected = scales.map(|scales| Expected::new(scales, chemistry, n));
    let Some(kinetics) = chemistry.kinetics.as_mut() else { return };
    if is_gated && kinetics.method == Method::Explicit {
        kinetics.method = Method::Rosenbrock;
    }
    if is_free
        && kinetics.method == Method::Rosenbrock
        && expected.is_some_and(|expected| expected.is_explicit())
    {
        kinetics.method = Method::Explicit;
    }
}

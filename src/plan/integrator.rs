//! The choice between explicit and implicit integration.
//!
//! Owns this choice. May use the time scales and the gates of rates. It deliberately leaves alone what a
//! closed form has decided.

use super::Plan;
use super::chemistry::{Integrator, Method};
use super::time_scales::TimeScales;

/// Up to this many times of the fastest reaction per step an explicit method needs no more sub-steps for
/// stability (its limit is 3.3) than for accuracy.
const EXPLICIT: f64 = 5.0;

pub(super) fn choose(plan: &mut Plan, scales: Option<&TimeScales>) {
    let step = plan.time.step;
    // What is faded out near zero is stiff there, whatever the scene asks for.
    let is_gated = plan.gates().iter().any(|gates| !gates.is_empty());
    let Some(chemistry) = plan.chemistry.as_mut() else { return };
    let is_free = chemistry.integrator == Integrator::Auto;
    let Some(kinetics) = chemistry.kinetics.as_mut() else { return };
    if is_gated && kinetics.method == Method::Explicit {
        kinetics.method = Method::Rosenbrock;
    }
    if is_free
        && !is_gated
        && kinetics.method == Method::Rosenbrock
        && scales.is_some_and(|scales| scales.steepest * step <= EXPLICIT)
    {
        kinetics.method = Method::Explicit;
    }
}

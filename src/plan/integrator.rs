//! The choice between explicit and implicit integration.
//!
//! Owns this choice. May use the time scales. It deliberately leaves alone what the scene or a closed form
//! has decided.

use super::Plan;
use super::chemistry::{Integrator, Method};
use super::time_scales::TimeScales;

/// Up to this many times of the fastest reaction per step an explicit method needs no more sub-steps for
/// stability (its limit is 3.3) than for accuracy.
const EXPLICIT: f64 = 5.0;

pub(super) fn choose(plan: &mut Plan, scales: Option<&TimeScales>) {
    let step = plan.time.step;
    let Some(chemistry) =
        plan.chemistry.as_mut().filter(|chemistry| chemistry.integrator == Integrator::Auto)
    else {
        return;
    };
    let Some(kinetics) = chemistry.kinetics.as_mut() else { return };
    if kinetics.method == Method::Rosenbrock
        && scales.is_some_and(|scales| scales.fastest_rate() * step <= EXPLICIT)
    {
        kinetics.method = Method::Explicit;
    }
}

//! How fast a scene reacts with what it puts together: initial water, and what sides and sources bring.
//!
//! Owns these states. May use time scales and tapes. It deliberately follows no course: what grows or runs out later is
//! followed within a step, by who integrates it.

use super::Plan;
use super::tape::Tape;
use super::time_scales::{self, AtStart};
use super::transport::{Region, SideRule, Strength};

/// How fast reactions are at the start; nothing where no rate can be told.
///
/// - Equation: `max |Σ_i ν_i ∂r/∂c_i|` and `max ν_i r/c_i` over the initial states, and the one with each species at its largest.
/// - Symbols: `r` rate, `ν` coefficients, `c` concentrations of initial water, of inflow and of sources.
/// - Range: laws of any kind; concentrations not below the floors.
/// - Source: definition; methods, section 5.8.
/// - Shape: one of each per reaction.
pub(super) fn start_rates(plan: &Plan) -> Option<AtStart> {
    let brought: Vec<f64> = (0..plan.species.len()).map(|species| brought(plan, species)).collect();
    let of_component = |component: usize| {
        let own = plan.species_of(component);
        own.map_or(0.0, |species| brought[species] / plan.species[species].terms[0].1)
    };
    let most: Vec<f64> = (0..plan.components.len()).map(of_component).collect();
    time_scales::at_start(plan, &most)
}

/// The largest concentration that sides and sources bring of a species.
fn brought(plan: &Plan, species: usize) -> f64 {
    let Some(transport) = plan.transport.as_ref().filter(|_| plan.carries_mass()) else { return 0.0 };
    let mut most: f64 = 0.0;
    for patch in transport.sides.iter().flatten().flatten() {
        if let SideRule::Inflow(tapes) | SideRule::Held(tapes) = &patch.rule
            && let Some(tape) = tapes.get(species)
        {
            most = most.max(largest(tape, plan));
        }
    }
    let retardation =
        transport.populations.iter().find(|it| it.species == species).map_or(1.0, |it| it.retardation);
    for source in transport.sources.iter().filter(|source| source.species == species) {
        let c = match (&source.strength, &source.region) {
            (Strength::Held(c), _) => *c,
            (Strength::HeldInTime(tape), _) => largest(tape, plan),
            (Strength::Pulse(amount), Region::Box(low, high)) => {
                let volume: f64 = low.iter().zip(high).map(|(low, high)| high - low).product();
                amount / (volume * super::shares::mean(&transport.porosity, &plan.axes) * retardation)
            }
            _ => 0.0,
        };
        most = most.max(c);
    }
    if most.is_finite() { most } else { 0.0 }
}

/// Over the domain, at some times.
fn largest(tape: &Tape, plan: &Plan) -> f64 {
    let times = [0.0, 0.25, 0.5, 0.75, 1.0].map(|part| part * plan.time.duration);
    let points = time_scales::sample_points(&plan.axes);
    let values = points.iter().flat_map(|&[x, y, z]| times.map(|t| tape.evaluate(&[x, y, z, t])));
    values.filter(|value| value.is_finite()).fold(0.0, f64::max)
}

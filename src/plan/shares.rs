//! How the particles of a scene are shared among its species, and how fast its water is about.
//!
//! Owns estimates: of the mass that each species brings, and of a mean speed where the flow is not solved yet.
//! May use the plan's types. It deliberately decides nothing but numbers of particles and steps: no law of
//! transport hangs on an estimate.

use super::Axis;
use super::in_time::{at_time, is_timed, switches};
use super::tape::{Operation, Tape};
use super::transport::{
    Conductivity, Darcy, DarcySide, Dispersion, Flow, Patch, Population, Region, SideRule, Strength,
    Transport,
};
use crate::maths::scalar::{exp, ln};
use crate::scenario::Scenario;
use crate::scenario::transport::Shares;

/// Points along each axis at which expressions are looked at.
const POINTS: [usize; 3] = [257, 33, 11];
/// An expression larger than this is looked at in fewer places, or a check would take seconds.
const LARGE_TAPE: usize = 500;
const FEW_POINTS: [usize; 3] = [33, 7, 4];

/// Middles of equal parts of the domain: x, y, z and the time 0.
pub(super) fn places(axes: &[Axis], n_operations: usize) -> Vec<[f64; 4]> {
    let points = if n_operations > LARGE_TAPE { FEW_POINTS } else { POINTS };
    let n = points[axes.len().clamp(1, 3) - 1];
    let mut list = vec![[0.0; 4]];
    for axis in axes {
        let at = |idx: usize| axis.low + (axis.high - axis.low) * (idx as f64 + 0.5) / n as f64;
        let with = |place: &[f64; 4]| {
            let place = *place;
            (0..n).map(move |idx| {
                let mut place = place;
                place[axis.index] = at(idx);
                place
            })
        };
        list = list.iter().flat_map(with).collect();
    }
    list
}

/// Mean over the domain; a constant is itself.
pub(super) fn mean(tape: &Tape, axes: &[Axis]) -> f64 {
    if let [Operation::Constant(value)] = tape.operations[..] {
        return value;
    }
    let places = places(axes, tape.operations.len());
    let sum: f64 = places.iter().map(|place| tape.evaluate(place)).filter(|value| value.is_finite()).sum();
    sum / places.len() as f64
}

fn volume(axes: &[Axis]) -> f64 {
    axes.iter().map(|axis| axis.high - axis.low).product()
}

/// Largest speed of a flow that is known, and a mean one of a flow that is still to be solved, m/s; that of the
/// fastest where flows follow one another.
///
/// - Equation: `v = K_e |Δh| / (L φ)` or `q/φ`, whichever is largest over the axes.
/// - Symbols: `Δh` difference of the heads of opposite sides `L` apart, `q` a given flux, φ mean porosity, `K_e`
///   effective conductivity, `K_G exp(σ² (1/2 − 1/d))` in `d` dimensions.
/// - Range: an estimate; wells and heads of neighbouring sides count by their differences over the shortest
///   extent.
/// - Source: L. W. Gelhar, Stochastic Subsurface Hydrology (1993), section 4.1 (conjecture of Matheron).
/// - Shape: one number.
pub(super) fn speed(axes: &[Axis], transport: &Transport) -> f64 {
    let of = |flow: &Flow| speed_of(axes, flow, transport);
    transport.flows().iter().map(of).fold(0.0, f64::max)
}

fn speed_of(axes: &[Axis], flow: &Flow, transport: &Transport) -> f64 {
    match flow {
        Flow::Uniform(velocity) => velocity.iter().map(|v| v * v).sum::<f64>().sqrt(),
        Flow::Expression(tapes) => {
            let n_operations = tapes.iter().map(|tape| tape.operations.len()).max().unwrap_or(0);
            let square =
                |place: &[f64; 4]| tapes.iter().map(|tape| tape.evaluate(place).powi(2)).sum::<f64>();
            let all = places(axes, n_operations);
            all.iter().map(square).filter(|s| s.is_finite()).fold(0.0, f64::max).sqrt()
        }
        Flow::Darcy(darcy) => darcy_speed(axes, darcy, mean(&transport.porosity, axes)),
        Flow::File(flow) => flow.facts.speed,
    }
}

fn darcy_speed(axes: &[Axis], darcy: &Darcy, porosity: f64) -> f64 {
    let n_axes = axes.len() as f64;
    let conductivity = match &darcy.conductivity {
        Conductivity::Lognormal { geometric_mean, variance, .. } => {
            geometric_mean * exp(variance * (0.5 - 1.0 / n_axes))
        }
        Conductivity::Expression(tape) => {
            let places = places(axes, tape.operations.len());
            let logs = places.iter().map(|place| ln(tape.evaluate(place))).filter(|value| value.is_finite());
            exp(logs.sum::<f64>() / places.len() as f64)
        }
    };
    let head = |side: &DarcySide| if let DarcySide::Head(head) = side { Some(*head) } else { None };
    let mut largest: f64 = 0.0;
    let mut heads: Vec<f64> = Vec::new();
    for (axis, [low, high]) in axes.iter().zip(&darcy.sides) {
        if let (Some(a), Some(b)) = (head(low), head(high)) {
            largest = largest.max(conductivity * (a - b).abs() / (axis.high - axis.low));
        }
        heads.extend(head(low).into_iter().chain(head(high)));
        for side in [low, high] {
            if let DarcySide::Flux(flux) = side {
                largest = largest.max(flux.abs());
            }
        }
    }
    let shortest = axes.iter().map(|axis| axis.high - axis.low).fold(f64::INFINITY, f64::min);
    if largest == 0.0 {
        let range = heads.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), h| (a.min(*h), b.max(*h)));
        largest = largest.max(conductivity * (range.1 - range.0).max(0.0) / shortest);
    }
    // What a well moves passes about the middle of the domain.
    let across = volume(axes) / shortest;
    let wells: f64 = darcy.wells.iter().map(|well| well.rate.abs()).sum();
    largest.max(wells / across) / porosity
}

/// Largest dispersion coefficient at a speed, m²/s.
pub(super) fn spread(axes: &[Axis], dispersion: &Dispersion, speed: f64) -> f64 {
    match dispersion {
        Dispersion::Constant(triangle) => {
            (0..axes.len()).map(|i| triangle[i * (i + 1) / 2 + i]).fold(0.0, f64::max)
        }
        Dispersion::Isotropic(tape) => {
            let all = places(axes, tape.operations.len());
            all.iter().map(|place| tape.evaluate(place)).filter(|d| d.is_finite()).fold(0.0, f64::max)
        }
        Dispersion::Velocity { longitudinal, transverse, molecular, .. } => {
            longitudinal.max(*transverse) * speed + molecular
        }
    }
}

/// Particles of each population: as the scene says, or in proportion to their masses, one at least.
pub(super) fn counts(scenario: &Scenario, axes: &[Axis], transport: &Transport) -> Vec<u64> {
    match &scenario.particles.shares {
        Some(Shares::Given(counts)) => counts.clone(),
        _ => divide(scenario.particles.count, &all_masses(scenario, axes, transport)),
    }
}

/// Mass that each population will have in all, as far as that can be told before.
pub(super) fn all_masses(scenario: &Scenario, axes: &[Axis], transport: &Transport) -> Vec<f64> {
    let speed = speed(axes, transport);
    let duration = scenario.run.duration;
    let mass = |population: &Population| masses(axes, transport, population, speed, duration);
    transport.populations.iter().map(mass).collect()
}

/// A number in parts in proportion to weights: sums are kept as far as each part has one at least.
fn divide(count: u64, weights: &[f64]) -> Vec<u64> {
    let whole: f64 = weights.iter().filter(|weight| weight.is_finite()).sum();
    let mut before = 0.0;
    let mut given = 0;
    let part = |weight: &f64| {
        if !(whole > 0.0 && weight.is_finite()) {
            return (count / weights.len().max(1) as u64).max(1);
        }
        before += weight;
        // Rounded at the ends of the parts, so that the parts add up to the whole.
        let end = (count as f64 * (before / whole)).round() as u64;
        let part = end.saturating_sub(given);
        given = end.max(given);
        part.max(1)
    };
    weights.iter().map(part).collect()
}

/// Mass that a population will have in all: initial, of sources, and in through the sides.
fn masses(axes: &[Axis], transport: &Transport, population: &Population, speed: f64, duration: f64) -> f64 {
    let porosity = mean(&transport.porosity, axes);
    let retardation = population.retardation;
    let mut sum = mean(&population.initial, axes) * porosity * retardation * volume(axes);
    for source in transport.sources.iter().filter(|source| source.species == population.species) {
        let time = (source.during.1.min(duration) - source.during.0).max(0.0);
        let during = (source.during.0, source.during.1.min(duration));
        let strength = match &source.strength {
            Strength::RateInTime(tape) => Strength::Rate(mean_over(tape, axes, during)),
            Strength::HeldInTime(tape) => Strength::Held(mean_over(tape, axes, during)),
            constant => constant.clone(),
        };
        sum += match (strength, &source.region) {
            (Strength::Pulse(amount), _) => amount,
            (Strength::Rate(rate), _) => rate * time,
            (Strength::Held(c), Region::Box(low, high)) => {
                let widths = low.iter().zip(high).map(|(low, high)| high - low);
                let volume: f64 = widths.clone().product();
                let shortest = widths.fold(f64::INFINITY, f64::min);
                c * porosity * volume * (retardation + speed * time / shortest)
            }
            (Strength::Held(_) | Strength::RateInTime(_) | Strength::HeldInTime(_), _) => 0.0,
        };
    }
    let spread = spread(axes, &transport.dispersion, speed);
    let diffusive = (4.0 * spread * duration * retardation / std::f64::consts::PI).sqrt();
    for (axis, ends) in transport.sides.iter().enumerate() {
        for patch in ends.iter().flatten() {
            let per_area = match &patch.rule {
                SideRule::Inflow(tapes) => (tapes, speed * duration),
                SideRule::Held(tapes) => (tapes, speed * duration + diffusive),
                _ => continue,
            };
            let Some(tape) = per_area.0.get(population.species) else { continue };
            sum += mean_over(tape, axes, (0.0, duration)) * porosity * area(patch, axis) * per_area.1;
        }
    }
    if let Flow::Darcy(darcy) = &transport.flow {
        for well in &darcy.wells {
            let Some(tape) = well.carrying.get(population.species) else { continue };
            sum += mean_over(tape, axes, (0.0, duration)) * well.rate.max(0.0) * duration;
        }
    }
    sum
}

/// Points in each piece of time between two switches.
const TIMES: usize = 32;
/// Pieces that are looked at so closely.
const MOST_PIECES: usize = 64;

/// Mean over the domain and a window of time, with all that is switched on and off in it.
fn mean_over(tape: &Tape, axes: &[Axis], (from, to): (f64, f64)) -> f64 {
    if !is_timed(tape) || from >= to {
        return mean(tape, axes);
    }
    let mut middle = [0.0; 3];
    axes.iter().for_each(|axis| middle[axis.index] = 0.5 * (axis.low + axis.high));
    let mut edges = vec![from];
    edges.extend(switches(tape, middle, from, to));
    edges.push(to);
    let n = if edges.len() > MOST_PIECES { 1 } else { TIMES };
    let mut sum = 0.0;
    for pair in edges.windows(2) {
        let length = (pair[1] - pair[0]) / n as f64;
        let at = |k: usize| mean(&at_time(tape, pair[0] + (k as f64 + 0.5) * length), axes);
        sum += (0..n).map(at).sum::<f64>() * length;
    }
    sum / (to - from)
}

fn area(patch: &Patch, axis: usize) -> f64 {
    let others = (0..patch.low.len()).filter(|&other| other != axis);
    others.map(|other| patch.high[other] - patch.low[other]).product()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_add_up_to_the_whole() {
        assert_eq!(divide(100, &[1.0, 3.0]), [25, 75]);
        assert_eq!(divide(10, &[1.0, 1.0, 1.0]), [3, 4, 3]);
        assert_eq!(divide(10, &[0.0, 1.0]), [1, 10]);
        assert_eq!(divide(9, &[0.0, 0.0, 0.0]), [3, 3, 3]);
        assert_eq!(divide(7, &[f64::NAN, 2.0]), [3, 7]);
    }
}

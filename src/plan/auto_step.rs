//! The step of `step auto`, from criteria and sizes.
//!
//! Owns the choice. May use estimates of `shares`. It deliberately solves no flow: in cells the steps of single
//! particles follow the flow they meet, and this one only says how often all of them meet.

use super::shares::{places, speed, spread};
use super::transport::{Flow, SubSteps, Transport};
use super::{Axis, Output, Walk};
use crate::scenario::transport::Auto;

/// Cells that a particle may cross in a step at the mean speed; within, its own sub-steps keep the criteria.
pub(super) const CELLS_PER_STEP: f64 = 8.0;
/// Without bins a hundredth of an extent is what criteria count in.
const PARTS: f64 = 100.0;

/// A step in s, and what each particle divides it by.
pub(super) struct Chosen {
    pub step: f64,
    pub sub_steps: Option<SubSteps>,
}

/// Chooses the step of a scene with masses.
///
/// - Equation: `Δt = n min(C / Σ_i |v_i|/Δ_i, F / Σ_i D/Δ_i²)`, at most the duration `T`, then shortened so that
///   `T/Δt` is whole.
/// - Symbols: `C` bound of the Courant number, `F` that of the dispersion number, `v` velocity and `D` largest
///   dispersion, Δ_i sizes along the axes. Where flow is solved or read in cells Δ_i are those of the cells, `v` is
///   an estimate of the mean speed along each axis, and `n` is 8, as particles take sub-steps. Elsewhere Δ_i are
///   the smallest bins of averages and outputs, or a hundredth of the extent, and `n` is 1.
/// - Range: any; `T` itself where nothing moves.
/// - Source: definition of the criteria.
/// - Shape: one number.
pub(super) fn of_masses(
    axes: &[Axis],
    outputs: &[Output],
    transport: &Transport,
    auto: Auto,
    duration: f64,
) -> Chosen {
    let (sizes, n_cells) = match &transport.flow {
        Flow::Darcy(darcy) => {
            let width = |(axis, &cells): (&Axis, &usize)| (axis.high - axis.low) / cells as f64;
            (axes.iter().zip(&darcy.cells).map(width).collect(), CELLS_PER_STEP)
        }
        Flow::Uniform(_) | Flow::Expression(_) | Flow::File(_) => (bin_sizes(axes, outputs), 1.0),
    };
    let speed = speed(axes, transport);
    let velocity = match &transport.flow {
        Flow::Uniform(velocity) => velocity.iter().map(|v| v.abs()).collect(),
        Flow::Expression(tapes) => {
            let largest = |tape: &super::tape::Tape| {
                let all = places(axes, tape.operations.len());
                all.iter()
                    .map(|place| tape.evaluate(place).abs())
                    .filter(|v| v.is_finite())
                    .fold(0.0, f64::max)
            };
            tapes.iter().map(largest).collect()
        }
        Flow::Darcy(_) | Flow::File(_) => vec![speed / (axes.len() as f64).sqrt(); axes.len()],
    };
    let spread = spread(axes, &transport.dispersion, speed);
    let step = n_cells * limit(&sizes, &velocity, &vec![spread; axes.len()], auto);
    let sub_steps = Some(SubSteps { courant: auto.courant, dispersion: auto.dispersion });
    let step = whole(step, duration);
    Chosen { step: fitting(outputs, step, duration).unwrap_or(step), sub_steps }
}

/// Steps shorter than a given one that are tried.
const TRIED: u64 = 10_000;
/// As near as this, in steps, an output is at a step.
const AT_A_STEP: f64 = 1e-9;

/// The longest step up to a given one of which all times of the outputs are multiples, if one of the next
/// shorter ones will do.
pub(super) fn fitting(outputs: &[Output], step: f64, duration: f64) -> Option<f64> {
    let fewest = (duration / step * (1.0 - 1e-12)).ceil().max(1.0);
    let is_fine = |n: f64| times_between(outputs, duration / n).next().is_none();
    let most = (8.0 * fewest + 1000.0).min(fewest + TRIED as f64);
    let mut n = fewest;
    while n <= most {
        if is_fine(n) {
            return Some(duration / n);
        }
        n += 1.0;
    }
    None
}

/// Times of outputs that fall between two steps, each with its output.
pub(super) fn times_between(outputs: &[Output], step: f64) -> impl Iterator<Item = (usize, f64)> + '_ {
    let of_output = move |(idx, output): (usize, &'_ Output)| {
        let is_between = move |t: &f64| (t / step - (t / step).round()).abs() > AT_A_STEP;
        output.times.iter().copied().find(is_between).map(|t| (idx, t))
    };
    outputs.iter().enumerate().filter_map(of_output)
}

/// The same for a walk of fluid in uniform flow, where any step has the right law.
pub(super) fn of_fluid(axes: &[Axis], outputs: &[Output], walk: &Walk, auto: Auto, duration: f64) -> Chosen {
    let velocity: Vec<f64> = walk.drift.iter().map(|v| v.abs()).collect();
    let spread = |axis: usize| {
        let row = &walk.spread[axis * (axis + 1) / 2..][..=axis];
        0.5 * row.iter().map(|b| b * b).sum::<f64>()
    };
    let spread: Vec<f64> = (0..axes.len()).map(spread).collect();
    let step = limit(&bin_sizes(axes, outputs), &velocity, &spread, auto);
    Chosen { step: whole(step, duration), sub_steps: None }
}

fn limit(sizes: &[f64], velocity: &[f64], spread: &[f64], auto: Auto) -> f64 {
    let courant: f64 = sizes.iter().zip(velocity).map(|(size, v)| v / size).sum();
    let dispersion: f64 = sizes.iter().zip(spread).map(|(size, d)| d / (size * size)).sum();
    (auto.courant / courant).min(auto.dispersion / dispersion)
}

/// The next shorter step of which the duration is a multiple; all of it where nothing limits a step.
fn whole(step: f64, duration: f64) -> f64 {
    if !(step > 0.0 && step < duration) {
        return duration;
    }
    duration / (duration / step * (1.0 - 1e-12)).ceil()
}

fn bin_sizes(axes: &[Axis], outputs: &[Output]) -> Vec<f64> {
    let of = |(idx, axis): (usize, &Axis)| {
        let of_outputs = outputs.iter().filter_map(|output| output.bins.get(idx).copied()).max().unwrap_or(1);
        let bins = axis.bins.max(of_outputs) as f64;
        (axis.high - axis.low) / if bins > 1.0 { bins } else { PARTS }
    };
    axes.iter().enumerate().map(of).collect()
}

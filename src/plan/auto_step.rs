//! The step of `step auto`, from criteria and sizes.
//!
//! Owns the choice. May use estimates of `shares`. It deliberately solves no flow: in cells the steps of single
//! particles follow the flow they meet, and this one only says how often all of them meet.

use super::shares::{places, speed, spread};
use super::transport::{Flow, SubSteps, Transport};
use super::{Axis, Output, Plan};
use crate::scenario::transport::Auto;

/// Cells that a particle may cross in a step at the mean speed; within, its own sub-steps keep the criteria.
const CELLS_PER_STEP: f64 = 8.0;
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
///   dispersion, Δ_i sizes along the axes. Where flow is solved or read in cells
///   Δ_i are those of the cells, `v` is an estimate of the mean speed along each axis, and `n` is 8, as particles take sub-steps. Elsewhere Δ_i are
///   the smallest bins of averages and outputs, or a hundredth of the extent, and `n` is 1.
/// - Range: any; `T` itself where nothing moves.
/// - Source: definition of the criteria.
/// - Shape: one number.
pub(super) fn of_masses(
    axes: &[Axis],
    outputs: &[Output],
    transport: &Transport,
    auto: Auto,
    (duration, exchanged): (f64, f64),
) -> Chosen {
    let (limit, n_cells) = longest(axes, outputs, transport, auto, exchanged);
    let sub_steps = Some(SubSteps { courant: auto.courant, dispersion: auto.dispersion });
    let step = whole(n_cells * limit, duration);
    Chosen { step: fitting(outputs, step, duration).unwrap_or(step), sub_steps }
}

/// Displacements that a particle takes in a step of its own, at the mean speed of the flow; 1 where there are no cells.
pub(super) fn displacements(plan: &Plan) -> f64 {
    let Some(transport) = &plan.transport else { return 1.0 };
    let Some(SubSteps { courant, dispersion }) = transport.sub_steps else { return 1.0 };
    let (limit, n_cells) =
        longest(&plan.axes, &plan.outputs, transport, Auto { courant, dispersion, reaction: None }, 0.0);
    let expected = plan.time.step / limit;
    if n_cells > 1.0 && expected.is_finite() { expected.max(1.0) } else { 1.0 }
}

/// The longest time that the criteria allow at the mean speed, and how many of them make a step.
fn longest(
    axes: &[Axis],
    outputs: &[Output],
    transport: &Transport,
    auto: Auto,
    exchanged: f64,
) -> (f64, f64) {
    let of_cells = |cells: &[usize]| {
        let width = |(axis, &cells): (&Axis, &usize)| (axis.high - axis.low) / cells as f64;
        axes.iter().zip(cells).map(width).collect()
    };
    let (sizes, n_cells) = match &transport.flow {
        Flow::Darcy(darcy) => (of_cells(&darcy.cells), CELLS_PER_STEP),
        Flow::File(flow) => (of_cells(&flow.facts.cells), CELLS_PER_STEP),
        Flow::Uniform(_) | Flow::Expression(_) => (bin_sizes(axes, outputs), 1.0),
    };
    let speed = speed(axes, transport);
    let flows = transport.flows();
    let of_flow = |flow: &Flow| match flow {
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
    let mut velocity: Vec<f64> = vec![0.0; axes.len()];
    for own in flows.iter().map(of_flow) {
        velocity.iter_mut().zip(own).for_each(|(largest, v): (&mut f64, f64)| *largest = largest.max(v));
    }
    let spread = spread(axes, &transport.dispersion, speed) + exchanged;
    (limit(&sizes, &velocity, &vec![spread; axes.len()], auto), n_cells)
}

/// Steps shorter than a given one that are tried.
const TRIED: usize = 10_000;
/// Times of outputs that are looked at in all of them.
const MOST_LOOKS: usize = 20_000_000;
const MOST_STEPS: f64 = 1e12;
/// As near as this, in steps, an output is at a step.
const AT_A_STEP: f64 = 1e-9;

/// The longest step up to a given one of which all times of the outputs are multiples, if one of the next
/// shorter ones will do.
pub(super) fn fitting(outputs: &[Output], step: f64, duration: f64) -> Option<f64> {
    let fewest = (duration / step * (1.0 - 1e-12)).ceil().max(1.0);
    let is_fine = |n: f64| times_between(outputs, duration / n).next().is_none();
    // Beyond that many steps nobody runs, and whole numbers of steps cannot be told apart.
    if fewest > MOST_STEPS {
        return None;
    }
    let n_times: usize = outputs.iter().map(|output| output.times.len()).sum();
    let tried = ((7.0 * fewest + 1000.0) as usize).min(TRIED).min(MOST_LOOKS / n_times.max(1));
    (0..=tried).map(|k| fewest + k as f64).find(|&n| is_fine(n)).map(|n| duration / n)
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
pub(super) fn of_fluid(plan: &Plan, auto: Auto, duration: f64) -> Chosen {
    let velocity: Vec<f64> = plan.walk.drift.iter().map(|v| v.abs()).collect();
    let spread: Vec<f64> = (0..plan.axes.len()).map(|axis| dispersion(plan, axis)).collect();
    let step = limit(&bin_sizes(&plan.axes, &plan.outputs), &velocity, &spread, auto);
    Chosen { step: whole(step, duration), sub_steps: None }
}

/// What walks and what is exchanged along an axis, m²/s.
fn dispersion(plan: &Plan, axis: usize) -> f64 {
    let row = &plan.walk.spread[axis * (axis + 1) / 2..][..=axis];
    let walks = 0.5 * row.iter().map(|b| b * b).sum::<f64>();
    walks + plan.exchange.as_ref().map_or(0.0, |exchange| exchange.along(axis))
}

fn limit(sizes: &[f64], velocity: &[f64], spread: &[f64], auto: Auto) -> f64 {
    let courant: f64 = sizes.iter().zip(velocity).map(|(size, v)| v / size).sum();
    let dispersion: f64 = sizes.iter().zip(spread).map(|(size, d)| d / (size * size)).sum();
    (auto.courant / courant).min(auto.dispersion / dispersion)
}

/// The next shorter step of which the duration is a multiple; all of it where nothing limits a step.
pub(super) fn whole(step: f64, duration: f64) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn outputs(times: &[f64]) -> Vec<Output> {
        vec![Output {
            kind: super::super::OutputKind::Total,
            quantities: vec![],
            times: times.to_vec(),
            bins: vec![],
            station: None,
            unit: None,
        }]
    }

    #[test]
    fn steps_meet_the_times_of_outputs() {
        // 12 steps of 8.33 do not meet 30 and 45; 20 steps of 5 do.
        assert_eq!(fitting(&outputs(&[30.0, 45.0, 100.0]), 100.0 / 12.0, 100.0), Some(5.0));
        assert_eq!(fitting(&outputs(&[std::f64::consts::PI]), 1.0, 100.0), None);
    }

    /// Numbers of steps that cannot be told from the next one end, too.
    #[test]
    fn tiny_steps_are_given_up_at_once() {
        for step in [1e-9, 1e-18, 1e-300, f64::MIN_POSITIVE] {
            assert_eq!(fitting(&outputs(&[0.3, 1.0]), step, 1e6), None, "{step:e}");
        }
    }
}

//! When outputs are due, in steps and fractions of a step.
//!
//! Owns the calendar of a run. May use the plan. It deliberately knows nothing of what is observed.

use super::calendar::Calendar;
use super::error::RunError;
use super::program::unsound;
use crate::plan::{Plan, Time};

/// A time is on the grid of steps if it is this near, in steps. The beginning is 0 and nothing else: there
/// may be much to see in the first part of a long step.
pub const ON_GRID: f64 = 1e-9;

/// A time at which outputs are due.
#[derive(Debug, Clone, PartialEq)]
pub struct Due {
    /// After this many whole steps …
    pub steps: u64,
    /// … and this fraction of the next (0 on the grid).
    pub fraction: f64,
    /// s, as asked.
    pub t: f64,
    /// Indices into `plan.outputs`, rising.
    pub outputs: Vec<usize>,
}

/// Length of step number `step`, counted from 0; the last one may be short.
pub fn step_length(time: &Time, step: u64) -> f64 {
    if step + 1 == time.n_steps { time.duration - time.step * step as f64 } else { time.step }
}

/// All due times in order, by the steps of a calendar.
pub fn schedule(plan: &Plan, calendar: &Calendar) -> Result<Vec<Due>, RunError> {
    let mut dues: Vec<Due> = Vec::new();
    for (output_idx, output) in plan.outputs.iter().enumerate() {
        for &t in &output.times {
            let (steps, fraction) = calendar.locate(t).ok_or_else(|| {
                unsound(&format!("an output at {t} s, outside 0 … {} s", plan.time.duration))
            })?;
            dues.push(Due { steps, fraction, t, outputs: vec![output_idx] });
        }
    }
    // A stable sort: outputs of one time stay in the order of the plan.
    dues.sort_by(|a, b| {
        (a.steps, a.fraction).partial_cmp(&(b.steps, b.fraction)).unwrap_or(std::cmp::Ordering::Equal)
    });
    let mut merged: Vec<Due> = Vec::new();
    for due in dues {
        match merged.last_mut() {
            Some(last) if (last.steps, last.fraction, last.t) == (due.steps, due.fraction, due.t) => {
                if last.outputs.last() != due.outputs.last() {
                    last.outputs.extend(due.outputs);
                }
            }
            _ => merged.push(due),
        }
    }
    Ok(merged)
}

/// Steps and fraction of a time; `None` outside the run.
pub fn locate(time: &Time, t: f64) -> Option<(u64, f64)> {
    if !(t >= 0.0 && t <= time.duration * (1.0 + 1e-12)) {
        return None;
    }
    if time.n_steps == 0 {
        return Some((0, 0.0));
    }
    let near = ((t / time.step).round() as u64).min(time.n_steps);
    let at = |steps: u64| if steps == time.n_steps { time.duration } else { steps as f64 * time.step };
    for steps in [near, (near + 1).min(time.n_steps), time.n_steps] {
        let slack = if steps == 0 { 0.0 } else { ON_GRID * time.step };
        if (t - at(steps)).abs() <= slack {
            return Some((steps, 0.0));
        }
    }
    let before = if at(near) <= t { near } else { near - 1 };
    let before = before.min(time.n_steps - 1);
    Some((before, (t - at(before)) / step_length(time, before)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_fall_on_steps_or_between_them() {
        let time = Time { step: 0.1, n_steps: 8, duration: 0.73 };
        assert_eq!(locate(&time, 0.0), Some((0, 0.0)));
        assert_eq!(locate(&time, 0.1 + 0.2), Some((3, 0.0)));
        assert_eq!(locate(&time, 0.73), Some((8, 0.0)));
        let (steps, fraction) = locate(&time, 0.25).unwrap();
        assert_eq!(steps, 2);
        assert!((fraction - 0.5).abs() < 1e-12);
        let (steps, fraction) = locate(&time, 0.715).unwrap();
        assert_eq!(steps, 7);
        assert!((fraction - 0.5).abs() < 1e-12);
        assert_eq!(locate(&time, 0.0), Some((0, 0.0)));
        let (steps, fraction) = locate(&time, 1e-12).unwrap();
        assert_eq!(steps, 0);
        assert!((fraction - 1e-11).abs() < 1e-20);
        assert_eq!(locate(&time, 0.74), None);
        assert_eq!(locate(&time, f64::NAN), None);
        assert!((step_length(&time, 7) - 0.03).abs() < 1e-12);
    }
}

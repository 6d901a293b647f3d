//! Steps of a run: equal ones, cut where something changes.
//!
//! Owns the numbers of steps and when each begins. May use the plan's time. It deliberately does not know what
//! changes.

use super::schedule::{ON_GRID, locate, step_length};
use crate::plan::Time;

/// A change within a step, which ends there.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Cut {
    /// The step that begins here.
    number: u64,
    /// The step of the plan that is cut.
    whole: u64,
    /// s
    t: f64,
}

/// Steps of a run; without cuts they are those of the plan.
#[derive(Debug, Clone, PartialEq)]
pub struct Calendar {
    time: Time,
    cuts: Vec<Cut>,
    /// Steps that begin with a change, rising.
    changes: Vec<u64>,
}

impl Calendar {
    /// `changes` in s, in any order; those outside of the run count nothing.
    pub fn new(time: &Time, changes: &[f64]) -> Self {
        let mut calendar = Self { time: time.clone(), cuts: Vec::new(), changes: Vec::new() };
        let mut times: Vec<f64> = changes.iter().copied().filter(|&t| t > 0.0 && t < time.duration).collect();
        times.sort_by(f64::total_cmp);
        times.dedup_by(|next, last| *next - *last <= ON_GRID * time.step);
        for t in times {
            let Some((whole, fraction)) = locate(time, t) else { continue };
            let number = whole + calendar.cuts.len() as u64 + u64::from(fraction > 0.0);
            if number == 0 || number >= calendar.n_steps() + u64::from(fraction > 0.0) {
                continue;
            }
            if fraction > 0.0 {
                calendar.cuts.push(Cut { number, whole, t });
            }
            calendar.changes.push(number);
        }
        calendar
    }

    pub fn n_steps(&self) -> u64 {
        self.time.n_steps + self.cuts.len() as u64
    }

    /// The cuts before or at the beginning of a step.
    fn cuts_to(&self, step: u64) -> usize {
        self.cuts.partition_point(|cut| cut.number <= step)
    }

    /// When a step begins, s.
    pub fn start(&self, step: u64) -> f64 {
        let n = self.cuts_to(step);
        match self.cuts[..n].last() {
            Some(cut) if cut.number == step => cut.t,
            _ if step == self.n_steps() => self.time.duration,
            _ => (step - n as u64) as f64 * self.time.step,
        }
    }

    /// Length of a step, s.
    pub fn length(&self, step: u64) -> f64 {
        if self.is_cut(step) {
            return self.start(step + 1) - self.start(step);
        }
        step_length(&self.time, step - self.cuts_to(step) as u64)
    }

    /// Whether a step is a part of one of the plan.
    fn is_cut(&self, step: u64) -> bool {
        let n = self.cuts_to(step);
        self.cuts[..n].last().is_some_and(|cut| cut.number == step)
            || self.cuts.get(n).is_some_and(|cut| cut.number == step + 1)
    }

    /// Changes up to the beginning of a step.
    pub fn period(&self, step: u64) -> usize {
        self.changes.partition_point(|&change| change <= step)
    }

    /// The end of steps of equal length from one on, between the same changes, at most `limit`.
    pub fn even_until(&self, step: u64, limit: u64) -> u64 {
        let mut end = limit.min(self.n_steps());
        if let Some(&change) = self.changes.get(self.period(step)) {
            end = end.min(change);
        }
        if self.is_cut(step) {
            return step + 1;
        }
        if let Some(cut) = self.cuts.get(self.cuts_to(step)) {
            end = end.min(cut.number - 1);
        }
        // The last step may have another length.
        if end == self.n_steps() && step + 1 < end { end - 1 } else { end }
    }

    /// The steps that are over at a time and the part of the next one; `None` outside of the run.
    pub fn locate(&self, t: f64) -> Option<(u64, f64)> {
        let (whole, fraction) = locate(&self.time, t)?;
        let near = |cut: &&Cut| (cut.t - t).abs() <= ON_GRID * self.time.step;
        if let Some(cut) = self.cuts.iter().find(near) {
            return Some((cut.number, 0.0));
        }
        let is_before = |cut: &Cut| cut.whole < whole || (cut.whole == whole && fraction > 0.0 && cut.t < t);
        let step = whole + self.cuts.partition_point(is_before) as u64;
        if fraction == 0.0 || !self.is_cut(step) {
            return Some((step, fraction));
        }
        Some((step, (t - self.start(step)) / self.length(step)))
    }

    /// The step that a time lies in.
    pub fn step_at(&self, t: f64) -> u64 {
        self.locate(t).map_or(0, |(step, _)| step).min(self.n_steps().saturating_sub(1))
    }

    /// Boundaries of the steps that are parts of one of the plan, and of a last one of another length, s: within
    /// them steps are equal.
    pub fn seams(&self) -> Vec<f64> {
        let mut list = Vec::new();
        let last = self.n_steps().saturating_sub(1);
        for step in
            self.cuts.iter().flat_map(|cut| [cut.number - 1, cut.number, cut.number + 1]).chain([last])
        {
            list.push(self.start(step));
        }
        list.extend(self.changes.iter().map(|&step| self.start(step)));
        list.sort_by(f64::total_cmp);
        list.dedup();
        list
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn time() -> Time {
        Time { step: 0.1, n_steps: 8, duration: 0.73 }
    }

    #[test]
    fn without_changes_steps_are_those_of_the_plan() {
        let calendar = Calendar::new(&time(), &[0.0, 0.73, 2.0, -1.0]);
        assert_eq!((calendar.n_steps(), calendar.period(7)), (8, 0));
        for step in 0..8 {
            assert_eq!(calendar.start(step), step as f64 * 0.1);
            assert_eq!(calendar.length(step), step_length(&time(), step));
        }
        assert_eq!(calendar.even_until(0, 99), 7);
        assert_eq!(calendar.even_until(7, 99), 8);
    }

    #[test]
    fn steps_end_at_changes() {
        let calendar = Calendar::new(&time(), &[0.52, 0.2, 0.55]);
        // 0, 0.1, 0.2 (change), 0.3, 0.4, 0.5, 0.52, 0.55, 0.6, 0.7, 0.73
        assert_eq!(calendar.n_steps(), 10);
        let starts: Vec<f64> = (0..=10).map(|step| calendar.start(step)).collect();
        let expected = [0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.52, 0.55, 0.6, 0.7, 0.73];
        for (found, expected) in starts.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-15, "{starts:?}");
        }
        let sum: f64 = (0..10).map(|step| calendar.length(step)).sum();
        assert!((sum - 0.73).abs() < 1e-15);
        let periods: Vec<usize> = (0..10).map(|step| calendar.period(step)).collect();
        assert_eq!(periods, [0, 0, 1, 1, 1, 1, 2, 3, 3, 3]);
        let ends: Vec<u64> = (0..10).map(|step| calendar.even_until(step, 99)).collect();
        assert_eq!(ends, [2, 2, 5, 5, 5, 6, 7, 8, 9, 10]);
        assert_eq!(calendar.even_until(2, 4), 4);
    }

    #[test]
    fn times_are_found_in_cut_steps() {
        let calendar = Calendar::new(&time(), &[0.52, 0.2]);
        assert_eq!(calendar.locate(0.2), Some((2, 0.0)));
        assert_eq!(calendar.locate(0.52), Some((6, 0.0)));
        assert_eq!(calendar.locate(0.73), Some((9, 0.0)));
        let (step, fraction) = calendar.locate(0.51).unwrap();
        assert_eq!(step, 5);
        assert!((fraction - 0.5).abs() < 1e-12);
        let (step, fraction) = calendar.locate(0.54).unwrap();
        assert_eq!(step, 6);
        assert!((fraction - 0.25).abs() < 1e-12);
        let (step, fraction) = calendar.locate(0.65).unwrap();
        assert_eq!(step, 7);
        assert!((fraction - 0.5).abs() < 1e-12);
        assert_eq!(calendar.locate(0.8), None);
    }
}

//! The two shapes that most solutions have: a function of x and time, or of time alone.
//!
//! Owns the adapters from such a function to [`Solution`]. May use nothing else. It deliberately knows
//! no formula.

use super::Solution;

/// A solution that depends on x and t.
pub(super) fn of_x_and_time(value: impl Fn(f64, f64) -> f64 + Send + Sync + 'static) -> Box<dyn Solution> {
    Box::new(AlongX(value))
}

/// A solution that depends on t alone.
pub(super) fn of_time(value: impl Fn(f64) -> f64 + Send + Sync + 'static) -> Box<dyn Solution> {
    Box::new(OfTime(value))
}

struct AlongX<F>(F);

impl<F: Fn(f64, f64) -> f64 + Send + Sync> Solution for AlongX<F> {
    fn fill(&self, t: f64, positions: [&[f64]; 3], out: &mut [f64]) {
        for (value, &x) in out.iter_mut().zip(positions[0]) {
            *value = (self.0)(x, t);
        }
    }
}

struct OfTime<F>(F);

impl<F: Fn(f64) -> f64 + Send + Sync> Solution for OfTime<F> {
    fn fill(&self, t: f64, _positions: [&[f64]; 3], out: &mut [f64]) {
        out.fill((self.0)(t));
    }
}

//! Many turns to and fro between two states at once.
//!
//! Owns the law of the time that so many round trips take, and how many surely fit a time. May use `maths` and random
//! streams. It deliberately approximates nothing: what may not fit is left to single turns.

use crate::maths::scalar::{cos, ln, log1p};
use crate::state::stream::Stream;

/// Fewer round trips than this are made one by one.
const FEWEST: f64 = 16.0;
/// More are made in several goes.
const MOST: f64 = (1_u64 << 40) as f64;
/// Standard deviations by which round trips must fit a time: of 16 they do not once in 10¹¹, of more less often.
const MARGIN: f64 = 12.0;

/// Uniform numbers of one particle and displacement, one after the other.
pub struct Numbers<'a> {
    stream: &'a Stream,
    id: u64,
    /// Block of the stream that comes next.
    block: u64,
    numbers: [f64; 8],
    used: usize,
}

impl<'a> Numbers<'a> {
    pub fn new(stream: &'a Stream, id: u64, block: u64) -> Self {
        Self { stream, id, block, numbers: [0.5; 8], used: 8 }
    }

    pub fn uniform(&mut self) -> f64 {
        if self.used == self.numbers.len() {
            self.numbers = self.stream.uniforms_of(self.id, self.block);
            self.block = self.block.wrapping_add(1);
            self.used = 0;
        }
        self.used += 1;
        self.numbers[self.used - 1]
    }

    pub fn normal(&mut self) -> f64 {
        let (a, b) = (self.uniform(), self.uniform());
        (-2.0 * ln(a)).sqrt() * cos(2.0 * std::f64::consts::PI * b)
    }

    /// Sum of `n` waiting times of mean 1.
    ///
    /// - Equation: `d (1 + z/√(9d))³`, `d = n − 1/3`, taken with the chance `e^{z²/2 + d − dv + d ln v}`.
    /// - Symbols: `z` normal, `v` the cube.
    /// - Range: `n ≥ 1`.
    /// - Source: G. Marsaglia, W. W. Tsang (2000), doi:10.1145/358407.358414.
    /// - Shape: one number of the gamma law.
    pub fn gamma(&mut self, n: f64) -> f64 {
        let d = n - 1.0 / 3.0;
        let c = 1.0 / (9.0 * d).sqrt();
        loop {
            let z = self.normal();
            let root = 1.0 + c * z;
            if root <= 0.0 {
                continue;
            }
            let v = root * root * root;
            if ln(self.uniform()) < 0.5 * z * z + d - d * v + d * ln(v) {
                return d * v;
            }
        }
    }
}

/// One of the two states of a round trip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stop {
    /// Chance per time to turn, 1/s.
    pub rate: f64,
    /// Chance that a turn goes to the other state.
    pub share: f64,
    /// Part of a time that counts for the walk.
    pub mobility: f64,
}

impl Stop {
    fn wait(&self) -> f64 {
        1.0 / self.rate
    }
}

/// How many round trips from the first of two states surely end within a time and a walk; none if they are few.
///
/// - Equation: `n μ + 12 σ √n ≤ T`, `μ = 1/k₁ + 1/k₂`, `σ² = 1/k₁² + 1/k₂²`, and the same for the walk.
/// - Symbols: `k` rates, `T` the time.
/// - Range: 16 to 2⁴⁰.
/// - Source: sums of exponential waiting times; `P(Σ > n(1 + δ)) < e^{−n(δ − ln(1 + δ))}`, 10⁻¹¹ for `n = 16`, `δ = 12/√n`.
/// - Shape: a whole number.
pub fn fitting(stops: [Stop; 2], time: f64, walk: f64) -> Option<f64> {
    let waits = stops.map(|stop| stop.wait());
    let ways = [waits[0] * stops[0].mobility, waits[1] * stops[1].mobility];
    let most = |[a, b]: [f64; 2], whole: f64| {
        // Also where a mean is beyond numbers.
        if FEWEST * (a + b) > whole {
            return 0.0;
        }
        let (mean, spread) = (a + b, MARGIN * (a * a + b * b).sqrt());
        let root = (-spread + (spread * spread + 4.0 * mean * whole).sqrt()) / (2.0 * mean);
        root * root
    };
    let by_walk = if walk.is_finite() && ways[0] + ways[1] > 0.0 { most(ways, walk) } else { MOST };
    let n = most(waits, time).min(by_walk).min(MOST).floor();
    (n >= FEWEST).then_some(n)
}

/// Round trips that are made of `n`: all, or as many as come before one that goes elsewhere.
pub fn made(stops: [Stop; 2], n: f64, numbers: &mut Numbers) -> f64 {
    let elsewhere = elsewhere(stops);
    if elsewhere <= 0.0 {
        return n;
    }
    (ln(numbers.uniform()) / log1p(-elsewhere)).floor().min(n)
}

/// Chance that a round trip goes elsewhere: `1 − p₁ p₂`.
pub fn elsewhere([first, second]: [Stop; 2]) -> f64 {
    let away = [1.0 - first.share, 1.0 - second.share];
    away[0] + first.share * away[1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::stream::Purpose;

    /// Reference: mean n, variance n and third central moment 2n of the gamma law; bounds of 4.5 sampling errors.
    #[test]
    fn many_waiting_times_have_the_moments_of_their_sum() {
        let stream = Stream::new(3, Purpose::Turn);
        for n in [1.0, 5.0, 300.0] {
            let draws = 100_000_u64;
            let values: Vec<f64> = (0..draws).map(|id| Numbers::new(&stream, id, 0).gamma(n)).collect();
            let moment = |power: i32| values.iter().map(|x| (x - n).powi(power)).sum::<f64>() / draws as f64;
            let many = draws as f64;
            assert!(moment(1).abs() < 4.5 * (n / many).sqrt(), "{n}: {}", moment(1));
            // E(x − n)⁴ = 3n² + 6n
            let bound = 4.5 * ((2.0 * n * n + 6.0 * n) / many).sqrt();
            assert!((moment(2) - n).abs() < bound, "{n}: {}", moment(2));
            // E(x − n)⁶ = 15n³ + 130n² + 120n
            let bound = 4.5 * ((15.0 * n * n * n + 130.0 * n * n + 120.0 * n) / many).sqrt();
            assert!((moment(3) - 2.0 * n).abs() < bound, "{n}: {}", moment(3));
        }
    }

    #[test]
    fn round_trips_fit_the_time_and_the_walk_or_are_made_one_by_one() {
        let stop = |rate: f64, mobility: f64| Stop { rate, share: 1.0, mobility };
        let stops = [stop(2.0, 1.0), stop(1.0, 0.0)];
        let n = fitting(stops, 1e6, f64::INFINITY).expect("many");
        assert!(n * 1.5 + 12.0 * (n * 1.25_f64).sqrt() <= 1e6 && n > 6e5);
        let n = fitting(stops, 1e6, 1e4).expect("many");
        assert!(n * 0.5 + 12.0 * (n * 0.25_f64).sqrt() <= 1e4 && n > 1.5e4);
        assert_eq!(fitting(stops, 50.0, f64::INFINITY), None);
        assert_eq!(fitting([stop(1e300, 1.0), stop(1e300, 1.0)], 1e10, f64::INFINITY), Some(MOST));
        assert_eq!(fitting([stop(0.0, 1.0), stop(1.0, 1.0)], 1e10, f64::INFINITY), None);
    }
}

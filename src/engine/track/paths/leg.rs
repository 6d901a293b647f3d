//! The way of a particle along one axis while it is in one cell.
//!
//! Owns the closed forms. May use `maths`. It deliberately knows no cells: it is given two ends and their velocities.

use crate::maths::scalar::{expm1, ln, log1p};

/// Motion along one axis with a velocity that is linear in the place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Leg {
    from: f64,
    /// Velocity at `from`, m/s.
    velocity: f64,
    /// `dv/dx`, 1/s.
    rate: f64,
    /// Lower and upper end, m; infinite where there is none.
    ends: [f64; 2],
    /// Velocities there, m/s.
    at_ends: [f64; 2],
}

impl Leg {
    /// Between two faces.
    pub fn between(from: f64, ends: [f64; 2], at_ends: [f64; 2]) -> Self {
        let width = ends[1] - ends[0];
        let part = ((from - ends[0]) / width).clamp(0.0, 1.0);
        // At a face exactly its velocity, so that both cells say the same.
        let velocity = at_ends[0] * (1.0 - part) + at_ends[1] * part;
        Self { from, velocity, rate: (at_ends[1] - at_ends[0]) / width, ends, at_ends }
    }

    /// With one velocity; an end that is infinite is never reached.
    pub fn steady(from: f64, velocity: f64, ends: [f64; 2]) -> Self {
        Self { from, velocity, rate: 0.0, ends, at_ends: [velocity; 2] }
    }

    pub fn rate(&self) -> f64 {
        self.rate
    }

    /// Whether water leaves through neither end.
    pub fn is_closed(&self) -> bool {
        self.at_ends[0] >= 0.0 && self.at_ends[1] <= 0.0
    }

    /// Time to a place ahead with the velocity there; infinite if it is never reached.
    ///
    /// - Equation: `t = ln(v₁/v₀)/A = (δ/v₀) ln(1 + w)/w`, `w = A δ/v₀`.
    /// - Symbols: `δ` way, `v₀`, `v₁` velocities at its ends, `A = dv/dx`.
    /// - Range: velocities of one sign; the second form has no cancellation where `A` is small.
    /// - Source: D. W. Pollock (1988), doi:10.1111/j.1745-6584.1988.tb00425.x; methods, equation 1.6.
    /// - Shape: one axis.
    fn time(&self, way: f64, velocity: f64, rate: f64) -> f64 {
        if way == 0.0 {
            return 0.0;
        }
        let direct = way / self.velocity;
        let change = rate * direct;
        if !(direct > 0.0 && change > -1.0 && velocity * self.velocity > 0.0) {
            return f64::INFINITY;
        }
        match change.abs() {
            0.0 => direct,
            small if small < 0.5 => direct * log1p(change) / change,
            _ => ln(velocity / self.velocity) / rate,
        }
    }

    /// Time to a place ahead, s.
    pub fn time_to(&self, place: f64) -> f64 {
        let way = place - self.from;
        self.time(way, self.velocity + self.rate * way, self.rate)
    }

    /// The end that it goes to, and when; nothing if it goes to none.
    pub fn exit(&self) -> Option<(usize, f64)> {
        let end = match self.velocity {
            v if v > 0.0 => 1,
            v if v < 0.0 => 0,
            _ => return None,
        };
        let time = self.time(self.ends[end] - self.from, self.at_ends[end], self.rate);
        time.is_finite().then_some((end, time))
    }

    /// How long ago it came in, s; infinite if it never did.
    pub fn since(&self) -> f64 {
        let end = match self.velocity {
            v if v > 0.0 => 0,
            v if v < 0.0 => 1,
            _ => return f64::INFINITY,
        };
        // The same way back, in time that runs backwards.
        let back = Self { velocity: -self.velocity, ..*self };
        back.time(self.ends[end] - self.from, -self.at_ends[end], -self.rate)
    }

    /// Where it is after a time that does not lead out.
    ///
    /// - Equation: `x = x₀ + v₀ t (e^{At} − 1)/(At)`.
    /// - Symbols: `A = dv/dx`; towards a place where the velocity is zero an infinite time leads.
    /// - Range: any `A t`.
    /// - Source: D. W. Pollock (1988), doi:10.1111/j.1745-6584.1988.tb00425.x; methods, equation 1.5.
    /// - Shape: one axis.
    pub fn after(&self, time: f64) -> f64 {
        if self.velocity == 0.0 {
            return self.from;
        }
        let way = match self.rate * time {
            0.0 => self.velocity * time,
            exponent if exponent.is_infinite() => -self.velocity / self.rate,
            exponent => self.velocity * time * (expm1(exponent) / exponent),
        };
        (self.from + way).clamp(self.ends[0], self.ends[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reference: `x(t)` of `x' = v₀ + A (x − x₀)` in both directions, composed of two halves.
    #[test]
    fn a_way_is_the_sum_of_its_parts() {
        for (low, high) in [(1.0, 2.0), (2.0, 1.0), (1.0, 1.0), (1.0, 1.0 + 1e-12), (-2.0, -0.5), (1e-9, 3.0)]
        {
            let leg = Leg::between(10.3, [10.0, 11.0], [low, high]);
            let (end, time) = leg.exit().unwrap();
            assert_eq!(end, usize::from(low > 0.0));
            assert!((leg.after(time) - [10.0, 11.0][end]).abs() < 1e-14 * 11.0);
            let middle = leg.after(0.3 * time);
            assert!((leg.time_to(middle) - 0.3 * time).abs() < 1e-11 * time, "{low} {high}");
            let rest = Leg::between(middle, [10.0, 11.0], [low, high]);
            assert!((rest.exit().unwrap().1 - 0.7 * time).abs() < 1e-11 * time);
            assert!((rest.since() - leg.since() - 0.3 * time).abs() < 1e-11 * (time + leg.since()));
        }
    }

    #[test]
    fn between_opposite_velocities_nobody_leaves() {
        let leg = Leg::between(0.2, [0.0, 1.0], [1.0, -1.0]);
        assert!(leg.is_closed() && leg.exit().is_none());
        assert!((leg.after(f64::INFINITY) - 0.5).abs() < 1e-15);
        // v = 1 − 2x: x = ½ (1 − e^{−2t}) from the lower face on.
        assert!((leg.since() - 0.5 * -ln(0.6)).abs() < 1e-15);
        assert_eq!(Leg::between(0.5, [0.0, 1.0], [-1.0, 1.0]).exit(), None);
    }
}

//! What enters through a side that is held at a concentration, in one step.
//!
//! Owns the closed forms of one step. May use `maths`. It deliberately knows no particle.

use crate::maths::scalar::{erf, erfc, exp};

/// Below this Péclet number of a step the flow through the side is left out.
const STILL: f64 = 1e-4;
/// Halvings of the search for a depth: 1e-15 of the deepest.
const HALVINGS: usize = 50;
/// Points of the mean time of what has entered.
const LAG_POINTS: usize = 32;

/// A half space that begins empty and whose edge is held at 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Entry {
    /// Velocity into the half space, m/s.
    pub velocity: f64,
    /// m²/s
    pub dispersion: f64,
    /// s
    pub time: f64,
}

impl Entry {
    fn length(self) -> f64 {
        2.0 * (self.dispersion * self.time).sqrt()
    }

    fn travelled(self) -> f64 {
        self.velocity * self.time
    }

    /// What lies deeper than `x`, per area and unit of concentration, m.
    ///
    /// - Equation: `G = ∫_x^∞ ½ [erfc((y − vt)/s) + e^{vy/D} erfc((y + vt)/s)] dy
    ///   = s/2 ierfc((x − vt)/s) + D/(2v) [erfc((x − vt)/s) − e^{vx/D} erfc((x + vt)/s)]`, `s = 2√(Dt)`.
    /// - Symbols: `v` velocity inwards, `D` dispersion, `t` time; `ierfc z = e^{−z²}/√π − z erfc z`.
    /// - Range: any velocity; `D = 0` leaves what was carried in.
    /// - Source: A. Ogata, R. B. Banks (1961), USGS Prof. Paper 411-A, doi:10.3133/pp411A, integrated.
    /// - Shape: one depth.
    pub fn beyond(self, x: f64) -> f64 {
        let (s, a) = (self.length(), self.travelled());
        if s <= 1e-9 * a.abs() || s == 0.0 {
            return (a - x).max(0.0);
        }
        let ierfc = |z: f64| exp(-z * z) / std::f64::consts::PI.sqrt() - z * erfc(z);
        if a.abs() <= STILL * s {
            return s * ierfc(x / s);
        }
        let (v, d) = (self.velocity, self.dispersion);
        let image = exp_erfc(v * x / d, (x + a) / s);
        (0.5 * s * ierfc((x - a) / s) + 0.5 * d / v * (erfc((x - a) / s) - image)).max(0.0)
    }

    /// Everything that has entered: [`Entry::beyond`] at the edge.
    ///
    /// - Equation: `G(0) = s/2 ierfc(−vt/s) + D/v erf(vt/s)`.
    /// - Symbols: as in [`Entry::beyond`].
    /// - Range: any velocity.
    /// - Source: the same; `v → 0` gives `2√(Dt/π)` (methods, section 1.6).
    /// - Shape: one number.
    pub fn total(self) -> f64 {
        let (s, a) = (self.length(), self.travelled());
        if s <= 1e-9 * a.abs() || s == 0.0 || a.abs() <= STILL * s {
            return self.beyond(0.0);
        }
        let z = a / s;
        let carried = 0.5 * s * (exp(-z * z) / std::f64::consts::PI.sqrt() + z * erfc(-z));
        carried + self.dispersion / self.velocity * erf(z)
    }

    /// How long ago what is there entered, on average, s.
    ///
    /// - Equation: `∫₀^t s g(s) ds / G(t) = t − ∫₀^t G(s) ds / G(t)`, `g = dG/dt`, by the midpoint rule in `√s`.
    /// - Symbols: `G` of [`Entry::total`].
    /// - Range: any velocity: `t/3` without flow, `t/2` without dispersion.
    /// - Source: integration by parts.
    /// - Shape: one number.
    pub fn lag(self) -> f64 {
        let whole = self.total();
        if whole <= 0.0 {
            return 0.5 * self.time;
        }
        let at = |k: usize| {
            let part = (k as f64 + 0.5) / LAG_POINTS as f64;
            2.0 * part * Entry { time: self.time * part * part, ..self }.total()
        };
        let mean = (0..LAG_POINTS).map(at).sum::<f64>() / LAG_POINTS as f64;
        self.time * (1.0 - mean / whole)
    }

    /// Depth beyond which a share `uniform` of what has entered lies.
    pub fn depth(self, uniform: f64) -> f64 {
        let wanted = uniform * self.total();
        let (mut low, mut high) = (0.0, self.travelled().max(0.0) + 7.0 * self.length());
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if self.beyond(middle) > wanted { low = middle } else { high = middle }
        }
        0.5 * (low + high)
    }

    /// Concentration at a depth.
    ///
    /// - Equation: `c = ½ [erfc((y − vt)/s) + e^{vy/D} erfc((y + vt)/s)]`.
    /// - Symbols: as in [`Entry::beyond`].
    /// - Range: any velocity.
    /// - Source: Ogata and Banks (1961), doi:10.3133/pp411A.
    /// - Shape: one depth.
    fn profile(self, y: f64) -> f64 {
        let (s, a) = (self.length(), self.travelled());
        if s <= 1e-9 * a.abs() || s == 0.0 {
            return if y <= a { 1.0 } else { 0.0 };
        }
        0.5 * (erfc((y - a) / s) + exp_erfc(self.velocity * y / self.dispersion, (y + a) / s))
    }

    /// How long what is found at a depth has been there, s.
    ///
    /// - Equation: `P(age < a) = c(y, a)/c(y, t)`.
    /// - Symbols: `c` as in [`Entry::profile`], `t` the time of the entry.
    /// - Range: depths that something has reached.
    /// - Source: `c(y, a)` is the chance that a walk from `y` against the flow meets the edge within `a`; backwards in
    ///   time it is the way of what came in last.
    /// - Shape: one particle, by bisection.
    pub fn age(self, y: f64, uniform: f64) -> f64 {
        let wanted = uniform * self.profile(y);
        let (mut low, mut high) = (0.0, self.time);
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            if (Self { time: middle, ..self }).profile(y) < wanted { low = middle } else { high = middle }
        }
        high
    }
}

/// `e^a erfc(b)` where either alone may be beyond numbers.
fn exp_erfc(a: f64, b: f64) -> f64 {
    if b > 5.0 { exp(a - b * b) * crate::maths::special::erfcx(b) } else { exp(a) * erfc(b) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::maths::quadrature::integrate;

    /// Reference: the profile, integrated numerically.
    #[test]
    fn integrals_are_those_of_the_profile() {
        for velocity in [0.0, 1e-6, 1e-3, 0.7, 30.0, -0.7, -5.0] {
            let entry = Entry { velocity, dispersion: 0.3, time: 0.4 };
            let deepest = entry.travelled().max(0.0) + 8.0 * entry.length();
            for x in [0.0, 0.1, 0.5, 2.0] {
                let expected =
                    integrate(|y| entry.profile(y), &[x, deepest.max(x + 1.0)], 1e-13, 1e-12).value;
                let found = entry.beyond(x);
                // Near v = 0 the flow is left out: half of a step's Péclet number at most.
                let error = (found - expected).abs();
                assert!(error <= 1e-10 + 1e-4 * expected, "v = {velocity}, x = {x}: {found} {expected}");
                if velocity.abs() > 1e-2 || velocity == 0.0 {
                    assert!(error <= 1e-10, "v = {velocity}, x = {x}: {found} {expected}");
                }
            }
            assert!((entry.total() - entry.beyond(0.0)).abs() <= 1e-12 * entry.total());
            let depth = entry.depth(0.25);
            assert!((entry.beyond(depth) - 0.25 * entry.total()).abs() <= 1e-10, "v = {velocity}");
        }
        let still = Entry { velocity: 0.0, dispersion: 2.0, time: 3.0 };
        assert!((still.total() - 2.0 * (6.0 / std::f64::consts::PI).sqrt()).abs() < 1e-14);
        let carried = Entry { velocity: 2.0, dispersion: 0.0, time: 3.0 };
        assert!((still.lag() - 1.0).abs() < 1e-3 && (carried.lag() - 1.5).abs() < 1e-3);
        assert_eq!(carried.total(), 6.0);
        assert!((carried.depth(0.5) - 3.0).abs() < 1e-13);
    }
}

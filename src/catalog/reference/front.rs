//! The coordinate of a front that moves and spreads.
//!
//! Owns the similarity variable. May use nothing else. It deliberately knows no concentration.

/// A plane front that starts sharp at `x0`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Front {
    /// m²/s
    pub(super) dispersion: f64,
    /// m/s, in the frame of the scene
    pub(super) velocity: f64,
    /// m
    pub(super) x0: f64,
}

impl Front {
    /// The similarity variable of the front.
    ///
    /// Equation: `ξ = (x − x0 − v t) / (2 √(D t))`.
    /// Symbols: x position, x0 start, v velocity, D dispersion, t time.
    /// Dimensions and range: none; any real number, infinite beside a front that has not spread.
    /// Source: Crank 1975, The Mathematics of Diffusion, chapter 2.
    /// Shape: linear in x, flattening with √t.
    pub(super) fn similarity(self, x: f64, t: f64) -> f64 {
        let distance = x - self.x0 - self.velocity * t.max(0.0);
        let width = 2.0 * (self.dispersion * t.max(0.0)).sqrt();
        if width > 0.0 {
            distance / width
        } else if distance == 0.0 {
            0.0
        } else {
            f64::INFINITY.copysign(distance)
        }
    }
}

//! Exponents of the seven base dimensions, with rational powers.

/// One exponent unit is 1/60, so that halves, thirds, … sixths and tenths are exact.
pub const SCALE: i16 = 60;

/// Exponents of length, mass, time, amount, temperature, current, luminous intensity, in 1/60.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Dimension(pub [i16; 7]);

impl Dimension {
    /// A dimension from whole exponents of length, mass, time and amount.
    pub const fn new(length: i16, mass: i16, time: i16, amount: i16) -> Self {
        Self([length * SCALE, mass * SCALE, time * SCALE, amount * SCALE, 0, 0, 0])
    }

    pub const NONE: Self = Self::new(0, 0, 0, 0);
    pub const LENGTH: Self = Self::new(1, 0, 0, 0);
    pub const TIME: Self = Self::new(0, 0, 1, 0);
    pub const RATE: Self = Self::new(0, 0, -1, 0);
    pub const VELOCITY: Self = Self::new(1, 0, -1, 0);
    /// Dispersion, m²/s.
    pub const DISPERSION: Self = Self::new(2, 0, -1, 0);
    /// mol/m³
    pub const MOLAR_CONCENTRATION: Self = Self::new(-3, 0, 0, 1);
    /// kg/m³
    pub const MASS_CONCENTRATION: Self = Self::new(-3, 1, 0, 0);
}

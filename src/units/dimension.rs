//! Exponents of the seven base dimensions, with rational powers.

use std::fmt::Write as _;

/// One exponent unit is 1/60, so that halves, thirds, … sixths and tenths are exact.
pub const SCALE: i16 = 60;

/// Exponents of length, mass, time, amount, temperature, current, luminous intensity, in 1/60.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
pub struct Dimension(pub [i16; 7]);

const SYMBOLS: [&str; 7] = ["m", "kg", "s", "mol", "K", "A", "cd"];
const WORDS: [&str; 7] = ["length", "mass", "time", "amount", "temperature", "current", "luminosity"];

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
    pub const TEMPERATURE: Self = Self([0, 0, 0, 0, SCALE, 0, 0]);
    /// Dispersion, m²/s.
    pub const DISPERSION: Self = Self::new(2, 0, -1, 0);
    /// mol/m³
    pub const MOLAR_CONCENTRATION: Self = Self::new(-3, 0, 0, 1);
    /// kg/m³
    pub const MASS_CONCENTRATION: Self = Self::new(-3, 1, 0, 0);

    pub fn is_none(self) -> bool {
        self == Self::NONE
    }

    /// Whether this is one of the two dimensions that a concentration may have.
    pub fn is_concentration(self) -> bool {
        self == Self::MOLAR_CONCENTRATION || self == Self::MASS_CONCENTRATION
    }

    pub fn times(self, other: Self) -> Self {
        Self(std::array::from_fn(|idx| self.0[idx].saturating_add(other.0[idx])))
    }

    pub fn over(self, other: Self) -> Self {
        Self(std::array::from_fn(|idx| self.0[idx].saturating_sub(other.0[idx])))
    }

    /// This dimension to the power `numerator/denominator`; `None` if an exponent is no sixtieth or
    /// out of range.
    pub fn power(self, numerator: i32, denominator: i32) -> Option<Self> {
        let mut result = [0; 7];
        for (exponent, own) in result.iter_mut().zip(self.0) {
            let scaled = i32::from(own).checked_mul(numerator)?;
            if denominator == 0 || scaled % denominator != 0 {
                return None;
            }
            *exponent = i16::try_from(scaled / denominator).ok()?;
        }
        Some(Self(result))
    }

    /// This dimension to a decimal power such as 0.5 or −1.2.
    pub fn power_f64(self, power: f64) -> Option<Self> {
        let scaled = power * f64::from(SCALE);
        let rounded = scaled.round();
        if self.is_none() {
            return Some(self);
        }
        // Decimal thirds such as 0.333333 are not exact thirds: refuse rather than guess.
        ((scaled - rounded).abs() < 1e-9 && rounded.abs() < 6e3)
            .then(|| self.power(rounded as i32, i32::from(SCALE)))
            .flatten()
    }

    /// The SI unit, such as `m^2/s`; empty for a plain number.
    pub fn unit_text(self) -> String {
        compose(self, &SYMBOLS, "1")
    }

    /// Words and unit for messages, such as `length^2/time (m^2/s)`.
    pub fn describe(self) -> String {
        let named = [
            (Self::NONE, "a plain number"),
            (Self::MOLAR_CONCENTRATION, "an amount concentration (mol/m^3)"),
            (Self::MASS_CONCENTRATION, "a mass concentration (kg/m^3)"),
            (Self::LENGTH, "a length (m)"),
            (Self::TIME, "a time (s)"),
            (Self::RATE, "1/time (1/s)"),
            (Self::VELOCITY, "a velocity (m/s)"),
            (Self::DISPERSION, "a dispersion coefficient (m^2/s)"),
        ];
        match named.iter().find(|(dimension, _)| *dimension == self) {
            Some((_, words)) => (*words).to_owned(),
            None => format!("{} ({})", compose(self, &WORDS, "1"), self.unit_text()),
        }
    }

    /// The exponents as numbers, in the order of the type's doc.
    pub fn exponents(self) -> [f64; 7] {
        self.0.map(|exponent| f64::from(exponent) / f64::from(SCALE))
    }
}

fn compose(dimension: Dimension, names: &[&str; 7], one: &str) -> String {
    let part = |sign: i16| {
        let mut text = String::new();
        for (name, exponent) in names.iter().zip(dimension.0) {
            let exponent = exponent * sign;
            if exponent <= 0 {
                continue;
            }
            if !text.is_empty() {
                text.push(if sign > 0 { '·' } else { '/' });
            }
            text.push_str(name);
            if exponent != SCALE {
                let _ = write!(text, "^{}", f64::from(exponent) / f64::from(SCALE));
            }
        }
        text
    };
    let (above, below) = (part(1), part(-1));
    match (above.is_empty(), below.is_empty()) {
        (_, true) => above,
        (true, false) => format!("{one}/{below}"),
        (false, false) => format!("{above}/{below}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_and_words() {
        assert_eq!(Dimension::DISPERSION.unit_text(), "m^2/s");
        assert_eq!(Dimension::RATE.unit_text(), "1/s");
        assert_eq!(Dimension::NONE.unit_text(), "");
        assert_eq!(Dimension::DISPERSION.power(1, 2).map(Dimension::unit_text).as_deref(), Some("m/s^0.5"));
        assert_eq!(Dimension::LENGTH.power_f64(0.333), None);
        assert_eq!(Dimension::MOLAR_CONCENTRATION.unit_text(), "mol/m^3");
        assert_eq!(Dimension::new(-3, 0, -1, 1).describe(), "amount/length^3/time (mol/m^3/s)");
    }
}

//! Dimensions, units and exact conversion of written quantities to SI.
//!
//! Owns the table of units; prefixes are computed. May use `maths`, for roots of units.
//! It deliberately does not know what a quantity is for.

pub mod dimension;
mod table;

use crate::maths::scalar;

pub use dimension::Dimension;
pub use table::{is_unit_symbol, known_symbols};

/// Powers of units are counted in these, as those of dimensions.
const SIXTIETHS: i32 = dimension::SCALE as i32;

/// A unit as written, such as `mg/L`: its dimension and its exact factor to SI,
/// `numerator · 10^decimal / denominator`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    pub dimension: Dimension,
    /// Power of ten, applied to the decimal digits before they become a binary number.
    pub decimal: i32,
    /// Product of the factors that are no powers of ten (60 for `min`).
    pub numerator: f64,
    pub denominator: f64,
}

/// Why a unit text is no unit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum UnitError {
    /// A symbol that the table does not know, with its byte range in the text.
    UnknownSymbol { symbol: String, start: usize, end: usize },
    /// Not of the form `symbol`, `symbol^n`, `symbol^0.5`, joined by `/`, `·` or `.`.
    Malformed { start: usize, end: usize },
    /// A power that is no number of sixtieths.
    NoSixtieth { start: usize, end: usize },
    /// An exponent beyond ±9.
    ExponentTooLarge { start: usize, end: usize },
}

impl Unit {
    pub const ONE: Unit = Unit { dimension: Dimension::NONE, decimal: 0, numerator: 1.0, denominator: 1.0 };

    /// Parses `m`, `cm^2/s`, `/d`, `kg·m/s^2`, `%`.
    pub fn parse(text: &str) -> Result<Unit, UnitError> {
        let mut unit = Unit::ONE;
        // Powers of ten in sixtieths: those of a whole unit may add up to a whole one.
        let mut decimal = 0;
        let mut position = 0;
        let mut sign = 1;
        if let Some(rest) = text.strip_prefix('/') {
            sign = -1;
            position = text.len() - rest.len();
        }
        loop {
            let (symbol_end, power, end) = read_term(text, position)?;
            let symbol = &text[position..symbol_end];
            let factor = table::lookup(symbol).ok_or_else(|| unknown(text, position))?;
            if text[symbol_end..].starts_with(|c: char| c == '_' || c.is_ascii_digit()) {
                return Err(unknown(text, position));
            }
            decimal += sign * power * factor.decimal;
            unit = unit.times(factor, sign * power);
            let Some(joint) = text[end..].chars().next() else { return Ok(unit.shifted(decimal)) };
            sign = match joint {
                '/' => -1,
                '·' | '.' => 1,
                _ => return Err(UnitError::Malformed { start: end, end: end + joint.len_utf8() }),
            };
            position = end + joint.len_utf8();
        }
    }

    /// Times another to a power in sixtieths; the powers of ten are the caller's.
    fn times(self, other: Unit, power: i32) -> Unit {
        let dimension = other.dimension.power(power, SIXTIETHS).unwrap_or(Dimension::NONE);
        let mut result = Unit { dimension: self.dimension.times(dimension), ..self };
        if power % SIXTIETHS != 0 {
            let factor = other.numerator / other.denominator;
            result.numerator *= scalar::pow(factor, f64::from(power) / f64::from(SIXTIETHS));
            return result;
        }
        for _ in 0..(power / SIXTIETHS).unsigned_abs() {
            if power > 0 {
                result.numerator *= other.numerator;
                result.denominator *= other.denominator;
            } else {
                result.numerator *= other.denominator;
                result.denominator *= other.numerator;
            }
        }
        result
    }

    /// Times a power of ten in sixtieths.
    fn shifted(self, decimal: i32) -> Unit {
        let rest = decimal.rem_euclid(SIXTIETHS);
        let root = if rest == 0 { 1.0 } else { scalar::pow(10.0, f64::from(rest) / f64::from(SIXTIETHS)) };
        Unit { decimal: decimal.div_euclid(SIXTIETHS), numerator: self.numerator * root, ..self }
    }

    /// The SI value of written digits in this unit; `None` if it is beyond the range of numbers.
    ///
    /// The power of ten moves the decimal point of the digits, so `7.5 cm` and `0.075 m` are one
    /// and the same number, bit by bit.
    pub fn to_si(&self, digits: &str) -> Option<f64> {
        let scaled = |value: f64| {
            let value = value * self.numerator / self.denominator;
            value.is_finite().then_some(value)
        };
        // Long tables have millions of numbers.
        if self.decimal == 0 {
            return scaled(digits.parse().ok()?);
        }
        let (mantissa, exponent) = match digits.split_once(['e', 'E']) {
            Some((mantissa, exponent)) => (mantissa, whole(exponent)?),
            None => (digits, 0),
        };
        let exponent = exponent.saturating_add(i64::from(self.decimal));
        scaled(format!("{mantissa}e{exponent}").parse().ok()?)
    }

    /// The SI value of one of this unit.
    pub fn factor(&self) -> f64 {
        self.to_si("1").unwrap_or(f64::NAN)
    }
}

/// A whole number as far as it matters for an exponent.
fn whole(digits: &str) -> Option<i64> {
    let most = i64::from(i32::MAX);
    let bare = digits.strip_prefix(['+', '-']).unwrap_or(digits);
    let is_whole = !bare.is_empty() && bare.bytes().all(|c| c.is_ascii_digit());
    let beyond = if digits.starts_with('-') { -most } else { most };
    is_whole.then(|| digits.parse().unwrap_or(beyond).clamp(-most, most))
}

/// The word at `start`, which is no unit: up to the next joint or power.
fn unknown(text: &str, start: usize) -> UnitError {
    let rest = &text[start..];
    let len = rest.find(['/', '·', '.', '^']).unwrap_or(rest.len());
    UnitError::UnknownSymbol { symbol: rest[..len].to_owned(), start, end: start + len }
}

/// Reads `symbol` or `symbol^n` at `start`; returns the end of the symbol, the power in sixtieths and the end.
fn read_term(text: &str, start: usize) -> Result<(usize, i32, usize), UnitError> {
    let rest = &text[start..];
    let symbol_len = rest.find(|c: char| !(c.is_alphabetic() || c == '%' || c == 'µ')).unwrap_or(rest.len());
    let symbol_end = start + symbol_len;
    if symbol_len == 0 {
        let end = start + rest.chars().next().map_or(0, char::len_utf8);
        return Err(UnitError::Malformed { start, end });
    }
    let after = &text[symbol_end..];
    for (mark, power) in [('²', 2 * SIXTIETHS), ('³', 3 * SIXTIETHS)] {
        if after.starts_with(mark) {
            return Ok((symbol_end, power, symbol_end + mark.len_utf8()));
        }
    }
    let Some(exponent) = after.strip_prefix('^') else {
        return Ok((symbol_end, SIXTIETHS, symbol_end));
    };
    let digits_len = power_len(exponent);
    let end = symbol_end + 1 + digits_len;
    let malformed = UnitError::Malformed { start: symbol_end, end };
    let power: f64 = exponent[..digits_len].parse().map_err(|_| malformed.clone())?;
    if power == 0.0 {
        return Err(malformed);
    }
    if power.abs() > 9.0 {
        return Err(UnitError::ExponentTooLarge { start: symbol_end, end });
    }
    let sixtieths = power * f64::from(SIXTIETHS);
    // A third as a decimal has sixteen digits, as dimensions are shown; a shorter one is refused and not guessed.
    if (sixtieths - sixtieths.round()).abs() > 1e-9 {
        return Err(UnitError::NoSixtieth { start: symbol_end, end });
    }
    Ok((symbol_end, sixtieths.round() as i32, end))
}

/// Bytes of `-`, digits and a point that digits follow: a point before a symbol joins two units.
fn power_len(text: &str) -> usize {
    let n_digits = |text: &str| text.bytes().take_while(u8::is_ascii_digit).count();
    let sign = usize::from(text.starts_with('-'));
    let whole = sign + n_digits(&text[sign..]);
    match text[whole..].strip_prefix('.').map_or(0, n_digits) {
        0 => whole,
        n => whole + 1 + n,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn si(digits: &str, unit: &str) -> f64 {
        Unit::parse(unit).expect("unit").to_si(digits).expect("finite")
    }

    #[test]
    fn written_decimals_are_exact() {
        assert_eq!(si("7.5", "cm"), 0.075);
        assert_eq!(si("1.3e-3", "cm^2/s"), 1.3e-7);
        assert_eq!(si("0.02", "mol/L"), 20.0);
        assert_eq!(si("1.21e-2", "cm/s"), 1.21e-4);
        assert_eq!(si("8", "mg/L"), 8e-3);
        assert_eq!(si("20", "%"), 0.2);
        assert_eq!(si("1", "a"), 31_557_600.0);
        assert_eq!(si("1", "ft"), 0.3048);
    }

    #[test]
    fn factors_that_are_no_powers_of_ten_divide_once() {
        assert_eq!(si("3", "/d"), 3.0 / 86_400.0);
        assert_eq!(si("90", "min"), si("1.5", "h"));
        assert_eq!(si("10", "m/d"), 10.0 / 86_400.0);
    }

    #[test]
    fn whole_symbols_win_over_prefixes() {
        assert_eq!(Unit::parse("min").expect("unit").dimension, Dimension::TIME);
        assert_eq!(Unit::parse("d").expect("unit").dimension, Dimension::TIME);
        assert_eq!(si("1", "hPa"), 100.0);
        assert_eq!(si("1", "mmol/m³"), 1e-3);
        assert_eq!(si("1", "µm"), si("1", "um"));
        assert_eq!(si("1", "kg·m/s^2"), si("1", "N"));
    }

    #[test]
    fn powers_may_be_fractions() {
        // mmol^½ L^-½ = (1e-3 mol / 1e-3 m³)^½, and the same for litres alone.
        assert_eq!(si("1", "mmol^0.5/L^0.5"), 1.0);
        let near = |found: f64, expected: f64| {
            assert!((found / expected - 1.0).abs() < 1e-15, "{found} and not {expected}");
        };
        near(si("3", "L^0.5"), 3.0 * 1e-3_f64.sqrt());
        near(si("1", "mol^0.5/L^0.5/s"), 1e3_f64.sqrt());
        near(si("1", "min^-0.5"), 1.0 / 60.0_f64.sqrt());
        near(si("1", "ft^0.5/h"), 0.3048_f64.sqrt() / 3600.0);
        let half = Unit::parse("mol^0.5/m^1.5/s").expect("unit").dimension;
        assert_eq!(half.unit_text(), "mol^0.5/m^1.5/s");
        assert_eq!(half.power(2, 1).map(Dimension::unit_text).as_deref(), Some("mol/m^3/s^2"));
        // A point before a symbol joins, as ever; one before a digit is that of a power.
        assert_eq!(Unit::parse("kg^1.m"), Unit::parse("kg·m"));
        assert_eq!(Unit::parse("m^2.0"), Unit::parse("m^2"));
        // What dimensions are shown as is read again, thirds too.
        let third = Dimension::LENGTH.power(1, 3).expect("a sixtieth");
        assert_eq!(Unit::parse(&third.unit_text()).expect("unit").dimension, third);
        assert_eq!(Unit::parse("m^0.33"), Err(UnitError::NoSixtieth { start: 1, end: 6 }));
        assert_eq!(Unit::parse("m^9.5"), Err(UnitError::ExponentTooLarge { start: 1, end: 5 }));
        assert_eq!(Unit::parse("m^-0.0"), Err(UnitError::Malformed { start: 1, end: 6 }));
    }

    #[test]
    fn what_is_no_unit_is_said_with_its_place() {
        assert_eq!(
            Unit::parse("mol/Q"),
            Err(UnitError::UnknownSymbol { symbol: "Q".into(), start: 4, end: 5 })
        );
        assert_eq!(Unit::parse("m^"), Err(UnitError::Malformed { start: 1, end: 2 }));
        assert_eq!(Unit::parse("m^99"), Err(UnitError::ExponentTooLarge { start: 1, end: 4 }));
        assert_eq!(Unit::parse(""), Err(UnitError::Malformed { start: 0, end: 0 }));
        assert!(Unit::parse("kmin").is_err());
        assert_eq!(
            Unit::parse("c0"),
            Err(UnitError::UnknownSymbol { symbol: "c0".into(), start: 0, end: 2 })
        );
        assert_eq!(
            Unit::parse("/m2"),
            Err(UnitError::UnknownSymbol { symbol: "m2".into(), start: 1, end: 3 })
        );
        assert_eq!(Unit::ONE.to_si("1e999"), None);
    }
}

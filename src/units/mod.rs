//! Dimensions, units and exact conversion of written quantities to SI.
//!
//! Owns the table of units; prefixes are computed. May use nothing else of the crate.
//! It deliberately does not know what a quantity is for.

pub mod dimension;
mod table;

pub use dimension::Dimension;
pub use table::{is_unit_symbol, known_symbols};

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
    /// Not of the form `symbol`, `symbol^n`, joined by `/`, `·` or `.`.
    Malformed { start: usize, end: usize },
    /// An exponent beyond ±9.
    ExponentTooLarge { start: usize, end: usize },
}

impl Unit {
    pub const ONE: Unit = Unit { dimension: Dimension::NONE, decimal: 0, numerator: 1.0, denominator: 1.0 };

    /// Parses `m`, `cm^2/s`, `/d`, `kg·m/s^2`, `%`.
    pub fn parse(text: &str) -> Result<Unit, UnitError> {
        let mut unit = Unit::ONE;
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
            unit = unit.times(factor, sign * power);
            let Some(joint) = text[end..].chars().next() else { return Ok(unit) };
            sign = match joint {
                '/' => -1,
                '·' | '.' => 1,
                _ => return Err(UnitError::Malformed { start: end, end: end + joint.len_utf8() }),
            };
            position = end + joint.len_utf8();
        }
    }

    fn times(self, other: Unit, power: i32) -> Unit {
        let mut result = Unit {
            dimension: self.dimension.times(other.dimension.power(power, 1).unwrap_or(Dimension::NONE)),
            decimal: self.decimal + other.decimal * power,
            ..self
        };
        for _ in 0..power.unsigned_abs() {
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

    /// The SI value of written digits in this unit; `None` if it is beyond the range of numbers.
    ///
    /// The power of ten moves the decimal point of the digits, so `7.5 cm` and `0.075 m` are one
    /// and the same number, bit by bit.
    pub fn to_si(&self, digits: &str) -> Option<f64> {
        let (mantissa, exponent) = match digits.split_once(['e', 'E']) {
            Some((mantissa, exponent)) => (mantissa, exponent.parse::<i64>().unwrap_or(i64::from(i32::MAX))),
            None => (digits, 0),
        };
        let exponent = exponent.saturating_add(i64::from(self.decimal));
        let value: f64 = format!("{mantissa}e{exponent}").parse().ok()?;
        let value = value * self.numerator / self.denominator;
        value.is_finite().then_some(value)
    }

    /// The SI value of one of this unit.
    pub fn factor(&self) -> f64 {
        self.to_si("1").unwrap_or(f64::NAN)
    }
}

/// The word at `start`, which is no unit: up to the next joint or power.
fn unknown(text: &str, start: usize) -> UnitError {
    let rest = &text[start..];
    let len = rest.find(['/', '·', '.', '^']).unwrap_or(rest.len());
    UnitError::UnknownSymbol { symbol: rest[..len].to_owned(), start, end: start + len }
}

/// Reads `symbol` or `symbol^n` at `start`; returns the end of the symbol, the power and the end.
fn read_term(text: &str, start: usize) -> Result<(usize, i32, usize), UnitError> {
    let rest = &text[start..];
    let symbol_len = rest.find(|c: char| !(c.is_alphabetic() || c == '%' || c == 'µ')).unwrap_or(rest.len());
    let symbol_end = start + symbol_len;
    if symbol_len == 0 {
        let end = start + rest.chars().next().map_or(0, char::len_utf8);
        return Err(UnitError::Malformed { start, end });
    }
    let after = &text[symbol_end..];
    for (mark, power) in [('²', 2), ('³', 3)] {
        if after.starts_with(mark) {
            return Ok((symbol_end, power, symbol_end + mark.len_utf8()));
        }
    }
    let Some(exponent) = after.strip_prefix('^') else { return Ok((symbol_end, 1, symbol_end)) };
    let digits_len = exponent
        .char_indices()
        .find(|&(idx, c)| !(c.is_ascii_digit() || (idx == 0 && c == '-')))
        .map_or(exponent.len(), |(idx, _)| idx);
    let end = symbol_end + 1 + digits_len;
    let malformed = UnitError::Malformed { start: symbol_end, end };
    let power: i32 = exponent[..digits_len].parse().map_err(|_| malformed.clone())?;
    if power == 0 {
        return Err(malformed);
    }
    if power.abs() > 9 {
        return Err(UnitError::ExponentTooLarge { start: symbol_end, end });
    }
    Ok((symbol_end, power, end))
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

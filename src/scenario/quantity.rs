//! Numbers with units: converted exactly, or told what is wrong with them.

use super::check::Checker;
use super::expression::{Expr, Type};
use super::scope::{Entry, Origin};
use crate::diagnostic::codes::{U105, U106, U107};
use crate::diagnostic::{Diagnostic, did_you_mean};
use crate::source::Span;
use crate::syntax::tree;
use crate::units::{self, Unit, UnitError};

impl Checker<'_> {
    pub(super) fn number(&mut self, number: &tree::Number, span: Span) -> Option<Expr> {
        let unit = match &number.unit {
            None => Unit::ONE,
            Some(written) => match Unit::parse(&written.value) {
                Ok(unit) => unit,
                Err(error) => {
                    self.unknown_unit(&error, number, written.span);
                    return None;
                }
            },
        };
        let Some(value) = unit.to_si(&number.digits) else {
            self.report(
                Diagnostic::error(U106, "this number is too large")
                    .at(span, "beyond 1.8e308 in SI units")
                    .found(number.digits.clone())
                    .expected("a number below 1.8e308"),
            );
            return None;
        };
        if value == 0.0
            && number.digits.bytes().any(|b| (b'1'..=b'9').contains(&mantissa_byte(&number.digits, b)))
        {
            self.report(
                Diagnostic::error(U106, "this number is too small")
                    .at(span, "it would become zero")
                    .found(number.digits.clone())
                    .expected("zero, or a number above 5e-324"),
            );
            return None;
        }
        self.note_unit_that_is_a_name(number, span);
        let kind =
            if number.unit.is_none() && value == 0.0 { Type::Zero } else { Type::Number(unit.dimension) };
        Some(Expr::constant(value, kind, span))
    }

    /// `0.8 /d` is per day even where the scene has a `d`: say so.
    fn note_unit_that_is_a_name(&mut self, number: &tree::Number, span: Span) {
        let Some(name) = number.unit.as_ref().and_then(|unit| unit.value.strip_prefix('/')) else { return };
        // What has no value cannot have been meant.
        let is_value = |entry: &&Entry| {
            matches!(
                entry.origin,
                Origin::Let(_) | Origin::Param(_) | Origin::Species(_) | Origin::Measure(_)
            )
        };
        let Some(entry) = self.scope.get(name).filter(is_value) else { return };
        let (origin, defined) = (entry.origin.describe(), entry.span);
        self.diagnostics.push(
            Diagnostic::remark(
                U107,
                format!("`/{name}` after a number is the unit 1/{name}, not the name `{name}`"),
            )
            .at(span, format!("read as per {name}"))
            .also(defined, format!("`{name}` is {origin} of this scene"))
            .help(format!("for the name write `{} / {name}`, with a blank after the slash", number.digits)),
        );
    }

    pub(super) fn unknown_unit(&mut self, error: &UnitError, number: &tree::Number, span: Span) {
        let sub = |start: usize, end: usize| {
            let base = span.start as usize;
            Span::new(span.file, base + start, (base + end).min(span.end as usize).max(base + start))
        };
        let mut message = match error {
            UnitError::UnknownSymbol { symbol, start, end } => {
                let mut message = Diagnostic::error(U105, format!("`{symbol}` is not a unit"))
                    .at(sub(*start, *end), "unknown unit")
                    .found(format!("`{symbol}`"))
                    .expected("a unit such as `m`, `d`, `mol/L`");
                let known: Vec<String> = units::known_symbols().collect();
                let (base, power) =
                    symbol.split_at(symbol.trim_end_matches(|c: char| c.is_ascii_digit()).len());
                if !power.is_empty() && units::is_unit_symbol(base) {
                    message = message.help(format!("did you mean `{base}^{power}`?"));
                } else if let Some(candidate) = did_you_mean(symbol, known.iter().map(String::as_str)) {
                    message = message.help(format!("did you mean `{candidate}`?"));
                }
                message
            }
            UnitError::Malformed { start, end } => Diagnostic::error(U105, "this is not a unit")
                .at(sub(*start, *end), "cannot be read as a unit")
                .found("something else")
                .expected("symbols joined by `/` or `·`, powers as `m^2`, `mol^0.5`"),
            UnitError::NoSixtieth { start, end } => {
                Diagnostic::error(U105, "this power of a unit cannot be kept")
                    .at(sub(*start, *end), "no number of sixtieths")
                    .found("another fraction")
                    .expected("a power such as 2, 0.5, 0.25, 0.2 or 0.1")
            }
            UnitError::ExponentTooLarge { start, end } => {
                Diagnostic::error(U105, "the power of this unit is too large")
                    .at(sub(*start, *end), "beyond 9")
                    .found("a power beyond 9")
                    .expected("a power from -9 to 9")
            }
        };
        let word = number.unit.as_ref().map(|unit| unit.value.as_str()).unwrap_or_default();
        if self.scope.get(word).is_some() || self.axes.iter().any(|(axis, _)| axis == word) || word == "t" {
            // The name is what was meant: no unit comes near it.
            message.help = vec![format!("to multiply write `{} * {word}`", number.digits)];
        }
        self.report(message);
    }
}

/// The byte itself if it stands before an exponent mark, else `0`: `0e5` is zero, not too small.
fn mantissa_byte(digits: &str, byte: u8) -> u8 {
    let mantissa = digits.split(['e', 'E']).next().unwrap_or(digits);
    if mantissa.bytes().any(|b| b == byte) { byte } else { b'0' }
}

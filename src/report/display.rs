//! Units that read well: the one in which the largest value has one to four digits before the point.
//!
//! Owns the ladders of units. May use `plan` and `table`. It deliberately keeps the unit that a
//! scene asked for.

use crate::plan::{Output, OutputKind, Plan, Quantity};
use crate::table::{si_text, value_dimension};
use crate::units::Dimension;

/// `shown value = SI value / factor`
#[derive(Debug, Clone, PartialEq)]
pub struct Shown {
    pub factor: f64,
    pub text: String,
}

impl Shown {
    fn new(factor: f64, text: &str) -> Self {
        Self { factor, text: text.to_owned() }
    }

    pub fn one() -> Self {
        Self::new(1.0, "")
    }
}

/// From small to large: a unit is taken for values from `from` of it upwards.
type Ladder = &'static [(f64, &'static str)];

const LENGTHS: Ladder = &[(1e-6, "µm"), (1e-3, "mm"), (1e-2, "cm"), (1.0, "m"), (1e3, "km")];
const MOLAR: Ladder = &[(1e-6, "nmol/L"), (1e-3, "µmol/L"), (1.0, "mmol/L"), (1e3, "mol/L")];
const MASSES: Ladder = &[(1e-9, "ng/L"), (1e-6, "µg/L"), (1e-3, "mg/L"), (1.0, "g/L")];
const MOLES: Ladder = &[(1e-9, "nmol"), (1e-6, "µmol"), (1e-3, "mmol"), (1.0, "mol")];
const KILOGRAMS: Ladder = &[(1e-9, "µg"), (1e-6, "mg"), (1e-3, "g"), (1.0, "kg")];

/// The largest unit of which `largest` has at least 0.1; the smallest if there is none.
fn step(ladder: Ladder, largest: f64) -> Shown {
    let fitting = ladder.iter().rev().find(|(factor, _)| largest >= 0.1 * factor);
    let (factor, text) = *fitting.unwrap_or(&ladder[0]);
    Shown::new(factor, text)
}

/// For positions up to `largest` m: 7.5 cm rather than 0.075 m.
pub fn length(largest: f64) -> Shown {
    let fitting = LENGTHS.iter().rev().find(|(factor, _)| largest >= *factor);
    let (factor, text) = *fitting.unwrap_or(&LENGTHS[0]);
    Shown::new(factor, text)
}

/// For times up to `largest` s.
pub fn time(largest: f64) -> Shown {
    const DAY: f64 = 86_400.0;
    match largest {
        t if t <= 2.0 * 3600.0 => Shown::new(1.0, "s"),
        t if t <= 3.0 * DAY => Shown::new(3600.0, "h"),
        t if t <= 3.0 * 365.25 * DAY => Shown::new(DAY, "d"),
        _ => Shown::new(365.25 * DAY, "yr"),
    }
}

/// For the values of an output up to `largest` (SI); the scene's own unit if it names one.
pub fn value(plan: &Plan, output: &Output, quantity: Quantity, n_axes: usize, largest: f64) -> Shown {
    if let Some(unit) = &output.unit {
        return Shown::new(unit.factor, &raised(&unit.text));
    }
    let dimension = value_dimension(plan, output.kind, quantity, n_axes);
    match (output.kind, quantity) {
        (OutputKind::Covariance, _) => squared(dimension, largest),
        (OutputKind::Total | OutputKind::FirstPassage | OutputKind::Moments | OutputKind::Budget, _) => {
            amount(dimension, n_axes, largest)
        }
        _ if dimension == Dimension::MOLAR_CONCENTRATION => step(MOLAR, largest),
        _ if dimension == Dimension::MASS_CONCENTRATION => step(MASSES, largest),
        _ => Shown::new(1.0, &raised(&si_text(dimension))),
    }
}

/// For values up to `largest` of a table's unit; masses per volume get short, all others stay as they are.
pub fn of_unit(unit: &str, largest: f64) -> Shown {
    if unit == "kg/m^3" { step(MASSES, largest) } else { Shown::new(1.0, &raised(unit)) }
}

fn squared(dimension: Dimension, largest: f64) -> Shown {
    let is_square_of = |base: Dimension| dimension.0 == base.0.map(|exponent| 2 * exponent);
    let root = largest.sqrt();
    let base = if is_square_of(Dimension::MOLAR_CONCENTRATION) {
        step(MOLAR, root)
    } else if is_square_of(Dimension::MASS_CONCENTRATION) {
        step(MASSES, root)
    } else {
        return Shown::new(1.0, &raised(&si_text(dimension)));
    };
    Shown { factor: base.factor * base.factor, text: base.text.replace("/L", "²/L²") }
}

fn amount(dimension: Dimension, n_axes: usize, largest: f64) -> Shown {
    let ladder = if dimension.0[1] == 0 { MOLES } else { KILOGRAMS };
    let shown = step(ladder, largest);
    let per = match n_axes {
        1 => "/m²",
        2 => "/m",
        _ => "",
    };
    Shown { factor: shown.factor, text: format!("{}{per}", shown.text) }
}

/// `mol/m^3` as `mol/m³`.
pub fn raised(text: &str) -> String {
    let mut shown = String::new();
    let mut is_exponent = false;
    for letter in text.chars() {
        match letter {
            '^' => is_exponent = true,
            '-' if is_exponent => shown.push('⁻'),
            digit if is_exponent && digit.is_ascii_digit() => {
                shown.push_str(&super::scale::superscript(digit.to_digit(10).unwrap_or(0) as i32));
            }
            other => {
                is_exponent = false;
                shown.push(other);
            }
        }
    }
    shown
}

/// A number with as few digits as tell it apart: `619`, `0.25`.
pub fn plain(value: f64) -> String {
    let text = if value != 0.0 && (value.abs() < 1e-3 || value.abs() >= 1e6) {
        format!("{value:.3e}")
    } else {
        let rounded = format!("{value:.3}");
        rounded.trim_end_matches('0').trim_end_matches('.').to_owned()
    };
    text.replace('-', "−")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_fit_the_values() {
        assert_eq!(length(0.075).text, "cm");
        assert_eq!(length(200.0).text, "m");
        assert_eq!(time(1510.0).text, "s");
        assert_eq!(time(200.0 * 86_400.0).text, "d");
        assert_eq!(step(MOLAR, 20.0), Shown::new(1.0, "mmol/L"));
        assert_eq!(step(MASSES, 0.05), Shown::new(1e-3, "mg/L"));
        assert_eq!(raised("mol^2/m^-6"), "mol²/m⁻⁶");
        assert_eq!(
            (plain(619.0), plain(0.25), plain(-1e-7)),
            ("619".into(), "0.25".into(), "−1.000e−7".into())
        );
    }
}

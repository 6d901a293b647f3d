//! Units of the columns, as text and as exponents of the base dimensions.
//!
//! Owns which SI unit each value of an output has. May use `units` and `plan`. It deliberately
//! converts nothing but the factor that the plan states.

use crate::plan::{Output, OutputKind, Plan, Quantity};
use crate::units::dimension::SCALE;
use crate::units::{Dimension, Unit};

/// The unit of one value of one output: `written value = SI value / factor`.
#[derive(Debug, Clone, PartialEq)]
pub struct ValueUnit {
    pub text: String,
    pub dimension: Dimension,
    pub factor: f64,
}

/// Symbols of the base units with their place in [`Dimension`], in the order they are written.
const SYMBOLS: [(usize, &str); 7] =
    [(1, "kg"), (3, "mol"), (0, "m"), (2, "s"), (4, "K"), (5, "A"), (6, "cd")];

/// A dimension as a product of SI base units, `kg·mol/m^6` or `1`, as scenes write them.
pub fn si_text(dimension: Dimension) -> String {
    let part = |sign: i16| {
        SYMBOLS
            .iter()
            .filter(|(idx, _)| dimension.0[*idx] * sign > 0)
            .map(|(idx, symbol)| power(symbol, dimension.0[*idx] * sign))
            .collect::<Vec<_>>()
    };
    let (above, below) = (part(1), part(-1));
    let above = if above.is_empty() { "1".to_owned() } else { above.join("·") };
    let below: String = below.iter().map(|factor| format!("/{factor}")).collect();
    format!("{above}{below}")
}

fn power(symbol: &str, sixtieths: i16) -> String {
    if sixtieths == SCALE {
        symbol.to_owned()
    } else if sixtieths % SCALE == 0 {
        format!("{symbol}^{}", sixtieths / SCALE)
    } else {
        format!("{symbol}^{}", exponent(sixtieths))
    }
}

/// An exponent in sixtieths as a number.
pub fn exponent(sixtieths: i16) -> f64 {
    f64::from(sixtieths) / f64::from(SCALE)
}

/// Dimension of what `output` holds for `quantity`, in a domain of `n_axes` axes.
///
/// Concentration mol/m³ or kg/m³; covariance the product of two; total concentration × m^d;
/// mixing the product of two × m^d.
pub fn value_dimension(plan: &Plan, kind: OutputKind, quantity: Quantity, n_axes: usize) -> Dimension {
    let concentration = match quantity {
        Quantity::Species(s) => concentration_of(plan, s),
        Quantity::Pair(a, b) => product(concentration_of(plan, a), concentration_of(plan, b)),
    };
    match kind {
        OutputKind::Profile | OutputKind::Map | OutputKind::Particles | OutputKind::Covariance => {
            concentration
        }
        OutputKind::Breakthrough | OutputKind::Density => concentration,
        OutputKind::Kernels => Dimension::LENGTH,
        OutputKind::Total
        | OutputKind::Mixing
        | OutputKind::FirstPassage
        | OutputKind::Moments
        | OutputKind::Budget => product(concentration, Dimension::new(n_axes as i16, 0, 0, 0)),
        OutputKind::Dilution => Dimension::new(n_axes as i16, 0, 0, 0),
    }
}

/// The unit in which `output` is written for `quantity`.
pub fn value_unit(plan: &Plan, output: &Output, quantity: Quantity, n_axes: usize) -> ValueUnit {
    let dimension = value_dimension(plan, output.kind, quantity, n_axes);
    match &output.unit {
        Some(unit) => ValueUnit { text: unit.text.clone(), dimension, factor: unit.factor },
        None => ValueUnit { text: si_text(dimension), dimension, factor: 1.0 },
    }
}

/// Dimension of the root of the integral of `fieldʳᵒᵒᵗ` over an output of this kind, as norms take it:
/// over the axis of a profile, over all active axes of a map.
pub fn integrated(plan: &Plan, kind: OutputKind, field: Dimension, root: i16) -> Dimension {
    let n_axes = match kind {
        OutputKind::Profile | OutputKind::Covariance => 1,
        OutputKind::Map => plan.axes.len() as i16,
        _ => 0,
    };
    product(field, Dimension([n_axes * SCALE / root, 0, 0, 0, 0, 0, 0]))
}

/// The dimension of a unit in text, also of those that [`si_text`] writes with broken exponents; none
/// for what is no unit of measurement.
pub fn dimension_of(text: &str) -> Option<Dimension> {
    Unit::parse(text).ok().map(|unit| unit.dimension).or_else(|| of_si_text(text))
}

/// The way back from [`si_text`], and from `kg mol/(m^3 s)` as tables of earlier versions have it.
fn of_si_text(text: &str) -> Option<Dimension> {
    let (above, below) = text.split_once('/').unwrap_or((text, ""));
    let below = below.strip_prefix('(').map_or(below, |rest| rest.trim_end_matches(')'));
    if above.is_empty() {
        return None;
    }
    let factors = |part: &'_ str| part.split([' ', '·', '/']).map(str::to_owned).collect::<Vec<_>>();
    let signed = factors(above).into_iter().map(|factor| (factor, 1.0));
    let mut dimension = Dimension::NONE;
    for (factor, sign) in signed.chain(factors(below).into_iter().map(|factor| (factor, -1.0))) {
        if factor == "1" || factor.is_empty() {
            continue;
        }
        let (symbol, exponent) = factor.split_once('^').unwrap_or((&factor, "1"));
        let (idx, _) = SYMBOLS.iter().find(|(_, known)| *known == symbol)?;
        let sixtieths = exponent.parse::<f64>().ok()? * f64::from(SCALE);
        dimension.0[*idx] += (sign * sixtieths).round() as i16;
    }
    Some(dimension)
}

fn concentration_of(plan: &Plan, species_idx: usize) -> Dimension {
    match plan.species.get(species_idx) {
        Some(species) if !species.is_molar => Dimension::MASS_CONCENTRATION,
        _ => Dimension::MOLAR_CONCENTRATION,
    }
}

fn product(a: Dimension, b: Dimension) -> Dimension {
    Dimension(std::array::from_fn(|k| a.0[k] + b.0[k]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base_units_are_written_as_a_reader_expects() {
        let text = |l, m, t, n| si_text(Dimension::new(l, m, t, n));
        assert_eq!(text(-3, 0, 0, 1), "mol/m^3");
        assert_eq!(text(-2, 1, 0, 0), "kg/m^2");
        assert_eq!(text(0, 0, 0, 0), "1");
        assert_eq!(text(0, 0, -1, 0), "1/s");
        assert_eq!(text(-5, 1, 0, 1), "kg·mol/m^5");
        assert_eq!(text(2, 0, -1, 0), "m^2/s");
        assert_eq!(text(-3, 0, -1, 1), "mol/m^3/s");
        assert_eq!(si_text(Dimension([SCALE / 2, 0, 0, 0, 0, 0, 0])), "m^0.5");
    }

    #[test]
    fn a_written_unit_leads_back_to_its_dimension() {
        for length in [-330, -150, -60, 0, 7, 30, 60, 120] {
            for (mass, time, amount) in [(0, 0, 0), (60, -60, 0), (0, -120, 60), (-30, 60, 120)] {
                let dimension = Dimension([length, mass, time, amount, 0, 0, 0]);
                assert_eq!(dimension_of(&si_text(dimension)), Some(dimension), "{}", si_text(dimension));
            }
        }
        let rate = Dimension::new(-3, 1, -1, 1);
        for text in ["kg·mol/m^3/s", "kg mol/(m^3 s)"] {
            assert_eq!(dimension_of(text), Some(rate));
        }
        // A scene can ask for it: `in kg·mol/m^6`.
        assert_eq!(Unit::parse(&si_text(rate)).map(|unit| unit.dimension), Ok(rate));
        assert_eq!(dimension_of("mg/L"), Some(Dimension::MASS_CONCENTRATION));
        for text in ["byte", "UTC", "", "m^", "see column unit"] {
            assert_eq!(dimension_of(text), None, "{text}");
        }
    }
}

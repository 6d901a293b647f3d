//! Rate constants at other temperatures.

use super::Step::{Argument, Binary as Do, Number, Unary as Of};
use super::{Bound, Item, Mismatch, expect};
use crate::maths::operator::Binary::{Divide, Multiply};
use crate::maths::operator::Unary::{Exp, Negate};
use crate::units::Dimension;

/// J/(mol K), exact in the SI of 2019.
const GAS_CONSTANT: f64 = 8.314_462_618_153_24;
/// J/mol
const MOLAR_ENERGY: Dimension = Dimension::new(2, 1, -2, -1);

/// A rate constant at a temperature.
///
/// Equation: `A exp(−Ea / (R T))`.
/// Symbols: A pre-exponential factor, Ea activation energy, T absolute temperature, R gas constant.
/// Dimensions and range: A any, Ea J/mol, T K above zero; the value has the dimension of A.
/// Source: Arrhenius 1889; R from the SI of 2019.
/// Shape: from 0 at T = 0 towards A.
pub(super) const ITEM: Item = Item {
    name: "arrhenius",
    arguments: &[
        ("A", "pre-exponential factor, in the unit of the rate constant"),
        ("Ea", "activation energy, energy per amount"),
        ("T", "absolute temperature"),
    ],
    dimension,
    bounds: &[(2, Bound::AboveZero)],
    formula: &[
        Argument(0),
        Argument(1),
        Of(Negate),
        Number(GAS_CONSTANT),
        Argument(2),
        Do(Multiply),
        Do(Divide),
        Of(Exp),
        Do(Multiply),
    ],
    equation: "A * exp(-Ea / (R T)), R = 8.314462618 J/mol/K",
    summary: "a rate constant at temperature T",
    source: "Arrhenius 1889, Z. Phys. Chem. 4, 226-248, doi:10.1515/zpch-1889-0416",
};

fn dimension(arguments: &[Option<Dimension>]) -> Result<Dimension, Mismatch> {
    expect(arguments, 1, MOLAR_ENERGY)?;
    expect(arguments, 2, Dimension::TEMPERATURE)?;
    Ok(arguments.first().copied().flatten().unwrap_or_default())
}

//! Activity coefficients of ions, for rate laws that depend on activities.

use super::Step::{Argument, Binary as Do, Number, Unary as Of};
use super::{Bound, Item, Mismatch, Step, expect};
use crate::maths::operator::Binary::{Add, Divide, Multiply, Power, Subtract};
use crate::maths::operator::Unary::{Negate, Sqrt};
use crate::units::Dimension;

/// A of water at 25 °C, per root of mol/L.
const A: f64 = 0.5085;
/// mol/m³ in a mol/L.
const LITRE: f64 = 1000.0;

const ARGUMENTS: &[(&str, &str)] =
    &[("z", "charge number of the ion"), ("I", "ionic strength, as a concentration")];

/// Activity coefficient in very dilute water.
///
/// Equation: `log₁₀ γ = −A z² √I`.
/// Symbols: z charge, I ionic strength in mol/L, A = 0.5085 at 25 °C.
/// Dimensions and range: z plain, I amount concentration not below zero; the value is a plain number.
/// Source: Debye & Hückel 1923; A as in Stumm & Morgan 1996, table 3.3.
/// Shape: 1 at I = 0, falls; used up to about 0.005 mol/L.
pub(super) const DEBYE_HUCKEL: Item = Item {
    name: "debye_huckel",
    arguments: ARGUMENTS,
    dimension,
    bounds: &[(1, Bound::NotNegative)],
    formula: &[
        Number(10.0),
        Number(A),
        Of(Negate),
        Argument(0),
        Do(Multiply),
        Argument(0),
        Do(Multiply),
        Argument(1),
        Number(LITRE),
        Do(Divide),
        Of(Sqrt),
        Do(Multiply),
        Do(Power),
    ],
    equation: "10^(-0.5085 z^2 sqrt(I)), I in mol/L",
    summary: "activity coefficient of an ion in very dilute water, limiting law",
    source: "Debye, Hückel 1923, Phys. Z. 24, 185-206; constant of Stumm, Morgan 1996, Aquatic Chemistry, 3rd ed.",
};

/// Activity coefficient after Davies.
///
/// Equation: `log₁₀ γ = −A z² (√I / (1 + √I) − 0.3 I)`.
/// Symbols: z charge, I ionic strength in mol/L, A = 0.5085 at 25 °C.
/// Dimensions and range: z plain, I amount concentration not below zero; the value is a plain number.
/// Source: Davies 1962, Ion Association, with 0.3.
/// Shape: 1 at I = 0, falls, rises again beyond about 0.5 mol/L, where it is no longer used.
pub(super) const DAVIES: Item = Item {
    name: "davies",
    arguments: ARGUMENTS,
    dimension,
    bounds: &[(1, Bound::NotNegative)],
    formula: DAVIES_FORMULA,
    equation: "10^(-0.5085 z^2 (sqrt(I) / (1 + sqrt(I)) - 0.3 I)), I in mol/L",
    summary: "activity coefficient of an ion in water of up to about 0.5 mol/L",
    source: "Davies 1962, Ion Association, Butterworths, London, p. 41",
};

const DAVIES_FORMULA: &[Step] = &[
    Number(10.0),
    Number(A),
    Of(Negate),
    Argument(0),
    Do(Multiply),
    Argument(0),
    Do(Multiply),
    Argument(1),
    Number(LITRE),
    Do(Divide),
    Of(Sqrt),
    Number(1.0),
    Argument(1),
    Number(LITRE),
    Do(Divide),
    Of(Sqrt),
    Do(Add),
    Do(Divide),
    Number(0.3),
    Argument(1),
    Do(Multiply),
    Number(LITRE),
    Do(Divide),
    Do(Subtract),
    Do(Multiply),
    Do(Power),
];

fn dimension(arguments: &[Option<Dimension>]) -> Result<Dimension, Mismatch> {
    expect(arguments, 0, Dimension::NONE)?;
    expect(arguments, 1, Dimension::MOLAR_CONCENTRATION)?;
    Ok(Dimension::NONE)
}

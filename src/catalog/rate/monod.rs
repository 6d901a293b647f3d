//! Saturation of a rate with its substrate.

use super::Step::{Argument, Binary as Do};
use super::{Bound, Item, ratio_of_alike};
use crate::maths::operator::Binary::{Add, Divide};

/// Share of the largest rate that a substrate allows.
///
/// Equation: `c / (K + c)`.
/// Symbols: c concentration of the substrate, K half-saturation constant.
/// Dimensions and range: c and K alike, the value is a plain number from 0 to 1.
/// Source: Monod 1949; the same form as Michaelis & Menten 1913.
/// Shape: linear below K, 1 above it, one half at K.
pub(super) const ITEM: Item = Item {
    name: "monod",
    arguments: &[("c", "concentration of the substrate"), ("K", "half-saturation constant")],
    dimension: ratio_of_alike,
    bounds: &[(1, Bound::NotNegative)],
    formula: &[Argument(0), Argument(1), Argument(0), Do(Add), Do(Divide)],
    equation: "c / (K + c)",
    summary: "saturation with a substrate: 0 without it, one half at K, 1 far above",
    source: "Monod 1949, Annu. Rev. Microbiol. 3, 371-394, doi:10.1146/annurev.mi.03.100149.002103",
};

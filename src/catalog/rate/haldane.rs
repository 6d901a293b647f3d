//! Saturation of a rate with a substrate that inhibits it when there is too much.

use super::Step::{Argument, Binary as Do};
use super::{Bound, Item, ratio_of_alike};
use crate::maths::operator::Binary::{Add, Divide, Multiply};

/// Share of the largest rate under inhibition by the substrate itself.
///
/// Equation: `c / (K + c + c² / Ki)`.
/// Symbols: c concentration of the substrate, K half-saturation constant, Ki inhibition constant.
/// Dimensions and range: all alike, the value is a plain number from 0 to 1.
/// Source: Andrews 1968, eq. 5, after Haldane 1930.
/// Shape: largest at √(K Ki), falls as Ki/c above it.
pub(super) const ITEM: Item = Item {
    name: "haldane",
    arguments: &[
        ("c", "concentration of the substrate"),
        ("K", "half-saturation constant"),
        ("Ki", "inhibition constant"),
    ],
    dimension: ratio_of_alike,
    bounds: &[(1, Bound::NotNegative), (2, Bound::AboveZero)],
    formula: &[
        Argument(0),
        Argument(1),
        Argument(0),
        Do(Add),
        Argument(0),
        Argument(0),
        Do(Multiply),
        Argument(2),
        Do(Divide),
        Do(Add),
        Do(Divide),
    ],
    equation: "c / (K + c + c^2 / Ki)",
    summary: "saturation with a substrate that inhibits above sqrt(K Ki)",
    source: "Andrews 1968, Biotechnol. Bioeng. 10, 707-723, doi:10.1002/bit.260100602",
};

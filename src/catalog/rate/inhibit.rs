//! Inhibition of a rate by a solute.

use super::Step::{Argument, Binary as Do};
use super::{Bound, Item, ratio_of_alike};
use crate::maths::operator::Binary::{Add, Divide};

/// Share of a rate that an inhibitor leaves.
///
/// Equation: `K / (K + c)`.
/// Symbols: c concentration of the inhibitor, K the one that halves the rate.
/// Dimensions and range: c and K alike, the value is a plain number from 0 to 1.
/// Source: Widdowson, Molz, Benefield 1988, eq. 6 (non-competitive inhibition).
/// Shape: 1 below K, one half at K, falls as K/c above it.
pub(super) const ITEM: Item = Item {
    name: "inhibit",
    arguments: &[("c", "concentration of the inhibitor"), ("K", "concentration that halves the rate")],
    dimension: ratio_of_alike,
    bounds: &[(1, Bound::NotNegative)],
    formula: &[Argument(1), Argument(1), Argument(0), Do(Add), Do(Divide)],
    equation: "K / (K + c)",
    summary: "inhibition by a solute: 1 without it, one half at K, 0 far above",
    source: "Widdowson, Molz, Benefield 1988, Water Resour. Res. 24, 1553-1565, doi:10.1029/WR024i009p01553",
};

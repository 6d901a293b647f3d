//! The parabola: of all kernels the one with the least error in the estimate of a density.

use super::{Item, Radial};

#[derive(Debug, Clone, Copy)]
pub struct Epanechnikov;

impl Radial for Epanechnikov {
    #[inline(always)]
    fn value(self, q2: f64) -> f64 {
        if q2 < 1.0 { 1.0 - q2 } else { 0.0 }
    }

    #[inline(always)]
    fn force(self, q2: f64) -> f64 {
        if q2 < 1.0 { 2.0 } else { 0.0 }
    }
}

pub const ITEM: Item = Item {
    name: "epanechnikov",
    support: 1.0,
    value: |q2| Epanechnikov.value(q2),
    force: |q2| Epanechnikov.force(q2),
    equation: "1 - q^2",
    source: "V. A. Epanechnikov, 1969: Theory Probab. Appl. 14, 153, doi:10.1137/1114019",
};

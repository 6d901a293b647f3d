//! The normal distribution.

use super::{Item, Radial};
use crate::maths::vector::{exp_near, exp_of_negative, reduced_negative};

#[derive(Debug, Clone, Copy)]
pub struct Gaussian;

impl Radial for Gaussian {
    const IS_ITS_OWN_FORCE: bool = true;
    const HAS_PARTS: bool = true;

    #[inline(always)]
    fn value(self, q2: f64) -> f64 {
        exp_of_negative(-0.5 * q2)
    }

    /// `−W′/q = W`.
    #[inline(always)]
    fn force(self, q2: f64) -> f64 {
        self.value(q2)
    }

    #[inline(always)]
    fn parts(self, q2: f64) -> (f64, f64) {
        reduced_negative(-0.5 * q2)
    }

    #[inline(always)]
    fn of_rest(self, rest: f64) -> f64 {
        exp_near(rest)
    }
}

pub const ITEM: Item = Item {
    name: "gaussian",
    support: f64::INFINITY,
    value: |q2| Gaussian.value(q2),
    force: |q2| Gaussian.force(q2),
    equation: "exp(-q^2/2)",
    source: "D. A. Benson, D. Bolster, 2016: Water Resour. Res. 52, 9190, doi:10.1002/2016WR019368 (collocation of two \
             particles)",
};

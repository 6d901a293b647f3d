//! Wendland's functions, those for up to three dimensions, with a support of two bandwidths.

use super::{Item, Radial};

#[derive(Debug, Clone, Copy)]
pub struct WendlandC2;

#[derive(Debug, Clone, Copy)]
pub struct WendlandC4;

#[derive(Debug, Clone, Copy)]
pub struct WendlandC6;

/// `1 − q/2` within the support.
#[inline(always)]
fn rest(q: f64) -> f64 {
    if q < 2.0 { 1.0 - 0.5 * q } else { 0.0 }
}

#[inline(always)]
fn square(x: f64) -> f64 {
    x * x
}

impl Radial for WendlandC2 {
    #[inline(always)]
    fn value(self, q2: f64) -> f64 {
        let q = q2.sqrt();
        square(square(rest(q))) * (1.0 + 2.0 * q)
    }

    /// `W′ = −5 q (1 − q/2)³`.
    #[inline(always)]
    fn force(self, q2: f64) -> f64 {
        let rest = rest(q2.sqrt());
        5.0 * rest * square(rest)
    }
}

impl Radial for WendlandC4 {
    #[inline(always)]
    fn value(self, q2: f64) -> f64 {
        let q = q2.sqrt();
        square(rest(q)) * square(square(rest(q))) * (1.0 + 3.0 * q + 35.0 / 12.0 * q2)
    }

    /// `W′ = −(7/3) q (2 + 5 q) (1 − q/2)⁵`.
    #[inline(always)]
    fn force(self, q2: f64) -> f64 {
        let q = q2.sqrt();
        let rest = rest(q);
        7.0 / 3.0 * rest * square(square(rest)) * (2.0 + 5.0 * q)
    }
}

impl Radial for WendlandC6 {
    #[inline(always)]
    fn value(self, q2: f64) -> f64 {
        let q = q2.sqrt();
        square(square(square(rest(q)))) * (1.0 + 4.0 * q + 6.25 * q2 + 4.0 * q2 * q)
    }

    /// `W′ = −(11/4) q (1 − q/2)⁷ (2 + 7 q + 8 q²)`.
    #[inline(always)]
    fn force(self, q2: f64) -> f64 {
        let q = q2.sqrt();
        let rest = rest(q);
        2.75 * rest * square(rest) * square(square(rest)) * (2.0 + 7.0 * q + 8.0 * q2)
    }
}

const SOURCE: &str = "H. Wendland, 1995: Adv. Comput. Math. 4, 389, doi:10.1007/BF02123482";

pub const C2: Item = Item {
    name: "wendland_c2",
    support: 2.0,
    value: |q2| WendlandC2.value(q2),
    force: |q2| WendlandC2.force(q2),
    equation: "(1 - q/2)^4 (1 + 2 q)",
    source: SOURCE,
};

pub const C4: Item = Item {
    name: "wendland_c4",
    support: 2.0,
    value: |q2| WendlandC4.value(q2),
    force: |q2| WendlandC4.force(q2),
    equation: "(1 - q/2)^6 (1 + 3 q + 35/12 q^2)",
    source: SOURCE,
};

pub const C6: Item = Item {
    name: "wendland_c6",
    support: 2.0,
    value: |q2| WendlandC6.value(q2),
    force: |q2| WendlandC6.force(q2),
    equation: "(1 - q/2)^8 (1 + 4 q + 25/4 q^2 + 4 q^3)",
    source: SOURCE,
};

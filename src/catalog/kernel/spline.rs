//! B-splines of third and fifth degree.

use super::{Item, Radial};

#[derive(Debug, Clone, Copy)]
pub struct CubicSpline;

impl Radial for CubicSpline {
    #[inline(always)]
    fn value(self, q2: f64) -> f64 {
        let q = q2.sqrt();
        let (outer, inner) = (above(2.0, q), above(1.0, q));
        0.25 * (outer * outer * outer - 4.0 * inner * inner * inner)
    }

    /// `W′ = −¾ [(2 − q)² − 4 (1 − q)²]`, which vanishes at 0 as q does.
    #[inline(always)]
    fn force(self, q2: f64) -> f64 {
        let q = q2.sqrt();
        let (inside, outer) = (3.0 - 2.25 * q, above(2.0, q));
        let outside = 0.75 * outer * outer / if q > 1.0 { q } else { 1.0 };
        if q < 1.0 { inside } else { outside }
    }
}

#[derive(Debug, Clone, Copy)]
pub struct QuinticSpline;

impl Radial for QuinticSpline {
    #[inline(always)]
    fn value(self, q2: f64) -> f64 {
        let q = q2.sqrt();
        let (a, b, c) = (above(3.0, q), above(2.0, q), above(1.0, q));
        fifth(a) - 6.0 * fifth(b) + 15.0 * fifth(c)
    }

    /// Below 1 the sum `5 [(3−q)⁴ − 6 (2−q)⁴ + 15 (1−q)⁴]` is `q (120 − 120 q² + 50 q³)`.
    #[inline(always)]
    fn force(self, q2: f64) -> f64 {
        let q = q2.sqrt();
        let (a, b) = (above(3.0, q), above(2.0, q));
        let outside = 5.0 * (fourth(a) - 6.0 * fourth(b)) / if q > 1.0 { q } else { 1.0 };
        if q < 1.0 { 120.0 - 120.0 * q2 + 50.0 * q2 * q } else { outside }
    }
}

/// `end − q`, and nothing beyond the end.
#[inline(always)]
fn above(end: f64, q: f64) -> f64 {
    if q < end { end - q } else { 0.0 }
}

#[inline(always)]
fn fourth(x: f64) -> f64 {
    (x * x) * (x * x)
}

#[inline(always)]
fn fifth(x: f64) -> f64 {
    fourth(x) * x
}

const SOURCE: &str = "J. J. Monaghan, 1992: Annu. Rev. Astron. Astrophys. 30, 543, \
                      doi:10.1146/annurev.aa.30.090192.002551";

pub const CUBIC: Item = Item {
    name: "cubic_spline",
    support: 2.0,
    value: |q2| CubicSpline.value(q2),
    force: |q2| CubicSpline.force(q2),
    equation: "((2 - q)^3 - 4 (1 - q)^3)/4, each difference only where it is above zero",
    source: SOURCE,
};

pub const QUINTIC: Item = Item {
    name: "quintic_spline",
    support: 3.0,
    value: |q2| QuinticSpline.value(q2),
    force: |q2| QuinticSpline.force(q2),
    equation: "(3 - q)^5 - 6 (2 - q)^5 + 15 (1 - q)^5, each difference only where it is above zero",
    source: SOURCE,
};

//! A substrate that is used up at a saturating rate.

use super::arguments::{C0, checked, renamed};
use super::solutions::of_time;
use super::{Argument, ArgumentDimension, Built, Item, Predicts};
use crate::maths::scalar::{exp, ln};

pub(super) const ITEM: Item = Item {
    name: "michaelis_menten",
    predicts: Predicts::Concentration,
    arguments: ARGUMENTS,
    equation: "K ln(c/c0) + c − c0 = −V t",
    summary: "a well-mixed substrate that is used up at the rate V c / (K + c)",
    source: "Michaelis & Menten 1913, Biochem. Z. 49, 333; the integrated form",
    build,
};

const ARGUMENTS: &[Argument; 3] = &[
    renamed(C0, "c0", None, "concentration at time 0"),
    Argument {
        name: "V",
        dimension: ArgumentDimension::ConcentrationPerTime,
        default: None,
        range: (0.0, f64::MAX),
        doc: "largest rate",
    },
    renamed(C0, "K", None, "concentration at which the rate is half of that"),
];

/// Concentration of a substrate in a batch.
///
/// Equation: `K ln(c/c0) + c − c0 = −V t`.
/// Symbols: c0 concentration at time 0, V largest rate, K half-saturation constant, t time.
/// Dimensions and range: concentration; from c0 down to 0. With K = 0 it falls in a straight line.
/// Source: Michaelis & Menten 1913, Biochem. Z. 49, 333; solved by Newton's method between bounds.
/// Shape: a straight line far above K, an exponential far below it.
fn build(values: &[f64]) -> Built {
    let [c0, maximum, half] = checked(ARGUMENTS, values)?;
    Ok(of_time(move |t| c0 * remaining(maximum * t / c0, half / c0)))
}

/// `u` in 0 … 1 with `k ln u + u − 1 = −s`.
fn remaining(s: f64, k: f64) -> f64 {
    if s.is_nan() || s <= 0.0 || k.is_nan() || k.is_infinite() {
        // Nothing was there, or nothing has happened yet; infinitely far below K it stays what it is.
        return 1.0;
    }
    if k == 0.0 {
        return (1.0 - s).max(0.0);
    }
    // In w = ln u the left side, k w + e^w − 1, rises and is convex: Newton from the right never overshoots.
    let (mut low, mut high) = (-(s / k) - 1.0 / k, 0.0_f64);
    let mut w = if s < 1.0 { ln(1.0 - s * (1.0 / (1.0 + k))) } else { -s / (1.0 + k) };
    for _ in 0..200 {
        let grown = exp(w);
        let residual = k * w + crate::maths::scalar::expm1(w) + s;
        if residual > 0.0 {
            high = w
        } else {
            low = w
        }
        let next = w - residual / (k + grown);
        let next = if next > low && next < high { next } else { 0.5 * (low + high) };
        let is_there = (next - w).abs() <= 1e-16 * w.abs();
        w = next;
        if is_there {
            break;
        }
    }
    exp(w)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Put back into the equation; the other values are limits.
    #[test]
    fn the_equation_holds() {
        for k in [1e-12, 1e-6, 1e-3, 0.3, 1.0, 50.0, 1e9] {
            for s in [1e-9, 1e-3, 0.5, 0.999, 1.0, 1.5, 30.0] {
                let u = remaining(s, k);
                assert!((0.0..1.0 + 1e-15).contains(&u), "{k} {s} {u}");
                if u > 1e-300 {
                    let residual = k * ln(u) + u - 1.0 + s;
                    // Two roundings of u, seen through the equation's slope, and those of the terms.
                    let rounding = 2.3e-16 * (2.0 * (k + u) + 4.0 * (1.0 + s + k * ln(u).abs()));
                    assert!(residual.abs() < rounding, "{k} {s} {u}: {residual}");
                }
            }
        }
        assert_eq!(remaining(0.25, 0.0), 0.75);
        assert_eq!(remaining(2.0, 0.0), 0.0);
        // Far below K: an exponential.
        assert!((remaining(1e6, 1e6) - exp(-1.0 + 1e-6 * (1.0 - exp(-1.0)))).abs() < 1e-9);
    }
}

//! One complex, which has a closed form.
//!
//! Owns the three forms. May use the compiled system. It deliberately knows nothing of activities or
//! minerals: with those there is no closed form.

use super::Refusal;
use super::system::System;
use crate::maths::scalar;

/// A single reaction between ideal species.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Closed {
    /// `A + B ⇌ AB`
    Pair { dissociation: f64 },
    /// `2 A ⇌ A₂`
    Dimer { constant: f64 },
    /// `⇌ A + B` from a solvent, B written over A: `c_B = K / c_A`
    Split { constant: f64 },
}

impl Closed {
    /// The form of a system, if it has one.
    pub fn of(system: &System) -> Option<Self> {
        let [row] = system.rows.as_slice() else { return None };
        if !system.is_ideal() || system.n_minerals > 0 || row.ln_constant.abs() > 600.0 {
            return None;
        }
        let constant = scalar::exp(row.ln_constant);
        let nus: Vec<f64> = row.entries.iter().map(|entry| entry.nu).collect();
        match (system.n_primaries, nus.as_slice()) {
            (2, [1.0, 1.0]) => Some(Closed::Pair { dissociation: scalar::exp(-row.ln_constant) }),
            (1, [2.0]) => Some(Closed::Dimer { constant }),
            (1, [-1.0]) => Some(Closed::Split { constant }),
            _ => None,
        }
    }

    /// Why totals have no equilibrium, if they have none.
    #[inline(always)]
    pub fn refusal(self, first: f64, second: f64) -> Option<Refusal> {
        if !first.is_finite() || !second.is_finite() {
            return Some(Refusal::NotFinite { primary: usize::from(first.is_finite()) });
        }
        let is_negative = first < 0.0 || second < 0.0;
        (is_negative && !matches!(self, Closed::Split { .. })).then_some(Refusal::Infeasible)
    }

    /// Concentrations of all species of one particle: primaries, then the complex.
    ///
    /// Equation: pair: `c_AB = 2 u_A u_B/(s + √D)`, `c_A = ½(−b + √D)` or `2 K u_A/(b + √D)` with `s = u_A + u_B + K`,
    /// `b = u_B − u_A + K`, `D = (u_A − u_B)² + K (2 (u_A + u_B) + K)`; dimer: `c_A = 2u/(1 + √(1 + 8 K u))`; split:
    /// `c_A = ½(u + √(u² + 4K))` or `2 K/(√(u² + 4K) − u)`.
    /// Symbols: u totals; K dissociation constant of the pair, otherwise K as written.
    /// Dimensions and range: mol/m³; totals ≥ 0 for pair and dimer.
    /// Source: methods 8.3; quadratic equations without cancellation.
    /// Shape: K → 0 makes the pair min(u_A, u_B).
    #[inline(always)]
    pub fn solve(self, first: f64, second: f64) -> [f64; 3] {
        match self {
            Closed::Pair { dissociation: k } => {
                let apart = second - first;
                let root = (apart * apart + k * (2.0 * (first + second) + k)).sqrt();
                let bound = 2.0 * first * second / (first + second + k + root);
                [half(k + apart, k * first, root), half(k - apart, k * second, root), bound]
            }
            Closed::Dimer { constant } => {
                let single = 2.0 * first / (1.0 + (1.0 + 8.0 * constant * first).sqrt());
                [single, constant * single * single, 0.0]
            }
            Closed::Split { constant } => {
                let root = (first * first + 4.0 * constant).sqrt();
                [half(-first, constant, root), half(first, constant, root), 0.0]
            }
        }
    }
}

/// The positive root of `c² + b c = q`, given `√(b² + 4q)`.
#[inline(always)]
fn half(b: f64, q: f64, root: f64) -> f64 {
    if b > 0.0 { 2.0 * q / (b + root) } else { 0.5 * (root - b) }
}

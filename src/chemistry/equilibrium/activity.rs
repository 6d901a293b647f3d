//! Activity coefficients: `ln γ` of every species as a sum of a few functions of the ionic strength.
//!
//! Owns the models and their constants. May use the plan's types. It deliberately has no ionic strength of
//! its own: that is an unknown of the solver.

use crate::plan::chemistry::{Activity, Equilibrium};

const LN_10: f64 = std::f64::consts::LN_10;
/// Debye and Hückel's A in water at 25 °C, (mol/L)^-1/2.
const A: f64 = 0.5085;
/// Debye and Hückel's B in water at 25 °C, m⁻¹ (mol/L)^-1/2.
const B: f64 = 0.3281e10;
/// What an uncharged species gets with Davies' equation: log₁₀ γ = 0.1 I.
const SALTING_OUT: f64 = 0.1;

/// Ionic strengths, mol/L, beyond which no result is given. Davies' equation is used up to 0.5 and holds
/// roughly in sea water (0.7); all of them mean nothing in brines.
pub const MAX_IONIC_STRENGTH: f64 = 1.0;
/// The least ionic strength, mol/L, where slopes are still numbers; ln γ there is 1e-14.
pub(super) const MIN_IONIC_STRENGTH: f64 = 1e-28;

/// A function of the ionic strength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Shape {
    /// `√I`
    Root,
    /// `√I / (1 + b √I)`, b in (mol/L)^-1/2
    Extended { b: f64 },
    /// `√I / (1 + √I) − 0.3 I`
    Davies,
    /// `I`
    Linear,
}

impl Shape {
    /// Value and slope.
    ///
    /// Equation: φ as on the variants; `d/dI √I/(1 + b√I) = 1/(2√I (1 + b√I)²)`.
    /// Symbols: I ionic strength.
    /// Dimensions and range: I in mol/L, positive.
    /// Source: Debye & Hückel 1923, Phys. Z. 24, 185; Davies 1962, Ion Association, p. 41, with 0.3; neutral
    /// species: Parkhurst & Appelo 2013, USGS Techniques and Methods 6-A43, p. 16.
    /// Shape: like √I near 0; that of Davies has its maximum near 0.4 mol/L.
    #[inline(always)]
    pub fn value<const L: usize>(self, ionic: &[f64; L], root: &[f64; L]) -> ([f64; L], [f64; L]) {
        let mut value = [0.0; L];
        let mut slope = [0.0; L];
        match self {
            Shape::Root => {
                for lane in 0..L {
                    value[lane] = root[lane];
                    slope[lane] = 0.5 / root[lane];
                }
            }
            Shape::Extended { b } => {
                for lane in 0..L {
                    let below = 1.0 + b * root[lane];
                    value[lane] = root[lane] / below;
                    slope[lane] = 0.5 / (root[lane] * below * below);
                }
            }
            Shape::Davies => {
                for lane in 0..L {
                    let below = 1.0 + root[lane];
                    value[lane] = root[lane] / below - 0.3 * ionic[lane];
                    slope[lane] = 0.5 / (root[lane] * below * below) - 0.3;
                }
            }
            Shape::Linear => {
                for lane in 0..L {
                    value[lane] = ionic[lane];
                    slope[lane] = 1.0;
                }
            }
        }
        (value, slope)
    }
}

/// The functions that the species of an equilibrium need.
pub(super) fn shapes(equilibrium: &Equilibrium) -> Vec<Shape> {
    match equilibrium.activity {
        Activity::Ideal => Vec::new(),
        Activity::DebyeHuckel => vec![Shape::Root],
        Activity::Davies => vec![Shape::Davies, Shape::Linear],
        Activity::ExtendedDebyeHuckel => {
            let of_primaries = equilibrium.primaries.iter().map(|p| (p.charge, p.ion_size));
            let of_others = equilibrium.secondaries.iter().map(|s| (s.charge, s.ion_size));
            let mut shapes: Vec<Shape> = Vec::new();
            for (charge, size) in of_primaries.chain(of_others) {
                let shape = Shape::Extended { b: B * size };
                if charge != 0.0 && !shapes.contains(&shape) {
                    shapes.push(shape);
                }
            }
            shapes
        }
    }
}

/// What each shape counts in the `ln γ` of a species.
///
/// Equation: `ln γ = Σ weight φ(I)`, the weight being `−A ln 10 z²`, and `0.1 ln 10` for what has no charge
/// with Davies' equation; 0 for what has no charge with the two of Debye and Hückel, as their theory has it.
/// Symbols: z charge, A Debye and Hückel's constant.
/// Dimensions and range: A = 0.5085 (mol/L)^-1/2 in water at 25 °C.
/// Source: see [`Shape::value`]; the convention for neutral species is that of PHREEQC with Davies' equation.
/// Shape: one weight per shape, all but one 0.
pub(super) fn weights(model: Activity, shapes: &[Shape], charge: f64, ion_size: f64) -> Vec<f64> {
    let own = match model {
        Activity::ExtendedDebyeHuckel => Shape::Extended { b: B * ion_size },
        Activity::Davies if charge == 0.0 => Shape::Linear,
        Activity::Davies => Shape::Davies,
        Activity::Ideal | Activity::DebyeHuckel => Shape::Root,
    };
    let size = if charge == 0.0 { SALTING_OUT * LN_10 } else { -A * LN_10 * charge * charge };
    let counts = |shape: &Shape| *shape == own && (charge != 0.0 || own == Shape::Linear);
    shapes.iter().map(|shape| if counts(shape) { size } else { 0.0 }).collect()
}

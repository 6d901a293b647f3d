//! One reaction with a saturating rate, by Lambert's W.
//!
//! Owns the solution of `dc/dt = −v c/(K + c)`. May use `maths`. It deliberately takes two forms: one is
//! right when much has reacted, the other when little has.

use super::{Changes, Line};
use crate::maths::vector;
use crate::maths::wide::Width;
use crate::plan::Species;
use crate::plan::chemistry::{Kinetic, Law};
use pulp::NullaryFnOnce;

const BLOCK: usize = 64;

/// `r = V c/(K + c)`
#[derive(Debug, Clone)]
pub(in crate::chemistry) struct Saturation {
    maximum: f64,
    half: f64,
    line: Line,
    changes: Changes,
}

impl Saturation {
    /// The species must be consumed.
    pub fn new(reaction: &Kinetic, species: &[Species]) -> Result<Self, String> {
        let Law::Saturation { maximum, half, species: index } = reaction.law else {
            return Err(format!("`{}` has no saturating rate", reaction.name));
        };
        let line = Line::new(&species[index], &reaction.changes);
        if line.slope * maximum > 0.0 || half < 0.0 || half.is_nan() {
            return Err(format!("`{}` does not consume what saturates it", reaction.name));
        }
        Ok(Self { maximum, half, line, changes: reaction.changes.clone() })
    }

    pub fn react(&self, width: Width, t: f64, components: &mut [&mut [f64]]) {
        width.run(React { law: self, t, components });
    }
}

struct React<'a, 'b> {
    law: &'a Saturation,
    t: f64,
    components: &'a mut [&'b mut [f64]],
}

impl NullaryFnOnce for React<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { law, t, components } = self;
        let n = components.first().map_or(0, |column| column.len());
        let (mut c, mut extent) = ([0.0; BLOCK], [0.0; BLOCK]);
        for start in (0..n).step_by(BLOCK) {
            let length = BLOCK.min(n - start);
            law.line.read(components, start, &mut c[..length]);
            if law.line.slope == 0.0 {
                // What saturates the rate is not used up.
                for l in 0..BLOCK {
                    extent[l] = law.maximum * t * c[l] / if c[l] > 0.0 { law.half + c[l] } else { 1.0 };
                }
            } else {
                let speed = -law.line.slope * law.maximum;
                depletion(speed, t, law.half, &mut c, &mut extent);
                let inverse = -1.0 / law.line.slope;
                extent.iter_mut().for_each(|extent| *extent *= inverse);
            }
            for &(component, coefficient) in &law.changes {
                let column = &mut components[component][start..start + length];
                if law.line.own == Some(component) {
                    column.copy_from_slice(&c[..length]);
                } else {
                    for (value, extent) in column.iter_mut().zip(&extent) {
                        *value += coefficient * extent;
                    }
                }
            }
        }
    }
}

/// What is left of c, and how much has gone.
///
/// Equation: `c = K ω(u)`, `u = ln(c₀/K) + (c₀ − vt)/K`, and with `c = c₀ e^{−s}` also
/// `K s + c₀ (1 − e^{−s}) = vt`, by which little depletion `c₀ (1 − e^{−s})` is right.
/// Symbols: v maximum rate, K half saturation, c₀ initial concentration, ω with `ω + ln ω = u`.
/// Dimensions and range: c₀, K ≥ 0, v t ≥ 0; K over 24 decades about c₀.
/// Source: S. Schnell and C. Mendoza 1997, J. Theor. Biol. 187, 207, doi:10.1006/jtbi.1997.0425.
/// Shape: straight fall, then exponential decay.
#[inline(always)]
fn depletion(v: f64, t: f64, half: f64, c: &mut [f64; BLOCK], gone: &mut [f64; BLOCK]) {
    // A saturation at less than any concentration is none; it must not divide zero by zero.
    let k = if half < 1e-290 { 1e-290 } else { half };
    let (used, used_low) = product(v, t);
    for l in 0..BLOCK {
        let start = c[l];
        let rest = (start - used) - used_low;
        let u = (vector::ln(start) - vector::ln(k)) + rest / k;
        let far = k * omega(u);
        // A guess below the root: the residual is concave.
        let mut s = used / (k + start);
        for _ in 0..5 {
            let (decay, less_one) = vector::exp_and_less_one(-s);
            let residual = k * s - start * less_one - used;
            let slope = k + start * decay;
            let newton = residual / slope;
            s -= newton / (1.0 + 0.5 * newton * start * decay / slope);
        }
        let (decay, less_one) = vector::exp_and_less_one(-s);
        let is_near = used < 0.5 * (k + start);
        let left = if is_near { start * decay } else { far };
        let gone_here = if is_near { -start * less_one } else { start - far };
        c[l] = if start > 0.0 { left } else { start };
        gone[l] = if start > 0.0 { gone_here } else { start };
    }
}

/// The positive solution of `ω + ln ω = u`: Lambert's `W₀(e^u)` without overflow.
///
/// Equation: two steps of Fritsch, Shafer and Crowley from a guess.
/// Symbols: `z = u − ω − ln ω`, `p = z/(1 + ω)`, `q = 2 (1 + ω + ⅔ z)`, `ω ← ω (1 + p (q − p)/(q − 2p))`.
/// Dimensions and range: any u; `e^u` far below, `u − ln u` far above.
/// Source: F. N. Fritsch, R. E. Shafer and W. P. Crowley 1973, Comm. ACM 16, 123, doi:10.1145/361952.361970.
/// Shape: e^u that bends into a straight line.
#[inline(always)]
fn omega(u: f64) -> f64 {
    let power = vector::exp(if u > 1.0 { 1.0 } else { u });
    let low = power / (1.0 + power * (1.0 - 0.36 * power / (1.0 + power)));
    let ln = vector::ln(if u > 1.0 { u } else { 1.0 });
    let high = u - ln + ln / (if u > 1.0 { u } else { 1.0 });
    let mut w = if u > 1.0 { high } else { low };
    for _ in 0..3 {
        let z = (u - w) - vector::ln(w);
        let more = 1.0 + w;
        let p = z / more;
        let q = 2.0 * (more + z * (2.0 / 3.0));
        w *= 1.0 + p * (q - p) / (q - 2.0 * p);
    }
    if u < -40.0 { power } else { w }
}

/// Dekker's product: the rounding of `v t` would be divided by K.
#[inline(always)]
fn product(a: f64, b: f64) -> (f64, f64) {
    const SPLIT: f64 = 134_217_729.0;
    let product = a * b;
    let (scaled_a, scaled_b) = (SPLIT * a, SPLIT * b);
    let (high_a, high_b) = (scaled_a - (scaled_a - a), scaled_b - (scaled_b - b));
    let (low_a, low_b) = (a - high_a, b - high_b);
    let low = ((high_a * high_b - product) + high_a * low_b + low_a * high_b) + low_a * low_b;
    (product, if low.is_finite() { low } else { 0.0 })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ω put back into its equation; far below, where ω is not seen beside its logarithm, too.
    #[test]
    fn omega_satisfies_its_equation() {
        for k in -4000..4000 {
            let u = 0.01 * f64::from(k) + 1e-3 * f64::from(k % 7);
            let w = omega(u);
            let residual = u - w - crate::maths::scalar::ln(w);
            // A relative error δ of ω makes a residual (1 + ω) δ.
            let bound = 4e-16 * (1.0 + w + u.abs());
            assert!(residual.abs() <= bound, "{u}: {w} {residual}");
        }
        for u in [1e3, 1e12, 1e300] {
            let w = omega(u);
            assert!(((u - w - crate::maths::scalar::ln(w)) / w).abs() < 1e-15, "{u}: {w}");
        }
        assert_eq!(omega(-1e12), 0.0);
    }
}

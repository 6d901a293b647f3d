//! One reaction of second order.
//!
//! Owns the solution for two different reactants and for two alike. May use `maths`. It deliberately
//! writes what is left of each reactant as a product: its last digits are right when it is nearly gone.

use super::{Changes, Line};
use crate::maths::vector;
use crate::maths::wide::Width;
use crate::plan::Species;
use crate::plan::chemistry::{Kinetic, Law};
use pulp::NullaryFnOnce;

/// Particles that are computed together.
const BLOCK: usize = 64;

/// `r = k a b`, or `r = k a²`.
#[derive(Debug, Clone)]
pub(in crate::chemistry) struct Pair {
    constant: f64,
    first: Line,
    /// `None`: the first with itself.
    second: Option<Line>,
    changes: Changes,
}

impl Pair {
    pub fn new(reaction: &Kinetic, species: &[Species]) -> Result<Self, String> {
        let line = |index: usize| Line::new(&species[index], &reaction.changes);
        let (constant, first, second) = match &reaction.law {
            Law::MassAction { constant, orders } => match orders[..] {
                [(a, 1.0), (b, 1.0)] if a != b => (*constant, line(a), Some(line(b))),
                [(a, 1.0), (_, 1.0)] | [(a, 2.0)] => (*constant, line(a), None),
                _ => return Err(format!("`{}` is not of second order", reaction.name)),
            },
            _ => return Err(format!("`{}` is no mass action", reaction.name)),
        };
        Ok(Self { constant, first, second, changes: reaction.changes.clone() })
    }

    /// Takes all particles over `t`; something not finite is left where the reaction explodes.
    pub fn react(&self, width: Width, t: f64, components: &mut [&mut [f64]]) {
        width.run(React { pair: self, t, components });
    }
}

struct React<'a, 'b> {
    pair: &'a Pair,
    t: f64,
    components: &'a mut [&'b mut [f64]],
}

impl NullaryFnOnce for React<'_, '_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { pair, t, components } = self;
        let n = components.first().map_or(0, |column| column.len());
        let (mut a, mut b, mut extent) = ([0.0; BLOCK], [0.0; BLOCK], [0.0; BLOCK]);
        for start in (0..n).step_by(BLOCK) {
            let length = BLOCK.min(n - start);
            pair.first.read(components, start, &mut a[..length]);
            match &pair.second {
                Some(second) => {
                    second.read(components, start, &mut b[..length]);
                    different(
                        pair.constant * t,
                        [pair.first.slope, second.slope],
                        &mut a,
                        &mut b,
                        &mut extent,
                    );
                }
                None => alike(pair.constant * t, pair.first.slope, &mut a, &mut extent),
            }
            let own = |line: &Line| line.own;
            let (own_a, own_b) = (own(&pair.first), pair.second.as_ref().and_then(own));
            for &(component, coefficient) in &pair.changes {
                let column = &mut components[component][start..start + length];
                if own_a == Some(component) {
                    column.copy_from_slice(&a[..length]);
                } else if own_b == Some(component) {
                    column.copy_from_slice(&b[..length]);
                } else {
                    for (value, extent) in column.iter_mut().zip(&extent) {
                        *value += coefficient * extent;
                    }
                }
            }
        }
    }
}

/// What is left of two reactants, and the extent.
///
/// Equation: with `D = β a₀ − α b₀ ≥ 0` (else the roles change), `E = e^{−kDt}`, `X = (1 − E)/D`:
/// `a = a₀ E / N`, `b = b₀ / N`, `ξ = a₀ b₀ X / N`, `N = 1 − β a₀ X = E − α b₀ X`.
/// Symbols: α, β changes of a and b per extent, `kt` constant × time, a₀, b₀ concentrations ≥ 0.
/// Dimensions and range: any positive; not finite or negative where growth explodes before t, made NaN.
/// Source: separation of variables, as b/a grows like e^{kDt}.
/// Shape: hyperbola for D = 0, exponential approach to the surplus otherwise.
#[inline(always)]
fn different(
    kt: f64,
    [alpha, beta]: [f64; 2],
    a: &mut [f64; BLOCK],
    b: &mut [f64; BLOCK],
    extent: &mut [f64; BLOCK],
) {
    for l in 0..BLOCK {
        let difference = beta * a[l] - alpha * b[l];
        let is_kept = difference >= 0.0;
        let (scarce, other) = if is_kept { (a[l], b[l]) } else { (b[l], a[l]) };
        let (alpha, beta) = if is_kept { (alpha, beta) } else { (beta, alpha) };
        let z = -kt * difference.abs();
        let (decay, less_one) = vector::exp_and_less_one(z);
        // (1 − E)/D, which is kt for D → 0.
        let quotient = if z == 0.0 { 1.0 } else { less_one / z };
        let x = kt * quotient;
        // Of the two equal forms the one without a difference.
        let denominator = if beta < 0.0 { 1.0 - beta * scarce * x } else { decay - alpha * other * x };
        let inverse = 1.0 / if denominator > 0.0 { denominator } else { f64::NAN };
        let left = scarce * decay * inverse;
        let surplus = other * inverse;
        extent[l] = scarce * other * x * inverse;
        a[l] = if is_kept { left } else { surplus };
        b[l] = if is_kept { surplus } else { left };
    }
}

/// What is left of one reactant that reacts with itself.
///
/// Equation: `a = a₀ / N`, `ξ = kt a₀² / N`, `N = 1 − α kt a₀`.
/// Symbols: α change of a per extent.
/// Dimensions and range: as for [`different`].
/// Source: separation of variables.
/// Shape: hyperbola.
#[inline(always)]
fn alike(kt: f64, alpha: f64, a: &mut [f64; BLOCK], extent: &mut [f64; BLOCK]) {
    for l in 0..BLOCK {
        let denominator = 1.0 - alpha * kt * a[l];
        let left = a[l] / if denominator > 0.0 { denominator } else { f64::NAN };
        extent[l] = kt * a[l] * left;
        a[l] = left;
    }
}

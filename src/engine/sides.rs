//! The sides of the domain: reflect, come in again, or walk on.
//!
//! Owns what happens to a position beyond a side. May use the plan's words. It deliberately counts
//! nothing: a particle outside an open side is seen when it is looked for in the bins.

use crate::plan::Side;

/// What happens along one axis, chosen once per axis and pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rule {
    Reflect { low: f64, high: f64 },
    ReflectLow { low: f64 },
    ReflectHigh { high: f64 },
    Periodic { low: f64, high: f64 },
    Open,
}

impl Rule {
    /// `None` if only one of the two sides is periodic.
    pub fn new(low_side: Side, high_side: Side, low: f64, high: f64) -> Option<Self> {
        Some(match (low_side, high_side) {
            (Side::Reflect, Side::Reflect) => Self::Reflect { low, high },
            (Side::Reflect, Side::Open) => Self::ReflectLow { low },
            (Side::Open, Side::Reflect) => Self::ReflectHigh { high },
            (Side::Periodic, Side::Periodic) => Self::Periodic { low, high },
            (Side::Open, Side::Open) => Self::Open,
            (Side::Periodic, _) | (_, Side::Periodic) => return None,
        })
    }

    /// Applies the rule; the index of the first position that is not a finite number is an error.
    ///
    /// - Equation: reflection `x ← 2 x_side − x` until inside; periodic `x ← x − L ⌊(x − low)/L⌋`.
    /// - Symbols: `L = high − low`.
    /// - Range: any step, also many times `L`.
    /// - Source: specular reflection, exact for a constant dispersion without drift against the side.
    /// - Shape: one branch-free pass; the few that are still outside are folded one by one.
    #[inline(always)]
    pub fn apply(self, positions: &mut [f64]) -> Result<(), usize> {
        let mut n_left = 0_u64;
        match self {
            Self::Reflect { low, high } => {
                for x in positions.iter_mut() {
                    let above = if *x < low { 2.0 * low - *x } else { *x };
                    let inside = if above > high { 2.0 * high - above } else { above };
                    n_left |= u64::from(!(inside >= low && inside <= high));
                    *x = inside;
                }
            }
            Self::Periodic { low, high } => {
                let length = high - low;
                for x in positions.iter_mut() {
                    let above = if *x < low { *x + length } else { *x };
                    let inside = if above >= high { above - length } else { above };
                    n_left |= u64::from(!(inside >= low && inside <= high));
                    *x = inside;
                }
            }
            Self::ReflectLow { low } => {
                for x in positions.iter_mut() {
                    *x = if *x < low { 2.0 * low - *x } else { *x };
                    n_left |= u64::from(!x.is_finite());
                }
            }
            Self::ReflectHigh { high } => {
                for x in positions.iter_mut() {
                    *x = if *x > high { 2.0 * high - *x } else { *x };
                    n_left |= u64::from(!x.is_finite());
                }
            }
            Self::Open => {
                for x in positions.iter() {
                    n_left |= u64::from(!x.is_finite());
                }
            }
        }
        if n_left == 0 { Ok(()) } else { self.fold_all(positions) }
    }

    /// The rare rest: positions that one reflection or one turn did not bring inside.
    #[cold]
    #[inline(never)]
    fn fold_all(self, positions: &mut [f64]) -> Result<(), usize> {
        for (idx, x) in positions.iter_mut().enumerate() {
            if !x.is_finite() {
                return Err(idx);
            }
            *x = self.fold(*x);
        }
        Ok(())
    }

    fn fold(self, x: f64) -> f64 {
        match self {
            Self::Reflect { low, high } if x < low || x > high => {
                let length = high - low;
                let along = (x - low).rem_euclid(2.0 * length);
                let folded = if along > length { 2.0 * length - along } else { along };
                (low + folded).clamp(low, high)
            }
            Self::Periodic { low, high } if x < low || x > high => {
                (low + (x - low).rem_euclid(high - low)).clamp(low, high)
            }
            Self::Reflect { .. } | Self::Periodic { .. } => x,
            Self::ReflectLow { .. } | Self::ReflectHigh { .. } | Self::Open => x,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn applied(rule: Rule, x: f64) -> f64 {
        let mut positions = [x];
        rule.apply(&mut positions).unwrap();
        positions[0]
    }

    /// By hand: 7.6 → −5.6 → 3.6 → −1.6 → −0.4, and so on.
    #[test]
    fn steps_far_beyond_the_domain_fold_back() {
        let rule = Rule::Reflect { low: -1.0, high: 1.0 };
        assert!((applied(rule, 1.5) - 0.5).abs() < 1e-15);
        assert!((applied(rule, -1.5) + 0.5).abs() < 1e-15);
        assert!((applied(rule, 1.0 + 6.6) + 0.4).abs() < 1e-12);
        assert!((applied(rule, -1.0 - 8.5) + 0.5).abs() < 1e-12);
        assert_eq!(applied(rule, 0.25), 0.25);
        let around = Rule::Periodic { low: -1.0, high: 1.0 };
        assert!((applied(around, 1.5) + 0.5).abs() < 1e-15);
        assert!((applied(around, 21.5) + 0.5).abs() < 1e-12);
        assert!((applied(around, -20.5) + 0.5).abs() < 1e-12);
        assert_eq!(applied(Rule::Open, 21.5), 21.5);
        assert_eq!(applied(Rule::ReflectLow { low: 0.0 }, -21.5), 21.5);
        assert_eq!(applied(Rule::ReflectHigh { high: 0.0 }, 21.5), -21.5);
    }

    #[test]
    fn what_is_not_a_number_is_named() {
        for rule in [
            Rule::Reflect { low: 0.0, high: 1.0 },
            Rule::Periodic { low: 0.0, high: 1.0 },
            Rule::ReflectLow { low: 0.0 },
            Rule::ReflectHigh { high: 1.0 },
            Rule::Open,
        ] {
            assert_eq!(rule.apply(&mut [0.5, f64::NAN, f64::INFINITY]), Err(1));
            assert_eq!(rule.apply(&mut [0.5, 0.1, f64::INFINITY]), Err(2));
        }
    }
}

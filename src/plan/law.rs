//! What kind of law an expression is: mass action or saturation in any algebraic writing, or neither.
//!
//! Owns the recognition. May use the expressions of a scenario and the laws of the plan. It deliberately
//! works on numbers only: what hangs on place or time is an expression.

use super::chemistry::Law;
use crate::maths::operator::{Binary, Unary};
use crate::scenario::expression::{Expr, Node};

/// The law that an expression of current concentrations is.
pub fn recognise(expr: &Expr) -> Law {
    if let Some(monomial) = monomial_of(expr) {
        return monomial.law();
    }
    let mut species = None;
    let mut is_one = true;
    expr.walk(&mut |expr| {
        if let Node::Species(idx) = expr.node {
            is_one &= *species.get_or_insert(idx) == idx;
        }
    });
    let law = species.filter(|_| is_one).and_then(|species| ratio_of(expr)?.law(species));
    law.unwrap_or(Law::Expression)
}

/// `k Π c_s^n_s`
struct Monomial {
    constant: f64,
    powers: Vec<(usize, f64)>,
}

impl Monomial {
    fn law(mut self) -> Law {
        self.powers.retain(|(_, power)| *power != 0.0);
        self.powers.sort_unstable_by_key(|(species, _)| *species);
        // A negative power has no value without the species: only the expression says what is meant.
        let is_plain = self.constant.is_finite() && self.constant >= 0.0;
        if is_plain && self.powers.iter().all(|(_, power)| *power > 0.0) {
            Law::MassAction { constant: self.constant, orders: self.powers }
        } else {
            Law::Expression
        }
    }

    fn times(mut self, other: Self, sign: f64) -> Self {
        self.constant =
            if sign > 0.0 { self.constant * other.constant } else { self.constant / other.constant };
        for (species, power) in other.powers {
            match self.powers.iter_mut().find(|(known, _)| *known == species) {
                Some((_, sum)) => *sum += sign * power,
                None => self.powers.push((species, sign * power)),
            }
        }
        self
    }
}

fn monomial_of(expr: &Expr) -> Option<Monomial> {
    match &expr.node {
        Node::Constant(value) => Some(Monomial { constant: *value, powers: Vec::new() }),
        Node::Species(idx) => Some(Monomial { constant: 1.0, powers: vec![(*idx, 1.0)] }),
        Node::Unary(Unary::Negate, a) => {
            let a = monomial_of(a)?;
            Some(Monomial { constant: -a.constant, ..a })
        }
        Node::Unary(Unary::Sqrt, a) => raised(monomial_of(a)?, 0.5),
        Node::Binary(Binary::Multiply, a, b) => Some(monomial_of(a)?.times(monomial_of(b)?, 1.0)),
        Node::Binary(Binary::Divide, a, b) => Some(monomial_of(a)?.times(monomial_of(b)?, -1.0)),
        Node::Binary(Binary::Power, a, b) => raised(monomial_of(a)?, b.value()?),
        _ => None,
    }
}

fn raised(monomial: Monomial, power: f64) -> Option<Monomial> {
    let constant = Binary::Power.apply(monomial.constant, power);
    let powers = monomial.powers.into_iter().map(|(species, own)| (species, own * power)).collect();
    constant.is_finite().then_some(Monomial { constant, powers })
}

/// Highest power of the concentration that is followed.
const MAX_DEGREE: usize = 6;

/// A ratio of polynomials of one concentration, coefficients from the constant one up.
#[derive(Clone)]
struct Ratio {
    above: Vec<f64>,
    below: Vec<f64>,
}

impl Ratio {
    fn constant(value: f64) -> Self {
        Self { above: vec![value], below: vec![1.0] }
    }

    fn plus(&self, other: &Self, sign: f64) -> Option<Self> {
        if self.below == other.below {
            return Some(Self { above: sum(&self.above, &other.above, sign), below: self.below.clone() });
        }
        let (left, right) = (product(&self.above, &other.below)?, product(&other.above, &self.below)?);
        Some(Self { above: sum(&left, &right, sign), below: product(&self.below, &other.below)? })
    }

    fn times(&self, other: &Self) -> Option<Self> {
        Some(Self { above: product(&self.above, &other.above)?, below: product(&self.below, &other.below)? })
    }

    fn inverse(self) -> Self {
        Self { above: self.below, below: self.above }
    }

    /// `V c / (K + c)`, common powers of c taken out.
    fn law(mut self, species: usize) -> Option<Law> {
        let rounding = |list: &[f64]| 1e-14 * list.iter().fold(0.0, |max: f64, value| max.max(value.abs()));
        for list in [&mut self.above, &mut self.below] {
            let small = rounding(list);
            list.iter_mut().filter(|value| value.abs() <= small).for_each(|value| *value = 0.0);
            while list.last() == Some(&0.0) {
                list.pop();
            }
        }
        while self.above.first() == Some(&0.0) && self.below.first() == Some(&0.0) {
            self.above.remove(0);
            self.below.remove(0);
        }
        let ([0.0, v], [k, one]) = (&self.above[..], &self.below[..]) else { return None };
        let (maximum, half) = (v / one, k / one);
        let is_right = maximum > 0.0 && half > 0.0 && maximum.is_finite() && half.is_finite();
        is_right.then_some(Law::Saturation { maximum, half, species })
    }
}

fn sum(a: &[f64], b: &[f64], sign: f64) -> Vec<f64> {
    let at = |list: &[f64], idx: usize| list.get(idx).copied().unwrap_or(0.0);
    (0..a.len().max(b.len())).map(|idx| at(a, idx) + sign * at(b, idx)).collect()
}

fn product(a: &[f64], b: &[f64]) -> Option<Vec<f64>> {
    let mut result = vec![0.0; (a.len() + b.len()).saturating_sub(1)];
    for (i, a) in a.iter().enumerate() {
        for (j, b) in b.iter().enumerate() {
            result[i + j] += a * b;
        }
    }
    (result.len() <= MAX_DEGREE + 1).then_some(result)
}

fn ratio_of(expr: &Expr) -> Option<Ratio> {
    match &expr.node {
        Node::Constant(value) => Some(Ratio::constant(*value)),
        Node::Species(_) => Some(Ratio { above: vec![0.0, 1.0], below: vec![1.0] }),
        Node::Unary(Unary::Negate, a) => Ratio::constant(-1.0).times(&ratio_of(a)?),
        Node::Binary(Binary::Add, a, b) => ratio_of(a)?.plus(&ratio_of(b)?, 1.0),
        Node::Binary(Binary::Subtract, a, b) => ratio_of(a)?.plus(&ratio_of(b)?, -1.0),
        Node::Binary(Binary::Multiply, a, b) => ratio_of(a)?.times(&ratio_of(b)?),
        Node::Binary(Binary::Divide, a, b) => ratio_of(a)?.times(&ratio_of(b)?.inverse()),
        Node::Binary(Binary::Power, a, b) => {
            let (base, power) = (ratio_of(a)?, b.value()?);
            let times = power.abs();
            if times.fract() != 0.0 || !(1.0..=MAX_DEGREE as f64).contains(&times) {
                return None;
            }
            let base = if power < 0.0 { base.inverse() } else { base };
            (1..times as usize).try_fold(base.clone(), |all, _| all.times(&base))
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::expression::Type;
    use crate::source::Span;
    use crate::units::Dimension;

    const KIND: Type = Type::Number(Dimension::NONE);

    fn n(value: f64) -> Expr {
        Expr::constant(value, KIND, Span::default())
    }

    fn s(idx: usize) -> Expr {
        Expr::leaf(Node::Species(idx), Dimension::NONE, Span::default())
    }

    fn op(operator: Binary, a: Expr, b: Expr) -> Expr {
        Expr::binary(operator, a, b, KIND, Span::default())
    }

    use Binary::{Add, Divide, Multiply, Power, Subtract};

    #[test]
    fn mass_action_in_any_writing() {
        let k_a_b = op(Multiply, op(Multiply, s(1), n(2.0)), op(Divide, s(0), n(4.0)));
        assert_eq!(recognise(&k_a_b), Law::MassAction { constant: 0.5, orders: vec![(0, 1.0), (1, 1.0)] });
        let squared = op(Divide, op(Power, s(2), n(3.0)), s(2));
        assert_eq!(recognise(&squared), Law::MassAction { constant: 1.0, orders: vec![(2, 2.0)] });
        assert_eq!(recognise(&n(3.0)), Law::MassAction { constant: 3.0, orders: vec![] });
        assert_eq!(recognise(&op(Divide, n(1.0), s(0))), Law::Expression);
        let at_x = op(Multiply, s(0), Expr::leaf(Node::Axis(0), Dimension::NONE, Span::default()));
        assert_eq!(recognise(&at_x), Law::Expression);
    }

    #[test]
    fn saturation_in_any_writing() {
        let law = |maximum, half| Law::Saturation { maximum, half, species: 3 };
        let plain = op(Divide, op(Multiply, n(6.0), s(3)), op(Add, n(2.0), s(3)));
        assert_eq!(recognise(&plain), law(6.0, 2.0));
        // 6 / (1 + 2/S)
        let inverse = op(Divide, n(6.0), op(Add, n(1.0), op(Divide, n(2.0), s(3))));
        assert_eq!(recognise(&inverse), law(6.0, 2.0));
        // 6 (1 − 2/(2 + S))
        let rest = op(Subtract, n(1.0), op(Divide, n(2.0), op(Add, n(2.0), s(3))));
        assert_eq!(recognise(&op(Multiply, n(6.0), rest)), law(6.0, 2.0));
        // S / (4 + 2 S)
        let scaled = op(Divide, s(3), op(Add, n(4.0), op(Multiply, n(2.0), s(3))));
        assert_eq!(recognise(&scaled), law(0.5, 2.0));
    }

    #[test]
    fn what_is_neither_stays_an_expression() {
        let haldane = op(Divide, s(0), op(Add, op(Add, n(1.0), s(0)), op(Power, s(0), n(2.0))));
        assert_eq!(recognise(&haldane), Law::Expression);
        let two = op(Divide, s(0), op(Add, n(1.0), s(1)));
        assert_eq!(recognise(&two), Law::Expression);
        let reversible = op(Subtract, s(0), op(Multiply, n(2.0), s(1)));
        assert_eq!(recognise(&reversible), Law::Expression);
    }
}

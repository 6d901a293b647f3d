//! Expressions: pairs to rows, rows to trees.
//!
//! Owns operands and their brackets. May use `climb` for the order of operations and `quantity` for
//! units. It deliberately gives no meaning to any name.

use super::quantity::{self, Written};
use super::{Parts, Place, span_at, spanned};
use crate::source::Spanned;
use crate::syntax::climb::{Built, Deep, Item, climb, deeper};
use crate::syntax::grammar::Rule;
use crate::syntax::tree::{Argument, BinaryOperator, Expr, ExprKind, Range, UnaryOperator};
use pest::iterators::Pair;

impl Parts<'_> {
    pub fn expression(&mut self) -> Built<Expr> {
        let pair = self.need(Rule::expression)?;
        Ok(expression(self.place, pair)?.expr)
    }

    pub fn optional_expression(&mut self) -> Built<Option<Expr>> {
        let pair = self.take(Rule::expression);
        pair.map(|pair| Ok(expression(self.place, pair)?.expr)).transpose()
    }

    pub fn expressions(&mut self) -> Built<Vec<Expr>> {
        std::iter::from_fn(|| self.optional_expression().transpose()).collect()
    }

    /// The next range, if one follows.
    pub fn take_range(&mut self) -> Option<Built<Range>> {
        let is_next = self.pairs.peek().is_some_and(|pair| pair.as_rule() == Rule::range);
        is_next.then(|| self.range())
    }

    pub fn range(&mut self) -> Built<Range> {
        let pair = self.need(Rule::range)?;
        let mut parts = Parts::of(self.place, pair);
        Ok(Range { low: parts.expression()?, high: parts.expression()? })
    }
}

pub fn expression(place: Place, pair: Pair<Rule>) -> Built<Deep> {
    let mut items = Vec::new();
    for pair in pair.into_inner() {
        let span = span_at(place, &pair);
        match pair.as_rule() {
            Rule::prefix => {
                let operator = if pair.as_str() == "-" { UnaryOperator::Negate } else { UnaryOperator::Not };
                items.push(Item::Prefix(Spanned::new(operator, span)));
            }
            Rule::infix => items.push(Item::Infix(Spanned::new(infix(pair.as_str()), span))),
            Rule::number => {
                let is_exponent = is_after_power(&items);
                items.extend(quantity::items(written(place, pair, is_exponent)?));
            }
            _ => items.push(Item::Operand(operand(place, pair)?)),
        }
    }
    climb(items)
}

fn infix(text: &str) -> BinaryOperator {
    use BinaryOperator as B;
    match text {
        "+" => B::Add,
        "-" => B::Subtract,
        "*" => B::Multiply,
        "/" => B::Divide,
        "^" => B::Power,
        "<" => B::Less,
        "<=" => B::LessEqual,
        ">" => B::Greater,
        ">=" => B::GreaterEqual,
        "==" => B::Equal,
        "!=" => B::NotEqual,
        "and" => B::And,
        _ => B::Or,
    }
}

/// Whether the next operand is an exponent, with or without a sign.
fn is_after_power(items: &[Item]) -> bool {
    let before = items.iter().rev().find(|item| !matches!(item, Item::Prefix(_)));
    matches!(before, Some(Item::Infix(operator)) if operator.value == BinaryOperator::Power)
}

fn written(place: Place, pair: Pair<Rule>, is_exponent: bool) -> Built<Written> {
    let mut parts = Parts::of(place, pair);
    let digits = parts.need(Rule::bare_number)?;
    let unit = parts.take(Rule::unit);
    Ok(Written { digits: spanned(place, &digits), unit: unit.map(|unit| spanned(place, &unit)), is_exponent })
}

/// A number without a unit, as an expression.
pub fn bare_number(place: Place, pair: Pair<Rule>) -> Built<Expr> {
    let digits = spanned(place, &pair);
    let items = quantity::items(Written { digits, unit: None, is_exponent: false });
    Ok(climb(items)?.expr)
}

pub fn operand(place: Place, pair: Pair<Rule>) -> Built<Deep> {
    match pair.as_rule() {
        Rule::call => call(place, pair),
        Rule::conditional => conditional(place, pair),
        Rule::tuple => tuple(place, pair),
        _ => path(place, pair),
    }
}

fn path(place: Place, pair: Pair<Rule>) -> Built<Deep> {
    let span = span_at(place, &pair);
    let names = pair.into_inner().map(|name| spanned(place, &name)).collect();
    Ok(Deep { expr: Expr { span, kind: ExprKind::Path(names) }, depth: 1 })
}

fn call(place: Place, pair: Pair<Rule>) -> Built<Deep> {
    let span = span_at(place, &pair);
    let mut parts = Parts::of(place, pair);
    let function = parts.need(Rule::dotted)?;
    let function = spanned(place, &function);
    let mut arguments = Vec::new();
    let mut depth = 0;
    while let Some(pair) = parts.take(Rule::argument) {
        let mut argument = Parts::of(place, pair);
        let name = argument.take(Rule::argument_name);
        let name = name.map(|name| Parts::of(place, name).name()).transpose()?;
        let value = expression(place, argument.need(Rule::expression)?)?;
        depth = depth.max(value.depth);
        arguments.push(Argument { name, value: value.expr });
    }
    let kind = ExprKind::Call { function, arguments };
    Ok(Deep { expr: Expr { span, kind }, depth: deeper(depth, span)? })
}

fn conditional(place: Place, pair: Pair<Rule>) -> Built<Deep> {
    let start = span_at(place, &pair);
    let mut parts = Parts::of(place, pair);
    let mut branch = || expression(place, parts.need(Rule::expression)?);
    let (condition, then, otherwise) = (branch()?, branch()?, branch()?);
    // The pair may end in blanks; the expression ends with its last branch.
    let span = crate::source::Span { end: otherwise.expr.span.end, ..start };
    let depth = deeper(condition.depth.max(then.depth).max(otherwise.depth), span)?;
    let kind = ExprKind::If {
        condition: Box::new(condition.expr),
        then: Box::new(then.expr),
        otherwise: Box::new(otherwise.expr),
    };
    Ok(Deep { expr: Expr { span, kind }, depth })
}

/// Brackets around one expression are that expression with the brackets in its span.
fn tuple(place: Place, pair: Pair<Rule>) -> Built<Deep> {
    let span = span_at(place, &pair);
    let mut elements = Vec::new();
    for pair in pair.into_inner().filter(|pair| pair.as_rule() == Rule::expression) {
        elements.push(expression(place, pair)?);
    }
    if elements.len() == 1 {
        return Ok(elements.remove(0).with_span(span));
    }
    let depth = elements.iter().map(|element| element.depth).max().unwrap_or(0);
    let kind = ExprKind::Tuple(elements.into_iter().map(|element| element.expr).collect());
    Ok(Deep { expr: Expr { span, kind }, depth: deeper(depth, span)? })
}

impl Deep {
    fn with_span(mut self, span: crate::source::Span) -> Self {
        self.expr.span = span;
        self
    }
}

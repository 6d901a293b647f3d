//! Operands and operators in a row to a tree.
//!
//! Owns the order of operations: or < and < not < comparison < + - < * / < unary minus < ^ (to the
//! right). May use `tree`, `bounds`. It deliberately sees no text: the unit rule has been applied before.

use super::bounds::{MAX_EXPRESSION_DEPTH, too_deep};
use super::tree::{BinaryOperator, Expr, ExprKind, UnaryOperator};
use crate::diagnostic::{Diagnostic, codes};
use crate::source::{Span, Spanned};

/// What building gives: a part of the tree, or the message that says why there is none.
pub type Built<T> = Result<T, Box<Diagnostic>>;

/// An expression with the depth of its tree, which is bounded while it is built.
#[derive(Debug, Clone, PartialEq)]
pub struct Deep {
    pub expr: Expr,
    pub depth: usize,
}

/// One element of a flat row.
#[derive(Debug, Clone, PartialEq)]
pub enum Item {
    Prefix(Spanned<UnaryOperator>),
    Infix(Spanned<BinaryOperator>),
    Operand(Deep),
}

/// How strongly an operator binds; higher is tighter.
fn binding(operator: BinaryOperator) -> u8 {
    use BinaryOperator as B;
    match operator {
        B::Or => 1,
        B::And => 2,
        B::Less | B::LessEqual | B::Greater | B::GreaterEqual | B::Equal | B::NotEqual => COMPARISON,
        B::Add | B::Subtract => 5,
        B::Multiply | B::Divide => 6,
        B::Power => POWER,
    }
}

const NOT: u8 = 3;
const COMPARISON: u8 = 4;
const NEGATE: u8 = 7;
const POWER: u8 = 8;

/// Builds the tree of a whole row; the messages say why there is none.
pub fn climb(items: Vec<Item>) -> Built<Deep> {
    let mut row = Row { items: items.into_iter().peekable(), n_open: 0 };
    row.expression(0)
}

struct Row {
    items: std::iter::Peekable<std::vec::IntoIter<Item>>,
    /// How many calls of `expression` are open: bounds the recursion of `2^2^2^…` and `- - - …`.
    n_open: usize,
}

impl Row {
    /// An expression whose operators all bind at least as strongly as `weakest`.
    fn expression(&mut self, weakest: u8) -> Built<Deep> {
        self.n_open += 1;
        let mut left = self.operand()?;
        while let Some(operator) = self.next_infix(weakest) {
            let strength = binding(operator.value);
            let right = self.right_side(&operator, strength)?;
            left = join(left, operator, right)?;
            if strength == COMPARISON {
                self.refuse_chain(&left)?;
            }
        }
        self.n_open -= 1;
        Ok(left)
    }

    fn right_side(&mut self, operator: &Spanned<BinaryOperator>, strength: u8) -> Built<Deep> {
        if self.n_open > MAX_EXPRESSION_DEPTH {
            return Err(chain_too_deep(operator.span));
        }
        // Equal operators group to the left, powers to the right.
        self.expression(if strength == POWER { POWER } else { strength + 1 })
    }

    fn operand(&mut self) -> Built<Deep> {
        match self.items.next() {
            Some(Item::Operand(operand)) => Ok(operand),
            Some(Item::Prefix(operator)) => self.prefixed(operator),
            // The grammar lets only operands and prefixes stand here.
            Some(Item::Infix(operator)) => Err(malformed(operator.span)),
            None => Err(malformed(Span::default())),
        }
    }

    fn prefixed(&mut self, operator: Spanned<UnaryOperator>) -> Built<Deep> {
        if self.n_open > MAX_EXPRESSION_DEPTH {
            return Err(chain_too_deep(operator.span));
        }
        let operand = self.expression(match operator.value {
            UnaryOperator::Not => NOT,
            UnaryOperator::Negate => NEGATE,
        })?;
        let span = operator.span.to(operand.expr.span);
        let depth = deeper(operand.depth, operator.span)?;
        let kind = ExprKind::Unary { operator, operand: Box::new(operand.expr) };
        Ok(Deep { expr: Expr { span, kind }, depth })
    }

    fn next_infix(&mut self, weakest: u8) -> Option<Spanned<BinaryOperator>> {
        match self.items.peek() {
            Some(Item::Infix(operator)) if binding(operator.value) >= weakest => {
                let operator = operator.clone();
                self.items.next();
                Some(operator)
            }
            _ => None,
        }
    }

    /// `a < b < c` has no meaning that everyone would guess.
    fn refuse_chain(&mut self, left: &Deep) -> Built<()> {
        match self.items.peek() {
            Some(Item::Infix(operator)) if binding(operator.value) == COMPARISON => {
                let diagnostic = Diagnostic::error(codes::S012, "comparisons do not chain")
                    .at(operator.span, "a second comparison")
                    .also(left.expr.span, "the first is here")
                    .help("write both and join them: `a < b and b < c`");
                Err(Box::new(diagnostic))
            }
            _ => Ok(()),
        }
    }
}

fn join(left: Deep, operator: Spanned<BinaryOperator>, right: Deep) -> Built<Deep> {
    let span = left.expr.span.to(right.expr.span);
    let depth = deeper(left.depth.max(right.depth), operator.span)?;
    let kind = ExprKind::Binary { operator, left: Box::new(left.expr), right: Box::new(right.expr) };
    Ok(Deep { expr: Expr { span, kind }, depth })
}

/// One level more than `depth`, if the limit allows it.
pub fn deeper(depth: usize, span: Span) -> Built<usize> {
    if depth >= MAX_EXPRESSION_DEPTH { Err(chain_too_deep(span)) } else { Ok(depth + 1) }
}

fn chain_too_deep(span: Span) -> Box<Diagnostic> {
    Box::new(too_deep(span, "operators in one expression", MAX_EXPRESSION_DEPTH))
}

fn malformed(span: Span) -> Box<Diagnostic> {
    Box::new(Diagnostic::error(codes::S001, "a value is missing here").at(span, ""))
}

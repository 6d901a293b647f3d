//! The unit rule: what stands right after a number, unit or division by a name.
//!
//! Owns the decision for `2 m/tau`: the unit `m`, divided by the name `tau`. May use the symbols of
//! `units`. It deliberately knows no names of the scene: only what the table of units knows is a unit
//! after a slash, so that adding a parameter never changes how a number is read.

use crate::source::{Span, Spanned};
use crate::syntax::climb::{Deep, Item};
use crate::syntax::tree::{BinaryOperator, Expr, ExprKind, Name, Number};
use crate::units::is_unit_symbol;

/// A number's digits with their place, and the text after it that may be a unit.
pub struct Written {
    pub digits: Spanned<String>,
    pub unit: Option<Spanned<String>>,
    /// Right after `^` the slash is always a division: `x^2/s`.
    pub is_exponent: bool,
}

/// The row that a written number stands for: itself, then the divisions that its text holds.
pub fn items(written: Written) -> Vec<Item> {
    let Written { digits, unit, is_exponent } = written;
    let Some(unit) = unit else { return vec![number(digits, None)] };
    let end = unit_length(&unit.value, is_exponent);
    let rest = divisions(&unit.value[end..], part_span(unit.span, end, unit.value.len()));
    let kept = (end > 0).then(|| Spanned::new(unit.value[..end].to_owned(), part_span(unit.span, 0, end)));
    let mut items = vec![number(digits, kept)];
    items.extend(rest);
    items
}

fn number(digits: Spanned<String>, unit: Option<Spanned<String>>) -> Item {
    let span = unit.as_ref().map_or(digits.span, |unit| digits.span.to(unit.span));
    let kind = ExprKind::Number(Number { digits: digits.value.replace('_', ""), unit });
    Item::Operand(Deep { expr: Expr { span, kind }, depth: 1 })
}

/// How many bytes of the text are the unit; the rest begins with a slash before a name.
fn unit_length(text: &str, is_exponent: bool) -> usize {
    let slashes = text.match_indices('/').map(|(position, _)| position);
    let begins_name = |position: &usize| is_exponent || !is_unit_symbol(first_symbol(&text[position + 1..]));
    slashes.into_iter().find(begins_name).unwrap_or(text.len())
}

/// The symbol that a text begins with, up to an exponent or a joint.
fn first_symbol(text: &str) -> &str {
    text.split(['^', '/', '.', '·']).next().unwrap_or(text)
}

/// `/tau/a.b^2` as operators and operands; everything after the first name is a name, too.
fn divisions(text: &str, span: Span) -> Vec<Item> {
    let mut items = Vec::new();
    let mut position = 0;
    for piece in text.split('/').skip(1) {
        let slash = part_span(span, position, position + 1);
        items.push(Item::Infix(Spanned::new(BinaryOperator::Divide, slash)));
        let start = position + 1;
        let (path, exponent) =
            piece.split_once('^').map_or((piece, None), |(path, power)| (path, Some(power)));
        items.push(path_item(path, part_span(span, start, start + path.len())));
        if let Some(exponent) = exponent {
            let caret = start + path.len();
            items.push(Item::Infix(Spanned::new(BinaryOperator::Power, part_span(span, caret, caret + 1))));
            items.extend(exponent_items(exponent, part_span(span, caret + 1, start + piece.len())));
        }
        position = start + piece.len();
    }
    items
}

fn path_item(path: &str, span: Span) -> Item {
    let mut names = Vec::new();
    let mut position = 0;
    for name in path.split('.') {
        names.push(Name::new(name.to_owned(), part_span(span, position, position + name.len())));
        position += name.len() + 1;
    }
    Item::Operand(Deep { expr: Expr { span, kind: ExprKind::Path(names) }, depth: 1 })
}

fn exponent_items(exponent: &str, span: Span) -> Vec<Item> {
    use crate::syntax::tree::UnaryOperator::Negate;
    let digits = exponent.trim_start_matches('-');
    let sign = exponent.len() - digits.len();
    let digits = Spanned::new(digits.to_owned(), part_span(span, sign, exponent.len()));
    let negation = (sign > 0).then(|| Item::Prefix(Spanned::new(Negate, part_span(span, 0, sign))));
    negation.into_iter().chain([number(digits, None)]).collect()
}

fn part_span(span: Span, start: usize, end: usize) -> Span {
    Span::new(span.file, span.start as usize + start, span.start as usize + end)
}

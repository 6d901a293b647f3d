//! A setting of the command line, `name=value`: the value as an expression of the language.
//!
//! Owns the way from such a text to a tree whose places lie in it. May use everything beside it. It
//! deliberately looks up no name.

use super::parse::parse;
use super::tree::{Expr, ExprKind, Name, StatementKind};
use crate::diagnostic::{Diagnostic, codes};
use crate::source::{FileId, Span};

/// A setting is read as the constant of a scene that consists of it.
const BEFORE: &str = "lamella 1\nlet ";

/// The value of `name=value`; no text gives a panic. All places lie in `text`.
pub fn parse_setting(file: FileId, text: &str) -> (Option<Expr>, Vec<Diagnostic>) {
    // A second line would be a statement of its own, and nobody would read it.
    let text = text.trim_end();
    if let Some(line_end) = text.find(['\n', '\r']) {
        let rest = text[line_end..].trim_start();
        let first_line = rest.lines().next().unwrap_or(rest);
        let start = text.len() - rest.len();
        let place = Span::new(file, start, start + first_line.len());
        return (None, vec![more_than_a_value(place, first_line)]);
    }
    let (parsed, mut diagnostics) = parse(file, &format!("{BEFORE}{text}\n"));
    let shift = |span: &mut Span| {
        let back = |byte: u32| (byte as usize).saturating_sub(BEFORE.len()).min(text.len()) as u32;
        (span.start, span.end) = (back(span.start), back(span.end));
    };
    diagnostics.iter_mut().flat_map(|diagnostic| &mut diagnostic.labels).for_each(|l| shift(&mut l.span));
    let mut value = None;
    for statement in parsed.statements {
        if let StatementKind::Let(statement) = statement.kind {
            if let Some(mut doc) = statement.doc {
                shift(&mut doc.span);
                diagnostics.push(more_than_a_value(doc.span, &format!("\"{}\"", doc.value)));
            }
            let mut expr = statement.value;
            shift_expr(&mut expr, &shift);
            value = Some(expr);
        }
    }
    (value.filter(|_| diagnostics.is_empty()), diagnostics)
}

fn more_than_a_value(place: Span, found: &str) -> Diagnostic {
    Diagnostic::error(codes::S001, "a setting is one value")
        .at(place, "more than a value")
        .found(super::complaint::quoted(found))
        .expected("the end of the value")
}

fn shift_name(name: &mut Name, shift: &impl Fn(&mut Span)) {
    shift(&mut name.span);
}

/// Moves all places of an expression.
fn shift_expr(expr: &mut Expr, shift: &impl Fn(&mut Span)) {
    shift(&mut expr.span);
    match &mut expr.kind {
        ExprKind::Number(number) => number.unit.iter_mut().for_each(|unit| shift(&mut unit.span)),
        ExprKind::Path(path) => path.iter_mut().for_each(|name| shift_name(name, shift)),
        ExprKind::Call { function, arguments } => {
            shift_name(function, shift);
            for argument in arguments {
                argument.name.iter_mut().for_each(|name| shift_name(name, shift));
                shift_expr(&mut argument.value, shift);
            }
        }
        ExprKind::Unary { operator, operand } => {
            shift(&mut operator.span);
            shift_expr(operand, shift);
        }
        ExprKind::Binary { operator, left, right } => {
            shift(&mut operator.span);
            shift_expr(left, shift);
            shift_expr(right, shift);
        }
        ExprKind::If { condition, then, otherwise } => {
            for part in [condition, then, otherwise] {
                shift_expr(part, shift);
            }
        }
        ExprKind::Tuple(parts) => parts.iter_mut().for_each(|part| shift_expr(part, shift)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_places_of_a_value_lie_in_the_setting() {
        let text = "v = 2 cm/s * f(a)";
        let (value, diagnostics) = parse_setting(FileId(0), text);
        assert!(diagnostics.is_empty(), "{diagnostics:?}");
        let ExprKind::Binary { operator, left, right } = value.expect("a value").kind else {
            panic!("a product")
        };
        let at = |span: Span| &text[span.range()];
        assert_eq!([at(left.span), at(operator.span), at(right.span)], ["2 cm/s", "*", "f(a)"]);
        let ExprKind::Call { function, arguments } = right.kind else { panic!("a call") };
        assert_eq!([at(function.span), at(arguments[0].value.span)], ["f", "a"]);
    }

    #[test]
    fn a_setting_is_one_value_on_one_line() {
        for (text, place) in
            [("v=2\n7", "7"), ("v=2\rlet", "let"), ("v=(1 +\n 2)\n3", "2)"), ("v=2 \"speed\"", "\"speed\"")]
        {
            let (value, diagnostics) = parse_setting(FileId(0), text);
            assert!(value.is_none() && diagnostics.len() == 1, "{text}: {diagnostics:?}");
            let span = diagnostics[0].primary_span().expect("a place");
            assert_eq!(&text[span.range()], place);
        }
        assert!(parse_setting(FileId(0), "v=2 \n").0.is_some());
        // What cannot be read has its place in the setting, too.
        for text in ["v=2 +", "v=", "v=)", "v=2 3", "=2", "v=ü", "v=2 kk/"] {
            let (value, diagnostics) = parse_setting(FileId(0), text);
            assert!(value.is_none() != diagnostics.is_empty(), "{text}: {diagnostics:?}");
            for label in diagnostics.iter().flat_map(|diagnostic| &diagnostic.labels) {
                assert!(
                    label.span.end as usize <= text.len() && label.span.start <= label.span.end,
                    "{text}"
                );
            }
        }
    }
}

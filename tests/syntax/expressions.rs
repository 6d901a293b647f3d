//! How formulas group and where units end, written with brackets around every operation.

use crate::messages_of;
use lamella::source::FileId;
use lamella::syntax::parse;
use lamella::syntax::tree::{BinaryOperator, Expr, ExprKind, StatementKind, UnaryOperator};

fn symbol(operator: BinaryOperator) -> &'static str {
    use BinaryOperator as B;
    match operator {
        B::Add => "+",
        B::Subtract => "-",
        B::Multiply => "*",
        B::Divide => "/",
        B::Power => "^",
        B::Less => "<",
        B::LessEqual => "<=",
        B::Greater => ">",
        B::GreaterEqual => ">=",
        B::Equal => "==",
        B::NotEqual => "!=",
        B::And => "and",
        B::Or => "or",
    }
}

/// `(a + (b * c))`; a unit stands in square brackets.
fn bracketed(expr: &Expr) -> String {
    let list = |items: Vec<String>| items.join(", ");
    match &expr.kind {
        ExprKind::Number(number) => match &number.unit {
            Some(unit) => format!("{}[{}]", number.digits, unit.value),
            None => number.digits.clone(),
        },
        ExprKind::Path(names) => names.iter().map(|name| name.value.as_str()).collect::<Vec<_>>().join("."),
        ExprKind::Call { function, arguments } => {
            let argument = |value: &Expr, name: Option<&str>| match name {
                Some(name) => format!("{name} = {}", bracketed(value)),
                None => bracketed(value),
            };
            let arguments =
                arguments.iter().map(|it| argument(&it.value, it.name.as_ref().map(|it| it.value.as_str())));
            format!("{}({})", function.value, list(arguments.collect()))
        }
        ExprKind::Unary { operator, operand } => match operator.value {
            UnaryOperator::Negate => format!("(-{})", bracketed(operand)),
            UnaryOperator::Not => format!("(not {})", bracketed(operand)),
        },
        ExprKind::Binary { operator, left, right } => {
            format!("({} {} {})", bracketed(left), symbol(operator.value), bracketed(right))
        }
        ExprKind::If { condition, then, otherwise } => {
            format!("(if {} then {} else {})", bracketed(condition), bracketed(then), bracketed(otherwise))
        }
        ExprKind::Tuple(elements) => format!("({})", list(elements.iter().map(bracketed).collect())),
    }
}

fn read(formula: &str) -> String {
    let text = format!("lamella 1\nlet a = {formula}");
    let (file, messages) = parse(FileId(0), &text);
    match file.statements.last().map(|statement| &statement.kind) {
        Some(StatementKind::Let(it)) => {
            let span = it.value.span.range();
            assert_eq!(&text[span], formula, "the span of an expression is the expression");
            bracketed(&it.value)
        }
        _ => format!("{:?}", messages.first().map(|message| message.code.0)),
    }
}

#[test]
fn operators_group_in_the_usual_order() {
    let cases = [
        ("a + b * c ^ d ^ e", "(a + (b * (c ^ (d ^ e))))"),
        ("a - b - c + d", "(((a - b) - c) + d)"),
        ("a / b * c / d", "(((a / b) * c) / d)"),
        ("-a ^ 2 * b", "((-(a ^ 2)) * b)"),
        ("2 ^ -a ^ b", "(2 ^ (-(a ^ b)))"),
        ("a or b and not c < d + e", "(a or (b and (not (c < (d + e)))))"),
        ("not not a", "(not (not a))"),
        ("--a", "(-(-a))"),
        ("a < b and b < c", "((a < b) and (b < c))"),
        ("if a then b else if c then d else e + f", "(if a then b else (if c then d else (e + f)))"),
        ("(a + b) * c", "((a + b) * c)"),
        ("((a, b), (b, -c))", "((a, b), (b, (-c)))"),
        ("f(a, g = b + c) * h()", "(f(a, g = (b + c)) * h())"),
        ("a.b.c - d", "(a.b.c - d)"),
    ];
    for (formula, expected) in cases {
        assert_eq!(read(formula), expected, "{formula}");
    }
}

#[test]
fn units_are_known_right_after_a_number_only() {
    let cases = [
        ("1.2e-2 cm/s", "1.2e-2[cm/s]"),
        ("3 /d", "3[/d]"),
        ("3/d", "3[/d]"),
        ("3 / d", "(3 / d)"),
        ("20 %", "20[%]"),
        ("2 m^2/s + 1", "(2[m^2/s] + 1)"),
        ("2 kg·m/s^2", "2[kg·m/s^2]"),
        ("2 kg.m/s^-2", "2[kg.m/s^-2]"),
        ("1_000.5 m", "1000.5[m]"),
        ("1/tau", "(1 / tau)"),
        ("2 m/tau", "(2[m] / tau)"),
        ("2 m/s/tau^2*b", "((2[m/s] / (tau ^ 2)) * b)"),
        ("c/2/tau", "((c / 2) / tau)"),
        ("a ^ 2/s", "((a ^ 2) / s)"),
        ("a^-2/s", "((a ^ (-2)) / s)"),
        ("1/run.b", "(1 / run.b)"),
        ("2/f(a)", "(2 / f(a))"),
        ("0.5 c0 * b", "(0.5[c0] * b)"),
        ("(1 + 2) m", "Some(\"S001\")"),
        ("1e999", "1e999"),
        ("if a < 0 cm then 1 m else 2 m", "(if (a < 0[cm]) then 1[m] else 2[m])"),
    ];
    for (formula, expected) in cases {
        assert_eq!(read(formula), expected, "{formula}");
    }
}

#[test]
fn malformed_formulas_have_their_codes() {
    let cases = [
        ("a < b < c", "S012"),
        (".5", "S013"),
        ("1.", "S013"),
        ("a + .5 m", "S013"),
        ("0.02 mol L", "S014"),
        ("f(a", "S004"),
        ("f(a))", "S004"),
        ("a ** b", "S001"),
        ("a && b", "S006"),
        ("\"doc", "S005"),
        ("1e", "none"),
    ];
    for (formula, code) in cases {
        let messages = messages_of(&format!("lamella 1\nlet a = {formula}"));
        assert_eq!(messages.first().map_or("none", |message| message.code.0), code, "{formula}");
    }
}

#[test]
fn several_mistakes_are_told_in_one_run() {
    let text = "lamella 1\nlet a = (2 m\nparm b = 3\noutput total AB evry 10 s\nlet c = 3 *\nseed 1.5\n";
    let codes: Vec<_> = messages_of(text).iter().map(|message| message.code.0).collect();
    assert_eq!(codes, ["S004", "S001", "S001", "S013"]);
}

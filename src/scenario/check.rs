//! Written expressions to typed ones: names looked up, units converted, dimensions checked.

use super::data_files::Files;
use super::expression::{Expr, Node, Type};
use super::results::Measuring;
use super::scope::{BUILT_IN_FUNCTIONS, Locals, Origin, Progress, Scope, is_slip};
use crate::diagnostic::codes::{D005, D006, D008, D009, U101, U103, U106, U108};
use crate::diagnostic::{Diagnostic, precise};
use crate::maths::operator::{Binary, Unary};
use crate::source::Span;
use crate::syntax::tree::{self, BinaryOperator, ExprKind, UnaryOperator};
use crate::units::Dimension;
use std::collections::BTreeMap;

/// Nodes that one expression may have after functions are put in.
const MAX_EXPRESSION_SIZE: u32 = 50_000;

/// What may stand in an expression besides constants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Allow {
    pub position: bool,
    pub time: bool,
    pub species: bool,
    /// Results of a run, and norms of them.
    pub results: bool,
}

impl Allow {
    pub(super) const CONSTANT: Self = Self { position: false, time: false, species: false, results: false };
    pub(super) const PLACE: Self = Self { position: true, time: false, species: false, results: false };
    pub(super) const TIME: Self = Self { position: false, time: true, species: false, results: false };
    pub(super) const INITIAL: Self = Self { position: true, time: false, species: true, results: false };
    pub(super) const RATE: Self = Self { position: true, time: true, species: true, results: false };
    pub(super) const REFERENCE: Self = Self { position: true, time: true, species: false, results: false };
    pub(super) const MEASURE: Self = Self { position: true, time: false, species: false, results: true };
}

/// A function being put in.
pub(super) struct Call {
    pub function: String,
    /// Where the call names it, and the whole call.
    pub name_span: Span,
    pub span: Span,
}

/// The state of checking a scene: names, messages, and the functions being put in.
pub(super) struct Checker<'a> {
    pub scope: Scope<'a>,
    pub diagnostics: Vec<Diagnostic>,
    /// Names of the domain's axes with their index.
    pub axes: Vec<(String, usize)>,
    /// Extents of the axes: index, low, high; none while they are not known.
    pub extents: Vec<(usize, f64, f64)>,
    /// Concentration dimension of each species, as far as known.
    pub species_dimensions: Vec<Option<Dimension>>,
    /// Whether the initial concentration of some species is wrong.
    pub is_initial_wrong: bool,
    pub(super) call_stack: Vec<Call>,
    /// What a measure may speak of, while measures are checked.
    pub(super) measuring: Option<Measuring>,
    /// The whole expressions of the scene that have been checked, by their places.
    pub(super) checked: BTreeMap<Span, &'a tree::Expr>,
    /// Tables of numbers by their names; nothing for one that is wrong, which has been told.
    pub(super) tables: BTreeMap<String, Option<super::data::Known>>,
    /// Constants whose values are being worked out, each for the one before it.
    pub(super) running: Vec<String>,
    pub(super) files: Files,
}

impl<'a> Checker<'a> {
    /// Amount or mass: an amount where the scene does not say. `None` where a mistake hides what it says,
    /// so that no follow-up comes before that mistake.
    pub(super) fn concentration_of(&self, species: usize) -> Option<Dimension> {
        let default = (!self.is_initial_wrong).then_some(Dimension::MOLAR_CONCENTRATION);
        self.species_dimensions[species].or(default)
    }

    pub(super) fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// Checks an expression; `None` means that its mistake has been reported.
    pub(super) fn check(&mut self, expr: &'a tree::Expr, allow: Allow) -> Option<Expr> {
        self.checked.insert(expr.span, expr);
        self.check_with(expr, allow, &Vec::new())
    }

    pub(super) fn check_with(&mut self, expr: &'a tree::Expr, allow: Allow, locals: &Locals) -> Option<Expr> {
        let checked = match &expr.kind {
            ExprKind::Number(number) => self.number(number, expr.span),
            ExprKind::Path(path) => self.path(path, expr.span, allow, locals),
            ExprKind::Call { function, arguments } => {
                self.call(function, arguments, expr.span, allow, locals)
            }
            ExprKind::Unary { operator, operand } => {
                let operand = self.check_with(operand, allow, locals)?;
                self.unary(operator.value, operand, expr.span)
            }
            ExprKind::Binary { operator, left, right } => {
                let left = self.check_with(left, allow, locals);
                let right = self.check_with(right, allow, locals);
                self.binary(operator.value, left?, right?, expr.span)
            }
            ExprKind::If { condition, then, otherwise } => {
                let condition = self.check_with(condition, allow, locals);
                let then = self.check_with(then, allow, locals);
                let otherwise = self.check_with(otherwise, allow, locals);
                self.select(condition?, then?, otherwise?, expr.span)
            }
            ExprKind::Tuple(_) => {
                self.report(
                    Diagnostic::error(D009, "a list in brackets has no value here")
                        .at(expr.span, "several values")
                        .found("a list of values")
                        .expected("one value"),
                );
                None
            }
        }?;
        self.finish(checked)
    }

    /// Bounds the size and refuses constants that are no finite numbers.
    fn finish(&mut self, expr: Expr) -> Option<Expr> {
        if expr.size > MAX_EXPRESSION_SIZE {
            let message =
                Diagnostic::error(D008, "this expression is too large once its functions are put in");
            // The body is right by itself: what grows is the call of it.
            let message = match self.call_stack.first() {
                Some(call) => message.at(call.span, "this call").also(expr.span, "grown too large here"),
                None => message.at(expr.span, "grown too large here"),
            };
            self.report(
                message
                    .found(format!("{} operations", expr.size))
                    .expected(format!("at most {MAX_EXPRESSION_SIZE} operations"))
                    .help("each use of a function's parameter repeats its whole argument: use it less often"),
            );
            return None;
        }
        if let Some(value) = expr.value()
            && !value.is_finite()
        {
            let what = if value.is_nan() { "not a number" } else { "infinite" };
            self.report(
                Diagnostic::error(U106, format!("this value is {what}"))
                    .at(expr.span, format!("its value is {what}"))
                    .found(what)
                    .expected("a finite number"),
            );
            return None;
        }
        Some(expr)
    }

    fn path(&mut self, path: &'a [tree::Name], span: Span, allow: Allow, locals: &Locals) -> Option<Expr> {
        let [name] = path else {
            if self.is_column_alone(path, span) {
                return None;
            }
            if allow.results {
                return self.result_of_output(path, span);
            }
            self.report(
                Diagnostic::error(D005, "results cannot be used here")
                    .at(span, "a result of the run")
                    .found("a dotted name")
                    .expected("names of the scene")
                    .help("results such as `profile.A` are known in `measure` only"),
            );
            return None;
        };
        let text = name.value.as_str();
        if let Some((_, value)) = locals.iter().find(|(local, _)| local == text) {
            return Some(Expr { span, ..value.clone() });
        }
        if let Some(&(_, index)) = self.axes.iter().find(|(axis, _)| axis == text) {
            return self.variable(
                Node::Axis(index),
                Dimension::LENGTH,
                span,
                allow.position,
                text,
                "a position",
            );
        }
        match text {
            "t" => return self.variable(Node::Time, Dimension::TIME, span, allow.time, text, "the time"),
            "pi" => return Some(Expr::constant(std::f64::consts::PI, Type::Number(Dimension::NONE), span)),
            _ => {}
        }
        if allow.results
            && let Some(result) = self.named_result(name, span)
        {
            return result;
        }
        self.named(text, span, allow)
    }

    fn variable(
        &mut self,
        node: Node,
        dimension: Dimension,
        span: Span,
        is_allowed: bool,
        text: &str,
        what: &str,
    ) -> Option<Expr> {
        if is_allowed {
            return Some(Expr::leaf(node, dimension, span));
        }
        if self.scope.is_doubtful(text) {
            return None;
        }
        self.report(
            Diagnostic::error(D005, format!("`{text}` cannot be used here"))
                .at(span, format!("{what}, which is not fixed here"))
                .found(what)
                .expected("numbers, constants and parameters"),
        );
        None
    }

    /// The only parameter of the function being put in that its body does not use and that differs from a
    /// name by a slip.
    fn misspelt_parameter(&self, text: &str) -> Option<&'a tree::Name> {
        let call = self.call_stack.last()?;
        let Origin::Function(statement) = self.scope.get(&call.function)?.origin else { return None };
        let mut used = Vec::new();
        super::slot::collect_names(&statement.body, &mut used);
        let is_unused = |name: &&tree::Name| !used.contains(&name.value) && is_slip(text, &name.value);
        let mut unused = statement.parameters.iter().filter(is_unused);
        let parameter = unused.next()?;
        unused.next().is_none().then_some(parameter)
    }

    fn named(&mut self, text: &str, span: Span, allow: Allow) -> Option<Expr> {
        let is_doubtful = self.scope.is_doubtful(text);
        let Some(entry) = self.scope.get_mut(text) else {
            if is_doubtful {
                return None;
            }
            if BUILT_IN_FUNCTIONS.contains(&text) || crate::catalog::rate::find(text).is_some() {
                self.report(
                    Diagnostic::error(D005, format!("`{text}` cannot be used here"))
                        .at(span, "a built-in function without its arguments")
                        .found("a function")
                        .expected("numbers, constants and parameters"),
                );
            } else {
                self.scope.note_undefined(text, span);
                if let Some(parameter) = self.misspelt_parameter(text) {
                    self.scope.suspect(text, parameter);
                }
            }
            return None;
        };
        entry.n_uses += 1;
        match entry.origin {
            Origin::Let(_) | Origin::Param(_) => {
                let (value, kind) = self.constant_of(text)?;
                Some(Expr::constant(value, kind, span))
            }
            Origin::Species(idx) if allow.species => {
                let dimension = self.concentration_of(idx)?;
                Some(Expr::leaf(Node::Species(idx), dimension, span))
            }
            _ if is_doubtful => None,
            origin => {
                let defined = entry.span;
                let what = origin.describe();
                self.report(
                    Diagnostic::error(D005, format!("`{text}` cannot be used here"))
                        .at(span, format!("{what}, which has no value here"))
                        .also(defined, "defined here")
                        .found(what)
                        .expected("numbers, constants and parameters"),
                );
                None
            }
        }
    }

    /// The value of a `let` or `param`, worked out when it is first asked for.
    pub(super) fn constant_of(&mut self, name: &str) -> Option<(f64, Type)> {
        let entry = self.scope.get_mut(name)?;
        let value = match entry.origin {
            Origin::Let(statement) => &statement.value,
            Origin::Param(statement) => &statement.value,
            _ => return None,
        };
        match entry.progress {
            Progress::Known(value, kind) => return Some((value, kind)),
            Progress::Wrong => return None,
            Progress::Running => {
                entry.progress = Progress::Wrong;
                self.report_circle(name);
                return None;
            }
            Progress::Untouched => entry.progress = Progress::Running,
        }
        self.running.push(name.to_owned());
        let checked = self.check(value, Allow::CONSTANT);
        self.running.pop();
        let checked = checked.and_then(|expr| match (expr.value(), expr.kind) {
            (Some(value), kind @ (Type::Zero | Type::Number(_))) => Some((value, kind)),
            _ => {
                self.report(
                    Diagnostic::error(U108, format!("`{name}` must be a number"))
                        .at(expr.span, expr.kind.describe())
                        .found(expr.kind.describe())
                        .expected("a number"),
                );
                None
            }
        });
        if let Some(entry) = self.scope.get_mut(name) {
            let is_cycle = matches!(entry.progress, Progress::Wrong);
            entry.progress = match checked {
                Some((value, kind)) if !is_cycle => Progress::Known(value, kind),
                _ => Progress::Wrong,
            };
        }
        checked
    }

    /// Constants that need each other: every link of the circle with what it needs.
    fn report_circle(&mut self, name: &str) {
        let first = self.running.iter().position(|running| running == name).unwrap_or(0);
        let links: Vec<(&str, Span)> = self.running[first..]
            .iter()
            .filter_map(|link| Some((link.as_str(), self.scope.get(link)?.place_of_value())))
            .collect();
        let message = Diagnostic::error(D006, format!("`{name}` is defined by itself"));
        let message = label_circle(message, &links, "its value needs")
            .found("a circle of definitions")
            .expected("definitions that end in numbers");
        self.report(message);
    }

    fn unary(&mut self, operator: UnaryOperator, operand: Expr, span: Span) -> Option<Expr> {
        match (operator, operand.kind) {
            (UnaryOperator::Negate, kind @ (Type::Zero | Type::Number(_))) => {
                Some(Expr::unary(Unary::Negate, operand, kind, span))
            }
            (UnaryOperator::Not, Type::Truth) => Some(Expr::unary(Unary::Not, operand, Type::Truth, span)),
            (UnaryOperator::Negate, kind) => self.wrong_kind("`-`", "a number", kind, operand.span),
            (UnaryOperator::Not, kind) => self.wrong_kind("`not`", "a condition", kind, operand.span),
        }
    }

    pub(super) fn wrong_kind(&mut self, what: &str, expected: &str, found: Type, span: Span) -> Option<Expr> {
        self.report(
            Diagnostic::error(U108, format!("{what} needs {expected}"))
                .at(span, format!("this is {}", found.describe()))
                .found(found.describe())
                .expected(expected),
        );
        None
    }

    fn binary(&mut self, operator: BinaryOperator, a: Expr, b: Expr, span: Span) -> Option<Expr> {
        use BinaryOperator as Op;
        if operator == Op::Power {
            return self.power(a, b, span);
        }
        let (op, sign) = operator_of(operator);
        let is_logic = matches!(operator, Op::And | Op::Or);
        for side in [&a, &b] {
            if is_logic != (side.kind == Type::Truth) {
                let expected = if is_logic { "a condition" } else { "a number" };
                return self.wrong_kind(&format!("`{sign}`"), expected, side.kind, side.span);
            }
        }
        let kind = match operator {
            Op::And | Op::Or => Type::Truth,
            Op::Multiply => Type::Number(a.kind.dimension()?.times(b.kind.dimension()?)),
            Op::Divide => Type::Number(a.kind.dimension()?.over(b.kind.dimension()?)),
            _ => {
                let Some(kind) = a.kind.unify(b.kind) else { return self.mismatch(sign, &a, &b, span) };
                if matches!(operator, Op::Add | Op::Subtract) { kind } else { Type::Truth }
            }
        };
        Some(Expr::binary(op, a, b, kind, span))
    }

    pub(super) fn mismatch(&mut self, sign: &str, a: &Expr, b: &Expr, span: Span) -> Option<Expr> {
        let verb = match sign {
            "+" => "add",
            "-" => "subtract",
            _ => "compare",
        };
        let mut message = Diagnostic::error(U101, format!("cannot {verb} values of different dimensions"))
            .at(span, format!("`{sign}` needs the same dimension on both sides"))
            .also(a.span, format!("this is {}", a.kind.describe()))
            .also(b.span, format!("this is {}", b.kind.describe()))
            .found(b.kind.describe())
            .expected(a.kind.describe());
        for (bare, other) in [(a, b), (b, a)] {
            if let (Some(value), Type::Number(Dimension::NONE), Type::Number(dimension)) =
                (bare.value(), bare.kind, other.kind)
            {
                let value = precise(value);
                message = message
                    .help(format!("if {value} has a unit, write it: `{value} {}`", dimension.unit_text()));
            }
        }
        self.report(message);
        None
    }

    pub(super) fn power(&mut self, base: Expr, exponent: Expr, span: Span) -> Option<Expr> {
        let Some(base_dimension) = base.kind.dimension() else {
            return self.wrong_kind("a power", "a number", base.kind, base.span);
        };
        if !matches!(exponent.kind, Type::Zero | Type::Number(Dimension::NONE)) {
            return self.wrong_kind("an exponent", "a plain number", exponent.kind, exponent.span);
        }
        let dimension = if base_dimension.is_none() {
            Some(base_dimension)
        } else {
            exponent.value().and_then(|power| base_dimension.power_f64(power))
        };
        let Some(dimension) = dimension else {
            self.report(
                Diagnostic::error(U103, "the dimension of this power is not fixed")
                    .at(exponent.span, "the exponent must be a constant with a simple fraction")
                    .also(base.span, format!("this is {}", base.kind.describe()))
                    .found("an exponent that varies, or no sixtieth")
                    .expected("a constant such as 2 or 0.5, or a base without dimension"),
            );
            return None;
        };
        Some(Expr::binary(Binary::Power, base, exponent, Type::Number(dimension), span))
    }

    fn select(&mut self, condition: Expr, then: Expr, otherwise: Expr, span: Span) -> Option<Expr> {
        if condition.kind != Type::Truth {
            return self.wrong_kind("`if`", "a condition", condition.kind, condition.span);
        }
        let Some(kind) = then.kind.unify(otherwise.kind) else {
            self.report(
                Diagnostic::error(U101, "the two branches have different dimensions")
                    .at(span, "both branches must have one dimension")
                    .also(then.span, format!("this is {}", then.kind.describe()))
                    .also(otherwise.span, format!("this is {}", otherwise.kind.describe()))
                    .found(otherwise.kind.describe())
                    .expected(then.kind.describe()),
            );
            return None;
        };
        Some(Expr::select(condition, then, otherwise, kind, span))
    }
}

/// The operator that a written one stands for, and how it is written.
pub(super) fn operator_of(operator: BinaryOperator) -> (Binary, &'static str) {
    use BinaryOperator as Op;
    match operator {
        Op::Add => (Binary::Add, "+"),
        Op::Subtract => (Binary::Subtract, "-"),
        Op::Multiply => (Binary::Multiply, "*"),
        Op::Divide => (Binary::Divide, "/"),
        Op::Power => (Binary::Power, "^"),
        Op::Less => (Binary::Less, "<"),
        Op::LessEqual => (Binary::LessEqual, "<="),
        Op::Greater => (Binary::Greater, ">"),
        Op::GreaterEqual => (Binary::GreaterEqual, ">="),
        Op::Equal => (Binary::Equal, "=="),
        Op::NotEqual => (Binary::NotEqual, "!="),
        Op::And => (Binary::And, "and"),
        Op::Or => (Binary::Or, "or"),
    }
}

/// Labels the links of a circle, the first one as the place of the message.
pub(super) fn label_circle(mut message: Diagnostic, links: &[(&str, Span)], needs: &str) -> Diagnostic {
    for (idx, (_, span)) in links.iter().enumerate() {
        let next = links[(idx + 1) % links.len()].0;
        message = match (idx, links.len()) {
            (0, 1) => message.at(*span, format!("{needs} itself")),
            (0, _) => message.at(*span, format!("{needs} `{next}`")),
            _ => message.also(*span, format!("{needs} `{next}`")),
        };
    }
    message
}

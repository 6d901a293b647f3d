//! Written expressions to typed ones: names looked up, units converted, dimensions checked.

use super::expression::{Expr, Node, Type};
use super::scope::{BUILT_IN_FUNCTIONS, Locals, Origin, Progress, Scope};
use crate::diagnostic::codes::{D005, D006, D007, D008, D009, U101, U102, U103, U105, U106, U107, U108};
use crate::diagnostic::{Diagnostic, did_you_mean};
use crate::maths::operator::{Binary, Unary};
use crate::source::Span;
use crate::syntax::tree::{self, BinaryOperator, ExprKind, UnaryOperator};
use crate::units::{self, Dimension, Unit, UnitError};

/// Nodes that one expression may have after functions are put in.
const MAX_EXPRESSION_SIZE: u32 = 50_000;

/// What may stand in an expression besides constants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Allow {
    pub position: bool,
    pub time: bool,
    pub species: bool,
}

impl Allow {
    pub(super) const CONSTANT: Self = Self { position: false, time: false, species: false };
    pub(super) const INITIAL: Self = Self { position: true, time: false, species: true };
    pub(super) const REFERENCE: Self = Self { position: true, time: true, species: false };
}

/// The state of checking a scene: names, messages, and the functions being put in.
pub(super) struct Checker<'a> {
    pub scope: Scope<'a>,
    pub diagnostics: Vec<Diagnostic>,
    /// Names of the domain's axes with their index.
    pub axes: Vec<(String, usize)>,
    /// Concentration dimension of each species, as far as known.
    pub species_dimensions: Vec<Option<Dimension>>,
    pub(super) call_stack: Vec<String>,
}

impl<'a> Checker<'a> {
    pub(super) fn report(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// Checks an expression; `None` means that its mistake has been reported.
    pub(super) fn check(&mut self, expr: &'a tree::Expr, allow: Allow) -> Option<Expr> {
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
            self.report(
                Diagnostic::error(D008, "this expression is too large once its functions are put in")
                    .at(expr.span, "grown too large here")
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

    pub(super) fn number(&mut self, number: &tree::Number, span: Span) -> Option<Expr> {
        let unit = match &number.unit {
            None => Unit::ONE,
            Some(written) => match Unit::parse(&written.value) {
                Ok(unit) => unit,
                Err(error) => {
                    self.unknown_unit(&error, number, written.span);
                    return None;
                }
            },
        };
        let Some(value) = unit.to_si(&number.digits) else {
            self.report(
                Diagnostic::error(U106, "this number is too large")
                    .at(span, "beyond 1.8e308 in SI units")
                    .found(number.digits.clone())
                    .expected("a number below 1.8e308"),
            );
            return None;
        };
        if value == 0.0
            && number.digits.bytes().any(|b| (b'1'..=b'9').contains(&mantissa_byte(&number.digits, b)))
        {
            self.report(
                Diagnostic::error(U106, "this number is too small")
                    .at(span, "it would become zero")
                    .found(number.digits.clone())
                    .expected("zero, or a number above 5e-324"),
            );
            return None;
        }
        self.note_unit_that_is_a_name(number, span);
        let kind =
            if number.unit.is_none() && value == 0.0 { Type::Zero } else { Type::Number(unit.dimension) };
        Some(Expr::constant(value, kind, span))
    }

    /// `0.8 /d` is per day even where the scene has a `d`: say so.
    fn note_unit_that_is_a_name(&mut self, number: &tree::Number, span: Span) {
        let Some(name) = number.unit.as_ref().and_then(|unit| unit.value.strip_prefix('/')) else { return };
        let Some(entry) = self.scope.get(name) else { return };
        let (origin, defined) = (entry.origin.describe(), entry.span);
        self.diagnostics.push(
            Diagnostic::remark(
                U107,
                format!("`/{name}` after a number is the unit 1/{name}, not the name `{name}`"),
            )
            .at(span, format!("read as per {name}"))
            .also(defined, format!("`{name}` is {origin} of this scene"))
            .help(format!("for the name write `{} / {name}`, with a blank after the slash", number.digits)),
        );
    }

    fn unknown_unit(&mut self, error: &UnitError, number: &tree::Number, span: Span) {
        let sub = |start: usize, end: usize| {
            let base = span.start as usize;
            Span::new(span.file, base + start, (base + end).min(span.end as usize).max(base + start))
        };
        let mut message = match error {
            UnitError::UnknownSymbol { symbol, start, end } => {
                let mut message = Diagnostic::error(U105, format!("`{symbol}` is not a unit"))
                    .at(sub(*start, *end), "unknown unit")
                    .found(format!("`{symbol}`"))
                    .expected("a unit such as `m`, `d`, `mol/L`");
                let known: Vec<String> = units::known_symbols().collect();
                if let Some(candidate) = did_you_mean(symbol, known.iter().map(String::as_str)) {
                    message = message.help(format!("did you mean `{candidate}`?"));
                }
                message
            }
            UnitError::Malformed { start, end } => Diagnostic::error(U105, "this is not a unit")
                .at(sub(*start, *end), "cannot be read as a unit")
                .found("something else")
                .expected("symbols joined by `/` or `·`, powers as `m^2`"),
            UnitError::ExponentTooLarge { start, end } => {
                Diagnostic::error(U105, "the power of this unit is too large")
                    .at(sub(*start, *end), "beyond 9")
                    .found("a power beyond 9")
                    .expected("a power from -9 to 9")
            }
        };
        let word = number.unit.as_ref().map(|unit| unit.value.as_str()).unwrap_or_default();
        if self.scope.get(word).is_some() || self.axes.iter().any(|(axis, _)| axis == word) || word == "t" {
            message = message.help(format!("to multiply write `{} * {word}`", number.digits));
        }
        self.report(message);
    }

    fn path(&mut self, path: &'a [tree::Name], span: Span, allow: Allow, locals: &Locals) -> Option<Expr> {
        let [name] = path else {
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
        self.report(
            Diagnostic::error(D005, format!("`{text}` cannot be used here"))
                .at(span, format!("{what}, which is not fixed here"))
                .found(what)
                .expected("numbers, constants and parameters"),
        );
        None
    }

    fn named(&mut self, text: &str, span: Span, allow: Allow) -> Option<Expr> {
        let Some(entry) = self.scope.get_mut(text) else {
            if BUILT_IN_FUNCTIONS.contains(&text) {
                self.report(
                    Diagnostic::error(D005, format!("`{text}` cannot be used here"))
                        .at(span, "a built-in function without its arguments")
                        .found("a function")
                        .expected("numbers, constants and parameters"),
                );
            } else {
                self.scope.note_undefined(text, span);
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
                let dimension = self.species_dimensions[idx].unwrap_or(Dimension::MOLAR_CONCENTRATION);
                Some(Expr::leaf(Node::Species(idx), dimension, span))
            }
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
                let span = entry.span;
                entry.progress = Progress::Wrong;
                self.report(
                    Diagnostic::error(D006, format!("`{name}` is defined by itself"))
                        .at(span, "its value needs its own value")
                        .found("a circle of definitions")
                        .expected("definitions that end in numbers"),
                );
                return None;
            }
            Progress::Untouched => entry.progress = Progress::Running,
        }
        let checked = self.check(value, Allow::CONSTANT);
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
        let (op, sign) = match operator {
            Op::Add => (Binary::Add, "+"),
            Op::Subtract => (Binary::Subtract, "-"),
            Op::Multiply => (Binary::Multiply, "*"),
            Op::Divide => (Binary::Divide, "/"),
            Op::Power => return self.power(a, b, span),
            Op::Less => (Binary::Less, "<"),
            Op::LessEqual => (Binary::LessEqual, "<="),
            Op::Greater => (Binary::Greater, ">"),
            Op::GreaterEqual => (Binary::GreaterEqual, ">="),
            Op::Equal => (Binary::Equal, "=="),
            Op::NotEqual => (Binary::NotEqual, "!="),
            Op::And => (Binary::And, "and"),
            Op::Or => (Binary::Or, "or"),
        };
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

    fn mismatch(&mut self, sign: &str, a: &Expr, b: &Expr, span: Span) -> Option<Expr> {
        let verb = match sign {
            "+" => "add",
            "-" => "subtract",
            _ => "compare",
        };
        self.report(
            Diagnostic::error(U101, format!("cannot {verb} values of different dimensions"))
                .at(span, format!("`{sign}` needs the same dimension on both sides"))
                .also(a.span, format!("this is {}", a.kind.describe()))
                .also(b.span, format!("this is {}", b.kind.describe()))
                .found(b.kind.describe())
                .expected(a.kind.describe()),
        );
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

    fn call(
        &mut self,
        function: &'a tree::Name,
        arguments: &'a [tree::Argument],
        span: Span,
        allow: Allow,
        locals: &Locals,
    ) -> Option<Expr> {
        let checked: Vec<Option<Expr>> =
            arguments.iter().map(|argument| self.check_with(&argument.value, allow, locals)).collect();
        let name = function.value.as_str();
        let user = self.scope.get_mut(name).map(|entry| {
            entry.n_uses += 1;
            (entry.origin, entry.span)
        });
        let statement = match user {
            Some((Origin::Function(statement), _)) => Some(statement),
            Some((origin, defined)) => {
                let what = origin.describe();
                self.report(
                    Diagnostic::error(D009, format!("`{name}` is not a function"))
                        .at(function.span, format!("this is {what}"))
                        .also(defined, "defined here")
                        .found(what)
                        .expected("a function"),
                );
                return None;
            }
            None => None,
        };
        if statement.is_none() && !BUILT_IN_FUNCTIONS.contains(&name) {
            self.scope.note_undefined(name, function.span);
            return None;
        }
        if let Some(argument) = arguments.iter().find_map(|argument| argument.name.as_ref()) {
            self.report(
                Diagnostic::error(D007, format!("`{name}` takes its arguments by place"))
                    .at(argument.span, "a named argument")
                    .found(format!("`{} = …`", argument.value))
                    .expected("values only"),
            );
            return None;
        }
        let values: Vec<Expr> = checked.into_iter().collect::<Option<_>>()?;
        match statement {
            Some(statement) => self.user_function(statement, values, function.span, span, allow),
            None => self.built_in(name, values, function.span, span),
        }
    }

    fn user_function(
        &mut self,
        statement: &'a tree::Function,
        values: Vec<Expr>,
        name_span: Span,
        span: Span,
        allow: Allow,
    ) -> Option<Expr> {
        let name = &statement.name.value;
        if !self.has_arguments(name, name_span, statement.parameters.len(), values.len()) {
            return None;
        }
        if self.call_stack.contains(name) {
            self.report(
                Diagnostic::error(D006, format!("function `{name}` calls itself"))
                    .at(name_span, "called from its own body")
                    .also(statement.name.span, "defined here")
                    .found("a function that calls itself")
                    .expected("a function whose body ends in built-in functions"),
            );
            return None;
        }
        let locals: Locals = statement.parameters.iter().map(|p| p.value.clone()).zip(values).collect();
        self.call_stack.push(name.clone());
        let body = self.check_with(&statement.body, allow, &locals);
        self.call_stack.pop();
        body.map(|body| Expr { span, ..body })
    }

    fn has_arguments(&mut self, name: &str, span: Span, expected: usize, found: usize) -> bool {
        if expected == found {
            return true;
        }
        let plural = |n: usize| if n == 1 { "1 argument".to_owned() } else { format!("{n} arguments") };
        self.report(
            Diagnostic::error(D007, format!("`{name}` takes {}", plural(expected)))
                .at(span, format!("called with {}", plural(found)))
                .found(plural(found))
                .expected(plural(expected)),
        );
        false
    }

    fn built_in(&mut self, name: &str, mut values: Vec<Expr>, name_span: Span, span: Span) -> Option<Expr> {
        let unary = match name {
            "exp" => Some(Unary::Exp),
            "ln" => Some(Unary::Ln),
            "log10" => Some(Unary::Log10),
            "tanh" => Some(Unary::Tanh),
            "erf" => Some(Unary::Erf),
            "erfc" => Some(Unary::Erfc),
            "sin" => Some(Unary::Sin),
            "cos" => Some(Unary::Cos),
            "sqrt" => Some(Unary::Sqrt),
            "abs" => Some(Unary::Abs),
            _ => None,
        };
        if unary.is_none() && !["min", "max", "pow"].contains(&name) {
            self.report(
                Diagnostic::error(D005, format!("`{name}` is known in `measure` only"))
                    .at(name_span, "a norm of results")
                    .found(format!("`{name}`"))
                    .expected("a function of numbers"),
            );
            return None;
        }
        if !self.has_arguments(name, name_span, if unary.is_some() { 1 } else { 2 }, values.len()) {
            return None;
        }
        let last = values.pop()?;
        let Some(unary) = unary else { return self.built_in_pair(name, values.pop()?, last, span) };
        let Some(dimension) = last.kind.dimension() else {
            return self.wrong_kind(&format!("`{name}`"), "a number", last.kind, last.span);
        };
        let kind = match unary {
            Unary::Abs => last.kind,
            Unary::Sqrt => match dimension.power(1, 2) {
                Some(root) => Type::Number(root),
                None => return self.wrong_kind("`sqrt`", "a dimension with a root", last.kind, last.span),
            },
            _ if dimension.is_none() => Type::Number(dimension),
            _ => {
                self.report(
                    Diagnostic::error(U102, format!("`{name}` needs a plain number"))
                        .at(last.span, format!("this is {}", last.kind.describe()))
                        .found(last.kind.describe())
                        .expected("a plain number")
                        .help("divide by a scale of the same dimension"),
                );
                return None;
            }
        };
        Some(Expr::unary(unary, last, kind, span))
    }

    fn built_in_pair(&mut self, name: &str, a: Expr, b: Expr, span: Span) -> Option<Expr> {
        if name == "pow" {
            return self.power(a, b, span);
        }
        for side in [&a, &b] {
            if side.kind == Type::Truth {
                return self.wrong_kind(&format!("`{name}`"), "a number", side.kind, side.span);
            }
        }
        let Some(kind) = a.kind.unify(b.kind) else { return self.mismatch(name, &a, &b, span) };
        let operator = if name == "min" { Binary::Minimum } else { Binary::Maximum };
        Some(Expr::binary(operator, a, b, kind, span))
    }
}

/// The byte itself if it stands before an exponent mark, else `0`: `0e5` is zero, not too small.
fn mantissa_byte(digits: &str, byte: u8) -> u8 {
    let mantissa = digits.split(['e', 'E']).next().unwrap_or(digits);
    if mantissa.bytes().any(|b| b == byte) { byte } else { b'0' }
}

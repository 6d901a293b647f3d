//! Calls: functions of the scene put in, built-in functions checked.

use super::check::{Allow, Call, Checker};
use super::expression::{Expr, Type};
use super::results::norm_of;
use super::scope::{BUILT_IN_FUNCTIONS, Locals, Origin};
use crate::catalog::rate;
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{D005, D006, D007, D009, U102, U104};
use crate::maths::operator::{Binary, Unary};
use crate::source::Span;
use crate::syntax::tree;

impl<'a> Checker<'a> {
    pub(super) fn call(
        &mut self,
        function: &'a tree::Name,
        arguments: &'a [tree::Argument],
        span: Span,
        allow: Allow,
        locals: &Locals,
    ) -> Option<Expr> {
        let checked: Vec<Option<Expr>> =
            arguments.iter().map(|argument| self.check_with(&argument.value, allow, locals)).collect();
        if let Some(table) = self.table_of(&function.value) {
            return self.lookup(table, function, arguments, checked, span);
        }
        let name = function.value.as_str();
        let user = self.scope.get_mut(name).map(|entry| {
            entry.n_uses += 1;
            (entry.origin, entry.span)
        });
        let statement = match user {
            Some((Origin::Function(statement), _)) => Some(statement),
            Some(_) if self.scope.is_doubtful(name) => return None,
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
        let item = rate::find(name);
        if statement.is_none() && item.is_none() && !BUILT_IN_FUNCTIONS.contains(&name) {
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
        match (statement, item) {
            // A function of the scene comes before one of the catalogue.
            (Some(statement), _) => self.user_function(statement, values, function.span, span, allow),
            (None, Some(item)) => self.of_catalogue(item, values, function.span, span),
            (None, None) => match norm_of(name) {
                Some(norm) if allow.results => self.norm(norm, function, values, span),
                _ => self.built_in(name, values, function.span, span),
            },
        }
    }

    fn of_catalogue(
        &mut self,
        item: &'static rate::Item,
        values: Vec<Expr>,
        name_span: Span,
        span: Span,
    ) -> Option<Expr> {
        if !self.has_arguments(item.name, name_span, item.arguments.len(), values.len()) {
            return None;
        }
        if let Some(wrong) = values.iter().find(|value| value.kind == Type::Truth) {
            return self.wrong_kind(&format!("`{}`", item.name), "a number", wrong.kind, wrong.span);
        }
        let given = |value: &Expr| match value.kind {
            Type::Number(dimension) => Some(dimension),
            Type::Zero | Type::Truth => None,
        };
        let dimensions: Vec<_> = values.iter().map(given).collect();
        let dimension = match (item.dimension)(&dimensions) {
            Ok(dimension) => dimension,
            Err(mismatch) => {
                let wrong = &values[mismatch.argument];
                let (argument, meaning) = item.arguments[mismatch.argument];
                self.report(
                    Diagnostic::error(
                        U104,
                        format!("`{argument}` of `{}` has the wrong dimension", item.name),
                    )
                    .at(wrong.span, format!("this is {}", wrong.kind.describe()))
                    .found(wrong.kind.describe())
                    .expected(mismatch.expected.describe())
                    .note(format!("`{argument}` is the {meaning}")),
                );
                return None;
            }
        };
        self.are_within_bounds(item, &values)?;
        let kind = Type::Number(dimension);
        let built = item.follow(
            &values,
            |value| Expr::constant(value, kind, span),
            |operator, a| Expr::unary(operator, a, kind, span),
            |operator, a, b| Expr::binary(operator, a, b, kind, span),
        )?;
        Some(Expr { span, kind, ..built })
    }

    /// Whether constants are what the arguments of a function may be.
    fn are_within_bounds(&mut self, item: &rate::Item, values: &[Expr]) -> Option<()> {
        for (argument, bound) in item.bounds {
            let Some(value) = values[*argument].value() else { continue };
            let what = format!("`{}` of `{}`", item.arguments[*argument].0, item.name);
            let of = &values[*argument];
            let found = self.shown(value, of.kind.dimension().unwrap_or_default(), of.span);
            self.require(bound.allows(value), &what, found, bound.words(), values[*argument].span)?;
        }
        Some(())
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
        if let Some(first) = self.call_stack.iter().position(|call| call.function == *name) {
            let mut message = Diagnostic::error(D006, format!("function `{name}` calls itself"));
            let links = &self.call_stack[first..];
            message = if links.len() == 1 {
                message.at(name_span, "called from its own body")
            } else {
                message.at(name_span, format!("calls `{name}` again"))
            };
            message = message.also(statement.name.span, "defined here");
            for link in &links[1..] {
                message = message.also(link.name_span, format!("calls `{}`", link.function));
            }
            self.report(
                message
                    .found("a function that calls itself")
                    .expected("a function whose body ends in built-in functions"),
            );
            return None;
        }
        let locals: Locals = statement.parameters.iter().map(|p| p.value.clone()).zip(values).collect();
        self.call_stack.push(Call { function: name.clone(), name_span, span });
        let body = self.check_with(&statement.body, allow, &locals);
        self.call_stack.pop();
        body.map(|body| Expr { span, ..body })
    }

    pub(super) fn has_arguments(&mut self, name: &str, span: Span, expected: usize, found: usize) -> bool {
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

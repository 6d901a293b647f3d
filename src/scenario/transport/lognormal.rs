//! `lognormal(geometric_mean = …, variance = …, covariance = exponential(…))`.
//!
//! Owns the arguments of a random field. May use the scenario's slots. It deliberately draws nothing.

use super::super::check::Checker;
use super::super::choice::COVARIANCES;
use super::super::slot::Value;
use super::Conductivity;
use crate::diagnostic::codes::{D007, D009, M001, M004};
use crate::diagnostic::{Diagnostic, did_you_mean, precise};
use crate::scenario::Covariance;
use crate::syntax::tree::{self, Argument, ExprKind, Name};
use crate::units::Dimension;

const NAMES: [&str; 4] = ["geometric_mean", "variance", "covariance", "seed"];

pub fn lognormal<'a>(
    checker: &mut Checker<'a>,
    function: &'a Name,
    arguments: &'a [Argument],
) -> Option<Conductivity> {
    let mut found: [Option<&'a tree::Expr>; 4] = [None; 4];
    let mut is_right = true;
    for argument in arguments {
        is_right &= place(checker, argument, &mut found);
    }
    if !is_right {
        return None;
    }
    for (name, argument) in NAMES.iter().zip(&found).take(3) {
        if argument.is_none() {
            checker.report(
                Diagnostic::error(M001, format!("`lognormal` has no `{name}`"))
                    .at(function.span, format!("`{name}` is missing"))
                    .found(format!("no `{name}`"))
                    .expected("`geometric_mean`, `variance` and `covariance`; `seed` may be left out"),
            );
            is_right = false;
        }
    }
    let mean = found[0].and_then(|it| positive(checker, it, "the geometric mean", Dimension::VELOCITY));
    let variance = found[1].and_then(|it| {
        let value = checker.slot(it, "the variance of ln K", Dimension::NONE)?;
        checker.require(
            value.value >= 0.0,
            "the variance of ln K",
            precise(value.value),
            "zero or more",
            value.span,
        )?;
        Some(value.value)
    });
    let covariance = found[2].and_then(|it| covariance(checker, it));
    let seed = match found[3] {
        Some(written) => Some(seed(checker, written)?),
        None => None,
    };
    is_right.then_some(())?;
    let (covariance, lengths) = covariance?;
    Some(Conductivity::Lognormal {
        geometric_mean: mean?.value,
        variance: variance?,
        covariance,
        lengths,
        seed,
    })
}

fn place<'a>(
    checker: &mut Checker<'a>,
    argument: &'a Argument,
    found: &mut [Option<&'a tree::Expr>; 4],
) -> bool {
    let Some(name) = &argument.name else {
        checker.report(
            Diagnostic::error(D007, "`lognormal` takes its arguments by name")
                .at(argument.value.span, "an argument without a name")
                .found("a value")
                .expected("`geometric_mean = …`, `variance = …`, `covariance = …`"),
        );
        return false;
    };
    let Some(idx) = NAMES.iter().position(|known| *known == name.value) else {
        let mut message = Diagnostic::error(D007, format!("`lognormal` has no argument `{}`", name.value))
            .at(name.span, "not known here")
            .found(format!("`{}`", name.value))
            .expected("`geometric_mean`, `variance`, `covariance`, `seed`");
        if let Some(meant) = did_you_mean(&name.value, NAMES) {
            message = message.help(format!("did you mean `{meant}`?"));
        }
        checker.report(message);
        return false;
    };
    if let Some(first) = found[idx] {
        checker.report(
            Diagnostic::error(D007, format!("`{}` is given twice", name.value))
                .at(name.span, "here again")
                .also(first.span, "first here")
                .found("one argument twice")
                .expected("each argument once"),
        );
        return false;
    }
    found[idx] = Some(&argument.value);
    true
}

fn positive<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Expr,
    what: &str,
    dimension: Dimension,
) -> Option<Value> {
    let value = checker.slot(written, what, dimension)?;
    let found = format!("{} {}", precise(value.value), dimension.unit_text());
    checker.require(value.value > 0.0, what, found, "above zero", value.span)?;
    Some(value)
}

/// `exponential(10 m, 5 m)`: a correlation length for each axis, or one for all.
fn covariance<'a>(checker: &mut Checker<'a>, written: &'a tree::Expr) -> Option<(Covariance, Vec<f64>)> {
    let ExprKind::Call { function, arguments } = &written.kind else {
        let mut message = Diagnostic::error(M004, "this is no covariance")
            .at(written.span, "not a covariance with its lengths")
            .found("a value")
            .expected("`exponential(10 m, 5 m)` or `gaussian(10 m, 5 m)`");
        if let ExprKind::Path(path) = &written.kind
            && let [name] = path.as_slice()
            && COVARIANCES.iter().any(|(word, _)| *word == name.value)
        {
            message = message.help("its correlation lengths stand in brackets after it");
        }
        checker.report(message);
        return None;
    };
    let kind = checker.word(function, "a covariance", COVARIANCES)?;
    let n_axes = checker.axes.len();
    if arguments.len() != n_axes && arguments.len() != 1 {
        checker.report(
            Diagnostic::error(
                D009,
                "a covariance has a correlation length for each axis of the domain, or one for all",
            )
            .at(function.span, format!("{} lengths here", arguments.len()))
            .found(format!("{} lengths", arguments.len()))
            .expected(if n_axes == 1 {
                "1 length".to_owned()
            } else {
                format!("{n_axes} lengths, or 1")
            }),
        );
        return None;
    }
    let mut lengths = Vec::new();
    for argument in arguments {
        if let Some(name) = &argument.name {
            checker.report(
                Diagnostic::error(D007, format!("`{}` takes its lengths by place", function.value))
                    .at(name.span, "a named argument")
                    .found(format!("`{} = …`", name.value))
                    .expected("lengths only"),
            );
            return None;
        }
        lengths.push(positive(checker, &argument.value, "a correlation length", Dimension::LENGTH)?.value);
    }
    let first = *lengths.first()?;
    lengths.resize(n_axes, first);
    Some((kind, lengths))
}

fn seed<'a>(checker: &mut Checker<'a>, written: &'a tree::Expr) -> Option<u64> {
    let value = checker.slot(written, "the seed of the field", Dimension::NONE)?;
    // Beyond this not every whole number is one of 64-bit arithmetic.
    let is_right = value.value.fract() == 0.0 && (0.0..=9_007_199_254_740_992.0).contains(&value.value);
    checker.require(
        is_right,
        "the seed of the field",
        precise(value.value),
        "a whole number from 0 to 2^53",
        value.span,
    )?;
    Some(value.value as u64)
}

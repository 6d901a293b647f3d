//! Constants of reactions in equilibrium: their one argument, its dimension and range.
//!
//! Owns these messages. May use the scenario's types. It deliberately solves nothing: whether reactions fit
//! each other, the plan finds out.

use super::check::{Allow, Checker};
use super::expression::{Expr, Type};
use super::rates::{Equation, concentration};
use crate::diagnostic::codes::{D007, M009, U103, U104};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::Span;
use crate::syntax::tree;
use crate::units::Dimension;

/// `equilibrium(K = …)`: the constant in (mol/m³)^Δν.
pub(super) fn equilibrium<'a>(
    checker: &mut Checker<'a>,
    span: Span,
    arguments: &'a [tree::Argument],
    equation: Equation<'_>,
) -> Option<f64> {
    let [argument] = arguments else {
        checker.report(
            Diagnostic::error(D007, "`equilibrium` takes 1 argument")
                .at(span, format!("{} here", arguments.len()))
                .found(format!("{} arguments", arguments.len()))
                .expected("one constant")
                .help("write for example `equilibrium(K = 1e-6 mol/L)`, with the unit of K"),
        );
        return None;
    };
    if let Some(name) = argument.name.as_ref().filter(|name| name.value != "K") {
        checker.report(
            Diagnostic::error(D007, format!("`equilibrium` has no argument `{}`", name.value))
                .at(name.span, "not an argument of it")
                .found(format!("`{}`", name.value))
                .expected("`K`")
                .help("write `equilibrium(K = …)`"),
        );
        return None;
    }
    if concentration(checker, equation)? == Dimension::MASS_CONCENTRATION {
        checker.report(
            Diagnostic::error(M009, "a reaction in equilibrium is in amounts, not in masses")
                .at(equation.span, "its species are mass concentrations")
                .found(Dimension::MASS_CONCENTRATION.describe())
                .expected(Dimension::MOLAR_CONCENTRATION.describe())
                .help("give the initial concentrations in mol/L"),
        );
        return None;
    }
    let dissolved = |side: &[(usize, f64)]| -> f64 {
        let counted = side.iter().filter(|(species, _)| !equation.is_mineral[*species]);
        counted.map(|(_, nu)| nu).sum()
    };
    let power = dissolved(equation.products) - dissolved(equation.reactants);
    let checked = checker.check(&argument.value, Allow::CONSTANT)?;
    let value = checked.value()?;
    match Dimension::MOLAR_CONCENTRATION.power_f64(power) {
        Some(dimension) if checked.kind == Type::Number(dimension) => {}
        expected => {
            report_constant_of_equilibrium(checker, argument, &checked, equation, (power, expected));
            return None;
        }
    }
    let dimension = checked.kind.dimension().unwrap_or_default();
    let found = checker.shown(value, dimension, argument.value.span);
    checker.require(value > 0.0, "an equilibrium constant", found, "above zero", argument.value.span)?;
    Some(value)
}

fn report_constant_of_equilibrium<'a>(
    checker: &mut Checker<'a>,
    argument: &'a tree::Argument,
    checked: &Expr,
    equation: Equation<'_>,
    (power, expected): (f64, Option<Dimension>),
) {
    let Some(expected) = expected else {
        checker.report(
            Diagnostic::error(U103, "the dimension of this constant is not a simple fraction")
                .at(argument.value.span, format!("(mol/L)^{}", precise(power)))
                .found(format!("the power {}", precise(power)))
                .expected("coefficients whose sum is a whole sixtieth"),
        );
        return;
    };
    let found = checked.kind.describe();
    let unit = match power {
        0.0 => "no unit".to_owned(),
        _ if power > 0.0 => format!("`{}`", per("mol", "L", power)),
        _ => format!("`{}`", per("L", "mol", -power)),
    };
    let mut message = Diagnostic::error(
        U104,
        format!("the equilibrium constant of `{}` has the wrong dimension", equation.name),
    )
    .at(argument.value.span, format!("this is {found}"))
    .found(found)
    .expected(expected.describe())
    .help(format!("K is products over reactants, without minerals: it has {unit}"));
    for (name, span, kind) in checker.constants_in(&argument.value) {
        message = message.also(span, format!("`{name}` is set here: {}", kind.describe()));
    }
    checker.report(message);
}

fn per(above: &str, below: &str, power: f64) -> String {
    if power == 1.0 {
        return format!("{above}/{below}");
    }
    let power = precise(power);
    format!("{above}^{power}/{below}^{power}")
}

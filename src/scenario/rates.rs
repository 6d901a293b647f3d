//! What stands after the `@` of a reaction: instant, equilibrium, mass action or a law.
//!
//! Owns the choice among these and their dimensions. May use the scenario's types. It deliberately looks at
//! one reaction: what reactions do to each other is told beside it.

use super::Rate;
use super::check::{Allow, Checker};
use super::expression::{Expr, Node, Type};
use crate::diagnostic::codes::{D005, M001, M002, M010, M011, U104};
use crate::diagnostic::{Diagnostic, did_you_mean, precise};
use crate::source::Span;
use crate::syntax::tree::{self, ExprKind};
use crate::units::Dimension;

/// A reaction whose sides are known and whose rate is not.
#[derive(Clone, Copy)]
pub(super) struct Equation<'e> {
    pub name: &'e str,
    pub span: Span,
    /// `(species, ν > 0)`
    pub reactants: &'e [(usize, f64)],
    pub products: &'e [(usize, f64)],
    pub is_mineral: &'e [bool],
    pub names: &'e [&'e str],
}

impl Equation<'_> {
    fn backward(self) -> Self {
        Self { reactants: self.products, products: self.reactants, ..self }
    }
}

/// A rate with its place; there are two of them for forward and backward.
pub(super) type Placed = (Rate, Span);

pub(super) fn rates<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Reaction,
    equation: Equation<'_>,
) -> Option<Vec<Placed>> {
    let one = match &written.rate {
        tree::Rate::Directions(fields) => return directions(checker, written, fields, equation),
        tree::Rate::One(one) => one,
    };
    if is_word(one, "instant") {
        if written.arrow.value == tree::Arrow::Both {
            checker.report(
                Diagnostic::error(M011, "an instant reaction goes one way")
                    .at(written.arrow.span, "this is a reversible reaction")
                    .found("`<->`")
                    .expected("`->`")
                    .help("what is always at its balance is `@ equilibrium(K = …)`"),
            );
            return None;
        }
        return Some(vec![(Rate::Instant, one.span)]);
    }
    if let ExprKind::Call { function, arguments } = &one.kind
        && function.value == "equilibrium"
    {
        let constant = super::equilibrium::equilibrium(checker, one.span, arguments, equation)?;
        return Some(vec![(Rate::Equilibrium(constant), one.span)]);
    }
    if written.arrow.value == tree::Arrow::Both {
        note_uses(checker, one);
        checker.report(
            Diagnostic::error(M011, "a reversible reaction has two rates")
                .at(one.span, "one rate")
                .also(written.arrow.span, "this goes both ways")
                .found("one rate")
                .expected("`forward` and `backward` rates, or `equilibrium(…)`")
                .help("write `@ forward kf, backward kb`, or `->` for one way"),
        );
        return None;
    }
    if let Some(message) = misspelt_kind(checker, one) {
        checker.report(message);
        return None;
    }
    Some(vec![(rate(checker, one, equation)?, one.span)])
}

fn is_word(expr: &tree::Expr, word: &str) -> bool {
    matches!(&expr.kind, ExprKind::Path(path) if path.len() == 1 && path[0].value == word)
}

/// `@ instnt`, `@ equilibrum(K)`: close to a word of the language, and no name of the scene.
fn misspelt_kind(checker: &Checker<'_>, expr: &tree::Expr) -> Option<Diagnostic> {
    let (name, word) = match &expr.kind {
        ExprKind::Path(path) if path.len() == 1 => (&path[0], "instant"),
        ExprKind::Call { function, .. } => (function, "equilibrium"),
        _ => return None,
    };
    let is_known = checker.scope.get(&name.value).is_some() || is_function(&name.value);
    if is_known || did_you_mean(&name.value, [word]).is_none() {
        return None;
    }
    let message = Diagnostic::error(M011, format!("`{}` is no rate", name.value))
        .at(name.span, "not known here")
        .found(format!("`{}`", name.value))
        .expected("`instant`, `equilibrium(…)`, a rate constant or a rate law")
        .help(format!("did you mean `{word}`?"));
    Some(message)
}

fn is_function(name: &str) -> bool {
    super::scope::BUILT_IN_FUNCTIONS.contains(&name) || crate::catalog::rate::find(name).is_some()
}

/// What a rate names is used, so that nothing is said of it besides.
fn note_uses(checker: &mut Checker<'_>, expr: &tree::Expr) {
    let mut names = Vec::new();
    super::slot::collect_names(expr, &mut names);
    for name in &names {
        if let Some(entry) = checker.scope.get_mut(name) {
            entry.n_uses += 1;
        }
    }
}

/// Looks the names of a rate up where its equation is wrong.
pub(super) fn look_at_names(checker: &mut Checker<'_>, rate: &tree::Rate) {
    match rate {
        tree::Rate::One(rate) => note_uses(checker, rate),
        tree::Rate::Directions(fields) => fields.iter().for_each(|field| note_uses(checker, &field.value)),
    }
}

fn directions<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Reaction,
    fields: &'a [tree::Field],
    equation: Equation<'_>,
) -> Option<Vec<Placed>> {
    let find = |word: &str| fields.iter().find(|field| field.name.value == word);
    for field in fields {
        let first = find(&field.name.value)?;
        if !std::ptr::eq(first, field) {
            checker.report(
                Diagnostic::error(M002, format!("a second `{}` rate", field.name.value))
                    .at(field.name.span, "here again")
                    .also(first.name.span, "first here")
                    .found(format!("`{}` twice", field.name.value))
                    .expected("one `forward` and one `backward`"),
            );
            return None;
        }
    }
    if written.arrow.value == tree::Arrow::Forward {
        fields.iter().for_each(|field| note_uses(checker, &field.value));
        checker.report(
            Diagnostic::error(M011, "this reaction goes one way")
                .at(written.arrow.span, "one way")
                .also(fields[0].name.span, "a rate of a reversible reaction")
                .found("`->`")
                .expected("`<->`")
                .help("write `<->`, or the rate without `forward`"),
        );
        return None;
    }
    let (Some(forward), Some(backward)) = (find("forward"), find("backward")) else {
        fields.iter().for_each(|field| note_uses(checker, &field.value));
        let (has, lacks) = match find("forward") {
            Some(_) => ("forward", "backward"),
            None => ("backward", "forward"),
        };
        checker.report(
            Diagnostic::error(M011, "a reversible reaction has two rates")
                .at(fields[0].name.span.to(fields[0].value.span), format!("only `{has}`"))
                .also(written.arrow.span, "this goes both ways")
                .found(format!("no `{lacks}`"))
                .expected(format!("`, {lacks}` and a rate")),
        );
        return None;
    };
    let rates = [
        rate(checker, &forward.value, equation).map(|rate| (rate, forward.value.span)),
        rate(checker, &backward.value, equation.backward()).map(|rate| (rate, backward.value.span)),
    ];
    rates.into_iter().collect()
}

/// The dimension of all concentrations of a reaction; `None` if a mistake hides it.
pub(super) fn concentration(checker: &mut Checker<'_>, equation: Equation<'_>) -> Option<Dimension> {
    let first = equation.reactants.iter().chain(equation.products).next();
    first.and_then(|(species, _)| checker.concentration_of(*species))
}

/// Mass action or a law, by what the expression names and by its dimension.
fn rate<'a>(checker: &mut Checker<'a>, written: &'a tree::Expr, equation: Equation<'_>) -> Option<Rate> {
    let checked = checker.check(written, Allow::RATE)?;
    let own = concentration(checker, equation)?;
    let of_law = own.over(Dimension::TIME);
    let dimension = match checked.kind {
        Type::Zero => return Some(Rate::MassAction(checked)),
        Type::Number(dimension) => dimension,
        Type::Truth => {
            let what = format!("the rate of `{}`", equation.name);
            checker.expect_dimension(written, &checked, &what, &[of_law]);
            return None;
        }
    };
    if let Some(value) = checked.value()
        && value < 0.0
    {
        let found = checker.shown(value, dimension, written.span);
        checker.require(false, "a rate", found, "zero or more", written.span)?;
    }
    if checked.names_species() {
        if dimension == of_law {
            return Some(Rate::Law(checked));
        }
        report_law(checker, written, &checked, equation, own);
        return None;
    }
    let order: f64 = equation.reactants.iter().map(|(_, nu)| nu).sum();
    let of_constant = constant_of_order(own, order);
    if of_constant == Some(dimension) {
        return Some(Rate::MassAction(checked));
    }
    if dimension == of_law {
        return Some(Rate::Law(checked));
    }
    report_constant(checker, written, &checked, equation, own);
    None
}

/// The dimension of k in `r = k c^order`.
fn constant_of_order(concentration: Dimension, order: f64) -> Option<Dimension> {
    Some(concentration.power_f64(1.0 - order)?.over(Dimension::TIME))
}

/// A law with the wrong dimension: what it lacks.
fn report_law<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Expr,
    checked: &Expr,
    equation: Equation<'_>,
    own: Dimension,
) {
    let found = checked.kind.dimension().unwrap_or_default();
    let lacking = own.over(Dimension::TIME).over(found);
    let mut named = Vec::new();
    checked.walk(&mut |expr| {
        if let Node::Species(species) = expr.node {
            named.push(species);
        }
    });
    let mut members = equation.reactants.iter().chain(equation.products).map(|(species, _)| *species);
    let first = members.clone().next();
    let missing = members.find(|species| !named.contains(species)).or(first);
    let name = missing.map_or("A", |species| equation.names[species]);
    let help = if lacking == own {
        format!("multiply by a concentration, for example `… * {name}`")
    } else if lacking == Dimension::RATE {
        "multiply by a rate in 1/time, for example `0.1 /d * …`".to_owned()
    } else {
        format!("multiply by something in {}", shown(lacking))
    };
    report_wrong(checker, written, checked, equation, vec![own.over(Dimension::TIME).describe()], help, None);
}

fn shown(dimension: Dimension) -> String {
    if dimension.is_none() { "no unit".to_owned() } else { format!("`{}`", dimension.unit_text()) }
}

/// A rate constant with the wrong dimension: the unit of the right one.
fn report_constant<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Expr,
    checked: &Expr,
    equation: Equation<'_>,
    own: Dimension,
) {
    let order: f64 = equation.reactants.iter().map(|(_, nu)| nu).sum();
    let of_law = own.over(Dimension::TIME);
    let mut expected = Vec::new();
    let help = match constant_of_order(own, order) {
        Some(dimension) => {
            expected.push(dimension.describe());
            let unit = unit_of_order(own, order);
            format!("a rate constant of order {} has a unit such as `{unit}`", precise(order))
        }
        None => format!("an order of {} has no rate constant with a unit: write the law", precise(order)),
    };
    if dimension_differs(&expected, of_law) {
        expected.push(of_law.describe());
    }
    let found = checked.kind.dimension();
    let fitting = (0..=4).map(f64::from).find(|&other| constant_of_order(own, other) == found);
    let note = fitting.map(|other| format!("this is a rate constant of order {}", precise(other)));
    report_wrong(checker, written, checked, equation, expected, help, note);
}

fn dimension_differs(expected: &[String], other: Dimension) -> bool {
    !expected.contains(&other.describe())
}

/// `/s`, `L/mol/s`, `L^2/mol^2/s`, or with milligrams.
fn unit_of_order(concentration: Dimension, order: f64) -> String {
    let amount = if concentration == Dimension::MASS_CONCENTRATION { "mg" } else { "mol" };
    let power = |symbol: &str, exponent: f64| match exponent {
        1.0 => symbol.to_owned(),
        _ => format!("{symbol}^{}", precise(exponent)),
    };
    match order {
        1.0 => "/s".to_owned(),
        _ if order < 1.0 => {
            format!("{}/{}/s", power(amount, 1.0 - order), power("L", 1.0 - order))
        }
        _ => format!("{}/{}/s", power("L", order - 1.0), power(amount, order - 1.0)),
    }
}

fn report_wrong<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Expr,
    checked: &Expr,
    equation: Equation<'_>,
    expected: Vec<String>,
    help: String,
    note: Option<String>,
) {
    let found = checked.kind.describe();
    let mut message =
        Diagnostic::error(U104, format!("the rate of `{}` has the wrong dimension", equation.name))
            .at(written.span, format!("this is {found}"))
            .found(found)
            .expected(expected.join(", or a law in "))
            .help(help);
    if let Some(note) = note {
        message = message.note(note);
    }
    for (name, span, kind) in checker.constants_in(written) {
        message = message.also(span, format!("`{name}` is set here: {}", kind.describe()));
    }
    checker.report(message);
}

/// A reaction has something that reacts, or something that it makes.
pub(super) fn check_sides(checker: &mut Checker<'_>, written: &tree::Reaction, span: Span) -> Option<()> {
    if !written.reactants.is_empty() || !written.products.is_empty() {
        return Some(());
    }
    if let tree::Rate::One(rate) = &written.rate {
        note_uses(checker, rate);
    }
    checker.report(
        Diagnostic::error(M001, "this reaction has no species")
            .at(span, "nothing on either side")
            .found("no species")
            .expected("a reactant or a product"),
    );
    None
}

/// An instant reaction needs two different reactants.
pub(super) fn check_instant(checker: &mut Checker<'_>, equation: Equation<'_>) -> Option<()> {
    if equation.reactants.len() >= 2 {
        return Some(());
    }
    checker.report(
        Diagnostic::error(M010, format!("`{}` cannot be instant", equation.name))
            .at(equation.span, "an instant reaction of one species would leave nothing of it")
            .found(format!("{} reacting species", equation.reactants.len()))
            .expected("two or more different reactants"),
    );
    None
}

/// Coefficients above zero.
pub(super) fn coefficient<'a>(checker: &mut Checker<'a>, term: &'a tree::Term) -> Option<f64> {
    let Some(written) = &term.coefficient else { return Some(1.0) };
    let what = "a stoichiometric coefficient";
    if let ExprKind::Path(path) = &written.kind
        && let Some(super::scope::Origin::Species(_)) =
            checker.scope.get(&path[0].value).map(|entry| entry.origin)
    {
        let (first, second) = (&path[0].value, &term.species.value);
        if let Some(entry) = checker.scope.get_mut(first) {
            entry.n_uses += 1;
        }
        checker.report(
            Diagnostic::error(D005, format!("`{first}` is a species and no coefficient"))
                .at(written.span.to(term.species.span), "two species without a sign between them")
                .found("two species")
                .expected("`+` between species, or a number before one")
                .help(format!("write `{first} + {second}`")),
        );
        return None;
    }
    let value = checker.slot(written, what, Dimension::NONE)?;
    let is_fine = value.value > 0.0 && value.value.is_finite();
    checker.require(is_fine, what, precise(value.value), "above zero", value.span)?;
    Some(value.value)
}

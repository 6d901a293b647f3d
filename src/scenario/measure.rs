//! Measures: numbers computed from results, references and what a run knows of itself.

use super::check::{Allow, Checker};
use super::collect::Statements;
use super::expression::Type;
use super::model::species_index;
use super::observe::{OUTPUTS, time_list};
use super::places::{Places, Results, place_of};
use super::restriction::check_restrictions;
use super::scope::THE_REFERENCE;
use super::{Domain, Measure, Output, OutputKind, Reference};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{D004, D007, M015, U101, U103, U108};
use crate::maths::operator::{Binary, Unary};
use crate::source::Span;
use crate::syntax::tree::{self, BinaryOperator, ExprKind, UnaryOperator};
use crate::units::Dimension;
use serde::{Deserialize, Serialize};

/// An expression whose value is one number.
#[derive(Debug, Clone, PartialEq)]
pub enum Scalar {
    Number(f64),
    Fact(Fact),
    /// On the bins and times of an output of the scenario, given by its index.
    Norm(Norm, usize, Box<Field>),
    Unary(Unary, Box<Scalar>),
    Binary(Binary, Box<Scalar>, Box<Scalar>),
}

/// What a run knows of itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Fact {
    /// Wall seconds of the engine.
    WallTime,
    CpuTime,
    /// Largest relative mass defect of any component.
    MassDefect,
    Particles,
    Steps,
}

/// From a field (bins × times, or times) to a number. Sums over space are integrals with the bin
/// widths; over times they are plain sums (norms) or means (integral, mean).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Norm {
    /// Σ_t ∫ |f| dx
    L1,
    /// (Σ_t ∫ f² dx)^½
    L2,
    /// max |f|
    LInf,
    /// (mean of f² over bins and times)^½
    Rmse,
    /// mean over t of ∫ f dx
    Integral,
    /// mean over bins and times
    Mean,
    Minimum,
    Maximum,
}

/// An expression whose value is a field over the bins and times of one output.
#[derive(Debug, Clone, PartialEq)]
pub enum Field {
    Number(f64),
    /// Centre of the bin along axis 0, 1, 2 for x, y, z.
    Position(usize),
    Output(OutputKind, FieldTarget),
    Reference(usize),
    Unary(Unary, Box<Field>),
    Binary(Binary, Box<Field>, Box<Field>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldTarget {
    Species(usize),
    Pair(usize, usize),
}

const FACTS: &[(&str, Fact, Dimension)] = &[
    ("wall_time", Fact::WallTime, Dimension::TIME),
    ("cpu_time", Fact::CpuTime, Dimension::TIME),
    ("mass_defect", Fact::MassDefect, Dimension::NONE),
    ("particles", Fact::Particles, Dimension::NONE),
    ("steps", Fact::Steps, Dimension::NONE),
];

pub(super) const NORMS: &[(&str, Norm)] = &[
    ("l1", Norm::L1),
    ("l2", Norm::L2),
    ("linf", Norm::LInf),
    ("rmse", Norm::Rmse),
    ("integral", Norm::Integral),
    ("mean", Norm::Mean),
    ("minimum", Norm::Minimum),
    ("maximum", Norm::Maximum),
];

/// A checked part of a measure.
enum Part {
    Scalar(Scalar, Type),
    /// A field and the outputs on whose bins and times it can live.
    Field(Field, Type, Places),
}

impl Part {
    fn kind(&self) -> Type {
        match self {
            Part::Scalar(_, kind) | Part::Field(_, kind, _) => *kind,
        }
    }
}

pub(super) fn measures<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    outputs: &[Output],
    references: &[Reference],
    duration: Option<f64>,
    domain: Option<&Domain>,
) -> (Vec<Measure>, bool) {
    let are_whole =
        outputs.len() == statements.outputs.len() && references.len() == statements.references.len();
    let mut list = Vec::new();
    for (span, written) in &statements.measures {
        let results = Results { outputs, references, are_whole, times: None, decided: Vec::new() };
        list.extend(measure(checker, results, *span, written, duration, domain));
    }
    let is_right = list.len() == statements.measures.len();
    (list, is_right)
}

fn measure<'a>(
    checker: &mut Checker<'a>,
    mut results: Results<'_>,
    span: Span,
    written: &'a tree::Measure,
    duration: Option<f64>,
    domain: Option<&Domain>,
) -> Option<Measure> {
    let times = match &written.times {
        None => Some(None),
        Some(list) => time_list(checker, list, duration).map(Some),
    };
    results.times = times.clone().flatten();
    results.decide(&written.value, &checker.scope);
    let part = part(checker, &results, &written.value);
    let over = match &written.over {
        None => Some(None),
        Some(axis) => over(checker, axis).map(Some),
    };
    let (value, dimension) = match part? {
        Part::Scalar(value, kind) => (value, kind.dimension()?),
        Part::Field(..) => {
            checker.report(
                Diagnostic::error(U108, "a measure is one number")
                    .at(written.value.span, "a value for every bin and time")
                    .found("a field")
                    .expected("a norm of it, such as `l2(…)` or `integral(…)`"),
            );
            return None;
        }
    };
    let over = over?;
    check_restrictions(checker, &results, written, &value, over, domain)?;
    Some(Measure {
        name: written.name.value.clone(),
        span,
        value,
        over,
        times: times?,
        dimension,
        doc: written.doc.as_ref().map(|doc| doc.value.clone()),
    })
}

fn over<'a>(checker: &mut Checker<'a>, axis: &'a tree::Axis) -> Option<(usize, f64, f64)> {
    let words: Vec<(String, usize)> = checker.axes.clone();
    let words: Vec<(&str, usize)> = words.iter().map(|(name, index)| (name.as_str(), *index)).collect();
    let index = checker.word(&axis.name, "an axis of the domain", &words);
    let (low, high, _) = checker.range(&axis.range, "the range of a measure", Some(Dimension::LENGTH))?;
    Some((index?, low.value, high.value))
}

fn part<'a>(checker: &mut Checker<'a>, results: &Results<'_>, expr: &'a tree::Expr) -> Option<Part> {
    match &expr.kind {
        ExprKind::Path(path) => path_part(checker, results, path, expr),
        ExprKind::Call { function, arguments } => call_part(checker, results, function, arguments, expr),
        ExprKind::Unary { operator, operand } if operator.value == UnaryOperator::Negate => {
            let operand = part(checker, results, operand)?;
            Some(apply_unary(Unary::Negate, operand))
        }
        ExprKind::Binary { operator, left, right } => {
            let left_part = part(checker, results, left);
            let right_part = part(checker, results, right);
            binary_part(checker, operator.value, left_part?, right_part?, expr)
        }
        _ => constant(checker, expr),
    }
}

fn constant<'a>(checker: &mut Checker<'a>, expr: &'a tree::Expr) -> Option<Part> {
    let checked = checker.check(expr, Allow::CONSTANT)?;
    if checked.kind == Type::Truth {
        checker.wrong_kind("a measure", "a number", checked.kind, expr.span);
        return None;
    }
    Some(Part::Scalar(Scalar::Number(checked.value()?), checked.kind))
}

fn path_part<'a>(
    checker: &mut Checker<'a>,
    results: &Results<'_>,
    path: &'a [tree::Name],
    expr: &'a tree::Expr,
) -> Option<Part> {
    if let [name] = path {
        if let Some((_, fact, dimension)) = FACTS.iter().find(|(word, ..)| *word == name.value)
            && checker.scope.get(&name.value).is_none()
        {
            return Some(Part::Scalar(Scalar::Fact(*fact), Type::Number(*dimension)));
        }
        if let Some(&(_, index)) = checker.axes.iter().find(|(axis, _)| *axis == name.value) {
            return Some(Part::Field(
                Field::Position(index),
                Type::Number(Dimension::LENGTH),
                Places::default(),
            ));
        }
        if let Some(idx) = checker.scope.reference(&name.value) {
            if let Some(entry) = checker.scope.get_mut(&name.value) {
                entry.n_uses += 1;
            }
            return reference_part(checker, results, idx, expr);
        }
        if name.value == THE_REFERENCE && checker.scope.get(THE_REFERENCE).is_none() {
            report_no_only_reference(checker, name.span);
            return None;
        }
        return constant(checker, expr);
    }
    let kind = checker.word(&path[0], "an output", OUTPUTS)?;
    let species: Vec<Option<usize>> = path[1..].iter().map(|name| species_index(checker, name)).collect();
    let species: Vec<usize> = species.into_iter().collect::<Option<_>>()?;
    let target = FieldTarget::of(kind, &species);
    let places = target.map(|target| results.of_output(kind, target)).unwrap_or_default();
    let Some(&output) = places.candidates().first() else {
        if results.are_whole {
            let words: Vec<&str> = path.iter().map(|name| name.value.as_str()).collect();
            checker.report(
                Diagnostic::error(M015, "no output of the scene gives this")
                    .at(expr.span, "not an output")
                    .found(format!("`{}`", words.join(".")))
                    .expected("KIND.SPECIES of an `output` statement, such as `profile.A`")
                    .help(format!("add an `output {} {}` statement", kind.word(), words[1..].join(", "))),
            );
        }
        return None;
    };
    let target = match target? {
        FieldTarget::Pair(a, b) if !results.outputs[output].pairs.contains(&(a, b)) => {
            FieldTarget::Pair(b, a)
        }
        other => other,
    };
    let first = *species.first()?;
    let concentration = checker.concentration_of(first)?;
    let dimension = match kind {
        OutputKind::Mixing => Dimension::NONE,
        kind => kind.dimension(concentration, checker.axes.len()),
    };
    Some(Part::Field(Field::Output(kind, target), Type::Number(dimension), places))
}

fn report_no_only_reference(checker: &mut Checker<'_>, span: Span) {
    let names: Vec<String> = checker.scope.references().iter().map(|(name, _)| format!("`{name}`")).collect();
    let expected = match names.is_empty() {
        true => "a `reference` statement".to_owned(),
        false => names.join(", "),
    };
    checker.report(
        Diagnostic::error(D004, "`reference` stands for the only reference of a scene")
            .at(span, "not the only one")
            .found(format!("{} references", names.len()))
            .expected(expected),
    );
}

fn reference_part(
    checker: &mut Checker<'_>,
    results: &Results<'_>,
    idx: usize,
    expr: &tree::Expr,
) -> Option<Part> {
    // References that are wrong are reported where they stand.
    results.are_whole.then_some(())?;
    let reference = &results.references[idx];
    let places = results.of_reference(idx);
    if places.candidates().is_empty() {
        let kinds: Vec<String> =
            reference.target.outputs().iter().map(|kind| format!("`output {}`", kind.word())).collect();
        checker.report(
            Diagnostic::error(M015, format!("no output gives what reference `{}` predicts", reference.name))
                .at(expr.span, "without bins and times")
                .also(reference.span, "the reference")
                .found("no such output")
                .expected(format!("{} of its species", kinds.join(" or "))),
        );
        return None;
    }
    let kind = reference.target.outputs()[0];
    let concentration = checker.concentration_of(reference.target.species())?;
    let dimension = match kind {
        OutputKind::Mixing => Dimension::NONE,
        kind => kind.dimension(concentration, checker.axes.len()),
    };
    Some(Part::Field(Field::Reference(idx), Type::Number(dimension), places))
}

fn apply_unary(operator: Unary, part: Part) -> Part {
    match part {
        Part::Scalar(value, kind) => Part::Scalar(Scalar::Unary(operator, Box::new(value)), kind),
        Part::Field(value, kind, on) => Part::Field(Field::Unary(operator, Box::new(value)), kind, on),
    }
}

fn call_part<'a>(
    checker: &mut Checker<'a>,
    results: &Results<'_>,
    function: &'a tree::Name,
    arguments: &'a [tree::Argument],
    expr: &'a tree::Expr,
) -> Option<Part> {
    let name = function.value.as_str();
    let norm = NORMS.iter().find(|(word, _)| *word == name).map(|(_, norm)| *norm);
    if norm.is_none() && name != "abs" {
        return constant(checker, expr);
    }
    let [argument] = arguments else {
        checker.report(
            Diagnostic::error(D007, format!("`{name}` takes one argument"))
                .at(function.span, format!("{} here", arguments.len()))
                .found(format!("{} arguments", arguments.len()))
                .expected("one argument"),
        );
        return None;
    };
    let inner = part(checker, results, &argument.value)?;
    let Some(norm) = norm else { return Some(apply_unary(Unary::Abs, inner)) };
    let Part::Field(field, kind, places) = inner else {
        checker.report(
            Diagnostic::error(U108, format!("`{name}` is a norm of a field"))
                .at(argument.value.span, "one number")
                .found("one number")
                .expected("an output such as `profile.A`, or a reference"),
        );
        return None;
    };
    let output_idx = place_of(checker, results, name, &places, argument.value.span)?;
    let on = results.outputs[output_idx].kind;
    let dimension = norm_dimension(norm, kind.dimension()?, on, checker.axes.len());
    Some(Part::Scalar(Scalar::Norm(norm, output_idx, Box::new(field)), Type::Number(dimension)))
}

/// A part to a constant power.
fn power_part(base: Part, exponent: Part, checker: &mut Checker<'_>, expr: &tree::Expr) -> Option<Part> {
    let power = match exponent {
        Part::Scalar(Scalar::Number(power), Type::Number(Dimension::NONE) | Type::Zero) => Some(power),
        _ => None,
    };
    let dimension = power.and_then(|power| base.kind().dimension()?.power_f64(power));
    let (Some(power), Some(dimension)) = (power, dimension) else {
        checker.report(
            Diagnostic::error(U103, "the dimension of this power is not fixed")
                .at(expr.span, "the exponent must be a constant with a simple fraction")
                .found("another exponent")
                .expected("a constant such as 2 or 0.5"),
        );
        return None;
    };
    let kind = Type::Number(dimension);
    Some(match base {
        Part::Scalar(a, _) => {
            Part::Scalar(Scalar::Binary(Binary::Power, Box::new(a), Box::new(Scalar::Number(power))), kind)
        }
        Part::Field(a, _, on) => {
            Part::Field(Field::Binary(Binary::Power, Box::new(a), Box::new(Field::Number(power))), kind, on)
        }
    })
}

/// Norms that integrate over space carry the volume of the bins.
fn norm_dimension(norm: Norm, field: Dimension, on: OutputKind, n_axes: usize) -> Dimension {
    let n_integrated = match on {
        OutputKind::Profile | OutputKind::Covariance => 1,
        OutputKind::Map => n_axes as i32,
        OutputKind::Total | OutputKind::Mixing | OutputKind::Particles => 0,
    };
    let power = match norm {
        Norm::L1 | Norm::Integral => (n_integrated, 1),
        Norm::L2 => (n_integrated, 2),
        Norm::LInf | Norm::Rmse | Norm::Mean | Norm::Minimum | Norm::Maximum => (0, 1),
    };
    field.times(Dimension::LENGTH.power(power.0, power.1).unwrap_or(Dimension::NONE))
}

fn binary_part(
    checker: &mut Checker<'_>,
    operator: BinaryOperator,
    left: Part,
    right: Part,
    expr: &tree::Expr,
) -> Option<Part> {
    let (op, is_sum) = match operator {
        BinaryOperator::Add => (Binary::Add, true),
        BinaryOperator::Subtract => (Binary::Subtract, true),
        BinaryOperator::Multiply => (Binary::Multiply, false),
        BinaryOperator::Divide => (Binary::Divide, false),
        BinaryOperator::Power => return power_part(left, right, checker, expr),
        _ => {
            checker.report(
                Diagnostic::error(U108, "a measure is made of sums, products and norms")
                    .at(expr.span, "another operation")
                    .found("another operation")
                    .expected("`+`, `-`, `*`, `/`, `abs`, norms"),
            );
            return None;
        }
    };
    let kind = if is_sum {
        let Some(kind) = left.kind().unify(right.kind()) else {
            checker.report(
                Diagnostic::error(U101, "cannot add or subtract values of different dimensions")
                    .at(expr.span, "both sides must have one dimension")
                    .found(right.kind().describe())
                    .expected(left.kind().describe()),
            );
            return None;
        };
        kind
    } else {
        let (a, b) = (left.kind().dimension()?, right.kind().dimension()?);
        Type::Number(if operator == BinaryOperator::Multiply { a.times(b) } else { a.over(b) })
    };
    match (left, right) {
        (Part::Scalar(a, _), Part::Scalar(b, _)) => {
            Some(Part::Scalar(Scalar::Binary(op, Box::new(a), Box::new(b)), kind))
        }
        (Part::Field(a, _, on), Part::Field(b, _, other)) if on.can_join(&other) => {
            Some(Part::Field(Field::Binary(op, Box::new(a), Box::new(b)), kind, on.both(&other)))
        }
        (Part::Field(a, _, on), Part::Scalar(Scalar::Number(b), _)) => {
            Some(Part::Field(Field::Binary(op, Box::new(a), Box::new(Field::Number(b))), kind, on))
        }
        (Part::Scalar(Scalar::Number(a), _), Part::Field(b, _, on)) => {
            Some(Part::Field(Field::Binary(op, Box::new(Field::Number(a)), Box::new(b)), kind, on))
        }
        _ => {
            checker.report(
                Diagnostic::error(U108, "these two cannot be combined bin by bin")
                    .at(expr.span, "values on different bins, or a field and a computed number")
                    .found("different bins")
                    .expected("fields of one output, or constants"),
            );
            None
        }
    }
}

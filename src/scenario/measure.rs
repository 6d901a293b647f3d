//! Measures: numbers computed from results, references, other measures and what a run knows of itself.
//!
//! Owns their types and the order in which they are checked. May use the checker. It deliberately knows
//! no rule of expressions: `check` and `call` do, `results` adds the results of a run, and `fields` makes
//! numbers and fields of what they have checked.

use super::check::{Allow, Checker, label_circle};
use super::collect::Statements;
use super::expression::Type;
use super::fields::{self, Part};
use super::observe::time_list;
use super::places::Results;
use super::restriction::check_restrictions;
use super::results::Measuring;
use super::scope::Origin;
use super::slot::each_name;
use super::{Domain, Measure, Output, OutputKind, Reference};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{D006, U108};
use crate::maths::operator::{Binary, Unary};
use crate::maths::order::order;
use crate::source::Span;
use crate::syntax::tree;
use crate::units::Dimension;
use serde::{Deserialize, Serialize};
use std::rc::Rc;

/// An expression whose value is one number.
#[derive(Debug, Clone, PartialEq)]
pub enum Scalar {
    Number(f64),
    Fact(Fact),
    /// The value of another measure, by its index among those of the scenario.
    Measure(usize),
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
    /// Accepted sub-steps of what is integrated, all particles together.
    SubSteps,
    /// Mean velocity of the water along an axis, of a flow in cells.
    VelocityMeanX,
    VelocityMeanY,
    VelocityMeanZ,
    VelocityVarianceX,
    VelocityVarianceY,
    VelocityVarianceZ,
    /// Of a Darcy flow between two heads.
    EffectiveConductivity,
}

impl Fact {
    /// Whether it is one of a flow in cells.
    pub fn is_of_cells(self) -> bool {
        match self {
            Self::WallTime
            | Self::CpuTime
            | Self::MassDefect
            | Self::Particles
            | Self::Steps
            | Self::SubSteps => false,
            Self::VelocityMeanX
            | Self::VelocityMeanY
            | Self::VelocityMeanZ
            | Self::VelocityVarianceX
            | Self::VelocityVarianceY
            | Self::VelocityVarianceZ
            | Self::EffectiveConductivity => true,
        }
    }
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
    /// With which of its numbers, the first being 0.
    Output(OutputKind, FieldTarget, usize),
    Reference(usize),
    Unary(Unary, Box<Field>),
    Binary(Binary, Box<Field>, Box<Field>),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FieldTarget {
    Species(usize),
    Pair(usize, usize),
}

/// The measures of a scene, and whether all of them are right.
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
    let results = Results {
        outputs: outputs.into(),
        references: references.into(),
        are_whole,
        times: None,
        decided: Vec::new(),
    };
    let mut found: Vec<Option<Measure>> = vec![None; statements.measures.len()];
    let has_cells = statements.flow.is_some_and(|(_, flow)| {
        matches!(flow.argument, tree::FlowArgument::Entries(_) | tree::FlowArgument::Files(..))
    });
    checker.measuring = Some(Measuring::new(results, found.len(), has_cells));
    for idx in order_of_measures(checker, statements) {
        let (span, written) = statements.measures[idx];
        found[idx] = measure(checker, span, written, duration, domain);
        if let (Some(measuring), Some(found)) = (&mut checker.measuring, &found[idx]) {
            measuring.dimensions[idx] = Some(found.dimension);
        }
    }
    checker.measuring = None;
    let is_right = found.iter().all(Option::is_some);
    (found.into_iter().flatten().collect(), is_right)
}

/// Each measure after those that it names; circles are reported.
fn order_of_measures(checker: &mut Checker<'_>, statements: &Statements<'_>) -> Vec<usize> {
    let needs = statements.measures.iter().map(|(_, written)| needs(checker, &written.value));
    let order = order(&needs.collect::<Vec<_>>());
    for circle in order.circles {
        let name = |idx: usize| &statements.measures[idx].1.name;
        let links: Vec<(&str, Span)> =
            circle.iter().map(|&idx| (name(idx).value.as_str(), name(idx).span)).collect();
        let message = Diagnostic::error(D006, format!("`{}` is defined by itself", links[0].0));
        let message = label_circle(message, &links, "its value needs");
        checker.report(message.found("a circle of measures").expected("measures that end in results"));
    }
    order.items
}

/// The measures that an expression names, also in the functions that it calls.
fn needs(checker: &Checker<'_>, expr: &tree::Expr) -> Vec<usize> {
    let mut needs = Vec::new();
    let mut called: Vec<&tree::Function> = Vec::new();
    let mut n_seen = 0;
    let (mut body, mut parameters): (&tree::Expr, &[tree::Name]) = (expr, &[]);
    loop {
        each_name(body, &mut |name, is_called| {
            let origin = checker.scope.get(&name.value).map(|entry| entry.origin);
            // A parameter of the function hides a measure.
            let is_hidden = || parameters.iter().any(|parameter| parameter.value == name.value);
            match origin {
                Some(Origin::Measure(idx)) if !is_called && !is_hidden() => needs.push(idx),
                Some(Origin::Function(it)) if is_called && !called.iter().any(|is| std::ptr::eq(*is, it)) => {
                    called.push(it);
                }
                _ => {}
            }
        });
        let Some(function) = called.get(n_seen) else { break };
        (body, parameters) = (&function.body, &function.parameters);
        n_seen += 1;
    }
    needs.sort_unstable();
    needs.dedup();
    needs
}

fn measure<'a>(
    checker: &mut Checker<'a>,
    span: Span,
    written: &'a tree::Measure,
    duration: Option<f64>,
    domain: Option<&Domain>,
) -> Option<Measure> {
    let times = match &written.times {
        None => Some(None),
        Some(list) => time_list(checker, list, duration).map(Some),
    };
    let checked = value(checker, written, times.clone().flatten());
    let over = match &written.over {
        None => Some(None),
        Some(axis) => over(checker, axis).map(Some),
    };
    let (value, dimension) = checked?;
    let over = over?;
    let results = Rc::clone(&checker.measuring.as_ref()?.results);
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

/// The number that a measure is, with its dimension.
fn value<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Measure,
    times: Option<Vec<f64>>,
) -> Option<(Scalar, Dimension)> {
    checker.measuring.as_mut()?.begin(times);
    // Norms that leave no choice decide for those that do: they are found first, without messages.
    let n_messages = checker.diagnostics.len();
    checker.check(&written.value, Allow::MEASURE);
    checker.diagnostics.truncate(n_messages);
    checker.measuring.as_mut()?.are_decided();
    let checked = checker.check(&written.value, Allow::MEASURE)?;
    if checked.kind == Type::Truth {
        checker.wrong_kind("a measure", "a number", checked.kind, written.value.span);
        return None;
    }
    let dimension = checked.kind.dimension()?;
    match fields::part(checker, &checked)? {
        Part::Scalar(value) => Some((fields::as_written(checker, value, &written.value), dimension)),
        Part::Field(..) => {
            checker.report(
                Diagnostic::error(U108, "a measure is one number")
                    .at(written.value.span, "a value for every bin and time")
                    .found("a field")
                    .expected("a norm of it, such as `l2(…)` or `integral(…)`"),
            );
            None
        }
    }
}

fn over<'a>(checker: &mut Checker<'a>, axis: &'a tree::Axis) -> Option<(usize, f64, f64)> {
    let words: Vec<(String, usize)> = checker.axes.clone();
    let words: Vec<(&str, usize)> = words.iter().map(|(name, index)| (name.as_str(), *index)).collect();
    let index = checker.word(&axis.name, "an axis of the domain", &words);
    let (low, high, _) = checker.range(&axis.range, "the range of a measure", Some(Dimension::LENGTH))?;
    Some((index?, low.value, high.value))
}

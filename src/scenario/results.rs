//! Results of a run in the expressions of measures: outputs, references, facts, other measures, norms.
//!
//! Owns the meaning of these names and calls; every other rule of expressions is that of `check` and
//! `call`. May use `places`. It deliberately combines nothing: `fields` does.

use super::OutputKind;
use super::check::Checker;
use super::expression::{Expr, Node};
use super::fields::{self, Part};
use super::measure::{Fact, Field, FieldTarget, Norm, Scalar};
use super::model::species_index;
use super::numbers::number_dimension;
use super::observe::OUTPUTS;
use super::places::{Places, Results, place_of};
use super::scope::{Origin, THE_REFERENCE};
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{D004, M015, U108};
use crate::source::Span;
use crate::syntax::tree;
use crate::units::Dimension;
use std::rc::Rc;

const SQUARED_VELOCITY: Dimension = Dimension::new(2, 0, -2, 0);

const FACTS: &[(&str, Fact, Dimension)] = &[
    ("wall_time", Fact::WallTime, Dimension::TIME),
    ("cpu_time", Fact::CpuTime, Dimension::TIME),
    ("mass_defect", Fact::MassDefect, Dimension::NONE),
    ("particles", Fact::Particles, Dimension::NONE),
    ("steps", Fact::Steps, Dimension::NONE),
    ("sub_steps", Fact::SubSteps, Dimension::NONE),
    ("velocity_mean_x", Fact::VelocityMeanX, Dimension::VELOCITY),
    ("velocity_mean_y", Fact::VelocityMeanY, Dimension::VELOCITY),
    ("velocity_mean_z", Fact::VelocityMeanZ, Dimension::VELOCITY),
    ("velocity_variance_x", Fact::VelocityVarianceX, SQUARED_VELOCITY),
    ("velocity_variance_y", Fact::VelocityVarianceY, SQUARED_VELOCITY),
    ("velocity_variance_z", Fact::VelocityVarianceZ, SQUARED_VELOCITY),
    ("effective_conductivity", Fact::EffectiveConductivity, Dimension::VELOCITY),
];

const NORMS: &[(&str, Norm)] = &[
    ("l1", Norm::L1),
    ("l2", Norm::L2),
    ("linf", Norm::LInf),
    ("rmse", Norm::Rmse),
    ("integral", Norm::Integral),
    ("mean", Norm::Mean),
    ("minimum", Norm::Minimum),
    ("maximum", Norm::Maximum),
];

/// What the measure that is being checked may speak of, and what it has spoken of.
pub(super) struct Measuring {
    pub results: Rc<Results>,
    /// Dimensions of the measures of the scene, as far as they are known and right.
    pub dimensions: Vec<Option<Dimension>>,
    /// [`Node::Species`] is an index into these: species themselves have no value in a measure.
    pub leaves: Vec<Part>,
    /// Whether norms that leave no choice of their output are being gathered.
    is_deciding: bool,
    /// Whether the flow of the scene is one in cells.
    has_cells: bool,
}

impl Measuring {
    pub(super) fn new(results: Results, n_measures: usize, has_cells: bool) -> Self {
        let dimensions = vec![None; n_measures];
        Self { results: Rc::new(results), dimensions, leaves: Vec::new(), is_deciding: false, has_cells }
    }

    /// Another measure, restricted to these times.
    pub(super) fn begin(&mut self, times: Option<Vec<f64>>) {
        let results = Rc::make_mut(&mut self.results);
        results.times = times;
        results.decided.clear();
        self.leaves.clear();
        self.is_deciding = true;
    }

    pub(super) fn are_decided(&mut self) {
        self.leaves.clear();
        self.is_deciding = false;
    }
}

pub(super) fn norm_of(name: &str) -> Option<Norm> {
    NORMS.iter().find(|(word, _)| *word == name).map(|(_, norm)| *norm)
}

impl<'a> Checker<'a> {
    /// A name that means a result of the run; `Some(None)` if what is wrong with it has been told.
    pub(super) fn named_result(&mut self, name: &'a tree::Name, span: Span) -> Option<Option<Expr>> {
        let text = name.value.as_str();
        let origin = self.scope.get(text).map(|entry| entry.origin);
        let reference = self.scope.reference(text);
        match origin {
            None => {
                if let Some((_, fact, dimension)) = FACTS.iter().find(|(word, ..)| *word == text) {
                    if fact.is_of_cells() && !self.measuring.as_ref()?.has_cells {
                        report_no_cells(self, name);
                        return Some(None);
                    }
                    return Some(self.result(Part::Scalar(Scalar::Fact(*fact)), *dimension, 1, span));
                }
                if text == THE_REFERENCE && reference.is_none() {
                    report_no_only_reference(self, name.span);
                    return Some(None);
                }
            }
            Some(Origin::Measure(_) | Origin::Reference(_)) => {
                if let Some(entry) = self.scope.get_mut(text) {
                    entry.n_uses += 1;
                }
            }
            _ => return None,
        }
        if let Some(Origin::Measure(idx)) = origin {
            // A measure that is wrong has been reported where it stands.
            let dimension = self.measuring.as_ref()?.dimensions[idx];
            let value = Part::Scalar(Scalar::Measure(idx));
            return Some(dimension.and_then(|dimension| self.result(value, dimension, 1, span)));
        }
        reference.map(|idx| self.result_of_reference(idx, span))
    }

    /// Keeps a result for its place in an expression.
    fn result(&mut self, part: Part, dimension: Dimension, size: u32, span: Span) -> Option<Expr> {
        let leaves = &mut self.measuring.as_mut()?.leaves;
        leaves.push(part);
        Some(Expr { size, ..Expr::leaf(Node::Species(leaves.len() - 1), dimension, span) })
    }

    pub(super) fn result_of_output(&mut self, path: &'a [tree::Name], span: Span) -> Option<Expr> {
        let results = Rc::clone(&self.measuring.as_ref()?.results);
        let kind = self.word(&path[0], "an output", OUTPUTS)?;
        let (path, number) = self.number_of(kind, path)?;
        let species: Vec<Option<usize>> = path[1..].iter().map(|name| species_index(self, name)).collect();
        let species: Vec<usize> = species.into_iter().collect::<Option<_>>()?;
        let target = FieldTarget::of(kind, &species);
        let places = target.map(|target| results.of_output(kind, target)).unwrap_or_default();
        let Some(&output) = places.candidates().first() else {
            if results.are_whole {
                let words: Vec<&str> = path.iter().map(|name| name.value.as_str()).collect();
                let (kind_word, names) = (kind.word(), words[1..].join(", "));
                let help = match kind.is_binned() || kind.is_course() {
                    true => format!("add an `output {kind_word} {names}` statement"),
                    false => format!(
                        "`{kind_word}` has many rows at a time, which no measure reads: use `profile`, `map` or `total`"
                    ),
                };
                self.report(
                    Diagnostic::error(M015, "no output of the scene gives this")
                        .at(span, "not an output")
                        .found(format!("`{}`", words.join(".")))
                        .expected("KIND.SPECIES of an `output` statement, such as `profile.A`")
                        .help(help),
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
        let dimension = self.dimension_of_number(kind, *species.first()?, number)?;
        self.result(Part::Field(Field::Output(kind, target, number), places), dimension, 1, span)
    }

    /// Takes the name of a number off a path such as `moments.A.xx`; without one it is the first number.
    fn number_of(&mut self, kind: OutputKind, path: &'a [tree::Name]) -> Option<(&'a [tree::Name], usize)> {
        match path {
            [before @ .., last] if before.len() == 2 && !kind.numbers().is_empty() => {
                Some((before, number_named(self, kind, last)?))
            }
            _ => Some((path, 0)),
        }
    }

    fn dimension_of_number(&self, kind: OutputKind, species: usize, number: usize) -> Option<Dimension> {
        let first = self.dimension_of(kind, species)?;
        let Some(of) = kind.numbers().get(number) else { return Some(first) };
        let amount = OutputKind::Total.dimension(self.concentration_of(species)?, self.axes.len());
        Some(number_dimension(of.rule, first, amount))
    }

    fn result_of_reference(&mut self, idx: usize, span: Span) -> Option<Expr> {
        let results = Rc::clone(&self.measuring.as_ref()?.results);
        // References that are wrong are reported where they stand.
        results.are_whole.then_some(())?;
        let reference = &results.references[idx];
        let places = results.of_reference(idx);
        let outputs = reference.target.outputs();
        if places.candidates().is_empty() {
            let kinds: Vec<String> = outputs.iter().map(|kind| format!("`output {}`", kind.word())).collect();
            self.report(
                Diagnostic::error(
                    M015,
                    format!("no output gives what reference `{}` predicts", reference.name),
                )
                .at(span, "without bins and times")
                .also(reference.span, "the reference")
                .found("no such output")
                .expected(format!("{} of its species", kinds.join(" or "))),
            );
            return None;
        }
        let number = reference.target.number();
        let dimension = self.dimension_of_number(outputs[0], reference.target.species(), number)?;
        self.result(Part::Field(Field::Reference(idx), places), dimension, 1, span)
    }

    /// The dimension of an output of a species.
    fn dimension_of(&self, kind: OutputKind, species: usize) -> Option<Dimension> {
        let concentration = self.concentration_of(species)?;
        Some(match kind {
            OutputKind::Mixing => Dimension::NONE,
            kind => kind.dimension(concentration, self.axes.len()),
        })
    }

    pub(super) fn norm(
        &mut self,
        norm: Norm,
        function: &tree::Name,
        mut values: Vec<Expr>,
        span: Span,
    ) -> Option<Expr> {
        let name = function.value.as_str();
        if !self.has_arguments(name, function.span, 1, values.len()) {
            return None;
        }
        let argument = values.pop()?;
        let Some(dimension) = argument.kind.dimension() else {
            return self.wrong_kind(&format!("`{name}`"), "a number", argument.kind, argument.span);
        };
        let Part::Field(field, places) = fields::part(self, &argument)? else {
            self.report(
                Diagnostic::error(U108, format!("`{name}` is a norm of a field"))
                    .at(argument.span, "one number")
                    .found("one number")
                    .expected("an output such as `profile.A`, or a reference"),
            );
            return None;
        };
        let output_idx = self.output_of_norm(name, &places, argument.span)?;
        let on = self.measuring.as_ref()?.results.outputs[output_idx].kind;
        let dimension = norm_dimension(norm, dimension, on, self.axes.len());
        let value = Part::Scalar(Scalar::Norm(norm, output_idx, Box::new(field)));
        self.result(value, dimension, argument.size.saturating_add(1), span)
    }

    /// The output that a norm is taken on, which may depend on that of the other norms.
    fn output_of_norm(&mut self, norm: &str, places: &Places, span: Span) -> Option<usize> {
        let measuring = self.measuring.as_mut()?;
        if !measuring.is_deciding {
            let results = Rc::clone(&measuring.results);
            return place_of(self, &results, norm, places, span);
        }
        let chosen = places.chosen(&measuring.results);
        if let [only] = chosen[..] {
            Rc::make_mut(&mut measuring.results).decided.push(only);
        }
        chosen.first().copied()
    }
}

/// The number of an output in rows that has a name.
pub(super) fn number_named(checker: &mut Checker<'_>, kind: OutputKind, name: &tree::Name) -> Option<usize> {
    let numbers = kind.numbers().iter().enumerate();
    let words: Vec<(&str, usize)> = numbers.map(|(idx, number)| (number.name, idx)).collect();
    checker.word(name, &format!("a number of `{}`", kind.word()), &words)
}

fn report_no_cells(checker: &mut Checker<'_>, name: &tree::Name) {
    checker.report(
        Diagnostic::error(M015, format!("`{}` is known of a flow in cells only", name.value))
            .at(name.span, "no such flow here")
            .found("a flow without cells")
            .expected("`flow darcy { … }`, or a flow from a file"),
    );
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

/// Norms that integrate over space carry the volume of the bins.
fn norm_dimension(norm: Norm, field: Dimension, on: OutputKind, n_axes: usize) -> Dimension {
    let n_integrated = match on {
        OutputKind::Profile | OutputKind::Covariance => 1,
        OutputKind::Map => n_axes as i32,
        _ => 0,
    };
    let power = match norm {
        Norm::L1 | Norm::Integral => (n_integrated, 1),
        Norm::L2 => (n_integrated, 2),
        Norm::LInf | Norm::Rmse | Norm::Mean | Norm::Minimum | Norm::Maximum => (0, 1),
    };
    field.times(Dimension::LENGTH.power(power.0, power.1).unwrap_or(Dimension::NONE))
}

//! References: solutions from the catalogue or written out, and what they predict.

use super::check::{Allow, Checker};
use super::collect::Statements;
use super::model::species_index;
use super::numbers::number_dimension;
use super::observe::OUTPUTS;
use super::results::number_named;
use super::scope::Origin;
use super::{Output, OutputKind, Reference, Solution, Target};
use crate::catalog::reference::{self as catalogue, ArgumentDimension, Item, Predicts};
use crate::diagnostic::codes::{D002, D007, M004, M005, M014, M016};
use crate::diagnostic::{Diagnostic, did_you_mean, precise};
use crate::source::Span;
use crate::syntax::tree::{self, ExprKind};
use crate::units::Dimension;

/// The name of a reference: written, or that of its item.
pub(super) fn reference_name(written: &tree::Reference) -> Option<&tree::Name> {
    match (&written.name, &written.value.kind) {
        (Some(name), _) => Some(name),
        (None, ExprKind::Call { function, .. }) => Some(function),
        _ => None,
    }
}

impl Target {
    /// The kinds of output that a reference for this target is compared with.
    pub fn outputs(self) -> &'static [OutputKind] {
        match self {
            Target::Concentration(_) => &[OutputKind::Profile, OutputKind::Map],
            Target::Covariance(..) => &[OutputKind::Covariance],
            Target::Mixing(..) => &[OutputKind::Mixing],
            Target::Course(kind, ..) => match kind {
                OutputKind::Breakthrough => &[OutputKind::Breakthrough],
                OutputKind::FirstPassage => &[OutputKind::FirstPassage],
                OutputKind::Moments => &[OutputKind::Moments],
                OutputKind::Dilution => &[OutputKind::Dilution],
                _ => &[OutputKind::Total],
            },
        }
    }

    pub(super) fn is_in(self, output: &Output) -> bool {
        self.outputs().contains(&output.kind)
            && match self {
                Target::Concentration(species) | Target::Course(_, species, _) => {
                    output.species.contains(&species)
                }
                Target::Covariance(a, b) | Target::Mixing(a, b) => {
                    output.pairs.contains(&(a, b)) || output.pairs.contains(&(b, a))
                }
            }
    }

    /// Which number of its output it predicts, the first being 0.
    pub fn number(self) -> usize {
        if let Target::Course(.., number) = self { number } else { 0 }
    }

    pub(super) fn species(self) -> usize {
        match self {
            Target::Concentration(a)
            | Target::Course(_, a, _)
            | Target::Covariance(a, _)
            | Target::Mixing(a, _) => a,
        }
    }
}

pub(super) fn references<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    outputs: &[Output],
) -> (Vec<Reference>, bool) {
    let mut list = Vec::new();
    let are_outputs_right = outputs.len() == statements.outputs.len();
    for (span, written) in &statements.references {
        list.extend(reference(checker, *span, written, outputs, are_outputs_right));
    }
    let is_right = list.len() == statements.references.len();
    (list, is_right)
}

fn reference<'a>(
    checker: &mut Checker<'a>,
    span: Span,
    written: &'a tree::Reference,
    outputs: &[Output],
    are_outputs_right: bool,
) -> Option<Reference> {
    let target = target(checker, &written.target, span);
    let solution = solution(checker, written, target);
    let (target, solution) = (target?, solution?);
    let name = reference_name(written)?;
    let order_in_output = |target: Target| match target {
        Target::Covariance(a, b) | Target::Mixing(a, b)
            if outputs.iter().any(|output| target.is_in(output) && output.pairs.contains(&(b, a)))
                && a != b =>
        {
            if matches!(target, Target::Covariance(..)) {
                Target::Covariance(b, a)
            } else {
                Target::Mixing(b, a)
            }
        }
        other => other,
    };
    let target = order_in_output(target);
    if are_outputs_right && !outputs.iter().any(|output| target.is_in(output)) {
        let kinds: Vec<String> =
            target.outputs().iter().map(|kind| format!("`output {}`", kind.word())).collect();
        checker.report(
            Diagnostic::warning(M014, format!("reference `{}` is compared with nothing", name.value))
                .at(name.span, "no output gives what it predicts")
                .found("no such output")
                .expected(kinds.join(" or ")),
        );
    }
    Some(Reference { name: name.value.clone(), span, target, solution })
}

fn target(checker: &mut Checker<'_>, written: &tree::Target, span: Span) -> Option<Target> {
    let kind = match &written.output {
        None => None,
        Some(name) => {
            let words: Vec<(&str, OutputKind)> =
                OUTPUTS.iter().copied().filter(|(_, kind)| kind.is_binned() || kind.is_course()).collect();
            Some(checker.word(name, "an output that a reference can predict", &words)?)
        }
    };
    let mut number = 0;
    let species: Vec<Option<usize>> = written
        .species
        .iter()
        .map(|name| match (kind, split_number(checker, name)) {
            (Some(kind), Some((before, last))) if !kind.numbers().is_empty() => {
                number = number_named(checker, kind, &last)?;
                species_index(checker, &before)
            }
            _ => species_index(checker, name),
        })
        .collect();
    let species: Vec<usize> = species.into_iter().collect::<Option<_>>()?;
    let target = match (kind, species.as_slice()) {
        (None | Some(OutputKind::Profile | OutputKind::Map), [a]) => Some(Target::Concentration(*a)),
        (Some(OutputKind::Covariance), [a]) => Some(Target::Covariance(*a, *a)),
        (Some(OutputKind::Covariance), [a, b]) => Some(Target::Covariance(*a, *b)),
        (Some(OutputKind::Mixing), [a]) => Some(Target::Mixing(*a, *a)),
        (Some(OutputKind::Mixing), [a, b]) => Some(Target::Mixing(*a, *b)),
        (Some(kind), [a]) if kind.is_course() => Some(Target::Course(kind, *a, number)),
        _ => None,
    };
    if target.is_none() {
        let place = match (written.species.first(), written.species.last()) {
            (Some(first), Some(last)) => first.span.to(last.span),
            _ => span,
        };
        checker.report(
            Diagnostic::error(M005, "a reference predicts one species, or one pair")
                .at(place, format!("{} species here", species.len()))
                .found(format!("{} species", species.len()))
                .expected("one species; for `covariance` and `mixing` one or two"),
        );
    }
    target
}

/// `A.xx` as the species and the number; nothing for the name of a species.
fn split_number(checker: &Checker<'_>, name: &tree::Name) -> Option<(tree::Name, tree::Name)> {
    let (before, last) = name.value.rsplit_once('.')?;
    if checker.scope.get(&name.value).is_some() {
        return None;
    }
    let split = name.span.start as usize + before.len();
    let place = |start: usize, end: usize| Span::new(name.span.file, start, end);
    let before = tree::Name::new(before.to_owned(), place(name.span.start as usize, split));
    Some((before, tree::Name::new(last.to_owned(), place(split + 1, name.span.end as usize))))
}

fn solution<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Reference,
    target: Option<Target>,
) -> Option<Solution> {
    if let ExprKind::Call { function, arguments } = &written.value.kind {
        if let Some(item) = catalogue::find(&function.value) {
            return item_solution(checker, item, function, arguments, target);
        }
        let first = function.value.split('.').next().unwrap_or_default();
        let is_of_scene = checker.scope.get(first).is_some_and(|entry| match entry.origin {
            Origin::Data(_) => true,
            Origin::Function(_) => first == function.value,
            _ => false,
        });
        let is_built_in = super::scope::BUILT_IN_FUNCTIONS.contains(&function.value.as_str());
        if !is_of_scene && !is_built_in {
            report_unknown_item(checker, function);
            return None;
        }
    }
    let expr = checker.check(&written.value, Allow::REFERENCE)?;
    let target = target?;
    let concentration = checker.concentration_of(target.species())?;
    let n_axes = checker.axes.len();
    let kind = target.outputs()[0];
    let first = match target {
        Target::Mixing(..) => Dimension::NONE,
        _ => kind.dimension(concentration, n_axes),
    };
    let amount = OutputKind::Total.dimension(concentration, n_axes);
    let number = kind.numbers().get(target.number());
    let expected = number.map_or(first, |number| number_dimension(number.rule, first, amount));
    checker.expect_dimension(&written.value, &expr, "the reference", &[expected])?;
    Some(Solution::Expression(expr))
}

fn report_unknown_item(checker: &mut Checker<'_>, function: &tree::Name) {
    let names: Vec<&str> = catalogue::ALL.iter().map(|item| item.name).collect();
    let mut message =
        Diagnostic::error(M004, format!("`{}` is neither a function nor a reference", function.value))
            .at(function.span, "not known here")
            .found(format!("`{}`", function.value))
            .expected(names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", "));
    if let Some(candidate) = did_you_mean(&function.value, names.iter().copied()) {
        message = message.help(format!("did you mean `{candidate}`?"));
    }
    checker.report(message);
}

fn item_solution<'a>(
    checker: &mut Checker<'a>,
    item: &'static Item,
    function: &'a tree::Name,
    arguments: &'a [tree::Argument],
    target: Option<Target>,
) -> Option<Solution> {
    let slots = assign(checker, item, arguments);
    let concentration = match target {
        Some(target) => checker.concentration_of(target.species()),
        None => Some(Dimension::MOLAR_CONCENTRATION),
    };
    let mut is_right = true;
    let mut values = Vec::new();
    let mut missing = Vec::new();
    for (argument, written) in item.arguments.iter().zip(slots?) {
        let dimension = match argument.dimension {
            ArgumentDimension::Fixed(dimension) => Some(dimension),
            ArgumentDimension::Concentration => concentration,
            ArgumentDimension::ConcentrationPerTime => concentration.map(|own| own.over(Dimension::TIME)),
        };
        let Some(written) = written else {
            match argument.default {
                Some(value) => values.push(value),
                None => missing.push(argument.name),
            }
            continue;
        };
        let what = format!("argument `{}` of `{}`", argument.name, item.name);
        let (low, high) = argument.range;
        let Some(dimension) = dimension else {
            // Its names count as used, and what is wrong in itself is told.
            checker.check(written, Allow::CONSTANT);
            is_right = false;
            continue;
        };
        let value = checker.slot(written, &what, dimension).and_then(|value| {
            let rule = format!("{} ({})", argument.doc, allowed(low, high));
            let is_fine = (low..=high).contains(&value.value);
            let found = checker.shown(value.value, dimension, value.span);
            checker.require(is_fine, &what, found, &rule, value.span)?;
            Some(value.value)
        });
        match value {
            Some(value) => values.push(value),
            None => is_right = false,
        }
    }
    if !missing.is_empty() {
        checker.report(
            Diagnostic::error(D007, format!("`{}` needs {}", item.name, missing.join(", ")))
                .at(function.span, format!("without {}", missing.join(", ")))
                .found("too few arguments")
                .expected(signature(item)),
        );
        return None;
    }
    is_right.then_some(())?;
    check_prediction(checker, item, function, target?)?;
    if let Err(reason) = (item.build)(&values) {
        checker.report(
            Diagnostic::error(M016, format!("`{}` cannot be built from these arguments", item.name))
                .at(function.span, reason.clone())
                .found(reason)
                .expected(signature(item)),
        );
        return None;
    }
    Some(Solution::Catalogue { name: item.name, arguments: values })
}

/// A range of SI values in words; the largest number stands for no bound.
fn allowed(low: f64, high: f64) -> String {
    match (low > -f64::MAX, high < f64::MAX) {
        (true, true) => format!("{} to {} in SI", precise(low), precise(high)),
        (true, false) => format!("{} or more in SI", precise(low)),
        (false, true) => format!("{} or less in SI", precise(high)),
        (false, false) => "any number".to_owned(),
    }
}

fn signature(item: &Item) -> String {
    let arguments: Vec<String> = item
        .arguments
        .iter()
        .map(|argument| match argument.default {
            Some(value) => format!("{} = {}", argument.name, precise(value)),
            None => argument.name.to_owned(),
        })
        .collect();
    format!("{}({})", item.name, arguments.join(", "))
}

/// Arguments by place, then by name, each slot at most once.
fn assign<'a>(
    checker: &mut Checker<'a>,
    item: &Item,
    arguments: &'a [tree::Argument],
) -> Option<Vec<Option<&'a tree::Expr>>> {
    let mut slots: Vec<Option<&'a tree::Expr>> = vec![None; item.arguments.len()];
    let mut is_right = true;
    for (idx, argument) in arguments.iter().enumerate() {
        let slot = match &argument.name {
            None => (idx < slots.len()).then_some(idx),
            Some(name) => item.arguments.iter().position(|known| known.name == name.value),
        };
        let place = argument.name.as_ref().map_or(argument.value.span, |name| name.span);
        let Some(slot) = slot else {
            let mut message = Diagnostic::error(D007, format!("`{}` has no such argument", item.name))
                .at(place, "not an argument")
                .found(
                    argument
                        .name
                        .as_ref()
                        .map_or("one argument too many".into(), |name| format!("`{}`", name.value)),
                )
                .expected(signature(item));
            let names = item.arguments.iter().map(|known| known.name);
            if let Some(candidate) = argument.name.as_ref().and_then(|name| did_you_mean(&name.value, names))
            {
                message = message.help(format!("did you mean `{candidate}`?"));
            }
            checker.report(message);
            is_right = false;
            continue;
        };
        if let Some(first) = slots[slot].replace(&argument.value) {
            checker.report(
                Diagnostic::error(D002, format!("argument `{}` is given twice", item.arguments[slot].name))
                    .at(place, "here again")
                    .also(first.span, "first here")
                    .found("one argument twice")
                    .expected(signature(item)),
            );
            is_right = false;
        }
    }
    is_right.then_some(slots)
}

fn check_prediction(
    checker: &mut Checker<'_>,
    item: &Item,
    function: &tree::Name,
    target: Target,
) -> Option<()> {
    let (fits, predicts) = match item.predicts {
        Predicts::Concentration => (matches!(target, Target::Concentration(_)), "a concentration"),
        Predicts::Covariance => (matches!(target, Target::Covariance(..)), "a covariance"),
        Predicts::Gamma => (matches!(target, Target::Mixing(..)), "a mixing ratio γ"),
        Predicts::Total => (matches!(target, Target::Course(OutputKind::Total, ..)), "a total"),
        Predicts::Moment => {
            let name = target.outputs()[0].numbers().get(target.number()).map_or("", |number| number.name);
            let is_moment = matches!(target, Target::Course(OutputKind::Moments, ..));
            (is_moment && ["xx", "yy", "zz"].contains(&name), "a second moment")
        }
    };
    if fits {
        return Some(());
    }
    let wanted = target.outputs()[0].word();
    checker.report(
        Diagnostic::error(M016, format!("`{}` predicts {predicts}", item.name))
            .at(function.span, format!("not what `{wanted}` gives"))
            .found(predicts)
            .expected(match item.predicts {
                Predicts::Concentration => "`for SPECIES`",
                Predicts::Covariance => "`for covariance A, B`",
                Predicts::Gamma => "`for mixing A, B`",
                Predicts::Total => "`for total SPECIES`",
                Predicts::Moment => "`for moments SPECIES.xx`, `.yy` or `.zz`",
            }),
    );
    None
}

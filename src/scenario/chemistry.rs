//! The `chemistry` statement: how accurately, and with which activities.
//!
//! Owns its words, ranges and defaults. May use the scenario's types. It deliberately chooses no method:
//! the plan does.

use super::check::Checker;
use super::choice::{ACTIVITIES, INTEGRATORS, SPLITTINGS};
use super::collect::Statements;
use super::expression::Type;
use super::{Activity, Chemistry, Integrator, Splitting};
use crate::diagnostic::codes::{M002, M004};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::Span;
use crate::syntax::tree::{self, ExprKind};
use crate::units::Dimension;

/// Relative tolerances: below the first rounding decides, above the second nothing is known.
const TOLERANCES: std::ops::RangeInclusive<f64> = 1e-12..=0.1;
const DEFAULT_TOLERANCE: f64 = 1e-6;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    Tolerance,
    Floor,
    Order,
    Splitting,
    Activity,
    Integrator,
}

const WORDS: &[(&str, Word)] = &[
    ("tolerance", Word::Tolerance),
    ("floor", Word::Floor),
    ("order", Word::Order),
    ("splitting", Word::Splitting),
    ("activity", Word::Activity),
    ("integrator", Word::Integrator),
];

/// The settings of a scene; `None` if something of the statement is wrong.
pub(super) fn chemistry<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> Option<Chemistry> {
    let mut found = Chemistry {
        span: None,
        tolerance: DEFAULT_TOLERANCE,
        floor: None,
        splitting: Splitting::Lie,
        activity: Activity::Ideal,
        integrator: Integrator::Auto,
    };
    let Some((span, fields)) = statements.chemistry else { return Some(found) };
    found.span = Some(span);
    let mut seen: Vec<(Word, &tree::Name)> = Vec::new();
    let mut splitting: Option<(Splitting, Span)> = None;
    let mut is_right = true;
    for field in fields {
        let word = checker.word(&field.name, "a setting of chemistry", WORDS);
        let twice = seen.iter().find(|(earlier, _)| Some(*earlier) == word).map(|(_, first)| *first);
        if let Some(first) = twice {
            report_twice(checker, &field.name, first);
        }
        let Some(word) = word.filter(|_| twice.is_none()) else {
            is_right = false;
            continue;
        };
        seen.push((word, &field.name));
        is_right &= match word {
            Word::Tolerance => tolerance(checker, field).map(|value| found.tolerance = value).is_some(),
            Word::Floor => floor(checker, field).map(|value| found.floor = Some(value)).is_some(),
            Word::Activity => {
                choice(checker, field, ACTIVITIES).map(|value| found.activity = value).is_some()
            }
            Word::Integrator => {
                choice(checker, field, INTEGRATORS).map(|value| found.integrator = value).is_some()
            }
            Word::Order | Word::Splitting => {
                let chosen = match word {
                    Word::Order => order(checker, field),
                    _ => choice(checker, field, SPLITTINGS),
                };
                chosen.and_then(|chosen| agree(checker, &mut splitting, chosen, field.value.span)).is_some()
            }
        };
    }
    if let Some((splitting, _)) = splitting {
        found.splitting = splitting;
    }
    is_right.then_some(found)
}

fn report_twice(checker: &mut Checker<'_>, name: &tree::Name, first: &tree::Name) {
    checker.report(
        Diagnostic::error(M002, format!("a second `{}` of chemistry", name.value))
            .at(name.span, "here again")
            .also(first.span, "first here")
            .found(format!("`{}` twice", name.value))
            .expected(format!("one `{}`", name.value)),
    );
}

fn tolerance<'a>(checker: &mut Checker<'a>, field: &'a tree::Field) -> Option<f64> {
    let value = checker.slot(&field.value, "the tolerance", Dimension::NONE)?;
    let rule = format!("from {} to {}", precise(*TOLERANCES.start()), precise(*TOLERANCES.end()));
    let is_fine = TOLERANCES.contains(&value.value);
    checker.require(is_fine, "the tolerance", precise(value.value), &rule, value.span)?;
    Some(value.value)
}

fn floor<'a>(checker: &mut Checker<'a>, field: &'a tree::Field) -> Option<(f64, Dimension)> {
    let checked = checker.check(&field.value, super::check::Allow::CONSTANT)?;
    let of = |own: &Option<Dimension>| own.unwrap_or(Dimension::MOLAR_CONCENTRATION);
    let species: Vec<Dimension> = checker.species_dimensions.iter().map(of).collect();
    // A floor of what no species has would do nothing.
    let mut dimensions = vec![Dimension::MOLAR_CONCENTRATION, Dimension::MASS_CONCENTRATION];
    dimensions.retain(|dimension| species.is_empty() || species.contains(dimension));
    let kind = checker.expect_dimension(&field.value, &checked, "the floor", &dimensions)?;
    let value = checked.value()?;
    let Type::Number(dimension) = kind else {
        checker.require(false, "the floor", "0", "above zero", field.value.span)?;
        return None;
    };
    checker.require(value > 0.0, "the floor", precise(value), "above zero", field.value.span)?;
    Some((value, dimension))
}

fn order<'a>(checker: &mut Checker<'a>, field: &'a tree::Field) -> Option<Splitting> {
    let order = checker.slot(&field.value, "the order", Dimension::NONE)?;
    let is_known = order.value == 1.0 || order.value == 2.0;
    checker.require(is_known, "the order", precise(order.value), "1 or 2", order.span)?;
    Some(if order.value == 1.0 { Splitting::Lie } else { Splitting::Strang })
}

/// `order` and `splitting` say the same thing in two ways, and may stand together if they agree.
fn agree(
    checker: &mut Checker<'_>,
    known: &mut Option<(Splitting, Span)>,
    chosen: Splitting,
    span: Span,
) -> Option<()> {
    let (first, first_span) = *known.get_or_insert((chosen, span));
    if first == chosen {
        return Some(());
    }
    checker.report(
        Diagnostic::error(M002, "`order` and `splitting` contradict each other")
            .at(span, "this is another one")
            .also(first_span, "than this")
            .found("two kinds of splitting")
            .expected("one of them")
            .help("`lie` has order 1, `strang` order 2"),
    );
    None
}

/// One of a list of words.
fn choice<T: Copy>(checker: &mut Checker<'_>, field: &tree::Field, words: &[(&str, T)]) -> Option<T> {
    let what = match field.name.value.as_str() {
        "activity" => "a model of activities",
        "integrator" => "an integrator",
        _ => "a splitting",
    };
    if let ExprKind::Path(path) = &field.value.kind
        && let [name] = path.as_slice()
    {
        return checker.word(name, what, words);
    }
    let all: Vec<String> = words.iter().map(|(word, _)| format!("`{word}`")).collect();
    checker.report(
        Diagnostic::error(M004, format!("this is not {what}"))
            .at(field.value.span, "not a word")
            .found("a value")
            .expected(all.join(", ")),
    );
    None
}

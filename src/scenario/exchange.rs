//! The statements `exchange` and `kernel`, and means by kernels: what parcels exchange with those around them by.
//!
//! Owns their words, ranges and defaults. May use the catalogue and the scenario's types. It deliberately works no
//! length out: what a step and a number of particles make of them is for the plan.

use super::check::{Allow, Checker};
use super::choice::{INTEGRATIONS, Integration, NORMALISATIONS, Normalisation};
use super::collect::Statements;
use super::estimation::{Estimation, estimation};
use super::expression::{Expr, Node};
use super::scope::{Locals, Origin};
use super::slot::collect_names;
use crate::catalog::kernel;
use crate::diagnostic::codes::{D003, M001, M002, M004};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::{Span, Spanned};
use crate::syntax::tree::{self, ExprKind};
use crate::units::Dimension;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

/// An `exchange` statement.
#[derive(Debug, Clone, PartialEq)]
pub struct Exchange {
    pub span: Span,
    pub kernel: Spanned<Choice>,
    /// m, over [`WORDS_OF_LENGTH`] in the place of coordinates.
    pub bandwidth: Spanned<Expr>,
    /// The part of the dispersion that is exchange; the rest walks.
    pub mixing_fraction: f64,
    pub normalisation: Normalisation,
    pub integration: Integration,
    pub cutoff: Cutoff,
    pub is_compensated: bool,
}

/// The means that zones exchange with, over the parcels around: `average kernel …`.
#[derive(Debug, Clone, PartialEq)]
pub struct Averaging {
    pub span: Span,
    pub kernel: Spanned<Choice>,
    /// m, over [`WORDS_OF_LENGTH`], of which only the distance of parcels may be named.
    pub bandwidth: Spanned<Expr>,
    pub normalisation: Normalisation,
    pub cutoff: Cutoff,
}

/// Whose kernel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Choice {
    Catalogue(&'static str),
    /// One of the scene's own, by its number.
    Own(usize),
}

/// A kernel of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    pub name: String,
    pub span: Span,
    /// Over the distance in bandwidths, in the place of x.
    pub value: Expr,
    pub support: Spanned<f64>,
    pub doc: Option<String>,
}

/// Where kernels without an end are cut off.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Cutoff {
    /// In bandwidths.
    Radius(f64),
    /// At the least radius with this relative error of the dispersion, before it is compensated.
    Error(f64),
}

impl Default for Cutoff {
    /// Half a digit below what a plume of 10⁵ particles shows; about five bandwidths.
    fn default() -> Self {
        Self::Error(1e-5)
    }
}

/// Radii that a kernel may be cut off at, in bandwidths.
pub const CUTOFFS: RangeInclusive<f64> = 1.0..=10.0;
/// Errors of the dispersion that a radius may be chosen by.
const ERRORS: RangeInclusive<f64> = 1e-12..=0.1;
/// Bandwidths that a kernel of a scene may be long.
const LONGEST_SUPPORT: f64 = 100.0;

/// Lengths that only a bandwidth can name, in the order of the inputs of its tape: the one that makes the leading
/// error of a step vanish, and the mean distance of particles.
pub const WORDS_OF_LENGTH: [&str; 2] = ["collocation", "spacing"];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    Kernel,
    Bandwidth,
    Fraction,
    Normalise,
    Integrate,
    Cutoff,
    Error,
    Compensate,
    /// Of an average: read elsewhere.
    Bins,
}

const WORDS: &[(&str, Word)] = &[
    ("kernel", Word::Kernel),
    ("bandwidth", Word::Bandwidth),
    ("mixing_fraction", Word::Fraction),
    ("normalise", Word::Normalise),
    ("integrate", Word::Integrate),
    ("cutoff", Word::Cutoff),
    ("diffusion_error", Word::Error),
    ("compensate", Word::Compensate),
];

/// Of a mean over the parcels around: nothing disperses by it.
const WORDS_OF_MEANS: &[(&str, Word)] = &[
    ("kernel", Word::Kernel),
    ("bandwidth", Word::Bandwidth),
    ("normalise", Word::Normalise),
    ("cutoff", Word::Cutoff),
    ("bins", Word::Bins),
];

/// An exchange, kernels of the scene, means that zones exchange with, and how concentrations of masses are found.
type Exchanges = (Option<Exchange>, Vec<Kernel>, Option<Averaging>, Option<Estimation>);

/// The exchange of a scene, if it has one, its kernels in the order of the text, and what else has kernels; `None` if
/// something is wrong.
pub(super) fn exchanges<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> Option<Exchanges> {
    let kernels: Vec<Option<Kernel>> =
        statements.kernels.iter().map(|written| own(checker, written)).collect();
    let (exchange, averaging) = (statement(checker, statements), averaging(checker, statements));
    let estimation = estimation(checker, statements);
    Some((exchange?, kernels.into_iter().collect::<Option<_>>()?, averaging?, estimation?))
}

/// `Some(None)` without the statement.
fn statement<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> Option<Option<Exchange>> {
    let Some((span, fields)) = statements.exchange else { return Some(None) };
    let words = ("a setting of an exchange", WORDS, &[0, 1][..]);
    settings(checker, statements, (span, fields), words).map(|(found, _)| Some(found))
}

/// `Some(None)` without a mean over the parcels around.
fn averaging<'a>(checker: &mut Checker<'a>, statements: &Statements<'a>) -> Option<Option<Averaging>> {
    let Some((span, average)) = statements.average else { return Some(None) };
    if average.settings.is_empty() {
        return Some(None);
    }
    let words = ("a setting of an average", WORDS_OF_MEANS, &[1][..]);
    let (found, seen) = settings(checker, statements, (span, &average.settings), words)?;
    let place = average.settings.first().map_or(span, |field| field.name.span);
    if !seen.contains(&Word::Bandwidth) {
        checker.report(
            Diagnostic::error(M001, "a mean over the parcels around has no bandwidth")
                .at(place, "without a `bandwidth`")
                .found("no `bandwidth`")
                .expected("`bandwidth` and a length")
                .help("add for example `bandwidth 3 * spacing`"),
        );
        return None;
    }
    if statements.zones.is_none() {
        checker.report(
            Diagnostic::error(M001, "nothing exchanges with a mean over the parcels around")
                .at(place, "a kernel without `mixing zones`")
                .found("no `mixing zones`")
                .expected("a `mixing zones` statement")
                .help("add zones, or leave all but `bins` out of `average`"),
        );
        return None;
    }
    let Exchange { kernel, bandwidth, normalisation, cutoff, .. } = found;
    Some(Some(Averaging { span: place, kernel, bandwidth, normalisation, cutoff }))
}

/// What they are called, which there are, and which words of length a bandwidth may name.
type Words<'w> = (&'w str, &'w [(&'w str, Word)], &'w [usize]);

/// What fields of a statement set, and which of them stand there.
fn settings<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    (span, fields): (Span, &'a [tree::Field]),
    (what, words, lengths): Words<'_>,
) -> Option<(Exchange, Vec<Word>)> {
    let bandwidth = Expr::leaf(Node::Axis(0), Dimension::LENGTH, span);
    let mut found = Exchange {
        span,
        kernel: Spanned::new(Choice::Catalogue(kernel::ALL[0].name), span),
        bandwidth: Spanned::new(bandwidth, span),
        mixing_fraction: 1.0,
        normalisation: Normalisation::Arithmetic,
        integration: Integration::Explicit,
        cutoff: Cutoff::default(),
        is_compensated: true,
    };
    let bins = statements.average.and_then(|(_, average)| average.bins.as_ref());
    let bins = bins.filter(|_| words.iter().any(|(_, word)| *word == Word::Bins));
    let mut seen: Vec<(Word, &tree::Name)> = bins.map(|(name, _)| (Word::Bins, name)).into_iter().collect();
    let mut is_right = true;
    for field in fields {
        let word = checker.word(&field.name, what, words);
        let first = seen.iter().find(|(earlier, _)| word.is_some_and(|word| excludes(*earlier, word)));
        if let Some((_, first)) = first {
            report_twice(checker, &field.name, first, what);
        }
        let Some(word) = word.filter(|_| first.is_none()) else {
            is_right = false;
            continue;
        };
        seen.push((word, &field.name));
        is_right &= set(checker, statements, field, (word, lengths), &mut found).is_some();
    }
    is_right.then(|| (found, seen.into_iter().map(|(word, _)| word).collect()))
}

/// Whether two settings say where one thing ends.
fn excludes(earlier: Word, word: Word) -> bool {
    let is_end = |word: Word| matches!(word, Word::Cutoff | Word::Error);
    earlier == word || (is_end(earlier) && is_end(word))
}

fn report_twice(checker: &mut Checker<'_>, name: &tree::Name, first: &tree::Name, what: &str) {
    let message = if name.value == first.value {
        let whose = what.trim_start_matches("a setting of ");
        Diagnostic::error(M002, format!("a second `{}` of {whose}", name.value))
            .found(format!("`{}` twice", name.value))
            .expected(format!("one `{}`", name.value))
    } else {
        Diagnostic::error(M002, "`cutoff` and `diffusion_error` both say where a kernel ends")
            .found("two ends of one kernel")
            .expected("one of them")
    };
    checker.report(message.at(name.span, "here again").also(first.span, "first here"));
}

fn set<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
    field: &'a tree::Field,
    (word, lengths): (Word, &[usize]),
    found: &mut Exchange,
) -> Option<()> {
    match word {
        Word::Kernel => found.kernel = kernel_named(checker, statements, field)?,
        Word::Bandwidth => found.bandwidth = bandwidth(checker, &field.value, lengths)?,
        Word::Fraction => found.mixing_fraction = fraction(checker, &field.value)?,
        Word::Normalise => {
            found.normalisation = choice(checker, field, "a normalisation", NORMALISATIONS)?;
        }
        Word::Integrate => {
            found.integration = choice(checker, field, "an integration", INTEGRATIONS)?;
        }
        Word::Cutoff => {
            found.cutoff = Cutoff::Radius(within(checker, &field.value, "the cut-off", CUTOFFS)?);
        }
        Word::Error => {
            let what = "the error of the dispersion";
            found.cutoff = Cutoff::Error(within(checker, &field.value, what, ERRORS)?);
        }
        Word::Compensate => {
            found.is_compensated = choice(checker, field, "an answer", &[("on", true), ("off", false)])?;
        }
        Word::Bins => {}
    }
    Some(())
}

fn within<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Expr,
    what: &str,
    range: RangeInclusive<f64>,
) -> Option<f64> {
    let value = checker.slot(written, what, Dimension::NONE)?;
    let rule = format!("from {} to {}", precise(*range.start()), precise(*range.end()));
    checker.require(range.contains(&value.value), what, precise(value.value), &rule, value.span)?;
    Some(value.value)
}

fn fraction<'a>(checker: &mut Checker<'a>, written: &'a tree::Expr) -> Option<f64> {
    let what = "the part of the dispersion that mixes";
    let value = checker.slot(written, what, Dimension::NONE)?;
    let is_fine = (0.0..=1.0).contains(&value.value);
    checker.require(is_fine, what, precise(value.value), "from 0 to 1", value.span)?;
    Some(value.value)
}

/// A length, in which some of two words have a meaning that they have nowhere else.
fn bandwidth<'a>(
    checker: &mut Checker<'a>,
    written: &'a tree::Expr,
    lengths: &[usize],
) -> Option<Spanned<Expr>> {
    are_free(checker, written, lengths)?;
    let length = |idx: usize| Expr::leaf(Node::Axis(idx), Dimension::LENGTH, written.span);
    let locals: Locals = lengths.iter().map(|&idx| (WORDS_OF_LENGTH[idx].to_owned(), length(idx))).collect();
    checker.checked.insert(written.span, written);
    let value = checker.check_with(written, Allow::CONSTANT, &locals)?;
    let what = "the bandwidth";
    checker.expect_dimension(written, &value, what, &[Dimension::LENGTH])?;
    if let Some(constant) = value.value() {
        let found = format!("{} m", precise(constant));
        checker.require(constant > 0.0, what, found, "above zero", written.span)?;
    }
    Some(Spanned::new(value, written.span))
}

/// A name of the scene would be hidden by what it means in a bandwidth.
fn are_free(checker: &mut Checker<'_>, written: &tree::Expr, lengths: &[usize]) -> Option<()> {
    let mut names = Vec::new();
    collect_names(written, &mut names);
    let hidden = lengths.iter().find_map(|&idx| {
        let word = WORDS_OF_LENGTH[idx];
        let entry = checker.scope.get(word).filter(|_| names.iter().any(|name| name == word))?;
        Some((word, entry.origin.describe(), entry.span))
    });
    let Some((word, what, defined)) = hidden else { return Some(()) };
    if let Some(entry) = checker.scope.get_mut(word) {
        entry.n_uses += 1;
    }
    checker.report(
        Diagnostic::error(D003, format!("`{word}` has a meaning of its own in a bandwidth"))
            .at(defined, format!("{what} of this name"))
            .also(written.span, "which of the two is meant here?")
            .found(format!("`{word}`"))
            .expected("a name of your own")
            .help("call it something else"),
    );
    None
}

fn kernel_named(
    checker: &mut Checker<'_>,
    statements: &Statements<'_>,
    field: &tree::Field,
) -> Option<Spanned<Choice>> {
    let span = field.value.span;
    let own: Vec<&str> = statements.kernels.iter().map(|kernel| kernel.name.value.as_str()).collect();
    // A scene may have a kernel of the name of one of the catalogue: then it is its own.
    let all = own.iter().enumerate().map(|(idx, name)| (*name, Choice::Own(idx)));
    let all = all.chain(kernel::ALL.iter().map(|item| (item.name, Choice::Catalogue(item.name))));
    let words: Vec<(&str, Choice)> = all.collect();
    let chosen = choice(checker, field, "a kernel", &words)?;
    if let Choice::Own(idx) = chosen
        && let Some(entry) = checker.scope.get_mut(own[idx])
        && matches!(entry.origin, Origin::Kernel)
    {
        entry.n_uses += 1;
    }
    Some(Spanned::new(chosen, span))
}

/// One of a list of words.
fn choice<T: Copy>(
    checker: &mut Checker<'_>,
    field: &tree::Field,
    what: &str,
    words: &[(&str, T)],
) -> Option<T> {
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

fn own<'a>(checker: &mut Checker<'a>, written: &'a tree::Kernel) -> Option<Kernel> {
    let name = &written.name;
    let distance = Expr::leaf(Node::Axis(0), Dimension::NONE, written.parameter.span);
    let locals: Locals = vec![(written.parameter.value.clone(), distance)];
    checker.checked.insert(written.value.span, &written.value);
    let value = checker.check_with(&written.value, Allow::CONSTANT, &locals);
    let what = format!("the kernel `{}`", name.value);
    let value = value
        .filter(|value| checker.expect_dimension(&written.value, value, &what, &[Dimension::NONE]).is_some());
    let what = format!("the support of `{}`", name.value);
    let support = checker.slot(&written.support, &what, Dimension::NONE);
    let (value, support) = (value?, support?);
    let is_fine = support.value > 0.0 && support.value <= LONGEST_SUPPORT;
    let rule = format!("above 0, at most {LONGEST_SUPPORT}");
    checker.require(is_fine, &what, precise(support.value), &rule, support.span)?;
    Some(Kernel {
        name: name.value.clone(),
        span: name.span,
        value,
        support: Spanned::new(support.value, support.span),
        doc: written.doc.as_ref().map(|doc| doc.value.clone()),
    })
}

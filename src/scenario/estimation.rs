//! The statement `kernel … adaptive`: how concentrations are found of particles that carry mass, and how these react.
//!
//! Owns its words, ranges and defaults. May use the scenario's types. It deliberately finds no bandwidth: the engine does.

use super::check::Checker;
use super::collect::Statements;
use crate::diagnostic::codes::{M001, M002, M004, M005};
use crate::diagnostic::{Diagnostic, precise};
use crate::source::{Span, Spanned};
use crate::syntax::tree::{self, EstimateValue, ExprKind};
use crate::units::Dimension;
use serde::{Deserialize, Serialize};

/// Cells of a lattice: as many as bins of averages.
const MOST_CELLS: f64 = 1e8;
/// Loops that bandwidths may take to settle.
const MOST_LOOPS: f64 = 1000.0;
/// Steps from one search for bandwidths to the next.
const MOST_STEPS: f64 = 1e9;

/// Orders of densities.
pub const SECOND: u8 = 2;
pub const FOURTH: u8 = 4;

/// How densities are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Manner {
    /// Kernels of their own in each cell.
    Adaptive,
    /// One kernel for all particles of a species, found from these.
    Global,
    /// One kernel of a given size.
    Fixed,
    /// Masses of cells.
    Histogram,
    /// Pairs meet as far as a step disperses them.
    Collocation,
}

/// How the one kernel of a species is found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rule {
    #[default]
    PlugIn,
    NormalReference,
    Botev,
}

/// What stands for the number of particles where masses differ.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Weighing {
    #[default]
    OfAll,
    Mean,
    Number,
    OfCell,
}

/// What a reaction does to particles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Reacting {
    /// Their masses change, by what reacts in the cells that their kernels reach.
    Masses,
    /// Pairs of them meet by chance, and are gone.
    Pairs,
}

const NAMES: &[(&str, Option<Manner>)] =
    &[("gaussian", None), ("histogram", Some(Manner::Histogram)), ("collocation", Some(Manner::Collocation))];
const MANNERS: &[(&str, Manner)] =
    &[("adaptive", Manner::Adaptive), ("global", Manner::Global), ("fixed", Manner::Fixed)];
const RULES: &[(&str, Rule)] =
    &[("plug_in", Rule::PlugIn), ("normal_reference", Rule::NormalReference), ("botev", Rule::Botev)];
const WEIGHINGS: &[(&str, Weighing)] = &[
    ("of_all", Weighing::OfAll),
    ("mean", Weighing::Mean),
    ("number", Weighing::Number),
    ("of_cell", Weighing::OfCell),
];
const REACTING: &[(&str, Reacting)] = &[("masses", Reacting::Masses), ("pairs", Reacting::Pairs)];

impl Manner {
    /// As scenes have it.
    pub fn words(self) -> &'static str {
        match self {
            Self::Adaptive => "gaussian adaptive",
            Self::Global => "gaussian global",
            Self::Fixed => "gaussian fixed",
            Self::Histogram => "histogram",
            Self::Collocation => "collocation",
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Word {
    Bandwidth,
    Grid,
    Correct,
    Shape,
    Orient,
    Order,
    Rule,
    Weighing,
    Tolerance,
    Loops,
    Refresh,
    Narrowing,
    Reactions,
}

const WORDS: &[(&str, Word)] = &[
    ("bandwidth", Word::Bandwidth),
    ("grid", Word::Grid),
    ("correct", Word::Correct),
    ("shape", Word::Shape),
    ("orient", Word::Orient),
    ("order", Word::Order),
    ("rule", Word::Rule),
    ("weighing", Word::Weighing),
    ("tolerance", Word::Tolerance),
    ("loops", Word::Loops),
    ("refresh", Word::Refresh),
    ("narrowing", Word::Narrowing),
    ("reactions", Word::Reactions),
];

impl Word {
    /// Whether a manner has use for it.
    fn is_of(self, manner: Manner) -> bool {
        let is_gaussian = matches!(manner, Manner::Adaptive | Manner::Global | Manner::Fixed);
        let is_found = matches!(manner, Manner::Adaptive | Manner::Global);
        match self {
            Self::Grid | Self::Reactions => true,
            Self::Bandwidth | Self::Correct => is_gaussian,
            Self::Shape | Self::Weighing | Self::Refresh | Self::Narrowing => is_found,
            Self::Orient | Self::Order | Self::Tolerance | Self::Loops => manner == Manner::Adaptive,
            Self::Rule => manner == Manner::Global,
        }
    }
}

/// A statement `kernel gaussian adaptive { … }`.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimation {
    pub span: Span,
    pub manner: Manner,
    /// Bounds, or the same twice, m; where there are none the cells and the domain set them.
    pub bandwidth: Option<Spanned<[f64; 2]>>,
    /// Cells along each axis of the domain.
    pub cells: Option<Spanned<Vec<usize>>>,
    pub is_stretched: bool,
    /// Kernels lie along the flow.
    pub is_oriented: bool,
    /// Of which power of bandwidths the bias of densities is that are shown: 2 or 4.
    pub order: u8,
    pub rule: Rule,
    pub weighing: Weighing,
    pub tolerance: f64,
    pub loops: u32,
    pub refresh: u64,
    pub narrowing: f64,
    pub reacting: Option<Spanned<Reacting>>,
}

impl Estimation {
    /// What a scene without the statement has.
    pub fn usual(span: Span) -> Self {
        Self {
            span,
            manner: Manner::Adaptive,
            bandwidth: None,
            cells: None,
            is_stretched: true,
            is_oriented: false,
            order: SECOND,
            rule: Rule::PlugIn,
            weighing: Weighing::OfAll,
            tolerance: 0.02,
            loops: 20,
            refresh: 20,
            narrowing: 0.08,
            reacting: None,
        }
    }
}

/// `Some(None)` without the statement; `None` if something is wrong.
pub(super) fn estimation<'a>(
    checker: &mut Checker<'a>,
    statements: &Statements<'a>,
) -> Option<Option<Estimation>> {
    let Some((span, written)) = statements.estimate else { return Some(None) };
    let manner = manner(checker, written);
    let mut found = Estimation { manner: manner.unwrap_or(Manner::Adaptive), ..Estimation::usual(span) };
    let mut seen: Vec<(Word, &tree::Name)> = Vec::new();
    let mut is_right = manner.is_some();
    for entry in &written.entries {
        let word = checker.word(&entry.name, "an entry of a kernel", WORDS);
        let Some(word) = word else {
            is_right = false;
            continue;
        };
        if let Some((_, first)) = seen.iter().find(|(other, _)| *other == word) {
            report_twice(checker, &entry.name, first);
            is_right = false;
            continue;
        }
        seen.push((word, &entry.name));
        if manner.is_some_and(|manner| !word.is_of(manner)) {
            report_unfit(checker, written, entry, found.manner);
            is_right = false;
            continue;
        }
        is_right &= set(checker, entry, word, &mut found).is_some();
    }
    if found.manner == Manner::Fixed && is_right && found.bandwidth.is_none() {
        checker.report(
            Diagnostic::error(M001, "a kernel of a fixed size has no `bandwidth`")
                .at(span, "without a `bandwidth`")
                .found("no `bandwidth`")
                .expected("`bandwidth` and a length")
                .help("add for example `bandwidth 5 cm`, or let it be found: `kernel gaussian global`"),
        );
        return None;
    }
    is_right.then_some(Some(found))
}

fn manner(checker: &mut Checker<'_>, written: &tree::Estimate) -> Option<Manner> {
    let of_name = checker.word(&written.name, "a kernel", NAMES)?;
    match (of_name, &written.manner) {
        (Some(manner), None) => Some(manner),
        (None, Some(word)) => checker.word(word, "a way to find bandwidths", MANNERS),
        (None, None) => {
            checker.report(
                Diagnostic::error(M001, "nothing says how bandwidths are found")
                    .at(written.name.span, "without a further word")
                    .found("`gaussian` alone")
                    .expected("`adaptive`, `global` or `fixed`")
                    .help("write for example `kernel gaussian adaptive`"),
            );
            None
        }
        (Some(manner), Some(word)) => {
            checker.report(
                Diagnostic::error(M004, format!("`{}` has no further word", manner.words()))
                    .at(word.span, "this word")
                    .found(format!("`{}`", word.value))
                    .expected("none"),
            );
            None
        }
    }
}

fn report_twice(checker: &mut Checker<'_>, name: &tree::Name, first: &tree::Name) {
    checker.report(
        Diagnostic::error(M002, format!("a second `{}` of the kernel", name.value))
            .at(name.span, "here again")
            .also(first.span, "first here")
            .found(format!("`{}` twice", name.value))
            .expected(format!("one `{}`", name.value)),
    );
}

fn report_unfit(
    checker: &mut Checker<'_>,
    written: &tree::Estimate,
    entry: &tree::EstimateEntry,
    manner: Manner,
) {
    let fits = |(word, it): &(&str, Word)| it.is_of(manner).then(|| format!("`{word}`"));
    let all: Vec<String> = WORDS.iter().filter_map(fits).collect();
    let place = written.manner.as_ref().map_or(written.name.span, |word| word.span);
    checker.report(
        Diagnostic::error(M004, format!("`kernel {}` has no `{}`", manner.words(), entry.name.value))
            .at(entry.name.span, "this entry")
            .also(place, "of this kernel")
            .found(format!("`{}`", entry.name.value))
            .expected(all.join(", ")),
    );
}

fn set<'a>(
    checker: &mut Checker<'a>,
    entry: &'a tree::EstimateEntry,
    word: Word,
    found: &mut Estimation,
) -> Option<()> {
    match word {
        Word::Bandwidth => found.bandwidth = Some(bandwidth(checker, entry, found.manner)?),
        Word::Grid => found.cells = Some(cells(checker, entry)?),
        Word::Correct => choice(checker, entry, "what is corrected", &[("boundaries", ())])?,
        Word::Shape => {
            found.is_stretched =
                choice(checker, entry, "a shape of kernels", &[("stretched", true), ("round", false)])?;
        }
        Word::Orient => {
            found.is_oriented =
                choice(checker, entry, "a direction of kernels", &[("flow", true), ("axes", false)])?;
        }
        Word::Order => {
            let what = "the order of densities";
            let value = number(checker, entry, what)?;
            let is_fine = [SECOND, FOURTH].map(f64::from).contains(&value.value);
            checker.require(is_fine, what, precise(value.value), "2 or 4", value.span)?;
            found.order = value.value as u8;
        }
        Word::Rule => found.rule = choice(checker, entry, "a rule for one bandwidth", RULES)?,
        Word::Weighing => found.weighing = choice(checker, entry, "a weighing of masses", WEIGHINGS)?,
        Word::Reactions => {
            let reacting = choice(checker, entry, "a way to react", REACTING)?;
            found.reacting = Some(Spanned::new(reacting, entry.name.span));
        }
        Word::Tolerance => {
            let value = number(checker, entry, "the tolerance of bandwidths")?;
            let is_fine = (1e-12..=1.0).contains(&value.value);
            let what = "the tolerance of bandwidths";
            checker.require(is_fine, what, precise(value.value), "from 1e-12 to 1", value.span)?;
            found.tolerance = value.value;
        }
        Word::Narrowing => {
            let what = "the part of a bandwidth that kernels have which react";
            let value = number(checker, entry, what)?;
            let is_fine = (1e-3..=1.0).contains(&value.value);
            checker.require(is_fine, what, precise(value.value), "from 0.001 to 1", value.span)?;
            found.narrowing = value.value;
        }
        Word::Loops => {
            let value = number(checker, entry, "the number of loops")?;
            found.loops = checker.count(value.value, "the number of loops", MOST_LOOPS, value.span)? as u32;
        }
        Word::Refresh => {
            let what = "the number of steps between two searches for bandwidths";
            let value = number(checker, entry, what)?;
            found.refresh = checker.count(value.value, what, MOST_STEPS, value.span)?;
        }
    }
    Some(())
}

fn place_of(entry: &tree::EstimateEntry) -> Span {
    match &entry.value {
        EstimateValue::One(it) => it.span,
        EstimateValue::Range(it) => it.low.span.to(it.high.span),
        EstimateValue::Counts(list) => {
            list.first().zip(list.last()).map_or(entry.name.span, |(first, last)| first.span.to(last.span))
        }
    }
}

fn one<'a>(checker: &mut Checker<'a>, entry: &'a tree::EstimateEntry, what: &str) -> Option<&'a tree::Expr> {
    if let EstimateValue::One(it) = &entry.value {
        return Some(it);
    }
    checker.report(
        Diagnostic::error(M004, format!("this is not {what}"))
            .at(place_of(entry), "several values")
            .found(if matches!(entry.value, EstimateValue::Range(_)) { "a range" } else { "counts" })
            .expected("one value"),
    );
    None
}

fn number<'a>(
    checker: &mut Checker<'a>,
    entry: &'a tree::EstimateEntry,
    what: &str,
) -> Option<super::slot::Value> {
    let written = one(checker, entry, what)?;
    checker.slot(written, what, Dimension::NONE)
}

/// One of a list of words.
fn choice<T: Copy>(
    checker: &mut Checker<'_>,
    entry: &tree::EstimateEntry,
    what: &str,
    words: &[(&str, T)],
) -> Option<T> {
    if let EstimateValue::One(written) = &entry.value
        && let ExprKind::Path(path) = &written.kind
        && let [name] = path.as_slice()
    {
        return checker.word(name, what, words);
    }
    let all: Vec<String> = words.iter().map(|(word, _)| format!("`{word}`")).collect();
    checker.report(
        Diagnostic::error(M004, format!("this is not {what}"))
            .at(place_of(entry), "not a word")
            .found("a value")
            .expected(all.join(", ")),
    );
    None
}

/// Bounds, or one width.
fn bandwidth<'a>(
    checker: &mut Checker<'a>,
    entry: &'a tree::EstimateEntry,
    manner: Manner,
) -> Option<Spanned<[f64; 2]>> {
    let what = "the bandwidth";
    let span = place_of(entry);
    let bounds = match &entry.value {
        EstimateValue::Range(range) => {
            let (low, high, _) = checker.range(range, "the range of bandwidths", Some(Dimension::LENGTH))?;
            [low.value, high.value]
        }
        _ => {
            let written = one(checker, entry, what)?;
            [checker.slot(written, what, Dimension::LENGTH)?.value; 2]
        }
    };
    let found = format!("{} m", precise(bounds[0]));
    checker.require(bounds[0] > 0.0 && bounds[1].is_finite(), what, found, "above zero", span)?;
    if manner == Manner::Fixed && bounds[0] != bounds[1] {
        checker.report(
            Diagnostic::error(M004, "a kernel of a fixed size has one bandwidth")
                .at(span, "a range")
                .found("a range")
                .expected("one length")
                .help("write one length, or let it be found: `kernel gaussian adaptive`"),
        );
        return None;
    }
    Some(Spanned::new(bounds, span))
}

/// Cells along each axis: their numbers, or their edges.
fn cells<'a>(checker: &mut Checker<'a>, entry: &'a tree::EstimateEntry) -> Option<Spanned<Vec<usize>>> {
    const WHAT: &str = "the number of cells";
    let span = place_of(entry);
    let written = match &entry.value {
        EstimateValue::Counts(counts) => return super::geometry::grid(checker, counts, WHAT, span),
        _ => one(checker, entry, "a grid")?,
    };
    let n_axes = checker.axes.len();
    let edges: Vec<&'a tree::Expr> = match &written.kind {
        ExprKind::Tuple(list) => list.iter().collect(),
        _ => vec![written; n_axes],
    };
    if edges.len() != n_axes {
        checker.report(
            Diagnostic::error(M004, "edges of cells must be given for each axis of the domain")
                .at(span, format!("{} here", edges.len()))
                .found(format!("{} edges", edges.len()))
                .expected(format!("one for all, or {n_axes}")),
        );
        return None;
    }
    let mut counts = Vec::new();
    for (idx, edge) in edges.into_iter().enumerate() {
        let is_count = n_axes == 1 && is_bare(edge);
        let dimension = if is_count { Dimension::NONE } else { Dimension::LENGTH };
        let value = checker.slot(edge, "the edge of a cell", dimension)?;
        if is_count {
            counts.push(checker.count(value.value, WHAT, MOST_CELLS, value.span)? as usize);
            continue;
        }
        let &(_, low, high) = checker.extents.get(idx)?;
        let extent = high - low;
        let found = format!("{} m", precise(value.value));
        let rule = "above zero, and an extent of the domain at most";
        let is_fine = value.value > 0.0 && value.value <= extent * (1.0 + 1e-9);
        checker.require(is_fine, "the edge of a cell", found, rule, value.span)?;
        // Cells are equal, and fill the domain: the next finer ones that do.
        let n = (extent / value.value * (1.0 - 1e-9)).ceil().max(1.0);
        checker.require(n <= MOST_CELLS, WHAT, precise(n), "at most 1e8", value.span)?;
        counts.push(n as usize);
    }
    let total: f64 = counts.iter().map(|&n| n as f64).product();
    if total > MOST_CELLS {
        checker.report(
            Diagnostic::error(M005, "the grid has too many cells")
                .at(span, format!("{} cells", precise(total)))
                .found(format!("{} cells", precise(total)))
                .expected("at most 1e8")
                .help("use larger cells: a kernel should reach a few of them"),
        );
        return None;
    }
    Some(Spanned::new(counts, span))
}

fn is_bare(written: &tree::Expr) -> bool {
    match &written.kind {
        ExprKind::Number(number) => number.unit.is_none(),
        _ => false,
    }
}

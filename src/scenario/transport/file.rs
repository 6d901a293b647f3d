//! `flow table`, `flow grid` and `flow modflow`: files, columns, units.
//!
//! Owns the entries of these statements. May use the scenario's slots. It deliberately looks into no file: whether
//! they hold what is said of them is found by whoever reads them.

use super::super::check::Checker;
use super::file_columns::{
    has_ending, of_faces, only_name, only_text, per_axis, single, table_format, unit_of, unknown_format,
    wrong_value,
};
use super::flow_file::{FileForm, FlowFacts, FlowFile, ModflowForm, NamedFile, TableForm, Velocity};
use super::sides::side_words;
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{D009, M001, M002};
use crate::source::Span;
use crate::syntax::tree::{Column, FileEntry, FileValue, Name, Text};
use crate::units::Dimension;

/// Flow from files in a scenario.
#[derive(Debug, Clone, PartialEq)]
pub struct FileFlow {
    pub file: FlowFile,
    /// Where each file is named, …
    pub spans: Vec<Span>,
    /// … and each package whose side is given, in their order.
    pub package_spans: Vec<Span>,
    /// Where a column is said to hold the porosity.
    pub porosity_span: Option<Span>,
    /// Filled in by whoever reads the files.
    pub facts: Option<FlowFacts>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    Table,
    Grid,
    Modflow,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Entry {
    At,
    Velocity,
    Discharge,
    Normal,
    Porosity,
    Head,
    Conductivity,
    Grid,
    Heads,
    Length,
    Time,
    Origin,
    /// Twice the axis of the domain plus one at its upper end.
    Side(usize),
}

const OF_TABLE: &[(&str, Entry)] = &[
    ("at", Entry::At),
    ("velocity", Entry::Velocity),
    ("discharge", Entry::Discharge),
    ("normal", Entry::Normal),
    ("porosity", Entry::Porosity),
    ("head", Entry::Head),
    ("conductivity", Entry::Conductivity),
];
const OF_GRID: &[(&str, Entry)] = &[("velocity", Entry::Velocity), ("discharge", Entry::Discharge)];
const OF_MODFLOW: &[(&str, Entry)] = &[
    ("grid", Entry::Grid),
    ("heads", Entry::Heads),
    ("length", Entry::Length),
    ("time", Entry::Time),
    ("origin", Entry::Origin),
];

/// The entries of one statement, each looked up.
struct Entries<'a> {
    word: &'a Name,
    list: Vec<(Entry, &'a FileEntry)>,
}

pub fn file<'a>(
    checker: &mut Checker<'a>,
    kind: FileKind,
    word: &'a Name,
    names: &'a [Text],
    entries: &'a [FileEntry],
) -> Option<FileFlow> {
    let indices: Vec<usize> = checker.axes.iter().map(|(_, index)| *index).collect();
    let words: Vec<(&str, Entry)> = match kind {
        FileKind::Table => OF_TABLE.to_vec(),
        FileKind::Grid => OF_GRID.to_vec(),
        FileKind::Modflow => {
            let sides = side_words(&indices).into_iter();
            let side =
                |(word, (axis, end)): (&'static str, (usize, usize))| (word, Entry::Side(2 * axis + end));
            OF_MODFLOW.iter().copied().chain(sides.map(side)).collect()
        }
    };
    let what = format!("an entry of `flow {}`", word.value);
    let mut is_right = true;
    let mut found: Vec<(Entry, &FileEntry)> = Vec::new();
    for entry in entries {
        let Some(own) = checker.word(&entry.word, &what, &words) else {
            is_right = false;
            continue;
        };
        if let Some((_, first)) = found.iter().find(|(other, _)| *other == own) {
            checker.report(
                Diagnostic::error(M002, format!("`{}` is given twice", entry.word.value))
                    .at(entry.word.span, "here again")
                    .also(first.word.span, "first here")
                    .found(format!("`{}` twice", entry.word.value))
                    .expected(format!("one `{}`", entry.word.value)),
            );
            is_right = false;
            continue;
        }
        found.push((own, entry));
    }
    let entries = Entries { word, list: found };
    let (form, mut wanted) = match kind {
        FileKind::Table => (entries.table(checker, names), Vec::new()),
        FileKind::Grid => (entries.arrays(checker, names, indices.len()), Vec::new()),
        FileKind::Modflow => entries.modflow(checker, names)?,
    };
    wanted.splice(0..0, names);
    let files: Option<Vec<NamedFile>> =
        wanted.iter().map(|name| checker.data_file(name)).collect::<Vec<_>>().into_iter().collect();
    let (form, files) = (form?, files?);
    let spans = wanted.iter().map(|name| name.span).collect();
    let package_spans = entries.packages().map(|(_, package)| package.name.span).collect();
    let porosity_span = entries.get(Entry::Porosity).map(|entry| entry.word.span);
    let file = FlowFile { form, files };
    is_right.then_some(FileFlow { file, spans, package_spans, porosity_span, facts: None })
}

impl<'a> Entries<'a> {
    fn get(&self, wanted: Entry) -> Option<&'a FileEntry> {
        self.list.iter().find(|(entry, _)| *entry == wanted).map(|(_, entry)| *entry)
    }

    fn need(
        &self,
        checker: &mut Checker<'a>,
        wanted: Entry,
        what: &str,
        example: &str,
    ) -> Option<&'a FileEntry> {
        let found = self.get(wanted);
        if found.is_none() {
            checker.report(
                Diagnostic::error(M001, format!("`flow {}` has no {what}", self.word.value))
                    .at(self.word.span, format!("no {what} in its braces"))
                    .found(format!("no {what}"))
                    .expected(format!("one {what}"))
                    .help(format!("add for example `{example}`")),
            );
        }
        found
    }

    /// `velocity` or `discharge`.
    fn flow(&self, checker: &mut Checker<'a>, example: &str) -> Option<(&'a FileEntry, bool)> {
        match (self.get(Entry::Velocity), self.get(Entry::Discharge)) {
            (Some(velocity), Some(discharge)) => {
                checker.report(
                    Diagnostic::error(M002, "the flow is given twice")
                        .at(discharge.word.span, "as water per area of the medium")
                        .also(velocity.word.span, "as the velocity of the water in its pores")
                        .found("`velocity` and `discharge`")
                        .expected("one of the two"),
                );
                None
            }
            (Some(velocity), None) => Some((velocity, false)),
            (None, Some(discharge)) => Some((discharge, true)),
            (None, None) => {
                self.need(checker, Entry::Velocity, "`velocity` or `discharge`", example)?;
                None
            }
        }
    }

    fn table(&self, checker: &mut Checker<'a>, names: &'a [Text]) -> Option<FileForm> {
        let is_parquet = table_format(checker, names);
        let at = self.need(checker, Entry::At, "`at`", "at x [m], y [m]");
        let at = at.and_then(|entry| per_axis(checker, entry, Dimension::LENGTH));
        let normal = match self.get(Entry::Normal) {
            Some(entry) => Some(only_name(checker, entry, "normal axis")?.name.value.clone()),
            None => None,
        };
        let flow = self.flow(checker, "velocity vx [m/d], vy [m/d]");
        let flow = flow.and_then(|(entry, is_discharge)| {
            if normal.is_none() {
                return Some((per_axis(checker, entry, Dimension::VELOCITY)?, is_discharge));
            }
            if !is_discharge {
                of_faces(checker, entry.word.span, "`velocity`");
                return None;
            }
            Some((vec![single(checker, entry, Dimension::VELOCITY)?], is_discharge))
        });
        let mut more = [None, None, None];
        let dimensions = [Dimension::NONE, Dimension::LENGTH, Dimension::VELOCITY];
        let mut is_right = true;
        for (idx, entry) in [Entry::Porosity, Entry::Head, Entry::Conductivity].into_iter().enumerate() {
            let Some(written) = self.get(entry) else { continue };
            if normal.is_some() {
                of_faces(checker, written.word.span, &format!("`{}`", written.word.value));
                is_right = false;
                continue;
            }
            more[idx] = single(checker, written, dimensions[idx]);
            is_right &= more[idx].is_some();
        }
        let [porosity, head, conductivity] = more;
        let (is_parquet, at, (flow, is_discharge)) = (is_parquet?, at?, flow?);
        let table = TableForm { is_parquet, at, normal, flow, is_discharge, porosity, head, conductivity };
        is_right.then(|| FileForm::Table(Box::new(table)))
    }

    fn arrays(&self, checker: &mut Checker<'a>, names: &'a [Text], n_axes: usize) -> Option<FileForm> {
        let mut is_right = true;
        for name in names.iter().filter(|name| !has_ending(name, &["npy"])) {
            unknown_format(checker, name, "a file of NumPy, which ends in `.npy`");
            is_right = false;
        }
        if names.len() != 1 && names.len() != n_axes {
            let last = names.last()?;
            let message = "the arrays of a flow are one, or one for each axis of the domain";
            checker.report(
                Diagnostic::error(D009, message)
                    .at(names[0].span.to_if_same_file(last.span), format!("{} files", names.len()))
                    .found(format!("{} files", names.len()))
                    .expected(format!("1 array at the middles of cells, or {n_axes} at faces")),
            );
            return None;
        }
        let (entry, is_discharge) = self.flow(checker, "velocity [m/d]")?;
        if names.len() > 1 && !is_discharge {
            of_faces(checker, entry.word.span, "`velocity`");
            return None;
        }
        let factor = unit_of(checker, entry, Dimension::VELOCITY)?;
        is_right.then_some(FileForm::Arrays(Velocity { is_discharge, factor }))
    }

    /// The form, and the files that its entries name.
    fn modflow(
        &self,
        checker: &mut Checker<'a>,
        names: &'a [Text],
    ) -> Option<(Option<FileForm>, Vec<&'a Text>)> {
        if let [_, second, ..] = names {
            checker.report(
                Diagnostic::error(D009, "one budget file stands behind `modflow`")
                    .at(second.span, "a second file")
                    .found(format!("{} files", names.len()))
                    .expected("the budget file; the others are entries in the braces")
                    .help("write `grid \"model.dis.grb\"` and `heads \"model.hds\"` in the braces"),
            );
            return None;
        }
        let grid = self.need(checker, Entry::Grid, "`grid`", "grid \"model.dis.grb\"");
        let grid = grid.and_then(|entry| only_text(checker, entry, "grid \"model.dis.grb\""));
        let heads = self.get(Entry::Heads);
        let heads = match heads {
            Some(entry) => Some(only_text(checker, entry, "heads \"model.hds\"")?),
            None => None,
        };
        let length = self.need(checker, Entry::Length, "`length`", "length [m]");
        let length = length.and_then(|entry| unit_of(checker, entry, Dimension::LENGTH));
        let time = self.need(checker, Entry::Time, "`time`", "time [d]");
        let time = time.and_then(|entry| unit_of(checker, entry, Dimension::TIME));
        let origin = match self.get(Entry::Origin) {
            None => Some([0.0; 3]),
            Some(FileEntry { value: FileValue::Value(value), .. }) => {
                checker.vector(value, "the corner of the grid", Dimension::LENGTH)
            }
            Some(entry) => wrong_value(checker, entry, "a corner", "origin (0 m, 0 m)"),
        };
        let sides = self.sides(checker);
        let form = (|| {
            let (length, time, origin) = (length?, time?, origin?);
            Some(FileForm::Modflow(ModflowForm { length, time, origin, sides: sides? }))
        })();
        Some((form, [grid?].into_iter().chain(heads).collect()))
    }

    fn sides(&self, checker: &mut Checker<'a>) -> Option<Vec<(String, usize)>> {
        let indices: Vec<usize> = checker.axes.iter().map(|(_, index)| *index).collect();
        for (entry, written) in &self.list {
            if matches!(entry, Entry::Side(_)) && !matches!(written.value, FileValue::Columns(_)) {
                return wrong_value(checker, written, "names of packages", "top RCH, EVT");
            }
        }
        let of_grid = |side: usize| 2 * indices[side / 2] + side % 2;
        Some(self.packages().map(|(side, package)| (package.name.value.clone(), of_grid(side))).collect())
    }

    /// Packages that are named at sides: the side of the domain and the name.
    fn packages(&self) -> impl Iterator<Item = (usize, &'a Column)> {
        self.list.iter().flat_map(|(entry, written)| {
            let (side, names) = match (entry, &written.value) {
                (Entry::Side(side), FileValue::Columns(names)) => (*side, &names[..]),
                _ => (0, &[][..]),
            };
            names.iter().map(move |name| (side, name))
        })
    }
}

//! Two files become one scene.
//!
//! Owns which statements of each belong to it. May use the tree. It deliberately looks at no value.

use super::alias::{Mentions, Stripping};
use super::{Used, defined_by, definitions, sweeps};
use crate::diagnostic::Diagnostic;
use crate::scenario::choice::OUTPUTS;
use crate::source::FileId;
use crate::syntax::tree::{File, Report, Statement, StatementKind, SweepEntry};
use std::collections::BTreeSet;

/// The scene of one used file: its statements, then those of the file that uses it.
pub(super) fn merged(file: &File, used: &Used, all: &[Used]) -> (File, Vec<Diagnostic>) {
    let own = belonging(file, used, all);
    let has_title = own.iter().any(|statement| matches!(statement.kind, StatementKind::Title(_)));
    let names = definitions(&used.file).into_keys().collect();
    // First words of dotted paths: results, and tables with their columns.
    let tables = file.statements.iter().chain(&used.file.statements).filter_map(|it| match &it.kind {
        StatementKind::Data(data) => Some(data.name.value.as_str()),
        _ => None,
    });
    let outputs: Vec<&str> = OUTPUTS.iter().map(|(word, _)| *word).chain(tables).collect();
    let mut stripping = Stripping {
        alias: &used.alias.value,
        path: &used.path,
        used: &names,
        own: &definitions(file),
        outputs: &outputs,
        diagnostics: Vec::new(),
    };
    // The title is that of the file which is run; sweeps and reports of a used scene are its own.
    let is_taken = |statement: &&Statement| match statement.kind {
        StatementKind::Title(_) => !has_title,
        StatementKind::Edition(_)
        | StatementKind::Use(_)
        | StatementKind::Sweep(_)
        | StatementKind::Report(_) => false,
        _ => true,
    };
    let mut statements: Vec<Statement> = used.file.statements.iter().filter(is_taken).cloned().collect();
    for statement in own {
        let mut statement = statement.clone();
        stripping.strip(&mut statement);
        statements.push(statement);
    }
    let merged = File { file: file.file, tokens: file.tokens.clone(), statements };
    (merged, stripping.diagnostics)
}

/// The statements of a file that belong to the scene of `used`: not those that speak of another used
/// scene, and not what is made of them.
fn belonging<'f>(file: &'f File, used: &Used, all: &[Used]) -> Vec<&'f Statement> {
    let mut kept: Vec<&Statement> = file.statements.iter().collect();
    if all.len() < 2 {
        return kept;
    }
    let aliases: BTreeSet<&str> = all.iter().map(|used| used.alias.value.as_str()).collect();
    let speaks_of = |statement: &Statement| Mentions::of(statement, aliases.clone());
    let is_other = |statement: &&Statement| match &statement.kind {
        StatementKind::Sweep(sweep) => sweep.of.as_ref().is_some_and(|of| of.value != used.alias.value),
        StatementKind::Report(report) => is_of_other_sweep(file, used, report),
        _ => speaks_of(statement).scenes.keys().any(|scene| *scene != used.alias.value),
    };
    let mut left_out: BTreeSet<String> = BTreeSet::new();
    let mut leave = |statement: &&Statement| {
        left_out.extend(defined_by(&statement.kind).into_iter().map(|name| name.value.clone()));
    };
    kept.iter().filter(|statement| is_other(statement)).for_each(&mut leave);
    kept.retain(|statement| !is_other(statement));
    loop {
        let follows = |statement: &&Statement| {
            let is_sweep = matches!(statement.kind, StatementKind::Sweep(_));
            !is_sweep && !speaks_of(statement).names.is_disjoint(&left_out)
        };
        let following: Vec<&Statement> = kept.iter().copied().filter(follows).collect();
        if following.is_empty() {
            return kept;
        }
        kept.retain(|statement| !following.iter().any(|other| std::ptr::eq(*other, *statement)));
        for statement in following {
            left_out.extend(defined_by(&statement.kind).into_iter().map(|name| name.value.clone()));
        }
    }
}

/// Whether a report is drawn over axes that only sweeps of other scenes have.
fn is_of_other_sweep(file: &File, used: &Used, report: &Report) -> bool {
    let axes = |is_own: bool| -> BTreeSet<&str> {
        let chosen = sweeps(file)
            .filter(move |sweep| sweep.of.as_ref().is_some_and(|of| of.value == used.alias.value) == is_own);
        chosen.flat_map(|sweep| sweep.entries.iter().flat_map(axis_names)).collect()
    };
    let (own, other) = (axes(true), axes(false));
    let mut names = report.against.iter().chain(&report.by).map(|name| name.value.as_str());
    names.any(|name| other.contains(name) && !own.contains(name))
}

/// What an entry of a sweep sets, without the alias of its scene.
fn axis_names(entry: &SweepEntry) -> Vec<&str> {
    let axes = match entry {
        SweepEntry::Axis(axis) => std::slice::from_ref(axis),
        SweepEntry::Zip(_, axes) => axes,
        _ => &[],
    };
    let last = |name: &'_ str| name.rfind('.').map_or(0, |dot| dot + 1);
    axes.iter().map(|axis| &axis.target.value[last(&axis.target.value)..]).collect()
}

/// The messages about several scenes of one file, each once. A warning about the file itself holds only
/// if it holds for all of them: what one scene does not use another may.
pub(super) fn once(file: FileId, told: Vec<Vec<Diagnostic>>) -> Vec<Diagnostic> {
    let is_same = |a: &Diagnostic, b: &Diagnostic| {
        a.code == b.code && a.primary_span() == b.primary_span() && a.message == b.message
    };
    let holds = |message: &Diagnostic| {
        let is_own = message.primary_span().is_some_and(|span| span.file == file);
        message.is_fatal() || !is_own || told.iter().all(|list| list.iter().any(|it| is_same(it, message)))
    };
    let mut all: Vec<Diagnostic> = Vec::new();
    for message in told.iter().flatten().filter(|message| holds(message)) {
        if !all.iter().any(|known| is_same(known, message)) {
            all.push(message.clone());
        }
    }
    all
}

//! Used scenes: the statements of a file together with those of a file that it uses.
//!
//! Owns the way from `use "column.lam" as column` to the scene that is swept or run. May use `syntax`.
//! It deliberately reads no file: callers put the texts of used files into the sources, or the reason
//! why they could not.

mod alias;
mod check;
mod merge;
mod visit;

pub(super) use check::name_of;

use super::reference::reference_name;
use super::{Scenario, Settings};
use crate::diagnostic::Diagnostic;
use crate::source::{FileId, Sources, Span};
use crate::syntax::tree::{self, StatementKind};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Files that one scene may use.
pub const MAX_USES: usize = 64;

/// The files that a scene uses, read.
#[derive(Debug, Clone, Default)]
pub struct Uses {
    pub list: Vec<Used>,
    /// What is wrong with the texts of used files.
    pub syntax: Vec<Diagnostic>,
    /// What is wrong with the uses themselves.
    pub diagnostics: Vec<Diagnostic>,
    /// Whether every file is there and each has its alias, so that scenes can be put together.
    pub are_whole: bool,
}

/// A file that a scene uses.
#[derive(Debug, Clone)]
pub struct Used {
    pub alias: tree::Name,
    /// As it was written.
    pub path: String,
    pub file: tree::File,
}

impl Uses {
    /// Finds the used files of a scene, the first of `sources`, among the sources.
    pub fn read(file: &tree::File, sources: &Sources) -> Self {
        let mut uses = Self { are_whole: true, ..Self::default() };
        let mut wanted = written(file);
        if let Some(one_more) = wanted.get(MAX_USES) {
            uses.refuse(check::too_many(one_more));
            wanted.truncate(MAX_USES);
        }
        for (idx, statement) in wanted.iter().enumerate() {
            match check::find(file.file, sources, statement, &wanted[..idx]) {
                Ok(id) => uses.add(statement, id, sources),
                Err(message) => uses.refuse(*message),
            }
        }
        for (idx, statement) in wanted.iter().enumerate() {
            if let Some(message) = check::alias(file, statement, &wanted[..idx], &uses.list) {
                uses.refuse(message);
            }
        }
        for used in &uses.list {
            let nested = check::nested(sources, file, used);
            uses.are_whole &= nested.is_empty();
            uses.diagnostics.extend(nested);
        }
        if uses.are_whole {
            uses.diagnostics.extend(check::sweeps_of(file, &wanted));
            uses.diagnostics.extend(check::speaks_of_two(file, &uses.list));
        }
        uses
    }

    fn refuse(&mut self, message: Diagnostic) {
        self.diagnostics.push(message);
        self.are_whole = false;
    }

    fn add(&mut self, statement: &tree::Use, id: FileId, sources: &Sources) {
        let (file, diagnostics) = crate::syntax::parse(id, &sources.file(id).text);
        self.syntax.extend(diagnostics);
        self.list.push(Used { alias: statement.alias.clone(), path: statement.path.value.clone(), file });
    }

    /// The aliases whose scenes a file speaks of; nothing but `None` for a file that uses no other. First
    /// comes that of the sweep of that name, or of the first sweep.
    pub fn aliases(&self, file: &tree::File, sweep: Option<&str>) -> Vec<Option<&str>> {
        let known = |name: &str| self.list.iter().map(|used| used.alias.value.as_str()).find(|a| *a == name);
        let mut aliases: Vec<Option<&str>> = Vec::new();
        let named = sweeps(file).filter(|it| sweep == Some(&it.name.value));
        for alias in named.chain(sweeps(file)).filter_map(|it| known(&it.of.as_ref()?.value)) {
            if !aliases.contains(&Some(alias)) {
                aliases.push(Some(alias));
            }
        }
        if aliases.is_empty() {
            aliases.push(self.list.first().map(|used| used.alias.value.as_str()));
        }
        aliases
    }

    /// The scene of an alias: the statements of the file with those of the used one.
    ///
    /// Without an alias it is the scene of the first sweep. Places keep their files; the tokens are
    /// those of the file that uses the other.
    pub fn base<'f>(
        &self,
        file: &'f tree::File,
        alias: Option<&str>,
    ) -> (Cow<'f, tree::File>, Vec<Diagnostic>) {
        let alias = alias.or_else(|| self.aliases(file, None).first().copied().flatten());
        match self.list.iter().find(|used| Some(used.alias.value.as_str()) == alias) {
            Some(used) => {
                let (merged, diagnostics) = merge::merged(file, used, &self.list);
                (Cow::Owned(merged), diagnostics)
            }
            None => (Cow::Borrowed(file), Vec::new()),
        }
    }
}

/// The names, among the sources, of the files that a scene uses, each with the path as written. Paths
/// that leave the folder of the scene are not among them: a scene may not look there.
pub fn wanted_files(scene: &str, text: &str) -> Vec<(String, String)> {
    if !text.lines().any(|line| line.trim_start_matches('\u{feff}').trim_start().starts_with("use")) {
        return Vec::new();
    }
    let (file, _) = crate::syntax::parse(FileId(0), text);
    let mut list: Vec<(String, String)> = Vec::new();
    for statement in written(&file).into_iter().take(MAX_USES) {
        let path = &statement.path.value;
        if let Some(name) = check::name_of(scene, path)
            && name != scene
            && !list.iter().any(|(known, _)| *known == name)
        {
            list.push((name, path.clone()));
        }
    }
    list
}

fn written(file: &tree::File) -> Vec<&tree::Use> {
    let uses = file.statements.iter().filter_map(|statement| match &statement.kind {
        StatementKind::Use(it) => Some(it),
        _ => None,
    });
    uses.collect()
}

/// The sweeps of a file, whichever scene they are of.
pub fn sweeps(file: &tree::File) -> impl Iterator<Item = &tree::Sweep> {
    file.statements.iter().filter_map(|statement| match &statement.kind {
        StatementKind::Sweep(sweep) => Some(sweep),
        _ => None,
    })
}

/// The names that a statement defines.
fn defined_by(kind: &StatementKind) -> Vec<&tree::Name> {
    match kind {
        StatementKind::Let(it) => vec![&it.name],
        StatementKind::Param(it) => vec![&it.name],
        StatementKind::Function(it) => vec![&it.name],
        StatementKind::Data(it) => vec![&it.name],
        StatementKind::Kernel(it) => vec![&it.name],
        StatementKind::Species(list) => list.iter().map(|species| &species.name).collect(),
        StatementKind::Reaction(it) => it.name.iter().collect(),
        StatementKind::Reference(it) => reference_name(it).into_iter().collect(),
        StatementKind::Measure(it) => vec![&it.name],
        _ => Vec::new(),
    }
}

/// All names that a file defines, with the first place of each.
fn definitions(file: &tree::File) -> BTreeMap<String, Span> {
    let mut all = BTreeMap::new();
    for name in file.statements.iter().flat_map(|statement| defined_by(&statement.kind)) {
        all.entry(name.value.clone()).or_insert(name.span);
    }
    all
}

/// Resolves the scenes that a file speaks of, and gives that of the sweep that the settings name, or of
/// the first one. Settings are those of this scene; what is told of several scenes is told once.
pub fn resolve_all(
    file: &tree::File,
    uses: &Uses,
    sources: &mut Sources,
    settings: &Settings,
    has_syntax_errors: bool,
) -> (Option<Scenario>, Vec<Diagnostic>) {
    let aliases = uses.aliases(file, settings.sweep.as_deref());
    let mut first = None;
    let mut told: Vec<Vec<Diagnostic>> = Vec::new();
    for (idx, alias) in aliases.iter().enumerate() {
        let (base, mut messages) = uses.base(file, *alias);
        let of_scene = if idx == 0 { settings } else { &Settings::default() };
        let (scenario, more) = super::resolve(&base, sources, of_scene, has_syntax_errors);
        // What follows from a path that leads nowhere has been told with it.
        let is_told = |message: &Diagnostic| {
            let span = message.primary_span();
            messages.iter().filter_map(Diagnostic::primary_span).any(|at| {
                span.is_some_and(|span| at.file == span.file && at.start < span.end && span.start < at.end)
            })
        };
        let more: Vec<Diagnostic> = more.into_iter().filter(|message| !is_told(message)).collect();
        messages.extend(more);
        if idx == 0 {
            first = scenario.filter(|_| !crate::diagnostic::any_fatal(&messages));
        }
        told.push(messages);
    }
    (first, merge::once(file.file, told))
}

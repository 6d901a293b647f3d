//! Names of a used scene in the file that uses it: `column.v` is the `v` of `column`.
//!
//! Owns the way from such a path to the name in the merged scene, and what a statement speaks of. May
//! use the tree. It deliberately resolves no name: the phases after it do, in the merged scene.

use super::visit::{Visitor, visit};
use crate::diagnostic::codes::{D004, D005};
use crate::diagnostic::{Diagnostic, did_you_mean};
use crate::source::Span;
use crate::syntax::tree::{Expr, ExprKind, Name, Statement, StatementKind};
use std::collections::{BTreeMap, BTreeSet};

/// What a statement speaks of.
#[derive(Default)]
pub(super) struct Mentions<'a> {
    aliases: BTreeSet<&'a str>,
    /// Used scenes, each with its first place.
    pub scenes: BTreeMap<String, Span>,
    /// Names without an alias, those of functions included.
    pub names: BTreeSet<String>,
}

impl<'a> Mentions<'a> {
    pub(super) fn of(statement: &Statement, aliases: BTreeSet<&'a str>) -> Self {
        let mut mentions = Self { aliases, ..Self::default() };
        let mut kind = statement.kind.clone();
        visit(&mut kind, &mut mentions);
        if let StatementKind::Report(report) = &kind {
            let names = report.against.iter().chain(&report.by).chain([&report.measure]);
            mentions.names.extend(names.map(|name| name.value.clone()));
        }
        mentions
    }

    fn add(&mut self, first: &str, is_path: bool, span: Span) {
        if is_path && self.aliases.contains(first) {
            self.scenes.entry(first.to_owned()).or_insert(span);
        } else {
            self.names.insert(first.to_owned());
        }
    }
}

impl Visitor for Mentions<'_> {
    fn expression(&mut self, expr: &mut Expr) {
        match &expr.kind {
            ExprKind::Path(path) => {
                if let Some(first) = path.first() {
                    self.add(&first.value, path.len() > 1, expr.span);
                }
            }
            ExprKind::Call { function, .. } => {
                let first = function.value.split('.').next().unwrap_or_default();
                self.add(first, function.value.contains('.'), function.span);
            }
            _ => {}
        }
    }

    fn dotted(&mut self, name: &mut Name) {
        let (first, rest) = name.value.split_once('.').unwrap_or((&name.value, ""));
        self.add(first, !rest.is_empty(), name.span);
    }
}

/// Takes an alias off the paths of a statement.
pub(super) struct Stripping<'a> {
    pub alias: &'a str,
    pub path: &'a str,
    /// Names that the used scene has, …
    pub used: &'a BTreeSet<String>,
    /// … and those of the file that uses it, with their places.
    pub own: &'a BTreeMap<String, Span>,
    /// First words of dotted paths besides the alias.
    pub outputs: &'a [&'a str],
    pub diagnostics: Vec<Diagnostic>,
}

impl Stripping<'_> {
    pub(super) fn strip(&mut self, statement: &mut Statement) {
        visit(&mut statement.kind, self);
    }

    /// A name that stands behind the alias but is one of the file itself.
    fn check_origin(&mut self, name: &str, span: Span) {
        let (false, Some(own)) = (self.used.contains(name), self.own.get(name)) else { return };
        self.diagnostics.push(
            Diagnostic::error(D004, format!("`{}` does not define `{name}`", self.path))
                .at(span, format!("no such name in the used scene `{}`", self.alias))
                .also(*own, "defined here, in this file")
                .found(format!("`{}.{name}`", self.alias))
                .expected(format!("`{name}`"))
                .help(format!("write `{name}` without `{}.`", self.alias)),
        );
    }

    /// A path whose first word is neither the used scene nor an output.
    fn report_unknown(&mut self, first: &str, span: Span) {
        if self.outputs.contains(&first) {
            return;
        }
        let known = || self.outputs.iter().copied().chain([self.alias]);
        let mut message = Diagnostic::error(D004, format!("`{first}` is no used scene"))
            .at(span, "no such scene")
            .found(format!("`{first}`"))
            .expected(format!("`{}`, or a kind of output", self.alias));
        if let Some(candidate) = did_you_mean(first, known()) {
            message = message.help(format!("did you mean `{candidate}`?"));
        }
        self.diagnostics.push(message);
    }
}

impl Visitor for Stripping<'_> {
    fn expression(&mut self, expr: &mut Expr) {
        let path = match &mut expr.kind {
            ExprKind::Path(path) => path,
            ExprKind::Call { function, .. } => return self.dotted(function),
            _ => return,
        };
        let Some(first) = path.first() else { return };
        if first.value != self.alias {
            if path.len() > 1 {
                let (first, span) = (first.value.clone(), first.span);
                self.report_unknown(&first, span);
            }
            return;
        }
        if path.len() == 1 {
            self.diagnostics.push(
                Diagnostic::error(D005, format!("`{}` is a used scene", self.alias))
                    .at(first.span, "a scene has no value")
                    .found("a scene")
                    .expected(format!("a name of it, as in `{}.NAME`", self.alias)),
            );
            return;
        }
        path.remove(0);
        if let [name, ..] = &path[..] {
            let (name, span) = (name.value.clone(), name.span);
            self.check_origin(&name, span);
        }
    }

    fn dotted(&mut self, name: &mut Name) {
        let Some((first, rest)) = name.value.split_once('.') else { return };
        let (first, rest) = (first.to_owned(), rest.to_owned());
        if first != self.alias {
            let end = name.span.start + first.len() as u32;
            self.report_unknown(&first, Span { end, ..name.span });
            return;
        }
        name.span.start += first.len() as u32 + 1;
        self.check_origin(rest.split('.').next().unwrap_or_default(), name.span);
        name.value = rest;
    }
}

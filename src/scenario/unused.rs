//! Definitions that nothing uses.
//!
//! Owns these messages, and those of functions whose circles nobody has met. May use the scope. It
//! deliberately counts no uses: the checker does.

use super::check::label_circle;
use super::scope::{Entry, Origin, Progress, Scope};
use super::slot::each_name;
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{D006, D010};
use crate::maths::order::order;
use crate::source::Span;
use crate::syntax::tree;

pub(super) fn report_unused(scope: &Scope<'_>, diagnostics: &mut Vec<Diagnostic>) {
    let circular = report_circles(scope, diagnostics);
    for (name, entry) in scope.iter() {
        let is_constant =
            matches!(entry.origin, Origin::Let(_) | Origin::Param(_) | Origin::Function(_) | Origin::Data(_))
                || matches!(entry.origin, Origin::Kernel);
        let is_told = matches!(entry.progress, Progress::Wrong) || circular.contains(&name.as_str());
        if is_constant && entry.n_uses == 0 && !is_told {
            diagnostics.push(
                Diagnostic::warning(D010, format!("`{name}` is never used"))
                    .at(entry.span, format!("{} without effect", entry.origin.describe()))
                    .help("delete it, or use it"),
            );
        }
    }
}

/// Functions that call themselves though nobody calls them: a call would have told. Gives their names.
fn report_circles<'s>(scope: &'s Scope<'_>, diagnostics: &mut Vec<Diagnostic>) -> Vec<&'s str> {
    let unused = scope.iter().filter_map(|(name, entry)| match entry {
        Entry { origin: Origin::Function(function), n_uses: 0, .. } => Some((name.as_str(), *function)),
        _ => None,
    });
    let unused: Vec<(&str, &tree::Function)> = unused.collect();
    let calls = |function: &tree::Function| {
        let mut calls = Vec::new();
        each_name(&function.body, &mut |name, is_called| {
            if let Ok(idx) = unused.binary_search_by(|(known, _)| (*known).cmp(name.value.as_str()))
                && is_called
            {
                calls.push(idx);
            }
        });
        calls
    };
    let calls: Vec<Vec<usize>> = unused.iter().map(|(_, function)| calls(function)).collect();
    let mut circular = Vec::new();
    for circle in order(&calls).circles {
        let links: Vec<(&str, Span)> =
            circle.iter().map(|&idx| (unused[idx].0, unused[idx].1.name.span)).collect();
        let message = Diagnostic::error(D006, format!("function `{}` calls itself", links[0].0));
        diagnostics.push(
            label_circle(message, &links, "its body calls")
                .found("a function that calls itself")
                .expected("a function whose body ends in built-in functions"),
        );
        circular.extend(links.iter().map(|(name, _)| *name));
    }
    circular
}

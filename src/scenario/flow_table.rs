//! `output flow`: the cells of a flow as a table.
//!
//! Owns the checks of that statement. May use the tree. It deliberately is no output of particles: it has no species,
//! no times and no bins.

use super::check::Checker;
use super::collect::Statements;
use super::transport::Flow;
use crate::diagnostic::Diagnostic;
use crate::diagnostic::codes::{M002, M004, M034};
use crate::source::{Span, Spanned};
use crate::syntax::tree;

/// The word that stands behind `output`.
pub(super) const WORD: &str = "flow";

/// Where the table is asked for; nothing if it is not, or not rightly.
pub(super) fn flow_table(
    checker: &mut Checker<'_>,
    statements: &Statements<'_>,
    flow: Option<&Spanned<Flow>>,
) -> Option<Span> {
    let mut asked = statements.outputs.iter().filter(|(_, written)| written.kind.value == WORD);
    let (span, written) = asked.next()?;
    if let Some((_, again)) = asked.next() {
        checker.report(
            Diagnostic::error(M002, "the flow is written twice")
                .at(again.kind.span, "here again")
                .also(written.kind.span, "first here")
                .found("`output flow` twice")
                .expected("one `output flow`"),
        );
    }
    if !is_bare(written) {
        checker.report(
            Diagnostic::error(M004, "`output flow` stands alone")
                .at(*span, "more than the two words")
                .found("species, times, places or a unit")
                .expected("`output flow`")
                .help("each cell has one row, in SI units"),
        );
    }
    if !matches!(flow.map(|flow| &flow.value), Some(Flow::Darcy(_) | Flow::File(_))) {
        checker.report(
            Diagnostic::error(M034, "the flow has no cells")
                .at(*span, "the cells of which flow?")
                .found(if flow.is_none() {
                    "no flow"
                } else {
                    "a flow that is the same everywhere, or an expression"
                })
                .expected("`flow darcy`, `flow table`, `flow grid` or `flow modflow`"),
        );
    }
    Some(*span)
}

fn is_bare(written: &tree::Output) -> bool {
    let has_list = !written.species.is_empty() || !written.grid.is_empty();
    let has_clause = written.times.is_some() || written.place.is_some() || written.along.is_some();
    !has_list && !has_clause && written.unit.is_none() && written.averaging.is_none()
}

//! The entry of a sweep that the grammar refused.
//!
//! Owns the cut of a sweep's body into entries, each of which is then matched alone: in the whole body a
//! misspelt word is read as an axis, and the grammar stops far behind it. May use the stop beside it. It
//! deliberately looks at no sweep that the grammar takes.

use super::Stop;
use super::expected::quoted;
use crate::diagnostic::{Diagnostic, codes, did_you_mean};
use crate::syntax::grammar::{Grammar, Rule};
use crate::syntax::split::{Chunk, Lexed, continues_after, continues_before};
use crate::syntax::tree::TokenKind;
use crate::syntax::words::SWEEP_ENTRIES;
use pest::Parser;

/// What is wrong with the first broken entry of a sweep, if one of them is broken by itself.
pub fn complain_about_entry(lexed: Lexed, chunk: &Chunk) -> Option<Diagnostic> {
    if lexed.slice(chunk.first) != "sweep" {
        return None;
    }
    let text = |entry: &Chunk| {
        let span = lexed.tokens[entry.first].span.to(lexed.tokens[entry.end - 1].span);
        &lexed.text[span.range()]
    };
    let is_broken = |entry: &&Chunk| Grammar::parse(Rule::line_of_sweep, text(entry)).is_err();
    let entries = entries(lexed, chunk);
    let broken = entries.iter().find(is_broken)?;
    // Two entries on one line are allowed, but here one of them is wrong: read it as one.
    let error = Grammar::parse(Rule::entry_of_sweep, text(broken)).err()?;
    let stop = Stop { is_entry: true, ..Stop::find(lexed, broken, &error) };
    Some(stop.broken_list().or_else(|| stop.misspelt_entry()).unwrap_or_else(|| stop.complain()))
}

/// The entries of a body: each ends at a line end, a semicolon or a brace.
fn entries(lexed: Lexed, chunk: &Chunk) -> Vec<Chunk> {
    let Some(open) = (chunk.first..chunk.end).find(|&idx| lexed.slice(idx) == "{") else { return Vec::new() };
    let mut entries: Vec<Chunk> = Vec::new();
    let mut current: Option<Chunk> = None;
    let (mut n_round, mut is_line_start) = (0_usize, false);
    for idx in open + 1..chunk.end {
        if lexed.kind(idx) == Some(TokenKind::Newline) {
            is_line_start = true;
        }
        if !lexed.is_significant(idx) {
            continue;
        }
        let word = lexed.slice(idx);
        if let Some(entry) = current.take_if(|entry| {
            let goes_on = continues_before(lexed, idx) && !matches!(word, "{" | "}");
            let is_open = n_round > 0 || goes_on || continues_after(lexed, entry.end - 1);
            let ends_line = is_line_start && (!is_open || SWEEP_ENTRIES.contains(&word));
            ends_line || matches!(word, ";" | "}") || lexed.slice(entry.end - 1) == "{"
        }) {
            entries.push(entry);
            n_round = 0;
        }
        is_line_start = false;
        match word {
            "(" => n_round += 1,
            ")" => n_round = n_round.saturating_sub(1),
            _ => {}
        }
        match &mut current {
            // The head of axes that go together is whole.
            Some(entry) if word == "{" && lexed.slice(entry.first) == "zip" => current = None,
            Some(entry) => entry.end = idx + 1,
            None if matches!(word, ";" | "}") => {}
            None => current = Some(Chunk { first: idx, end: idx + 1 }),
        }
    }
    entries.extend(current);
    entries
}

impl Stop<'_> {
    /// A word that resembles that of an entry was read as the name of an axis.
    fn misspelt_entry(&self) -> Option<Diagnostic> {
        let &first = self.before.first().or(self.at.as_ref())?;
        let word = self.word(first);
        if word == "skip" {
            return self.skip_without_when(first);
        }
        if SWEEP_ENTRIES.contains(&word) || word.len() > 40 || !self.is_kind(first, TokenKind::Word) {
            return None;
        }
        let meant = did_you_mean(word, SWEEP_ENTRIES.iter().copied())?;
        let diagnostic = Diagnostic::error(codes::S001, format!("{} is not known here", quoted(word)))
            .at(self.span(first), format!("did you mean `{meant}`?"))
            .found(quoted(word))
            .expected("an entry of a sweep, or an axis with its values")
            .help(format!("write `{meant}`"));
        Some(diagnostic)
    }

    fn skip_without_when(&self, skip: usize) -> Option<Diagnostic> {
        let second = self.before.get(1).copied().or(self.at);
        let place = second.map_or_else(|| self.span(skip), |idx| self.span(skip).to(self.span(idx)));
        if second.is_some_and(|idx| self.word(idx) == "when") {
            return None;
        }
        let found = second.map_or_else(|| self.end().to_owned(), |idx| quoted(self.word(idx)));
        let diagnostic = Diagnostic::error(codes::S001, "`skip` needs its `when`")
            .at(place, "expected `when` after `skip`")
            .found(found)
            .expected("`when`")
            .help("write `skip when CONDITION`");
        Some(diagnostic)
    }

    /// A list of values broken off by a semicolon, or by a line end without a comma.
    fn broken_list(&self) -> Option<Diagnostic> {
        let at = self.at.filter(|&idx| self.before.is_empty() && !self.is_kind(idx, TokenKind::Word))?;
        let last = (0..at).rev().find(|&idx| self.lexed.is_significant(idx))?;
        let diagnostic = Diagnostic::error(codes::S001, format!("{} begins no entry", quoted(self.word(at))))
            .at(self.span(last).to(self.span(at)), "expected the name of an axis between these")
            .found(quoted(self.word(at)))
            .expected("an entry of a sweep, or an axis with its values")
            .help("a list goes on after a `,`");
        Some(diagnostic)
    }
}

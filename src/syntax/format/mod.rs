//! A text in the one fixed layout.
//!
//! Owns the layout: `spacing` decides the blanks inside a line, `align` the columns of neighbouring
//! lines. May use `lexer`, `split`, `tree`.
//! It deliberately works on tokens and keeps every one of them: it changes blanks and line ends only,
//! and leaves statements that did not parse as they are.

mod align;
mod spacing;
mod units;

use super::split::{Chunk, Lexed, split, track_bracket};
use super::tree::{File, TokenKind};
use align::{Columns, columns_of};

/// The text of a file in the fixed layout; `file` is what `parse` made of `text`.
pub fn format(file: &File, text: &str) -> String {
    let n_covered = file.tokens.last().map_or(0, |token| token.span.end as usize);
    if n_covered != text.len() {
        return text.to_owned();
    }
    let lexed = Lexed { text, tokens: &file.tokens };
    let mut lines = read_lines(file, lexed);
    align::align(&mut lines);
    print(&lines)
}

/// One line of the result.
pub enum Line<'t> {
    Empty,
    /// Printed as it is: a comment of its own, or a part of a statement that did not parse.
    Whole {
        indent: usize,
        text: &'t str,
    },
    Code(Code<'t>),
}

/// A line with tokens of a statement that parsed.
pub struct Code<'t> {
    pub indent: usize,
    /// The tokens, each with the number of blanks before it.
    pub pieces: Vec<(usize, &'t str)>,
    pub columns: Option<Columns>,
    pub comment: Option<&'t str>,
    /// Blanks before the comment.
    pub comment_gap: usize,
}

impl Code<'_> {
    /// Characters up to the piece `end`, without the blanks before it.
    pub fn width_before(&self, end: usize) -> usize {
        let pieces = self.pieces.iter().take(end);
        self.indent + pieces.map(|(gap, text)| gap + text.chars().count()).sum::<usize>()
    }
}

fn read_lines<'t>(file: &File, lexed: Lexed<'t>) -> Vec<Line<'t>> {
    let chunks = split(lexed);
    let mut reader = Reader { lexed, file, chunks: &chunks, chunk_idx: 0, open: Vec::new() };
    let mut lines = Vec::new();
    let mut start = 0;
    while start < lexed.tokens.len() {
        let newline = (start..lexed.tokens.len()).find(|&idx| lexed.kind(idx) == Some(TokenKind::Newline));
        let end = newline.unwrap_or(lexed.tokens.len());
        lines.push(reader.line(start, end));
        start = end + 1;
    }
    lines
}

struct Reader<'a, 't> {
    lexed: Lexed<'t>,
    file: &'a File,
    chunks: &'a [Chunk],
    /// The first chunk that is not over yet.
    chunk_idx: usize,
    /// Brackets that are open in the current statement.
    open: Vec<&'t str>,
}

impl<'t> Reader<'_, 't> {
    /// The line of the tokens `start..end`, none of which is a line end.
    fn line(&mut self, start: usize, end: usize) -> Line<'t> {
        let significant: Vec<usize> = (start..end).filter(|&idx| self.lexed.is_significant(idx)).collect();
        let comment = (start..end).find(|&idx| self.lexed.kind(idx) == Some(TokenKind::Comment));
        let comment = comment.map(|idx| self.lexed.slice(idx).trim_end());
        while self.chunks.get(self.chunk_idx).is_some_and(|chunk| chunk.end <= start) {
            self.chunk_idx += 1;
            self.open.clear();
        }
        let chunk = self.chunks.get(self.chunk_idx).filter(|chunk| chunk.first < end);
        if chunk.is_some_and(|chunk| !self.has_parsed(chunk)) {
            return self.verbatim(start, end);
        }
        match (significant.first(), comment) {
            (None, None) => Line::Empty,
            (None, Some(text)) => Line::Whole { indent: self.indent(chunk, start, ""), text },
            (Some(first), _) => {
                let indent = self.indent(chunk, *first, self.lexed.slice(*first));
                let line = self.code(&significant, indent, comment, chunk);
                for idx in significant {
                    track_bracket(&mut self.open, self.lexed.slice(idx));
                }
                line
            }
        }
    }

    fn is_sweep(&self, chunk: Option<&Chunk>) -> bool {
        chunk.is_some_and(|chunk| self.lexed.slice(chunk.first) == "sweep")
    }

    fn has_parsed(&self, chunk: &Chunk) -> bool {
        let start = self.lexed.tokens[chunk.first].span.start;
        self.file.statements.binary_search_by_key(&start, |statement| statement.span.start).is_ok()
    }

    fn verbatim(&self, start: usize, end: usize) -> Line<'t> {
        let is_blank = |idx: &usize| self.lexed.kind(*idx) == Some(TokenKind::Blank);
        match (start..end).rev().find(|idx| !is_blank(idx)) {
            Some(last) => {
                let span = self.lexed.tokens[start].span.to(self.lexed.tokens[last].span);
                Line::Whole { indent: 0, text: &self.lexed.text[span.range()] }
            }
            None => Line::Empty,
        }
    }

    /// Two blanks for each open bracket, two for a line that goes on with its statement otherwise.
    fn indent(&self, chunk: Option<&Chunk>, idx: usize, first: &str) -> usize {
        let Some(_) = chunk.filter(|chunk| chunk.first < idx) else { return 0 };
        let closes = matches!(first, ")" | "}" | "]");
        match self.open.len() - usize::from(closes && !self.open.is_empty()) {
            0 if closes => 0,
            0 => 2,
            // A list that goes on is no entry of its own.
            n_open
                if self.is_sweep(chunk) && !closes && !first.is_empty() && !self.lexed.begins_entry(idx) =>
            {
                2 * n_open + 2
            }
            n_open => 2 * n_open,
        }
    }

    fn code(
        &self,
        line: &[usize],
        indent: usize,
        comment: Option<&'t str>,
        chunk: Option<&Chunk>,
    ) -> Line<'t> {
        let is_begin = chunk.is_some_and(|chunk| line.first() == Some(&chunk.first));
        let is_end = chunk.is_some_and(|chunk| line.last().is_some_and(|last| last + 1 == chunk.end));
        let gaps = spacing::gaps(self.lexed, line, chunk.map_or(0, |chunk| chunk.first));
        let pieces: Vec<_> = gaps.into_iter().zip(line.iter().map(|&idx| self.lexed.slice(idx))).collect();
        let words: Vec<&str> = pieces.iter().map(|(_, text)| *text).collect();
        let columns = match (is_begin, is_end) {
            (true, true) => columns_of(&words),
            (false, _) if self.is_sweep(chunk) => {
                let is_entry = line.first().is_some_and(|&first| self.lexed.begins_entry(first));
                let is_zipped = self.open.len() > 1;
                is_entry.then(|| align::entry_columns(&words, is_zipped)).flatten()
            }
            (false, _) if self.open == ["{"] => align::zone_columns(&words),
            _ => None,
        };
        Line::Code(Code { indent, pieces, columns, comment, comment_gap: 2 })
    }
}

/// At most one empty line in a row, none at the ends; every line ends in `\n`.
fn print(lines: &[Line]) -> String {
    let mut text = String::new();
    let mut is_after_gap = false;
    for line in lines {
        if matches!(line, Line::Empty) {
            is_after_gap = !text.is_empty();
            continue;
        }
        if std::mem::take(&mut is_after_gap) {
            text.push('\n');
        }
        print_line(&mut text, line);
        text.push('\n');
    }
    text
}

fn print_line(text: &mut String, line: &Line) {
    match line {
        Line::Empty => {}
        Line::Whole { indent, text: whole } => {
            push_blanks(text, *indent);
            text.push_str(whole);
        }
        Line::Code(code) => {
            push_blanks(text, code.indent);
            for (gap, piece) in &code.pieces {
                push_blanks(text, *gap);
                text.push_str(piece);
            }
            if let Some(comment) = code.comment {
                push_blanks(text, code.comment_gap);
                text.push_str(comment);
            }
        }
    }
}

fn push_blanks(text: &mut String, n_blanks: usize) {
    text.extend(std::iter::repeat_n(' ', n_blanks));
}

//! Tokens to statements: where one ends and the next begins.
//!
//! Owns the rule of line ends and the recovery at statement keywords. May use `tree`, `words`.
//! It deliberately looks at no grammar: a broken statement must not change where the next begins.

use super::tree::{Token, TokenKind};
use super::words::{BODY_KEYWORDS, RESERVED_WORDS, is_statement_keyword};

/// The tokens of one statement without blanks around it: from its first word to its last token.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Chunk {
    /// Indices into all tokens of the file.
    pub first: usize,
    /// One past the last token that is not blank, comment or line end.
    pub end: usize,
}

/// A text with its tokens.
#[derive(Clone, Copy)]
pub struct Lexed<'t> {
    pub text: &'t str,
    pub tokens: &'t [Token],
}

impl<'t> Lexed<'t> {
    /// The characters of a token.
    pub fn slice(&self, idx: usize) -> &'t str {
        self.tokens.get(idx).map_or("", |token| &self.text[token.span.range()])
    }

    pub fn kind(&self, idx: usize) -> Option<TokenKind> {
        self.tokens.get(idx).map(|token| token.kind)
    }

    /// Whether a token is neither blank, comment nor line end.
    pub fn is_significant(&self, idx: usize) -> bool {
        self.kind(idx).is_some_and(is_significant_kind)
    }

    /// The first significant token at or after `idx`.
    pub fn next_significant(&self, idx: usize) -> Option<usize> {
        (idx..self.tokens.len()).find(|&idx| self.is_significant(idx))
    }

    /// The last significant token before `idx`.
    pub fn last_significant(&self, idx: usize) -> Option<usize> {
        (0..idx.min(self.tokens.len())).rev().find(|&idx| self.is_significant(idx))
    }

    /// Whether an entry of a sweep begins with the token `idx`, which is the first of its line or follows
    /// a semicolon or a brace.
    pub fn begins_entry(&self, idx: usize) -> bool {
        let Some(last) = self.last_significant(idx) else { return false };
        if matches!(self.slice(last), ";" | "{") {
            return true;
        }
        let is_line_start = (last..idx).any(|idx| self.kind(idx) == Some(TokenKind::Newline));
        is_line_start && !continues_after(*self, last) && !continues_before(*self, idx)
    }

    /// The first significant token at or after `idx` that stands before a line end.
    fn next_on_line(&self, idx: usize) -> Option<usize> {
        (idx..self.tokens.len())
            .take_while(|&idx| self.tokens[idx].kind != TokenKind::Newline)
            .find(|&idx| self.is_significant(idx))
    }
}

/// Whether tokens of this kind carry meaning.
pub fn is_significant_kind(kind: TokenKind) -> bool {
    !matches!(kind, TokenKind::Blank | TokenKind::Newline | TokenKind::Comment)
}

/// Cuts the tokens of a file into statements.
pub fn split(lexed: Lexed) -> Vec<Chunk> {
    let closing_braces = closing_braces(lexed);
    let mut splitter = Splitter { lexed, open: Vec::new(), chunks: Vec::new(), current: None };
    let mut is_line_start = true;
    let mut idx = 0;
    while idx < lexed.tokens.len() {
        match lexed.tokens[idx].kind {
            TokenKind::Newline => is_line_start = true,
            kind if is_significant_kind(kind) => {
                if is_line_start && splitter.begins_statement(idx) {
                    splitter.finish();
                }
                is_line_start = false;
                splitter.push(idx);
                if let Some(close) = splitter.body_to_skip(idx, &closing_braces) {
                    idx = close;
                    splitter.push(close);
                }
            }
            _ => {}
        }
        idx += 1;
    }
    splitter.finish();
    splitter.chunks
}

struct Splitter<'t> {
    lexed: Lexed<'t>,
    /// The brackets that are open in the current statement.
    open: Vec<&'t str>,
    chunks: Vec<Chunk>,
    current: Option<Chunk>,
}

impl<'t> Splitter<'t> {
    /// Whether the token `idx`, the first of its line, begins a new statement.
    fn begins_statement(&self, idx: usize) -> bool {
        let Some(current) = &self.current else { return true };
        if looks_like_statement(self.lexed, idx) {
            return true;
        }
        self.open.is_empty()
            && !continues_before(self.lexed, idx)
            && !continues_after(self.lexed, current.end - 1)
    }

    fn push(&mut self, idx: usize) {
        match &mut self.current {
            Some(chunk) => chunk.end = idx + 1,
            None => self.current = Some(Chunk { first: idx, end: idx + 1 }),
        }
        if self.lexed.kind(idx) == Some(TokenKind::Symbol) {
            track_bracket(&mut self.open, self.lexed.slice(idx));
        }
    }

    /// The closing brace of a statement whose body may hold what looks like statements.
    fn body_to_skip(&self, idx: usize, closing: &[Option<u32>]) -> Option<usize> {
        let keyword = self.lexed.slice(self.current.as_ref()?.first);
        let has_body = BODY_KEYWORDS.contains(&keyword);
        let is_body = has_body && self.lexed.slice(idx) == "{";
        is_body.then(|| closing[idx].map(|close| close as usize)).flatten()
    }

    fn finish(&mut self) {
        self.open.clear();
        self.chunks.extend(self.current.take());
    }
}

/// Opens or closes a bracket on a stack; a closing bracket also closes what was left open inside it.
pub fn track_bracket<'t>(open: &mut Vec<&'t str>, symbol: &'t str) {
    let opener = match symbol {
        "(" | "{" | "[" => return open.push(symbol),
        ")" => "(",
        "}" => "{",
        "]" => "[",
        _ => return,
    };
    if let Some(position) = open.iter().rposition(|bracket| *bracket == opener) {
        open.truncate(position);
    }
}

/// A statement keyword followed by what a statement may go on with; a name of the same spelling
/// inside an expression is followed by an operator, a comma or a closing bracket.
fn looks_like_statement(lexed: Lexed, idx: usize) -> bool {
    if !is_statement_keyword(lexed.slice(idx)) {
        return false;
    }
    let Some(next) = lexed.next_on_line(idx + 1) else { return false };
    match lexed.tokens[next].kind {
        // `kernel gaussian` is a setting of an exchange that goes on.
        TokenKind::Word if lexed.slice(idx) == "kernel" => lexed
            .next_on_line(next + 1)
            .is_some_and(|after| matches!(lexed.slice(after), "(" | "adaptive" | "global" | "fixed")),
        TokenKind::Word => !RESERVED_WORDS.contains(&lexed.slice(next)),
        TokenKind::Text | TokenKind::Number => true,
        _ => lexed.slice(idx) == "dispersion" && lexed.slice(next) == "(",
    }
}

/// Whether a line that begins with this token goes on with the statement before it: no statement
/// begins with a symbol or with a reserved word. A line that begins with a closing bracket does too.
pub fn continues_before(lexed: Lexed, idx: usize) -> bool {
    match lexed.kind(idx) {
        Some(TokenKind::Symbol) => true,
        Some(TokenKind::Word) => RESERVED_WORDS.contains(&lexed.slice(idx)),
        _ => false,
    }
}

/// Whether a line that ends with this token cannot be the end of its statement.
pub fn continues_after(lexed: Lexed, idx: usize) -> bool {
    let word = lexed.slice(idx);
    match lexed.kind(idx) {
        Some(TokenKind::Symbol) => !matches!(word, ")" | "}" | "]" | "%" | "‰" | ";" | ":"),
        Some(TokenKind::Word) => RESERVED_WORDS.contains(&word),
        _ => false,
    }
}

/// For each `{`, the index of the `}` that closes it.
fn closing_braces(lexed: Lexed) -> Vec<Option<u32>> {
    let mut closing = vec![None; lexed.tokens.len()];
    let mut open = Vec::new();
    for idx in 0..lexed.tokens.len() {
        match lexed.slice(idx) {
            "{" => open.push(idx),
            "}" => {
                if let Some(start) = open.pop() {
                    closing[start] = Some(idx as u32);
                }
            }
            _ => {}
        }
    }
    closing
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::FileId;
    use crate::syntax::lexer::tokenize;

    fn statements(text: &str) -> Vec<&str> {
        let tokens = tokenize(FileId(0), text);
        let lexed = Lexed { text, tokens: &tokens };
        split(lexed)
            .iter()
            .map(|chunk| {
                let (first, last) = (tokens[chunk.first].span, tokens[chunk.end - 1].span);
                &text[first.to(last).range()]
            })
            .collect()
    }

    #[test]
    fn lines_end_statements() {
        assert_eq!(statements("a b # c\n\n  d e\r\nf"), ["a b", "d e", "f"]);
    }

    #[test]
    fn open_brackets_and_operators_continue() {
        assert_eq!(statements("a (b\n c)\nd"), ["a (b\n c)", "d"]);
        assert_eq!(statements("a = b +\n c\nd"), ["a = b +\n c", "d"]);
        assert_eq!(statements("a = if b\n then c\n else d\ne"), ["a = if b\n then c\n else d", "e"]);
        assert_eq!(statements("out a,\n b\n at t = 1\nc"), ["out a,\n b\n at t = 1", "c"]);
    }

    #[test]
    fn a_keyword_closes_a_broken_statement() {
        assert_eq!(statements("let a = (b\nlet c = d"), ["let a = (b", "let c = d"]);
        assert_eq!(statements("let a = b +\nseed 1"), ["let a = b +", "seed 1"]);
        assert_eq!(
            statements("let a = (b -\n reference) / c\nseed 1"),
            ["let a = (b -\n reference) / c", "seed 1"]
        );
    }

    #[test]
    fn bodies_of_later_statements_are_whole() {
        let text = "sweep a of b {\n  particles 1, 2\n  seed 3\n}\nseed 1";
        assert_eq!(statements(text), [text.strip_suffix("\nseed 1").unwrap_or_default(), "seed 1"]);
        assert_eq!(statements("sweep a {\nseed 3"), ["sweep a {", "seed 3"]);
    }
}

//! What is checked on the tokens of a statement before the grammar sees them.
//!
//! Owns the limits of size and nesting, and the words for stray characters. May use `diagnostic`.
//! It deliberately refuses anything that could make a recursive walk deep: everything after it may recurse.

use super::split::{Chunk, Lexed, is_significant_kind, track_bracket};
use super::tree::TokenKind;
use crate::diagnostic::{Diagnostic, codes};
use crate::source::{FileId, Span};

/// The largest text that is read.
pub const MAX_FILE_BYTES: usize = 4 * 1024 * 1024;
/// Brackets and conditionals inside each other.
pub const MAX_NESTING: usize = 64;
/// Depth of an expression's tree: a chain of operators counts one for each.
pub const MAX_EXPRESSION_DEPTH: usize = 256;
/// Tokens of one statement, blanks and comments included.
pub const MAX_STATEMENT_TOKENS: usize = 20_000;
/// Characters of one word.
pub const MAX_WORD_CHARS: usize = 128;
/// After so many messages the rest is only counted.
pub const MAX_MESSAGES: usize = 200;

/// The refusal of a text that is too large to read.
pub fn check_file_size(file: FileId, text: &str) -> Option<Diagnostic> {
    (text.len() > MAX_FILE_BYTES).then(|| {
        Diagnostic::refused(codes::S010, "this file is too large for a scene")
            .at(Span::new(file, 0, 0), "")
            .found(format!("{} bytes", text.len()))
            .expected(format!("at most {MAX_FILE_BYTES} bytes"))
    })
}

/// Everything that keeps a statement from being matched against the grammar.
pub fn check_statement(lexed: Lexed, chunk: &Chunk) -> Vec<Diagnostic> {
    let mut found: Vec<Diagnostic> = check_length(lexed, chunk).into_iter().collect();
    if found.is_empty() {
        found.extend((chunk.first..chunk.end).filter_map(|idx| check_token(lexed, idx)));
        found.extend(check_nesting(lexed, chunk));
    }
    found
}

fn check_length(lexed: Lexed, chunk: &Chunk) -> Option<Diagnostic> {
    let n_tokens = chunk.end - chunk.first;
    (n_tokens > MAX_STATEMENT_TOKENS).then(|| {
        Diagnostic::refused(codes::S010, "this statement is too long")
            .at(lexed.tokens[chunk.first].span, "it begins here")
            .found(format!("{n_tokens} tokens"))
            .expected(format!("at most {MAX_STATEMENT_TOKENS} tokens"))
    })
}

fn check_token(lexed: Lexed, idx: usize) -> Option<Diagnostic> {
    let span = lexed.tokens[idx].span;
    let text = lexed.slice(idx);
    match lexed.tokens[idx].kind {
        TokenKind::Unknown => Some(stray_character(span, text)),
        TokenKind::Text if !is_closed_text(text) => Some(
            Diagnostic::error(codes::S005, "this text is never closed")
                .at(span, "it begins here and reaches the end of the line")
                .expected("`\"` on the same line")
                .help("close the text with `\"`; a quote inside a text is written `\\\"`"),
        ),
        TokenKind::Word if text.len() > MAX_WORD_CHARS && text.chars().count() > MAX_WORD_CHARS => Some(
            Diagnostic::refused(codes::S010, "this word is too long")
                .at(span, "")
                .found(format!("{} characters", text.chars().count()))
                .expected(format!("at most {MAX_WORD_CHARS} characters")),
        ),
        _ => None,
    }
}

/// Whether a text token ends with a quote that closes it.
fn is_closed_text(text: &str) -> bool {
    let Some(inner) = text.strip_prefix('"').and_then(|rest| rest.strip_suffix('"')) else { return false };
    let n_backslashes = inner.bytes().rev().take_while(|byte| *byte == b'\\').count();
    n_backslashes % 2 == 0
}

fn stray_character(span: Span, text: &str) -> Diagnostic {
    let character = text.chars().next().unwrap_or(' ');
    let printable = if character.is_control() || character.is_whitespace() {
        format!("U+{:04X}", u32::from(character))
    } else {
        format!("`{character}`")
    };
    let diagnostic = Diagnostic::error(codes::S006, format!("the character {printable} has no meaning here"))
        .at(span, "not part of the language")
        .found(printable);
    match stray_help(character) {
        Some(help) => diagnostic.help(help),
        None => diagnostic,
    }
}

/// What the writer of a character that the language does not know will have meant.
fn stray_help(character: char) -> Option<&'static str> {
    Some(match character {
        '−' | '–' | '—' => "write the minus sign of the keyboard: `-`",
        '“' | '”' | '„' | '«' | '»' | '\'' | '‘' | '’' | '`' => {
            "texts stand between straight double quotes: `\"…\"`"
        }
        '×' => "write `*` for a product; for counts write `x`, as in `100 x 50`",
        '²' | '³' | '⁻' | '¹' => "write powers with `^`: `m^2`",
        '→' => "write the arrow as `->`",
        '≤' => "write `<=`",
        '≥' => "write `>=`",
        '≠' => "write `!=`",
        '&' => "write `and`",
        '|' => "write `or`",
        '!' => "write `not`, or `!=` for unequal",
        '~' => "a range is written with `..`, as in `0 .. 1`",
        _ if character.is_whitespace() => "replace it by an ordinary blank",
        _ => return None,
    })
}

/// One counter per open bracket: conditionals nest to the right until a comma or the bracket's end.
fn check_nesting(lexed: Lexed, chunk: &Chunk) -> Option<Diagnostic> {
    let mut open = Vec::new();
    let mut conditionals = vec![0_usize];
    for idx in chunk.first..chunk.end {
        let word = lexed.slice(idx);
        match lexed.tokens[idx].kind {
            TokenKind::Symbol => track_bracket(&mut open, word),
            TokenKind::Word if word == "if" => *conditionals.last_mut()? += 1,
            kind if !is_significant_kind(kind) => continue,
            _ => {}
        }
        conditionals.resize(open.len() + 1, 0);
        if word == "," {
            *conditionals.last_mut()? = 0;
        }
        if open.len() > MAX_NESTING || open.len() + conditionals.iter().sum::<usize>() > MAX_NESTING {
            return Some(too_deep(lexed.tokens[idx].span, "brackets and `if … then … else …`", MAX_NESTING));
        }
    }
    None
}

/// The refusal of an expression that nests deeper than the limit.
pub fn too_deep(span: Span, what: &str, limit: usize) -> Diagnostic {
    Diagnostic::refused(codes::S009, "this is nested too deeply")
        .at(span, "the limit is passed here")
        .expected(format!("at most {limit} levels of {what}"))
        .help("name a part with `let` or `fn` and use the name")
}

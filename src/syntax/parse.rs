//! Text to tree, statement by statement.
//!
//! Owns the order of the steps and the messages about whole statements. May use everything beside it.
//! It deliberately goes on after a broken statement: all mistakes of a text are reported together.

use super::bounds::{MAX_MESSAGES, check_file_size, check_statement};
use super::build::{self, Place};
use super::complaint::{complain, quoted};
use super::grammar::{Grammar, rule_of};
use super::lexer::tokenize;
use super::split::{Chunk, Lexed, split};
use super::tree::{File, Statement, StatementKind, TokenKind};
use super::words::{RESERVED_WORDS, STATEMENT_KEYWORDS, is_statement_keyword};
use crate::diagnostic::{Diagnostic, codes, did_you_mean};
use crate::source::{FileId, Span};
use pest::Parser;
use rayon::prelude::*;

/// The edition that this version reads.
pub const EDITION: u32 = 1;

/// Fewer are parsed sooner than a thread wakes up.
const MIN_STATEMENTS_PER_THREAD: usize = 64;

/// Parses one file. Statements that do not parse have a message and are left out of the tree; any
/// text, however broken, gives a tree and never a panic.
pub fn parse(file: FileId, text: &str) -> (File, Vec<Diagnostic>) {
    if let Some(refusal) = check_file_size(file, text) {
        return (File { file, tokens: Vec::new(), statements: Vec::new() }, vec![refusal]);
    }
    let tokens = tokenize(file, text);
    let lexed = Lexed { text, tokens: &tokens };
    let chunks = split(lexed);
    let mut diagnostics: Vec<Diagnostic> = check_edition_line(file, lexed, &chunks).into_iter().collect();
    let mut statements = Vec::new();
    let mut lost_body = LostBody::default();
    // Statements do not depend on each other, and long scenes should be checked while one types.
    let parsed: Vec<_> = chunks
        .par_iter()
        .with_min_len(MIN_STATEMENTS_PER_THREAD)
        .map(|chunk| parse_statement(file, lexed, chunk))
        .collect();
    for (chunk, result) in chunks.iter().zip(parsed) {
        match result {
            Ok(statement) => statements.push(statement),
            Err(found) if !lost_body.covers(lexed, chunk) => diagnostics.extend(found),
            Err(_) => {}
        }
        lost_body.follow(lexed, chunk);
    }
    diagnostics.extend(statements.iter().filter_map(check_edition));
    drop_repeated(&mut diagnostics);
    limit_messages(&mut diagnostics);
    (File { file, tokens, statements }, diagnostics)
}

/// Whether the lines that follow are the body of a block whose opening brace is missing: one
/// mistake, one message.
#[derive(Default)]
struct LostBody {
    is_inside: bool,
}

impl LostBody {
    fn covers(&self, lexed: Lexed, chunk: &Chunk) -> bool {
        self.is_inside && !is_statement_keyword(lexed.slice(chunk.first))
    }

    fn follow(&mut self, lexed: Lexed, chunk: &Chunk) {
        let keyword = lexed.slice(chunk.first);
        if is_statement_keyword(keyword) {
            let has = |word: &str| (chunk.first..chunk.end).any(|idx| lexed.slice(idx) == word);
            let has_body = keyword == "mixing" || (keyword == "flow" && has("darcy"));
            self.is_inside = has_body && !has("{");
        }
    }
}

fn parse_statement(file: FileId, lexed: Lexed, chunk: &Chunk) -> Result<Statement, Vec<Diagnostic>> {
    let before_grammar = check_statement(lexed, chunk);
    if !before_grammar.is_empty() {
        return Err(before_grammar);
    }
    let keyword = lexed.slice(chunk.first);
    let Some(rule) = rule_of(keyword) else { return Err(vec![unknown_statement(lexed, chunk)]) };
    let span = chunk_span(lexed, chunk);
    let place = Place { file, offset: span.start as usize };
    let mut pairs = Grammar::parse(rule, &lexed.text[span.range()])
        .map_err(|error| vec![complain(lexed, chunk, &error)])?;
    let pair = pairs.next().ok_or_else(|| vec![unknown_statement(lexed, chunk)])?;
    build::statement(place, span, lexed.tokens[chunk.first].span, pair)
        .map_err(|diagnostic| vec![*diagnostic])
}

fn chunk_span(lexed: Lexed, chunk: &Chunk) -> Span {
    lexed.tokens[chunk.first].span.to(lexed.tokens[chunk.end - 1].span)
}

/// A line whose first word begins no statement.
fn unknown_statement(lexed: Lexed, chunk: &Chunk) -> Diagnostic {
    let span = lexed.tokens[chunk.first].span;
    let word = lexed.slice(chunk.first);
    if lexed.kind(chunk.first) != Some(TokenKind::Word) || RESERVED_WORDS.contains(&word) {
        return Diagnostic::error(codes::S001, "a statement begins with its keyword")
            .at(span, "this begins no statement")
            .found(quoted(word))
            .expected("a keyword such as `param`, `species`, `output`");
    }
    let diagnostic = Diagnostic::error(codes::S002, format!("{} begins no statement", quoted(word)))
        .found(quoted(word))
        .expected("a keyword such as `param`, `species`, `output`");
    let meant = if word.len() > 40 { None } else { did_you_mean(word, all_keywords()) };
    let next = (chunk.first + 1..chunk.end).find(|&idx| lexed.is_significant(idx));
    match meant {
        Some(meant) => {
            diagnostic.at(span, format!("did you mean `{meant}`?")).help(format!("write `{meant}`"))
        }
        None if next.is_some_and(|idx| lexed.slice(idx) == "=") => {
            let name = quoted(word);
            let name = name.trim_matches('`');
            diagnostic
                .at(span, "not a keyword")
                .help(format!("a value is named with `let {name} = …` or `param {name} = …`"))
        }
        None => diagnostic.at(span, "not a keyword"),
    }
}

fn all_keywords() -> impl Iterator<Item = &'static str> {
    STATEMENT_KEYWORDS.iter().copied()
}

/// `lamella 1` is the first statement, and the only one of its kind.
fn check_edition_line(file: FileId, lexed: Lexed, chunks: &[Chunk]) -> Option<Diagnostic> {
    let first = chunks.first();
    let is_edition = |chunk: &&Chunk| lexed.slice(chunk.first) == "lamella";
    let later = chunks.iter().skip(1).find(is_edition).map(|chunk| lexed.tokens[chunk.first].span);
    let is_misspelt = |chunk: &Chunk| {
        let word = lexed.slice(chunk.first);
        word.len() <= 40
            && !is_statement_keyword(word)
            && did_you_mean(word, all_keywords()) == Some("lamella")
    };
    match (first, later) {
        (Some(first), Some(later)) if is_edition(&first) => Some(
            Diagnostic::error(codes::S007, "the edition stands twice")
                .at(later, "the second")
                .also(lexed.tokens[first.first].span, "the first")
                .help("keep the first line only"),
        ),
        (Some(first), None) if is_edition(&first) || is_misspelt(first) => None,
        (Some(_), Some(later)) => Some(
            Diagnostic::error(codes::S007, "the edition must be the first statement")
                .at(later, "too late")
                .help(format!("move `lamella {EDITION}` to the first line")),
        ),
        (first, _) => {
            let span = first.map_or_else(|| Span::new(file, 0, 0), |chunk| lexed.tokens[chunk.first].span);
            Some(
                Diagnostic::error(codes::S007, "the edition is missing")
                    .at(span, format!("expected `lamella {EDITION}` before this"))
                    .help(format!("write `lamella {EDITION}` as the first line")),
            )
        }
    }
}

fn check_edition(statement: &Statement) -> Option<Diagnostic> {
    let StatementKind::Edition(edition) = &statement.kind else { return None };
    (edition.value != EDITION).then(|| {
        Diagnostic::error(codes::S008, format!("edition {} is not known", edition.value))
            .at(edition.span, "unknown edition")
            .found(edition.value.to_string())
            .expected(format!("`lamella {EDITION}`"))
    })
}

/// Messages in the order of the text; of several about one place the first stays.
fn drop_repeated(diagnostics: &mut Vec<Diagnostic>) {
    diagnostics.sort_by_key(|diagnostic| diagnostic.primary_span());
    diagnostics.dedup_by_key(|diagnostic| diagnostic.primary_span());
}

fn limit_messages(diagnostics: &mut Vec<Diagnostic>) {
    let n_more = diagnostics.len().saturating_sub(MAX_MESSAGES);
    if n_more > 0 {
        diagnostics.truncate(MAX_MESSAGES);
        diagnostics.push(Diagnostic::remark(codes::S015, format!("{n_more} further messages are not shown")));
    }
}

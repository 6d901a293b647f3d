//! Where the grammar stopped, as a message in the user's words.
//!
//! Owns the choice of the token to blame and of the words for what was expected. May use `grammar`,
//! `words`, `diagnostic`, the symbols of `units`.
//! It deliberately blames one token per statement: what follows a first mistake is guesswork.

mod entry;
mod expected;
mod junction;

pub use expected::quoted;

use super::grammar::Rule;
use super::split::{Chunk, Lexed, track_bracket};
use super::tree::TokenKind;
use super::words::{RESERVED_WORDS, clause_words, is_no_unit};
use crate::diagnostic::{Diagnostic, codes, did_you_mean};
use crate::source::Span;
use crate::units::is_unit_symbol;
use expected::{END, VALUE, expected_words, join_words, literal, shortened};
use pest::error::{Error, ErrorVariant, InputLocation};

/// The message for a statement that the grammar refused.
pub fn complain(lexed: Lexed, chunk: &Chunk, error: &Error<Rule>) -> Diagnostic {
    entry::complain_about_entry(lexed, chunk).unwrap_or_else(|| Stop::find(lexed, chunk, error).complain())
}

/// The significant tokens around the place where the grammar stopped.
struct Stop<'t> {
    lexed: Lexed<'t>,
    /// Indices of the significant tokens before the stop, in order.
    before: Vec<usize>,
    /// The token at the stop; none at the end of the statement.
    at: Option<usize>,
    expected: Vec<Rule>,
    /// Whether this is an entry of a statement, not the whole of it.
    is_entry: bool,
}

impl<'t> Stop<'t> {
    fn complain(&self) -> Diagnostic {
        None.or_else(|| self.detached_fraction())
            .or_else(|| self.broken_unit())
            .or_else(|| self.parted_word())
            .or_else(|| self.misspelt_word())
            .or_else(|| self.open_bracket())
            .or_else(|| self.lone_bracket())
            .or_else(|| self.lone_branch())
            .or_else(|| self.arguments_without_function())
            .or_else(|| self.missing_kind())
            .or_else(|| self.late_clause())
            .unwrap_or_else(|| self.plain())
    }

    fn find(lexed: Lexed<'t>, chunk: &Chunk, error: &Error<Rule>) -> Self {
        let offset = lexed.tokens[chunk.first].span.start as usize;
        let position = match error.location {
            InputLocation::Pos(position) | InputLocation::Span((position, _)) => offset + position,
        };
        let significant = (chunk.first..chunk.end).filter(|&idx| lexed.is_significant(idx));
        let (before, after): (Vec<_>, Vec<_>) =
            significant.partition(|&idx| lexed.tokens[idx].span.end as usize <= position);
        let expected = match &error.variant {
            ErrorVariant::ParsingError { positives, .. } => positives.clone(),
            ErrorVariant::CustomError { .. } => Vec::new(),
        };
        Self { lexed, before, at: after.first().copied(), expected, is_entry: false }
    }

    fn word(&self, idx: usize) -> &'t str {
        self.lexed.slice(idx)
    }

    fn span(&self, idx: usize) -> Span {
        self.lexed.tokens[idx].span
    }

    /// Whether the stop lies on a later line than the token before it.
    fn begins_line(&self, at: usize) -> bool {
        let before = self.before.last().copied().unwrap_or(0);
        (before..at).any(|idx| self.is_kind(idx, TokenKind::Newline))
    }

    /// The token that the statement begins with.
    fn keyword(&self) -> &'t str {
        self.before.first().or(self.at.as_ref()).map_or("", |&idx| self.word(idx))
    }

    fn is_kind(&self, idx: usize, kind: TokenKind) -> bool {
        self.lexed.kind(idx) == Some(kind)
    }

    /// The place to show: the token itself, or the last one of a statement that ends too early.
    fn place(&self) -> Span {
        self.at.or(self.before.last().copied()).map_or_else(Span::default, |idx| self.span(idx))
    }

    fn found(&self) -> String {
        self.at.map_or_else(|| self.end().to_owned(), |idx| quoted(self.word(idx)))
    }

    fn end(&self) -> &'static str {
        if self.is_entry { "the end of the entry" } else { END }
    }

    /// What could follow, each once; what makes up a value is not listed beside it.
    fn expected(&self) -> String {
        let words: Vec<String> = self.expected.iter().flat_map(|rule| expected_words(*rule)).collect();
        let has_value = words.iter().any(|word| word == VALUE);
        let mut shown: Vec<String> = Vec::new();
        for word in words {
            let is_part = has_value && matches!(word.as_str(), "a number" | "a name" | "`(`");
            if !is_part && word != END && !shown.contains(&word) {
                shown.push(word);
            }
        }
        if self.expected.contains(&Rule::EOI) {
            shown.push(self.end().to_owned());
        }
        join_words(&shown)
    }

    /// `.5`, `1.`: numbers have digits on both sides of the point.
    fn detached_fraction(&self) -> Option<Diagnostic> {
        let at = self.at.filter(|&idx| self.word(idx) == ".")?;
        let number_before =
            self.before.last().copied().filter(|&idx| self.touches(idx, at, TokenKind::Number));
        let number_after = Some(at + 1).filter(|&idx| self.is_kind(idx, TokenKind::Number));
        let (from, to) = (number_before.unwrap_or(at), number_after.unwrap_or(at));
        if from == to {
            return None;
        }
        let digits = |idx: Option<usize>| idx.map_or("0", |idx| self.word(idx));
        let diagnostic = Diagnostic::error(codes::S013, "a number has digits on both sides of its point")
            .at(self.span(from).to(self.span(to)), "a digit is missing")
            .help(format!(
                "write `{}.{}`",
                shortened(digits(number_before)),
                shortened(digits(number_after))
            ));
        Some(diagnostic)
    }

    fn touches(&self, idx: usize, next: usize, kind: TokenKind) -> bool {
        self.is_kind(idx, kind) && self.span(idx).end == self.span(next).start
    }

    /// A word after a number was read as its unit and the sentence broke off behind it.
    fn broken_unit(&self) -> Option<Diagnostic> {
        let at = self.at?;
        let (number, unit) = self.unit_before()?;
        let unit_text = &self.lexed.text[unit.range()];
        if !unit_text.starts_with('/') && !unit_text.contains('/') && !is_unit_symbol(symbol_of(unit_text)) {
            if self.is_entry
                && let Some(word) = self.before.last().and_then(|&last| self.misspelt(last))
            {
                return Some(word);
            }
            let diagnostic = Diagnostic::error(codes::S014, format!("{} is not a unit", quoted(unit_text)))
                .at(unit, "a word right after a number is its unit")
                .found(quoted(unit_text))
                .expected(format!("a unit, or {}", self.expected()))
                .also(self.span(at), "so this does not fit");
            return Some(diagnostic);
        }
        let is_word = self.is_kind(at, TokenKind::Word) && !RESERVED_WORDS.contains(&self.word(at));
        if !is_word || self.begins_line(at) {
            return None;
        }
        if self.suggestion(self.word(at)).is_some() {
            return None;
        }
        let diagnostic = Diagnostic::error(
            codes::S014,
            format!("{} does not fit after a unit", self.found()),
        )
        .at(unit.to(self.span(at)), "a unit has no blanks inside")
        .also(number, "the number")
        .found(self.found())
        .expected(self.expected())
        .help("join the parts of a unit with `/` or `·`, as in `mol/L`; a product with a name needs `*`");
        Some(diagnostic)
    }

    /// The number and the unit text that end right before the stop.
    fn unit_before(&self) -> Option<(Span, Span)> {
        let number = self.before.iter().rposition(|&idx| self.is_kind(idx, TokenKind::Number))?;
        let unit = self.before.get(number + 1..)?;
        let (first, last) = (*unit.first()?, *unit.last()?);
        let is_unit = unit.iter().all(|&idx| {
            self.is_kind(idx, TokenKind::Word) || matches!(self.word(idx), "/" | "·" | "." | "%" | "‰" | "^")
        });
        let is_glued = last - first + 1 == unit.len();
        let ends_open = !self.is_kind(last, TokenKind::Word) && self.word(last) != "%";
        (is_unit && is_glued && !ends_open && !is_no_unit(self.word(last)))
            .then(|| (self.span(self.before[number]), self.span(first).to(self.span(last))))
    }

    /// Two words of one line that are one with `_` between them, as `no flow`.
    fn parted_word(&self) -> Option<Diagnostic> {
        let at = self.at?;
        let next = (at + 1..self.lexed.tokens.len()).find(|&idx| self.lexed.is_significant(idx));
        let pairs = [(self.before.last().copied(), Some(at)), (Some(at), next)];
        pairs.into_iter().find_map(|(first, second)| {
            let (first, second) = first.zip(second)?;
            let joined = format!("{}_{}", self.word(first), self.word(second));
            let is_parted = (first..second).any(|idx| self.is_kind(idx, TokenKind::Newline));
            let meant =
                clause_words(self.keyword()).iter().find(|word| **word == joined).filter(|_| !is_parted)?;
            let found = format!("`{} {}`", self.word(first), self.word(second));
            let diagnostic = Diagnostic::error(codes::S001, format!("{found} is one word here"))
                .at(self.span(first).to(self.span(second)), format!("did you mean `{meant}`?"))
                .found(found)
                .expected(format!("`{meant}`"))
                .help(format!("write `{meant}`"));
            Some(diagnostic)
        })
    }

    /// The word at the stop or the one before it resembles a word of this statement.
    fn misspelt_word(&self) -> Option<Diagnostic> {
        let at = self.at.filter(|&idx| self.is_kind(idx, TokenKind::Word));
        let candidates = at.into_iter().chain(self.before.get(1..)?.last().copied());
        candidates.into_iter().find_map(|idx| self.misspelt(idx))
    }

    fn misspelt(&self, idx: usize) -> Option<Diagnostic> {
        let word = self.word(idx);
        if !self.is_kind(idx, TokenKind::Word) || RESERVED_WORDS.contains(&word) {
            return None;
        }
        let meant = self.suggestion(word)?;
        let diagnostic = Diagnostic::error(codes::S001, format!("{} is not known here", quoted(word)))
            .at(self.span(idx), format!("did you mean `{meant}`?"))
            .found(quoted(word))
            .expected(if self.at == Some(idx) { self.expected() } else { format!("`{meant}`") })
            .help(format!("write `{meant}`"));
        Some(diagnostic)
    }

    /// The word of this statement, or of what was expected, that was meant.
    fn suggestion(&self, word: &str) -> Option<&'static str> {
        if word.len() > 40 || word.len() < 2 || clause_words(self.keyword()).contains(&word) {
            return None;
        }
        let expected = self.expected.iter().filter_map(|rule| literal(*rule));
        let inner = ["if", "then", "else", "and", "or", "not"];
        did_you_mean(word, clause_words(self.keyword()).iter().copied().chain(expected).chain(inner))
    }

    /// The innermost bracket that is still open where a value, a word or the statement ended.
    fn open_bracket(&self) -> Option<Diagnostic> {
        let closer = self.expected.iter().find_map(|rule| match rule {
            Rule::close_round => Some(")"),
            Rule::close_brace => Some("}"),
            _ => None,
        })?;
        let at_end = self.at.is_none_or(|idx| {
            (closer == ")" && self.begins_line(idx))
                || RESERVED_WORDS.contains(&self.word(idx))
                || matches!(self.word(idx), ")" | "}" | "]")
        });
        let opener = *self.open_brackets().last()?;
        if !at_end {
            return None;
        }
        let diagnostic =
            Diagnostic::error(codes::S004, format!("{} is never closed", quoted(self.word(opener))))
                .at(
                    self.place(),
                    if self.at.is_some() {
                        "must be closed before this"
                    } else {
                        "must be closed after this"
                    },
                )
                .at(self.span(opener), "opened here")
                .found(self.found())
                .expected(format!("`{closer}`"));
        Some(diagnostic)
    }

    fn open_brackets(&self) -> Vec<usize> {
        let (mut open, mut places) = (Vec::new(), Vec::new());
        for &idx in &self.before {
            track_bracket(&mut open, self.word(idx));
            places.truncate(open.len());
            if open.len() > places.len() {
                places.push(idx);
            }
        }
        places
    }

    /// A closing bracket that closes nothing.
    fn lone_bracket(&self) -> Option<Diagnostic> {
        let at = self.at.filter(|&idx| matches!(self.word(idx), ")" | "}" | "]"))?;
        let opener = match self.word(at) {
            ")" => "(",
            "}" => "{",
            _ => "[",
        };
        if self.open_brackets().iter().any(|&idx| self.word(idx) == opener) {
            return None;
        }
        let diagnostic = Diagnostic::error(codes::S004, format!("this {} closes nothing", self.found()))
            .at(self.span(at), "no bracket is open here")
            .found(self.found())
            .expected(self.expected())
            .help("remove it, or open the bracket where it should begin");
        Some(diagnostic)
    }
}

fn symbol_of(unit: &str) -> &str {
    unit.split(['^', '.', '·']).next().unwrap_or(unit)
}

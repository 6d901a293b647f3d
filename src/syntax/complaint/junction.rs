//! Two neighbours that do not go together: which of them to blame.
//!
//! Owns the messages that no more special rule takes. May use the stop beside it.
//! It deliberately shows both neighbours where either may be wrong: something is missing between two
//! values, or a value is missing after an operator.

use super::Stop;
use super::expected::{quoted, shortened};
use crate::diagnostic::{Diagnostic, codes};
use crate::source::Span;
use crate::syntax::grammar::Rule;
use crate::syntax::tree::TokenKind;
use crate::syntax::words::{RESERVED_WORDS, clause_words};

impl Stop<'_> {
    /// `then` or `else` where no `if` is open.
    pub fn lone_branch(&self) -> Option<Diagnostic> {
        let at = self.at.filter(|&idx| matches!(self.word(idx), "then" | "else"))?;
        let starts = |idx: &usize| matches!(self.word(*idx), "=" | "(" | "," | "@" | "if" | "then" | "else");
        let start = self.before.iter().rposition(starts)?;
        if matches!(self.word(self.before[start]), "if" | "then") {
            return None;
        }
        let first = *self.before.get(start + 1)?;
        let diagnostic = Diagnostic::error(codes::S001, format!("this {} has no `if`", self.found()))
            .at(self.span(first), "expected `if` before this")
            .also(self.span(at), "the branch that has no condition")
            .found(quoted(self.word(first)))
            .expected("`if`")
            .help("write `if … then … else …`");
        Some(diagnostic)
    }

    /// `(a = b, …)` where no function stands before the bracket.
    pub fn arguments_without_function(&self) -> Option<Diagnostic> {
        self.at.filter(|&idx| self.word(idx) == "=")?;
        let opener = *self.open_brackets().last().filter(|&&idx| self.word(idx) == "(")?;
        let position = self.before.iter().position(|&idx| idx == opener)?;
        let before = *self.before.get(position.checked_sub(1)?)?;
        if self.is_kind(before, TokenKind::Word) {
            return None;
        }
        let diagnostic =
            Diagnostic::error(codes::S001, "named arguments stand in brackets without a function")
                .at(self.span(before).to(self.span(opener)), "expected a function's name between these")
                .found(quoted(self.word(opener)))
                .expected("a function's name");
        Some(diagnostic)
    }

    /// `output A, B`: the first word would be the kind.
    pub fn missing_kind(&self) -> Option<Diagnostic> {
        let at = self.at.filter(|&idx| self.is_kind(idx, TokenKind::Word))?;
        let next = self.lexed.next_significant(at + 1).filter(|&idx| self.word(idx) == ",")?;
        if !self.expected.contains(&Rule::output_kind) || RESERVED_WORDS.contains(&self.word(at)) {
            return None;
        }
        let diagnostic = Diagnostic::error(codes::S001, "the kind of this output is missing")
            .at(self.span(at).to(self.span(next)), "a list begins here; expected a kind before it")
            .found(self.found())
            .expected("a kind such as `profile`");
        Some(diagnostic)
    }

    /// A clause word was taken for a name, and the statement broke off behind it.
    pub fn late_clause(&self) -> Option<Diagnostic> {
        let [.., earlier, word] = self.before[..] else { return None };
        let is_clause = clause_words(self.keyword()).contains(&self.word(word));
        if !is_clause || RESERVED_WORDS.contains(&self.word(word)) || earlier == self.before[0] {
            return None;
        }
        if matches!(self.word(earlier), "," | ":" | ";" | "{") {
            return None;
        }
        let name = quoted(self.word(word));
        let diagnostic =
            Diagnostic::error(codes::S001, format!("{name} does not follow {}", quoted(self.word(earlier))))
                .at(self.span(earlier).to(self.span(word)), format!("expected `,` before {name}"))
                .found(name)
                .expected("`,`");
        Some(diagnostic)
    }

    /// The message where nothing more special is known.
    pub fn plain(&self) -> Diagnostic {
        let expected = self.expected();
        let (span, message, label) = match self.neighbours() {
            Some((span, message)) => (span, message, format!("expected {expected} here")),
            None if self.at.is_none() => {
                let message = match self.is_entry {
                    true => "this entry ends too early".to_owned(),
                    false => "this statement ends too early".to_owned(),
                };
                (self.place(), message, format!("after this, expected {expected}"))
            }
            None => {
                (self.place(), format!("{} does not fit here", self.found()), format!("expected {expected}"))
            }
        };
        let diagnostic =
            Diagnostic::error(codes::S001, message).at(span, label).found(self.found()).expected(expected);
        let diagnostic = match self.open_brackets().last() {
            Some(&opener) if self.word(opener) == "(" => {
                diagnostic.also(self.span(opener), "this bracket is still open")
            }
            _ => diagnostic,
        };
        match self.help() {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        }
    }

    /// Both tokens at the stop, where either may be the wrong one.
    fn neighbours(&self) -> Option<(Span, String)> {
        let (&before, at) = (self.before.last()?, self.at?);
        let is_keyword = self.before.len() == 1;
        let names = (quoted(self.word(before)), quoted(self.word(at)));
        let message = match (self.ends_value(before), self.begins_value(at)) {
            (true, true) if !is_keyword || self.word(before) == "mixing" => {
                format!("something is missing between {} and {}", names.0, names.1)
            }
            (true, false) if self.wants_value() && !is_keyword => {
                format!("a value is missing between {} and {}", names.0, names.1)
            }
            (true, false) if self.word(at) == "=" && !is_keyword => {
                format!("{} does not fit after {}", names.1, names.0)
            }
            (false, false) if !RESERVED_WORDS.contains(&self.word(before)) => {
                format!("something is missing between {} and {}", names.0, names.1)
            }
            (false, true) if matches!(self.word(before), "," | ":") => {
                format!("{} does not fit after {}", names.1, names.0)
            }
            _ => return None,
        };
        Some((self.span(before).to(self.span(at)), message))
    }

    fn wants_value(&self) -> bool {
        self.expected.contains(&Rule::expression)
    }

    fn ends_value(&self, idx: usize) -> bool {
        match self.lexed.kind(idx) {
            Some(TokenKind::Word) => !RESERVED_WORDS.contains(&self.word(idx)),
            Some(TokenKind::Symbol) => matches!(self.word(idx), ")" | "}" | "]" | "%" | "‰"),
            _ => true,
        }
    }

    /// A text is no value: after an operator it shows that one is missing.
    fn begins_value(&self, idx: usize) -> bool {
        match self.lexed.kind(idx) {
            Some(TokenKind::Word) => !RESERVED_WORDS.contains(&self.word(idx)),
            Some(TokenKind::Number) => true,
            Some(TokenKind::Text) => self.before.last().is_some_and(|&before| self.ends_value(before)),
            _ => false,
        }
    }

    /// What the writer of a token that is at home in other languages will have meant.
    fn help(&self) -> Option<String> {
        let at = self.at?;
        let previous = self.before.last().map_or("", |&idx| self.word(idx));
        Some(match (previous, self.word(at)) {
            ("*", "*") => "a power is written `^`".to_owned(),
            (_, "=") if self.expected.contains(&Rule::infix) => "equality is written `==`".to_owned(),
            (_, word)
                if RESERVED_WORDS.contains(&word)
                    && [Rule::name, Rule::dotted].iter().any(|rule| self.expected.contains(rule)) =>
            {
                format!("`{}` is a word of the language and cannot be a name", shortened(word))
            }
            _ => return None,
        })
    }
}

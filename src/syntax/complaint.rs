//! Where the grammar stopped, as a message in the user's words.
//!
//! Owns the choice of the token to blame and of the words for what was expected. May use `grammar`,
//! `words`, `diagnostic`, the symbols of `units`.
//! It deliberately blames one token per statement: what follows a first mistake is guesswork.

use super::grammar::Rule;
use super::split::{Chunk, Lexed, track_bracket};
use super::tree::TokenKind;
use super::words::{RESERVED_WORDS, clause_words};
use crate::diagnostic::{Diagnostic, codes, did_you_mean};
use crate::source::Span;
use crate::units::is_unit_symbol;
use pest::error::{Error, ErrorVariant, InputLocation};

/// The message for a statement that the grammar refused.
pub fn complain(lexed: Lexed, chunk: &Chunk, error: &Error<Rule>) -> Diagnostic {
    let stop = Stop::find(lexed, chunk, error);
    None.or_else(|| stop.detached_fraction())
        .or_else(|| stop.broken_unit())
        .or_else(|| stop.misspelt_word())
        .or_else(|| stop.open_bracket())
        .or_else(|| stop.lone_bracket())
        .unwrap_or_else(|| stop.plain())
}

/// The significant tokens around the place where the grammar stopped.
struct Stop<'t> {
    lexed: Lexed<'t>,
    /// Indices of the significant tokens before the stop, in order.
    before: Vec<usize>,
    /// The token at the stop; none at the end of the statement.
    at: Option<usize>,
    expected: Vec<Rule>,
}

impl<'t> Stop<'t> {
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
        Self { lexed, before, at: after.first().copied(), expected }
    }

    fn word(&self, idx: usize) -> &'t str {
        self.lexed.slice(idx)
    }

    fn span(&self, idx: usize) -> Span {
        self.lexed.tokens[idx].span
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
        self.at.map_or_else(|| "the end of the statement".to_owned(), |idx| quoted(self.word(idx)))
    }

    fn expected(&self) -> String {
        let mut words: Vec<String> = self.expected.iter().flat_map(|rule| expected_words(*rule)).collect();
        words.dedup();
        let mut seen = std::collections::BTreeSet::new();
        words.retain(|word| seen.insert(word.clone()));
        join_words(&words)
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
            let diagnostic = Diagnostic::error(codes::S014, format!("{} is not a unit", quoted(unit_text)))
                .at(unit, "a word right after a number is its unit")
                .found(quoted(unit_text))
                .expected(format!("a unit, or {}", self.expected()))
                .also(self.span(at), "so this does not fit");
            return Some(diagnostic);
        }
        if !self.is_kind(at, TokenKind::Word) || RESERVED_WORDS.contains(&self.word(at)) {
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
        (is_unit && is_glued && !ends_open && !RESERVED_WORDS.contains(&self.word(last)))
            .then(|| (self.span(self.before[number]), self.span(first).to(self.span(last))))
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
            RESERVED_WORDS.contains(&self.word(idx)) || matches!(self.word(idx), ")" | "}" | "]")
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
                .also(self.span(opener), "opened here")
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

    fn plain(&self) -> Diagnostic {
        let expected = self.expected();
        let message = match self.at {
            Some(_) => format!("{} does not fit here", self.found()),
            None => "this statement ends too early".to_owned(),
        };
        let label = match self.at {
            Some(_) => format!("expected {expected}"),
            None => format!("after this, expected {expected}"),
        };
        let diagnostic = Diagnostic::error(codes::S001, message)
            .at(self.place(), label)
            .found(self.found())
            .expected(expected);
        match self.help() {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        }
    }

    /// What the writer of a token that is at home in other languages will have meant.
    fn help(&self) -> Option<String> {
        let at = self.at?;
        let previous = self.before.last().map_or("", |&idx| self.word(idx));
        Some(match (previous, self.word(at)) {
            ("*", "*") => "a power is written `^`".to_owned(),
            (_, "=") if self.expected.contains(&Rule::infix) => "equality is written `==`".to_owned(),
            (_, word) if RESERVED_WORDS.contains(&word) && self.expected.contains(&Rule::name) => {
                format!("`{word}` is a word of the language and cannot be a name")
            }
            (before, _) if self.is_after_kind(TokenKind::Number) && self.is_kind(at, TokenKind::Number) => {
                format!("something is missing between `{}` and this", shortened(before))
            }
            _ => return None,
        })
    }

    fn is_after_kind(&self, kind: TokenKind) -> bool {
        self.before.last().is_some_and(|&idx| self.is_kind(idx, kind))
    }
}

fn symbol_of(unit: &str) -> &str {
    unit.split(['^', '.', '·']).next().unwrap_or(unit)
}

/// A token in backticks, shortened where it is long; a text in quotes as it is.
pub fn quoted(token: &str) -> String {
    format!("`{}`", shortened(token))
}

fn shortened(token: &str) -> String {
    const MAX_SHOWN: usize = 40;
    let mut shown: String = token.chars().take(MAX_SHOWN).collect();
    if shown.len() < token.len() {
        shown.push('…');
    }
    shown
}

fn join_words(words: &[String]) -> String {
    match words {
        [] => "something else".to_owned(),
        [one] => one.clone(),
        [first @ .., last] => format!("{} or {last}", first.join(", ")),
    }
}

/// The word of a keyword's rule.
fn literal(rule: Rule) -> Option<&'static str> {
    use Rule as R;
    Some(match rule {
        R::kw_zones => "zones",
        R::kw_frame | R::frame => "frame",
        R::kw_moving => "moving",
        R::kw_to => "to",
        R::kw_step | R::run_step => "step",
        R::kw_in | R::in_unit => "in",
        R::kw_at | R::at => "at",
        R::kw_every | R::every => "every",
        R::kw_along | R::along => "along",
        R::kw_on | R::on => "on",
        R::kw_over | R::over => "over",
        R::kw_for => "for",
        R::kw_then => "then",
        R::kw_else => "else",
        _ => return None,
    })
}

/// What a rule is called in messages; nothing for what would only confuse.
fn expected_words(rule: Rule) -> Vec<String> {
    use Rule as R;
    let one = |word: &str| vec![word.to_owned()];
    match rule {
        R::EOI => one("the end of the statement"),
        R::expression | R::prefix | R::number | R::conditional | R::call | R::path | R::tuple => {
            one("a value")
        }
        R::range => one("a range `low .. high`"),
        R::infix => one("an operator"),
        R::name | R::term | R::species_item | R::species_list | R::assignment | R::target => one("a name"),
        R::reactants | R::products | R::target_kind => one("a name"),
        R::kind | R::output_kind | R::shape | R::boundary_kind => one("a kind"),
        R::setting => one("a setting"),
        R::argument | R::argument_name => one("an argument"),
        R::label | R::zone => one("a name with `:`"),
        R::zone_field => one("a field such as `rate`"),
        R::qualifier | R::placement => one("a further word"),
        R::text => one("a text in quotes"),
        R::bare_number | R::count | R::counts => one("a number"),
        R::unit => one("a unit"),
        R::axis_name | R::axis => ["`x`", "`y`", "`z`"].map(str::to_owned).to_vec(),
        R::side => one("a side such as `left`"),
        R::arrow => one("`->`"),
        R::rate_sign => one("`@`"),
        R::dots => one("`..`"),
        R::times_sign => one("`x`"),
        R::zone_end | R::comma => one("`,`"),
        R::colon => one("`:`"),
        R::plus => one("`+`"),
        R::assign => one("`=`"),
        R::open_round => one("`(`"),
        R::close_round => one("`)`"),
        R::open_brace => one("`{`"),
        R::close_brace => one("`}`"),
        R::kw_t => one("`t`"),
        _ => literal(rule).map(|word| format!("`{word}`")).into_iter().collect(),
    }
}

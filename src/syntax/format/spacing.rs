//! Blanks between the tokens of one line.
//!
//! Owns the rule for each pair of neighbours. May use `units` beside it.
//! It deliberately keeps `*` and `/` tight or wide as written: writers use it to show what belongs
//! together, as in `abs(x) / (2*sqrt(D*t))`.

use super::units::{is_glued, is_set_apart, unit_marks};
use crate::syntax::split::Lexed;
use crate::syntax::tree::TokenKind;
use crate::syntax::words::RESERVED_WORDS;

/// Words after which a minus is a sign.
const BEFORE_VALUE: &[&str] =
    &["fraction", "rate", "moving", "to", "step", "dispersion", "uniform", "charge", "forward", "backward"];

/// The same in statements of transport: keyword and word.
const BEFORE_VALUE_IN: &[(&str, &[&str])] = &[
    ("species", &["retardation", "diffusion"]),
    ("medium", &["porosity"]),
    ("exchange", &["bandwidth", "mixing_fraction", "cutoff", "diffusion_error"]),
    ("kernel", &["support"]),
    ("particles", &["disorder"]),
    ("dispersion", &["longitudinal", "transverse", "transverse_vertical", "molecular"]),
    ("flow", &["left", "right", "bottom", "top", "front", "back", "conductivity", "anisotropy"]),
];

fn is_before_value(keyword: &str, word: &str) -> bool {
    let of_keyword = BEFORE_VALUE_IN.iter().find(|(own, _)| *own == keyword);
    BEFORE_VALUE.contains(&word) || of_keyword.is_some_and(|(_, words)| words.contains(&word))
}

/// The number of blanks before each token of a line; `keyword` is the first token of its statement.
pub fn gaps(lexed: Lexed, line: &[usize], keyword: usize) -> Vec<usize> {
    let marks = unit_marks(lexed, line);
    let pair = Pair { lexed, line, marks: &marks, keyword };
    (0..line.len()).map(|position| usize::from(position > 0 && pair.is_apart(position))).collect()
}

struct Pair<'a, 't> {
    lexed: Lexed<'t>,
    line: &'a [usize],
    marks: &'a [bool],
    keyword: usize,
}

impl<'t> Pair<'_, 't> {
    fn word(&self, position: usize) -> &'t str {
        self.line.get(position).map_or("", |&idx| self.lexed.slice(idx))
    }

    fn is_kind(&self, position: usize, kind: TokenKind) -> bool {
        self.line.get(position).is_some_and(|&idx| self.lexed.kind(idx) == Some(kind))
    }

    /// Whether the token at `position` (not the first) stands apart from the one before it.
    fn is_apart(&self, position: usize) -> bool {
        if self.marks[position] {
            return !self.marks[position - 1] && is_set_apart(self.lexed, self.line[position]);
        }
        let (before, word) = (self.word(position - 1), self.word(position));
        match (before, word) {
            (_, "," | ";" | ":" | ")" | "]") | ("(" | "[", _) | ("{", "}") => false,
            ("," | ";" | ":" | "{", _) | (_, "}" | "{") => true,
            (".", _) | (_, ".") => false,
            _ if self.is_sign(position - 1) => false,
            ("^", _) => self.is_wide_power(position - 1),
            (_, "^") => self.is_wide_power(position),
            ("*" | "/", _) => self.is_wide(position - 1),
            (_, "*" | "/") => self.is_wide(position),
            (_, "(") => self.is_apart_from_bracket(position),
            _ => true,
        }
    }

    /// Whether the token is a minus, or the plus of a charge, that belongs to the value after it.
    fn is_sign(&self, position: usize) -> bool {
        if !matches!(self.word(position), "-" | "+") || self.marks[position] {
            return false;
        }
        let Some(before) = position.checked_sub(1) else { return false };
        let word = self.word(before);
        if self.word(position) == "+" {
            return word == "charge" && self.lexed.slice(self.keyword) == "species";
        }
        match self.lexed.kind(self.line[before]) {
            Some(TokenKind::Symbol) => !matches!(word, ")" | "]" | "}") && !self.marks[before],
            Some(TokenKind::Word) => {
                let is_before_value = RESERVED_WORDS.contains(&word)
                    || is_before_value(self.lexed.slice(self.keyword), word)
                    || (self.lexed.slice(self.keyword) == "sweep"
                        && self.lexed.begins_entry(self.line[before]));
                !self.marks[before] && is_before_value
            }
            _ => false,
        }
    }

    /// Whether an operator was written with a blank on either side.
    fn is_wide(&self, position: usize) -> bool {
        let after = self.line.get(position + 1);
        !is_glued(self.lexed, self.line[position]) || after.is_some_and(|&idx| !is_glued(self.lexed, idx))
    }

    /// `2 m ^ 2` squares the length and must not become `2 m^2`.
    fn is_wide_power(&self, position: usize) -> bool {
        position > 0 && self.marks[position - 1] && self.is_wide(position)
    }

    /// A call has its bracket at the name; a keyword, an operator or a comparison does not.
    fn is_apart_from_bracket(&self, position: usize) -> bool {
        let before = position - 1;
        let is_name = self.is_kind(before, TokenKind::Word)
            && self.line[before] != self.keyword
            && !RESERVED_WORDS.contains(&self.word(before));
        !is_name || !is_glued(self.lexed, self.line[position])
    }
}

//! Which tokens after a number belong to it.
//!
//! Owns the unit rule of the grammar, on tokens. May use `lexed` texts and the symbols of `units`.
//! It deliberately also takes `/tau` for a unit: kept as written, its meaning stays whatever it is.

use crate::syntax::split::Lexed;
use crate::syntax::tree::TokenKind;
use crate::syntax::words::is_no_unit;
use crate::units::is_unit_symbol;

/// Marks the tokens of `line` that are parts of units: `true` for each after a number.
pub fn unit_marks(lexed: Lexed, line: &[usize]) -> Vec<bool> {
    let mut marks = vec![false; line.len()];
    let mut position = 0;
    while position < line.len() {
        let is_number = lexed.kind(line[position]) == Some(TokenKind::Number);
        let is_exponent = position > 0 && lexed.slice(line[position - 1]) == "^";
        let n_unit = if is_number { unit_tokens(lexed, &line[position + 1..]) } else { 0 };
        let is_division = is_exponent && line.get(position + 1).is_some_and(|&idx| lexed.slice(idx) == "/");
        if !is_division {
            marks[position + 1..][..n_unit].fill(true);
        }
        position += 1 + n_unit;
    }
    marks
}

/// Whether a unit that begins with this token is set apart from its number: `3 /d`, but `1/tau`.
pub fn is_set_apart(lexed: Lexed, first: usize) -> bool {
    lexed.slice(first) != "/" || is_unit_symbol(lexed.slice(first + 1)) || !is_glued(lexed, first)
}

/// How many of the tokens that follow a number are its unit.
fn unit_tokens(lexed: Lexed, rest: &[usize]) -> usize {
    let mut n_taken = 0;
    loop {
        let n_joint = match rest.get(n_taken).map(|&idx| lexed.slice(idx)) {
            Some("/") => 1,
            Some("." | "·") if n_taken > 0 => 1,
            Some(_) if n_taken == 0 => 0,
            _ => return n_taken,
        };
        let is_glued_joint = n_taken == 0 || is_glued(lexed, rest[n_taken]);
        let Some(n_part) = part_tokens(lexed, &rest[n_taken + n_joint..], n_taken + n_joint > 0) else {
            return n_taken;
        };
        if !is_glued_joint {
            return n_taken;
        }
        n_taken += n_joint + n_part;
    }
}

/// A symbol with its exponent, if it is one and no call.
fn part_tokens(lexed: Lexed, rest: &[usize], must_touch: bool) -> Option<usize> {
    let symbol = *rest.first()?;
    let word = lexed.slice(symbol);
    let is_symbol =
        matches!(word, "%" | "‰") || lexed.kind(symbol) == Some(TokenKind::Word) && !is_no_unit(word);
    if !is_symbol || (must_touch && !is_glued(lexed, symbol)) {
        return None;
    }
    let exponent = exponent_tokens(lexed, &rest[1..]);
    let is_call = rest.get(1 + exponent).is_some_and(|&idx| lexed.slice(idx) == "(" && is_glued(lexed, idx));
    if !is_call {
        return Some(1 + exponent);
    }
    // The grammar then tries the symbol without its exponent.
    (exponent > 0).then_some(1)
}

fn exponent_tokens(lexed: Lexed, rest: &[usize]) -> usize {
    let is = |position: usize, word: &str| {
        rest.get(position).is_some_and(|&idx| lexed.slice(idx) == word && is_glued(lexed, idx))
    };
    if !is(0, "^") {
        return 0;
    }
    let digits = 1 + usize::from(is(1, "-"));
    let is_whole = rest.get(digits).is_some_and(|&idx| {
        is_glued(lexed, idx) && lexed.slice(idx).bytes().all(|byte| byte.is_ascii_digit())
    });
    if is_whole { digits + 1 } else { 0 }
}

/// Whether a token follows the one before it without a blank.
pub fn is_glued(lexed: Lexed, idx: usize) -> bool {
    idx > 0 && lexed.is_significant(idx - 1)
}

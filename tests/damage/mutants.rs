//! One token of a scene deleted, swapped with the next or misspelt; one unit replaced by another.

use super::{Token, replaced, tokens};
use lamella::syntax::tree::TokenKind;
use lamella::units::Unit;
use std::ops::Range;

/// A damaged text and where a message should point.
pub struct Mutant {
    pub what: String,
    pub text: String,
    /// The touched token or tokens; for a deletion the gap with the tokens beside it.
    pub place: Range<usize>,
}

/// Every deletion, swap and misspelling of one token.
pub fn of_tokens(text: &str) -> Vec<Mutant> {
    let tokens = tokens(text);
    let mut mutants = Vec::new();
    for idx in 0..tokens.len() {
        mutants.push(deletion(text, &tokens, idx));
        mutants.extend(swap(text, &tokens, idx));
        mutants.extend(misspellings(text, &tokens[idx]));
    }
    mutants
}

fn deletion(text: &str, tokens: &[Token], idx: usize) -> Mutant {
    let range = tokens[idx].1.clone();
    let (result, _) = replaced(text, &range, "");
    let start = idx.checked_sub(1).map_or(range.start, |before| tokens[before].1.start);
    let end = tokens.get(idx + 1).map_or(range.start, |(_, after)| after.end - range.len());
    Mutant { what: format!("without `{}`", &text[range]), text: result, place: start..end }
}

fn swap(text: &str, tokens: &[Token], idx: usize) -> Option<Mutant> {
    let (first, second) = (tokens[idx].1.clone(), tokens.get(idx + 1)?.1.clone());
    let swapped =
        format!("{}{}{}", &text[second.clone()], &text[first.end..second.start], &text[first.clone()]);
    let (result, place) = replaced(text, &(first.start..second.end), &swapped);
    let what = format!("`{}` and `{}` swapped", &text[first], &text[second]);
    (result != text).then_some(Mutant { what, text: result, place })
}

/// Each character of the token changed, dropped and doubled, and what is wrong with the whole of it.
fn misspellings(text: &str, (kind, range): &Token) -> Vec<Mutant> {
    let word = &text[range.clone()];
    let mut mutants = Vec::new();
    let mut add = |wrong: Vec<String>| {
        for wrong in wrong.into_iter().filter(|wrong| !wrong.is_empty() && wrong != word) {
            let (result, place) = replaced(text, range, &wrong);
            mutants.push(Mutant { what: format!("`{word}` as `{wrong}`"), text: result, place });
        }
    };
    for (at, old) in word.char_indices() {
        let rest = &word[at + old.len_utf8()..];
        let with = |new: &str| format!("{}{new}{rest}", &word[..at]);
        let mut wrong = vec![with(""), with(&format!("{old}{old}"))];
        wrong.extend(other_characters(old).map(|new| with(&new.to_string())));
        add(wrong);
    }
    add(as_a_whole(*kind, word));
    mutants
}

/// Words with a letter too many, numbers with a letter inside or a point at the end, texts without
/// quotes, symbols that the language does not have.
fn as_a_whole(kind: TokenKind, word: &str) -> Vec<String> {
    let middle = word.char_indices().nth(word.chars().count() / 2).map_or(0, |(at, _)| at);
    let (head, tail) = word.split_at(middle);
    match kind {
        TokenKind::Word => vec![format!("{word}q")],
        TokenKind::Number => vec![format!("{head}q{tail}"), format!("{word}.")],
        TokenKind::Text => vec![word.trim_matches('"').to_owned()],
        _ => vec!["?".to_owned()],
    }
}

/// What may be typed in place of a character: one of its kind, and for a digit also a letter.
fn other_characters(old: char) -> impl Iterator<Item = char> {
    let (first, second) = match old {
        'q' => ('w', None),
        _ if old.is_alphabetic() => ('q', None),
        '0'..='8' => (char::from(old as u8 + 1), Some('o')),
        '9' => ('0', Some('o')),
        ';' => (':', None),
        _ => (';', None),
    };
    std::iter::once(first).chain(second)
}

/// Units of dimensions that scenes use, and of some that they do not.
const OTHER_UNITS: &[&str] =
    &["m", "cm^2", "L", "s", "/d", "cm/s", "m^2/s", "mol/L", "mg/L", "mol", "kg", "K", "bar", "%"];

/// Every unit replaced by every listed one of another dimension.
pub fn of_units(text: &str) -> Vec<Mutant> {
    let mut mutants = Vec::new();
    for range in units(text) {
        let old = Unit::parse(&text[range.clone()]).expect("a unit").dimension;
        for new in OTHER_UNITS {
            if Unit::parse(new).expect("a unit").dimension != old {
                let (result, place) = replaced(text, &range, new);
                mutants.push(Mutant {
                    what: format!("`{}` as `{new}`", &text[range.clone()]),
                    text: result,
                    place,
                });
            }
        }
    }
    mutants
}

/// Where units stand: what reads as one right after a number, or after `in`.
fn units(text: &str) -> Vec<Range<usize>> {
    let tokens = tokens(text);
    let mut found = Vec::new();
    for (kind, range) in &tokens {
        if *kind != TokenKind::Number && &text[range.clone()] != "in" {
            continue;
        }
        let line = text[range.end..].lines().next().unwrap_or("");
        let start = range.end + line.len() - line.trim_start().len();
        let ends_unit = |c: char| !(c.is_alphanumeric() || "/^-·%".contains(c));
        let length = text[start..].find(ends_unit).unwrap_or(text.len() - start);
        if Unit::parse(&text[start..start + length]).is_ok() {
            found.push(start..start + length);
        }
    }
    found
}

//! One token of a valid scene deleted, swapped with the next or misspelt: does the first message
//! point at it?

use crate::{GRAMLING, messages_of};
use lamella::source::FileId;
use lamella::syntax::parse;
use lamella::syntax::tree::TokenKind;
use std::ops::Range;

/// A broken text and the places of the tokens that were touched, the neighbours of a gap included.
struct Mutant {
    what: String,
    text: String,
    places: Vec<Range<usize>>,
}

fn significant(text: &str) -> Vec<(TokenKind, Range<usize>)> {
    let (file, _) = parse(FileId(0), text);
    let is_kept = |kind| !matches!(kind, TokenKind::Blank | TokenKind::Newline | TokenKind::Comment);
    file.tokens
        .iter()
        .filter(|token| is_kept(token.kind))
        .map(|token| (token.kind, token.span.range()))
        .collect()
}

/// The text with a range replaced, and where the replacement lies.
fn replaced(text: &str, range: &Range<usize>, by: &str) -> (String, Range<usize>) {
    let mut result = text.to_owned();
    result.replace_range(range.clone(), by);
    (result, range.start..range.start + by.len())
}

fn deletion(text: &str, tokens: &[(TokenKind, Range<usize>)], idx: usize) -> Mutant {
    let range = tokens[idx].1.clone();
    let (result, _) = replaced(text, &range, "");
    let before = idx.checked_sub(1).map(|before| tokens[before].1.clone());
    let after = tokens.get(idx + 1).map(|(_, after)| after.start - range.len()..after.end - range.len());
    let what = format!("without `{}`", &text[range]);
    Mutant { what, text: result, places: before.into_iter().chain(after).collect() }
}

fn swap(text: &str, tokens: &[(TokenKind, Range<usize>)], idx: usize) -> Option<Mutant> {
    let (first, second) = (tokens[idx].1.clone(), tokens.get(idx + 1)?.1.clone());
    let swapped =
        format!("{}{}{}", &text[second.clone()], &text[first.end..second.start], &text[first.clone()]);
    let (result, place) = replaced(text, &(first.start..second.end), &swapped);
    let what = format!("`{}` and `{}` swapped", &text[first], &text[second]);
    Some(Mutant { what, text: result, places: vec![place] })
}

/// Words lose a letter, get one twice, get one more or a wrong one; numbers get a letter inside;
/// symbols become another one.
fn misspellings(text: &str, token: &(TokenKind, Range<usize>)) -> Vec<Mutant> {
    let word = &text[token.1.clone()];
    let middle = word.char_indices().nth(word.chars().count() / 2).map_or(0, |(at, _)| at);
    let (head, tail) = word.split_at(middle);
    let rest = tail.get(1..).unwrap_or("");
    let wrong = match token.0 {
        TokenKind::Word => vec![format!("{head}{rest}"), format!("{word}q"), format!("{head}z{rest}")],
        TokenKind::Number => vec![format!("{head}q{tail}"), format!("{word}.")],
        TokenKind::Text => vec![format!("\"{}", word.trim_matches('"')), word.trim_matches('"').to_owned()],
        _ => vec![";".to_owned(), "?".to_owned()],
    };
    let wrong = wrong.into_iter().filter(|it| !it.is_empty());
    let mutants = wrong.map(|wrong| {
        let (result, place) = replaced(text, &token.1, &wrong);
        Mutant { what: format!("`{word}` as `{wrong}`"), text: result, places: vec![place] }
    });
    mutants.collect()
}

fn mutants(text: &str) -> Vec<Mutant> {
    let tokens = significant(text);
    let mut mutants = Vec::new();
    for idx in 0..tokens.len() {
        mutants.push(deletion(text, &tokens, idx));
        mutants.extend(swap(text, &tokens, idx));
        mutants.extend(misspellings(text, &tokens[idx]));
    }
    mutants
}

/// Whether the first message points at a touched token; none if the mutant is valid syntax.
fn is_hit(mutant: &Mutant) -> Option<bool> {
    let messages = messages_of(&mutant.text);
    let primary = messages.first()?.primary_span()?.range();
    Some(mutant.places.iter().any(|place| primary.start <= place.end && place.start <= primary.end))
}

/// The bar is 95 % over all phases; what the syntax alone finds should be above it.
#[test]
fn the_first_message_points_at_the_mutated_token() {
    let mutants = mutants(GRAMLING);
    let judged: Vec<_> = mutants.iter().filter_map(|mutant| Some((mutant, is_hit(mutant)?))).collect();
    let missed: Vec<_> =
        judged.iter().filter(|(_, is_hit)| !is_hit).map(|(mutant, _)| describe(mutant)).collect();
    let rate = 1.0 - missed.len() as f64 / judged.len() as f64;
    println!("{} mutants, {} with a message, {:.1} % hit", mutants.len(), judged.len(), 100.0 * rate);
    assert!(rate > 0.97, "{rate}\n{}", missed.join("\n"));
}

fn describe(mutant: &Mutant) -> String {
    let messages = messages_of(&mutant.text);
    let line = mutant.text[mutant.places[0].clone().start..].lines().next().unwrap_or("").to_owned();
    let first = messages.first();
    let place = first.and_then(|message| message.primary_span()).map(|span| &mutant.text[span.range()]);
    format!("{}: {:?} at {place:?} …{line}", mutant.what, first.map(|message| &message.message))
}

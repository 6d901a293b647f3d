//! Text to tokens that cover it without a gap.
//!
//! Owns the lexical shapes: words, numbers, texts, symbols, comments. May use `source`.
//! It deliberately reports nothing: what no rule knows becomes [`TokenKind::Unknown`], and a text
//! without its closing quote stays a [`TokenKind::Text`]; `bounds` speaks about both.

use super::tree::{Token, TokenKind};
use crate::source::{FileId, Span};

/// Symbols, longest first, so that the first match is the right one.
const SYMBOLS: &[&str] = &[
    "<->", "->", "<=", ">=", "==", "!=", "..", "(", ")", "{", "}", "[", "]", ",", "=", "+", "-", "*", "/",
    "^", "<", ">", "@", ":", ";", ".", "·", "%", "‰",
];

/// All tokens of a text, in order; their spans touch each other and cover it.
pub fn tokenize(file: FileId, text: &str) -> Vec<Token> {
    let mut tokens = Vec::with_capacity(text.len() / 3);
    let mut start = 0;
    let mut is_beginning = true;
    while start < text.len() {
        let (kind, n_bytes) = next_token(&text[start..], is_beginning);
        is_beginning &= matches!(kind, TokenKind::Blank | TokenKind::Newline);
        tokens.push(Token { kind, span: Span::new(file, start, start + n_bytes) });
        start += n_bytes;
    }
    tokens
}

/// The tokens of a part of a text, with their characters.
pub fn tokens(text: &str) -> Vec<(TokenKind, &str)> {
    let tokens = tokenize(FileId(0), text);
    tokens.into_iter().map(|token| (token.kind, &text[token.span.range()])).collect()
}

/// Kind and length of the token that `rest` (not empty) begins with; at the beginning of a file only
/// blanks and line ends stand before it.
fn next_token(rest: &str, is_beginning: bool) -> (TokenKind, usize) {
    let first = rest.chars().next().unwrap_or('\0');
    match first {
        '\n' => (TokenKind::Newline, 1),
        '\r' => (TokenKind::Newline, if rest.starts_with("\r\n") { 2 } else { 1 }),
        ' ' | '\t' => (TokenKind::Blank, prefix_length(rest, |c| c == ' ' || c == '\t')),
        // A byte order mark is what some editors put first; it means nothing.
        '\u{feff}' if is_beginning => (TokenKind::Blank, first.len_utf8()),
        '#' => (TokenKind::Comment, prefix_length(rest, |c| c != '\n' && c != '\r')),
        '"' => (TokenKind::Text, text_length(rest)),
        '0'..='9' => (TokenKind::Number, number_length(rest)),
        _ if is_word_start(first) => (TokenKind::Word, prefix_length(rest, is_word_part)),
        _ => match SYMBOLS.iter().find(|symbol| rest.starts_with(**symbol)) {
            Some(symbol) => (TokenKind::Symbol, symbol.len()),
            None => (TokenKind::Unknown, first.len_utf8()),
        },
    }
}

/// Whether a word may begin with `c`; the degree sign begins the unit `°C`.
pub fn is_word_start(c: char) -> bool {
    c.is_alphabetic() || c == '_' || c == '°'
}

/// Whether a word may go on with `c`.
pub fn is_word_part(c: char) -> bool {
    is_word_start(c) || c.is_ascii_digit()
}

fn prefix_length(rest: &str, belongs: impl Fn(char) -> bool) -> usize {
    rest.find(|c| !belongs(c)).unwrap_or(rest.len())
}

/// Up to and with the closing quote, or to the line end where there is none.
fn text_length(rest: &str) -> usize {
    let mut is_escaped = false;
    for (idx, c) in rest.char_indices().skip(1) {
        match c {
            '\n' | '\r' => return idx,
            _ if is_escaped => is_escaped = false,
            '\\' => is_escaped = true,
            '"' => return idx + 1,
            _ => {}
        }
    }
    rest.len()
}

/// Digits with single `_` between them, then a fraction, then an exponent; `1..2` is `1`, `..`, `2`.
fn number_length(rest: &str) -> usize {
    let bytes = rest.as_bytes();
    let mut end = digits_end(bytes, 0);
    if bytes.get(end) == Some(&b'.') && digits_end(bytes, end + 1) > end + 1 {
        end = digits_end(bytes, end + 1);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent_end = digits_end(bytes, end + 1 + sign);
        if exponent_end > end + 1 + sign {
            end = exponent_end;
        }
    }
    end
}

/// Where a run of digits that begins at `start` ends; `start` itself if there is none.
fn digits_end(bytes: &[u8], start: usize) -> usize {
    let mut end = start;
    loop {
        match bytes.get(end) {
            Some(b'0'..=b'9') => end += 1,
            Some(b'_') if end > start && matches!(bytes.get(end + 1), Some(b'0'..=b'9')) => end += 1,
            _ => return end,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pieces(text: &str) -> Vec<&str> {
        tokenize(FileId(0), text).iter().map(|token| &text[token.span.range()]).collect()
    }

    #[test]
    fn ranges_do_not_eat_the_points() {
        assert_eq!(pieces("0..1"), ["0", "..", "1"]);
        assert_eq!(pieces("1..10 d"), ["1", "..", "10", " ", "d"]);
        assert_eq!(pieces("1.5..2"), ["1.5", "..", "2"]);
        assert_eq!(pieces("1."), ["1", "."]);
    }

    #[test]
    fn numbers_take_underscores_and_exponents() {
        assert_eq!(pieces("1_000_000"), ["1_000_000"]);
        assert_eq!(pieces("1.2e-2cm"), ["1.2e-2", "cm"]);
        assert_eq!(pieces("1eV"), ["1", "eV"]);
        assert_eq!(pieces("1__0"), ["1", "__0"]);
    }

    #[test]
    fn texts_end_at_the_line() {
        assert_eq!(pieces("\"a\\\"b\" c"), ["\"a\\\"b\"", " ", "c"]);
        assert_eq!(pieces("\"a\nb"), ["\"a", "\n", "b"]);
        assert_eq!(pieces("\"a\\\nb"), ["\"a\\", "\n", "b"]);
    }

    #[test]
    fn arrows_are_whole() {
        assert_eq!(pieces("A<->B->C"), ["A", "<->", "B", "->", "C"]);
    }
}

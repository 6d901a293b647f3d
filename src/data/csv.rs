//! Separated text (RFC 4180), record by record.
//!
//! Owns quoting, comments and numbers. May use the messages beside it. It deliberately guesses nothing: a decimal
//! comma is a message and not a try.

use super::error::{Kind, Place, ReadError};
use std::borrow::Cow;

/// The text of a file, without the mark that some programs put before it.
pub fn text(bytes: &[u8]) -> Result<&str, ReadError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    std::str::from_utf8(bytes).map_err(|error| {
        let place = Place::Byte(error.valid_up_to());
        ReadError::new(Kind::Foreign, "the file is not text in UTF-8").at(place)
    })
}

/// Whether nothing but what decimal numbers are written with is there.
pub fn is_decimal(text: &str) -> bool {
    text.bytes().all(|c| c.is_ascii_digit() || matches!(c, b'+' | b'-' | b'.' | b'e' | b'E'))
}

/// A decimal number; what Rust reads beyond that (`inf`, `nan`) is none.
pub fn number(field: &Field, column: &str) -> Result<f64, ReadError> {
    let text = field.text.trim();
    if let Some(number) = text.parse::<f64>().ok().filter(|number| is_decimal(text) && number.is_finite()) {
        return Ok(number);
    }
    let wrong = |message: String| ReadError::new(Kind::Value, message).at(field.place());
    if text.is_empty() {
        return Err(wrong(format!("column `{column}` is empty here")));
    }
    let error = wrong(format!("`{}` in column `{column}` is no finite number", field.shown()));
    let with_e = text.replace(['d', 'D'], "e");
    Err(if text.contains(',') && text.replacen(',', ".", 1).parse::<f64>().is_ok() {
        error.help("write a decimal point")
    } else if with_e != text && with_e.parse::<f64>().is_ok() {
        error.help(format!("write `{with_e}`"))
    } else {
        error
    })
}

/// What stands between two separators, and where.
pub struct Field<'a> {
    pub text: Cow<'a, str>,
    pub line: u32,
    pub column: u32,
}

impl Field<'_> {
    pub fn place(&self) -> Place {
        Place::Text { line: self.line as usize, column: self.column as usize }
    }

    /// For messages: short, and nothing that steers a terminal.
    pub fn shown(&self) -> String {
        let clean = |c: char| if c.is_control() { '?' } else { c };
        self.text.trim().chars().take(40).map(clean).collect()
    }
}

/// Takes records off a text. Lines that start with `#` and empty lines are passed over.
pub struct Reader<'a> {
    rest: &'a str,
    line: u32,
    column: u32,
    /// One byte long.
    separator: char,
}

impl<'a> Reader<'a> {
    pub fn new(text: &'a str, separator: char) -> Self {
        Self { rest: text, line: 1, column: 1, separator }
    }

    /// The fields of the next line that has any; a line may go on in a quoted field.
    pub fn record(&mut self) -> Result<Option<Vec<Field<'a>>>, ReadError> {
        loop {
            if self.rest.is_empty() {
                return Ok(None);
            }
            let (line, _) = self.rest.split_once('\n').unwrap_or((self.rest, ""));
            if !line.starts_with('#') && !line.trim().is_empty() {
                break;
            }
            self.skip(line.len());
            self.end_line();
        }
        let mut fields = Vec::new();
        loop {
            fields.push(self.field()?);
            if self.rest.starts_with(self.separator) {
                self.skip(1);
                continue;
            }
            if !self.end_line() {
                let message = "text follows a closing quote";
                return Err(ReadError::new(Kind::Damaged, message)
                    .at(self.place())
                    .help("a quote within quotes is written twice"));
            }
            return Ok(Some(fields));
        }
    }

    fn field(&mut self) -> Result<Field<'a>, ReadError> {
        let (line, column) = (self.line, self.column);
        if !self.rest.starts_with('"') {
            let separator = self.separator as u8;
            let ends = |c: u8| c == separator || c == b'\n';
            let end = self.rest.bytes().position(ends).unwrap_or(self.rest.len());
            let text = &self.rest[..end];
            self.skip(text.strip_suffix('\r').unwrap_or(text).len());
            return Ok(Field { text: Cow::Borrowed(text.trim_end_matches('\r')), line, column });
        }
        let open = self.place();
        let mut text = String::new();
        self.skip(1);
        loop {
            let Some(end) = self.rest.find('"') else {
                return Err(ReadError::new(Kind::Damaged, "this quote is never closed").at(open));
            };
            text.push_str(&self.rest[..end]);
            self.skip(end + 1);
            if !self.rest.starts_with('"') {
                return Ok(Field { text: Cow::Owned(text), line, column });
            }
            text.push('"');
            self.skip(1);
        }
    }

    fn place(&self) -> Place {
        Place::Text { line: self.line as usize, column: self.column as usize }
    }

    /// Passes over bytes, which may hold ends of lines inside quotes.
    fn skip(&mut self, n: usize) {
        let passed = &self.rest[..n];
        let of_line = |text: &str| text.chars().count() as u32;
        match passed.rfind('\n') {
            None => self.column += of_line(passed),
            Some(last) => {
                self.line += passed.bytes().filter(|&c| c == b'\n').count() as u32;
                self.column = 1 + of_line(&passed[last + 1..]);
            }
        }
        self.rest = &self.rest[n..];
    }

    /// Passes over the end of a line, or tells that something else stands here.
    fn end_line(&mut self) -> bool {
        let rest = self.rest.strip_prefix('\r').unwrap_or(self.rest);
        let Some(rest) = rest.strip_prefix('\n').or_else(|| rest.is_empty().then_some(rest)) else {
            return false;
        };
        (self.rest, self.line, self.column) = (rest, self.line + 1, 1);
        true
    }
}

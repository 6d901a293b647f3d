//! The header of an NPY file: a Python dictionary of three entries.
//!
//! Owns its grammar. May use bytes and errors. It deliberately reads no other Python.

use super::bytes::{Bytes, text};
use super::error::{Kind, ReadError};

const MAGIC: &[u8] = b"\x93NUMPY";

/// What the elements are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    Single,
    Double,
}

impl Number {
    pub(super) fn size(self) -> usize {
        match self {
            Self::Single => 4,
            Self::Double => 8,
        }
    }
}

#[derive(Debug)]
pub(super) struct Header {
    pub number: Number,
    pub is_big_endian: bool,
    pub is_fortran_order: bool,
    pub shape: Vec<usize>,
}

/// A value of the dictionary.
#[derive(Debug, PartialEq)]
enum Entry<'a> {
    Text(&'a str),
    Truth(bool),
    Lengths(Vec<usize>),
    Other,
}

impl Header {
    pub(super) fn read(bytes: &mut Bytes) -> Result<Self, ReadError> {
        if !bytes.rest().starts_with(MAGIC) {
            let start = &bytes.rest()[..bytes.rest().len().min(8)];
            let message = format!("this is no NPY file: it starts with `{}`", text(start));
            return Err(ReadError::new(Kind::Foreign, message).help("`numpy.save` writes one"));
        }
        bytes.take(MAGIC.len(), "the first bytes")?;
        let [major, minor] = bytes.array("the version")?;
        let n_bytes = match (major, minor) {
            (1, 0) => u16::from_le_bytes(bytes.array("the length of the header")?) as usize,
            (2 | 3, 0) => u32::from_le_bytes(bytes.array("the length of the header")?) as usize,
            _ => {
                let message = format!("this is NPY version {major}.{minor}");
                return Err(ReadError::new(Kind::Unsupported, message).help("versions 1.0 to 3.0 are read"));
            }
        };
        let place = bytes.place();
        let header = bytes.take(n_bytes, "the header")?;
        let damaged = |what: &str| ReadError::new(Kind::Damaged, what).at(place);
        let header = std::str::from_utf8(header).map_err(|_| damaged("the header is not text"))?;
        Self::of(header).map_err(|error| error.at(place))
    }

    fn of(text: &str) -> Result<Self, ReadError> {
        let damaged = || ReadError::new(Kind::Damaged, "the header is no dictionary as NumPy writes it");
        let entries = entries(text).ok_or_else(damaged)?;
        let entry = |key: &str| entries.iter().find(|(name, _)| *name == key).map(|(_, entry)| entry);
        let Some(Entry::Lengths(shape)) = entry("shape") else { return Err(damaged()) };
        let Some(&Entry::Truth(is_fortran_order)) = entry("fortran_order") else { return Err(damaged()) };
        let (number, is_big_endian) = match entry("descr") {
            Some(Entry::Text("<f8")) => (Number::Double, false),
            Some(Entry::Text(">f8")) => (Number::Double, true),
            Some(Entry::Text("<f4")) => (Number::Single, false),
            Some(Entry::Text(">f4")) => (Number::Single, true),
            None => return Err(damaged()),
            Some(Entry::Text("|O" | "O")) => {
                return Err(ReadError::new(
                    Kind::Unsupported,
                    "the elements are objects of Python, not numbers",
                )
                .help(
                    "rows of different lengths, words or `None` make such an array: mend these, then \
                         `numpy.save(file, numpy.array(rows, dtype=\"f8\"))`",
                ));
            }
            Some(other) => {
                let kind = if let Entry::Text(kind) = other { format!("`{kind}`") } else { "records".into() };
                return Err(ReadError::new(Kind::Unsupported, format!("the elements are {kind}"))
                    .help("write floats of 4 or 8 bytes: `numpy.save(file, array.astype(\"f8\"))`"));
            }
        };
        Ok(Self { number, is_big_endian, is_fortran_order, shape: shape.clone() })
    }
}

/// `{'key': value, …}`; `None` if it is none.
fn entries(text: &str) -> Option<Vec<(&str, Entry<'_>)>> {
    let mut rest = text.trim().strip_prefix('{')?.strip_suffix('}')?.trim();
    let mut entries = Vec::new();
    while !rest.is_empty() {
        let (key, after) = quoted(rest)?;
        let (entry, after) = value(after.trim_start().strip_prefix(':')?.trim_start())?;
        entries.push((key, entry));
        rest = after.trim_start();
        rest = match rest.strip_prefix(',') {
            Some(after) => after.trim_start(),
            None if rest.is_empty() => rest,
            None => return None,
        };
    }
    Some(entries)
}

fn quoted(text: &str) -> Option<(&str, &str)> {
    let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    text[1..].split_once(quote)
}

fn value(text: &str) -> Option<(Entry<'_>, &str)> {
    if let Some((text, rest)) = quoted(text) {
        return Some((Entry::Text(text), rest));
    }
    if let Some(rest) = text.strip_prefix("True") {
        return Some((Entry::Truth(true), rest));
    }
    if let Some(rest) = text.strip_prefix("False") {
        return Some((Entry::Truth(false), rest));
    }
    if let Some(rest) = text.strip_prefix('(') {
        let (inside, rest) = rest.split_once(')')?;
        let parts = inside.split(',').map(str::trim).filter(|part| !part.is_empty());
        let lengths = parts.map(|part| part.trim_end_matches('L').parse().ok()).collect::<Option<_>>()?;
        return Some((Entry::Lengths(lengths), rest));
    }
    // A list tells of records, which are refused by the caller; brackets inside it are balanced.
    let mut depth = 0usize;
    for (idx, c) in text.char_indices() {
        match c {
            '[' => depth += 1,
            ']' => depth = depth.checked_sub(1)?,
            _ => {}
        }
        if depth == 0 {
            return (idx > 0).then(|| (Entry::Other, &text[idx + 1..]));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_numpy_writes_is_read() {
        let header = Header::of("{'descr': '>f4', 'fortran_order': True, 'shape': (3, 4), }  \n").unwrap();
        assert_eq!(
            (header.number, header.is_big_endian, header.is_fortran_order),
            (Number::Single, true, true)
        );
        assert_eq!(header.shape, [3, 4]);
        assert_eq!(
            Header::of("{'descr': '<f8', 'fortran_order': False, 'shape': (7,), }").unwrap().shape,
            [7]
        );
        assert!(
            Header::of("{'descr': '<f8', 'fortran_order': False, 'shape': (), }").unwrap().shape.is_empty()
        );
    }

    #[test]
    fn other_elements_are_named_and_nonsense_is_refused() {
        let integers = Header::of("{'descr': '<i8', 'fortran_order': False, 'shape': (7,), }").unwrap_err();
        assert_eq!((integers.kind, integers.message.as_str()), (Kind::Unsupported, "the elements are `<i8`"));
        let records =
            "{'descr': [('a', '<f8'), ('b', '<f8', (2,))], 'fortran_order': False, 'shape': (7,), }";
        assert_eq!(Header::of(records).unwrap_err().message, "the elements are records");
        for wrong in
            ["", "{", "{}", "{'shape': (7,)}", "{'a' 'b'}", "{'descr': [[[}", "{'é", "{'shape': (x,)}"]
        {
            assert_eq!(Header::of(wrong).unwrap_err().kind, Kind::Damaged, "{wrong}");
        }
    }
}

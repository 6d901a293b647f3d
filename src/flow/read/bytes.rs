//! A file's bytes, taken front to back.
//!
//! Owns the bounds: nothing is taken that is not there, so nothing larger than the file is ever asked of
//! memory. May use the errors. It deliberately allocates nothing.

use super::error::{Kind, Place, ReadError};

pub(super) struct Bytes<'a> {
    all: &'a [u8],
    at: usize,
}

impl<'a> Bytes<'a> {
    pub(super) fn new(all: &'a [u8]) -> Self {
        Self { all, at: 0 }
    }

    pub(super) fn is_at_end(&self) -> bool {
        self.at == self.all.len()
    }

    pub(super) fn place(&self) -> Place {
        Place::Byte(self.at)
    }

    pub(super) fn rest(&self) -> &'a [u8] {
        &self.all[self.at..]
    }

    /// The next bytes; `what` is what they would have been.
    pub(super) fn take(&mut self, n: usize, what: &str) -> Result<&'a [u8], ReadError> {
        let rest = self.rest();
        let Some(taken) = rest.get(..n) else {
            let message = format!("the file ends within {what}: {n} bytes needed, {} left", rest.len());
            return Err(ReadError::new(Kind::Damaged, message).at(self.place()));
        };
        self.at += n;
        Ok(taken)
    }

    /// As `take`, for `n` things of `size` bytes each.
    pub(super) fn take_many(&mut self, n: usize, size: usize, what: &str) -> Result<&'a [u8], ReadError> {
        match n.checked_mul(size) {
            Some(bytes) => self.take(bytes, what),
            None => {
                Err(ReadError::new(Kind::Damaged, format!("{what} has the impossible size {n}"))
                    .at(self.place()))
            }
        }
    }

    pub(super) fn array<const N: usize>(&mut self, what: &str) -> Result<[u8; N], ReadError> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N, what)?);
        Ok(array)
    }

    /// A little-endian integer.
    pub(super) fn int(&mut self, what: &str) -> Result<i32, ReadError> {
        self.array(what).map(i32::from_le_bytes)
    }

    /// A little-endian double.
    pub(super) fn double(&mut self, what: &str) -> Result<f64, ReadError> {
        self.array(what).map(f64::from_le_bytes)
    }
}

/// Little-endian doubles, one after the other.
pub(super) fn doubles(bytes: &[u8]) -> impl ExactSizeIterator<Item = f64> + '_ {
    bytes.as_chunks().0.iter().map(|chunk| f64::from_le_bytes(*chunk))
}

/// Little-endian integers, one after the other.
pub(super) fn ints(bytes: &[u8]) -> impl ExactSizeIterator<Item = i32> + '_ {
    bytes.as_chunks().0.iter().map(|chunk| i32::from_le_bytes(*chunk))
}

/// Text of fixed length without the blanks around it; characters that no terminal should see are replaced.
pub(super) fn text(bytes: &[u8]) -> String {
    let shown = |byte: &u8| if byte.is_ascii_graphic() || *byte == b' ' { *byte as char } else { '?' };
    bytes.iter().map(shown).collect::<String>().trim().to_owned()
}

//! A sweep: points, their seeds and keys, runs side by side, and one set of tables.
//!
//! Owns what many runs have in common. May use everything above. It deliberately prints nothing and
//! knows no terminal: whoever calls is told through [`run::Watch`].

mod codec;
pub mod expect;
pub mod frame;
pub mod gather;
pub mod journal;
pub mod manifest;
pub mod points;
mod queue;
pub mod replicate;
pub mod run;
pub mod scene;
mod seed;
pub mod why;

pub use journal::{Journal, JournalError};
pub use points::{Point, Points};
pub use queue::Series;
pub use scene::Scene;

/// A hash: of a plan with its seed, of an evaluation.
pub type Key = [u8; 32];

/// The text of a key.
pub fn key_text(key: &Key) -> String {
    key.iter().map(|byte| format!("{byte:02x}")).collect()
}

/// The key that a text stands for.
pub fn key_of(text: &str) -> Option<Key> {
    let digits = text.as_bytes();
    let mut key = [0; 32];
    if digits.len() != 2 * key.len() {
        return None;
    }
    for (byte, pair) in key.iter_mut().zip(digits.chunks(2)) {
        *byte = u8::from_str_radix(std::str::from_utf8(pair).ok()?, 16).ok()?;
    }
    Some(key)
}

//! Text to tree and back.
//!
//! Owns the grammar: `lexer` covers the text with tokens, `split` cuts them into statements, `bounds`
//! refuses what is too large or too deep, pest matches each statement, `build` and `climb` make the
//! tree, `format` prints it. May use `source`, `diagnostic` and the symbols of `units`.
//! It deliberately knows no physics and resolves no name.

mod bounds;
mod build;
mod climb;
mod complaint;
mod format;
mod grammar;
mod lexer;
mod parse;
mod setting;
mod split;
pub mod tree;
pub mod words;

pub use bounds::{MAX_EXPRESSION_DEPTH, MAX_FILE_BYTES, MAX_NESTING};
pub use format::format;
pub use lexer::tokens;
pub use parse::{EDITION, parse};
pub use setting::parse_setting;
pub use words::{RESERVED_WORDS, STATEMENT_KEYWORDS};

//! Text to tree and back. (under construction)
pub mod tree;

//! Laws of the engine, each against a closed form or an identity of bytes.

mod bridge;
mod bytes;
mod failures;
mod front;
mod limits;
mod mixing;
mod moments;
#[path = "../support/mod.rs"]
mod support;
mod uniform;

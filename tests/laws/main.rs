//! Laws of the engine, each against a closed form or an identity of bytes.

mod bridge;
mod bytes;
mod failures;
mod front;
mod limits;
mod mixing;
mod moments;
mod standard_errors;
#[path = "../support/mod.rs"]
mod support;
mod uniform;

//! Chemistry on particles against closed forms, published solutions and independent integrators.

mod closed;
mod exhausted;
mod network;
mod stiff;
#[path = "../support/mod.rs"]
mod support;

//! Chemistry on particles against closed forms, published solutions and independent integrators.

mod closed;
mod exhausted;
mod jacobian;
mod network;
mod stiff;
#[path = "../support/mod.rs"]
mod support;

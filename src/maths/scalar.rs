//! One value at a time, from the pure-Rust port of musl's library.

pub use libm::{
    acosh, atan, cos, cosh, erf, erfc, exp, expm1, log as ln, log1p, log10, pow, sin, sinh, sqrt, tan, tanh,
};

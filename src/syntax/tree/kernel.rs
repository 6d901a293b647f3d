//! A radial kernel as it was written.

use super::{Expr, Name, Text};

/// `kernel W(q) = … support 2`
#[derive(Debug, Clone, PartialEq)]
pub struct Kernel {
    pub name: Name,
    /// What the distance over the bandwidth is called.
    pub parameter: Name,
    pub value: Expr,
    pub support: Expr,
    pub doc: Option<Text>,
}

//! Kernels by which densities are found.
//!
//! Owns this form of `kernel`. May use the expressions beside it. It deliberately knows none of its words.

use super::Parts;
use super::statements::{count, each};
use crate::source::{Span, Spanned};
use crate::syntax::climb::Built;
use crate::syntax::grammar::Rule;
use crate::syntax::tree::{Estimate, EstimateEntry, EstimateValue, Name};

/// `gaussian adaptive { grid 0.5 m }`
pub fn estimate(parts: &mut Parts) -> Built<Estimate> {
    let (name, manner) = (parts.name()?, parts.take_name()?);
    Ok(Estimate { name, manner, entries: each(parts, Rule::estimate_entry, entry)? })
}

fn entry(parts: &mut Parts) -> Built<EstimateEntry> {
    if let Some(pair) = parts.take(Rule::grid_counts) {
        let mut inner = Parts::of(parts.place, pair);
        let mut counts = Vec::new();
        while let Some(pair) = inner.take(Rule::count) {
            counts.push(count(inner.place, pair)?);
        }
        // The keyword is no part of its own: it is what the entry begins with.
        let span = Span { end: parts.whole.start + GRID.len() as u32, ..parts.whole };
        return Ok(EstimateEntry { name: named(span), value: EstimateValue::Counts(counts) });
    }
    let name = parts.name()?;
    let is_range = parts.pairs.peek().is_some_and(|pair| pair.as_rule() == Rule::range);
    let value =
        if is_range { EstimateValue::Range(parts.range()?) } else { EstimateValue::One(parts.expression()?) };
    Ok(EstimateEntry { name, value })
}

const GRID: &str = "grid";

fn named(span: Span) -> Name {
    Spanned::new(GRID.to_owned(), span)
}

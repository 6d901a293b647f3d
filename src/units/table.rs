//! The symbols: whole units and the prefixes that may stand before some of them.

use super::{Dimension, Unit};

struct Symbol {
    text: &'static str,
    dimension: Dimension,
    decimal: i32,
    factor: f64,
    takes_prefix: bool,
}

const fn prefixed(text: &'static str, dimension: Dimension, decimal: i32) -> Symbol {
    Symbol { text, dimension, decimal, factor: 1.0, takes_prefix: true }
}

const fn plain(text: &'static str, dimension: Dimension, decimal: i32, factor: f64) -> Symbol {
    Symbol { text, dimension, decimal, factor, takes_prefix: false }
}

/// `Dimension::new(length, mass, time, amount)`; the year is Julian (365.25 d).
const SYMBOLS: &[Symbol] = &[
    prefixed("m", Dimension::LENGTH, 0),
    prefixed("g", Dimension::new(0, 1, 0, 0), -3),
    prefixed("s", Dimension::TIME, 0),
    prefixed("mol", Dimension::new(0, 0, 0, 1), 0),
    prefixed("K", Dimension::TEMPERATURE, 0),
    prefixed("L", Dimension::new(3, 0, 0, 0), -3),
    prefixed("M", Dimension::MOLAR_CONCENTRATION, 3),
    prefixed("N", Dimension::new(1, 1, -2, 0), 0),
    prefixed("J", Dimension::new(2, 1, -2, 0), 0),
    prefixed("W", Dimension::new(2, 1, -3, 0), 0),
    prefixed("Pa", Dimension::new(-1, 1, -2, 0), 0),
    prefixed("bar", Dimension::new(-1, 1, -2, 0), 5),
    prefixed("Hz", Dimension::RATE, 0),
    plain("min", Dimension::TIME, 0, 60.0),
    plain("h", Dimension::TIME, 0, 3_600.0),
    plain("d", Dimension::TIME, 0, 86_400.0),
    plain("wk", Dimension::TIME, 0, 604_800.0),
    plain("a", Dimension::TIME, 0, 31_557_600.0),
    plain("yr", Dimension::TIME, 0, 31_557_600.0),
    plain("ft", Dimension::LENGTH, -4, 3_048.0),
    plain("%", Dimension::NONE, -2, 1.0),
];

const PREFIXES: &[(&str, i32)] = &[
    ("da", 1),
    ("y", -24),
    ("z", -21),
    ("a", -18),
    ("f", -15),
    ("p", -12),
    ("n", -9),
    ("u", -6),
    ("µ", -6),
    ("μ", -6),
    ("m", -3),
    ("c", -2),
    ("d", -1),
    ("h", 2),
    ("k", 3),
    ("M", 6),
    ("G", 9),
    ("T", 12),
    ("P", 15),
    ("E", 18),
    ("Z", 21),
    ("Y", 24),
];

/// The unit of one symbol; a whole symbol wins over a prefix and a symbol (`min`, `Pa`).
pub(super) fn lookup(text: &str) -> Option<Unit> {
    let unit = |symbol: &Symbol, prefix: i32| Unit {
        dimension: symbol.dimension,
        decimal: symbol.decimal + prefix,
        numerator: symbol.factor,
        denominator: 1.0,
    };
    if let Some(symbol) = SYMBOLS.iter().find(|symbol| symbol.text == text) {
        return Some(unit(symbol, 0));
    }
    PREFIXES.iter().find_map(|&(prefix, power)| {
        let rest = text.strip_prefix(prefix)?;
        let symbol = SYMBOLS.iter().find(|symbol| symbol.takes_prefix && symbol.text == rest)?;
        Some(unit(symbol, power))
    })
}

/// Whether a word is the symbol of a unit, with or without a prefix.
pub fn is_unit_symbol(text: &str) -> bool {
    lookup(text).is_some()
}

/// Symbols that people write, for did-you-mean and the language reference.
pub fn known_symbols() -> impl Iterator<Item = String> {
    const COMMON: [&str; 7] = ["k", "c", "m", "u", "µ", "n", "M"];
    SYMBOLS.iter().flat_map(|symbol| {
        let prefixes = if symbol.takes_prefix { &COMMON[..] } else { &[] };
        std::iter::once(symbol.text.to_owned())
            .chain(prefixes.iter().map(move |prefix| format!("{prefix}{}", symbol.text)))
    })
}

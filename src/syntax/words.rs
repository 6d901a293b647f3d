//! The words that the language keeps for itself.
//!
//! Owns the lists of statement keywords and reserved words. May use nothing.
//! It deliberately lists no catalogue names: those are ordinary names, resolved in `scenario`.

/// The first words of the statements of this edition.
pub const STATEMENT_KEYWORDS: &[&str] = &[
    "lamella",
    "title",
    "cite",
    "seed",
    "let",
    "param",
    "fn",
    "species",
    "reaction",
    "chemistry",
    "domain",
    "boundary",
    "medium",
    "flow",
    "dispersion",
    "source",
    "mixing",
    "exchange",
    "kernel",
    "average",
    "initial",
    "particles",
    "run",
    "output",
    "reference",
    "measure",
    "data",
    "use",
    "sweep",
    "report",
];

/// Statements whose body in braces may hold what looks like statements.
pub const BODY_KEYWORDS: &[&str] = &["sweep", "kernel"];

/// The first words of the entries of a sweep that are not axes.
pub const SWEEP_ENTRIES: &[&str] = &["replicates", "seed", "common_random_numbers", "skip", "expect", "zip"];

/// Words that can be neither names nor units, wherever they stand.
pub const RESERVED_WORDS: &[&str] = &[
    "if", "then", "else", "and", "or", "not", "in", "at", "every", "along", "on", "over", "for", "until",
    "of", "during", "by", "when",
];

/// Whether a word begins a statement.
pub fn is_statement_keyword(word: &str) -> bool {
    STATEMENT_KEYWORDS.contains(&word)
}

/// Whether a word cannot be a unit, although it follows a number: what goes on with the statement does.
pub fn is_no_unit(word: &str) -> bool {
    RESERVED_WORDS.contains(&word) || word == "support"
}

/// The clause words that a statement knows, for a misspelling of one of them.
pub fn clause_words(keyword: &str) -> &'static [&'static str] {
    match keyword {
        "param" => &["in"],
        "species" => &["immobile", "mobile", "mineral", "charge", "ion_size", "retardation", "diffusion"],
        "reaction" => &["forward", "backward"],
        "chemistry" => &["tolerance", "floor", "order", "splitting", "activity", "integrator"],
        "domain" => &["frame", "moving"],
        "boundary" => &["rate"],
        "medium" => &["porosity"],
        "flow" => &[
            "head",
            "flux",
            "no_flow",
            "periodic",
            "conductivity",
            "anisotropy",
            "well",
            "rate",
            "screen",
            "carrying",
            "grid",
            "change",
            "at",
            "every",
        ],
        "dispersion" => &["longitudinal", "transverse", "transverse_vertical", "molecular"],
        "source" => &["at", "in", "along", "during"],
        "exchange" => &[
            "kernel",
            "bandwidth",
            "mixing_fraction",
            "normalise",
            "integrate",
            "cutoff",
            "diffusion_error",
            "compensate",
        ],
        "kernel" => &[
            "support",
            "bandwidth",
            "grid",
            "correct",
            "shape",
            "orient",
            "order",
            "rule",
            "weighing",
            "tolerance",
            "loops",
            "refresh",
            "reactions",
        ],
        "particles" => &["disorder"],
        "mixing" => &["zones", "fraction", "rate"],
        "run" => &["to", "step"],
        "output" => &["at", "every", "along", "on", "in", "resident", "flux_weighted"],
        "reference" => &["for"],
        "measure" => &["over", "at"],
        "data" => &["steps", "linear"],
        "use" => &["as"],
        "sweep" => {
            &["of", "replicates", "until", "seed", "common_random_numbers", "skip", "expect", "zip", "factor"]
        }
        "report" => &["against", "by"],
        _ => &[],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_word_has_one_role() {
        for word in STATEMENT_KEYWORDS {
            assert!(!RESERVED_WORDS.contains(word), "{word}");
        }
    }
}

//! Any text: no panic, no lost character, a layout that is a fixed point.

use crate::format::formatted;
use crate::{FORMS, GRAMLING, SWEEPS, messages_of, shape};
use lamella::source::FileId;
use lamella::syntax::parse;
use proptest::prelude::*;

/// Pieces that a scene is made of, for texts that come close to one.
const PIECES: &[&str] = &[
    "lamella 1",
    "title",
    "let",
    "param",
    "fn",
    "species",
    "reaction",
    "domain",
    "mixing zones",
    "output",
    "run",
    "measure",
    "reference",
    "dispersion",
    "longitudinal 1 m",
    "medium porosity",
    "flow darcy {",
    "head left",
    "well w at",
    "source s:",
    "during",
    "inflow",
    "boundary left y =",
    "retardation 2",
    "use",
    "sweep",
    "sweep s {",
    "zip {",
    "replicates",
    "until",
    "skip when",
    "expect",
    "by",
    "report",
    "a",
    "x",
    "t",
    "tau",
    "if",
    "then",
    "else",
    "and",
    "not",
    "in",
    "at",
    "every",
    "for",
    "1",
    "2.5",
    "1e3",
    "1_0",
    "m",
    "/s",
    "/tau",
    "m/s",
    "%",
    "mol",
    "\"doc\"",
    "\"",
    "(",
    ")",
    "{",
    "}",
    ",",
    ";",
    ":",
    "=",
    "==",
    "<",
    "->",
    "<->",
    "@",
    "+",
    "-",
    "*",
    "/",
    "^",
    ".",
    "..",
    "·",
    "#c",
    "\n",
    "\n",
    "\n",
    " ",
    " ",
    " ",
    "\t",
    "\r\n",
    "é",
    "\u{feff}",
    "−",
    "?",
];

fn soup() -> impl Strategy<Value = String> {
    proptest::collection::vec(proptest::sample::select(PIECES), 0..60).prop_map(|pieces| pieces.concat())
}

/// A scene with a few of its characters replaced by pieces.
fn mutated(scene: &'static str) -> impl Strategy<Value = String> {
    let edit = (0..scene.len(), 0..12_usize, proptest::sample::select(PIECES));
    proptest::collection::vec(edit, 1..6).prop_map(|edits| {
        let mut text = scene.to_owned();
        for (at, n_removed, piece) in edits {
            let start = (0..=at.min(text.len())).rev().find(|&idx| text.is_char_boundary(idx)).unwrap_or(0);
            let end = (start + n_removed).min(text.len());
            let end = (end..=text.len()).find(|&idx| text.is_char_boundary(idx)).unwrap_or(text.len());
            text.replace_range(start..end, piece);
        }
        text
    })
}

fn check_any(text: &str) {
    let (file, diagnostics) = parse(FileId(0), text);
    let covered: String = file.tokens.iter().map(|token| &text[token.span.range()]).collect();
    assert_eq!(covered, text, "tokens cover the text");
    for span in diagnostics.iter().flat_map(|diagnostic| &diagnostic.labels).map(|label| label.span) {
        assert!(text.get(span.range()).is_some(), "labels lie in the text");
    }
    let once = formatted(text);
    assert_eq!(formatted(&once), once, "the layout is a fixed point");
    assert_eq!(shape(&once), shape(text), "the layout keeps the tree");
    assert_eq!(significant(&once), significant(text), "the layout keeps all tokens and comments");
}

fn significant(text: &str) -> Vec<String> {
    use lamella::syntax::tree::TokenKind;
    let is_kept = |kind| !matches!(kind, TokenKind::Blank | TokenKind::Newline);
    let (file, _) = parse(FileId(0), text);
    let kept = file.tokens.iter().filter(|token| is_kept(token.kind));
    kept.map(|token| text[token.span.range()].trim_end().to_owned()).collect()
}

/// More blanks, line ends where they change nothing, and comments at line ends.
fn perturbed(seed: &[u8], text: &str) -> String {
    let (file, _) = parse(FileId(0), text);
    let mut result = String::new();
    for (idx, token) in file.tokens.iter().enumerate() {
        let piece = &text[token.span.range()];
        let choice = seed[idx % seed.len()];
        match (piece, choice % 4) {
            (" ", 0) => result.push_str("   "),
            (" ", 1) => result.push('\t'),
            (",", 2) => result.push_str(" ,\n # why\n\n "),
            ("\n", 0) => result.push_str("  # note\n\n\n"),
            ("\n", 1) => result.push_str("\r\n"),
            _ => result.push_str(piece),
        }
    }
    result
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 500, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_text(text in "\\PC*") {
        check_any(&text);
    }

    #[test]
    fn any_bytes(bytes in proptest::collection::vec(any::<u8>(), 0..200)) {
        check_any(&String::from_utf8_lossy(&bytes));
    }

    #[test]
    fn any_soup(text in soup()) {
        check_any(&text);
    }

    #[test]
    fn any_mutation(text in mutated(GRAMLING)) {
        check_any(&text);
    }

    #[test]
    fn any_mutation_of_sweeps(text in mutated(SWEEPS)) {
        check_any(&text);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn blanks_and_comments_mean_nothing(seed in proptest::collection::vec(any::<u8>(), 1..50)) {
        for scene in [GRAMLING, SWEEPS, FORMS] {
            let text = perturbed(&seed, scene);
            prop_assert_eq!(messages_of(&text), []);
            prop_assert_eq!(shape(&text), shape(scene));
            check_any(&text);
        }
    }
}

/// Everything that could make a recursive walk deep ends in a message.
#[test]
fn deep_and_long_texts_are_refused() {
    let n = 100_000;
    let chains = [
        "(".repeat(n),
        "-".repeat(n) + "x",
        "not ".repeat(n) + "x",
        "2^".repeat(n) + "2",
        "a+".repeat(n) + "a",
        "1/".repeat(n) + "a",
        "if a then b else ".repeat(n) + "c",
        "if ".repeat(n),
        "f(".repeat(n),
        "(-".repeat(n),
        "2 m".to_owned() + &"/a".repeat(n),
        "a < ".repeat(n) + "a",
        "a".repeat(n),
        "1".repeat(n) + "1e999",
        "{".repeat(n),
    ];
    for chain in chains {
        for n_bytes in [300, 3000, chain.len()] {
            let chain = &chain[..n_bytes.min(chain.len())];
            let text = format!("lamella 1\nlet a = {chain}");
            let (file, _) = parse(FileId(0), &text);
            assert!(file.statements.len() <= 2);
            check_any(&text);
        }
    }
    let entries = ["zip {", "a 1\n", "a (\n", "skip when (", "expect\n", "a 1 .. 2 by\n", ";", "}"];
    for entry in entries {
        for n in [100, 1_000, 5_000] {
            check_any(&format!("lamella 1\nsweep s {{\n{}", entry.repeat(n)));
            check_any(&format!("lamella 1\nsweep s {{\n{}\n}}", entry.repeat(n)));
        }
    }
    check_any("1e999 .5 1. ..");
}

#[test]
fn too_large_a_file_is_refused() {
    let text = "x\n".repeat(3 * 1024 * 1024);
    let codes: Vec<_> = messages_of(&text).iter().map(|diagnostic| diagnostic.code.0).collect();
    assert_eq!(codes, ["S010"]);
    assert_eq!(formatted(&text), text);
}

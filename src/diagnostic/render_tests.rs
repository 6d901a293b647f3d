use super::*;
use crate::diagnostic::Code;

const SCENE: &str = "lamella 1\nspecies S\nreaction growth: S -> X @ (mu / Y) * monod(S, Ks)\n";

fn span_of(text: &str, part: &str) -> Span {
    let start = text.find(part).expect("the part is in the text");
    Span::new(FileId(0), start, start + part.len())
}

fn plain(diagnostic: Diagnostic, name: &str, text: &str) -> String {
    super::text(&[diagnostic], &Sources::single(name, text), Colour::Plain)
}

#[test]
fn an_error_shows_header_place_source_found_expected_notes_and_help() {
    let diagnostic = Diagnostic::error(Code("U104"), "the rate of `growth` has the wrong dimension")
        .at(span_of(SCENE, "(mu / Y) * monod(S, Ks)"), "this is 1/time")
        .also(span_of(SCENE, "S\n"), "`S` is a concentration")
        .expected("concentration / time")
        .found("1/time")
        .note("a rate changes concentrations")
        .help("multiply by a concentration, for example `X`");
    let want = "\
error[U104]: the rate of `growth` has the wrong dimension
  ┌─ aquifer.lam:3:27
  │
2 │ species S
  │         - `S` is a concentration
3 │ reaction growth: S -> X @ (mu / Y) * monod(S, Ks)
  │                           ^^^^^^^^^^^^^^^^^^^^^^^ this is 1/time
  │
  = expected concentration / time
       found 1/time
  = a rate changes concentrations
help: multiply by a concentration, for example `X`

";
    assert_eq!(plain(diagnostic, "aquifer.lam", SCENE), want);
}

#[test]
fn a_refusal_says_refused_in_the_header_and_nowhere_else() {
    let diagnostic = Diagnostic::refused(Code("N201"), "this bug stays").at(span_of("ab", "b"), "a bug");
    let want = "\
refused[N201]: this bug stays
  ┌─ a.lam:1:2
  │
1 │ ab
  │  ^ a bug

";
    assert_eq!(plain(diagnostic, "a.lam", "ab"), want);
}

#[test]
fn a_message_without_a_place_is_header_and_notes() {
    let diagnostic = Diagnostic::remark(Code("L010"), "left out of this run").note("zone `fast`");
    assert_eq!(
        plain(diagnostic, "a.lam", ""),
        "note[L010]: left out of this run\n  = zone `fast`\n\n".replace("\n  =", "\n =")
    );
}

#[test]
fn colours_appear_on_request_only() {
    let diagnostic = Diagnostic::refused(Code("N201"), "too coarse").help("smaller");
    let sources = Sources::single("a.lam", "x");
    let coloured = super::text(std::slice::from_ref(&diagnostic), &sources, Colour::Ansi);
    assert!(coloured.contains("\u{1b}["), "{coloured:?}");
    assert!(coloured.contains("refused[N201]"), "{coloured:?}");
    assert!(!super::text(&[diagnostic], &sources, Colour::Plain).contains('\u{1b}'));
}

#[test]
fn hostile_text_does_not_reach_the_terminal() {
    let text = "a\u{1b}[31m\u{9b}b\u{202e}c";
    let diagnostic =
        Diagnostic::error(Code("S001"), "found \u{1b}]0;x\u{7}").at(span_of(text, "c"), "here\u{8}");
    let shown = plain(diagnostic, "na\u{1b}me.lam", text);
    assert!(shown.chars().all(|c| c == '\n' || !is_unsafe_to_show(c)), "{shown:?}");
    // Stand-ins keep their width in bytes, so the caret still stands under the `c`.
    assert!(shown.contains(":1:10"), "{shown}");
}

#[test]
fn every_span_of_awkward_texts_is_rendered_without_panic() {
    let texts = [
        "",
        "\n",
        "\r\n",
        "a\r\nb\r\n",
        "\tx\ty",
        "µ 温度 = 3 °C\n𝛼",
        "no newline",
        "\u{feff}x",
        "e\u{301}\u{1f1e9}\u{1f1ea}",
    ];
    for text in texts {
        let sources = Sources::single("t.lam", text);
        for start in 0..text.len() + 3 {
            for end in start..text.len() + 4 {
                let span = Span::new(FileId(0), start, end);
                let diagnostic = Diagnostic::error(Code("S001"), "m").at(span, "here").also(span, "");
                let diagnostics = [diagnostic];
                assert!(super::text(&diagnostics, &sources, Colour::Plain).contains("t.lam:"));
                assert_eq!(json(&diagnostics, &sources).lines().count(), 1);
            }
        }
    }
}

#[test]
fn a_span_in_an_unknown_file_loses_its_place_but_not_its_message() {
    let diagnostic = Diagnostic::error(Code("S001"), "lost").at(Span::new(FileId(7), 0, 1), "here");
    assert_eq!(plain(diagnostic.clone(), "t.lam", "x"), "error[S001]: lost\n\n");
    assert!(json(&[diagnostic], &Sources::default()).contains("\"labels\":[]"));
}

#[test]
fn json_has_every_field_and_character_columns() {
    let text = "lamella 1\nµ = 3 kg\nx\n";
    let start = text.find("kg").expect("there");
    let diagnostic = Diagnostic::warning(Code("U104"), "wrong")
        .at(Span::new(FileId(0), start, start + 4), "this")
        .found("mass")
        .help("write m");
    let line = json(&[diagnostic], &Sources::single("a.lam", text));
    let value: serde_json::Value = serde_json::from_str(&line).expect("JSON");
    let want = serde_json::json!({
        "code": "U104", "severity": "warning", "message": "wrong",
        "labels": [{
            "file": "a.lam", "start": start, "end": start + 4, "line": 2, "column": 7,
            "end_line": 3, "end_column": 2, "text": "this", "primary": true,
        }],
        "found": "mass", "expected": null, "notes": [], "help": ["write m"],
    });
    assert_eq!(value, want);
}

#[test]
fn a_long_header_is_broken_at_blanks_and_stays_one_line_in_json() {
    let message = format!("left out: {}", ["something (for a reason)"; 12].join(", "));
    let diagnostic = Diagnostic::remark(Code("L010"), message.clone());
    let shown = plain(diagnostic.clone(), "a.lam", SCENE);
    let lines: Vec<&str> = shown.trim_end().lines().collect();
    assert!(lines.len() > 2 && lines.iter().all(|line| line.chars().count() <= 110), "{shown}");
    assert!(lines[1..].iter().all(|line| line.starts_with("  ") && !line.starts_with("   ")), "{shown}");
    let joined = lines.iter().map(|line| line.trim()).collect::<Vec<_>>().join(" ");
    assert_eq!(joined, format!("note[L010]: {message}"));
    let json: serde_json::Value =
        serde_json::from_str(&json(&[diagnostic], &Sources::single("a.lam", SCENE))).expect("JSON");
    assert_eq!(json["message"], message);
}

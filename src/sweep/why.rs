//! Why a point will run, or will not: what of its plan differs from the one that was run.
//!
//! Owns the comparison of plans and of scenes. May use the plan and the tree. It deliberately reads no
//! journal: callers hand in the two scenes.

use crate::plan::Plan;
use crate::source::{Sources, Span};
use crate::syntax::tree::{File, Statement, TokenKind};
use serde_json::Value;

/// The first place where two plans differ.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// `time.step`, `walk.spread[0]`
    pub path: String,
    pub before: String,
    pub now: String,
}

/// The first difference in the order of the plan's fields; seeds are looked at last.
pub fn difference(before: &Plan, now: &Plan) -> Option<Difference> {
    let of =
        |plan: &Plan| serde_json::to_value(plan).expect("plans hold finite numbers, lists and names only");
    let (mut first, mut second) = (of(before), of(now));
    let seeds =
        [&mut first, &mut second].map(|value| value.as_object_mut().and_then(|plan| plan.remove("seed")));
    differ(&first, &second, "").or_else(|| {
        let [before, now] = seeds.map(|seed| seed.unwrap_or(Value::Null));
        differ(&before, &now, "seed")
    })
}

fn differ(before: &Value, now: &Value, path: &str) -> Option<Difference> {
    match (before, now) {
        (Value::Object(a), Value::Object(b)) => {
            let names = a.keys().chain(b.keys().filter(|name| !a.contains_key(*name)));
            let deeper =
                |name: &String| if path.is_empty() { name.clone() } else { format!("{path}.{name}") };
            names.map(|name| differ_at(a.get(name), b.get(name), &deeper(name))).find_map(|found| found)
        }
        (Value::Array(a), Value::Array(b)) => (0..a.len().max(b.len()))
            .map(|idx| differ_at(a.get(idx), b.get(idx), &format!("{path}[{idx}]")))
            .find_map(|found| found),
        _ if before == now => None,
        _ => Some(Difference { path: path.to_owned(), before: shown(before), now: shown(now) }),
    }
}

fn differ_at(before: Option<&Value>, now: Option<&Value>, path: &str) -> Option<Difference> {
    differ(before.unwrap_or(&Value::Null), now.unwrap_or(&Value::Null), path)
}

/// At most a line.
fn shown(value: &Value) -> String {
    const MAX: usize = 60;
    let text = match value {
        Value::Null => "nothing".to_owned(),
        value => value.to_string(),
    };
    match text.char_indices().nth(MAX) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

/// Places of a changed statement, as it was and as it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Change {
    pub before: Option<Span>,
    pub now: Option<Span>,
}

/// A scene: its tree and the texts that its places lie in.
pub type Written<'a> = (&'a File, &'a Sources);

/// Statements that are not written in both scenes, those that can be behind `path` first. Blanks,
/// comments and the order of statements do not count.
pub fn changes(before: Written, now: Written, path: &str) -> Vec<Change> {
    let (first, second) = (words_of_all(before), words_of_all(now));
    let only = |own: &[(Span, Vec<String>)], other: &[(Span, Vec<String>)]| {
        let is_there = |words: &Vec<String>| other.iter().any(|(_, same)| same == words);
        own.iter().filter(|(_, words)| !is_there(words)).cloned().collect::<Vec<_>>()
    };
    let mut old = only(&first, &second);
    let mut list = Vec::new();
    for (span, words) in only(&second, &first) {
        let partner = old.iter().position(|(_, other)| head(other) == head(&words));
        let before = partner.map(|place| old.remove(place).0);
        list.push((rank(&words, path), Change { before, now: Some(span) }));
    }
    list.extend(
        old.iter().map(|(span, words)| (rank(words, path), Change { before: Some(*span), now: None })),
    );
    list.sort_by_key(|(rank, _)| *rank);
    list.into_iter().map(|(_, change)| change).collect()
}

/// The words of each statement that is no sweep, report or other cosmetics.
fn words_of_all((file, sources): Written) -> Vec<(Span, Vec<String>)> {
    let words = |statement: &Statement| {
        let text = sources.slice(statement.span);
        let tokens = crate::syntax::tokens(text);
        let kept = tokens
            .into_iter()
            .filter(|(kind, _)| !matches!(kind, TokenKind::Blank | TokenKind::Newline | TokenKind::Comment));
        (statement.span, kept.map(|(_, word)| word.to_owned()).collect::<Vec<_>>())
    };
    let all = file.statements.iter().map(words);
    all.filter(|(_, words)| {
        !matches!(words.first().map(String::as_str), Some("sweep" | "report" | "title" | "cite"))
    })
    .collect()
}

/// What tells statements of one kind apart: the keyword and, where there is one, the name.
fn head(words: &[String]) -> &[String] {
    let has_name =
        matches!(words.first().map(String::as_str), Some("let" | "param" | "fn" | "reaction" | "output"));
    &words[..words.len().min(if has_name { 2 } else { 1 })]
}

/// Which statements make which part of a plan.
const MAKERS: &[(&str, &[&str])] = &[
    ("axes", &["domain", "boundary", "average"]),
    ("walk", &["dispersion", "flow", "domain", "run"]),
    ("particles", &["particles", "domain"]),
    ("species", &["species", "initial", "reaction"]),
    ("components", &["initial", "species", "reaction"]),
    ("mixing", &["mixing", "average"]),
    ("reactions", &["reaction"]),
    ("time", &["run"]),
    ("outputs", &["output", "average"]),
    ("stages", &["mixing", "run"]),
    ("seed", &["seed", "sweep"]),
];

/// 0 for the statements behind a path, 1 for constants that they may use, 2 for all others.
fn rank(words: &[String], path: &str) -> u8 {
    let keyword = words.first().map_or("", String::as_str);
    let part = path.split(['.', '[']).next().unwrap_or(path);
    let makers = MAKERS.iter().find(|(name, _)| *name == part).map_or(&[][..], |(_, makers)| makers);
    match keyword {
        _ if makers.contains(&keyword) => 0,
        "let" | "param" | "fn" => 1,
        _ => 2,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::FileId;

    fn written(text: &str) -> (File, Sources) {
        let text = format!("lamella 1\n{text}");
        let (file, diagnostics) = crate::syntax::parse(FileId(0), &text);
        assert!(diagnostics.is_empty(), "{diagnostics:?}");
        (file, Sources::single("s.lam", text))
    }

    #[test]
    fn changed_statements_are_paired_and_the_likely_ones_come_first() {
        let (a, a_text) = written("param D = 1 m^2/s\nlet w = 2 m # old\nrun to 2 s, step 1 s\nseed 1\n");
        let (b, b_text) =
            written("seed 1\nrun to   2 s, step 1 s # new\nlet w = 3 m\nparam D = 2 m^2/s\ncite \"x\"\n");
        let found = changes((&a, &a_text), (&b, &b_text), "walk.spread[0]");
        let texts: Vec<(Option<&str>, Option<&str>)> = found
            .iter()
            .map(|change| (change.before.map(|s| a_text.slice(s)), change.now.map(|s| b_text.slice(s))))
            .collect();
        let expected = [
            (Some("let w = 2 m"), Some("let w = 3 m")),
            (Some("param D = 1 m^2/s"), Some("param D = 2 m^2/s")),
        ];
        assert_eq!(texts, expected);
    }

    #[test]
    fn the_first_difference_has_a_path() {
        let parse = |text: &str| serde_json::from_str::<Value>(text).unwrap();
        let a = parse(r#"{"time": {"step": 1.0, "n": 2}, "list": [1, 2]}"#);
        let b = parse(r#"{"time": {"step": 1.0, "n": 2}, "list": [1, 3, 4]}"#);
        let found = differ(&a, &b, "").unwrap();
        assert_eq!((found.path.as_str(), found.before.as_str(), found.now.as_str()), ("list[1]", "2", "3"));
        assert_eq!(differ(&a, &a, ""), None);
    }
}

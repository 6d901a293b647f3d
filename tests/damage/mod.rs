//! Scenes that someone has damaged: what `check` is fed with to see that it stays calm and points at
//! the damage. Shared by the tests and by the example `fuzz_check`.
#![allow(dead_code)]

pub mod mutants;
pub mod noise;

use lamella::data::DataFile;
use lamella::diagnostic::Diagnostic;
use lamella::plan::compile::Options;
use lamella::scenario::Settings;
use lamella::source::{FileId, Sources};
use lamella::syntax::parse;
use lamella::syntax::tree::TokenKind;
use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Kind and place of a token.
pub type Token = (TokenKind, Range<usize>);

/// Name and text of every scene that is shipped, sorted by name.
pub fn shipped_scenes() -> Vec<(String, String)> {
    let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut folders = vec![root.join("tests/scenes")];
    let experiments =
        std::fs::read_dir(root.join("experiments")).expect("the folder is part of the repository");
    folders
        .extend(experiments.map(|entry| entry.expect("a folder entry").path()).filter(|path| path.is_dir()));
    let mut scenes = Vec::new();
    for folder in folders {
        for entry in std::fs::read_dir(folder).expect("a folder of scenes") {
            let path = entry.expect("a folder entry").path();
            if path.extension().is_some_and(|extension| extension == "lam") {
                let name = path.strip_prefix(root).expect("below the root").display().to_string();
                scenes.push((name, std::fs::read_to_string(&path).expect("a scene is text")));
            }
        }
    }
    scenes.sort();
    scenes
}

/// The file that one of the scenes uses.
const USED: (&str, &str) = ("used/column.lam", include_str!("../scenes/used/column.lam"));

/// Those that a study of several scenes uses.
const PARTS: &[(&str, &str)] = &[
    ("line.lam", include_str!("../../experiments/kernel_size_study/line.lam")),
    ("plane.lam", include_str!("../../experiments/kernel_size_study/plane.lam")),
];

/// A text as a scene, with the files that it may use.
pub fn sources(text: &str) -> Sources {
    let mut sources = Sources::single("scene.lam", text);
    sources.add(USED.0, USED.1);
    for (name, part) in PARTS.iter().filter(|(name, _)| text.contains(name)) {
        sources.add(*name, *part);
    }
    // One of the scenes reads the flow of a model.
    for (name, bytes) in FILES.iter().filter(|(name, _)| text.contains(name)) {
        sources.add_data(Arc::new(DataFile::new((*name).to_owned(), bytes.to_vec())));
    }
    sources
}

const FILES: &[(&str, &[u8])] = &[
    ("valley.bud", include_bytes!("../../experiments/modflow6_import/valley.bud")),
    ("valley.dis.grb", include_bytes!("../../experiments/modflow6_import/valley.dis.grb")),
];

/// Everything that `check` says about a text, in its order.
pub fn messages(text: &str) -> Vec<Diagnostic> {
    lamella::check(sources(text), &Settings::default(), &Options::default()).diagnostics
}

/// What the syntax alone says about a text.
pub fn messages_of_syntax(text: &str) -> Vec<Diagnostic> {
    parse(FileId(0), text).1
}

/// A guard against hanging, hundreds of times what a text of the noise needs.
pub const LIMIT: Duration = Duration::from_secs(1);

/// How long `check` takes; none if it panics. A text beyond the limit is timed once more: a machine
/// that stands still for a while is no fault of the text.
pub fn time_of_check(text: &str) -> Option<Duration> {
    let time = || {
        let start = Instant::now();
        std::panic::catch_unwind(|| messages(text)).ok().map(|_| start.elapsed())
    };
    let first = time()?;
    if first > LIMIT { Some(first.min(time()?)) } else { Some(first) }
}

/// The tokens that carry meaning.
pub fn tokens(text: &str) -> Vec<Token> {
    let (file, _) = parse(FileId(0), text);
    let is_kept = |kind| !matches!(kind, TokenKind::Blank | TokenKind::Newline | TokenKind::Comment);
    file.tokens
        .iter()
        .filter(|token| is_kept(token.kind))
        .map(|token| (token.kind, token.span.range()))
        .collect()
}

/// The text with a range replaced, and where the replacement lies.
pub fn replaced(text: &str, range: &Range<usize>, by: &str) -> (String, Range<usize>) {
    let mut result = text.to_owned();
    result.replace_range(range.clone(), by);
    (result, range.start..range.start + by.len())
}

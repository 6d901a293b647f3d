//! The syntax as a user meets it: what parses, what is said about what does not, and the layout.

mod expressions;
mod format;
mod properties;

use lamella::diagnostic::Diagnostic;
use lamella::source::FileId;
use lamella::syntax::parse;

/// Name and text of every valid scene and of the collection of statement forms.
fn scenes() -> Vec<(String, String)> {
    let mut scenes = Vec::new();
    for folder in ["tests/scenes", "tests/syntax/forms"] {
        let folder = format!("{}/{folder}", env!("CARGO_MANIFEST_DIR"));
        for entry in std::fs::read_dir(folder).expect("the folder is part of the repository") {
            let path = entry.expect("a folder entry").path();
            if path.extension().is_some_and(|extension| extension == "lam") {
                scenes.push((
                    path.display().to_string(),
                    std::fs::read_to_string(&path).expect("a scene is text"),
                ));
            }
        }
    }
    scenes.sort();
    scenes
}

/// Scenario 1 of the language description, as it stands there.
const GRAMLING: &str = include_str!("../scenes/gramling_column.lam");
/// Sweeps with every kind of entry.
const SWEEPS: &str = include_str!("../scenes/sweeps.lam");
/// Every form that a statement may take.
const FORMS: &str = include_str!("forms/every_statement_form.lam");

fn messages_of(text: &str) -> Vec<Diagnostic> {
    parse(FileId(0), text).1
}

/// The statements of a text without their places.
fn shape(text: &str) -> String {
    let (file, _) = parse(FileId(0), text);
    let written = format!("{:?}", file.statements);
    let mut shape = String::with_capacity(written.len());
    let mut rest = written.as_str();
    while let Some((before, after)) = rest.split_once("Span { file") {
        shape.push_str(before);
        rest = after.split_once('}').map_or("", |(_, after)| after);
    }
    shape + rest
}

#[test]
fn valid_scenes_parse_without_messages() {
    for (name, text) in scenes() {
        assert_eq!(messages_of(&text), [], "{name}");
    }
}

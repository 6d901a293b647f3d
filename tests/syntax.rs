//! The syntax as a user meets it: scenes and statement forms that must parse as written.

use lamella::diagnostic::Diagnostic;
use lamella::source::FileId;
use lamella::syntax::parse;

fn scenes() -> Vec<(String, String)> {
    let folders = ["tests/scenes", "tests/syntax_forms"];
    let mut scenes: Vec<_> = folders
        .iter()
        .map(|folder| format!("{}/{folder}", env!("CARGO_MANIFEST_DIR")))
        .flat_map(|folder| std::fs::read_dir(folder).expect("the folder is part of the repository"))
        .map(|entry| entry.expect("a folder entry").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "lam"))
        .map(|path| (path.display().to_string(), std::fs::read_to_string(&path).expect("a scene is text")))
        .collect();
    scenes.sort();
    scenes
}

fn messages(text: &str) -> Vec<Diagnostic> {
    parse(FileId(0), text).1
}

#[test]
fn valid_scenes_parse_without_messages() {
    for (name, text) in scenes() {
        assert_eq!(messages(&text), [], "{name}");
    }
}

//! Commands that need no scene.

use crate::program::Folder;

#[test]
fn without_a_command_it_shows_help_and_exits_2() {
    Folder::new().lamella(&[]).exits(2).says("Usage: lamella");
}

#[test]
fn help_names_commands_and_exit_codes() {
    let help = Folder::new().lamella(&["--help"]).exits(0);
    for part in ["new", "check", "fmt", "plan", "run", "explain", "completions", "130 interrupted"] {
        assert!(help.stdout.contains(part), "{part}: {}", help.stdout);
    }
}

#[test]
fn a_misspelt_option_is_a_usage_error() {
    Folder::new().lamella(&["new", "x", "--templat", "tracer"]).exits(2).says("--template");
}

#[test]
fn new_writes_a_scene_and_never_replaces_one() {
    let folder = Folder::new();
    folder.lamella(&["new", "column"]).exits(0).says("wrote column.lam");
    assert!(folder.read("column.lam").starts_with("lamella 1\n"));
    folder.write("column.lam", "mine");
    let again = folder.lamella(&["new", "column", "--message-format", "json"]).exits(1);
    assert_eq!(again.messages()[0]["code"], "F103");
    assert_eq!(folder.read("column.lam"), "mine");
}

#[test]
fn new_keeps_an_ending_and_says_why_it_cannot_write() {
    let folder = Folder::new();
    folder.lamella(&["new", "a.b.lam", "--template", "tracer", "--quiet"]).exits(0);
    assert_eq!(folder.files(), ["a.b.lam"]);
    folder.lamella(&["new", "missing/x"]).exits(1).says("cannot write missing/x.lam: no such file or folder");
    folder.lamella(&["new", ".."]).exits(1).says("a scene needs a name");
}

#[test]
fn explain_pages_lists_and_suggests() {
    let folder = Folder::new();
    folder.lamella(&["explain", "f102"]).exits(0).gives("# F102: ");
    let list = folder.lamella(&["explain"]).exits(0);
    assert!(list.stdout.lines().any(|line| line.starts_with("F101  ")), "{}", list.stdout);
    let unknown = folder.lamella(&["explain", "F1O2", "--message-format", "json"]).exits(2);
    assert_eq!(unknown.messages()[0]["code"], "F104");
    assert_eq!(unknown.messages()[0]["help"][0], "did you mean `F102`?");
}

#[test]
fn completions_come_for_each_shell() {
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        Folder::new().lamella(&["completions", shell]).exits(0).gives("explain");
    }
}

#[test]
fn colours_come_when_asked_for_and_not_into_a_pipe() {
    let folder = Folder::new();
    let is_coloured = |arguments: &[&str]| folder.lamella(arguments).exits(2).stderr.contains('\u{1b}');
    assert!(!is_coloured(&["explain", "Z999"]));
    assert!(is_coloured(&["explain", "Z999", "--color", "always"]));
    assert!(!is_coloured(&["explain", "Z999", "--color", "never"]));
}

//! Every way a file can be wrong is one clear sentence and the right exit code.

use crate::program::Folder;

const COMMANDS: [&str; 4] = ["check", "fmt", "plan", "run"];

#[test]
fn a_missing_file_is_named() {
    let folder = Folder::new();
    for command in COMMANDS {
        folder
            .lamella(&[command, "nowhere.lam"])
            .exits(2)
            .says("error[F101]: cannot read nowhere.lam: no such file or folder");
    }
}

#[test]
fn a_directory_is_not_a_scene() {
    let folder = Folder::new();
    for command in COMMANDS {
        folder.lamella(&[command, "."]).exits(2).says("cannot read .: it is a directory");
    }
}

#[test]
fn text_that_is_not_utf8_gives_the_byte_and_the_line() {
    let folder = Folder::new();
    folder.write("latin.lam", b"lamella 1\n# \xb5m\n");
    for command in COMMANDS {
        let finished = folder.lamella(&[command, "latin.lam", "--message-format", "json"]).exits(2);
        let message = &finished.messages()[0];
        assert_eq!(message["code"], "F102");
        let text = message["message"].as_str().expect("a text");
        assert!(text.contains("byte 12 (line 2)"), "{text}");
    }
}

#[test]
fn a_file_without_end_is_refused() {
    if std::path::Path::new("/dev/zero").exists() {
        Folder::new().lamella(&["check", "/dev/zero"]).exits(2).says("larger than 16 MiB");
    }
}

#[cfg(unix)]
#[test]
fn a_file_without_permission_is_named() {
    use std::os::unix::fs::PermissionsExt;
    let folder = Folder::new();
    let path = folder.write("secret.lam", "lamella 1\n");
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o000)).expect("own file");
    // The administrator may read everything.
    if std::fs::File::open(&path).is_err() {
        folder.lamella(&["check", "secret.lam"]).exits(2).says("cannot read secret.lam: permission denied");
    }
}

#[test]
fn an_empty_file_is_a_wrong_scene() {
    let folder = Folder::new();
    folder.write("empty.lam", "");
    folder.lamella(&["check", "empty.lam"]).exits(2).says("empty.lam:1:1");
    folder.lamella_with_stdin(&["check", "-"], "").exits(2).says("<stdin>:1:1");
}

#[test]
fn results_that_cannot_be_written_fail_before_the_run() {
    let folder = Folder::new();
    folder.lamella(&["new", "scene", "--template", "tracer", "-q"]).exits(0);
    folder.write("taken", "a file");
    let started = std::time::Instant::now();
    folder.lamella(&["run", "scene.lam", "--out", "taken"]).exits(1).says("[F103]").says("taken");
    assert!(started.elapsed().as_secs() < 5, "the run was not started in vain");
    assert_eq!(folder.read("taken"), "a file");
}

//! Where results come from: the crate of a folder, judged by its published validator, and the page.

use crate::program::Folder;
use crate::scene_with;
use serde_json::Value;
use std::process::Command;

const SWEEP: &str = "  D 1e-4 m^2/s, 1e-3 m^2/s\n  step 1 s, 2 s\n  replicates 2";

fn read_crate(folder: &Folder, out: &str) -> Value {
    let text = folder.read(&format!("{out}/ro-crate-metadata.json"));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// All entities whose type is this one.
fn entities<'a>(crate_: &'a Value, kind: &str) -> Vec<&'a Value> {
    let graph = crate_["@graph"].as_array().expect("a crate has a graph");
    graph.iter().filter(|entity| entity["@type"] == kind).collect()
}

/// The values of a fact, one for each start that knows it.
fn facts<'a>(crate_: &'a Value, name: &str) -> Vec<&'a str> {
    let values = entities(crate_, "PropertyValue").into_iter().filter(|entity| entity["name"] == name);
    values.filter_map(|entity| entity["value"].as_str()).collect()
}

/// Runs the validator over folders; one answer for each. Needs `LAMELLA_PYTHON`, a Python with
/// `tests/python/requirements.txt`.
#[allow(clippy::print_stderr)] // Whoever runs the tests must see that this one checked nothing.
fn judged(folder: &Folder, outs: &[&str]) -> Option<Vec<Value>> {
    let Some(python) = std::env::var_os("LAMELLA_PYTHON") else {
        let is_owed = ["CI", "LAMELLA_REQUIRE_PYTHON"].iter().any(|name| std::env::var_os(name).is_some());
        assert!(!is_owed, "LAMELLA_PYTHON is not set, so no crate was validated");
        eprintln!("NOT CHECKED: LAMELLA_PYTHON is not set; no crate was validated");
        return None;
    };
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/python/validate_crates.py");
    let mut command = Command::new(python);
    command.arg(script).args(outs.iter().map(|out| folder.path(out)));
    let output = command.output().expect("Python starts");
    let told = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{told}\nLAMELLA_PYTHON needs all of tests/python/requirements.txt");
    let text = String::from_utf8_lossy(&output.stdout);
    let answers: Vec<Value> =
        text.lines().map(|line| serde_json::from_str(line).expect("an answer is JSON")).collect();
    assert_eq!(answers.len(), outs.len(), "{text}");
    Some(answers)
}

/// A copy of the results whose crate is changed.
fn spoilt(folder: &Folder, from: &str, to: &str, change: impl Fn(&mut Value)) {
    for name in folder.files().into_iter().filter(|name| name.starts_with(&format!("{from}/"))) {
        let bytes = std::fs::read(folder.path(&name)).expect("a result can be read");
        folder.write(&name.replacen(from, to, 1), bytes);
    }
    std::fs::create_dir_all(folder.path(to).join("report")).expect("a folder can be made");
    let mut crate_ = read_crate(folder, from);
    crate_["@graph"].as_array_mut().expect("a crate has a graph").iter_mut().for_each(change);
    folder.write(&format!("{to}/ro-crate-metadata.json"), crate_.to_string());
}

/// A sweep, a run, and a sweep with failures pass all that the profiles require, and nothing but what
/// Lamella cannot know is missing of what they recommend; crates that were spoilt do not pass.
#[test]
fn the_published_validator_accepts_crates() {
    let folder = Folder::new();
    folder.write("s.lam", format!("{}\ncite \"Someone (2020) A tracer\"\n", scene_with(SWEEP)));
    folder.lamella(&["sweep", "s.lam", "--out", "whole", "--set", "c0=2mol/m^3"]).exits(0);
    folder.lamella(&["run", "s.lam", "--out", "single", "--set", "c0=2mol/m^3", "--plot"]).exits(0);
    let mut failing = folder.command(&["sweep", "s.lam", "--out", "failing"]);
    let failed = failing.env("LAMELLA_FAULT_EVERY", "2").output().expect("the program starts");
    assert_eq!(failed.status.code(), Some(1));
    let remove = |field: &'static str| {
        move |entity: &mut Value| {
            drop(entity.as_object_mut().and_then(|fields| fields.remove(field)));
        }
    };
    spoilt(&folder, "whole", "unlicensed", remove("license"));
    spoilt(&folder, "whole", "untyped", remove("additionalType"));
    spoilt(&folder, "whole", "unsaid", remove("instrument"));
    spoilt(&folder, "whole", "incomplete", |_| {});
    std::fs::remove_file(folder.path("incomplete/points.parquet")).expect("a table can be removed");
    let good = ["whole", "single", "failing"];
    let bad = [
        ("unlicensed", "`license`"),
        ("untyped", "additionalType"),
        ("unsaid", "instrument"),
        ("incomplete", "points.parquet"),
    ];
    let all: Vec<&str> = good.into_iter().chain(bad.map(|(name, _)| name)).collect();
    let Some(answers) = judged(&folder, &all) else { return };
    // Lamella has no public address yet, knows no person, and writes no README.
    let unknown = ["SHOULD have a url", "absolute URI", "agent", "`author`", "`publisher`", "README.md"];
    for (name, answer) in good.iter().zip(&answers) {
        assert_eq!(answer["required"], serde_json::json!([]), "{name}");
        let unmet = answer["recommended"].as_array().expect("a list");
        let text = |issue: &Value| issue.as_str().unwrap_or_default().to_owned();
        let more: Vec<String> = unmet.iter().map(text).collect();
        let more: Vec<_> =
            more.iter().filter(|issue| !unknown.iter().any(|part| issue.contains(part))).collect();
        assert!(more.is_empty(), "{name}: {more:?}");
        assert_eq!(answer["main"], "scene.lam");
        let parts = answer["parts"].as_array().expect("a list");
        let expected = ["scene.lam", "plan.yaml", "points.parquet", "total/part-0000.parquet"];
        assert!(expected.iter().all(|part| parts.contains(&Value::from(*part))), "{name}: {parts:?}");
        assert_eq!(parts.contains(&Value::from("sweep.json")), *name != "single");
        assert_eq!(parts.contains(&Value::from("figure.svg")), *name == "single");
    }
    for ((name, part), answer) in bad.iter().zip(&answers[good.len()..]) {
        assert!(answer["required"].to_string().contains(part), "{name}: {answer}");
    }
}

#[test]
fn a_crate_tells_axes_settings_and_how_it_ended() {
    let folder = Folder::new();
    folder.write("s.lam", scene_with(SWEEP));
    folder.lamella(&["sweep", "s.lam", "--out", "out", "--set", "c0=2mol/m^3", "--seed", "7"]).exits(0);
    let crate_ = read_crate(&folder, "out");
    let value = |name: &str| {
        let found = entities(&crate_, "PropertyValue").into_iter().find(|entity| entity["name"] == name);
        found.unwrap_or_else(|| panic!("{name} is not there")).clone()
    };
    assert_eq!(value("D")["value"], serde_json::json!([1e-4, 1e-3]));
    assert_eq!(value("D")["unitText"], "m^2/s");
    assert_eq!(value("step")["value"], serde_json::json!([1.0, 2.0]));
    assert_eq!((&value("c0")["value"], &value("seed")["value"]), (&"2mol/m^3".into(), &"7".into()));
    let action = entities(&crate_, "CreateAction")[0];
    assert_eq!(action["actionStatus"], "http://schema.org/CompletedActionStatus");
    assert!(action.get("error").is_none());
    let points = lamella::table::read::points(&folder.path("out/points.parquet")).expect("points");
    assert_eq!(points.len(), 8);
    let (start, end) = (action["startTime"].as_str().unwrap_or(""), action["endTime"].as_str().unwrap_or(""));
    assert!(start <= end && start.len() == 29 && end.len() == 29, "{start} {end}");
    // Every replicate fails.
    let mut failing = folder.command(&["sweep", "s.lam", "--out", "failing"]);
    let failed = failing.env("LAMELLA_FAULT_EVERY", "1").output().expect("the program starts");
    assert_eq!(failed.status.code(), Some(1));
    let crate_ = read_crate(&folder, "failing");
    let action = entities(&crate_, "CreateAction")[0];
    assert_eq!(action["actionStatus"], "http://schema.org/FailedActionStatus");
    assert_eq!(action["error"], "8 replicates or points failed");
}

#[test]
fn equal_sweeps_have_equal_crates_but_for_the_hours() {
    let folder = Folder::new();
    folder.write("s.lam", scene_with(SWEEP));
    for out in ["a", "b"] {
        folder.lamella(&["sweep", "s.lam", "--out", out]).exits(0);
    }
    let hours = ["\"startTime\"", "\"endTime\"", "\"datePublished\""];
    let timeless = |out: &str| -> Vec<String> {
        let text = folder.read(&format!("{out}/ro-crate-metadata.json"));
        let lines = text.lines().filter(|line| !hours.iter().any(|hour| line.contains(hour)));
        lines.map(str::to_owned).collect()
    };
    assert_eq!(timeless("a"), timeless("b"));
    let n_hours = folder.read("a/ro-crate-metadata.json").lines().count() - timeless("a").len();
    assert_eq!(n_hours, 4, "of the root, of the run, and of the one start");
}

#[test]
fn starts_are_told_that_ran_what_the_tables_hold() {
    let folder = Folder::new();
    folder.write("s.lam", scene_with("  D 1e-4 m^2/s, 1e-3 m^2/s"));
    folder.lamella(&["sweep", "s.lam", "--out", "out", "--threads", "1"]).exits(0);
    // Runs nothing, so that nothing comes from it.
    folder.lamella(&["sweep", "s.lam", "--out", "out", "--threads", "3"]).exits(0);
    assert_eq!(facts(&read_crate(&folder, "out"), "threads"), ["1"]);
    folder.write("s.lam", scene_with("  D 1e-4 m^2/s, 1e-3 m^2/s, 1e-2 m^2/s"));
    folder.lamella(&["sweep", "s.lam", "--out", "out", "--threads", "2"]).exits(0);
    let crate_ = read_crate(&folder, "out");
    assert_eq!(facts(&crate_, "threads"), ["1", "2"]);
    assert_eq!(entities(&crate_, "OrganizeAction").len(), 2);
    assert_eq!(entities(&crate_, "SoftwareApplication").len(), 1);
    // From the journals alone, and drawn once more from the folder alone.
    let (text, page) = (folder.read("out/ro-crate-metadata.json"), folder.read("out/report.html"));
    folder.lamella(&["gather", "out"]).exits(0);
    folder.lamella(&["report", "out"]).exits(0);
    assert_eq!(folder.read("out/ro-crate-metadata.json"), text);
    assert_eq!(folder.read("out/report.html"), page);
    let compiler = facts(&crate_, "compiler")[0];
    assert!(compiler.starts_with("rustc 1.") && page.contains(compiler), "{compiler}");
    assert_eq!(facts(&crate_, "architecture"), [std::env::consts::ARCH; 2]);
}

fn git(folder: &Folder, arguments: &[&str]) -> Option<String> {
    let who = ["-c", "user.name=nobody", "-c", "user.email=nobody@example.org", "-C"];
    let mut command = Command::new("git");
    command.args(who).arg(folder.path(".")).args(arguments);
    // Neither the settings of whoever runs the tests nor a repository that runs them.
    command.env("GIT_CONFIG_GLOBAL", "/dev/null").env_remove("GIT_DIR").env_remove("GIT_INDEX_FILE");
    let output = command.output().ok()?;
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// Commit and state of the repository are those of the scene; without git nothing is said of either.
#[test]
fn the_commit_of_a_scene_is_told() {
    let folder = Folder::new();
    folder.write("scenes/s.lam", scene_with("  D 1e-4 m^2/s, 1e-3 m^2/s"));
    folder.write("other.txt", "as it was");
    let has_git = git(&folder, &["init", "--quiet"]).is_some();
    let told = |out: &str| {
        folder.lamella(&["sweep", "scenes/s.lam", "--out", out]).exits(0);
        let crate_ = read_crate(&folder, out);
        let one = |name: &str| facts(&crate_, name).first().map(|&text| text.to_owned());
        (one("commit"), one("repository"))
    };
    if !has_git {
        assert_eq!(told("results/no-git"), (None, None));
        return;
    }
    let state = |text: &str| Some(text.to_owned());
    git(&folder, &["add", "other.txt"]);
    git(&folder, &["commit", "--quiet", "-m", "first"]);
    let first = git(&folder, &["rev-parse", "HEAD"]);
    assert_eq!(told("results/a"), (first.clone(), state("the scene is not committed")));
    git(&folder, &["add", "scenes"]);
    git(&folder, &["commit", "--quiet", "-m", "second"]);
    let second = git(&folder, &["rev-parse", "HEAD"]);
    assert_ne!(first, second);
    // The results of before are no change of the scene.
    assert_eq!(told("results/b"), (second.clone(), state("as committed")));
    let page = folder.read("results/b/report.html");
    assert!(second.as_ref().is_some_and(|commit| page.contains(commit.as_str())));
    folder.write("other.txt", "as it is");
    assert_eq!(told("results/c"), (second.clone(), state("with changes that are not committed")));
    // Runs that are no sweeps know it, too.
    folder.lamella(&["run", "scenes/s.lam", "--out", "results/d"]).exits(0);
    assert_eq!(facts(&read_crate(&folder, "results/d"), "commit"), [second.unwrap_or_default()]);
    let mut without = folder.command(&["run", "scenes/s.lam", "--out", "results/e"]);
    assert!(without.env("PATH", "").output().expect("the program starts").status.success());
    assert_eq!(facts(&read_crate(&folder, "results/e"), "commit"), [""; 0]);
}

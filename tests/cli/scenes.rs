//! `check`, `fmt` and `plan` on scenes.

use crate::program::Folder;

fn with_template(template: &str) -> Folder {
    let folder = Folder::new();
    folder.lamella(&["new", "scene", "--template", template, "--quiet"]).exits(0);
    folder
}

#[test]
fn the_templates_are_right_and_laid_out() {
    for template in ["gramling", "tracer", "pulse"] {
        let folder = with_template(template);
        folder.lamella(&["check", "scene.lam"]).exits(0).says("scene.lam: no mistakes");
        folder.lamella(&["fmt", "--check", "scene.lam"]).exits(0);
    }
}

#[test]
fn check_reports_all_files_and_all_mistakes() {
    let folder = with_template("tracer");
    folder.write(
        "b.lam",
        folder.read("scene.lam").replace("1 cm/h", "1 kg").replace("dispersion D", "dispersion DD"),
    );
    folder.write("c.lam", folder.read("scene.lam").replace("output total   T", "output total   Q"));
    let finished =
        folder.lamella(&["check", "scene.lam", "b.lam", "c.lam", "--message-format", "json"]).exits(2);
    let messages = finished.messages();
    let count = |name: &str| {
        messages.iter().filter(|m| m["severity"] == "error" && m["labels"][0]["file"] == name).count()
    };
    assert_eq!((count("scene.lam"), count("b.lam"), count("c.lam")), (0, 3, 1), "{}", finished.stderr);
    let misspelt = messages.iter().find(|m| m["message"].as_str().is_some_and(|text| text.contains("DD")));
    assert!(misspelt.is_some_and(|m| m["help"].to_string().contains("`D`")), "{}", finished.stderr);
}

#[test]
fn a_wrong_unit_names_both_dimensions() {
    let folder = with_template("tracer");
    folder.write("scene.lam", folder.read("scene.lam").replace("1 cm/h", "1 kg"));
    let finished = folder.lamella(&["check", "scene.lam", "--message-format", "json"]).exits(2);
    let message = &finished.messages()[0];
    assert!(message["found"].is_string() && message["expected"].is_string(), "{message}");
}

#[test]
fn check_reads_standard_input_and_stays_silent_when_asked() {
    let scene = with_template("tracer").read("scene.lam");
    let folder = Folder::new();
    folder.lamella_with_stdin(&["check", "-"], &scene).exits(0).says("<stdin>: no mistakes");
    let quiet = folder.lamella_with_stdin(&["check", "-", "-q"], &scene).exits(0);
    assert_eq!((quiet.stdout.as_str(), quiet.stderr.as_str()), ("", ""));
}

#[test]
fn check_goes_on_after_a_file_that_cannot_be_read() {
    let folder = with_template("tracer");
    folder
        .lamella(&["check", "nowhere.lam", "scene.lam"])
        .exits(2)
        .says("nowhere.lam")
        .says("scene.lam: no mistakes");
}

#[test]
fn fmt_rewrites_checks_and_prints() {
    let folder = with_template("tracer");
    let tidy = folder.read("scene.lam");
    let untidy = tidy.replace("species T", "species     T");
    folder.write("scene.lam", &untidy);
    folder.lamella(&["fmt", "--check", "scene.lam"]).exits(1).says("scene.lam");
    assert_eq!(folder.read("scene.lam"), untidy);
    assert_eq!(folder.lamella(&["fmt", "--stdout", "scene.lam"]).exits(0).stdout, tidy);
    assert_eq!(folder.read("scene.lam"), untidy);
    folder.lamella(&["fmt", "scene.lam"]).exits(0);
    assert_eq!(folder.read("scene.lam"), tidy);
    assert_eq!(folder.lamella_with_stdin(&["fmt", "-"], &untidy).exits(0).stdout, tidy);
    assert_eq!(folder.files(), ["scene.lam"]);
}

#[test]
fn fmt_leaves_a_file_with_a_syntax_error_as_it_is() {
    let folder = Folder::new();
    let broken = "lamella 1\n   species = = 3\n";
    folder.write("broken.lam", broken);
    folder.lamella(&["fmt", "broken.lam"]).exits(2).says("broken.lam:2:");
    assert_eq!(folder.read("broken.lam"), broken);
}

#[test]
fn plan_explains_and_emits_every_stage() {
    let folder = with_template("gramling");
    folder.lamella(&["plan", "scene.lam"]).exits(0).gives("plan ");
    for (stage, part) in [("tree", "File"), ("scenario", "Scenario"), ("plan", "Plan"), ("yaml", "species:")]
    {
        folder.lamella(&["plan", "scene.lam", "--emit", stage]).exits(0).gives(part);
    }
}

#[test]
fn settings_are_checked_like_the_scene() {
    let folder = with_template("gramling");
    folder.lamella(&["plan", "scene.lam", "--set", "v=2 cm/s"]).exits(0);
    folder.lamella(&["plan", "scene.lam", "--set", "eta=1.5"]).exits(2).says("eta");
    folder.lamella(&["plan", "scene.lam", "--set", "v=2 kg"]).exits(2).says("v");
    folder.lamella(&["plan", "scene.lam", "--set", "w=2"]).exits(2).says("w");
    folder.lamella(&["plan", "scene.lam", "--set", "v"]).exits(2).says("name=value");
}

#[test]
fn messages_about_settings_show_them_as_typed() {
    let folder = with_template("gramling");
    let plan = |setting: &str| folder.lamella(&["plan", "scene.lam", "--set", setting]).exits(2);
    plan("v = 2 kg").says("--set:1:5").says("v = 2 kg");
    plan("w=2").says("--set:1:1").says("w=2");
    plan("v=v").says("error[D006]").says("--set:1:3").says("v=v");
    plan("v=2 cm/s +").says("--set:1:").says("v=2 cm/s +");
    // A second line would never be read.
    plan("v=2 cm/s\nseed 7").says("error[S001]").says("--set:2:1");
}

#[test]
fn the_plan_hash_ignores_layout_and_units_and_sees_physics() {
    let folder = with_template("gramling");
    let scene = folder.read("scene.lam");
    let hash = |text: &str| {
        let finished = folder.lamella_with_stdin(&["plan", "-", "--emit", "yaml"], text).exits(0);
        let line = finished.stdout.lines().find(|line| line.contains("hash")).map(str::to_owned);
        line.unwrap_or_else(|| panic!("no hash in {}", finished.stdout))
    };
    let written = hash(&scene);
    assert_eq!(hash(&scene.replace("7.5 cm", "0.075 m")), written);
    assert_eq!(hash(&scene.replace("seed 42", "# a comment\n\nseed   42")), written);
    assert_ne!(hash(&scene.replace("step 2 s", "step 1 s")), written);
    assert_ne!(hash(&scene.replace("seed 42", "seed 43")), written);
}

#[test]
fn windows_line_ends_change_nothing() {
    let folder = with_template("tracer");
    folder.write("windows.lam", folder.read("scene.lam").replace('\n', "\r\n"));
    folder.lamella(&["check", "windows.lam"]).exits(0);
}

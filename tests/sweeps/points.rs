//! Which points run, which do not, and what a user is told of them.

use crate::program::Folder;
use crate::{facts, scene_with};

const SWEEP: &str = "  D  1e-4 m^2/s, 1e-3 m^2/s\n  c0 1 mol/m^3, 2 mol/m^3, 3 mol/m^3\n  replicates 2";

/// `SWEEP` in a folder of its own, run once.
fn run_once() -> Folder {
    let folder = Folder::new();
    folder.write("s.lam", scene_with(SWEEP));
    folder.lamella(&["sweep", "s.lam", "--out", "out"]).exits(0).says("12 replicates run");
    folder
}

#[test]
fn cosmetics_are_no_reason_to_run_again() {
    let folder = run_once();
    let before = facts(&folder, "out");
    let edits: [(&str, &str); 6] = [
        ("# a comment", "# another comment, and more of it"),
        ("let   w  = 0.5 m", "let w = 50 cm"),
        ("x < w", "x < width"),
        ("D  1e-4 m^2/s, 1e-3 m^2/s", "D 1 cm^2/s, 10 cm^2/s"),
        ("run to 4 s, step 1 s", "run to 4000 ms, step 1 s"),
        ("output total   A every 2 s", ""),
    ];
    let mut text = scene_with(SWEEP);
    for (from, to) in &edits[..5] {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    text = text.replace("(x - w)", "(x - width)").replace("let w = 50 cm", "let width = 50 cm");
    // The order of statements.
    text = text.replace("species A \"tracer\"\n", "") + "species A \"tracer\"\n";
    folder.write("s.lam", &text);
    folder.lamella(&["sweep", "s.lam", "--out", "out"]).exits(0).says("0 replicates run, 12 known");
    assert_eq!(facts(&folder, "out"), before);
    // A change of what is asked for is none of cosmetics.
    folder.write("s.lam", text.replace(edits[5].0, edits[5].1));
    folder.lamella(&["sweep", "s.lam", "--out", "out"]).exits(0).says("12 replicates run");
}

#[test]
fn a_changed_value_runs_the_points_it_touches() {
    let folder = run_once();
    folder.write("s.lam", scene_with(&SWEEP.replace("2 mol/m^3", "2.5 mol/m^3")));
    folder.lamella(&["sweep", "s.lam", "--out", "out"]).exits(0).says("4 replicates run, 8 known");
}

#[test]
fn points_that_are_skipped_or_refused_are_told() {
    let folder = Folder::new();
    let sweep = "  step 1 s, 2 s, 4 s\n  particles 100, 1000\n  skip when particles / step > 400 /s";
    folder.write("s.lam", scene_with(sweep));
    let done = folder.lamella(&["sweep", "s.lam", "--out", "out"]).exits(0);
    done.says("4 points, 2 skipped").gives("4 done, 0 failed");
    // Outside of the parameter's range: refused before it runs, and its row says why.
    folder.write("r.lam", scene_with("  D 1e-3 m^2/s, 5 m^2/s"));
    let done = folder.lamella(&["sweep", "r.lam", "--out", "refused"]).exits(1);
    done.says("1 points are refused before they run").gives("1 done, 1 failed");
    let points = lamella::table::read::points(&folder.path("refused/points.parquet")).unwrap();
    assert_eq!(points[1].error_code.as_deref(), Some("P002"), "{:?}", points[1].error_message);
}

#[test]
fn failed_points_are_rows_and_run_again() {
    let folder = Folder::new();
    folder.write("s.lam", scene_with("  D linspace(1e-4 m^2/s, 1e-3 m^2/s, 60)"));
    let mut command = folder.command(&["sweep", "s.lam", "--out", "out"]);
    let bad = crate::program::finish(command.env("LAMELLA_FAULT_EVERY", "5").output().unwrap()).exits(1);
    let rows = facts(&folder, "out");
    let failed: Vec<&String> = rows.iter().filter(|row| row.contains("Failed")).collect();
    assert_eq!(rows.len(), 60);
    assert!(!failed.is_empty() && failed.len() < 60, "{}", bad.stderr);
    // Each log has a command that runs the point alone, with the same plan.
    let logs: Vec<String> = folder.files().into_iter().filter(|name| name.ends_with("/log.txt")).collect();
    assert_eq!(logs.len(), failed.len());
    for log in &logs {
        let key = log.split('/').nth_back(1).expect("out/failed/KEY/log.txt");
        let text = folder.read(log);
        let line = text.lines().find(|line| line.starts_with("lamella run ")).expect("a command");
        let arguments: Vec<String> =
            line.split(' ').skip(1).map(|word| word.trim_matches('\'').to_owned()).collect();
        let mut arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        arguments.extend(["--out", "alone"]);
        folder.lamella(&arguments).exits(0).gives(key);
    }
    folder
        .lamella(&["sweep", "s.lam", "--out", "out"])
        .exits(0)
        .says(&format!("{} replicates run", failed.len()));
    folder.lamella(&["sweep", "s.lam", "--out", "whole"]).exits(0);
    crate::assert_same(&folder, "out", "whole");
}

#[test]
fn expectations_fail_visibly() {
    let folder = Folder::new();
    let sweep = "  D 1e-4 m^2/s, 1e-3 m^2/s\n  expect leak < 1e-12\n  expect err < 1e-9";
    folder.write("s.lam", scene_with(sweep));
    let done = folder.lamella(&["sweep", "s.lam", "--out", "out"]).exits(1);
    let done = done.gives("leak < 1e-12: met (2 replicates)").gives("err < 1e-9: NOT MET (err = ");
    done.gives("at point 0 (D=0.0001 m^2/s), replicate 0");
}

#[test]
fn means_are_told_in_the_unit_that_they_are_expected_in() {
    let folder = Folder::new();
    let sweep = "  c0 1 mol/m^3, 2 mol/m^3\n  expect mean(of_the_end) in 5 mmol/L .. 6 mmol/L";
    const MEAN: &str = "measure of_the_end = 3 mol/m^3 + 0 mol/m^3 * err\n";
    folder.write("s.lam", scene_with(sweep) + MEAN);
    let done = folder.lamella(&["sweep", "s.lam", "--out", "out"]).exits(1);
    done.gives("NOT MET (of_the_end = 3 mmol/L at point 0");
    // No more than a few are named, and the rest is counted.
    let sweep = "  D linspace(1e-4 m^2/s, 1e-3 m^2/s, 9)\n  expect mean(of_the_end) in 5 mmol/L .. 6 mmol/L";
    folder.write("m.lam", scene_with(sweep) + MEAN);
    folder.lamella(&["sweep", "m.lam", "--out", "many"]).exits(1).gives(" more)");
}

#[test]
fn axes_can_be_given_on_the_command_line() {
    let folder = Folder::new();
    folder.write("s.lam", crate::SCENE);
    let over = ["sweep", "s.lam", "--over", "step=1s,2s", "--over", "D=1e-4 m^2/s .. 4e-4 m^2/s by factor 2"];
    let done = folder.lamella(&[&over[..], &["--replicates", "2", "--out", "out"]].concat()).exits(0);
    done.says("6 points").says("12 replicates run");
    folder.lamella(&["sweep", "s.lam", "--over", "stop=1s"]).exits(2).says("`stop` cannot be swept");
    folder.lamella(&["sweep", "s.lam"]).exits(2).says("[F120]").says("the scene has no sweep");
    folder.lamella(&["status", "nowhere"]).exits(2).says("[F121]");
}

#[test]
fn what_would_be_set_twice_is_refused() {
    let folder = Folder::new();
    folder.write("s.lam", scene_with(SWEEP));
    let set = folder.lamella(&["sweep", "s.lam", "--set", "D=1e-4 m^2/s"]).exits(2);
    set.says("[W002]").says("`--set` gives `D` one value, and the sweep `study` gives it many");
    folder.lamella(&["sweep", "s.lam", "--set", "particles=50", "--out", "out"]).exits(0);
    let both = folder.lamella(&["sweep", "s.lam", "study", "--over", "step=1s"]).exits(2);
    both.says("[F120]").says("`study` names a sweep of the scene");
    for axis in ["D linspace(1e-4 m^2/s, 1e-4 m^2/s, 2)", "particles linspace(100, 100, 3)"] {
        folder.write("s.lam", scene_with(axis));
        folder.lamella(&["check", "s.lam"]).exits(2).says("[W002]").says("gives the same value twice");
    }
    // Whole numbers that rounding makes equal are one value: 10, 10.5, 11.
    folder.write("s.lam", scene_with("particles linspace(10, 11, 3)"));
    folder.lamella(&["sweep", "s.lam", "--out", "rounded"]).exits(0).says("2 points");
}

#[test]
fn a_replicate_beyond_the_sweep_is_refused() {
    let folder = run_once();
    for command in ["why", "repro"] {
        let refused = folder.lamella(&[command, "out", "2/77"]).exits(2);
        refused.says("[F122]").says("point 2 has no replicate 77").says("0 to 1");
    }
    folder.lamella(&["why", "out", "2/1"]).exits(0);
    let more = SWEEP.replace("replicates 2", "replicates 2 .. 4 until stderr(err) < 90 % of mean(err)");
    folder.write("s.lam", scene_with(&more));
    folder.lamella(&["why", "out", "2/3"]).exits(0);
    folder.lamella(&["why", "out", "2/4"]).exits(2).says("0 to 3");
}

#[test]
fn why_names_the_line() {
    let folder = run_once();
    folder.lamella(&["why", "out", "0"]).exits(0).gives("will not run: complete since");
    folder
        .lamella(&["status", "out"])
        .exits(0)
        .gives("replicates  12 done, 0 failed")
        .gives("incomplete  0 points");
    let json = folder.lamella(&["status", "out", "--message-format", "json"]).exits(0).stdout;
    let state: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!((&state["done"], &state["points"]), (&12.into(), &6.into()));
    let text = scene_with(SWEEP).replace("run to 4 s, step 1 s", "run to 4 s, step 500 ms");
    folder.write("s.lam", &text);
    let why = folder.lamella(&["why", "out", "3/1"]).exits(0);
    let why = why.gives("point 3/1 (D=0.001 m^2/s, c0=1 mol/m^3)");
    let why = why.gives("will run: `time.n_steps` was 4 and is 8").says("[F124]");
    why.says("run to 4 s, step 500 ms").says("run to 4 s, step 1 s").says("as it was run");
    folder.write("s.lam", scene_with("  D 5e-4 m^2/s\n  c0 1 mol/m^3"));
    folder.lamella(&["why", "out", "0"]).exits(0).gives("no point with these values was ever run");
    folder.lamella(&["why", "out", "1"]).exits(2).says("[F122]");
}

#[test]
fn points_can_be_verified_and_repeated() {
    let folder = run_once();
    folder.lamella(&["verify", "out"]).exits(0).gives("12 replicates run again: the same bytes");
    folder.lamella(&["verify", "out", "--sample", "2"]).exits(0).gives("4 replicates run again");
    let points = lamella::table::read::points(&folder.path("out/points.parquet")).unwrap();
    let last = points.last().unwrap();
    let name = format!("{}/{}", last.point, last.replicate);
    let alone = folder.lamella(&["repro", "out", &name, "--out", "alone"]).exits(0).gives(&last.key);
    assert!(alone.stderr.contains("the same by hand: lamella run s.lam"), "{}", alone.stderr);
    // A run of its own can be verified, too, with what the command line set.
    folder.lamella(&["verify", "alone"]).exits(0).gives("the same bytes in all data files");
    let path = folder.path("alone/total/part-0000.parquet");
    let mut bytes = std::fs::read(&path).unwrap();
    bytes[100] ^= 1;
    std::fs::write(&path, bytes).unwrap();
    folder.lamella(&["verify", "alone"]).exits(1).says("[F123]").says("total/part-0000.parquet");
    folder.lamella(&["verify", "nowhere"]).exits(2).says("[F121]");
}

/// Values that are wrong can be skipped for being wrong; those that are not have rows that say why.
#[test]
fn skips_come_before_what_a_scene_refuses() {
    let folder = Folder::new();
    let sweep = "  D 1e-3 m^2/s, 5 m^2/s\n  particles 100, 200\n  skip when D > 1 m^2/s and particles > 150";
    folder.write("s.lam", scene_with(sweep));
    let done = folder.lamella(&["sweep", "s.lam", "--out", "out"]).exits(1);
    done.says("3 points, 1 skipped").gives("2 done, 1 failed");
    let points = lamella::table::read::points(&folder.path("out/points.parquet")).unwrap();
    let refused = &points[2];
    assert_eq!((refused.particles, refused.step), (100, 1.0));
    let message = refused.error_message.as_deref().unwrap();
    assert!(message.contains("s.lam:21:") && message.contains("found 5"), "{message}");
    folder.write("none.lam", scene_with("  D 1e-3 m^2/s\n  skip when D > 0 m^2/s"));
    folder.lamella(&["sweep", "none.lam"]).exits(2).says("[F127]");
}

#[test]
fn axes_that_go_together_have_one_order() {
    let folder = Folder::new();
    let sweep =
        "  zip {\n    step 1 s, 2 s, 4 s\n    particles 100, 400, 1600\n  }\n  D 1e-3 m^2/s, 1e-4 m^2/s";
    folder.write("s.lam", scene_with(&format!("{sweep}\n  expect order(err, step) in 7 .. 8")));
    folder.lamella(&["sweep", "s.lam", "--out", "a"]).exits(1).gives("NOT MET").gives("over 6 points");
    // What cannot be told is not met.
    folder.write("s.lam", scene_with(&format!("{sweep}\n  expect order(leak, step) in 0 .. 1")));
    let none = folder.lamella(&["sweep", "s.lam", "--out", "b"]).exits(1);
    none.gives("not known").gives("have no logarithm");
}

#[test]
fn a_folder_keeps_its_sweep() {
    let folder = run_once();
    folder.write("other.lam", scene_with(SWEEP));
    folder.lamella(&["sweep", "other.lam", "--out", "out"]).exits(2).says("[F126]").says("`study` of s");
    let over = |axis: &str| folder.lamella(&["sweep", "s.lam", "--over", axis]).exits(0);
    over("step=1s,2s").gives("results/s-over-step");
    over("particles=100,200").gives("results/s-over-particles");
}

#[test]
fn a_folder_holds_a_run_or_a_sweep() {
    let folder = run_once();
    let before = std::fs::read(folder.path("out/points.parquet")).unwrap();
    folder.lamella(&["run", "s.lam", "--out", "out"]).exits(2).says("[F125]").says("out holds a sweep");
    assert_eq!(std::fs::read(folder.path("out/points.parquet")).unwrap(), before);
    folder.lamella(&["run", "s.lam", "--out", "single"]).exits(0);
    folder.lamella(&["sweep", "s.lam", "--out", "single"]).exits(2).says("[F125]").says("results of a run");
    assert!(!folder.path("single/journal").exists());
}

/// What a kill between two names, or a copy, can leave.
#[test]
fn tables_of_two_plans_are_not_reported() {
    let folder = run_once();
    folder.lamella(&["report", "out"]).exits(0);
    folder.lamella(&["run", "s.lam", "--seed", "99", "--out", "single"]).exits(0);
    std::fs::copy(
        folder.path("single/profile/part-0000.parquet"),
        folder.path("out/profile/part-0000.parquet"),
    )
    .unwrap();
    folder.lamella(&["report", "out"]).exits(1).says("are of two plans or two").says("lamella gather");
    folder.lamella(&["gather", "out"]).exits(0);
    folder.lamella(&["report", "out"]).exits(0);
    std::fs::remove_file(folder.path("out/points.parquet")).unwrap();
    folder.lamella(&["report", "out"]).exits(2).says("no points.parquet").says("lamella gather");
}

#[test]
fn what_failed_can_be_run_alone() {
    let folder = Folder::new();
    folder.write("s.lam", scene_with("  D linspace(1e-4 m^2/s, 1e-3 m^2/s, 30)"));
    folder
        .lamella(&["sweep", "s.lam", "--retry-failed", "--out", "none"])
        .says("0 replicates run, 30 left alone");
    let mut command = folder.command(&["sweep", "s.lam", "--out", "out"]);
    crate::program::finish(command.env("LAMELLA_FAULT_EVERY", "5").output().unwrap()).exits(1);
    let n_failed = facts(&folder, "out").iter().filter(|row| row.contains("Failed")).count();
    let again = folder.lamella(&["sweep", "s.lam", "--retry-failed", "--out", "out"]).exits(0);
    again.says(&format!("{n_failed} replicates run, {} known", 30 - n_failed));
}

#[test]
fn a_mean_that_stays_imprecise_is_told() {
    let folder = Folder::new();
    let sweep = "  D 1e-3 m^2/s, 1e-4 m^2/s\n  replicates 2 .. 3 until stderr(err) < 0.0001 % of mean(err)";
    folder.write("s.lam", scene_with(sweep));
    folder.lamella(&["sweep", "s.lam", "--out", "out"]).exits(0).gives("imprecise   2 points");
}

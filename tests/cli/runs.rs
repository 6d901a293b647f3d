//! `run`: results whole or absent, the same bytes every time.

use crate::program::{Finished, Folder, finish};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// A scene that runs in well under a second.
const SMALL: &str = r#"lamella 1
param c0 = 0.02 mol/L
param D  = 1.3e-3 cm^2/s
species A, B, AB
reaction join: A + B -> AB @ instant
domain line x = -7.5 cm .. 7.5 cm
boundary left, right reflect
dispersion D
mixing zones {
  fast: fraction 0.5, rate instant
  slow: fraction 0.5, rate 1e-3 /s
}
average bins 60
initial A = if x < 0 cm then c0 else 0
initial B = c0 - A
particles fluid 20_000 stratified
run to 100 s, step 2 s
seed 42
output profile    A, B, AB at t = 50 s, 100 s
output covariance A, B     at t = 50 s, 100 s
output total      AB every 10 s
output mixing     A, B every 10 s
output particles  A, AB at t = 100 s
reference well_mixed for AB = 0.5 * c0 * erfc(abs(x) / (2*sqrt(D*t)))
"#;

fn run(folder: &Folder, arguments: &[&str]) -> Finished {
    folder.lamella(&[&["run", "small.lam"], arguments].concat())
}

fn with_small() -> Folder {
    let folder = Folder::new();
    folder.write("small.lam", SMALL);
    folder
}

/// The data files of a results folder; facts of the machine live in `points.parquet` alone.
fn data_files(folder: &Folder, out: &str) -> Vec<String> {
    let inside = format!("{out}/");
    let names = folder.files().into_iter().filter_map(|name| name.strip_prefix(&inside).map(str::to_owned));
    names.filter(|name| !["points.parquet", "ro-crate-metadata.json"].contains(&name.as_str())).collect()
}

#[track_caller]
fn assert_same_bytes(folder: &Folder, a: &str, b: &str) {
    let names = data_files(folder, a);
    assert!(names.iter().filter(|name| name.ends_with(".parquet")).count() >= 6, "{names:?}");
    assert_eq!(names, data_files(folder, b));
    for name in names {
        let bytes =
            |out: &str| std::fs::read(folder.path(&format!("{out}/{name}"))).expect("the file is there");
        assert!(bytes(a) == bytes(b), "{name} differs between {a} and {b}");
    }
}

#[test]
fn a_run_writes_the_layout_of_the_readme() {
    let folder = with_small();
    let finished = run(&folder, &["--plot"]).exits(0).says("note[L010]: left out of this run");
    let files = folder.files();
    for name in ["plan.yaml", "points.parquet", "columns.parquet", "profile/part-0000.parquet", "figure.svg"]
    {
        assert!(files.contains(&format!("results/small/{name}")), "{name} in {files:?}");
    }
    for part in ["well_mixed", "mass defect", "ns per particle-step", "results/small"] {
        assert!(finished.stdout.contains(part), "{part} in {}", finished.stdout);
    }
}

#[test]
fn any_number_of_threads_and_any_repetition_give_the_same_bytes() {
    let folder = with_small();
    for (threads, out) in [("1", "one"), ("2", "two"), ("7", "seven"), ("1", "again")] {
        run(&folder, &["--threads", threads, "--out", out, "--quiet"]).exits(0);
    }
    for out in ["two", "seven", "again"] {
        assert_same_bytes(&folder, "one", out);
    }
}

#[test]
fn formatting_changes_neither_hash_nor_data() {
    let folder = with_small();
    run(&folder, &["--out", "before", "-q"]).exits(0);
    folder.lamella(&["fmt", "small.lam"]).exits(0);
    run(&folder, &["--out", "after", "-q"]).exits(0);
    let hash = |out: &str| {
        let plan = folder.read(&format!("{out}/plan.yaml"));
        plan.lines().find(|line| line.contains("hash")).expect("plan.yaml has a hash").to_owned()
    };
    assert_eq!(hash("before"), hash("after"));
}

#[test]
fn another_seed_gives_other_numbers() {
    let folder = with_small();
    run(&folder, &["--out", "a", "-q"]).exits(0);
    run(&folder, &["--out", "b", "-q", "--seed", "43"]).exits(0);
    let bytes =
        |out: &str| std::fs::read(folder.path(&format!("{out}/profile/part-0000.parquet"))).expect("there");
    assert!(bytes("a") != bytes("b"));
}

#[test]
fn a_second_run_replaces_the_first() {
    let folder = with_small();
    run(&folder, &["-q"]).exits(0);
    let first = folder.files();
    run(&folder, &["-q"]).exits(0);
    assert_eq!(folder.files(), first);
}

#[test]
fn a_wrong_scene_does_not_start() {
    let folder = Folder::new();
    folder.write("small.lam", SMALL.replace("dispersion D", "dispersion 3 kg"));
    run(&folder, &[]).exits(2).says("small.lam:8:");
    assert_eq!(folder.files(), ["small.lam"]);
}

#[test]
fn a_run_that_breaks_names_the_particle_and_leaves_no_table() {
    let folder = Folder::new();
    // An odd number of ordered particles puts one at exactly 0, where this has no value.
    let text = SMALL
        .replace("if x < 0 cm then c0 else 0", "c0 * (1 cm / abs(x))")
        .replace("initial B = c0 - A", "initial B = c0");
    folder.write("small.lam", text.replace("20_000 stratified", "20_001 ordered"));
    run(&folder, &[]).exits(1).says("[R102]").says("particle 10000");
    assert!(folder.files().iter().all(|name| !name.contains("part-")), "{:?}", folder.files());
}

#[test]
fn a_summary_as_json_has_the_numbers() {
    let folder = with_small();
    let finished = run(&folder, &["--message-format", "json"]).exits(0);
    let summary: serde_json::Value = serde_json::from_str(&finished.stdout).expect("one JSON object");
    assert_eq!(summary["particles"], 20_000);
    assert_eq!(summary["steps"], 50);
    assert!(summary["mass_defect"].as_f64().is_some_and(|defect| defect <= 1e-12), "{summary}");
    assert_eq!(summary["errors"][0]["reference"], "well_mixed");
    finished.messages();
}

#[test]
fn a_column_that_nothing_reads_is_left_out_without_passes_it_is_not() {
    let folder = with_small();
    run(&folder, &["--out", "with", "-q"]).exits(0);
    run(&folder, &["--out", "without", "-q", "--no-passes"]).exits(0);
    let bytes =
        |out: &str| std::fs::read(folder.path(&format!("{out}/mixing/part-0000.parquet"))).expect("there");
    assert_eq!(bytes("with").len(), bytes("without").len());
}

#[cfg(unix)]
#[test]
fn an_interrupted_run_leaves_no_half_file_and_exits_130() {
    for signal in ["INT", "TERM"] {
        let folder = Folder::new();
        folder.write("long.lam", SMALL.replace("20_000", "200_000").replace("step 2 s", "step 0.001 s"));
        let mut command = folder.command(&["run", "long.lam"]);
        let child =
            command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts");
        std::thread::sleep(Duration::from_millis(1500));
        let started = Instant::now();
        let kill = Command::new("kill").args([format!("-{signal}"), child.id().to_string()]).status();
        assert!(kill.is_ok_and(|status| status.success()), "the run was still going");
        let finished = finish(child.wait_with_output().expect("the program ends")).exits(130).says("[R101]");
        assert!(started.elapsed() < Duration::from_secs(5), "{}", finished.stderr);
        let left: Vec<String> = folder.files().into_iter().filter(|name| name != "long.lam").collect();
        assert!(left.is_empty(), "{left:?}");
    }
}

#[test]
fn a_measure_without_its_time_is_refused_before_the_run() {
    let folder = Folder::new();
    folder.write("small.lam", format!("{SMALL}measure late = integral(profile.AB) at t = 75 s\n"));
    run(&folder, &[]).exits(2).says("error[M015]");
    assert!(!folder.files().iter().any(|name| name.ends_with(".parquet")), "{:?}", folder.files());
}

#[test]
fn layout_of_the_scene_changes_no_byte_of_the_data() {
    let folder = Folder::new();
    folder.write("small.lam", SMALL.replace("  ", " ").replace("initial B = c0 - A", "initial   B = c0-A"));
    run(&folder, &["--out", "one"]).exits(0);
    folder.lamella(&["fmt", "small.lam"]).exits(0);
    run(&folder, &["--out", "two"]).exits(0);
    for name in data_files(&folder, "one").iter().filter(|name| name.ends_with(".parquet")) {
        let bytes =
            |out: &str| std::fs::read(folder.path(&format!("{out}/{name}"))).expect("the file is there");
        assert!(bytes("one") == bytes("two"), "{name} differs after fmt");
    }
}

#[test]
fn a_negative_start_stops_the_run_by_name() {
    let folder = Folder::new();
    // B is not carried but restored from A: its sign is checked all the same.
    folder.write("small.lam", SMALL.replace("then c0 else 0", "then 2 * c0 else 0"));
    run(&folder, &[]).exits(1).says("error[R102]").says("initial concentration of `B` is negative");
    assert!(!folder.files().iter().any(|name| name.ends_with(".parquet")), "{:?}", folder.files());
}

#[test]
fn gamma_has_no_value_before_anything_mixes() {
    let folder = Folder::new();
    let odd = SMALL.replace("0.02 mol/L", "0.0137 mol/L");
    folder.write(
        "small.lam",
        format!("{odd}reference theory for mixing A, B = front_gamma(eta = 0.5, chi = 1e-3 /s)\n"),
    );
    let finished = run(&folder, &["--message-format", "json"]).exits(0);
    assert!(finished.stdout.contains("theory"), "{}", finished.stdout);
    let evaluated: serde_json::Value = serde_json::from_str(&finished.stdout).expect("one object");
    let row = evaluated["errors"].as_array().expect("rows").iter().find(|row| row["reference"] == "theory");
    let largest = row.and_then(|row| row["linf"].as_f64()).expect("the reference has an error");
    // Against −0.25 at t = 0 a value made of rounding would be an error of about one.
    assert!(largest < 0.2, "rounding at t = 0 is no γ: {row:?}");
}

#[test]
fn an_old_figure_does_not_stay_beside_new_tables() {
    let folder = with_small();
    run(&folder, &["--plot"]).exits(0);
    assert!(folder.files().contains(&"results/small/figure.svg".to_owned()));
    run(&folder, &["--seed", "7"]).exits(0);
    assert!(!folder.files().contains(&"results/small/figure.svg".to_owned()));
}

#[test]
fn settings_stand_in_the_results() {
    let folder = with_small();
    let set = ["--set", "D = 26 cm^2/h", "--set", "c0=2 * 5 mol/m^3", "--set", "c0=10 mol/m^3"];
    run(&folder, &[&["--out", "set", "-q"], &set[..]].concat()).exits(0);
    let edited = SMALL.replace("1.3e-3 cm^2/s", "26 cm^2/h").replace("0.02 mol/L", "10 mol/m^3");
    folder.write("edited.lam", edited);
    folder.lamella(&["run", "edited.lam", "--out", "edited", "-q"]).exits(0);
    let document = |out: &str| -> serde_yaml::Value {
        serde_yaml::from_str(&folder.read(&format!("{out}/plan.yaml"))).expect("a document")
    };
    let (set, edited) = (document("set"), document("edited"));
    // What is recorded is no part of the plan.
    assert_eq!(set["plan_hash"], edited["plan_hash"]);
    let wanted =
        "[{name: D, value: 26 cm^2/h}, {name: c0, value: 2 * 5 mol/m^3}, {name: c0, value: 10 mol/m^3}]";
    assert_eq!(set["settings"], serde_yaml::from_str::<serde_yaml::Value>(wanted).expect("YAML"));
    assert_eq!(edited["settings"].as_sequence().map(Vec::len), Some(0));
    let parameter = |name: &str, value: f64, unit: &str, si_unit: &str, is_set: bool| {
        let text =
            format!("{{name: {name}, value: {value:?}, si_unit: {si_unit}, unit: {unit}, is_set: {is_set}}}");
        serde_yaml::from_str::<serde_yaml::Value>(&text).expect("YAML")
    };
    let d = 26e-4 / 3600.0;
    assert_eq!(set["parameters"][0], parameter("c0", 10.0, "mol/m^3", "mol/m^3", true));
    assert_eq!(set["parameters"][1], parameter("D", d, "cm^2/h", "m^2/s", true));
    assert_eq!(edited["parameters"][1], parameter("D", d, "cm^2/h", "m^2/s", false));
    let points = |out: &str| {
        let path = folder.path(&format!("{out}/points.parquet"));
        lamella::table::read::points(&path).expect("points").remove(0).values
    };
    let column = |out: &str, name: &str| {
        points(out).iter().find(|value| value.name == name).and_then(|value| value.value)
    };
    assert_eq!((column("set", "D"), column("set", "c0")), (Some(d), Some(10.0)));
    assert_eq!((column("edited", "D"), column("edited", "c0")), (None, None));
}

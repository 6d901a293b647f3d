//! `run --error`: bars beside tables that stay as they are.

use crate::program::Folder;

const SCENE: &str = r#"lamella 1
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
average bins 30
initial A = if x < 0 cm then c0 else 0
initial B = c0 - A
particles fluid 20_000 stratified
run to 100 s, step 2 s
seed 42
output profile    AB       at t = 51 s, 100 s
output covariance A, B     at t = 100 s
output total      AB every 10 s
output mixing     A, B every 10 s
output particles  A, AB at t = 100 s
"#;

#[test]
fn runs_with_error_bars_are_verified_with_them() {
    let folder = Folder::new();
    folder.write("a.lam", SCENE.replace("20_000", "2_000"));
    folder.lamella(&["run", "a.lam", "--out", "bars", "--error", "--plot"]).exits(0);
    folder.lamella(&["verify", "bars"]).exits(0);
}

#[test]
fn error_bars_leave_all_other_tables_as_they_are() {
    let folder = Folder::new();
    folder.write("a.lam", SCENE);
    folder.lamella(&["run", "a.lam", "--out", "plain"]).exits(0);
    let finished = folder.lamella(&["run", "a.lam", "--out", "bars", "--error", "--threads", "1"]).exits(0);
    for part in [
        "profile AB at 100 s: ±",
        "total AB: ±",
        "mixing A,B: ±",
        "covariance A,B at 100 s: ±",
        "particles",
        "most for its cost",
    ] {
        assert!(finished.stdout.contains(part), "{part} in\n{}", finished.stdout);
    }
    let tables = ["profile", "covariance", "total", "mixing", "particles"];
    for table in tables {
        let bytes = |out: &str| {
            std::fs::read(folder.path(&format!("{out}/{table}/part-0000.parquet")))
                .expect("the table is there")
        };
        assert!(bytes("plain") == bytes("bars"), "{table} differs");
    }
    assert_eq!(folder.read("plain/plan.yaml"), folder.read("bars/plan.yaml"));
    assert!(!folder.path("plain/error_bars").exists());
    // Again on two threads, the same bars; without them, none is left of the earlier run.
    folder.lamella(&["run", "a.lam", "--out", "again", "--error", "--threads", "2"]).exits(0);
    let bars = |out: &str| std::fs::read(folder.path(&format!("{out}/error_bars/part-0000.parquet")));
    assert_eq!(bars("bars").expect("bars"), bars("again").expect("bars"));
    folder.lamella(&["run", "a.lam", "--out", "bars"]).exits(0);
    assert!(!folder.path("bars/error_bars").exists());
}

#[test]
fn bars_are_in_the_json_when_they_are_asked_for() {
    let folder = Folder::new();
    folder.write("a.lam", SCENE);
    let of = |arguments: &[&str]| -> serde_json::Value {
        let finished = folder.lamella(&[&["run", "a.lam", "--message-format", "json"], arguments].concat());
        serde_json::from_str(&finished.exits(0).stdout).expect("one object")
    };
    let bars = of(&["--error"])["error_bars"].clone();
    // A profile at two times, a covariance at one, 11 totals and 11 γ, and each over all times.
    assert_eq!(bars.as_array().map(Vec::len), Some(3 + 2 + 12 + 11));
    let first = &bars[0];
    assert_eq!((first["kind"].as_str(), first["species"][0].as_str()), (Some("profile"), Some("AB")));
    let number = |name: &str| first[name].as_f64().unwrap_or_else(|| panic!("{name} in {first}"));
    assert!(number("total") > 0.0 && number("from_particles") > 0.0 && number("from_bins") >= 0.0);
    assert!(number("relative") > 0.0 && number("relative") < 0.5, "{first}");
    assert!(of(&[]).get("error_bars").is_none());
}

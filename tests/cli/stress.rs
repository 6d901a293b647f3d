//! `lamella stress`: what is multiplied, what comes of it, and a table that others read.

use crate::program::Folder;

const SCENE: &str = "lamella 1
species A, B
domain line x = 0 m .. 1 m
boundary left, right reflect
dispersion 1e-6 m^2/s
mixing zones {
  fast: fraction 0.5, rate instant
  slow: fraction 0.5, rate 1e-3 /s
}
average bins 20
initial A = if x < 0.5 m then 1 mol/L else 0
initial B = 1 mol/L - A
particles fluid 20_000 stratified
run to 1e4 s, step 50 s
seed 1
output profile A, B at t = 1e4 s
output mixing A, B at t = 1e4 s
";

#[test]
fn every_trial_is_a_row_with_its_reason() {
    let folder = Folder::new();
    folder.write("s.lam", SCENE);
    let trials =
        ["stress", "s.lam", "--every", "6", "--seconds", "5", "--out", "out", "--message-format", "json"];
    let finished = folder.lamella(&trials).exits(0);
    let rows: Vec<serde_json::Value> =
        finished.stdout.lines().map(|line| serde_json::from_str(line).expect("a row is JSON")).collect();
    // Three quantities at five powers each: there is no reaction to multiply.
    assert_eq!(rows.len(), 15, "{}", finished.stdout);
    let row = |knob: &str, decades: i64| {
        rows.iter().find(|row| row["knob"] == knob && row["decades"] == decades).expect("the trial is there")
    };
    for decades in [-12, -6, 0, 6, 12] {
        let finished = row("concentrations", decades);
        assert_eq!(finished["fate"], "finished", "{finished}");
        assert!(finished["mass_defect"].as_f64().unwrap() < 1e-12, "{finished}");
        // No value below zero by more than rounding.
        assert!(finished["lowest"].as_f64().unwrap() > -1e-15, "{finished}");
    }
    // chi dt = 0.05 is 5e4 after six decades more, and 1e4 s is all there is.
    for decades in [6, 12] {
        let refused = row("step", decades);
        assert_eq!(
            (&refused["fate"], &refused["code"], &refused["line"]),
            (&"refused".into(), &"N202".into(), &14.into())
        );
    }
    assert_eq!(row("step", -12)["fate"], "too_long");
    assert_eq!(row("peclet", 12)["code"], "N203");
    assert!(folder.path("out/stress.parquet").is_file());
}

#[test]
fn what_a_scene_does_not_have_cannot_be_turned() {
    let folder = Folder::new();
    folder.write("s.lam", SCENE);
    let absent = ["stress", "s.lam", "--knobs", "step,rates", "--out", "out"];
    folder.lamella(&absent).exits(2).says("[F128]").says("`rates`").says("`concentrations`");
    assert!(!folder.path("out").exists());
    // Values that are the same everywhere are folded into the outputs, and turned all the same.
    folder.write("flat.lam", SCENE.replace("if x < 0.5 m then 1 mol/L else 0", "0.25 mol/L"));
    let flat = ["stress", "flat.lam", "--knobs", "concentrations", "--decades", "1", "--out", "flat"];
    folder.lamella(&flat).exits(0).gives("3 trials in");
}

#[test]
fn the_table_is_read_by_others() {
    let Some(python) = std::env::var_os("LAMELLA_PYTHON") else { return };
    let folder = Folder::new();
    folder.write("s.lam", SCENE);
    let text =
        folder.lamella(&["stress", "s.lam", "--knobs", "step", "--decades", "2", "--out", "out"]).exits(0);
    text.gives("5 trials in").gives("1e+2").gives("refused");
    let script = "
import duckdb, pandas, polars, pyarrow.parquet
path = 'out/stress.parquet'
table = pyarrow.parquet.read_table(path)
assert table.schema.field('wall').metadata[b'unit'] == b's', table.schema.field('wall').metadata
expected = [-2, -1, 0, 1, 2]
assert table['decades'].to_pylist() == expected
assert polars.read_parquet(path)['decades'].to_list() == expected
assert pandas.read_parquet(path)['decades'].to_list() == expected
assert [row[0] for row in duckdb.sql(f\"select decades from '{path}'\").fetchall()] == expected
assert duckdb.sql(f\"select count(*) from '{path}' where fate = 'refused' and code is null\").fetchall() == [(0,)]
";
    let status = std::process::Command::new(python)
        .args(["-c", script])
        .current_dir(folder.path(""))
        .status()
        .expect("Python starts");
    assert!(status.success());
}

//! Tables of numbers, as a user has them: read, run, compared, kept with the results, run again.

use crate::program::Folder;

const PLUME: &str = "# measured on May 3\nx;y;c;probe\n0;0;1;A\n0;5;2;B\n10;0;3;C\n10;5;4;D\n";

/// Particles of fluid on a bilinear plume that decays at a rate that jumps.
const SCENE: &str = r#"lamella 1
data plume = "measured/plume.csv" (x [m], y [m], c [mg/L]) "snapshot"
data rate  = "rate.csv" (t [d], k [/d]) steps
species S "substrate"
reaction decay: S -> @ rate.k(t) * S
domain rect x = 0 .. 10 m, y = 0 .. 5 m
boundary left, right, top, bottom reflect
initial S = plume.c(x, y)
average bins 5 x 5
particles fluid 5_000 ordered
run to 10 d, step 1 d
output map   S at t = 0 d, 10 d
output total S every 5 d
reference left for S = plume.c(x, y) * exp(-1.5 * (t / 10 d))
measure start = linf((map.S - left) / left) at t = 0 d
measure end   = linf((map.S - left) / left) at t = 10 d
"#;

fn with_scene() -> Folder {
    let folder = Folder::new();
    folder.write("scene.lam", SCENE);
    folder.write("measured/plume.csv", PLUME);
    folder.write("rate.csv", "t,k\n0,0.1\n5,0.2\n");
    folder
}

/// The value of a measure as a run tells it.
fn measure(folder: &Folder, arguments: &[&str], name: &str) -> f64 {
    let run = folder.lamella(&[&["run"], arguments, &["--message-format", "json"]].concat()).exits(0);
    let summary: serde_json::Value = serde_json::from_str(run.stdout.trim()).expect("one object");
    let all = summary["measures"].as_array().expect("measures");
    let found = all.iter().find(|measure| measure["name"] == name).expect("the measure");
    found["value"].as_f64().expect("a number")
}

#[test]
fn tables_give_what_their_rows_say() {
    let folder = with_scene();
    folder.lamella(&["fmt", "--check", "scene.lam"]).exits(0);
    folder.lamella(&["check", "scene.lam"]).exits(0);
    // Ordered particles are 100 x 50 here and fill each bin evenly, and the plume is bilinear: means are exact.
    assert!(measure(&folder, &["scene.lam"], "start") < 1e-12);
    // Five days at 0.1/d and five at 0.2/d; the rate jumps between two steps, and sub-steps keep 1e-6.
    assert!(measure(&folder, &["scene.lam"], "end") < 1e-5);
    let plan = folder.lamella(&["plan", "scene.lam"]).exits(0);
    let hash = blake3::hash(PLUME.as_bytes()).to_hex().to_string();
    plan.gives(&format!("measured/plume.csv, BLAKE3 {hash}"));
}

#[test]
fn units_orders_and_formats_make_no_other_plan() {
    let folder = with_scene();
    let plan_hash = |scene: &str| {
        let yaml = folder.lamella(&["plan", scene, "--emit", "yaml"]).exits(0).stdout;
        let document: serde_yaml::Value = serde_yaml::from_str(&yaml).expect("YAML");
        document["plan_hash"].as_str().expect("a hash").to_owned()
    };
    let first = plan_hash("scene.lam");
    folder.write("cm.csv", "c\tx [cm]\ty [cm]\n4\t1000\t500\n3\t1000\t0\n2\t0\t500\n1\t0\t0\n");
    let other = SCENE.replace("measured/plume.csv\" (x [m], y [m]", "cm.csv\" (x [cm], y [cm]");
    folder.write("other.lam", &other);
    assert_eq!(plan_hash("other.lam"), first);
    folder.write("cm.csv", "x,y,c\n0,0,1\n0,500,2\n1000,0,3\n1000,500,4.5\n");
    assert_ne!(plan_hash("other.lam"), first);
}

#[test]
fn results_hold_what_is_needed_to_run_again() {
    let folder = with_scene();
    folder.lamella(&["run", "scene.lam", "--out", "out", "-q"]).exits(0);
    assert_eq!(folder.read("out/data/measured/plume.csv"), PLUME);
    std::fs::remove_file(folder.path("measured/plume.csv")).expect("removed");
    std::fs::remove_file(folder.path("scene.lam")).expect("removed");
    folder.lamella(&["verify", "out"]).exits(0).gives("the same bytes");
    folder.write("out/data/measured/plume.csv", PLUME.replace("10;5;4", "10;5;5"));
    folder.lamella(&["verify", "out"]).exits(1).says("plume.csv is not the file that was read");
}

#[test]
fn sweeps_keep_their_files_and_tell_when_one_has_changed() {
    let folder = with_scene();
    let swept = SCENE.replace("run to 10 d, step 1 d", "param h = 1 d\nrun to 10 d, step h")
        + "sweep steps { h 1 d, 2 d }\n";
    folder.write("scene.lam", &swept);
    folder.lamella(&["sweep", "scene.lam", "--out", "out", "-q"]).exits(0);
    folder.lamella(&["why", "out", "0"]).gives("complete since");
    folder.write("measured/plume.csv", PLUME.replace("10;5;4", "10;5;5"));
    let why = folder.lamella(&["why", "out", "0"]);
    why.says("measured/plume.csv holds other numbers than it did");
    // What was run is still there, under its hash.
    folder.lamella(&["verify", "out"]).exits(0);
    folder.lamella(&["repro", "out", "1"]).exits(0);
    folder.lamella(&["gather", "out"]).exits(0);
    assert_eq!(folder.read("out/repro/1-0/data/measured/plume.csv"), PLUME);
}

/// Measured data are compared where they are, and nowhere else.
#[test]
fn references_of_measured_data_leave_out_what_was_not_measured() {
    let folder = Folder::new();
    folder.write("probes.csv", "x,c\n20,1\n40,1\n60,3\n");
    folder.write("tank.csv", "t,c\n2,1.5\n4,1.5\n");
    let scene = r#"lamella 1
data probes = "probes.csv" (x [cm], c [mg/L])
data tank   = "tank.csv" (t [d], c [mg/L])
species S
domain line x = 0 m .. 1 m
boundary left, right reflect
flow uniform 0 m/d
dispersion 1e-9 m^2/s
initial S = 2 mg/L
particles mass 1000 ordered
run to 5 d, step 1 d
output profile      S at t = 0 d on 10
output breakthrough S in box(0 m .. 1 m) every 1 d
reference measured for S              = probes.c(x)
reference lab      for breakthrough S = tank.c(t)
measure err  = mean(profile.S - measured) / (1 mg/L)
measure late = mean(breakthrough.S - lab) / (1 mg/L)
"#;
    folder.write("scene.lam", scene);
    // Bins from 0.2 to 0.4 m differ by 1, those to 0.6 m by 0.5 and -0.5: (1 + 1 + 0.5 - 0.5)/4.
    let err = measure(&folder, &["scene.lam"], "err");
    assert!((err - 0.5).abs() < 1e-9, "{err}");
    let late = measure(&folder, &["scene.lam"], "late");
    assert!((late - 0.5).abs() < 1e-9, "{late}");
    let run = folder.lamella(&["run", "scene.lam", "--plot"]).exits(0);
    run.gives("measured");
}

/// A cloud of points with unequal masses: amount, centre and spread are those of its rows.
#[test]
fn clouds_put_in_what_their_rows_give() {
    let folder = Folder::new();
    folder.write("cloud.csv", "x,y,m\n2,1,1\n4,1,3\n8,4,4\n");
    let scene = r#"lamella 1
data cloud = "cloud.csv" (x [m], y [m], m [g/m])
species S
domain rect x = 0 .. 10 m, y = 0 .. 5 m
boundary left, right, bottom, top reflect
source spill: S = cloud.m at cloud
particles mass 8_000
run to 1 s, step 1 s
output moments   S at t = 0 s
output budget    S at t = 1 s
output particles S at t = 0 s
"#;
    folder.write("scene.lam", scene);
    folder.lamella(&["fmt", "--check", "scene.lam"]).exits(0);
    folder.lamella(&["plan", "scene.lam"]).exits(0).gives("at the 3 places of a table");
    folder.lamella(&["run", "scene.lam", "--out", "out"]).exits(0);
    let bytes = std::fs::read(folder.path("out/moments/part-0000.parquet")).expect("moments");
    let numbers =
        lamella::data::parquet::columns(bytes.into(), &["amount", "mean_x", "mean_y", "xx"], None, 100)
            .expect("columns");
    // 8 g/m in all; 8,000 particles fall on 1,000, 3,000 and 4,000, so that moments are exact.
    let expected = [8e-3, 46.0 / 8.0, 20.0 / 8.0, (4.0 + 48.0 + 256.0) / 8.0 - (46.0_f64 / 8.0).powi(2)];
    for (found, expected) in numbers.iter().zip(expected) {
        assert!((found[0] - expected).abs() < 1e-12 * expected.abs(), "{found:?} is not {expected}");
    }
    folder.write("cloud.csv", "x,y,m\n2,1,1\n14,1,3\n");
    folder.lamella(&["check", "scene.lam"]).exits(2).says("[T105]").says("line 3, column 1: x = 14 m");
}

#[test]
fn a_table_is_read_below_the_folder_of_its_scene_only() {
    let folder = Folder::new();
    folder.write("study/scene.lam", SCENE);
    folder.write("study/rate.csv", "0,0.1\n5,0.2\n");
    folder.lamella(&["check", "study/scene.lam"]).exits(2).says("[F105]").says("no such file");
    folder.write("outside.csv", PLUME);
    folder.write("study/scene.lam", SCENE.replace("measured/", "../"));
    folder.lamella(&["check", "study/scene.lam"]).exits(2).says("[F106]");
    folder.lamella_with_stdin(&["check", "-"], SCENE).exits(2).says("standard input has no folder");
    #[cfg(unix)]
    {
        folder.write("study/scene.lam", SCENE);
        std::fs::create_dir_all(folder.path("study/measured")).expect("a folder");
        std::os::unix::fs::symlink(folder.path("outside.csv"), folder.path("study/measured/plume.csv"))
            .expect("a link");
        folder.lamella(&["check", "study/scene.lam"]).exits(2).says("[F106]").says("leads out");
    }
}

/// Tables of a used scene, with and without its alias, count from the folder of that scene.
#[test]
fn a_used_scene_brings_its_tables() {
    let folder = Folder::new();
    let column = SCENE.lines().filter(|line| !line.starts_with("reference") && !line.starts_with("measure"));
    folder.write("sub/column.lam", column.collect::<Vec<_>>().join("\n") + "\n");
    folder.write("sub/measured/plume.csv", PLUME);
    folder.write("sub/rate.csv", "t,k\n0,0.1\n5,0.2\n");
    let study = "lamella 1\nuse \"sub/column.lam\" as column\n\
        reference left for column.S = column.plume.c(x, y)\n\
        measure start = linf((column.map.S - left) / left) at t = 0 d\n";
    folder.write("study.lam", study);
    assert!(measure(&folder, &["study.lam", "--out", "out"], "start") < 1e-12);
    assert_eq!(folder.read("out/data/sub/measured/plume.csv"), PLUME);
    folder.lamella(&["verify", "out"]).exits(0);
    folder.write("study.lam", study.replace("column.plume.c(x, y)", "plum.c(x, y)"));
    folder.lamella(&["check", "study.lam"]).exits(2).says("`plum` is no used scene").says("did you mean");
}

/// A line gives along all of it at any time: particles of one moment are spread evenly, and so are rows of a table.
#[test]
fn rates_along_lines_and_tables_go_on_everywhere_at_once() {
    let folder = Folder::new();
    folder.write("leaks.csv", "x,y,q\n2,1,1\n8,1,1\n");
    let scene = r#"lamella 1
data leaks = "leaks.csv" (x [m], y [m], q [g/m/d])
species A, B
domain rect x = 0 .. 10 m, y = 0 .. 5 m
boundary left, right, bottom, top reflect
source pipe: A = 1 g/m/d at line((0 m, 1 m), (10 m, 1 m))
source wells: B = leaks.q at leaks
particles mass A 10_000, B 10_000
run to 10 d, step 1 d
output moments A, B at t = 1 d
"#;
    folder.write("scene.lam", scene);
    folder.lamella(&["run", "scene.lam", "--out", "out"]).exits(0);
    let bytes = std::fs::read(folder.path("out/moments/part-0000.parquet")).expect("moments");
    let names = ["mean_x", "xx"];
    let numbers = lamella::data::parquet::columns(bytes.into(), &names, None, 100).expect("columns");
    // 1,000 particles after a tenth of the time: means of 5 m within four standard errors of 2.9 and 3 m over
    // their root, variances of 100/12 and 9 m^2 within 15 %.
    for (row, variance) in [(0, 100.0 / 12.0), (1, 9.0)] {
        assert!((numbers[0][row] - 5.0).abs() < 0.4, "{numbers:?}");
        assert!((numbers[1][row] / variance - 1.0).abs() < 0.15, "{numbers:?}");
    }
}

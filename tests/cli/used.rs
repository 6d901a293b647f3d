//! Scenes that use others: where they are looked for, and what the results keep of them.

use crate::program::Folder;

const COLUMN: &str = r#"lamella 1
param D = 1e-9 m^2/s
species A
domain line x = 0 m .. 1 m
boundary left, right reflect
dispersion D
initial A = if x < 0.5 m then 1 mol/m^3 else 0
particles fluid 1000 stratified
run to 10 s, step 1 s
output total A at t = 10 s   # the whole
"#;

#[test]
fn a_scene_reads_what_it_uses_below_its_own_folder() {
    let folder = Folder::new();
    folder.write("study/parts/column.lam", COLUMN);
    folder.write("study/scene.lam", "lamella 1\nuse \"parts/column.lam\" as column\n");
    folder.lamella(&["check", "study/scene.lam"]).exits(0);
    folder.lamella(&["run", "study/scene.lam", "--out", "out", "-q"]).exits(0);
    let document: serde_yaml::Value = serde_yaml::from_str(&folder.read("out/plan.yaml")).expect("YAML");
    let sources = document["sources"].as_sequence().expect("sources");
    let names: Vec<_> = sources.iter().map(|source| source["name"].as_str().expect("a name")).collect();
    assert_eq!(names, ["scene.lam", "parts/column.lam"]);
    let text = sources[1]["text"].as_str().expect("a text");
    assert!(text.starts_with("lamella 1\nparam D = 1e-9 m^2/s\n") && text.contains("# the whole"), "{text}");
    assert_eq!(sources[1]["hash"].as_str(), Some(blake3::hash(text.as_bytes()).to_hex().as_str()));
    // However the scene is named, the path counts from its folder.
    folder.lamella(&["plan", "./study/scene.lam"]).exits(0);
}

#[test]
fn a_used_file_that_cannot_be_had_is_told_with_the_reason() {
    let folder = Folder::new();
    let with = |path: &str| {
        folder.write("study/scene.lam", format!("lamella 1\nuse \"{path}\" as column\n"));
        folder.lamella(&["check", "study/scene.lam"]).exits(2)
    };
    with("column.lam").says("[F105]").says("study/column.lam: no such file");
    folder.write("study/folder.lam/inside", "");
    with("folder.lam").says("[F105]").says("it is a directory");
    folder.write("study/latin.lam", b"lamella 1 # \xe9\n");
    with("latin.lam").says("[F105]").says("not UTF-8");
    folder.write("outside.lam", COLUMN);
    with("../outside.lam").says("[F106]");
    let absolute = folder.path("outside.lam").display().to_string();
    with(&absolute).says("[F106]");
    let input = "lamella 1\nuse \"outside.lam\" as column\n";
    folder.lamella_with_stdin(&["check", "-"], input).exits(2).says("standard input has no folder");
}

#[cfg(unix)]
#[test]
fn a_link_leads_to_no_file_outside() {
    let folder = Folder::new();
    folder.write("outside.lam", COLUMN);
    folder.write("study/inside.lam", COLUMN);
    let link = |target: &str, name: &str| {
        std::os::unix::fs::symlink(folder.path(target), folder.path(name)).expect("a link");
    };
    link("outside.lam", "study/out.lam");
    link("study/inside.lam", "study/in.lam");
    folder.write("study/scene.lam", "lamella 1\nuse \"out.lam\" as column\n");
    folder.lamella(&["check", "study/scene.lam"]).exits(2).says("[F106]").says("a link that leads out");
    folder.write("study/scene.lam", "lamella 1\nuse \"in.lam\" as column\n");
    folder.lamella(&["check", "study/scene.lam"]).exits(0);
    // A folder that is a link itself is the folder of its scenes.
    link("study", "linked");
    folder.lamella(&["check", "linked/scene.lam"]).exits(0);
}

/// Each of two used scenes is run by the sweep that is of it.
#[test]
fn a_sweep_runs_the_scene_that_it_is_of() {
    let folder = Folder::new();
    folder.write("coarse.lam", COLUMN);
    folder.write("fine.lam", COLUMN.replace("particles fluid 1000", "particles fluid 2000"));
    let scene = "lamella 1\nuse \"coarse.lam\" as coarse\nuse \"fine.lam\" as fine\n\
                 measure mass_coarse = mean(coarse.total.A)\nmeasure mass_fine = mean(fine.total.A)\n\
                 sweep one of coarse { step 1 s, 2 s }\nsweep two of fine { fine.D 1e-9 m^2/s, 2e-9 m^2/s }\n";
    folder.write("scene.lam", scene);
    folder.lamella(&["sweep", "scene.lam", "three"]).exits(2).says("[F120]").says("`one`, `two`");
    folder.lamella(&["sweep", "scene.lam", "--out", "both"]).exits(0).says("sweep `one`").says("sweep `two`");
    for name in ["one", "two"] {
        let path = folder.path(&format!("both/{name}/points.parquet"));
        assert_eq!(lamella::table::read::points(&path).map_or(0, |points| points.len()), 2);
    }
    for (name, particles, measure) in [("one", 1000, "mass_coarse"), ("two", 2000, "mass_fine")] {
        folder.lamella(&["sweep", "scene.lam", name, "--out", name, "-q"]).exits(0);
        let path = folder.path(&format!("{name}/points.parquet"));
        let points = lamella::table::read::points(&path).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(points.len(), 2);
        for point in &points {
            assert_eq!(point.particles, particles);
            assert_eq!(point.values.last().map(|it| it.name.as_str()), Some(measure));
        }
        folder.lamella(&["gather", name, "-q"]).exits(0);
        let out = format!("run-{name}");
        folder.lamella(&["run", "scene.lam", "--sweep", name, "--out", &out, "-q"]).exits(0);
        let run = folder.path(&format!("{out}/points.parquet"));
        let run = lamella::table::read::points(&run).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(run[0].particles, particles);
    }
    folder.lamella(&["plan", "scene.lam", "--sweep", "three"]).exits(2).says("no sweep `three`");
    folder.write("scene.lam", scene.replace("sweep two", "sweep one"));
    folder.lamella(&["check", "scene.lam"]).exits(2).says("two sweeps are called `one`");
}

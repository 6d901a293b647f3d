//! Sweeps as a user runs them: resumed, killed, damaged, cut into shards, and always the same tables.

mod durability;
mod experiments;
mod points;
#[path = "../cli/program.rs"]
mod program;
mod provenance;
mod same_bytes;
mod verified;

use program::Folder;

/// Trivial points: what is left is the cost of the sweep itself.
pub const SCENE: &str = r#"lamella 1
# a comment
param D  = 1e-9 m^2/s in 0 m^2/s .. 1 m^2/s "dispersion"
param c0 = 1 mol/m^3
let   w  = 0.5 m
species A "tracer"
domain line x = 0 m .. 1 m
boundary left, right reflect
dispersion D
average bins 4
initial A = if x < w then c0 else 0
particles fluid 100 stratified
run to 4 s, step 1 s
output profile A at t = 4 s on 4
output total   A every 2 s
reference exact for A = 0.5 * c0 * erfc((x - w) / (2*sqrt(D*t)))
measure err  = l2(profile.A - exact) / l2(exact)
measure leak = abs(mass_defect)
"#;

/// `SCENE` with a sweep.
pub fn scene_with(sweep: &str) -> String {
    format!("{SCENE}\nsweep study {{\n{sweep}\n}}\n")
}

/// The data files of a sweep's folder with their bytes; facts of the run stand in `points.parquet`, and
/// the journal is the memory of one history.
pub fn data_files(folder: &Folder, out: &str) -> Vec<(String, Vec<u8>)> {
    let inside = format!("{out}/");
    let names = folder.files().into_iter().filter(|name| name.starts_with(&inside));
    // The report shows times and the machine.
    let apart = ["/journal/", "/points.parquet", "/report", "/manifest.json", "/ro-crate-metadata.json"];
    let names = names.filter(|name| !apart.iter().any(|part| name.contains(part)));
    names
        .map(|name| {
            let bytes = std::fs::read(folder.path(&name)).expect("a file of the folder can be read");
            (name[inside.len()..].to_owned(), bytes)
        })
        .collect()
}

/// What of `points.parquet` must be the same for every history: identity, seeds, status and values.
pub fn facts(folder: &Folder, out: &str) -> Vec<String> {
    let path = folder.path(&format!("{out}/points.parquet"));
    let points = lamella::table::read::points(&path).unwrap_or_else(|error| panic!("{error}"));
    let fact = |point: &lamella::table::read::Point| {
        let values: Vec<String> =
            point.values.iter().map(|value| format!("{} = {:?}", value.name, value.value)).collect();
        format!(
            "{}/{} {} {} {:?} {} {} {:?}",
            point.point,
            point.replicate,
            point.key,
            point.seed,
            point.status,
            point.particles,
            point.step,
            values
        )
    };
    points.iter().map(fact).collect()
}

/// Holds that two folders have the same tables.
#[track_caller]
pub fn assert_same(folder: &Folder, a: &str, b: &str) {
    assert_eq!(facts(folder, a), facts(folder, b));
    let (first, second) = (data_files(folder, a), data_files(folder, b));
    let names = |files: &[(String, Vec<u8>)]| files.iter().map(|(name, _)| name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&first), names(&second));
    for ((name, a), (_, b)) in first.iter().zip(&second) {
        assert!(a == b, "{name} differs");
    }
}

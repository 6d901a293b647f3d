//! Solved flows that later runs find again.

use crate::program::Folder;

const SCENE: &str = r#"lamella 1
species A
domain rect x = 0 .. 200 m, y = 0 .. 100 m
boundary left inflow A = 1 mg/L
boundary right outflow
boundary bottom, top reflect
medium porosity 0.3
flow darcy {
  head left 2 m, right 1 m
  no_flow top, bottom
  conductivity lognormal(geometric_mean = 10 m/d, variance = 1, covariance = exponential(10 m))
  grid 200 x 100
}
dispersion longitudinal 1 m, transverse 0.1 m, molecular 1e-9 m^2/s
particles mass 500
run to 100 d, step 10 d
output map A on 10 x 5 at t = 100 d
"#;

fn tables(folder: &Folder, out: &str) -> Vec<u8> {
    std::fs::read(folder.path(&format!("{out}/map/part-0000.parquet"))).unwrap()
}

#[test]
fn with_and_without_a_kept_flow_there_are_the_same_bytes() {
    let folder = Folder::new();
    folder.write("a.lam", SCENE);
    folder.lamella(&["run", "a.lam", "--out", "none", "--no-cache"]).exits(0);
    assert!(!folder.path("none/cache").exists());
    folder.lamella(&["run", "a.lam", "--out", "kept"]).exits(0);
    let entries = || -> Vec<_> {
        std::fs::read_dir(folder.path("kept/cache")).unwrap().map(|it| it.unwrap().path()).collect()
    };
    let first = entries();
    assert_eq!(first.len(), 1);
    folder.lamella(&["run", "a.lam", "--out", "kept"]).exits(0);
    assert_eq!((tables(&folder, "none"), entries()), (tables(&folder, "kept"), first.clone()));
    folder.lamella(&["verify", "kept"]).exits(0).gives("the same bytes");
    folder.lamella(&["verify", "kept", "--no-cache"]).exits(0).gives("the same bytes");
    // A damaged entry is noticed and made again.
    let sound = std::fs::read(&first[0]).unwrap();
    let mut damaged = sound.clone();
    damaged[1000] ^= 1;
    std::fs::write(&first[0], &damaged).unwrap();
    folder.lamella(&["verify", "kept"]).exits(0).gives("the same bytes");
    assert!(std::fs::read(&first[0]).unwrap() == sound, "the entry is sound again");
    // Another flow takes the place of the one before.
    folder.write("a.lam", SCENE.replace("head left 2 m", "head left 3 m"));
    folder.lamella(&["run", "a.lam", "--out", "kept"]).exits(0);
    assert_ne!(entries(), first);
    assert_eq!(entries().len(), 1);
}

#[test]
fn a_sweep_keeps_its_flow_once() {
    let folder = Folder::new();
    // With the seed of the scene each point would have a field of its own.
    folder.write("a.lam", SCENE.replace("exponential(10 m)", "exponential(10 m), seed = 3"));
    folder.lamella(&["sweep", "a.lam", "--over", "step=5d,10d", "--out", "s"]).exits(0);
    assert_eq!(std::fs::read_dir(folder.path("s/cache")).unwrap().count(), 1);
    folder.lamella(&["verify", "s"]).exits(0);
    folder.lamella(&["sweep", "a.lam", "--over", "step=5d,10d", "--out", "t", "--no-cache"]).exits(0);
    assert!(!folder.path("t/cache").exists());
}
